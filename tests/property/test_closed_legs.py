"""Closed forms of legs with a ball at one end: random joints in random order, judged by following them from home.

Coordinates must put the platform where the pose says, by the legs' screws alone, and on the branch where Newton's
method arrives that follows them from the home pose. Poses that it reaches are reached, and others are not lost.
"""

from functools import cache

import numpy as np
import pytest

from kinetostat.kinematics.closing import leg_ends, platform_placement, squared_distance
from kinetostat.kinematics.closure import CLOSED_FORMS, NEWTON, solver_of, task_of
from kinetostat.kinematics.status import Status
from kinetostat.machine.column import column
from kinetostat.machine.loading import build
from kinetostat.machine.parameters import values, with_values

POSES = 40
ARMS = ("UP", "PU", "RU", "UR", "UP split", "RU split")
"""What comes before the ball; split universal joints are two revolutes that do not name the same point twice."""


def leg(arm, backwards, rng):
    """The joints of a leg with random points and axes; its ball is at the base if it is backwards."""
    base, middle, top = [-0.1, 0.05, 0.0], [0.1, -0.1, 0.3], [0.05, 0.1, 0.55]
    points = [np.array(point) + rng.uniform(-0.05, 0.05, 3) for point in (base, middle, top)]
    kinds, split = arm.split()[0], arm.endswith("split")
    joints = []
    for kind, point in zip(kinds, points, strict=False):
        axes = rng.normal(size=(2, 3))
        if kind == "U" and split:
            joints += [("revolute", point, {"axis": axes[0]}), ("revolute", point, {"axis": axes[1]})]
        elif kind == "U":
            joints.append(("universal", point, {"first_axis": axes[0], "second_axis": axes[1]}))
        else:
            joints.append(("prismatic" if kind == "P" else "revolute", point, {"axis": axes[0]}))
    if split:
        joints += [("revolute", points[2], {"axis": axis}) for axis in rng.permutation(np.eye(3))]
    else:
        joints.append(("spherical", points[2], {}))
    if backwards:
        flip = np.array([1.0, 1.0, -1.0])
        joints = [
            (kind, point * flip + [0, 0, 0.6], {name: axis * flip for name, axis in axes.items()})
            for kind, point, axes in reversed(joints)
        ]
    return joints


def machine(arm, backwards, seed):
    """A machine of one such leg, whose pose gives all coordinates."""
    joints = leg(arm, backwards, np.random.default_rng(seed))
    bodies = ["base", *(f"body {i}" for i in range(1, len(joints))), "platform"]
    written = [
        {"name": f"joint {i}", "type": kind, "joins": bodies[i : i + 2], "point": point.tolist()}
        | {name: axis.tolist() for name, axis in axes.items()}
        for i, (kind, point, axes) in enumerate(joints)
    ]
    pose = dict(zip("xyz", (0.0, 0.0, 0.6), strict=True)) | dict.fromkeys(("roll", "pitch", "yaw"), 0.0)
    tables = {"schema": 1, "name": arm, "family": "legs", "platform": {"point": [0.0, 0.0, 0.6]}, "pose": pose}
    return build({**tables, "legs": [{"name": "leg", "joints": written}]}, arm)


SEEDS = range(3)


@cache
def at_all_poses(arm, backwards):
    """The task of the machines of all seeds, each at its own poses, and what both solvers find for it.

    Rows [seeds * POSES] are solved one by one, and only the calls of NumPy serve them all.
    """
    machines = [machine(arm, backwards, seed) for seed in SEEDS]
    numbers = [values(each) for each in machines]
    columns = {path: np.repeat([each[path] for each in numbers], POSES) for path in numbers[0]}
    for name in ("x", "y", "z", "roll", "pitch", "yaw"):
        columns[f"pose.{name}"] = np.full(len(SEEDS) * POSES, 0.6 if name == "z" else 0.0)
    for seed in SEEDS:
        rng, rows = np.random.default_rng(seed + 10), slice(seed * POSES, (seed + 1) * POSES)
        size = rng.choice([0.02, 0.15, 0.6], POSES)
        for name in ("x", "y", "z", "roll", "pitch", "yaw"):
            columns[f"pose.{name}"][rows] += size * rng.uniform(-1, 1, POSES)
    task = task_of(with_values(machines[0], columns))
    assert solver_of(task) is CLOSED_FORMS
    with np.errstate(all="ignore"):
        return task, CLOSED_FORMS(task), CLOSED_FORMS.over_scalars(task.chains), NEWTON(task)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("arm", ARMS)
def test_closed_forms_of_legs_with_a_ball_are_what_newtons_method_follows(arm, backwards, seed):
    task, closed, inside, followed = at_all_poses(arm, backwards)
    rows = slice(seed * POSES, (seed + 1) * POSES)
    of_closed, status, of_followed = (np.asarray(joints.status)[rows] for joints in (closed, inside, followed))
    assert (of_closed == Status.OK)[of_followed == Status.OK].all()
    assert (of_followed != Status.OK)[status == Status.OUT_OF_REACH].all()
    assert (status == Status.OK).sum() >= (of_followed == Status.OK).sum() > 0
    good = np.flatnonzero(status == Status.OK)
    (end,) = leg_ends(task.chains, [column(np.asarray(q)) for q in closed.coordinates])
    distance = squared_distance(end.platform, platform_placement(task.chains), task.chains.length)
    assert np.asarray(distance)[rows][good].max() < 1e-22
    (same,) = leg_ends(task.chains, [column(np.asarray(q)) for q in followed.coordinates])
    both = good[of_followed[good] == Status.OK]
    for ours, theirs in zip(end.movers, same.movers, strict=True):
        axes = [
            [np.broadcast_to(np.asarray(c), len(task.goal))[rows] for c in joint.axis.components()]
            for joint in (ours, theirs)
        ]
        sines = np.linalg.norm(np.cross(*axes, axis=0), axis=0)[both]  # both turns of a ball are one posture
        assert np.median(sines) < 1e-12
        assert sines.max() < 1e-7

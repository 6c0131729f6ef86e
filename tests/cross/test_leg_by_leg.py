"""Machines written leg by leg against their families: joints at one pose as the home pose, compared at another.

Families know their kinematics in closed form; written machines are closed by Newton's method or by a leg's own closed
form. Nothing but points, axes and stiffnesses passes from the one to the other.
"""

import json
import math

import numpy as np
import pytest

from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.closure import CLOSED_FORMS, NEWTON, solve_joints, task_of
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.leg import Joint, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.loading import as_toml, build, load
from kinetostat.machine.parameters import values, with_values
from kinetostat.spec import document
from machines import load_without_limits
from numeric import array, assert_blocks_close, matrix

SAME = 1e-9
"""Newton's method closes the legs to some rounding units; solving W multiplies that by its condition."""


def vector(v):
    return json.dumps([float(c) for c in v.components()])


def joint_line(number, element, bodies):
    """One joint of a leg as a file has it."""
    freedom = element.joint if isinstance(element, Spring) else element
    if isinstance(element, Parallelogram):
        bar = "rigid" if math.isinf(element.bar) else float(element.bar)
        what = f'type = "parallelogram", point = {vector(element.near)}, far = {vector(element.far)}, '
        what += f"axis = {vector(element.side)}, width = {element.width!r}, bar_stiffness = {json.dumps(bar)}"
    elif freedom.point is None:
        what = f'type = "prismatic", point = [0, 0, 0], axis = {vector(freedom.axis)}'
    else:
        what = f'type = "revolute", point = {vector(freedom.point)}, axis = {vector(freedom.axis)}'
    if isinstance(element, Spring):
        what += f", actuated = true, stiffness = {float(element.stiffness)!r}"
    return f'{{ name = "joint {number}", joins = {json.dumps(bodies)}, {what} }}'


def written(machine, pose):
    """The machine at its pose, leg by leg: that pose is the home pose; only joints and actuators, links are rigid."""
    configuration = machine.configure()
    space = "planar" if configuration.plane else "spatial"
    lines = ["schema = 1", f'name = "{machine.name}"', 'family = "legs"', f'space = "{space}"', "[platform]"]
    lines += [f"point = {vector(configuration.platform.translation)}", "[pose]"]
    lines += [f"{name} = {value!r}" for name, value in pose.items()]
    for leg in configuration.legs:
        moving = [
            e for e in leg.chain if isinstance(e, Joint | Parallelogram) or (isinstance(e, Spring) and e.actuated)
        ]
        bodies = ["base", *(f"body {i}" for i in range(1, len(moving))), "platform"]
        joints = [joint_line(i, e, bodies[i : i + 2]) for i, e in enumerate(moving)]
        lines += ["[[legs]]", f'name = "{leg.name}"', "joints = [", *(f"  {line}," for line in joints), "]"]
    return build(document.parse("\n".join(lines), "written"), "written")


RIGID_LINKS = {
    "hexapod": {},
    "planar-3rpr": {"stiffness.leg_axial": math.inf},
    "delta": {"stiffness.arm_bending": math.inf, "stiffness.arm_torsion": math.inf},
    "orthoglide": {"stiffness.foot_bending": math.inf, "stiffness.foot_torsion": math.inf},
}


def known(name):
    """A bundled machine without what a file of joints and actuators cannot say."""
    machine = load_without_limits(name)
    return with_values(machine, {path: k for path, k in RIGID_LINKS[name].items() if path in values(machine)})


def moved(machine, amount):
    """The machine at another pose: every coordinate some m or rad away."""
    pose = {path: value for path, value in values(machine).items() if path.startswith("pose.")}
    steps = dict(zip(pose, np.resize([0.7, -0.4, 0.5, 0.3, -0.6, 0.2], len(pose)), strict=True))
    return with_values(machine, {path: value + amount * steps[path] for path, value in pose.items()})


def pose_of(configuration, home):
    """Coordinates of a placement as a written machine takes them: P, and Q against the home pose."""
    turn = matrix(configuration.platform.rotation) @ matrix(home.platform.rotation).T
    point = configuration.platform.translation
    angles = {
        "roll": math.atan2(turn[2, 1], turn[2, 2]),
        "pitch": math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0])),
        "yaw": math.atan2(turn[1, 0], turn[0, 0]),
    }
    return {"x": float(point.x), "y": float(point.y), "z": float(point.z), **angles}


TASKS = {
    "hexapod": ("x", "y", "z", "roll", "pitch", "yaw"),
    "planar-3rpr": ("x", "y", "yaw"),
    "delta": ("x", "y", "z"),
    "orthoglide": ("x", "y", "z"),
}


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("amount", [0.0, 0.02, -0.05])
def test_a_machine_written_leg_by_leg_is_the_machine_of_the_family(name, amount):
    machine = known(name)
    there = moved(machine, amount * 0.2 if name == "hexapod" else amount)
    pose = pose_of(there.configure(), machine.configure())
    other = written(machine, {coordinate: pose[coordinate] for coordinate in TASKS[name]})
    found, expected = respond(other), respond(there)
    assert found.status == expected.status == Status.OK
    assert_blocks_close(array(found.compliance), array(expected.compliance), SAME)
    assert_blocks_close(array(found.stiffness), array(expected.stiffness), SAME)
    reached = pose_of(found.configuration, other.configure([0.0] * other.chains().size))
    assert np.allclose([*reached.values()], [*pose.values()], atol=1e-12)


@pytest.mark.parametrize("name", ["tripteron", "written delta", "written hexapod"])
def test_batches_are_the_single_poses(name):
    """Closed forms in machine code, closed forms in NumPy and Newton's method for columns of the kernel agree."""
    base = name.removeprefix("written ")
    machine = load(base)
    if base != name:
        home = pose_of(known(base).configure(), known(base).configure())
        machine = written(known(base), {c: home[c] for c in TASKS[base]})
    rng = np.random.default_rng(2)
    paths = [path for path in values(machine) if path.startswith("pose.")]
    count = 20_000 if base == name else 40
    size = 0.3 if base == name else 0.01
    columns = {path: values(machine)[path] + rng.uniform(-size, size, count) for path in paths}
    names = [*GROUPS["compliance"], *GROUPS["stiffness"]]
    found = evaluate(machine, PointTable(columns), names)
    assert (found.status == Status.OK).all()
    for n in (0, count // 2, count - 1):
        one = respond(with_values(machine, {path: float(column[n]) for path, column in columns.items()}))
        expected = [*one.compliance.diagonal(), *one.stiffness.diagonal()]
        assert np.allclose([found.values[name][n] for name in names], expected, rtol=1e-9)


def test_the_closed_form_of_a_leg_is_what_newton_finds():
    machine = load("tripteron", ["pose.x=0.31", "pose.y=0.82", "pose.z=0.17"])
    joints = CLOSED_FORMS.over_scalars(machine.chains())
    angles = [a if isinstance(a, float) else math.atan2(a.sine, a.cosine) for a in joints.coordinates]
    away = load("tripteron", ["pose.x=0.31", "pose.y=0.82", "pose.z=0.17", "pose.roll=0"])
    assert joints.status == Status.OK
    assert np.allclose(angles, solve_joints(away).coordinates, atol=1e-12)
    assert np.allclose(angles, NEWTON(task_of(machine)).coordinates, atol=1e-12)


def test_dependent_coordinates_are_solved_for_and_checked():
    free = load("tripteron", ["pose.x=0.4"])
    assert np.allclose(pose_of(free.configure(solve_joints(free).coordinates), free.configure([0.0] * 12))["roll"], 0.0)
    assert solve_joints(load("tripteron", ["pose.roll=0"])).status == Status.OK
    assert solve_joints(load("tripteron", ['pose.roll="1 deg"'])).status == Status.OUT_OF_REACH


def test_the_file_that_is_written_back_is_the_same_machine():
    machine = load("tripteron", ['legs.z.slide.stiffness="3 N/um"', "pose.x=0.3"])
    text = as_toml(machine)
    again = build(document.parse(text, "again"), "again")
    assert as_toml(again) == text
    assert np.array_equal(array(respond(again).compliance), array(respond(machine).compliance))

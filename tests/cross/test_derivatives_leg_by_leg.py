"""Derivatives where joints follow by Newton's method, against families that place the same joints in closed form."""

import numpy as np
import pytest
from test_leg_by_leg import TASKS, known, moved, pose_of, written

from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.closure import CLOSED_FORMS, solver_of, task_of
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import values, with_values

SAME = 1e-8
"""Of an index: Newton's method leaves some rounding units; W and the joints' equations multiply them by a condition."""
ROUNDED = 1e-30
"""What rounding leaves of a compliance that is zero."""


def shares(machine, names, paths):
    """Change of each index per m of the pose, or per whole of a stiffness, and the indices."""
    held = values(machine)
    found = evaluate_gradient(machine, PointTable({path: np.array([held[path]]) for path in paths}), names, paths)
    assert found.status[0] == 0
    units = np.array([1.0 if path.startswith("pose.") else held[path] for path in paths])
    return found.gradients[:, :, 0] * units, found.values


def assert_same(ours, theirs):
    allowed = SAME * np.maximum(np.abs(theirs[0]).max(axis=1, keepdims=True), np.abs(theirs[1])) + ROUNDED
    assert (np.abs(ours[0] - theirs[0]) <= allowed).all()


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("amount", [0.0, -0.05])
def test_along_the_pose_and_by_the_actuators(name, amount):
    machine = known(name)
    home, there = machine.configure(), moved(machine, amount)
    tasks, pose = TASKS[name], pose_of(there.configure(), home)
    file = written(machine, {task: pose_of(home, home)[task] for task in tasks})
    file = with_values(file, {f"pose.{task}": pose[task] for task in tasks})
    names = [f"compliance_{component}" for component in machine.family.component_names]
    straight = [f"pose.{task}" for task in tasks if task in "xyz"]
    assert_same(shares(file, names, straight), shares(there, names, straight))
    softer = [path for path in values(file) if path.endswith(".stiffness")]
    actuators = [path for path in values(machine) if path.startswith("stiffness.actuator.")]
    assert_same(shares(file, names, softer), shares(there, names, actuators))


def turned(machine, turn):
    """The machine turned about the base's z axis by an angle of this cosine and sine, at its home pose."""
    numbers = values(machine)
    vectors = {path[:-2] for path in numbers if path.startswith(("legs.", "platform.point")) and path[-2:] == ".0"}
    changed = {}
    for name in vectors:
        x, y = numbers[f"{name}.0"], numbers[f"{name}.1"]
        changed |= {f"{name}.0": turn[0] * x - turn[1] * y, f"{name}.1": turn[1] * x + turn[0] * y}
    changed |= {"pose.x": changed["platform.point.0"], "pose.y": changed["platform.point.1"]}
    return with_values(machine, {**changed, "pose.z": numbers["platform.point.2"]})


def test_machines_of_one_plan_are_judged_by_their_own_numbers():
    """Closed forms hold for a machine whose axes are parallel, not for one of the same form where an axis tilts.

    At the home pose the legs close in either, so that only derivatives tell the difference.
    """
    parallel, axis = turned(load("tripteron"), (0.6, 0.8)), "legs.x.elbow.axis"
    longer = {f"{axis}.{k}": 1.7 * values(parallel)[f"{axis}.{k}"] for k in (0, 1)}
    parallel = with_values(parallel, longer)
    tilted = with_values(parallel, {f"{axis}.1": 1.1 * longer[f"{axis}.1"]})
    assert parallel.family is tilted.family
    assert solver_of(task_of(tilted)) is CLOSED_FORMS
    points = PointTable({f"pose.{c}": np.array([values(parallel)[f"pose.{c}"]]) for c in "xyz"})
    for machine in (parallel, tilted):
        found, expected = (
            evaluate_gradient(machine, points, "compliance_x", points.paths, repeated=native)
            for native in (True, False)
        )
        np.testing.assert_allclose(found.gradients, expected.gradients, rtol=1e-6)

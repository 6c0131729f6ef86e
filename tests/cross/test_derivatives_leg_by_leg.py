"""Derivatives where joints follow by Newton's method, against families that place the same joints in closed form."""

import numpy as np
import pytest
from test_leg_by_leg import TASKS, known, moved, pose_of, written

from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import Table
from kinetostat.machine.parameters import values, with_values

SAME = 1e-8
"""Of an index: Newton's method leaves some rounding units; W and the joints' equations multiply them by a condition."""
ROUNDED = 1e-30
"""What rounding leaves of a compliance that is zero."""


def shares(machine, names, paths):
    """Change of each index per m of the pose, or per whole of a stiffness, and the indices."""
    held = values(machine)
    found = evaluate_gradient(machine, Table({path: np.array([held[path]]) for path in paths}), names, paths)
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

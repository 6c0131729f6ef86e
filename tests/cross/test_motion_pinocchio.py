"""Forces of drives along random motions, against Pinocchio: a hexapod of telescopes, and a Delta with its bars.

Pinocchio is given the legs as open trees, each on its own, and the platform as a rigid body. Trees are closed by
Newton's method on their ends; their rates and accelerations follow from those of the platform by Pinocchio's Jacobians.
What remains, forces on the platform and of the drives, is a linear equation.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from kinetostat.equilibrium.state import state_of
from kinetostat.machine.loading import load
from kinetostat.machine.loads import located_members
from kinetostat.machine.parameters import with_values
from kinetostat.studies.dynamics import dynamics
from telescopes import CYLINDER, GRAVITY, INERTIA, LEAD, ROD, ROTOR, TOOL, axes, document, ends, telescopes

pin = pytest.importorskip("pinocchio")
AGREED = 1e-8
"""Of the largest force; the largest found is 5e-15."""
NAMES = ("x", "y", "z", "roll", "pitch", "yaw")
SETTLED = 1e-14
IN_PLACE = pin.SE3.Identity()
ALONG_BASE = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass
class Tree:
    """A leg: its model, whose first or last coordinate is its drive, and its ends with where they meet the platform."""

    model: object
    drive: int
    frames: list
    points: list  # from P at the home pose


def tensor(numbers):
    xx, yy, zz, xy, xz, yz = numbers
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def add_end(model, joint, at):
    return model.addFrame(pin.Frame(f"end {joint}", joint, 0, pin.SE3(np.eye(3), at), pin.FrameType.OP_FRAME))


def telescope(leg, home):
    """A universal joint, a slide with its rotor, and both bodies; in base axes at the home pose."""
    first, last, along = ends(leg)
    model = pin.Model()
    one, other = axes(along)
    joint = model.addJoint(0, pin.JointModelRevoluteUnaligned(one), pin.SE3(np.eye(3), first), "first")
    joint = model.addJoint(joint, pin.JointModelRevoluteUnaligned(other), IN_PLACE, "second")
    slide = model.addJoint(joint, pin.JointModelPrismaticUnaligned(along), IN_PLACE, "slide")
    model.appendBodyToJoint(joint, pin.Inertia(CYLINDER[0], CYLINDER[1] * along, tensor(INERTIA)), IN_PLACE)
    model.appendBodyToJoint(slide, pin.Inertia(ROD[0], last - first + ROD[1] * along, tensor(INERTIA)), IN_PLACE)
    model.armature = np.array([0.0, 0.0, ROTOR * (2.0 * np.pi / LEAD) ** 2])
    return Tree(model, 2, [add_end(model, slide, last - first)], [last - home])


def thin(mass, start, end):
    """A thin rod from one point to another one, seen from a frame at the first point given."""
    half = 0.5 * (end - start)
    return pin.Inertia(mass, half, mass / 3.0 * (half @ half * np.eye(3) - np.outer(half, half)))


def arm_with_bars(axis, arm, bars, ratio, home):
    """A crank with its rotor, and on it two thin bars, each on a universal joint: no thin bar feels that it spins."""
    model = pin.Model()
    mass, start, elbow = arm
    crank = model.addJoint(0, pin.JointModelRevoluteUnaligned(axis), pin.SE3(np.eye(3), start), "crank")
    model.appendBodyToJoint(crank, thin(mass, start, elbow), IN_PLACE)
    frames, points = [], []
    for number, (weight, first, last) in enumerate(bars):
        one, other = axes((last - first) / np.linalg.norm(last - first))
        at = pin.SE3(np.eye(3), first - start)
        joint = model.addJoint(crank, pin.JointModelRevoluteUnaligned(one), at, f"first {number}")
        joint = model.addJoint(joint, pin.JointModelRevoluteUnaligned(other), IN_PLACE, f"second {number}")
        model.appendBodyToJoint(joint, thin(weight, first, last), IN_PLACE)
        frames.append(add_end(model, joint, last - first))
        points.append(last - home)
    model.armature = np.array([ROTOR * ratio**2, 0.0, 0.0, 0.0, 0.0])
    return Tree(model, 0, frames, points)


def turned(roll, pitch, yaw):
    (a, b, c), (d, e, f) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [c * b, c * e * d - f * a, c * e * a + f * d],
            [f * b, f * e * d + c * a, f * e * a - c * d],
            [-e, b * d, b * a],
        ]
    )


def turning(pose, rates, gains):
    """Turn, angular velocity and acceleration of the platform by those of roll, pitch and yaw."""
    (roll, pitch, yaw), change, gain = pose[3:], rates[3:], gains[3:]
    ax = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)])
    ay, az = np.array([-np.sin(yaw), np.cos(yaw), 0.0]), np.array([0.0, 0.0, 1.0])
    spin = ax * change[0] + ay * change[1] + az * change[2]
    lag = np.cross(az * change[2] + ay * change[1], ax) * change[0] + np.cross(az * change[2], ay) * change[1]
    return turned(roll, pitch, yaw), spin, ax * gain[0] + ay * gain[1] + az * gain[2] + lag


def close(tree, data, targets):
    """Coordinates at which the ends of a tree are at their targets."""
    q = np.zeros(tree.model.nq)
    for _ in range(20):
        pin.framesForwardKinematics(tree.model, data, q)
        gap = np.concatenate([t - data.oMf[f].translation for t, f in zip(targets, tree.frames, strict=True)])
        step = np.linalg.lstsq(jacobian_of(tree, data, q), gap, rcond=None)[0]
        q = q + step
        if np.abs(step).max() < SETTLED:
            break
    assert np.abs(gap).max() < 1e-12
    return q


def jacobian_of(tree, data, q):
    return np.vstack([pin.computeFrameJacobian(tree.model, data, q, f, ALONG_BASE)[:3] for f in tree.frames])


def forces_of_drives(trees: list, pose, rates, gains, tool=TOOL):
    """Forces of the drives by Pinocchio, positive along the coordinates of the trees: N, or N·m of cranks."""
    turn, spin, spun = turning(pose, rates, gains)
    centre = turn @ np.array(tool["centre_of_mass"])
    force = tool["mass"] * (gains[:3] + np.cross(spun, centre) + np.cross(spin, np.cross(spin, centre)) - GRAVITY)
    inertia = turn @ tensor(tool["inertia"]) @ turn.T
    right = [force, np.cross(centre, force) + inertia @ spun + np.cross(spin, inertia @ spin)]
    held, inner, driven = [], [], []
    for tree in trees:
        tree.model.gravity.linear[:] = GRAVITY
        data, arms = tree.model.createData(), [turn @ point for point in tree.points]
        q = close(tree, data, [pose[:3] + arm for arm in arms])
        jacobian = jacobian_of(tree, data, q)
        speeds = np.concatenate([rates[:3] + np.cross(spin, arm) for arm in arms])
        wanted = [gains[:3] + np.cross(spun, arm) + np.cross(spin, np.cross(spin, arm)) for arm in arms]
        v = np.linalg.lstsq(jacobian, speeds, rcond=None)[0]
        pin.forwardKinematics(tree.model, data, q, v, np.zeros(tree.model.nv))
        pin.updateFramePlacements(tree.model, data)
        drift = [pin.getFrameClassicalAcceleration(tree.model, data, f, ALONG_BASE).linear for f in tree.frames]
        a = np.linalg.lstsq(jacobian, np.concatenate(wanted) - np.concatenate(drift), rcond=None)[0]
        assert np.abs(jacobian @ v - speeds).max() < 1e-12
        right.append(pin.rnea(tree.model, data, q, v, a))  # with the rotors
        moments = [np.cross(arm, np.eye(3)).T for arm in arms]
        held.append(np.vstack([np.hstack([np.eye(3)] * len(arms)), np.hstack(moments)]))
        inner.append(-jacobian.T)
        driven.append(np.eye(tree.model.nv)[:, [tree.drive]])
    rows, columns = 6 + sum(len(r) for r in inner), sum(r.shape[1] for r in inner) + len(trees)
    system, row, column = np.zeros((rows, columns)), 6, 0
    for number, (above, block, drive) in enumerate(zip(held, inner, driven, strict=True)):
        at, across = slice(row, row + len(block)), slice(column, column + block.shape[1])
        system[:6, across], system[at, across], system[at, [columns - len(trees) + number]] = above, block, drive
        row, column = at.stop, across.stop
    forces, *_ = np.linalg.lstsq(system, np.concatenate(right), rcond=None)
    assert np.abs(system @ forces - np.concatenate(right)).max() < 1e-9 * np.abs(forces).max()
    return forces[columns - len(trees) :]


def agree(machine, home, trees, tool=TOOL, senses: Callable = lambda equations: np.ones(len(equations.drives))):
    """Compare the forces at five random poses of a random motion."""
    rng, size = np.random.default_rng(11), len(dynamics(machine).coordinates)
    for _ in range(5):
        pose, rates, gains = home + 0.0, np.zeros(6), np.zeros(6)
        pose[:size] += rng.uniform(-0.01, 0.01, size)
        rates[:size], gains[:size] = rng.normal(0.0, [[0.1], [1.0]], (2, size))
        there = with_values(machine, {f"pose.{n}": float(c) for n, c in zip(NAMES[:size], pose, strict=False)})
        equations = dynamics(there)
        parts = equations.forces(rates[:size].tolist(), gains[:size].tolist())
        ours = (parts["weight"] + parts["inertia"]) * senses(equations)
        theirs = forces_of_drives(trees, pose, rates, gains, tool)
        assert ours == pytest.approx(theirs, abs=AGREED * np.abs(theirs).max())


def test_telescopes_do_what_pinocchio_asks_for():
    home = np.array([0.0, 0.0, 0.135, 0.0, 0.0, 0.0])
    agree(telescopes(), home, [telescope(leg, home[:3]) for leg in document()["legs"]])


def test_a_delta_does_what_pinocchio_asks_for():
    """Its platform does not turn; each of its bars is a thin rod between two balls."""
    tool = {"mass": 3.0, "inertia": [0.0] * 6, "centre_of_mass": [0.0, 0.0, 0.0]}
    machine = load(
        "delta",
        [
            "tool.mass=3 kg",
            "drives.rotor_inertia=1e-4",
            "drives.ratio=5",
            f"load.gravity={GRAVITY}",
            "linear_density.arms=2 kg/m",
            "linear_density.bars=2 kg/m",
        ],
    )
    state = state_of(machine)
    table = machine.tables["pose"]
    home = np.array([table.x, table.y, table.z, 0.0, 0.0, 0.0], dtype=float)
    parts = [
        (float(part.mass), *(np.array(p.components(), dtype=float) for _, p in part.ends()))
        for part in located_members(machine, state.configuration, None)
    ]
    arms, bars = parts[:3], [parts[3 + 2 * k : 5 + 2 * k] for k in range(3)]
    cranks = [spring.joint.axis for leg in state.configuration.legs for spring in leg.springs if spring.actuated]
    trees = [
        arm_with_bars(np.array(axis.components(), dtype=float), arm, pair, 5.0, home[:3])
        for axis, arm, pair in zip(cranks, arms, bars, strict=True)
    ]
    agree(machine, home, trees, tool, lambda equations: equations.senses)

"""The posture of an arm with one joint too many: joints are nearest to home, in all axes and units."""

import copy
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from kinetostat import build
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.parameters import values
from kinetostat.numerics.motions import skew_of

TEXT = (Path(__file__).parents[1] / "cases/seven-joint-arm.toml").read_text("utf-8")
SLIDE = 2
POSE = {"x": 0.44, "y": 0.12, "z": 0.57, "roll": 0.12, "pitch": -0.07, "yaw": 0.21}


def document():
    result = tomllib.loads(TEXT)
    result["platform"]["point"] = [0.42, 0.05, 0.61]
    result["pose"] = dict(POSE)
    return result


def turned(turn):
    """The arm in other axes of the base, its pose with it."""
    result = copy.deepcopy(document())
    result["platform"]["point"] = (turn @ result["platform"]["point"]).tolist()
    for joint in result["legs"][0]["joints"]:
        joint["point"], joint["axis"] = (turn @ joint["point"]).tolist(), (turn @ joint["axis"]).tolist()
    there = Rotation.from_euler("xyz", [POSE["roll"], POSE["pitch"], POSE["yaw"]]).as_matrix()
    roll, pitch, yaw = Rotation.from_matrix(turn @ there @ turn.T).as_euler("xyz")
    x, y, z = turn @ [POSE["x"], POSE["y"], POSE["z"]]
    result["pose"] = {"x": x, "y": y, "z": z, "roll": roll, "pitch": pitch, "yaw": yaw}
    return result


def larger(factor):
    """The arm in another unit of length."""
    result = copy.deepcopy(document())
    result["platform"]["point"] = [factor * c for c in result["platform"]["point"]]
    for joint in result["legs"][0]["joints"]:
        joint["point"] = [factor * c for c in joint["point"]]
        joint["stiffness"] *= 1.0 if joint["type"] == "prismatic" else factor**2
    result["pose"] = {name: value * (factor if name in "xyz" else 1.0) for name, value in POSE.items()}
    return result


def platform(arm, coordinates):
    """Where matrix exponentials of the joints' screws take the platform [4 x 4]."""
    motion = np.eye(4)
    for joint, amount in zip(arm["legs"][0]["joints"], coordinates, strict=True):
        axis, point = np.array(joint["axis"]) / np.linalg.norm(joint["axis"]), np.array(joint["point"])
        screw = np.zeros((4, 4))
        if joint["type"] == "prismatic":
            screw[:3, 3] = axis
        else:
            screw[:3, :3], screw[:3, 3] = skew_of(axis[None])[0], -np.cross(axis, point)
        motion = motion @ expm(screw * amount)
    home = np.eye(4)
    home[:3, 3] = arm["platform"]["point"]
    return motion @ home


def test_joints_are_nearest_to_home_of_all_that_reach_the_pose():
    """As SciPy's minimum under constraints finds them from another posture, slides in units of the machine's length."""
    arm, machine = document(), build(document())
    units = np.where(np.arange(7) == SLIDE, float(machine.chains().length), 1.0)
    wanted = Rotation.from_euler("xyz", [POSE["roll"], POSE["pitch"], POSE["yaw"]]).as_matrix()

    def gap(unknowns):
        there = platform(arm, unknowns * units)
        turn = Rotation.from_matrix(there[:3, :3] @ wanted.T).as_rotvec()
        return np.concatenate([turn, there[:3, 3] - [POSE["x"], POSE["y"], POSE["z"]]])

    found = minimize(
        lambda unknowns: unknowns @ unknowns,
        np.full(7, 0.2),
        method="SLSQP",
        constraints={"type": "eq", "fun": gap},
        options={"ftol": 1e-15, "maxiter": 500},
    )
    assert np.abs(gap(found.x)).max() < 1e-8
    assert np.array(solve_joints(machine).coordinates) / units == pytest.approx(found.x, abs=1e-5)


@pytest.mark.parametrize("angle", [0.3, 1.5, 2.9])
def test_axes_of_the_base_change_neither_the_posture_nor_the_compliance(angle):
    turn = Rotation.from_rotvec(angle * np.array([0.6, -0.64, 0.48])).as_matrix()
    first, second = build(document()), build(turned(turn))
    assert np.allclose(solve_joints(second).coordinates, solve_joints(first).coordinates, rtol=0.0, atol=1e-12)
    both = np.kron(np.eye(2), turn)
    expected, other = (np.array(respond(machine).compliance.rows()) for machine in (first, second))
    assert np.allclose(both.T @ other @ both, expected, rtol=0.0, atol=1e-12 * abs(expected).max())


@pytest.mark.parametrize("factor", [1e-3, 10.0, 1e3])
def test_units_of_length_do_not_change_the_posture(factor):
    units = np.where(np.arange(7) == SLIDE, factor, 1.0)
    expected = np.array(solve_joints(build(document())).coordinates)
    assert np.allclose(solve_joints(build(larger(factor))).coordinates / units, expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    "path", ["pose.x", "pose.yaw", "legs.arm.elbow.point.0", "legs.arm.quill.axis.0", "platform.point.2"]
)
def test_derivatives_follow_the_posture(path):
    """As differences do, whose error is 1e-10: a motion of least norm alone would be wrong in the first figures."""
    machine, step = build(document()), 1e-5
    here = values(machine)[path]
    names = ["compliance_x", "compliance_ry"]
    exact = evaluate_gradient(machine, PointTable({path: np.array([here])}), names, [path]).gradients[:, 0, 0]
    points = here + step * np.array([-2.0, -1.0, 1.0, 2.0])
    around = evaluate_gradient(machine, PointTable({path: points}), names, []).values
    expected = around @ np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * step)
    assert exact == pytest.approx(expected, rel=1e-7)

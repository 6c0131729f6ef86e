"""Equations 1 to 32 of the paper, tested by a second route: its own matrices A, B, J and J' in NumPy against (W, G)."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.arrays import AnyArray, Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import flexible_stiffness
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values, with_values
from kinetostat.studies.printed_numbers import ACTUATOR_STIFFNESS, MACHINE

MOTION_STEP = 1e-6
"""Step of central differences, rad and m: their error is about step² + rounding/step."""
STEP_ERROR = 1e-8
"""Tolerance of a central difference with that step."""
ROUND_OFF = 1e-11
"""Tolerance of two algebraic routes in float64 at condition numbers near 100."""
LOAD = np.array([0.3, -0.2, 0.5, 4.0, -3.0, 7.0])
"""A wrench on the tool, N·m and N: any will do that no symmetry of the machine takes from an actuator."""
TASK_RATES = {"pose.x": 0.02, "pose.z": -0.03, "pose.theta5": 0.05, "pose.theta6": -0.04}
"""Rates of the task coordinates, m/s and rad/s: any will do that move all of them."""
PASSIVE_STIFFNESS = 1000.0
"""Stiffness of both virtual joints of the passive leg, N·m/rad, in the paper's machine as its file has it."""


@dataclass(frozen=True)
class EquationCheck:
    """One equation of the paper, tested numerically.

    Attributes:
        equation: its number(s).
        statement: the statement that is tested, in our words.
        residual: relative difference between both sides, which should vanish.
        tolerance: greatest residual with which the equation holds.
    """

    equation: str
    statement: str
    residual: float
    tolerance: float

    @property
    def holds(self) -> bool:
        """Whether the residual is within the tolerance."""
        return self.residual <= self.tolerance


def derivation() -> Iterator[EquationCheck]:
    """The chain of equations at the reference configuration, in the paper's order."""
    machine = load(MACHINE)
    response = respond(machine)
    yield from _velocity_checks(machine, response)
    yield from _rigid_checks(response)
    yield from _flexible_checks(response)


def _velocity_checks(machine: Machine, response: Response) -> Iterator[EquationCheck]:
    """Equations 1 to 7, by central differences."""
    matrices, rates = _matrices(response), _rates(machine)
    gap = _gap(matrices.a @ rates.twist, matrices.b @ rates.legs)
    yield EquationCheck("1-4", "A t = B rho', leg rates by differences", gap, STEP_ERROR)
    gap = _gap(matrices.j @ rates.passive_joints, rates.twist)
    yield EquationCheck("7", "t = J theta', passive joint rates by differences", gap, STEP_ERROR)


def _rigid_checks(response: Response) -> Iterator[EquationCheck]:
    """Equations 5 to 22: statics, and the compliance of the machine with a rigid passive leg."""
    a, b, j, _ = _matrices(response)
    aj = a @ j
    forces = b.T @ np.linalg.solve(aj.T, j.T @ LOAD)
    gap = _gap(forces @ np.linalg.solve(b, aj), LOAD @ j)
    yield EquationCheck("5-11", "actuator forces do the work of the wrench on every feasible twist", gap, ROUND_OFF)
    actuator = np.eye(4) / ACTUATOR_STIFFNESS
    inner = np.linalg.solve(aj, b)
    rigid = j @ inner @ actuator @ inner.T @ j.T
    computed = _entries(respond(load(MACHINE, ["stiffness.passive_links=rigid"])).compliance)
    gap = _gap(rigid, computed)
    yield EquationCheck("12-21", "C of the rigid machine equals W^-T G W^-1", gap, ROUND_OFF)
    gap = _gap(a @ (computed @ LOAD), b @ actuator @ forces)
    yield EquationCheck("13, 16, 22", "C w deflects the actuators by C tau", gap, ROUND_OFF)
    excess = _rank_excess(np.linalg.eigvalsh(computed), 4)
    yield EquationCheck("21", "rigid machine: C has rank 4, no eigenvalue below 0", excess, ROUND_OFF)


def _flexible_checks(response: Response) -> Iterator[EquationCheck]:
    """Equations 22 to 32: the stiffness of the machine with its flexible passive leg."""
    a, b, j, virtual = _matrices(response)
    joints_by_twist = np.linalg.inv(np.hstack([j, virtual]))
    springs = np.diag([0.0] * 4 + 2 * [PASSIVE_STIFFNESS])
    legs_by_twist = np.linalg.inv(b) @ a
    of_passive_leg = joints_by_twist.T @ springs @ joints_by_twist
    stiffness = of_passive_leg + ACTUATOR_STIFFNESS * legs_by_twist.T @ legs_by_twist
    k, c = _entries(response.stiffness), _entries(response.compliance)
    gap = _gap(stiffness, k)
    yield EquationCheck("23-32", "K of the flexible machine equals sum of W G^-1 W^T", gap, ROUND_OFF)
    gap = _gap(_entries(flexible_stiffness(response.legs)), k)
    yield EquationCheck("32", "K by springs equals K by legs", gap, ROUND_OFF)
    gap = float(np.abs(k @ c - np.eye(6)).max())
    yield EquationCheck("22, 31", "K C = 1 for the flexible machine", gap, ROUND_OFF)


def _entries(matrix: Symmetric6) -> Array:
    return np.array(matrix.rows())


def _gap(actual: Array, expected: Array) -> float:
    """The greatest difference of two arrays as a share of the greatest entry of the second one."""
    return float(np.abs(actual - expected).max() / np.abs(expected).max())


def _rank_excess(eigenvalues: AnyArray, rank: int) -> float:
    """Zero where just `rank` eigenvalues are positive and the rest vanish beside them."""
    ordered = np.sort(eigenvalues)
    rest, least = np.abs(ordered[: 6 - rank]).max(), ordered[6 - rank]
    return float(rest / ordered[-1]) if least > 0 else math.inf


class _Matrices(NamedTuple):
    """The matrices of the paper at a pose.

    Attributes:
        a, b: A [4 x 6] and B [4 x 4] of eqs. 3 and 4: A times the twist is B times the rates of the legs.
        j: J of eq. 7 [6 x 4], twists of the passive joints.
        virtual: columns of J' for the virtual joints [6 x 2].
    """

    a: Array
    b: Array
    j: Array
    virtual: Array


def _matrices(response: Response) -> _Matrices:
    reference = np.array(response.configuration.platform.translation.components())
    a, lengths = [], []
    for leg in response.configuration.legs:
        if leg.actuated:
            foot, joint = (np.array(point.components()) for point in leg.path)
            a.append(np.concatenate([np.cross(joint - reference, joint - foot), joint - foot]))
            lengths.append(np.linalg.norm(joint - foot))
    passive_leg = response.legs[0]
    j = np.array([twist.components() for twist in passive_leg.passive]).T
    virtual = np.array([twist.components() for twist in passive_leg.elastic]).T
    return _Matrices(np.array(a), np.diag(lengths), j, virtual)


class _Rates(NamedTuple):
    """Rates of the machine along one motion of the task coordinates.

    Attributes:
        passive_joints: rates of the angles of the passive leg, rad/s [4].
        legs: rates of the lengths of the actuated legs, m/s [4].
        twist: twist of the platform, rad/s and m/s [6].
    """

    passive_joints: Array
    legs: Array
    twist: Array


def _rates(machine: Machine) -> _Rates:
    """The rates at `TASK_RATES`, by central differences."""
    coordinates = values(machine)
    ahead, behind = (
        _placement(with_values(machine, {path: coordinates[path] + step * rate for path, rate in TASK_RATES.items()}))
        for step in (MOTION_STEP, -MOTION_STEP)
    )
    spin = (ahead.rotation @ behind.rotation.T - behind.rotation @ ahead.rotation.T) / (4 * MOTION_STEP)
    velocity = (ahead.position - behind.position) / (2 * MOTION_STEP)
    return _Rates(
        passive_joints=(ahead.angles - behind.angles) / (2 * MOTION_STEP),
        legs=(ahead.lengths - behind.lengths) / (2 * MOTION_STEP),
        twist=np.concatenate([[spin[2, 1], spin[0, 2], spin[1, 0]], velocity]),
    )


class _Placement(NamedTuple):
    """The machine at a pose: angles of the passive leg, lengths of the others, P and the rotation of the platform."""

    angles: Array
    lengths: Array
    position: Array
    rotation: Array


def _placement(machine: Machine) -> _Placement:
    response = respond(machine)
    configuration = response.configuration
    points = [np.array(point.components()) for point in configuration.legs[0].path]
    lower, upper = points[1] - points[0], points[2] - points[1]
    axes = configuration.platform.rotation
    rotation = np.array([axis.components() for axis in (axes.x, axes.y, axes.z)]).T
    first = -math.atan2(lower[2], lower[0])
    second = -math.atan2(upper[2], upper[0]) - first
    pitch = math.atan2(-rotation[2, 0], rotation[0, 0])
    roll = math.atan2(-rotation[1, 2], rotation[1, 1])
    return _Placement(
        angles=np.array([first, second, pitch - first - second, roll]),
        lengths=np.diag(_matrices(response).b).copy(),
        position=np.array(configuration.platform.translation.components()),
        rotation=rotation,
    )

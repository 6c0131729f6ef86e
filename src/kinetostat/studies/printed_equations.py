"""Equations 1 to 32 of the paper, tested by a second route: its own matrices A, B, J and J' in NumPy against (W, G)."""

import math
from collections.abc import Iterator

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
    a, b, jacobian, _ = _matrices(response)
    rates, lengths_rate, twist = _velocities(machine)
    gap = _gap(a @ twist, b @ lengths_rate)
    yield EquationCheck("1-4", "A t = B rho', leg rates by differences", gap, STEP_ERROR)
    gap = _gap(jacobian @ rates, twist)
    yield EquationCheck("7", "t = J theta', passive joint rates by differences", gap, STEP_ERROR)


def _rigid_checks(response: Response) -> Iterator[EquationCheck]:
    """Equations 5 to 22: statics, and the compliance of the machine with a rigid passive leg."""
    a, b, jacobian, _ = _matrices(response)
    aj = a @ jacobian
    load_on_tool = np.array([0.3, -0.2, 0.5, 4.0, -3.0, 7.0])
    forces = b.T @ np.linalg.solve(aj.T, jacobian.T @ load_on_tool)
    gap = _gap(forces @ np.linalg.solve(b, aj), load_on_tool @ jacobian)
    yield EquationCheck("5-11", "actuator forces do the work of the wrench on every feasible twist", gap, ROUND_OFF)
    actuator = np.eye(4) / ACTUATOR_STIFFNESS
    inner = np.linalg.solve(aj, b)
    rigid = jacobian @ inner @ actuator @ inner.T @ jacobian.T
    ours = _rows(respond(load(MACHINE, ["stiffness.passive_links=rigid"])).compliance)
    gap = _gap(rigid, ours)
    yield EquationCheck("12-21", "C of the rigid machine equals W^-T G W^-1", gap, ROUND_OFF)
    gap = _gap(a @ (ours @ load_on_tool), b @ actuator @ forces)
    yield EquationCheck("13, 16, 22", "C w deflects the actuators by C tau", gap, ROUND_OFF)
    excess = _rank_excess(np.linalg.eigvalsh(ours), 4)
    yield EquationCheck("21", "rigid machine: C has rank 4, no eigenvalue below 0", excess, ROUND_OFF)


def _flexible_checks(response: Response) -> Iterator[EquationCheck]:
    """Equations 22 to 32: the stiffness of the machine with its flexible passive leg."""
    a, b, jacobian, virtual = _matrices(response)
    back = np.linalg.inv(np.hstack([jacobian, virtual]))
    springs = np.diag([0.0] * 4 + 2 * [PASSIVE_STIFFNESS])
    rates = np.linalg.inv(b) @ a
    stiffness = back.T @ springs @ back + ACTUATOR_STIFFNESS * rates.T @ rates
    k, c = _rows(response.stiffness), _rows(response.compliance)
    gap = _gap(stiffness, k)
    yield EquationCheck("23-32", "K of the flexible machine equals sum of W G^-1 W^T", gap, ROUND_OFF)
    gap = _gap(_rows(flexible_stiffness(response.legs)), k)
    yield EquationCheck("32", "K by springs equals K by legs", gap, ROUND_OFF)
    gap = float(np.abs(k @ c - np.eye(6)).max())
    yield EquationCheck("22, 31", "K C = 1 for the flexible machine", gap, ROUND_OFF)


def _rows(matrix: Symmetric6) -> Array:
    return np.array(matrix.rows())


def _gap(actual: Array, expected: Array) -> float:
    return float(np.abs(actual - expected).max() / np.abs(expected).max())


def _rank_excess(eigenvalues: AnyArray, rank: int) -> float:
    """Zero where just `rank` eigenvalues are positive and the rest vanish beside them."""
    ordered = np.sort(eigenvalues)
    rest, least = np.abs(ordered[: 6 - rank]).max(), ordered[6 - rank]
    return float(rest / ordered[-1]) if least > 0 else math.inf


def _matrices(response: Response) -> tuple[Array, Array, Array, Array]:
    """A [4 x 6], B [4 x 4] (eqs. 3, 4), J [6 x 4] and the columns of J' for the virtual joints [6 x 2]."""
    reference = np.array(response.configuration.platform.translation.components())
    a, lengths = [], []
    for leg in response.configuration.legs:
        if leg.actuated:
            foot, joint = (np.array(point.components()) for point in leg.path)
            a.append(np.concatenate([np.cross(joint - reference, joint - foot), joint - foot]))
            lengths.append(np.linalg.norm(joint - foot))
    passive = response.legs[0]
    jacobian = np.array([twist.components() for twist in passive.passive]).T
    virtual = np.array([twist.components() for twist in passive.elastic]).T
    return np.array(a), np.diag(lengths), jacobian, virtual


def _velocities(machine: Machine) -> tuple[Array, Array, Array]:
    """Passive joint rates, leg rates and platform twist along one motion of the task coordinates, by differences."""
    motion = {"pose.x": 0.02, "pose.z": -0.03, "pose.theta5": 0.05, "pose.theta6": -0.04}
    states = []
    for sign in (1.0, -1.0):
        displaced = {path: values(machine)[path] + sign * MOTION_STEP * rate for path, rate in motion.items()}
        states.append(respond(with_values(machine, displaced)))
    ahead, behind = (_state(response) for response in states)
    angles, lengths, position = ((p - q) / (2 * MOTION_STEP) for p, q in zip(ahead[:3], behind[:3], strict=True))
    spin = (ahead[3] @ behind[3].T - behind[3] @ ahead[3].T) / (4 * MOTION_STEP)
    return angles, lengths, np.concatenate([[spin[2, 1], spin[0, 2], spin[1, 0]], position])


def _state(response: Response) -> tuple[Array, Array, Array, Array]:
    """Passive joint angles, leg lengths, P and Q of a configuration."""
    configuration = response.configuration
    _, b, _, _ = _matrices(response)
    points = [np.array(point.components()) for point in configuration.legs[0].path]
    lower, upper = points[1] - points[0], points[2] - points[1]
    turn = configuration.platform.rotation
    rotation = np.array([axis.components() for axis in (turn.x, turn.y, turn.z)]).T
    first = -math.atan2(lower[2], lower[0])
    second = -math.atan2(upper[2], upper[0]) - first
    pitch = math.atan2(-rotation[2, 0], rotation[0, 0])
    roll = math.atan2(-rotation[1, 2], rotation[1, 1])
    angles = np.array([first, second, pitch - first - second, roll])
    return angles, np.diag(b).copy(), np.array(configuration.platform.translation.components()), rotation

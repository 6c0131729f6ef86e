"""Numbers and equations of the paper: what it prints, digit for digit, and what this program computes beside it.

Tables III and IV, equations 33 to 38 and the designs of section 4.3 are judged by the digits that are printed.
Equations 1 to 32 are tested by a second route: the paper's own matrices A, B, J and J' in NumPy, against this program's
(W, G).
Source: `CITATION`.
"""

import math
from collections.abc import Iterator, Sequence
from decimal import Decimal
from enum import StrEnum

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.arrays import AnyArray, Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import flexible_stiffness
from kinetostat.kinetostatics.elements import elements
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values, with_values
from kinetostat.studies.guidelines import equations_of_k

CITATION = (
    'D. Zhang and C. M. Gosselin, "Parallel kinematic machine design with kinetostatic model", Robotica 20(4), 429-438 '
    "(2002)"
)
MACHINE = "zhang-gosselin-4dof"
ACTUATOR_STIFFNESS = 1000.0
"""K_actuator, N/m, in every table."""


@dataclass(frozen=True)
class PrintedRow:
    """A row of Table III or IV: the six diagonal entries in the order rx ry rz x y z.

    Attributes:
        label: what the paper prints in the column K_passive.
        setting: the value of both stiffness.passive_links that belongs to the numbers.
        values: the printed numbers, digit for digit.
    """

    label: str
    setting: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Erratum:
    """A misprint: what the row should say, and why we are sure."""

    corrected: str
    reason: str


TABLE_3 = (
    PrintedRow("1000", "1e3 N*m/rad", ("0.52371", "1.41939", "1.5e-3", "0.915208", "5.78e-4", "0.0111974")),
    PrintedRow("10^2 Ka", "1e5 N*m/rad", ("0.51707", "1.40514", "1.5e-5", "0.909087", "5.78e-6", "0.0111429")),
    PrintedRow("10^4 Ka", "1e7 N*m/rad", ("0.516404", "1.4046", "1.5e-7", "0.908726", "5.78e-8", "0.0111393")),
    PrintedRow("10^6 Ka", "1e10 N*m/rad", ("0.516397", "1.40459", "1.5e-10", "0.908722", "5.78e-11", "0.0111393")),
    PrintedRow("rigid", "rigid", ("0.516397", "1.40459", "0.0", "0.908722", "0.0", "0.0111393")),
)
"""Diagonal of C, rad/(N·m) and m/N."""

TABLE_4 = (
    PrintedRow("1000", "1e3 N*m/rad", ("8.50551", "26.21", "743.98", "70.4587", "2223.51", "3628.32")),
    PrintedRow("10^4 Ka", "1e7 N*m/rad", ("8.50551", "26.21", "7.40741e6", "70.4587", "1.92e7", "3628.32")),
    PrintedRow("10^6 Ka", "1e9 N*m/rad", ("8.50551", "26.21", "7.40741e8", "70.4587", "1.92e9", "3628.32")),
    PrintedRow("10^7 Ka", "1e10 N*m/rad", ("8.50551", "26.21", "7.40741e9", "70.4587", "1.92e10", "3628.32")),
)
"""Diagonal of K, N·m/rad and N/m."""

ONE_DIGIT = "one digit is wrong: the other rows of the table approach the rigid row in proportion to 1/K_passive"
ERRATA = {
    ("Table III, row 1", "rx"): Erratum("0.58371", ONE_DIGIT),
    ("Table III, row 1", "ry"): Erratum("1.45939", ONE_DIGIT),
    ("Table III, row 1", "x"): Erratum("0.945208", ONE_DIGIT),
    ("Table III, row 1", "z"): Erratum("0.0114974", ONE_DIGIT),
    ("Table III, row 4", "K_passive / Ka"): Erratum(
        "1e7", "its two small numbers belong to 10^7 Ka: C_rz is 1.5 / K_passive in every row"
    ),
    ("Table IV, row 1", "y"): Erratum("2223.56", "eq. 37 of the paper itself gives 2223.56 here, one digit is wrong"),
}
"""Misprints by place and component."""

TYPOGRAPHY = (
    "Two equations are numbered 26; the one before the first of them, eq. 25, is the one the text refers to.",
    "Eq. 14 lists translation first, while every table and the twist of eq. 1 list rotation first.",
    "T_p and T_b in eq. 41 are T_a and T_b elsewhere.",
)
"""Slips of typography, which touch no number."""

EQUATIONS_33_38 = {
    "rx": ("33", {"Ka": "0.00850551"}),
    "ry": ("34", {"Ka": "0.0262118"}),
    "rz": ("35", {"Ka": "0.00324", "k52": "0.5926", "k54": "0.148"}),
    "x": ("36", {"Ka": "0.0704587"}),
    "y": ("37", {"Ka": "0.301", "k52": "0.961", "k54": "0.961"}),
    "z": ("38", {"Ka": "3.62832"}),
}
"""Equation number, and the coefficient of each stiffness in the diagonal of K."""

# Section 4.3: compliances of the initial and the optimised design as printed, in the order rx ry rz x y z, their sums,
# and the ratio of the sums. With 1e10 N·m/rad the passive links count as rigid there.
INITIAL = ("0.5164", "1.4", "1.5e-10", "0.91", "5.78e-11", "0.011")
INITIAL_SUM = "2.84085"
OPTIMISED = ("0.12", "0.57", "3.747e-3", "0.32", "5e-11", "3.345e-3")
OPTIMISED_SUM = "1.017897"
IMPROVEMENT = "2.8"
STIFF = "stiffness.passive_links=1e10 N*m/rad"
OPTIMISED_DESIGN = (
    'geometry.platform_radius="14 cm"',
    'geometry.base_radius="26 cm"',
    'geometry.passive_links=["70 cm", "55 cm"]',
    'pose.z="66 cm"',
    'geometry.base_angle="35 deg"',
    'geometry.platform_angle="55 deg"',
    STIFF,
)
"""Section 4.3: the design the paper's genetic algorithm found."""

COMPLIANCE_UNITS = [QUANTITIES[name].unit for name in GROUPS["compliance"]]
STIFFNESS_UNITS = [QUANTITIES[name].unit for name in GROUPS["stiffness"]]

SYMBOLS = {"passive link 1": "k52", "passive link 2": "k54"}
"""The paper's names of our springs; all actuators are Ka."""


class PrintVerdict(StrEnum):
    """Result of comparing a computed number with the printed one."""

    EQUAL = "equal to print"
    MISPRINT = "known misprint"
    DIFFERS = "differs"


@dataclass(frozen=True)
class PaperNumber:
    """One number of the paper.

    Attributes:
        place: its place in the paper, e.g. "Table III, row 1".
        component: the component of the row, or the name of the number.
        printed: the value as printed.
        computed: the value that this program computes, SI.
        unit: unit of both values.
        verdict: whether the computed value rounds to the printed one.
        reason: reason for a misprint.
    """

    place: str
    component: str
    printed: str
    computed: float
    unit: str
    verdict: PrintVerdict
    reason: str = ""


def compare(place: str, component: str, printed: str, computed: float, unit: str) -> PaperNumber:
    """Judge a computed value by the digits that are printed; a misprint must round to its correction instead."""
    erratum, verdict, reason = ERRATA.get((place, component)), PrintVerdict.DIFFERS, ""
    if rounds_to(computed, printed):
        verdict = PrintVerdict.EQUAL
    elif erratum is not None and rounds_to(computed, erratum.corrected):
        verdict, reason = PrintVerdict.MISPRINT, f"should be {erratum.corrected}: {erratum.reason}"
    return PaperNumber(
        place=place, component=component, printed=printed, computed=computed, unit=unit, verdict=verdict, reason=reason
    )


def rounds_to(computed: float, printed: str) -> bool:
    """Whether a number is within half a unit of the last printed digit."""
    digits = Decimal(printed)
    exponent = digits.as_tuple().exponent
    half = Decimal(5).scaleb(int(exponent) - 1)
    return abs(Decimal(computed) - digits) <= half * Decimal("1.000001")


def at(*settings: str) -> Response:
    """The paper's machine with some values changed."""
    return respond(load(MACHINE, settings))


def table_3() -> Iterator[PaperNumber]:
    """Compliance against the stiffness of the passive leg."""
    for i, row in enumerate(TABLE_3):
        response = at(f"stiffness.passive_links={row.setting}")
        place = f"Table III, row {i + 1}"
        yield from _numbers(place, row.values, response.compliance.diagonal(), COMPLIANCE_UNITS)
        if row.label == "10^6 Ka":
            yield _label_of_row_4(place, row.values[2])


def _label_of_row_4(place: str, value: str) -> PaperNumber:
    """Compare the label of a row with the ratio K_passive / Ka that gives its printed C_rz: the label is wrong."""
    for exponent in range(10):
        stiffness = ACTUATOR_STIFFNESS * 10**exponent
        if rounds_to(at(f"stiffness.passive_links={stiffness}").compliance.diagonal()[2], value):
            return compare(place, "K_passive / Ka", "1e6", float(10**exponent), "1")
    return compare(place, "K_passive / Ka", "1e6", 0.0, "1")


def table_4() -> Iterator[PaperNumber]:
    """Stiffness against the stiffness of the passive leg."""
    for i, row in enumerate(TABLE_4):
        response = at(f"stiffness.passive_links={row.setting}")
        yield from _numbers(f"Table IV, row {i + 1}", row.values, response.stiffness.diagonal(), STIFFNESS_UNITS)


def _numbers(
    place: str, values: Sequence[str], computed: Sequence[float], units: Sequence[str]
) -> Iterator[PaperNumber]:
    for name, text, value, unit in zip(COMPONENTS, values, computed, units, strict=True):
        yield compare(place, name, text, value, unit)


def coefficients(*settings: str) -> dict[str, Array]:
    """Per stiffness Ka, k52, k54, its coefficients in the six diagonal entries of K (all actuators alike)."""
    response = at(*settings)
    equations = equations_of_k(response, elements(response.configuration), range(len(COMPONENTS)))
    return {SYMBOLS.get(name, "Ka"): row for name, row in (equations or {}).items()}


def equations_33_38() -> Iterator[PaperNumber]:
    """K diagonal as a closed form in the stiffnesses: every coefficient, also those that are not printed (zero)."""
    factors = coefficients()
    for i, name in enumerate(COMPONENTS):
        number, known = EQUATIONS_33_38[name]
        for symbol in ("Ka", "k52", "k54"):
            unit = _coefficient_unit(symbol, name)
            yield compare(f"Eq. {number}", f"{symbol} in K_{name}", known.get(symbol, "0"), factors[symbol][i], unit)


def _coefficient_unit(symbol: str, component: str) -> str:
    rotation = component.startswith("r")
    if symbol == "Ka":
        return "m²" if rotation else "1"
    return "1" if rotation else "1/m²"


def section_4_3() -> Iterator[PaperNumber]:
    """Compliances of the initial and of the optimised design, their sums and the gain (all weights one, SI)."""
    initial, best = at(STIFF), at(*OPTIMISED_DESIGN)
    yield from _numbers("Section 4.3, initial", INITIAL, initial.compliance.diagonal(), COMPLIANCE_UNITS)
    yield from _numbers("Section 4.3, optimised", OPTIMISED, best.compliance.diagonal(), COMPLIANCE_UNITS)
    before, after = sum(initial.compliance.diagonal()), sum(best.compliance.diagonal())
    yield compare("Section 4.3, initial", "sum (eq. 40)", INITIAL_SUM, before, "SI, weights 1")
    yield compare("Section 4.3, optimised", "sum (eq. 40)", OPTIMISED_SUM, after, "SI, weights 1")
    yield compare("Section 4.3", "gain", IMPROVEMENT, before / after, "1")


MOTION_STEP = 1e-6
"""Step of central differences, rad and m: their error is about step² + rounding/step."""
STEP_ERROR = 1e-8
"""Tolerance of a central difference with that step."""
ROUND_OFF = 1e-11
"""Tolerance of two algebraic routes in float64 at condition numbers near 100."""


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
    springs = np.diag([0.0] * 4 + [1000.0, 1000.0])
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
        moved = {path: values(machine)[path] + sign * MOTION_STEP * rate for path, rate in motion.items()}
        states.append(respond(with_values(machine, moved)))
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

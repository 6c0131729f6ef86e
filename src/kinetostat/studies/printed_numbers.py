"""Numbers of the paper: what it prints, digit for digit, and what this program computes beside it.

Tables III and IV, equations 33 to 38 and the designs of section 4.3 are judged by the digits that are printed.
Source: `CITATION`.
"""

from collections.abc import Iterator, Sequence
from decimal import Decimal
from enum import StrEnum

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.elements import elements
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import load
from kinetostat.studies.guidelines import equations_of_k

CITATION = (
    'D. Zhang and C. M. Gosselin, "Parallel kinematic machine design with kinetostatic model", Robotica 20(4), 429-438 '
    "(2002)"
)
MACHINE = "zhang-gosselin-4dof"
"""Name of the paper's machine among those that are bundled."""
ACTUATOR_STIFFNESS = 1000.0
"""K_actuator, N/m, in every table."""


@dataclass(frozen=True)
class PrintedRow:
    """A row of Table III or IV: the six diagonal entries in the order rx ry rz x y z.

    Attributes:
        ratio: K_passive over K_actuator as the paper prints it; 0 where it prints "rigid".
        setting: the value of both stiffness.passive_links that belongs to the numbers.
        values: the printed numbers, digit for digit.
    """

    ratio: str
    setting: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Erratum:
    """A misprint: what the row should say, and why we are sure."""

    corrected: str
    reason: str


TABLE_3 = (
    PrintedRow("1", "1e3 N*m/rad", ("0.52371", "1.41939", "1.5e-3", "0.915208", "5.78e-4", "0.0111974")),
    PrintedRow("1e2", "1e5 N*m/rad", ("0.51707", "1.40514", "1.5e-5", "0.909087", "5.78e-6", "0.0111429")),
    PrintedRow("1e4", "1e7 N*m/rad", ("0.516404", "1.4046", "1.5e-7", "0.908726", "5.78e-8", "0.0111393")),
    PrintedRow("1e6", "1e10 N*m/rad", ("0.516397", "1.40459", "1.5e-10", "0.908722", "5.78e-11", "0.0111393")),
    PrintedRow("0", "rigid", ("0.516397", "1.40459", "0.0", "0.908722", "0.0", "0.0111393")),
)
"""Diagonal of C, rad/(N·m) and m/N."""

TABLE_4 = (
    PrintedRow("1", "1e3 N*m/rad", ("8.50551", "26.21", "743.98", "70.4587", "2223.51", "3628.32")),
    PrintedRow("1e4", "1e7 N*m/rad", ("8.50551", "26.21", "7.40741e6", "70.4587", "1.92e7", "3628.32")),
    PrintedRow("1e6", "1e9 N*m/rad", ("8.50551", "26.21", "7.40741e8", "70.4587", "1.92e9", "3628.32")),
    PrintedRow("1e7", "1e10 N*m/rad", ("8.50551", "26.21", "7.40741e9", "70.4587", "1.92e10", "3628.32")),
)
"""Diagonal of K, N·m/rad and N/m."""

RATIO = "K_passive / Ka"
"""The name of the first column of both tables among the components."""
ONE_DIGIT = "one digit is wrong: the other rows of the table approach the rigid row in proportion to 1/K_passive"
HALF_DIGIT_SLACK = Decimal("1.000001")
"""Factor on half a digit: a number on its edge is equal to print although a binary number lies a little beside it."""
ERRATA = {
    ("Table III, row 1", "rx"): Erratum("0.58371", ONE_DIGIT),
    ("Table III, row 1", "ry"): Erratum("1.45939", ONE_DIGIT),
    ("Table III, row 1", "x"): Erratum("0.945208", ONE_DIGIT),
    ("Table III, row 1", "z"): Erratum("0.0114974", ONE_DIGIT),
    ("Table III, row 4", RATIO): Erratum(
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

INITIAL = ("0.5164", "1.4", "1.5e-10", "0.91", "5.78e-11", "0.011")
"""Section 4.3: compliances of the initial design as printed, in the order rx ry rz x y z."""
INITIAL_SUM = "2.84085"
"""Their sum as printed."""
OPTIMISED = ("0.12", "0.57", "3.747e-3", "0.32", "5e-11", "3.345e-3")
"""Section 4.3: compliances of the optimised design as printed, in the same order."""
OPTIMISED_SUM = "1.017897"
"""Their sum as printed."""
IMPROVEMENT = "2.8"
"""Ratio of both sums as printed."""
STIFF = "stiffness.passive_links=1e10 N*m/rad"
"""Stiffness with which the passive links count as rigid in section 4.3."""
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
"""Units of the diagonals of C and K, component by component."""
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
    return abs(Decimal(computed) - digits) <= half * HALF_DIGIT_SLACK


def response_with(*settings: str) -> Response:
    """The response of the paper's machine with some values changed, "path=value" each."""
    return respond(load(MACHINE, settings))


def table_3() -> Iterator[PaperNumber]:
    """Compliance against the stiffness of the passive leg."""
    for i, row in enumerate(TABLE_3):
        response = response_with(f"stiffness.passive_links={row.setting}")
        place = f"Table III, row {i + 1}"
        yield from _compared_row(place, row.values, response.compliance.diagonal(), COMPLIANCE_UNITS)
        if (place, RATIO) in ERRATA:
            yield _ratio_of_row(place, row)


def _ratio_of_row(place: str, row: PrintedRow) -> PaperNumber:
    """Compare the printed ratio of a row with the power of ten that gives its printed C_rz; 0 if none does."""
    ratios, rotation_about_z = (10.0**exponent for exponent in range(10)), row.values[COMPONENTS.index("rz")]
    fitting = (r for r in ratios if rounds_to(_rotation_about_z(ACTUATOR_STIFFNESS * r), rotation_about_z))
    return compare(place, RATIO, row.ratio, next(fitting, 0.0), "1")


def _rotation_about_z(passive_stiffness: float) -> float:
    """C_rz, rad/(N·m), with a stiffness of the passive links, N·m/rad."""
    return response_with(f"stiffness.passive_links={passive_stiffness}").compliance.diagonal()[2]


def table_4() -> Iterator[PaperNumber]:
    """Stiffness against the stiffness of the passive leg."""
    for i, row in enumerate(TABLE_4):
        response = response_with(f"stiffness.passive_links={row.setting}")
        yield from _compared_row(f"Table IV, row {i + 1}", row.values, response.stiffness.diagonal(), STIFFNESS_UNITS)


def _compared_row(
    place: str, printed: Sequence[str], computed: Sequence[float], units: Sequence[str]
) -> Iterator[PaperNumber]:
    """The numbers of a row beside the computed ones, in the order rx ry rz x y z."""
    for name, text, value, unit in zip(COMPONENTS, printed, computed, units, strict=True):
        yield compare(place, name, text, value, unit)


def coefficients(*settings: str) -> dict[str, Array]:
    """Per stiffness Ka, k52, k54, its coefficients in the six diagonal entries of K (all actuators alike)."""
    response = response_with(*settings)
    equations = equations_of_k(response, elements(response.configuration), range(len(COMPONENTS)))
    return {SYMBOLS.get(name, "Ka"): row for name, row in (equations or {}).items()}


def equations_33_38() -> Iterator[PaperNumber]:
    """K diagonal as a closed form in the stiffnesses: every coefficient, also those that are not printed (zero)."""
    factors = coefficients()
    for row, name in enumerate(COMPONENTS):
        number, printed = EQUATIONS_33_38[name]
        for symbol in ("Ka", "k52", "k54"):
            place, entry, unit = f"Eq. {number}", f"{symbol} in K_{name}", _coefficient_unit(symbol, name)
            yield compare(place, entry, printed.get(symbol, "0"), factors[symbol][row], unit)


def _coefficient_unit(symbol: str, component: str) -> str:
    """Unit of what multiplies a stiffness in an entry of K: Ka is in N/m, k52 and k54 in N·m/rad."""
    rotation = component.startswith("r")
    if symbol == "Ka":
        return "m²" if rotation else "1"
    return "1" if rotation else "1/m²"


def section_4_3() -> Iterator[PaperNumber]:
    """Compliances of the initial and of the optimised design, their sums and the gain (all weights one, SI)."""
    initial, best = response_with(STIFF), response_with(*OPTIMISED_DESIGN)
    yield from _compared_row("Section 4.3, initial", INITIAL, initial.compliance.diagonal(), COMPLIANCE_UNITS)
    yield from _compared_row("Section 4.3, optimised", OPTIMISED, best.compliance.diagonal(), COMPLIANCE_UNITS)
    before, after = sum(initial.compliance.diagonal()), sum(best.compliance.diagonal())
    yield compare("Section 4.3, initial", "sum (eq. 40)", INITIAL_SUM, before, "SI, weights 1")
    yield compare("Section 4.3, optimised", "sum (eq. 40)", OPTIMISED_SUM, after, "SI, weights 1")
    yield compare("Section 4.3", "gain", IMPROVEMENT, before / after, "1")

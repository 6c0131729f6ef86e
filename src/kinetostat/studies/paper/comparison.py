"""Every printed number compared with the computed one: Tables III and IV, equations 33-38, designs of section 4.3."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.kinetostatics.elements import elements
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import load
from kinetostat.studies.guidelines.roles import equations_of_k
from kinetostat.studies.paper import printed
from kinetostat.studies.paper.printed import ERRATA

COMPLIANCE_UNITS = [QUANTITIES[name].unit for name in GROUPS["compliance"]]
STIFFNESS_UNITS = [QUANTITIES[name].unit for name in GROUPS["stiffness"]]

SYMBOLS = {"passive link 1": "k52", "passive link 2": "k54"}
"""The paper's names of our springs; all actuators are Ka."""


class Verdict(StrEnum):
    """What became of a comparison."""

    EQUAL = "equal to print"
    MISPRINT = "known misprint"
    DIFFERS = "differs"


@dataclass(frozen=True)
class Comparison:
    """One number of the paper.

    Attributes:
        place: where it is printed, e.g. "Table III, row 1".
        component: which number there.
        printed: as printed.
        computed: by this program, SI.
        unit: of both.
        verdict: whether the computed value rounds to the printed one.
        reason: of a misprint.
    """

    place: str
    component: str
    printed: str
    computed: float
    unit: str
    verdict: Verdict
    reason: str = ""


def compare(place: str, component: str, printed: str, computed: float, unit: str) -> Comparison:
    """Judge a computed value by the digits that are printed; a misprint must round to its correction instead."""
    if rounds_to(computed, printed):
        return Comparison(place, component, printed, computed, unit, Verdict.EQUAL)
    erratum = ERRATA.get((place, component))
    if erratum is not None and rounds_to(computed, erratum.corrected):
        reason = f"should be {erratum.corrected}: {erratum.reason}"
        return Comparison(place, component, printed, computed, unit, Verdict.MISPRINT, reason)
    return Comparison(place, component, printed, computed, unit, Verdict.DIFFERS)


def rounds_to(computed: float, printed: str) -> bool:
    """Whether a number is within half a unit of the last printed digit."""
    digits = Decimal(printed)
    exponent = digits.as_tuple().exponent
    half = Decimal(5).scaleb(int(exponent) - 1)
    return abs(Decimal(computed) - digits) <= half * Decimal("1.000001")


def at(*settings: str) -> Response:
    """The paper's machine with some values changed."""
    return respond(load(printed.MACHINE, settings))


def table_3() -> Iterator[Comparison]:
    """Compliance against the stiffness of the passive leg."""
    for i, row in enumerate(printed.TABLE_3):
        response = at(f"stiffness.passive_links={row.setting}")
        place = f"Table III, row {i + 1}"
        yield from _row(place, row.values, response.compliance.diagonal(), COMPLIANCE_UNITS)
        if row.label == "10^6 Ka":
            yield _label(place, row.values[2])


def _label(place: str, value: str) -> Comparison:
    """Which ratio K_passive / Ka gives the printed C_rz: the row's label is wrong."""
    for exponent in range(10):
        stiffness = printed.ACTUATOR * 10**exponent
        if rounds_to(at(f"stiffness.passive_links={stiffness}").compliance.diagonal()[2], value):
            return compare(place, "K_passive / Ka", "1e6", float(10**exponent), "1")
    return compare(place, "K_passive / Ka", "1e6", 0.0, "1")


def table_4() -> Iterator[Comparison]:
    """Stiffness against the stiffness of the passive leg."""
    for i, row in enumerate(printed.TABLE_4):
        response = at(f"stiffness.passive_links={row.setting}")
        yield from _row(f"Table IV, row {i + 1}", row.values, response.stiffness.diagonal(), STIFFNESS_UNITS)


def _row(place: str, values: Sequence[str], computed: Sequence[float], units: Sequence[str]) -> Iterator[Comparison]:
    for name, text, value, unit in zip(COMPONENTS, values, computed, units, strict=True):
        yield compare(place, name, text, value, unit)


def coefficients(*settings: str) -> dict[str, tuple[float, ...]]:
    """Per stiffness Ka, k52, k54, its coefficients in the six diagonal entries of K (all actuators alike)."""
    response = at(*settings)
    equations = equations_of_k(response, elements(response.configuration), range(len(COMPONENTS)))
    return {SYMBOLS.get(name, "Ka"): row for name, row in (equations or {}).items()}


def equations_33_38() -> Iterator[Comparison]:
    """K diagonal as a closed form in the stiffnesses: every coefficient, also those that are not printed (zero)."""
    factors = coefficients()
    for i, name in enumerate(COMPONENTS):
        number, known = printed.EQUATIONS_33_38[name]
        for symbol in ("Ka", "k52", "k54"):
            unit = _coefficient_unit(symbol, name)
            yield compare(f"Eq. {number}", f"{symbol} in K_{name}", known.get(symbol, "0"), factors[symbol][i], unit)


def _coefficient_unit(symbol: str, component: str) -> str:
    rotation = component.startswith("r")
    if symbol == "Ka":
        return "m²" if rotation else "1"
    return "1" if rotation else "1/m²"


def section_4_3() -> Iterator[Comparison]:
    """Compliances of the initial and of the optimised design, their sums and the gain (all weights one, SI)."""
    initial, best = at(printed.STIFF), at(*printed.OPTIMISED_DESIGN)
    yield from _row("Section 4.3, initial", printed.INITIAL, initial.compliance.diagonal(), COMPLIANCE_UNITS)
    yield from _row("Section 4.3, optimised", printed.OPTIMISED, best.compliance.diagonal(), COMPLIANCE_UNITS)
    before, after = sum(initial.compliance.diagonal()), sum(best.compliance.diagonal())
    yield compare("Section 4.3, initial", "sum (eq. 40)", printed.INITIAL_SUM, before, "SI, weights 1")
    yield compare("Section 4.3, optimised", "sum (eq. 40)", printed.OPTIMISED_SUM, after, "SI, weights 1")
    yield compare("Section 4.3", "gain", printed.IMPROVEMENT, before / after, "1")

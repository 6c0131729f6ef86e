"""A printed number beside a computed one, and the verdict. Where the numbers come from is elsewhere."""

from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum

from kinetostat.studies.paper.printed import ERRATA


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

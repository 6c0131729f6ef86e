"""Results in the units that people read: the one formatter of terminal, reports, figures and the studio.

Only units and digits change here; files and JSON stay SI, and what people write is read in `units`.
"""

import math
import re
from collections.abc import Iterable, Sequence
from functools import cache

from kinetostat.frozen import dataclass
from kinetostat.tolerances import ROUND_OFF_OF_COLUMN
from kinetostat.units import UnitError, multiple_of_unit

SI = "si"
"""Word of a file for results that are all shown in SI units."""
DIGITS = (2, 12)
"""The fewest and the most significant digits that may be asked for: one hides which of two is larger, and beyond
twelve lies round-off."""
DASH = "–"
"""Stands where there is no number."""
INFINITE = "∞"
"""Stands for infinity."""
_VALUE = re.compile(r"([-+]?[\d.]+(?:e-?\d+)?) (\S+)")
_HYPHEN_OF_NUMBER = re.compile(r"(?<![\w.,)-])-(?=[\d.∞])")
MOST_DECIMALS = 6
"""Decimals with which a number stands beside its uncertainty at most: a smaller uncertainty has a power of ten."""
PLAIN_POWERS = (-3, 5)
"""Numbers are written without a power of ten from 0.001 to 999999."""
UNIT_OF = {
    "m": "mm",
    "rad": "deg",
    "N/m": "N/µm",
    "N·m/rad": "N·m/µrad",
    "N/rad": "N/µrad",
    "m/N": "µm/N",
    "rad/(N·m)": "µrad/(N·m)",
    "rad/N": "µrad/N",
    "N": "N",
    "N·m": "N·m",
    "kg": "kg",
    "kg/m": "kg/m",
    "kg/m**3": "kg/m³",
    "Pa": "GPa",
    "N·m**2": "N·m²",
    "m**2": "cm²",
    "m**4": "cm⁴",
}
"""The engineering unit of each SI unit. In N, N·m, µm and µrad every entry of K is a millionth of that in SI, so that K
stays symmetric and K C = 1 also as printed."""
SMALL_MOTIONS = {"m": 1e3, "rad": 1e3}
"""Values of these units that are all below so many µm and µrad are read in µm and µrad."""
DUAL = {"N/m": "m/N", "N·m/rad": "rad/(N·m)", "N/rad": "rad/N"}
"""Stiffnesses and the compliances whose units follow from theirs."""
POWERS = {"2": "²", "3": "³", "4": "⁴"}
"""Powers of units, as they are printed."""
EXAMPLE = "mm, deg, N/um, N*m/urad"
"""Units that may be chosen, for messages and help."""


@dataclass(frozen=True)
class Scale:
    """The scale for values of one SI unit: they are multiplied by `factor` and shown in `unit`."""

    factor: float
    unit: str

    def label(self, what: str) -> str:
        """Return the label of an axis or a column: what it shows, and its unit in brackets."""
        return f"{what} ({self.unit})" if self.head else what

    @property
    def head(self) -> str:
        """The unit alone, for the head of a column: nothing where there is none."""
        return "" if self.unit == "1" else self.unit


@dataclass(frozen=True)
class Display:
    """The units and the digits in which people want to read results.

    Attributes:
        units: units by commas, such as "mm, deg, N/um", or "si", or both; what is not named is in `UNIT_OF`.
        digits: significant digits of a result.
    """

    units: str = ""
    digits: int = 4

    def scale(self, unit: str) -> Scale:
        """Return the scale of an SI unit; a unit that has no other way to be read stays as it is."""
        return _scales(self.units).get(unit) or Scale(1.0, _as_printed(unit))

    def deflection(self, unit: str) -> Scale:
        """Return the scale of a small motion in m or rad: that of the compliances, µm and µrad unless chosen."""
        compliance = {"m": "m/N", "rad": "rad/(N·m)"}[unit]
        return _scale_of_motion(self.scale(compliance).unit.partition("/")[0])

    def fitting(self, unit: str, values: Iterable[float]) -> Scale:
        """Return the scale for values of one quantity: lengths and angles that are all small are small motions.

        Args:
            unit: their SI unit.
            values: SI; those that are not finite do not count.
        """
        if unit not in SMALL_MOTIONS or self.scale(unit).unit != UNIT_OF[unit] or UNIT_OF[unit] in self._chosen_units:
            return self.scale(unit)
        small = self.deflection(unit)
        largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
        return small if largest * small.factor < SMALL_MOTIONS[unit] else self.scale(unit)

    @property
    def _chosen_units(self) -> set[str]:
        return {_as_printed(word) for word in self.units.split(",")}

    def number(self, value: float | None, unit: str = "1", endless: str = INFINITE) -> str:
        """Return an SI value as a number in the unit of `scale`, without the unit."""
        return number(value and value * self.scale(unit).factor, endless, self.digits)

    def show(self, value: float | None, unit: str, endless: str = INFINITE, digits: int | None = None) -> str:
        """Return an SI value with its unit, e.g. "312.4 mm".

        Args:
            value: SI; None or NaN gives a dash.
            unit: its SI unit; "1" or nothing for a number without one.
            endless: stands for infinity, without a unit.
            digits: significant digits, if not those of this display.
        """
        scale = self.scale(unit)
        return with_unit(number(value and value * scale.factor, endless, digits or self.digits), scale.unit)

    def show_deflection(self, value: float | None, unit: str) -> str:
        """Return a small motion, in m or rad, with its unit, e.g. "12.3 µm"; "free" if it is infinite."""
        scale = self.deflection(unit)
        return with_unit(number(value and value * scale.factor, "free", self.digits), scale.unit)

    def names(self, units: Sequence[str]) -> str:
        """Return the units in which values of these SI units are shown, by commas."""
        return ", ".join(dict.fromkeys(self.scale(unit).unit for unit in units))


ENGINEERING = Display()
"""The units of `UNIT_OF`, in four digits."""


def read_display(given: object) -> Display:
    """Read a table [display] of a machine file.

    Args:
        given: the table as written, with `units` (text or a list of texts) and `digits`, both optional.

    Raises:
        UnitError: it is not such a table, a unit is unknown, or the number of digits is out of bounds.
    """
    if not isinstance(given, dict) or not given.keys() <= {"units", "digits"}:
        raise UnitError(f'display must be a table that may hold units = "{EXAMPLE}" and digits = 4')
    units, digits = given.get("units", ""), given.get("digits", ENGINEERING.digits)
    units = ", ".join(map(str, units)) if isinstance(units, list) else units
    if not isinstance(units, str):
        raise UnitError(f'display.units must be text; write units by commas, e.g. "{EXAMPLE}", or "{SI}"')
    if not isinstance(digits, int) or not DIGITS[0] <= digits <= DIGITS[1]:
        raise UnitError(f"display.digits is {digits!r}; give a whole number from {DIGITS[0]} to {DIGITS[1]}")
    try:
        _scales(units)
    except UnitError as error:
        raise UnitError(f"display.units: {error}") from None
    return Display(units, digits)


def number(value: float | None, endless: str = INFINITE, digits: int = 4) -> str:
    """Return a number with so many significant digits, zeros at its end left out, e.g. "0.5", "26195", "1.2e-7".

    A dash stands for None and NaN, `endless` for infinity.
    """
    if value is None or math.isnan(value):
        return DASH
    if math.isinf(value):
        return endless if value > 0.0 else f"-{endless}"
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    size = int(power)
    if float(mantissa) == 0.0:
        return "0"
    if PLAIN_POWERS[0] <= size <= PLAIN_POWERS[1]:
        return _without_zeros(f"{value:.{max(digits - 1 - size, 0)}f}")
    return f"{_without_zeros(mantissa)}e{size}"


def with_minus_signs(text: str) -> str:
    """Return a text with a minus sign in front of negative numbers instead of a hyphen, for pages and print."""
    return _HYPHEN_OF_NUMBER.sub("\N{MINUS SIGN}", text)


def without_round_off(cells: Sequence[str]) -> list[str]:
    """Return the cells of a column, in which values that are round-off beside the greatest of their unit are 0.

    So "-2.4e-8 N" is "0 N" below "8822 N". Cells without a unit stay as they are: of ratios, 1 and 3e-13 beside each
    other both say something.
    """
    if not any("e-" in cell for cell in cells):
        return list(cells)
    values = [_VALUE.fullmatch(cell) for cell in cells]
    greatest: dict[str, float] = {}
    for value in values:
        if value:
            greatest[value[2]] = max(abs(float(value[1])), greatest.get(value[2], 0.0))
    return [
        f"0 {value[2]}" if value and abs(float(value[1])) < ROUND_OFF_OF_COLUMN * greatest[value[2]] else cell
        for cell, value in zip(cells, values, strict=True)
    ]


def number_and_uncertainty(value: float, uncertainty: float) -> tuple[str, str]:
    """Return a number and its uncertainty in the same decimals: two significant digits of the uncertainty.

    More digits of the number would say more than is known, such as those of "0.953 ± 0.93" after the second. Where the
    uncertainty is 0, infinite or far below a millionth, the number has its usual digits.
    """
    if not (math.isfinite(value) and math.isfinite(uncertainty) and uncertainty > 0.0):
        return number(value), number(uncertainty)
    decimals = 1 - math.floor(math.log10(uncertainty))
    if decimals > MOST_DECIMALS:
        return number(value), number(uncertainty, digits=2)
    shown = max(decimals, 0)
    return f"{round(value, shown) + 0.0:.{shown}f}", f"{uncertainty:.{shown}f}"


def with_unit(text: str, unit: str) -> str:
    """Return a number and its unit; words and dashes that stand for a number have none."""
    return f"{text} {unit}".rstrip() if text[-1:].isdigit() and unit != "1" else text


def _without_zeros(text: str) -> str:
    """Return a number without the zeros at the end of its fraction."""
    return text.rstrip("0").rstrip(".") if "." in text else text


@cache
def _scales(units: str) -> dict[str, Scale]:
    """Read the units that were chosen; return the scale of each SI unit.

    Raises:
        UnitError: one of them is not a unit of any result.
    """
    words = [word.strip() for word in units.split(",") if word.strip()]
    in_si = SI in (word.lower() for word in words)
    units_of = {si: _as_printed(si) if in_si else unit for si, unit in UNIT_OF.items()}
    chosen = {}
    for word in words:
        if word.lower() not in (SI, "engineering"):
            unit = _as_printed(word)
            chosen[multiple_of_unit(unit, UNIT_OF, EXAMPLE)[0]] = unit
    for stiffness, compliance in DUAL.items():
        for si, dual in ((stiffness, compliance), (compliance, stiffness)):
            if si in chosen and dual not in chosen:
                units_of[dual] = _reciprocal(chosen[si])
    units_of |= chosen
    return {si: Scale(1.0 / multiple_of_unit(unit, [si], EXAMPLE)[1], unit) for si, unit in units_of.items()}


@cache
def _scale_of_motion(unit: str) -> Scale:
    """Return the scale of motions that are read in a unit of length or angle."""
    return Scale(1.0 / multiple_of_unit(unit, ["m", "rad"], EXAMPLE)[1], unit)


def _as_printed(unit: str) -> str:
    """Return a unit as it is printed: "N m/urad" becomes "N·m/µrad", "cm**2" becomes "cm²"."""
    unit = re.sub(r"\*\*([2-4])", lambda power: POWERS[power[1]], unit)
    unit = re.sub(r"(?<!\*)\*(?!\*)|(?<=\w)\s+(?=\w)", "·", unit.replace("μ", "µ"))
    return re.sub(r"\bu(?=(?:m|rad|N)\b)", "µ", unit.replace(" ", ""))


def _reciprocal(unit: str) -> str:
    """Return a unit upside down: "N·m/rad" becomes "rad/(N·m)"."""
    top, _, bottom = unit.partition("/")
    return f"{bottom.strip('()')}/{f'({top})' if '·' in top else top}"

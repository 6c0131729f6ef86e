"""Text with a unit to an SI float and back: the only place that converts.

A bare number is SI. What a number may mean (its kind) is fixed by the field that holds it; see `KINDS`.
"""

import math
import re
from collections.abc import Collection, Iterable
from dataclasses import replace
from decimal import Decimal
from functools import cache
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.frozen import dataclass
from kinetostat.late import show_array_libraries

if TYPE_CHECKING:
    from pint import UnitRegistry
    from pint.facets.plain import PlainQuantity


@dataclass(frozen=True)
class Kind:
    """A kind of quantity: its SI unit, as people read it, and an example of how to write it.

    `bare` is the unit of a number without one, where that is not the SI unit.
    """

    name: str
    unit: str
    example: str
    bare: str = ""

    @property
    def stiff(self) -> bool:
        """Whether it says how something resists: from 0 (free) to "rigid"."""
        return self.name.endswith(("stiffness", "rigidity"))

    @property
    def heavy(self) -> bool:
        """Whether it says how much matter there is: never negative."""
        return self.name.endswith(("mass", "density", "moment of inertia"))

    @property
    def unsigned(self) -> bool:
        """Whether it cannot be negative, though it may be 0."""
        return self.heavy or self.name.endswith(
            ("damping", "friction", "ratio", "share", "rate", "speed", "duration", "pressure")
        )


KINDS = {
    kind.name: kind
    for kind in (
        Kind("length", "m", "12 cm"),
        Kind("angle", "rad", "30 deg"),
        Kind("linear stiffness", "N/m", "20 N/um"),
        Kind("torsional stiffness", "N·m/rad", "1e7 N*m/rad"),
        Kind("coupling stiffness", "N/rad", "1e5 N/rad"),
        Kind("linear compliance", "m/N", "1e-8 m/N"),
        Kind("torsional compliance", "rad/(N·m)", "1e-6 rad/(N*m)"),
        Kind("coupling compliance", "rad/N", "1e-7 rad/N"),
        Kind("axial rigidity", "N", "2e8 N"),
        Kind("torsional rigidity", "N·m**2", "4e4 N*m**2"),
        Kind("bending rigidity", "N·m**2", "5e4 N*m**2"),
        Kind("force", "N", "500 N"),
        Kind("moment", "N·m", "20 N*m"),
        Kind("elastic modulus", "Pa", "210 GPa"),
        Kind("area", "m**2", "12 cm**2"),
        Kind("second moment of area", "m**4", "80 cm**4"),
        Kind("density", "kg/m**3", "7850 kg/m**3"),
        Kind("linear density", "kg/m", "3.5 kg/m"),
        Kind("mass", "kg", "12 kg"),
        Kind("moment of inertia", "kg·m**2", "2e-4 kg*m**2"),
        Kind("linear moment of inertia", "kg·m", "1.2e-3 kg*cm**2/mm"),
        Kind("inertia", "kg·m**2", "0.4 kg*m**2"),
        Kind("ratio", "", "0.02"),
        Kind("linear damping", "N·s/m", "500 N*s/m"),
        Kind("torsional damping", "N·m·s/rad", "0.2 N*m*s/rad"),
        Kind("linear friction", "N", "5 N"),
        Kind("torsional friction", "N·m", "0.05 N*m"),
        Kind("rate", "rad/s", "3 rad/s"),
        Kind("duration", "s", "1e-5 s"),
        Kind("frequency", "Hz", "120 Hz"),
        Kind("cutting pressure", "Pa", "2000 N/mm**2"),
        Kind("E I", "N·m**2", "5e4 N*m**2"),
        Kind("temperature difference", "K", "15 K"),
        Kind("thermal expansion", "m/(m·K)", "12 um/(m*K)"),
        Kind("speed", "m/s", "0.5 m/s"),
        Kind("acceleration", "m/s**2", "9.81 m/s**2"),
        Kind("angular acceleration", "rad/s**2", "50 rad/s**2"),
        Kind("jerk", "m/s**3", "100 m/s**3"),
        Kind("direction", "", "1.0"),
        Kind("share", "m/m", "20 um/m"),
    )
}

UNITS = Path(__file__).with_name("units.txt")
"""The file with all units that are known, in the form that pint reads."""
USUAL = {
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "nm": 1e-9},
    "rad": {"rad": 1.0, "deg": 0.017453292519943295, "mrad": 1e-3, "urad": 1e-6},
    "N": {"N": 1.0, "kN": 1e3},
    "N*m": {"N*m": 1.0, "kN*m": 1e3},
    "N/m": {"N/m": 1.0, "N/mm": 1e3, "N/um": 1e6, "kN/mm": 1e6},
    "N*m/rad": {"N*m/rad": 1.0, "kN*m/rad": 1e3, "N*m/mrad": 1e3, "N*m/urad": 1e6},
    "N/rad": {"N/rad": 1.0, "N/mrad": 1e3, "N/urad": 1e6},
    "m/N": {"m/N": 1.0, "mm/N": 1e-3, "um/N": 1e-6},
    "rad/(N*m)": {"rad/(N*m)": 1.0, "mrad/(N*m)": 1e-3, "urad/(N*m)": 1e-6},
    "rad/N": {"rad/N": 1.0, "mrad/N": 1e-3, "urad/N": 1e-6},
    "N*m**2": {"N*m**2": 1.0},
    "Pa": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
    "m**2": {"m**2": 1.0, "mm**2": 1e-6, "cm**2": 1e-4},
    "m**4": {"m**4": 1.0, "cm**4": 1e-8},
    "kg/m**3": {"kg/m**3": 1.0},
    "kg/m": {"kg/m": 1.0, "g/m": 1e-3},
    "kg": {"kg": 1.0, "g": 1e-3},
    "kg*m**2": {"kg*m**2": 1.0},
    "s": {"s": 1.0},
    "rad/s": {"rad/s": 1.0},
    "Hz": {"Hz": 1.0},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3},
    "m/s**2": {"m/s**2": 1.0},
    "rad/s**2": {"rad/s**2": 1.0},
    "K": {"K": 1.0},
    "m/(m*K)": {"m/(m*K)": 1.0, "um/(m*K)": 1e-6},
    "": {"%": 0.01},
    "m/m": {"m/m": 1.0, "mm/m": 1e-3, "um/m": 1e-6, "%": 0.01, "ppm": 1e-6},
}
"""SI values of the units that most files use, by SI unit. They are pint's to the last bit, which a test compares; pint
itself takes longer to import than a thousand poses take to compute, and is only asked about all other units."""
KINDS_WITH_ANGLE = ("angle", "rate", "frequency", "angular acceleration")
"""Kinds whose angle cannot be left out: 1 Hz is 2 pi rad/s. Others may be written without theirs, a torsional stiffness
in N*m; but none is written with an angle that it has not: a lead of "10 mm/turn" is not a length of 10 mm / (2 pi)."""
WITHOUT_ANGLE = {"rate": "1/s", "angular acceleration": "1/s**2"}
"""Unit in which such a kind may be written without its angle all the same, because SI does so."""
RIGID = "rigid"
"""Word of a file for an infinite stiffness."""

IN_FILES = {
    "length": ("mm", "m"),
    "angle": ("deg", "rad"),
    "linear stiffness": ("N/um", "N/m"),
    "elastic modulus": ("GPa", "Pa"),
    "area": ("mm**2", "m**2"),
}
"""Units in which a file gives a number where nothing was written before; the one with the fewest digits is taken."""
PLAIN = (1e-4, 1e6)
"""Between these a number is written without an exponent: at most six digits or three zeros stand before the rest."""

MOST_DIGITS = 17
"""Significant digits after which no other float is written in the same way."""

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
# One unit with its power, then a product in brackets below a stroke: "/(N*m)".
_NAME = r"(?:[A-Za-zµμ°]+|%)(?:\s*(?:\*\*|\^)\s*[1-4]|[²³⁴])?"
_UNDER = rf"/\s*\({_NAME}(?:\s*[*·]\s*{_NAME})*\)"
UNIT = re.compile(rf"(?:1\s*/\s*)?{_NAME}(?:\s*[*/·]\s*{_NAME}|\s*{_UNDER})*")
"""Pattern of the text of a unit, e.g. "N/um" or "1/s"."""
_PLAIN_SIGNS = str.maketrans({"·": "*", "µ": "u", "μ": "u", "²": "**2", "³": "**3", "⁴": "**4"})
_LONGEST = 64
"""Characters up to which a text is read as a quantity: all digits of a float and any unit, and no more to search."""


class UnitError(ValueError):
    """A value that is not a quantity of the wanted kind; the message says what is wrong with it and what is allowed."""


def parse(value: object, kind: str, bare: str = "") -> float:
    """Return the SI value of a number or of text such as "12 cm".

    Args:
        value: a finite number (SI), or text: a number and a unit.
        kind: a key of `KINDS`; for a stiffness or rigidity, the text "rigid" gives infinity.
        bare: unit of a text without one; that of SI if empty.

    Raises:
        UnitError: it is not a number, the unit is unknown, or the unit is of another kind.
    """
    wanted = replace(KINDS[kind], bare=bare)
    if isinstance(value, bool) or not isinstance(value, Real | str):
        raise UnitError(f"it must be {_allowed_form(wanted)}")
    if isinstance(value, str):
        return _parse_text(value, wanted)
    try:
        return _finite(float(value), wanted)
    except OverflowError:
        raise UnitError(f"it is too large; write {_allowed_form(wanted)}") from None


def write(value: float, kind: str) -> str:
    """Return an SI value as text for a file, e.g. "0.22 m"; `parse` reads it back exactly. Infinity is "rigid"."""
    return RIGID if math.isinf(value) else f"{value!r} {KINDS[kind].unit}".rstrip()


def written_value(value: float, kind: str, like: object = None) -> str | float:
    """Return an SI value as people write it in a file: the shortest text from which `parse` reads exactly this value.

    Args:
        value: SI; infinity is "rigid".
        kind: a key of `KINDS`.
        like: the entry that stood in the file before: its unit is kept if it can be, and a bare number stays bare.
    """
    if math.isinf(value):
        return RIGID
    bare = isinstance(like, int | float) and not isinstance(like, bool)
    if bare or not KINDS[kind].unit:
        return value
    match = _NUMBER.fullmatch(like) if isinstance(like, str) else None
    usual, si = [match[2]] if match else IN_FILES.get(kind, ()), [_ascii(KINDS[kind].unit)]
    texts = _texts(value, usual, kind) or _texts(value, si, kind)
    return min(texts, key=lambda text: sum(c.isdigit() for c in text))


def rounded_value(value: float, kind: str, like: object, digits: int) -> float:
    """Return the SI value next to a finite one that has so many digits in the unit of what stood in a file before."""
    match = _NUMBER.fullmatch(like) if isinstance(like, str) else None
    factor = _factor(match[2], KINDS[kind]) if match and match[2] else 1.0
    return float(f"{value / factor:.{digits}g}") * factor


def _texts(value: float, units: Iterable[str], kind: str) -> list[str]:
    return [text for unit in units if (text := _exactly(value, unit, KINDS[kind])) is not None]


def _exactly(value: float, unit: str, wanted: Kind) -> str | None:
    """Return the shortest number with this unit that is read as exactly this value; None where there is none."""
    try:
        factor = _factor(unit, wanted) if unit else 1.0
    except UnitError:
        return None
    for digits in range(1, MOST_DIGITS + 1):
        number = f"{value / factor + 0.0:.{digits}g}"
        if float(number) * factor == value:
            mantissa, _, exponent = number.partition("e")
            plain = not exponent or PLAIN[0] <= abs(float(number)) < PLAIN[1]
            return f"{f'{Decimal(number):f}' if plain else f'{mantissa}e{int(exponent)}'} {unit}".rstrip()
    return None


def _ascii(unit: str) -> str:
    """Return a unit with signs that every keyboard has."""
    return unit.translate(_PLAIN_SIGNS)


def load_unit(turning: bool) -> str:
    """Return the unit of a load: of a moment where it turns, else of a force."""
    return "N·m" if turning else "N"


def motion_unit(turning: bool) -> str:
    """Return the unit of a small motion: of a rotation, else of a displacement."""
    return "rad" if turning else "m"


def component_units(components: Iterable[str]) -> list[str]:
    """Return the units of components of a small motion by their names: those about axes begin with r, "rx"."""
    return [motion_unit(name.startswith("r")) for name in components]


def as_read(value: float, unit: str) -> tuple[float, str]:
    """Return a value and its unit as people read them: angles in degrees, all else unchanged."""
    return (math.degrees(value), "deg") if unit == "rad" else (value, unit)


def multiple_of_unit(unit: str, known: Collection[str], example: str) -> tuple[str, float]:
    """Find which of several SI units a unit is a multiple of.

    Args:
        unit: such as "N/µm"; an angle counts, so that N·m is not N·m/rad.
        known: the SI units, such as "N/m".
        example: units that may be written, for the message.

    Returns:
        The SI unit, and the SI value of one `unit`.

    Raises:
        UnitError: it is a multiple of none of them.
    """
    for si in known:
        if (factor := _usual_factor(unit, si)) is not None:
            return si, factor
    written = _in_root_units(unit) if UNIT.fullmatch(unit) else None
    for si in known:
        target = _in_root_units(si)
        if written is not None and target is not None and written.units == target.units:
            return si, float(written.magnitude / target.magnitude)
    shown = unit if len(unit) <= _LONGEST else f"{unit[:_LONGEST]}…"
    raise UnitError(f'"{shown}" is not a unit of any result; write for example "{example}"')


def _parse_text(text: str, wanted: Kind) -> float:
    if text.strip().lower() == RIGID and wanted.stiff:
        return math.inf
    match = _NUMBER.fullmatch(text) if len(text) <= _LONGEST else None
    if match is None:
        raise UnitError(f"it must be {_allowed_form(wanted)}")
    number, unit = float(match[1]), match[2] or wanted.bare
    return _finite(number * _factor(unit, wanted) if unit else number, wanted)


def _finite(number: float, wanted: Kind) -> float:
    if not math.isfinite(number):
        raise UnitError(f"it is not a finite number; write {_allowed_form(wanted)}")
    return number


def _allowed_form(wanted: Kind) -> str:
    if not wanted.unit:
        return f"a number without a unit, e.g. {wanted.example}"
    rigid = f', or "{RIGID}"' if wanted.stiff else ""
    article = "an" if wanted.name[0] in "aeiouE" else "a"
    bare = f"a bare number in {wanted.bare or wanted.unit}"
    return f'{article} {wanted.name} with its unit, e.g. "{wanted.example}"{rigid}, or {bare}'


def _usual_factor(unit: str, si: str) -> float | None:
    """Return the SI value of one `unit`; None where it is not one of the usual ones of this SI unit."""
    return USUAL.get(_ascii(si), {}).get(_ascii(unit))


@cache
def _registry() -> "UnitRegistry[float]":
    show_array_libraries("pint")
    import pint

    return pint.UnitRegistry(str(UNITS))


def _in_root_units(unit: str) -> "PlainQuantity[float] | None":
    """Return one `unit` in pint's root units; None if there is no such unit."""
    show_array_libraries("pint")
    from pint import PintError

    try:
        return _registry().Quantity(1.0, _ascii(unit)).to_root_units()
    except (PintError, ValueError):
        return None


@cache
def _factor(unit: str, wanted: Kind) -> float:
    """Return the SI value of one `unit` of this kind.

    Angles are no dimension to pint, so that their powers are compared apart: see `KINDS_WITH_ANGLE`.
    """
    if UNIT.fullmatch(unit) is None:
        raise UnitError(f'"{unit}" is not a unit; write {_allowed_form(wanted)}')
    if unit == WITHOUT_ANGLE.get(wanted.name):
        return 1.0
    if (factor := _usual_factor(unit, wanted.unit)) is not None:
        return factor
    written, target = _in_root_units(unit), _in_root_units(wanted.unit)
    if written is None or target is None:
        raise UnitError(f'the unit "{unit}" is unknown; write {_allowed_form(wanted)}')
    power, wanted_power = (dict(quantity.unit_items()).get("radian", 0) for quantity in (written, target))
    misread = power != wanted_power and (power or wanted.name in KINDS_WITH_ANGLE)
    if written.dimensionality != target.dimensionality or misread:
        raise UnitError(f'"{unit}" is not a unit of {wanted.name}; write {_allowed_form(wanted)}')
    return float(written.magnitude / target.magnitude)

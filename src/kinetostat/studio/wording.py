"""Names, numbers and units as the page shows them. Computes nothing else."""

import math

from kinetostat.machine.parameters import Parameter
from kinetostat.spec.fields import Quantity
from kinetostat.units import KINDS
from kinetostat.views.display import PREFIXES

DIGITS = 6
"""Significant digits of a value that may be typed over."""
AXES = ("x", "y", "z")
VECTORS = ("offset", "moment", "force", "point", "axis", "first_axis", "second_axis", "far")
"""Fields whose entries are along x, y, z."""
DASH = "–"
MINUS = "\u2212"


def shown(quantity: Quantity, value: float) -> str:
    """A value as people write it, e.g. "220 mm", "30 deg", "20 N/µm"; `units.parse` reads it."""
    if value == quantity.unset or math.isinf(value):
        return quantity.show(value)
    kind, unit = quantity.kind, KINDS[quantity.kind].unit
    match kind:
        case "length":
            return f"{_digits(1e3 * value)} mm" if abs(value) < 10.0 else f"{_digits(value)} m"
        case "angle":
            return f"{_digits(math.degrees(value))} deg"
        case "linear stiffness" if abs(value) >= 1e6:
            return f"{_digits(1e-6 * value)} N/µm"
        case "elastic modulus":
            return f"{_digits(1e-9 * value)} GPa"
        case "area":
            return f"{_digits(1e4 * value)} cm**2"
        case "second moment of area":
            return f"{_digits(1e8 * value)} cm**4"
    return f"{_digits(value)} {unit}".rstrip()


def _digits(value: float) -> str:
    return f"{value:.{DIGITS}g}".replace("e+0", "e").replace("e+", "e")


def engineering(value: float | None, unit: str = "", digits: int = 4) -> str:
    """A result with an SI prefix: "3.628 kN/m"; infinity is "rigid or free", nothing is a dash."""
    if value is None or math.isnan(value):
        return DASH
    if math.isinf(value):
        return "∞"
    if unit in ("", "1") or value == 0.0:
        return f"{value:.{digits}g} {unit if unit != '1' else ''}".strip()
    power = 3 * math.floor(math.log10(abs(value) * (1.0 + 1e-12)) / 3)
    factor = min(max(10.0**power, min(PREFIXES)), max(PREFIXES))
    nearest = min(PREFIXES, key=lambda known: abs(math.log10(known / factor)))
    return f"{value / nearest:.{digits}g} {PREFIXES[nearest]}{unit}"


def scientific(value: float | None) -> str:
    """A matrix entry in four digits, e.g. "5.094e-7"; a dash where there is none."""
    if value is None:
        return DASH
    if math.isinf(value):
        return "∞"
    digits, _, power = f"{value:.3e}".partition("e")
    return "0" if value == 0.0 else f"{digits}e{int(power)}".replace("-", MINUS)


def label(parameter: Parameter) -> str:
    """The name of a parameter within its section: "base radius", "actuator 2", "offset z"."""
    name = parameter.path.split(".")[-1]
    if not name.isdecimal():
        return name.replace("_", " ")
    field = parameter.path.split(".")[-2]
    entry = AXES[int(name)] if field in VECTORS else str(int(name) + 1)
    return f"{field.replace('_', ' ')} {entry}"


def full_label(parameter: Parameter) -> str:
    """Its name with its section where that is not the pose: "x", "geometry: base radius"."""
    section = parameter.path.rsplit(".", 2 if parameter.path.split(".")[-1].isdecimal() else 1)[0]
    return label(parameter) if section == "pose" else f"{section.replace('.', ' ')}: {label(parameter)}"

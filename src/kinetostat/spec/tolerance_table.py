"""Table [tolerances] of machine files: how far numbers of the machine may be from the drawing. Nothing is evaluated.

The tolerance classes of two standards by nominal size come first, as these print them: grades IT1 to IT14 of ISO 286-1,
classes of ISO 2768-1. Which numbers a line is about depends on the machine, and is looked up in
`accuracy.toleranced_parts`.
"""

import math
import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from kinetostat.frozen import dataclass
from kinetostat.spec.arguments import as_list
from kinetostat.spec.document import Document, setting_value, toml_key, toml_value
from kinetostat.spec.errors import PRINTABLE, InputError, shorten
from kinetostat.units import UnitError, parse

MM, UM, MINUTE = 1e-3, 1e-6, math.pi / 180.0 / 60.0
"""Units of the standards in SI: m, m and rad."""

SIZES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500, 630, 800, 1000, 1250, 1600, 2000, 2500, 3150)
"""Upper ends of the ranges of nominal sizes, mm. Source: ISO 286-1:2010, table 1."""
GRADES = {
    1: (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8, 9, 10, 11, 13, 15, 18, 22, 26),
    2: (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10, 11, 13, 15, 18, 21, 25, 30, 36),
    3: (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15, 16, 18, 21, 24, 29, 35, 41, 50),
    4: (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 22, 25, 28, 33, 39, 46, 55, 68),
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27, 32, 36, 40, 47, 55, 65, 78, 96),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40, 44, 50, 56, 66, 78, 92, 110, 135),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63, 70, 80, 90, 105, 125, 150, 175, 210),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97, 110, 125, 140, 165, 195, 230, 280, 330),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155, 175, 200, 230, 260, 310, 370, 440, 540),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250, 280, 320, 360, 420, 500, 600, 700, 860),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400, 440, 500, 560, 660, 780, 920, 1100, 1350),
    12: (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630, 700, 800, 900, 1050, 1250, 1500, 1750, 2100),
    13: (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970, 1100, 1250, 1400, 1650, 1950, 2300, 2800,
         3300),
    14: (250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550, 1750, 2000, 2300, 2600, 3100, 3700,
         4400, 5400),
}  # fmt: skip
"""Width of the whole tolerance zone, µm, by grade and range of sizes. Source: ISO 286-1:2010, table 1."""
LENGTHS = (3, 6, 30, 120, 400, 1000, 2000, 4000)
"""Upper ends of the ranges of lengths, mm. Source: ISO 2768-1:1989, table 1."""
LENGTH_LIMITS = {
    "f": (0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, None),
    "m": (0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0),
    "c": (0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 4.0),
    "v": (None, 0.5, 1.0, 1.5, 2.5, 4.0, 6.0, 8.0),
}
"""Plus-minus, mm; None where the standard gives no value. Source: ISO 2768-1:1989, table 1."""
SIDES = (10, 50, 120, 400, math.inf)
"""Upper ends of the ranges of the shorter side of an angle, mm. Source: ISO 2768-1:1989, table 3."""
ANGLE_LIMITS = {
    "f": (60, 30, 20, 10, 5),
    "m": (60, 30, 20, 10, 5),
    "c": (90, 60, 30, 15, 10),
    "v": (180, 120, 60, 30, 20),
}
"""Plus-minus, minutes of arc. Source: ISO 2768-1:1989, table 3."""


def within_class(name: int | str, size: float, kind: str) -> float:
    """Return the greatest distance of a length (m) or an angle (rad) of a class from its nominal value either way.

    Args:
        name: a grade of ISO 286-1, 1 to 14, of which half of the zone counts; or "f", "m", "c" or "v" of ISO 2768-1.
        size: nominal length, or length of the shorter side of the angle, m.
        kind: "length" or "angle"; grades have lengths only.

    Raises:
        InputError: the size is beyond the table, or the class has no value there.
    """
    if isinstance(name, int):
        return 0.5 * UM * GRADES[name][_range_of(size, SIZES, f"IT{name}")]
    if kind == "angle":
        return MINUTE * ANGLE_LIMITS[name][_range_of(size, SIDES, f"ISO 2768-{name}")]
    limit = LENGTH_LIMITS[name][_range_of(size, LENGTHS, f"ISO 2768-{name}")]
    if limit is None:
        raise InputError(
            f"ISO 2768-{name} has no value for {size / MM:g} mm; take another class, or write the tolerance in mm."
        )
    return MM * limit


def _range_of(size: float, ends: Sequence[float], name: str) -> int:
    """Return the number of the range to which a nominal size belongs, rounded so that 400 mm is not above 400 mm."""
    millimetres = round(size / MM, 9)
    if not 0.0 < millimetres <= ends[-1]:
        reach = f"up to {ends[-1]:g} mm" if math.isfinite(ends[-1]) else "above 0"
        raise InputError(
            f"{name} has values for sizes {reach}, not for {millimetres:g} mm; write the tolerance with its unit."
        )
    return bisect_left(ends, millimetres)


TABLE = "tolerances"
"""Name of the table in files."""
MOST_LINES = 200
"""Lines of the table at most: one for each number of a large machine, so that more are a mistake."""
MOST_DEVIATIONS = 3
"""Values of a line: one for each kind of number, length, angle and share."""
LINE_WIDTH = 120
"""Characters of a name or a value."""
SIGMAS = 3.0
"""Standard deviations that a plus-minus stands for, where a number is normally distributed: 99.7 % lie within three."""
UNIFORM, NORMAL = "uniform", "normal"
"""Distributions of a number about its nominal value: evenly between its limits, or as a bell curve."""
LARGEST_TOLERANCE = {"length": 1.0, "angle": 0.5, "share": 0.5}
"""The largest tolerance of each kind, SI: beyond it errors are not small, and nothing here would hold."""
COSTS = (1e-6, 1e6)
"""The least and the greatest cost of a line, in units of those of other lines: any that mean something."""
LARGEST_SIZE = 1e3
"""The largest nominal size that may be written with a class, m: the tables of the standards end far below."""
LINE_KEYS = ("tolerance", "cost")
"""Keys of a line that is a table."""
TOLERANCE_FORM = (
    'write for example joints = "0.05 mm" (plus and minus), ["0.05 mm", "0.02 deg"] (lengths and angles), "sigma '
    '0.02 mm" (a standard deviation), "0.05 mm normal" (three of them), "IT7 at 300 mm" or "ISO 2768-m at 300 mm" '
    "(a class)"
)
"""End of the messages on what is not a tolerance."""

_SIGNS = re.compile(r"^(?:±|\+\s*/?\s*-)\s*")
_GRADE = re.compile(r"(?:ISO\s*286[\s:-]*)?IT\s*(\d{1,2})", re.IGNORECASE)
_CLASS = re.compile(r"(?:ISO\s*)?2768\s*-?\s*([fmcv])[HKL]?", re.IGNORECASE)


@dataclass(frozen=True)
class PlusMinus:
    """The greatest distance of a number from its nominal value, as it was written with its unit.

    Attributes:
        text: the text as it was written.
        spread: "uniform" or "normal", between or about the limits.
        kind: "length", "angle" or "share".
        limit: plus and minus, SI: three standard deviations of a normal distribution.
    """

    text: str
    spread: str
    kind: str
    limit: float

    def fits(self, kind: str) -> bool:
        """Return whether it can be the tolerance of a number of a kind."""
        return kind == self.kind

    def within(self, _kind: str, _size: float) -> float:
        """Return the plus and minus of a number, SI, which does not depend on its size."""
        return self.limit


@dataclass(frozen=True)
class StandardClass:
    """The greatest distance of a number from its nominal value, by a class of a standard.

    Attributes:
        text, spread: see `PlusMinus`.
        name: a grade of ISO 286-1, which has lengths only, or a class of ISO 2768-1: f, m, c or v.
        size: nominal size that was written with it, m; 0 if none was.
    """

    text: str
    spread: str
    name: int | str
    size: float

    def fits(self, kind: str) -> bool:
        """Return whether it can be the tolerance of a number of a kind."""
        return kind == "length" or (kind == "angle" and isinstance(self.name, str))

    def within(self, kind: str, size: float) -> float:
        """Return the plus and minus of a number, SI.

        Args:
            kind: "length" or "angle".
            size: its nominal size, m, where none was written; 0 if it has none.

        Raises:
            InputError: neither size is known, or the class has no value for it.
        """
        nominal = self.size or size
        if not nominal:
            raise InputError(f'"{self.text}" depends on a nominal size; write it, for example "{self.text} at 300 mm".')
        return within_class(self.name, nominal, kind)


Deviation = PlusMinus | StandardClass


@dataclass(frozen=True)
class Tolerance:
    """A line of the table: its subject, how far those numbers may deviate, and the cost of making them so.

    Attributes:
        about: a group, or a path in which * stands for anything.
        deviations: one for each kind of number.
        cost: the cost of making each of its numbers as written, compared with those of other lines.
    """

    about: str
    deviations: tuple[Deviation, ...]
    cost: float = 1.0

    @property
    def text(self) -> str:
        """Its values as written, by commas."""
        return ", ".join(deviation.text for deviation in self.deviations)

    def of(self, kind: str) -> Deviation | None:
        """Return the deviation of numbers of a kind; None if it says nothing about them."""
        return next((deviation for deviation in self.deviations if deviation.fits(kind)), None)


Tolerances = dict[str, Tolerance]
"""Tolerances by their subjects, in the order of the file: of two about the same number, the later one holds."""


def take_tolerances(document: Document, settings: Sequence[str], origin: str) -> tuple[Document, list[str], Tolerances]:
    """Separate the tolerances of a machine file, with their overrides, from the rest of it.

    Args:
        document: the document as written.
        settings: overrides "path=value"; what follows "tolerances." is what a tolerance is about, dots included. Lines
            that they give come after those of the file.
        origin: name of the file, for messages.

    Returns:
        The document and the settings without tolerances, and the tolerances.

    Raises:
        InputError: names the line, its value, what is allowed, and how to write it.
    """
    overrides = [text for text in as_list(settings) if re.match(rf"\s*{TABLE}\s*[.=]", text)]
    others = [text for text in as_list(settings) if text not in overrides]
    tolerances = read_tolerances(document.get(TABLE, {}), f'"{origin}": ')
    for setting in overrides:
        path, equals, value = setting.partition("=")
        if not equals:
            raise InputError(f'{shorten(setting)} must be {TABLE}.WHAT=VALUE, e.g. {TABLE}.joints="0.05 mm".')
        _, dot, about = path.partition(".")
        line = {about.strip().strip("\"'"): setting_value(value.strip())} if dot else setting_value(value.strip())
        tolerances = joined_tolerances(tolerances, read_tolerances(line))
    return {key: value for key, value in document.items() if key != TABLE}, others, tolerances


def joined_tolerances(tolerances: Mapping[str, Tolerance], further: Mapping[str, Tolerance]) -> Tolerances:
    """Return the tolerances with further ones after them, which hold where both are about the same number."""
    return {**{about: line for about, line in tolerances.items() if about not in further}, **further}


def read_tolerances(written: object, origin: str = "") -> Tolerances:
    """Read the table [tolerances].

    Args:
        written: values by what they are about; tables in it are parts of a path.
        origin: beginning of the message, which names the file.

    Raises:
        InputError: names the line, its value, what is allowed, and how to write it.
    """
    if not isinstance(written, Mapping):
        raise InputError(f"{origin}{TABLE} is {shorten(written)}; it must be a table: {TOLERANCE_FORM}.")
    lines = list(_lines(written))
    if len(lines) > MOST_LINES:
        raise InputError(f"{origin}{TABLE} has {len(lines)} lines; at most {MOST_LINES} are allowed.")
    return {about: _tolerance(about, value, f"{origin}{TABLE}.{about}") for about, value in lines}


def _lines(table: Mapping[Any, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Give the lines of a table, and of tables in it: `geometry.base_radius` need not stand in quotes."""
    for key, value in table.items():
        subject = f"{before}{key}"
        if isinstance(value, Mapping) and not {*LINE_KEYS} & value.keys():
            yield from _lines(value, f"{subject}.")
        else:
            yield subject, value


def _tolerance(about: str, value: object, place: str) -> Tolerance:
    if not about.strip() or len(about) > LINE_WIDTH or not re.match(PRINTABLE, about):
        raise InputError(f"{shorten(place)} cannot be looked up; give a group or a path, at most {LINE_WIDTH} letters.")
    table = value if isinstance(value, Mapping) else {"tolerance": value}
    if unknown := [key for key in table if key not in LINE_KEYS]:
        raise InputError(f"{place} has no field {shorten(unknown[0])}; it may have {' and '.join(LINE_KEYS)}.")
    entries = table.get("tolerance")
    texts = entries if isinstance(entries, list | tuple) else [entries]
    if not 0 < len(texts) <= MOST_DEVIATIONS:
        raise InputError(f"{place} has {len(texts)} values; give 1 to {MOST_DEVIATIONS}: {TOLERANCE_FORM}.")
    deviations = tuple(_deviation(text, place) for text in texts)
    for kind in LARGEST_TOLERANCE:
        if sum(deviation.fits(kind) for deviation in deviations) > 1:
            raise InputError(f"{place} has two tolerances of the kind {kind} ({shorten(entries)}); give one of them.")
    cost = table.get("cost", 1.0)
    if isinstance(cost, bool) or not isinstance(cost, int | float) or not COSTS[0] <= cost <= COSTS[1]:
        raise InputError(f"{place}.cost is {shorten(cost)}; give a number from {COSTS[0]:g} to {COSTS[1]:g}, e.g. 2.")
    return Tolerance(about, deviations, float(cost))


def _deviation(written: object, place: str) -> Deviation:
    """Read one value: a plus-minus, a standard deviation, or a class of a standard."""
    if not isinstance(written, str) or len(written) > LINE_WIDTH:
        raise InputError(
            f"{place} is {shorten(written)}; a tolerance is a text with a unit or a class: {TOLERANCE_FORM}."
        )
    text = " ".join(written.split())
    words, spread = text, UNIFORM
    for name in (UNIFORM, NORMAL):
        if words.lower().endswith(f" {name}"):
            words, spread = words[: -len(name) - 1], name
    name, has_size, size = words.partition(" at ")
    grade, general = _GRADE.fullmatch(name.strip()), _CLASS.fullmatch(name.strip())
    nominal = _size(size, place) if has_size and (grade or general) else 0.0
    if grade and int(grade[1]) not in GRADES:
        raise InputError(f"{place} is {shorten(written)}; grades IT{min(GRADES)} to IT{max(GRADES)} are known.")
    if grade:
        return StandardClass(text, spread, int(grade[1]), nominal)
    if general:
        return StandardClass(text, spread, general[1].lower(), nominal)
    factor = 1.0
    if words.lower().startswith("sigma "):
        words, factor, spread = words[len("sigma ") :], SIGMAS, NORMAL
    kind, limit = _amount(_SIGNS.sub("", words), written, place)
    return PlusMinus(text, spread, kind, factor * limit)


def _size(text: str, place: str) -> float:
    try:
        size = parse(text.strip(), "length")
    except UnitError as error:
        raise InputError(f"{place}: the nominal size is {shorten(text)}: {error}.") from None
    if not 0.0 < size <= LARGEST_SIZE:
        raise InputError(f'{place}: the nominal size is {shorten(text)}; give a length, e.g. "300 mm".')
    return size


def _amount(text: str, written: object, place: str) -> tuple[str, float]:
    """Return the kind and the SI value of a number with its unit, whose unit alone says the kind."""
    for kind, largest in LARGEST_TOLERANCE.items():
        try:
            value = parse(text, kind) if re.search(r"[^\d\s.eE+-]", text) else math.nan
        except UnitError:
            continue
        if not 0.0 <= value <= largest:
            break
        return kind, value
    length, angle, relative = LARGEST_TOLERANCE.values()
    raise InputError(
        f"{place} is {shorten(written)}, which is not a tolerance from 0 to {length:g} m, {angle:g} rad or "
        f"{100.0 * relative:g} %, with its unit; {TOLERANCE_FORM}."
    )


def tolerances_schema() -> dict[str, Any]:
    """Return the JSON Schema of the table."""
    text: dict[str, Any] = {"type": "string", "examples": ["0.05 mm", "sigma 0.02 mm", "IT7 at 300 mm", "20 um/m"]}
    value = {"anyOf": [text, {"type": "array", "items": text, "minItems": 1, "maxItems": MOST_DEVIATIONS}]}
    cost = {"type": "number", "minimum": COSTS[0], "maximum": COSTS[1], "description": "relative cost of making it so"}
    table = {"type": "object", "properties": {"tolerance": value, "cost": cost}, "required": ["tolerance"]}
    return {
        "type": "object",
        "description": "how far numbers may be from the drawing, by group (joints, zeros, gains, ...) or path",
        "additionalProperties": {"anyOf": [*value["anyOf"], table, {"type": "object"}]},
    }


def tolerance_lines(tolerances: Mapping[str, Tolerance]) -> Iterator[str]:
    """Give the lines of the table as TOML that reads back as the same tolerances; none without a tolerance."""
    if not tolerances:
        return
    yield from ("", f"[{TABLE}]")
    for about, line in tolerances.items():
        texts = [deviation.text for deviation in line.deviations]
        value = texts if len(texts) > 1 else texts[0]
        entry = value if line.cost == 1.0 else {"tolerance": value, "cost": line.cost}
        yield f"{toml_key(about)} = {toml_value(entry)}"

"""The vocabulary in which a family declares what people may write: quantities with a kind, bounds, a meaning; ranges.

A family's tables are plain frozen dataclasses whose fields are annotated with `Quantity`. From those annotations come
the validation, the JSON Schema, the field paths and the messages; no family writes any of them. A range of a field,
FIELD=from:to:count[:log], is read here, too. Libraries that check data or make schemas must not be imported here: every
command reads a machine.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Annotated, Any, TypeVar, dataclass_transform, get_type_hints

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.spec.document import is_whole_number
from kinetostat.spec.errors import InputError, shorten
from kinetostat.units import KINDS, RIGID, UnitError, parse, write, written_value

Table = TypeVar("Table")

LARGEST_OF_KIND = {"length": 1e6, "angle": 1e3}
"""Bounds on size, in SI: far beyond any machine, well inside float64."""
LARGEST_OTHER = 1e20
"""The bound of every other kind."""
LEAST_OF_KIND = {"length": 1e-12, "angle": 1e-12, "area": 1e-24, "second moment of area": 1e-48, "elastic modulus": 1.0}
"""Least values of what must be greater than 0, in SI: less than an atom, softer than a gel."""
LEAST_STIFFNESS = 1e-12
"""Least stiffness and rigidity but 0, in SI: far below a strand of protein, where machines are not."""

NO_LIMIT = "none"
"""The word for a limit that is not set."""


@dataclass_transform(frozen_default=True)
def table(cls: type[Table]) -> type[Table]:
    """Declare a table of a machine file: a frozen dataclass that refuses keys it does not have."""
    made = dataclass(frozen=True)(cls)
    made.__pydantic_config__ = {"extra": "forbid"}  # type: ignore[attr-defined]
    return made


@dataclass(frozen=True)
class Quantity:
    """The content of a field: annotate `float` with it, or a tuple of floats where `count` is given.

    Attributes:
        kind: a key of `units.KINDS`.
        meaning: one phrase for people, also the comment in templates.
        positive: whether zero is refused, and negative values with it; a stiffness may be zero (free), never negative.
        count: the number of values; None for a single one.
        apart: whether each of several values must be written, as components and angles; else one may stand for all.
        most: the largest value that is allowed, SI.
        least: the least size allowed for a value that is not 0, SI; 0 for that of the kind, see `least_size`.
        unset: the infinity that stands for "no limit"; None for a quantity that is not a limit.
        per_leg: whether there is a value for each actuated leg, in their order.
    """

    kind: str
    meaning: str
    positive: bool = False
    count: int | None = None
    apart: bool = False
    most: float = math.inf
    least: float = 0.0
    unset: float | None = None
    per_leg: bool = False

    @property
    def stiff(self) -> bool:
        """Whether it is a stiffness or a rigidity: from 0 (free) to "rigid"."""
        return KINDS[self.kind].stiff

    @property
    def least_size(self) -> float:
        """Least size of a value that is not 0, SI; 0.0 where any is allowed."""
        if self.least:
            return self.least
        if self.stiff:
            return LEAST_STIFFNESS
        return LEAST_OF_KIND.get(self.kind, 0.0) if self.positive else 0.0

    @property
    def entries(self) -> str:
        """A list of several values as people write it."""
        return f'a list of {self.count}, each such as "{KINDS[self.kind].example}"'

    def read(self, value: object) -> float | tuple[float, ...]:
        """Validate what was written: SI value, or a tuple of `count` of them.

        Raises:
            UnitError: with the reason.
        """
        if self.count is None:
            return self.number(value)
        if not isinstance(value, list | tuple):
            if self.apart:
                raise UnitError(f"it must be {self.entries}")
            return (self.number(value),) * self.count
        if len(value) != self.count:
            alike = "" if self.apart else ", or one value for all"
            raise UnitError(f"it has {len(value)} entries; give {self.count}{alike}")
        return tuple(self._entry(i, entry) for i, entry in enumerate(value))

    def _entry(self, i: int, value: object) -> float:
        """Return an entry of a list in SI; the reason why it cannot be read begins with its place."""
        try:
            return self.number(value)
        except UnitError as error:
            raise UnitError(f"entry {i}: {shorten(value)}: {error}") from None

    def number(self, value: object) -> float:
        """Return the SI value of a number or of text with a unit, within the bounds.

        Raises:
            UnitError: with the reason.
        """
        if self.unset is not None and isinstance(value, str) and value.strip().lower() == NO_LIMIT:
            return self.unset
        number = parse(value, self.kind)
        self.check(number)
        return number

    def check(self, number: float) -> None:
        """Refuse an SI value that is out of bounds; infinity stands for "rigid" of a stiffness, and for no limit.

        Raises:
            UnitError: with the reason.
        """
        kind = KINDS[self.kind]
        example = f'e.g. "{kind.example}"'
        if number == self.unset:
            return
        if math.isnan(number) or (math.isinf(number) and not (self.stiff and number > 0.0)):
            raise UnitError(f"it is not a finite number, {example}")
        if self.stiff and number < 0:
            raise UnitError(
                f'a {self.kind.split()[-1]} cannot be negative; write 0 for a free element, {example}, or "{RIGID}"'
            )
        if kind.unsigned and number < 0:
            raise UnitError(f"a {self.kind} cannot be negative, {example}")
        if self.positive and number <= 0:
            raise UnitError(f"it must be greater than 0, {example}")
        if number > self.most:
            most = f"{math.degrees(self.most):g} deg" if self.kind == "angle" else f"{self.most:g} {kind.unit}"
            raise UnitError(f"it must not exceed {most}, {example}")
        if 0.0 < abs(number) < self.least_size:
            advice = f"; write 0 for a free element, or {example}" if self.stiff else f", {example}"
            raise UnitError(f"it must be at least {self.least_size:g} {kind.unit}, and nothing is below that{advice}")
        largest = LARGEST_OF_KIND.get(self.kind, LARGEST_OTHER)
        if abs(number) > largest and not math.isinf(number):
            advice = f'; write "{RIGID}"' if self.stiff else ""
            raise UnitError(f"it must not exceed {largest:g} {kind.unit}{advice}")

    def show(self, value: float) -> str:
        """Return an SI value of it as text that a file may hold."""
        return NO_LIMIT if value == self.unset else write(value, self.kind)

    def in_file(self, value: float, like: object = None) -> str | float:
        """Return an SI value of it as people write it in a file, in the unit of what stood there before."""
        return NO_LIMIT if value == self.unset else written_value(value, self.kind, like)

    def __get_pydantic_json_schema__(self, _core: Any, _handler: Any) -> dict[str, Any]:
        """Return the JSON Schema of what may be written; pydantic asks for it in `machine.file_schema`."""
        kind = KINDS[self.kind]
        cross_section = ["object"] if self.stiff else []
        single = {"type": ["number", "string", *cross_section], "examples": [kind.example]}
        form = (
            f"a {kind.name} with its unit, or a bare number in {kind.unit}" if kind.unit else "a number without a unit"
        )
        rule = f"{self.meaning}; {form}"
        rule += f', or "{RIGID}"' if self.stiff else ""
        rule += f', or "{NO_LIMIT}"' if self.unset is not None else ""
        if self.count is None:
            return {**single, "description": rule}
        many = {"type": "array", "items": single, "minItems": self.count, "maxItems": self.count}
        if self.apart:
            return {**many, "description": f"{rule}; a list of {self.count}"}
        named_part = {"type": "string", "pattern": r"^\s*[A-Za-z].*\s"}
        series = [{"type": "array", "items": named_part, "minItems": 1}] if kind.name.endswith("stiffness") else []
        return {"anyOf": [single, many, *series], "description": f"{rule}; one for all, or a list of {self.count}"}


def positive_number(value: object, kind: str, name: str) -> float:
    """Read an argument or an option that must be greater than 0, and of a size that can be computed with.

    Args:
        value: a number (SI), or text with a unit.
        kind: a key of `KINDS`.
        name: the name of the argument, for the message.

    Raises:
        InputError: it is not such a quantity.
    """
    try:
        return Quantity(kind, "", positive=True).number(value)
    except UnitError as error:
        raise InputError(f"{name} is {shorten(value)}: {error}.") from None


along_axes = partial(Quantity, count=3, apart=True)
"""A quantity with a component along each of x, y and z."""
inertia_tensor = partial(Quantity, "inertia", count=6, apart=True)
"""Moments and products of inertia: xx, yy, zz, xy, xz, yz."""


@dataclass(frozen=True)
class Field:
    """A field of a table that is made while the program runs: what it holds, its default if it may be left out."""

    quantity: Quantity
    default: Any = None


def made_table(name: str, content: Mapping[str, Field], bases: tuple[type, ...] = ()) -> type:
    """Make the class of a table from its fields, optional ones last, and from the tables that it extends."""
    ordered = dict(sorted(content.items(), key=lambda item: item[1].default is not None))
    kinds = {key: float if single.quantity.count is None else tuple[float, ...] for key, single in ordered.items()}
    hints = {key: Annotated[kinds[key], single.quantity] for key, single in ordered.items()}
    defaults = {key: single.default for key, single in ordered.items() if single.default is not None}
    return table(type(name, bases, {"__annotations__": hints, "__module__": __name__, **defaults}))


@lru_cache(1024)
def quantities(table_type: type) -> Mapping[str, Quantity]:
    """Return the fields of a table by name."""
    hints = get_type_hints(table_type, include_extras=True)
    return MappingProxyType({field.name: hints[field.name].__metadata__[0] for field in fields(table_type)})


def optional(table_type: type) -> set[str]:
    """Return the names of the fields of a table that may be left out."""
    return {field.name for field in fields(table_type) if field.default is not MISSING}


def leaves(name: str, quantity: Quantity) -> Iterator[str]:
    """Give the names of the scalars of a field: itself, or one for each entry."""
    if quantity.count is None:
        yield name
    else:
        yield from (f"{name}.{i}" for i in range(quantity.count))


MOST_VALUES = 1_000_000
"""Values along one axis: a mistyped count is refused before memory runs out."""
RANGE_FORM = 'write FIELD=from:to:count or FIELD=from:to:count:log, e.g. pose.x="-2 cm:2 cm:41"'
"""End of the message on what is not a range."""


@dataclass(frozen=True)
class Range:
    """A field and the values it runs through, still as text.

    Attributes:
        field: the field as written.
        start, end: the ends, each a value of the field.
        count: the number of values, the ends included.
        logarithmic: whether they are spaced by a constant factor.
    """

    field: str
    start: str
    end: str
    count: int
    logarithmic: bool

    def values(self, quantity: Quantity) -> Array:
        """Return the values in SI.

        Raises:
            InputError: an end that the field does not allow, or one that is infinite or, for :log, not positive.
        """
        start, end = self._end(self.start, quantity), self._end(self.end, quantity)
        if not np.isfinite([start, end]).all():
            raise InputError(
                f'{self.field}: a range cannot end at "rigid"; write a large value, and analyse the rigid machine '
                "separately."
            )
        if not self.logarithmic:
            return np.linspace(start, end, self.count)
        if start <= 0 or end <= 0:
            raise InputError(
                f"{self.field}: a logarithmic range needs ends above 0, not {write(min(start, end), quantity.kind)}; "
                "leave out :log or raise the end."
            )
        return np.geomspace(start, end, self.count)

    def _end(self, text: str, quantity: Quantity) -> float:
        try:
            return quantity.number(text)
        except UnitError as error:
            example = KINDS[quantity.kind].example
            raise InputError(f"{self.field}: {shorten(text)}: {error} (in a range, e.g. {example}).") from None


def parse_range(text: str) -> Range:
    """Return a range from "FIELD=from:to:count[:log]".

    Raises:
        InputError: not of that form, or a count out of bounds.
    """
    field, equals, rest = text.partition("=")
    parts = [part.strip().strip('"') for part in rest.strip().strip('"').split(":")]
    logarithmic = len(parts) == 4 and parts[3] == "log"
    if not equals or not field.strip() or len(parts) - logarithmic != 3:
        raise InputError(f"{shorten(text)} is not a range; {RANGE_FORM}.")
    start, end, count, *_ = parts
    if not is_whole_number(count) or not 2 <= int(count) <= MOST_VALUES:
        raise InputError(f"{shorten(text)}: the count is {shorten(count)}; it must be 2 to {MOST_VALUES}.")
    return Range(field.strip(), start, end, int(count), logarithmic)

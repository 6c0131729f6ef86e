"""Ranges as people write them, FIELD=from:to:count[:log], to SI values. Which field is meant is decided elsewhere."""

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.units import KINDS, UnitError, write

MOST_VALUES = 1_000_000
"""Values along one axis."""

HOW = 'write FIELD=from:to:count or FIELD=from:to:count:log, e.g. pose.x="-2 cm:2 cm:41"'


@dataclass(frozen=True)
class Range:
    """A field and the values it runs through, still as text.

    Attributes:
        field: the field as written.
        start, end: the ends, each a value of the field.
        count: how many values, the ends included.
        logarithmic: whether they are spaced by a constant factor.
    """

    field: str
    start: str
    end: str
    count: int
    logarithmic: bool

    def values(self, quantity: Quantity) -> Array:
        """The values in SI.

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
    """A range from "FIELD=from:to:count[:log]".

    Raises:
        InputError: not of that form, or a count out of bounds.
    """
    field, equals, rest = text.partition("=")
    parts = [part.strip().strip('"') for part in rest.strip().strip('"').split(":")]
    logarithmic = len(parts) == 4 and parts[3] == "log"
    if not equals or not field.strip() or len(parts) - logarithmic != 3:
        raise InputError(f"{shorten(text)} is not a range; {HOW}.")
    count = parts[2]
    if not count.isdecimal() or not 2 <= int(count[:9]) <= MOST_VALUES:
        raise InputError(f"{shorten(text)}: the count is {shorten(count)}; it must be 2 to {MOST_VALUES}.")
    return Range(field.strip(), parts[0], parts[1], int(count), logarithmic)

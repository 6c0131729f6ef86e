"""Conditions on quantities as people write them, "free_stiffness_z > 20 N/um": read, and tested at many points."""

import math
import operator
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.renamed import current_name
from kinetostat.studies.grid.quantities import resolve_quantities
from kinetostat.units import KINDS, UnitError, parse

COMPARISONS = {"<=": operator.le, ">=": operator.ge, "<": operator.lt, ">": operator.gt}
HOW = 'write QUANTITY < VALUE or QUANTITY > VALUE, e.g. "free_stiffness_z > 20 N/um"'
LONGEST = 200

_FORM = re.compile(r"\s*([a-z_]+)\s*(<=|>=|<|>)\s*([^<>=]+?)\s*")
_BY_UNIT = {
    kind.unit: kind.name
    for kind in KINDS.values()
    if kind.name.endswith(("stiffness", "compliance")) or kind.name in ("length", "force", "moment", "mass")
}


@dataclass(frozen=True)
class Condition:
    """A quantity compared with a value.

    Attributes:
        text: as written, with single spaces.
        quantity: its name.
        comparison: "<", "<=", ">" or ">=".
        value: SI.
    """

    text: str
    quantity: str
    comparison: str
    value: float

    def holds(self, values: Array) -> Mask:
        """Where the quantity, given in SI, meets the condition; not where it is NaN."""
        return np.asarray(COMPARISONS[self.comparison](values, self.value))


def parse_condition(text: str, components: Sequence[str]) -> Condition:
    """A condition from text.

    Args:
        text: "QUANTITY < VALUE".
        components: that the machine has.

    Raises:
        InputError: not of that form, an unknown quantity, or a value of another kind.
    """
    match = _FORM.fullmatch(text) if len(text) <= LONGEST else None
    if match is None:
        raise InputError(f"{shorten(text)} is not a condition; {HOW}.")
    given, comparison, written = match.groups()
    name = current_name(given, "quantity")
    if name in GROUPS:
        raise InputError(f'"{name}" stands for several quantities; name one of {", ".join(GROUPS[name])}.')
    resolve_quantities([name], components)
    value = value_of(QUANTITIES[name].unit, written, f"the condition on {name}")
    return Condition(f"{name} {comparison} {written}", name, comparison, value)


def value_of(unit: str, written: float | str | None, where: str) -> float:
    """The value, SI, with which a quantity of some unit is compared; `where` it is written goes into messages.

    Raises:
        InputError: it is of another kind, or not finite.
    """
    try:
        if unit in _BY_UNIT:
            return _finite(parse(written, _BY_UNIT[unit]))
        return _finite(float(written if written is not None else math.nan))
    except UnitError as error:
        raise InputError(f"in {where}, {shorten(written)}: {error}.") from None
    except ValueError:
        raise InputError(f"in {where}, {shorten(written)} must be a plain number, e.g. 0.05.") from None


def _finite(value: float) -> float:
    if not np.isfinite(value):
        raise UnitError('no condition can ask for "rigid"; give a large value')
    return value

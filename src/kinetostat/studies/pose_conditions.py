"""Conditions on poses as people write them: a quantity compared with a value, "free_stiffness_z > 20 N/um"."""

import math
import operator
import re
from collections.abc import Sequence

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.renamed import current_name
from kinetostat.studies.quantities import resolve_quantities
from kinetostat.units import KINDS, UnitError, parse

COMPARISONS = {"<=": operator.le, ">=": operator.ge, "<": operator.lt, ">": operator.gt}
"""Comparisons of a condition, and their functions."""
CONDITION_FORM = 'write QUANTITY < VALUE or QUANTITY > VALUE, e.g. "free_stiffness_z > 20 N/um"'
"""The end of messages about a text that is not a condition."""
LONGEST_CONDITION = 200
"""Characters of a condition; a longer text is refused unread."""
_CONDITION = re.compile(r"\s*([a-z_]+(?:_\d+)?)\s*(<=|>=|<|>)\s*([^<>=]+?)\s*")
"""A condition: quantity, comparison and value."""
COMPARED_KINDS = (
    "length", "angle", "force", "moment", "mass", "frequency", "speed", "rate", "acceleration", "angular acceleration",
)  # fmt: skip
"""Kinds of quantities beside stiffnesses and compliances, of which several have one unit."""
KIND_OF_UNIT = {
    kind.unit: kind.name
    for kind in KINDS.values()
    if kind.name.endswith(("stiffness", "compliance")) or kind.name in COMPARED_KINDS
}
"""Kind of the value with which a quantity of a unit is compared; values of other units are plain numbers."""


@dataclass(frozen=True)
class PoseCondition:
    """A quantity compared with a value.

    Attributes:
        text: the condition as written, with single spaces.
        quantity: name of the quantity.
        comparison: "<", "<=", ">" or ">=".
        value: the value with which it is compared, SI.
    """

    text: str
    quantity: str
    comparison: str
    value: float

    @property
    def wants_more(self) -> bool:
        """Whether greater values are better: the comparison is > or >=."""
        return self.comparison.startswith(">")

    def holds(self, values: Array) -> Mask:
        """Tell at which points the quantity, given in SI, meets the condition; where it is NaN, it does not."""
        return np.asarray(COMPARISONS[self.comparison](values, self.value))


def parse_condition(text: str, components: Sequence[str]) -> PoseCondition:
    """Read a condition from text.

    Args:
        text: "QUANTITY < VALUE".
        components: components that the machine has.

    Raises:
        InputError: not of that form, an unknown quantity, or a value of another kind.
    """
    match = _CONDITION.fullmatch(text) if len(text) <= LONGEST_CONDITION else None
    if match is None:
        raise InputError(f"{shorten(text)} is not a condition; {CONDITION_FORM}.")
    quantity, comparison, written = match.groups()
    name = current_name(quantity, "quantity")
    if name in GROUPS:
        raise InputError(f'"{name}" stands for several quantities; name one of {", ".join(GROUPS[name])}.')
    resolve_quantities([name], components)
    value = value_of(QUANTITIES[name].unit, written, f"the condition on {name}")
    return PoseCondition(f"{name} {comparison} {written}", name, comparison, value)


def value_of(unit: str, written: float | str | None, where: str) -> float:
    """Read the value, SI, with which a quantity of some unit is compared; `where` it is written goes into messages.

    Raises:
        InputError: it is of another kind, or not finite.
    """
    try:
        if unit in KIND_OF_UNIT:
            return _finite(parse(written, KIND_OF_UNIT[unit]))
        return _finite(float(written if written is not None else math.nan))
    except UnitError as error:
        raise InputError(f"in {where}, {shorten(written)}: {error}.") from None
    except ValueError:
        raise InputError(f"in {where}, {shorten(written)} must be a plain number, e.g. 0.05.") from None


def _finite(value: float) -> float:
    if not np.isfinite(value):
        raise UnitError('no condition can ask for "rigid"; give a large value')
    return value

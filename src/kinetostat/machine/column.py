"""Many numbers as one scalar: a NumPy array whose operators know structural zeros and ones. No formula lives here.

It is what parameters become in a batch of machines or poses. With it a formula of `algebra`, such as
`a * c - b * b`, runs over a whole batch and skips what is zero by form.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.arrays import AnyArray, Array

_new = object.__new__


class Column:
    """Numbers or truth values, one per pose, that drop a Python float of exactly 0.0 or 1.0 from products and sums.

    Such a float is zero (one) by form, at every pose. The result is then the float 0.0, or the column itself: sparse
    screws cost what their non-zeros cost, and a structural zero stays one through a whole formula. Everything else is
    NumPy's own arithmetic, in the precision of the array; NumPy's functions take a column as the array that it wraps.

    It wraps its array instead of deriving from it, because NumPy spends longer on a derived class than on the
    arithmetic of some hundred numbers.

    Attributes:
        values: the numbers or truth values [poses].
    """

    __slots__ = ("values",)
    __array_priority__ = 1000.0  # an array on the left leaves the operation to the column

    values: AnyArray

    def __init__(self, values: AnyArray) -> None:
        self.values = values

    def __add__(self, other: Scalar) -> Scalar:
        if other.__class__ is Column:
            return _wrap(self.values + other.values)
        return self if other.__class__ is float and other == 0.0 else _wrap(self.values + other)

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Scalar:
        if other.__class__ is Column:
            return _wrap(self.values - other.values)
        return self if other.__class__ is float and other == 0.0 else _wrap(self.values - other)

    def __rsub__(self, other: Scalar) -> Scalar:
        return -self if other.__class__ is float and other == 0.0 else _wrap(other - self.values)

    def __mul__(self, other: Scalar) -> Scalar:
        if other.__class__ is Column:
            return _wrap(self.values * other.values)
        if other.__class__ is float and (other == 0.0 or other == 1.0):
            return self if other else 0.0
        return _wrap(self.values * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Scalar:
        return _wrap(self.values / plain(other))

    def __rtruediv__(self, other: Scalar) -> Scalar:
        return _wrap(other / self.values)

    def __neg__(self) -> "Column":
        return _wrap(-self.values)

    def __abs__(self) -> "Column":
        return _wrap(np.abs(self.values))

    def __lt__(self, other: Scalar) -> "Column":
        return _wrap(self.values < plain(other))

    def __le__(self, other: Scalar) -> "Column":
        return _wrap(self.values <= plain(other))

    def __gt__(self, other: Scalar) -> "Column":
        return _wrap(self.values > plain(other))

    def __ge__(self, other: Scalar) -> "Column":
        return _wrap(self.values >= plain(other))

    def __and__(self, other: Scalar) -> "Column":
        return _wrap(self.values & plain(other))

    __rand__ = __and__

    def __eq__(self, other: object) -> Any:
        return self.values == plain(other)

    def __ne__(self, other: object) -> Any:
        return self.values != plain(other)

    __hash__ = None  # type: ignore[assignment]  # as an array

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, places: Any) -> Any:
        return self.values[places]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        return self.values.shape

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> AnyArray:
        array = self.values if dtype is None else self.values.astype(dtype, copy=False)
        return array.copy() if copy else array

    def __array_namespace__(self, *, api_version: str | None = None) -> Any:
        return _Functions


def _wrap(values: AnyArray) -> Column:
    """Make a column without the call of `__init__`, which would cost a tenth of the whole batch."""
    wrapped = _new(Column)
    wrapped.values = values
    return wrapped


class _Functions:
    """The functions of `algebra.scalar` over columns."""

    @staticmethod
    def sqrt(a: Column) -> Column:
        return _wrap(np.sqrt(a.values))

    @staticmethod
    def sin(a: Column) -> Column:
        return _wrap(np.sin(a.values))

    @staticmethod
    def cos(a: Column) -> Column:
        return _wrap(np.cos(a.values))

    @staticmethod
    def atan2(y: Scalar, x: Scalar) -> Column:
        return _wrap(np.arctan2(plain(y), plain(x)))

    @staticmethod
    def where(condition: Any, a: Scalar, b: Scalar) -> Column:
        """`a` where the condition holds, `b` elsewhere."""
        return _wrap(np.where(condition.values, plain(a), plain(b)))


def column(values: Any) -> Any:
    """Return an array as a column; anything else, a float or a traced value, as it is."""
    return Column(values) if type(values) is np.ndarray else values


def plain(values: Any) -> Any:
    """Return the array of a column; anything else as it is."""
    return values.values if values.__class__ is Column else values


def stacked_columns(scalars: Sequence[Scalar], count: int) -> Array:
    """Stack scalars as columns [n x scalars]."""
    if not scalars:
        return np.zeros((count, 0))
    return np.stack([np.broadcast_to(np.asarray(s, dtype=float), (count,)) for s in scalars], axis=1)

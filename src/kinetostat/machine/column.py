"""Many numbers as one scalar: a NumPy array whose operators know structural zeros and ones. No formula lives here.

It is what parameters become in a batch of machines or poses. With it a formula of `algebra`, such as
`a * c - b * b`, runs over a whole batch and skips what is zero by form.
"""

from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar


class Column(np.ndarray[Any, Any]):
    """An array of numbers, one per pose, that drops a Python float of exactly 0.0 or 1.0 from products and sums.

    Such a float is zero (one) by form, at every pose. The result is then the float 0.0, or the column itself: sparse
    screws cost what their non-zeros cost, and a structural zero stays one through a whole formula. Everything else is
    NumPy's own arithmetic, in the precision of the array.
    """

    def __add__(self, other: Scalar) -> Scalar:
        return self if type(other) is float and other == 0.0 else np.ndarray.__add__(self, other)

    def __radd__(self, other: Scalar) -> Scalar:
        return self if type(other) is float and other == 0.0 else np.ndarray.__radd__(self, other)

    def __sub__(self, other: Scalar) -> Scalar:
        return self if type(other) is float and other == 0.0 else np.ndarray.__sub__(self, other)

    def __rsub__(self, other: Scalar) -> Scalar:
        return -self if type(other) is float and other == 0.0 else np.ndarray.__rsub__(self, other)

    def __mul__(self, other: Scalar) -> Scalar:
        if type(other) is float and (other == 0.0 or other == 1.0):
            return self if other else 0.0
        return np.ndarray.__mul__(self, other)

    __rmul__ = __mul__

    def __array_namespace__(self, *, api_version: str | None = None) -> Any:
        return _Functions


class _Functions:
    """The functions of `algebra.scalar` over columns."""

    sqrt, sin, cos = np.sqrt, np.sin, np.cos

    @staticmethod
    def where(condition: Any, a: Scalar, b: Scalar) -> Column:
        """`a` where the condition holds, `b` elsewhere; NumPy's own function would forget that they are columns."""
        return np.asarray(np.where(condition, a, b)).view(Column)


def column(values: Any) -> Any:
    """Return an array as a column; anything else, a float or a traced value, as it is."""
    return values.view(Column) if type(values) is np.ndarray else values

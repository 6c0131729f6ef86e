"""Scalars: one set of functions over floats, columns of numbers and traced values.

No vectors, no matrices here. Everything in `algebra` is built from these scalars as a structure of arrays: a
formula written once is a float computation at one pose, a computation over columns (any precision) at many or, traced
by the engine (or by JAX), one fused SIMD loop. A Python float that is exactly 0.0 is a structural zero: it drops out of
products and sums while the formula is traced, so that sparse screws cost what their non-zeros cost.
"""

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

Scalar: TypeAlias = Any
"""A float, a NumPy array or a traced value: whatever carries + - * / and, if not a float, `__array_namespace__`."""


def is_zero(a: Scalar) -> bool:
    """Whether `a` is a structural zero: the Python float 0.0, never an array that happens to hold zeros."""
    return type(a) is float and a == 0.0


def is_one(a: Scalar) -> bool:
    """Whether `a` is a structural one: the Python float 1.0 itself."""
    return type(a) is float and a == 1.0


def is_infinite(a: Scalar) -> bool:
    """Whether `a` is infinite by form, as what is rigid or free may be: the Python float infinity, never an array."""
    return type(a) is float and a == math.inf


def weighted(weight: Scalar, amount: Scalar) -> Scalar:
    """weight * amount, and exactly 0 where the amount is exactly 0, even if the weight is infinite.

    For weights that may be infinite: the compliance of a free spring, the reciprocal of an exact zero. A load that a
    free spring does not feel does not deform it, so that 0 times infinity is 0 there, not NaN.
    """
    if (type(amount) is float and amount == 0.0) or (type(weight) is float and weight == 0.0):
        return 0.0
    return weight * amount


def total(terms: list[Scalar]) -> Scalar:
    """Sum of `terms`, left to right; 0.0 when there are none."""
    result: Scalar = 0.0
    for term in terms:
        result = result + term
    return result


def inner_product(left: Sequence[Scalar], right: Sequence[Scalar]) -> Scalar:
    """Sum of the products of two rows of equal length, entry by entry, left to right."""
    return total([a * b for a, b in zip(left, right, strict=True)])


def sqrt(a: Scalar) -> Scalar:
    """Square root; NaN for a negative argument, as arrays do, so that a caller can mask it with a status."""
    if isinstance(a, float):
        return math.sqrt(a) if a >= 0.0 else math.nan
    return a.__array_namespace__().sqrt(a)


def sin(a: Scalar) -> Scalar:
    """Sine of an angle in rad."""
    return math.sin(a) if isinstance(a, float) else a.__array_namespace__().sin(a)


def cos(a: Scalar) -> Scalar:
    """Cosine of an angle in rad."""
    return math.cos(a) if isinstance(a, float) else a.__array_namespace__().cos(a)


def arctan2(y: Scalar, x: Scalar) -> Scalar:
    """Angle in rad of the point (x, y), between -pi and pi."""
    if isinstance(y, float) and isinstance(x, float):
        return math.atan2(y, x)
    return (x if isinstance(y, float) else y).__array_namespace__().atan2(y, x)


def steady(a: Scalar) -> Scalar:
    """The number itself, which derivatives of traced formulas take for a constant."""
    constant = _function_of_trace(a, "steady")
    return constant(a) if constant else a


def is_bounded(a: Scalar) -> bool:
    """Whether `a` is finite by form: a float that is, or a traced value whose bounds are known."""
    if isinstance(a, float):
        return math.isfinite(a)
    bounded = _function_of_trace(a, "bounded")
    return bounded(a) if bounded else False


def finite(a: Scalar) -> Scalar:
    """The number itself, which traced comparisons with infinity take for finite, as the caller knows it to be."""
    mark = _function_of_trace(a, "finite")
    return mark(a) if mark else a


def ordinary(a: Scalar) -> Scalar:
    """The number itself, which traced code takes for positive, and far from 0 and infinity, as the caller knows."""
    mark = _function_of_trace(a, "ordinary")
    return mark(a) if mark else a


def _function_of_trace(a: Scalar, name: str) -> Any:
    """A function of traced values alone; None for other scalars."""
    traced = getattr(a, "__array_namespace__", None)
    return getattr(traced(), name, None) if traced else None


def where(condition: Scalar, a: Scalar, b: Scalar) -> Scalar:
    """`a` where the condition holds, `b` elsewhere."""
    if not hasattr(condition, "__array_namespace__"):
        return a if condition else b
    return condition.__array_namespace__().where(condition, a, b)


def smaller(a: Scalar, b: Scalar) -> Scalar:
    """The smaller of the two; `b` where either is NaN, so that a NaN that comes last is kept."""
    return where(a < b, a, b)


def larger(a: Scalar, b: Scalar) -> Scalar:
    """The larger of the two; `b` where either is NaN."""
    return where(a > b, a, b)


def reciprocal(a: Scalar) -> Scalar:
    """1 / a for a >= 0 with the ends of the scale exchanged exactly: 0 gives infinity, infinity gives 0."""
    if isinstance(a, float):
        return 1.0 / a if a != 0.0 else math.inf
    return 1.0 / a

"""Jets: a number with its rates along two directions and the rate of one by the other (hyper-dual numbers).

A formula over scalars that is given jets gives its exact first and second derivatives along them. No formula of a
machine lives here.

Source: J. A. Fike and J. J. Alonso, "The development of hyper-dual numbers for exact second-derivative calculations",
AIAA Paper 2011-886.
"""

from typing import Any, NoReturn

from kinetostat.algebra.scalar import Scalar, arctan2, cos, is_one, is_zero, reciprocal, sin, sqrt, weighted, where
from kinetostat.frozen import dataclass


@dataclass(frozen=True)
class Jet:
    """A number a + b e1 + c e2 + d e1 e2 with e1² = e2² = 0: it depends on two amounts to first order in each.

    Attributes:
        value: the number.
        first, second: its rates by each amount.
        mixed: the rate of the first rate by the second amount.
    """

    value: Scalar
    first: Scalar = 0.0
    second: Scalar = 0.0
    mixed: Scalar = 0.0

    def __add__(self, other: Scalar) -> "Jet":
        b = jet_of(other)
        return Jet(self.value + b.value, self.first + b.first, self.second + b.second, self.mixed + b.mixed)

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> "Jet":
        return self + -jet_of(other)

    def __rsub__(self, other: Scalar) -> "Jet":
        return jet_of(other) - self

    def __mul__(self, other: Scalar) -> Scalar:
        # Structural zeros and ones stay what they are, so that they cost a traced program nothing.
        if is_zero(other) or is_one(other):
            return self if other else 0.0
        b = jet_of(other)
        return Jet(
            self.value * b.value,
            self.first * b.value + self.value * b.first,
            self.second * b.value + self.value * b.second,
            self.mixed * b.value + self.first * b.second + self.second * b.first + self.value * b.mixed,
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Scalar:
        return self * _inverse(jet_of(other))

    def __rtruediv__(self, other: Scalar) -> Scalar:
        return jet_of(other) * _inverse(self)

    def __neg__(self) -> "Jet":
        return Jet(*(0.0 if is_zero(part) else -part for part in self.parts))

    def __abs__(self) -> Scalar:
        return where(self < 0.0, -self, self)

    def __lt__(self, other: Scalar) -> Scalar:
        return _condition(self.value < jet_of(other).value)

    def __le__(self, other: Scalar) -> Scalar:
        return _condition(self.value <= jet_of(other).value)

    def __gt__(self, other: Scalar) -> Scalar:
        return _condition(self.value > jet_of(other).value)

    def __ge__(self, other: Scalar) -> Scalar:
        return _condition(self.value >= jet_of(other).value)

    def __bool__(self) -> NoReturn:
        raise TypeError("a jet is not a truth value")

    def __array_namespace__(self, *, api_version: str | None = None) -> Any:
        return _JetFunctions

    @property
    def parts(self) -> tuple[Scalar, ...]:
        """The number, its rates and the mixed rate."""
        return self.value, self.first, self.second, self.mixed

    def image(self, value: Scalar, slope: Scalar, curvature: Scalar) -> "Jet":
        """The image of this number under a function, from the function's value and its first two derivatives there."""
        rates = [weighted(slope, rate) for rate in (self.first, self.second, self.mixed)]
        return Jet(value, rates[0], rates[1], rates[2] + weighted(curvature, self.first * self.second))


@dataclass(frozen=True)
class JetCondition:
    """A condition on the values of jets, between which it chooses."""

    holds: Scalar

    def __and__(self, other: Any) -> Any:
        return _condition(self.holds & (other.holds if isinstance(other, JetCondition) else other))

    __rand__ = __and__

    def __array_namespace__(self, *, api_version: str | None = None) -> Any:
        return _JetFunctions


def _condition(holds: Any) -> Any:
    """A condition as `where` takes it: a plain truth value stays one."""
    return holds if isinstance(holds, bool) else JetCondition(holds)


def jet_of(number: Scalar) -> Jet:
    """A number as a jet: one that depends on nothing has no rates."""
    return number if isinstance(number, Jet) else Jet(number)


def _inverse(a: Jet) -> Jet:
    shrink = reciprocal(a.value)
    square = shrink * shrink
    return a.image(shrink, -square, 2.0 * square * shrink)


class _JetFunctions:
    """The functions of `algebra.scalar` over jets."""

    @staticmethod
    def sqrt(a: Jet) -> Jet:
        root = sqrt(a.value)
        slope = 0.5 * reciprocal(root)
        return a.image(root, slope, -0.5 * slope * reciprocal(a.value))

    @staticmethod
    def sin(a: Jet) -> Jet:
        sine = sin(a.value)
        return a.image(sine, cos(a.value), -sine)

    @staticmethod
    def cos(a: Jet) -> Jet:
        cosine = cos(a.value)
        return a.image(cosine, -sin(a.value), -cosine)

    @staticmethod
    def atan2(y: Scalar, x: Scalar) -> Jet:
        """Angle of a point: its rate is (x dy - y dx) / r^2; the mixed rate is the derivative of this quotient."""
        y, x = jet_of(y), jet_of(x)
        shrink = 1.0 / (x.value * x.value + y.value * y.value)
        first = (x.value * y.first - y.value * x.first) * shrink
        second = (x.value * y.second - y.value * x.second) * shrink
        numerator_rate = x.second * y.first + x.value * y.mixed - y.second * x.first - y.value * x.mixed
        square_rate = 2.0 * (x.value * x.second + y.value * y.second)
        return Jet(arctan2(y.value, x.value), first, second, (numerator_rate - first * square_rate) * shrink)

    @staticmethod
    def where(condition: Any, a: Scalar, b: Scalar) -> Scalar:
        """`a` where the condition holds, `b` elsewhere; a rate that both have, such as a structural zero, is kept."""
        pairs = zip(jet_of(a).parts, jet_of(b).parts, strict=True)
        return Jet(*(left if left is right else where(condition.holds, left, right) for left, right in pairs))

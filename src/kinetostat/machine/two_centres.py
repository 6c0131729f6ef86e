"""Legs whose passive joints turn about two points, two axes about one and three about the other: U-P-S and its like.

Such a leg carries a force along the line through both points and nothing else, however its joints are written. Here is
that line, and how near the joints are to locking up: the singularity margin of the five twists in closed form, where
`solve.complement` would triangularise them. What springs make of the force is not this file's business.

Source: theory (1) and (2). All in the base frame.
"""

from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal, sqrt, total, where
from kinetostat.algebra.screw import Wrench, force_along
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass

PAIR, BALL = 2, 3
"""Axes about either point."""


@dataclass(frozen=True)
class TwoCentres:
    """Axes about two points.

    Attributes:
        point: that of both which is nearer to the platform, m.
        along: unit vector to it from the other one.
        ball: the point about which three axes turn, m.
        distance: how far it lies along the line from the other one, m: negative if it is nearer to the base.
        pair_axes, ball_axes: unit vectors of the axes.
    """

    point: Vector
    along: Vector
    ball: Vector
    distance: Scalar
    pair_axes: tuple[Vector, ...]
    ball_axes: tuple[Vector, ...]

    def wrench(self, reference: Vector) -> Wrench:
        """The unit force along the line, at `reference` (base frame, m)."""
        return force_along(self.along, self.point - reference)

    def square(self, reference: Vector, length: Scalar) -> Scalar:
        """The square of the size of this wrench, moments over `length`."""
        moment = self.wrench(reference).rotational * reciprocal(length)
        return moment.dot(moment) + 1.0

    def singularity_margin(self, reference: Vector, length: Scalar) -> Scalar:
        """The margin 5 / (|V| |V+|) of the five unit twists V at a point (m), lengths divided by `length`.

        A row of V+ is the wrench that works on one twist alone and has no share of the force along the line. For an
        axis of the pair it is a force through the ball, across the line, whose moment about the other axis vanishes.
        For an axis of the ball it is the moment dual to the three, with forces that keep it from turning the pair.

        Returns:
            0 where the axes of the ball or the pair lock up, or the line is in the plane of the pair.
        """
        shrink, along = reciprocal(length), self.along
        arm, line = (reference - self.ball) * shrink, self.wrench(reference).rotational * shrink
        size = reciprocal(self.square(reference, length))
        first, second = self.pair_axes
        weight = reciprocal(self.distance * shrink * second.dot(along.cross(first)))
        forces = [(along * second.dot(along) - second) * weight, (first - along * first.dot(along)) * weight]
        moments = [force.cross(arm) for force in forces]
        left = [moment - line * (moment.dot(line) * size) for moment in moments]
        rows, square = _dual(self.ball_axes)
        turned = [[row.dot(axis) for row in rows] for axis in self.pair_axes]
        felt = [
            (moments[i].dot(left[j]) + forces[i].dot(forces[j])) * (float(i == j) + _inner(turned[i], turned[j]))
            for i, j in ((0, 0), (0, 1), (1, 1))
        ]
        mixed = [_inner(turns, [row.dot(part) for row in rows]) for turns, part in zip(turned, left, strict=True)]
        along_line = [row.dot(line) for row in rows]
        inverse = square - size * _inner(along_line, along_line) + felt[0] + felt[2] + 2.0 * (felt[1] - total(mixed))
        margin = float(PAIR + BALL) * reciprocal(sqrt(self._squares(arm, shrink) * inverse))
        return where(margin > 0.0, where(margin < 1.0, margin, 1.0), 0.0)

    def _squares(self, arm: Vector, shrink: Scalar) -> Scalar:
        """The sum of the squares of all components of the five twists; that of a x r is r^2 - (a r)^2."""
        other = arm + self.along * (self.distance * shrink)
        arms = float(BALL) * arm.dot(arm) + float(PAIR) * other.dot(other)
        along = [axis.dot(arm) for axis in self.ball_axes] + [axis.dot(other) for axis in self.pair_axes]
        return float(PAIR + BALL) + (arms - _inner(along, along))


def two_centres(start: Vector, end: Vector, first: Sequence[Vector], second: Sequence[Vector]) -> TwoCentres:
    """Axes about two points of a leg, `first` about `start` and `second` about `end`, from the base (m, base frame)."""
    span = end - start
    distance = span.norm()
    along = span * reciprocal(distance)
    if len(second) == BALL:
        return TwoCentres(end, along, end, distance, tuple(first), tuple(second))
    return TwoCentres(end, along, start, -distance, tuple(second), tuple(first))


def _dual(axes: Sequence[Vector]) -> tuple[list[Vector], Scalar]:
    """The vectors that have a product of 1 with one axis of three and 0 with the others, and their squares' sum."""
    first, second, third = axes
    shrink = reciprocal(second.dot(third.cross(first)))
    rows = [second.cross(third) * shrink, third.cross(first) * shrink, first.cross(second) * shrink]
    if is_zero(second.dot(first)) and is_zero(second.dot(third)):
        return [rows[0], second, rows[2]], 1.0 + 2.0 * (shrink * shrink)
    return rows, total([row.dot(row) for row in rows])


def _inner(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    return total([p * q for p, q in zip(a, b, strict=True)])

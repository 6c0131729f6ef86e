"""Legs whose passive joints turn about two points, two axes about one and three about the other, such as U-P-S.

Such a leg carries a force along the line through both points and nothing else, whatever joints its axes belong to. This
file has that line, and how near the joints are to locking up: the singularity margin of the five twists in closed form,
for which `solve.complement` would triangularise them. Springs are not considered here.

Source: theory (1) and (2). All in the base frame.
"""

from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal, sqrt, total, where
from kinetostat.algebra.screw import Wrench, force_along
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass

PAIR, BALL = 2, 3
"""Numbers of axes about the two points."""


@dataclass(frozen=True)
class TwoCentres:
    """The axes of a leg's passive joints: a pair through one point, and three, a ball, through the other.

    Attributes:
        point: the one of both points that is nearer to the platform, m.
        along: unit vector of the line, from the other point to this one.
        ball: the point through which three axes pass, m.
        distance: how far the ball lies along the line from the pair, m: negative if it is nearer to the base.
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
        """The square of the size of the wrench at `reference`, with its moment divided by `length`."""
        moment = self.wrench(reference).rotational * reciprocal(length)
        return moment.dot(moment) + 1.0

    def singularity_margin(self, reference: Vector, length: Scalar) -> Scalar:
        """The margin 5 / (|V| |V+|) of the five unit twists V at a point (m), lengths divided by `length`.

        A row of V+ is the wrench that does work on one twist alone and has no component of the force along the line.
        For an axis of the pair it is a force through the ball, across the line, without a moment about the other axis.
        For an axis of the ball it is the moment dual to the three, with forces by which it does no work on the pair.

        Returns:
            The margin; 0 where the axes of the ball or the pair lock up, or the line is in the plane of the pair.
        """
        shrink, along = reciprocal(length), self.along
        arm, line = (reference - self.ball) * shrink, self.wrench(reference).rotational * shrink
        size = reciprocal(self.square(reference, length))
        first, second = self.pair_axes
        weight = reciprocal(self.distance * shrink * second.dot(along.cross(first)))
        forces = [(along * second.dot(along) - second) * weight, (first - along * first.dot(along)) * weight]
        moments = [force.cross(arm) for force in forces]
        across = [moment - line * (moment.dot(line) * size) for moment in moments]
        dual_axes, square = _dual(self.ball_axes)
        turns = [[dual.dot(axis) for dual in dual_axes] for axis in self.pair_axes]
        # V+ is a part of the pair and one of the ball: its square is theirs, and twice their product.
        first_pair, mixed_pair, second_pair = (
            (moments[i].dot(across[j]) + forces[i].dot(forces[j])) * (float(i == j) + _inner(turns[i], turns[j]))
            for i, j in ((0, 0), (0, 1), (1, 1))
        )
        mixed = [_inner(row, [dual.dot(part) for dual in dual_axes]) for row, part in zip(turns, across, strict=True)]
        along_line = [dual.dot(line) for dual in dual_axes]
        of_ball = square - size * _inner(along_line, along_line)
        inverse = of_ball + first_pair + second_pair + 2.0 * (mixed_pair - total(mixed))
        margin = float(PAIR + BALL) * reciprocal(sqrt(self._squares(arm, shrink) * inverse))
        return where(margin > 0.0, where(margin < 1.0, margin, 1.0), 0.0)

    def _squares(self, arm: Vector, shrink: Scalar) -> Scalar:
        """The sum of the squares of all components of the five twists; that of a x r is r^2 - (a r)^2."""
        pair_arm = arm + self.along * (self.distance * shrink)
        arms = float(BALL) * arm.dot(arm) + float(PAIR) * pair_arm.dot(pair_arm)
        along = [axis.dot(arm) for axis in self.ball_axes] + [axis.dot(pair_arm) for axis in self.pair_axes]
        return float(PAIR + BALL) + (arms - _inner(along, along))


def two_centres(start: Vector, end: Vector, first: Sequence[Vector], second: Sequence[Vector]) -> TwoCentres:
    """The axes of a leg from the base: `first` through the point `start`, `second` through `end` (m, base frame)."""
    span = end - start
    distance = span.norm()
    along = span * reciprocal(distance)
    if len(second) == BALL:
        return TwoCentres(end, along, end, distance, tuple(first), tuple(second))
    return TwoCentres(end, along, start, -distance, tuple(second), tuple(first))


def _dual(axes: Sequence[Vector]) -> tuple[list[Vector], Scalar]:
    """The vectors that have a product of 1 with one of three axes and 0 with the others; the sum of their squares."""
    first, second, third = axes
    shrink = reciprocal(second.dot(third.cross(first)))
    rows = [second.cross(third) * shrink, third.cross(first) * shrink, first.cross(second) * shrink]
    if is_zero(second.dot(first)) and is_zero(second.dot(third)):
        return [rows[0], second, rows[2]], 1.0 + 2.0 * (shrink * shrink)
    return rows, total([row.dot(row) for row in rows])


def _inner(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    return total([p * q for p, q in zip(a, b, strict=True)])

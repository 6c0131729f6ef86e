"""The screws by which a leg acts on the platform: twists of its joints and springs, and the wrenches that it carries.

Wrenches are the space reciprocal to the passive twists: of any twists, or in closed form where these turn about two
points. Which joints and springs a leg has is in `leg`.

Source: theory (1) and (2); for margins section 2, "Singularities". Screws are at one reference point in base axes.
"""

from collections.abc import Sequence
from dataclasses import replace

from kinetostat.algebra.scalar import Scalar, inner_product, is_zero, reciprocal, sqrt, total, where
from kinetostat.algebra.screw import Twist, Wrench, force_along, pure_moment
from kinetostat.algebra.solve import complement
from kinetostat.algebra.vector import AXES, ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.tolerances import CLOSING_ROUND_OFF

PAIR, BALL = 2, 3
"""Numbers of axes about the two points of a leg such as U-P-S."""


@dataclass(frozen=True)
class LegScrews:
    """The screws by which a leg acts on the platform, at one reference point in base axes (theory section 2).

    Attributes:
        passive: unit twists that span what the passive joints allow (J_p).
        elastic: unit twist of each spring (J_e).
        compliance: compliance of each spring, 0 if it is rigid and infinite if it is free; m/N or rad/(N·m).
        wrenches: basis of what the leg can carry (W): no work on any passive twist.
        loads: load in each spring per unit of each wrench (J_e^T W).
        load_squares: the largest square that the load of each spring can have under a wrench of 1 N, moments over the
            characteristic length (N², N²m²): round-off of the load is judged by it.
        singularity_margin: 0 where the passive joints lock up, 1 where they are orthogonal (dimensionless).
        wrench_squares: squared size of each wrench, moments over the characteristic length, by which the margin of a
            platform scales it to unit size. Empty where the margin counts the wrenches as they are.
    """

    passive: tuple[Twist, ...]
    elastic: tuple[Twist, ...]
    compliance: tuple[Scalar, ...]
    wrenches: tuple[Wrench, ...]
    loads: tuple[tuple[Scalar, ...], ...]
    load_squares: tuple[Scalar, ...]
    singularity_margin: Scalar
    wrench_squares: tuple[Scalar, ...] = ()

    @property
    def with_unit_wrenches(self) -> "LegScrews":
        """The same with wrenches of unit size."""
        if not self.wrench_squares:
            return self
        shrink = [reciprocal(sqrt(square)) for square in self.wrench_squares]
        wrenches = tuple(wrench * factor for wrench, factor in zip(self.wrenches, shrink, strict=True))
        loads = tuple(tuple(c * factor for c, factor in zip(row, shrink, strict=True)) for row in self.loads)
        return replace(self, wrenches=wrenches, loads=loads, wrench_squares=())


def work_on_free(wrench: Wrench, twist: Twist) -> Scalar:
    """The work of a wrench on the twist of a free spring, exactly 0 if it is only round-off.

    A free spring gives way to the least load, so that round-off would move it without end. Both are at one point.
    """
    turning = wrench.rotational.norm() * twist.rotational.norm()
    size = turning + wrench.translational.norm() * twist.translational.norm()
    load = wrench.work(twist)
    return where(abs(load) > CLOSING_ROUND_OFF * size, load, 0.0)


def reciprocal_wrenches(passive: Sequence[Twist], length: Scalar) -> tuple[tuple[Wrench, ...], Scalar]:
    """Wrenches that do no work on any of `passive`: a basis of the reciprocal space (J_p^T W = 0).

    Args:
        passive: n independent unit twists, at P in base axes.
        length: m; translations are compared with rotations through it, the space does not depend on it.

    Returns:
        W, 6 - n wrenches at P in base axes (orthonormal once moments are divided by `length`), and the singularity
        margin: 0 where the twists are dependent.
    """
    if not passive:
        return (*(force_along(axis, ZERO) for axis in AXES), *(pure_moment(axis) * length for axis in AXES)), 1.0
    shrink = reciprocal(length)
    basis, singularity_margin = complement([comparable(twist, shrink) for twist in passive])
    return tuple(Wrench(Vector(*row[:3]) * length, Vector(*row[3:])) for row in basis), singularity_margin


def comparable(twist: Twist, shrink: Scalar) -> tuple[Scalar, ...]:
    """The components of a unit twist, translations times `shrink` (1/m); a slide stays of unit size."""
    if twist.is_translation:
        return twist.components()
    return Twist(twist.rotational, twist.translational * shrink).components()


@dataclass(frozen=True)
class TwoCentres:
    """The axes of a leg's passive joints: a pair through one point and three, a ball, through another, as in U-P-S.

    Such a leg carries a force along the line through both points and nothing else, whatever joints its axes belong to.
    How near its joints are to locking up follows in closed form; `reciprocal_wrenches` would triangularise the twists.

    Attributes:
        point: the one of both points that is nearer to the platform, m.
        along: unit vector of the line, from the other point to this one.
        ball: the point through which three axes pass, m.
        distance: coordinate of the ball along the line from the pair, m; negative if the ball is nearer to the base.
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
        For an axis a_i of the pair it is a force f_i through the ball, across the line, without a moment about the
        other axis. For an axis b_i of the ball it is the moment m_i dual to the three, with the forces -(a_1 m_i) f_1
        and -(a_2 m_i) f_2, by which it does no work on the pair.

        Source: theory section 2, "Singularities", on passive axes that turn about two points.

        Returns:
            The margin; 0 where the axes of the ball or the pair lock up, or the line is in the plane of the pair.
        """
        arm = (reference - self.ball) * reciprocal(length)
        inverse_squares = self._inverse_squares(arm, reference, length)
        margin = float(PAIR + BALL) * reciprocal(sqrt(self._squares(arm, reciprocal(length)) * inverse_squares))
        # NaN, where a distance is zero, compares as false: the margin is then 0.
        return where(margin > 0.0, where(margin < 1.0, margin, 1.0), 0.0)

    def _inverse_squares(self, arm: Vector, reference: Vector, length: Scalar) -> Scalar:
        """|V+|^2: the sum of the squares of f_1, f_2 and the three m_i - (a_1 m_i) f_1 - (a_2 m_i) f_2.

        Of all squares the share in the force along the line is left out. The products f_i f_j of all five rows together
        are weighted by 1 (of i = j, the rows of the pair) + (a_i m)(a_j m).
        """
        line_moment = self.wrench(reference).rotational * reciprocal(length)
        inverse_line_square = reciprocal(self.square(reference, length))
        forces = self._pair_forces(reciprocal(length))
        moments = [force.cross(arm) for force in forces]
        off_line = [moment - line_moment * (moment.dot(line_moment) * inverse_line_square) for moment in moments]
        duals, dual_square = _dual(self.ball_axes)
        along_pair = [[dual.dot(axis) for dual in duals] for axis in self.pair_axes]
        first_force, both_forces, second_force = (
            (moments[i].dot(off_line[j]) + forces[i].dot(forces[j]))
            * (float(i == j) + inner_product(along_pair[i], along_pair[j]))
            for i, j in ((0, 0), (0, 1), (1, 1))
        )
        duals_with_forces = [
            inner_product(shares, [dual.dot(moment) for dual in duals])
            for shares, moment in zip(along_pair, off_line, strict=True)
        ]
        along_line = [dual.dot(line_moment) for dual in duals]
        of_duals = dual_square - inverse_line_square * inner_product(along_line, along_line)
        return of_duals + first_force + second_force + 2.0 * (both_forces - total(duals_with_forces))

    def _pair_forces(self, shrink: Scalar) -> list[Vector]:
        """The forces f_1 and f_2, with distances times `shrink` (1/m)."""
        e, (first, second) = self.along, self.pair_axes
        inverse_v = reciprocal(self.distance * shrink * second.dot(e.cross(first)))
        return [(e * second.dot(e) - second) * inverse_v, (first - e * first.dot(e)) * inverse_v]

    def _squares(self, arm: Vector, shrink: Scalar) -> Scalar:
        """The sum of the squares of all components of the five twists; that of a x r is r^2 - (a r)^2."""
        pair_arm = arm + self.along * (self.distance * shrink)
        arms = float(BALL) * arm.dot(arm) + float(PAIR) * pair_arm.dot(pair_arm)
        along = [axis.dot(arm) for axis in self.ball_axes] + [axis.dot(pair_arm) for axis in self.pair_axes]
        return float(PAIR + BALL) + (arms - inner_product(along, along))


def two_centres(points: Sequence[Vector], axes: Sequence[Sequence[Vector]]) -> TwoCentres | None:
    """The passive axes of a leg by the points that they pass through; None unless these are two, of a pair and a ball.

    Args:
        points: the points in order from the base to the platform, m, base frame.
        axes: unit vectors of the axes through each point.
    """
    if sorted(map(len, axes)) != [PAIR, BALL]:
        return None
    start, end = points
    span = end - start
    distance = span.norm()
    along = span * reciprocal(distance)
    first, second = axes
    if len(second) == BALL:
        return TwoCentres(end, along, end, distance, tuple(first), tuple(second))
    return TwoCentres(end, along, start, -distance, tuple(second), tuple(first))


def _dual(axes: Sequence[Vector]) -> tuple[list[Vector], Scalar]:
    """The vectors that have a product of 1 with one of three axes and 0 with the others; the sum of their squares."""
    first, second, third = axes
    shrink = reciprocal(second.dot(third.cross(first)))
    rows = [second.cross(third) * shrink, third.cross(first) * shrink, first.cross(second) * shrink]
    if is_zero(second.dot(first)) and is_zero(second.dot(third)):
        # By form, as in most ball joints that files describe: `second` is then its own dual, and traced code stays
        # small. The duals of the other two, unit vectors in a plane, both have the size 1 / sine of their angle.
        return [rows[0], second, rows[2]], 1.0 + 2.0 * (shrink * shrink)
    return rows, total([row.dot(row) for row in rows])

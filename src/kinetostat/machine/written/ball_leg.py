"""Joint coordinates of legs of six joints with a ball at one end, in closed form.

A ball is three revolutes about one point. Seen from the other end of the leg, the platform says where this point is.
The three joints that lead there put it in its place, and the ball then turns by what is left. A leg with its ball at
the base is the same leg read backwards. Two of the three joints are revolutes about a second point, in any order with
the third one, so that the third alone decides how far the two points are apart. Thus U-P-S, P-U-S, R-U-S, U-R-S and
their reverses are solved, however their joints are written.

Source: theory (73)-(75); R. M. Murray, Z. Li and S. S. Sastry, A Mathematical Introduction to Robotic Manipulation
(1994), section 3.3, for the subproblems. All is in the base frame at the home pose.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal, sqrt, where
from kinetostat.algebra.vector import (
    Carried,
    Displacement,
    Rotation,
    TriadRotation,
    Vector,
    axis_between,
    rotation_along,
)
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, RevolutePlace, Turn
from kinetostat.machine.machine import ClosedLeg, Closure, Step
from kinetostat.tolerances import NO_LINK, SAME_CENTRE, SAME_DIRECTION

LEAST_SHARE = 1e-6
"""Share of its greatest value that a branch's sign needs at the home pose: else the leg stands between two branches."""


class JointReach(NamedTuple):
    """The movement of a joint to a distance, m or a turn, NaN where there is none; and the ends of the distances, m."""

    amount: Scalar | Turn
    nearest: Scalar
    farthest: Scalar


class _ClosedArm(NamedTuple):
    """The three joints before the ball, in closed form.

    Attributes:
        amounts: their coordinates.
        motion: the displacement of the arm that they carry.
        closure: the condition for the single joint to reach.
        gap: the square of what the pair misses.
    """

    amounts: list[Scalar | Turn]
    motion: Displacement
    closure: Closure
    gap: Scalar


@dataclass(frozen=True)
class BallLeg:
    """A leg of six joints with a ball at one end, and two revolutes about another point among the others.

    Attributes:
        leg: the name of the leg.
        backwards: whether the ball is at the base, so that the leg is read from the platform.
        pair_first: whether, read so, the two revolutes about one point come before the single joint.
        upright: whether the axes of the pair, and its second axis and the arm, are at right angles.
        aligned: whether the single joint slides along the arm: 1 away from the pair, -1 towards it, 0 if it does not.
    """

    leg: str
    backwards: bool
    pair_first: bool
    upright: bool = False
    aligned: float = 0.0

    def at_home(self, steps: Sequence[Step]) -> "BallLeg":
        """The same with what the numbers of the leg say at the home pose, which is `upright` and `aligned`."""
        movers = [step.element.mover for step in steps if step.moves]
        row = movers[::-1] if self.backwards else movers
        pair, single = (row[:2], row[2]) if self.pair_first else (row[1:3], row[0])
        arm = row[3].pivot - pair[0].pivot
        arm = arm * (1.0 / arm.norm())
        products = pair[0].axis.dot(pair[1].axis), pair[1].axis.dot(arm)
        along = single.axis.dot(arm)
        slides = self.pair_first and single.point is None and single.axis.cross(arm).norm() < SAME_DIRECTION
        upright = all(abs(product) < SAME_DIRECTION for product in products)
        return replace(self, upright=upright, aligned=math.copysign(1.0, along) if slides else 0.0)

    def close(self, steps: Sequence[Step], motion: Displacement) -> ClosedLeg:
        """Find the joint coordinates at which the platform has moved by `motion`, on the branches of the home pose.

        The condition for the single joint to reach comes with them. Where it holds and the coordinates are NaN all the
        same, the pair does not reach on this branch, and Newton's method finds out why.

        Args:
            steps: the leg at the home pose.
            motion: the motion of the platform from its home pose, base frame.
        """
        movers = [step.element.mover for step in steps if step.moves]
        if not self.backwards:
            return self._solve(movers, motion)
        leg = self._solve(movers[::-1], motion.inverse())
        # Seen from the base, what follows a joint is what comes before it as seen from the platform.
        amounts: list[Scalar | Turn] = []
        following = motion  # of what follows this joint, seen from the base
        for amount, joint in zip(leg.amounts, movers[::-1], strict=True):
            opposite = _opposite(amount)
            if isinstance(amount, Turn) and isinstance(opposite, Turn) and amount.placement:
                place = amount.placement
                opposite = replace(opposite, placement=_place_at(place.axis, place.point, motion, following))
                following = motion @ place.motion
            else:
                following = following @ joint.motion_by(amount)[1]
            amounts.append(opposite)
        return ClosedLeg(amounts[::-1], leg.closure, leg.gap)

    def _solve(self, movers: Sequence[Joint], motion: Displacement) -> ClosedLeg:
        """Find the coordinates of a leg whose ball comes last: the three joints before it, and then the ball."""
        ball = movers[3:]
        centre = ball[0].pivot
        before_ball = self._close_pair_first if self.pair_first else self._close_single_first
        arm = before_ball(movers[:3], centre, motion.apply(centre))
        ball_turns, ball_gap = _ball_turns(ball, arm.motion.rotation, motion.apply(centre), motion)
        return ClosedLeg([*arm.amounts, *ball_turns], arm.closure, arm.gap + ball_gap)

    def _close_pair_first(self, movers: Sequence[Joint], centre: Vector, goal: Vector) -> _ClosedArm:
        """The single joint puts the ball at its distance from the pair, and the pair turns the arm between them."""
        *pair, single = movers
        fixed = pair[0].pivot
        end = goal - fixed
        square = _square(end)
        reach = to_distance(single, centre, centre, fixed, square, self.aligned)
        single_motion = single.motion_by(reach.amount)[1]
        shrink = reciprocal(sqrt(square))
        start = single.axis * self.aligned if self.aligned else (single_motion.apply(centre) - fixed) * shrink
        turns, gap = self._pair(pair, start, end * shrink, centre - fixed)
        pair_motion = _placement_of(turns[1]).motion
        arm = pair_motion @ single_motion
        amounts = [*turns, _with_placement(reach.amount, single, pair_motion, arm)]
        return _ClosedArm(amounts, arm, self._closure(square, reach), gap)

    def _close_single_first(self, movers: Sequence[Joint], centre: Vector, goal: Vector) -> _ClosedArm:
        """The single joint carries the pair; seen from the pair, it puts the goal at the distance of the ball."""
        single, *pair = movers
        fixed = pair[0].pivot
        start = centre - fixed
        square = _square(start)
        reach = to_distance(single, goal, centre, fixed, square)
        end = single.motion_by(reach.amount)[1].apply(goal) - fixed
        shrink = reciprocal(sqrt(square))
        turns, gap = self._pair(pair, start * shrink, end * shrink, centre - fixed)
        amount = _opposite(reach.amount)  # seen from the base
        single_motion = single.motion_by(amount)[1]
        turns = [_displaced_turn(single_motion, turn) for turn in turns]
        amounts = [_with_placement(amount, single, single_motion, single_motion), *turns]
        return _ClosedArm(amounts, _placement_of(turns[1]).motion, self._closure(square, reach), gap)

    def _closure(self, square: Scalar, reach: JointReach) -> Closure:
        """The condition for the single joint to reach a distance with this square, m²."""
        return Closure(self.leg, sqrt(square), reach.nearest, reach.farthest)

    def _pair(self, pair: Sequence[Joint], start: Vector, end: Vector, home: Vector) -> tuple[list[Turn], Scalar]:
        """Turns of the pair that take one unit vector to another (theory (74)), and the square of what they miss.

        Args:
            pair: two revolutes about one point, from the base.
            start, end: unit vectors of the arm, as if the pair had not turned and as it is.
            home: the arm at the home pose, m.
        """
        first, second = (joint.axis for joint in pair)
        slant, arm_slant = (0.0, 0.0) if self.upright else (first.dot(second), start.dot(second))
        axis, gap = axis_between(first, end, slant, arm_slant, first.cross(home).dot(second))
        across = sqrt(1.0 - arm_slant * arm_slant)
        shrink = reciprocal(across)
        across_start, across_end = (second - start * arm_slant) * shrink, (axis - end * arm_slant) * shrink
        rotation = TriadRotation(
            (start, across_start, start.cross(across_start)), (end, across_end, end.cross(across_end))
        )
        turns = [
            turn_about(first, (second, axis), first, (second, second)),
            turn_about(axis, (first, end), second, (first, start)),
        ]
        point = pair[0].pivot
        first_rotation = rotation_along(first, turns[0].cosine, turns[0].sine)
        motions = [Displacement(turn, point - turn.apply(point)) for turn in (first_rotation, rotation)]
        axes = first, Carried(axis.x, axis.y, axis.z, rotation, Vector(arm_slant, across, 0.0))
        places = [RevolutePlace(direction, point, motion) for direction, motion in zip(axes, motions, strict=True)]
        return [replace(turn, placement=place) for turn, place in zip(turns, places, strict=True)], gap


def _ball_turns(
    ball: Sequence[Joint], arm: Rotation, centre: Vector, motion: Displacement
) -> tuple[list[Turn], Scalar]:
    """The turns of the ball's axes, which make the part of the motion that the joints before the ball have not made.

    Source: theory (75).

    Args:
        ball: the joints of the ball at the home pose.
        arm: the rotation of the link before the ball.
        centre: the centre of the ball at the pose, m.
        motion: the displacement of the link behind the ball.

    Returns:
        The turns with their placements, and the square of what they miss.
    """
    first, second, third = (joint.axis for joint in ball)
    start, end = arm.apply(first), motion.rotation.apply(third)
    slants = first.dot(second), third.dot(second)
    axis, gap = axis_between(start, end, *slants, first.cross(third).dot(second))
    near, far = arm.apply(second), motion.rotation.apply(second)
    turns = [
        turn_about(start, (near, axis), first, (second, second)),
        turn_about(axis, (start, end), second, (first, third)),
        turn_about(end, (axis, far), third, (second, second)),
    ]
    home = ball[0].pivot
    rotations = [
        rotation_along(start, turns[0].cosine, turns[0].sine) @ arm,
        rotation_along(end, turns[2].cosine, -turns[2].sine) @ motion.rotation,
    ]
    motions = [*(Displacement(turn, centre - turn.apply(home)) for turn in rotations), motion]
    places = [RevolutePlace(line, centre, turned) for line, turned in zip((start, axis, end), motions, strict=True)]
    return [replace(turn, placement=place) for turn, place in zip(turns, places, strict=True)], gap


def turn_about(axis: Vector, pair: tuple[Vector, Vector], home_axis: Vector, home: tuple[Vector, Vector]) -> Turn:
    """The turn about an axis by which one vector goes from the other, beyond the turn between them at the home pose.

    Args:
        axis, home_axis: unit vectors, at the pose and at the home pose.
        pair, home: the vectors likewise; only what is across the axis counts.
    """
    (c, s), (c0, s0) = _product(axis, *pair), _product(home_axis, *home)
    size = reciprocal(c0 * c0 + s0 * s0)
    return Turn((c * c0 + s * s0) * size, (s * c0 - c * s0) * size)


def _product(axis: Vector, a: Vector, b: Vector) -> tuple[Scalar, Scalar]:
    """Cosine and sine of the angle about an axis from one vector to another, times the sizes of both across it."""
    return a.dot(b) - a.dot(axis) * b.dot(axis), axis.dot(a.cross(b))


def _with_placement(amount: Scalar | Turn, joint: Joint, before: Displacement, after: Displacement) -> Scalar | Turn:
    """The amount of the single joint with its placement, between the motions of what is before and behind it."""
    if not isinstance(amount, Turn):
        return amount
    return replace(amount, placement=_place_at(joint.axis, joint.pivot, before, after))


def _placement_of(turn: Turn) -> RevolutePlace:
    if turn.placement is None:
        raise ValueError("a turn without a placement")
    return turn.placement


def _displaced_turn(single_motion: Displacement, turn: Turn) -> Turn:
    """A turn whose placement a joint before it has displaced."""
    place = _placement_of(turn)
    return replace(turn, placement=_place_at(place.axis, place.point, single_motion, single_motion @ place.motion))


def _place_at(axis: Vector, point: Vector, before: Displacement, after: Displacement) -> RevolutePlace:
    """The place of a revolute that what is before it has displaced, and the displacement of what follows it."""
    return RevolutePlace(before.rotation.apply(axis), before.apply(point), after)


def to_distance(
    joint: Joint, point: Vector, home: Vector, centre: Vector, square: Scalar, aligned: float = 0.0
) -> JointReach:
    """Find how far a joint must move for a point to lie at a distance from a centre (theory (73)).

    Args:
        joint: a revolute or a slide.
        point: the point before the joint moves, m.
        home: the point at the home pose, where the joint need not move: this chooses one of the two solutions.
        centre: the centre, m.
        square: the square of the distance, m².
        aligned: 1 if the joint slides along the line from the centre to the point, -1 if against it; 0 for all others.
    """
    span = point - centre
    if joint.point is None:
        along = span.dot(joint.axis)
        if aligned:
            return JointReach(sqrt(square) * aligned - along, 0.0, math.inf)
        aside = _square(span.across(joint.axis))
        root = sqrt(square - aside)
        return JointReach(root * _sign((home - centre).dot(joint.axis)) - along, sqrt(aside), math.inf)
    arm = (point - joint.point).across(joint.axis)
    middle = span - arm
    a, b = middle.dot(arm), middle.dot(joint.axis.cross(arm))
    mean = _square(middle) + _square(arm)
    d = 0.5 * (square - mean)
    size = a * a + b * b
    root = sqrt(size - d * d) * _sign(_bend(joint, home, centre))
    shrink = reciprocal(size)
    wide = 2.0 * sqrt(size)
    nearest = sqrt(where(mean > wide, mean - wide, 0.0))
    return JointReach(Turn((a * d + b * root) * shrink, (b * d - a * root) * shrink), nearest, sqrt(mean + wide))


def _bend(joint: Joint, home: Vector, centre: Vector) -> Scalar:
    """Half the rate of the squared distance from a centre by a revolute at the home pose."""
    arm = (home - joint.pivot).across(joint.axis)
    return (home - centre).dot(joint.axis.cross(arm))


def ball_leg(name: str, movers: Sequence[Joint]) -> BallLeg | None:
    """Recognise a leg with a ball at one end by its joints at the home pose; None if it is another leg.

    Numbers of the joints must be floats.
    """
    if len(movers) != 6 or any(not is_zero(joint.pitch) for joint in movers):
        return None
    for backwards in (False, True):
        row = movers[::-1] if backwards else movers
        arm, ball = row[:3], row[3:]
        if not _meet(ball) or _is_in_plane(ball, ball[2].axis):
            continue
        for pair_first in (True, False):
            pair, single = (arm[:2], arm[2]) if pair_first else (arm[1:], arm[0])
            if _meet(pair) and _decides(pair, single, ball[0].pivot):
                return BallLeg(name, backwards, pair_first)
    return None


def _decides(pair: Sequence[Joint], single: Joint, centre: Vector) -> bool:
    """Whether the home pose is clearly on one branch: of the distance that the single joint sets, and of the pair."""
    arm = centre - pair[0].pivot
    if _is_in_plane(pair, arm):
        return False
    if single.point is None:
        return bool(abs(arm.dot(single.axis)) > LEAST_SHARE * arm.norm())
    crank = (centre - single.point).across(single.axis)
    return bool(abs(_bend(single, centre, pair[0].pivot)) > LEAST_SHARE * crank.norm() * arm.norm())


def _is_in_plane(joints: Sequence[Joint], arm: Vector) -> bool:
    """Whether an arm lies in the plane of the first two axes, as far as can be told, or has no length."""
    volume = arm.dot(joints[0].axis.cross(joints[1].axis))
    return bool(arm.norm() < NO_LINK or abs(volume) <= LEAST_SHARE * arm.norm())


def _meet(joints: Sequence[Joint]) -> bool:
    """Whether joints are revolutes about one point."""
    points = [joint.point for joint in joints if joint.point is not None]
    return len(points) == len(joints) and all((point - points[0]).norm() <= SAME_CENTRE for point in points)


def _opposite(amount: Scalar | Turn) -> Scalar | Turn:
    return Turn(amount.cosine, -amount.sine) if isinstance(amount, Turn) else -amount


def _square(vector: Vector) -> Scalar:
    return vector.dot(vector)


def _sign(a: Scalar) -> Scalar:
    return where(a < 0.0, -1.0, 1.0)

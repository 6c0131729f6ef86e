"""Closed-form joint coordinates: of legs with three parallel revolutes and at most one slide, and of legs with a ball.

Which legs have a closed form is seen from their axes at the home pose. All other legs are closed by Newton's method
(`kinematics.closure`), and so are those with parallel axes where the platform turns out of the leg's plane.

A leg of six joints that ends in a ball (three revolutes about one point): seen from its other end, the platform says
where the centre of the ball is. The three joints that lead there only have to put it in its place; the ball then turns
by what is left. A leg with its ball at the base is the same leg read backwards. Two of the three joints are revolutes
about a second point, in any order with the third one, so that the third alone decides how far the two points are apart.
Thus U-P-S, P-U-S, R-U-S, U-R-S and their reverses are solved, however their joints are written.

Source: theory (73)-(75); R. M. Murray, Z. Li and S. S. Sastry, A Mathematical Introduction to Robotic Manipulation
(1994), section 3.3, for the subproblems. All is in the base frame at the home pose.
"""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal, sqrt, where
from kinetostat.algebra.vector import IDENTITY, Displacement, Vector, rotation_along
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, Turn
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Closure, Inverse, Step
from kinetostat.tolerances import NO_LINK, PARALLEL_AXES, SAME_CENTRE


@dataclass(frozen=True)
class ParallelAxes:
    """A leg of three revolutes about parallel axes and at most one slide along them, in any order.

    Attributes:
        leg: its name.
        revolutes: which of its movable elements turn, from base to platform.
        slide: which of them slides, or None.
        signs: the signs of the axes against the first revolute's.
        bend: side of the line from the first to the last revolute on which the middle one lies at the home pose.
    """

    leg: str
    revolutes: tuple[int, int, int]
    slide: int | None
    signs: tuple[float, ...]
    bend: float

    def amounts(self, steps: Sequence[Step], motion: Displacement) -> tuple[list[Scalar | Turn], Closure]:
        """Find joint coordinates that displace the platform end by `motion` as far as the leg can, on the home branch.

        Args:
            steps: the leg at the home pose.
            motion: the motion of the platform from its home pose, base frame.

        Returns:
            One coordinate per movable element: m of a slide, the cosine and sine of a revolute; NaN where the links
            cannot reach, as the condition that comes with them says.
        """
        movers = [step.element.mover for step in steps if step.moves]
        axis = movers[self.revolutes[0]].axis
        first, middle, last = (point_of(movers[i]) for i in self.revolutes)
        goal = motion.apply(last)
        lower, upper, span = (across(v, axis) for v in (middle - first, last - middle, goal - first))
        bent, closure = self._triangle(axis, lower, upper, span)
        lower_turn = turn_between(axis, lower, bent)
        both = turn_between(axis, upper, span - bent)
        whole = turn_between(axis, lower, motion.rotation.apply(lower))
        amounts: list[Scalar | Turn] = [0.0] * len(movers)
        turns = (lower_turn, _remaining_turn(lower_turn, both), _remaining_turn(both, whole))
        for i, turn in zip(self.revolutes, turns, strict=True):
            amounts[i] = Turn(turn.cosine, self.signs[i] * turn.sine)
        if self.slide is not None:
            amounts[self.slide] = self.signs[self.slide] * axis.dot(goal - last)
        return amounts, closure

    def _triangle(self, axis: Vector, lower: Vector, upper: Vector, span: Vector) -> tuple[Vector, Closure]:
        """Direction of the lower link, and the condition for the two links to bridge the span."""
        near, far, square = lower.dot(lower), upper.dot(upper), span.dot(span)
        shrink = reciprocal(square)
        along = 0.5 * (1.0 + (near - far) * shrink)
        aside = sqrt(near * shrink - along * along)
        sizes = sqrt(near), sqrt(far)
        closure = Closure(self.leg, sqrt(square), abs(sizes[0] - sizes[1]), sizes[0] + sizes[1])
        return span * along + axis.cross(span) * (self.bend * aside), closure


def _remaining_turn(first: Turn, whole: Turn) -> Turn:
    """The rest of a turn after the first part of it."""
    return Turn(
        whole.cosine * first.cosine + whole.sine * first.sine,
        whole.sine * first.cosine - whole.cosine * first.sine,
    )


def closed_form(name: str, steps: Sequence[Step]) -> Inverse | None:
    """Recognise the closed form of a leg at the home pose, if it has one; its numbers must be floats."""
    moving = [step.element for step in steps if step.moves]
    # The far side of a parallelogram slides along the axes at the home pose, and on a circle away from it.
    if any(isinstance(element, Parallelogram) for element in moving):
        return None
    movers = [element.mover for element in moving]
    return _parallel_axes(name, movers) or ball_leg(name, movers)


def _parallel_axes(name: str, movers: Sequence[Joint]) -> ParallelAxes | None:
    turning = [i for i, joint in enumerate(movers) if joint.point is not None]
    sliding = [i for i, joint in enumerate(movers) if joint.point is None]
    if len(turning) != 3 or len(sliding) > 1 or any(joint.pitch for joint in movers):
        return None
    axes = np.array([joint.axis.components() for joint in movers], dtype=float)
    axis = axes[turning[0]]
    if np.linalg.norm(np.cross(axes, axis), axis=1).max() > PARALLEL_AXES:
        return None
    points = np.array([point_of(movers[i]).components() for i in turning], dtype=float)
    lower, upper = (link - axis * (link @ axis) for link in np.diff(points, axis=0))
    bend = float(np.cross(upper, lower) @ axis)
    if min(np.linalg.norm(lower), np.linalg.norm(upper)) < NO_LINK or bend == 0.0:
        return None
    signs = tuple(float(np.sign(direction @ axis)) for direction in axes)
    first, middle, last = turning
    return ParallelAxes(name, (first, middle, last), next(iter(sliding), None), signs, float(np.sign(bend)))


LEAST_SHARE = 1e-6
"""Share of its greatest value that a branch's sign needs at the home pose: else the leg stands between two branches."""


@dataclass(frozen=True)
class BallLeg:
    """A leg of six joints with a ball at one end, and two revolutes about another point among the others.

    Attributes:
        leg: its name.
        backwards: whether the ball is at the base, so that the leg is read from the platform.
        pair_first: whether, read so, the two revolutes about one point come before the single joint.
    """

    leg: str
    backwards: bool
    pair_first: bool

    def amounts(self, steps: Sequence[Step], motion: Displacement) -> tuple[list[Scalar | Turn], Closure]:
        """Find the joint coordinates at which the platform has moved by `motion`, on the branches of the home pose.

        Args:
            steps: the leg at the home pose.
            motion: the motion of the platform from its home pose, base frame.

        Returns:
            One coordinate per movable element: m of a slide, the cosine and sine of a revolute; NaN where the leg
            cannot reach. The condition for the single joint to reach comes with them. Where it holds and the
            coordinates are NaN all the same, the pair does not reach on this branch, and Newton's method finds out why.
        """
        movers = [step.element.mover for step in steps if step.moves]
        if not self.backwards:
            return self._solve(movers, motion)
        amounts, closure = self._solve(movers[::-1], motion.inverse())
        return [_opposite(amount) for amount in reversed(amounts)], closure

    def _solve(self, movers: Sequence[Joint], motion: Displacement) -> tuple[list[Scalar | Turn], Closure]:
        """Find the coordinates of a leg whose ball comes last."""
        arm, ball = movers[:3], movers[3:]
        centre = point_of(ball[0])
        goal = motion.apply(centre)
        if self.pair_first:
            fixed = point_of(arm[0])
            square = _square(goal - fixed)
            single, limits = to_distance(arm[2], centre, centre, fixed, square)
            turns = by_two_axes(arm[:2], arm[2].moved(single)[1].apply(centre) - fixed, goal - fixed, centre - fixed)
            amounts: list[Scalar | Turn] = [*turns, single]
        else:
            fixed = point_of(arm[1])
            square = _square(centre - fixed)
            back, limits = to_distance(arm[0], goal, centre, fixed, square)
            reached = arm[0].moved(back)[1].apply(goal)
            amounts = [_opposite(back), *by_two_axes(arm[1:], centre - fixed, reached - fixed, centre - fixed)]
        return [*amounts, *_ball_turns(arm, amounts, ball, motion)], Closure(self.leg, sqrt(square), *limits)


def _ball_turns(
    arm: Sequence[Joint], amounts: Sequence[Scalar | Turn], ball: Sequence[Joint], motion: Displacement
) -> list[Turn]:
    """Turns of a ball's axes that are left of a motion after that of the joints before it (theory (75))."""
    first, middle, last = ball
    turn = IDENTITY
    for joint, amount in zip(arm, amounts, strict=True):
        turn = turn @ joint.moved(amount)[1].rotation
    back = turn.inverse()
    wanted = back.apply(motion.rotation.apply(last.axis))
    two = by_two_axes((first, middle), last.axis, wanted, last.axis)
    across_last = across(middle.axis, last.axis)
    turned = back.apply(motion.rotation.apply(across_last))
    for joint, amount in zip((first, middle), two, strict=True):
        turned = rotation_along(joint.axis, amount.cosine, -amount.sine).apply(turned)
    return [*two, turn_between(last.axis, across_last, across(turned, last.axis))]


def to_distance(
    joint: Joint, point: Vector, home: Vector, centre: Vector, square: Scalar
) -> tuple[Scalar | Turn, tuple[Scalar, Scalar]]:
    """Find how far a joint must move for a point to lie at a distance from a centre (theory (73)).

    Args:
        joint: a revolute or a slide.
        point: where the point is before, m.
        home: where it is at the home pose, where the joint need not move: this chooses one of the two solutions.
        centre: the centre, m.
        square: of the distance, m².

    Returns:
        The movement, m or a turn, NaN where there is none; and the least and the greatest distance that there are, m.
    """
    span = point - centre
    if joint.point is None:
        along = span.dot(joint.axis)
        aside = _square(across(span, joint.axis))
        root = sqrt(square - aside)
        return root * _sign((home - centre).dot(joint.axis)) - along, (sqrt(aside), math.inf)
    arm = across(point - joint.point, joint.axis)
    middle = span - arm
    a, b = middle.dot(arm), middle.dot(joint.axis.cross(arm))
    mean = _square(middle) + _square(arm)
    d = 0.5 * (square - mean)
    size = a * a + b * b
    root = sqrt(size - d * d) * _sign(_bend(joint, home, centre))
    shrink = reciprocal(size)
    wide = 2.0 * sqrt(size)
    nearest = sqrt(where(mean > wide, mean - wide, 0.0))
    return Turn((a * d + b * root) * shrink, (b * d - a * root) * shrink), (nearest, sqrt(mean + wide))


def _bend(joint: Joint, home: Vector, centre: Vector) -> Scalar:
    """Half the rate of the squared distance from a centre by a revolute at the home pose."""
    arm = across(home - point_of(joint), joint.axis)
    return (home - centre).dot(joint.axis.cross(arm))


def by_two_axes(joints: Sequence[Joint], start: Vector, end: Vector, home: Vector) -> list[Turn]:
    """Find the turns about two axes through one point that take one arm from there to another (theory (74)).

    Args:
        joints: two revolutes, from the base.
        start, end: the arms, of one length; the second axis turns the first of them, and the first axis the result.
        home: both of them at the home pose: the arm between the turns stays on the side of both axes where this lies.
    """
    first, second = (joint.axis for joint in joints)
    normal, slant = first.cross(second), first.dot(second)
    shrink = reciprocal(normal.dot(normal))
    high, low = end.dot(first), start.dot(second)
    alpha, beta = (high - slant * low) * shrink, (low - slant * high) * shrink
    square = _square(start) - alpha * alpha - beta * beta - 2.0 * slant * (alpha * beta)
    side = sqrt(square * shrink) * _sign(home.dot(normal))
    between = first * alpha + second * beta + normal * side
    return [
        turn_between(first, across(between, first), across(end, first)),
        turn_between(second, across(start, second), across(between, second)),
    ]


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
            if _meet(pair) and _decides(pair, single, point_of(ball[0])):
                return BallLeg(name, backwards, pair_first)
    return None


def _decides(pair: Sequence[Joint], single: Joint, centre: Vector) -> bool:
    """Whether the home pose is clearly on one branch: of the distance that the single joint sets, and of the pair."""
    arm = centre - point_of(pair[0])
    if _is_in_plane(pair, arm):
        return False
    if single.point is None:
        return bool(abs(arm.dot(single.axis)) > LEAST_SHARE * arm.norm())
    crank = across(centre - single.point, single.axis)
    return bool(abs(_bend(single, centre, point_of(pair[0]))) > LEAST_SHARE * crank.norm() * arm.norm())


def _is_in_plane(joints: Sequence[Joint], arm: Vector) -> bool:
    """Whether an arm lies in the plane of the first two axes, as far as can be told, or has no length."""
    volume = arm.dot(joints[0].axis.cross(joints[1].axis))
    return bool(arm.norm() < NO_LINK or abs(volume) <= LEAST_SHARE * arm.norm())


def _meet(joints: Sequence[Joint]) -> bool:
    """Whether joints are revolutes about one point."""
    points = [joint.point for joint in joints if joint.point is not None]
    return len(points) == len(joints) and all((point - points[0]).norm() <= SAME_CENTRE for point in points)


def point_of(joint: Joint) -> Vector:
    """The point of a revolute, m."""
    if joint.point is None:
        raise ValueError("a slide has no point")
    return joint.point


def across(vector: Vector, axis: Vector) -> Vector:
    """The part of a vector at right angles to an axis."""
    return vector - axis * vector.dot(axis)


def turn_between(axis: Vector, old: Vector, new: Vector) -> Turn:
    """The turn about an axis that takes one vector at right angles to it to another of the same length."""
    size = reciprocal(old.dot(old))
    return Turn(old.dot(new) * size, axis.dot(old.cross(new)) * size)


def _opposite(amount: Scalar | Turn) -> Scalar | Turn:
    return Turn(amount.cosine, -amount.sine) if isinstance(amount, Turn) else -amount


def _square(vector: Vector) -> Scalar:
    return vector.dot(vector)


def _sign(a: Scalar) -> Scalar:
    return where(a < 0.0, -1.0, 1.0)

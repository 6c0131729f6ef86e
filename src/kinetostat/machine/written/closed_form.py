"""Closed-form joint coordinates of legs with three parallel revolutes and at most one slide along them.

Which legs have a closed form, this or that of `ball_legs`, is seen from their axes at the home pose. All other legs are
closed by Newton's method (`kinematics.closure`), and so are these where the platform turns out of the leg's plane.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.scalar import Scalar, reciprocal, sqrt
from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, Turn
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Closure, Inverse, Step
from kinetostat.machine.written.ball_legs import across, ball_leg, point_of, turn_between
from kinetostat.tolerances import NO_LINK, PARALLEL_AXES


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

"""Joint coordinates of legs with three parallel revolutes and at most one slide along them, in closed form.

Across their common axis such a leg is two links in a plane, and closing it is to find the apex of a triangle. Where the
platform turns out of the leg's plane, these coordinates do not close it: Newton's method does (`kinematics.closure`).

Source: theory (23). All is in the base frame at the home pose.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.scalar import Scalar, reciprocal, sqrt
from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, Turn
from kinetostat.machine.machine import ClosedLeg, Closure, Step
from kinetostat.tolerances import NO_LINK, PARALLEL_AXES


@dataclass(frozen=True)
class ParallelAxes:
    """A leg of three revolutes about parallel axes and at most one slide along them, in any order.

    Attributes:
        leg: the name of the leg.
        revolutes: numbers of its movable elements that turn, from base to platform.
        slide: number of the one that slides, or None.
        signs: for each movable element 1 if its axis points as that of the first revolute does, otherwise -1.
        bend: side of the line from the first to the last revolute on which the middle one lies at the home pose.
    """

    leg: str
    revolutes: tuple[int, int, int]
    slide: int | None
    signs: tuple[float, ...]
    bend: float

    def close(self, steps: Sequence[Step], motion: Displacement) -> ClosedLeg:
        """Find joint coordinates that displace the platform end by `motion` as far as the leg can, on the home branch.

        Args:
            steps: the leg at the home pose.
            motion: the motion of the platform from its home pose, base frame.
        """
        movers = [step.element.mover for step in steps if step.moves]
        axis = movers[self.revolutes[0]].axis
        first, middle, last = (movers[i].pivot for i in self.revolutes)
        goal = motion.apply(last)
        lower, upper, span = (v.across(axis) for v in (middle - first, last - middle, goal - first))
        bent, closure = self._triangle(axis, lower, upper, span)
        # Turns of both links and of the platform against the base; each revolute turns by the difference of two.
        lower_turn = _turn_between(axis, lower, bent)
        upper_turn = _turn_between(axis, upper, span - bent)
        platform_turn = _turn_between(axis, lower, motion.rotation.apply(lower))
        turns = (lower_turn, _difference(upper_turn, lower_turn), _difference(platform_turn, upper_turn))
        amounts: list[Scalar | Turn] = [0.0] * len(movers)
        for i, turn in zip(self.revolutes, turns, strict=True):
            amounts[i] = Turn(turn.cosine, self.signs[i] * turn.sine)
        if self.slide is not None:
            amounts[self.slide] = self.signs[self.slide] * axis.dot(goal - last)
        return ClosedLeg(amounts, closure)

    def _triangle(self, axis: Vector, lower: Vector, upper: Vector, span: Vector) -> tuple[Vector, Closure]:
        """The lower link as a vector, m, and the condition for both links to bridge the span; all across the axis."""
        lower_square, upper_square, span_square = lower.dot(lower), upper.dot(upper), span.dot(span)
        shrink = reciprocal(span_square)
        along = 0.5 * (1.0 + (lower_square - upper_square) * shrink)
        across = sqrt(lower_square * shrink - along * along)
        lengths = sqrt(lower_square), sqrt(upper_square)
        closure = Closure(self.leg, sqrt(span_square), abs(lengths[0] - lengths[1]), lengths[0] + lengths[1])
        return span * along + axis.cross(span) * (self.bend * across), closure


def _turn_between(axis: Vector, old: Vector, new: Vector) -> Turn:
    """The turn about an axis that takes one vector at right angles to it to another of the same length."""
    shrink = reciprocal(old.dot(old))
    return Turn(old.dot(new) * shrink, axis.dot(old.cross(new)) * shrink)


def _difference(whole: Turn, first: Turn) -> Turn:
    """The turn that is left of a whole one after its first part."""
    return Turn(
        whole.cosine * first.cosine + whole.sine * first.sine,
        whole.sine * first.cosine - whole.cosine * first.sine,
    )


def parallel_axes(name: str, movers: Sequence[Joint]) -> ParallelAxes | None:
    """Recognise such a leg by its joints at the home pose; None if it is another leg. Their numbers must be floats."""
    turning = [i for i, joint in enumerate(movers) if joint.point is not None]
    sliding = [i for i, joint in enumerate(movers) if joint.point is None]
    if len(turning) != 3 or len(sliding) > 1 or any(joint.pitch for joint in movers):
        return None
    axes = np.array([joint.axis.components() for joint in movers], dtype=float)
    axis = axes[turning[0]]
    if np.linalg.norm(np.cross(axes, axis), axis=1).max() > PARALLEL_AXES:
        return None
    points = np.array([movers[i].pivot.components() for i in turning], dtype=float)
    lower, upper = (link - axis * (link @ axis) for link in np.diff(points, axis=0))
    bend = float(np.cross(upper, lower) @ axis)
    if min(np.linalg.norm(lower), np.linalg.norm(upper)) < NO_LINK or bend == 0.0:
        return None
    signs = tuple(float(np.sign(direction @ axis)) for direction in axes)
    first, middle, last = turning
    return ParallelAxes(name, (first, middle, last), next(iter(sliding), None), signs, float(np.sign(bend)))

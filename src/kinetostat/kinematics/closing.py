"""The conditions under which the legs of a machine close at its pose: the span of links, and equations for joints.

The conditions are stated here once, over any scalar, with their rates from the joints' screws. Nothing is solved here:
`closure` finds the joint coordinates, and `engine.derivatives` differentiates the same equations.

Source: theory section 4 for links that meet, theory (19)-(21) for equations, (23) for legs of three revolutes;
placements are in the base frame.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isnan

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import Scalar, cos, sin, smaller, sqrt
from kinetostat.algebra.vector import ZERO, Displacement, Rotation, Vector, rotation_x, rotation_y, rotation_z
from kinetostat.machine.column import column
from kinetostat.machine.leg import Joint, Turn
from kinetostat.machine.machine import Chains, Closure, Configuration, Step
from kinetostat.machine.written.family import place
from kinetostat.tolerances import NO_ANGLE_RATES

Array = npt.NDArray[np.float64]

POINT, ANGLES = ("x", "y", "z"), ("roll", "pitch", "yaw")


def clearance(closure: Closure) -> Scalar:
    """Return how far the leg is from its nearest limit, m; negative where it cannot close."""
    return smaller(closure.longest - closure.span, closure.span - closure.shortest)


def within_reach(configuration: Configuration) -> Scalar:
    """Tell whether every leg closes."""
    result: Scalar = True
    for closure in configuration.closures:
        result = (clearance(closure) >= 0.0) & result
    return result


def why_out_of_reach(configuration: Configuration) -> str:
    """Say which legs do not close, a sentence each, with the lengths in m and what to change."""
    sentences = []
    for closure in configuration.closures:
        # If the first part of a leg does not close, its next part has no place, and so its span is NaN.
        if clearance(closure) >= 0.0 or isnan(closure.span):
            continue
        far = closure.span > closure.longest
        limit = f"at most {closure.longest:.6g} m" if far else f"at least {closure.shortest:.6g} m"
        nearer = "move the platform nearer or lengthen its links"
        advice = nearer if far else "move the platform away or make its links more equal in length"
        sentences.append(
            f"The {closure.leg} would have to span {closure.span:.6g} m, but its links can span {limit}; {advice}."
        )
    return " ".join(sentences) or "The legs cannot reach the platform at this pose; move it nearer to the home pose."


def platform_placement(chains: Chains) -> Displacement:
    """Place the platform at the pose; missing positions are those of the home pose, and missing angles are 0."""
    given, home = chains.pose, chains.home.translation
    roll, pitch, yaw = (given.get(name, 0.0) for name in ANGLES)
    turn = rotation_z(cos(yaw), sin(yaw)) @ rotation_y(cos(pitch), sin(pitch)) @ rotation_x(cos(roll), sin(roll))
    return Displacement(turn, Vector(given.get("x", home.x), given.get("y", home.y), given.get("z", home.z)))


@dataclass(frozen=True)
class LegEnd:
    """Where a leg takes the platform.

    Attributes:
        platform: placement of the platform, base frame.
        movers: the freedoms of the leg's joints in this placement, in order from the base; their unit twists are the
            rates of the placement.
    """

    platform: Displacement
    movers: tuple[Joint, ...]


def leg_ends(chains: Chains, coordinates: Sequence[Scalar]) -> list[LegEnd]:
    """Follow every leg from base to platform.

    Args:
        chains: the legs at the home pose.
        coordinates: joint coordinates leg by leg, from the home pose, rad or m.
    """
    remaining = iter(coordinates)
    return [leg_end(steps, chains.home, remaining) for steps in chains.legs]


def leg_end(steps: Sequence[Step], home: Displacement, coordinates: Iterator[Scalar | Turn]) -> LegEnd:
    """Follow one leg from base to platform, and take its coordinates, rad (or turns) or m from the home pose."""
    chain, motion = place([step for step in steps if step.moves], coordinates)
    return LegEnd(motion @ home, tuple(element.mover for element in chain))  # type: ignore[attr-defined]


def closing_equations(chains: Chains, coordinates: Sequence[Scalar]) -> list[Scalar]:
    """Return residuals that are zero where all legs put the platform in one placement, and this has the given pose.

    Near that placement they are exact to first order: the rotation from one placement to another is half the sum of
    r x r' over their columns, which is the rotation vector if the two nearly agree. This needs no arc function, so the
    formulas can be traced. `gaps_at` has the residuals that Newton's method needs further away.

    Args:
        chains: the legs at the home pose, and the pose.
        coordinates: joint coordinates leg by leg, from the home pose, rad or m.

    Returns:
        Six numbers for each leg after the first, then one for each pose coordinate, all in m: rotations (rad) are
        multiplied by the machine's length.
    """
    ends = leg_ends(chains, coordinates)
    return [*_between_legs(ends, chains.length), *_off_pose(chains, ends[0].platform)]


def _between_legs(ends: Sequence[LegEnd], length: Scalar) -> list[Scalar]:
    """Return the displacement of the platform from its placement by each other leg to that by the first leg."""
    first = ends[0].platform
    return [gap for end in ends[1:] for gap in _apart(end.platform, first, length)]


def _apart(start: Displacement, end: Displacement, length: Scalar) -> list[Scalar]:
    return [*_turned(start.rotation, end.rotation, length), *(end.translation - start.translation).components()]


def _turned(start: Rotation, end: Rotation, length: Scalar) -> list[Scalar]:
    """The rotation vector from one rotation to another, times the length."""
    turn = ZERO
    for a, b in ((start.x, end.x), (start.y, end.y), (start.z, end.z)):
        turn = turn + a.cross(b)
    return list((turn * (0.5 * length)).components())


def _off_pose(chains: Chains, end: Displacement) -> list[Scalar]:
    """Return the difference between a placement and the pose, for each coordinate that the pose gives."""
    given = chains.pose
    gaps = [given[name] - getattr(end.translation, name) for name in POINT if name in given]
    if all(name in given for name in ANGLES):
        return gaps + _turned(end.rotation, platform_placement(chains).rotation, chains.length)
    sides = _sides(end.rotation)
    return gaps + [
        chains.length * (sin(given[name]) * sides[name][0] - cos(given[name]) * sides[name][1])
        for name in ANGLES
        if name in given
    ]


def _sides(turn: Rotation) -> dict[str, tuple[Scalar, Scalar]]:
    """Cosine and sine of roll, pitch and yaw of Q = Rz(yaw) Ry(pitch) Rx(roll), each up to a common factor."""
    flat = sqrt(turn.x.x * turn.x.x + turn.x.y * turn.x.y)
    return {"roll": (turn.z.z, turn.y.z), "pitch": (flat, -turn.x.z), "yaw": (turn.x.x, turn.x.y)}


def squared_distance(start: Displacement, end: Displacement, length: Scalar) -> Scalar:
    """Return the squared distance between two placements, in rad and units of the length; 0 only if they are equal."""
    shift = (end.translation - start.translation) * (1.0 / length)
    turns = ((start.rotation.x, end.rotation.x), (start.rotation.y, end.rotation.y), (start.rotation.z, end.rotation.z))
    square: Scalar = shift.dot(shift)
    for apart in [a - b for a, b in turns]:
        square = square + 0.5 * apart.dot(apart)
    return square


@dataclass(frozen=True)
class Gaps:
    """How far a machine is from closed and from its pose, in rad and in units of the machine's length [n x rows].

    Attributes:
        closure, pose: the gaps between the legs, and those to the pose.
        closure_rates, pose_rates: reduction of the gaps per unit of each joint coordinate, slides in units of the
            machine's length [n x rows x coordinates].
        platform: placement of the platform by the first leg.
        platform_rates: twist of the platform per unit of each joint coordinate, in the same units [n x 6 x
            coordinates].
    """

    closure: Array
    pose: Array
    closure_rates: Array
    pose_rates: Array
    platform: Displacement
    platform_rates: Array

    @property
    def left(self) -> Array:
        """All gaps [n x rows]."""
        return np.hstack([self.closure, self.pose])

    @property
    def rates(self) -> Array:
        """The reduction of all gaps per unit of each joint coordinate [n x rows x coordinates]."""
        return np.concatenate([self.closure_rates, self.pose_rates], axis=1)

    @property
    def largest(self) -> Array:
        """The largest gap [n]."""
        return np.asarray(np.max(np.abs(self.left), axis=1, initial=0.0))


def gaps_at(chains: Chains, coordinates: Array, goal: Array) -> Gaps:
    """Evaluate the closing equations and their rates at arrays of poses.

    The rates come from the joints' screws, not from differences. Angles of the pose are compared as angles, not by a
    sine as in `closing_equations`: on the way from the home pose they may differ much, and a sine is also zero at half
    a turn.

    Args:
        chains: the legs at the home pose.
        coordinates: joint coordinates [n x coordinates], rad or m.
        goal: pose coordinates to reach, in the order of the chains' pose [n x given], rad or m.
    """
    count = len(coordinates)
    length = np.broadcast_to(np.asarray(chains.length, dtype=float), (count,))
    ends = leg_ends(chains, [column(c) for c in coordinates.T])
    scale = np.stack([np.ones(count)] * 3 + [1.0 / length] * 3, axis=1)[:, :, None] * units_of(chains, length)[:, None]
    twists = [block * scale for block in _platform_twists(ends, count)]
    closure = stacked(_between_legs(ends, length), count) / length[:, None]
    closure_rates = [np.zeros((count, 0, chains.size)), *(block - twists[0] for block in twists[1:])]
    pose, pose_rates = _pose_gaps(ends[0].platform, twists[0], chains, goal, length)
    return Gaps(closure, pose, np.concatenate(closure_rates, axis=1), pose_rates, ends[0].platform, twists[0])


def units_of(chains: Chains, length: Array) -> Array:
    """Return the unit of each joint coordinate [n x coordinates]: 1 rad, or for a slide the machine's length, m."""
    slides = np.array([step.element.mover.point is None for steps in chains.legs for step in steps if step.moves])
    return np.where(slides, length[:, None], 1.0)


def _platform_twists(ends: Sequence[LegEnd], count: int) -> list[Array]:
    """Return for each leg the platform's twist per unit of every joint coordinate [n x 6 x all]; 0 for other legs."""
    blocks, first = [], 0
    size = sum(len(end.movers) for end in ends)
    for end in ends:
        block = np.zeros((count, 6, size))
        for k, mover in enumerate(end.movers, first):
            block[:, :, k] = stacked(mover.twist(end.platform.translation).components(), count)
        first += len(end.movers)
        blocks.append(block)
    return blocks


def stacked(scalars: Sequence[Scalar], count: int) -> Array:
    """Stack scalars as columns [n x scalars]."""
    if not scalars:
        return np.zeros((count, 0))
    return np.stack([np.broadcast_to(np.asarray(s, dtype=float), (count,)) for s in scalars], axis=1)


def _pose_gaps(end: Displacement, twists: Array, chains: Chains, goal: Array, length: Array) -> tuple[Array, Array]:
    reached, given = pose_of(end), [*chains.pose]
    turning = any(name in ANGLES for name in given)
    changes = _angle_rates(end.rotation, len(goal)) @ twists[:, :3] if turning else twists[:, :3]
    gaps, rows = [], []
    for name, wanted in zip(given, goal.T, strict=True):
        left = wanted - reached[name]
        if name in POINT:
            gaps.append(left / length)
            rows.append(twists[:, 3 + POINT.index(name)])
        else:
            gaps.append(np.arctan2(np.sin(left), np.cos(left)))
            rows.append(changes[:, ANGLES.index(name)])
    return np.stack(gaps, axis=1), np.stack(rows, axis=1)


def pose_of(end: Displacement) -> dict[str, Array]:
    """Pose coordinates of a placement: P (m) and the angles of Q = Rz(yaw) Ry(pitch) Rx(roll) (rad), arrays [n]."""
    angles = {name: np.arctan2(sine, cosine) for name, (cosine, sine) in _sides(end.rotation).items()}
    return {name: np.asarray(getattr(end.translation, name)) for name in POINT} | angles


def _angle_rates(turn: Rotation, count: int) -> Array:
    """Rates of roll, pitch and yaw per unit angular velocity [n x 3 x 3]; least norm at pitch = +-90 deg."""
    yaw = np.arctan2(turn.x.y, turn.x.x)
    axes = [turn.x.components(), (-np.sin(yaw), np.cos(yaw), 0.0), (0.0, 0.0, 1.0)]
    return np.linalg.pinv(np.stack([stacked(axis, count) for axis in axes], axis=2), rcond=NO_ANGLE_RATES)

"""The conditions under which the legs of a machine close at its pose: the span of links, and equations for joints.

The conditions are stated here once, over any scalar, with their rates from the joints' screws. Nothing is solved here:
`closure` finds the joint coordinates, and `engine.derivatives` differentiates the same equations.

Source: theory section 4 for links that meet, theory (19)-(21) for equations, (23) for legs of three revolutes;
placements are in the base frame.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import isnan
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.algebra.scalar import Scalar, cos, is_zero, sin, smaller, sqrt
from kinetostat.algebra.vector import ZERO, Displacement, Rotation, Vector, rotation_of_angles
from kinetostat.arrays import Array
from kinetostat.display import Display
from kinetostat.frozen import dataclass
from kinetostat.kinematics.limits import DIGITS_OF_LIMIT
from kinetostat.late import LateModule
from kinetostat.machine.column import column, plain, stacked_columns
from kinetostat.machine.leg import Joint, Turn
from kinetostat.machine.machine import Chains, Closure, Configuration, Step
from kinetostat.tolerances import PARALLEL_AXES

if TYPE_CHECKING:
    from kinetostat.machine.written import family
else:
    family = LateModule("kinetostat.machine.written.family")

POINT, ANGLES = ("x", "y", "z"), ("roll", "pitch", "yaw")
"""Names of the coordinates of a pose: those of the platform point, and those of the platform's orientation."""


@dataclass(frozen=True)
class Joints:
    """Joint coordinates that have been solved for.

    Attributes:
        coordinates: one scalar per joint coordinate, leg by leg, rad or m from the home pose; closed forms over any
            scalar give turns instead of angles.
        status: `Status` code: OK, OUT_OF_REACH, SINGULAR or NOT_CONVERGED.
    """

    coordinates: tuple[Scalar | Turn, ...]
    status: Scalar


def clearance(closure: Closure) -> Scalar:
    """Return how far the leg is from its nearest limit, m; negative where it cannot close."""
    return smaller(closure.longest - closure.span, closure.span - closure.shortest)


def within_reach(configuration: Configuration) -> Scalar:
    """Return whether every leg closes."""
    result: Scalar = True
    for closure in configuration.closures:
        result = (clearance(closure) >= 0.0) & result
    return result


def why_out_of_reach(configuration: Configuration, display: Display) -> str:
    """Say which leg is farthest beyond its reach and what to change, a sentence for each way to miss."""
    # If the first part of a leg does not close, its next part has no place, and so its span is NaN.
    open_legs = [c for c in configuration.closures if clearance(c) < 0.0 and not isnan(c.span)]
    ways = (
        (True, "at most", "move the platform nearer or lengthen its links"),
        (False, "at least", "move the platform away or make its links more equal in length"),
    )
    sentences = []
    for too_far, bound, advice in ways:
        legs = sorted((c for c in open_legs if (c.span > c.longest) is too_far), key=clearance)
        if not legs:
            continue
        worst, others = legs[0], len(legs) - 1
        lengths = (worst.span, worst.longest if too_far else worst.shortest)
        span, limit = (display.show(float(length), "m", digits=DIGITS_OF_LIMIT) for length in lengths)
        more = f", and {others} more {'legs do' if others > 1 else 'leg does'} not reach either" if others else ""
        sentences.append(
            f"The {worst.leg} would have to span {span}, but its links can span {bound} {limit}{more}; {advice}."
        )
    return " ".join(sentences) or "The legs cannot reach the platform at this pose; move it nearer to the home pose."


def platform_placement(chains: Chains) -> Displacement:
    """Place the platform at the pose; missing positions are those of the home pose, and missing angles are 0."""
    home = dict(zip(POINT, chains.home.translation.components(), strict=True))
    return placement_of(home | dict.fromkeys(ANGLES, 0.0) | dict(chains.pose))


def placement_of(pose: Mapping[str, Scalar]) -> Displacement:
    """Place the platform at a pose of which all coordinates are given, m and rad."""
    return Displacement(
        rotation_of_angles(pose["roll"], pose["pitch"], pose["yaw"]), Vector(pose["x"], pose["y"], pose["z"])
    )


def free_coordinates(chains: Chains) -> tuple[str, ...]:
    """Return the coordinates that the pose leaves to the machine; none out of its plane for one that stays in it."""
    out_of_plane = ("z", "roll", "pitch") if stays_in_plane(chains) else ()
    return tuple(name for name in (*POINT, *ANGLES) if name not in chains.pose and name not in out_of_plane)


def stays_in_plane(chains: Chains) -> bool:
    """Return whether no joint moves anything out of the x-y plane."""
    return all(_in_plane(step.element.mover) for steps in chains.legs for step in steps if step.moves)


def _in_plane(mover: Joint) -> bool:
    """Return whether a joint is a slide in the x-y plane, or turns about an axis across it."""
    x, y, z = (np.max(np.abs(np.asarray(plain(c), dtype=float))) for c in mover.axis.components())
    return bool(is_zero(mover.pitch) and (z if mover.point is None else max(x, y)) <= PARALLEL_AXES)


@dataclass(frozen=True)
class LegEnd:
    """The place to which a leg takes the platform.

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
    chain, motion = family.placed_chain([step for step in steps if step.moves], coordinates)
    return LegEnd(motion @ home, tuple(element.mover for element in chain))  # type: ignore[attr-defined]


def closing_equations(chains: Chains, coordinates: Sequence[Scalar]) -> list[Scalar]:
    """Return residuals that are zero where all legs put the platform in one placement, and this has the given pose.

    Near that placement they are exact to first order: the rotation from one placement to another is half the sum of
    r x r' over their columns, which is the rotation vector if the two nearly agree. This needs no arc function, so the
    formulas can be traced.

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
    return [gap for end in ends[1:] for gap in _gap(end.platform, first, length)]


def _gap(start: Displacement, end: Displacement, length: Scalar) -> list[Scalar]:
    return [*_rotation_gap(start.rotation, end.rotation, length), *(end.translation - start.translation).components()]


def _rotation_gap(start: Rotation, end: Rotation, length: Scalar) -> list[Scalar]:
    return list((rotation_between(start, end) * length).components())


def rotation_between(start: Rotation, end: Rotation) -> Vector:
    """Return the rotation vector from one rotation to another, to first order: its length is the sine of the angle."""
    turn = ZERO
    for a, b in ((start.x, end.x), (start.y, end.y), (start.z, end.z)):
        turn = turn + a.cross(b)
    return turn * 0.5


def _off_pose(chains: Chains, end: Displacement) -> list[Scalar]:
    """Return the difference between a placement and the pose, for each coordinate that the pose gives."""
    pose = chains.pose
    gaps = [pose[name] - getattr(end.translation, name) for name in POINT if name in pose]
    if all(name in pose for name in ANGLES):
        return gaps + _rotation_gap(end.rotation, platform_placement(chains).rotation, chains.length)
    given_angles = {name: sides for name, sides in _cosines_and_sines(end.rotation).items() if name in pose}
    return gaps + [
        chains.length * (sin(pose[name]) * cosine - cos(pose[name]) * sine)
        for name, (cosine, sine) in given_angles.items()
    ]


def _cosines_and_sines(turn: Rotation) -> dict[str, tuple[Scalar, Scalar]]:
    """Cosine and sine of roll, pitch and yaw, as `rotation_of_angles` takes them, each pair up to a common factor."""
    flat = sqrt(turn.x.x * turn.x.x + turn.x.y * turn.x.y)
    return {"roll": (turn.z.z, turn.y.z), "pitch": (flat, -turn.x.z), "yaw": (turn.x.x, turn.x.y)}


def squared_distance(start: Displacement, end: Displacement, length: Scalar) -> Scalar:
    """Return the squared distance between two placements, in rad and units of the length; 0 only if they are equal."""
    shift = (end.translation - start.translation) * (1.0 / length)
    axes = ((start.rotation.x, end.rotation.x), (start.rotation.y, end.rotation.y), (start.rotation.z, end.rotation.z))
    square: Scalar = shift.dot(shift)
    for difference in [a - b for a, b in axes]:
        square = square + 0.5 * difference.dot(difference)
    return square


@dataclass(frozen=True)
class Gaps:
    """Gaps from the legs to the first one, in rad and in units of the machine's length [n x rows].

    Attributes:
        closure: the gaps between the legs.
        closure_rates: reduction of the gaps per unit of each joint coordinate, slides in units of the machine's length
            [n x rows x coordinates].
        platform_rates: twist of the platform by the first leg per unit of each joint coordinate, in the same units
            [n x 6 x coordinates].
    """

    closure: Array
    closure_rates: Array
    platform_rates: Array


def gaps_at(chains: Chains, coordinates: Array) -> Gaps:
    """Evaluate the gaps between the legs and their rates, from the joints' screws, wherever the platform may be.

    Args:
        chains: the legs at the home pose.
        coordinates: joint coordinates [n x coordinates], rad or m.
    """
    count = len(coordinates)
    length = np.broadcast_to(np.asarray(chains.length, dtype=float), (count,))
    ends = leg_ends(chains, [column(c) for c in coordinates.T])
    scale = np.stack([np.ones(count)] * 3 + [1.0 / length] * 3, axis=1)[:, :, None] * units_of(chains, length)[:, None]
    twists = [block * scale for block in _platform_twists(ends, count)]
    closure = stacked_columns(_between_legs(ends, length), count) / length[:, None]
    no_rates = np.zeros((count, 0, chains.size))  # a single leg has no gap
    closure_rates = [no_rates, *(block - twists[0] for block in twists[1:])]
    return Gaps(closure, np.concatenate(closure_rates, axis=1), twists[0])


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
            block[:, :, k] = stacked_columns(mover.twist(end.platform.translation).components(), count)
        first += len(end.movers)
        blocks.append(block)
    return blocks


def pose_coordinates(end: Displacement) -> dict[str, Array]:
    """Return the coordinates of a placement: P (m), and the angles (rad) of `rotation_of_angles`, arrays [n]."""
    angles = {name: np.arctan2(sine, cosine) for name, (cosine, sine) in _cosines_and_sines(end.rotation).items()}
    return {name: np.asarray(getattr(end.translation, name)) for name in POINT} | angles

"""The equations that joint coordinates of a machine written leg by leg satisfy, over any scalar. They are not solved.

What solves them is in `closure`; how their solution changes with the machine and its pose follows from them alone.

Source: theory (19)-(21), in the base frame.
"""

from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, cos, minus, sin, sqrt, times
from kinetostat.algebra.vector import ZERO, Displacement, Rotation
from kinetostat.kinematics.closed_form import platform_placement
from kinetostat.machine.machine import Chains
from kinetostat.machine.written.family import place

ANGLES = ("roll", "pitch", "yaw")


def closing_equations(chains: Chains, coordinates: Sequence[Scalar]) -> list[Scalar]:
    """What vanishes where all legs take the platform to one place and that place has the given pose.

    Exact to first order there: rotations are half the sum of r x r' over their columns, the rotation vector between
    two placements that all but agree.

    Args:
        chains: the legs at the home pose, and the pose.
        coordinates: of their joints leg by leg, from the home pose, rad or m.

    Returns:
        Six numbers for each leg after the first, then one for each pose coordinate; m, rotations (rad) times the
        machine's length.
    """
    remaining = iter(coordinates)
    ends = [place(steps, remaining)[1] @ chains.home for steps in chains.legs]
    gaps = [gap for end in ends[1:] for gap in _apart(ends[0], end, chains.length)]
    return [*gaps, *_off_pose(chains, ends[0])]


def _apart(one: Displacement, other: Displacement, length: Scalar) -> list[Scalar]:
    return [*_turned(one.rotation, other.rotation, length), *(other.translation - one.translation).components()]


def _turned(one: Rotation, other: Rotation, length: Scalar) -> list[Scalar]:
    """The rotation vector from one rotation to another, times the length."""
    turn = ZERO
    for a, b in ((one.x, other.x), (one.y, other.y), (one.z, other.z)):
        turn = turn + a.cross(b)
    return list((turn * times(0.5, length)).components())


def _off_pose(chains: Chains, end: Displacement) -> list[Scalar]:
    """What is left from a placement to the pose, for each coordinate that is given."""
    given = chains.pose
    points = {"x": end.translation.x, "y": end.translation.y, "z": end.translation.z}
    gaps = [minus(given[name], reached) for name, reached in points.items() if name in given]
    if all(name in given for name in ANGLES):
        return gaps + _turned(end.rotation, platform_placement(chains).rotation, chains.length)
    sides = _sides(end.rotation)
    return gaps + [
        times(chains.length, minus(times(sin(given[name]), sides[name][0]), times(cos(given[name]), sides[name][1])))
        for name in ANGLES
        if name in given
    ]


def _sides(turn: Rotation) -> dict[str, tuple[Scalar, Scalar]]:
    """Cosine and sine of roll, pitch and yaw of Q = Rz(yaw) Ry(pitch) Rx(roll), each up to a common factor."""
    flat = sqrt(times(turn.x.x, turn.x.x) + times(turn.x.y, turn.x.y))
    return {"roll": (turn.z.z, turn.y.z), "pitch": (flat, -turn.x.z), "yaw": (turn.x.x, turn.x.y)}

"""Joint coordinates in closed form where every leg has one: for one pose, for many, or traced. No iteration here.

Source: theory (23). Placements are in the base frame.
"""

from kinetostat.algebra.scalar import Scalar, cos, plus, sin, times, where
from kinetostat.algebra.vector import Displacement, Vector, rotation_x, rotation_y, rotation_z
from kinetostat.kinematics.reach import clearance
from kinetostat.kinematics.status import Status
from kinetostat.machine.leg import Turn
from kinetostat.machine.machine import Chains
from kinetostat.machine.written.family import place

CLOSED = 1e-10
"""Largest gap of a closed leg: rad, or in units of the machine's length."""


def platform_placement(chains: Chains) -> Displacement:
    """Where the pose puts the platform, if coordinates that it does not give are those of the home pose."""
    given, home = chains.pose, chains.home.translation
    roll, pitch, yaw = (given.get(name, 0.0) for name in ("roll", "pitch", "yaw"))
    turn = rotation_z(cos(yaw), sin(yaw)) @ rotation_y(cos(pitch), sin(pitch)) @ rotation_x(cos(roll), sin(roll))
    return Displacement(turn, Vector(given.get("x", home.x), given.get("y", home.y), given.get("z", home.z)))


def closed_joints(chains: Chains) -> tuple[list[Scalar | Turn], Scalar] | None:
    """Joint coordinates of all legs, and a `Status` code; None if a leg has no closed form.

    NOT_CONVERGED says that the legs close only if coordinates which the pose does not give differ from those of the
    home pose: Newton's method finds them.
    """
    inverses = [inverse for inverse in chains.inverses if inverse is not None]
    if len(inverses) < len(chains.legs):
        return None
    placement = platform_placement(chains)
    motion = placement @ chains.home.inverse()
    found: list[Scalar | Turn] = []
    reached: Scalar = True
    gap: Scalar = 0.0
    for inverse, steps in zip(inverses, chains.legs, strict=True):
        amounts, closure = inverse.amounts(steps, motion)
        found += amounts
        reached = (clearance(closure) >= 0.0) & reached
        gap = plus(gap, _gap(place(steps, iter(amounts))[1] @ chains.home, placement, chains.length))
    status = where(gap < CLOSED * CLOSED, int(Status.OK), int(Status.NOT_CONVERGED))
    return found, where(reached, status, int(Status.OUT_OF_REACH))


def _gap(one: Displacement, other: Displacement, length: Scalar) -> Scalar:
    """Square of how far two placements differ, rad and units of the length."""
    shift = (one.translation - other.translation) * (1.0 / length)
    turns = zip(_columns(one), _columns(other), strict=True)
    apart = [a - b for a, b in turns]
    square: Scalar = shift.dot(shift)
    for column in apart:
        square = plus(square, times(0.5, column.dot(column)))
    return square


def _columns(placement: Displacement) -> tuple[Vector, Vector, Vector]:
    turn = placement.rotation
    return turn.x, turn.y, turn.z

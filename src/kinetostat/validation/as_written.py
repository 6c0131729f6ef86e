"""A machine at its pose as its file describes it, for independent engines: nothing of it comes from kinetostat's chain.

`written_legs` reads the joints, links and masses of a machine that is written leg by leg, and its legs are closed here
by their own equations. Joint coordinates that kinetostat has found only say where to begin, which decides the assembly
mode.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.algebra.vector import Displacement, Rotation, Vector
from kinetostat.arrays import Array
from kinetostat.kinematics.closure import Joints
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Turn
from kinetostat.machine.loads import located_members
from kinetostat.machine.machine import Configuration, Machine, Member, Plane
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import CLOSED
from kinetostat.validation.family_legs import with_legs_of_file
from kinetostat.validation.moving_legs import MovingLeg, apply, placement, turn, vector
from kinetostat.validation.pieces import array, columns
from kinetostat.validation.written_legs import written_legs

STEPS = 20
"""Steps of Newton's method from coordinates that should be those of the pose already."""


@dataclass(frozen=True)
class Drawing:
    """A machine at its pose as its file describes it.

    Attributes:
        configuration: the platform and every leg.
        reference: the tool point T, base frame, m.
        members: the links with their masses.
    """

    configuration: Configuration
    reference: Vector
    members: tuple[Member, ...]


def drawing(machine: Machine, response: Response, joints: Joints | None) -> Drawing:
    """Return a machine as its file describes it.

    Args:
        machine: at its pose.
        response: of it; where the file leaves coordinates of the pose open, it says them.
        joints: of a machine written leg by leg, at the pose.

    Raises:
        InputError: if a leg as the file describes it does not reach the platform.
    """
    if joints is None:
        placed = with_legs_of_file(machine, response.configuration)
        at = placed.platform.apply(Vector(*machine.tables["tool"].offset))
        return Drawing(placed, at, tuple(located_members(machine, placed, None)))
    ours = response.configuration
    target, length = _platform(machine, ours.platform), float(ours.length)
    home = placement(np.eye(3), np.array(machine.tables["platform"].point, dtype=float))
    remaining, legs, members = [_amount(amount) for amount in joints.coordinates], [], []
    for leg in written_legs(machine):
        start, remaining = remaining[: leg.size], remaining[leg.size :]
        placements = closed(leg, start, target @ np.linalg.inv(home), length)
        legs.append(leg.placed(placements))
        members += [body.member(leg.name, placements) for body in leg.bodies]
    axes = [vector(axis) for axis in target[:3, :3].T]
    platform = Displacement(Rotation(*axes), vector(target[:3, 3]))
    plane = Plane() if machine.family.planar else None
    reference = vector(apply(target, np.array(machine.tables["tool"].offset, dtype=float)))
    return Drawing(Configuration(platform, tuple(legs), (), length, plane), reference, tuple(members))


def closed(leg: MovingLeg, start: Sequence[float], target: Array, length: float) -> list[Array]:
    """Placements along a leg whose platform end is displaced as a pose says, by Newton's method.

    Args:
        leg: at the home pose.
        start: coordinates to begin with, rad and m.
        target: displacement of the platform from the home pose [4 x 4].
        length: of the machine, m.

    Raises:
        InputError: if the leg does not reach there.
    """
    coordinates = np.array(start, dtype=float)
    for _ in range(STEPS):
        placements = leg.placements(coordinates.tolist())
        gap = _twist(target @ np.linalg.inv(placements[-1]))
        if _size(gap, target, length) <= CLOSED:
            return placements
        coordinates = coordinates + np.linalg.lstsq(leg.rates(placements, coordinates.tolist()), gap, rcond=None)[0]
    raise InputError(
        f'Leg "{leg.name}", as the file describes it, does not reach the platform where kinetostat places it: '
        f"{1000.0 * length * _size(gap, target, length):.3g} mm are missing. Please report this machine."
    )


def _twist(error: Array) -> Array:
    """A small displacement as a twist about the origin, rotation first [6]."""
    skew = 0.5 * (error[:3, :3] - error[:3, :3].T)
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0], *error[:3, 3]])


def _size(gap: Array, target: Array, length: float) -> float:
    """How far a twist moves the platform: rad, or share of the machine's length."""
    moved = gap[3:] + np.cross(gap[:3], target[:3, 3])
    return max(float(np.linalg.norm(gap[:3])), float(np.linalg.norm(moved)) / length)


def _platform(machine: Machine, ours: Displacement) -> Array:
    """Placement of the platform: Q = Rz(yaw) Ry(pitch) Rx(roll) and P, what the file gives as it gives it [4 x 4]."""
    rotation, place = columns(ours.rotation), array(ours.translation)
    pose: Mapping[str, float] = {
        "x": place[0],
        "y": place[1],
        "z": place[2],
        "roll": math.atan2(rotation[2, 1], rotation[2, 2]),
        "pitch": math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0])),
        "yaw": math.atan2(rotation[1, 0], rotation[0, 0]),
        **vars(machine.tables["pose"]),
    }
    x, y, z = np.eye(3)
    angles = turn(z, pose["yaw"]) @ turn(y, pose["pitch"]) @ turn(x, pose["roll"])
    return placement(angles, np.array([pose["x"], pose["y"], pose["z"]]))


def _amount(amount: object) -> float:
    """A joint coordinate as a number, rad or m."""
    return math.atan2(float(amount.sine), float(amount.cosine)) if isinstance(amount, Turn) else float(amount)  # type: ignore[arg-type]

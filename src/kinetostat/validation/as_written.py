"""A machine at its pose as its file describes it, for independent engines: nothing of it comes from kinetostat's chain.

`written_legs` reads the joints, links and masses of a machine that is written leg by leg, and its legs are closed here
by their own equations. Joint coordinates that kinetostat has found only say where to begin, which decides the assembly
mode. Actuated struts and cranks of families are placed once more, from the radii, angles, lengths and springs of the
file and the pose, so that an engine notices joints that a family's closed form puts elsewhere. Passive legs, and legs
with pairs of bars, are those of the family. Points and axes are in the base frame, SI.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from kinetostat.algebra.vector import AXES, Displacement, Rotation, Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Element, Joint, Leg, Spring, Turn
from kinetostat.machine.loads import located_members
from kinetostat.machine.machine import Configuration, Machine, Member, Plane
from kinetostat.machine.parts import Arm
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import CLOSED
from kinetostat.validation.moving_legs import MovingLeg, apply, placement, turn, unit, vector
from kinetostat.validation.pieces import array, columns
from kinetostat.validation.written_legs import written_legs

MOST_CLOSING_STEPS = 20
"""Steps of Newton's method from coordinates that should be those of the pose already: a handful are enough."""
X, Y, Z = np.eye(3)
CRANKS_SUFFIX = "-rus"
"""End of the names of families whose legs have cranks in the place of struts."""


def _tilt(pose: Any) -> Array:
    return turn(Y, pose.theta1) @ turn(X, pose.theta2)


PLATFORMS: Mapping[str, Callable[[Any], Array]] = {
    "hexapod": lambda pose: placement(
        turn(Z, pose.yaw) @ turn(Y, pose.pitch) @ turn(X, pose.roll), np.array([pose.x, pose.y, pose.z])
    ),
    "passive-leg-3dof-pu": lambda pose: placement(_tilt(pose), pose.z * Z),
    "tricept": lambda pose: placement(_tilt(pose), _tilt(pose) @ (pose.length * Z)),
    "planar-3rpr": lambda pose: placement(turn(Z, pose.angle), np.array([pose.x, pose.y, 0.0])),
}
"""Placement of the platform at a pose, by family [4 x 4]."""
GUIDED = ("passive-leg-4dof", "passive-leg-5dof")
"""Families whose platform is where their passive leg takes it."""


@dataclass(frozen=True)
class DrawnMachine:
    """A machine at its pose as its file describes it.

    Attributes:
        configuration: the platform and every leg.
        reference: the tool point T, base frame, m.
        members: the links with their masses.
    """

    configuration: Configuration
    reference: Vector
    members: tuple[Member, ...]


def drawing(machine: Machine, response: Response, joints: Joints | None) -> DrawnMachine:
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
        return DrawnMachine(placed, at, tuple(located_members(machine, placed, None)))
    ours = response.configuration
    target, length = _platform(machine, ours.platform), float(ours.length)
    home = placement(np.eye(3), np.array(machine.tables["platform"].point, dtype=float))
    remaining, legs, members = [_coordinate(amount) for amount in joints.coordinates], [], []
    for leg in written_legs(machine):
        start, remaining = remaining[: leg.size], remaining[leg.size :]
        placements = closed_placements(leg, start, target @ np.linalg.inv(home), length)
        legs.append(leg.at_pose(placements))
        members += [body.member(leg.name, placements) for body in leg.bodies]
    axes = [vector(axis) for axis in target[:3, :3].T]
    platform = Displacement(Rotation(*axes), vector(target[:3, 3]))
    plane = Plane() if machine.family.planar else None
    reference = vector(apply(target, np.array(machine.tables["tool"].offset, dtype=float)))
    return DrawnMachine(Configuration(platform, tuple(legs), (), length, plane), reference, tuple(members))


def closed_placements(leg: MovingLeg, start: Sequence[float], target: Array, length: float) -> list[Array]:
    """Return the placements along a leg whose platform end is displaced as a pose says, by Newton's method.

    Args:
        leg: at the home pose.
        start: coordinates to begin with, rad and m.
        target: displacement of the platform from the home pose [4 x 4].
        length: of the machine, m.

    Raises:
        InputError: if the leg does not reach there.
    """
    coordinates = np.array(start, dtype=float)
    for _ in range(MOST_CLOSING_STEPS):
        placements = leg.placements(coordinates.tolist())
        gap = _twist(target @ np.linalg.inv(placements[-1]))
        if _motion_size(gap, target, length) <= CLOSED:
            return placements
        coordinates = coordinates + np.linalg.lstsq(leg.rates(placements, coordinates.tolist()), gap, rcond=None)[0]
    raise InputError(
        f'Leg "{leg.name}", as the file describes it, does not reach the platform where kinetostat places it: '
        f"{1000.0 * length * _motion_size(gap, target, length):.3g} mm are missing. Please report this machine."
    )


def _twist(error: Array) -> Array:
    """Return a small displacement as a twist about the origin, rotation first [6]."""
    skew = 0.5 * (error[:3, :3] - error[:3, :3].T)
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0], *error[:3, 3]])


def _motion_size(gap: Array, target: Array, length: float) -> float:
    """Return the size of the motion of the platform by a twist: rad, or share of the machine's length."""
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


def _coordinate(amount: object) -> float:
    """Return a joint coordinate as a number, rad or m."""
    return math.atan2(float(amount.sine), float(amount.cosine)) if isinstance(amount, Turn) else float(amount)  # type: ignore[arg-type]


def with_legs_of_file(machine: Machine, ours: Configuration) -> Configuration:
    """Return the machine with its actuated legs where the file puts them; other families are left as they are.

    Args:
        machine: of any family, at its pose.
        ours: its configuration by kinetostat, from which passive legs and the assembly mode are taken.
    """
    kind = machine.family.name.removesuffix(CRANKS_SUFFIX)
    if kind not in PLATFORMS and kind not in GUIDED:
        return ours
    place = PLATFORMS[kind](machine.tables["pose"]) if kind in PLATFORMS else _matrix(ours.platform)
    build = _crank if machine.family.name.endswith(CRANKS_SUFFIX) else _strut
    drives = [leg for leg in ours.legs if leg.number is not None]
    base, top = _rings(machine, place)
    made = {
        leg.name: Leg(leg.name, tuple(build(machine, i, (base[i], top[i]), leg)), leg.lines, number=leg.number)
        for i, leg in enumerate(drives)
    }
    axes = [vector(axis) for axis in place[:3, :3].T]
    platform = Displacement(Rotation(*axes), vector(place[:3, 3]))
    legs = tuple(made.get(leg.name, leg) for leg in ours.legs)
    return Configuration(platform, legs, (), ours.length, ours.plane)


def _rings(machine: Machine, place: Array) -> tuple[list[Array], list[Array]]:
    """Return the base and platform joints of the actuated legs, in order."""
    geometry = machine.tables["geometry"]
    rings = []
    for name in ("base", "platform"):
        first, quarter = getattr(geometry, f"{name}_angle", 0.0), math.pi / 2.0
        angles = getattr(geometry, f"{name}_angles", (first, quarter + first, -quarter - first, -first))
        radius, height = getattr(geometry, f"{name}_radius"), getattr(geometry, f"{name}_height", 0.0)
        rings.append([np.array([radius * math.cos(a), radius * math.sin(a), height]) for a in angles])
    return rings[0], [apply(place, point) for point in rings[1]]


def _drive(machine: Machine, number: int, freedom: Joint) -> list[Spring]:
    """Return the springs of an actuator: one, or those of its parts in a row."""
    series = machine.tables.get("stiffness.actuator")
    rows = [machine.tables["stiffness"].actuator] if series is None else list(vars(series).values())
    return [Spring("actuator", freedom, row[number], actuated=i == 0) for i, row in enumerate(rows)]


def _elastic(freedom: Joint, rigidity: float, length: float, factor: float = 1.0) -> list[Spring]:
    """Return a spring of a link over its whole length; none if it is rigid."""
    return [] if math.isinf(rigidity) else [Spring("link", freedom, factor * rigidity / length)]


def _strut(machine: Machine, number: int, ends: tuple[Array, Array], _ours: Leg) -> Sequence[Element]:
    """Return a slide between two spherical joints; of a planar machine, between two revolutes."""
    low, high = ends
    axes = (AXES[2],) if machine.family.planar else AXES
    along, length = Joint(vector(unit(high - low))), float(np.linalg.norm(high - low))
    rod = _elastic(along, float(machine.tables["stiffness"].leg_axial), length)
    return [*_ball(low, axes), *_drive(machine, number, along), *rod, *_ball(high, axes)]


def _crank(machine: Machine, number: int, ends: tuple[Array, Array], ours: Leg) -> Sequence[Element]:
    """Return a crank in a vertical plane and a rod, with its elbow on the side where kinetostat has it."""
    (low, high), geometry, stiffness = ends, machine.tables["geometry"], machine.tables["stiffness"]
    side = turn(Z, geometry.crank_turn[number]) @ unit([low[0], low[1], 0.0])
    crank, rod, span = float(geometry.crank_length), float(geometry.rod_length), high - low
    across, up = float(span @ side), float(span @ Z)
    middle = math.atan2(up, across)
    half = math.acos((span @ span + crank**2 - rod**2) / (2.0 * crank * math.hypot(across, up)))
    elbows = [low + crank * (math.cos(a) * side + math.sin(a) * Z) for a in (middle + half, middle - half)]
    (arm,) = [element for element in ours.chain if isinstance(element, Arm)]
    elbow = min(elbows, key=lambda point: float(np.linalg.norm(point - array(arm.end))))
    axis = np.cross(Z, side)
    pivot, sideways = Joint(vector(axis), vector(low)), Joint(vector(np.cross(axis, unit(elbow - low))), vector(low))
    along = Joint(vector(unit(high - elbow)))
    bending = [
        *_elastic(pivot, stiffness.crank_bending, crank, 3.0),
        *_elastic(sideways, stiffness.crank_bending, crank, 3.0),
    ]
    stretched = _elastic(along, stiffness.leg_axial, rod)
    bar = Arm(vector(low), vector(elbow))
    return [*_drive(machine, number, pivot), *bending, bar, *_ball(elbow, AXES), *stretched, *_ball(high, AXES)]


def _ball(centre: Array, axes: Sequence[Any]) -> list[Joint]:
    return [Joint(axis, vector(centre)) for axis in axes]


def _matrix(place: Displacement) -> Array:
    return placement(columns(place.rotation), array(place.translation))

"""Actuated legs of families between rings of joints, from the tables of their file: places of joints, and springs.

Struts and cranks are placed here once more, from radii, angles, lengths and the pose, so that an independent engine
notices joints that a family's closed form puts elsewhere. Passive legs, and legs with pairs of bars, are those of the
family. Points and axes are in the base frame, SI.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from kinetostat.algebra.vector import AXES, Displacement, Rotation
from kinetostat.arrays import Array
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parts import Arm
from kinetostat.validation.moving_legs import apply, placement, turn, unit, vector
from kinetostat.validation.pieces import array, columns

X, Y, Z = np.eye(3)
CRANKS = "-rus"
"""How the names of families end whose legs have cranks in the place of struts."""


def _tilted(pose: Any) -> Array:
    return turn(Y, pose.theta1) @ turn(X, pose.theta2)


PLATFORMS: Mapping[str, Callable[[Any], Array]] = {
    "hexapod": lambda pose: placement(
        turn(Z, pose.yaw) @ turn(Y, pose.pitch) @ turn(X, pose.roll), np.array([pose.x, pose.y, pose.z])
    ),
    "passive-leg-3dof-pu": lambda pose: placement(_tilted(pose), pose.z * Z),
    "tricept": lambda pose: placement(_tilted(pose), _tilted(pose) @ (pose.length * Z)),
    "planar-3rpr": lambda pose: placement(turn(Z, pose.angle), np.array([pose.x, pose.y, 0.0])),
}
"""Placement of the platform at a pose, by family [4 x 4]."""
GUIDED = ("passive-leg-4dof", "passive-leg-5dof")
"""Families whose platform is where their passive leg takes it."""


def with_legs_of_file(machine: Machine, ours: Configuration) -> Configuration:
    """The machine with its actuated legs where the file puts them; other families are left as they are.

    Args:
        machine: of any family, at its pose.
        ours: its configuration by kinetostat, from which passive legs and the assembly mode are taken.
    """
    kind = machine.family.name.removesuffix(CRANKS)
    if kind not in PLATFORMS and kind not in GUIDED:
        return ours
    place = PLATFORMS[kind](machine.tables["pose"]) if kind in PLATFORMS else _matrix(ours.platform)
    build = _crank if machine.family.name.endswith(CRANKS) else _strut
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
    """Base and platform joints of the actuated legs, in order."""
    geometry = machine.tables["geometry"]
    rings = []
    for name in ("base", "platform"):
        first, quarter = getattr(geometry, f"{name}_angle", 0.0), math.pi / 2.0
        angles = getattr(geometry, f"{name}_angles", (first, quarter + first, -quarter - first, -first))
        radius, height = getattr(geometry, f"{name}_radius"), getattr(geometry, f"{name}_height", 0.0)
        rings.append([np.array([radius * math.cos(a), radius * math.sin(a), height]) for a in angles])
    return rings[0], [apply(place, point) for point in rings[1]]


def _drive(machine: Machine, number: int, freedom: Joint) -> list[Spring]:
    """The springs of an actuator: one, or those of its parts in a row."""
    series = machine.tables.get("stiffness.actuator")
    rows = [machine.tables["stiffness"].actuator] if series is None else list(vars(series).values())
    return [Spring("actuator", freedom, row[number], actuated=i == 0) for i, row in enumerate(rows)]


def _elastic(freedom: Joint, rigidity: float, length: float, factor: float = 1.0) -> list[Spring]:
    """A spring of a link over its whole length; none if it is rigid."""
    return [] if math.isinf(rigidity) else [Spring("link", freedom, factor * rigidity / length)]


def _strut(machine: Machine, number: int, ends: tuple[Array, Array], _ours: Leg) -> Sequence[Element]:
    """A slide between two spherical joints; of a planar machine, between two revolutes."""
    low, high = ends
    axes = (AXES[2],) if machine.family.planar else AXES
    along, length = Joint(vector(unit(high - low))), float(np.linalg.norm(high - low))
    rod = _elastic(along, float(machine.tables["stiffness"].leg_axial), length)
    return [*_ball(low, axes), *_drive(machine, number, along), *rod, *_ball(high, axes)]


def _crank(machine: Machine, number: int, ends: tuple[Array, Array], ours: Leg) -> Sequence[Element]:
    """A crank in a vertical plane and a rod, with its elbow on the side where kinetostat has it."""
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

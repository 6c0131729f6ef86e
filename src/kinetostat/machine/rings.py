"""Machines between two rings of joints, on the base and on the platform: where their legs begin and end, and the legs.

A family says where its platform is and what guides it; the actuated legs, struts (U-P-S) or cranks (R-U-S), come from
here. Points and axes are in the base frame, points of the platform's ring before it is moved in its own.

Source: theory (13)-(15) for the cranks.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import chain
from typing import Annotated, Any, NamedTuple

from kinetostat.algebra.lines import crank_end, crank_range
from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin
from kinetostat.algebra.vector import AXES, Z_AXIS, Displacement, Vector, polar, ring, rotation_z
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import (
    RIGID,
    Element,
    Joint,
    Leg,
    Line,
    PartName,
    Spring,
    revolutes,
    with_numbers,
)
from kinetostat.machine.links import LinkKind, in_each_leg, straight_legs
from kinetostat.machine.machine import Closure, Configuration, Family
from kinetostat.machine.parts import Arm, if_elastic, per_length, two_force_legs
from kinetostat.spec.fields import Field, Quantity, made_table, quantities, table

Three = tuple[float, float, float]
of_three_legs = partial(Quantity, count=3, per_leg=True)
"""A quantity with a value for each of three legs."""


@table
class Rings:
    """Part of a table [geometry]: the radii."""

    base_radius: Annotated[float, Quantity("length", "radius of the base joints, Rb", positive=True)]
    platform_radius: Annotated[float, Quantity("length", "radius of the platform joints, Rp", positive=True)]

    @property
    def size(self) -> Scalar:
        """Characteristic length of the machine, m: the mean radius."""
        return 0.5 * (self.base_radius + self.platform_radius)


def joint_angles(ring_name: str, count: int) -> Quantity:
    """Angles of the joints of a ring, "base" or "platform": one for each leg."""
    meaning = f"angles of the {ring_name} joints from x, leg by leg"
    return Quantity("angle", meaning, count=count, apart=True, per_leg=True)


@table
class ThreeLegs(Rings):
    """Part of a table [geometry]: rings of three legs."""

    base_angles: Annotated[Three, joint_angles("base", 3)]
    platform_angles: Annotated[Three, joint_angles("platform", 3)]


class LegEnds(NamedTuple):
    """The joints at both ends of the actuated legs, in the order of the legs: base joints, platform joints.

    Points are in the base frame, m.
    """

    base: Sequence[Vector]
    platform: Sequence[Vector]


def leg_ends(
    rings: Rings,
    base_angles: Sequence[Scalar],
    platform_angles: Sequence[Scalar],
    platform: Displacement,
    base_height: Scalar = 0.0,
    platform_height: Scalar = 0.0,
) -> LegEnds:
    """The ends of legs between two rings.

    Args:
        rings: the radii.
        base_angles, platform_angles: the angles of the joints of both rings from x, rad.
        platform: the placement of the platform.
        base_height: z of the base ring in the base frame, m.
        platform_height: z of the platform ring in the platform frame, m.
    """
    top = ring(rings.platform_radius, platform_angles, platform_height)
    return LegEnds(ring(rings.base_radius, base_angles, base_height), [platform.apply(point) for point in top])


def four_joints(radius: Scalar, angle: Scalar) -> list[Vector]:
    """Joint centres at `radius` (m) and the angles T, 90 deg + T, -(90 deg + T), -T for T = `angle` (rad)."""
    p = polar(radius, angle)
    return [p, Vector(-p.y, p.x, 0.0), Vector(-p.y, -p.x, 0.0), Vector(p.x, -p.y, 0.0)]


@dataclass(frozen=True)
class Placement:
    """A machine at its pose without its actuated legs; base frame, m.

    Attributes:
        platform: the placement of the platform; its translation is P.
        joints: the joints at both ends of the actuated legs.
        passive: the passive legs that guide the platform.
        closures: what the passive legs need to close.
    """

    platform: Displacement
    joints: LegEnds
    passive: tuple[Leg, ...] = ()
    closures: tuple[Closure, ...] = ()

    def with_legs(self, legs: Sequence[Leg], size: Scalar, closures: Sequence[Closure] = ()) -> Configuration:
        """The whole machine, with its actuated legs, their closures, and its characteristic length (m)."""
        return Configuration(self.platform, (*self.passive, *legs), (*self.closures, *closures), size)


@table
class Cranks:
    """Part of a table [geometry]: the links of R-U-S legs."""

    crank_length: Annotated[
        float, Quantity("length", "from the actuated revolute to the joint of the rod", positive=True)
    ]
    rod_length: Annotated[float, Quantity("length", "from the crank to the platform joint", positive=True)]


@dataclass(frozen=True)
class CrankLinks:
    """The two links of a crank leg.

    Attributes:
        crank, rod: lengths, m.
        bending: E I of the crank, N·m².
        axial: E A of the rod, N.
    """

    crank: Scalar
    rod: Scalar
    bending: Scalar = RIGID
    axial: Scalar = RIGID


PlacedLeg = tuple[Leg, tuple[Closure, ...]]
"""A leg at a pose, and what it needs to close there."""


def legs_and_closures(placed: Iterable[PlacedLeg]) -> tuple[tuple[Leg, ...], tuple[Closure, ...]]:
    """Return the actuated legs of a family with their numbers, and what all of them need to close."""
    legs, closures = zip(*placed, strict=True)
    return tuple(with_numbers(legs)), tuple(chain.from_iterable(closures))


CRANK_LINKS = (
    LinkKind("cranks", ("crank_bending",), in_each_leg("crank", "crank_length", 0)),
    LinkKind("rods", ("leg_axial",), in_each_leg("rod", "rod_length", 1)),
)
"""The links of R-U-S legs, whose rods have the rigidity `leg_axial`."""


def outward_directions(base: Sequence[Vector], radius: Scalar, turns: Sequence[Scalar]) -> list[Vector]:
    """Horizontal unit vectors in the vertical planes of the cranks: away from the z axis, each turned about it.

    Args:
        base: base joints, on a ring about z, m.
        radius: the radius of the ring, m.
        turns: the turn of each plane about z, rad.
    """
    shrink = reciprocal(radius)
    radial = [Vector(point.x, point.y, 0.0) * shrink for point in base]
    return [rotation_z(cos(turn), sin(turn)).apply(v) for v, turn in zip(radial, turns, strict=True)]


def place_elbow(
    name: str, base: Vector, tip: Vector, axis: Vector, links: CrankLinks
) -> tuple[Vector, tuple[Closure, ...]]:
    """The elbow between a crank and its rod (base frame, m; NaN out of reach), and what the leg needs to close.

    Args:
        name: the name of the leg.
        base, tip: the point through which the crank's axis goes, and the end of the rod, base frame, m.
        axis: unit vector. Seen along it, the elbow lies at +90 deg from the way from base to tip.
        links: crank and rod.
    """
    nearest, farthest = crank_range(base, tip, axis, links.crank)
    rod = f"rod of {name}"
    closures = (Closure(rod, nearest, 0.0, links.rod), Closure(rod, farthest, links.rod, RIGID))
    return crank_end(base, tip, axis, links.crank, links.rod), closures


def crank_leg(name: str, base: Vector, tip: Vector, axis: Vector, stiffness: Scalar, links: CrankLinks) -> PlacedLeg:
    """R-U-S with the revolute actuated: a force along the rod and nothing else (theory section 4).

    The crank bends at its built-in end, in its plane and across it, by 3 E I / length each: of the four torsional
    springs of the paper's Table II those that a force through the elbow loads.

    Args:
        name: the name of the leg.
        base, tip: centres of the actuated revolute and of the spherical joint, base frame, m.
        axis: the axis of the revolute, unit vector; see `place_elbow` for its sign.
        stiffness: the stiffness of the actuator, N·m/rad.
        links: crank and rod.
    """
    elbow, closures = place_elbow(name, base, tip, axis, links)
    along, crank = (tip - elbow) * reciprocal(links.rod), (elbow - base) * reciprocal(links.crank)
    bending, part = per_length(links.bending, links.crank, 3.0), PartName(name, "crank")
    elements: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), Joint(axis, base), stiffness, actuated=True),
        *if_elastic(
            Spring(f"{part} in plane", Joint(axis, base), bending, part),
            Spring(f"{part} across", Joint(axis.cross(crank), base), bending, part),
        ),
        Arm(base, elbow),
        *revolutes(elbow, AXES, f"{name} elbow"),
        *if_elastic(Spring(PartName(name, "rod"), Joint(along), per_length(links.axial, links.rod))),
        *revolutes(tip, AXES, f"{name} platform joint"),
    )
    return Leg(name, elements, (Line(tip, along),)), closures


PlatformOf = Callable[[Any, Any, Any], Placement]
"""From the tables geometry, stiffness and pose (SI) to the platform in closed form, NaN where it cannot be."""


def with_struts_or_cranks(
    name: str,
    summaries: tuple[str, str],
    tables: Mapping[str, type],
    platform_of: PlatformOf,
    links: Sequence[LinkKind] = (),
) -> tuple[Family, Family]:
    """Two families of one platform: with U-P-S legs, struts, and as "NAME-rus" with R-U-S legs, cranks with rods.

    Struts are forces along lines between the joints. Cranks turn in vertical planes, outward where the platform is
    above the base; a machine is NaN where a rod does not reach.

    Args:
        name: the name of the family with struts.
        summaries: one line about each of the two, for lists.
        tables: geometry (`Rings`), stiffness (with `actuator` and `leg_axial`) and pose of the family with struts.
        platform_of: places the platform and what guides it.
        links: the links with a mass that guide it.
    """

    def with_struts(geometry: Any, stiffness: Any, pose: Any) -> Configuration:
        placement = platform_of(geometry, stiffness, pose)
        legs = two_force_legs(*placement.joints, stiffness.actuator, stiffness.leg_axial)
        return placement.with_legs(legs, geometry.size)

    def with_cranks(geometry: Any, stiffness: Any, pose: Any) -> Configuration:
        placement = platform_of(geometry, stiffness, pose)
        bars = CrankLinks(geometry.crank_length, geometry.rod_length, stiffness.crank_bending, stiffness.leg_axial)
        # About this axis the crank points to its side if the platform joint is above the base joint, else away from it.
        sides = outward_directions(placement.joints.base, geometry.base_radius, geometry.crank_turn)
        axes = [Z_AXIS.cross(side) for side in sides]
        legs, closures = legs_and_closures(
            crank_leg(f"leg {i}", base, tip, axis, k, bars)
            for i, (base, tip, axis, k) in enumerate(zip(*placement.joints, axes, stiffness.actuator, strict=True), 1)
        )
        return placement.with_legs(legs, geometry.size, closures)

    struts = LinkKind("legs", ("leg_axial",), straight_legs)
    cranked = {**tables, **_crank_tables(tables["geometry"], tables["stiffness"])}
    return (
        Family(name, summaries[0], tables, with_struts, links=(struts, *links)),
        Family(f"{name}-rus", summaries[1], cranked, with_cranks, links=(*CRANK_LINKS, *links)),
    )


def _crank_tables(geometry: type, stiffness: type) -> dict[str, type]:
    """The tables [geometry] and [stiffness] of cranks, from those of struts."""
    count = quantities(stiffness)["actuator"].count
    turn = Quantity("angle", "turn of each crank's plane about z, from the radial direction", count=count, per_leg=True)
    rigidities = {
        "actuator": Field(
            Quantity("torsional stiffness", "stiffness of the actuated revolutes", count=count, per_leg=True)
        ),
        "leg_axial": Field(Quantity("axial rigidity", "axial rigidity of the rods, EA"), RIGID),
        "crank_bending": Field(Quantity("bending rigidity", "bending rigidity of the cranks, EI"), RIGID),
    }
    turns = {"crank_turn": Field(turn, (0.0,) * (count or 1))}
    return {
        "geometry": made_table("Geometry", turns, (geometry, Cranks)),
        "stiffness": made_table("Stiffness", rigidities, (stiffness,)),
    }

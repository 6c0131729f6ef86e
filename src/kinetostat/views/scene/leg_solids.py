"""Legs as solids: joints by their kind, links by their cross-section, rails and springs.

Where the parts are, and how thick they are, is decided in `anatomy`. Sizes of joints are written in radii of the leg;
they were chosen by eye, so that joints look like those that one can buy, and say nothing about the machine.
"""

import math
from dataclasses import replace

from kinetostat.algebra.vector import Vector
from kinetostat.views.scene import shapes
from kinetostat.views.scene.anatomy import (
    Anatomy,
    JointPart,
    LinkPart,
    Profile,
    Proportions,
    RailPart,
    SpringPart,
    coincide,
)
from kinetostat.views.scene.solids import Extruded, Solid, Swept, Turned, unit, upright

RAIL_LENGTH = 0.55
"""Length of a rail as a share of the machine's diagonal."""
COIL_TURNS = 2.5
"""Turns of the spiral that stands for a torsional spring."""
BARREL_SHARE = 0.56
"""Length of a cylinder as a share of its leg's length where the machine was loaded."""
LONGEST_BARREL = 0.88
"""Share of a leg that its cylinder takes at most, however short the leg becomes."""
BAR_RADIUS = 0.72
"""Radius of a bar as a share of a leg's cylinder, where the file gives no cross-section."""
CABLE_RADIUS = 0.3
"""Radius of a cable as a share of a leg's."""
JOINT_PER_WIDTH = 0.42
"""Radius from which joints are drawn, in widths of the thickest link of the leg."""


def leg_solids(leg: Anatomy, up: Vector | None, down: Vector, sizes: Proportions) -> list[Solid]:
    """Build all parts of a leg between base and platform.

    Args:
        leg: the parts of the leg.
        up: normal of the base plate, towards the joints; None where there is no such plate.
        down: normal of the platform, towards the joints.
        sizes: the proportions of the machine.
    """
    material = "removed" if leg.removed else "actuated" if leg.actuated else "passive"
    radius = joint_radius(leg, sizes)
    solids: list[Solid] = []
    for link in leg.links:
        span = sizes.spans.get(link.name, link.span.norm())
        solids += _link(link, radius, material, sizes.cross_sections.get(link.name), span)
    for joint in leg.joints:
        solids += _joint(joint, _neighbours(joint, leg, up, down), radius, material)
    for rail in leg.rails:
        solids += _rail(rail, sizes, radius, leg.second_point - rail.point)
    # A rigid spring does not deflect, so it is not drawn.
    solids += [_spring(spring, radius) for spring in leg.springs if not math.isinf(spring.stiffness)]
    return [replace(solid, leg=leg.leg) for solid in solids]


def joint_radius(leg: Anatomy, sizes: Proportions) -> float:
    """Return the radius to which the joints of a leg are drawn, m: more than usual where a link is thick."""
    profiles = [sizes.cross_sections[link.name] for link in leg.links if link.name in sizes.cross_sections]
    return max([sizes.leg, *(JOINT_PER_WIDTH * profile.width for profile in profiles)])


def _neighbours(joint: JointPart, leg: Anatomy, up: Vector | None, down: Vector) -> tuple[Vector, Vector]:
    """Return the vectors from a joint to the part before it and to the part after it in its leg: a link, or a plate."""
    before = next((link.start - joint.point for link in leg.links if coincide(link.end, joint.point)), None)
    after = next((link.end - joint.point for link in leg.links if coincide(link.start, joint.point)), None)
    if before is None and up is not None and not leg.on_rail:
        before = -up
    if after is None:
        after = -down
    return (before if before is not None else -after), after


def _joint(joint: JointPart, towards: tuple[Vector, Vector], radius: float, material: str) -> list[Solid]:
    """Return a joint.

    Args:
        joint: kind, place and axes of the joint.
        towards: vectors from its centre to the part before it and to the part after it, base axes.
        radius: the radius of the leg, m.
        material: the material of the leg.
    """
    before, after = unit(towards[0]), unit(towards[1])
    match joint.kind:
        case "spherical":
            return _spherical(joint, after, radius)
        case "universal":
            return _universal(joint, before, after, radius)
        case "motor":
            return _motor(joint, radius, material)
        case "flexure":
            return [_at(joint, "flexure", shapes.waist(1.3 * radius, 0.35 * radius, 4.0 * radius), "spring", before)]
        case "helical":
            return [*_revolute(joint, before, radius, material), _thread(joint, radius)]
    return _revolute(joint, before, radius, material)


def _spherical(joint: JointPart, after: Vector, radius: float) -> list[Solid]:
    size = 1.45 * radius
    return [
        _at(joint, "ball", shapes.ball(size), "steel", after),
        _at(joint, "socket", shapes.socket(size), "joint", -after),
    ]


def _universal(joint: JointPart, before: Vector, after: Vector, radius: float) -> list[Solid]:
    """Return a cross whose arms two forks hold."""
    first, second = joint.axes
    cross = [
        _at(joint, f"cross {n}", shapes.pin(0.36 * radius, 3.5 * radius), "steel", axis)
        for n, axis in enumerate((first, second), 1)
    ]
    heart = _at(joint, "heart", shapes.ball(0.8 * radius), "steel", first)
    return [
        *cross,
        heart,
        _fork(joint, "base fork", first, before, radius),
        _fork(joint, "leg fork", second, after, radius),
    ]


def _fork(joint: JointPart, name: str, axis: Vector, stem: Vector, radius: float) -> Solid:
    """Return a fork around the pin along `axis`, with its bridge towards `stem`."""
    arm, width = 0.55 * radius, 1.5 * radius
    outline = shapes.fork(2.1 * radius, arm, 2.3 * radius, 0.6 * radius)
    across = unit(stem.cross(axis))
    place = upright(joint.point - across * (0.5 * width), across, axis)  # y is away from the stem, the bridge at -y
    return Solid(f"{joint.name}/{name}", Extruded(outline, width, 0.12 * radius), "joint", place)


def _revolute(joint: JointPart, before: Vector, radius: float, material: str) -> list[Solid]:
    """Return a pin through an eye, held in a fork."""
    (axis, *_) = joint.axes
    return [
        _at(joint, "pin", shapes.pin(0.55 * radius, 4.0 * radius), "steel", axis),
        _at(joint, "eye", shapes.pin(1.35 * radius, 1.9 * radius), material, axis),
        _fork(joint, "fork", axis, before, radius),
    ]


def _motor(joint: JointPart, radius: float, material: str) -> list[Solid]:
    (axis, *_) = joint.axes
    size = 1.9 * radius
    body = shapes.shaft(size, 3.4 * radius, 0.25 * size, 1.1 * radius)
    return [
        _at(joint, "motor", body, "motor", axis),
        _at(joint, "flange", shapes.shaft(1.18 * size, 0.5 * radius, 0.1 * radius, 0.7 * radius), "joint", axis),
        _at(joint, "hub", shapes.shaft(1.25 * radius, 2.0 * radius, 0.15 * radius, -1.2 * radius), material, axis),
        _at(joint, "motor end", shapes.shaft(0.8 * size, 0.4 * radius, 0.1 * radius, 4.5 * radius), "joint", axis),
    ]


def _thread(joint: JointPart, radius: float) -> Solid:
    return _at(joint, "thread", shapes.helix(0.75 * radius, 5.0 * radius, 6.0, 0.16 * radius), "steel", joint.axes[0])


def _at(joint: JointPart, name: str, shape: Turned | Swept, material: str, z: Vector) -> Solid:
    return Solid(f"{joint.name}/{name}", shape, material, upright(joint.point, z))


def rail_ends(rail: RailPart, sizes: Proportions) -> tuple[Vector, Vector]:
    """Return the ends of a rail, base frame, m. It does not move with its carriage, and is long enough for it."""
    home, half = sizes.carriages.get(rail.name, rail.point), 0.5 * RAIL_LENGTH * sizes.diagonal
    travel = (rail.point - home).dot(rail.axis)
    middle = rail.point - rail.axis * travel
    return middle + rail.axis * min(-half, travel), middle + rail.axis * max(half, travel)


def _rail(rail: RailPart, sizes: Proportions, radius: float, inward: Vector) -> list[Solid]:
    """Return a rail on its bed, with brackets at its ends, and the carriage.

    Args:
        rail: the axis of the rail, and the place of its carriage.
        sizes: the proportions of the machine.
        radius: the radius of the leg, m.
        inward: the direction from the carriage to the rest of the leg.
    """
    outward = unit(rail.axis.cross(rail.axis.cross(inward)))
    start, end = rail_ends(rail, sizes)
    length = (end - start).norm()

    def part(name: str, box: tuple[float, float, float], material: str, along: float, away: float) -> Solid:
        """Return a part of the rail.

        Args:
            name: the name of the part.
            box: depth away from the leg and width across it in radii, and length along the axis in m.
            material: the material of the part.
            along, away: place of its middle from the start of the rail, m, and of its face from the axis, in radii.
        """
        depth, width, extent = box
        origin = start + rail.axis * (along - 0.5 * extent) + outward * (away * radius)
        shape = shapes.block(depth * radius, width * radius, extent, 0.1 * radius)
        return Solid(f"{rail.name}/{name}", shape, material, upright(origin, rail.axis, outward))

    carriage = (rail.point - start).dot(rail.axis)
    return [
        part("rail", (1.0, 1.4, length), "steel", 0.5 * length, 1.7),
        part("bed", (1.3, 3.4, length), "base", 0.5 * length, 2.8),
        part("carriage", (1.8, 3.8, 4.4 * radius), "motor" if rail.driven else "joint", carriage, 0.9),
        part("first end", (3.0, 4.2, 1.0 * radius), "base", 0.0, 2.2),
        part("last end", (3.0, 4.2, 1.0 * radius), "base", length, 2.2),
    ]


def _spring(spring: SpringPart, radius: float) -> Solid:
    """Return a virtual spring as in a sketch: a spiral about its axis, or a coil along it."""
    shape = (
        shapes.spiral(1.9 * radius, 3.3 * radius, COIL_TURNS, 0.17 * radius)
        if spring.torsional
        else shapes.helix(1.75 * radius, 6.0 * radius, 5.0, 0.17 * radius)
    )
    material = "removed" if spring.stiffness == 0.0 else "spring"
    return Solid(f"{spring.name}/spring", shape, material, upright(spring.point, spring.axis), layer="springs")


def _link(link: LinkPart, radius: float, material: str, profile: Profile | None, span: float) -> list[Solid]:
    """Return a link of a leg.

    Args:
        link: kind and ends of the link.
        radius: the radius of a leg, m.
        material: the material of the leg.
        profile: the cross-section of the link, if the file gives one.
        span: the length of a telescope where the machine was loaded, m.
    """
    if link.kind == "telescope":
        return _telescope(link, radius, material, span)
    if link.kind == "bars":
        return _bars(link, radius, material)
    if link.kind == "cable":
        place = upright(link.start, link.span)
        return [Solid(f"{link.name}/cable", shapes.shaft(CABLE_RADIUS * radius, link.span.norm()), material, place)]
    return [_bar(link, radius, material, profile)]


def _bar(link: LinkPart, radius: float, material: str, profile: Profile | None) -> Solid:
    length = link.span.norm()
    place = upright(link.start, link.span, link.up)
    if profile is None:
        return Solid(f"{link.name}/bar", shapes.shaft(0.95 * radius, length, 0.15 * radius), material, place)
    if profile.depth is None:
        return Solid(
            f"{link.name}/bar", shapes.shaft(0.5 * profile.width, length, 0.05 * profile.width), material, place
        )
    chamfer = 0.06 * min(profile.width, profile.depth)
    return Solid(f"{link.name}/bar", shapes.block(profile.depth, profile.width, length, chamfer), material, place)


def _telescope(link: LinkPart, radius: float, material: str, span: float) -> list[Solid]:
    """Return a cylinder at the start, from which the rod comes."""
    length, along = link.span.norm(), unit(link.span)
    gap = min(2.0 * radius, 0.12 * length)  # between joint and cylinder, where the stem is seen
    barrel = min(BARREL_SHARE * span, LONGEST_BARREL * length) - gap
    barrel_radius = 1.25 * radius
    rim_radius = 1.14 * barrel_radius

    def part(name: str, shape: Turned, part_material: str, distance: float) -> Solid:
        return Solid(f"{link.name}/{name}", shape, part_material, upright(link.start + along * distance, along))

    return [
        part("stem", shapes.shaft(0.7 * radius, gap + 0.2 * radius), "joint", 0.0),
        part("cylinder", shapes.shaft(barrel_radius, barrel, 0.2 * radius), material, gap),
        part("cap", shapes.shaft(rim_radius, 0.9 * radius, 0.15 * radius), "joint", gap),
        part("gland", shapes.shaft(rim_radius, 0.8 * radius, 0.15 * radius), "joint", gap + barrel - 0.7 * radius),
        part("rod", shapes.shaft(0.62 * radius, length - gap - barrel + radius), "steel", gap + barrel - radius),
    ]


def _bars(link: LinkPart, radius: float, material: str) -> list[Solid]:
    """Return two bars, and the shafts or pins that hold them."""
    side = link.side if link.side is not None else link.span * 0.0
    thick, width = BAR_RADIUS * radius, side.norm()
    solids = []
    for end, centre in (("near", link.start), ("far", link.end)):
        place = upright(centre, side)
        solids.append(Solid(f"{link.name}/{end} shaft", shapes.pin(0.7 * thick, 2.0 * width + radius), "joint", place))
    for n, sign in enumerate((1.0, -1.0), 1):
        start = link.start + side * sign
        length = link.span.norm()
        bar = shapes.shaft(thick, length)
        solids.append(Solid(f"{link.name}/bar {n}", bar, material, upright(start, link.span)))
        for end, centre in (("near", start), ("far", link.end + side * sign)):
            knuckle = shapes.pin(1.25 * thick, 1.6 * thick) if link.pinned else shapes.ball(1.55 * thick)
            axis = link.span.cross(side) if link.pinned else link.span
            solids.append(Solid(f"{link.name}/{end} knuckle {n}", knuckle, "steel", upright(centre, axis)))
    return solids

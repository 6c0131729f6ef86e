"""Joints as solids, each by its kind. Where they are is the anatomy's business."""

import math

from kinetostat.algebra.vector import Vector
from kinetostat.views.scene import shapes
from kinetostat.views.scene.anatomy import JointPart, RailPart, SpringPart
from kinetostat.views.scene.profiles import Proportions
from kinetostat.views.scene.solids import Extruded, Solid, Swept, Turned, unit, upright

RAIL = 0.55
"""Length of a rail as a share of the machine's diagonal."""
COIL_TURNS = 2.5


def joint_solids(joint: JointPart, towards: tuple[Vector, Vector], radius: float, material: str) -> list[Solid]:
    """A joint of a leg of some radius (m).

    Args:
        joint: its kind, place and axes.
        towards: from its centre to the body before it and to the body after it, base frame.
        radius: of the leg.
        material: of the leg.
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
    """A cross whose arms two forks hold."""
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
    """A fork around the pin along `axis`, its bridge on the side of `stem`."""
    arm, width = 0.55 * radius, 1.5 * radius
    outline = shapes.fork(2.1 * radius, arm, 2.3 * radius, 0.6 * radius)
    across = unit(axis.cross(stem))
    place = upright(joint.point - across * (0.5 * width), across, axis)
    up = place.rotation.y
    if up.dot(stem) > 0.0:
        place = upright(joint.point + across * (0.5 * width), -across, axis)
    return Solid(f"{joint.name}/{name}", Extruded(outline, width, 0.12 * radius), "joint", place)


def _revolute(joint: JointPart, before: Vector, radius: float, material: str) -> list[Solid]:
    """A pin through an eye, held in a fork."""
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
    """The ends of a rail, base frame, m; it stays while the carriage moves, and reaches at least that far."""
    home, half = sizes.carriages.get(rail.name, rail.point), 0.5 * RAIL * sizes.diagonal
    moved = (rail.point - home).dot(rail.axis)
    middle = rail.point - rail.axis * moved
    return middle + rail.axis * min(-half, moved), middle + rail.axis * max(half, moved)


def rail_solids(rail: RailPart, sizes: Proportions, radius: float, inward: Vector) -> list[Solid]:
    """A rail on its bed, with brackets at its ends, and the carriage.

    Args:
        rail: where the carriage is.
        sizes: of the machine.
        radius: of the leg, m.
        inward: to where the carriage carries the rest of the leg.
    """
    outward = unit(rail.axis.cross(rail.axis.cross(inward)))
    start, end = rail_ends(rail, sizes)
    length = (end - start).norm()

    def part(name: str, box: tuple[float, float, float], material: str, along: float, away: float) -> Solid:
        """A box of so many radii: away from the leg, across, and (m) along the axis."""
        deep, wide, long = box
        origin = start + rail.axis * (along - 0.5 * long) + outward * (away * radius)
        shape = shapes.block(deep * radius, wide * radius, long, 0.1 * radius)
        return Solid(f"{rail.name}/{name}", shape, material, upright(origin, rail.axis, outward))

    at = (rail.point - start).dot(rail.axis)
    return [
        part("rail", (1.0, 1.4, length), "steel", 0.5 * length, 1.7),
        part("bed", (1.3, 3.4, length), "base", 0.5 * length, 2.8),
        part("carriage", (1.8, 3.8, 4.4 * radius), "motor" if rail.driven else "joint", at, 0.9),
        part("first end", (3.0, 4.2, 1.0 * radius), "base", 0.0, 2.2),
        part("last end", (3.0, 4.2, 1.0 * radius), "base", length, 2.2),
    ]


def spring_solid(spring: SpringPart, radius: float) -> Solid:
    """A virtual spring as engineers sketch it: a spiral about its axis, or a coil along it."""
    shape = (
        shapes.spiral(1.9 * radius, 3.3 * radius, COIL_TURNS, 0.17 * radius)
        if spring.torsional
        else shapes.helix(1.75 * radius, 6.0 * radius, 5.0, 0.17 * radius)
    )
    material = "removed" if spring.stiffness == 0.0 else "spring"
    return Solid(f"{spring.name}/spring", shape, material, upright(spring.point, spring.axis), layer="springs")


def visible(spring: SpringPart) -> bool:
    """Whether a spring is drawn: a rigid one is not there."""
    return not math.isinf(spring.stiffness)

"""A machine at a pose as a scene of solids, and what it does there as overlays. No renderer is known here."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.deflected import DeflectedLink
from kinetostat.kinetostatics.indices import Principal
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import BASE_FRAME, Configuration, Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.refusal import why_not
from kinetostat.views.scene import joints, links, overlays, shapes
from kinetostat.views.scene.anatomy import Anatomy, JointPart, anatomy, together
from kinetostat.views.scene.overlays import Measure
from kinetostat.views.scene.plates import Plate, plate_behind
from kinetostat.views.scene.profiles import Proportions, bounds, cross_sections_of, diagonal, leg_radius
from kinetostat.views.scene.solids import Label, Scene, Solid, unit, upright

SNUG = 0.42
"""Radius from which joints are drawn, in widths of the thickest link of the leg."""
BED = 4.5
"""Depth of a rail's bed below its carriage's joint, in radii of its leg."""
FRAME = 0.11
"""Length of a frame's axes as a share of the machine's diagonal."""
DRAWN = (Status.OK, Status.JOINT_LIMIT, Status.SINGULAR)
"""Poses at which every part has its place."""


def proportions_of(machine: Machine, configuration: Configuration) -> Proportions:
    """Sizes to draw a machine with, from how it stands when it is loaded; they stay while it moves."""
    legs = [anatomy(leg) for leg in configuration.legs]
    size = diagonal(configuration)
    return Proportions(
        leg_radius(machine, size),
        cross_sections_of(machine),
        {link.name: link.span.norm() for leg in legs for link in leg.links},
        {rail.name: rail.point for leg in legs for rail in leg.rails},
        size,
    )


def scene_of(machine: Machine) -> Scene:
    """A machine at its pose, in proportions that suit it there.

    Raises:
        InputError: not every part has a place at the pose; the message says why.
    """
    response = respond(machine)
    points = [point for leg in response.configuration.legs for point in leg.path]
    placed = all(math.isfinite(c) for point in points for c in point.components())
    if Status(int(response.status)) not in DRAWN or not placed:
        raise InputError(f"The machine cannot be drawn at this pose. {why_not(machine, response, ())}")
    return machine_scene(machine, response.configuration, proportions_of(machine, response.configuration))


def machine_scene(machine: Machine, configuration: Configuration, sizes: Proportions) -> Scene:
    """The machine at a pose: base, platform, legs, springs, tool, frames and labels.

    Args:
        machine: gives tool and sections.
        configuration: of it, every joint placed.
        sizes: from `proportions_of`.
    """
    legs = [anatomy(leg) for leg in configuration.legs]
    base, platform = plates(configuration, legs, sizes.leg)
    solids = [*(base.solids() if base else []), *platform.solids(), *_tool(machine, configuration, platform, sizes.leg)]
    for leg in legs:
        solids += _leg_solids(leg, base, platform, sizes)
    tool = machine.tool_point(configuration.platform)
    frames = [("O", BASE_FRAME), ("P", configuration.platform)]
    if not together(tool, configuration.platform.translation):
        frames.append(("T", Displacement(configuration.platform.rotation, tool)))
    length = FRAME * sizes.diagonal
    named = [Label(leg.leg.removeprefix("leg "), _label_point(leg, sizes)) for leg in legs if leg.actuated]
    for name, place in frames:
        solids += overlays.frame_solids(name, place, length)
        named += overlays.frame_labels(name, place, length)
    rails = [end for leg in legs for rail in leg.rails for end in joints.rail_ends(rail, sizes)]
    points = [*(p for leg in configuration.legs for p in leg.path), configuration.platform.translation, tool, *rails]
    low, high = bounds(points)
    span = high - low
    beds = BED * max(_radius(leg, sizes) for leg in legs) if rails else 0.0
    floor = min(low.z - beds, *(_lowest(plate) for plate in (base, platform) if plate)) - 0.6 * sizes.leg
    return Scene(tuple(solids), tuple(named), (low + high) * 0.5, math.hypot(*span.components()), floor)


def plates(configuration: Configuration, legs: Sequence[Anatomy], radius: float) -> tuple[Plate | None, Plate]:
    """The base plate, unless all legs slide along rails, and the platform."""
    up = configuration.plane.frame.rotation.z if configuration.plane else configuration.platform.translation
    feet = [leg for leg in legs if not leg.on_rail]
    base = None
    if feet:
        into = [_next_point(leg) - leg.foot for leg in feet]
        base = plate_behind("base", [leg.foot for leg in feet], into, radius, BASE_FRAME, up)
    back = [_last_but_one(leg) - leg.head for leg in legs]
    top = plate_behind("platform", [leg.head for leg in legs], back, radius, configuration.platform, -up)
    return base, top


def _next_point(leg: Anatomy) -> Vector:
    return leg.links[0].end if leg.links else leg.head


def _last_but_one(leg: Anatomy) -> Vector:
    return leg.links[-1].start if leg.links else leg.foot


def _leg_solids(leg: Anatomy, base: Plate | None, platform: Plate, sizes: Proportions) -> list[Solid]:
    material = "removed" if leg.removed else "actuated" if leg.actuated else "passive"
    radius = _radius(leg, sizes)
    found: list[Solid] = []
    for link in leg.links:
        span = sizes.spans.get(link.name, link.span.norm())
        found += links.link_solids(link, radius, material, sizes.cross_sections.get(link.name), span)
    for joint in leg.joints:
        found += joints.joint_solids(joint, _sides(joint, leg, base, platform), radius, material)
    for rail in leg.rails:
        found += joints.rail_solids(rail, sizes, radius, _next_point(leg) - rail.point)
    found += [joints.spring_solid(spring, radius) for spring in leg.springs if joints.visible(spring)]
    return [replace(solid, leg=leg.leg) for solid in found]


def _radius(leg: Anatomy, sizes: Proportions) -> float:
    """From which the joints of a leg are drawn, m: the machine's, or more where a link is thicker."""
    profiles = [sizes.cross_sections[link.name] for link in leg.links if link.name in sizes.cross_sections]
    return max([sizes.leg, *(SNUG * profile.width for profile in profiles)])


def _sides(joint: JointPart, leg: Anatomy, base: Plate | None, platform: Plate) -> tuple[Vector, Vector]:
    """From a joint to what lies before it and after it in its leg: a link, or a plate."""
    before = next((link.start - joint.point for link in leg.links if together(link.end, joint.point)), None)
    after = next((link.end - joint.point for link in leg.links if together(link.start, joint.point)), None)
    if before is None and base is not None and not leg.on_rail:
        before = -base.normal
    if after is None:
        after = -platform.normal
    return (before if before is not None else -after), after


def _tool(machine: Machine, configuration: Configuration, platform: Plate, radius: float) -> list[Solid]:
    """What leads from the platform to P, and from there to the tool point, where they lie apart."""
    tip, point = machine.tool_point(configuration.platform), configuration.platform.translation
    found = []
    near = (point - platform.place.translation).norm()
    if near > 4.0 * radius and not platform.hub:
        way = point - platform.place.translation
        shape = shapes.shaft(1.3 * radius, way.norm(), 0.2 * radius)
        found.append(Solid("platform/neck", shape, "platform", upright(platform.place.translation, way)))
    if not together(tip, point):
        shape = shapes.cone(1.5 * radius, 0.3 * radius, (tip - point).norm())
        found.append(Solid("platform/tool", shape, "tool", upright(point, tip - point)))
    return found


def _label_point(leg: Anatomy, sizes: Proportions) -> Vector:
    """Beside the foot of a leg."""
    return leg.foot - unit(_next_point(leg) - leg.foot) * (0.5 * sizes.leg) + Vector(0.0, 0.0, 2.2 * sizes.leg)


def _lowest(plate: Plate) -> float:
    thick = 1.7 * plate.radius
    corners = [plate.place.apply(Vector(0.0, 0.0, plate.surface - thick)).z]
    return min(*corners, *(joint.z - thick for joint in plate.joints))


@dataclass(frozen=True)
class Deflection:
    """A loaded machine's small motions.

    Attributes:
        load: at the tool point, base axes, N·m and N.
        motion: of the tool point, rad and m.
        links: of the legs.
    """

    load: Wrench
    motion: Twist
    links: tuple[DeflectedLink, ...]


def response_overlays(
    machine: Machine, configuration: Configuration, sizes: Proportions, principal: dict[str, Principal] | None
) -> list[Solid]:
    """Ellipsoids and softest directions at the tool point; nothing where a direction is free.

    Args:
        machine, configuration, sizes: as for `machine_scene`.
        principal: compliances by block, base axes.
    """
    if not principal:
        return []
    point, measure = machine.tool_point(configuration.platform), Measure(sizes.diagonal, sizes.leg)
    bodies = [s for block, one in principal.items() for s in overlays.ellipsoid_solids(block, one, point, measure)]
    return [*bodies, *overlays.softest_solids(principal, point, measure)]


def deflection_overlays(
    machine: Machine, configuration: Configuration, sizes: Proportions, found: Deflection, factor: float | None = None
) -> tuple[list[Solid], float]:
    """The load and the deflected shape, and the factor by which it is exaggerated.

    Args:
        machine, configuration, sizes: as for `machine_scene`.
        found: its small motions.
        factor: of exaggeration; None to choose a round one.
    """
    point, measure = machine.tool_point(configuration.platform), Measure(sizes.diagonal, sizes.leg)
    loads = overlays.load_solids(found.load, point, measure)
    moved = [*found.motion.components(), *(c for link in found.links for c in link.end_motion.components())]
    if not all(math.isfinite(c) for c in moved):
        return loads, 1.0
    legs = [anatomy(leg) for leg in configuration.legs]
    _, platform = plates(configuration, legs, sizes.leg)
    radii = {leg.leg: _radius(leg, sizes) for leg in legs}
    reach = max((joint - point).norm() for joint in platform.joints)
    chosen = factor or overlays.exaggeration(found.links, found.motion, reach, sizes.diagonal)
    body = [*platform.solids(), *_tool(machine, configuration, platform, sizes.leg)]
    return [*loads, *overlays.ghost_solids(found.links, body, found.motion, point, chosen, radii)], chosen

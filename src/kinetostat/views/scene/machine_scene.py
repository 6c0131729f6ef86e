"""A machine at a pose as a scene: base, platform, legs, tool, frames and labels. No renderer is known here."""

import math
from collections.abc import Sequence

from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.refusal import why_not
from kinetostat.machine.machine import BASE_FRAME, Configuration, Machine
from kinetostat.spec.errors import InputError
from kinetostat.views.scene import shapes
from kinetostat.views.scene.anatomy import Anatomy, Proportions, anatomy, bounds, proportions_of, together
from kinetostat.views.scene.leg_solids import joint_radius, leg_solids, rail_ends
from kinetostat.views.scene.plates import Plate, plate_behind
from kinetostat.views.scene.solids import Label, Scene, Solid, unit, upright

BED_DEPTH = 4.5
"""Depth of a rail's bed below its carriage's joint, in radii of its leg."""
FRAME_LENGTH = 0.11
"""Length of a frame's axes as a share of the machine's diagonal."""
DRAWABLE = (Status.OK, Status.JOINT_LIMIT, Status.SINGULAR, Status.UNDECIDED)
"""Status of poses at which every part has a place."""


def scene_of(machine: Machine) -> Scene:
    """Build the scene of a machine at its pose, in proportions that suit it there.

    Raises:
        InputError: the pose does not place every part; the message says why.
    """
    state = state_of(machine)
    configuration = state.configuration
    points = [point for leg in configuration.legs for point in leg.path]
    placed = all(math.isfinite(c) for point in points for c in point.components())
    if Status(int(state.free.status)) not in DRAWABLE or not placed:
        raise InputError(f"The machine cannot be drawn at this pose. {why_not(machine, state.free, ())}")
    return machine_scene(machine, configuration, proportions_of(machine, configuration))


def machine_scene(machine: Machine, configuration: Configuration, sizes: Proportions) -> Scene:
    """Build the scene of a machine: base, platform, legs, springs, tool, frames and labels.

    Args:
        machine: gives the tool.
        configuration: its pose, with every joint placed.
        sizes: the proportions that `proportions_of` returns.
    """
    legs = [anatomy(leg) for leg in configuration.legs]
    base, platform = plates(configuration, legs, sizes.leg)
    hidden = has_open_frame(configuration)
    of_base = [solid for solid in base.solids() if not (hidden and solid.name == "base/plate")] if base else []
    solids = [*of_base, *platform.solids()]
    solids += tool_solids(machine, configuration, platform, sizes.leg)
    for leg in legs:
        solids += leg_solids(leg, base, platform, sizes)
    tool = machine.tool_point(configuration.platform)
    frames = [("O", BASE_FRAME), ("P", configuration.platform)]
    if not together(tool, configuration.platform.translation):
        frames.append(("T", Displacement(configuration.platform.rotation, tool)))
    length = FRAME_LENGTH * sizes.diagonal
    labels = [Label(leg.label, _label_point(leg, sizes)) for leg in legs if leg.actuated]
    for name, place in frames:
        solids += frame_solids(name, place, length)
        labels += frame_labels(name, place, length)
    rails = [end for leg in legs for rail in leg.rails for end in rail_ends(rail, sizes)]
    points = [*(p for leg in configuration.legs for p in leg.path), configuration.platform.translation, tool, *rails]
    low, high = bounds(points)
    span = high - low
    beds = BED_DEPTH * max(joint_radius(leg, sizes) for leg in legs) if rails else 0.0
    floor = min(low.z - beds, *(_lowest(plate) for plate in (base, platform) if plate)) - 0.6 * sizes.leg
    return Scene(tuple(solids), tuple(labels), (low + high) * 0.5, math.hypot(*span.components()), floor)


def frame_solids(name: str, place: Displacement, length: float) -> list[Solid]:
    """Draw the axes of a frame as arrows (m)."""
    axes = place.rotation
    return [
        Solid(
            f"frame {name}/{axis}", shapes.arrow(length, 0.028 * length), f"{axis} axis",
            upright(place.translation, direction), layer="frames",
        )
        for axis, direction in zip("xyz", (axes.x, axes.y, axes.z), strict=True)
    ]  # fmt: skip


def frame_labels(name: str, place: Displacement, length: float) -> list[Label]:
    """Write the name of a frame at its origin and the letters of its axes."""
    axes = place.rotation
    tips = zip("xyz", (axes.x, axes.y, axes.z), strict=True)
    letters = [Label(letter, place.translation + axis * (1.12 * length), "frames") for letter, axis in tips]
    return [Label(name, place.translation, "frames"), *letters]


def has_open_frame(configuration: Configuration) -> bool:
    """Return whether cables hang between the posts of a frame: a plate behind their anchors would hide the machine."""
    return all(spring.acts for leg in configuration.legs for spring in leg.springs if spring.actuated)


def plates(configuration: Configuration, legs: Sequence[Anatomy], radius: float) -> tuple[Plate | None, Plate]:
    """Return the base plate, None where all legs slide along rails, and the platform."""
    up = configuration.plane.frame.rotation.z if configuration.plane else configuration.platform.translation
    feet = [leg for leg in legs if not leg.on_rail]
    base = None
    if feet:
        into = [leg.second_point - leg.foot for leg in feet]
        base = plate_behind("base", [leg.foot for leg in feet], into, radius, BASE_FRAME, up)
    back = [leg.last_but_one - leg.head for leg in legs]
    top = plate_behind("platform", [leg.head for leg in legs], back, radius, configuration.platform, -up)
    return base, top


def tool_solids(machine: Machine, configuration: Configuration, platform: Plate, radius: float) -> list[Solid]:
    """Return the neck from the platform to P, and the tool from there to the tool point, where these lie apart."""
    tip, point = machine.tool_point(configuration.platform), configuration.platform.translation
    solids = []
    near = (point - platform.place.translation).norm()
    if near > 4.0 * radius and platform.block is None:
        offset = point - platform.place.translation
        shape = shapes.shaft(1.3 * radius, offset.norm(), 0.2 * radius)
        solids.append(Solid("platform/neck", shape, "platform", upright(platform.place.translation, offset)))
    if not together(tip, point):
        shape = shapes.cone(1.5 * radius, 0.3 * radius, (tip - point).norm())
        solids.append(Solid("platform/tool", shape, "tool", upright(point, tip - point)))
    return solids


def _label_point(leg: Anatomy, sizes: Proportions) -> Vector:
    """Return a point beside the foot of a leg."""
    return leg.foot - unit(leg.second_point - leg.foot) * (0.5 * sizes.leg) + Vector(0.0, 0.0, 2.2 * sizes.leg)


def _lowest(plate: Plate) -> float:
    thick = 1.7 * plate.radius
    corners = [plate.place.apply(Vector(0.0, 0.0, plate.surface - thick)).z]
    return min(*corners, *(joint.z - thick for joint in plate.joints))

"""A machine at a pose as a scene: base and platform as plates, legs, tool, frames and labels.

Plates lie behind the joints of the legs and are joined to them by pedestals; legs are built in `leg_solids`. No
renderer is known here.
"""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.refusal import why_not
from kinetostat.machine.machine import BASE_FRAME, Configuration, Machine
from kinetostat.spec.errors import InputError
from kinetostat.views.scene import shapes
from kinetostat.views.scene.anatomy import Anatomy, Proportions, anatomy, bounds, coincide, proportions_of
from kinetostat.views.scene.leg_solids import joint_radius, leg_solids, rail_ends
from kinetostat.views.scene.mesh import turn_of
from kinetostat.views.scene.shapes import CORNER_POINTS, HALF_CIRCLE_POINTS
from kinetostat.views.scene.solids import Extruded, Label, Point2, Scene, Solid, unit, upright

BED_DEPTH = 4.5
"""Depth of a rail's bed below its carriage's joint, in radii of its leg."""
FLOOR_CLEARANCE = 0.6
"""Distance of the ground below the lowest part, in radii of a leg: a plate's shadow is seen beside it."""
FRAME_LENGTH = 0.11
"""Length of a frame's axes as a share of the machine's diagonal: letters at their ends do not meet those of legs."""
DRAWABLE = (Status.OK, Status.JOINT_LIMIT, Status.SINGULAR, Status.UNDECIDED)
"""Status of poses at which every part has a place."""
PLATE_CLEARANCE = 2.3
"""Distance of a plate from the joint centres, in radii of a leg: enough room for the fork of a joint."""
HUB_SPREAD = 1.0
"""If the joints spread less than this, in radii of a leg, a block takes the place of the plate."""
BLOCK_SIZE = 3.4
"""Size of a block around joints that coincide, in radii of a leg; one around others is as much larger than they."""
FLATNESS = 0.2
"""Spread of joints across their mean plane, as a share of their greatest spread, above which a platform is a block."""
LEAST_LEAN = 0.05
"""Sine of the angle between the links together and the plane of their joints, below which they lie in this plane."""
PLATE_MARGIN = {"base": 3.6, "platform": 2.9}
"""Width of the rim of a plate beyond its joints, in radii of a leg: their pedestals stand well inside."""
PLATE_THICKNESS = {"base": 1.7, "platform": 1.3}
"""Thickness of a plate, in radii of a leg: the base looks the heavier one."""
LEAST_NECK = 4.0
"""Distance of P from the middle of the platform's joints, in radii of a leg, beyond which a neck leads there."""
LETTER_DISTANCE = 1.12
"""Place of the letter of an axis of a frame, in lengths of the axis: just beyond its arrow."""
NANOMETRE_DECIMALS = 9
"""Decimals of a length in m to which corners of plates are rounded: round-off makes no two corners of one point."""


@dataclass(frozen=True)
class Plate:
    """A plate behind some joints.

    Attributes:
        name: base or platform.
        place: frame with z towards the joints and the origin in their middle, in their mean plane, base frame.
        joints: centres of the joints, base frame, m.
        radius: radius of a leg, m.
        block: size of the block that takes the place of the plate, along the axes of `place`, m: joints are close
            together, or those of a platform do not lie near a plane. None for a plate.
    """

    name: str
    place: Displacement
    joints: tuple[Vector, ...]
    radius: float
    block: Vector | None

    @property
    def normal(self) -> Vector:
        """Direction from the plate to the joints, base axes."""
        return self.place.rotation.z

    @property
    def surface(self) -> float:
        """Coordinate of the plate's face along its z, m; it lies below every joint."""
        lowest = min((joint - self.place.translation).dot(self.normal) for joint in self.joints)
        return lowest - PLATE_CLEARANCE * self.radius

    @property
    def lowest(self) -> float:
        """Height of the lowest point of the plate, about, base frame, m: below its middle or its lowest joint."""
        thick = PLATE_THICKNESS["base"] * self.radius  # that of the thicker plate: the ground is below either
        middle = self.place.apply(Vector(0.0, 0.0, self.surface - thick))
        return min(middle.z, *(joint.z - thick for joint in self.joints))

    def solids(self) -> list[Solid]:
        """Make the plate and its pedestals."""
        if self.block is not None:
            return [self._solid_block(self.block)]
        thick = PLATE_THICKNESS[self.name] * self.radius
        outline = rounded_hull(self._joints_in_plane(), PLATE_MARGIN[self.name] * self.radius)
        origin = self.place.apply(Vector(0.0, 0.0, self.surface - thick))
        plate = Solid(
            f"{self.name}/plate",
            Extruded(outline, thick, 0.22 * thick),
            self.name,
            Displacement(self.place.rotation, origin),
        )
        return [plate, *(self._pedestal(n, joint) for n, joint in enumerate(self.joints, 1))]

    def _solid_block(self, size: Vector) -> Solid:
        down = Displacement(self.place.rotation, self.place.apply(Vector(0.0, 0.0, -0.5 * size.z)))
        shape = shapes.block(size.x, size.y, size.z, 0.12 * min(size.components()))
        return Solid(f"{self.name}/block", shape, self.name, down)

    def _joints_in_plane(self) -> list[Point2]:
        """Return the coordinates of the joints along x and y of the plate's frame, m."""
        axes, places = self.place.rotation, [joint - self.place.translation for joint in self.joints]
        decimals = NANOMETRE_DECIMALS
        return [(round(place.dot(axes.x), decimals), round(place.dot(axes.y), decimals)) for place in places]

    def _pedestal(self, number: int, joint: Vector) -> Solid:
        height = (joint - self.place.translation).dot(self.normal) - self.surface
        shape = shapes.cone(1.9 * self.radius, 1.25 * self.radius, max(height - 1.5 * self.radius, 0.4 * self.radius))
        foot = joint - self.normal * height
        return Solid(f"{self.name}/pedestal {number}", shape, "joint", upright(foot, self.normal))


def plate_behind(
    name: str, joints: Sequence[Vector], links: Sequence[Vector], radius: float, frame: Displacement, side: Vector
) -> Plate:
    """Place a plate behind joints, on the side away from their links, or a block around them; see `Plate.block`.

    Args:
        name: base or platform; a block stands around joints that are apart in a platform only.
        joints: centres of the joints, base frame, m.
        links: vector from each joint into its leg, base axes.
        radius: radius of a leg, m.
        frame: frame of the body, base frame; its z is the normal if the joints do not span a plane.
        side: direction from the plate to the joints, used if the links lie in the plane of the joints.
    """
    points = np.array([joint.components() for joint in joints], dtype=float)
    centre = points.mean(axis=0)
    spreads, axes = np.linalg.svd(points - centre)[1:]  # along three axes, the greatest first
    is_hub = len(points) > 1 and float(spreads[0]) < HUB_SPREAD * radius
    is_flat = len(points) < 4 or spreads[2] <= FLATNESS * spreads[0]
    if name == "platform" and not (is_hub or is_flat):
        return _block_around(name, joints, radius, frame)
    span_a_plane = len(points) > 2 and spreads[1] > HUB_SPREAD * radius
    normal = Vector(*axes[2].tolist()) if span_a_plane else frame.rotation.z
    place = upright(Vector(*centre.tolist()), _towards_links(normal, links, side), frame.rotation.x)
    return Plate(name, place, tuple(joints), radius, Vector(*[BLOCK_SIZE * radius] * 3) if is_hub else None)


def _towards_links(normal: Vector, links: Sequence[Vector], side: Vector) -> Vector:
    """Return the normal of a plate, or its opposite: the one that points to the links; arguments as `plate_behind`."""
    inward = unit(Vector(*np.sum([unit(link).components() for link in links], axis=0).tolist()))
    # Links in the plane of the joints do not say on which side the plate has room; then `side` decides.
    lean = inward.dot(normal) if abs(inward.dot(normal)) > LEAST_LEAN else side.dot(normal)
    return normal if lean > 0.0 else -normal


def _block_around(name: str, joints: Sequence[Vector], radius: float, frame: Displacement) -> Plate:
    """Return a block along the axes of a frame that holds all joints; arguments as for `plate_behind`."""
    in_frame = np.array([frame.rotation.inverse().apply(joint).components() for joint in joints], dtype=float)
    low, high = in_frame.min(axis=0), in_frame.max(axis=0)
    place = Displacement(frame.rotation, frame.rotation.apply(Vector(*(0.5 * (low + high)).tolist())))
    return Plate(name, place, tuple(joints), radius, Vector(*(high - low + BLOCK_SIZE * radius).tolist()))


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
        machine: the machine, which has a tool.
        configuration: the machine at a pose that places every joint.
        sizes: the proportions that `proportions_of` returns.
    """
    legs = [anatomy(leg) for leg in configuration.legs]
    base, platform = plates(configuration, legs, sizes.leg)
    base_solids = base.solids() if base else []
    if has_open_frame(configuration):
        base_solids = [solid for solid in base_solids if solid.name != "base/plate"]
    solids = [*base_solids, *platform.solids(), *tool_solids(machine, configuration, platform, sizes.leg)]
    for leg in legs:
        solids += leg_solids(leg, base.normal if base else None, platform.normal, sizes)
    labels = [Label(leg.label, _label_point(leg, sizes)) for leg in legs if leg.actuated]
    length = FRAME_LENGTH * sizes.diagonal
    for name, place in _frames(machine, configuration).items():
        solids += frame_solids(name, place, length)
        labels += frame_labels(name, place, length)
    rails = [end for leg in legs for rail in leg.rails for end in rail_ends(rail, sizes)]
    joints = [point for leg in configuration.legs for point in leg.path]
    tool = machine.tool_point(configuration.platform)
    low, high = bounds([*joints, configuration.platform.translation, tool, *rails])
    bed_depth = BED_DEPTH * max(joint_radius(leg, sizes) for leg in legs) if rails else 0.0
    lowest = min(low.z - bed_depth, *(plate.lowest for plate in (base, platform) if plate))
    return Scene(
        tuple(solids),
        tuple(labels),
        centre=(low + high) * 0.5,
        size=math.hypot(*(high - low).components()),
        floor=lowest - FLOOR_CLEARANCE * sizes.leg,
    )


def _frames(machine: Machine, configuration: Configuration) -> dict[str, Displacement]:
    """Return the frames of the base and the platform, and that of the tool if it is elsewhere, by their origins."""
    tool, platform = machine.tool_point(configuration.platform), configuration.platform
    frames = {"O": BASE_FRAME, "P": platform}
    return frames if coincide(tool, platform.translation) else {**frames, "T": Displacement(platform.rotation, tool)}


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
    letters = [Label(letter, place.translation + axis * (LETTER_DISTANCE * length), "frames") for letter, axis in tips]
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
        base_links = [leg.second_point - leg.foot for leg in feet]
        base = plate_behind("base", [leg.foot for leg in feet], base_links, radius, BASE_FRAME, up)
    platform_links = [leg.last_but_one - leg.head for leg in legs]
    heads = [leg.head for leg in legs]
    return base, plate_behind("platform", heads, platform_links, radius, configuration.platform, -up)


def tool_solids(machine: Machine, configuration: Configuration, platform: Plate, radius: float) -> list[Solid]:
    """Return the neck from the platform to P, and the tool from there to the tool point, where these lie apart."""
    tip, point = machine.tool_point(configuration.platform), configuration.platform.translation
    solids = []
    offset = point - platform.place.translation
    if offset.norm() > LEAST_NECK * radius and platform.block is None:
        shape = shapes.shaft(1.3 * radius, offset.norm(), 0.2 * radius)
        solids.append(Solid("platform/neck", shape, "platform", upright(platform.place.translation, offset)))
    if not coincide(tip, point):
        shape = shapes.cone(1.5 * radius, 0.3 * radius, (tip - point).norm())
        solids.append(Solid("platform/tool", shape, "tool", upright(point, tip - point)))
    return solids


def _label_point(leg: Anatomy, sizes: Proportions) -> Vector:
    """Return a point beside the foot of a leg."""
    return leg.foot - unit(leg.second_point - leg.foot) * (0.5 * sizes.leg) + Vector(0.0, 0.0, 2.2 * sizes.leg)


def rounded_hull(points: Sequence[Point2], margin: float) -> tuple[Point2, ...]:
    """Return the convex hull of points, widened by `margin` with round corners, counter-clockwise."""
    hull = convex_hull(points)
    if len(hull) == 1:
        angles = [math.tau * i / (4 * HALF_CIRCLE_POINTS) for i in range(4 * HALF_CIRCLE_POINTS)]
        return tuple((hull[0][0] + margin * math.cos(a), hull[0][1] + margin * math.sin(a)) for a in angles)
    corners: list[Point2] = []
    for i, (x, y) in enumerate(hull):
        (x_before, y_before), (x_after, y_after) = hull[i - 1], hull[(i + 1) % len(hull)]
        first = math.atan2(y - y_before, x - x_before) - 0.5 * math.pi
        turn = (math.atan2(y_after - y, x_after - x) - 0.5 * math.pi - first) % math.tau
        count = max(2, math.ceil(2 * CORNER_POINTS * turn / math.pi))
        angles = [first + turn * k / count for k in range(count + 1)]
        corners += [(x + margin * math.cos(a), y + margin * math.sin(a)) for a in angles]
    return tuple(corners)


def convex_hull(points: Sequence[Point2]) -> list[Point2]:
    """Return the corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered

    def half(along: Sequence[Point2]) -> list[Point2]:
        corners: list[Point2] = []
        for x, y in along:
            while len(corners) > 1 and turn_of(corners[-2], corners[-1], (x, y)) <= 0.0:
                corners.pop()
            corners.append((x, y))
        return corners[:-1]

    return half(ordered) + half(ordered[::-1])

"""Base and platform as plates behind the joints of the legs, joined to them by pedestals; the outlines of the plates.

No leg is drawn here.
"""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.frozen import dataclass
from kinetostat.views.scene import shapes
from kinetostat.views.scene.mesh import turn_of
from kinetostat.views.scene.shapes import CORNER_POINTS, HALF_CIRCLE_POINTS
from kinetostat.views.scene.solids import Extruded, Point2, Solid, unit, upright

PLATE_CLEARANCE = 2.3
"""Distance of a plate from the joint centres, in radii of a leg: enough room for the fork of a joint."""
HUB_SPREAD = 1.0
"""If the joints spread less than this, in radii of a leg, a block takes the place of the plate."""
BLOCK_SIZE = 3.4
"""Size of a block around joints that coincide, in radii of a leg; one around others is as much larger than they."""
FLATNESS = 0.2
"""Spread of joints across their mean plane, as a share of their greatest spread, above which a platform is a block."""
PLATE_MARGIN = {"base": 3.6, "platform": 2.9}
"""Width of the rim of a plate beyond its joints, in radii of a leg."""
PLATE_THICKNESS = {"base": 1.7, "platform": 1.3}
"""Thickness of a plate, in radii of a leg."""


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

    def solids(self) -> list[Solid]:
        """Make the plate and its pedestals."""
        if self.block is not None:
            return [self._solid_block(self.block)]
        thick = PLATE_THICKNESS[self.name] * self.radius
        outline = rounded_hull(self._flat(), PLATE_MARGIN[self.name] * self.radius)
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

    def _flat(self) -> list[tuple[float, float]]:
        axes, origin = self.place.rotation, self.place.translation
        return [(_to_1_nm((j - origin).dot(axes.x)), _to_1_nm((j - origin).dot(axes.y))) for j in self.joints]

    def _pedestal(self, number: int, joint: Vector) -> Solid:
        height = (joint - self.place.translation).dot(self.normal) - self.surface
        shape = shapes.cone(1.9 * self.radius, 1.25 * self.radius, max(height - 1.5 * self.radius, 0.4 * self.radius))
        foot = joint - self.normal * height
        return Solid(f"{self.name}/pedestal {number}", shape, "joint", upright(foot, self.normal))


def _to_1_nm(number: float) -> float:
    """Round a length (m) to 1 nm, so that round-off does not make two corners of coincident points."""
    return round(number, 9)


def plate_behind(
    name: str, joints: Sequence[Vector], links: Sequence[Vector], radius: float, frame: Displacement, side: Vector
) -> Plate:
    """Place a plate behind joints, on the side away from their links.

    Args:
        name: base or platform.
        joints: centres of the joints, base frame, m.
        links: vector from each joint into its leg, base axes.
        radius: radius of a leg, m.
        frame: frame of the body, base frame; its z is the normal if the joints do not span a plane.
        side: direction from the plate to the joints, used if the links lie in the plane of the joints.
    """
    points = np.array([joint.components() for joint in joints], dtype=float)
    centre = Vector(*points.mean(axis=0).tolist())
    spread = points - points.mean(axis=0)
    sizes, axes = np.linalg.svd(spread)[1:]
    flat = len(points) > 2 and sizes[1] > HUB_SPREAD * radius
    normal = Vector(*axes[2].tolist()) if flat else frame.rotation.z
    inward = unit(Vector(*np.sum([unit(link).components() for link in links], axis=0).tolist()))
    lean = inward.dot(normal)
    # Links in the plane of the joints do not say on which side the plate has room; then `side` decides.
    normal = normal if (lean if abs(lean) > 0.05 else side.dot(normal)) > 0.0 else -normal
    place, block = upright(centre, normal, frame.rotation.x), None
    if len(points) > 1 and float(sizes[0]) < HUB_SPREAD * radius:
        block = Vector(*[BLOCK_SIZE * radius] * 3)
    elif name == "platform" and len(points) > 3 and sizes[2] > FLATNESS * sizes[0]:
        in_frame = np.array([frame.rotation.inverse().apply(joint).components() for joint in joints], dtype=float)
        low, high = in_frame.min(axis=0), in_frame.max(axis=0)
        place = Displacement(frame.rotation, frame.rotation.apply(Vector(*(0.5 * (low + high)).tolist())))
        block = Vector(*(high - low + BLOCK_SIZE * radius).tolist())
    return Plate(name, place, tuple(joints), radius, block)


def rounded_hull(points: Sequence[Point2], margin: float) -> tuple[Point2, ...]:
    """Return the convex hull of points, widened by `margin` with round corners, counter-clockwise."""
    hull = convex_hull(points)
    if len(hull) == 1:
        angles = [math.tau * i / (4 * HALF_CIRCLE_POINTS) for i in range(4 * HALF_CIRCLE_POINTS)]
        return tuple((hull[0][0] + margin * math.cos(a), hull[0][1] + margin * math.sin(a)) for a in angles)
    corners: list[Point2] = []
    for i, (x, y) in enumerate(hull):
        (px, py), (nx, ny) = hull[i - 1], hull[(i + 1) % len(hull)]
        first = math.atan2(y - py, x - px) - 0.5 * math.pi
        turn = (math.atan2(ny - y, nx - x) - 0.5 * math.pi - first) % math.tau
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
        kept: list[Point2] = []
        for x, y in along:
            while len(kept) > 1 and turn_of(kept[-2], kept[-1], (x, y)) <= 0.0:
                kept.pop()
            kept.append((x, y))
        return kept[:-1]

    return half(ordered) + half(ordered[::-1])

"""Solids of a scene as plain data: shapes, places, and materials with their looks.

No machine and no renderer is known here. Lengths are in m; `mesh` makes triangles of the three kinds of shape.
"""

from collections.abc import Iterable
from dataclasses import asdict, replace
from functools import lru_cache
from typing import Any, TypeAlias

from kinetostat.algebra.vector import AXES, IDENTITY, ZERO, Displacement, Rotation, Vector
from kinetostat.frozen import dataclass
from kinetostat.tolerances import NO_DIRECTION

Point2: TypeAlias = tuple[float, float]
Point3: TypeAlias = tuple[float, float, float]

SCENE_DIGITS = 7
"""Significant digits of a number in a scene: a renderer has float32."""
SHAPES_KEPT = 1024
"""Number of shapes whose data is kept: a machine has about a hundred, few of which change while it moves."""
PLACE_DECIMALS = 8
"""Decimals of a place (m) in a scene: 10 nm, which nobody sees."""
LAYERS = ("machine", "springs", "load", "deflection", "ellipsoids", "directions", "frames", "labels")
"""Layers that a viewer may show or hide."""
BASE = Displacement(IDENTITY, ZERO)
"""The place of a solid whose axes are those of the base frame."""


@dataclass(frozen=True)
class Turned:
    """A solid of revolution about z.

    Attributes:
        profile: (radius, height) of the points of its outline, from below upwards, m.
    """

    profile: tuple[Point2, ...]


@dataclass(frozen=True)
class Extruded:
    """A plate: an outline in the x-y plane, raised along z.

    Attributes:
        outline: corners in the x-y plane, counter-clockwise, m.
        height: height of the plate, from z = 0, m.
        chamfer: width of the chamfer of all edges, m.
    """

    outline: tuple[Point2, ...]
    height: float
    chamfer: float = 0.0


@dataclass(frozen=True)
class Swept:
    """A round wire along a curve through points.

    Attributes:
        path: points of its axis, m.
        radius: radius of the wire, m.
        closed: whether its end joins its beginning.
    """

    path: tuple[Point3, ...]
    radius: float
    closed: bool = False


Shape: TypeAlias = Turned | Extruded | Swept


@dataclass(frozen=True)
class Look:
    """A surface as physically based renderers describe it.

    Attributes:
        color: colour of diffuse reflection, and for a metal also of mirror images; sRGB as "#rrggbb".
        metalness: 0 for plastics and paint, 1 for a bare metal.
        roughness: 0 for a mirror, 1 for chalk.
        opacity: 1 for an opaque surface, less for a translucent one.
    """

    color: str
    metalness: float
    roughness: float
    opacity: float = 1.0


LOOKS = {
    "base": Look("#8b929c", 0.15, 0.6),
    "platform": Look("#c3c9d1", 0.3, 0.42),
    "actuated": Look("#1f6fb4", 0.2, 0.38),
    "passive": Look("#d9721f", 0.15, 0.42),
    "removed": Look("#9aa3ad", 0.0, 0.8, 0.25),
    "steel": Look("#d3d8de", 0.85, 0.24),
    "joint": Look("#4a525d", 0.55, 0.42),
    "motor": Look("#2b3440", 0.35, 0.5),
    "tool": Look("#b9a76a", 0.8, 0.3),
    "spring": Look("#17a673", 0.3, 0.35),
    "load": Look("#c81e4a", 0.0, 0.5),
    "ghost": Look("#d01f50", 0.0, 0.9, 0.4),
    "translation": Look("#2f9fe0", 0.0, 0.35, 0.38),
    "rotation": Look("#a855c7", 0.1, 0.4),
    "soft translation": Look("#0b7fc7", 0.1, 0.4),
    "soft rotation": Look("#8a2fb0", 0.1, 0.4),
    "x axis": Look("#d23b3b", 0.0, 0.5),
    "y axis": Look("#2c9c4a", 0.0, 0.5),
    "z axis": Look("#2d62d3", 0.0, 0.5),
}
"""Looks by the names of materials."""


def looks_data() -> dict[str, dict[str, Any]]:
    """Convert all looks to plain data, by the name of the material."""
    return {name: asdict(look) for name, look in LOOKS.items()}


def linear_rgb(color: str) -> tuple[float, float, float]:
    """Convert "#rrggbb" to linear red, green and blue from 0 to 1 (IEC 61966-2-1)."""
    parts = [int(color[start : start + 2], 16) / 255.0 for start in (1, 3, 5)]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return red, green, blue


@dataclass(frozen=True)
class Solid:
    """A shape at its place.

    Attributes:
        name: a name that is unique within its scene; the same part has the same name at every pose.
        shape: the shape, in axes of its own.
        material: one of `LOOKS`.
        place: displacement from its own axes to the base frame.
        scale: factors along its own axes.
        layer: one of `LAYERS`.
        leg: name of the leg to which it belongs; empty if it belongs to none.
    """

    name: str
    shape: Shape
    material: str
    place: Displacement = BASE
    scale: Point3 = (1.0, 1.0, 1.0)
    layer: str = "machine"
    leg: str = ""

    def moved_by(self, motion: Displacement, **changes: Any) -> "Solid":
        """Return the solid after a displacement, with some attributes replaced."""
        return replace(self, place=motion @ self.place, **changes)


@dataclass(frozen=True)
class Label:
    """A text at a point of the base frame, m."""

    text: str
    point: Vector
    layer: str = "labels"


@dataclass(frozen=True)
class Scene:
    """Solids and labels of a picture.

    Attributes:
        solids, labels: solids and labels in the base frame.
        centre: centre of all solids, m.
        size: diagonal of the box around all solids, m.
        floor: height of the ground below them, m.
    """

    solids: tuple[Solid, ...]
    labels: tuple[Label, ...]
    centre: Vector
    size: float
    floor: float


def as_data(scene: Scene) -> dict[str, Any]:
    """Convert a scene to nested dictionaries and lists."""
    return {
        "solids": [solid_data(solid) for solid in scene.solids],
        "labels": [label_data(label) for label in scene.labels],
        "centre": [round(c, PLACE_DECIMALS) for c in scene.centre.components()],
        "size": scene.size,
        "floor": scene.floor,
    }


def solid_data(solid: Solid) -> dict[str, Any]:
    """Convert a solid to plain data; `place` holds the columns of its 3 x 4 matrix."""
    return {
        "name": solid.name,
        "layer": solid.layer,
        "leg": solid.leg,
        "material": solid.material,
        "shape": _shape_data(solid.shape),
        "place": [round(c, PLACE_DECIMALS) for v in matrix_columns(solid) for c in v.components()],
    }


def matrix_columns(solid: Solid) -> tuple[Vector, Vector, Vector, Vector]:
    """Return the columns of the 3 x 4 matrix from a solid's own axes, scaled, to the base frame (m)."""
    axes = solid.place.rotation
    x, y, z = (axis * size for axis, size in zip((axes.x, axes.y, axes.z), solid.scale, strict=True))
    return x, y, z, solid.place.translation


def label_data(label: Label) -> dict[str, Any]:
    """Convert a label to plain data."""
    return {
        "text": label.text,
        "layer": label.layer,
        "point": [round(c, PLACE_DECIMALS) for c in label.point.components()],
    }


@lru_cache(SHAPES_KEPT)
def _shape_data(shape: Shape) -> dict[str, Any]:
    match shape:
        case Turned(profile):
            return {"kind": "turned", "profile": [_numbers(point) for point in profile]}
        case Extruded(outline, height, chamfer):
            corners = [_numbers(point) for point in outline]
            return {"kind": "extruded", "outline": corners, "height": _round(height), "chamfer": _round(chamfer)}
        case Swept(path, radius, closed):
            return {
                "kind": "swept", "path": [_numbers(point) for point in path], "radius": _round(radius), "closed": closed
            }  # fmt: skip


def _numbers(numbers: Iterable[float]) -> list[float]:
    return [_round(number) for number in numbers]


def _round(number: float) -> float:
    return float(f"{number:.{SCENE_DIGITS}g}")


def upright(origin: Vector, z: Vector, x: Vector | None = None) -> Displacement:
    """Return the place whose z axis is along `z`, and whose x axis is as near as possible to `x` (if that is given)."""
    up = unit(z)
    hint = x if x is not None and up.cross(x).norm() > NO_DIRECTION * x.norm() else _axis_across(up)
    side = unit(up.cross(hint))
    return Displacement(Rotation(side.cross(up), side, up), origin)


def unit(vector: Vector) -> Vector:
    """Scale a vector to length 1; a zero vector becomes z."""
    size = vector.norm()
    return vector * (1.0 / size) if size > 0.0 else AXES[2]


def _axis_across(direction: Vector) -> Vector:
    """Return the axis that is most nearly perpendicular to a direction."""
    return min(AXES, key=lambda axis: abs(axis.dot(direction)))

"""Solids of a scene as plain data: shapes, where they stand, what they are of. Knows no machine and no renderer.

Lengths are in m. There are three kinds of shape (`mesh` makes triangles of them); materials are named (`looks`).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, TypeAlias

from kinetostat.algebra.vector import AXES, IDENTITY, ZERO, Displacement, Rotation, Vector

Point2: TypeAlias = tuple[float, float]
Point3: TypeAlias = tuple[float, float, float]

DIGITS = 7
"""Significant digits of a number in a scene: a renderer has float32."""
KEPT = 1024
"""Shapes whose data is kept: a machine has about a hundred, few of which change while it moves."""
DECIMALS = 8
"""Decimals of a place: 10 nm."""
SHORT = 1e-9
"""Length of a vector below which it has no direction, in units of the others."""


@dataclass(frozen=True)
class Turned:
    """A solid of revolution about z.

    Attributes:
        profile: (radius, height) of its outline from below upwards, m.
    """

    profile: tuple[Point2, ...]


@dataclass(frozen=True)
class Extruded:
    """A plate: an outline in the x-y plane, raised along z.

    Attributes:
        outline: corners, counter-clockwise, m.
        height: along z from 0, m.
        chamfer: of all edges, m.
    """

    outline: tuple[Point2, ...]
    height: float
    chamfer: float = 0.0


@dataclass(frozen=True)
class Swept:
    """A round wire along a curve through points.

    Attributes:
        path: points of its axis, m.
        radius: of the wire, m.
        closed: whether its end is its beginning.
    """

    path: tuple[Point3, ...]
    radius: float
    closed: bool = False


Shape: TypeAlias = Turned | Extruded | Swept

LAYERS = ("machine", "springs", "load", "deflection", "ellipsoids", "directions", "frames", "labels")
"""What a viewer may show or hide."""


BASE = Displacement(IDENTITY, ZERO)
"""The place of what stands in the base frame."""


@dataclass(frozen=True)
class Solid:
    """A shape at its place.

    Attributes:
        name: unique within its scene; the same part has the same name at every pose.
        shape: in its own axes.
        material: one of `looks.LOOKS`.
        place: from its own axes to the base frame.
        scale: along its own axes.
        layer: one of `LAYERS`.
        leg: of which it is a part; empty if of none.
    """

    name: str
    shape: Shape
    material: str
    place: Displacement = BASE
    scale: Point3 = (1.0, 1.0, 1.0)
    layer: str = "machine"
    leg: str = ""

    def moved(self, motion: Displacement, **changes: Any) -> "Solid":
        """The solid after a displacement, with some attributes replaced."""
        return replace(self, place=motion @ self.place, **changes)


@dataclass(frozen=True)
class Label:
    """A text at a point of the base frame, m."""

    text: str
    point: Vector
    layer: str = "labels"


@dataclass(frozen=True)
class Scene:
    """What there is to see.

    Attributes:
        solids, labels: in the base frame.
        centre: of what is shown, m.
        size: its diagonal, m.
        floor: height of the ground below it, m.
    """

    solids: tuple[Solid, ...]
    labels: tuple[Label, ...]
    centre: Vector
    size: float
    floor: float


def as_data(scene: Scene) -> dict[str, Any]:
    """A scene as nested dictionaries and lists."""
    return {
        "solids": [solid_data(solid) for solid in scene.solids],
        "labels": [label_data(label) for label in scene.labels],
        "centre": [round(c, DECIMALS) for c in scene.centre.components()],
        "size": scene.size,
        "floor": scene.floor,
    }


def solid_data(solid: Solid) -> dict[str, Any]:
    """A solid as plain data; `place` holds the columns of its 3 x 4 matrix."""
    return {
        "name": solid.name,
        "layer": solid.layer,
        "material": solid.material,
        "shape": _shape_data(solid.shape),
        "place": [round(c, DECIMALS) for v in columns_of(solid) for c in v.components()],
    }


def columns_of(solid: Solid) -> tuple[Vector, Vector, Vector, Vector]:
    """The columns of the 3 x 4 matrix from a solid's own axes, scaled, to the base frame (m)."""
    axes = solid.place.rotation
    x, y, z = (axis * size for axis, size in zip((axes.x, axes.y, axes.z), solid.scale, strict=True))
    return x, y, z, solid.place.translation


def label_data(label: Label) -> dict[str, Any]:
    """A label as plain data."""
    return {"text": label.text, "layer": label.layer, "point": [round(c, DECIMALS) for c in label.point.components()]}


@lru_cache(KEPT)
def _shape_data(shape: Shape) -> dict[str, Any]:
    match shape:
        case Turned(profile):
            return {"kind": "turned", "profile": [_rounded(point) for point in profile]}
        case Extruded(outline, height, chamfer):
            corners = [_rounded(point) for point in outline]
            return {"kind": "extruded", "outline": corners, "height": _round(height), "chamfer": _round(chamfer)}
        case Swept(path, radius, closed):
            return {
                "kind": "swept", "path": [_rounded(point) for point in path], "radius": _round(radius), "closed": closed
            }  # fmt: skip


def _rounded(numbers: Iterable[float]) -> list[float]:
    return [_round(number) for number in numbers]


def _round(number: float) -> float:
    return float(f"{number:.{DIGITS}g}")


def upright(origin: Vector, z: Vector, x: Vector | None = None) -> Displacement:
    """The place whose z axis is along `z`, and whose x axis is as near as can be to `x` (any, if not given)."""
    up = unit(z)
    hint = x if x is not None and up.cross(x).norm() > SHORT * x.norm() else _far_from(up)
    side = unit(up.cross(hint))
    return Displacement(Rotation(side.cross(up), side, up), origin)


def unit(vector: Vector) -> Vector:
    """The vector at length 1; z if it has none."""
    size = vector.norm()
    return vector * (1.0 / size) if size > 0.0 else AXES[2]


def _far_from(direction: Vector) -> Vector:
    return min(AXES, key=lambda axis: abs(axis.dot(direction)))

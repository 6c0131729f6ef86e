"""The shapes of a scene as exact solids of Open CASCADE, in mm. Places, materials and files are not dealt with here.

A mesh has facets; these solids are round: cylinders, cones, spheres and tori, and wires along smooth curves. A scene
gives outlines as points, so that the lines and arcs of an outline are first recovered from its points.
"""

import cmath
import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_GTransform,
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepOffsetAPI import BRepOffsetAPI_MakePipe
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
from OCP.collections import HArray1_gp_Pnt
from OCP.GC import GC_MakeArcOfCircle
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp, gp_Ax2, gp_Circ, gp_Dir, gp_GTrsf, gp_Pnt, gp_Vec
from OCP.Standard import Standard_Failure
from OCP.TopAbs import TopAbs_EDGE, TopAbs_ShapeEnum, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape

from kinetostat.tolerances import EVEN_CHORDS, NO_CIRCLE, OPEN_CASCADE_POINT
from kinetostat.views.scene.solids import Extruded, Point2, Point3, Shape, Swept, Turned

Piece: TypeAlias = tuple[Point2, Point2] | tuple[Point2, Point2, Point2]
"""A line by its two ends, or an arc by its start, a point in between, and its end."""

CORNER = math.radians(30)
"""Smallest turn from one chord to the next that is a corner, rad: a scene draws roundings in finer steps."""
FEWEST = 3
"""Least number of chords that are taken for an arc: any two chords of equal length fit some circle."""
MILLIMETRES = 1e3
"""Millimetres in a metre. CAD programs work in mm, and Open CASCADE's tolerances are made for them."""
UNSCALED = (1.0, 1.0, 1.0)


def solid_of(shape: Shape, scale: Point3 = UNSCALED) -> TopoDS_Shape:
    """Return the exact solid of a shape in the axes of the shape, scaled along them."""
    match shape:
        case Turned():
            solid_shape = _turned_solid(shape)
        case Extruded():
            solid_shape = _extruded_solid(shape)
        case Swept():
            solid_shape = _swept_solid(shape)
    (solid,) = _within(solid_shape, TopAbs_SOLID)
    return solid if scale == UNSCALED else _scaled_solid(solid, scale)


def point_of(x: float, y: float, z: float) -> gp_Pnt:
    """Return the point with coordinates in m."""
    return gp_Pnt(x * MILLIMETRES, y * MILLIMETRES, z * MILLIMETRES)


def _turned_solid(shape: Turned) -> TopoDS_Shape:
    # A radius that is only round-off is set to 0, so that the profile meets the axis and the solid has no hole in it.
    least = NO_CIRCLE * max(radius for radius, _ in shape.profile)
    profile = [(radius if radius > least else 0.0, height) for radius, height in shape.profile]
    return BRepPrimAPI_MakeRevol(_face(profile, lambda x, z: point_of(x, 0.0, z)), gp.OZ_s()).Shape()


def _extruded_solid(shape: Extruded) -> TopoDS_Shape:
    outline = _face(shape.outline, lambda x, y: point_of(x, y, 0.0))
    prism = BRepPrimAPI_MakePrism(outline, gp_Vec(0.0, 0.0, shape.height * MILLIMETRES))
    rounded = _rounded_prism(prism, shape.chamfer * MILLIMETRES) if shape.chamfer > 0.0 else None
    return rounded or prism.Shape()


def _rounded_prism(prism: BRepPrimAPI_MakePrism, radius: float) -> TopoDS_Shape | None:
    """Return a prism with rounded edges at both ends (radius in mm), or None if the radius does not fit."""
    fillet = BRepFilletAPI_MakeFillet(prism.Shape())
    for end in (prism.FirstShape(), prism.LastShape()):
        for edge in _within(end, TopAbs_EDGE):
            fillet.Add(radius, TopoDS.Edge(edge))
    # Open CASCADE reports a radius that does not fit in two ways: by an error, or by a solid that is not valid.
    try:
        shape = fillet.Shape()
    except Standard_Failure:
        return None
    return shape if BRepCheck_Analyzer(shape).IsValid() else None


def _swept_solid(shape: Swept) -> TopoDS_Shape:
    points = HArray1_gp_Pnt(1, len(shape.path))
    for number, corner in enumerate(shape.path, 1):
        points.SetValue(number, point_of(*corner))
    smooth = GeomAPI_Interpolate(points, shape.closed, OPEN_CASCADE_POINT)
    smooth.Perform()
    # The wire is a disc, set at right angles to the start of the curve and pulled along it; D1 fills in `start` and
    # `along`, the tangent there.
    curve, start, along = smooth.Curve(), gp_Pnt(), gp_Vec()
    curve.D1(curve.FirstParameter(), start, along)
    rim = gp_Circ(gp_Ax2(start, gp_Dir(along)), shape.radius * MILLIMETRES)
    path = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(curve).Edge()).Wire()
    return BRepOffsetAPI_MakePipe(path, _disc_within([BRepBuilderAPI_MakeEdge(rim).Edge()])).Shape()


def _face(outline: Sequence[Point2], placed: Callable[[float, float], gp_Pnt]) -> TopoDS_Face:
    """Return the plane face within a closed outline; `placed` maps a corner of the outline to its point in space."""
    corners = [corner for corner, following in pairwise([*outline, outline[0]]) if corner != following]
    # Beginning with the last corner closes the outline.
    return _disc_within([_edge([placed(*corner) for corner in piece]) for piece in pieces([corners[-1], *corners])])


def _edge(points: Sequence[gp_Pnt]) -> TopoDS_Edge:
    """Return the line between two points, or the arc through three."""
    curve = points if len(points) == 2 else [GC_MakeArcOfCircle(*points).Value()]
    return BRepBuilderAPI_MakeEdge(*curve).Edge()


def _disc_within(edges: Sequence[TopoDS_Edge]) -> TopoDS_Face:
    """Return the plane face that edges enclose."""
    rim = BRepBuilderAPI_MakeWire()
    for edge in edges:
        rim.Add(edge)
    return BRepBuilderAPI_MakeFace(rim.Wire(), True).Face()


def _within(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Iterator[TopoDS_Shape]:
    """Go through the parts of a shape that are of one kind, such as its solids or edges."""
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _scaled_solid(solid: TopoDS_Shape, scale: Point3) -> TopoDS_Shape:
    stretch = gp_GTrsf()
    for axis, factor in enumerate(scale, 1):
        stretch.SetValue(axis, axis, factor)
    return BRepBuilderAPI_GTransform(solid, stretch).Shape()


def pieces(points: Sequence[Point2]) -> Iterator[Piece]:
    """Split a path through points into lines and arcs; points at even distances round a circle become an arc.

    An arc is at most half a circle, so that the three points by which it is given lie well apart.

    Args:
        points: points of the path, m; no two in a row coincide.
    """
    chords = [complex(x2 - x1, y2 - y1) for (x1, y1), (x2, y2) in pairwise(points)]
    start = 0
    while start < len(chords):
        count = _chords_of_arc(chords, start)
        if count < FEWEST:
            yield points[start], points[start + 1]
            start += 1
        else:
            yield points[start], points[start + count // 2], points[start + count]
            start += count


def _chords_of_arc(chords: Sequence[complex], start: int) -> int:
    """Count the chords from `start` on that have equal lengths and turn by equal angles, up to half a circle.

    Chords are complex numbers. The ratio of a chord to the one before it gives both: its modulus is the ratio of the
    lengths, and its phase is the turn.
    """
    if start + 1 == len(chords):
        return 1
    turn = chords[start + 1] / chords[start]
    angle = abs(cmath.phase(turn))
    if abs(abs(turn) - 1.0) > EVEN_CHORDS or not EVEN_CHORDS < angle < CORNER:
        return 1
    # The tolerance keeps an exact half circle from losing its last chord to round-off.
    end = min(len(chords), start + math.floor(math.pi / angle + EVEN_CHORDS))
    following = range(start + 1, end)
    return next((i for i in following if abs(chords[i] / chords[i - 1] - turn) > EVEN_CHORDS), end) - start

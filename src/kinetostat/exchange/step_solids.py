"""The shapes of a scene as exact solids of Open CASCADE, mm. Knows no place, no material and no file.

Where a mesh has facets these are round: cylinders, cones, spheres and tori, and wires along smooth curves.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

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

from kinetostat.exchange.step_outlines import pieces
from kinetostat.views.scene.mesh import POINT
from kinetostat.views.scene.solids import Extruded, Point2, Point3, Shape, Swept, Turned

MILLIMETRES = 1e3
"""In a metre. CAD programs work in mm, and Open CASCADE's tolerances are made for them."""
SAME = 1e-7
"""Distance of points that are one to Open CASCADE, mm."""
UNSCALED = (1.0, 1.0, 1.0)


def solid_of(shape: Shape, scale: Point3 = UNSCALED) -> TopoDS_Shape:
    """The solid that a shape stands for, in its own axes, scaled along them."""
    match shape:
        case Turned():
            made = _turned(shape)
        case Extruded():
            made = _extruded(shape)
        case Swept():
            made = _swept(shape)
    (solid,) = _within(made, TopAbs_SOLID)
    return solid if scale == UNSCALED else _scaled(solid, scale)


def point_of(x: float, y: float, z: float) -> gp_Pnt:
    """A point whose coordinates are given in m."""
    return gp_Pnt(x * MILLIMETRES, y * MILLIMETRES, z * MILLIMETRES)


def _turned(shape: Turned) -> TopoDS_Shape:
    least = POINT * max(radius for radius, _ in shape.profile)
    profile = [(radius if radius > least else 0.0, height) for radius, height in shape.profile]
    return BRepPrimAPI_MakeRevol(_face(profile, lambda x, z: point_of(x, 0.0, z)), gp.OZ_s()).Shape()


def _extruded(shape: Extruded) -> TopoDS_Shape:
    outline = _face(shape.outline, lambda x, y: point_of(x, y, 0.0))
    prism = BRepPrimAPI_MakePrism(outline, gp_Vec(0.0, 0.0, shape.height * MILLIMETRES))
    rounded = _rounded(prism, shape.chamfer * MILLIMETRES) if shape.chamfer > 0.0 else None
    return rounded or prism.Shape()


def _rounded(prism: BRepPrimAPI_MakePrism, radius: float) -> TopoDS_Shape | None:
    """A prism whose edges at both ends are round (mm); None where there is no room for that."""
    fillet = BRepFilletAPI_MakeFillet(prism.Shape())
    for end in (prism.FirstShape(), prism.LastShape()):
        for edge in _within(end, TopAbs_EDGE):
            fillet.Add(radius, TopoDS.Edge(edge))
    try:
        shape = fillet.Shape()
    except Standard_Failure:
        return None
    return shape if BRepCheck_Analyzer(shape).IsValid() else None


def _swept(shape: Swept) -> TopoDS_Shape:
    points = HArray1_gp_Pnt(1, len(shape.path))
    for number, corner in enumerate(shape.path, 1):
        points.SetValue(number, point_of(*corner))
    smooth = GeomAPI_Interpolate(points, shape.closed, SAME)
    smooth.Perform()
    curve, start, along = smooth.Curve(), gp_Pnt(), gp_Vec()
    curve.D1(curve.FirstParameter(), start, along)
    rim = gp_Circ(gp_Ax2(start, gp_Dir(along)), shape.radius * MILLIMETRES)
    path = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(curve).Edge()).Wire()
    return BRepOffsetAPI_MakePipe(path, _bounded([BRepBuilderAPI_MakeEdge(rim).Edge()])).Shape()


def _face(outline: Sequence[Point2], placed: Callable[[float, float], gp_Pnt]) -> TopoDS_Face:
    """What lies within an outline, which ends where it begins, in a plane of which `placed` gives the points."""
    corners = [corner for corner, following in pairwise([*outline, outline[0]]) if corner != following]
    return _bounded([_edge([placed(*corner) for corner in piece]) for piece in pieces([corners[-1], *corners])])


def _edge(points: Sequence[gp_Pnt]) -> TopoDS_Edge:
    """A line between two points, or an arc through three."""
    curve = points if len(points) == 2 else [GC_MakeArcOfCircle(*points).Value()]
    return BRepBuilderAPI_MakeEdge(*curve).Edge()


def _bounded(edges: Sequence[TopoDS_Edge]) -> TopoDS_Face:
    rim = BRepBuilderAPI_MakeWire()
    for edge in edges:
        rim.Add(edge)
    return BRepBuilderAPI_MakeFace(rim.Wire(), True).Face()


def _within(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Iterator[TopoDS_Shape]:
    """The parts of one kind of a shape."""
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _scaled(solid: TopoDS_Shape, scale: Point3) -> TopoDS_Shape:
    stretch = gp_GTrsf()
    for axis, factor in enumerate(scale, 1):
        stretch.SetValue(axis, axis, factor)
    return BRepBuilderAPI_GTransform(solid, stretch).Shape()

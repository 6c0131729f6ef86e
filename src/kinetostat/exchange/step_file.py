"""A scene as a STEP file: exact solids in mm, as an assembly with places, names and colours, always in the same order.

A mesh has facets; these solids are round: cylinders, cones, spheres and tori, and wires along smooth curves. A scene
gives outlines as points, so that the lines and arcs of an outline are first recovered from its points. A part is in the
document once, however often and wherever it is built in.

Source: ISO 10303-214:2010 (automotive design), which every CAD program reads; ISO 10303-21:2016 (the file).
"""

import cmath
import io
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from typing import Any, TypeAlias

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
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
from OCP.gp import gp, gp_Ax2, gp_Ax3, gp_Circ, gp_Dir, gp_GTrsf, gp_Pnt, gp_Trsf, gp_Vec
from OCP.Interface import Interface_InterfaceModel, Interface_Static
from OCP.Message import Message, Message_Fail
from OCP.Quantity import Quantity_Color, Quantity_ColorRGBA, Quantity_TOC_RGB
from OCP.Standard import Standard_Failure
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.StepRepr import StepRepr_NextAssemblyUsageOccurrence
from OCP.StepVisual import StepVisual_ColourRgb
from OCP.StepVisual import StepVisual_MechanicalDesignGeometricPresentationRepresentation as Presentation
from OCP.TCollection import TCollection_ExtendedString
from OCP.TCollection import TCollection_HAsciiString as Text
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_ShapeEnum, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape
from OCP.UnitsMethods import UnitsMethods_LengthUnit_Millimeter
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.exchange.formats import one_line
from kinetostat.tolerances import EVEN_CHORDS, NO_CIRCLE, OPEN_CASCADE_POINT
from kinetostat.views.scene.solids import (
    BASE,
    LOOKS,
    Extruded,
    Point2,
    Point3,
    Scene,
    Shape,
    Solid,
    Swept,
    Turned,
    linear_rgb,
    solid_data,
)

OutlinePiece: TypeAlias = tuple[Point2, Point2] | tuple[Point2, Point2, Point2]
"""A line by its two ends, or an arc by its start, a point in between, and its end."""
PartKey = tuple[str, Point3, str]
"""A shape as text, its scale along the axes, and its material: what makes solids the same part."""

CORNER = math.radians(30)
"""Smallest turn from one chord to the next that is a corner, rad: a scene draws roundings in finer steps."""
LEAST_CHORDS_OF_ARC = 3
"""Least number of chords that are taken for an arc: any two chords of equal length fit some circle."""
MILLIMETRES = 1e3
"""Millimetres in a metre. CAD programs work in mm, and Open CASCADE's tolerances are made for them."""
UNSCALED = (1.0, 1.0, 1.0)
NUMBER_AT_END = re.compile(r" \d+$")
"""A number at the end of a name, as in "ball 3": it tells places apart, and a part has none."""
BODY_LAYER = "machine"
"""The layer whose solids are bodies; springs and frames are only signs."""
SETTINGS = {"write.step.schema": "AP214IS", "write.step.unit": "MM", "write.surfacecurve.mode": "Off"}
"""Settings of the writer, for the whole process. Without the curves on surfaces, which readers compute, a file is half
as large."""
STRING = re.compile(rb"'[^']*'")
"""A string of the file; the writer breaks long ones into lines, even within a character beyond ASCII."""
UNDATED = "1970-01-01T00:00:00"
"""The time in the header, which is always the same, so that equal machines give equal files."""


def solid_of(shape: Shape, scale: Point3 = UNSCALED) -> TopoDS_Shape:
    """Return the exact solid of a shape in the axes of the shape, scaled along them."""
    match shape:
        case Turned():
            solid_shape = _turned_solid(shape)
        case Extruded():
            solid_shape = _extruded_solid(shape)
        case Swept():
            solid_shape = _swept_solid(shape)
    (solid,) = _parts_of(solid_shape, TopAbs_SOLID)
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
        for edge in _parts_of(end, TopAbs_EDGE):
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
    return BRepOffsetAPI_MakePipe(path, _enclosed_face([BRepBuilderAPI_MakeEdge(rim).Edge()])).Shape()


def _face(outline: Sequence[Point2], point_in_space: Callable[[float, float], gp_Pnt]) -> TopoDS_Face:
    """Return the plane face within a closed outline, of which a function gives each corner as a point in space."""
    corners = [corner for corner, following in pairwise([*outline, outline[0]]) if corner != following]
    # Beginning with the last corner closes the outline.
    rim = outline_pieces([corners[-1], *corners])
    return _enclosed_face([_edge([point_in_space(*corner) for corner in piece]) for piece in rim])


def _edge(points: Sequence[gp_Pnt]) -> TopoDS_Edge:
    """Return the line between two points, or the arc through three."""
    curve = points if len(points) == 2 else [GC_MakeArcOfCircle(*points).Value()]
    return BRepBuilderAPI_MakeEdge(*curve).Edge()


def _enclosed_face(edges: Sequence[TopoDS_Edge]) -> TopoDS_Face:
    """Return the plane face that edges enclose."""
    rim = BRepBuilderAPI_MakeWire()
    for edge in edges:
        rim.Add(edge)
    return BRepBuilderAPI_MakeFace(rim.Wire(), True).Face()


def _parts_of(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Iterator[TopoDS_Shape]:
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


def outline_pieces(points: Sequence[Point2]) -> Iterator[OutlinePiece]:
    """Split a path through points into lines and arcs; points at even distances round a circle become an arc.

    An arc is at most half a circle, so that the three points by which it is given lie well apart.

    Args:
        points: points of the path, m; no two in a row coincide.
    """
    chords = [complex(x2 - x1, y2 - y1) for (x1, y1), (x2, y2) in pairwise(points)]
    start = 0
    while start < len(chords):
        count = _chords_of_arc(chords, start)
        if count < LEAST_CHORDS_OF_ARC:
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


class Assembly:
    """A document with one assembly in mm and base axes, to which solids are added one by one."""

    def __init__(self, name: str) -> None:
        self._document = TDocStd_Document(_text("XCAF"))
        XCAFDoc_DocumentTool.SetLengthUnit_s(self._document, 1.0, UnitsMethods_LengthUnit_Millimeter)
        self._shapes = XCAFDoc_DocumentTool.ShapeTool_s(self._document.Main())
        self._colors = XCAFDoc_DocumentTool.ColorTool_s(self._document.Main())
        self._whole = self._with_name(self._shapes.NewShape(), name)
        self._groups: dict[str, TDF_Label] = {}
        self._parts: dict[PartKey, TDF_Label] = {}
        self._names: Counter[str] = Counter()

    def add(self, solid: Solid) -> None:
        """Add a solid under its leg, or under the body that its name begins with."""
        group = self._group(solid.leg or solid.name.partition("/")[0])
        self._build_in(group, self._part(solid), solid.name, solid.place)

    def document(self) -> TDocStd_Document:
        """Return the document with all solids added so far."""
        self._shapes.UpdateAssemblies()
        return self._document

    def _group(self, name: str) -> TDF_Label:
        if name not in self._groups:
            self._groups[name] = self._with_name(self._shapes.NewShape(), name)
            self._build_in(self._whole, self._groups[name], name, BASE)
        return self._groups[name]

    def _part(self, solid: Solid) -> TDF_Label:
        """Return the part of which a solid is an instance: equal in shape, to all digits of a scene, and in look."""
        key = (str(solid_data(solid)["shape"]), solid.scale, solid.material)
        if key not in self._parts:
            kind = NUMBER_AT_END.sub("", solid.name.rpartition("/")[2])
            self._names[kind] += 1
            name = kind if self._names[kind] == 1 else f"{kind} {self._names[kind]}"
            part = self._with_name(self._shapes.AddShape(solid_of(solid.shape, solid.scale), False), name)
            self._colors.SetColor(part, _color(solid.material), XCAFDoc_ColorSurf)
            self._parts[key] = part
        return self._parts[key]

    def _build_in(self, group: TDF_Label, part: TDF_Label, name: str, place: Displacement) -> None:
        self._with_name(self._shapes.AddComponent(group, part, _location(place)), name)

    def _with_name(self, label: TDF_Label, name: str) -> TDF_Label:
        TDataStd_Name.Set_s(label, _text(step_text(name)))
        return label


def step_text(text: str) -> str:
    r"""Return a name as a STEP string holds it: in one line, characters beyond ASCII by their numbers.

    Source: ISO 10303-21:2016, encoding of strings: \X2\ and \X4\.
    """
    return "".join(c if c.isascii() else _escape_of(ord(c)) for c in one_line(text))


def _escape_of(code: int) -> str:
    return f"\\X2\\{code:04X}\\X0\\" if code < 0x10000 else f"\\X4\\{code:08X}\\X0\\"


def _text(text: str) -> TCollection_ExtendedString:
    return TCollection_ExtendedString(text, True)


def _color(material: str) -> Quantity_ColorRGBA:
    look = LOOKS[material]
    return Quantity_ColorRGBA(Quantity_Color(*linear_rgb(look.color), Quantity_TOC_RGB), look.opacity)


def _location(place: Displacement) -> TopLoc_Location:
    axes = place.rotation
    frame = gp_Ax3(point_of(*place.translation.components()), _direction(axes.z), _direction(axes.x))
    motion = gp_Trsf()
    motion.SetDisplacement(gp_Ax3(), frame)
    return TopLoc_Location(motion)


def _direction(vector: Vector) -> gp_Dir:
    return gp_Dir(*vector.components())


def step_bytes(scene: Scene, name: str) -> bytes:
    """Return the solids of a scene as exact bodies in an assembly: mm, z up, base frame, with names and colours.

    Args:
        scene: the solids.
        name: the name of the assembly.

    Returns:
        The file; the same bytes from the same scene and name.
    """
    assembly = Assembly(name)
    for solid in scene.solids:
        if solid.layer == BODY_LAYER:
            assembly.add(solid)
    stream = io.BytesIO()
    with _without_messages():
        writer = STEPCAFControl_Writer()
        with _writer_settings(SETTINGS):
            writer.Transfer(assembly.document())
        model = writer.ChangeWriter().Model()
        _fill_header(model, name)
        _sort_styles(model)
        _number_instances(model)
        writer.WriteStream(stream)
    return STRING.sub(lambda string: string[0].replace(b"\n", b""), stream.getvalue())


def _fill_header(model: Interface_InterfaceModel, name: str) -> None:
    """Fill in the header."""
    header = APIHeaderSection_MakeHeader(model)
    header.SetName(Text(step_text(name)))
    header.SetTimeStamp(Text(UNDATED))
    header.SetAuthorValue(1, Text(""))
    header.SetOrganizationValue(1, Text(""))
    header.SetAuthorisation(Text(""))
    header.SetOriginatingSystem(Text("kinetostat"))
    header.SetDescriptionValue(1, Text("solids of a machine at a pose"))


def _sort_styles(model: Interface_InterfaceModel) -> None:
    """Sort the looks, which come last, into the order of their solids, with colours before them.

    The writer has them in the order of addresses in memory, so that files would differ from run to run.
    """
    entities = _entities(model)
    numbers = {entity: number for number, entity in enumerate(entities)}
    starts = [number for number, entity in enumerate(entities) if isinstance(entity, Presentation)]
    looks = [entities[start:end] for start, end in pairwise([*starts, len(entities)])]
    looks.sort(key=lambda look: numbers[look[0].ItemsValue(1).Item()])
    colors = [entity for entity in entities if isinstance(entity, StepVisual_ColourRgb)]
    colors.sort(key=lambda color: (color.Red(), color.Green(), color.Blue()))
    ordered = [*colors, *(entity for look in looks for entity in look if entity not in colors)]
    for number, entity in enumerate(ordered, starts[0]):
        before = entities.index(entity)
        if before != number:
            model.ChangeOrder(before + 1, number + 1)
            entities.insert(number, entities.pop(before))


def _number_instances(model: Interface_InterfaceModel) -> None:
    """Number instances from 1: the writer would go on from where its last file ended."""
    entities = _entities(model)
    instances = (entity for entity in entities if isinstance(entity, StepRepr_NextAssemblyUsageOccurrence))
    for number, instance in enumerate(instances, 1):
        instance.SetId(Text(str(number)))


def _entities(model: Interface_InterfaceModel) -> list[Any]:
    return [model.Value(number) for number in range(1, model.NbEntities() + 1)]


@contextmanager
def _writer_settings(settings: dict[str, str]) -> Iterator[None]:
    """Apply settings of the writer, which belong to the whole process, and undo them at the end."""
    with ExitStack() as undoing:
        for name, value in settings.items():
            undoing.callback(Interface_Static.SetCVal_s, name, Interface_Static.CVal_s(name))
            Interface_Static.SetCVal_s(name, value)
        yield


@contextmanager
def _without_messages() -> Iterator[None]:
    """Keep the writer from printing on the terminal, but for failures."""
    with ExitStack() as undoing:
        for printer in Message.DefaultMessenger_s().Printers():
            undoing.callback(printer.SetTraceLevel, printer.GetTraceLevel())
            printer.SetTraceLevel(Message_Fail)
        yield

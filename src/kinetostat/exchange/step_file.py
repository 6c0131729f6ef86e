"""A scene as a STEP file: its solids as an assembly with places, names and colours, always in the same order.

A part stands in the document once, however often and wherever it is built in.

Source: ISO 10303-214:2010 (automotive design), which every CAD program reads; ISO 10303-21:2016 (the file).
"""

import io
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from typing import Any

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.gp import gp_Ax3, gp_Dir, gp_Trsf
from OCP.Interface import Interface_InterfaceModel, Interface_Static
from OCP.Message import Message, Message_Fail
from OCP.Quantity import Quantity_Color, Quantity_ColorRGBA, Quantity_TOC_RGB
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.StepRepr import StepRepr_NextAssemblyUsageOccurrence
from OCP.StepVisual import StepVisual_ColourRgb
from OCP.StepVisual import StepVisual_MechanicalDesignGeometricPresentationRepresentation as Presentation
from OCP.TCollection import TCollection_ExtendedString
from OCP.TCollection import TCollection_HAsciiString as Text
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.UnitsMethods import UnitsMethods_LengthUnit_Millimeter
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.exchange.formats import one_line
from kinetostat.exchange.step_solids import point_of, solid_of
from kinetostat.views.scene.solids import BASE, LOOKS, Point3, Scene, Solid, linear, solid_data

COUNTED = re.compile(r" \d+$")
"""A number at the end of a name: it belongs to the place, not to the part that is built in there."""

Key = tuple[str, Point3, str]


class Assembly:
    """A document with one assembly in mm and base axes, to which solids are added one by one."""

    def __init__(self, name: str) -> None:
        self._document = TDocStd_Document(_text("XCAF"))
        XCAFDoc_DocumentTool.SetLengthUnit_s(self._document, 1.0, UnitsMethods_LengthUnit_Millimeter)
        self._shapes = XCAFDoc_DocumentTool.ShapeTool_s(self._document.Main())
        self._colors = XCAFDoc_DocumentTool.ColorTool_s(self._document.Main())
        self._whole = self._with_name(self._shapes.NewShape(), name)
        self._groups: dict[str, TDF_Label] = {}
        self._parts: dict[Key, TDF_Label] = {}
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
        """The part of which a solid is an instance: equal in shape, to as many digits as a scene has, and in look."""
        key = (str(solid_data(solid)["shape"]), solid.scale, solid.material)
        if key not in self._parts:
            kind = COUNTED.sub("", solid.name.rpartition("/")[2])
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
    return "".join(c if c.isascii() else _by_number(ord(c)) for c in one_line(text))


def _by_number(code: int) -> str:
    return f"\\X2\\{code:04X}\\X0\\" if code < 0x10000 else f"\\X4\\{code:08X}\\X0\\"


def _text(text: str) -> TCollection_ExtendedString:
    return TCollection_ExtendedString(text, True)


def _color(material: str) -> Quantity_ColorRGBA:
    look = LOOKS[material]
    return Quantity_ColorRGBA(Quantity_Color(*linear(look.color), Quantity_TOC_RGB), look.opacity)


def _location(place: Displacement) -> TopLoc_Location:
    axes = place.rotation
    frame = gp_Ax3(point_of(*place.translation.components()), _direction(axes.z), _direction(axes.x))
    motion = gp_Trsf()
    motion.SetDisplacement(gp_Ax3(), frame)
    return TopLoc_Location(motion)


def _direction(vector: Vector) -> gp_Dir:
    return gp_Dir(*vector.components())


BODY_LAYER = "machine"
"""The layer whose solids are bodies; springs and frames are only signs."""
SETTINGS = {"write.step.schema": "AP214IS", "write.step.unit": "MM", "write.surfacecurve.mode": "Off"}
"""Settings of the writer. Without the curves on surfaces, which readers compute, a file is half as large."""
STRING = re.compile(rb"'[^']*'")
"""A string of the file; the writer breaks long ones into lines, even within a character beyond ASCII."""
UNDATED = "1970-01-01T00:00:00"
"""The time in the header: equal machines are equal files."""


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
    with _quiet():
        writer = STEPCAFControl_Writer()
        with _set(SETTINGS):
            writer.Transfer(assembly.document())
        model = writer.ChangeWriter().Model()
        _sign(model, name)
        _sort_styles(model)
        _number_instances(model)
        writer.WriteStream(stream)
    return STRING.sub(lambda string: string[0].replace(b"\n", b""), stream.getvalue())


def _sign(model: Interface_InterfaceModel, name: str) -> None:
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
def _set(settings: dict[str, str]) -> Iterator[None]:
    """Apply settings of the writer, which belong to the whole process, and undo them at the end."""
    with ExitStack() as undoing:
        for name, value in settings.items():
            undoing.callback(Interface_Static.SetCVal_s, name, Interface_Static.CVal_s(name))
            Interface_Static.SetCVal_s(name, value)
        yield


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the writer from printing on the terminal, but for failures."""
    with ExitStack() as undoing:
        for printer in Message.DefaultMessenger_s().Printers():
            undoing.callback(printer.SetTraceLevel, printer.GetTraceLevel())
            printer.SetTraceLevel(Message_Fail)
        yield

"""The solids of a scene as an assembly of Open CASCADE with places, names and colours. No file is written here.

A part stands in the document once, however often and wherever it is built in.
"""

import re
from collections import Counter

from OCP.gp import gp_Ax3, gp_Dir, gp_Trsf
from OCP.Quantity import Quantity_Color, Quantity_ColorRGBA, Quantity_TOC_RGB
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.UnitsMethods import UnitsMethods_LengthUnit_Millimeter
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.exchange.formats import one_line
from kinetostat.exchange.step_solids import point_of, solid_of
from kinetostat.views.scene.solids import BASE, LOOKS, Point3, Solid, linear, solid_data

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
        self._whole = self._named(self._shapes.NewShape(), name)
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
            self._groups[name] = self._named(self._shapes.NewShape(), name)
            self._build_in(self._whole, self._groups[name], name, BASE)
        return self._groups[name]

    def _part(self, solid: Solid) -> TDF_Label:
        """The part of which a solid is an instance: equal in shape, to as many digits as a scene has, and in look."""
        key = (str(solid_data(solid)["shape"]), solid.scale, solid.material)
        if key not in self._parts:
            kind = COUNTED.sub("", solid.name.rpartition("/")[2])
            self._names[kind] += 1
            name = kind if self._names[kind] == 1 else f"{kind} {self._names[kind]}"
            part = self._named(self._shapes.AddShape(solid_of(solid.shape, solid.scale), False), name)
            self._colors.SetColor(part, _color(solid.material), XCAFDoc_ColorSurf)
            self._parts[key] = part
        return self._parts[key]

    def _build_in(self, group: TDF_Label, part: TDF_Label, name: str, place: Displacement) -> None:
        self._named(self._shapes.AddComponent(group, part, _location(place)), name)

    def _named(self, label: TDF_Label, name: str) -> TDF_Label:
        TDataStd_Name.Set_s(label, _text(step_text(name)))
        return label


def step_text(text: str) -> str:
    r"""Return a name as a STEP string holds it: in one line, characters beyond ASCII by their numbers.

    Source: ISO 10303-21:2016, encoding of strings: \X2\ and \X4\.
    """
    return "".join(c if c.isascii() else _numbered(ord(c)) for c in one_line(text))


def _numbered(code: int) -> str:
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

"""What another program finds in a STEP file: the bodies of its assembly, read by Open CASCADE. Imported by tests."""

from dataclasses import dataclass

from OCP.Bnd import Bnd_Box
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.collections import Sequence_TDF_Label
from OCP.GProp import GProp_GProps
from OCP.Quantity import Quantity_ColorRGBA
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_ColorTool, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool


@dataclass(frozen=True)
class Found:
    """A body as a reader has it: names of the assemblies down to it, of its part, its shape in the whole, its look."""

    path: tuple[str, ...]
    part: str
    shape: TopoDS_Shape
    color: tuple[float, float, float]
    opacity: float


def bodies_of(path) -> list[Found]:
    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    reader = STEPCAFControl_Reader()
    reader.ReadFile(str(path))
    reader.Transfer(document)
    free = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(free)
    (whole,) = free
    return list(_below(whole, (_name(whole),), TopLoc_Location()))


def _below(label, path, place):
    components = Sequence_TDF_Label()
    XCAFDoc_ShapeTool.GetComponents_s(label, components)
    for component in components:
        referred, there = TDF_Label(), place.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(component))
        XCAFDoc_ShapeTool.GetReferredShape_s(component, referred)
        names = (*path, _name(component))
        if XCAFDoc_ShapeTool.IsAssembly_s(referred):
            yield from _below(referred, names, there)
        else:
            look = Quantity_ColorRGBA()
            assert XCAFDoc_ColorTool.GetColor_s(referred, XCAFDoc_ColorSurf, look)
            color = look.GetRGB()
            yield Found(
                names, _name(referred), XCAFDoc_ShapeTool.GetShape_s(referred).Moved(there),
                (color.Red(), color.Green(), color.Blue()), look.Alpha(),
            )  # fmt: skip


def _name(label):
    name = TDataStd_Name()
    assert label.FindAttribute(TDataStd_Name.GetID_s(), name)
    return name.Get().ToExtString()


def within(shape, kind):
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def is_valid(shape) -> bool:
    """Whether it is one solid without a fault."""
    return len(list(within(shape, TopAbs_SOLID))) == 1 and BRepCheck_Analyzer(shape).IsValid()


def surfaces(shape) -> list[str]:
    """The kinds of its faces, in alphabetical order."""
    faces = (BRepAdaptor_Surface(TopoDS.Face(face)) for face in within(shape, TopAbs_FACE))
    return sorted(face.GetType().name.removeprefix("GeomAbs_") for face in faces)


def volume(shape) -> float:
    """m^3."""
    return _bulk(shape).Mass() * 1e-9


def centre(shape) -> list[float]:
    """Of its volume, mm."""
    return _numbers(_bulk(shape).CentreOfMass())


def _bulk(shape):
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    return properties


def box(shape) -> list[float]:
    """Least and greatest x, y, z, mm: exact, without tolerances."""
    found = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, found, False, False)
    return [*_numbers(found.CornerMin()), *_numbers(found.CornerMax())]


def _numbers(point):
    return [point.X(), point.Y(), point.Z()]

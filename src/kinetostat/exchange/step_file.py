"""A scene as a STEP file: the settings of Open CASCADE's writer, the header, and what would differ from day to day.

Source: ISO 10303-214:2010 (automotive design), which every CAD program reads; ISO 10303-21:2016 (the file).
"""

import io
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from typing import Any

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.Interface import Interface_InterfaceModel, Interface_Static
from OCP.Message import Message, Message_Fail
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.StepRepr import StepRepr_NextAssemblyUsageOccurrence
from OCP.StepVisual import StepVisual_ColourRgb
from OCP.StepVisual import StepVisual_MechanicalDesignGeometricPresentationRepresentation as Presentation
from OCP.TCollection import TCollection_HAsciiString as Text

from kinetostat.exchange.step_assembly import Assembly, step_text
from kinetostat.views.scene.solids import Scene

BODIES = "machine"
"""The layer whose solids are bodies; springs and frames are signs."""
SETTINGS = {"write.step.schema": "AP214IS", "write.step.unit": "MM", "write.surfacecurve.mode": "Off"}
"""Of the writer. Without the curves of surfaces, which readers compute, a file is half as large."""
STRING = re.compile(rb"'[^']*'")
"""A string of the file, which the writer breaks into lines, characters beyond ASCII not excepted."""
UNDATED = "1970-01-01T00:00:00"
"""The time in the header: equal machines are equal files."""


def step_bytes(scene: Scene, name: str) -> bytes:
    """The solids of a scene as exact bodies in an assembly: mm, z up, in the base frame, with names and colours.

    Args:
        scene: what there is to see.
        name: of the whole.

    Returns:
        The file; the same bytes from the same scene and name.
    """
    assembly = Assembly(name)
    for solid in scene.solids:
        if solid.layer == BODIES:
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
    """Bring looks, which come last, into the order of their solids, and colours before them.

    The writer has them in the order of addresses in memory.
    """
    entities = _entities(model)
    numbers = {one: number for number, one in enumerate(entities)}
    starts = [number for number, one in enumerate(entities) if isinstance(one, Presentation)]
    looks = [entities[start:end] for start, end in pairwise([*starts, len(entities)])]
    looks.sort(key=lambda look: numbers[look[0].ItemsValue(1).Item()])
    colors = [one for one in entities if isinstance(one, StepVisual_ColourRgb)]
    colors.sort(key=lambda color: (color.Red(), color.Green(), color.Blue()))
    wanted = [*colors, *(one for look in looks for one in look if one not in colors)]
    for number, one in enumerate(wanted, starts[0]):
        before = entities.index(one)
        if before != number:
            model.ChangeOrder(before + 1, number + 1)
            entities.insert(number, entities.pop(before))


def _number_instances(model: Interface_InterfaceModel) -> None:
    """Count instances from 1: the writer goes on from where its last file ended."""
    instances = (one for one in _entities(model) if isinstance(one, StepRepr_NextAssemblyUsageOccurrence))
    for number, instance in enumerate(instances, 1):
        instance.SetId(Text(str(number)))


def _entities(model: Interface_InterfaceModel) -> list[Any]:
    return [model.Value(number) for number in range(1, model.NbEntities() + 1)]


@contextmanager
def _set(wanted: dict[str, str]) -> Iterator[None]:
    """Settings of the writer, which are those of the whole process, for a while."""
    with ExitStack() as undoing:
        for name, value in wanted.items():
            undoing.callback(Interface_Static.SetCVal_s, name, Interface_Static.CVal_s(name))
            Interface_Static.SetCVal_s(name, value)
        yield


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the writer's words on the terminal, but for failures."""
    with ExitStack() as undoing:
        for printer in Message.DefaultMessenger_s().Printers():
            undoing.callback(printer.SetTraceLevel, printer.GetTraceLevel())
            printer.SetTraceLevel(Message_Fail)
        yield

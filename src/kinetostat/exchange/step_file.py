"""A scene as a STEP file: the settings of Open CASCADE's writer, the header, and an order that is always the same.

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
        name: of the assembly.

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

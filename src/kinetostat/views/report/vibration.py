"""The section on natural vibrations, where the file says what platform or payload weigh. Nothing is computed."""

from collections.abc import Iterator

import xarray as xr

from kinetostat.kinematics.status import Status
from kinetostat.studies.vibration import Vibration
from kinetostat.views.figures import contour_maps, curves
from kinetostat.views.report.content import Block, Paragraph, Section
from kinetostat.views.report.pictures import drawn
from kinetostat.views.report.typesetting import printed, typeset
from kinetostat.views.vibration_figures import response_figure, shape_figure
from kinetostat.views.vibration_tables import cut_by_table, damping_of, masses_of, mode_table, share_table, strain_of

SHAPES = 3
"""Modes of which the shape is drawn."""


def vibration_section(answer: Vibration, frequencies: xr.Dataset | None) -> Section:
    """Write the section: verdict, modes, who makes them, shapes, response, and the first frequency over the poses.

    Args:
        answer: at the pose of the report.
        frequencies: the first one over the poses of the maps; None where there are no maps.
    """
    return Section("Vibration", tuple(_blocks(answer, frequencies)))


def _blocks(answer: Vibration, frequencies: xr.Dataset | None) -> Iterator[Block]:
    about = " about its state under load" if answer.loaded else ""
    if not answer.modes:
        yield Paragraph(typeset(answer.message), f"Vibration{about}:")
        return
    yield Paragraph(
        typeset(f"{answer.message} {masses_of(answer)} Damping: {damping_of(answer)}"), f"Vibration{about}:"
    )
    if cut := cut_by_table(answer):
        yield Paragraph(typeset(cut), "Cutting:")
    caption = (
        "Natural frequencies; the component in which the tool moves most, with the mass and stiffness that would ring "
        "there alone; and the share of all moving mass that answers when the base shakes along each axis."
    )
    yield printed(mode_table(answer.modes, answer.machine.display, answer.components), caption)
    yield printed(share_table("Strain energy (%)", strain_of(answer.modes)), "Strain energy by spring, %.")
    yield printed(
        share_table("Kinetic energy (%)", [mode.kinetic for mode in answer.modes]), "Kinetic energy by part, %."
    )
    for number, mode in enumerate(answer.modes[:SHAPES]):
        if mode.shape is not None:
            shown = answer.machine.display.show(mode.frequency, "Hz")
            yield drawn(shape_figure(answer, number, ""), f"Shape of mode {number + 1}, {shown}.")
    yield drawn(
        response_figure(answer, title=""),
        "Motion of the tool per force along it: size, phase, real part and Nyquist curve.",
    )
    if frequencies is not None and (frequencies["status"] == int(Status.OK)).any():
        draw = contour_maps if frequencies["status"].ndim == 2 else curves
        names = [str(name) for name in frequencies.data_vars if "frequency" in str(name)]
        yield drawn(draw(frequencies, names, ""), "The first natural frequency over the poses.")

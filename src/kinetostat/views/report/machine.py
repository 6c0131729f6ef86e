"""Sections about the machine itself: what it looks like, how it can move, and every number of its file."""

from dataclasses import replace

from kinetostat.kinematics.mobility import Mobility
from kinetostat.spec.fields import NO_LIMIT
from kinetostat.studies.analysis import Analysis
from kinetostat.views.drawing import three_views
from kinetostat.views.report.content import Block, Figure, Paragraph, Section
from kinetostat.views.report.live import WITHOUT, can_be_live
from kinetostat.views.report.pictures import SHARE, Shown, drawn
from kinetostat.views.report.typesetting import printed, typeset
from kinetostat.views.tables import machine_table, number


def machine_section(found: Analysis, pictures: Shown, live: bool) -> Section:
    """Pictures and mobility.

    Args:
        found: at the pose.
        pictures: of it.
        live: whether the report will be a page, which shows the machine in three dimensions if it can.
    """
    machine, turning = found.machine, live and can_be_live()
    caption = f"{machine.name} at its pose: actuated legs blue, passive ones orange."
    if live and not turning:
        caption += WITHOUT
    if turning and pictures.factor is not None:
        caption += f" Deflections {pictures.factor:,.6g} times as large as they are."
    blocks: list[Block] = [
        Paragraph(_first_upper(machine.family.summary)),
        *_mobility(found.mobility),
        Figure(caption, pictures.portrait(), SHARE, pictures.data if turning else None),
        _drawing(found),
    ]
    return Section("The machine", tuple(blocks))


def _drawing(found: Analysis) -> Figure:
    """The machine from its sides, a planar one from above."""
    sides = "Plan" if found.machine.family.planar else "Front, side and plan"
    return drawn(
        three_views(found.machine, ""),
        f"{sides}, to scale; K, C and the load are given at {found.machine.reference[-1]}.",
    )


def _mobility(found: Mobility | None) -> tuple[Block, ...]:
    if found is None:
        return ()
    redundant = f", {found.here.redundant} constraints redundant" if found.here.redundant else ""
    distances = f"{number(found.leg_distance)} for the legs and {number(found.platform_distance)} for the platform"
    text = (
        f"{found.full_cycle} freedoms, {found.actuators} actuators{redundant}. The pose is {found.kind}: of 1, the "
        f"distance from a singularity is {distances}; at 0 a leg locks up, or the platform moves with locked actuators."
    )
    return (Paragraph(typeset(text), "Mobility and singularity:"),)


def data_section(found: Analysis) -> Section:
    """Every number of the machine file."""
    table = printed(machine_table(found.machine), "All values of the machine with their units; angles in degrees.")
    unset = [row[0].removeprefix("limits.") for row in table.rows if row[1] == NO_LIMIT]
    rest = replace(table, rows=tuple(row for row in table.rows if row[1] != NO_LIMIT))
    said = (Paragraph(f"{', '.join(unset)}.", "Limits that are not set:"),) if unset else ()
    return Section("Data sheet", (rest, *said))


def _first_upper(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"

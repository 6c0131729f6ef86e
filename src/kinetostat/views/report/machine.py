"""Sections on the machine itself: what it looks like, how it can move, and every number of its file.

Nothing is computed here.
"""

from dataclasses import replace

from kinetostat.kinematics.mobility import Kind, Mobility
from kinetostat.spec.fields import NO_LIMIT
from kinetostat.spec.installation import adding
from kinetostat.studies.analysis import Analysis
from kinetostat.views.drawing import three_views
from kinetostat.views.first_lines import margins
from kinetostat.views.report.content import Block, Figure, Paragraph, Section
from kinetostat.views.report.pictures import SHARE, WITHOUT, Shown, can_be_live, drawn
from kinetostat.views.report.typesetting import printed, typeset
from kinetostat.views.tables import machine_table


def portrait(analysis: Analysis, pictures: Shown, live: bool) -> Figure:
    """The picture of the machine on the first page.

    Args:
        analysis: at the pose.
        pictures: of the machine.
        live: whether the report will be a page, which shows the machine in three dimensions if it can.
    """
    machine, turning = analysis.machine, live and can_be_live()
    caption = f"{machine.name} at its pose: actuated legs blue, passive ones orange."
    if live and not turning:
        caption += WITHOUT.format(adding("report"))
    if turning and pictures.factor is not None:
        caption += f" Deflections are drawn {pictures.factor:,.6g} times as large as they are."
    if turning and pictures.swings:
        caption += " Modes of vibration swing as far as can be seen; their sizes say nothing."
    return Figure(caption, pictures.portrait(), SHARE, pictures.data if turning else None)


def machine_section(analysis: Analysis) -> Section:
    """Write the section with drawings and mobility."""
    summary = Paragraph(_first_upper(analysis.machine.family.summary))
    return Section("The machine", (summary, *_mobility(analysis), _drawing(analysis)))


def _drawing(analysis: Analysis) -> Figure:
    """Front, side and plan of the machine; of a planar machine the plan alone."""
    views = "Plan" if analysis.machine.family.planar else "Front, side and plan"
    return drawn(
        three_views(analysis.machine, ""),
        f"{views}, to scale; K, C and the load refer to {analysis.machine.reference[-1]}.",
    )


def _pose_kind(analysis: Analysis, mobility: Mobility) -> str:
    """Say in a sentence or two what kind of pose it is, and how far it is from a singularity."""
    kind = f"{mobility.kind} pose" if mobility.kind is Kind.REGULAR else mobility.kind
    return f"{_first_upper(kind)} {margins(analysis)}"


def _mobility(analysis: Analysis) -> tuple[Block, ...]:
    mobility = analysis.mobility
    if mobility is None:
        return ()
    redundant = f", {mobility.here.redundant} constraints redundant" if mobility.here.redundant else ""
    text = (
        f"{mobility.full_cycle} freedoms, {mobility.actuators} actuators{redundant}. {_pose_kind(analysis, mobility)} "
        "At a margin of 0 a leg locks up, or the platform moves although the actuators are locked."
    )
    return (Paragraph(typeset(text), "Mobility and singularity:"),)


def data_section(analysis: Analysis) -> Section:
    """Write the section with every number of the machine file."""
    table = printed(machine_table(analysis.machine), "All values of the machine with their units; angles in degrees.")
    unset = [row[0].removeprefix("limits.") for row in table.rows if row[1] == NO_LIMIT]
    rest = replace(table, rows=tuple(row for row in table.rows if row[1] != NO_LIMIT))
    remarks = (Paragraph(f"{', '.join(unset)}.", "Limits that are not set:"),) if unset else ()
    return Section("Data sheet", (rest, *remarks))


def _first_upper(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"

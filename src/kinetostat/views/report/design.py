"""Sections for the designer: guidelines with the tables behind them, and parameters by rank."""

from kinetostat.studies.guidelines.guidelines import Guidelines
from kinetostat.studies.guidelines.roles import Roles
from kinetostat.studies.guidelines.sentences import statements
from kinetostat.studies.report.answers import Answers
from kinetostat.studies.sensitivity import Sensitivity, notes
from kinetostat.views.guideline_figures import limit_figure
from kinetostat.views.guideline_tables import (
    ALIKE,
    LEGEND,
    MOST_ROWS,
    TOPICS,
    element_table,
    equations,
    left_out,
    limit_table,
    move_table,
    over_poses,
)
from kinetostat.views.report.content import Block, Listing, Paragraph, Points, Section
from kinetostat.views.report.pictures import drawn
from kinetostat.views.report.typesetting import printed, typeset
from kinetostat.views.sensitivity_tables import influence_table

MOST_INFLUENCES = 24
"""Parameters in the ranking."""


def guideline_section(answers: Answers) -> Section:
    """What the stiffness depends on and what to change."""
    found, title = answers.guidelines, "Guidelines"
    if found is None or found.here is None:
        return Section(title, (Paragraph("Guidelines were left out." if found is None else found.message),))
    said = statements(found)
    topics = [(heading, [one for one in said if one.topic == topic]) for topic, heading in TOPICS.items()]
    parts = [
        Section(
            heading,
            (Points(tuple((typeset(one.text), "" if one.holds is None else over_poses(one.holds)) for one in own)),),
        )
        for heading, own in topics
        if own
    ]
    return Section(
        title, (Paragraph(_about(found)), *parts, Section("Tables behind the sentences", _tables(found, found.here)))
    )


def _about(found: Guidelines) -> str:
    answered, poses = found.poses
    where = f" and tried at {answered:,} of {poses:,} poses of the range mapped above" if poses else ""
    return f"Derived from this machine at its pose{where}. Directions are those of a load and of its motion."


def _tables(found: Guidelines, here: Roles) -> tuple[Block, ...]:
    count = min(MOST_ROWS, len(found.moves))
    blocks: list[Block] = [printed(element_table(found, here), "Shares of the elements in the diagonal of C.")]
    sums = equations(found)
    if sums:
        caption = "The diagonal of K, by the stiffness k of one part of each element (SI)."
        blocks.append(Listing(caption, "\n".join(sums)))
    blocks.append(printed(limit_table(found, here), f"Stiffness from which an element counts as rigid. {LEGEND}"))
    if count:
        poses = f" {ALIKE[0].upper()}{ALIKE[1:]}" if found.poses[0] else ""
        arrows = (
            "What one percent more of a parameter does, or 0.01 rad more of an angle: percent stiffer ▲ or softer ▼."
        )
        caption = arrows + poses
        blocks.append(printed(move_table(found, count), caption))
    blocks += [Paragraph(typeset(line)) for line in (found.meaning, *left_out(found, count))]
    limits = limit_figure(found)
    if limits is not None:
        caption = "Stiffness of each direction against that of each element, as a share of that with the element rigid."
        blocks.append(drawn(limits, caption))
    return tuple(blocks)


def sensitivity_section(found: Sensitivity | None) -> Section:
    """Which parameters matter, by rank."""
    title = "Sensitivity"
    if found is None:
        return Section(title, (Paragraph("Sensitivities were left out."),))
    if not found.influences:
        return Section(title, (Paragraph("No parameter has an influence on the compliance here."),))
    count = min(MOST_INFLUENCES, len(found.influences))
    rest = len(found.influences) - count
    more = f" {rest} more have less influence." if rest else ""
    about = (
        "Percent by which each entry of the diagonal of C changes per percent of a parameter, of an angle per 0.01 rad."
    )
    caption = f"{about}{more}"
    return Section(
        title,
        (
            Paragraph("Exact derivatives at the pose, the greatest influence first."),
            printed(influence_table(found, count), caption),
            *(Paragraph(typeset(note)) for note in notes(found)),
        ),
    )

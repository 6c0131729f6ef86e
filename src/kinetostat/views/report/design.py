"""Sections for the designer: guidelines with the tables behind them, and the parameters ranked by influence.

Nothing is computed here.
"""

from kinetostat.studies.guideline_sentences import statements
from kinetostat.studies.guidelines import Guidelines, Roles
from kinetostat.studies.report import Answers
from kinetostat.studies.sensitivity import Sensitivity, notes
from kinetostat.views.influence_figures import limit_figure
from kinetostat.views.influence_tables import (
    ALIKE,
    LEGEND,
    MOST_ROWS,
    TOPICS,
    element_table,
    equations,
    influence_table,
    left_out,
    limit_table,
    move_table,
    over_poses,
)
from kinetostat.views.report.content import Block, Listing, Paragraph, Points, Section
from kinetostat.views.report.pictures import figure_of
from kinetostat.views.report.typesetting import as_table, typeset

MOST_INFLUENCES = 24
"""Number of parameters in the ranking."""


def guideline_section(answers: Answers) -> Section:
    """Write the section on what the stiffness depends on and what to change."""
    advice, title = answers.of("guidelines"), "Guidelines"
    if advice is None or advice.here is None:
        return Section(title, (Paragraph("Guidelines were left out." if advice is None else advice.message),))
    parts = []
    for topic, heading in TOPICS.items():
        matching = [statement for statement in statements(advice) if statement.topic == topic]
        remarks = ["" if statement.holds is None else over_poses(statement.holds) for statement in matching]
        items = tuple((typeset(statement.text), remark) for statement, remark in zip(matching, remarks, strict=True))
        parts += [Section(heading, (Points(items),))] if items else []
    tables = Section("Tables behind the sentences", _tables(advice, advice.here))
    return Section(title, (Paragraph(_about(advice)), *parts, tables))


def _about(advice: Guidelines) -> str:
    answered, poses = advice.poses
    where = f" and checked at {answered:,} of {poses:,} poses of the range mapped above" if poses else ""
    return f"Derived from this machine at its pose{where}. A direction is that of a load and of the motion it causes."


def _tables(advice: Guidelines, here: Roles) -> tuple[Block, ...]:
    count = min(MOST_ROWS, len(advice.parameters))
    blocks: list[Block] = [as_table(element_table(advice, here), "Shares of the elements in the diagonal of C.")]
    sums = equations(advice)
    if sums:
        caption = "Diagonal of K as a sum over the elements, k being the stiffness of one part of each (SI)."
        blocks.append(Listing(caption, "\n".join(sums)))
    blocks.append(as_table(limit_table(advice, here), f"Stiffness from which an element counts as rigid. {LEGEND}"))
    if count:
        poses = f" {ALIKE[0].upper()}{ALIKE[1:]}" if advice.poses[0] else ""
        arrows = "Effect of 1 % more of a parameter, or of 0.01 rad more of an angle: percent stiffer ▲ or softer ▼."
        blocks.append(as_table(move_table(advice, count), arrows + poses))
    blocks += [Paragraph(typeset(line)) for line in (advice.meaning, *left_out(advice, count))]
    limits = limit_figure(advice)
    if limits is not None:
        caption = (
            "Stiffness in each direction over the stiffness of each element, relative to that with the element rigid."
        )
        blocks.append(figure_of(limits, caption))
    return tuple(blocks)


def sensitivity_section(ranking: Sensitivity | None) -> Section:
    """Write the section that ranks the parameters by their influence."""
    title = "Sensitivity"
    if ranking is None:
        return Section(title, (Paragraph("Sensitivities were left out."),))
    if not ranking.parameters:
        return Section(title, (Paragraph("No parameter has an influence on the compliance here."),))
    count = min(MOST_INFLUENCES, len(ranking.parameters))
    rest = len(ranking.parameters) - count
    more = f" {rest} parameters with less influence are omitted." if rest else ""
    caption = (
        "Percent by which each entry of the diagonal of C changes per percent of a parameter, of an angle per 0.01 rad."
        f"{more}"
    )
    return Section(
        title,
        (
            Paragraph("Exact derivatives at the pose, largest influence first."),
            as_table(influence_table(ranking, count), caption),
            *(Paragraph(typeset(note)) for note in notes(ranking)),
        ),
    )

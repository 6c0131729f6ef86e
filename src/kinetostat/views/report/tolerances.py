"""The section on the error that tolerances allow, where the machine's file has some. Nothing is computed here."""

from kinetostat.studies.budget.budget import Budget
from kinetostat.views.budget_figures import contributions_figure
from kinetostat.views.budget_tables import drawn_sentence, legs_table, lines_table, sizes_table
from kinetostat.views.report.content import Block, Paragraph, Section
from kinetostat.views.report.pictures import drawn
from kinetostat.views.report.typesetting import printed, typeset


def tolerances_section(budget: Budget) -> Section:
    """Write the section: how far off the tool is at the pose, and what that is made of.

    Args:
        budget: at the pose of the report.
    """
    sizes = sizes_table(budget)
    blocks: list[Block] = [
        Paragraph(typeset(budget.message), "As built:"),
        printed(sizes, f"{sizes.title}. {drawn_sentence(budget)}"),
    ]
    if budget.shares.any():
        blocks += [
            printed(lines_table(budget), "Contributions of the lines of [tolerances] to the variance."),
            printed(legs_table(budget), "Contributions of the legs to the variance."),
            drawn(contributions_figure(budget, ""), "What the variance of the error is made of."),
        ]
    return Section("Error by tolerances", tuple(blocks))

"""The section about the independent engine: both compliances, their difference, and how the engine comes to its own."""

from kinetostat.validation.comparison import Validation
from kinetostat.views.report.content import Block, Paragraph, Section
from kinetostat.views.report.summary import verdict
from kinetostat.views.report.typesetting import printed, typeset
from kinetostat.views.validation_tables import diagonal_table, difference_table, trial_table


def validation_section(found: Validation | str) -> Section:
    """Ours beside the engine's, or why there is no comparison."""
    title = "Validation"
    if isinstance(found, str):
        return Section(title, (Paragraph(found),))
    about = (
        "The machine was rebuilt in an engine that is not ours, from its geometry, sections and springs alone; no "
        f"Jacobian of ours goes into it. {verdict(found)}"
    )
    blocks: list[Block] = [
        Paragraph(typeset(about)),
        printed(diagonal_table(found), "The diagonal of the compliance, side by side."),
        printed(difference_table(found), "Relative difference by block, and how far the engine itself may be trusted."),
    ]
    if len(found.trials) > 1:
        blocks.append(printed(trial_table(found), "How the engine comes to it."))
    return Section(title, tuple(blocks))

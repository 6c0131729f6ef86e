"""The first section: the results in sentences, and each direction in a line.

Nothing is computed here but sums of shares.
"""

import math
from collections.abc import Iterator

from kinetostat.display import Display
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.attribution import by_part, ranked
from kinetostat.studies.guideline_sentences import statements
from kinetostat.studies.optimisation.result_data import message
from kinetostat.studies.report.answers import Answers
from kinetostat.validation.comparison import Validation
from kinetostat.views.first_lines import first_lines
from kinetostat.views.report.content import Block, Figure, Paragraph, Points, Section, Table
from kinetostat.views.report.provenance import verdict
from kinetostat.views.report.study import gains
from kinetostat.views.report.typesetting import typeset
from kinetostat.views.report.under_load import verdict_of
from kinetostat.views.requirement_lines import headline, requirement_lines

MOST_NAMED = 2
"""Number of parts that are named in each direction, at most."""
NAMED = 0.05
"""Share of a direction's compliance from which a part is named."""


def summary_section(answers: Answers, validation: Validation | str, portrait: Figure) -> Section:
    """Write the summary, with the requirements and a picture of the machine."""
    points = tuple((typeset(text), "") for text in _findings(answers, validation))
    answer = [Paragraph(typeset(text), f"{label}:") for label, text in first_lines(answers.analysis)]
    answer += [verdict_of(answers.loaded)] if answers.loaded else []
    for label, known in (("Vibration", answers.vibration), ("As built", answers.budget)):
        answer += [Paragraph(typeset(known.message), f"{label}:")] if known else []
    return Section("Summary", (*answer, *_requirements(answers), portrait, Points(points), _directions(answers)))


def _requirements(answers: Answers) -> tuple[Block, ...]:
    """What the file demands: how much of it is met, and each requirement with its margin and worst pose."""
    judged, display = answers.requirements, answers.machine.display
    if not judged:
        return ()
    lines = tuple((typeset(sentence), word) for _, word, sentence in requirement_lines(judged, display))
    return Paragraph(headline(judged), "Requirements:"), Points(lines)


def _findings(answers: Answers, validation: Validation | str) -> Iterator[str]:
    if answers.result is not None:
        yield " ".join([message(answers.result), *gains(answers.result)])
    if answers.guidelines is not None:
        yield from (statement.text for statement in statements(answers.guidelines) if statement.topic == "weakest")
    yield verdict(validation)


def _directions(answers: Answers) -> Table:
    """Each direction in a line: compliance, free and held stiffness, and the parts that contribute most."""
    analysis = answers.analysis
    display = analysis.machine.display
    heads = ("direction", "compliance C", "stiffness 1/C", "stiffness K", "mainly from")
    rows = []
    for i, name in enumerate(analysis.components):
        soft, stiff = analysis.compliance_diagonal[i], analysis.stiffness_diagonal[i]
        free = math.inf if soft == 0.0 else 1.0 / soft
        values = [_scaled(soft, f"compliance_{name}", "free", display)]
        values += [_scaled(k, f"stiffness_{name}", "rigid", display) for k in (free, stiff)]
        rows.append((name, *values, _contributors(analysis, i)))
    caption = (
        f"Each direction at the {analysis.machine.reference}: C is the motion by a unit load in the same direction, "
        "1/C the stiffness with all other motions free to follow, K the stiffness with all other motions held."
    )
    return Table(caption, heads, tuple(rows), (False, True, True, True, False))


def _scaled(value: float, quantity: str, infinite: str, display: Display) -> str:
    return typeset(display.show(value, QUANTITIES[quantity].unit, infinite))


def _contributors(analysis: Analysis, i: int) -> str:
    parts = by_part(analysis.attribution).items()
    shares = {name: sum(spring.compliance_share[i] or 0.0 for spring in springs) for name, springs in parts}
    largest = [pair for pair in ranked(shares) if pair[1] >= NAMED]
    named = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in largest[:MOST_NAMED])
    more = len(largest) - MOST_NAMED
    return f"{named} and {more} more" if more > 0 else named or "nothing"

"""The first section: the results in sentences, and each direction in a line.

Nothing is computed here but sums of shares.
"""

import math
from collections.abc import Iterator

import numpy as np

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.attribution import by_part
from kinetostat.studies.guidelines.sentences import statements
from kinetostat.studies.optimisation.result_data import message
from kinetostat.studies.report.answers import Answers
from kinetostat.validation.comparison import Validation
from kinetostat.views.display import prefixed_scale
from kinetostat.views.report.content import Paragraph, Points, Section, Table
from kinetostat.views.report.machine import pose_kind
from kinetostat.views.report.provenance import verdict
from kinetostat.views.report.study import gains
from kinetostat.views.report.typesetting import typeset
from kinetostat.views.tables import number

MOST_NAMED = 2
"""Number of parts that are named in each direction, at most."""
NAMED = 0.05
"""Share of a direction's compliance from which a part is named."""


def summary_section(answers: Answers, validation: Validation | str) -> Section:
    """Write the summary."""
    points = tuple((typeset(text), "") for text in _findings(answers, validation))
    return Section("Summary", (Paragraph(typeset(answers.analysis.message)), Points(points), _directions(answers)))


def _findings(answers: Answers, validation: Validation | str) -> Iterator[str]:
    analysis = answers.analysis
    if answers.result is not None:
        yield " ".join([message(answers.result), *gains(answers.result)])
    if analysis.indices and analysis.indices.free and "translation" in analysis.indices.free:
        soft = analysis.indices.free["translation"]
        values = [number(k, "rigid") for k in (soft.stiffnesses[0], soft.stiffnesses[-1])]
        yield (
            f"Against a force at the {analysis.machine.reference} the stiffness is {values[0]} N/m in the softest "
            f"direction and {values[1]} N/m in the stiffest, rotations free to follow."
        )
    if answers.guidelines is not None:
        yield from (statement.text for statement in statements(answers.guidelines) if statement.topic == "weakest")
    if analysis.mobility:
        yield pose_kind(analysis.mobility)
    if analysis.load:
        moved, turned = math.hypot(*analysis.load.deflection[3:]), math.hypot(*analysis.load.deflection[:3])
        if math.isfinite(moved) and math.isfinite(turned):
            point = analysis.machine.reference
            yield f"Under its load the {point} moves by {1e3 * moved:.4g} mm and turns by {1e3 * turned:.4g} mrad."
    yield verdict(validation)


def _directions(answers: Answers) -> Table:
    """Each direction in a line: compliance, free and held stiffness, and the parts that contribute most."""
    analysis = answers.analysis
    heads = ("direction", "compliance C", "stiffness 1/C", "stiffness K", "mainly from")
    rows = []
    for i, name in enumerate(analysis.components):
        soft, stiff = analysis.compliance_diagonal[i], analysis.stiffness_diagonal[i]
        free = math.inf if soft == 0.0 else 1.0 / soft
        values = [_scaled(soft, f"compliance_{name}", "free")]
        values += [_scaled(k, f"stiffness_{name}", "rigid") for k in (free, stiff)]
        rows.append((name, *values, _contributors(analysis, i)))
    caption = (
        f"Each direction at the {analysis.machine.reference}: C is the motion by a unit load in the same direction, "
        "1/C the stiffness with all other motions free to follow, K the stiffness with all other motions held."
    )
    return Table(caption, heads, tuple(rows), (False, True, True, True, False))


def _scaled(value: float, quantity: str, infinite: str) -> str:
    unit = QUANTITIES[quantity].unit
    if not math.isfinite(value) or value == 0.0:
        return number(value, infinite) if value else f"0 {unit}"
    scale = prefixed_scale(unit, np.array([value]))
    return typeset(f"{number(value * scale.factor)} {scale.unit}")


def _contributors(analysis: Analysis, i: int) -> str:
    parts = by_part(analysis.attribution).items()
    shares = {name: sum(spring.compliance_share[i] or 0.0 for spring in springs) for name, springs in parts}
    largest = sorted((pair for pair in shares.items() if pair[1] >= NAMED), key=lambda pair: -pair[1])
    named = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in largest[:MOST_NAMED])
    more = len(largest) - MOST_NAMED
    return f"{named} and {more} more" if more > 0 else named or "nothing"

"""The first section: what a reader should know who reads no further. Only shares are added up here."""

import math
from collections.abc import Iterator

import numpy as np

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.attribution import by_part
from kinetostat.studies.guidelines.sentences import statements
from kinetostat.studies.optimisation.result_data import message
from kinetostat.studies.report.answers import Answers
from kinetostat.validation.comparison import AGREED, Validation
from kinetostat.views.display import prefixed_scale
from kinetostat.views.report.content import Paragraph, Points, Section, Table
from kinetostat.views.report.study import gains
from kinetostat.views.report.typesetting import typeset
from kinetostat.views.tables import number

MOST_BLAMED = 2
"""Parts that are named in each direction."""
BLAMED = 0.05
"""Share of a direction's compliance from which a part is named."""


def summary_section(answers: Answers, validation: Validation | str) -> Section:
    """Findings in sentences, and each direction in a line."""
    points = tuple((typeset(text), "") for text in _findings(answers, validation))
    return Section("Summary", (Paragraph(typeset(answers.analysis.message)), Points(points), _directions(answers)))


def _findings(answers: Answers, validation: Validation | str) -> Iterator[str]:
    found = answers.analysis
    if answers.result is not None:
        yield " ".join([message(answers.result), *gains(answers.result)])
    if found.indices and found.indices.free and "translation" in found.indices.free:
        soft = found.indices.free["translation"]
        values = [number(k, "rigid") for k in (soft.stiffnesses[0], soft.stiffnesses[-1])]
        yield (
            f"Against a force at the {found.machine.reference} the machine is softest with {values[0]} N/m and "
            f"stiffest with {values[1]} N/m, rotations free to follow."
        )
    if answers.guidelines is not None:
        yield from (one.text for one in statements(answers.guidelines) if one.topic == "weakest")
    if found.mobility:
        yield (
            f"The pose is {found.mobility.kind}; distance from a singularity {number(found.mobility.leg_distance)} "
            f"(legs) and {number(found.mobility.platform_distance)} (platform), of 1."
        )
    if found.load:
        moved, turned = math.hypot(*found.load.deflection[3:]), math.hypot(*found.load.deflection[:3])
        if math.isfinite(moved) and math.isfinite(turned):
            point = found.machine.reference
            yield f"Under its load the {point} moves by {1e3 * moved:.4g} mm, and turns by {1e3 * turned:.4g} mrad."
    yield verdict(validation)


def verdict(validation: Validation | str) -> str:
    """What an independent engine says, in a sentence, or why there is none."""
    if isinstance(validation, str):
        return validation
    agree = "agrees" if validation.difference <= AGREED else "DIFFERS"
    return (
        f"{validation.engine.capitalize()} {validation.version}, an independent engine, {agree}: compliances differ by "
        f"{validation.difference:.1e} (relative, worst block), allowed {AGREED:g}."
    )


def _directions(answers: Answers) -> Table:
    """Each direction in a line: compliance, stiffness both ways, and the parts that are to blame."""
    found = answers.analysis
    heads = ("direction", "compliance C", "stiffness 1/C", "stiffness K", "yields by")
    rows = []
    for i, name in enumerate(found.components):
        soft, stiff = found.compliance_diagonal[i], found.stiffness_diagonal[i]
        free = math.inf if soft == 0.0 else 1.0 / soft
        values = [_scaled(soft, f"compliance_{name}", "free")]
        values += [_scaled(k, f"stiffness_{name}", "rigid") for k in (free, stiff)]
        rows.append((name, *values, _blamed(found, i)))
    caption = (
        f"Each direction at the {found.machine.reference}: C is the motion by a unit load in the same direction, 1/C "
        "the stiffness with all other motions free to follow, K the stiffness with all other motions held."
    )
    return Table(caption, heads, tuple(rows), (False, True, True, True, False))


def _scaled(value: float, quantity: str, endless: str) -> str:
    unit = QUANTITIES[quantity].unit
    if not math.isfinite(value) or value == 0.0:
        return number(value, endless) if value else f"0 {unit}"
    scale = prefixed_scale(unit, np.array([value]))
    return typeset(f"{number(value * scale.factor)} {scale.unit}")


def _blamed(found: Analysis, i: int) -> str:
    parts = by_part(found.attribution).items()
    shares = {name: sum(one.compliance_share[i] or 0.0 for one in springs) for name, springs in parts}
    worst = sorted((pair for pair in shares.items() if pair[1] >= BLAMED), key=lambda pair: -pair[1])
    named = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in worst[:MOST_BLAMED])
    more = len(worst) - MOST_BLAMED
    return f"{named} and {more} more" if more > 0 else named or "nothing"

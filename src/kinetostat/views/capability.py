"""Forces and speeds that the drives allow at a pose: the question, and the description of its answer.

Source: theory (81)-(84).
"""

import math
from collections.abc import Iterator

from kinetostat.display import DASH
from kinetostat.machine.machine import pose_of
from kinetostat.studies.capability import Capability, capability
from kinetostat.views.analysis_tables import direction_words
from kinetostat.views.question import FIRST_FIELDS, LOADS_LEFT_OUT, Description, Field, Lines, Option, Question, Records
from kinetostat.views.tables import FittedTable, numeric_table

TITLES = {
    "force": "force at no moment",
    "moment": "moment at no force",
    "speed": "speed without turning",
    "rate": "turning about the tool point",
    "acceleration": "acceleration without turning",
    "angular acceleration": "acceleration of turning alone",
}
"""Heads of the rows of the table and of the panels of the figure, by set."""
NO_END = "no limit"
"""Words for a load that no drive feels."""


def _amount_text(answer: Capability, value: float, unit: str) -> str:
    if math.isnan(value):
        return DASH
    return NO_END if math.isinf(value) else answer.machine.display.show(value, unit)


def _weakest(answer: Capability) -> str:
    """Say in which direction the least force and the least speed are, and which drives are at their limits there."""
    sentences = []
    for name in ("force", "speed", "acceleration"):
        part = answer.set_of(name)
        if part and part.weakest.size and part.least > 0.0:
            sentences.append(
                f"The {name} is least along {direction_words(part.weakest)}, where {_names(part.limited_by)} reach"
                f"{'es its limit' if len(part.limited_by) == 1 else ' their limits'}."
            )
    return " ".join(sentences)


def _names(names: tuple[str, ...]) -> str:
    """List names of drives in a phrase; of many, the first one and the number of the others."""
    if len(names) > 3:
        return f"{names[0]} and {len(names) - 1} others"
    return " and ".join(([", ".join(names[:-1])] if len(names) > 1 else []) + [names[-1]])


def _along(answer: Capability) -> str:
    """Return the greatest amounts both ways of the direction that was asked for."""
    phrases = []
    for part in (part for part in answer.sets if part.least >= 0.0):
        amounts = [part.along([sign * c for c in answer.direction]) for sign in (1.0, -1.0)]
        shown = list(dict.fromkeys(_amount_text(answer, way, part.unit) for way in amounts))
        phrases.append(f"{part.name} {' and, the other way, '.join(shown)}")
    return f"Along or about {direction_words(answer.direction)}: {'; '.join(phrases)}." if phrases else ""


def _lines(answer: Capability) -> Lines:
    if not answer.drives:
        return [("Pose", f"{pose_of(answer.machine)}. {answer.message}")]
    lines = [("Pose", f"{pose_of(answer.machine)}."), ("Drives", answer.message), ("Least", _weakest(answer))]
    return [*lines, ("Along", _along(answer) if answer.direction else "")]


def _tables(answer: Capability, _full: bool) -> Iterator[FittedTable]:
    if not answer.drives:
        return
    columns = ["in every direction", "least along", "in the best"]
    table = numeric_table("The drives allow at the tool point, beside the loads that count", "", columns)
    for part in answer.sets:
        weakest = direction_words(part.weakest) if part.weakest.size else ""
        greatest = _amount_text(answer, part.greatest, part.unit)
        table.add_row(TITLES[part.name], _amount_text(answer, part.least, part.unit), weakest, greatest)
    yield table
    drives = numeric_table("Drives", "", ["carries", "least", "greatest", "speed"])
    for drive in answer.drives:
        load, speed = ("N", "m/s") if drive.slides else ("N·m", "rad/s")
        carried = answer.machine.display.show(drive.carried, load)
        limits = [_amount_text(answer, drive.lower, load), _amount_text(answer, drive.upper, load)]
        drives.add_row(drive.name, carried, *limits, _amount_text(answer, drive.speed, speed))
    yield drives


def _finite(value: float) -> float | None:
    """Return a number for JSON; None where there is no limit."""
    return value if math.isfinite(value) else None


SETS = (
    Field("set", "name", long_name="force, moment, speed, rate or acceleration", column="quantity"),
    Field("unit"),
    Field("least", lambda part: _finite(part.least), long_name="in whichever direction, SI"),
    Field(
        "greatest",
        lambda part: _finite(part.greatest),
        long_name="in the best direction, SI; none if endless or not held",
    ),
    Field("weakest", lambda part: part.weakest, long_name="direction of the least, base axes", forms=("json",)),
    Field("limited_by", lambda part: list(part.limited_by), long_name="drives at their limits there", forms=("json",)),
    Field("vertices", lambda part: part.vertices.tolist(), long_name="of the polytope, SI, base axes", forms=("json",)),
)
"""Values of each set of loads or speeds."""
DRIVES = (
    Field("drive", "name"),
    Field("carried", long_name="load by what counts already, N or N·m"),
    Field("lower", lambda drive: _finite(drive.lower), long_name="least load, N or N·m"),
    Field("upper", lambda drive: _finite(drive.upper), long_name="greatest load, N or N·m"),
    Field("speed", lambda drive: _finite(drive.speed), long_name="greatest speed, m/s or rad/s"),
)
"""Values of each drive."""

CAPABILITY = Description(
    title="What the drives can do",
    fields=(
        *FIRST_FIELDS,
        LOADS_LEFT_OUT,
        Field("direction", lambda answer: list(answer.direction), forms=("json",)),
        Records("sets", "set", SETS),
        Records("drives", "drive", DRIVES, "drives", forms=("json",)),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.capability_figures.capability_figures",
    answered=lambda answer: bool(answer.drives),
    files={"capability.json": "json", "capability.csv": "csv"},
)
CAPABILITY_QUESTION = Question(
    example='kinetostat capability hexapod --set limits.actuator_speed="300 mm/s" -o capability',
    answer=capability,
    options=(Option("along", "direction", "direction in which force and speed are looked at, base axes", default=()),),
    loaded="the drives with what they carry at rest under all loads, weights of links and tensions among them",
    output="capability.json, capability.csv and the figure",
)

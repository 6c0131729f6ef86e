"""Sensitivities: the question, and the description of its answer. Nothing is computed here but rounding."""

import math
from collections.abc import Iterator
from typing import Any

from kinetostat.display import DASH
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, plain_name
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.sensitivity import UNIT_OF_PERCENTS, Sensitivity, notes, sensitivity
from kinetostat.units import KINDS, RIGID
from kinetostat.views.question import (
    FIRST_FIELDS,
    LOADS_LEFT_OUT,
    Description,
    Field,
    Lines,
    Question,
    Records,
    quantities_option,
)
from kinetostat.views.tables import FittedTable, numeric_table, words_on_omitted

MOST_INFLUENCES = 40
"""Parameters that have a line unless all are wanted: the strongest, which fill a screen."""
DIGITS_OF_PARAMETERS = 6
"""Digits of the value of a parameter: it can be found again in the file."""
NEGLIGIBLE = 0.0005
"""Percent per percent below which a 0 is shown: with three decimals it would read 0.000."""


def influence_table(answer: Sensitivity, count: int) -> FittedTable:
    """Return the first parameters by rank, with their values and their effect on each index."""
    group, machine = group_of(answer.quantities), answer.machine
    heads = [plain_name(name.removeprefix(f"{group}_")) for name in answer.quantities]
    title = f"{plain_name(group)}, {UNIT_OF_PERCENTS}" if group else UNIT_OF_PERCENTS
    table = numeric_table(f"{machine.name}: {title}", "parameter", ["value", *heads])
    for influence in answer.parameters[:count]:
        value = machine.display.show(influence.value, KINDS[influence.kind].unit, RIGID, DIGITS_OF_PARAMETERS)
        table.add_row(
            with_leg(machine, influence.path), value, *(_percent_text(percent) for percent in influence.percents)
        )
    return table


def _percent_text(value: float) -> str:
    """Return a number with three decimals, or a dash where there is none."""
    if math.isnan(value):
        return DASH
    return "0" if abs(value) < NEGLIGIBLE else f"{value:.3f}"


def _tables(answer: Sensitivity, full: bool) -> Iterator[FittedTable]:
    if answer.parameters:
        yield influence_table(answer, len(answer.parameters) if full else MOST_INFLUENCES)


def _lines(answer: Sensitivity) -> Lines:
    hidden = len(answer.parameters) - MOST_INFLUENCES
    if hidden > 0:
        yield "Parameters", f"{words_on_omitted(hidden)} (--full shows them)."
    if not answer.parameters:
        yield "Parameters", "No parameter has an influence here."
    meaning, *others = notes(answer)
    yield "Percent", meaning
    for sentence in others:
        yield "Others", sentence


def _parameters(answer: Sensitivity) -> list[dict[str, Any]]:
    """Return the parameters with the names of the indices."""
    names = answer.quantities
    return [
        {
            "path": parameter.path,
            "value": parameter.value,
            "units": KINDS[parameter.kind].unit,
            "one_percent_of": {"measure": parameter.measure, "value": parameter.percent_of},
            "derivatives": dict(zip(names, parameter.derivatives, strict=True)),
            "percent_per_percent": dict(zip(names, parameter.percents, strict=True)),
        }
        for parameter in answer.parameters
    ]


def _indices(answer: Sensitivity) -> dict[str, dict[str, Any]]:
    pairs = zip(answer.quantities, answer.indices, strict=True)
    return {name: {"value": value, "units": QUANTITIES[name].unit} for name, value in pairs}


PARAMETER = (
    Field("path", long_name="parameter"),
    Field("value", long_name="value of the parameter, SI"),
    Field("units", long_name="unit of the parameter"),
    Field("one_percent_of", forms=("json", "csv")),
    Field("derivatives", long_name="derivative of each index, SI", axes=("quantity",)),
    Field("percent_per_percent", unit="1", long_name=UNIT_OF_PERCENTS, axes=("quantity",)),
)
SENSITIVITY = Description(
    title="Sensitivity",
    fields=(
        *FIRST_FIELDS,
        LOADS_LEFT_OUT,
        Field("characteristic_length", lambda answer: answer.characteristic_length if answer.parameters else None),
        Field("indices", _indices),
        Records("parameters", "parameter", PARAMETER, _parameters),
        Field("without_influence"),
        Field("without_derivative", lambda answer: dict(answer.without_derivative)),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.sensitivity_figures.sensitivity_figures",
    answered=lambda answer: answer.status is Status.OK,
    files={"sensitivity.json": "json"},
)
SENSITIVITY_QUESTION = Question(
    example="kinetostat sensitivity zhang-gosselin-4dof --quantity compliance_z -o sensitivity",
    answer=sensitivity,
    options=(quantities_option("compliance"),),
    output="the figure and JSON",
    full="show every parameter that has an influence",
)

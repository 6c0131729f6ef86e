"""Sensitivities as a table on a terminal: parameters by rank against indices. Nothing is computed but rounding."""

from rich.console import Console
from rich.table import Table

from kinetostat.machine.parameters import with_leg
from kinetostat.studies.sensitivity import PER, Sensitivity, notes
from kinetostat.views.display import family_of_names, spoken
from kinetostat.views.tables import measured, numeric_table, omitted

MOST_ROWS = 40
"""Parameters that are printed; `--json` has all."""
LEAST = 0.0005
"""Percent per percent below which a 0 is printed."""


def print_sensitivity(console: Console, answer: Sensitivity) -> None:
    """The parameters that matter most, and what the numbers mean."""
    console.print(influence_table(answer, MOST_ROWS))
    hidden = len(answer.influences) - MOST_ROWS
    if hidden > 0:
        console.print(f"{omitted(hidden)} (--json has all).")
    for note in notes(answer):
        console.print(note, highlight=False)


def influence_table(answer: Sensitivity, count: int) -> Table:
    """The first parameters by rank, with their values and what they do to each index."""
    group = family_of_names(answer.quantities)
    heads = [spoken(name.removeprefix(f"{group}_")) for name in answer.quantities]
    title = f"{answer.machine.name}: {spoken(group)}, {PER}" if group else f"{answer.machine.name}: {PER}"
    table = numeric_table(title, "parameter", ["value", *heads])
    for one in answer.influences[:count]:
        name = with_leg(answer.machine, one.path)
        table.add_row(name, measured(one.value, one.kind), *(_percent(percent) for percent in one.percents))
    return table


def _percent(value: float | None) -> str:
    """Three digits after the point, a dash where there is none."""
    if value is None:
        return "–"
    return "0" if abs(value) < LEAST else f"{value:.3f}"

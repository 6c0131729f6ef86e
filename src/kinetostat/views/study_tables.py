"""What a study asks, before anything is searched, on a terminal and in reports. Nothing is computed."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.studies.optimisation.problem import Problem
from kinetostat.views.display import spoken
from kinetostat.views.tables import numeric_table


def print_study(console: Console, problem: Problem) -> None:
    """The question of a study: where it is judged, what is wanted, and what may change."""
    console.print(Text.assemble((problem.study.name, "bold"), f"  {problem.machine.name}"))
    console.print(f"Evaluated at {problem.poses.told}; method {problem.method}.", highlight=False)
    for aim in aims(problem):
        console.print(aim, highlight=False)
    console.print(bounds_table(problem))
    if fixed := not_searched(problem):
        console.print(f"Not searched, as these have a tolerance only: {fixed}.", highlight=False)


def aims(problem: Problem) -> list[str]:
    """Objectives and constraints, a line each."""
    wanted = [f"Objective: {one.goal} {spoken(one.term.label)}{_unit(one.term.unit)}" for one in problem.objectives]
    return wanted + [f"Constraint: {spoken(one.label)}" for one in problem.constraints]


def bounds_table(problem: Problem) -> Table:
    """The variables, between which values they may be, and what they are."""
    table = numeric_table("Variables", "variable", ["initial", "from", "to"])
    table.add_column("meaning")
    for one in problem.space.searched:
        low = 0.0 if one.choices is not None else one.low
        cells = (one.shown(value) for value in (one.initial, low, one.high))
        table.add_row(one.name, *cells, one.quantity.meaning)
    return table


def not_searched(problem: Problem) -> str:
    """Names of the variables that only have a tolerance."""
    return ", ".join(one.name for one in problem.space.variables if one.fixed)


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" ({unit})"

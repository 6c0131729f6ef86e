"""Tables of an optimisation study on a terminal: its question, and its answer beside the initial machine.

Nothing is computed here but rounding.
"""

import math
from collections.abc import Iterator

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.result_data import message
from kinetostat.studies.optimisation.ridges import told
from kinetostat.studies.optimisation.robustness import Robustness
from kinetostat.views.display import spoken
from kinetostat.views.tables import number, numeric_table


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


MOST_ROWS = 25
"""Designs of a front that are printed; result.json has all."""
FEW = 1e-4
"""Percent per percent below which a 0 is printed."""
MUCH = 0.01
"""Stiffness that is left, as a share, below which the loss is pointed out."""


def print_result(console: Console, found: Result) -> None:
    """All tables of a study that found something."""
    problem = found.problem
    console.print(f"{problem.study.name}: {problem.machine.name}", style="bold", highlight=False)
    console.print(f"{message(found)} Evaluated at {problem.poses.told}; method {problem.method}.", highlight=False)
    if len(problem.objectives) > 1:
        console.print(front_table(found))
    console.print(worth_table(found))
    console.print(variable_table(found))
    console.print(direction_table(found))
    if found.robustness:
        console.print(scatter_table(found.robustness))
        if found.robustness.failing:
            console.print(failing(found.robustness), highlight=False)
    for line in remarks(found):
        console.print(line, highlight=False)


def worth_table(found: Result) -> Table:
    """Objectives and constraints before and after."""
    best = "knee of the front" if len(found.problem.objectives) > 1 else "best"
    table = numeric_table(
        "Objectives and constraints" if found.problem.constraints else "Objectives",
        "",
        ["initial", best, "gain", "unit"],
    )
    for k, objective in enumerate(found.problem.objectives):
        before, after = found.initial.objectives[0, k], found.outcome.objectives[0, k]
        gain = before / after if objective.sign > 0 else after / before
        name = f"{objective.goal} {objective.term.label}"
        table.add_row(name, _exact(before), _exact(after), _times(gain), objective.term.unit)
    for k, one in enumerate(found.problem.constraints):
        before, after = found.initial.constraints[0, k], found.outcome.constraints[0, k]
        table.add_row(one.label, number(before), number(after), "", "" if one.term.unit == "1" else one.term.unit)
    return table


def variable_table(found: Result) -> Table:
    """The variables before and after, where they meet bounds, and what they do to the objectives."""
    objectives = found.problem.objectives
    heads = ["% per %"] if len(objectives) == 1 else [f"% per % ({k + 1})" for k in range(len(objectives))]
    table = numeric_table(
        "Variables (% per %: change of the objective per 1 % more; of an angle, per 0.01 rad more)",
        "variable",
        ["initial", "best", "at bound", *heads],
    )
    influences = {one.name: one for one in found.influences}
    held = found.problem.space.values(found.genes)
    for variable, value in zip(found.problem.space.searched, held, strict=True):
        own = influences.get(variable.name)
        percents = [_percent(p) for p in own.percents] if own else [""] * len(objectives)
        bound = own.bound if own else ""
        table.add_row(variable.name, variable.shown(variable.initial), variable.shown(value), bound, *percents)
        for field in variable.fields[1:]:
            table.add_row(f"  with {field.path}", "", "", "", *[""] * len(heads))
    return table


def direction_table(found: Result) -> Table:
    """The compliance of each direction before and after."""
    worst = "" if found.problem.poses.count == 1 else ", the worst of all poses"
    table = numeric_table(f"Compliance{worst}", "direction", ["initial", "best", "change", "unit"])
    for one in found.directions:
        name = one.name.removeprefix("compliance_")
        table.add_row(name, number(one.before), number(one.after), times_stiffer(one.gain), one.unit)
    return table


def scatter_table(robustness: Robustness) -> Table:
    """How the objectives scatter under the tolerances."""
    title = f"Under the tolerances: {robustness.machines:,} random machines"
    title += f" and {robustness.corners:,} corners (every tolerance at an end)" if robustness.corners else ""
    table = numeric_table(title, "", ["nominal", "mean", "std. dev.", "95 % within", "worst", "unit"])
    for one in robustness.scatters:
        figures = (_exact(value) for value in (one.nominal, one.mean))
        rest = (number(one.deviation), _exact(one.usual), _exact(one.worst))
        table.add_row(one.label, *figures, *rest, one.unit)
    return table


def failing(robustness: Robustness) -> str:
    """How many of the random machines are not feasible."""
    return f"{100.0 * robustness.failing:.3g} % of the random machines are not feasible."


def front_table(found: Result) -> Table:
    """Designs of the front, the knee among them."""
    problem, outcome = found.problem, found.log.outcome(found.front)
    shown = {round(k * (len(found.front) - 1) / (MOST_ROWS - 1)) for k in range(MOST_ROWS)} | {found.knee}
    names = [f"{one.term.label}\n{one.term.unit}".replace(" (", "\n(") for one in problem.objectives]
    variables = [variable.name.split(".", 1)[1].replace("_", "\n") for variable in problem.space.searched]
    title = f"Pareto front: {len(found.front)} designs" + (
        f", {len(shown)} shown" if len(found.front) > len(shown) else ""
    )
    table = numeric_table(title, "", [*names, *variables])
    for k in sorted(k for k in shown if k < len(found.front)):
        genes = found.log.genes(found.front[k : k + 1])[0]
        held = zip(problem.space.searched, problem.space.values(genes), strict=True)
        cells = [number(value) for value in outcome.objectives[k]] + [one.shown(value) for one, value in held]
        table.add_row("knee" if k == found.knee else "", *cells, style="bold" if k == found.knee else None)
    return table


def remarks(found: Result) -> Iterator[str]:
    """What a designer should not overlook."""
    bounded = [one for one in found.influences if one.bound]
    if bounded and len(found.problem.objectives) == 1:
        names = ", ".join(f"{one.name} ({one.bound})" for one in bounded)
        yield f"At a bound: {names}. Wider bounds would improve the objective, by the percentages above."
    lost = [one for one in found.directions if one.gain < MUCH]
    for one in lost:
        name = one.name.removeprefix("compliance_")
        yield f"The best design gives up {name}: {one.gain:.2g} of its stiffness is left; add a constraint to keep it."
    if len(found.problem.objectives) == 1:
        yield from told(found.ridges, found.problem) or (
            [found.no_ridges] if found.no_ridges else ["There is no ridge: the optimum is a single design."]
        )


def _exact(value: float) -> str:
    return number(value) if not math.isfinite(value) else f"{value:.9g}"


def _times(gain: float) -> str:
    return "–" if math.isnan(gain) else f"{gain:.4g}"


def times_stiffer(gain: float) -> str:
    """How many times stiffer, or softer, a direction has become."""
    if not gain or not math.isfinite(gain):
        return _times(gain)
    return f"{_times(gain)} times stiffer" if gain >= 1.0 else f"{_times(1.0 / gain)} times softer"


def _percent(value: float) -> str:
    if math.isnan(value):
        return "–"
    return "0" if abs(value) < FEW else f"{value:.3g}"

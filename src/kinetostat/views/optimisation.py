"""An optimisation study on a terminal, and the description of its answer: the best design beside the initial one.

Nothing is computed here; numbers are only rounded.
"""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.arrays import Array
from kinetostat.display import DASH, ENGINEERING, Display, number
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.late import LateModule
from kinetostat.machine.saving import as_file
from kinetostat.studies.optimisation.assessment import COMMON_SHARE, DesignVerdict, Outcome, Robustness
from kinetostat.studies.optimisation.log import ROWS
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.slopes import ridge_sentences
from kinetostat.studies.storage import list_files
from kinetostat.studies.study_folder import COPY, HISTORY, QUESTION
from kinetostat.views.answers import write_files
from kinetostat.views.question import LOADS_LEFT_OUT, MESSAGE, Description, Field, Lines
from kinetostat.views.tables import numeric_table

if TYPE_CHECKING:
    import xarray as xr
else:
    xr = LateModule("xarray")


MOST_ROWS = 25
"""Designs of a front that are printed, on one screen; result.json has all."""
OBJECTIVE_DIGITS = 9
"""Digits with which objectives are shown: the last ones still change while a search converges."""
LEAST_PERCENT = 1e-4
"""Percent per percent below which a 0 is printed: differences leave round-off of this size."""
LEAST_STIFFNESS_LEFT = 0.01
"""Share of its initial stiffness below which a direction has been given up for the others, and a sentence says so."""


def print_study(console: Console, problem: Problem) -> None:
    """Print the question of a study: poses, objectives, constraints and variables."""
    console.print("The file has no mistake, and its machine can be read.", highlight=False)
    console.print(Text.assemble((problem.study.name, "bold"), f"  {problem.machine.name}"))
    console.print(f"Evaluated at {problem.poses.description}; method {problem.method}.", highlight=False)
    for aim in aims(problem):
        console.print(aim, highlight=False)
    console.print(bounds_table(problem))
    if fixed := unsearched_variables(problem):
        console.print(f"Not searched, because only a tolerance is given: {fixed}.", highlight=False)


def aims(problem: Problem) -> list[str]:
    """Return the objectives and constraints of a study, a line each."""
    objectives = [
        f"Objective: {term.goal} {plain_name(term.term.label)}{_unit(term.term.unit, problem.machine.display)}"
        for term in problem.objectives
    ]
    return objectives + [f"Constraint: {bound.in_words(problem.machine.display)}" for bound in problem.constraints]


def bounds_table(problem: Problem) -> Table:
    """Return the variables with their bounds and meanings."""
    table = numeric_table("Variables", "variable", ["initial", "from", "to"])
    table.add_column("meaning")
    for variable in problem.space.searched_variables:
        low = 0.0 if variable.choices is not None else variable.low
        cells = (variable.in_words(value, problem.machine.display) for value in (variable.initial, low, variable.high))
        table.add_row(variable.name, *cells, variable.quantity.meaning)
    return table


def unsearched_variables(problem: Problem) -> str:
    """Return the names of the variables that only have a tolerance."""
    return ", ".join(variable.name for variable in problem.space.variables if variable.fixed)


def _unit(unit: str, display: Display) -> str:
    return "" if unit == "1" else f" ({display.scale(unit).unit})"


def objective_table(result: Result) -> Table:
    """Return the objectives and constraints before and after."""
    display = result.problem.machine.display
    best = "knee of the front" if len(result.problem.objectives) > 1 else "best"
    table = numeric_table(
        "Objectives and constraints" if result.problem.constraints else "Objectives",
        "",
        ["initial", best, "gain", "unit"],
    )
    for k, objective in enumerate(result.problem.objectives):
        before, after = result.initial.objectives[0, k], result.outcome.objectives[0, k]
        gain = before / after if objective.sign > 0 else after / before  # above 1 where the objective is better
        name, scale = f"{objective.goal} {objective.term.label}", display.scale(objective.term.unit)
        cells = (_exact(value * scale.factor) for value in (before, after))
        table.add_row(name, *cells, _times(gain), scale.head)
    for k, constraint in enumerate(result.problem.constraints):
        before, after = result.initial.constraints[0, k], result.outcome.constraints[0, k]
        unit = constraint.term.unit
        cells = (display.number(value, unit) for value in (before, after))
        table.add_row(constraint.in_words(display), *cells, "", display.scale(unit).head)
    return table


def variable_table(result: Result) -> Table:
    """Return the variables before and after, the bounds they meet, and their effect on the objectives."""
    objectives = result.problem.objectives
    heads = ["% per %"] if len(objectives) == 1 else [f"% per % ({k + 1})" for k in range(len(objectives))]
    table = numeric_table(
        "Variables (% per %: change of the objective if the variable grows by 1 %, an angle by 0.01 rad)",
        "variable",
        ["initial", "best", "at bound", *heads],
    )
    influences = {influence.name: influence for influence in result.influences}
    values, display = result.problem.space.values(result.genes), result.problem.machine.display
    for variable, value in zip(result.problem.space.searched_variables, values, strict=True):
        influence = influences.get(variable.name)
        percents = [sensitivity_text(p) for p in influence.percents] if influence else [""] * len(objectives)
        bound = influence.bound if influence else ""
        shown = (variable.in_words(number, display) for number in (variable.initial, value))
        table.add_row(variable.name, *shown, bound, *percents)
        for field in variable.fields[1:]:
            table.add_row(f"  with {field.path}", "", "", "", *[""] * len(heads))
    return table


def direction_table(result: Result) -> Table:
    """Return the compliance of each direction before and after."""
    display = result.problem.machine.display
    worst = "" if result.problem.poses.count == 1 else ", the worst of all poses"
    table = numeric_table(f"Compliance{worst}", "direction", ["initial", "best", "change", "unit"])
    for direction in result.compliance_changes:
        name = direction.name.removeprefix("compliance_")
        cells = (display.number(value, direction.unit) for value in (direction.before, direction.after))
        table.add_row(name, *cells, times_stiffer(direction.gain), display.scale(direction.unit).unit)
    return table


def scatter_table(robustness: Robustness, display: Display = ENGINEERING) -> Table:
    """Return the scatter of the objectives under the tolerances."""
    title = f"Under the tolerances: {robustness.machines:,} random machines"
    title += f" and {robustness.corners:,} corners (every tolerance at an end)" if robustness.corners else ""
    head_of_usual = f"reached by {100.0 * COMMON_SHARE:g} %"
    table = numeric_table(title, "", ["nominal", "mean", "std. dev.", head_of_usual, "worst", "unit"])
    for scatter in robustness.scatters:
        scale = display.scale(scatter.unit)
        nominal, mean, usual, worst = (
            _exact(value * scale.factor) for value in (scatter.nominal, scatter.mean, scatter.usual, scatter.worst)
        )
        deviation = display.number(scatter.deviation, scatter.unit)
        table.add_row(scatter.label, nominal, mean, deviation, usual, worst, scale.unit)
    return table


def failing_sentence(robustness: Robustness) -> str:
    """Return a sentence on the share of the random machines that are not feasible."""
    return f"{100.0 * robustness.failing:.3g} % of the random machines are not feasible."


def front_table(result: Result) -> Table:
    """Return the designs of the front, the knee among them."""
    problem, outcome = result.problem, result.log.outcome(result.front)
    evenly_spaced = {round(k * (len(result.front) - 1) / (MOST_ROWS - 1)) for k in range(MOST_ROWS)}
    shown = evenly_spaced | {result.knee}
    units = [objective.term.unit for objective in problem.objectives]
    display = problem.machine.display
    names = [
        f"{objective.term.label}\n{display.scale(unit).unit}".replace(" (", "\n(")
        for objective, unit in zip(problem.objectives, units, strict=True)
    ]
    variables = [variable.name.split(".", 1)[1].replace("_", "\n") for variable in problem.space.searched_variables]
    title = f"Pareto front: {len(result.front)} designs" + (
        f", {len(shown)} shown" if len(result.front) > len(shown) else ""
    )
    table = numeric_table(title, "", [*names, *variables])
    for k in sorted(k for k in shown if k < len(result.front)):
        genes = result.log.genes(result.front[k : k + 1])[0]
        values = zip(problem.space.searched_variables, problem.space.values(genes), strict=True)
        cells = [display.number(value, unit) for value, unit in zip(outcome.objectives[k], units, strict=True)]
        cells += [variable.in_words(value, display) for variable, value in values]
        table.add_row("knee" if k == result.knee else "", *cells, style="bold" if k == result.knee else None)
    return table


def remarks(result: Result) -> Iterator[str]:
    """Say what a designer should not overlook: variables at bounds, stiffness given up, ridges."""
    has_one_objective = len(result.problem.objectives) == 1
    bounded = [influence for influence in result.influences if influence.bound]
    if bounded and has_one_objective:
        names = ", ".join(f"{influence.name} ({influence.bound})" for influence in bounded)
        yield f"At a bound: {names}. Wider bounds would improve the objective, by the percentages above."
    for direction in result.compliance_changes:
        if direction.gain < LEAST_STIFFNESS_LEFT:
            name, share = direction.name.removeprefix("compliance_"), f"{direction.gain:.2g}"
            yield f"The best design gives up {name}: {share} of its stiffness is left; add a constraint to keep it."
    if has_one_objective:
        no_ridge = result.no_ridges or "There is no ridge: the optimum is a single design."
        yield from ridge_sentences(result.ridges, result.problem) or [no_ridge]


def _exact(value: float) -> str:
    return number(value) if not math.isfinite(value) else f"{value:.{OBJECTIVE_DIGITS}g}"


def _times(gain: float) -> str:
    return DASH if math.isnan(gain) else f"{gain:.4g}"


def times_stiffer(gain: float) -> str:
    """Say how many times stiffer, or softer, a direction has become."""
    if not gain or not math.isfinite(gain):
        return _times(gain)
    return f"{_times(gain)} times stiffer" if gain >= 1.0 else f"{_times(1.0 / gain)} times softer"


def sensitivity_text(value: float | None) -> str:
    """Return a sensitivity in percent per percent: 0 where it is negligible, a dash where there is none."""
    if value is None or math.isnan(value):
        return DASH
    return "0" if abs(value) < LEAST_PERCENT else f"{value:.3g}"


def _lines(result: Result) -> Lines:
    yield "Search", result.message
    yield "Poses", f"Evaluated at {result.problem.poses.description}; method {result.problem.method}."


def _tables(result: Result, _full: bool) -> Iterator[Table | str]:
    if not result.solved:
        return
    if len(result.problem.objectives) > 1:
        yield front_table(result)
    yield from (objective_table(result), variable_table(result), direction_table(result))
    if result.robustness:
        yield scatter_table(result.robustness, result.problem.machine.display)
        if result.robustness.failing:
            yield failing_sentence(result.robustness)
    yield from remarks(result)


def _if_solved(value_of: Callable[[Result], Any]) -> Callable[[Result], Any]:
    """Return a function that gives a value of a study with a solution, and None for a study without one."""
    return lambda result: value_of(result) if result.solved else None


def variables_of(problem: Problem, genes: Array) -> dict[str, float]:
    """Return the value of every field that the searched variables set, by its path, SI."""
    columns = problem.space.columns(genes[None])
    return {
        field.path: float(columns[field.leaves[0]][0])
        for variable in problem.space.searched_variables
        for field in variable.fields
    }


def _numbers_of(problem: Problem, outcome: Outcome, k: int) -> dict[str, Any]:
    """Return the objectives, constraints and verdict of one design of an outcome."""
    objectives = zip(problem.objectives, outcome.objectives[k].tolist(), strict=True)
    constraints = zip(problem.constraints, outcome.constraints[k].tolist(), strict=True)
    return {
        "objectives": {objective.term.label: value for objective, value in objectives},
        "constraints": {constraint.label: value for constraint, value in constraints},
        "verdict": DesignVerdict(int(outcome.verdict[k])).name.lower(),
    }


def _best(key: str) -> Field:
    """Return a field of the answer that has this key in `_numbers_of` the best design."""
    return Field(key, _if_solved(lambda result: _numbers_of(result.problem, result.outcome, 0)[key]), optional=True)


def _objective(result: Result) -> float | None:
    single = result.solved and len(result.problem.objectives) == 1
    return float(result.outcome.objectives[0, 0]) if single else None


def _initial(result: Result) -> dict[str, Any]:
    variables = {variable.name: variable.initial for variable in result.problem.space.searched_variables}
    return {"variables": variables, **_numbers_of(result.problem, result.initial, 0)}


def _directions(result: Result) -> list[dict[str, Any]]:
    return [
        {"name": item.name, "units": item.unit, "initial": item.before, "best": item.after, "gain": item.gain}
        for item in result.compliance_changes
    ]


def _sensitivity(result: Result) -> dict[str, Any]:
    return {
        item.name: {"derivatives": list(item.slopes), "percent_per_percent": list(item.percents)}
        for item in result.influences
    }


def _ridges(result: Result) -> list[dict[str, Any]]:
    return [
        {"variables": list(r.names), "from": list(r.start), "to": list(r.end), "relative_change": r.change}
        for r in result.ridges
    ]


def _scatter(result: Result) -> dict[str, Any] | None:
    robustness = result.robustness
    if robustness is None:
        return None
    objectives = {
        item.label: {
            "nominal": item.nominal,
            "mean": item.mean,
            "standard_deviation": item.deviation,
            "percentile_95": item.usual,
            "worst": item.worst,
        }
        for item in robustness.scatters
    }
    counts = {"machines": robustness.machines, "corners": robustness.corners, "failing": robustness.failing}
    return {**counts, "objectives": objectives}


def _convergence(result: Result) -> dict[str, Any]:
    keys = ("designs", "feasible", "best", "mean")
    return {key: [step.get(key) for step in result.log.steps] for key in keys}


def _front(result: Result) -> list[dict[str, Any]] | None:
    """Return the designs of a front with variables, objectives and constraints; None for a single objective."""
    if not result.solved or len(result.problem.objectives) == 1:
        return None
    outcome = result.log.outcome(result.front)
    return [
        {
            "knee": k == result.knee,
            "variables": variables_of(result.problem, genes),
            **_numbers_of(result.problem, outcome, k),
        }
        for k, genes in enumerate(result.log.genes(result.front))
    ]


def designs_dataset(result: Result) -> "xr.Dataset":
    """Return every design that was judged: its step, variables (SI, or the number of a choice), worth and verdict."""
    problem, log = result.problem, result.log
    outcome = log.outcome()
    steps = np.repeat(np.arange(len(log.steps)), [step["designs"] for step in log.steps])
    content: dict[str, Any] = {"step": ("design", steps, {"long_name": "step of the search"})}
    for variable, column in zip(problem.space.searched_variables, problem.space.values(log.genes()).T, strict=True):
        about = {"units": variable.unit, "long_name": variable.quantity.meaning}
        if variable.choices is not None:
            about["choices"] = "; ".join(variable.labels)
        content[variable.name] = ("design", column, about)
    for kind, terms, columns in (
        ("objective", [(o.term.label, o.term.unit) for o in problem.objectives], outcome.objectives),
        ("constraint", [(c.label, c.term.unit) for c in problem.constraints], outcome.constraints),
    ):
        for k, (label, unit) in enumerate(terms):
            content[f"{kind}_{k}"] = ("design", columns[:, k], {"units": unit, "long_name": label})
    flags = {
        "flag_values": [int(v) for v in DesignVerdict],
        "flag_meanings": " ".join(v.name.lower() for v in DesignVerdict),
    }
    content["verdict"] = ("design", outcome.verdict, flags)
    content["violation"] = ("design", outcome.violation, {"units": "1", "long_name": "0 where feasible"})
    attributes = {"study": problem.study.name, "machine": problem.machine.name, "method": problem.method}
    return xr.Dataset(content, attrs=attributes)


RESULT = Description(
    title="Design study",
    fields=(
        Field("name", "problem.study.name"),
        Field("machine", "problem.machine.name"),
        Field("status", lambda result: "ok" if result.solved else "infeasible"),
        MESSAGE,
        LOADS_LEFT_OUT,
        Field("method", "problem.method"),
        Field("seed", "problem.study.optimizer.seed"),
        Field("evaluations", "log.count"),
        Field("infeasible", lambda result: {v.name.lower(): count for v, count in result.counts.items() if v}),
        Field("poses", lambda result: {"count": result.problem.poses.count, "about": result.problem.poses.description}),
        Field("objective", _objective),
        Field("variables", lambda result: variables_of(result.problem, result.genes) if result.solved else {}),
        _best("objectives"),
        _best("constraints"),
        _best("verdict"),
        Field("initial", _initial),
        Field("directions", _if_solved(_directions), optional=True),
        Field(
            "at_bounds",
            _if_solved(lambda result: {item.name: item.bound for item in result.influences if item.bound}),
            optional=True,
        ),
        Field("sensitivity", _if_solved(_sensitivity), optional=True),
        Field("ridges", _if_solved(_ridges), optional=True),
        Field(
            "ridges_text",
            _if_solved(lambda result: ridge_sentences(result.ridges, result.problem) or [result.no_ridges]),
            optional=True,
        ),
        Field("robustness", _scatter),
        Field("convergence", _if_solved(_convergence), optional=True),
        Field("front", _front),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.optimisation_figures.pictures",
    makers={"nc": designs_dataset},
    machine="problem.machine",
    state=lambda result: result.problem.study.name,
    answered=lambda result: result.solved,
    files={
        "result.json": "json",
        "designs.nc": "nc",
        "best.toml": lambda result: as_file(result.machine) if result.solved else None,
    },
)


def write_result(result: Result, folder: Path) -> list[Path]:
    """Write the files of a result without figures, and list them with those of the search; return their paths."""
    written = write_files(RESULT, result, folder)
    list_files(folder, [*written, *(folder / name for name in (QUESTION, COPY, HISTORY, ROWS))])
    return written

"""The result of a study as HTML: the best design next to the initial one.

The numbers are those of `optimize --json`; here they are only rounded and arranged.
"""

from typing import Any

from kinetostat.display import DASH, Scale, number
from kinetostat.kinetostatics.quantities import spoken
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studio.design.progress import EXACT, Progress
from kinetostat.studio.wording import gains, heading, paragraph, table

SACRIFICED = 0.01
"""A remark says so if a direction keeps less than this share of its initial stiffness."""
NEGLIGIBLE = 1e-4
"""A sensitivity below this, in percent per percent, is shown as 0."""


def result_text(progress: Progress) -> str:
    """Return all tables of a search that has ended, or the best design so far of one that has not."""
    result = progress.result
    if result is None:
        return _so_far(progress)
    if result["status"] != "ok":
        return paragraph(str(result["message"]), "lead")
    several = result["objective"] is None
    parts = [paragraph(str(result["message"]), "note"), _objectives(progress, result, "knee" if several else "best")]
    parts += [_design(progress.problem, result), _directions(result), _robustness(progress, result)]
    return "".join(parts + [paragraph(line) for line in _remarks(result)])


def _so_far(progress: Progress) -> str:
    if not progress.objectives:
        return paragraph("No feasible design has been found so far." if progress.steps else "The search is starting.")
    if len(progress.problem.objectives) > 1:
        count = len(progress.objectives)
        return paragraph(f"The Pareto front has {count} designs so far. Click one in the plot to load it.")
    aim, display = progress.problem.objectives[0], progress.problem.machine.display
    rows = [[f"{aim.goal} {spoken(aim.term.label)}", progress.exact(aim, progress.objectives[0][0])]]
    if progress.genes is not None:
        space = progress.problem.space
        pairs = zip(space.searched, space.values(progress.genes[0]), strict=True)
        rows += [[variable.name, variable.in_words(value, display)] for variable, value in pairs]
    return heading("Best so far") + table("Best so far", ["", "best"], rows)


def _objectives(progress: Progress, result: dict[str, Any], best: str) -> str:
    problem, rows = progress.problem, []
    for aim in problem.objectives:
        before, after = (given["objectives"][aim.term.label] for given in (result["initial"], result))
        rows.append([progress.label(aim), *_exact(progress.scale(aim), before, after), _ratio(before, after)])
    for bound in problem.constraints:
        values = (given["constraints"][bound.label] for given in (result["initial"], result))
        texts = (problem.machine.display.show(value, bound.term.unit) for value in values)
        rows.append([bound.in_words(problem.machine.display), *texts, ""])
    title = "Objectives and constraints" if problem.constraints else "Objectives" if len(rows) > 1 else "Objective"
    return heading(title) + table(title, ["", "initial", best, "ratio"], rows)


def _design(problem: Problem, result: dict[str, Any]) -> str:
    rows = []
    bounds, slopes = result["at_bounds"], result["sensitivity"]
    first = {variable.name: variable for variable in problem.space.searched}
    for path, value in result["variables"].items():
        variable = first.get(path)
        if variable is None or variable.choices is not None:
            before, after = DASH, f"{value:.6g}"
            before = variable.in_words(variable.initial, problem.machine.display) if variable else before
        else:
            before, after = (variable.in_words(v, problem.machine.display) for v in (variable.initial, value))
        percents = slopes.get(path, {}).get("percent_per_percent", [])
        rows.append([path, before, after, bounds.get(path, ""), ", ".join(_percent(p) for p in percents)])
    note = paragraph(
        "% per %: by how many percent the objective changes if the variable grows by 1 % (an angle by 0.01 rad).",
        "note",
    )
    return heading("Design") + table("Design", ["", "initial", "best", "bound", "% per %"], rows, "design") + note


def _directions(result: dict[str, Any]) -> str:
    rows = [(each["name"].removeprefix("compliance_"), each["gain"]) for each in result["directions"]]
    over = "" if result["poses"]["count"] == 1 else " (worst of all poses)"
    title = f"Stiffness, times that of the initial design{over}"
    return heading(title) + gains("stiffness gain", [row for row in rows if row[1] is not None])


def _robustness(progress: Progress, result: dict[str, Any]) -> str:
    scatter = result["robustness"]
    if scatter is None:
        return ""
    keys, rows = ("nominal", "mean", "percentile_95", "worst"), []
    for aim in progress.problem.objectives:
        spread = scatter["objectives"][aim.term.label]
        rows.append([progress.label(aim), *_exact(progress.scale(aim), *(spread[key] for key in keys))])
    title = f"With tolerances: {scatter['machines']:,} machines"
    return heading(title) + table(title, ["", "nominal", "mean", "reached by 95 %", "worst"], rows)


def _remarks(result: dict[str, Any]) -> list[str]:
    bounded = [f"{name} ({bound})" for name, bound in result["at_bounds"].items()]
    remarks = [f"At a bound: {', '.join(bounded)}. Wider bounds would allow a better design."] if bounded else []
    for each in result["directions"]:
        if each["gain"] is not None and each["gain"] < SACRIFICED:
            name = each["name"].removeprefix("compliance_")
            gain = f"{each['gain']:.2g}"
            remarks.append(f"In the direction {name}, the best design keeps only {gain} of the initial stiffness.")
    return remarks + (result["ridges_text"] if result["front"] is None else [])


def _exact(scale: Scale, *values: float | None) -> list[str]:
    return [number(value and value * scale.factor, digits=EXACT) for value in values]


def _ratio(before: float | None, after: float | None) -> str:
    return DASH if before is None or not after else f"{after / before:.4g}" if before else DASH


def _percent(value: float | None) -> str:
    return DASH if value is None else "0" if abs(value) < NEGLIGIBLE else f"{value:.3g}"

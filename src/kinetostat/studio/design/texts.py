"""Results of the design tab as HTML: the best design next to the initial one, and two to five designs side by side.

The numbers are those of `optimize --json` and of `studies.comparison`; here they are rounded and arranged, with
their ratios.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from typing import Any

from kinetostat.display import DASH, Display, Scale, number
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.studies.comparison import Comparison
from kinetostat.studies.design_numbers import DesignRow
from kinetostat.studies.optimisation.assessment import COMMON_SHARE
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studio.design.progress import SearchState
from kinetostat.studio.question_process import figure_html
from kinetostat.studio.wording import engineering, gains, heading, paragraph, titled_table
from kinetostat.views.comparison import (
    COMPARISON,
    change_kind,
    change_text,
    condition_of,
    differing_fields,
    letters_of,
    softest_texts,
    verdict_text,
)
from kinetostat.views.optimisation import LEAST_STIFFNESS_LEFT, OBJECTIVE_DIGITS, sensitivity_text


def result_text(progress: SearchState) -> str:
    """Return all tables of a search that has ended, or the best design so far of one that has not, as HTML."""
    result = progress.result
    if result is None:
        return _so_far(progress)
    if result["status"] != "ok":
        return paragraph(str(result["message"]), "lead")
    several = result["objective"] is None
    parts = [paragraph(str(result["message"]), "note"), _objectives(progress, result, "knee" if several else "best")]
    parts += [_design(progress.problem, result), _directions(result), _robustness(progress, result)]
    return "".join(parts + [paragraph(line) for line in _remarks(result)])


def _so_far(progress: SearchState) -> str:
    if not progress.objectives:
        return paragraph("No feasible design has been found so far." if progress.steps else "The search is starting.")
    if len(progress.problem.objectives) > 1:
        count = len(progress.objectives)
        return paragraph(f"The Pareto front has {count} designs so far. Click one in the plot to load it.")
    aim, display = progress.problem.objectives[0], progress.problem.machine.display
    rows = [[f"{aim.goal} {plain_name(aim.term.label)}", progress.exact(aim, progress.objectives[0][0])]]
    if progress.genes is not None:
        space = progress.problem.space
        pairs = zip(space.searched_variables, space.values(progress.genes[0]), strict=True)
        rows += [[variable.name, variable.in_words(value, display)] for variable, value in pairs]
    return titled_table("Best so far", ["", "best"], rows)


def _objectives(progress: SearchState, result: dict[str, Any], best: str) -> str:
    """Return the objectives and constraints of the initial design and of the one that is called `best`."""
    problem, rows = progress.problem, []
    for aim in problem.objectives:
        before, after = (design["objectives"][aim.term.label] for design in (result["initial"], result))
        rows.append([progress.label(aim), *_exact(progress.scale(aim), before, after), _ratio(before, after)])
    for bound in problem.constraints:
        values = (design["constraints"][bound.label] for design in (result["initial"], result))
        texts = (problem.machine.display.show(value, bound.term.unit) for value in values)
        rows.append([bound.in_words(problem.machine.display), *texts, ""])
    title = "Objectives and constraints" if problem.constraints else "Objectives" if len(rows) > 1 else "Objective"
    return titled_table(title, ["", "initial", best, "ratio"], rows)


def _design(problem: Problem, result: dict[str, Any]) -> str:
    rows, display = [], problem.machine.display
    bounds, slopes = result["at_bounds"], result["sensitivity"]
    variables = {variable.name: variable for variable in problem.space.searched_variables}
    for path, value in result["variables"].items():
        variable = variables.get(path)
        before = DASH if variable is None else variable.in_words(variable.initial, display)
        after = variable.in_words(value, display) if variable and variable.choices is None else f"{value:.6g}"
        percents = slopes.get(path, {}).get("percent_per_percent", [])
        rows.append([path, before, after, bounds.get(path, ""), ", ".join(map(sensitivity_text, percents))])
    note = paragraph(
        "% per %: by how many percent the objective changes if the variable grows by 1 % (an angle by 0.01 rad).",
        "note",
    )
    return titled_table("Design", ["", "initial", "best", "bound", "% per %"], rows, "design") + note


def _directions(result: dict[str, Any]) -> str:
    rows = [(_direction_name(row), row["gain"]) for row in result["directions"] if row["gain"] is not None]
    over = "" if result["poses"]["count"] == 1 else " (worst of all poses)"
    return heading(f"Stiffness, times that of the initial design{over}") + gains("stiffness gain", rows)


def _direction_name(row: dict[str, Any]) -> str:
    return str(row["name"]).removeprefix("compliance_")


def _robustness(progress: SearchState, result: dict[str, Any]) -> str:
    scatter = result["robustness"]
    if scatter is None:
        return ""
    keys, rows = ("nominal", "mean", "percentile_95", "worst"), []
    for aim in progress.problem.objectives:
        spread = scatter["objectives"][aim.term.label]
        rows.append([progress.label(aim), *_exact(progress.scale(aim), *(spread[key] for key in keys))])
    title = f"With tolerances: {scatter['machines']:,} machines"
    return titled_table(title, ["", "nominal", "mean", f"reached by {100.0 * COMMON_SHARE:g} %", "worst"], rows)


def _remarks(result: dict[str, Any]) -> list[str]:
    bounded = [f"{name} ({bound})" for name, bound in result["at_bounds"].items()]
    remarks = [f"At a bound: {', '.join(bounded)}. Wider bounds would allow a better design."] if bounded else []
    for row in result["directions"]:
        gain, name = row["gain"], _direction_name(row)
        if gain is not None and gain < LEAST_STIFFNESS_LEFT:
            remarks.append(f"In the direction {name}, the best design keeps only {gain:.2g} of the initial stiffness.")
    return remarks + (result["ridges_text"] if result["front"] is None else [])


def _exact(scale: Scale, *values: float | None) -> list[str]:
    scaled = (None if value is None else value * scale.factor for value in values)
    return [number(value, digits=OBJECTIVE_DIGITS) for value in scaled]


def _ratio(before: float | None, after: float | None) -> str:
    return f"{after / before:.4g}" if before and after else DASH


def comparison_text(comparison: Comparison) -> str:
    """Return the whole comparison: gains, values at the pose of each design, differences, contributions."""
    letters = letters_of(comparison)
    parts = [
        _legend(comparison, letters),
        heading("Stiffness, times that of A (logarithmic bars; orange: less stiff)"),
        _gains(comparison, letters),
        _numbers_table("At the pose of each design", comparison, comparison.rows),
    ]
    if comparison.where:
        over = [replace(row, name=f"{row.group} {row.name}") for row in comparison.over]
        parts.append(_numbers_table(f"{comparison.where[0].upper()}{comparison.where[1:]}", comparison, over))
    if comparison.verdicts:
        display = comparison.machine.display
        judged = [[": ".join(condition_of(row)), *(verdict_text(verdict, display) for verdict in row)]
                  for row in comparison.verdicts]  # fmt: skip
        title = "Requirements, with the worst value and its distance from the bound"
        parts.append(titled_table(title, ["", *letters], judged, "words"))
    parts.append(_differences(comparison, letters))
    if any(comparison.softest):
        named = [[letter, *softest_texts(softest)] for letter, softest in zip(letters, comparison.softest, strict=True)]
        title = "Largest contributions in the softest directions"
        parts.append(titled_table(title, ["", "rotation", "translation"], named, "words"))
    return "".join([*parts, *map(figure_html, COMPARISON.drawings(comparison).values())])


def _legend(comparison: Comparison, letters: str) -> str:
    items = []
    for letter, design in zip(letters, comparison.designs, strict=True):
        reason = "" if design.answered else f": {design.analysis.message}"
        items.append(f"<li><b>{letter}</b> {escape(design.label + reason)}</li>")
    return f'<ul class="legend">{"".join(items)}</ul>'


def _gains(comparison: Comparison, letters: str) -> str:
    """Return bars of the compliance of A over that of each other design."""
    compliances = [row for row in comparison.rows if row.group == "compliance"]
    columns = []
    for place, letter in enumerate(letters[1:], 1):
        rows = [(row.name.removeprefix("C_"), _gain(row, place)) for row in compliances]
        bars = gains(f"{letter} against A", [(name, gain) for name, gain in rows if gain is not None])
        columns.append(f"<div><h4>{letter}</h4>{bars}</div>")
    return f'<div class="gains">{"".join(columns)}</div>'


def _gain(row: DesignRow, place: int) -> float | None:
    """Return the value of the first design over that of another one; None where either has none."""
    first, other = row.values[0], row.values[place]
    if first is None or other is None or not other or not math.isfinite(first) or not math.isfinite(other):
        return None
    return first / other


def _numbers_table(title: str, comparison: Comparison, rows: Sequence[DesignRow]) -> str:
    """Return a table with the numbers of each design, the best of each row in bold, and their changes against A."""
    head = "".join(f'<th scope="col">{letter}</th>' for letter in letters_of(comparison))
    body = "".join(_row(row, comparison.machine.display) for row in rows)
    columns = f"<caption>{escape(title)}</caption><thead><tr><th></th>{head}</tr></thead>"
    return f'{heading(title)}<table class="figures">{columns}<tbody>{body}</tbody></table>'


def _row(row: DesignRow, display: Display) -> str:
    cells = []
    for i, (value, percent) in enumerate(zip(row.values, row.percents, strict=True)):
        text = escape(engineering(value, row.unit, display))
        text = f"<b>{text}</b>" if i in row.best else text
        cells.append(f"<td>{text}{_change(row, percent) if i else ''}</td>")  # no change of the first against itself
    return f'<tr><th scope="row">{escape(row.name.replace("_", " "))}</th>{"".join(cells)}</tr>'


def _change(row: DesignRow, percent: float | None) -> str:
    if percent is None:
        return ""
    return f' <span class="change {change_kind(row, percent)}">{change_text(percent)}</span>'


def _differences(comparison: Comparison, letters: str) -> str:
    rows = [[path, *values] for path, values in differing_fields(comparison).items()]
    title = "Where they differ"
    if not rows:
        return heading(title) + paragraph("The designs do not differ.")
    return titled_table(title, ["", *letters], rows)

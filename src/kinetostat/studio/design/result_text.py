"""The answer to a study as HTML: the best design beside the machine as it was. Nothing is computed but rounding."""

import math
from typing import Any

from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studio.design.progress import Progress
from kinetostat.studio.wording import DASH, engineering, gains, heading, paragraph, shown, table

MUCH = 0.01
"""Stiffness that is left, as a share, below which the loss is pointed out."""
FEW = 1e-4
"""Percent per percent below which a 0 is shown."""
EXACT = 9
"""Digits of an objective."""


def result_text(progress: Progress) -> str:
    """All tables of a search that has an answer; what is known so far of one that has none yet."""
    found = progress.result
    if found is None:
        return _so_far(progress)
    if found["status"] != "ok":
        return paragraph(str(found["message"]), "lead")
    several = found["objective"] is None
    parts = [paragraph(str(found["message"]), "note"), _worth(found, "knee" if several else "best")]
    parts += [_design(progress.problem, found), _directions(found), _robustness(found)]
    return "".join(parts + [paragraph(line) for line in _remarks(found)])


def _so_far(progress: Progress) -> str:
    if not progress.objectives:
        return paragraph("No feasible design has been found so far." if progress.steps else "The search is starting.")
    if len(progress.problem.objectives) > 1:
        return paragraph(
            f"{len(progress.objectives)} designs that none beats so far. Click one in the plot to load it."
        )
    aim = progress.problem.objectives[0]
    rows = [[f"{aim.goal} {aim.term.label}", _exact(progress.objectives[0][0], aim.term.unit)]]
    if progress.genes is not None:
        space = progress.problem.space
        held = zip(space.searched, space.values(progress.genes[0]), strict=True)
        rows += [[variable.name, variable.shown(value)] for variable, value in held]
    return heading("Best so far") + table("Best so far", ["", "best"], rows)


def _worth(found: dict[str, Any], best: str) -> str:
    rows = []
    for label, after in found["objectives"].items():
        before = found["initial"]["objectives"][label]
        rows.append([label, _exact(before), _exact(after), _ratio(before, after)])
    for label, after in found["constraints"].items():
        rows.append([label, _exact(found["initial"]["constraints"][label]), _exact(after), ""])
    return heading("Worth") + table("Worth", ["", "initial", best, "ratio"], rows)


def _design(problem: Problem, found: dict[str, Any]) -> str:
    rows = []
    bounds, slopes = found["at_bounds"], found["sensitivity"]
    first = {variable.name: variable for variable in problem.space.searched}
    for path, value in found["variables"].items():
        variable = first.get(path)
        if variable is None or variable.choices is not None:
            before, after = DASH, f"{value:.6g}"
            before = variable.shown(variable.initial) if variable else before
        else:
            before, after = (shown(variable.quantity, v) for v in (variable.initial, value))
        percents = slopes.get(path, {}).get("percent_per_percent", [])
        rows.append([path, before, after, bounds.get(path, ""), ", ".join(_percent(p) for p in percents)])
    note = paragraph("% per %: of the objective per percent of the variable, of an angle per 0.01 rad.", "note")
    return heading("Design") + table("Design", ["", "initial", "best", "bound", "% per %"], rows, "design") + note


def _directions(found: dict[str, Any]) -> str:
    rows = [(one["name"].removeprefix("compliance_"), one["gain"]) for one in found["directions"]]
    over = "" if found["poses"]["count"] == 1 else ", the worst of all poses"
    return heading(f"Times stiffer{over}") + gains("times stiffer", [row for row in rows if row[1] is not None])


def _robustness(found: dict[str, Any]) -> str:
    scatter = found["robustness"]
    if scatter is None:
        return ""
    keys = ("nominal", "mean", "percentile_95", "worst")
    rows = [[label, *(_exact(one[key], digits=6) for key in keys)] for label, one in scatter["objectives"].items()]
    title = f"Under the tolerances, {scatter['machines']:,} machines"
    return heading(title) + table(title, ["", "nominal", "mean", "95 % within", "worst"], rows)


def _remarks(found: dict[str, Any]) -> list[str]:
    bounded = [f"{name} ({bound})" for name, bound in found["at_bounds"].items()]
    said = [f"At its bounds: {', '.join(bounded)}; wider ones would be used."] if bounded else []
    for one in found["directions"]:
        if one["gain"] is not None and one["gain"] < MUCH:
            name = one["name"].removeprefix("compliance_")
            said.append(f"The best design gives up {name}: {one['gain']:.2g} of its stiffness is left.")
    return said + (found["ridges_told"] if found["front"] is None else [])


def _exact(value: float | None, unit: str = "", digits: int = EXACT) -> str:
    if value is None or not math.isfinite(value):
        return engineering(value)
    return f"{value:.{digits}g} {unit if unit not in ('1', 'SI') else ''}".strip()


def _ratio(before: float | None, after: float | None) -> str:
    return DASH if before is None or not after else f"{after / before:.4g}" if before else DASH


def _percent(value: float | None) -> str:
    return DASH if value is None else "0" if abs(value) < FEW else f"{value:.3g}"

"""The answer to a study as plain data, as a table of all designs, and as files. Nothing is computed here."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.arrays import Array
from kinetostat.machine.saving import as_file
from kinetostat.studies.optimisation.assessment import Outcome, Verdict
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.ridges import ridge_sentences
from kinetostat.studies.optimisation.robustness import Robustness
from kinetostat.studies.optimisation.search import ROWS
from kinetostat.studies.storage import list_files, write_dataset, write_json, write_text
from kinetostat.studies.study_folder import HISTORY, QUESTION

INFEASIBLE = "No feasible design was found: {}. Widen the bounds, ease the constraints, or change [poses]."


def message(result: Result) -> str:
    """What became of the search, in a sentence."""
    lacking = ", ".join(f"{count} x {verdict.phrase}" for verdict, count in result.counts.items() if verdict)
    if not result.solved:
        return INFEASIBLE.format(lacking)
    return f"{result.log.count:,} designs judged, {result.counts[Verdict.FEASIBLE]:,} of them feasible" + (
        f" ({lacking})." if lacking else "."
    )


def as_json(result: Result) -> dict[str, Any]:
    """A result as plain data: SI numbers, null where there is no finite one."""
    problem = result.problem
    settings = problem.study.optimizer
    head = {
        "name": problem.study.name,
        "machine": problem.machine.name,
        "status": "ok" if result.solved else "infeasible",
        "message": message(result),
        "method": problem.method,
        "seed": settings.seed,
        "evaluations": result.log.count,
        "infeasible": {verdict.name.lower(): count for verdict, count in result.counts.items() if verdict},
        "poses": {"count": problem.poses.count, "about": problem.poses.description},
    }
    initial = {
        "variables": {variable.name: variable.initial for variable in problem.space.searched},
        **_worth(problem, result.initial, 0),
    }
    if not result.solved:
        return _plain({**head, "objective": None, "variables": {}, "initial": initial})
    best = _worth(problem, result.outcome, 0)
    return _plain(
        {
            **head,
            "objective": float(result.outcome.objectives[0, 0]) if len(problem.objectives) == 1 else None,
            "variables": variables_of(problem, result.genes),
            **best,
            "initial": initial,
            "directions": [
                {"name": item.name, "units": item.unit, "initial": item.before, "best": item.after, "gain": item.gain}
                for item in result.directions
            ],
            "at_bounds": {item.name: item.bound for item in result.influences if item.bound},
            "sensitivity": {
                item.name: {"derivatives": list(item.slopes), "percent_per_percent": list(item.percents)}
                for item in result.influences
            },
            "ridges": [
                {"variables": list(r.names), "from": list(r.start), "to": list(r.end), "relative_change": r.change}
                for r in result.ridges
            ],
            "ridges_text": ridge_sentences(result.ridges, problem) or [result.no_ridges],
            "robustness": _scatter(result.robustness) if result.robustness else None,
            "convergence": {
                key: [step.get(key) for step in result.log.steps] for key in ("designs", "feasible", "best", "mean")
            },
            "front": front_rows(result) if len(problem.objectives) > 1 else None,
        }
    )


def variables_of(problem: Problem, genes: Array) -> dict[str, float]:
    """The value of every field that the searched variables set, by its path, SI."""
    columns = problem.space.columns(genes[None])
    return {
        field.path: float(columns[field.leaves[0]][0])
        for variable in problem.space.searched
        for field in variable.fields
    }


def front_rows(result: Result) -> list[dict[str, Any]]:
    """The designs of a front, each with its variables, objectives and constraints."""
    outcome = result.log.outcome(result.front)
    return [
        {
            "knee": k == result.knee,
            "variables": variables_of(result.problem, genes),
            **_worth(result.problem, outcome, k),
        }
        for k, genes in enumerate(result.log.genes(result.front))
    ]


def _worth(problem: Problem, outcome: Outcome, k: int) -> dict[str, Any]:
    return {
        "objectives": {
            item.term.label: float(value) for item, value in zip(problem.objectives, outcome.objectives[k], strict=True)
        },
        "constraints": {
            item.label: float(value) for item, value in zip(problem.constraints, outcome.constraints[k], strict=True)
        },
        "verdict": Verdict(int(outcome.verdict[k])).name.lower(),
    }


def _scatter(robustness: Robustness) -> dict[str, Any]:
    return {
        "machines": robustness.machines,
        "corners": robustness.corners,
        "failing": robustness.failing,
        "objectives": {
            item.label: {
                "nominal": item.nominal,
                "mean": item.mean,
                "standard_deviation": item.deviation,
                "percentile_95": item.usual,
                "worst": item.worst,
            }
            for item in robustness.scatters
        },
    }


def _plain(value: Any) -> Any:
    """The same with null for what is not finite."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_dataset(result: Result) -> xr.Dataset:
    """Every design that was judged: its step, variables (SI, or the number of a choice), worth and verdict."""
    problem, log = result.problem, result.log
    outcome = log.outcome()
    steps = np.repeat(np.arange(len(log.steps)), [step["designs"] for step in log.steps])
    content: dict[str, Any] = {"step": ("design", steps, {"long_name": "step of the search"})}
    for variable, column in zip(problem.space.searched, problem.space.values(log.genes()).T, strict=True):
        about = {"units": variable.unit, "long_name": variable.quantity.meaning}
        if variable.choices is not None:
            about["choices"] = "; ".join(variable.labels)
        content[variable.name] = ("design", column, about)
    for kind, terms, values in (
        ("objective", [(o.term.label, o.term.unit) for o in problem.objectives], outcome.objectives),
        ("constraint", [(c.label, c.term.unit) for c in problem.constraints], outcome.constraints),
    ):
        for k, (label, unit) in enumerate(terms):
            content[f"{kind}_{k}"] = ("design", values[:, k], {"units": unit, "long_name": label})
    flags = {"flag_values": [int(v) for v in Verdict], "flag_meanings": " ".join(v.name.lower() for v in Verdict)}
    content["verdict"] = ("design", outcome.verdict, flags)
    content["violation"] = ("design", outcome.violation, {"units": "1", "long_name": "0 where feasible"})
    attributes = {"study": problem.study.name, "machine": problem.machine.name, "method": problem.method}
    return xr.Dataset(content, attrs=attributes)


def write_result(result: Result, folder: Path) -> list[Path]:
    """Write the result, the table of all designs and the best design as a machine file; returns the paths."""
    written = [folder / "result.json", folder / "designs.nc"]
    write_json(written[0], as_json(result))
    write_dataset(written[1], as_dataset(result))
    if result.solved:
        written.append(folder / "best.toml")
        write_text(written[-1], as_file(result.machine))
    list_files(folder, [*written, *(folder / name for name in (QUESTION, HISTORY, ROWS))])
    return written

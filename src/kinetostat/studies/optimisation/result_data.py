"""The answer to a study as plain data, as a table of all designs, and as files. Nothing is computed here."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.engine.points import Array
from kinetostat.machine.loading import as_toml
from kinetostat.studies.optimisation.assessment import Outcome, Verdict
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.ridges import told
from kinetostat.studies.optimisation.robustness import Robustness
from kinetostat.studies.storage import write_dataset, write_json, write_text

INFEASIBLE = "No feasible design was found: {}. Widen the bounds, ease the constraints, or change [poses]."


def message(found: Result) -> str:
    """What became of the search, in a sentence."""
    lacking = ", ".join(f"{count} x {verdict.phrase}" for verdict, count in found.counts.items() if verdict)
    if not found.solved:
        return INFEASIBLE.format(lacking)
    return f"{found.log.count:,} designs judged, {found.counts[Verdict.FEASIBLE]:,} of them feasible" + (
        f" ({lacking})." if lacking else "."
    )


def as_json(found: Result) -> dict[str, Any]:
    """A result as plain data: SI numbers, null where there is no finite one."""
    problem = found.problem
    settings = problem.study.optimizer
    head = {
        "name": problem.study.name,
        "machine": problem.machine.name,
        "status": "ok" if found.solved else "infeasible",
        "message": message(found),
        "method": problem.method,
        "seed": settings.seed,
        "evaluations": found.log.count,
        "infeasible": {verdict.name.lower(): count for verdict, count in found.counts.items() if verdict},
        "poses": {"count": problem.poses.count, "about": problem.poses.told},
    }
    initial = {
        "variables": {variable.name: variable.initial for variable in problem.space.searched},
        **_worth(problem, found.initial, 0),
    }
    if not found.solved:
        return _plain({**head, "objective": None, "variables": {}, "initial": initial})
    best = _worth(problem, found.outcome, 0)
    return _plain(
        {
            **head,
            "objective": float(found.outcome.objectives[0, 0]) if len(problem.objectives) == 1 else None,
            "variables": variables_of(problem, found.genes),
            **best,
            "initial": initial,
            "directions": [
                {"name": one.name, "units": one.unit, "initial": one.before, "best": one.after, "gain": one.gain}
                for one in found.directions
            ],
            "at_bounds": {one.name: one.bound for one in found.influences if one.bound},
            "sensitivity": {
                one.name: {"derivatives": list(one.slopes), "percent_per_percent": list(one.percents)}
                for one in found.influences
            },
            "ridges": [
                {"variables": list(r.names), "from": list(r.start), "to": list(r.end), "relative_change": r.change}
                for r in found.ridges
            ],
            "ridges_told": told(found.ridges, problem) or [found.no_ridges],
            "robustness": _scatter(found.robustness) if found.robustness else None,
            "convergence": {
                key: [step.get(key) for step in found.log.steps] for key in ("designs", "feasible", "best", "mean")
            },
            "front": front_rows(found) if len(problem.objectives) > 1 else None,
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


def front_rows(found: Result) -> list[dict[str, Any]]:
    """The designs of a front, each with its variables, objectives and constraints."""
    outcome = found.log.outcome(found.front)
    return [
        {
            "knee": k == found.knee,
            "variables": variables_of(found.problem, genes),
            **_worth(found.problem, outcome, k),
        }
        for k, genes in enumerate(found.log.genes(found.front))
    ]


def _worth(problem: Problem, outcome: Outcome, k: int) -> dict[str, Any]:
    return {
        "objectives": {
            one.term.label: float(value) for one, value in zip(problem.objectives, outcome.objectives[k], strict=True)
        },
        "constraints": {
            one.label: float(value) for one, value in zip(problem.constraints, outcome.constraints[k], strict=True)
        },
        "verdict": Verdict(int(outcome.verdict[k])).name.lower(),
    }


def _scatter(robustness: Robustness) -> dict[str, Any]:
    return {
        "machines": robustness.machines,
        "corners": robustness.corners,
        "failing": robustness.failing,
        "objectives": {
            one.label: {
                "nominal": one.nominal,
                "mean": one.mean,
                "standard_deviation": one.deviation,
                "percentile_95": one.usual,
                "worst": one.worst,
            }
            for one in robustness.scatters
        },
    }


def _plain(value: Any) -> Any:
    """The same with null for what is not finite."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_dataset(found: Result) -> xr.Dataset:
    """Every design that was judged: its step, variables (SI, or the number of a choice), worth and verdict."""
    problem, log = found.problem, found.log
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


def write_result(found: Result, folder: Path) -> list[Path]:
    """Write the result, the table of all designs and the best design as a machine file; returns the paths."""
    written = [folder / "result.json", folder / "designs.nc"]
    write_json(written[0], as_json(found))
    write_dataset(written[1], as_dataset(found))
    if found.solved:
        written.append(folder / "best.toml")
        write_text(written[-1], as_toml(found.machine))
    return written

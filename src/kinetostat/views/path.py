"""Quantities at the poses of a file: the question, and the description of its answer. Nothing is computed here."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.display import DASH, number
from kinetostat.engine.batch import Progress
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import data_name
from kinetostat.studies.evaluation import PoseAnswers, answers_at
from kinetostat.studies.poses import read_poses
from kinetostat.studies.quantities import usual_quantities
from kinetostat.views.data_forms import csv_text
from kinetostat.views.question import (
    DISPLACED,
    LOADS_LEFT_OUT,
    NAME,
    Description,
    Field,
    Lines,
    Option,
    Question,
    quantities_option,
)
from kinetostat.views.tables import FittedTable, numeric_table

USUAL_QUANTITY = "free_stiffness"


def _lines(answer: PoseAnswers) -> Lines:
    count, failures = answer.poses.count, answer.failures
    inside = count - sum(len(numbers) for numbers in failures.values())
    yield "Poses", f"{inside:,} of {count:,} poses have a result."
    for status, numbers in failures.items():
        first, several = numbers[0] + 1, len(numbers) > 1
        which = f"{len(numbers):,} poses, the first is {first}" if several else f"pose {first}"
        yield "No result", f"{status.word.replace('_', ' ')}: {which}. {status.sentence}"
    if failures and answer.poses.unit_doubt:
        yield "Units", answer.poses.unit_doubt


def _tables(answer: PoseAnswers, _full: bool) -> Iterator[FittedTable]:
    """Give the extremes of each quantity, with the numbers of their poses, from 1."""
    if not answer.answered:
        return
    heads = ["unit", "least", "at", "largest", "at"]
    table = numeric_table("Extremes and the numbers of their poses", "quantity", heads)
    display = answer.machine.display
    for name, values in answer.values.items():
        if np.isnan(values).all():  # of turns, where the machine has none
            table.add_row(name, display.scale(QUANTITIES[name].unit).head, DASH, DASH, DASH, DASH)
            continue
        low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
        scale = display.fitting(QUANTITIES[name].unit, (values[low], values[high]))
        least, largest = (number(float(values[k]) * scale.factor, digits=display.digits) for k in (low, high))
        table.add_row(name, scale.head, least, str(low + 1), largest, str(high + 1))
    yield table


def _poses(answer: PoseAnswers) -> dict[str, Any]:
    pairs = zip(answer.poses.fields, answer.poses.values, strict=True)
    return {field.path: {"units": field.unit, "values": values} for field, values in pairs}


def _variables(answer: PoseAnswers) -> dict[str, Any]:
    return {name: {"units": QUANTITIES[name].unit, "values": answer.values[name]} for name in answer.names}


def at_poses_of(machine: Machine, poses: Path, progress: Progress, quantities: Sequence[str] = ()) -> PoseAnswers:
    """Evaluate quantities at the poses of a file, see `evaluate`.

    Raises:
        InputError: the file cannot be read, or names an unknown field or quantity.
    """
    wanted = quantities or usual_quantities(machine, USUAL_QUANTITY)
    return answers_at(machine, read_poses(machine, poses), wanted, progress)


def _csv(answer: PoseAnswers) -> str:
    """Write answers as CSV in SI, which `kinetostat path` can read again.

    A row has the number of the pose (from 1), its fields, its status in a word, and its quantities. A quantity is
    empty where the status is not ok; infinity, of a rigid or a free direction, is "inf".
    """
    columns: dict[str, Sequence[Any]] = {"pose": range(1, answer.poses.count + 1)}
    for field, values in zip(answer.poses.fields, answer.poses.values, strict=True):
        columns[_head(data_name(field.path), field.unit)] = values.tolist()
    columns["status"] = [Status(code).word for code in answer.status.tolist()]
    for name, values in answer.values.items():
        columns[_head(name, QUANTITIES[name].unit)] = ["" if math.isnan(value) else value for value in values.tolist()]
    return csv_text(columns, zip(*columns.values(), strict=True))


def _head(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit not in ("", "1") else name


PATH = Description(
    title="Along the poses",
    fields=(
        NAME,
        LOADS_LEFT_OUT,
        Field("poses", _poses),
        Field("variables", _variables),
        Field("matrices", lambda answer: {name: answer.matrix(name) for name in answer.matrices}),
        Field("components", "machine.family.component_names"),
        Field("status", lambda answer: [Status(code).word for code in answer.status.tolist()]),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.grid_figures.path_figures",
    makers={"csv": _csv, "nc": "studies.datasets.as_dataset"},
    state=lambda _answer: "",
    answered=lambda answer: answer.answered,
)
PATH_QUESTION = Question(
    example="kinetostat path hexapod poses.csv -o stiffness.csv -o stiffness.png",
    answer=at_poses_of,
    options=(
        Option(
            "poses",
            "file",
            "a CSV file: a line of fields with their units, such as x [mm], z [mm], and below it a line for each pose",
            metavar="POSES",
            first=True,
            required=True,
        ),
        quantities_option(USUAL_QUANTITY),
    ),
    loaded=DISPLACED,
    output="write a table (.csv, .json, .nc) or a picture along the path (.png, .svg, .pdf); repeatable",
    suffixes=(".csv", ".json", ".nc", ".png", ".svg", ".pdf"),
    reports_progress=True,
)

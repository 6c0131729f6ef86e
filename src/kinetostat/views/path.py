"""Quantities at the poses of a file: the question, the description of its answer, and its figure.

Nothing is computed here.
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetostat.arrays import Array, Integers
from kinetostat.display import DASH, number
from kinetostat.engine.batch import Progress
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, plain_name
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine, setting_of
from kinetostat.machine.parameters import data_name, named_entry
from kinetostat.studies.evaluation import PoseAnswers, answers_at
from kinetostat.studies.poses import read_poses
from kinetostat.studies.quantities import usual_quantities
from kinetostat.views.data_forms import column_head, csv_text, status_words
from kinetostat.views.question import (
    DISPLACED,
    LOADS_LEFT_OUT,
    NAME,
    Description,
    Drawing,
    Field,
    Lines,
    Option,
    Question,
    quantities_option,
)
from kinetostat.views.tables import FittedTable, numeric_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.views import figures
else:
    figures = LateModule("kinetostat.views.figures")

USUAL_QUANTITY = "free_stiffness"
"""Quantity that is computed where nobody names one: what a tool feels."""
ROOM_FOR_TITLE = 0.7
"""Height of title and notes of the figure, inches."""
QUANTITY_HEIGHT, COORDINATE_HEIGHT = 1.9, 1.25
"""Height of a panel of quantities, and of one of coordinates, which only say where the machine is; inches."""
STRIP_COLOUR = "#dddddd"
"""Grey of strips behind poses that have no result: darker than on maps, because strips are narrow."""
MOST_DOTS = 60
"""Number of poses up to which each is marked with a dot: more would run into a line."""
Curves = dict[str, Array]
"""Values at each pose, in the unit of the axis, by the name in the legend."""


def _lines(answer: PoseAnswers) -> Lines:
    count, failures = answer.poses.count, answer.failures
    answered = count - sum(len(numbers) for numbers in failures.values())
    yield "Poses", f"{answered:,} of {count:,} poses have a result."
    for status, numbers in failures.items():
        first = numbers[0] + 1
        poses = f"{len(numbers):,} poses, the first is {first}" if len(numbers) > 1 else f"pose {first}"
        yield "No result", f"{status.phrase}: {poses}. {status.sentence}"
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
        if np.isnan(values).all():  # such as a rotation that a planar machine does not have
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


def evaluate_file(machine: Machine, poses: Path, progress: Progress, quantities: Sequence[str] = ()) -> PoseAnswers:
    """Evaluate quantities at every pose of a CSV file; without names, `USUAL_QUANTITY`.

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
        columns[column_head(data_name(field.path), field.unit)] = values.tolist()
    columns["status"] = status_words(answer.status)
    for name, values in answer.values.items():
        columns[column_head(name, QUANTITIES[name].unit)] = [
            "" if math.isnan(value) else value for value in values.tolist()
        ]
    return csv_text(columns, zip(*columns.values(), strict=True))


def path_figures(answer: PoseAnswers) -> dict[str, Drawing]:
    """Return the one figure of quantities along a path."""
    return {"path": Drawing("Quantities along the poses.", partial(path_figure, answer))}


def path_figure(answer: PoseAnswers, title: str = "{}") -> "Figure":
    """Draw quantities along a path, a panel for each unit, and the coordinates that vary below; grey without a result.

    The poses are taken as neighbours in the order in which they are given.
    """
    quantities, coordinates = _quantity_panels(answer), _coordinate_panels(answer)
    heights = [QUANTITY_HEIGHT] * len(quantities) + [COORDINATE_HEIGHT] * len(coordinates)
    size = (figures.PAGE_WIDTH, ROOM_FOR_TITLE + sum(heights))
    with figures.new_figure(size, title.format(answer.machine.name), *_notes(answer)) as figure:
        panels = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for panel, (label, curves) in zip(panels, quantities + coordinates, strict=True):
            _draw_panel(panel, answer, curves, label)
        panels[-1].set_xlabel("pose")
    return figure


def _quantity_panels(answer: PoseAnswers) -> list[tuple[str, Curves]]:
    """Return label and curves of a panel for each unit of the quantities."""
    members: dict[str, list[str]] = {}
    for name in answer.values:
        members.setdefault(QUANTITIES[name].unit, []).append(name)
    panels = []
    for unit, names in members.items():
        scale = answer.machine.display.fitting(unit, (v for name in names for v in answer.values[name]))
        label = scale.label(plain_name(group_of(names) or names[0]))
        panels.append((label, {QUANTITIES[name].symbol: answer.values[name] * scale.factor for name in names}))
    return panels


def _coordinate_panels(answer: PoseAnswers) -> list[tuple[str, Curves]]:
    """Return label and curves of a panel for each kind of field that varies along the path."""
    panels: dict[str, Curves] = {}
    for field, values in zip(answer.poses.fields, answer.poses.values, strict=True):
        if np.ptp(values) > 0.0:
            scale = answer.machine.display.scale(field.unit)
            curves = panels.setdefault(scale.label(field.quantity.kind), {})
            curves[named_entry(field.shown)] = values * scale.factor
    return list(panels.items())


def _draw_panel(panel: "Axes", answer: PoseAnswers, curves: Curves, label: str) -> None:
    numbers = np.arange(1, answer.poses.count + 1)
    _shade(panel, np.flatnonzero(answer.status != Status.OK) + 1)
    marker = "." if len(numbers) <= MOST_DOTS else ""
    for place, (name, values) in enumerate(curves.items()):
        finite = np.where(np.isfinite(values), values, np.nan)
        panel.plot(numbers, finite, marker=marker, label=name, **figures.look_of(place))
    panel.set_ylabel(label)
    panel.margins(x=0.0)
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _shade(panel: "Axes", numbers: Integers) -> None:
    """Shade the poses of these numbers; neighbours share one strip."""
    for run in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1):
        if len(run):
            panel.axvspan(run[0] - 0.5, run[-1] + 0.5, color=STRIP_COLOUR, linewidth=0.0)


def _notes(answer: PoseAnswers) -> tuple[str, str, str]:
    """Return the notes: numbers that differ from the file, loads left out, and poses without a result."""
    counts = {status: len(numbers) for status, numbers in answer.failures.items()}
    missing = figures.missing_line(counts, answer.poses.count, " (grey)")
    return setting_of(answer.machine, list(answer.poses.leaves)), answer.loads_left_out, missing


PATH = Description(
    title="Along the poses",
    fields=(
        NAME,
        LOADS_LEFT_OUT,
        Field("poses", _poses),
        Field("variables", _variables),
        Field("matrices", lambda answer: {name: answer.matrix(name) for name in answer.matrices}),
        Field("components", "machine.family.component_names"),
        Field("status", lambda answer: status_words(answer.status)),
    ),
    lines=_lines,
    tables=_tables,
    figures=path_figures,
    makers={"csv": _csv, "nc": "studies.datasets.as_dataset"},
    state=lambda _answer: "",
    answered=lambda answer: answer.answered,
)
PATH_QUESTION = Question(
    example="kinetostat path hexapod poses.csv -o stiffness.csv -o stiffness.png",
    answer=evaluate_file,
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

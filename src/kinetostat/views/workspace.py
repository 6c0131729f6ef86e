"""The workspace of a machine: the question, and the description of its answer. Nothing is computed here."""

import math
from collections.abc import Iterator
from operator import attrgetter
from typing import Any

from kinetostat.machine.limits import Limits, no_limits_sentence
from kinetostat.machine.parameters import dimension, shown
from kinetostat.studies.datasets import field_of
from kinetostat.studies.workspace import FEWEST_CELLS, METHOD, Workspace, workspace
from kinetostat.studies.workspace_verdicts import INSIDE, phrase
from kinetostat.views.question import LOADS_LEFT_OUT, NAME, Description, Field, Lines, Option, Question, ranges_option
from kinetostat.views.tables import FittedTable, numeric_table

SHOWN_ERRORS = 2
"""Standard errors that are printed: the truth lies within them 95 times of 100."""


def _lines(answer: Workspace) -> Lines:
    yield from _volume_lines(answer)
    yield from _border_lines(answer)


def _volume_lines(answer: Workspace) -> Lines:
    """Give the sentences on the size of the workspace, and on what is not known of it."""
    volume = answer.volume
    name = "Area" if len(answer.dataset["verdict"].dims) == 2 else "Volume"
    if volume.cells < FEWEST_CELLS:
        cells = "1 cell" if volume.cells == 1 else f"{volume.cells:,} cells"
        yield (
            name,
            f"About {volume.value:.2g} {volume.unit} ({100.0 * volume.share:.3g} % of the box). The grid is too coarse "
            f"to say how far that may be wrong: it has {cells}; give the axes more points, for {FEWEST_CELLS} cells or "
            "more.",
        )
    else:
        yield (
            name,
            f"{volume.value:.5g} ± {SHOWN_ERRORS * volume.standard_error:.2g} {volume.unit} "
            f"({100.0 * volume.share:.4g} % of the box; two random points in each of {volume.cells:,} cells, ± two "
            "standard errors).",
        )
    if volume.unknown_cells:
        yield (
            "Unknown",
            f"It may be larger by up to {volume.unknown:.2g} {volume.unit}: in {volume.unknown_cells:,} of the cells a "
            "point did not converge or is undecided. Whether it belongs to the workspace is not known; it counts as "
            "outside.",
        )


def _border_lines(answer: Workspace) -> Lines:
    """Give the sentences on the borders of the workspace, and on the part of it that can be reached."""
    if "assembly_mode" in answer.dataset.attrs:
        yield (
            "Mode",
            "The machine keeps to the assembly mode of its home pose, the one in which its legs are written down.",
        )
    if not answer.limits:
        yield "Limits", no_limits_sentence(Limits())
    if not answer.exists:
        yield "Inside", "No pose of the box is in the workspace; the table shows why."
    elif answer.connected is None:
        yield (
            "Connected",
            "The pose of the file is outside the workspace, so it is unknown which part can be reached from it.",
        )
    elif answer.connected < 1.0:
        share = f"{100.0 * answer.connected:.3g} %"
        yield "Connected", f"Only {share} of the workspace is connected with the pose of the file."
    if not answer.singularities_divide:
        yield (
            "Singular",
            "Singularities are not borders here: they do not divide the poses of this machine, or the pose of the file "
            "is singular.",
        )


def _tables(answer: Workspace, _full: bool) -> Iterator[FittedTable]:
    total, display = answer.dataset["verdict"].size, answer.machine.display
    table = numeric_table(f"Nodes of the grid ({total:,})", "", ["nodes", "share"])
    for label, count in sorted(answer.nodes.items(), key=lambda item: (item[0] != INSIDE, -item[1])):
        if count:
            table.add_row(phrase(label), f"{count:,}", f"{100.0 * count / total:.3g} %")
    yield table
    if answer.extents:
        table = numeric_table("Extent of the workspace", "", ["from", "to", ""])
        for field, ends in answer.extents.items():
            unit = answer.dataset[dimension(field)].attrs["units"]
            low, high = (display.number(end, unit) for end in ends)
            table.add_row(shown(field), low, high, display.scale(unit).unit)
        yield table
    if answer.demands:
        table = numeric_table("Demands on the machine within the workspace", "", ["from", "to", ""])
        for demand in answer.demands:
            cells = (display.number(value, demand.unit) for value in (demand.least, demand.greatest))
            table.add_row(demand.title, *cells, display.scale(demand.unit).unit)
        yield table


def _coordinates(answer: Workspace) -> dict[str, Any]:
    dataset = answer.dataset
    return {
        field_of(dataset[dim]): {
            "units": dataset[dim].attrs["units"],
            "from": dataset[dim].values[0],
            "to": dataset[dim].values[-1],
            "count": dataset.sizes[dim],
            "inside": answer.extents.get(field_of(dataset[dim])),
        }
        for dim in dataset["verdict"].dims
    }


def _volume(answer: Workspace) -> dict[str, Any]:
    volume = answer.volume
    return {
        "value": volume.value,
        "standard_error": None if math.isnan(volume.standard_error) else volume.standard_error,
        "unknown": volume.unknown,
        "units": volume.unit,
        "share_of_box": volume.share,
        "cells": volume.cells,
        "method": METHOD,
    }


WORKSPACE = Description(
    title="Workspace",
    fields=(
        NAME,
        Field("coordinates", _coordinates),
        Field("volume", _volume),
        Field("assembly_mode", lambda answer: answer.dataset.attrs.get("assembly_mode")),
        Field("limits", lambda answer: list(answer.limits)),
        LOADS_LEFT_OUT,
        Field("nodes"),
        Field("connected"),
        Field("singularities_divide"),
        Field("demands"),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.workspace_figures.workspace_figures",
    makers={"nc": attrgetter("dataset")},
    state=lambda _answer: "",
    answered=lambda answer: answer.exists,
    files={"workspace.nc": "nc"},
)
WORKSPACE_QUESTION = Question(
    example='kinetostat workspace hexapod --set "limits.longest_leg=20 cm" --over "x=-8 cm:8 cm:41" '
    '--over "y=-8 cm:8 cm:41" --over "z=10 cm:25 cm:41" --where "free_stiffness_z > 20 N/um" -o out',
    answer=workspace,
    options=(
        ranges_option("a coordinate of the pose and its range; give two to six", required=True),
        Option(
            "conditions",
            "text",
            'a condition that a pose must meet, e.g. "free_stiffness_z > 20 N/um"; repeatable, all must be met',
            metavar="CONDITION",
            many=True,
            word="--where",
        ),
        Option("seed", "count", "seed of the random points for the volume (default: 0)", metavar="SEED", default=0),
    ),
    loaded="only poses at which the machine comes to rest under its loads",
    output="NetCDF and pictures",
    reports_progress=True,
)

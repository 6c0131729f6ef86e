"""Tables, figures, data and files of each kind of result: one row a kind. Nothing is drawn here.

`plot`, `save` and notebooks look up here what they can show.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure
from rich.console import Console

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.machine.saving import as_file
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice
from kinetostat.studies import analysis, assembly, carrying, command, sensitivity, under_load, vibration
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.assembly import Forward
from kinetostat.studies.budget import data as budget_data
from kinetostat.studies.budget.budget import Budget
from kinetostat.studies.carrying import Carrying
from kinetostat.studies.command import Command
from kinetostat.studies.comparison import designs
from kinetostat.studies.comparison.designs import Comparison
from kinetostat.studies.correction import table
from kinetostat.studies.correction.table import CorrectionTable
from kinetostat.studies.grid import grid
from kinetostat.studies.guidelines import sentences
from kinetostat.studies.guidelines.guidelines import Guidelines
from kinetostat.studies.identification import identification
from kinetostat.studies.identification.identification import Identification
from kinetostat.studies.measured import comparison as measured
from kinetostat.studies.measured.comparison import MeasuredComparison
from kinetostat.studies.optimisation import result_data
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.sensitivity import Sensitivity
from kinetostat.studies.storage import write_bytes, write_dataset, write_json, write_text
from kinetostat.studies.under_load import LoadedState
from kinetostat.studies.vibration import Vibration
from kinetostat.studies.workspace import workspace
from kinetostat.studies.workspace.workspace import Workspace
from kinetostat.tolerances import AGREED
from kinetostat.validation import comparison as validation
from kinetostat.validation.comparison import Validation
from kinetostat.views import optimisation_figures, workspace_figures
from kinetostat.views.analysis_tables import print_analysis
from kinetostat.views.assembly_tables import print_forward
from kinetostat.views.budget_figures import budget_figures
from kinetostat.views.budget_tables import print_budget
from kinetostat.views.carrying_views import carrying_map, print_carrying
from kinetostat.views.comparison_figure import comparison_figure
from kinetostat.views.comparison_tables import print_comparison, print_validation
from kinetostat.views.correction_tables import print_corrections
from kinetostat.views.drawing import three_views
from kinetostat.views.figures import FORMATS, Drawings, contour_maps, curves, save_figure
from kinetostat.views.grid_tables import print_dataset, print_workspace
from kinetostat.views.identification_figures import identification_figures
from kinetostat.views.identification_tables import print_identification
from kinetostat.views.influence_figures import guideline_figures, sensitivity_figure
from kinetostat.views.influence_tables import print_guidelines, print_sensitivity
from kinetostat.views.loaded_figures import load_figure, shape_figure
from kinetostat.views.loaded_tables import print_command, print_loaded
from kinetostat.views.measured_figure import measured_figure
from kinetostat.views.measured_tables import print_measured
from kinetostat.views.optimisation_tables import print_result
from kinetostat.views.picture import Picture, machine_picture
from kinetostat.views.scene.glb import glb
from kinetostat.views.scene.machine_scene import scene_of
from kinetostat.views.tables import print_machine
from kinetostat.views.vibration_figures import vibration_figures
from kinetostat.views.vibration_tables import print_vibration


@dataclass(frozen=True)
class Kind:
    """How results of one kind are shown.

    Attributes:
        type: class of the results.
        tell: prints a result of this kind on a console.
        figures: gives the functions that draw them, by name; the most telling one first.
        data: gives a result as plain data; None where it is kept in another way.
    """

    type: type
    tell: Callable[[Console, Any], None]
    figures: Callable[[Any], Drawings] = lambda _: {}
    data: Callable[[Any], dict[str, Any]] | None = None


def _views(machine: Machine) -> Drawings:
    return {"views": partial(three_views, machine, machine.name)}


def _names(dataset: xr.Dataset) -> list[str]:
    return [str(name) for name in dataset.data_vars if name in QUANTITIES]


def _grid_figures(dataset: xr.Dataset) -> Drawings:
    """Return curves over one field, or contours over two; a grid of more fields has no picture."""
    draw = {1: curves, 2: contour_maps}.get(dataset["status"].ndim)
    return {"map": partial(draw, dataset, _names(dataset), dataset.attrs["machine"])} if draw else {}


def _workspace_figures(workspace: Workspace) -> Drawings:
    drawn = workspace_figures.pictures(
        workspace.dataset, workspace.verdicts, workspace.conditions, workspace.dataset.attrs["machine"]
    )
    return {name.removeprefix("-") or "region": figure for name, figure in drawn.items()}


def _sensitivity_figures(sensitivity: Sensitivity) -> Drawings:
    return {"influences": partial(sensitivity_figure, sensitivity)} if sensitivity.parameters else {}


def _loaded_figures(state: LoadedState) -> Drawings:
    """Return the curve over the growing load, and the shape; a machine without rest has neither."""
    drawn: Drawings = {"growing load": partial(load_figure, state), "shape": partial(shape_figure, state)}
    return drawn if state.displacement else {}


KINDS = (
    Kind(Machine, print_machine, _views),
    Kind(Analysis, print_analysis, data=analysis.as_json),
    Kind(Forward, print_forward, data=assembly.as_json),
    Kind(LoadedState, print_loaded, _loaded_figures, under_load.as_json),
    Kind(Vibration, print_vibration, vibration_figures, vibration.as_json),
    Kind(Command, print_command, data=command.as_json),
    Kind(CorrectionTable, print_corrections, data=table.as_json),
    Kind(
        Carrying,
        print_carrying,
        lambda answer: {"map": partial(carrying_map, answer)} if answer.is_map else {},
        carrying.as_json,
    ),
    Kind(
        xr.Dataset,
        lambda console, dataset: print_dataset(console, dataset, _names(dataset)),
        _grid_figures,
        grid.as_json,
    ),
    Kind(Workspace, print_workspace, _workspace_figures, workspace.as_json),
    Kind(Sensitivity, print_sensitivity, _sensitivity_figures, sensitivity.as_json),
    Kind(Identification, print_identification, identification_figures, identification.as_json),
    Kind(Guidelines, print_guidelines, guideline_figures, sentences.as_json),
    Kind(Budget, print_budget, budget_figures, budget_data.as_json),
    Kind(
        Comparison,
        print_comparison,
        lambda comparison: {"comparison": partial(comparison_figure, comparison)},
        designs.as_json,
    ),
    Kind(
        MeasuredComparison,
        print_measured,
        lambda answer: {"measured": partial(measured_figure, answer)},
        measured.as_json,
    ),
    Kind(Result, print_result, optimisation_figures.pictures, result_data.as_json),
    Kind(
        Validation,
        lambda console, result: print_validation(console, result, AGREED),
        data=validation.as_json,
    ),
)
"""All kinds of results that Python and notebooks show."""


def kind_of(answer: object) -> Kind:
    """Look up how a result is shown.

    Raises:
        InputError: it is not a result of kinetostat.
    """
    kind_of_answer = next((kind for kind in KINDS if isinstance(answer, kind.type)), None)
    if kind_of_answer is None or (isinstance(answer, xr.Dataset) and "status" not in answer):
        known = ", ".join(kind.type.__name__ for kind in KINDS)
        raise InputError(
            f"An object of type {type(answer).__name__} is not a result of kinetostat; give one of: {known}."
        )
    return kind_of_answer


@checked
def plot(answer: object, which: str | None = None) -> Figure:
    """Draw a figure of a result; a notebook displays it, `save` writes it.

    Args:
        answer: a machine (front, side and plan, to scale), a grid over one or two fields, a workspace, sensitivities,
            guidelines, a comparison or an optimisation's result.
        which: name of one of its figures; the most telling one if None.

    Raises:
        InputError: there is no such figure; the message names the available ones.
    """
    figures = kind_of(answer).figures(answer)
    if not figures:
        raise InputError(
            f"There is no figure for a result of type {type(answer).__name__}; use its tables and its data instead."
        )
    return figures[next(iter(figures)) if which is None else choice(which, figures, "which")]()


Writer = Callable[[Path], None]


@checked
def save(what: object, path: str | Path) -> Path:
    """Write a machine, a result or a figure to a file, completely or not at all; its suffix gives the format.

    Args:
        what: a machine (.toml; .png, a picture; .glb, its solids), an answer (.json), a grid or a workspace (.json,
            .nc), a figure (.png, .svg, .pdf), a picture (.png).
        path: of the file; an existing file is replaced.

    Returns:
        The path.

    Raises:
        InputError: the suffix does not fit what is saved, or the file cannot be written.
    """
    place = Path(path)
    writers = _writers(what)
    writers[choice(place.suffix.lower(), writers, f'the suffix of "{place}"')](place)
    return place


def _writers(what: object) -> dict[str, Writer]:
    """Return the ways to write it, by suffix."""
    match what:
        case Figure():
            return dict.fromkeys((f".{name}" for name in FORMATS), lambda path: save_figure(what, path))
        case Picture():
            return {".png": lambda path: write_bytes(path, what)}
        case Machine():
            return {
                ".toml": lambda path: write_text(path, as_file(what)),
                ".png": lambda path: write_bytes(path, machine_picture(what)),
                ".glb": lambda path: write_bytes(path, glb(scene_of(what))),
            }
    data = kind_of(what).data
    if data is None:
        raise InputError(
            f"A result of type {type(what).__name__} has no file format; save its tables or figures instead."
        )
    written: dict[str, Writer] = {".json": lambda path: write_json(path, data(what))}
    match what:
        case xr.Dataset():
            written[".nc"] = lambda path: write_dataset(path, what)
        case Workspace() | Carrying():
            written[".nc"] = lambda path: write_dataset(path, what.dataset)
        case Budget():
            written[".csv"] = lambda path: write_text(path, budget_data.contributions_csv(what))
            written[".nc"] = lambda path: write_dataset(path, budget_data.as_dataset(what))
    return written

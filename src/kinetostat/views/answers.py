"""What there is to see of each kind of answer: tables, figures, plain data. One row a kind; nothing is drawn here."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import xarray as xr
from matplotlib.figure import Figure
from rich.console import Console

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, choice
from kinetostat.studies import analysis, sensitivity
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.comparison import designs
from kinetostat.studies.comparison.designs import Comparison
from kinetostat.studies.grid import grid
from kinetostat.studies.guidelines import sentences
from kinetostat.studies.guidelines.guidelines import Guidelines
from kinetostat.studies.optimisation import result_data
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.sensitivity import Sensitivity
from kinetostat.studies.workspace import workspace
from kinetostat.studies.workspace.workspace import Workspace
from kinetostat.validation import comparison as validation
from kinetostat.validation.comparison import Validation
from kinetostat.views import optimisation_figures, workspace_figures
from kinetostat.views.analysis_tables import print_analysis
from kinetostat.views.design_figure import comparison_figure
from kinetostat.views.design_tables import print_comparison
from kinetostat.views.drawing import three_views
from kinetostat.views.figures import contour_maps, curves
from kinetostat.views.grid_tables import print_dataset
from kinetostat.views.guideline_figures import guideline_figures
from kinetostat.views.guideline_tables import print_guidelines
from kinetostat.views.optimisation_tables import print_result
from kinetostat.views.sensitivity_figure import sensitivity_figure
from kinetostat.views.sensitivity_tables import print_sensitivity
from kinetostat.views.tables import print_machine
from kinetostat.views.validation_tables import print_validation
from kinetostat.views.workspace_tables import print_workspace


@dataclass(frozen=True)
class Kind:
    """How answers of one kind are shown.

    Attributes:
        type: of the answers.
        tell: print one on a console.
        figures: of one, by name, the one that says most first.
        data: one as plain data; None where there is another way to keep it.
    """

    type: type
    tell: Callable[[Console, Any], None]
    figures: Callable[[Any], dict[str, Figure]] = lambda _: {}
    data: Callable[[Any], dict[str, Any]] | None = None


def _views(machine: Machine) -> dict[str, Figure]:
    return {"views": three_views(machine, machine.name)}


def _names(dataset: xr.Dataset) -> list[str]:
    return [str(name) for name in dataset.data_vars if name in QUANTITIES]


def _grid_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Curves over one field, contours over two; of more there is no picture."""
    draw = {1: curves, 2: contour_maps}.get(dataset["status"].ndim)
    return {"map": draw(dataset, _names(dataset), dataset.attrs["machine"])} if draw else {}


def _workspace_figures(found: Workspace) -> dict[str, Figure]:
    drawn = workspace_figures.pictures(found.dataset, found.verdicts, found.conditions, found.dataset.attrs["machine"])
    return {name.removeprefix("-") or "region": figure for name, figure in drawn.items()}


def _sensitivity_figures(found: Sensitivity) -> dict[str, Figure]:
    return {"influences": sensitivity_figure(found)} if found.influences else {}


KINDS = (
    Kind(Machine, print_machine, _views),
    Kind(Analysis, print_analysis, data=analysis.as_json),
    Kind(
        xr.Dataset,
        lambda console, found: print_dataset(console, found, _names(found)),
        _grid_figures,
        grid.as_json,
    ),
    Kind(Workspace, print_workspace, _workspace_figures, workspace.as_json),
    Kind(Sensitivity, print_sensitivity, _sensitivity_figures, sensitivity.as_json),
    Kind(Guidelines, print_guidelines, guideline_figures, sentences.as_json),
    Kind(
        Comparison,
        print_comparison,
        lambda found: {"comparison": comparison_figure(found)},
        designs.as_json,
    ),
    Kind(Result, print_result, optimisation_figures.pictures, result_data.as_json),
    Kind(
        Validation,
        lambda console, found: print_validation(console, found, validation.AGREED),
        data=validation.as_json,
    ),
)
"""Everything that Python and notebooks show."""


def kind_of(answer: object) -> Kind:
    """How an answer is shown.

    Raises:
        InputError: it is no answer of ours.
    """
    found = next((kind for kind in KINDS if isinstance(answer, kind.type)), None)
    if found is None or (isinstance(answer, xr.Dataset) and "status" not in answer):
        known = ", ".join(kind.type.__name__ for kind in KINDS)
        raise InputError(f"A {type(answer).__name__} is not an answer of kinetostat; give one of: {known}.")
    return found


def plot(answer: object, which: str | None = None) -> Figure:
    """A figure of an answer; a notebook displays it, `save` writes it.

    Args:
        answer: a machine (front, side and plan, to scale), a grid over one or two fields, a workspace, sensitivities,
            guidelines, a comparison or an optimisation's result.
        which: of its figures, by name; the one that says most if None.

    Raises:
        InputError: there is no such figure; the message names those that there are.
    """
    figures = kind_of(answer).figures(answer)
    if not figures:
        raise InputError(
            f"There is no figure for a result of type {type(answer).__name__}; use its tables and its data instead."
        )
    return figures[next(iter(figures)) if which is None else choice(which, figures, "which")]

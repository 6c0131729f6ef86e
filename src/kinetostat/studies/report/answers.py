"""The answers that a report shows, gathered from the studies that find them; a question without answer says why."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import xarray as xr

from kinetostat.engine.batch import Progress, silent
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import find
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.ranges import parse_range
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.grid.grid import evaluate_grid
from kinetostat.studies.guidelines.guidelines import Guidelines, guidelines
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.report.ranges import coarser, usual_ranges
from kinetostat.studies.sensitivity import Sensitivity, sensitivity

MAP_POINTS, GUIDELINE_POINTS = 41, 7
"""Points along each coordinate of the maps, and of the poses at which guidelines are tried."""
MOST_AXES = 2
PARTS = ("maps", "guidelines", "sensitivity", "validation")
"""What takes time and may be left out of a report."""
STEPS = 7
"""Of the whole work on a report, as progress counts them; the last two are validation and the file."""


@dataclass(frozen=True)
class Answers:
    """All that is known of a machine at its pose.

    Attributes:
        machine: the subject; of a study its best design.
        analysis: at its pose; all that follows is None unless its status is OK, or what was left out.
        maps: the diagonal of C over one range or two.
        guidelines: at the pose and over a coarser grid of the same ranges.
        sensitivity: of the diagonal of C.
        result: of the study that the machine is the best design of.
        refused: why there is no answer, by the name of the part.
    """

    machine: Machine
    analysis: Analysis
    maps: xr.Dataset | None = None
    guidelines: Guidelines | None = None
    sensitivity: Sensitivity | None = None
    result: Result | None = None
    refused: dict[str, str] = field(default_factory=dict)


def gather(
    machine: Machine,
    ranges: Sequence[str] = (),
    without: Sequence[str] = (),
    result: Result | None = None,
    progress: Progress = silent,
) -> Answers:
    """Ask everything of a machine.

    Args:
        machine: with its pose.
        ranges: of the maps, "FIELD=from:to:count[:log]", one or two; none to choose them.
        without: what is left out, of `PARTS`; validation is another engine's answer and not asked for here.
        result: of a study whose best design the machine is.
        progress: told how far the work on a report is: five of `STEPS`.

    Raises:
        InputError: a bad range, too many, or an unknown part.
    """
    for part in without:
        choice(part, PARTS, "the part of a report to leave out")
    if len(ranges) > MOST_AXES:
        raise InputError(f"a report maps one coordinate or two, not {len(ranges)}; leave out an --over.")
    analysis = analyze(machine)
    if analysis.status is not Status.OK:
        return Answers(machine, analysis, result=result)
    over = list(ranges) or usual_ranges(machine, MAP_POINTS)
    refused: dict[str, str] = {}
    if not over:
        refused["maps"] = "No coordinate of the pose can change by itself here, so that there is nothing to map."
    progress(1, STEPS)
    maps = evaluate_grid(machine, over, list(_diagonal(machine))) if over and "maps" not in without else None
    progress(2, STEPS)
    ranked = sensitivity(machine) if "sensitivity" not in without else None
    progress(3, STEPS)
    advice = _advice(machine, over) if "guidelines" not in without else None
    progress(5, STEPS)
    return Answers(machine, analysis, maps, advice, ranked, result, refused)


def _advice(machine: Machine, over: Sequence[str]) -> Guidelines:
    """Guidelines, over a grid of those ranges that are coordinates of the pose."""
    fields = {text: find(machine.family, parse_range(text).field).path for text in over}
    return guidelines(machine, coarser([text for text in over if fields[text].startswith("pose.")], GUIDELINE_POINTS))


def _diagonal(machine: Machine) -> tuple[str, ...]:
    """Names of the entries of the diagonal of C that the machine has."""
    there = machine.family.component_names
    return tuple(name for name in GROUPS["compliance"] if name.removeprefix("compliance_") in there)

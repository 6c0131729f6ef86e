"""The answers that a report shows, gathered from the studies that find them; a question without answer says why."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress, evaluate, silent
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, find, parameters, values
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.ranges import parse_range
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.budget.budget import Budget, budget
from kinetostat.studies.grid import evaluate_grid
from kinetostat.studies.guidelines import Guidelines, guidelines
from kinetostat.studies.identification.record import FitRecord, read_fit
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.requirements import Verdict, requirements
from kinetostat.studies.sensitivity import Sensitivity, sensitivity
from kinetostat.studies.under_load import LoadedState, under_load
from kinetostat.studies.vibration import Vibration, modes

PROBES = 48
"""Steps to each side in which it is tried how far a coordinate goes."""
NEAR = {"length": 0.3, "angle": math.radians(15.0)}
"""Farthest from the pose, by kind: in units of the characteristic length, and in rad."""
FAR = {"length": 1.0, "angle": math.radians(90.0)}
"""The same for a machine whose file has limits, which then say how far it goes."""
REGULAR = 0.1
"""Share of the pose's singularity margin that is kept, so that maps are not about singularities."""
SLACK = 1e-6
"""Of a step, within which an end counts as round already."""
UNIT = {"length": 1.0, "angle": math.radians(1.0)}
"""In which numbers of a kind are round."""
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
        requirements: of the machine's file, judged.
        loaded: the machine at rest under its loads, if it is meant so (`machine.loaded`).
        budget: the error of the tool by the tolerances of the machine's file, if it has some.
        vibration: natural vibrations, if the file says what the platform or its payload weighs.
        frequencies: the first natural frequency over the poses of the maps.
        fit: what measurements have said of the machine as built, if a record of that is given.
    """

    machine: Machine
    analysis: Analysis
    maps: xr.Dataset | None = None
    guidelines: Guidelines | None = None
    sensitivity: Sensitivity | None = None
    result: Result | None = None
    refused: dict[str, str] = field(default_factory=dict)
    requirements: tuple[Verdict, ...] = ()
    loaded: LoadedState | None = None
    budget: Budget | None = None
    vibration: Vibration | None = None
    frequencies: xr.Dataset | None = None
    fit: FitRecord | None = None


def gather(
    machine: Machine,
    ranges: Sequence[str] = (),
    without: Sequence[str] = (),
    result: Result | None = None,
    progress: Progress = silent,
    fit: str | Path | None = None,
) -> Answers:
    """Answer every question of a report on a machine.

    Args:
        machine: with its pose.
        ranges: of the maps, "FIELD=from:to:count[:log]", one or two; none to choose them.
        without: what is left out, of `PARTS`; validation is computed elsewhere, by an independent engine.
        result: of a study whose best design the machine is.
        progress: receives how far the work on a report is: five of `STEPS`.
        fit: record of an identification of the machine, or the folder in which it lies.

    Raises:
        InputError: a bad range, too many, an unknown part, loads that `under_load` or tolerances that `budget` refuses,
            or a record that is not one of this machine.
    """
    for part in without:
        choice(part, PARTS, "the part of a report to leave out")
    if len(ranges) > MOST_AXES:
        raise InputError(f"a report maps one coordinate or two, not {len(ranges)}; leave out one --over.")
    record = read_fit(fit) if fit else None
    if record:
        record.check(machine, drawn=False)
    here = state_of(machine)
    analysis = analyze(here)
    if analysis.status is not Status.OK:
        return Answers(machine, analysis, result=result)
    over = list(ranges) or usual_ranges(machine, MAP_POINTS)
    refused: dict[str, str] = {}
    if not over:
        refused["maps"] = "No coordinate of the pose can change by itself here, so that there is nothing to map."
    judged, state = requirements(machine), under_load(here) if machine.loaded else None
    built = budget(machine) if machine.tolerances else None
    rings = modes(here) if machine.tables["tool"].mass or machine.tables["tool"].payload else None
    progress(1, STEPS)
    maps = evaluate_grid(machine, over, list(_diagonal(machine))) if over and "maps" not in without else None
    first = "loaded_frequency_1" if machine.loaded else "frequency_1"
    frequencies = evaluate_grid(machine, over, [first]) if maps is not None and rings and rings.modes else None
    progress(2, STEPS)
    ranked = sensitivity(here) if "sensitivity" not in without else None
    progress(3, STEPS)
    advice = _advice(machine, over) if "guidelines" not in without else None
    progress(5, STEPS)
    return Answers(
        machine, analysis, maps, advice, ranked, result, refused, judged, state, built, rings, frequencies, record
    )


def _advice(machine: Machine, over: Sequence[str]) -> Guidelines:
    """Guidelines, over a grid of those ranges that are coordinates of the pose."""
    fields = {text: find(machine.family, parse_range(text).field).path for text in over}
    return guidelines(machine, coarser([text for text in over if fields[text].startswith("pose.")], GUIDELINE_POINTS))


def _diagonal(machine: Machine) -> tuple[str, ...]:
    """Names of the entries of the diagonal of C that the machine has."""
    there = machine.family.component_names
    return tuple(name for name in GROUPS["compliance"] if name.removeprefix("compliance_") in there)


def usual_ranges(machine: Machine, count: int) -> list[str]:
    """Two ranges "pose.x=from:to:count" about the pose, translations first; fewer where fewer coordinates can change.

    Each coordinate goes as far as the machine can follow while the others stay: within its limits if the file has some,
    else not far from the pose, and never near a singularity.

    Args:
        machine: whose pose has an answer.
        count: of points of each.
    """
    limited = machine.tables["limits"]
    kinds = FAR if any(map(is_set, vars(limited).values())) else NEAR
    coordinates = [p for p in parameters(machine.family) if p.path.startswith("pose.") and len(p.leaves) == 1]
    ordered = sorted(coordinates, key=lambda p: p.quantity.kind != "length")
    length, ranges = float(state_of(machine).configuration.length), []
    for parameter in ordered:
        reach = kinds[parameter.quantity.kind] * (length if parameter.quantity.kind == "length" else 1.0)
        low, high = _extent(machine, parameter, reach)
        if high > low:
            ranges.append(f"{parameter.path}={low:.9g}:{high:.9g}:{count}")
        if len(ranges) == 2:
            break
    return ranges


def coarser(ranges: Sequence[str], most: int) -> list[str]:
    """The same ranges "FIELD=from:to:count[:log]" with at most that many points each.

    Raises:
        InputError: not of that form.
    """
    read = [parse_range(text) for text in ranges]
    return [
        f"{span.field}={span.start}:{span.end}:{min(span.count, most)}{':log' if span.logarithmic else ''}"
        for span in read
    ]


def _extent(machine: Machine, parameter: Parameter, reach: float) -> tuple[float, float]:
    """How far a coordinate goes to each side, SI, before there is no good answer."""
    (path,), here = parameter.leaves, float(values(machine)[parameter.path])
    steps = np.linspace(-reach, reach, 2 * PROBES + 1)
    answer = evaluate(machine, PointTable({path: here + steps}), ["singularity_margin"])
    singularity_margin = np.nan_to_num(answer.values["singularity_margin"])
    good = (answer.status == Status.OK) & (singularity_margin >= REGULAR * singularity_margin[PROBES])
    bad = np.flatnonzero(~good)
    first = bad[bad < PROBES].max(initial=-1) + 1
    last = bad[bad > PROBES].min(initial=len(steps)) - 1
    return _rounded(here + steps[[first, last]], UNIT[parameter.quantity.kind])


def _rounded(ends: Array, unit: float) -> tuple[float, float]:
    """The ends, inwards to numbers that are round to a tenth of the range or less."""
    low, high = (float(end) for end in ends)
    if high == low:
        return low, high
    step = 10.0 ** math.floor(math.log10((high - low) / unit / 10.0)) * unit
    return math.ceil(low / step - SLACK) * step, math.floor(high / step + SLACK) * step

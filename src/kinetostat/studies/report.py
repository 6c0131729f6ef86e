"""The subject of a report, a machine or a study, and the questions that are asked of it. Nothing is written here.

Each question has a condition: the error budget is asked where the file has tolerances, the state under load where the
machine is meant so. A part that has no answer says why.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress, evaluate, silent
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.cables import cable_signs
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.machine.limits import limits_set
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, find, parameters, values
from kinetostat.machine.saving import as_file
from kinetostat.spec import document as documents
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.ranges import parse_range
from kinetostat.spec.study import study_toml
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.budget.budget import budget
from kinetostat.studies.bundled import bundled_studies, is_study
from kinetostat.studies.capability import capability, limits_of_drives
from kinetostat.studies.drives import drives
from kinetostat.studies.grid import evaluate_grid
from kinetostat.studies.guidelines import Guidelines, guidelines
from kinetostat.studies.identification.record import FitRecord, read_fit
from kinetostat.studies.lobes import lobes
from kinetostat.studies.optimisation.problem import Problem, load_problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.search import stored_problem
from kinetostat.studies.requirements import requirements
from kinetostat.studies.sensitivity import sensitivity
from kinetostat.studies.study_folder import holds_study
from kinetostat.studies.tensions import tensions
from kinetostat.studies.under_load import under_load
from kinetostat.studies.vibration import modes

PROBE_STEPS = 48
"""Steps to each side in which it is tried how far a coordinate goes."""
FARTHEST_FREE = {"length": 0.3, "angle": math.radians(15.0)}
"""Farthest from the pose, by kind: in units of the characteristic length, and in rad."""
FARTHEST_LIMITED = {"length": 1.0, "angle": math.radians(90.0)}
"""The same for a machine whose file has limits, which then say how far it goes."""
LEAST_MARGIN = 0.1
"""Share of the pose's singularity margin that is kept, so that maps are not about singularities."""
ROUND_SLACK = 1e-6
"""Share of a step within which an end counts as round already."""
ROUND_UNIT = {"length": 1.0, "angle": math.radians(1.0)}
"""The unit in which numbers of a kind are round."""
MAP_POINTS, GUIDELINE_POINTS = 41, 7
"""Points along each coordinate of the maps, and of the poses at which guidelines are tried."""
MOST_AXES = 2
REPORT_PARTS = ("maps", "guidelines", "sensitivity", "validation")
"""Parts that take time and may be left out of a report; validation is computed elsewhere, by an independent engine."""
NOTHING_TO_MAP = "No coordinate of the pose can change by itself here, so that there is nothing to map."

Texts = tuple[tuple[str, str], ...]
"""Name and text of each input."""


@dataclass(frozen=True)
class Subject:
    """The machine or the study of a report.

    Attributes:
        machine: with its overrides; of a study as it is before.
        inputs: name and text of each file that it was read from.
        problem: of a study; None for a machine alone.
        folder: that holds the search of the study, if there is one.
    """

    machine: Machine
    inputs: Texts
    problem: Problem | None = None
    folder: Path | None = None


def subject_of(name: str, settings: Sequence[str] = ()) -> Subject:
    """The subject that a name or path means: a machine, a study, or the folder of a study.

    Args:
        name: a file, a folder, or the name of a bundled machine or study.
        settings: overrides "path=value" of the machine's or the study's fields.

    Raises:
        InputError: nothing of that name, or a mistake in it or in an override.
    """
    path = Path(name)
    shipped = name in bundled() or name in bundled_studies()
    if not shipped and documents.exists(path) and holds_study(path):
        return _study_in_folder(path, settings)
    if is_study(name):
        return _study(name, path, settings)
    machine = load(name, settings)
    return Subject(machine, (_read(name, path),))


def _study_in_folder(folder: Path, settings: Sequence[str]) -> Subject:
    if settings:
        raise InputError(f'"{folder}" holds a study with settings of its own; leave out --set.')
    problem = stored_problem(folder)
    return Subject(problem.machine, texts_of(problem), problem, folder)


def texts_of(problem: Problem) -> Texts:
    """Texts from which a problem can be read again, the study first."""
    return ("study.toml", study_toml(problem.study)), ("machine.toml", as_file(problem.machine))


def _study(name: str, path: Path, settings: Sequence[str]) -> Subject:
    problem = load_problem(name, settings)
    machine = problem.study.machine
    study = (f"{name}.toml", bundled_studies()[name]) if name in bundled_studies() else _read(name, path)
    return Subject(problem.machine, (study, _read(machine, path.parent / machine)), problem)


def _read(name: str, path: Path) -> tuple[str, str]:
    """The text of a machine or study file, or of a bundled machine of that name."""
    shipped = bundled()
    return (f"{name}.toml", shipped[name]) if name in shipped else (path.name, path.read_text("utf-8"))


@dataclass(frozen=True)
class Answers:
    """All that is known of a machine at its pose.

    Attributes:
        machine: the subject; of a study its best design.
        state: of it at its pose, made once for all questions.
        analysis: at its pose; nothing else is asked unless its status is OK.
        ranges: of the maps.
        fit: what measurements have said of the machine as built, if a record of that is given.
        result: of the study that the machine is the best design of.
        motion: path of the motion that its drives make; None for none.
        given: the answer to each question of `REPORT_QUESTIONS` that was asked, by its name.
    """

    machine: Machine
    state: MachineState
    analysis: Analysis
    ranges: tuple[str, ...] = ()
    fit: FitRecord | None = None
    result: Result | None = None
    motion: Path | None = None
    given: dict[str, Any] = field(default_factory=dict)

    def of(self, name: str) -> Any:
        """Return the answer to a question; None where it was not asked."""
        return self.given.get(name)


@dataclass(frozen=True)
class ReportQuestion:
    """A question that a report asks.

    Attributes:
        name: of its answer.
        ask: answers it, from what is known so far.
        when: whether it is asked.
        part: of `REPORT_PARTS`, that leaves it out.
    """

    name: str
    ask: Callable[[Answers], Any]
    when: Callable[[Answers], bool] = lambda _known: True
    part: str = ""


REPORT_QUESTIONS = (
    ReportQuestion("requirements", lambda known: requirements(known.state)),
    ReportQuestion("under_load", lambda known: under_load(known.state), lambda known: known.machine.loaded),
    ReportQuestion("budget", lambda known: budget(known.state), lambda known: bool(known.machine.tolerances)),
    ReportQuestion(
        "capability", lambda known: capability(known.state), lambda known: bool(limits_of_drives(known.state))
    ),
    ReportQuestion("tensions", lambda known: tensions(known.state), lambda known: bool(cable_signs(known.machine))),
    ReportQuestion("vibration", lambda known: modes(known.state), lambda known: _has_mass(known.machine)),
    ReportQuestion("drives", lambda known: drives(known.state, known.motion), lambda known: known.motion is not None),
    ReportQuestion("lobes", lambda known: lobes(known.state), lambda known: _cuts(known.machine)),
    ReportQuestion(
        "maps",
        lambda known: evaluate_grid(known.state, known.ranges, _compliances(known.machine)),
        lambda known: bool(known.ranges),
        "maps",
    ),
    ReportQuestion(
        "frequencies",
        lambda known: evaluate_grid(known.state, known.ranges, [_first_frequency(known.machine)]),
        lambda known: bool(known.ranges and known.of("vibration") and known.of("vibration").modes),
        "maps",
    ),
    ReportQuestion("sensitivity", lambda known: sensitivity(known.state), part="sensitivity"),
    ReportQuestion("guidelines", lambda known: _advice(known.state, known.ranges), part="guidelines"),
)
"""The questions in the order in which they are asked. The state under load is asked where the machine is meant so, the
error budget where the file has tolerances, capability where it limits its drives, tensions where all legs are cables,
vibrations where it has masses, drives where a motion is given, lobes where the file says what the tool cuts, and
frequencies over the poses of the maps where there are modes."""
REPORT_STEPS = len(REPORT_QUESTIONS) + 2
"""Steps of the whole work on a report, as progress counts them; the last two are validation and the file."""


def gather(
    machine: Machine,
    ranges: Sequence[str] = (),
    without: Sequence[str] = (),
    result: Result | None = None,
    progress: Progress = silent,
    fit: str | Path | None = None,
    motion: str | Path | None = None,
) -> Answers:
    """Answer every question of a report on a machine.

    Args:
        machine: with its pose.
        ranges: of the maps, "FIELD=from:to:count[:log]", one or two; none to choose them.
        without: what is left out, of `REPORT_PARTS`.
        result: of a study whose best design the machine is.
        progress: receives how far the work on a report is: all but the last two of `REPORT_STEPS`.
        fit: record of an identification of the machine, or the folder in which it lies.
        motion: path of the CSV file of a motion, as `drives` takes it; None for none.

    Raises:
        InputError: a bad range, too many, an unknown part, loads that `under_load` or tolerances that `budget` refuses,
            a record that is not one of this machine, or a motion that `drives` refuses.
    """
    for part in without:
        choice(part, REPORT_PARTS, "the part of a report to leave out")
    if len(ranges) > MOST_AXES:
        raise InputError(f"a report maps one coordinate or two, not {len(ranges)}; leave out one --over.")
    record = read_fit(fit) if fit else None
    if record:
        record.check(machine, drawn=False)
    state = state_of(machine)
    analysis = analyze(state)
    if analysis.status is not Status.OK:
        return Answers(machine, state, analysis, result=result)
    over = list(ranges) or usual_ranges(machine, MAP_POINTS)
    known = Answers(machine, state, analysis, tuple(over), record, result, None if motion is None else Path(motion))
    for step, question in enumerate(REPORT_QUESTIONS, 1):
        if question.part not in without and question.when(known):
            known.given[question.name] = question.ask(known)
        progress(step, REPORT_STEPS)
    return known


def _cuts(machine: Machine) -> bool:
    cutting = machine.tables["cutting"]
    return _has_mass(machine) and bool(cutting.pressure and any(cutting.direction))


def _has_mass(machine: Machine) -> bool:
    """Whether the file says what the platform or its payload weighs."""
    return bool(machine.tables["tool"].mass or machine.tables["tool"].payload)


def _first_frequency(machine: Machine) -> str:
    return "loaded_frequency_1" if machine.loaded else "frequency_1"


def _advice(state: MachineState, over: Sequence[str]) -> Guidelines:
    """Guidelines, over a grid of those ranges that are coordinates of the pose."""
    fields = {text: find(state.machine.family, parse_range(text).field).path for text in over}
    return guidelines(state, coarser([text for text in over if fields[text].startswith("pose.")], GUIDELINE_POINTS))


def _compliances(machine: Machine) -> list[str]:
    """Names of the entries of the diagonal of C that the machine has."""
    there = machine.family.component_names
    return [name for name in GROUPS["compliance"] if name.removeprefix("compliance_") in there]


def usual_ranges(machine: Machine, count: int) -> list[str]:
    """Two ranges "pose.x=from:to:count" about the pose, translations first; fewer where fewer coordinates can change.

    Each coordinate goes as far as the machine can follow while the others stay: within its limits if the file has some,
    else not far from the pose, and never near a singularity.

    Args:
        machine: whose pose has an answer.
        count: of points of each.
    """
    kinds = FARTHEST_LIMITED if limits_set(machine.tables["limits"]) else FARTHEST_FREE
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
    """Both ends to which a coordinate goes, SI, before there is no good answer."""
    (path,), here = parameter.leaves, float(values(machine)[parameter.path])
    steps = np.linspace(-reach, reach, 2 * PROBE_STEPS + 1)
    answer = evaluate(machine, PointTable({path: here + steps}), ["singularity_margin"])
    singularity_margin = np.nan_to_num(answer.values["singularity_margin"])
    good = (answer.status == Status.OK) & (singularity_margin >= LEAST_MARGIN * singularity_margin[PROBE_STEPS])
    bad = np.flatnonzero(~good)
    first = bad[bad < PROBE_STEPS].max(initial=-1) + 1
    last = bad[bad > PROBE_STEPS].min(initial=len(steps)) - 1
    return _rounded_inwards(here + steps[[first, last]], ROUND_UNIT[parameter.quantity.kind])


def _rounded_inwards(ends: Array, unit: float) -> tuple[float, float]:
    """The ends, inwards to numbers that are round to a tenth of the range or less."""
    low, high = (float(end) for end in ends)
    if high == low:
        return low, high
    step = 10.0 ** math.floor(math.log10((high - low) / unit / 10.0)) * unit
    return math.ceil(low / step - ROUND_SLACK) * step, math.floor(high / step + ROUND_SLACK) * step

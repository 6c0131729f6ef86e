"""The subject of a report, a machine or a study, and the questions that are asked of it. Nothing is written here.

Each question has a condition: the error budget, for instance, is asked if the file has tolerances. A part of the report
that has no answer says why.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from kinetostat.engine.batch import Progress, silent
from kinetostat.equilibrium.cables import cable_signs
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, find
from kinetostat.machine.saving import as_file
from kinetostat.spec import document as documents
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.fields import parse_range
from kinetostat.spec.study import study_toml
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.budget import budget
from kinetostat.studies.bundled import bundled_studies, is_study
from kinetostat.studies.capability import capability, limits_of_drives
from kinetostat.studies.datasets import MOST_RANGES_OF_MAPS, coarser_ranges, evaluate_grid, usual_ranges
from kinetostat.studies.drives import drives
from kinetostat.studies.elevation import elevation
from kinetostat.studies.guidelines import Guidelines, guidelines
from kinetostat.studies.identification.record import FitRecord, read_fit
from kinetostat.studies.lobes import lobes
from kinetostat.studies.motions import motions_required
from kinetostat.studies.optimisation.problem import Problem, load_problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.search import stored_problem
from kinetostat.studies.requirements import required_motors, requirements
from kinetostat.studies.sensitivity import sensitivity
from kinetostat.studies.study_folder import holds_study
from kinetostat.studies.tensions import tensions
from kinetostat.studies.under_load import under_load
from kinetostat.studies.vibration import modes

MAP_POINTS = 41
"""Points along each coordinate of the maps: contours between them are smooth on a page."""
GUIDELINE_POINTS = 7
"""Points along each coordinate at which guidelines are tried: some fifty poses of a map."""
REPORT_PARTS = ("maps", "guidelines", "sensitivity", "validation")
"""Parts that take time and may be left out; an independent engine computes validation (`views.report.writing`)."""
NOTHING_TO_MAP = "No coordinate of the pose can change by itself here, so that there is nothing to map."
"""The text in the place of maps where there is none."""

InputText = tuple[str, str]
"""Name and text of a file."""
Texts = tuple[InputText, ...]
"""Name and text of each file."""


@dataclass(frozen=True)
class Subject:
    """The machine or the study of a report.

    Attributes:
        machine: the machine with its overrides; of a study, the machine before the search.
        inputs: name and text of each file from which the subject was read.
        problem: the problem of a study; None for a machine alone.
        folder: the folder that holds the search of the study, if there is one.
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
        return _subject_in_folder(path, settings)
    if is_study(name):
        return _subject_of_study(name, path, settings)
    machine = load(name, settings)
    return Subject(machine, (_machine_text(name, path),))


def _subject_in_folder(folder: Path, settings: Sequence[str]) -> Subject:
    if settings:
        raise InputError(f'"{folder}" holds a study with settings of its own; leave out --set.')
    problem = stored_problem(folder)
    return Subject(problem.machine, texts_of(problem), problem, folder)


def texts_of(problem: Problem) -> Texts:
    """The files from which a problem can be read again, the study first."""
    return ("study.toml", study_toml(problem.study)), ("machine.toml", as_file(problem.machine))


def _subject_of_study(name: str, path: Path, settings: Sequence[str]) -> Subject:
    """A study by its name or path; a machine that is not bundled lies beside its file."""
    problem = load_problem(name, settings)
    machine = problem.study.machine
    machine_text = _machine_text(machine, path.parent / machine)
    return Subject(problem.machine, (_text_of(name, path, bundled_studies()), machine_text), problem)


def _machine_text(name: str, path: Path) -> InputText:
    return _text_of(name, path, bundled())


def _text_of(name: str, path: Path, shipped: Mapping[str, str]) -> InputText:
    """The text that is shipped under a name, or else that of a file."""
    return (f"{name}.toml", shipped[name]) if name in shipped else (path.name, path.read_text("utf-8-sig"))


@dataclass(frozen=True)
class Answers:
    """The answers of a report on a machine at its pose.

    Attributes:
        machine: the machine; of a study, its best design.
        state: the machine's state at its pose, made once for all questions.
        analysis: the analysis of the pose; no other question is asked unless its status is OK.
        ranges: ranges of the maps.
        fit: the record of an identification of the machine as built, if one is given.
        result: the result of the study whose best design the machine is.
        motion: path of the motion that its drives make; None for none.
        elevations: range of elevations, "0 deg:90 deg:7"; empty for a machine that does not.
        given: the answer to each question of `REPORT_QUESTIONS` that was asked, by its name.
    """

    machine: Machine
    state: MachineState
    analysis: Analysis
    ranges: tuple[str, ...] = ()
    fit: FitRecord | None = None
    result: Result | None = None
    motion: Path | None = None
    elevations: str = ""
    given: dict[str, Any] = field(default_factory=dict)

    def of(self, name: str) -> Any:
        """Return the answer to a question; None where it was not asked."""
        return self.given.get(name)


@dataclass(frozen=True)
class ReportQuestion:
    """A question that a report asks.

    Attributes:
        name: name of the question and of its answer.
        ask: answers the question, from the answers so far.
        when: whether the question is asked.
        part: the part of `REPORT_PARTS` to which it belongs; empty if it cannot be left out.
        section: whether the report has a section that is made of its answer alone.
    """

    name: str
    ask: Callable[[Answers], Any]
    when: Callable[[Answers], bool] = lambda _known: True
    part: str = ""
    section: bool = False


REPORT_QUESTIONS = (
    ReportQuestion("requirements", lambda known: requirements(known.state)),
    ReportQuestion(
        "under_load", lambda known: under_load(known.state), lambda known: known.machine.loaded, section=True
    ),
    ReportQuestion(
        "elevation",
        lambda known: elevation(known.state, known.elevations),
        lambda known: bool(known.elevations),
        section=True,
    ),
    ReportQuestion(
        "tensions", lambda known: tensions(known.state), lambda known: bool(cable_signs(known.machine)), section=True
    ),
    ReportQuestion(
        "capability",
        lambda known: capability(known.state),
        lambda known: bool(limits_of_drives(known.state)),
        section=True,
    ),
    ReportQuestion("vibration", lambda known: modes(known.state), lambda known: _has_mass(known.machine), section=True),
    ReportQuestion(
        "drives",
        lambda known: drives(known.state, known.motion),
        lambda known: known.motion is not None or len(motions_required(known.machine)) == 1,
        section=True,
    ),
    ReportQuestion(
        "motors",
        lambda known: required_motors(known.machine),
        lambda known: any(each.fits for each in known.machine.requirements.values()),
        section=True,
    ),
    ReportQuestion("lobes", lambda known: lobes(known.state), lambda known: _has_cut(known.machine), section=True),
    ReportQuestion(
        "budget", lambda known: budget(known.state), lambda known: bool(known.machine.tolerances), section=True
    ),
    ReportQuestion(
        "maps",
        lambda known: evaluate_grid(known.state, known.ranges, _compliances(known.machine)),
        lambda known: bool(known.ranges),
        part="maps",
    ),
    ReportQuestion(
        "frequencies",
        lambda known: evaluate_grid(known.state, known.ranges, [_first_frequency(known.machine)]),
        lambda known: bool(known.ranges and known.of("vibration") and known.of("vibration").modes),
        part="maps",
    ),
    ReportQuestion("sensitivity", lambda known: sensitivity(known.state), part="sensitivity"),
    ReportQuestion("guidelines", lambda known: _guidelines_over(known.state, known.ranges), part="guidelines"),
)
"""The questions in the order in which they are asked and shown, each with its condition. Later ones may read earlier
answers: the map of frequencies is drawn only if vibrations have modes."""
REPORT_STEPS = len(REPORT_QUESTIONS) + 2
"""Number of steps that progress counts; the last two are validation and writing the file."""


def gather(
    machine: Machine,
    ranges: Sequence[str] = (),
    without: Sequence[str] = (),
    result: Result | None = None,
    progress: Progress = silent,
    fit: str | Path | None = None,
    motion: str | Path | None = None,
    elevations: str = "",
) -> Answers:
    """Answer every question of a report on a machine; only the analysis where its pose has no answer.

    Args:
        machine: the machine with its pose.
        ranges: ranges of the maps, "FIELD=from:to:count[:log]", one or two; `usual_ranges` if there are none.
        without: parts of `REPORT_PARTS` to leave out.
        result: the result of the study whose best design the machine is.
        progress: receives the number of steps done, and `REPORT_STEPS`; the last two steps are not done here.
        fit: record of an identification of the machine, or the folder in which it lies.
        motion: path of the CSV file of a motion, as `drives` takes it; None for none.
        elevations: range of elevations over which the machine tilts, as `elevation` takes it; empty for none.

    Raises:
        InputError: a bad range, too many, an unknown part, elevations, loads, tolerances or a motion that `elevation`,
            `under_load`, `budget` or `drives` refuses, or a record that is not one of this machine.
    """
    for part in without:
        choice(part, REPORT_PARTS, "the part of a report to leave out")
    if len(ranges) > MOST_RANGES_OF_MAPS:
        raise InputError(f"a report maps one coordinate or two, not {len(ranges)}; leave out one --over.")
    record = read_fit(fit) if fit else None
    if record:
        record.check(machine)
    state = state_of(machine)
    analysis = analyze(state)
    if analysis.status is not Status.OK:
        return Answers(machine, state, analysis, result=result)
    over = list(ranges) or usual_ranges(machine, MAP_POINTS)
    path = None if motion is None else Path(motion)
    known = Answers(
        machine=machine,
        state=state,
        analysis=analysis,
        ranges=tuple(over),
        fit=record,
        result=result,
        motion=path,
        elevations=elevations,
    )
    for step, question in enumerate(REPORT_QUESTIONS, 1):
        if question.part not in without and question.when(known):
            known.given[question.name] = question.ask(known)
        progress(step, REPORT_STEPS)
    return known


def _has_cut(machine: Machine) -> bool:
    """Whether the file gives masses, and a table [cutting] that is complete enough for stability lobes."""
    cutting = machine.tables["cutting"]
    return _has_mass(machine) and bool(cutting.pressure and any(cutting.direction))


def _has_mass(machine: Machine) -> bool:
    """Whether the file says what the platform or its payload weighs."""
    return bool(machine.tables["tool"].mass or machine.tables["tool"].payload)


def _first_frequency(machine: Machine) -> str:
    return "loaded_frequency_1" if machine.loaded else "frequency_1"


def _guidelines_over(state: MachineState, ranges: Sequence[str]) -> Guidelines:
    """Guidelines, over a grid of those ranges that are coordinates of the pose."""
    paths = {text: find(state.machine.family, parse_range(text).field).path for text in ranges}
    of_pose = [text for text, path in paths.items() if path.startswith(POSE)]
    return guidelines(state, coarser_ranges(of_pose, GUIDELINE_POINTS))


def _compliances(machine: Machine) -> list[str]:
    """Names of the entries of the diagonal of C that the machine has."""
    components = machine.family.component_names
    return [name for name in GROUPS["compliance"] if name.removeprefix("compliance_") in components]

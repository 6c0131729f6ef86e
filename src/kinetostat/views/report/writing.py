"""A report as a file: the answers are gathered, its sections put in order, and written as a page or as a PDF.

Sections are written in the modules beside this one, but for the record of how to repeat the report; the order of the
work and the file are decided here.
"""

import json
import platform
import shlex
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from kinetostat.engine.batch import Progress, silent
from kinetostat.engine.kernel import closes_inside
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine, pose_of
from kinetostat.machine.saving import as_file
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.report import REPORT_STEPS, Answers, Texts, gather, texts_of
from kinetostat.studies.storage import place_of, write_bytes
from kinetostat.validation.comparison import Validation, choose, validate
from kinetostat.views.answers import plain_of
from kinetostat.views.live_page import page_functions, page_of
from kinetostat.views.report.answers import (
    ANSWERS_WITH_SECTIONS,
    answer_sections,
    design_sections,
    study_section,
    validation_section,
)
from kinetostat.views.report.content import InnerPage, Listing, Paragraph, Report, Section, Table, typeset
from kinetostat.views.report.stiffness import load_section, method_section, stiffness_section, workspace_section
from kinetostat.views.report.summary import (
    data_section,
    machine_pictures,
    machine_section,
    portrait,
    summary_section,
)
from kinetostat.views.report.writers import check_typst, html_page, pdf_bytes

SUFFIXES = (".html", ".pdf")
LIBRARIES = ("kinetostat", "numpy", "scipy", "llvmlite", "pymoo", "matplotlib")
"""Programs whose versions decide the digits and the pictures of a report."""
AGAIN_TEXT = (
    "The same command with the same input and the same versions makes this report again, byte for byte. The machine "
    "with all digits (machine.toml) and the results (results.json) are inside this file."
)


@dataclass(frozen=True)
class Origin:
    """The sources of a report.

    Attributes:
        command: the command that makes it again.
        inputs: name and text of each file, as written.
        machine_file: the machine with all overrides, all digits.
        results: the analysis as JSON.
    """

    command: str
    inputs: tuple[tuple[str, str], ...]
    machine_file: str
    results: str


@dataclass(frozen=True)
class ReportOptions:
    """Options of a report, by the names of the command line.

    Attributes:
        ranges: the ranges of the maps, "FIELD=from:to:count[:log]", one or two; empty to choose them automatically.
        without: parts to leave out because they take time, of `REPORT_PARTS`.
        engine: the engine of the validation; None for the first that is installed.
        author, date: the entries of the title block; None for none.
        loaded: whether the machine is to be shown under its loads, whatever its file says.
        fit: record of an identification of the machine, or its folder.
        motion: path of the CSV file of a motion of its drives.
        elevations: over which the machine tilts, as `elevation` takes them; empty for none.
    """

    ranges: Sequence[str] = ()
    without: Sequence[str] = ()
    engine: str | None = None
    author: str | None = None
    date: str | None = None
    loaded: bool = False
    fit: str | Path | None = None
    motion: str | Path | None = None
    elevations: str = ""

    def words(self) -> list[str]:
        """Return the words of the command line that give the same options."""
        single = [(name, getattr(self, name)) for name in ("engine", "author", "date", "fit", "motion", "elevations")]
        pairs = [("--over", self.ranges), ("--without", self.without)]
        pairs += [(f"--{name}", [str(value)]) for name, value in single if value]
        words = [word for name, values in pairs for value in values for word in (name, value)]
        return ["--loaded", *words] if self.loaded else words


@checked
def report(
    about: Machine | Result,
    path: str | Path,
    ranges: Sequence[str] = (),
    without: Sequence[str] = (),
    *,
    engine: str | None = None,
    author: str | None = None,
    date: str | None = None,
    fit: str | Path | None = None,
    motion: str | Path | None = None,
    elevations: str = "",
    progress: Progress = silent,
) -> Path:
    """Write a report for a design review into one file: on a machine, or on a study and its best design.

    Args:
        about: a machine at a pose that has an answer, or the result of a study.
        path: the path of the file, .html (with the machine in three dimensions) or .pdf; an existing file is replaced.
        ranges: the ranges of the maps, "FIELD=from:to:count[:log]", one or two; empty to choose them automatically.
        without: parts to leave out because they take time: maps, guidelines, sensitivity, validation.
        engine: the engine of the validation, exudyn or pynite; None for the first that is installed.
        author, date: the entries of the title block. Without a date, the same input gives the same bytes.
        fit: record of an identification of the machine (fit.json), or the folder in which it lies.
        motion: path of the CSV file of a motion, as `drives` takes it: what it asks of the drives.
        elevations: over which the machine tilts, as `elevation` takes them, "0 deg:90 deg:7"; empty for none.
        progress: called with the number of steps done and of all steps.

    Returns:
        The path.

    Raises:
        InputError: the pose has no answer, no design meets the constraints, a range or part is not valid, the file is
            neither .html nor .pdf or cannot be written, or a library is missing.
    """
    place = report_path(path)
    options = ReportOptions(ranges, without, engine, author, date, fit=fit, motion=motion, elevations=elevations)
    result = about if isinstance(about, Result) else None
    if result is not None and not result.solved:
        raise InputError(result.message)
    machine = about.machine if isinstance(about, Result) else about
    answers = gather(machine, ranges, without, result, progress, fit, motion, elevations)
    if answers.analysis.status is not Status.OK:
        raise InputError(answers.analysis.message)
    inputs = texts_of(result.problem) if result else (("machine.toml", as_file(machine)),)
    write_report(answers, options, [inputs[0][0]], inputs, place, progress)
    return place


def report_path(path: str | Path) -> Path:
    """Check the path of a report before the work begins.

    Raises:
        InputError: the suffix is neither .html nor .pdf, what is there is not replaced, or the library for PDF is not
            installed.
    """
    place = Path(path)
    if place.suffix not in SUFFIXES:
        raise InputError(f'a report is {" or ".join(SUFFIXES)}, not "{place}"; write e.g. -o report.html.')
    place_of(place)
    if place.suffix == ".pdf":
        check_typst()
    return place


def write_report(
    answers: Answers,
    options: ReportOptions,
    subject: Sequence[str],
    inputs: Texts,
    path: Path,
    progress: Progress = silent,
) -> None:
    """Write a report from its answers; the file appears whole or not at all.

    Args:
        answers: the answers at a pose whose status is OK.
        options: the options of the report.
        subject: words of the command line that name the machine or study, with its overrides.
        inputs: name and text of each file that it was read from.
        path: the path that `report_path` returns.
        progress: called for the last two of `REPORT_STEPS`.

    Raises:
        InputError: an unknown engine, or a path that cannot be written.
    """
    command = shlex.join(["kinetostat", "report", *subject, *options.words(), "-o", path.name])
    results = json.dumps(results_of(answers), ensure_ascii=False, allow_nan=False, indent=1)
    origin = Origin(command, inputs, as_file(answers.machine), results)
    title_lines = {name: text for name, text in (("Author", options.author), ("Date", options.date)) if text}
    page = path.suffix == ".html"
    validation = _validation(answers.machine, options)
    progress(REPORT_STEPS - 1, REPORT_STEPS)
    whole = report_of(answers, validation, origin, title_lines, page)
    data = html_page(whole).encode() if page else pdf_bytes(whole)
    write_bytes(path, data)
    progress(REPORT_STEPS, REPORT_STEPS)


def _validation(machine: Machine, options: ReportOptions) -> Validation | str:
    """Validate with an independent engine, or say why that was not possible."""
    if "validation" in options.without:
        return "Validation was left out."
    if options.engine:
        choose(options.engine)
    try:
        return validate(machine, options.engine)
    except InputError as reason:
        return str(reason)


def results_of(answers: Answers) -> dict[str, Any]:
    """Return the analysis as plain data, with the other answers that have a section of their own under their names."""
    others = {name: answers.of(name) for name in ANSWERS_WITH_SECTIONS}
    return plain_of(answers.analysis) | {name: plain_of(answer) for name, answer in others.items() if answer}


def report_of(
    answers: Answers, validation: Validation | str, origin: Origin, title_lines: Mapping[str, str], live: bool
) -> Report:
    """Assemble the report on a machine, or on a study and its best design.

    Args:
        answers: the answers at a pose whose status is OK.
        validation: the validation by an independent engine, or why there is none.
        origin: the sources of the report.
        title_lines: further lines of the title block, by name.
        live: whether the report will be a page, which may show the machine in three dimensions.

    Raises:
        ValueError: the status of the pose is not OK.
    """
    analysis, result = answers.analysis, answers.result
    if analysis.status is not Status.OK:
        raise ValueError("a report needs a pose whose status is OK")
    pictures = machine_pictures(analysis, answers.of("vibration") if live else None)
    engine = () if isinstance(validation, str) else (validation.engine, validation.version)
    sections = [
        summary_section(answers, validation, portrait(analysis, pictures, live)),
        *([study_section(result)] if result else []),
        machine_section(analysis),
        data_section(analysis),
        stiffness_section(analysis),
        load_section(analysis, pictures),
        *answer_sections(answers),
        workspace_section(answers),
        *design_sections(answers),
        validation_section(validation),
        *(moving_sections(analysis) if live else []),
        method_section(),
        record_section(origin, engine),
    ]
    return Report(
        "Stiffness report" if result is None else "Design study report",
        analysis.machine.name if result is None else result.problem.study.name,
        (*_title_block(answers), *title_lines.items()),
        tuple(sections),
        {"machine.toml": origin.machine_file, "results.json": origin.results},
    )


def moving_sections(analysis: Analysis) -> list[Section]:
    """Write the section with the page that moves the machine; none where its legs have no closed form, and no page."""
    machine = analysis.machine
    if machine.family.chains is not None and not closes_inside(machine):
        return []
    words = Paragraph("Sliders move the machine, and all numbers follow: they are computed here, by its own formulas.")
    page = page_of(page_functions(machine), "machine")
    return [Section("The machine to move", (words, InnerPage(f"{machine.name} to move", page)))]


def record_section(origin: Origin, engine: Sequence[str]) -> Section:
    """Write the section with the command, the versions and the input.

    Args:
        origin: the origin of the report.
        engine: name and version of the independent engine; empty without one.
    """
    versions = [(name, version(name)) for name in LIBRARIES] + [("Python", platform.python_version())]
    versions += [(engine[0], engine[1])] if engine else []
    return Section(
        "Record",
        (
            Paragraph(AGAIN_TEXT),
            Listing("Command.", origin.command),
            Table("Versions.", ("program", "version"), tuple(versions), (False, False)),
            *(Listing(f"Input: {name}.", text) for name, text in origin.inputs),
        ),
    )


def _title_block(answers: Answers) -> list[tuple[str, str]]:
    machine = answers.machine
    return [
        ("Machine", machine.name),
        ("Family", machine.family.name),
        ("Pose", typeset(pose_of(machine))),
        ("Reference", f"{machine.reference}, {answers.analysis.axes} axes"),
        ("Program", f"kinetostat {version('kinetostat')}"),
    ]

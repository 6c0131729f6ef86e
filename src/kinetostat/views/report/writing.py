"""A report as a file: the answers are gathered, assembled, and written as a page or as a PDF.

Sections are written in the modules beside this one; only the order of the work and the file are decided here.
"""

import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kinetostat.engine.batch import Progress, silent
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.saving import as_file
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.studies import under_load
from kinetostat.studies.analysis import as_json
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.result_data import message
from kinetostat.studies.report.answers import STEPS, Answers, gather
from kinetostat.studies.report.subject import Texts, texts_of
from kinetostat.studies.storage import place_of, write_bytes
from kinetostat.validation.comparison import Validation, choose, validate
from kinetostat.views.budget import BUDGET
from kinetostat.views.data_forms import json_of
from kinetostat.views.report.assembly import report_of
from kinetostat.views.report.html_page import html_page
from kinetostat.views.report.pdf import check_typst, pdf_bytes
from kinetostat.views.report.provenance import Origin
from kinetostat.views.vibration import VIBRATION

SUFFIXES = (".html", ".pdf")


@dataclass(frozen=True)
class Wanted:
    """Options of a report.

    Attributes:
        ranges: of the maps, "FIELD=from:to:count[:log]", one or two; empty to choose them automatically.
        without: parts to leave out because they take time, of `studies.report.answers.PARTS`.
        engine: for the validation; None for the first that is installed.
        author, date: for the title block; None for none.
        loaded: whether the machine is to be shown under its loads, whatever its file says.
        fit: record of an identification of the machine, or its folder.
    """

    ranges: Sequence[str] = ()
    without: Sequence[str] = ()
    engine: str | None = None
    author: str | None = None
    date: str | None = None
    loaded: bool = False
    fit: str | Path | None = None

    def options(self) -> list[str]:
        """Words of the command line that give the same options."""
        single = (("--engine", self.engine), ("--author", self.author), ("--date", self.date), ("--fit", self.fit))
        pairs = [("--over", self.ranges), ("--without", self.without)]
        pairs += [(name, [str(value)]) for name, value in single if value]
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
    progress: Progress = silent,
) -> Path:
    """Write a report for a design review into one file: on a machine, or on a study and its best design.

    Args:
        about: a machine at a pose that has an answer, or the result of a study.
        path: of the file, .html (with the machine in three dimensions) or .pdf; an existing file is replaced.
        ranges: of the maps, "FIELD=from:to:count[:log]", one or two; empty to choose them automatically.
        without: parts to leave out because they take time: maps, guidelines, sensitivity, validation.
        engine: for the validation, exudyn or pynite; None for the first that is installed.
        author, date: for the title block. Without a date, the same input gives the same bytes.
        fit: record of an identification of the machine (fit.json), or the folder in which it lies.
        progress: called with the number of steps done and of all steps.

    Returns:
        The path.

    Raises:
        InputError: the pose has no answer, no design meets the constraints, a range or part is not valid, the file is
            neither .html nor .pdf or cannot be written, or a library is missing.
    """
    place, wanted = report_path(path), Wanted(ranges, without, engine, author, date, fit=fit)
    result = about if isinstance(about, Result) else None
    if result is not None and not result.solved:
        raise InputError(message(result))
    machine = about.machine if isinstance(about, Result) else about
    answers = gather(machine, ranges, without, result, progress, fit)
    if answers.analysis.status is not Status.OK:
        raise InputError(answers.analysis.message)
    inputs = texts_of(result.problem) if result else (("machine.toml", as_file(machine)),)
    write_report(answers, wanted, [inputs[0][0]], inputs, place, progress)
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
    answers: Answers, wanted: Wanted, subject: Sequence[str], inputs: Texts, path: Path, progress: Progress = silent
) -> None:
    """Write a report from its answers; the file appears whole or not at all.

    Args:
        answers: for a pose whose status is OK.
        wanted: options of the report.
        subject: words of the command line that name the machine or study, with its overrides.
        inputs: name and text of each file that it was read from.
        path: from `report_path`.
        progress: called for the last two of `STEPS`.

    Raises:
        InputError: an unknown engine, or a path that cannot be written.
    """
    command = shlex.join(["kinetostat", "report", *subject, *wanted.options(), "-o", path.name])
    loaded = {} if answers.loaded is None else {"under_load": under_load.as_json(answers.loaded)}
    built = {} if answers.budget is None else {"budget": json_of(BUDGET, answers.budget)}
    rings = {} if answers.vibration is None else {"vibration": json_of(VIBRATION, answers.vibration)}
    results = json.dumps(
        as_json(answers.analysis) | loaded | built | rings, ensure_ascii=False, allow_nan=False, indent=1
    )
    origin = Origin(command, inputs, as_file(answers.machine), results)
    about = {name: text for name, text in (("Author", wanted.author), ("Date", wanted.date)) if text}
    page = path.suffix == ".html"
    validation = _validation(answers.machine, wanted)
    progress(STEPS - 1, STEPS)
    whole = report_of(answers, validation, origin, about, page)
    data = html_page(whole).encode() if page else pdf_bytes(whole)
    write_bytes(path, data)
    progress(STEPS, STEPS)


def _validation(machine: Machine, wanted: Wanted) -> Validation | str:
    """Validate with an independent engine, or say why that was not possible."""
    if "validation" in wanted.without:
        return "Validation was left out."
    if wanted.engine:
        choose(wanted.engine)
    try:
        return validate(machine, wanted.engine)
    except InputError as reason:
        return str(reason)

"""`report`: everything about a machine or a study in one file for a design review. No formula lives here."""

import argparse
import json
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import DONE, add_command, no_answer

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.machine.machine import Machine
    from kinetostat.studies.optimisation.problem import Problem
    from kinetostat.studies.optimisation.result import Result
    from kinetostat.validation.comparison import Validation
    from kinetostat.views.report.content import Report

WITHOUT = ("maps", "guidelines", "sensitivity", "validation")
SUFFIXES = (".html", ".pdf")


def add_report_command(commands: "Commands") -> None:
    """Add `report`."""
    command = add_command(
        commands, "report", _report, "everything about a machine or a study in one file for a design review",
        'kinetostat report tripteron --set \'load.force=["0 N","0 N","-500 N"]\' -o tripteron.pdf',
    )  # fmt: skip
    command.add_argument(
        "subject", metavar="MACHINE|STUDY",
        help="a machine or study file, the name of a bundled one (see `kinetostat list`), or the folder of a study",
    )  # fmt: skip
    command.add_argument(
        "--set", metavar="PATH=VALUE", action="append", default=[], dest="settings",
        help="override a field of the machine or of the study; repeatable",
    )  # fmt: skip
    command.add_argument(
        "--over", metavar="FIELD=from:to:count", action="append", default=[], dest="ranges",
        help="an axis of the maps, one or two; default: two coordinates of the pose, as far as the machine can follow",
    )  # fmt: skip
    command.add_argument(
        "--without", metavar="PART", action="append", default=[], choices=WITHOUT,
        help=f"leave out what takes time: {', '.join(WITHOUT)}; repeatable",
    )  # fmt: skip
    command.add_argument("--engine", help="of the validation: exudyn or pynite (default: the first that is installed)")
    command.add_argument("--author", help="a name for the title block")
    command.add_argument("--date", help="a date for the title block; without it, the same input gives the same bytes")
    command.add_argument(
        "-o", "--output", type=Path, default=Path("report.html"), help="file, .html or .pdf (default: report.html)"
    )


def _report(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.optimisation.result_data import message
    from kinetostat.studies.report.answers import gather
    from kinetostat.studies.report.subject import subject_of
    from kinetostat.views.progress import progress_bar
    from kinetostat.views.report.pdf import check_typst

    if options.output.suffix not in SUFFIXES:
        raise InputError(f'a report is {" or ".join(SUFFIXES)}, not "{options.output}"; write e.g. -o report.html.')
    if options.output.suffix == ".pdf":
        check_typst()
    subject = subject_of(options.subject, options.settings)
    result = _searched(subject.problem, subject.folder) if subject.problem else None
    if result is not None and not result.solved:
        return no_answer(message(result))
    machine = subject.machine if result is None else result.machine
    with progress_bar("asking") as progress:
        answers = gather(machine, options.ranges, options.without, result, progress)
    if answers.analysis.status is not Status.OK:
        return no_answer(answers.analysis.message)
    from kinetostat.machine.loading import as_toml
    from kinetostat.studies.analysis_data import as_json
    from kinetostat.views.report.assembly import report_of
    from kinetostat.views.report.record import Origin

    results = json.dumps(as_json(answers.analysis), ensure_ascii=False, allow_nan=False, indent=1)
    origin = Origin(_command(options), subject.inputs, as_toml(machine), results)
    about = {name: text for name, text in (("Author", options.author), ("Date", options.date)) if text}
    page = options.output.suffix == ".html"
    _write(report_of(answers, _validation(machine, options), origin, about, page), options.output)
    return DONE


def _searched(problem: "Problem", folder: Path | None) -> "Result":
    """The result of a study, which goes on in its folder if it has one."""
    from kinetostat.studies.optimisation.result import optimize
    from kinetostat.views.progress import telling_bar

    with telling_bar("searching") as tell:
        return optimize(
            problem,
            folder,
            lambda done, total, best: tell(done, total, "" if best is None else f"(best {best:.8g})"),
        )


def _validation(machine: "Machine", options: argparse.Namespace) -> "Validation | str":
    """What an independent engine says, or why it says nothing."""
    from kinetostat.spec.errors import InputError
    from kinetostat.validation.comparison import choose, validate

    if "validation" in options.without:
        return "Validation was left out."
    if options.engine:
        choose(options.engine)
    try:
        return validate(machine, options.engine)
    except InputError as reason:
        return str(reason)


def _command(options: argparse.Namespace) -> str:
    """The command that makes the report again."""
    words = ["kinetostat", "report", options.subject]
    pairs = [("--set", options.settings), ("--over", options.ranges), ("--without", options.without)]
    single = [("--engine", options.engine), ("--author", options.author), ("--date", options.date)]
    for name, values in [*pairs, *((name, [value]) for name, value in single if value)]:
        words += [word for value in values for word in (name, value)]
    return shlex.join([*words, "-o", options.output.name])


def _write(report: "Report", path: Path) -> None:
    from kinetostat.studies.storage import replacing
    from kinetostat.views.grid_tables import print_written
    from kinetostat.views.report.html_page import html_page
    from kinetostat.views.report.pdf import pdf_bytes
    from kinetostat.views.tables import terminal

    data = html_page(report).encode() if path.suffix == ".html" else pdf_bytes(report)
    with replacing(path) as temporary:
        temporary.write_bytes(data)
    print_written(terminal(), [path])

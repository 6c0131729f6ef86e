"""`report`: everything about a machine or a study in one file for a design review. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import DONE, add_command, no_answer

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.optimisation.problem import Problem
    from kinetostat.studies.optimisation.result import Result

WITHOUT = ("maps", "guidelines", "sensitivity", "validation")


def add_report_command(commands: "Commands") -> None:
    """Add `report`."""
    command = add_command(
        commands, "report", _report, "write one document about a machine or a study for a design review",
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
        help="an axis of the maps (one or two); default: two coordinates of the pose, over their reach",
    )  # fmt: skip
    command.add_argument(
        "--without", metavar="PART", action="append", default=[], choices=WITHOUT,
        help=f"omit a part that takes time: {', '.join(WITHOUT)}; repeatable",
    )  # fmt: skip
    command.add_argument(
        "--engine",
        help="independent engine for the validation: exudyn or pynite (default: the first that is installed)",
    )
    command.add_argument("--author", help="author in the title block")
    command.add_argument(
        "--date", help="date in the title block (default: none, so that equal input gives equal files)"
    )
    command.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("report.html"),
        help="the file, .html or .pdf (default: report.html)",
    )


def _report(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.optimisation.result_data import message
    from kinetostat.studies.report.answers import gather
    from kinetostat.studies.report.subject import subject_of
    from kinetostat.views.grid_tables import print_written
    from kinetostat.views.progress import progress_bar
    from kinetostat.views.report.writing import Wanted, report_path, write_report
    from kinetostat.views.tables import terminal

    path = report_path(options.output)
    wanted = Wanted(options.ranges, options.without, options.engine, options.author, options.date)
    subject = subject_of(options.subject, options.settings)
    result = _searched(subject.problem, subject.folder) if subject.problem else None
    if result is not None and not result.solved:
        return no_answer(message(result))
    machine = subject.machine if result is None else result.machine
    with progress_bar("computing") as progress:
        answers = gather(machine, wanted.ranges, wanted.without, result, progress)
        if answers.analysis.status is Status.OK:
            named = [options.subject, *(word for text in options.settings for word in ("--set", text))]
            write_report(answers, wanted, named, subject.inputs, path, progress)
    if answers.analysis.status is not Status.OK:
        return no_answer(answers.analysis.message)
    print_written(terminal(), [path])
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

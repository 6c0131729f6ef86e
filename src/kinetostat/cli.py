"""The command line: words to questions, answers to the terminal and to files. No formula lives here.

Imports are late on purpose: `kinetostat --help` must not wait for libraries that only some commands need.
"""

import argparse
import errno
import io
import os
import sys
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.asking import add_grid_commands, add_other_questions
from kinetostat.commands.common import (
    BAD_INPUT,
    DONE,
    Help,
    Parser,
    add_command,
    judge_requirements,
    load_machine,
    no_answer,
    print_json,
    say_stopped,
    takes_machine,
)
from kinetostat.commands.design import add_design_commands
from kinetostat.commands.doctor import add_doctor_command
from kinetostat.commands.documents import add_document_commands
from kinetostat.commands.silence import SilenceWatch, spoken_silence
from kinetostat.spec.errors import InputError
from kinetostat.spec.installation import as_typed
from kinetostat.views.questions import QUESTION_GROUPS

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands

UNWRITABLE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of the system where standard output is a file on a full or failing disk; other files say it by themselves."""

USUAL_ACTIVITY = "computing"
"""Words while a command takes long that has none of its own."""
CHECK_ACTIVITY = "computing; if the pose is out of reach, the nearest one is looked for"
"""Words while a check takes long."""

GROUPS: Mapping[str, tuple[str, ...]] = {
    "machine files": ("list", "new", "schema", "check"),
    **{group: tuple(words) for group, words in QUESTION_GROUPS.items()},
    "comparison and design": ("validate", "compare", "optimize", "pareto"),
    "documents and other programs": ("report", "export", "studio", "reproduce", "doctor"),
}
"""Commands by what they are asked about, in the order in which the help lists them."""

EXAMPLES = """examples:
  kinetostat list
  kinetostat analyze zhang-gosselin-4dof
  kinetostat analyze zhang-gosselin-4dof --set stiffness.passive_links=rigid --json
  kinetostat forward hexapod --actuators "leg 1=96 mm"
  kinetostat path    hexapod poses.csv -o stiffness.csv -o stiffness.png
  kinetostat sweep   zhang-gosselin-4dof --vary "stiffness.passive_links=1e3:1e10:8:log"
  kinetostat map     zhang-gosselin-4dof --over "x=-2 cm:2 cm:41" --over "z=66 cm:70 cm:41" -o maps
  kinetostat optimize zhang-gosselin-2002 -o better
  kinetostat identify hexapod measured.csv --frame -o identified
  kinetostat validate tripteron
  kinetostat report tripteron -o report.html
  kinetostat reproduce
  kinetostat doctor

exit codes: 0 done, 1 the question has no answer or a requirement is not met, 2 bad input, 130 stopped by Ctrl-C
"""
PYTHON_WARNING = warnings.formatwarning
"""Python's own text of a warning, for those that are not of old names."""


class Overview(Help):
    """Help that lists the commands in groups.

    `argparse` offers no public way to order them, hence its private names.
    """

    def _format_action(self, action: argparse.Action) -> str:
        if not isinstance(action, argparse._SubParsersAction):
            return super()._format_action(action)
        lines = {each.dest: self._format_action(each) for each in action._get_subactions()}
        groups = {name: "".join(lines[word] for word in words) for name, words in GROUPS.items()}
        return "".join(f"\n {name}:\n{group}" for name, group in groups.items())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        The exit code, as the end of `EXAMPLES` lists them.
    """
    _prepare_process()
    with spoken_silence("starting") as watch:
        return _run(arguments, watch)


def _run(arguments: Sequence[str] | None, watch: SilenceWatch | None) -> int:
    """Run one command, and say in a sentence why it could not be done."""
    try:
        options = _options(arguments)
        if watch is not None:
            watch.say(getattr(options, "doing", USUAL_ACTIVITY))
            watch.ends_with_any_output = getattr(options, "serves", False)
        code = int(options.run(options))
        sys.stdout.flush()
        return code
    except InputError as error:
        print(f"kinetostat: {as_typed(str(error))}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return say_stopped("files that had been written are complete.")
    except BrokenPipeError:
        _forget_output()
        return DONE
    except OSError as error:
        if error.errno not in UNWRITABLE:
            raise
        _forget_output()
        print(
            f"kinetostat: standard output cannot be written: {error.strerror}; make room, or send it elsewhere.",
            file=sys.stderr,
        )
        return BAD_INPUT


def _prepare_process() -> None:
    """Make printing and drawing work everywhere.

    A closed stream becomes the null device, characters that a terminal lacks become "?", and Matplotlib draws without
    a window system, because figures are only written to files. What has a new name is said in a sentence, without the
    line of the script that started the command.
    """
    os.environ["MPLBACKEND"] = "agg"
    warnings.formatwarning = _sentence_of_warning
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - open until the end
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _sentence_of_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
) -> str:
    if issubclass(category, DeprecationWarning):
        return f"kinetostat: {message}\n"
    return PYTHON_WARNING(message, category, filename, lineno, line)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Read the words of a command; where only the help was wanted, print it, whole, and stop."""
    try:
        return _parser().parse_args(arguments)
    except SystemExit:
        sys.stdout.flush()
        raise


def _forget_output() -> None:
    """Drop what could not be written, so that Python does not try again when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _parser() -> Parser:
    parser = Parser(
        prog="kinetostat",
        description="Compute how stiff a parallel kinematic machine is, where it is weak, and why.",
        epilog=EXAMPLES,
        formatter_class=Overview,
    )
    parser.add_argument("--version", action="store_true", help="print the version and stop")
    parser.set_defaults(run=_version_or_help, parser=parser)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", parser_class=Parser)
    _add_file_commands(commands)
    add_grid_commands(commands)
    add_other_questions(commands)
    add_design_commands(commands)
    add_document_commands(commands)
    add_doctor_command(commands)
    return parser


def _add_file_commands(commands: "Commands") -> None:
    """Add `list`, `new`, `schema` and `check`."""
    add_command(commands, "list", _list, "list bundled machines, bundled studies and families", "kinetostat list")
    _add_new_command(commands)
    schema = add_command(
        commands, "schema", _schema, "print the JSON Schema of machine or study files",
        "kinetostat schema machine > machine.schema.json",
    )  # fmt: skip
    schema.add_argument("what", choices=["machine", "study"], help="kind of file")
    check = add_command(
        commands, "check", _check, "read a machine or study file and show its values", "kinetostat check mine.toml"
    )
    takes_machine(
        check,
        "a machine or study file, the name of a bundled one (see `kinetostat list`), or the folder of a long grid or "
        "search, whose checksums are then compared",
    )
    check.set_defaults(doing=CHECK_ACTIVITY)


def _add_new_command(commands: "Commands") -> None:
    """Add `new`, which prints a file from one of three sources."""
    new = add_command(
        commands, "new", _new, "print a commented machine or study file", "kinetostat new passive-leg-4dof > mine.toml"
    )
    source = new.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "family", metavar="FAMILY", nargs="?",
        help="a family or a bundled machine (see `kinetostat list`), or the word study for a study file",
    )  # fmt: skip
    source.add_argument(
        "--from", metavar="FILE", type=Path, dest="urdf",
        help="convert a URDF with closed loops into a machine written leg by leg",
    )  # fmt: skip
    source.add_argument(
        "--legs-of", metavar="MACHINE",
        help="write a bundled machine or one from a file leg by leg, joint by joint, at its pose",
    )  # fmt: skip


def _version_or_help(options: argparse.Namespace) -> int:
    if options.version:
        from importlib.metadata import version

        print(f"kinetostat {version('kinetostat')}")
    else:
        options.parser.print_help()
    return DONE


def _list(options: argparse.Namespace) -> int:
    from kinetostat.machine.loading import bundled
    from kinetostat.spec.document import head
    from kinetostat.studies.bundled import bundled_studies
    from kinetostat.views.tables import print_machines, print_studies, terminal

    print_machines(terminal(), {name: head(text, name) for name, text in bundled().items()})
    print_studies(terminal(), {name: head(text, name) for name, text in bundled_studies().items()})
    return DONE


def _new(options: argparse.Namespace) -> int:
    if options.urdf is not None:
        from kinetostat.exchange.urdf_import import machine_text

        print(machine_text(options.urdf), end="")
        return DONE
    if options.legs_of is not None:
        from kinetostat.exchange.leg_by_leg import legs_of

        print(legs_of(options.legs_of), end="")
        return DONE
    from kinetostat.machine.loading import template
    from kinetostat.studies.bundled import study_template

    print(study_template() if options.family == "study" else template(options.family), end="")
    return DONE


def _schema(options: argparse.Namespace) -> int:
    from kinetostat.machine.file_schema import machine_schema
    from kinetostat.spec.study import study_schema

    print_json(study_schema() if options.what == "study" else machine_schema())
    return DONE


def _check(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.spec.document import exists
    from kinetostat.studies.analysis import analyze
    from kinetostat.studies.bundled import is_study
    from kinetostat.studies.folder_check import has_checks
    from kinetostat.views.tables import print_machine, terminal

    if exists(Path(options.machine)) and has_checks(Path(options.machine)):
        return _check_folder(Path(options.machine))
    if is_study(options.machine):
        return _check_study(options)
    machine = load_machine(options)
    analysis = analyze(machine)
    print_machine(terminal(), machine, f"The file has no mistake. {analysis.message}")
    code = judge_requirements(machine)
    return no_answer(analysis.message) if analysis.status is not Status.OK else code


def _check_folder(folder: Path) -> int:
    from kinetostat.studies.folder_check import check_folder

    check = check_folder(folder)
    if not check.whole:
        return no_answer(check.sentence)
    print(check.sentence)
    return DONE


def _check_study(options: argparse.Namespace) -> int:
    from kinetostat.studies.optimisation.problem import load_problem
    from kinetostat.views.optimisation import print_study
    from kinetostat.views.tables import terminal

    print_study(terminal(), load_problem(options.machine, options.settings))
    return DONE

"""Any question as a command: its options, its answer on the terminal, and the files of a folder. No formula lives here.

The options of a question are added when its command is used, so that `kinetostat --help` imports no question. Two
commands, `sweep` and `map`, have options of their own: their grids may be shared among processes, and one that does not
fit in memory is computed chunk by chunk into the output folder (`studies.stored_grid`), where it can be resumed.
"""

import argparse
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinetostat.commands.common import (
    MOST_DIGITS,
    NO_ANSWER,
    Help,
    Parser,
    direction,
    drawings_of,
    list_written,
    load_machine,
    note_damage,
    print_result,
    progress_bar,
    say_stopped,
    takes_figures,
    takes_json,
    takes_loaded,
    takes_machine,
    whole_number,
    write_figures,
)
from kinetostat.spec.errors import InputError, choice
from kinetostat.views.question import Option, Question, late
from kinetostat.views.questions import QUESTIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import xarray as xr

    from kinetostat.commands.common import Commands
    from kinetostat.engine.batch import Progress
    from kinetostat.engine.chunks import Compute
    from kinetostat.machine.machine import Machine
    from kinetostat.studies.datasets import GridQuestion
    from kinetostat.studies.stored_grid import StoredGrid
    from kinetostat.studies.tensions import Carrying
    from kinetostat.views.question import Description

MOST_WORKERS = 1024
"""Greatest number of processes that may be asked for: more than any machine has cores, so that more is a mistake."""


def add_question(
    commands: "Commands",
    word: str,
    run: "Callable[[Question, argparse.Namespace], int] | None" = None,
    add_further_options: "Callable[[Parser], None]" = lambda _command: None,
) -> None:
    """Add the command of a question; its options follow when it is used.

    Args:
        commands: the commands to which it is added.
        word: the word of the question.
        run: runs the command with its options and returns the exit code; `ask` if None.
        add_further_options: adds options that the question has on the command line alone.
    """
    summary, place = QUESTIONS[word]
    command = commands.add_parser(word, help=summary, formatter_class=Help)

    def add_options(command: Parser) -> None:
        question: Question = late(place)
        _add_options(command, summary, question)
        add_further_options(command)
        command.set_defaults(run=partial(run or ask, question))

    command.later = add_options


def add_other_questions(commands: "Commands") -> None:
    """Add the commands of all questions that have none yet."""
    for word in QUESTIONS:
        if word not in commands.choices:
            add_question(commands, word)


def _add_options(command: Parser, summary: str, question: Question) -> None:
    """Give a command the description and the options of a question."""
    command.description = f"{summary[0].upper()}{summary[1:]}."
    command.epilog = f"example:\n  {question.example}\n"
    command.set_defaults(doing=question.slow)
    takes_machine(command)
    for option in question.options:
        _add_option(command, option)
    if question.loaded:
        takes_loaded(command, question.loaded)
    if question.full:
        command.add_argument("--full", action="store_true", help=question.full)
    if question.suffixes:
        command.add_argument(
            "-o", "--output", help=question.output, metavar="FILE", type=Path, action="append", default=[]
        )
    elif question.output:
        takes_figures(command, question.output)
    takes_json(command)


def _add_option(command: Parser, option: Option) -> None:
    """Add an option, or a word that stands after the machine; `settings` are those of argparse's `add_argument`."""
    settings: dict[str, Any] = {"help": option.meaning}
    if option.kind == "flag":
        command.add_argument(option.flag, action="store_true", dest=option.name, **settings)
        return
    settings["type"] = READERS.get(option.kind, str)
    settings["default"] = list(option.default or ()) if option.many else option.default
    if option.choices:
        settings["choices"] = option.choices
    else:
        settings["metavar"] = option.metavar or METAVARS.get(option.kind, option.name.upper())
    if option.many:
        settings["action"] = "append"
    if option.first:
        settings |= {} if option.required else {"nargs": "?"}
        command.add_argument(option.name, **settings)
        return
    command.add_argument(option.flag, dest=option.name, required=option.required, **settings)
    for former in option.former:
        settings |= {
            "help": argparse.SUPPRESS, "action": partial(_FormerName, option.flag), "default": argparse.SUPPRESS,
        }  # fmt: skip
        command.add_argument(former, dest=option.name, **settings)


class _FormerName(argparse.Action):
    """A former name of an option: it works, and says what the option is called now."""

    def __init__(self, current: str, **options: Any) -> None:
        super().__init__(**options)
        self.current = current

    def __call__(self, _parser: Any, namespace: Any, values: Any, option: str | None = None) -> None:
        print(f"kinetostat: {option} is now called {self.current}.", file=sys.stderr)
        setattr(namespace, self.dest, values)


def _count(text: str) -> int:
    return whole_number(text, f"a number; give a whole number of at most {MOST_DIGITS} digits")


READERS = {"direction": direction, "count": _count, "number": float, "file": Path}
"""Functions that read the words of an option, by its kind; others stay texts."""
METAVARS = {"direction": "X,Y,Z", "count": "N", "number": "NUMBER", "file": "FILE"}


def ask(question: Question, options: argparse.Namespace) -> int:
    """Ask a question with the options of its command, and show the answer.

    Returns:
        The exit code.

    Raises:
        InputError: what the question refuses, in the words of the command line.
    """
    files = options.output if question.suffixes else []
    for path in files:
        choice(path.suffix.lower(), question.suffixes, f'the suffix of "{path}"')
    overrides, arguments = question.arguments({each.name: getattr(options, each.name) for each in question.options})
    machine = load_machine(options, overrides)
    try:
        if question.reports_progress:
            with progress_bar(question.slow) as progress:
                answer = question.answer(machine, **arguments, progress=progress)
        else:
            answer = question.answer(machine, **arguments)
    except InputError as error:
        raise InputError(_with_flag(question, str(error))) from None
    return show_answer(options, answer, to_files=bool(question.suffixes))


def show_answer(options: argparse.Namespace, answer: Any, to_files: bool = False) -> int:
    """Write the files of an answer where the options name a place, and print it.

    Args:
        options: the options of the command; `output` and `full` count as not given where the command has none.
        answer: an answer of a kind that has a description.
        to_files: whether `--output` is a list of files instead of a folder.

    Returns:
        The exit code.

    Raises:
        InputError: a folder is given for an answer that has neither files nor figures.
    """
    from kinetostat.views.answers import description_of
    from kinetostat.views.data_forms import json_of
    from kinetostat.views.tables import print_answer

    description, output = description_of(answer), getattr(options, "output", None)
    answered, message = description.answered(answer), getattr(answer, "message", "")
    full, written = getattr(options, "full", False), []
    if output and description.undrawn:
        raise InputError(description.undrawn)
    if output and (answered or not message):
        written = (_write_named_files if to_files else write_folder)(options, description, answer)
    code = print_result(
        options,
        answered,
        lambda: json_of(description, answer),
        lambda console: print_answer(console, description, answer, full),
        written,
        message=message,
    )
    return code if description.kept(answer) else NO_ANSWER


def _with_flag(question: Question, message: str) -> str:
    """Return a message with the option of the command line for the argument of Python with which it may begin."""
    first_word, space, rest = message.partition(" ")
    flags = {option.name: option.flag for option in question.options if not option.first}
    return f"{flags.get(first_word, first_word)}{space}{rest}"


def _write_named_files(options: argparse.Namespace, description: "Description", answer: Any) -> list[Path]:
    """Write an answer to files in the form that the suffix of each says; pictures are of its first figure."""
    from kinetostat.views.answers import FIGURE_SUFFIXES, save

    paths: list[Path] = options.output
    for path in paths:
        is_picture = path.suffix.lower() in FIGURE_SUFFIXES
        save(next(iter(drawings_of(description, answer).values()))() if is_picture else answer, path)
    return paths


def write_folder(options: argparse.Namespace, description: "Description", answer: Any) -> list[Path]:
    """Write the files and the figures of an answer into the folder of `--output`; return their paths."""
    from kinetostat.views.answers import write_files

    written = write_files(description, answer, options.output)
    drawings = {
        draw.file or f"{description.figure_prefix}{name}": draw
        for name, draw in drawings_of(description, answer).items()
    }
    return written + write_figures(options, drawings)


def add_grid_commands(commands: "Commands") -> None:
    """Add `sweep` and `map`."""
    for word in ("sweep", "map"):
        add_question(commands, word, partial(_ask_grid, word), _add_grid_options)


def _add_grid_options(command: Parser) -> None:
    """Add the options that say where a grid is computed, and whether it goes on."""
    command.add_argument(
        "--resume", action="store_true",
        help="for grids of over 5 million points: continue the one in the output folder, and refuse if there "
        "is none; without this option the command continues or begins",
    )  # fmt: skip
    place = command.add_mutually_exclusive_group()
    place.add_argument("--workers", metavar="N", type=_workers, help="compute in N processes on this machine")
    place.add_argument("--cluster", metavar="ADDRESS", help="compute on a Dask cluster, e.g. tcp://10.0.0.1:8786")


def _workers(text: str) -> int:
    return whole_number(text, f"a number of processes; give 1 to {MOST_WORKERS}", 1, MOST_WORKERS)


def _ask_grid(word: str, question: Question, options: argparse.Namespace) -> int:
    """Ask as any question is asked, but answer by `_answer_grid`, which knows these options; return the exit code."""
    try:
        return ask(replace(question, answer=partial(_answer_grid, word, question, options)), options)
    except KeyboardInterrupt:
        from kinetostat.studies.study_folder import holds_study

        if not options.output or not holds_study(options.output):
            raise
        return say_stopped(f"the results so far are in {options.output}; the same command continues from there.")


def _answer_grid(
    word: str,
    question: Question,
    options: argparse.Namespace,
    machine: "Machine",
    ranges: "Sequence[str]",
    progress: "Progress",
    quantities: "Sequence[str]" = (),
    carrying: bool = False,
) -> "xr.Dataset | Carrying | StoredGrid":
    """Compute a grid by as many processes as the options say: in memory, or into the folder if it is too large.

    What `ask` passes by name, `machine` to `carrying`, are the arguments of the question itself.
    """
    from kinetostat.engine.chunks import Crew, compute_with
    from kinetostat.studies.datasets import answer
    from kinetostat.views.grid import CARRYING_ALONE, map_question, sweep_question

    if carrying:
        if options.workers or options.cluster or options.resume:
            raise InputError(CARRYING_ALONE)
        carried: Carrying = question.answer(machine, ranges, progress, quantities, carrying)
        return carried
    grid_question = (sweep_question if word == "sweep" else map_question)(machine, ranges, quantities)
    with compute_with(Crew(options.workers, options.cluster)) as compute:
        if options.output and not grid_question.fits_memory:
            return _answer_into_folder(options, grid_question, word, progress, compute)
        if options.output:
            _check_folder(options.output, options.resume)
        return answer(grid_question, progress, compute)


def _check_folder(folder: Path, resume: bool) -> None:
    """Refuse to write a grid that is kept in memory over a study in a folder, or to resume it."""
    from kinetostat.studies.study_folder import holds_study

    if holds_study(folder):
        raise InputError(f'"{folder}" holds the study of a larger grid; choose another folder with -o.')
    if resume:
        raise InputError("a grid that is kept in memory is computed at once and cannot be resumed; leave out --resume.")


def _answer_into_folder(
    options: argparse.Namespace, question: "GridQuestion", word: str, progress: "Progress", compute: "Compute"
) -> "StoredGrid":
    """Compute a large grid into the folder, or continue the one there, and say what was repaired and written."""
    from kinetostat.studies.storage import differing
    from kinetostat.studies.stored_grid import answer_into
    from kinetostat.studies.study_folder import COPY, HISTORY, QUESTION

    changed = differing(options.output)
    stored = answer_into(question, options.output, word, progress, compute, options.resume)
    note_damage(options.output, stored.repaired, stored.unchecked, changed)
    list_written(options.output, [*(options.output / name for name in (QUESTION, COPY, HISTORY)), stored.path])
    return stored

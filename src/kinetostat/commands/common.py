"""Parts that commands share: exit codes, options, reading of machines, progress, output of results.

No command is known here. What is not needed for `--help` is imported late, so that the help appears at once.
"""

import argparse
import json
import re
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

from kinetostat.late import leave_out_property_lists, postpone_glyph_names
from kinetostat.spec.installation import as_typed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import TypeAlias

    from matplotlib.figure import Figure
    from rich.console import Console

    from kinetostat.machine.machine import Machine
    from kinetostat.views.question import Description, Drawing

    Commands: TypeAlias = argparse._SubParsersAction["Parser"]

DONE, NO_ANSWER, BAD_INPUT, STOPPED = 0, 1, 2, 130
"""Exit codes; the last is that of shells for what Ctrl-C has ended."""
MACHINE_HELP = "a machine file, or the name of a bundled machine (see `kinetostat list`)"
MOST_DIGITS = 9
"""Digits of the whole numbers that options take: a billion of anything would never end."""
FIGURE_FORMATS = ("png", "svg", "pdf")
"""Formats in which a command writes figures, the usual one first."""
FILE_SUFFIXES = {".csv", ".html", ".json", ".nc", ".pdf", ".png", ".svg", ".toml"}
"""Suffixes by which `--output` means a file, although a folder may have any name."""
LOCAL_HOSTS = ("127.0.0.1", "localhost", "::1")
"""Addresses that only this computer can reach."""
PROGRESS_SECONDS = 600.0
"""Seconds of progress of which the remaining time is estimated: several chunks, even where each takes minutes."""
_WORDS = re.compile(r"""(?:-[\w-]+ (?!-))?(?:[^\s"']|"[^"]*"|'[^']*')+""")
"""Words of a command: an option with its value, what stands in quotes, or any other word."""
BESIDE_WORDS = 5
"""Characters of a line of an example besides its words: three blanks before the last, and a blank and a backslash."""


class Help(argparse.RawDescriptionHelpFormatter):
    """Help whose commands can be typed as they stand, broken between words, in examples by a backslash."""

    def _expand_help(self, action: argparse.Action) -> str:
        return as_typed(super()._expand_help(action))

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_long_words=False, break_on_hyphens=False)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n".join(part for line in as_typed(text).splitlines() for part in _lines_within(indent + line, width))


def _lines_within(line: str, width: int) -> list[str]:
    """Return a line of the help in as many lines as it needs; an example begins with blanks."""
    if len(line) <= width:
        return [line]
    if not line.startswith(" "):
        return textwrap.wrap(line, width, break_long_words=False, break_on_hyphens=False)
    lines = [""]
    for word in _WORDS.findall(line):
        if lines[-1] and len(lines[-1]) + len(word) + BESIDE_WORDS > width:
            lines.append("   ")
        lines[-1] += f" {word}" if lines[-1] else word
    return [*(f"  {part} \\" for part in lines[:-1]), f"  {lines[-1]}"]


class Parser(argparse.ArgumentParser):
    """An argument parser that reports mistakes in one readable paragraph, and whose options may be added when needed.

    Attributes:
        later: adds its options and its description; it is called once, before anything is parsed or listed.
    """

    later: "Callable[[Parser], None] | None" = None

    def fill(self) -> None:
        """Add what is to be added later."""
        later, self.later = self.later, None
        if later is not None:
            later(self)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse the words of a command."""
        self.fill()
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Print what is wrong and where the help is; exit with code 2."""
        self.exit(BAD_INPUT, as_typed(f"{self.prog}: {message}. Help: `{self.prog} --help`\n"))


def add_command(commands: "Commands", name: str, run: object, text: str, example: str) -> Parser:
    """Add a command: its name, the function that runs it, one line about it, and an example."""
    command = commands.add_parser(
        name,
        help=text,
        description=f"{text[0].upper()}{text[1:]}.",
        epilog=f"example:\n  {example}\n",
        formatter_class=Help,
    )
    command.set_defaults(run=run)
    return command


def takes_machine(command: Parser, meaning: str = MACHINE_HELP, default: str | None = None) -> None:
    """Give a command the machine, which must be named if there is no default, with `--set` and `--units`."""
    command.add_argument("machine", metavar="MACHINE", nargs="?" if default else None, default=default, help=meaning)
    takes_settings(command, 'override a field, e.g. --set geometry.base_radius="26 cm"; repeatable')
    takes_units(command)


def takes_loaded(command: Parser, meaning: str) -> None:
    """Give a command `--loaded`, which does for one call what `state = "loaded"` in [load] does for a file."""
    command.add_argument(
        "--loaded", action="store_true", help=f'{meaning} (default where [load] says state = "loaded")'
    )


def takes_units(command: Parser) -> None:
    """Give a command `--units`."""
    command.add_argument(
        "--units", metavar="UNITS", default="",
        help='units of printed and drawn results, e.g. --units "mm, deg, N/um, N*m/urad" or --units si (default: those '
        "of [display] in the machine file, else N/um, N*m/urad, mm, deg); JSON and data files are always in SI",
    )  # fmt: skip


def takes_settings(command: Parser, meaning: str) -> None:
    """Give a command `--set`."""
    command.add_argument("--set", metavar="PATH=VALUE", action="append", default=[], dest="settings", help=meaning)


def takes_ranges(command: Parser, meaning: str) -> None:
    """Give a command `--over`: coordinates of the pose and their ranges."""
    command.add_argument(
        "--over", metavar="FIELD=from:to:count", action="append", default=[], dest="ranges", help=meaning
    )


def takes_output(command: Parser, contents: str) -> None:
    """Give a command `--output`, a folder, which may be given once."""
    command.add_argument("-o", "--output", type=_folder, action=_Once, help=f"folder for {contents}")


def _folder(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() in FILE_SUFFIXES and not path.is_dir():
        folder = path.with_suffix("")
        raise argparse.ArgumentTypeError(
            f'{text} is the name of a file, and this command writes a folder of files; give it as "-o {folder}"'
        )
    return path


class _Once(argparse.Action):
    """An option that may be given once: of two folders, one would be left out without a word."""

    def __call__(self, _parser: Any, namespace: argparse.Namespace, values: Any, _option: Any = None) -> None:
        if (before := getattr(namespace, self.dest)) is not self.default:
            raise argparse.ArgumentError(self, f"given twice, as {before} and as {values}; give one folder")
        setattr(namespace, self.dest, values)


def takes_figures(command: Parser, contents: str) -> None:
    """Give a command `--output` and `--formats`."""
    takes_output(command, contents)
    command.add_argument(
        "--formats", metavar="LIST", type=_formats, default=FIGURE_FORMATS[:1],
        help=f"formats of the figures, separated by commas: {', '.join(FIGURE_FORMATS)} (default: {FIGURE_FORMATS[0]})",
    )  # fmt: skip


def _formats(text: str) -> tuple[str, ...]:
    formats = tuple(dict.fromkeys(part.strip().lower().removeprefix(".") for part in text.split(",")))
    if not set(formats) <= set(FIGURE_FORMATS):
        raise argparse.ArgumentTypeError(f"{text} is not a list of formats; give some of {','.join(FIGURE_FORMATS)}")
    return formats


def drawings_of(description: "Description", answer: object) -> "dict[str, Drawing]":
    """Return the figures of an answer, and prepare Matplotlib for a process that writes them and ends."""
    if description.figures:
        leave_out_property_lists()
        postpone_glyph_names()
    return description.drawings(answer)


def write_figures(options: argparse.Namespace, drawings: "Mapping[str, Callable[[], Figure]]") -> list[Path]:
    """Draw figures and write them in the formats asked for; a bar says which one is being drawn.

    Args:
        options: the options of the command, with `--output` and `--formats`.
        drawings: functions that draw the figures, by the name of the file without its suffix.

    Returns:
        The files.
    """
    from kinetostat.views.figures import save

    with progress_bar("drawing") as progress:
        return save(drawings, options.output, options.formats, progress)


def direction(text: str) -> tuple[float, ...]:
    """Read a direction, three numbers with commas, as an option of the command line."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not a direction; give three numbers, e.g. 0,0,1") from None
    return x, y, z


def whole_number(text: str, refusal: str, least: int = 0, most: int = 10**MOST_DIGITS - 1) -> int:
    """Read a whole number between two bounds as an option of the command line.

    Args:
        text: the word of the option.
        refusal: follows the word in the message where it is refused: "a port; give a number from 1 to 65535".
        least: the least number allowed.
        most: the greatest number allowed.
    """
    if not text.isdecimal() or len(text) > MOST_DIGITS or not least <= int(text) <= most:
        raise argparse.ArgumentTypeError(f"{text} is not {refusal}")
    return int(text)


def takes_json(command: Parser) -> None:
    """Give a command `--json`."""
    command.add_argument("--json", action="store_true", help="print the result as JSON and nothing else")


def load_machine(options: argparse.Namespace, more: "Sequence[str]" = ()) -> "Machine":
    """Load the machine that the options name, with their overrides and then with more of them.

    Raises:
        InputError: there is no such machine, or the file or an override has a mistake.
    """
    from kinetostat.machine.loading import STUDY_REFUSAL, bundled, load
    from kinetostat.spec.document import exists
    from kinetostat.spec.errors import InputError

    if options.machine not in bundled() and not exists(Path(options.machine)):
        from kinetostat.studies.bundled import bundled_studies

        if options.machine in bundled_studies():
            raise InputError(f'"{options.machine}" {STUDY_REFUSAL}')
    return as_wanted(options, load(options.machine, [*options.settings, *more]))


def as_wanted(options: argparse.Namespace, machine: "Machine") -> "Machine":
    """Return a machine with the units of `--units`, and at rest under its loads where `--loaded` says so."""
    machine = replace(machine, loaded=True) if getattr(options, "loaded", False) else machine
    return machine.in_units(options.units) if options.units else machine


def print_json(data: object) -> None:
    """Print plain data as JSON, with escapes where the output does not know all characters."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    print(json.dumps(data, ensure_ascii=not encoding.lower().startswith("utf"), allow_nan=False, indent=1))


def print_result(
    options: argparse.Namespace,
    answered: bool,
    as_data: "Callable[[], object]",
    show: "Callable[[Console], None]",
    written: "Sequence[Path]" = (),
    message: str = "",
) -> int:
    """Print a result and the names of the files that were written, and keep their checksums in their folder.

    Args:
        options: the options of the command; with `--json` the result is printed as data.
        answered: whether there is a result.
        as_data: gives the result as plain data.
        show: prints the result on a terminal.
        written: files to name after the result.
        message: printed instead of the result where there is none; if empty, the result is printed all the same.

    Returns:
        The exit code.
    """
    list_written(getattr(options, "output", None), written)
    if options.json:
        print_json(as_data())
    elif message and not answered:
        return no_answer(message)
    else:
        from kinetostat.views.tables import print_written, terminal

        console = terminal()
        show(console)
        print_written(console, written)
    return DONE if answered else NO_ANSWER


def list_written(output: object, written: "Sequence[Path]") -> None:
    """Note the checksums of written files in their folder, if it is the output or has such a list already.

    Args:
        output: the output of the command, a folder or something else.
        written: the files.
    """
    if not written:
        return
    from kinetostat.studies.storage import LIST, list_files

    for folder in {path.parent for path in written}:
        if folder == output or (folder / LIST).exists():
            list_files(folder, written)


def note_damage(folder: Path, repaired: str, unchecked: bool, changed: "Sequence[str]") -> None:
    """Print on stderr what was damaged in the folder of a study and has been computed again.

    Args:
        folder: the folder of the study.
        repaired: the damage that was repaired, in words; empty if there was none.
        unchecked: whether the folder was begun without checksums.
        changed: names of its files that were missing or not as they had been written, and have been written again.
    """
    parts = [part for part in (repaired, *changed) if part]
    if parts:
        print(f'kinetostat: "{folder}" had been damaged; computed again: {", ".join(parts)}.', file=sys.stderr)
    if unchecked:
        print(
            f'kinetostat: "{folder}" was begun without checksums, by an earlier version; damage in it cannot be seen.',
            file=sys.stderr,
        )


class ShownProgress(Protocol):
    """Shows how much of the work is done, of how much, and perhaps a few words on its state."""

    def __call__(self, done: int, total: int, words: str = "", /) -> None: ...


@contextmanager
def progress_bar(activity: str) -> Iterator[ShownProgress]:
    """Show a bar on stderr with the remaining time; show nothing where stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(
        *columns, console=Console(stderr=True), transient=True, speed_estimate_period=PROGRESS_SECONDS
    ) as bar:
        task = bar.add_task(activity, total=None)
        yield lambda done, total, words="": bar.update(
            task, completed=done, total=total, description=f"{activity} {words}".rstrip()
        )


def judge_requirements(machine: "Machine", printing: bool = True) -> int:
    """Judge the requirements of a machine's file, print the verdicts, and return the exit code.

    Args:
        machine: the machine; without requirements there is nothing to judge or to print.
        printing: whether the verdicts are printed, which they are not beside JSON.
    """
    if not machine.requirements:
        return DONE
    from kinetostat.studies.requirements import requirements

    verdicts = requirements(machine)
    if printing:
        from kinetostat.views.tables import print_requirements, terminal

        print_requirements(terminal(), verdicts, machine.display)
    return DONE if all(verdict.met for verdict in verdicts) else NO_ANSWER


def no_answer(message: str) -> int:
    """Print why there is no result; return the exit code."""
    print(f"kinetostat: {as_typed(message)}", file=sys.stderr)
    return NO_ANSWER


def say_stopped(message: str) -> int:
    """Print what remains of a command that was stopped; return the exit code."""
    print(f"\nkinetostat: stopped; {message}", file=sys.stderr)
    return STOPPED

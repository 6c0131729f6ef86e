"""The commands `sweep` and `map`: asked as any question, but with many processes, and large grids into a folder.

A grid that does not fit in memory is answered chunk by chunk into the output folder (`studies.stored_grid`), where it
can be stopped and resumed. No formula lives here.
"""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.asking import add_question, ask
from kinetostat.commands.common import list_written, note_damage, say_stopped

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from kinetostat.commands.common import Commands, Parser
    from kinetostat.engine.batch import Progress
    from kinetostat.engine.chunks import Compute
    from kinetostat.machine.machine import Machine
    from kinetostat.studies.datasets import GridQuestion
    from kinetostat.studies.stored_grid import StoredGrid
    from kinetostat.studies.tensions import Carrying
    from kinetostat.views.question import Question

MOST_WORKERS = 1024
"""Greatest number of processes that may be asked for: more than any machine has cores, so that more is a mistake."""


def add_grid_commands(commands: "Commands") -> None:
    """Add `sweep` and `map`."""
    for word in ("sweep", "map"):
        add_question(commands, word, partial(_ask, word), _add_options)


def _add_options(command: "Parser") -> None:
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
    if not text.isdecimal() or not 1 <= int(text[:9]) <= MOST_WORKERS:
        raise argparse.ArgumentTypeError(f"{text} is not a number of processes; give 1 to {MOST_WORKERS}")
    return int(text)


def _ask(word: str, question: "Question", options: argparse.Namespace) -> int:
    """Ask as any question is asked, but answer by `_answer`, which knows these options; return the exit code."""
    try:
        return ask(replace(question, answer=partial(_answer, word, question, options)), options)
    except KeyboardInterrupt:
        from kinetostat.studies.study_folder import holds_study

        if not options.output or not holds_study(options.output):
            raise
        return say_stopped(f"the results so far are in {options.output}; the same command continues from there.")


def _answer(
    word: str,
    question: "Question",
    options: argparse.Namespace,
    machine: "Machine",
    ranges: "Sequence[str]",
    progress: "Progress",
    quantities: "Sequence[str]" = (),
    carrying: bool = False,
) -> "xr.Dataset | Carrying | StoredGrid":
    """Compute a grid by the processes that are wanted: in memory, or into the folder if it is too large for that."""
    from kinetostat.engine.chunks import Crew, compute_with
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.datasets import answer
    from kinetostat.views.grid import CARRYING_ALONE, map_question, sweep_question

    if carrying:
        if options.workers or options.cluster or options.resume:
            raise InputError(CARRYING_ALONE)
        answered: Carrying = question.answer(machine, ranges, progress, quantities, carrying)
        return answered
    wanted = (sweep_question if word == "sweep" else map_question)(machine, ranges, quantities)
    with compute_with(Crew(options.workers, options.cluster)) as compute:
        if options.output and not wanted.fits_memory:
            return _answer_into_folder(options, wanted, word, progress, compute)
        if options.output:
            _check_folder(options.output, options.resume)
        return answer(wanted, progress, compute)


def _check_folder(folder: Path, resume: bool) -> None:
    """Refuse to write a grid that is kept in memory over a study in a folder, or to resume it."""
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.study_folder import holds_study

    if holds_study(folder):
        raise InputError(f'"{folder}" holds the study of a larger grid; choose another folder with -o.')
    if resume:
        raise InputError("a grid that is kept in memory is computed at once and cannot be resumed; leave out --resume.")


def _answer_into_folder(
    options: argparse.Namespace, question: "GridQuestion", word: str, progress: "Progress", compute: "Compute"
) -> "StoredGrid":
    """Compute a large grid into the folder, or go on with it, and say what was repaired and written there."""
    from kinetostat.studies.storage import differing
    from kinetostat.studies.stored_grid import answer_into
    from kinetostat.studies.study_folder import COPY, HISTORY, QUESTION

    changed = differing(options.output)
    stored = answer_into(question, options.output, word, progress, compute, options.resume)
    note_damage(options.output, stored.repaired, stored.unchecked, changed)
    list_written(options.output, [*(options.output / name for name in (QUESTION, COPY, HISTORY)), stored.path])
    return stored

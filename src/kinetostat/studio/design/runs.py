"""Searches, each in its own process and folder: start, stop, resume, list, delete, and what the process does.

The process is `python -m kinetostat.studio.design.runs`. It is started before a search needs it, because importing
takes longer than the first steps. It ends after its present step when its standard input is closed, which also happens
when the server that started it dies: no search runs on unnoticed.
"""

import json
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Hashable
from enum import StrEnum
from pathlib import Path
from typing import IO

from kinetostat.frozen import dataclass
from kinetostat.late import hide_array_libraries
from kinetostat.spec.errors import InputError
from kinetostat.studies.folder_check import RESULT_FILE
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.search import begin_search, optimize, stored_problem
from kinetostat.studies.storage import write_text
from kinetostat.studies.study_folder import holds_study, in_use, read_history, read_question
from kinetostat.studio.design.state_folder import RUNS, numbered_entries, slug
from kinetostat.studio.processes import make_modest
from kinetostat.views.optimisation import write_result

MOST_RUNNING = 2
"""Searches at a time; each of them uses all cores. A tab has one, so that none keeps the others from searching."""
MOST_RUNS = 60
"""Searches that are kept: more than anybody reads in a list."""
SEARCHING_PROGRAM = "kinetostat.studio.design.runs"
"""The module that a searching process runs: this one, by its name, because `__name__` is not it in that process."""
FAILURE_FILE = "failed.txt"
"""File in the folder of a search that could not go on, with the reason."""
UNREADABLE = (OSError, ValueError, KeyError, IndexError, TypeError, AttributeError)
"""Exceptions that reading a damaged folder of a search may raise."""


class Stage(StrEnum):
    """The stage of a search."""

    RUNNING = "running"
    STOPPING = "stopping"
    STOPPED = "stopped"
    DONE = "done"
    FAILED = "failed"
    DAMAGED = "damaged"

    @property
    def active(self) -> bool:
        """Whether a process works on it."""
        return self in (Stage.RUNNING, Stage.STOPPING)


@dataclass(frozen=True)
class Run:
    """A search that is kept.

    Attributes:
        number: the number of the search.
        folder: the folder of its problem, its records and its result.
        name: the name of its study.
        stage: its stage at the time of the listing.
    """

    number: int
    folder: Path
    name: str
    stage: Stage


@dataclass(frozen=True)
class _Worker:
    """A process that searches in a folder, or waits for one, and the tab that asked for the search."""

    process: subprocess.Popen[bytes]
    tab: Hashable = None

    @property
    def has_ended(self) -> bool:
        return self.process.poll() is not None

    @property
    def is_stopping(self) -> bool:
        """Whether it has been asked to end."""
        return self._input.closed

    @property
    def _input(self) -> IO[bytes]:
        if self.process.stdin is None:
            raise ValueError("a worker is started with a pipe to its standard input")
        return self.process.stdin

    def hand(self, folder: Path) -> None:
        """Tell it in which folder to search."""
        self._input.write(f"{json.dumps(str(folder))}\n".encode())
        self._input.flush()

    def stop(self) -> None:
        """Ask it to end after its present step."""
        self._input.close()


class Runs:
    """All searches of a state folder; a server has one such object, which knows the processes it started."""

    def __init__(self, state: Path) -> None:
        """Searches below `state`; nothing is written before the first one."""
        self._folder = state / RUNS
        self._workers: dict[Path, _Worker] = {}  # by the folder of the search that each was given last
        self._spare: _Worker | None = None
        self._names: dict[Path, str] = {}
        self._lock = threading.Lock()

    def prepare(self) -> None:
        """Let a process start that the next search takes, so that its first steps need not wait for the start."""
        if self._spare is None or self._spare.has_ended:
            self._spare = _Worker(_started_process())

    def entries(self) -> list[Run]:
        """Return all searches, the latest first; none from a folder that cannot be read."""
        runs = (self._read_entry(number, path) for number, path in numbered_entries(self._folder).items())
        return [run for run in runs if run is not None]

    def entry(self, number: int) -> Run:
        """Return the search of this number.

        Raises:
            InputError: it has been deleted.
        """
        path = numbered_entries(self._folder).get(number)
        run = None if path is None else self._read_entry(number, path)
        if run is None:
            raise InputError(f"search {number} has been deleted; choose another one.")
        return run

    def _read_entry(self, number: int, path: Path) -> Run | None:
        """Return what the list shows of a folder, which may be damaged; None if no search has begun in it."""
        try:
            return Run(number, path, self._name(path), self._stage(path)) if holds_study(path) else None
        except UNREADABLE:
            return Run(number, path, path.name, Stage.DAMAGED)

    def start(self, problem: Problem, tab: Hashable = None) -> Run:
        """Begin a search in a new process, and return at once.

        Args:
            problem: the problem to solve.
            tab: the key of the tab that asks for it; None where no tab does.

        Raises:
            InputError: too many searches run or are kept, this tab has one, or the folder cannot be written.
        """
        with self._lock:
            self._check_free(tab)
            present = numbered_entries(self._folder)
            if len(present) >= MOST_RUNS:
                raise InputError(f"{MOST_RUNS} searches are kept, the most there may be; delete one of them.")
            number = max(present, default=0) + 1
            folder = self._folder / f"{number:04d}-{slug(problem.study.name, 'study')}"
            begin_search(problem, folder)
            self._hand_to_worker(folder, tab)
        return self.entry(number)

    def resume(self, number: int, tab: Hashable = None) -> None:
        """Resume a search that was stopped.

        Args:
            number: the number of the search.
            tab: the key of the tab that asks, as for `start`.

        Raises:
            InputError: too many searches run, this tab has one, or this search runs already or is done.
        """
        with self._lock:
            run = self.entry(number)
            if run.stage not in (Stage.STOPPED, Stage.FAILED):
                raise InputError(f"search {number} is {run.stage}; only a search that was stopped can be resumed.")
            self._check_free(tab)
            self._hand_to_worker(run.folder, tab)

    def stop(self, number: int) -> None:
        """Let a search end after its present step; all results are kept.

        Raises:
            InputError: another studio started it.
        """
        run = self.entry(number)
        worker = self._workers.get(run.folder)
        if run.stage.active and worker is None:
            raise InputError(f"search {number} was started by another studio, which still runs; stop it there.")
        if worker is not None:
            worker.stop()

    def delete(self, number: int) -> None:
        """Delete a search that is not running.

        Raises:
            InputError: it is running.
        """
        with self._lock:
            run = self.entry(number)
            if run.stage.active:
                raise InputError(f"search {number} is {run.stage}; stop it before it is deleted.")
            shutil.rmtree(run.folder, ignore_errors=True)
            # A later search may have the same number and folder, but another name and another process.
            self._names.pop(run.folder, None)
            if worker := self._workers.pop(run.folder, None):
                worker.stop()

    def close(self) -> None:
        """Let all searches of this server end after their present step."""
        spare = [] if self._spare is None else [self._spare]
        for worker in [*self._workers.values(), *spare]:
            worker.stop()

    def wait(self, number: int) -> None:
        """Wait until the process of a search of this server has ended."""
        worker = self._workers.get(self.entry(number).folder)
        if worker is not None:
            worker.process.wait()

    def _check_free(self, tab: Hashable) -> None:
        """Refuse a further search if the tab has one, or if as many run as may."""
        active = [run for run in self.entries() if run.stage.active]
        for run in active:
            worker = self._workers.get(run.folder)
            if tab is not None and worker is not None and worker.tab == tab:
                raise InputError(
                    f"search {run.number} ({run.name}) of this tab is {run.stage}; a tab has one search at a time, so "
                    "that others can search as well: wait until it is done, or stop it."
                )
        if len(active) >= MOST_RUNNING:
            names = " and ".join(f"{run.number} ({run.name})" for run in active)
            raise InputError(f"searches {names} are running; wait until one of them is done, or stop one.")

    def _hand_to_worker(self, folder: Path, tab: Hashable) -> None:
        """Let the spare process search in a folder, or a new one if there is none."""
        (folder / FAILURE_FILE).unlink(missing_ok=True)
        if folder in self._workers:
            self._workers[folder].stop()
        spare, self._spare = self._spare, None
        process = _started_process() if spare is None or spare.has_ended else spare.process
        self._workers[folder] = _Worker(process, tab)
        self._workers[folder].hand(folder)

    def _stage(self, folder: Path) -> Stage:
        worker = self._workers.get(folder)
        if worker is not None and not worker.has_ended:
            return Stage.STOPPING if worker.is_stopping else Stage.RUNNING
        if worker is None and in_use(folder):
            return Stage.RUNNING
        if (folder / FAILURE_FILE).exists():
            return Stage.FAILED
        return Stage.DONE if _is_complete(folder) else Stage.STOPPED

    def _name(self, folder: Path) -> str:
        """Return the name of the study, read once; that of its folder where it cannot be read."""
        if folder not in self._names:
            try:
                self._names[folder] = str(read_question(folder)["optimisation"]["name"])
            except (InputError, KeyError, TypeError):
                return folder.name
        return self._names[folder]


def _is_complete(folder: Path) -> bool:
    """Return whether all steps are done and the result is written."""
    steps, _ = read_history(folder)
    return bool(steps) and len(steps) >= steps[-1].get("of", len(steps)) and (folder / RESULT_FILE).exists()


def _started_process() -> subprocess.Popen[bytes]:
    """Start a process that waits for the folder of a search."""
    words = [sys.executable, "-m", SEARCHING_PROGRAM]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    make_modest(process.pid)
    return process


def search_until_input_ends() -> None:
    """Search on from the records in a folder until a step after the standard input ends, and write the result so far.

    The folder is the first line of the standard input, which comes when a search needs the process, or never.
    """
    line = sys.stdin.buffer.readline()
    if not line:
        return
    folder, stopped = Path(json.loads(line)), threading.Event()
    threading.Thread(target=_wait_for_end_of_input, args=(stopped,), daemon=True).start()
    try:
        write_result(optimize(stored_problem(folder), folder, stop=stopped.is_set), folder)
    except InputError as error:
        if not in_use(folder):  # otherwise another process is at work here, and the search is not a failure
            write_text(folder / FAILURE_FILE, str(error))
    except Exception as error:
        write_text(folder / FAILURE_FILE, f"The search ended with an error of the program: {error!r}")
        raise


def _wait_for_end_of_input(stopped: threading.Event) -> None:
    """Ask the search to stop after its step once the server has closed the standard input."""
    sys.stdin.buffer.read()
    stopped.set()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in the terminal is for the server, which closes the input
    hide_array_libraries()
    search_until_input_ends()

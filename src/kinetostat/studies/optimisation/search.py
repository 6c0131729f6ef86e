"""`optimize` and the searches behind it: step by step, in memory or into a study folder, from where it was stopped."""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from kinetostat.display import ENGINEERING
from kinetostat.frozen import dataclass
from kinetostat.machine.loading import as_toml, build
from kinetostat.machine.saving import as_file
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.study import read_study
from kinetostat.studies.optimisation.assessment import Assessor
from kinetostat.studies.optimisation.descents import Gradient
from kinetostat.studies.optimisation.generations import Genetic
from kinetostat.studies.optimisation.log import ROW_NUMBER, ROWS, Log, RowFile, Step, record_of
from kinetostat.studies.optimisation.problem import Problem, problem_of
from kinetostat.studies.optimisation.result import Result, result_of
from kinetostat.studies.study_folder import (
    DATA,
    Record,
    StudyFolder,
    has_checksums,
    holds_study,
    read_question,
    study_folder,
)

STUDY_VERSION = 1
"""Version of the question in a study folder, as far as this module writes it."""
OPTIMISATION, ROW_WIDTH, MACHINE_FILE = "optimisation", "numbers in a row", "machine file"
"""Keys of that question: the study file, the width of the rows of its log, and the machine as people write it."""

Watch = Callable[[int, int, float | None], None]
"""Called with (steps done, steps in all, best objective so far) after each step."""
Stop = Callable[[], bool]
"""Called after each step; True leaves the rest for later."""


def never() -> bool:
    """Never stop a search."""
    return False


def ignore_progress(_done: int, _total: int, _best: float | None) -> None:
    """Ignore the progress of a search."""


class Method(Protocol):
    """A way to search: so many steps, each of which depends on the log before it and on the seed alone."""

    @property
    def steps(self) -> int:
        """Number of steps."""

    def step(self, number: int, log: Log) -> Step:
        """Make the step of that number."""


@dataclass(frozen=True)
class Hybrid:
    """A genetic search, then one descent.

    Attributes:
        first: the genetic search.
        then: the descent.
    """

    first: Genetic
    then: Gradient

    @property
    def steps(self) -> int:
        """Generations, and one more."""
        return self.first.steps + 1

    def step(self, number: int, log: Log) -> Step:
        """A generation, or the descent from the best of the last one."""
        if number < self.first.steps:
            return self.first.step(number, log)
        return self.then.descend(log.genes(log.survivors[:1])[0], log)


def method_of(assess: Assessor) -> Method:
    """Return the search method that a study names."""
    match assess.problem.method:
        case "gradient":
            return Gradient(assess)
        case "hybrid":
            return Hybrid(Genetic(assess), Gradient(assess))
        case "nsga2":
            return Genetic(assess, crowded=True)
    return Genetic(assess)


def steps_of(problem: Problem) -> int:
    """Return the number of steps that the search of a problem takes; nothing is computed for it."""
    return method_of(Assessor(problem)).steps


@checked
def optimize(
    problem: Problem,
    folder: str | Path | None = None,
    watch: Watch = ignore_progress,
    resume: bool = False,
    stop: Stop = never,
) -> Result:
    """Search for the best design of a problem and explain it.

    Args:
        problem: from `load_problem`.
        folder: where every step is kept, so that a search that was stopped goes on; None to keep nothing.
        watch: called with the progress and the best objective.
        resume: whether the folder must hold a part of the search.
        stop: called after each step; True ends the search with the result so far.

    Raises:
        InputError: another study or another process in the folder, nothing to resume, a full disk.
    """
    if resume and folder is None:
        raise InputError("resume is True, but there is no folder; give the folder of the search that was stopped.")
    assess = Assessor(problem)
    log = search(assess, watch, stop) if folder is None else search_into(assess, Path(folder), watch, resume, stop)
    return result_of(assess, log)


def search(assess: Assessor, watch: Watch = ignore_progress, stop: Stop = never) -> Log:
    """Search in memory, until `stop` returns True after a step, and return the log of all designs."""
    log = Log(assess.problem)
    method = method_of(assess)
    while len(log.steps) < method.steps:
        _take(method, log)
        watch(len(log.steps), method.steps, log.steps[-1].get("best"))
        if stop():
            break
    return log


def search_into(
    assess: Assessor, folder: Path, watch: Watch = ignore_progress, resume: bool = False, stop: Stop = never
) -> Log:
    """Search into a folder, continuing a search of the same study that is there; return the log of all designs.

    Args:
        assess: judges designs of the problem.
        folder: the folder of this study alone.
        watch: called with the progress.
        resume: whether the folder must hold a part of the search.
        stop: called after each step; True ends the search for now.

    Raises:
        InputError: another study or another process in the folder, nothing to resume, a full disk.
    """
    if resume and not holds_study(folder):
        raise InputError(f'"{folder}" does not hold a study that could be resumed; check -o, or leave out --resume.')
    with study_folder(folder) as study:
        log, method = Log(assess.problem), method_of(assess)
        _begin_or_check(assess.problem, study, log)
        noted = study.records()
        noted_steps = max(noted, default=-1) + 1 + study.damaged  # a damaged line was that of a step, too
        with RowFile(folder / ROWS, log.width) as file:
            while len(log.steps) < method.steps:
                if _read_step(study, file, noted.get(len(log.steps)), log):
                    continue
                if len(log.steps) < noted_steps:
                    if not log.repaired:  # the history begins again with the steps before the first damaged one
                        study.keep(log.steps)
                    log.repaired += 1
                start = log.count
                _take(method, log)
                # The rows are on the disk before the note that they are there, so that no note is without its rows.
                log.steps[-1][DATA] = file.write(start, log.rows[start:])
                study.note(log.steps[-1])
                watch(len(log.steps), method.steps, log.steps[-1].get("best"))
                if stop():
                    break
        if study.damaged and not log.repaired:
            study.keep(log.steps)
            log.cleaned = True
        return log


def _read_step(study: StudyFolder, file: RowFile, record: Record | None, log: Log) -> bool:
    """Add the next step from the folder to the log, if it is there without damage, and return whether it was."""
    rows = file.read(log.count, record["designs"], record.get(DATA)) if record else None
    if record is None or rows is None:
        return False
    log.add(rows, record)
    if log.repaired:
        study.note(record)
    return True


def _take(method: Method, log: Log) -> None:
    """Make the next step of a search and add it to the log."""
    step = method.step(len(log.steps), log)
    record = {**record_of(log, step), "of": method.steps}
    log.add(log.as_rows(step), record)


def _begin_or_check(problem: Problem, study: StudyFolder, log: Log) -> None:
    """Begin the folder of a study, or check that it holds this one."""
    question = question_of(problem, log.width)
    stored = study.checked_question(question, _restate)
    if stored is None:
        (study.path / ROWS).unlink(missing_ok=True)
        study.begin(question | {MACHINE_FILE: as_file(problem.machine)})
    log.unchecked = stored is not None and not has_checksums(stored)


def _restate(stored: Record) -> Record:
    """A stored question as this version writes it."""
    return question_of(_problem_of(stored, "study.json"), stored[ROW_WIDTH])


def stored_problem(folder: Path) -> Problem:
    """Return the problem of a study folder.

    Raises:
        InputError: it is not the folder of an optimisation.
    """
    question = read_question(folder)
    if not {OPTIMISATION, "machine"} <= question.keys():
        raise InputError(f'"{folder}" is not the folder of an optimisation; give a study file, or such a folder.')
    return _problem_of(question, str(folder))


def _problem_of(question: Record, origin: str) -> Problem:
    machine = build(question.get(MACHINE_FILE) or question["machine"], origin)
    return problem_of(read_study(question[OPTIMISATION], origin), machine)


def begin_search(problem: Problem, folder: Path) -> None:
    """Make the folder of a search that is still to be made; `stored_problem` reads it.

    Raises:
        InputError: it cannot be written.
    """
    with study_folder(folder) as study:
        study.begin(question_of(problem, Log(problem).width) | {MACHINE_FILE: as_file(problem.machine)})


def kept_log(problem: Problem, folder: Path, record: Record) -> Log:
    """Return the designs that a step kept as a separate log; another process may be writing to the folder.

    Args:
        problem: the problem of the search.
        folder: the folder of the search.
        record: the note about the step.
    """
    log = Log(problem)
    count = (folder / ROWS).stat().st_size // (log.width * ROW_NUMBER.itemsize)
    rows = np.memmap(folder / ROWS, ROW_NUMBER, "r", shape=(count, log.width))[record["kept"]].astype(float)
    log.add(rows, {**record, "kept": list(range(len(rows)))})
    return log


def question_of(problem: Problem, width: int) -> Record:
    """Return everything on which the designs depend, as plain data."""
    question: dict[str, Any] = {
        "study": STUDY_VERSION,
        "kinetostat": version("kinetostat"),
        # How results are shown does not part a study from the one that it continues.
        "machine": as_toml(replace(problem.machine, display=ENGINEERING)),
        OPTIMISATION: problem.study.model_dump(mode="json", by_alias=True, exclude_none=True),
        ROW_WIDTH: width,
    }
    return json.loads(json.dumps(question))

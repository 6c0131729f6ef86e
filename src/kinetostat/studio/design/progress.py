"""How far a search is, read from its folder while another process is at work there. Knows no page."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kinetostat.engine.points import Array
from kinetostat.machine.machine import Machine
from kinetostat.studies.optimisation.front import front_of, knee_of
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.result import best_feasible, designed
from kinetostat.studies.optimisation.search import kept_log, stored_problem
from kinetostat.studies.study_folder import Record, noted
from kinetostat.studio.design.runs import FAILURE, RESULT, Run, Stage


@dataclass(frozen=True)
class Progress:
    """What is known of a search.

    Attributes:
        run: as it is now.
        problem: that it solves.
        steps: made, of `total` (0 if not known yet).
        designs: judged.
        best, mean: objective after each step; None where there is none. Empty for several objectives.
        objectives: of the designs that none of those kept beats, by the first one [designs x objectives].
        genes: of these designs [designs x variables].
        knee: place among them of the one that is called the best.
        result: as `optimize --json` has it; None while it is not written.
    """

    run: Run
    problem: Problem
    steps: int = 0
    total: int = 0
    designs: int = 0
    best: list[float | None] = field(default_factory=list)
    mean: list[float | None] = field(default_factory=list)
    objectives: list[list[float]] = field(default_factory=list)
    genes: Array | None = None
    knee: int = 0
    result: dict[str, Any] | None = None

    def design(self, place: int) -> Machine:
        """A design of the front, or with one objective the best design, as a machine."""
        if self.genes is None or not 0 <= place < len(self.genes):
            raise IndexError(place)
        return designed(self.problem, self.genes[place])


class Follower:
    """Reads what is new in the folder of one search."""

    def __init__(self, run: Run) -> None:
        """Follow a search.

        Raises:
            InputError: its folder cannot be read.
        """
        self.number, self._folder = run.number, run.folder
        self.problem = stored_problem(run.folder)
        self._records: list[Record] = []
        self._last: Record = {}
        self._place = 0

    def progress(self, run: Run) -> Progress:
        """How far it is."""
        new, self._place = noted(self._folder, self._place)
        self._records += [{key: record.get(key) for key in ("best", "mean", "designs")} for record in new]
        self._last = new[-1] if new else self._last
        result = None if run.stage.active else _result(self._folder)
        if not self._records:
            return Progress(run, self.problem, result=result)
        log = kept_log(self.problem, self._folder, self._last)
        several = len(self.problem.objectives) > 1
        front = front_of(log) if several else best_feasible(log)
        return Progress(
            run,
            self.problem,
            len(self._records),
            int(self._last.get("of", 0)),
            sum(record["designs"] for record in self._records),
            [] if several else [record["best"] for record in self._records],
            [] if several else [record["mean"] for record in self._records],
            log.outcome(front).objectives.tolist(),
            log.genes(front),
            knee_of(log, front) if several and len(front) else 0,
            result,
        )


def _result(folder: Path) -> dict[str, Any] | None:
    try:
        found = json.loads((folder / RESULT).read_text("utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def failure(run: Run) -> str:
    """Why a search could not go on; empty where it could."""
    path = run.folder / FAILURE
    return path.read_text("utf-8") if run.stage is Stage.FAILED and path.exists() else ""

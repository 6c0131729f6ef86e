"""The progress of a search, read from its folder while another process writes there.

Only what is new since the last look is read. Nothing of a page is known here.
"""

import json
from dataclasses import field
from pathlib import Path
from typing import Any

from kinetostat.arrays import Array
from kinetostat.display import Scale, number, with_unit
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.machine.machine import Machine
from kinetostat.studies.folder_check import RESULT_FILE
from kinetostat.studies.optimisation.log import best_designs
from kinetostat.studies.optimisation.problem import Objective, Problem
from kinetostat.studies.optimisation.result import machine_of_design
from kinetostat.studies.optimisation.search import kept_log, steps_of, stored_problem
from kinetostat.studies.study_folder import Record, read_history
from kinetostat.studio.design.runs import FAILURE_FILE, Run, Stage
from kinetostat.views.optimisation import OBJECTIVE_DIGITS


@dataclass(frozen=True)
class SearchState:
    """The state of a search; numbers are SI.

    Attributes:
        run: the search as it is listed now.
        problem: the problem that the search solves.
        steps: the number of steps done.
        total: steps of the whole search.
        designs: the number of designs evaluated.
        best, mean: objective after each step, None where no design was feasible; empty for several objectives.
        objectives: the objectives of the Pareto front (for one objective, of the best design), sorted by the first
            [designs x objectives].
        genes: the genes of these designs [designs x variables].
        knee: place of the recommended design among them.
        result: the result as `optimize --json` prints it; None until it is written.
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

    def scale(self, objective: Objective) -> Scale:
        """Return the unit in which the values of an objective are shown."""
        return self.problem.machine.display.scale(objective.term.unit)

    def label(self, objective: Objective) -> str:
        """Return the label of an objective with the unit in which its values are shown."""
        return self.scale(objective).label(plain_name(objective.term.label))

    def exact(self, objective: Objective, value: float) -> str:
        """Return the value of an objective with all its digits and its unit; a sum of several kinds has none."""
        scale = self.scale(objective)
        unit = "1" if scale.unit == "SI" else scale.unit  # sums of several kinds have the unit "SI" in tables
        return with_unit(number(value * scale.factor, digits=OBJECTIVE_DIGITS), unit)

    def design(self, place: int) -> Machine:
        """Return the design at a place of the front as a machine; with one objective, place 0 is the best design.

        Raises:
            IndexError: the front has no such place.
        """
        if self.genes is None or not 0 <= place < len(self.genes):
            raise IndexError(place)
        return machine_of_design(self.problem, self.genes[place])


class Follower:
    """Reads the records that a search adds to its folder, each once.

    Attributes:
        number: number of the search.
        problem: the problem that it solves.
    """

    def __init__(self, run: Run) -> None:
        """Follow a search from its beginning.

        Raises:
            InputError: its folder cannot be read.
        """
        self.number, self._folder = run.number, run.folder
        self.problem = stored_problem(run.folder)
        self._total = steps_of(self.problem)
        self._records: list[Record] = []
        self._last_record: Record = {}
        self._bytes_read = 0

    def progress(self, run: Run) -> SearchState:
        """Read what is new, and return the state of the search."""
        new, self._bytes_read = read_history(self._folder, self._bytes_read)
        self._records += [{key: record.get(key) for key in ("best", "mean", "designs")} for record in new]
        self._last_record = new[-1] if new else self._last_record
        result = None if run.stage.active else _result(self._folder)
        if not self._records:
            return SearchState(run=run, problem=self.problem, total=self._total, result=result)
        log = kept_log(self.problem, self._folder, self._last_record)
        front, knee = best_designs(log)
        several = len(self.problem.objectives) > 1
        return SearchState(
            run=run,
            problem=self.problem,
            steps=len(self._records),
            total=self._total,
            designs=sum(record["designs"] for record in self._records),
            best=[] if several else [record["best"] for record in self._records],
            mean=[] if several else [record["mean"] for record in self._records],
            objectives=log.outcome(front).objectives.tolist(),
            genes=log.genes(front),
            knee=knee,
            result=result,
        )


def _result(folder: Path) -> dict[str, Any] | None:
    try:
        result = json.loads((folder / RESULT_FILE).read_text("utf-8"))
    except (OSError, ValueError):
        return None
    return result if isinstance(result, dict) else None


def failure(run: Run) -> str:
    """Return the reason why a search failed; empty if it did not."""
    path = run.folder / FAILURE_FILE
    return path.read_text("utf-8") if run.stage is Stage.FAILED and path.exists() else ""

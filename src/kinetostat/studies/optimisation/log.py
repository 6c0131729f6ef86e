"""All designs that were judged, in order, what each step of a search kept of them, and the file in which they lie.

Nothing is judged here. A step depends on the log before it and on the seed alone. So a search that was stopped goes on
from its last whole step, and ends as if it had never been stopped.
"""

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from kinetostat.arrays import AnyArray, Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.studies.optimisation.assessment import Outcome, join_outcomes
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.storage import KEPT_SENTENCE, settle, writing
from kinetostat.studies.study_folder import checksum

ROWS = "designs.bin"
"""Name of the file with the rows of a log in the folder of a study."""
ROW_NUMBER = np.dtype("<f8")
"""Numbers in that file: float64, little-endian."""


@dataclass(frozen=True)
class Step:
    """One step of a search: the designs it judged and those it kept.

    Attributes:
        genes: designs that it judged, in order [designs x variables].
        outcome: their objectives, constraints and verdicts.
        kept: numbers in the log, these designs included, of those that the search goes on with, the best first.
        notes: further plain data for the note about the step.
    """

    genes: Array
    outcome: Outcome
    kept: Integers
    notes: Mapping[str, Any] = field(default_factory=dict)


class Log:
    """The designs of a search, as rows of one table: genes, objectives, constraints, violation, verdict.

    Attributes:
        problem: the problem of the search.
        count: number of designs so far.
        steps: the note about each step.
        repaired: number of steps that were damaged in their folder and have been computed again.
        cleaned: whether the history in the folder had lines that were no steps, which have been removed.
        unchecked: whether the folder was begun without checksums.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        # Ends of the genes, objectives, constraints and the violation in a row; the verdict follows.
        self._ends = np.cumsum([problem.space.size, len(problem.objectives), len(problem.constraints), 1])
        self._rows: Array = np.empty((0, self.width))
        self.count = self.repaired = 0
        self.cleaned = False
        self.unchecked = False
        self.steps: list[dict[str, Any]] = []

    @property
    def width(self) -> int:
        """Numbers in a row."""
        return int(self._ends[-1]) + 1

    @property
    def rows(self) -> Array:
        """All rows [designs x width]."""
        rows = self._rows[: self.count]
        rows.setflags(write=False)
        return rows

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Log):
            return NotImplemented
        return self.problem == other.problem and self.steps == other.steps and np.array_equal(self.rows, other.rows)

    __hash__ = None  # type: ignore[assignment]  # it grows

    @property
    def survivors(self) -> Integers:
        """Numbers of the designs that the last step kept."""
        return np.array(self.steps[-1]["kept"], dtype=np.int64)

    def genes(self, numbers: Integers | Sequence[int] | slice = slice(None)) -> Array:
        """Genes of some designs."""
        return self.rows[numbers, : self._ends[0]]

    def outcome(self, numbers: Integers | Sequence[int] | slice = slice(None)) -> Outcome:
        """Objectives, constraints and verdicts of some designs."""
        _, objectives, constraints, violation, verdict = np.split(self.rows[numbers], self._ends, axis=1)
        return Outcome(objectives, constraints, violation[:, 0], verdict[:, 0].astype(np.int8))

    def as_rows(self, step: Step) -> Array:
        """The rows of a step."""
        outcome = step.outcome
        return np.column_stack(
            [step.genes, outcome.objectives, outcome.constraints, outcome.violation, outcome.verdict]
        )

    def add(self, rows: Array, record: dict[str, Any]) -> None:
        """Add the rows of a step and what is noted about it."""
        needed = self.count + len(rows)
        if needed > len(self._rows):
            grown = np.empty((max(needed, 2 * len(self._rows)), self.width))
            grown[: self.count] = self.rows
            self._rows = grown
        self._rows[self.count : needed] = rows
        self.count = needed
        self.steps.append(record)


def record_of(log: Log, step: Step) -> dict[str, Any]:
    """Return the note about a step: its number, how many designs it judged, which it kept, and how good these are."""
    problem, kept = log.problem, _kept_outcome(log, step)
    feasible = kept.violation == 0.0
    notes: dict[str, Any] = {}
    if len(problem.objectives) == 1 and feasible.any():
        values = kept.objectives[feasible, 0]
        best = values.min() if problem.objectives[0].sign > 0 else values.max()
        notes = {"best": float(best), "mean": float(values.mean())}
    return {
        "chunk": len(log.steps),
        "designs": len(step.genes),
        "kept": step.kept.tolist(),
        "feasible": int(feasible.sum()),
        **notes,
        **step.notes,
    }


def _kept_outcome(log: Log, step: Step) -> Outcome:
    """The outcome of the designs that a step kept, in its order: of the log before it, and of its own."""
    is_logged = step.kept < log.count
    outcomes = join_outcomes([log.outcome(step.kept[is_logged]), step.outcome])
    own_places = is_logged.sum() + step.kept - log.count  # behind those of the log
    return outcomes.selection(np.where(is_logged, np.cumsum(is_logged) - 1, own_places))


def best_feasible(log: Log) -> Integers:
    """Return the number of the best design of a log; empty if it is not feasible."""
    first = log.survivors[:1]
    return first if log.outcome(first).violation[0] == 0.0 else first[:0]


def front_of(log: Log) -> Integers:
    """Return the Pareto-optimal designs among those that the search kept, ordered by the first objective."""
    outcome = log.outcome(log.survivors)
    feasible = np.flatnonzero(outcome.violation == 0.0)
    if not feasible.size:
        return feasible
    candidates = log.survivors[feasible]
    signed = _signed_objectives(log)[candidates]
    _, single = np.unique(signed, axis=0, return_index=True)  # of equal designs, one
    front = single[NonDominatedSorting().do(signed[single], only_non_dominated_front=True)]
    return candidates[front[np.argsort(signed[front, 0], kind="stable")]]


def best_designs(log: Log) -> tuple[Integers, int]:
    """Return the Pareto-optimal designs and the place of their knee; of one objective the best design alone, place 0.

    The first is empty where no design is feasible.
    """
    if len(log.problem.objectives) == 1:
        return best_feasible(log), 0
    front = front_of(log)
    return front, knee_of(log, front) if len(front) else 0


def knee_of(log: Log, front: Integers) -> int:
    """Return the place of the knee of a front: farthest from the plane through its ends, towards the better side.

    With each objective from 0 (its best on the front) to 1 (its worst), that is where their sum is least.

    Source: Das, On characterizing the "knee" of the Pareto curve, Structural Optimization 18 (1999).
    """
    signed = _signed_objectives(log)[front]
    spans = np.ptp(signed, axis=0)
    shares = (signed - signed.min(axis=0)) / np.where(spans > 0.0, spans, 1.0)
    return int(np.argmin(shares.sum(axis=1)))


def _signed_objectives(log: Log) -> Array:
    """Objectives of all designs, with signs so that less is better."""
    return np.array([objective.sign for objective in log.problem.objectives]) * log.outcome().objectives


class RowFile:
    """An open file of rows of one width, to which each step of a search adds its designs."""

    def __init__(self, path: Path, width: int) -> None:
        self._path, self._width = path, width
        with writing(path, KEPT_SENTENCE):
            path.touch()
            self._stream = path.open("r+b")

    def __enter__(self) -> "RowFile":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.close()

    def read(self, start: int, count: int, check: str | None) -> AnyArray | None:
        """Return some rows [count x width], from number `start` on; None if they are damaged or not there.

        Args:
            start, count: the rows.
            check: their checksum; None if they were written without it.
        """
        size = self._width * ROW_NUMBER.itemsize
        self._stream.seek(start * size)
        data = self._stream.read(count * size)
        if len(data) < count * size or check not in (None, checksum(data)):
            return None
        return np.frombuffer(data, dtype=ROW_NUMBER).reshape(count, self._width).astype(float)

    def write(self, start: int, rows: AnyArray) -> str:
        """Put rows at number `start`, and return their checksum; when this returns they are on the disk.

        Raises:
            InputError: the disk is full or failing.
        """
        data = np.ascontiguousarray(rows, dtype=ROW_NUMBER).data.cast("B")
        with writing(self._path, KEPT_SENTENCE):
            self._stream.seek(start * self._width * ROW_NUMBER.itemsize)
            self._stream.write(data)
            settle(self._stream)
        return checksum(data)

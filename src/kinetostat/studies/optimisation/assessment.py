"""Assess designs: their objectives and constraints at all poses and with all deviations of manufacture, in one call.

A design that cannot be judged is not an error: its verdict says why, and its violation how far it is from a feasible
design. Its robustness is the scatter and the worst case of its objectives over machines made within the tolerances.
"""

from collections.abc import Mapping, Sequence
from enum import IntEnum
from itertools import product

import numpy as np

from kinetostat.arrays import Array, Codes, Integers
from kinetostat.engine.batch import evaluate_designs
from kinetostat.engine.points import Population
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.spec.immutable import Immutable
from kinetostat.studies.optimisation.problem import Constraint, Objective, Problem
from kinetostat.studies.optimisation.space import Variable
from kinetostat.tolerances import ROUND_OFF_OF_SHARE

POINTS_AT_ONCE = 1 << 20
"""Points that are evaluated before they are summed up: a few quantities of them fit in a hundred megabytes."""
LARGEST_MET_EXCESS = 1e-9
"""Relative excess up to which a constraint counts as met, so that a design at its bound is not refused by round-off."""
MOST_CORNERS = 12
"""Greatest number of tolerances of which all combinations of ends are tried: 4096 machines."""
SIGMAS_IN_TOLERANCE = 3.0
"""Standard deviations of a normal distribution from its middle to the end of the tolerance: those of a process whose
capability index is 1. A deviation beyond is moved to the end."""
COMMON_SHARE = 0.95
"""Share of the machines that keep within `Scatter.usual`."""
SEARCH_STREAM, ROBUSTNESS_STREAM = 1, 2
"""Streams of the machines that are drawn: robustness is judged by others than those that the search has seen."""


class RandomPurpose(IntEnum):
    """Purposes of random numbers, of which none repeats the numbers of another."""

    MANUFACTURE = 0
    GENERATIONS = 1
    DESCENTS = 2


def random_numbers(problem: Problem, purpose: RandomPurpose, *stream: int) -> np.random.Generator:
    """A source of random numbers that depends on the seed of a study, a purpose, and a stream of that alone."""
    return np.random.default_rng([problem.study.optimizer.seed, int(purpose), *stream])


class DesignVerdict(IntEnum):
    """Why a design is or is not feasible."""

    FEASIBLE = 0
    OUT_OF_REACH = 1
    JOINT_LIMIT = 2
    SINGULAR = 3
    NOT_CONVERGED = 4
    CONSTRAINT = 5
    NOT_FINITE = 6
    NO_REST = 7
    UNDECIDED = 8

    @property
    def phrase(self) -> str:
        """The verdict in words."""
        phrases = {
            DesignVerdict.CONSTRAINT: "a constraint is violated",
            DesignVerdict.NOT_FINITE: "an objective is infinite",
        }
        return phrases.get(self, self.name.lower().replace("_", " "))


VERDICT_BY_STATUS = np.array([DesignVerdict.FEASIBLE, *(DesignVerdict[status.name] for status in Status if status)])
"""Verdict on a design that lacks poses, by the status that most of these have."""


@dataclass(frozen=True, eq=False)
class Outcome(Immutable):
    """Objectives, constraints and verdicts of designs.

    Attributes:
        objectives: SI, with the sign of the quantity [designs x objectives]; NaN where a design cannot be judged.
        constraints: values of their terms, SI [designs x constraints].
        violation: 0 for a feasible design; at most the number of constraints where some are violated, more beyond
            [designs].
        verdict: `DesignVerdict` codes [designs].
    """

    objectives: Array
    constraints: Array
    violation: Array
    verdict: Codes

    def selection(self, numbers: Integers) -> "Outcome":
        """The outcome of the designs with these numbers."""
        return Outcome(
            self.objectives[numbers], self.constraints[numbers], self.violation[numbers], self.verdict[numbers]
        )


class Assessor:
    """Judges designs of one problem; its program is compiled once."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        robust = problem.robust is not None
        self._deviations = deviations(problem, problem.study.robustness.search_samples, SEARCH_STREAM) if robust else {}

    def __call__(self, genes: Array) -> Outcome:
        """Judge designs [designs x variables], each as made by manufacture if the study says so."""
        return self._in_blocks(genes, self._deviations, machine_count(self._deviations))

    def nominal(self, genes: Array) -> Outcome:
        """Judge designs just as they are."""
        return self._in_blocks(genes, {}, 1)

    def judge_machines(self, genes: Array, added: Mapping[str, Array]) -> Outcome:
        """Judge machines made of one design [variables], each by itself.

        Args:
            genes: genes of the design.
            added: deviations of the machines, SI, by variable [machines].
        """
        return self._in_blocks(genes[None], added, 1)

    def _in_blocks(self, genes: Array, added: Mapping[str, Array], grouped: int) -> Outcome:
        """Judge every design as every machine that is made of it, block by block.

        Args:
            genes: genes of the designs [designs x variables].
            added: deviations of the machines, SI, by variable [machines]; none for the designs as they are.
            grouped: number of machines that have one verdict together: all those of a design, or 1.
        """
        machines = machine_count(added)
        total, step = len(genes) * machines, grouped * max(1, POINTS_AT_ONCE // (grouped * self.problem.poses.count))
        outcomes = []
        for start in range(0, total, step):
            design, machine = np.divmod(np.arange(start, min(start + step, total)), machines)
            deviations_of_block = {name: sizes[machine] for name, sizes in added.items()}
            outcomes.append(self._judge(self.problem.space.columns(genes[design], deviations_of_block), grouped))
        return join_outcomes(outcomes)

    def _judge(self, columns: Mapping[str, Array], machines: int) -> Outcome:
        """Judge designs by columns in which so many machines of each design follow each other."""
        problem = self.problem
        answers = evaluate_designs(problem.machine, Population(columns, problem.poses.columns), problem.names)
        reached = answers.status == Status.OK
        terms: list[Objective | Constraint] = [*problem.objectives, *problem.constraints]
        rows = [self._over_machines(t.term.values(answers.values, reached), machines, t.sign > 0) for t in terms]
        status_by_design = answers.status.reshape(-1, machines * answers.status.shape[1])
        by_design = np.array(rows).T.reshape(len(status_by_design), len(terms))
        objectives, constraints = np.split(by_design, [len(problem.objectives)], axis=1)
        return _outcome(problem, objectives, constraints, status_by_design)

    def _over_machines(self, values: Array, machines: int, high_is_bad: bool) -> Array:
        """One number for each design, as the study sums up the numbers of its machines."""
        if machines == 1 or self.problem.robust is None:
            return values
        by_design = values.reshape(-1, machines)
        return self.problem.robust.over(by_design, np.ones(by_design.shape, dtype=bool), high_is_bad)


def _outcome(problem: Problem, objectives: Array, constraints: Array, status: Codes) -> Outcome:
    """The verdicts on designs by their objectives and constraints, and by the status of all their poses.

    The violations order them: any that lacks poses is worse than any without finite objectives, and that is worse than
    any with violated constraints, each of which counts at most 1.

    Args:
        problem: the problem of the designs.
        objectives, constraints: values of their terms, SI [designs x terms each].
        status: `Status` codes of the poses of all machines of a design [designs x poses].
    """
    most = len(problem.constraints)
    excess = np.zeros(constraints.shape)
    for k, constraint in enumerate(problem.constraints):
        over = constraint.sign * (constraints[:, k] - constraint.bound) / constraint.scale
        over = np.where(over <= LARGEST_MET_EXCESS, 0.0, over)
        with np.errstate(invalid="ignore"):
            excess[:, k] = np.where(np.isfinite(over), over / (1.0 + over), 1.0)
    violation = excess.sum(axis=1)
    verdict = np.where(violation > 0.0, DesignVerdict.CONSTRAINT, DesignVerdict.FEASIBLE)
    infinite = ~np.isfinite(objectives).all(axis=1)
    verdict[infinite], violation[infinite] = DesignVerdict.NOT_FINITE, most + 1.0
    counts = np.stack([(status == code).sum(axis=1) for code in Status])
    reached, refused = counts[Status.OK], np.where(np.array(Status)[:, None] == Status.OK, 0, counts)
    missing = problem.poses.required - reached / status.shape[1]
    lacking = (missing > ROUND_OFF_OF_SHARE) | (reached == 0)
    verdict[lacking] = VERDICT_BY_STATUS[refused[:, lacking].argmax(axis=0)]
    violation[lacking] = most + 2.0 + missing[lacking]
    return Outcome(np.where(lacking[:, None], np.nan, objectives), constraints, violation, verdict.astype(np.int8))


def join_outcomes(parts: Sequence[Outcome]) -> Outcome:
    """The outcome of the designs of all parts, one part after the other."""
    if len(parts) == 1:
        return parts[0]
    return Outcome(
        np.concatenate([part.objectives for part in parts]),
        np.concatenate([part.constraints for part in parts]),
        np.concatenate([part.violation for part in parts]),
        np.concatenate([part.verdict for part in parts]),
    )


def deviations(problem: Problem, samples: int, stream: int) -> dict[str, Array]:
    """Draw the deviations of machines made to the tolerances, SI, by variable [samples]; the first machine has none.

    Args:
        problem: the problem, with tolerances and the seed.
        samples: number of machines, the nominal one included.
        stream: `SEARCH_STREAM` or `ROBUSTNESS_STREAM`.
    """
    rng = random_numbers(problem, RandomPurpose.MANUFACTURE, stream)
    tolerated = _tolerated_variables(problem)
    if problem.study.robustness.distribution == "normal":
        drawn = np.clip(rng.standard_normal((samples, len(tolerated))) / SIGMAS_IN_TOLERANCE, -1.0, 1.0)
    else:
        drawn = rng.uniform(-1.0, 1.0, (samples, len(tolerated)))
    drawn[0] = 0.0
    return {variable.name: variable.tolerance * row for variable, row in zip(tolerated, drawn.T, strict=True)}


def machine_count(added: Mapping[str, Array]) -> int:
    """Return the number of machines that deviations by variable make of a design; 1 where there are none."""
    return len(next(iter(added.values()))) if added else 1


def _tolerated_variables(problem: Problem) -> list[Variable]:
    return [variable for variable in problem.space.variables if variable.tolerance]


def corners(problem: Problem) -> dict[str, Array]:
    """Return all combinations of the ends of the tolerances, SI, by variable; empty if there are too many."""
    tolerated = _tolerated_variables(problem)
    if not 0 < len(tolerated) <= MOST_CORNERS:
        return {}
    ends = np.array(list(product((-1.0, 1.0), repeat=len(tolerated))))
    return {variable.name: variable.tolerance * row for variable, row in zip(tolerated, ends.T, strict=True)}


@dataclass(frozen=True)
class Scatter:
    """One objective over many machines of one design, SI.

    Attributes:
        label, unit: name and unit of the objective.
        nominal: its value for the design itself.
        mean, deviation: mean and standard deviation over all machines that can be judged.
        usual: the value within which `COMMON_SHARE` of these machines keep.
        worst: the worst value of all machines that can be judged, those with every tolerance at an end included.
        samples: the values of the random machines; NaN where one cannot be judged.
    """

    label: str
    unit: str
    nominal: float
    mean: float
    deviation: float
    usual: float
    worst: float
    samples: Array


@dataclass(frozen=True)
class Robustness:
    """The objectives of a design under its tolerances.

    Attributes:
        scatters: the scatter of each objective.
        machines: number of random machines.
        corners: number of combinations of ends of tolerances that were tried; 0 if there are too many of them.
        failing: share of the random machines that are not feasible.
    """

    scatters: tuple[Scatter, ...]
    machines: int
    corners: int
    failing: float


def robustness_of(assess: Assessor, genes: Array) -> Robustness | None:
    """Return the objectives of a design [variables] under the tolerances of its study; None where there are none."""
    problem = assess.problem
    if not _tolerated_variables(problem):
        return None
    made = assess.judge_machines(genes, deviations(problem, problem.study.robustness.samples, ROBUSTNESS_STREAM))
    ends = corners(problem)
    extreme = assess.judge_machines(genes, ends) if ends else made.selection(np.empty(0, dtype=np.int64))
    scatters = tuple(_scatter(assess, k, made, extreme) for k in range(len(problem.objectives)))
    return Robustness(scatters, len(made.violation), len(extreme.violation), float((made.violation > 0.0).mean()))


def _scatter(assess: Assessor, number: int, made: Outcome, extreme: Outcome) -> Scatter:
    objective = assess.problem.objectives[number]
    samples = made.objectives[:, number]
    known = objective.sign * samples[np.isfinite(samples)]
    ends = objective.sign * extreme.objectives[:, number]
    with_ends = np.concatenate([known, ends[np.isfinite(ends)]])
    if not known.size:
        known = with_ends = np.array([np.nan])
    return Scatter(
        label=objective.term.label,
        unit=objective.term.unit,
        nominal=float(samples[0]),
        mean=float(objective.sign * known.mean()),
        deviation=float(known.std()),
        usual=float(objective.sign * np.quantile(known, COMMON_SHARE)),
        worst=float(objective.sign * with_ends.max()),
        samples=samples,
    )

"""The answer to a study: the best design beside the machine as it was, what holds it there, and what it costs.

What is printed, drawn and written of it is elsewhere.
"""

from collections import Counter
from dataclasses import replace
from functools import cached_property

import numpy as np

from kinetostat.arrays import Array, Integers
from kinetostat.engine.batch import evaluate_designs
from kinetostat.engine.points import Population
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values, with_values
from kinetostat.spec.immutable import Immutable
from kinetostat.studies.optimisation.assessment import Assessor, DesignVerdict, Outcome, Robustness, robustness_of
from kinetostat.studies.optimisation.log import Log, best_feasible, front_of, knee_of
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.slopes import Ridge, Surveyor, at_bounds, find_ridges
from kinetostat.studies.quantities import uncounted_loads
from kinetostat.studies.sensitivity import relative_sensitivity

LONGEST_MACHINE_NAME = 80
INFEASIBLE = "No feasible design was found: {}. Widen the bounds, ease the constraints, or change [poses]."


@dataclass(frozen=True)
class Direction:
    """The compliance of one direction before and after, the worst over the poses, SI."""

    name: str
    unit: str
    before: float
    after: float

    @property
    def gain(self) -> float:
        """Compliance before over compliance after; NaN where nothing deflects."""
        if self.before == self.after:
            return 1.0 if self.after else float("nan")
        return self.before / self.after if self.after else float("inf")


@dataclass(frozen=True)
class VariableInfluence:
    """The effect of one variable on the objectives at the best design.

    Attributes:
        name: of the variable.
        slopes: derivatives of each objective by it, SI; where an objective has a kink, of the part that decides.
        percents: percent by which each objective changes per percent of the variable, of an angle per 0.01 rad; NaN
            where one of them is 0.
        bound: "lower" or "upper" if the variable is at that bound, else nothing.
    """

    name: str
    slopes: tuple[float, ...]
    percents: tuple[float, ...]
    bound: str


@dataclass(frozen=True, eq=False)
class Result(Immutable):
    """The result of a study.

    Attributes:
        problem: that was solved.
        log: of all designs.
        initial: what the machine is worth as its file says, by the same measure.
        front: numbers of the Pareto-optimal designs, by the first objective; of one objective the best design alone.
        knee: place in `front` of the design that is called the best.
        directions: before and after.
        influences: of the continuous variables; empty where there are no derivatives.
        ridges: ways that leave the objective as it is.
        no_ridges: why none were looked for.
        robustness: of the best design; None without tolerances.
    """

    problem: Problem
    log: Log
    initial: Outcome
    front: Integers
    knee: int
    directions: tuple[Direction, ...] = ()
    influences: tuple[VariableInfluence, ...] = ()
    ridges: tuple[Ridge, ...] = ()
    no_ridges: str = ""
    robustness: Robustness | None = None

    def __repr__(self) -> str:
        return f"<Result of {self.problem.study.name!r}: {self.log.count:,} designs judged, {len(self.front)} best>"

    @property
    def solved(self) -> bool:
        """Whether any feasible design was found."""
        return bool(len(self.front))

    @property
    def best(self) -> int:
        """Number of the best design."""
        return int(self.front[self.knee])

    @cached_property
    def genes(self) -> Array:
        """Of the best design [variables]."""
        return np.asarray(self.log.genes([self.best])[0])

    @property
    def outcome(self) -> Outcome:
        """Objectives, constraints and verdict of the best design."""
        return self.log.outcome([self.best])

    def in_units(self, units: str) -> "Result":
        """The result shown in other units; see `Machine.in_units`."""
        return replace(self, problem=replace(self.problem, machine=self.problem.machine.in_units(units)))

    @property
    def machine(self) -> Machine:
        """The best design as a machine."""
        return machine_of_design(self.problem, self.genes)

    @property
    def message(self) -> str:
        """The outcome of the search in a sentence."""
        lacking = ", ".join(f"{count} x {verdict.phrase}" for verdict, count in self.counts.items() if verdict)
        if not self.solved:
            return INFEASIBLE.format(lacking)
        feasible = self.counts[DesignVerdict.FEASIBLE]
        return f"{self.log.count:,} designs judged, {feasible:,} of them feasible" + (
            f" ({lacking})." if lacking else "."
        )

    @property
    def loads_left_out(self) -> str:
        """A sentence on the loads of the file that do not count in the objectives and constraints; empty if all do."""
        return uncounted_loads(state_of(self.problem.machine), self.problem.names)

    @property
    def counts(self) -> dict[DesignVerdict, int]:
        """Number of designs with each verdict."""
        counts = Counter(self.log.outcome().verdict.tolist())
        return {verdict: counts[verdict] for verdict in DesignVerdict if counts[verdict]}


def machine_of_design(problem: Problem, genes: Array) -> Machine:
    """A design [variables] as a machine."""
    columns = problem.space.columns(genes[None])
    machine = with_values(problem.machine, {path: float(value[0]) for path, value in columns.items()})
    return replace(machine, name=f"{problem.machine.name}, optimised"[:LONGEST_MACHINE_NAME])


def result_of(assess: Assessor, log: Log) -> Result:
    """Return the result of a search: its best designs, compared with the machine as it was, and explained."""
    problem, several = assess.problem, len(assess.problem.objectives) > 1
    front = front_of(log) if several else best_feasible(log)
    initial = assess(_as_it_is(problem))
    result = Result(problem, log, initial, front, knee_of(log, front) if several and len(front) else 0)
    return _explain(assess, result) if result.solved else result


def _as_it_is(problem: Problem) -> Array:
    """Genes of the machine as its file says; a value that its catalogue does not contain counts as the first one."""
    picked = problem.space.catalogue > 0
    return np.where(picked, np.maximum(problem.space.initial, 0.0), problem.space.initial)[None]


def _explain(assess: Assessor, result: Result) -> Result:
    """The result with everything that is asked of its best design."""
    problem = assess.problem
    searched = problem.method in ("gradient", "hybrid")  # then the program is there
    survey = Surveyor(problem, searched) if problem.differentiable else None
    ridges: list[Ridge] = []
    reason = "No ridges are sought, because the objective has no derivatives, or too many poses for them."
    if survey is not None and len(problem.objectives) == 1:
        ridges, reason = find_ridges(problem, survey, result.genes)
    return replace(
        result,
        directions=tuple(_directions(problem, result.machine)),
        influences=tuple(_influences(problem, survey, result.genes)) if survey else (),
        ridges=tuple(ridges),
        no_ridges=reason if len(problem.objectives) == 1 else "",
        robustness=robustness_of(assess, result.genes),
    )


def _directions(problem: Problem, machine: Machine) -> list[Direction]:
    """The greatest compliances over the poses that are reached, of the machine as it was and of another design."""
    there = problem.machine.family.component_names
    names = [name for name in GROUPS["compliance"] if QUANTITIES[name].components[0] in there]
    numbers = [values(design) for design in (problem.machine, machine)]
    columns = {path: np.array([design[path] for design in numbers], dtype=float) for path in problem.space.paths}
    answers = evaluate_designs(problem.machine, Population(columns, problem.poses.columns), names)
    reached = answers.status == Status.OK
    worst = {name: answers.values[name].max(axis=1, where=reached, initial=-np.inf) for name in names}
    return [
        Direction(name, QUANTITIES[name].unit, *np.where(reached.any(axis=1), worst[name], np.nan).tolist())
        for name in names
    ]


def _influences(problem: Problem, survey: Surveyor, genes: Array) -> list[VariableInfluence]:
    here, bounds, design = survey(genes), at_bounds(problem, genes), problem.space.values(genes)
    if not here.sound:
        return []
    terms = [here.term(objective.term, objective.sign > 0) for objective in problem.objectives]
    influences = []
    for place, k in enumerate(survey.free):
        variable = problem.space.searched_variables[k]
        slopes = tuple(float(slope[place]) / (variable.high - variable.low) for _, slope in terms)
        size = 1.0 if variable.quantity.kind == "angle" else float(design[k])
        levels = [value for value, _ in terms]
        percents = tuple(relative_sensitivity(np.array(slopes), size, np.array(levels)).tolist())
        influences.append(VariableInfluence(variable.name, slopes, percents, bounds[k]))
    return influences

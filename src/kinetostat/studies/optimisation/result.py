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
from kinetostat.spec.renamed import renamed_property
from kinetostat.spec.validation import LONGEST_MACHINE_NAME
from kinetostat.studies.optimisation.assessment import Assessor, DesignVerdict, Outcome, Robustness, robustness_of
from kinetostat.studies.optimisation.log import Log, best_designs
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.slopes import Ridge, Ridges, Surveyor, at_bounds, find_ridges
from kinetostat.studies.quantities import uncounted_loads
from kinetostat.studies.sensitivity import relative_sensitivity

DESIGN_SUFFIX = ", optimised"
"""End of the name of a machine that is a design of a study."""
INFEASIBLE = "No feasible design was found: {}. Widen the bounds, ease the constraints, or change [poses]."
"""The answer without a feasible design, with the numbers of designs by their verdicts."""


@dataclass(frozen=True)
class ComplianceChange:
    """The compliance of one component before and after, the worst over the poses, SI."""

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
        name: the name of the variable.
        slopes: derivatives of each objective by it, SI; where an objective has a kink, of the part that decides.
        percents: change of each objective in percent if the variable grows by 1 %, and an angle by 0.01 rad. NaN where
            the objective or the variable is 0.
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
        problem: the problem that was solved.
        log: the log of all designs.
        initial: objectives, constraints and verdict of the machine as its file says.
        front: numbers of the Pareto-optimal designs, by the first objective; of one objective the best design alone.
        knee: place in `front` of the design that is called the best.
        compliance_changes: the compliances before and after.
        influences: the effects of the continuous variables; empty where there are no derivatives.
        ridges: ways that leave the objective as it is.
        no_ridges: the reason why none were sought; empty if they were, and where there are several objectives.
        robustness: the robustness of the best design; None without tolerances.
    """

    problem: Problem
    log: Log
    initial: Outcome
    front: Integers
    knee: int
    compliance_changes: tuple[ComplianceChange, ...] = ()
    influences: tuple[VariableInfluence, ...] = ()
    ridges: tuple[Ridge, ...] = ()
    no_ridges: str = ""
    robustness: Robustness | None = None
    directions = renamed_property("compliance_changes")

    def __repr__(self) -> str:
        return f"<Result of {self.problem.study.name!r}: {self.log.count:,} designs judged, {len(self.front)} best>"

    @property
    def solved(self) -> bool:
        """Whether any feasible design was found."""
        return bool(len(self.front))

    @property
    def best(self) -> int:
        """Number of the best design in the log; there is one only where the study is solved."""
        return int(self.front[self.knee])

    @cached_property
    def genes(self) -> Array:
        """Genes of the best design [variables]."""
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
        return machine_of_design(self.problem, self.genes)

    @property
    def message(self) -> str:
        """The outcome of the search in a sentence."""
        rejected = [pair for pair in self.counts.items() if pair[0] is not DesignVerdict.FEASIBLE]
        reasons = ", ".join(f"{count} x {verdict.phrase}" for verdict, count in rejected)
        if not self.solved:
            return INFEASIBLE.format(reasons)
        sentence = f"{self.log.count:,} designs judged, {self.counts[DesignVerdict.FEASIBLE]:,} of them feasible"
        return f"{sentence} ({reasons})." if reasons else f"{sentence}."

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
    return replace(machine, name=problem.machine.name[: LONGEST_MACHINE_NAME - len(DESIGN_SUFFIX)] + DESIGN_SUFFIX)


def result_of(assess: Assessor, log: Log) -> Result:
    """Return the result of a search: its best designs, compared with the machine as it was, and explained."""
    front, knee = best_designs(log)
    initial = assess(_as_it_is(assess.problem))
    result = Result(problem=assess.problem, log=log, initial=initial, front=front, knee=knee)
    return _explain(assess, result) if result.solved else result


def _as_it_is(problem: Problem) -> Array:
    """Genes of the machine as its file says; a value that its catalogue does not contain counts as the first one."""
    is_choice = problem.space.catalogue > 0
    return np.where(is_choice, np.maximum(problem.space.initial, 0.0), problem.space.initial)[None]


def _explain(assess: Assessor, result: Result) -> Result:
    """The result with everything that is asked of its best design."""
    problem = assess.problem
    # A search that descends has compiled the derivatives already.
    survey = Surveyor(problem, searching=problem.descends) if problem.differentiable else None
    # Along a front the objectives change against each other, so that ridges are about a single one.
    ridges = find_ridges(problem, survey, result.genes) if len(problem.objectives) == 1 else Ridges()
    return replace(
        result,
        compliance_changes=tuple(_compliance_changes(problem, result.machine)),
        influences=tuple(_influences(problem, survey, result.genes)) if survey else (),
        ridges=ridges.ridges,
        no_ridges=ridges.why_none,
        robustness=robustness_of(assess, result.genes),
    )


def _compliance_changes(problem: Problem, machine: Machine) -> list[ComplianceChange]:
    """The greatest compliances over the poses that are reached, of the machine as it was and of another design."""
    components = problem.machine.family.component_names
    names = [name for name in GROUPS["compliance"] if QUANTITIES[name].components[0] in components]
    designs = [values(design) for design in (problem.machine, machine)]
    columns = {path: np.array([design[path] for design in designs], dtype=float) for path in problem.space.paths}
    answers = evaluate_designs(problem.machine, Population(columns, problem.poses.columns), names)
    reached = answers.status == Status.OK
    worst = {name: answers.values[name].max(axis=1, where=reached, initial=-np.inf) for name in names}
    changes = []
    for name in names:
        before, after = np.where(reached.any(axis=1), worst[name], np.nan).tolist()  # NaN of a design without any pose
        changes.append(ComplianceChange(name=name, unit=QUANTITIES[name].unit, before=before, after=after))
    return changes


def _influences(problem: Problem, survey: Surveyor, genes: Array) -> list[VariableInfluence]:
    """The effects of the continuous variables at a design; none where its derivatives are not sound."""
    design, bounds, settings = survey(genes), at_bounds(problem, genes), problem.space.values(genes)
    if not design.sound:
        return []
    pairs = [design.term(objective.term, high_is_bad=objective.sign > 0) for objective in problem.objectives]
    objectives = np.array([value for value, _ in pairs])
    influences = []
    for place, number in enumerate(survey.free):
        variable = problem.space.searched_variables[number]
        slopes = tuple(float(slope[place]) / (variable.high - variable.low) for _, slope in pairs)
        size = 1.0 if variable.quantity.kind == "angle" else float(settings[number])
        percents = tuple(relative_sensitivity(np.array(slopes), size, objectives).tolist())
        influences.append(VariableInfluence(variable.name, slopes, percents, bounds[number]))
    return influences

"""A study file and its machine as an optimisation problem: nothing is evaluated here but the machine as it is."""

import difflib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from kinetostat.display import Display
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.spec import document as documents
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.immutable import Immutable
from kinetostat.spec.renamed import current_name
from kinetostat.spec.requirements import with_files
from kinetostat.spec.study import ConstraintTable, ObjectiveTable, StudyFile, read_study
from kinetostat.studies.bundled import bundled_studies, study_of
from kinetostat.studies.optimisation.space import PoseSet, Space, read_poses, read_space
from kinetostat.studies.optimisation.terms import Aggregate, Term, known_terms, parse_aggregate, read_term, usual_goal
from kinetostat.studies.quantities import refuse_without_derivatives, value_of, without_derivatives

NOT_A_STUDY = (
    "is a machine, but this command takes a study, which names the machine and says what may change and what is "
    "better; `kinetostat new study` prints a study to start from."
)
"""The message for a machine in the place of a study."""
NOMINAL = "nominal"
"""Word for designs that are judged as they are, without what manufacture makes of them."""
MOST_EVALUATIONS = 5_000_000
"""Greatest number of designs of one study: their table then fits in half a gigabyte."""
MOST_POINTS = 2_000_000
"""Greatest number of poses of one design: a few quantities of them fit in some hundred megabytes."""
MOST_DIFFERENTIATED = 50_000
"""The same with derivatives by a dozen variables."""


@dataclass(frozen=True)
class Objective:
    """A term that is wanted small (sign 1) or large (sign -1)."""

    term: Term
    sign: float

    @property
    def goal(self) -> str:
        """The goal in a word."""
        return "minimise" if self.sign > 0 else "maximise"


@dataclass(frozen=True)
class Constraint:
    """A term that must not exceed a bound (sign 1), or not fall short of it (sign -1); bound in SI."""

    term: Term
    sign: float
    bound: float

    @property
    def label(self) -> str:
        """The constraint as files name it, SI."""
        unit = "" if self.term.unit == "1" else f" {self.term.unit}"
        return f"{self.term.label} {self._relation} {self.bound:.6g}{unit}"

    def in_words(self, display: Display) -> str:
        """The constraint as people read it."""
        return f"{plain_name(self.term.label)} {self._relation} {display.show(self.bound, self.term.unit)}"

    @property
    def _relation(self) -> str:
        return "<=" if self.sign > 0 else ">="

    @property
    def scale(self) -> float:
        """The size with which an excess is compared."""
        return abs(self.bound) or 1.0


@dataclass(frozen=True, eq=False)
class Problem(Immutable):
    """An optimisation problem.

    Attributes:
        study: the study file, overrides included.
        machine: the machine before the search.
        space: the variables, with their bounds or choices.
        poses: the poses at which designs are judged.
        objectives, constraints: the terms that are wanted small or large, and those that must keep a bound.
        robust: the way in which the numbers of all machines that manufacture makes of a design become one; None
            where the design itself counts.
        method: genetic, gradient, hybrid or nsga2.
    """

    study: StudyFile
    machine: Machine
    space: Space
    poses: PoseSet
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    robust: Aggregate | None
    method: str

    def __repr__(self) -> str:
        return f"<Problem {self.study.name!r}: {len(self.objectives)} objectives, {len(self.constraints)} constraints>"

    @property
    def terms(self) -> tuple[Term, ...]:
        """Terms of all objectives, then those of all constraints."""
        return *(item.term for item in self.objectives), *(item.term for item in self.constraints)

    @property
    def points(self) -> int:
        """Number of poses at which one design is evaluated, over all machines that manufacture makes of it."""
        return self.poses.count * (self.study.robustness.search_samples if self.robust else 1)

    @property
    def differentiable(self) -> bool:
        """Whether there are derivatives, and few enough of them to be kept."""
        return (
            all(objective.term.differentiable for objective in self.objectives)
            and without_derivatives(self.machine, self.names, self.paths) is None
            and self.space.has_continuous
            and self.points <= MOST_DIFFERENTIATED
        )

    @property
    def descends(self) -> bool:
        """Whether its method uses derivatives."""
        return self.method in ("gradient", "hybrid")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities of which the terms are made."""
        return tuple(dict.fromkeys(name for term in self.terms for name in term.names))

    @property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of all numbers that vary: those of designs, then those of poses."""
        return *self.space.paths, *self.poses.columns


@checked
def load_problem(study: str | Path, settings: Sequence[str] = ()) -> Problem:
    """The problem of a study file, or of a bundled study by its name.

    Args:
        study: path of a TOML file, or the name of a bundled study, as `kinetostat list` prints them.
        settings: overrides "path=value" of the study's fields, as `--set` takes them.

    Raises:
        InputError: there is no such study or machine, or it or an override has a mistake.
    """
    name, shipped = str(study), bundled_studies()
    if name in shipped:
        return build_problem(study_of(name, settings))
    path = Path(study)
    if name in bundled():
        raise InputError(f'"{name}" {NOT_A_STUDY}')
    if not documents.exists(path):
        near = difflib.get_close_matches(name, shipped, 1)
        hint = f'did you mean "{near[0]}"?' if near else f"bundled studies: {', '.join(shipped)}."
        raise InputError(f"{shorten(name)} is neither a file nor a bundled study; {hint}")
    document = documents.read(path)
    if "family" in document:
        raise InputError(f'"{name}" {NOT_A_STUDY}')
    return build_problem(read_study(document, name, settings), path.parent)


def build_problem(study: StudyFile, folder: Path = Path()) -> Problem:
    """The problem of a study; a machine that is not bundled is looked for from `folder`.

    Raises:
        InputError: a field, quantity, bound or value does not fit the machine.
    """
    named = study.machine in bundled()
    machine = load(study.machine if named else folder / study.machine, list(settings_of(study.changes)))
    required = with_files(study.requirements, folder)
    return problem_of(study.model_copy(update={"requirements": required}) if required else study, machine)


def problem_of(study: StudyFile, machine: Machine) -> Problem:
    """The problem of a study about a machine in which the study's changes are made already.

    Raises:
        InputError: a field, quantity, bound or value does not fit the machine.
    """
    machine = replace(machine, requirements={**machine.requirements, **study.requirements})
    poses = read_poses(machine, study.poses)
    space = read_space(machine, study.variables)
    both = [path for path in space.paths if path in poses.columns]
    if both:
        raise InputError(f"{both[0]} is a variable and varies over the poses too; leave it out of one of them.")
    objectives = tuple(_objective(machine, table, poses, f"objectives.{i}") for i, table in enumerate(study.objectives))
    constraints = tuple(
        _constraint(machine, table, poses, f"constraints.{i}") for i, table in enumerate(study.constraints)
    )
    labels = [item.term.label for item in objectives]
    if len(set(labels)) < len(labels):
        raise InputError("two objectives are the same; leave one out, or change its `over`.")
    problem = Problem(
        study=study,
        machine=machine,
        space=space,
        poses=poses,
        objectives=objectives,
        constraints=constraints,
        robust=_robust(study, space),
        method=study.optimizer.method or ("nsga2" if len(objectives) > 1 else "genetic"),
    )
    _check_method(problem)
    _check_size(problem)
    return problem


def settings_of(changes: Mapping[str, Any], above: str = "") -> Iterator[str]:
    """Overrides of the machine from a table, whose keys may be dotted or tables in tables."""
    for key, value in changes.items():
        path = f"{above}.{key}" if above else key
        if isinstance(value, dict):
            yield from settings_of(value, path)
        else:
            yield f"{path}={_as_setting(value, path)}"


def _as_setting(value: object, path: str) -> str:
    try:
        return json.dumps(value)
    except TypeError:
        raise InputError(f"set.{path} is {shorten(value)}; it must be a number, a text, or a list of them.") from None


def _objective(machine: Machine, table: ObjectiveTable, poses: PoseSet, where: str) -> Objective:
    name = current_name(table.quantity, "quantity")
    goal = table.goal or usual_goal(name)
    if goal is None and name in known_terms(machine):
        raise InputError(
            f'{where}: neither a larger nor a smaller {name} is better in general; add goal = "minimize" or "maximize".'
        )
    wants_less = goal == "minimize"
    return Objective(read_term(machine, table, poses, wants_less, where), 1.0 if wants_less else -1.0)


def _constraint(machine: Machine, table: ConstraintTable, poses: PoseSet, where: str) -> Constraint:
    if (table.at_least is None) == (table.at_most is None):
        raise InputError(f"{where} needs either at_least or at_most.")
    is_upper = table.at_most is not None
    key, written = ("at_most", table.at_most) if is_upper else ("at_least", table.at_least)
    term = read_term(machine, table, poses, is_upper, where)
    return Constraint(term, 1.0 if is_upper else -1.0, value_of(term.unit, written, f"{where}.{key}"))


def _robust(study: StudyFile, space: Space) -> Aggregate | None:
    text = study.robustness.objective.strip().lower()
    if text == NOMINAL:
        return None
    if not any(variable.tolerance for variable in space.variables):
        raise InputError("robustness.objective needs tolerances; add tolerance = ... to at least one variable.")
    return parse_aggregate(text, "robustness.objective")


def _check_method(problem: Problem) -> None:
    """Refuse a method that cannot solve the problem."""
    several = len(problem.objectives) > 1
    if several != (problem.method == "nsga2"):
        advice = "nsga2" if several else "genetic, gradient or hybrid"
        raise InputError(
            f"optimizer.method is {problem.method}, but the study has {len(problem.objectives)} objectives: "
            f"take {advice}{'' if several else ', or add an objective'}."
        )
    if not problem.descends:
        return
    refuse_without_derivatives(problem.machine, problem.names, problem.paths)
    stepped = [term.label for term in problem.terms if not term.differentiable]
    if stepped:
        raise InputError(f"{stepped[0]} changes in steps and has no gradient; take optimizer.method = genetic.")
    if problem.method == "gradient" and not problem.space.has_continuous:
        raise InputError("all variables are choices, along which there is no gradient; take method = genetic.")


def _check_size(problem: Problem) -> None:
    """Refuse a problem with more poses of a design, or more designs, than are kept."""
    settings = problem.study.optimizer
    if problem.points > MOST_POINTS:
        raise InputError(
            f"one design has {problem.poses.count:,} poses of {problem.study.robustness.search_samples:,} machines; at "
            f"most {MOST_POINTS:,} in all: lower the counts of [poses] or robustness.search_samples."
        )
    if problem.descends and problem.points > MOST_DIFFERENTIATED:
        raise InputError(
            f"one design has {problem.points:,} poses, of which derivatives are not kept beyond "
            f"{MOST_DIFFERENTIATED:,}; lower the counts of [poses], or take optimizer.method = genetic."
        )
    if problem.method != "gradient" and settings.population * settings.generations > MOST_EVALUATIONS:
        raise InputError(
            f"{settings.population:,} designs in {settings.generations:,} generations are more than the "
            f"{MOST_EVALUATIONS:,} that are kept; lower optimizer.population or optimizer.generations."
        )

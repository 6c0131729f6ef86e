"""The catalogue of terms by name: what people may ask for, in which unit, and which way is better."""

import difflib
import math
from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias

from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.renamed import current_name
from kinetostat.spec.study import TermTable
from kinetostat.studies.indices import three_numbers
from kinetostat.studies.optimisation.poses import PoseSet
from kinetostat.studies.optimisation.terms import PoseTerm, StrokeTerm, Term, VolumeTerm, parse_aggregate
from kinetostat.studies.quantities import refuse_absent

SUMS = {"compliance_sum": "compliance", "stiffness_sum": "stiffness"}
"""Weighted sums of the diagonal of C (eq. 40) and of K (eq. 39)."""
ALONG = {
    "compliance_along": ("compliance", 3, False, "m/N"),
    "stiffness_along": ("compliance", 3, True, "N/m"),
    "compliance_about": ("compliance", 0, False, "rad/(N·m)"),
    "stiffness_about": ("compliance", 0, True, "N·m/rad"),
}
"""Along (force) and about (moment) a direction, all else free to follow: matrix, first row, whether its reciprocal."""
STROKE, VOLUME = "leg_stroke", "workspace_volume"
AXES = "xyz"

Goal: TypeAlias = Literal["minimize", "maximize"]


def known_terms(machine: Machine) -> list[str]:
    """Names of all terms that a machine of this kind may be asked for."""
    there = machine.family.component_names
    of_poses = [
        name for name, q in QUANTITIES.items() if all(part in there for part in q.components) and name != "aspect"
    ]
    return [*SUMS, *ALONG, STROKE, VOLUME, *of_poses]


def usual_goal(name: str) -> Goal | None:
    """Return which way an objective is better unless a study says otherwise; None where neither way is.

    Args:
        name: of a term of the catalogue.
    """
    if name == VOLUME or (name in {*SUMS, *ALONG} and name.startswith("stiffness")):
        return "maximize"
    if name not in QUANTITIES:
        return "minimize"
    better = QUANTITIES[name].better
    return None if better is None else "maximize" if better == "more" else "minimize"


def read_term(machine: Machine, table: TermTable, poses: PoseSet, high_is_bad: bool, where: str) -> Term:
    """The term of an objective or a constraint.

    Args:
        machine: which has the parts that the quantity is about.
        table: as written.
        poses: at which designs are judged.
        high_is_bad: whether great values are the bad ones.
        where: the table's name, for messages.

    Raises:
        InputError: an unknown quantity, weights or a direction that do not belong to it, no aggregate.
    """
    name = _known(machine, table.quantity, f"{where}.quantity")
    if table.weights is not None and name not in SUMS:
        raise InputError(f"{where}: {name} takes no weights; leave them out, or ask for {' or '.join(SUMS)}.")
    if table.direction is not None and name not in ALONG:
        raise InputError(f"{where}: {name} takes no direction; leave it out, or ask for {', '.join(ALONG)}.")
    if name == VOLUME:
        return _volume(poses, where)
    if name == STROKE:
        refuse_absent(machine, StrokeTerm.names)
        return StrokeTerm()
    over = parse_aggregate(table.over, f"{where}.over")
    label = name if poses.count == 1 else f"{name} ({over.text})"
    if name in SUMS:
        weights = _sum_weights(machine, name, table.weights, where)
        return PoseTerm(label, "SI", tuple(weights.items()), False, over, high_is_bad)
    if name in ALONG:
        matrix, first, inverse, unit = ALONG[name]
        weights = _direction_weights(machine, matrix, first, table.direction, where)
        return PoseTerm(label, unit, tuple(weights.items()), inverse, over, high_is_bad)
    refuse_absent(machine, [name])
    return PoseTerm(label, QUANTITIES[name].unit, ((name, 1.0),), False, over, high_is_bad)


def _known(machine: Machine, name: str, where: str) -> str:
    """The name, if it is one of the catalogue; otherwise what was meant, or all but the single entries of C and K."""
    known, name = known_terms(machine), current_name(name, "quantity")
    entries = [entry for entry in known if entry in QUANTITIES and QUANTITIES[entry].components]
    if name in known or difflib.get_close_matches(name, known, 1):
        return choice(name, known, where)
    return choice(name, [*(term for term in known if term not in entries), entries[0], entries[-1]], where)


def _volume(poses: PoseSet, where: str) -> Term:
    if poses.box is None:
        raise InputError(
            f"{where}: {VOLUME} needs a grid of poses; add over = [...] to [poses], ranges of coordinates."
        )
    return VolumeTerm(*poses.box)


def _sum_weights(machine: Machine, name: str, given: Sequence[float] | None, where: str) -> Mapping[str, float]:
    there = machine.family.component_names
    names = [entry for entry in GROUPS[SUMS[name]] if QUANTITIES[entry].components[0] in there]
    weights = [1.0] * len(names) if given is None else given
    if len(weights) != len(names) or not any(weights) or min(weights) < 0.0:
        raise InputError(
            f"{where}.weights must be {len(names)} numbers of at least 0, not all 0, for {' '.join(there)}."
        )
    return {entry: weight for entry, weight in zip(names, weights, strict=True) if weight}


def _direction_weights(
    machine: Machine, matrix: str, first: int, direction: Sequence[float] | None, where: str
) -> Mapping[str, float]:
    """n^T C n as a sum of entries of C."""
    size = math.hypot(*three_numbers(direction)) if direction else 0.0
    if not direction or size == 0.0:
        raise InputError(f"{where} needs a direction, e.g. direction = [0, 0, 1].")
    n = [component / size for component in direction]
    rotation = "r" if first == 0 else ""
    weights: dict[str, float] = {}
    for i in range(3):
        for j in range(i, 3):
            weight = n[i] * n[j] * (1.0 if i == j else 2.0)
            parts = [f"{rotation}{AXES[i]}"] if i == j else [f"{rotation}{AXES[i]}", f"{rotation}{AXES[j]}"]
            if weight and not all(part in machine.family.component_names for part in parts):
                raise InputError(f"{where}.direction leaves the plane of {machine.name}, which has no {parts[-1]}.")
            if weight:
                weights["_".join([matrix, *parts])] = weight
    return weights

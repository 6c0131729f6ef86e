"""Verdicts on poses: whether each belongs to the workspace, why not, and which figures the inside poses demand.

Verdicts follow from status, aspect and conditions on quantities, which people write as "free_stiffness_z > 20 N/um";
demands follow from the measures of the limits.
"""

import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from kinetostat.arrays import Array, Codes, Integers, Mask
from kinetostat.engine.batch import first_limit_passed, limits_used
from kinetostat.equilibrium.state import MachineState
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.extremes import aspect
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.machine.limits import LIMITS, Limit, Limits, limits_set
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.renamed import current_name
from kinetostat.studies.quantities import resolve_quantities
from kinetostat.tolerances import SINGULAR
from kinetostat.units import KINDS, UnitError, as_read, parse

Poses = dict[str, Array]
"""Coordinates of poses by leaf path, SI."""

INSIDE, BEYOND = "inside", "beyond a singularity"
STATUS_VERDICTS = {
    Status.OK: INSIDE,
    Status.OUT_OF_REACH: "out of reach",
    Status.SINGULAR: "singular",
    Status.NOT_CONVERGED: "not converged",
    Status.NO_REST: "no rest under load",
    Status.UNDECIDED: "undecided",
}
"""Verdicts of statuses; for a limit that is passed, the verdict names the limit."""
LIMIT_VERDICT, CONDITION_VERDICT = "limits.", "fails "
"""The words with which verdicts of limits and of conditions begin."""


def phrase(label: str) -> str:
    """Write a verdict in a few words."""
    return next((limit.phrase for limit in LIMITS.values() if label == f"{LIMIT_VERDICT}{limit.name}"), label)


COMPARISONS = {"<=": operator.le, ">=": operator.ge, "<": operator.lt, ">": operator.gt}
CONDITION_FORM = 'write QUANTITY < VALUE or QUANTITY > VALUE, e.g. "free_stiffness_z > 20 N/um"'
LONGEST_CONDITION = 200

_CONDITION = re.compile(r"\s*([a-z_]+(?:_\d+)?)\s*(<=|>=|<|>)\s*([^<>=]+?)\s*")
COMPARED_KINDS = ("length", "angle", "force", "moment", "mass", "frequency", "speed", "rate")
"""Kinds of quantities beside stiffnesses and compliances, of which several have one unit."""
_BY_UNIT = {
    kind.unit: kind.name
    for kind in KINDS.values()
    if kind.name.endswith(("stiffness", "compliance")) or kind.name in COMPARED_KINDS
}


@dataclass(frozen=True)
class PoseCondition:
    """A quantity compared with a value.

    Attributes:
        text: as written, with single spaces.
        quantity: its name.
        comparison: "<", "<=", ">" or ">=".
        value: SI.
    """

    text: str
    quantity: str
    comparison: str
    value: float

    def holds(self, values: Array) -> Mask:
        """Tell at which points the quantity, given in SI, meets the condition; where it is NaN, it does not."""
        return np.asarray(COMPARISONS[self.comparison](values, self.value))


def parse_condition(text: str, components: Sequence[str]) -> PoseCondition:
    """Read a condition from text.

    Args:
        text: "QUANTITY < VALUE".
        components: that the machine has.

    Raises:
        InputError: not of that form, an unknown quantity, or a value of another kind.
    """
    match = _CONDITION.fullmatch(text) if len(text) <= LONGEST_CONDITION else None
    if match is None:
        raise InputError(f"{shorten(text)} is not a condition; {CONDITION_FORM}.")
    given, comparison, written = match.groups()
    name = current_name(given, "quantity")
    if name in GROUPS:
        raise InputError(f'"{name}" stands for several quantities; name one of {", ".join(GROUPS[name])}.')
    resolve_quantities([name], components)
    value = value_of(QUANTITIES[name].unit, written, f"the condition on {name}")
    return PoseCondition(f"{name} {comparison} {written}", name, comparison, value)


def value_of(unit: str, written: float | str | None, where: str) -> float:
    """Read the value, SI, with which a quantity of some unit is compared; `where` it is written goes into messages.

    Raises:
        InputError: it is of another kind, or not finite.
    """
    try:
        if unit in _BY_UNIT:
            return _finite(parse(written, _BY_UNIT[unit]))
        return _finite(float(written if written is not None else math.nan))
    except UnitError as error:
        raise InputError(f"in {where}, {shorten(written)}: {error}.") from None
    except ValueError:
        raise InputError(f"in {where}, {shorten(written)} must be a plain number, e.g. 0.05.") from None


def _finite(value: float) -> float:
    if not np.isfinite(value):
        raise UnitError('no condition can ask for "rigid"; give a large value')
    return value


@dataclass(frozen=True)
class Judge:
    """The rule by which a pose belongs to the workspace.

    Attributes:
        state: of the machine with its limits, at the file's pose.
        conditions: that the pose has to meet.
    """

    state: MachineState
    conditions: tuple[PoseCondition, ...]

    @property
    def machine(self) -> Machine:
        """The machine with its limits."""
        return self.state.machine

    @cached_property
    def aspect(self) -> float:
        """Aspect of the file's pose; 0 if no singular surface divides poses, or this pose has no answer."""
        response = self.state.free
        placed = (
            Status(int(response.status)) in (Status.OK, Status.JOINT_LIMIT) and response.singularity_margin > SINGULAR
        )
        return float(aspect(response)) if placed else 0.0

    @property
    def limits(self) -> list[str]:
        """Names of the limits that are set."""
        return [limit.name for limit in limits_set(self.machine.tables["limits"])]

    @property
    def labels(self) -> tuple[str, ...]:
        """All verdicts; "inside" is the first."""
        return (
            *STATUS_VERDICTS.values(),
            BEYOND,
            *(f"{LIMIT_VERDICT}{name}" for name in self.limits),
            *(f"{CONDITION_VERDICT}{c.text}" for c in self.conditions),
        )

    @property
    def quantities(self) -> list[str]:
        """Quantities that decide beside the status of a pose, which is that under load if one is about the load."""
        rest = ["load_factor"] if self.machine.loaded else []
        return list(dict.fromkeys(["aspect", *rest, *(condition.quantity for condition in self.conditions)]))

    def inside(self, status: Codes, values: Mapping[str, Any]) -> Mask:
        """Tell which poses are inside, from their status and quantities."""
        good = np.asarray(status == Status.OK) & ~self._beyond(values)
        for condition in self.conditions:
            good &= condition.holds(np.asarray(values[condition.quantity]))
        return good

    def verdicts(self, status: Codes, values: Mapping[str, Any], poses: Callable[[Integers], Poses]) -> Codes:
        """Judge poses; a verdict is a place in `labels`.

        Args:
            status, values: of the poses, of any shape.
            poses: from numbers of some of them to their coordinates.
        """
        codes = np.zeros(status.shape, dtype=np.int8)
        for place, plain in enumerate(STATUS_VERDICTS):
            codes[status == plain] = place
        codes[(status == Status.OK) & self._beyond(values)] = self.labels.index(BEYOND)
        limited = np.flatnonzero(status == Status.JOINT_LIMIT)
        if limited.size:
            codes.flat[limited] = (
                len(STATUS_VERDICTS) + 1 + first_limit_passed(self.machine, poses(limited), self.limits)
            )
        for place, condition in enumerate(self.conditions, len(STATUS_VERDICTS) + 1 + len(self.limits)):
            codes[(codes == 0) & ~condition.holds(np.asarray(values[condition.quantity]))] = place
        return codes

    def _beyond(self, values: Mapping[str, Any]) -> Mask:
        return np.asarray((np.asarray(values["aspect"]) * self.aspect) < 0.0)


@dataclass(frozen=True)
class Demand:
    """The range of what a limit is about.

    Attributes:
        name: of the limit.
        title: of the measure.
        least, greatest: over all poses and parts, in the unit.
        unit: m, deg, N or N·m.
    """

    name: str
    title: str
    least: float
    greatest: float
    unit: str


def demands(machine: Machine, poses: Mapping[str, Array]) -> tuple[Demand, ...]:
    """Compute the ranges of lengths, angles and loads over poses that can be reached; empty where there are none.

    Args:
        machine: with its load.
        poses: coordinates by leaf path, SI [poses].
    """
    if not next(iter(poses.values())).size:
        return ()
    # A limit is compared with the poses only where it is set; how high it is set does not change what it is about.
    watched = replace(machine, tables={**machine.tables, "limits": Limits(**dict.fromkeys(LIMITS, 1.0))})
    ranges = limits_used(watched, poses)
    last = {limit.title: limit for limit in LIMITS.values()}  # the least and the greatest length share one range
    return tuple(_demand(limit, ranges[limit.name]) for limit in last.values() if limit.name in ranges)


def _demand(limit: Limit, ends: tuple[float, float]) -> Demand:
    (least, unit), (greatest, _) = (as_read(number, limit.unit) for number in sorted(map(limit.shown, ends)))
    return Demand(limit.name, limit.title, least, greatest, unit)

"""Whether a pose belongs to the workspace of a machine, and if not, why: from status, aspect and conditions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetostat.engine.batch import first_limit_passed
from kinetostat.engine.points import Array
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.aspect import aspect
from kinetostat.kinetostatics.response import SINGULAR, respond
from kinetostat.machine.limits import LIMITS, limits_set
from kinetostat.machine.machine import Machine
from kinetostat.studies.workspace.conditions import Condition

Mask = npt.NDArray[np.bool_]
Codes = npt.NDArray[np.int8]
Numbers = npt.NDArray[np.int64]
Poses = dict[str, Array]
"""Coordinates of poses by leaf path, SI."""

INSIDE, BEYOND = "inside", "beyond a singularity"
PLAIN = {
    Status.OK: INSIDE,
    Status.OUT_OF_REACH: "out of reach",
    Status.SINGULAR: "singular",
    Status.NOT_CONVERGED: "not converged",
}
"""Verdicts of statuses; a limit that is passed is named instead."""
LIMIT, FAILS = "limits.", "fails "
"""How the verdicts of limits and of conditions begin."""


def phrase(label: str) -> str:
    """A verdict for people."""
    return next((limit.phrase for limit in LIMITS.values() if label == f"{LIMIT}{limit.name}"), label)


@dataclass(frozen=True)
class Judge:
    """What makes a pose one of the workspace.

    Attributes:
        machine: with its limits, at the file's pose.
        conditions: that the pose has to meet.
    """

    machine: Machine
    conditions: tuple[Condition, ...]

    @cached_property
    def aspect(self) -> float:
        """Aspect of the file's pose; 0 if no singular surface divides poses, or this pose has no answer."""
        response = respond(self.machine)
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
            *PLAIN.values(),
            BEYOND,
            *(f"{LIMIT}{name}" for name in self.limits),
            *(f"{FAILS}{c.text}" for c in self.conditions),
        )

    @property
    def quantities(self) -> list[str]:
        """What has to be known of a pose beside its status."""
        return list(dict.fromkeys(["aspect", *(condition.quantity for condition in self.conditions)]))

    def inside(self, status: Codes, values: Mapping[str, Any]) -> Mask:
        """Which poses are inside, from their status and quantities."""
        good = np.asarray(status == Status.OK) & ~self._beyond(values)
        for condition in self.conditions:
            good &= condition.holds(np.asarray(values[condition.quantity]))
        return good

    def verdicts(self, status: Codes, values: Mapping[str, Any], poses: Callable[[Numbers], Poses]) -> Codes:
        """What becomes of each pose: its place in `labels`.

        Args:
            status, values: of the poses, of any shape.
            poses: from numbers of some of them to their coordinates.
        """
        found = np.zeros(status.shape, dtype=np.int8)
        for place, plain in enumerate(PLAIN):
            found[status == plain] = place
        found[(status == Status.OK) & self._beyond(values)] = self.labels.index(BEYOND)
        limited = np.flatnonzero(status == Status.JOINT_LIMIT)
        if limited.size:
            found.flat[limited] = len(PLAIN) + 1 + first_limit_passed(self.machine, poses(limited), self.limits)
        for place, condition in enumerate(self.conditions, len(PLAIN) + 1 + len(self.limits)):
            found[(found == 0) & ~condition.holds(np.asarray(values[condition.quantity]))] = place
        return found

    def _beyond(self, values: Mapping[str, Any]) -> Mask:
        return np.asarray((np.asarray(values["aspect"]) * self.aspect) < 0.0)

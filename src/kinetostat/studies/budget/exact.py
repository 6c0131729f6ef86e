"""Machines drawn within their tolerances whose equations are solved exactly, beside their first order.

What is left between the two is what single contributions do not explain: curvature, and what errors do only together.

Source: theory (48) and (50).
"""

from dataclasses import dataclass

import numpy as np

from kinetostat.accuracy.model import ErrorModel, error_model
from kinetostat.arrays import Array
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import Immutable
from kinetostat.studies.budget.inputs import Inputs
from kinetostat.studies.budget.spread import SHARE, Measures

AT_ONCE = 1024
"""Machines that are solved together."""


@dataclass(frozen=True, eq=False)
class ExactSample(Immutable):
    """Machines whose equations were solved exactly, at the pose of the machine.

    Attributes:
        machines: how many.
        failed: how many of them cannot be assembled with their actuators there.
        rms: root of the mean square of each measure [measures].
        usual: what 95 % of them keep within [measures].
        difference: the largest difference of a measure from its first order [measures].
        unexplained: share of the variance that single contributions do not explain [measures]; 0 where nothing varies.
    """

    machines: int
    failed: int
    rms: Array
    usual: Array
    difference: Array
    unexplained: Array


def solved_exactly(machine: Machine, inputs: Inputs, measures: Measures, count: int, seed: int) -> ExactSample:
    """Solve machines exactly at the pose of the machine.

    Args:
        machine: as drawn.
        inputs: variables and what they do there.
        measures: that are asked for.
        count: of machines, a power of 2.
        seed: of the machines.

    Raises:
        InputError: none of them can be assembled.
    """
    path = next(path for path in values(machine) if path.startswith(POSE))
    here = float(values(machine)[path])
    exact, first = [], []
    model: ErrorModel | None = None
    for slab in inputs.machines(count, seed):
        for start in range(0, len(slab), AT_ONCE):
            drawn = slab[start : start + AT_ONCE]
            if model is None or len(model) != len(drawn):
                model = error_model(machine, {path: np.full(len(drawn), here)}, len(drawn))
            moved, _ = model.displacement(inputs.drawn + drawn @ inputs.errors.T)
            linear = inputs.shift[0] + drawn @ inputs.columns[0].T
            exact.append(measures.applied(moved.T[None])[0].T)
            first.append(measures.applied(linear.T[None])[0].T)
    solved, linear = np.concatenate(exact), np.concatenate(first)
    closed = np.isfinite(solved).all(axis=1)
    if not closed.any():
        raise InputError(
            f"{machine.name}: none of the {count:,} machines can be assembled with its actuators there; make the "
            "tolerances smaller."
        )
    solved, linear = solved[closed], linear[closed]
    sizes = measures.sizes(solved)
    return ExactSample(
        count,
        int((~closed).sum()),
        np.sqrt((sizes**2).mean(axis=0)),
        np.percentile(sizes, SHARE, axis=0),
        np.abs(sizes - measures.sizes(linear)).max(axis=0),
        _unexplained(solved, linear, measures),
    )


def _unexplained(solved: Array, linear: Array, measures: Measures) -> Array:
    """The variance of what the first order leaves, over the variance [machines x rows] -> [measures]."""
    left, whole = (solved - linear).var(axis=0), solved.var(axis=0)
    places = [measures.places(name) for name in measures.names]
    parts, wholes = (np.array([each[rows].sum() for rows in places]) for each in (left, whole))
    return np.divide(parts, wholes, out=np.zeros_like(parts), where=wholes > 0.0)

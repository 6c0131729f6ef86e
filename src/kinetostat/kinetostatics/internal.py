"""Internal loads: wrenches that legs exert on each other through the platform without any load on it. One pose.

If a spring on their way deflects, elasticity decides how large they are. If everything is rigid, they are undecided,
and no motion of the platform depends on them.

Source: theory (9) and theory section 7.
"""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.screw import Wrench
from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.leg import free_springs_as_joints
from kinetostat.machine.leg import LegScrews
from kinetostat.tolerances import CLOSING_ROUND_OFF, DEPENDENT_WRENCHES


@dataclass(frozen=True)
class InternalLoads:
    """Statically indeterminate loads of a machine.

    Attributes:
        degree: number of independent internal loads that the legs can carry: 0 for an isostatic machine.
        undecided: number of these that deflect no spring.
        legs: names of the legs that carry internal loads.
        undecided_legs: names of the legs that carry undecided ones.
    """

    degree: int
    undecided: int
    legs: tuple[str, ...]
    undecided_legs: tuple[str, ...]


def internal_loads(
    names: Sequence[str], legs: Sequence[LegScrews], length: float, guide: Sequence[Wrench] = ()
) -> InternalLoads:
    """The internal loads of a machine at a regular pose.

    They are the null space of the matrix whose columns are the wrenches of all legs (and of the guide): amounts of
    these wrenches that add up to zero on the platform. Those among them that load no elastic spring are undecided.

    Args:
        names: names of the legs.
        legs: their screws at one reference point, base axes.
        length: characteristic length, m, by which moments are divided to compare them with forces.
        guide: the wrenches by which a planar machine is kept in its plane; none for a spatial machine.
    """
    balanced = [free_springs_as_joints(leg) for leg in legs]
    owners = np.repeat(np.arange(len(legs)), [len(leg.wrenches) for leg in balanced])
    columns = [wrench.components() for leg in balanced for wrench in leg.wrenches]
    columns += [wrench.components() for wrench in guide]
    if not columns:
        return InternalLoads(0, 0, (), ())
    matrix = np.array(columns, dtype=float).T / np.repeat([length, 1.0], 3)[:, None]
    sizes = np.linalg.norm(matrix, axis=0)
    _, values, rows = np.linalg.svd(matrix / sizes)
    internal = (rows[int((values > DEPENDENT_WRENCHES * values[0]).sum()) :] / sizes).T[: len(owners)]
    _, elastic, modes = np.linalg.svd(_load_shares(balanced) @ internal)
    decided = int((elastic > CLOSING_ROUND_OFF).sum())
    undecided = internal @ modes[decided:].T
    return InternalLoads(
        internal.shape[1],
        internal.shape[1] - decided,
        _involved_legs(names, owners, internal),
        _involved_legs(names, owners, undecided),
    )


def _load_shares(legs: Sequence[LegScrews]) -> Array:
    """Load in each elastic spring per unit of each leg's wrenches, over its order of size [springs x wrenches]."""
    rows: list[Array] = []
    count = sum(len(leg.wrenches) for leg in legs)
    start = 0
    for leg in legs:
        for loads, compliance, square in zip(leg.loads, leg.compliance, leg.load_squares, strict=True):
            if compliance > 0.0:
                rows.append(np.zeros(count))
                rows[-1][start : start + len(loads)] = np.array(loads, dtype=float) / math.sqrt(square)
        start += len(leg.wrenches)
    return np.array(rows).reshape(len(rows), count)


def _involved_legs(names: Sequence[str], owners: Integers, loads: Array) -> tuple[str, ...]:
    """Names of the legs that carry a share of any of these loads."""
    if not loads.size:
        return ()
    carried = np.abs(loads).max(axis=1) > DEPENDENT_WRENCHES * np.abs(loads).max()
    return tuple(name for i, name in enumerate(names) if carried[owners == i].any())

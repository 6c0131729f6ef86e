"""Quantities of a machine at poses that a user gives, as arrays. `datasets` makes labelled arrays of them."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Codes
from kinetostat.engine.batch import Progress, evaluate, silent
from kinetostat.engine.kernel import Identical
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import several
from kinetostat.studies.poses import PoseColumns
from kinetostat.studies.quantities import cable_count, refuse_absent, resolve_quantities, uncounted_loads

MATRICES = {"K": "stiffness", "C": "compliance"}
"""Beginning of the names of entries, by the name of the matrix."""
MACHINES_KEPT = 8
"""Number of machines, by identity, whose facts that do not depend on the poses are kept."""


@dataclass(frozen=True)
class PoseAnswers:
    """Quantities at poses, in their order.

    Attributes:
        machine: gives all fields that the poses do not name.
        poses: the poses.
        names: names of the quantities that were requested, without the matrices.
        matrices: "K", "C", both or none.
        values: values by quantity, with the entries of the matrices [poses]; NaN where the status is not OK.
        status: `Status` codes [poses].
        loads_left_out: a sentence on the loads of the file that do not count; empty if all do.
    """

    machine: Machine
    poses: PoseColumns
    names: tuple[str, ...]
    matrices: tuple[str, ...]
    values: Mapping[str, Array]
    status: Codes
    loads_left_out: str = ""

    @property
    def answered(self) -> bool:
        """Whether any pose has a result."""
        return bool((self.status == Status.OK).any())

    @property
    def failures(self) -> dict[Status, list[int]]:
        """The numbers of the poses, from 0, that have each status other than OK."""
        return {s: np.flatnonzero(self.status == s).tolist() for s in Status if s and (self.status == s).any()}

    def matrix(self, name: str) -> Array:
        """K or C at every pose [poses x n x n]; n is 6, or 3 of a planar machine."""
        parts = self.machine.family.component_names
        rows = [[self.values[entry_name(name, row, column)] for column in parts] for row in parts]
        return np.moveaxis(np.array(rows), 2, 0)


def entry_name(matrix: str, row: str, column: str) -> str:
    """Return the name of the quantity that is one entry of a matrix: for "K", "x" and "rz", "stiffness_rz_x"."""
    first, last = sorted((row, column), key=COMPONENTS.index)
    return "_".join([MATRICES[matrix], *dict.fromkeys((first, last))])


def answers_at(
    machine: Machine, poses: PoseColumns, quantities: Sequence[str], progress: Progress = silent
) -> PoseAnswers:
    """Evaluate quantities at poses; see `evaluate`.

    Args:
        machine: gives all fields that the poses do not name.
        poses: the poses.
        quantities: names of quantities, groups, or "K" and "C".
        progress: called with the number of points done and of all points.

    Raises:
        InputError: an unknown quantity, or one that the machine cannot have.
    """
    wanted, parts = several(quantities), machine.family.component_names
    matrices = tuple(dict.fromkeys(name for name in wanted if name in MATRICES))
    state, cables = _state_and_cables(Identical(machine))
    names = tuple(resolve_quantities([name for name in wanted if name not in MATRICES], parts, cables))
    refuse_absent(state, names, poses.fields)
    entries = [entry_name(matrix, row, column) for matrix in matrices for row in parts for column in parts]
    computed = evaluate(machine, PointTable(poses.leaves), tuple(dict.fromkeys([*names, *entries])), progress)
    uncounted = uncounted_loads(state, computed.values, zip(poses.fields, poses.values, strict=True))
    return PoseAnswers(machine, poses, names, matrices, computed.values, computed.status, uncounted)


@lru_cache(MACHINES_KEPT)
def _state_and_cables(machine: Identical) -> tuple[MachineState, int]:
    """The state of a machine at its pose, kept with everything that it has computed, and the number of cables."""
    return state_of(machine.value), cable_count(machine.value)

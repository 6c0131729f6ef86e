"""Quantities of a machine at poses of the user's own, as arrays. `dataset` makes a labelled dataset of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.batch import Codes, Progress, evaluate, silent
from kinetostat.engine.points import Array, Table
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import several
from kinetostat.studies.evaluation.columns import PoseColumns
from kinetostat.studies.grid.quantities import refuse_absent, resolve_quantities
from kinetostat.studies.plain_data import as_answer

MATRICES = {"K": "stiffness", "C": "compliance"}
"""Whole matrices by name, and how the names of their entries begin."""


@dataclass(frozen=True)
class PoseAnswers:
    """Quantities at poses, in their order.

    Attributes:
        machine: gives all fields that the poses do not name.
        poses: where.
        names: of the quantities that are asked for; matrices are not among them.
        matrices: "K", "C", both or none.
        values: by quantity, the entries of the matrices included [poses]; NaN where the status is not OK.
        status: `Status` codes [poses].
    """

    machine: Machine
    poses: PoseColumns
    names: tuple[str, ...]
    matrices: tuple[str, ...]
    values: Mapping[str, Array]
    status: Codes

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
    """Return the quantity that is one entry of a matrix: of "K", "x" and "rz", stiffness_rz_x."""
    first, last = sorted((row, column), key=COMPONENTS.index)
    return "_".join([MATRICES[matrix], *dict.fromkeys((first, last))])


def answers_at(
    machine: Machine, poses: PoseColumns, quantities: Sequence[str], progress: Progress = silent
) -> PoseAnswers:
    """Evaluate quantities at poses; see `evaluate`.

    Args:
        machine: gives all fields that the poses do not name.
        poses: where.
        quantities: names of quantities, groups, or "K" and "C".
        progress: receives how far the work is.

    Raises:
        InputError: an unknown quantity, or one that the machine cannot have.
    """
    wanted, parts = several(quantities), machine.family.component_names
    matrices = tuple(dict.fromkeys(name for name in wanted if name in MATRICES))
    names = tuple(resolve_quantities([name for name in wanted if name not in MATRICES], parts))
    refuse_absent(machine, names, poses.fields)
    entries = [entry_name(matrix, row, column) for matrix in matrices for row in parts for column in parts]
    computed = evaluate(machine, Table(poses.leaves), tuple(dict.fromkeys([*names, *entries])), progress)
    return PoseAnswers(machine, poses, names, matrices, computed.values, computed.status)


def as_json(answers: PoseAnswers) -> dict[str, Any]:
    """The answers as plain data, SI: lists with one entry for each pose, null where there is no finite value."""
    words = [Status(code).word for code in answers.status.tolist()]
    variables = {name: {"units": QUANTITIES[name].unit, "values": answers.values[name]} for name in answers.names}
    return as_answer(
        {
            "name": answers.machine.name,
            "poses": {
                field.path: {"units": field.unit, "values": values}
                for field, values in zip(answers.poses.fields, answers.poses.values, strict=True)
            },
            "variables": variables,
            "matrices": {name: answers.matrix(name) for name in answers.matrices},
            "components": answers.machine.family.component_names,
            "status": words,
        }
    )

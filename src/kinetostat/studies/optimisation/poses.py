"""The poses at which every design is judged: the machine's own, a list, a grid, or the workspace in a grid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from kinetostat.arrays import Array
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import find, values
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.immutable import Immutable
from kinetostat.spec.study import PosesTable
from kinetostat.studies.grid import GridQuestion, grid_question
from kinetostat.studies.workspace import unit_product, workspace
from kinetostat.units import UnitError

MOST_POSES = 1_000_000


@dataclass(frozen=True, eq=False)
class PoseSet(Immutable):
    """Where designs are judged.

    Attributes:
        columns: values by leaf path, SI [poses]; empty for the machine's own pose.
        required: share of the poses that a design must reach.
        box: of a grid over coordinates of the pose alone, its volume and the unit of that.
        description: of the poses, in words.
    """

    columns: Mapping[str, Array]
    required: float
    box: tuple[float, str] | None
    description: str

    @property
    def count(self) -> int:
        """How many."""
        return len(next(iter(self.columns.values()), (0.0,)))


def read_poses(machine: Machine, table: PosesTable) -> PoseSet:
    """The poses of a study file.

    Raises:
        InputError: an unknown field, a bad range or value, both a list and a grid, nothing in the workspace.
    """
    if table.listed is not None and table.over is not None:
        raise InputError("[poses] has both list and over; give one of them.")
    if (table.within or table.where) and table.over is None:
        raise InputError("[poses]: within and where belong to a grid; add over = [...].")
    if table.where and table.within is None:
        raise InputError('[poses]: where belongs to within = "workspace"; add that.')
    if table.listed:
        columns = _listed(machine, table.listed)
        return PoseSet(columns, table.required, None, f"{len(table.listed)} poses of a list")
    if table.over:
        return _grid(machine, table)
    return PoseSet({}, table.required, None, "the machine's own pose")


def _listed(machine: Machine, rows: Sequence[Mapping[str, float | str]]) -> dict[str, Array]:
    numbers = values(machine)
    read = [_row(machine, row, f"poses.list.{i}") for i, row in enumerate(rows)]
    paths = dict.fromkeys(path for row in read for path in row)
    return {path: np.array([row.get(path, float(numbers[path])) for row in read]) for path in paths}


def _row(machine: Machine, row: Mapping[str, float | str], where: str) -> dict[str, float]:
    row_values = {}
    for name, written in row.items():
        field = find(machine.family, name)
        try:
            value = field.quantity.number(written)
        except UnitError as error:
            raise InputError(f"{where}.{name} is {shorten(written)}: {error}.") from None
        row_values.update(dict.fromkeys(field.leaves, value))
    return row_values


def _grid(machine: Machine, table: PosesTable) -> PoseSet:
    question = grid_question(machine, table.over or [], ["singularity_margin"])
    if question.grid.size > MOST_POSES:
        raise InputError(f"[poses] has {question.grid.size:,} nodes; at most {MOST_POSES:,} are allowed.")
    columns = question.grid.columns(0, question.grid.size)
    size = "x".join(str(count) for count in question.grid.shape)
    if table.within is None:
        return PoseSet(columns, table.required, _box(question), f"a grid of {size} poses")
    inside = workspace(machine, table.over or [], table.where).dataset["verdict"].values.ravel() == 0
    if not inside.any():
        raise InputError("[poses]: no node of the grid lies in the workspace of the machine; widen over or where.")
    kept = {path: column[inside] for path, column in columns.items()}
    description = f"{int(inside.sum())} poses in the workspace, of a grid of {size}"
    return PoseSet(kept, table.required, None, description)


def _box(question: GridQuestion) -> tuple[float, str] | None:
    if not all(field.startswith("pose.") for field in question.fields):
        return None
    spans = [abs(float(axis.values[-1] - axis.values[0])) for axis in question.grid.axes]
    return prod(spans), unit_product([str(question.labels[dim].attrs["units"]) for dim in question.dims])

"""The legs that carry a machine over a grid of poses or loads: in each state of rest, those that are not slack.

Source: theory section 12.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress, silent
from kinetostat.engine.loaded import Way
from kinetostat.equilibrium.numbers import states_of_rest
from kinetostat.equilibrium.state import MachineState, state_of, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine, springs
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.studies.datasets import ABOUT_STATUS
from kinetostat.studies.grid import grid_question


@dataclass(frozen=True, eq=False)
class Carrying(ImmutableAnswer):
    """The sets of legs that carry at the points of a grid.

    Attributes:
        machine: the machine with its loads; gives all parameters that do not vary.
        dataset: over the grid: `carrying` (place in `sets`, -1 where the machine comes to no rest) and `status`.
        legs: names of all legs.
        sets: names of the legs that carry together, the most frequent set first.
        points: how many points of the grid have each set.
    """

    machine: Machine
    dataset: xr.Dataset
    legs: tuple[str, ...]
    sets: tuple[tuple[str, ...], ...]
    points: tuple[int, ...]

    def __repr__(self) -> str:
        return f"<Carrying of {self.machine.name!r}: {len(self.sets)} sets of legs>"

    @property
    def is_map(self) -> bool:
        """Whether the grid has two dimensions, so that a map shows it."""
        return len(self.dataset["status"].dims) == 2


@checked
def carrying_legs(machine: Machine | MachineState, ranges: Sequence[str], progress: Progress = silent) -> Carrying:
    """Find which legs carry the machine at rest under its loads, over all combinations of some ranges.

    A leg is slack where one of its springs could only carry loads of the other sign; all other legs carry.

    Args:
        machine: the machine with its loads, or its state (`state_of`); gives all parameters that do not vary.
        ranges: one axis each, "FIELD=from:to:count[:log]".
        progress: receives how far the work is.

    Raises:
        InputError: no leg of the machine can go slack, a range that `evaluate_grid` refuses, or loads that
            `under_load` refuses.
    """
    state = state_of(machine)
    question, placed, machine = grid_question(state, ranges, ["slack_springs"]), state.configuration, state.machine
    if not any(spring.acts for spring in springs(placed)):
        raise InputError(
            f'all legs of {machine.name} pull and push, so that all of them carry; write acts = "pulls" at an '
            'actuator, or a leg of type = "cable".'
        )
    names, size = [leg.name for leg in placed.legs], question.grid.size
    carries, status = np.zeros((size, len(names)), dtype=bool), np.zeros(size, dtype=np.int8)
    for start in range(0, size, Way.ANY_MACHINE.slab):
        part = slice(start, min(start + Way.ANY_MACHINE.slab, size))
        carries[part], status[part] = _slab(machine, question.grid.columns(part.start, part.stop), len(names))
        progress(part.stop, size)
    rested = [tuple(row) for row in carries[status == Status.OK].tolist()]
    ranked = Counter(rested).most_common()
    places = {row: place for place, (row, _) in enumerate(ranked)}
    codes = np.full(size, -1, dtype=np.int16)
    codes[status == Status.OK] = [places[row] for row in rested]
    sets = tuple(tuple(n for n, carried in zip(names, row, strict=True) if carried) for row, _ in ranked)
    meanings = " ".join("+".join("_".join(name.split()) for name in names) or "none" for names in sets)
    about = {"units": "1", "flag_values": list(range(len(sets))), "flag_meanings": meanings}
    shape = question.grid.shape
    dataset = question.labels.assign(
        carrying=(question.dims, codes.reshape(shape), about),
        status=(question.dims, status.reshape(shape), ABOUT_STATUS),
    )
    return Carrying(machine, dataset, tuple(names), sets, tuple(count for _, count in ranked))


def _slab(machine: Machine, columns: dict[str, Array], legs: int) -> tuple[Any, Any]:
    """Whether each leg carries at some points [points x legs], and `Status` codes [points]."""
    count = len(next(iter(columns.values())))
    carries = np.zeros((count, legs), dtype=bool)
    states = states_of_rest(states_at(machine, columns, count))
    if states.equations is not None and states.stability is not None:
        pairs = zip(states.equations.mechanism.legs, states.equations.legs, strict=True)
        slack = [((leg.sign != 0.0) & (terms.carrying == 0.0)).any(axis=1) for leg, terms in pairs]
        carries[states.rows] = ~np.stack(slack, axis=1)[states.stability.stable]
    return carries, states.status.astype(np.int8)

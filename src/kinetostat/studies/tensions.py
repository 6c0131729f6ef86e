"""Legs that only pull or only push: tensions of cables at a pose, and over a grid the legs that are not slack.

The formulas are in `equilibrium.cables` and `equilibrium.numbers`.

Source: theory section 12 for slack legs, section 18 for cables.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetostat.arrays import Array, Codes, Mask
from kinetostat.equilibrium.cables import Cables, cable_signs, cables_of
from kinetostat.equilibrium.state import MachineState, state_of, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine, springs
from kinetostat.machine.parameters import POSE, with_values
from kinetostat.numerics.polytopes import wrench_closure
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.studies.poses import given_poses
from kinetostat.studies.under_load import why_no_tensions

if TYPE_CHECKING:
    import xarray as xr

    from kinetostat.engine import loaded
    from kinetostat.equilibrium import numbers
    from kinetostat.studies import datasets
else:  # only a grid needs them, and labelled datasets take longer to import than the tensions of a pose to compute
    loaded = LateModule("kinetostat.engine.loaded")
    numbers = LateModule("kinetostat.equilibrium.numbers")
    datasets = LateModule("kinetostat.studies.datasets")

SAG_MATTERS = 0.95
"""Share of the stiffness of a straight cable below which a cable's sag is said to matter: Young's modulus of a rope is
hardly known better than to a twentieth."""


@dataclass(frozen=True)
class CableState:
    """A cable at the pose.

    Attributes:
        name: name of its leg.
        tension: tension at the platform, N; None where no tensions hold the load.
        base_tension: tension where it leaves the base, N; the same of a straight cable.
        reserve: distance of the tension from the nearer of its bounds, N.
        length: unstretched length from where it leaves the base to the platform, with what lies on its pulley, m.
        sag: greatest distance from the line of its ends, m.
        stiffness_share: share of a straight cable's stiffness along the line of its ends.
    """

    name: str
    tension: float | None
    base_tension: float | None
    reserve: float | None
    length: float
    sag: float
    stiffness_share: float


@dataclass(frozen=True, eq=False)
class Tensions(ImmutableAnswer):
    """Tensions of the cables of a machine.

    Attributes:
        machine: the machine at its pose, with its loads.
        status: OK, or NO_REST where no tensions within the bounds hold the load, or sagging cables find no shape.
        message: the answer in a sentence.
        cables: all cables.
        bounds: least and greatest tension that are allowed, N; the greatest one may be infinite.
        capacity: distance of the load with its box, or of all required wrenches, from the border of the set of wrenches
            that the cables can hold, N, moments over the length of the machine; negative where they cannot hold them.
        wrench_closure: positive where cables without an upper bound hold any wrench.
        required: number of wrenches that the capacity is about.
    """

    machine: Machine
    status: Status
    message: str
    cables: tuple[CableState, ...]
    bounds: tuple[float, float]
    capacity: float
    wrench_closure: float
    required: int

    def __repr__(self) -> str:
        return f"<Tensions of {self.machine.name!r}: {self.status.word}, {len(self.cables)} cables>"

    @property
    def sag_message(self) -> str:
        """A sentence on the sag of the cables; on what says it where they are straight."""
        table, show = self.machine.tables["cables"], self.machine.display.show
        if not table.linear_density:
            return "Cables are straight here; with [cables] linear_density they hang under their own weight."
        if any(math.isnan(cable.sag) for cable in self.cables):
            return "The sag of cables without a shape is not known."
        deepest = max(self.cables, key=lambda cable: cable.sag)
        softest = min(self.cables, key=lambda cable: cable.stiffness_share)
        share = f"{100.0 * softest.stiffness_share:.0f} % of the stiffness of a straight cable"
        matters = "Sag matters" if softest.stiffness_share < SAG_MATTERS else "Sag matters little"
        return f"{matters}: {deepest.name} sags by {show(deepest.sag, 'm')}, and {softest.name} keeps {share}."


@checked
def tensions(machine: Machine | MachineState, wrenches: Any = None) -> Tensions:
    """Choose the tensions of a machine whose legs are cables, within the bounds of its [load] and as [cables] says.

    Args:
        machine: the machine at its pose with its loads, or its state.
        wrenches: loads that must be held at this pose, for the capacity: a DataFrame, a dictionary or a CSV file with
            columns such as "load.force.2" or "tool.payload" as `evaluate` takes them; the cables can then hold all
            mixtures of them as well.

    Raises:
        InputError: a leg is not a cable, nothing says what weighs, or `wrenches` cannot be read or move the pose.
    """
    machine = state_of(machine).machine
    signs = cable_signs(machine)
    if not signs:
        raise InputError(f'{machine.name} has legs that are not cables; write every leg with type = "cable".')
    with np.errstate(all="ignore"):
        cables = cables_of(machine, signs, 1)
        required = None if wrenches is None else _required_loads(machine, wrenches)
        capacity = float(cables.capacity(required)[0])
        closure = float(wrench_closure(cables.wrenches)[0])
    tensions_exist = bool(cables.tensions[1][0])
    states = _cable_states(machine, cables)
    return Tensions(
        machine=machine,
        status=Status.OK if tensions_exist else Status.NO_REST,
        message=_message(machine, states, tensions_exist, shapes_settle=bool(cables.settled[0])),
        cables=states,
        bounds=(float(cables.least[0]), float(cables.most[0])),
        capacity=capacity,
        wrench_closure=closure,
        required=1 if required is None else len(required),
    )


def _message(machine: Machine, states: Sequence[CableState], tensions_exist: bool, shapes_settle: bool) -> str:
    """The answer in a sentence: the range of the tensions, or the reason why there are none."""
    if tensions_exist:
        show, sizes = machine.display.show, [cable.tension for cable in states if cable.tension is not None]
        return f"Tensions from {show(min(sizes), 'N')} to {show(max(sizes), 'N')} hold the load."
    if not shapes_settle:
        return (
            f"No shape was found in which the cables of {machine.name} hang and hold this load: tensions and shapes, "
            "which follow from each other, do not settle. Raise load.min_tension, or make the cables lighter."
        )
    return why_no_tensions(machine)


def _required_loads(machine: Machine, wrenches: Any) -> Array:
    """Loads that must be held, in the units of `Cables.load` [k x d]."""
    columns = given_poses(machine, Path(wrenches) if isinstance(wrenches, str) else wrenches)
    moving_fields = [field.path for field in columns.fields if field.path.startswith((POSE, "geometry.", "legs."))]
    if moving_fields:
        raise InputError(f"wrenches has {moving_fields[0]}, which moves the machine; it takes loads at a single pose.")
    placed = with_values(machine, columns.leaves)
    return cables_of(placed, cable_signs(machine), columns.count).load


def _cable_states(machine: Machine, cables: Cables) -> tuple[CableState, ...]:
    """The cables, straight ones (without a shape) or hanging ones."""
    tensions_or_nan, shape = cables.tensions[0][0], cables.shape
    straight = np.sqrt(((cables.near - cables.far) ** 2).sum(axis=2))[0]
    if shape is None:
        stretch = np.where(np.isnan(tensions_or_nan), 0.0, tensions_or_nan) / cables.stiffness[0]
        lengths, base_tensions = straight - stretch, tensions_or_nan
        sags, shares = np.zeros(len(straight)), np.ones(len(straight))
    else:
        lengths, base_tensions = shape.length[0], shape.base_tension[0]
        sags, shares = shape.sag[0], shape.stiffness_share[0]
    least, most = float(cables.least[0]), float(cables.most[0])
    states = []
    for number, steps in enumerate(machine.chains().legs):
        tension = None if math.isnan(tensions_or_nan[number]) else float(tensions_or_nan[number])
        states.append(
            CableState(
                name=next(spring.part_name for step in steps for spring in step.element.springs).rpartition(" ")[0],
                tension=tension,
                base_tension=None if tension is None else float(base_tensions[number]),
                reserve=None if tension is None else min(tension - least, most - tension),
                length=float(lengths[number] + cables.wound[0][number]),
                sag=float(sags[number]),
                stiffness_share=float(shares[number]),
            )
        )
    return tuple(states)


@dataclass(frozen=True, eq=False)
class Carrying(ImmutableAnswer):
    """The sets of legs that carry at the points of a grid.

    Attributes:
        machine: the machine with its loads; gives all parameters that do not vary.
        dataset: the grid with `carrying` (place in `sets`, -1 where the machine comes to no rest) and `status`.
        legs: names of all legs.
        sets: names of the legs that carry together, the most frequent set first.
        points: number of points of the grid with each set.
    """

    machine: Machine
    dataset: "xr.Dataset"
    legs: tuple[str, ...]
    sets: tuple[tuple[str, ...], ...]
    points: tuple[int, ...]

    def __repr__(self) -> str:
        count = f"{len(self.sets)} set{'s' if len(self.sets) != 1 else ''} of legs"
        return f"<Carrying of {self.machine.name!r}: {count}>"

    @property
    def is_map(self) -> bool:
        """Whether the grid has two dimensions, so that a map shows it."""
        return len(self.dataset["status"].dims) == 2


@checked
def carrying_legs(
    machine: Machine | MachineState, ranges: Sequence[str], progress: Callable[[int, int], None] | None = None
) -> Carrying:
    """Find which legs carry the machine at rest under its loads, over all combinations of some ranges.

    A leg is slack where one of its springs could only carry loads of the other sign; all other legs carry.

    Args:
        machine: the machine with its loads, or its state (`state_of`); gives all parameters that do not vary.
        ranges: one axis each, "FIELD=from:to:count[:log]".
        progress: receives how far the work is; nobody does if None.

    Raises:
        InputError: no leg of the machine can go slack, a range that `evaluate_grid` refuses, or loads that
            `under_load` refuses.
    """
    state = state_of(machine)
    machine, question = state.machine, datasets.grid_question(state, ranges, ["slack_springs"])
    if not any(spring.acts for spring in springs(state.configuration)):
        raise InputError(
            f'all legs of {machine.name} pull and push, so that all of them carry; write acts = "pulls" at an '
            'actuator, or a leg of type = "cable".'
        )
    names, size = [leg.name for leg in state.configuration.legs], question.grid.size
    points_at_once = loaded.Way.ANY_MACHINE.slab
    carries, status = np.zeros((size, len(names)), dtype=bool), np.zeros(size, dtype=np.int8)
    for start in range(0, size, points_at_once):
        slab = slice(start, min(start + points_at_once, size))
        columns = question.grid.columns(slab.start, slab.stop)
        carries[slab], status[slab] = _carrying_in_slab(machine, columns, slab.stop - start, len(names))
        if progress is not None:
            progress(slab.stop, size)
    codes, rows, counts = _numbered_sets(carries, status == Status.OK)
    sets = tuple(tuple(name for name, carried in zip(names, row, strict=True) if carried) for row in rows)
    words = ["+".join("_".join(name.split()) for name in members) or "none" for members in sets]
    about_sets = {"units": "1", "flag_values": list(range(len(sets))), "flag_meanings": " ".join(words)}
    shape = question.grid.shape
    dataset = question.labels.assign(
        carrying=(question.dims, codes.reshape(shape), about_sets),
        status=(question.dims, status.reshape(shape), datasets.ABOUT_STATUS),
    )
    return Carrying(machine=machine, dataset=dataset, legs=tuple(names), sets=sets, points=counts)


def _numbered_sets(carries: Mask, at_rest: Mask) -> tuple[Codes, list[tuple[bool, ...]], tuple[int, ...]]:
    """The number of the set of legs that carry at each point, -1 without rest; the sets; and how often each occurs.

    Args:
        carries: whether each leg carries at each point [points x legs].
        at_rest: whether the machine comes to rest there [points].
    """
    sets_at_rest = [tuple(row) for row in carries[at_rest].tolist()]
    ranked = Counter(sets_at_rest).most_common()
    numbers_of_sets = {row: number for number, (row, _) in enumerate(ranked)}
    codes = np.full(len(carries), -1, dtype=np.int16)
    codes[at_rest] = [numbers_of_sets[row] for row in sets_at_rest]
    return codes, [row for row, _ in ranked], tuple(count for _, count in ranked)


def _carrying_in_slab(machine: Machine, columns: dict[str, Array], count: int, legs: int) -> tuple[Mask, Codes]:
    """Whether each leg carries at some points [points x legs], and `Status` codes [points]."""
    carries = np.zeros((count, legs), dtype=bool)
    states = numbers.states_of_rest(states_at(machine, columns, count))
    if states.equations is not None and states.stability is not None:
        pairs = zip(states.equations.mechanism.legs, states.equations.legs, strict=True)
        slack = [((leg.sign != 0.0) & (terms.carrying == 0.0)).any(axis=1) for leg, terms in pairs]
        carries[states.rows] = ~np.stack(slack, axis=1)[states.stability.stable]
    return carries, states.status.astype(np.int8)

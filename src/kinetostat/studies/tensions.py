"""Tensions of the cables of a machine at its pose, how they hang, and how far its load is from what they can hold.

Source: theory section 18. The formulas are in `equilibrium.cables`.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.equilibrium.cables import Cables, cable_signs, cables_of
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, with_values
from kinetostat.numerics.polytopes import wrench_closure
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.studies.poses import given_poses
from kinetostat.studies.under_load import why_no_tensions

SAG_MATTERS = 0.95
"""Share of the stiffness of a straight cable below which a cable's sag is said to matter."""


@dataclass(frozen=True)
class CableState:
    """A cable at the pose.

    Attributes:
        name: of its leg.
        tension: at the platform, N; None where no tensions hold the load.
        base_tension: where it leaves the base, N; the same of a straight cable.
        reserve: distance of the tension from the nearer of its bounds, N.
        length: unstretched, from where it leaves the base to the platform, with what lies on its pulley, m.
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
        machine: at its pose, with its loads.
        status: OK, or NO_REST where no tensions within the bounds hold the load.
        message: the answer in a sentence.
        cables: every cable.
        bounds: least and greatest tension that are allowed, N; the greatest one may be infinite.
        capacity: how far the load with its box, or every required wrench, is inside the set of wrenches that the
            cables can hold, N, moments over the length of the machine; negative where they cannot hold them.
        wrench_closure: positive where cables without an upper bound hold any wrench.
        required: how many wrenches the capacity is about.
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
        deepest = max(self.cables, key=lambda cable: cable.sag)
        softest = min(self.cables, key=lambda cable: cable.stiffness_share)
        share = f"{100.0 * softest.stiffness_share:.0f} % of the stiffness of a straight cable"
        matters = "Sag matters" if softest.stiffness_share < SAG_MATTERS else "Sag matters little"
        return f"{matters}: {deepest.name} sags by {show(deepest.sag, 'm')}, and {softest.name} keeps {share}."


@checked
def tensions(machine: Machine | MachineState, wrenches: Any = None) -> Tensions:
    """Choose the tensions of a machine whose legs are cables, within the bounds of its [load] and as [cables] says.

    Args:
        machine: with its pose and loads, or its state.
        wrenches: loads that must be held at this pose, for the capacity: a DataFrame, a dictionary or a CSV file with
            columns such as "load.force.2" or "tool.payload" as `evaluate` takes them; the cables can then hold all
            mixtures of them as well.

    Raises:
        InputError: a leg is not a cable, nothing says what weighs, or `wrenches` cannot be read or move the pose.
    """
    given = state_of(machine).machine
    signs = cable_signs(given)
    if not signs:
        raise InputError(f'{given.name} has legs that are not cables; write every leg with type = "cable".')
    with np.errstate(all="ignore"):
        cables = cables_of(given, signs, 1)
        required = None if wrenches is None else _required_loads(given, wrenches)
        capacity = float(cables.capacity(required)[0])
        closed = float(wrench_closure(cables.wrenches)[0])
    exist = bool(cables.tensions[1][0])
    states = _states(given, cables)
    show = given.display.show
    if exist:
        sizes = [cable.tension for cable in states if cable.tension is not None]
        ends = f"{show(min(sizes), 'N')} to {show(max(sizes), 'N')}"
        message = f"Tensions from {ends} hold the load."
    else:
        message = why_no_tensions(given)
    return Tensions(
        given,
        Status.OK if exist else Status.NO_REST,
        message,
        states,
        (float(cables.least[0]), float(cables.most[0])),
        capacity,
        closed,
        1 if required is None else len(required),
    )


def _required_loads(machine: Machine, wrenches: Any) -> Array:
    """Loads that must be held, in the units of `Cables.load` [k x d]."""
    columns = given_poses(machine, Path(wrenches) if isinstance(wrenches, str) else wrenches)
    moved = [field.path for field in columns.fields if field.path.startswith((POSE, "geometry.", "legs."))]
    if moved:
        raise InputError(f"wrenches has {moved[0]}, which moves the machine; it takes loads at a single pose.")
    placed = with_values(machine, columns.leaves)
    return cables_of(placed, cable_signs(machine), columns.count).load


def _states(machine: Machine, cables: Cables) -> tuple[CableState, ...]:
    chosen, shape = cables.tensions[0][0], cables.shape
    straight = np.sqrt(((cables.near - cables.far) ** 2).sum(axis=2))[0]
    slack = np.where(np.isnan(chosen), 0.0, chosen) / cables.stiffness[0]
    lengths = (straight - slack if shape is None else shape.length[0]) + cables.wound[0]
    ends = chosen if shape is None else shape.base_tension[0]
    sags, shares = (
        (np.zeros(len(chosen)), np.ones(len(chosen))) if shape is None else (shape.sag[0], shape.stiffness_share[0])
    )
    states = []
    for number, steps in enumerate(machine.chains().legs):
        name = next(spring.of for step in steps for spring in step.element.springs).rpartition(" ")[0]
        tension = None if math.isnan(chosen[number]) else float(chosen[number])
        least, most = float(cables.least[0]), float(cables.most[0])
        states.append(
            CableState(
                name,
                tension,
                None if tension is None else float(ends[number]),
                None if tension is None else min(tension - least, most - tension),
                float(lengths[number]),
                float(sags[number]),
                float(shares[number]),
            )
        )
    return tuple(states)

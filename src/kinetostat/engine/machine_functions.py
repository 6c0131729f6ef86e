"""Arguments and results of functions that are printed in another language, and points at which they are compared.

A function takes the coordinates of the pose, and after them parameters that were chosen; all other numbers of the
machine are part of its code. The languages are in `c_source` and `page`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import evaluate
from kinetostat.engine.form import (
    Form,
    Specimen,
    TracedPlacement,
    TracedShares,
    form_with_numbers,
    placement_of,
    shares_of,
    step_of,
)
from kinetostat.engine.kernel import closes_inside
from kinetostat.engine.loaded import have_programs
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.cut import cut_machine
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, MapQuantity
from kinetostat.machine.actuators import Actuator
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, parameters, values
from kinetostat.machine.written.family import at_home
from kinetostat.spec.errors import InputError, choice
from kinetostat.vibration.springwise import ModeCounts, SpringSizes, mode_counts_of, sizes_over_springs

LOADS = frozenset(("force", "moment", "gravity", "preload", "temperature_rise"))
"""Words of leaf paths that load a machine."""
ENTRIES = [name for name in QUANTITIES if name.partition("_")[0] in ("compliance", "stiffness")]
"""Quantities that are the entries of C and then of K, on and above the diagonal."""
DISPLACEMENTS = [name for name in QUANTITIES if name.startswith("displacement_")]
"""Quantities that are the motion of the tool under the loads: rotation vector, then displacement."""
STEPS_FORWARD, SHORTEST_SHARE = 30, 1e-4
"""Steps of forward kinematics, and the share of a step below which no shorter one is tried."""
SAMPLES, AROUND = 9, 0.02
"""Points at which functions are compared: that of the file and others near it, so far away in rad or in units of the
machine's length."""


@dataclass(frozen=True)
class MachineFunctions:
    """Arguments and results of the functions of a machine, whatever language they are written in.

    Attributes:
        machine: at its pose; free, whatever its file says, where its states of rest have no programs.
        inputs: leaf paths of the arguments: coordinates of the pose, then parameters that were chosen.
        coordinates: number of the coordinates.
        quantities: names of the quantities.
        form: how programs take the machine's numbers: all but the inputs are part of the code.
        closed: whether programs close the legs themselves.
        placement: formula of actuators, tool point, orientation and points of legs.
        rests: whether its states of rest have programs.
        mode_counts: modes over springs that the program of the quantities needs to be given; None if none.
    """

    machine: Machine
    inputs: tuple[str, ...]
    coordinates: int
    quantities: tuple[str, ...]
    form: Form
    closed: bool
    placement: TracedPlacement
    rests: bool
    mode_counts: ModeCounts | None

    @cached_property
    def specimen(self) -> Specimen:
        """The machine as a kind."""
        return Specimen(at_home(self.machine, self.inputs))

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """The actuators, with traced coordinates."""
        return self.placement.actuators

    @property
    def square(self) -> bool:
        """Whether there are as many actuators as coordinates, so that the way back is a square system."""
        return len(self.actuators) == self.coordinates

    @cached_property
    def shares(self) -> TracedShares:
        """Formula of what each part contributes to the compliance."""
        return shares_of(self.specimen, self.form, self.closed)

    @cached_property
    def states(self) -> int:
        """The number of coordinates of a state of rest."""
        return len(step_of(self.specimen, self.form, self.closed).body.results) - 1

    @cached_property
    def springs(self) -> SpringSizes:
        """Sizes of what the modes over springs are made of, where there are such."""
        return sizes_over_springs(self.machine)

    def needs_modes(self, quantity: MapQuantity) -> bool:
        """Whether the program of a quantity needs modes over springs."""
        return self.mode_counts is not None and self.mode_counts.needed_by(quantity)

    @cached_property
    def length(self) -> float:
        """The machine's length, m."""
        return float(self.machine.chains().length if self.closed else self.machine.configure().length)

    @cached_property
    def kinds(self) -> list[str]:
        """Kinds of the inputs: length, angle, ..."""
        by_path = {leaf: p.quantity for p in parameters(self.machine.family) for leaf in p.leaves}
        return [by_path[path].kind for path in self.inputs]

    @property
    def arguments(self) -> list[tuple[str, str]]:
        """Leaf path and kind of each input."""
        return list(zip(self.inputs, self.kinds, strict=True))

    @property
    def needs_state(self) -> bool:
        """Whether a quantity is about the machine at rest."""
        return any(QUANTITIES[name].loaded for name in self.quantities)


def functions_of(machine: Machine, inputs: Sequence[str], outputs: Sequence[str]) -> MachineFunctions:
    """Choose what functions of a machine take and give.

    Args:
        machine: at its pose.
        inputs: leaf paths of parameters that become arguments after the coordinates of the pose, as "load.force.2".
        outputs: names of quantities, as "compliance_x".

    Raises:
        InputError: legs of the machine have no closed form, or an input or output is unknown or has no program.
    """
    closed = machine.family.chains is not None
    if closed and not closes_inside(machine):
        raise InputError(
            f"{machine.name} cannot be written as a program: a leg of it has no closed form, so that its joints are "
            "found by iteration along a way; legs have one if three of their revolutes are parallel, or if a ball "
            "joint is at one end."
        )
    known = values(machine)
    pose = [name for name in known if name.startswith(POSE)]
    chosen = [choice(name, [leaf for leaf in known if leaf not in pose], "--inputs") for name in inputs]
    wanted = [choice(name, [q for q, row in QUANTITIES.items() if not row.cut], "--outputs") for name in outputs]
    paths = tuple(dict.fromkeys([*pose, *chosen]))
    acting = any(value or path in paths for path, value in known.items() if LOADS.intersection(path.split(".")))
    rests = acting and cut_machine(machine, paths) is not None
    needing = [name for name in wanted if not _has_program(machine, paths, name, rests)]
    if needing:
        raise InputError(
            f"{needing[0]} has no program for {machine.name}: nothing loads it, or its equations cannot be reduced to "
            "few coordinates; leave it out of --outputs, or give the machine a load."
        )
    if machine.loaded and not rests:  # what no program brings to rest is the free machine in all of them
        machine = replace(machine, loaded=False)
    counts = mode_counts_of(machine, wanted, paths)
    form = form_with_numbers(machine, paths)
    placement = placement_of(Specimen(at_home(machine, paths)), form, paths, closed)
    return MachineFunctions(
        machine, paths, len(pose), tuple(dict.fromkeys(wanted)), form, closed, placement, rests, counts
    )


def _has_program(machine: Machine, paths: tuple[str, ...], name: str, rests: bool) -> bool:
    """Whether a quantity has a program, alone or with modes over springs that a loop finds."""
    if QUANTITIES[name].loaded and not rests:
        return False
    return have_programs(machine, paths, [name]) or mode_counts_of(machine, [name], paths) is not None


def quantities_at(functions: MachineFunctions, columns: Mapping[str, Array], names: Sequence[str]) -> Array:
    """Compute quantities at points without the printed formulas [points x names]; columns are values by leaf path."""
    answers = evaluate(functions.machine, PointTable(columns), names).values
    return np.stack([answers[name] for name in names], axis=1)


def sample_points(functions: MachineFunctions) -> dict[str, Array]:
    """The pose of the file and some near it, those at which the machine has an answer: values by leaf path."""
    known = values(functions.machine)
    drawn = np.random.default_rng(0).uniform(-AROUND, AROUND, (SAMPLES, len(functions.inputs)))
    drawn[0], drawn[:, functions.coordinates :] = 0.0, 0.0
    units = np.where(np.array(functions.kinds) == "length", functions.length, 1.0)
    rows = np.array([float(known[path]) for path in functions.inputs]) + drawn * units
    columns = dict(zip(functions.inputs, rows.T, strict=True))
    wanted = ["singularity_margin", *(name for name in functions.quantities if not QUANTITIES[name].loaded)]
    answered = evaluate(functions.machine, PointTable(columns), wanted).status == Status.OK
    return {path: column[answered] for path, column in columns.items()}

"""Programs of a machine that are printed in other languages: arguments, results, and points to compare them at.

A function takes the coordinates of the pose, and after them parameters that were chosen; all other numbers of the
machine are part of its code. The languages are in `c_source` and `page`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, where
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.engine.batch import evaluate
from kinetostat.engine.form import (
    Form,
    Specimen,
    TracedFormula,
    form_with_numbers,
    formula_of,
    result_of,
    traced_joints,
    traced_machine,
)
from kinetostat.engine.kernel import closes_inside
from kinetostat.engine.loaded import have_programs
from kinetostat.engine.points import PointTable
from kinetostat.engine.rest import step_of
from kinetostat.equilibrium.cut import cut_machine
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import within_reach
from kinetostat.kinematics.closure import CLOSED_FORMS
from kinetostat.kinematics.forward import leg_names
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.assembly import compliance_shares
from kinetostat.kinetostatics.quantities import QUANTITIES, MapQuantity, rest_numbers
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.actuators import Actuator, actuators_of, joint_actuators
from kinetostat.machine.leg import Leg
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Machine, springs
from kinetostat.machine.parameters import POSE, parameters, values
from kinetostat.machine.written.family import at_home
from kinetostat.spec.errors import InputError, choice
from kinetostat.vibration.springwise import ModeCounts, SpringSizes, mode_counts_of, sizes_over_springs

LOADS = frozenset(("force", "moment", "gravity", "preload", "temperature_rise"))
"""Words of leaf paths that load a machine."""
DISPLACEMENTS = [name for name in QUANTITIES if name.startswith("displacement_")]
"""Quantities that are the motion of the tool under the loads: rotation vector, then displacement."""
STEPS_FORWARD = 30
"""Most steps of forward kinematics: Newton's method takes some five, more where steps are shortened."""
SHORTEST_SHARE = 1e-4
"""Share of a step of forward kinematics below which no shorter one is tried."""
SAMPLES = 9
"""Points at which functions are compared: the pose of the file and others near it."""
SAMPLE_DISTANCE = 0.02
"""Greatest distance of these poses from that of the file, rad or in units of the machine's length."""


@dataclass(frozen=True)
class TracedPlacement:
    """Places of the actuators, the tool and the legs of a traced machine.

    Attributes:
        formula: its results are the coordinates of the actuators (m or rad), the tool point T (m), the columns of Q,
            and the `drawn_points` of the legs (m), in the base frame; its code is the `Status` by reach alone.
        actuators: the actuators, with traced coordinates.
    """

    formula: TracedFormula
    actuators: tuple[Actuator, ...]


def drawn_points(leg: Leg) -> list[Vector]:
    """Return the points of a leg that a drawing joins (base frame, m): joints, links, springs, then ends of bars."""
    path = [point for element in leg.chain for point in element.path]
    path += [spring.joint.point for spring in leg.springs if spring.joint.point is not None]
    pairs = [element.bars for element in leg.chain if isinstance(element, Parallelogram)]
    return path + [end for bars in pairs for bar in bars for end in bar]


def placement_of(kind: Specimen, form: Form, paths: Sequence[str], closed: bool) -> TracedPlacement:
    """Trace the places of actuators, tool and legs of a machine.

    Args:
        kind: kind of a machine whose joints have closed forms.
        form: how its parameters enter; numbers of joints in the drawing are constant.
        paths: leaf paths of the parameters to differentiate by.
        closed: whether joints are computed inside the program, as legs written leg by leg need it.
    """
    traced = traced_machine(kind, form)
    joints = CLOSED_FORMS.over_scalars(traced.machine.chains()) if closed else None
    configuration = traced.machine.configure(joints.coordinates if joints else ())
    status: Scalar = joints.status if joints else int(Status.OK)
    if joints:
        at_home = joint_actuators(kind.machine.chains(), leg_names(kind.machine))
        actuators = [actuator.at(joints.coordinates) for actuator in at_home]
    else:
        actuators = actuators_of(configuration)
        status = where(within_reach(configuration), status, int(Status.OUT_OF_REACH))
    platform = configuration.platform
    tool = platform.apply(Vector(*traced.machine.tables["tool"].offset))
    points = [point for leg in configuration.legs for point in drawn_points(leg)]
    vectors = [tool, platform.rotation.x, platform.rotation.y, platform.rotation.z, *points]
    wanted = [actuator.coordinate for actuator in actuators] + [c for vector in vectors for c in vector.components()]
    accepted = status < Status.OK + 0.5
    results = [result_of(where(accepted, value, math.nan)) for value in wanted]
    formula = formula_of(traced, (), results, result_of(status), paths)
    return TracedPlacement(formula, tuple(actuators))


@dataclass(frozen=True)
class TracedShares:
    """The compliance that parts of a machine contribute.

    Attributes:
        formula: its results are what each part contributes to each diagonal entry of C, [part x 6] row by row, SI;
            NaN where the status is not OK.
        parts: names of the parts, those of springs that are not rigid.
    """

    formula: TracedFormula
    parts: tuple[str, ...]


def shares_of(kind: Specimen, form: Form, closed: bool) -> TracedShares:
    """Trace what the parts of a machine contribute to its compliance.

    Args:
        kind: kind of the machine.
        form: how its parameters enter.
        closed: as in `TraceOptions`.
    """
    traced = traced_machine(kind, form)
    joints, columns = traced_joints(traced, closed)
    response = respond(traced.machine, joints)
    accepted = response.status < Status.OK + 0.5
    parts: dict[str, list[Scalar]] = {}
    for spring, share in zip(springs(response.configuration), compliance_shares(response.statics), strict=True):
        diagonal = [share.entry(i, i) for i in range(6)]
        if not all(is_zero(entry) for entry in diagonal):
            name = str(spring.part_name)
            before = parts.get(name)
            parts[name] = [a + b for a, b in zip(before, diagonal, strict=True)] if before else diagonal
    results = [result_of(where(accepted, value, math.nan)) for row in parts.values() for value in row]
    return TracedShares(formula_of(traced, columns, results, result_of(response.status), ()), tuple(parts))


@dataclass(frozen=True)
class MachineFunctions:
    """Arguments and results of the functions of a machine, whatever language they are written in.

    Attributes:
        machine: the machine at its pose; free, whatever its file says, where its states of rest have no programs.
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
        """Return whether the program of a quantity needs modes over springs."""
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

    def at_rest(self, name: str) -> bool:
        """Whether a quantity is found at rest: one of the loaded state, or what drives carry in a machine meant so."""
        return bool(rest_numbers(self.machine, [name], limited=False))

    @property
    def needs_state(self) -> bool:
        """Whether a quantity is found at rest."""
        return any(self.at_rest(name) for name in self.quantities)


def functions_of(machine: Machine, inputs: Sequence[str], outputs: Sequence[str]) -> MachineFunctions:
    """Choose what functions of a machine take and give.

    Args:
        machine: the machine at its pose.
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
    numbers = values(machine)
    pose = [name for name in numbers if name.startswith(POSE)]
    chosen = [choice(name, [leaf for leaf in numbers if leaf not in pose], "--inputs") for name in inputs]
    wanted = [choice(name, [q for q, row in QUANTITIES.items() if not row.cut], "--outputs") for name in outputs]
    paths = tuple(dict.fromkeys([*pose, *chosen]))
    is_loaded = any(value or path in paths for path, value in numbers.items() if LOADS.intersection(path.split(".")))
    rests = is_loaded and cut_machine(machine, paths) is not None
    lacking = [name for name in wanted if not _has_program(machine, paths, name, rests)]
    if lacking:
        raise InputError(
            f"{lacking[0]} has no program for {machine.name}: nothing loads it, or its equations cannot be reduced to "
            "few coordinates; leave it out of --outputs, or give the machine a load."
        )
    if machine.loaded and not rests:  # what no program brings to rest is the free machine in all of them
        machine = replace(machine, loaded=False)
    counts = mode_counts_of(machine, wanted, paths)
    form = form_with_numbers(machine, paths)
    placement = placement_of(Specimen(at_home(machine, paths)), form, paths, closed)
    return MachineFunctions(
        machine=machine,
        inputs=paths,
        coordinates=len(pose),
        quantities=tuple(dict.fromkeys(wanted)),
        form=form,
        closed=closed,
        placement=placement,
        rests=rests,
        mode_counts=counts,
    )


def _has_program(machine: Machine, paths: tuple[str, ...], name: str, rests: bool) -> bool:
    """Return whether a quantity has a program, alone or with modes over springs that a loop finds."""
    if QUANTITIES[name].loaded and not rests:
        return False
    return have_programs(machine, paths, [name]) or mode_counts_of(machine, [name], paths) is not None


def quantities_at(functions: MachineFunctions, columns: Mapping[str, Array], names: Sequence[str]) -> Array:
    """Compute quantities at points without the printed formulas [points x names]; columns are values by leaf path."""
    answers = evaluate(functions.machine, PointTable(columns), names).values
    return np.stack([answers[name] for name in names], axis=1)


def sample_points(functions: MachineFunctions) -> dict[str, Array]:
    """Return the pose of the file and some near it, those at which the machine has an answer: values by leaf path."""
    numbers = values(functions.machine)
    drawn = np.random.default_rng(0).uniform(-SAMPLE_DISTANCE, SAMPLE_DISTANCE, (SAMPLES, len(functions.inputs)))
    drawn[0], drawn[:, functions.coordinates :] = 0.0, 0.0
    units = np.where(np.array(functions.kinds) == "length", functions.length, 1.0)
    rows = np.array([float(numbers[path]) for path in functions.inputs]) + drawn * units
    columns = dict(zip(functions.inputs, rows.T, strict=True))
    wanted = ["singularity_margin", *(name for name in functions.quantities if not QUANTITIES[name].loaded)]
    answered = evaluate(functions.machine, PointTable(columns), wanted).status == Status.OK
    return {path: column[answered] for path, column in columns.items()}

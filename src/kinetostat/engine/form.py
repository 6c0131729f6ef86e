"""A machine as the body of a program: its parameters as constants, fixed inputs or columns, its results traced.

Nothing is compiled or evaluated here, and nothing depends on a machine's numbers beyond its form.
"""

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from kinetostat.algebra.scalar import Scalar, where
from kinetostat.arrays import Array
from kinetostat.engine.trace import ORDINARY_BOUNDS, Body, Graph, Operand, Traced
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints, closing_equations
from kinetostat.kinematics.closure import CLOSED_FORMS
from kinetostat.kinematics.status import PLACELESS, Status
from kinetostat.kinetostatics.quantities import QUANTITIES, needs_masses, needs_motion, rest_numbers
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.late import LateModule
from kinetostat.machine.common_tables import FRICTION_OF_JOINTS
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.motion.response import response_in_motion
from kinetostat.spec.errors import InputError

if TYPE_CHECKING:
    from kinetostat.equilibrium import reduced
    from kinetostat.equilibrium import state as machine_state
    from kinetostat.motion import rigid
    from kinetostat.vibration import scalar_frequencies, springwise
else:  # most programs are of machines that are free and stand still
    reduced, machine_state = LateModule("kinetostat.equilibrium.reduced"), LateModule("kinetostat.equilibrium.state")
    scalar_frequencies = LateModule("kinetostat.vibration.scalar_frequencies")
    rigid, springwise = LateModule("kinetostat.motion.rigid"), LateModule("kinetostat.vibration.springwise")


@dataclass(frozen=True)
class Form:
    """The way in which a program takes the parameters of a machine, by leaf path.

    Attributes:
        constant: values that are part of the code: exactly 0 or infinite, and 1 or -1 in directions.
        inputs: the numbers that are the same at all points, and whether each is ordinary: positive, far from 0 and from
            infinity.
        uses: which parameters take which of these numbers, and whether with the other sign.
        varying: the columns, in order.
        turning: those of them that are angles.
    """

    constant: tuple[tuple[str, float], ...]
    inputs: tuple[bool, ...]
    uses: tuple[tuple[str, int, bool], ...]
    varying: tuple[str, ...]
    turning: tuple[str, ...]


class _Inputs:
    """Numbers that a program is given and parameters share, as they are counted."""

    def __init__(self) -> None:
        self.numbers: list[float] = []
        self._places: dict[float, int] = {}

    def add(self, number: float) -> int:
        """Add a number that is not shared and return its place."""
        self.numbers.append(number)
        return len(self.numbers) - 1

    def share(self, number: float) -> int:
        """Return the place of a number that may be shared, and add it if it is not there."""
        if number not in self._places:
            self._places[number] = self.add(number)
        return self._places[number]


def form_of(machine: Machine, varying: Sequence[str], kept: Collection[str] = ()) -> tuple[Form, Array]:
    """Return the form of a machine's programs and the values of their fixed inputs, SI.

    Parameters of one size share an input: what cancels by form, like heights of joints in one plane, is then not
    computed at all.

    Args:
        machine: its family, and all parameters that do not vary.
        varying: leaf paths of the parameters that vary.
        kept: leaf paths of those that get an input each, even if they are 0.
    """
    angles, axes = _paths_of(machine, "angle"), _paths_of(machine, "direction")
    constant, uses, inputs = [], [], _Inputs()
    for path, number in values(machine).items():
        if path in varying:
            continue
        value = float(number)
        if path in angles and math.isfinite(value):
            value = float(reduced_angles(np.array(value)))
        is_exact = value == 0.0 or (path in axes and abs(value) == 1.0)
        if math.isinf(value) or (is_exact and path not in kept):
            constant.append((path, value))
        elif path in kept:
            uses.append((path, inputs.add(value), False))
        else:
            uses.append((path, inputs.share(abs(value)), value < 0.0))
    numbers = np.array(inputs.numbers)
    form = Form(
        constant=tuple(constant),
        inputs=tuple(ORDINARY_BOUNDS[0] < number < ORDINARY_BOUNDS[1] for number in inputs.numbers),
        uses=tuple(uses),
        varying=tuple(varying),
        turning=tuple(path for path in varying if path in angles),
    )
    return form, numbers


def form_with_numbers(machine: Machine, varying: Sequence[str]) -> Form:
    """Return the form of programs that hold all numbers of a machine but those that vary, by leaf path."""
    constant = tuple((path, float(value)) for path, value in values(machine).items() if path not in varying)
    turning = tuple(path for path in varying if path in _paths_of(machine, "angle"))
    return Form(constant=constant, inputs=(), uses=(), varying=tuple(varying), turning=turning)


def _paths_of(machine: Machine, kind: str) -> frozenset[str]:
    """The leaf paths of all numbers of a kind of quantity, such as the components of axes."""
    return frozenset(leaf for p in parameters(machine.family) if p.quantity.kind == kind for leaf in p.leaves)


def reduced_angles(angle: Array) -> Array:
    """Turn angles (rad) back to between -pi and pi if any is beyond what traced cosines take."""
    if angle.size == 0 or max(angle.max(), -angle.min()) <= LARGEST_ANGLE:
        return angle
    with np.errstate(invalid="ignore"):
        return np.arctan2(np.sin(angle), np.cos(angle))


@dataclass(frozen=True, eq=False)
class Specimen:
    """A machine as a specimen of its family: equal to every other one of it that is meant in the same state."""

    machine: Machine

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Specimen):
            return False
        return (self.machine.family, self.machine.loaded) == (other.machine.family, other.machine.loaded)

    def __hash__(self) -> int:
        return hash((self.machine.family, self.machine.loaded))


@dataclass(frozen=True)
class TracedMachine:
    """A machine whose parameters are traced.

    Attributes:
        graph: the graph in which they are.
        fixed: inputs that are the same at all points.
        columns: inputs that vary, by leaf path.
        parameters: all that are not constant, by leaf path: inputs, some with the other sign.
        machine: the machine with these parameters.
    """

    graph: Graph
    fixed: tuple[Traced, ...]
    columns: dict[str, Traced]
    parameters: dict[str, Traced]
    machine: Machine


def traced_machine(kind: Specimen, form: Form) -> TracedMachine:
    """Make a machine of this kind with the inputs of a form, in a new graph."""
    graph = Graph()
    fixed = tuple(graph.input(True, ORDINARY_BOUNDS if ordinary else None) for ordinary in form.inputs)
    columns = {path: graph.input() for path in form.varying}
    used = {path: -fixed[place] if negative else fixed[place] for path, place, negative in form.uses}
    machine = with_values(kind.machine, {**dict(form.constant), **used, **columns})
    return TracedMachine(graph, fixed, columns, {**used, **columns}, machine)


Weights: TypeAlias = tuple[tuple[str, float], ...]
"""A weighted sum of quantities: their names and weights."""


def each_alone(names: Iterable[str]) -> list[Weights]:
    """Return quantities as objectives, each by itself with the weight 1."""
    return [((name, 1.0),) for name in names]


@dataclass(frozen=True)
class TracedFormula:
    """A body, and the inputs that its results are differentiated by: parameters by path, then joint coordinates."""

    body: Body
    inputs: tuple[Traced, ...]


@dataclass(frozen=True)
class TraceOptions:
    """Choices by which quantities are traced.

    Attributes:
        closed: whether joints are computed inside the program, in closed form. Otherwise their coordinates and a
            status are further columns, unless the family places the joints itself.
        judged: whether the code is the status of the pose. Otherwise it says whether joints are known, and reach,
            margin and limits are computed only as far as quantities need them.
        limited: whether limits of the loads of actuators are compared at rest, for a machine that is meant loaded.
        stepping: whether to give, after the objectives, the coordinates of the state of rest after another step and
            the square of its size, so that the program can be repeated until this is small.
        plan: the motions that there are, where quantities need them, see `plan_for`.
        modes: number of modes that are known, as further columns (`scalar_frequencies.mode_columns`); 0 to solve for
            frequencies inside.
        mode_counts: numbers of modes over springs that are known, as further columns, where legs that have masses
            close loops.
    """

    closed: bool = False
    judged: bool = True
    limited: bool = True
    stepping: bool = False
    plan: "rigid.MotionPlan | None" = None
    modes: int = 0
    mode_counts: "springwise.ModeCounts | None" = None


DEFAULT_OPTIONS = TraceOptions()


def objectives_of(
    kind: Specimen,
    form: Form,
    objectives: Sequence[Weights],
    options: TraceOptions = DEFAULT_OPTIONS,
    paths: Sequence[str] | None = None,
) -> TracedFormula:
    """Trace weighted sums of quantities as functions of the parameters; NaN where the status is not OK.

    If quantities are about the machine under load, coordinates of its state are further columns, see `rest.step_of`.

    Args:
        kind: kind of the machine.
        form: how its parameters enter.
        objectives: weighted sums of quantities.
        options: how they are traced.
        paths: leaf paths of the parameters to differentiate by, beside the joint coordinates; None for no derivatives.
    """
    traced = traced_machine(kind, form)
    joints, columns = traced_joints(traced, options.closed)
    names = [name for weights in objectives for name, _ in weights]
    free = respond(traced.machine, joints)
    response, coordinates = _response_at_rest(traced, free, joints, names, options, bool(paths))
    response, modes = _response_vibrating(traced, response, joints, names, options, bool(paths))
    response = response_in_motion(traced.machine, response, joints, options.plan, names)
    status = response.status if options.judged else response.joint_status
    accepted = status < Status.OK + 0.5
    results = [result_of(where(accepted, _weighted_sum(response, weights), math.nan)) for weights in objectives]
    if options.stepping and response.loaded is not None:
        results += [result_of(value) for value in response.loaded["after"]]
    return formula_of(traced, columns, results, result_of(status), paths, (*coordinates, *modes))


def _response_at_rest(
    traced: TracedMachine,
    response: Response,
    joints: Joints | None,
    names: Sequence[str],
    options: TraceOptions,
    differentiated: bool,
) -> tuple[Response, tuple[Traced, ...]]:
    """Trace what quantities under load need; return the response with it, and the columns of the state and its modes.

    Args:
        traced: the traced machine.
        response: its response in the free state.
        joints: its joints, where its family does not place them.
        names: names of all quantities; where none is about the machine under load, there are no columns.
        options: how they are traced.
        differentiated: whether results are differentiated.
    """
    wanted, counts = rest_numbers(traced.machine, names, options.limited), options.mode_counts
    if not wanted:
        return response, ()
    equations = reduced.reduced_machine(traced.machine, response, joints)
    state = new_inputs(traced.graph, equations.size)
    # At a state of rest a step has no size, but it has derivatives: those of the state by the parameters.
    coordinates = equations.step([*state])[0] if differentiated else [*state]
    loaded, status = equations.numbers(coordinates, wanted, response, names)
    modes: list[tuple[Traced, ...]] = []
    if counts is not None and counts.at_rest:
        motions = springwise.SpringMotions(equations.cut, coordinates)
        modes = [new_inputs(traced.graph, motions.size) for _ in range(counts.loaded + counts.factor)]
        status = where(motions.sure, status, int(Status.NOT_CONVERGED))
        if counts.loaded:
            squares = [motions.square(mode) for mode in modes[: counts.loaded]]
            loaded["frequency"] = scalar_frequencies.sorted_frequencies(squares)
        if counts.factor:
            loaded["factor"] = motions.factor(modes[-1])
    if "frequency" in wanted and "frequency" not in loaded:
        loaded["frequency"] = scalar_frequencies.frequencies_of_cut(equations.cut, coordinates, differentiated)
    columns = (*state, *(column for mode in modes for column in mode))
    return replace(response, loaded=loaded, status=status), columns


def _response_vibrating(
    traced: TracedMachine,
    response: Response,
    joints: Joints | None,
    names: Sequence[str],
    options: TraceOptions,
    differentiated: bool,
) -> tuple[Response, tuple[Traced, ...]]:
    """Trace the frequencies about the free state that quantities need; return also the columns of modes that are known.

    Modes over springs are known where legs with masses close loops; others where derivatives are wanted; else the
    program solves for frequencies itself. Arguments are those of `_response_at_rest`.
    """
    counts = options.mode_counts
    if counts is not None and counts.free:
        motions = springwise.motions_without_loads(traced.machine, response, joints)
        modes = [new_inputs(traced.graph, motions.size) for _ in range(counts.free)]
        frequencies = scalar_frequencies.sorted_frequencies([motions.square(mode) for mode in modes])
        status = where(motions.sure, response.status, int(Status.SINGULAR))
        columns = tuple(column for mode in modes for column in mode)
        return replace(response, frequencies=frequencies, status=status), columns
    if options.modes:
        vibration = scalar_frequencies.machine_of_known_modes(traced.machine, response, joints, options.modes)
        columns = new_inputs(traced.graph, vibration.columns)
        frequencies = scalar_frequencies.sorted_frequencies(vibration.inverse_squares(columns))
        return replace(response, frequencies=frequencies), columns
    if any(QUANTITIES[name].modal and not QUANTITIES[name].loaded for name in names):
        frequencies = scalar_frequencies.frequencies_over_scalars(traced.machine, response, joints, differentiated)
        return replace(response, frequencies=frequencies), ()
    return response, ()


def plan_for(machine: Machine, names: Iterable[str], varying: Iterable[str] = ()) -> "rigid.MotionPlan | None":
    """Decide at the pose of a machine which motions its programs count with; None where quantities need none.

    Args:
        machine: the machine with its numbers.
        names: names of quantities.
        varying: leaf paths of the parameters that vary. A spring whose stiffness does counts as a spring by form,
            even if the file says 0.

    Raises:
        InputError: quantities need them, and the machine has no place at the pose of its file.
    """
    damping, varying, names = machine.tables["damping"], {*varying}, [*names]
    has_friction = any(path in varying or getattr(damping, path.partition(".")[2]) for path in FRICTION_OF_JOINTS)
    if not needs_motion(names) or not (needs_masses(names) or has_friction):
        return None
    stiff = {leaf for parameter in parameters(machine.family) if parameter.quantity.stiff for leaf in parameter.leaves}
    free = [path for path in varying if path in stiff and values(machine)[path] == 0.0]
    state = machine_state.MachineState(with_values(machine, dict.fromkeys(free, 1.0)) if free else machine)
    if int(state.free.status) in PLACELESS:
        raise InputError(
            f"{machine.name} has no place at the pose of its file, which needs one for accelerations and friction of "
            f"joints; change [pose]. {state.refusal}"
        )
    return rigid.plan_of(state.machine, state.configuration, state.joints)


def new_inputs(graph: Graph, count: int) -> tuple[Traced, ...]:
    """Make further columns of the program."""
    return tuple(graph.input() for _ in range(count))


def equations_of(kind: Specimen, form: Form, paths: Sequence[str]) -> TracedFormula:
    """Trace the closing equations of a machine written leg by leg, and its length, m, after them.

    Columns are those of objectives that are not closed.

    Args:
        kind: kind of the machine.
        form: how its parameters enter.
        paths: leaf paths of the parameters to differentiate by.
    """
    traced = traced_machine(kind, form)
    _, columns = traced_joints(traced, closed=False)
    chains = traced.machine.chains()
    results = [result_of(result) for result in (*closing_equations(chains, columns[:-1]), chains.length)]
    return formula_of(traced, columns, results, 0.0, paths)


def formula_of(
    traced: TracedMachine,
    joints: Sequence[Traced],
    results: Sequence[Operand],
    code: Operand,
    paths: Sequence[str] | None = None,
    coordinates: Sequence[Traced] = (),
) -> TracedFormula:
    """Join results and a code into a formula; its columns are those that vary, of joints, and further coordinates."""
    body = Body(traced.fixed, [*traced.columns.values(), *joints, *coordinates], results, code)
    inputs = () if paths is None else (*(traced.parameters[path] for path in paths), *joints[:-1])
    return TracedFormula(body, inputs)


def traced_joints(traced: TracedMachine, closed: bool) -> tuple[Joints | None, tuple[Traced, ...]]:
    """Return the joints of a traced machine, and the columns that bring them: coordinates and a status."""
    if traced.machine.family.chains is None:
        return None, ()
    if closed:
        return CLOSED_FORMS.over_scalars(traced.machine.chains()), ()
    columns = new_inputs(traced.graph, traced.machine.chains().size + 1)
    return Joints(columns[:-1], columns[-1]), columns


def _weighted_sum(response: Response, weights: Weights) -> Scalar:
    """Return a weighted sum of quantities of a response."""
    value: Scalar = 0.0
    for name, weight in weights:
        value = value + float(weight) * QUANTITIES[name].value(response)
    return value


def result_of(value: Scalar) -> Operand:
    """Return a result as a program takes it: a node, or a float where it depends on nothing."""
    return float(value) if isinstance(value, int | float) else value

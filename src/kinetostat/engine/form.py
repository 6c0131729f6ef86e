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


def form_of(machine: Machine, varying: Sequence[str], kept: Collection[str] = ()) -> tuple[Form, Array]:
    """Return the form of a machine's programs and the values of their fixed inputs, SI.

    Parameters of one size share an input: what cancels by form, like heights of joints in one plane, is then not
    computed at all.

    Args:
        machine: its family, and all parameters that do not vary.
        varying: leaf paths of the parameters that vary.
        kept: leaf paths of those that get an input each, even if they are 0.
    """
    fixed = {path: float(value) for path, value in values(machine).items() if path not in varying}
    angles = frozenset(p.path for p in parameters(machine.family) if p.quantity.kind == "angle")
    turns = [path for path in angles & fixed.keys() if math.isfinite(fixed[path])]
    fixed |= {path: float(reduced_angles(np.array(fixed[path]))) for path in turns}
    axes = directions(machine)
    simple = {path: (0.0, 1.0) if path in axes else (0.0,) for path in fixed if path not in kept}
    constant = {path: v for path, v in fixed.items() if math.isinf(v) or abs(v) in simple.get(path, ())}
    numbers: list[float] = []
    places: dict[float, int] = {}  # of numbers that parameters share, by their size
    uses = []
    for path, value in fixed.items():
        if path in constant:
            continue
        alone = path in kept
        place = len(numbers) if alone else places.setdefault(abs(value), len(numbers))
        if place == len(numbers):
            numbers.append(value if alone else abs(value))
        uses.append((path, place, value < 0.0 and not alone))
    ordinary = tuple(ORDINARY_BOUNDS[0] < number < ORDINARY_BOUNDS[1] for number in numbers)
    turning = tuple(path for path in varying if path in angles)
    return Form(tuple(constant.items()), ordinary, tuple(uses), tuple(varying), turning), np.array(numbers)


def form_with_numbers(machine: Machine, varying: Sequence[str]) -> Form:
    """Return the form of programs that hold all numbers of a machine but those that vary, by leaf path."""
    constant = [(path, float(value)) for path, value in values(machine).items() if path not in varying]
    angles = frozenset(p.path for p in parameters(machine.family) if p.quantity.kind == "angle")
    return Form(tuple(constant), (), (), tuple(varying), tuple(path for path in varying if path in angles))


def directions(machine: Machine) -> frozenset[str]:
    """Return the leaf paths of all components of axes."""
    return frozenset(leaf for p in parameters(machine.family) if p.quantity.kind == "direction" for leaf in p.leaves)


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
        graph: in which they are.
        fixed: inputs that are the same at all points.
        columns: those that vary, by leaf path.
        parameters: all that are not constant, by leaf path: inputs, some with the other sign.
        machine: with them.
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


def objectives_of(
    kind: Specimen,
    form: Form,
    objectives: Sequence[Weights],
    paths: Sequence[str] | None = None,
    closed: bool = False,
    modes: int = 0,
    limited: bool = True,
    plan: "rigid.MotionPlan | None" = None,
    stepping: bool = False,
    judged: bool = True,
    mode_counts: "springwise.ModeCounts | None" = None,
) -> TracedFormula:
    """Trace weighted sums of quantities as functions of the parameters; NaN where the code is not OK.

    Args:
        kind: of the machine.
        form: how its parameters enter.
        objectives: weighted sums of quantities.
        paths: leaf paths of the parameters to differentiate by, beside the joint coordinates; None for no derivatives.
        closed: whether joints are computed inside the program, in closed form. Otherwise their coordinates and a
            status are further columns, unless the family places the joints itself. If quantities are about the machine
            under load, coordinates of its state follow, see `step_of`.
        limited: whether the limits of a machine meant under its loads judge its points at rest.
        plan: which motions there are, where quantities need them, see `plan_for`.
        modes: how many modes are known, as further columns (`scalar_frequencies.vibrating`); 0 to solve for frequencies
            inside.
        mode_counts: how many modes over springs are known, as further columns, where legs that have masses close loops.
        stepping: whether to give, after the objectives, the coordinates of the state after another step and the square
            of its size, so that the program can be repeated until this is small.
        judged: whether the code is the status of the pose. Otherwise it says whether joints are known, and reach,
            margin and limits are computed only as far as quantities need them.
    """
    given = traced_machine(kind, form)
    joints, columns = traced_joints(given, closed)
    response = respond(given.machine, joints)
    names = [name for weights in objectives for name, _ in weights]
    response, coordinates = _response_at_rest(given, response, joints, names, limited, mode_counts, bool(paths))
    response, unknowns = _response_vibrating(given, response, joints, names, modes, mode_counts, bool(paths))
    response = response_in_motion(given.machine, response, joints, plan, names)
    code = response.status if judged else response.joint_status
    accepted = code < Status.OK + 0.5
    results = [result_of(where(accepted, _weighted_sum(response, weights), math.nan)) for weights in objectives]
    if stepping and response.loaded is not None:
        results += [result_of(value) for value in response.loaded["after"]]
    return formula_of(given, columns, results, result_of(code), paths, (*coordinates, *unknowns))


def _response_at_rest(
    given: TracedMachine,
    response: Response,
    joints: Joints | None,
    names: Sequence[str],
    limited: bool,
    mode_counts: "springwise.ModeCounts | None",
    differentiated: bool,
) -> tuple[Response, tuple[Traced, ...]]:
    """Trace what quantities under load need; return the response with it, and the columns of the state and its modes.

    Args:
        given: the traced machine.
        response: of the machine in its free state.
        joints: of the machine, where its family does not place them.
        names: of all quantities; where none is about the machine under load, there are no columns.
        limited: as for `objectives_of`.
        mode_counts: how many modes over springs are known, as further columns.
        differentiated: whether results are differentiated.
    """
    wanted = rest_numbers(given.machine, names, limited)
    if not wanted:
        return response, ()
    equations = reduced.reduced_machine(given.machine, response, joints)
    state = new_inputs(given.graph, equations.size)
    # At a state of rest a step has no size, but the derivatives of the state: it follows the parameters.
    there = equations.step([*state])[0] if differentiated else [*state]
    loaded, status = equations.numbers(there, wanted, response, names)
    modes: list[tuple[Traced, ...]] = []
    if mode_counts is not None and mode_counts.at_rest:
        motions = springwise.SpringMotions(equations.cut, there)
        modes = [new_inputs(given.graph, motions.size) for _ in range(mode_counts.loaded + mode_counts.factor)]
        status = where(motions.sure, status, int(Status.NOT_CONVERGED))
        if mode_counts.loaded:
            squares = [motions.square(mode) for mode in modes[: mode_counts.loaded]]
            loaded["frequency"] = scalar_frequencies.lowest_frequencies(squares)
        if mode_counts.factor:
            loaded["factor"] = motions.factor(modes[-1])
    if "frequency" in wanted and "frequency" not in loaded:
        loaded["frequency"] = scalar_frequencies.frequencies_at(equations.cut, there, differentiated)
    columns = (*state, *(column for mode in modes for column in mode))
    return replace(response, loaded=loaded, status=status), columns


def _response_vibrating(
    given: TracedMachine,
    response: Response,
    joints: Joints | None,
    names: Sequence[str],
    modes: int,
    mode_counts: "springwise.ModeCounts | None",
    differentiated: bool,
) -> tuple[Response, tuple[Traced, ...]]:
    """Trace the frequencies about the free state that quantities need; return also the columns of modes that are known.

    Modes over springs are known where legs with masses close loops; others where derivatives are wanted; else the
    program solves for frequencies itself.
    """
    if mode_counts is not None and mode_counts.free:
        motions = springwise.motions_without_loads(given.machine, response, joints)
        shapes = [new_inputs(given.graph, motions.size) for _ in range(mode_counts.free)]
        squares = scalar_frequencies.lowest_frequencies([motions.square(shape) for shape in shapes])
        status = where(motions.sure, response.status, int(Status.SINGULAR))
        columns = tuple(column for shape in shapes for column in shape)
        return replace(response, frequencies=squares, status=status), columns
    if modes:
        vibration = scalar_frequencies.vibrating(given.machine, response, joints, modes)
        unknowns = new_inputs(given.graph, vibration.columns)
        squares = scalar_frequencies.lowest_frequencies(vibration.squares(unknowns))
        return replace(response, frequencies=squares), unknowns
    if any(QUANTITIES[name].modal and not QUANTITIES[name].loaded for name in names):
        squares = scalar_frequencies.free_frequencies(given.machine, response, joints, differentiated)
        return replace(response, frequencies=squares), ()
    return response, ()


def plan_for(machine: Machine, names: Iterable[str], varying: Iterable[str] = ()) -> "rigid.MotionPlan | None":
    """Decide at the pose of a machine which motions its programs count with; None where quantities need none.

    Args:
        machine: with numbers.
        names: of quantities.
        varying: leaf paths of the parameters that vary. A spring whose stiffness does counts as a spring by form,
            even if the file says 0.

    Raises:
        InputError: quantities need them, and the machine has no place at the pose of its file.
    """
    damping, changing, names = machine.tables["damping"], {*varying}, [*names]
    rubs = any(path in changing or getattr(damping, path.partition(".")[2]) for path in FRICTION_OF_JOINTS)
    if not needs_motion(names) or not (needs_masses(names) or rubs):
        return None
    stiff = {leaf for parameter in parameters(machine.family) if parameter.quantity.stiff for leaf in parameter.leaves}
    free = [path for path in changing if path in stiff and values(machine)[path] == 0.0]
    state = machine_state.MachineState(with_values(machine, dict.fromkeys(free, 1.0)) if free else machine)
    if int(state.free.status) in PLACELESS:
        raise InputError(
            f"{machine.name} has no place at the pose of its file, which needs one for accelerations and friction of "
            f"joints; change [pose]. {state.refusal}"
        )
    return rigid.plan_of(state.machine, state.configuration, state.joints)


def step_of(kind: Specimen, form: Form, closed: bool, first: bool = False, chord: bool = False) -> TracedFormula:
    """Trace a step of Newton's method towards rest: from coordinates of the state, which are the last columns, to them.

    The last result is the square of the step's size.

    Args:
        kind: of a machine whose equations can be reduced.
        form: how its parameters enter.
        closed: as for `objectives_of`.
        first: whether to begin at the free state, without columns of coordinates.
        chord: whether the step is one of the chord method, see `Reduced.chord_step`.
    """
    given = traced_machine(kind, form)
    joints, columns = traced_joints(given, closed)
    equations = reduced.reduced_machine(given.machine, respond(given.machine, joints), joints)
    coordinates = () if first else new_inputs(given.graph, equations.size)
    step = equations.chord_step if chord else equations.step
    stepped, square = equations.start() if first else step([*coordinates])
    results = [result_of(value) for value in (*stepped, square)]
    return formula_of(given, columns, results, 0.0, coordinates=coordinates)


def new_inputs(graph: Graph, count: int) -> tuple[Traced, ...]:
    """Make further columns of the program."""
    return tuple(graph.input() for _ in range(count))


def equations_of(kind: Specimen, form: Form, paths: Sequence[str]) -> TracedFormula:
    """Trace the closing equations of a machine written leg by leg, and its length, m, after them.

    Columns are those of objectives that are not closed.

    Args:
        kind: of the machine.
        form: how its parameters enter.
        paths: leaf paths of the parameters to differentiate by.
    """
    given = traced_machine(kind, form)
    _, columns = traced_joints(given, closed=False)
    chains = given.machine.chains()
    results = [result_of(result) for result in (*closing_equations(chains, columns[:-1]), chains.length)]
    return formula_of(given, columns, results, 0.0, paths)


def formula_of(
    given: TracedMachine,
    joints: Sequence[Traced],
    results: Sequence[Operand],
    code: Operand,
    paths: Sequence[str] | None = None,
    coordinates: Sequence[Traced] = (),
) -> TracedFormula:
    """Join results and a code into a formula; its columns are those that vary, of joints, and further coordinates."""
    body = Body(given.fixed, [*given.columns.values(), *joints, *coordinates], results, code)
    inputs = () if paths is None else (*(given.parameters[path] for path in paths), *joints[:-1])
    return TracedFormula(body, inputs)


def traced_joints(given: TracedMachine, closed: bool) -> tuple[Joints | None, tuple[Traced, ...]]:
    """Return the joints of a traced machine, and the columns that bring them: coordinates and a status."""
    if given.machine.family.chains is None:
        return None, ()
    if closed:
        return CLOSED_FORMS.over_scalars(given.machine.chains()), ()
    columns = new_inputs(given.graph, given.machine.chains().size + 1)
    return Joints(columns[:-1], columns[-1]), columns


def _weighted_sum(response: Response, weights: Weights) -> Scalar:
    value: Scalar = 0.0
    for name, weight in weights:
        value = value + float(weight) * QUANTITIES[name].value(response)
    return value


def result_of(value: Scalar) -> Operand:
    """Return a result as a program takes it: a node, or a float where it depends on nothing."""
    return float(value) if isinstance(value, int | float) else value

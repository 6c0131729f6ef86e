"""Vibrations of a machine for control: its tool with servo loops closed, and the machine as a state space.

The stiffness of an actuator is here that of its transmission between motor and joint, and the table [servo] gives the
loop that holds the motor. A state space has forces and motions that are chosen by name. Formulas are in
`vibration.servo` and `vibration.receptance`; `exchange.results` writes files of the matrices.

Source: theory (101)-(104). At the tool point, base axes.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Complex
from kinetostat.equilibrium.state import AnswerInState, MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.directions import unit_direction
from kinetostat.studies.vibration import HIGHEST_FREQUENCY, Vibration, modes
from kinetostat.tolerances import UNFELT
from kinetostat.vibration.modes import Modes
from kinetostat.vibration.receptance import StateSpaceMatrices
from kinetostat.vibration.receptance import state_space as equations_of
from kinetostat.vibration.servo import ClosedLoops, least_damped_pole

CURVE_RANGE = (0.001, 5.0)
"""Range of the curves in units of the lowest and of the sixth natural frequency with motors that stand still: from
where the slowest integral gain still acts to where masses alone answer."""
LAST_MODE_OF_CURVES = 6
"""Number of the mode up to which curves reach, of a machine that has so many: a rigid platform has six."""
CURVE_POINTS = 1200
"""Points of each curve: some 300 in a decade, so that five lie within the width of a peak of 2 % damping."""
WRENCH = dict(zip(("mx", "my", "mz", "fx", "fy", "fz"), COMPONENTS, strict=True))
"""Names of moments and forces at the tool point, and the components along which they act."""


@former_names(standing="motors_still", slowest="least_damped")
@dataclass(frozen=True, eq=False)
class Servo(AnswerInState):
    """The tool of a machine with its servo loops closed.

    Attributes:
        state: the state of the machine.
        status: the status of the pose.
        message: the answer in a sentence or two.
        loops: the machine with its servo loops; None without an answer.
        motors_still: free stiffness with motors that stand still, by component, N/m or N·m/rad.
        static: free stiffness at 0 Hz with the loops closed, by component, N/m or N·m/rad.
        least: for each component, the least free stiffness over the frequencies of the response, and its frequency,
            Hz [n x 2].
        poles: poles of the closed loops, rad/s.
        stable: whether all poles decay.
        least_damped: frequency (Hz) and damping ratio of the least damped pole; None if none oscillates.
        assumed: whether the file says nothing of the machine's own damping, so that a usual one is assumed.
        direction: direction in which the tool is pushed for the response; empty for x, y and z.
    """

    state: MachineState
    status: Status
    message: str
    loops: ClosedLoops | None = None
    motors_still: Array = field(default_factory=lambda: np.zeros(0))
    static: Array = field(default_factory=lambda: np.zeros(0))
    least: Array = field(default_factory=lambda: np.zeros(0))
    poles: Complex = field(default_factory=lambda: np.zeros(0, dtype=complex))
    stable: bool = True
    least_damped: tuple[float, float] | None = None
    assumed: bool = False
    direction: tuple[float, ...] = ()

    def __repr__(self) -> str:
        return f"<Servo loops of {self.machine.name!r}: {self.message}>"

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components that the machine has."""
        return self.machine.family.component_names

    @property
    def frequencies(self) -> Array:
        """Frequencies for curves, Hz."""
        if self.loops is None:
            return np.zeros(0)
        natural = self.loops.modes.frequencies[:LAST_MODE_OF_CURVES]
        return np.geomspace(CURVE_RANGE[0] * natural[0], CURVE_RANGE[1] * natural[-1], CURVE_POINTS)

    @checked
    def receptance(self, frequencies: Sequence[float]) -> Complex:
        """Motion of the tool per unit of a varying wrench on it [frequencies x 6 x 6], rad and m per N·m and N.

        Args:
            frequencies: Hz.

        Raises:
            InputError: there is no answer, or a frequency is not a number up to 1e20.
        """
        if self.loops is None:
            raise InputError(f"{self.machine.name} has no servo response at this pose: {self.message}")
        row = np.asarray(frequencies, dtype=float).reshape(-1)
        if not (np.abs(row) <= HIGHEST_FREQUENCY).all():
            raise InputError(f"frequencies must be numbers in Hz, up to {HIGHEST_FREQUENCY:g}.")
        return self.loops.receptance(row)


@checked
def servo(machine: Machine | MachineState, along: Sequence[float] = ()) -> Servo:
    """Find the stiffness and the damping of a machine's tool with its servo loops closed.

    Args:
        machine: the machine with pose, masses and [servo], or its state; under load where `machine.loaded` is set.
        along: direction in which the tool is pushed for the response, base axes; x, y and z if empty.

    Raises:
        InputError: a gain is zero, rotors have no inertia, a transmission is rigid, no mass is given, or the direction
            is zero.
    """
    state = state_of(machine)
    direction = tuple(unit_direction(along, "along")) if along else ()
    vibration = modes(state, closed_loops=True)
    if vibration.loops is None:
        return Servo(state, vibration.status, vibration.message)
    return replace(_with_loops(vibration, vibration.loops), direction=direction)


def _with_loops(vibration: Vibration, closed: ClosedLoops) -> Servo:
    """The answer for a machine whose modes with motors that stand still are known."""
    components = list(vibration.machine.family.components)
    with_motors_still = np.diag(closed.modes.tool @ closed.modes.tool.T)[components]
    at_0_hz = np.diag(closed.receptance(np.zeros(1))[0].real)[components]
    answer = Servo(
        state=vibration.state,
        status=Status.OK,
        message="",
        loops=closed,
        motors_still=_free_stiffness(with_motors_still, with_motors_still),
        static=_free_stiffness(at_0_hz, with_motors_still),
        poles=closed.poles(),
        stable=closed.stable,
        assumed=vibration.assumed,
    )
    frequencies = answer.frequencies
    receptance = np.abs(closed.receptance(frequencies))[:, components, components]
    least_stiffness = _free_stiffness(receptance.max(axis=0), with_motors_still)
    answer = replace(
        answer,
        least=np.stack([least_stiffness, frequencies[receptance.argmax(axis=0)]], axis=1),
        least_damped=least_damped_pole(answer.poles, (0.0, float(frequencies[-1]))),
    )
    return replace(answer, message=_message(answer))


def _free_stiffness(compliance: Array, with_motors_still: Array) -> Array:
    """Reciprocals of compliances [n]; infinite for one that is round-off beside that with motors that stand still."""
    pairs = zip(compliance.tolist(), with_motors_still.tolist(), strict=True)
    return np.array([math.inf if abs(entry) <= UNFELT * still else 1.0 / entry for entry, still in pairs])


def _message(answer: Servo) -> str:
    show = answer.machine.display.show
    if not answer.stable:
        growing = max(answer.poles.tolist(), key=lambda pole: float(pole.real))
        return (
            f"The loops are unstable: a motion of {show(abs(growing) / (2.0 * math.pi), 'Hz')} grows; lower "
            "servo.velocity_gain or servo.position_gain, or measure more of the position at the motor."
        )
    if answer.least_damped is None:
        return "The loops are stable, and nothing swings."
    frequency, ratio = answer.least_damped
    damping = f"{100.0 * ratio:.3g} % of critical damping"
    return f"The loops are stable; the least damped motion has {show(frequency, 'Hz')} and {damping}."


@dataclass(frozen=True)
class Port:
    """An input or an output.

    Attributes:
        name: "fx" for instance, or the name of an actuator.
        unit: its SI unit.
    """

    name: str
    unit: str


@dataclass(frozen=True, eq=False)
class StateSpace(ImmutableAnswer):
    """A machine at its pose as x' = A x + B u, y = C x + D u; forces and motions from the state of rest.

    Attributes:
        machine: the machine with its masses and its damping.
        equations: A, B, C, D, and what the states are.
        inputs: forces and moments at the tool point, base axes, and forces of actuators on their springs.
        outputs: turns and motions of the tool point, base axes, and deflections of the actuators' springs.
        frequencies: frequencies of the modes that are states, Hz.
        ratios: their damping ratios.
        assumed: whether the file says nothing about damping; then the ratios are the default.
    """

    machine: Machine
    equations: StateSpaceMatrices
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    frequencies: tuple[float, ...]
    ratios: tuple[float, ...]
    assumed: bool

    def __repr__(self) -> str:
        rows, columns = len(self.outputs), len(self.inputs)
        states = len(self.equations.states)
        return f"<State space of {self.machine.name!r}: {columns} inputs, {rows} outputs, {states} states>"


@checked
def state_space(
    machine: Machine,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    count: int | None = None,
) -> StateSpace:
    """Write the vibrations of a machine as a state space, about its state under load where `machine.loaded` is set.

    Args:
        machine: the machine with its pose and masses.
        inputs: names of forces: fx fy fz mx my mz at the tool point, or those of actuators; forces and moments at the
            tool point if None.
        outputs: names of motions: x y z rx ry rz of the tool point, or those of actuators; the tool point's if None.
        count: number of the lowest modes that are states; all if None. Higher modes act as springs without mass.

    Raises:
        InputError: a name is unknown, nothing has a mass, or the pose has no vibrations.
    """
    vibration = modes(machine)
    if vibration.solution is None or vibration.damping is None:
        raise InputError(f"{machine.name} has no vibrations at this pose: {vibration.message}")
    solution, damping = vibration.solution, vibration.damping
    if count is not None and count < 1:
        raise InputError(f"count is {count}; a state space has one mode or more: give a positive number.")
    forces = {name: component for name, component in WRENCH.items() if component in vibration.components}
    input_ports, input_modes = _ports(solution, forces, ("N·m", "N"), "input", inputs)
    motions = {component: component for component in vibration.components}
    output_ports, output_modes = _ports(solution, motions, ("rad", "m"), "output", outputs)
    kept = solution.mode_count if count is None else min(count, solution.mode_count)
    return StateSpace(
        machine=machine,
        equations=equations_of(solution, damping, input_modes, output_modes, kept),
        inputs=input_ports,
        outputs=output_ports,
        frequencies=tuple(solution.frequencies[:kept].tolist()),
        ratios=tuple(damping.ratios(solution)[:kept].tolist()),
        assumed=vibration.assumed,
    )


def _ports(
    solution: Modes, tool: Mapping[str, str], units: tuple[str, str], role: str, wanted: Sequence[str] | None
) -> tuple[tuple[Port, ...], Array]:
    """The chosen inputs or outputs, and how each moves in all modes [ports x modes].

    Args:
        solution: the modes.
        tool: names of the ports at the tool point, with the component of each.
        units: units of ports that turn and of those that slide.
        role: "input" or "output", for messages.
        wanted: names of the ports that are chosen; those at the tool point if None.
    """
    turning, sliding = units
    rows = {name: COMPONENTS.index(component) for name, component in tool.items()}
    motions = {name: solution.tool[row] for name, row in rows.items()}
    motions |= {drive.name: drive.motion for drive in solution.drives}
    unit_by_name = {name: turning if row < 3 else sliding for name, row in rows.items()}
    unit_by_name |= {drive.name: turning if drive.turning else sliding for drive in solution.drives}
    names = [choice(name, motions, role) for name in (tool if wanted is None else wanted)]
    ports = tuple(Port(name, unit_by_name[name]) for name in names)
    return ports, np.array([motions[name] for name in names]).reshape(len(names), len(solution.inverse_squares))

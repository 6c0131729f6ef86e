"""A machine as a state space between forces and motions that are chosen by name, for control and simulation.

The matrices are made by `vibration.receptance`; files of them are written by `exchange.vibration_files`.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.studies.vibration import modes
from kinetostat.vibration.modes import Modes
from kinetostat.vibration.receptance import Equations
from kinetostat.vibration.receptance import state_space as equations_of

WRENCH = dict(zip(("mx", "my", "mz", "fx", "fy", "fz"), COMPONENTS, strict=True))
"""Names of moments and forces at the tool point, and the components along which they act."""


@dataclass(frozen=True)
class Port:
    """An input or an output.

    Attributes:
        name: "fx", or the name of an actuator.
        unit: SI.
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
    equations: Equations
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
    forces = {name: part for name, part in WRENCH.items() if part in vibration.components}
    input_ports, input_modes = _ports(solution, forces, ("N·m", "N"), "input", inputs)
    motions = {part: part for part in vibration.components}
    output_ports, output_modes = _ports(solution, motions, ("rad", "m"), "output", outputs)
    kept = solution.ringing if count is None else min(count, solution.ringing)
    return StateSpace(
        machine,
        equations_of(solution, damping, input_modes, output_modes, kept),
        input_ports,
        output_ports,
        tuple(solution.frequencies[:kept].tolist()),
        tuple(damping.ratios(solution)[:kept].tolist()),
        vibration.assumed,
    )


def _ports(
    solution: Modes, tool: Mapping[str, str], units: tuple[str, str], what: str, wanted: Sequence[str] | None
) -> tuple[tuple[Port, ...], Array]:
    """The chosen inputs or outputs, and how each moves in all modes; units are those of turning and of sliding."""
    rows = {name: COMPONENTS.index(part) for name, part in tool.items()}
    turning, sliding = units
    known = {name: (turning if row < 3 else sliding, solution.tool[row]) for name, row in rows.items()}
    known |= {drive.name: (turning if drive.turning else sliding, drive.motion) for drive in solution.drives}
    names = [choice(name, known, what) for name in (tool if wanted is None else wanted)]
    ports = tuple(Port(name, known[name][0]) for name in names)
    return ports, np.array([known[name][1] for name in names]).reshape(len(names), len(solution.squares))

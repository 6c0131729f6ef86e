"""A machine with its servo loops closed: dynamic stiffness of its drives, receptance at the tool, and poles.

The modes are those of the machine with motors that stand still and rotors without inertia, so that the spring of an
actuator is its transmission alone. Each servo loop then takes the place of a motor that stands still.

Source: theory (101)-(104). SI; at the tool point, base axes.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.equilibrium.state import MachineState
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.drive_limits import driven_springs
from kinetostat.machine.actuators import name_of, numbers_of_drive, rotor_turns, with_every_drive
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.vibration.modes import Modes
from kinetostat.vibration.receptance import Damper, receptance, state_space

UNSTABLE_REAL_PART = 1e-9
"""Real part of a pole, as a share of its size, above which the motion grows; below it is round-off."""
STATES_OF_DRIVE = 3
"""States of a drive: position of its motor, speed of its motor, and the integral of the position error."""


@dataclass(frozen=True)
class ServoLoop:
    """The servo loop of a drive; all its numbers are referred to the coordinate of its actuator.

    Attributes:
        transmission: stiffness between motor and joint, N/m or N·m/rad.
        inertia: inertia of the rotor, kg or kg·m².
        friction: viscous friction of the rotor, N·s/m or N·m·s/rad.
        velocity_gain: gain of the velocity loop, N·s/m or N·m·s/rad.
        position_gain: gain of the position loop, 1/s.
        integral_time: integral time of the velocity loop, s; 0 if it has no integral part.
        at_load: share of the position that is measured behind the transmission.
    """

    transmission: float
    inertia: float
    friction: float
    velocity_gain: float
    position_gain: float
    integral_time: float = 0.0
    at_load: float = 0.0

    def stiffness(self, frequencies: Array) -> Complex:
        """Dynamic stiffness against a force on the joint, N/m or N·m/rad [frequencies]; it may be infinite at 0 Hz.

        Args:
            frequencies: Hz.

        Source: theory (101).
        """
        s = 2.0j * math.pi * np.asarray(frequencies, dtype=float)
        rotor = s * s * self.inertia + s * self.friction
        feedback_of_motor = s + self.position_gain * (1.0 - self.at_load)
        feedback = s + self.position_gain
        if self.integral_time:
            # Numerator and denominator times s, so that the integral part is finite at 0 Hz.
            rotor, spring = rotor * s, self.transmission * s
            gain = self.velocity_gain * (s + 1.0 / self.integral_time)
        else:
            spring, gain = self.transmission * np.ones_like(s), self.velocity_gain * np.ones_like(s)
        above, below = rotor + gain * feedback, rotor + spring + gain * feedback_of_motor
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(below == 0.0, np.inf, self.transmission * above / below))

    @property
    def static_stiffness(self) -> float:
        """Stiffness at 0 Hz, N/m or N·m/rad: that of the transmission if the velocity loop has an integral part.

        It is infinite with an integral part if all of the position is measured behind the transmission.

        Source: theory (102).
        """
        return float(self.stiffness(np.zeros(1))[0].real)


def servo_loops(state: MachineState) -> dict[str, ServoLoop]:
    """Return the loop of each drive, by the name of its actuator.

    Raises:
        InputError: a gain is zero, a rotor has no inertia, or a transmission is rigid.
    """
    machine, loops = state.machine, {}
    for spring in driven_springs(state.configuration):
        gains, drive = (numbers_of_drive(machine, table, spring) for table in ("servo", "drives"))
        for name, gain, example in (
            ("position_gain", gains.position_gain, '"50 1/s"'),
            ("velocity_gain", gains.velocity_gain, '"0.5 N*m*s/rad"'),
        ):
            if not gain:
                raise InputError(
                    f"servo.{name} of {machine.name} is 0, so that the motor of {name_of(spring)} is not held; write "
                    f"{name} = {example}, say, in the table [servo]."
                )
        if not drive.rotor_inertia:
            raise InputError(
                f"drives.rotor_inertia of {machine.name} is 0, and a loop without inertia has no dynamics; write "
                'rotor_inertia = "2e-5 kg*m**2", say, in the table [drives].'
            )
        stiffness = float(spring.stiffness)
        if math.isinf(stiffness):
            raise InputError(
                f"{spring.name} of {machine.name} is rigid; its stiffness is that of the transmission between motor "
                "and joint, which a servo loop needs: give it one."
            )
        square = float(rotor_turns(spring, drive)) ** 2
        loops[spring.part_name] = ServoLoop(
            transmission=stiffness,
            inertia=square * drive.rotor_inertia,
            friction=square * drive.rotor_damping,
            velocity_gain=square * gains.velocity_gain,
            position_gain=gains.position_gain,
            integral_time=gains.integral_time,
            at_load=gains.position_at_load,
        )
    return loops


def with_standing_motors(machine: Machine) -> Machine:
    """Return the machine with motors that stand still: without rotor inertia, springs of drives are transmissions."""
    return with_every_drive(machine, {"drives.rotor_inertia": 0.0, "drives.rotor_damping": 0.0})


@dataclass(frozen=True)
class ClosedLoops:
    """A machine with its servo loops.

    Attributes:
        modes: modes of the machine with motors that stand still.
        damping: damping of these modes.
        loops: the loop of each of `modes.drives`.
    """

    modes: Modes
    damping: Damper
    loops: tuple[ServoLoop, ...]

    def receptance(self, frequencies: Array) -> Complex:
        """Return the motion of the tool per unit of a varying wrench on it [frequencies x 6 x 6], rad and m per N·m, N.

        Each loop changes the stiffness of its actuator from that of the transmission to its own. All together change
        the stiffness by a matrix whose rank is the number of drives: H' = H - H_d (Delta^-1 + D)^-1 H_d^T (Woodbury).

        Args:
            frequencies: Hz.

        Source: theory (103).
        """
        motions = np.vstack([self.modes.tool, *(drive.motion[None] for drive in self.modes.drives)])
        whole = receptance(replace(self.modes, tool=motions), self.damping, frequencies)
        tool, across, drives = whole[:, :6, :6], whole[:, :6, 6:], whole[:, 6:, 6:]
        stiffness = np.array([loop.stiffness(frequencies) for loop in self.loops]).T
        change = stiffness - np.array([loop.transmission for loop in self.loops])
        # The row of a rigid loop, whose Delta is infinite, is divided by it: (1 + Delta D) x = Delta H_d^T.
        rigid = ~np.isfinite(change)
        weight, unit = np.where(rigid, 1.0, change), np.where(rigid, 0.0, 1.0)
        system = unit[:, :, None] * np.eye(len(self.loops)) + weight[:, :, None] * drives
        solved = np.linalg.solve(system, weight[:, :, None] * across.mT)
        return np.asarray(tool - across @ solved)

    @property
    def stable(self) -> bool:
        """Whether all poles decay."""
        poles = self.poles()
        return bool((poles.real <= UNSTABLE_REAL_PART * np.abs(poles)).all())

    def poles(self) -> Complex:
        """Eigenvalues of the closed loops, rad/s [states]; one with a positive real part is a motion that grows.

        Source: theory (104).
        """
        ports = np.array([drive.motion for drive in self.modes.drives])
        machine = state_space(self.modes, self.damping, ports, ports)
        count, size = len(self.loops), len(machine.states)
        # Columns of numbers, one for each drive.
        transmission = np.array([[loop.transmission] for loop in self.loops])
        inertia = np.array([[loop.inertia] for loop in self.loops])
        friction = np.array([[loop.friction] for loop in self.loops])
        gain = np.array([[loop.velocity_gain] for loop in self.loops])
        position_gain = np.array([[loop.position_gain] for loop in self.loops])
        at_load = np.array([[loop.at_load] for loop in self.loops])
        integral_gain = np.array(
            [[loop.velocity_gain / loop.integral_time if loop.integral_time else 0.0] for loop in self.loops]
        )
        zero = np.zeros((count, count))
        # Rows by the states (machine, motors, speeds, integrals): a motor at x_m pulls its joint with k x_m.
        joint = np.hstack([machine.c, machine.d * transmission.T, zero, zero])
        motor, speed, integral = (
            np.hstack([np.zeros((count, size)), *(np.eye(count) if i == place else zero for i in range(3))])
            for place in range(STATES_OF_DRIVE)
        )
        measured_position = at_load * joint + (1.0 - at_load) * motor
        torque = transmission * (joint - motor) - friction * speed
        torque = torque - gain * (position_gain * measured_position + speed)
        torque = torque - integral_gain * (position_gain * integral + motor)
        of_machine = np.hstack([machine.a, machine.b * transmission.T, np.zeros((size, 2 * count))])
        rows = [of_machine, speed, torque / inertia]
        # A loop without an integral part has an integral state that decays at 1/s and that nothing reads.
        rows.append(np.where(integral_gain > 0.0, measured_position, -integral))
        return np.asarray(np.linalg.eigvals(np.vstack(rows)))


def least_damped_pole(poles: Complex, frequencies: Sequence[float]) -> tuple[float, float] | None:
    """Return frequency (Hz) and damping ratio of the oscillating pole of least damping ratio; None if none oscillates.

    Args:
        poles: poles of the closed loops, rad/s.
        frequencies: least and greatest frequency that is considered, Hz.
    """
    oscillating = poles[poles.imag > 0.0]
    hertz = np.abs(oscillating) / (2.0 * math.pi)
    oscillating = oscillating[(hertz >= frequencies[0]) & (hertz <= frequencies[1])]
    if not len(oscillating):
        return None
    ratios = -oscillating.real / np.abs(oscillating)
    least = int(np.argmin(ratios))
    return float(np.abs(oscillating[least]) / (2.0 * math.pi)), float(ratios[least])

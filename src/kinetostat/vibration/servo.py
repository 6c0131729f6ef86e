"""A machine with its servo loops closed: what stiffness a drive has over frequency, the tool's response, and the poles.

The modes are those of the machine with motors that stand still and rotors without inertia, so that the spring of an
actuator is its transmission; each loop takes the place of that standing still.

Source: theory (101)-(104). SI; at the tool point, base axes.
"""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.frozen import dataclass
from kinetostat.vibration.modes import Modes
from kinetostat.vibration.receptance import Damper, receptance
from kinetostat.vibration.state_space import state_space

INTEGRAL_STATES = 3
"""States of a drive: where its motor stands, how fast it moves, and the integral of the position error."""


@dataclass(frozen=True)
class ServoLoop:
    """The loop of a drive, all of it at the coordinate of its actuator.

    Attributes:
        transmission: stiffness between motor and joint, N/m or N·m/rad.
        inertia: of the rotor, kg or kg·m².
        friction: viscous, of the rotor, N·s/m or N·m·s/rad.
        velocity_gain: of the velocity loop, N·s/m or N·m·s/rad.
        position_gain: of the position loop, 1/s.
        integral_time: of the velocity loop, s; 0 if it has no integral part.
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
        free = s * s * self.inertia + s * self.friction
        behind = s + self.position_gain * (1.0 - self.at_load)
        whole = s + self.position_gain
        if self.integral_time:
            # Both sides times s, so that the integral part is finite at 0 Hz.
            free, kept = free * s, self.transmission * s
            gain = self.velocity_gain * (s + 1.0 / self.integral_time)
        else:
            kept, gain = self.transmission * np.ones_like(s), self.velocity_gain * np.ones_like(s)
        above, below = free + gain * whole, free + kept + gain * behind
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(below == 0.0, np.inf, self.transmission * above / below))

    @property
    def static_stiffness(self) -> float:
        """Stiffness at 0 Hz, N/m or N·m/rad: that of the transmission where the motor's loop has an integral part.

        Infinite with an integral part and all of the position measured behind the transmission.

        Source: theory (102).
        """
        return float(self.stiffness(np.zeros(1))[0].real)


@dataclass(frozen=True)
class ClosedLoops:
    """A machine with its loops.

    Attributes:
        modes: of the machine with motors that stand still.
        damping: of these.
        loops: one for each of `modes.drives`.
    """

    modes: Modes
    damping: Damper
    loops: tuple[ServoLoop, ...]

    def receptance(self, frequencies: Array) -> Complex:
        """Motion of the tool per unit of a varying wrench on it [frequencies x 6 x 6], rad and m per N·m and N.

        Each loop changes the stiffness of its actuator from that of the transmission to its own, a change of as low a
        rank as there are drives: H' = H - H_d (Delta^-1 + D)^-1 H_d^T (Woodbury).

        Args:
            frequencies: Hz.

        Source: theory (103).
        """
        given = np.asarray(frequencies, dtype=float)
        motions = np.vstack([self.modes.tool, *(drive.motion[None] for drive in self.modes.drives)])
        whole = receptance(_with_motions(self.modes, motions), self.damping, given)
        tool, across, drives = whole[:, :6, :6], whole[:, :6, 6:], whole[:, 6:, 6:]
        stiffness = np.array([loop.stiffness(given) for loop in self.loops]).T
        change = stiffness - np.array([loop.transmission for loop in self.loops])
        endless = ~np.isfinite(change)
        weight, share = np.where(endless, 1.0, change), np.where(endless, 0.0, 1.0)
        system = share[:, :, None] * np.eye(len(self.loops)) + weight[:, :, None] * drives
        solved = np.linalg.solve(system, weight[:, :, None] * np.swapaxes(across, 1, 2))
        return np.asarray(tool - across @ solved)

    def poles(self) -> Complex:
        """Eigenvalues of the closed loops, rad/s [states]: a positive real part says that something grows.

        Source: theory (104).
        """
        ports = np.array([drive.motion for drive in self.modes.drives])
        machine = state_space(self.modes, self.damping, ports, ports)
        count, size = len(self.loops), len(machine.states)
        k, inertia, friction, gain, position, at_load = (
            np.array([getattr(loop, name) for loop in self.loops])
            for name in ("transmission", "inertia", "friction", "velocity_gain", "position_gain", "at_load")
        )
        rate = np.array([gain[i] / t if (t := loop.integral_time) else 0.0 for i, loop in enumerate(self.loops)])
        zero = np.zeros((count, count))
        # The joint's place e by the states (machine, motor, speed, integral): the motor pulls it with k x_m.
        joint = np.hstack([machine.c, machine.d * k, zero, zero])
        motor, speed, integral = (
            np.hstack([np.zeros((count, size)), *(np.eye(count) if i == place else zero for i in range(3))])
            for place in range(INTEGRAL_STATES)
        )
        seen = at_load[:, None] * joint + (1.0 - at_load)[:, None] * motor
        torque = k[:, None] * (joint - motor) - friction[:, None] * speed
        torque = torque - gain[:, None] * (position[:, None] * seen + speed)
        torque = torque - rate[:, None] * (position[:, None] * integral + motor)
        rows = [np.hstack([machine.a, machine.b * k, np.zeros((size, 2 * count))]), speed, torque / inertia[:, None]]
        integrates = rate[:, None] > 0.0
        return np.asarray(np.linalg.eigvals(np.vstack([*rows, np.where(integrates, seen, -integral)])))


def _with_motions(modes: Modes, motions: Array) -> Modes:
    """The modes with other motions in place of the tool's."""
    return Modes(modes.squares, modes.shapes, motions, modes.drives)


def slowest_decay(poles: Complex, frequencies: Sequence[float]) -> tuple[float, float] | None:
    """Frequency (Hz) and damping ratio of the pole that swings with the least damping; None where none swings.

    Args:
        poles: rad/s.
        frequencies: least and greatest, Hz, between which it is looked for.
    """
    swinging = poles[poles.imag > 0.0]
    hertz = np.abs(swinging) / (2.0 * math.pi)
    swinging = swinging[(hertz >= frequencies[0]) & (hertz <= frequencies[1])]
    if not len(swinging):
        return None
    ratios = -swinging.real / np.abs(swinging)
    worst = int(np.argmin(ratios))
    return float(np.abs(swinging[worst]) / (2.0 * math.pi)), float(ratios[worst])

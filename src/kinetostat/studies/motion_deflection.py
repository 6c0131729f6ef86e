"""Deflections of the tool along a motion: those of all springs pose by pose, and of the modes that the motion excites.

Motors stand where they should. The tool deflects by the wrench at the tool point that the acceleration of masses, the
process and the friction of joints demand.

Source: theory section 20; M. Hochbruck and A. Ostermann, "Exponential integrators", Acta Numerica 19 (2010), section 2.
"""

from dataclasses import replace

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.engine.batch import NUMPY_SLAB
from kinetostat.engine.moving import PathForces, RigidForm, forces_on_path
from kinetostat.equilibrium.state import MachineState, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.actuators import with_every_drive
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.motions import Motion
from kinetostat.studies.vibration import modes
from kinetostat.vibration.modes import Modes

STEPS = 8192
"""Equal steps of a motion in which modes are followed. A mode that swings 400 times in the motion has 20 of them in a
period, so that its greatest amount is missed by 1 % at most; the steps themselves have no error where loads change
evenly within them."""
EXCITED_SHARE = 0.01
"""Share of the greatest deflection at rest from which a mode counts as excited: a lesser one changes the deflection by
less than masses and damping ratios are known to."""
LEAST_FROM_CRITICAL = 1e-6
"""Least distance of a damping ratio from critical damping, where both poles of a swing are one and their difference has
no digits left; at this distance it loses three, and the swing is wrong by a millionth."""


@dataclass(frozen=True)
class ModesAlong:
    """The modes of a machine along a motion, beside what springs do at rest under the same forces.

    Attributes:
        frequency: frequency of the lowest mode while motors stand still, Hz.
        modes: frequencies of the modes that the motion excites, Hz; none where springs follow it as at rest.
        times: times at which the deflection is known, s [steps].
        surplus: deflection of the tool beyond that at rest under the same forces [steps x 6], rad and m.
        after: greatest displacement of the tool point after the end of the motion, m; 0 of one that goes on for ever.
    """

    frequency: float
    modes: tuple[float, ...]
    times: Array
    surplus: Array
    after: float


def deflections(machine: Machine, motion: Motion, forces: PathForces) -> Array:
    """Deflections of the tool point by C at each pose and the wrench there [n x 6]; NaN where a pose has no answer."""
    all_deflections = np.full((motion.path.size, 6), np.nan)
    for start in range(0, motion.path.size, NUMPY_SLAB):
        slab = slice(start, min(start + NUMPY_SLAB, motion.path.size))
        count = slab.stop - start
        columns = {path: column[slab] for path, column in motion.path.columns.items()}
        with np.errstate(all="ignore"):
            response = states_at(machine, columns, count).free
            entries = [[np.broadcast_to(entry, count) for entry in row] for row in response.compliance.rows()]
            deflection = np.einsum("ijn,jn->ni", np.array(entries, dtype=float), forces.wrench[:, slab])
            has_answer = np.broadcast_to(np.asarray(response.status) == Status.OK, count)
        all_deflections[slab] = np.where(has_answer[:, None] & np.isfinite(deflection), deflection, np.nan)
    return all_deflections


def modes_along(state: MachineState, form: RigidForm, motion: Motion, wrench: Array) -> ModesAlong | None:
    """Follow the modes of a machine at its pose along a motion.

    Args:
        state: the state of the machine.
        form: the form of its equations of motion.
        motion: a motion that begins and ends at rest, or goes on for ever.
        wrench: wrench at the tool point at each point of the motion [6 x n], N·m and N.

    Returns:
        None where no mode is known, or the motion takes no time.
    """
    modes_and_ratios = None if motion.timeless else _modes_of_standing_motors(state.machine)
    if modes_and_ratios is None:
        return None
    solution, ratios = modes_and_ratios
    shapes, rates = solution.tool[:, : solution.mode_count], 2.0 * np.pi * solution.frequencies
    times = np.linspace(motion.times[0], motion.times[-1], STEPS + 1)
    loads = shapes.T @ np.array([np.interp(times, motion.times, row) for row in wrench])
    # Before and after a motion the machine stands still, while accelerations may begin and end with a jump.
    first_load, last_load = (shapes.T @ _wrench_at_ends(form, motion)).T
    before = None if motion.periodic else first_load
    amounts, final_rates = swings_under(loads, rates, ratios, times[1] - times[0], before)
    surplus = amounts - loads
    # All of a mode moves in one ratio, so that the displacement of the tool point measures its rotations as well.
    displacements = np.linalg.norm(shapes[3:], axis=0)
    greatest_at_rest = np.linalg.norm(shapes[3:] @ loads, axis=0).max()
    excited = displacements * np.abs(surplus).max(axis=1) > EXCITED_SHARE * greatest_at_rest
    # What is left swings about the deflection at rest; the amplitude of a mode has its distance and its rate together.
    final_amplitudes = displacements * np.hypot(amounts[:, -1] - last_load, final_rates / rates)
    return ModesAlong(
        frequency=float(solution.frequencies[0]),
        modes=tuple(solution.frequencies[excited].tolist()),
        times=times,
        surplus=(shapes[:, excited] @ surplus[excited]).T,
        after=0.0 if motion.periodic else float(final_amplitudes[excited].sum()),
    )


def _modes_of_standing_motors(machine: Machine) -> tuple[Modes, Array] | None:
    """The modes of a machine whose motors stand where they should, and their damping ratios; None where it has none.

    Rotors without inertia and damping leave the ends of actuators where they are.
    """
    standing = with_every_drive(machine, {"drives.rotor_inertia": 0.0, "drives.rotor_damping": 0.0})
    try:
        vibration = modes(standing)
    except InputError:  # nothing has a mass, or no spring deflects
        return None
    solution, damping = vibration.solution, vibration.damping
    if solution is None or damping is None or not solution.mode_count:
        return None
    return solution, damping.ratios(solution)


def _wrench_at_ends(form: RigidForm, motion: Motion) -> Array:
    """The wrench at the tool point where the motion begins and where it ends, at rest [6 x 2]."""
    ends = motion.path.at(np.array([0, -1]))
    zeros = {name: np.zeros(2) for name in ends.pose}
    return forces_on_path(form, replace(ends, rates=zeros, accelerations=zeros), joints=True, compiled=False).wrench


def swings_under(loads: Array, rates: Array, ratios: Array, step: float, before: Array | None) -> tuple[Array, Array]:
    """Amounts of damped swings under loads at equal times, q'' + 2 zeta omega q' + omega² q = omega² p.

    A swing is the difference of two motions z' = lambda z + p, one for each pole lambda. Both are followed by the
    exponential integrator that is exact for a load that changes evenly from one time to the next.

    Args:
        loads: load p of each swing [m x n].
        rates: angular frequency omega of each, rad/s [m].
        ratios: damping ratio zeta of each [m].
        step: time from one load to the next, s.
        before: loads under which all is at rest before the first time [m]; None if the loads go on for ever.

    Returns:
        Amounts q [m x n], and the rates of these at the end [m].
    """
    ratios = np.where(np.abs(ratios - 1.0) < LEAST_FROM_CRITICAL, 1.0 + LEAST_FROM_CRITICAL, ratios)
    roots = np.sqrt((ratios**2 - 1.0).astype(complex))
    slow_poles, fast_poles = rates * (roots - ratios), -rates * (roots + ratios)
    poles: Complex = np.concatenate([slow_poles, fast_poles])
    z = poles * step
    decay = np.exp(z)
    phi_1 = np.expm1(z) / z  # the functions phi of the exponential integrator, as the source names them
    phi_2 = (phi_1 - 1.0) / z
    loads_of_poles = np.vstack([loads, loads]).T
    increments = step * ((phi_1 - phi_2) * loads_of_poles[:-1] + phi_2 * loads_of_poles[1:])
    states = np.zeros(loads_of_poles.shape, dtype=complex)
    if before is not None:
        states[0] = -np.concatenate([before, before]) / poles
    _follow(states, decay, increments)
    if before is None:  # the beginning that comes back to itself after a period
        states[0] = states[-1] / (1.0 - decay ** len(increments))
        _follow(states, decay, increments)
    slow, fast = np.split(states, 2, axis=1)
    factor = rates**2 / (slow_poles - fast_poles)
    return (factor * (slow - fast)).real.T, (factor * (slow_poles * slow[-1] - fast_poles * fast[-1])).real


def _follow(states: Complex, decay: Complex, increments: Complex) -> None:
    """Fill in all rows of states [n x poles] after the first one."""
    for k, increment in enumerate(increments):
        states[k + 1] = decay * states[k] + increment

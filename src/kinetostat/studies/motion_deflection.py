"""Deflections of the tool along a motion: those of all springs pose by pose, and of the modes that the motion excites.

Motors stand where they should. The tool deflects by the wrench at the tool point that the acceleration of masses, the
process and the friction of joints demand.

Source: theory section 20.
"""

from dataclasses import replace

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.engine.batch import NUMPY_SLAB
from kinetostat.engine.moving import PathForces, RigidForm, forces_on_path
from kinetostat.equilibrium.state import MachineState, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.drives import with_every_drive
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.motions import Motion
from kinetostat.studies.vibration import modes

STEPS = 8192
"""Equal steps of a motion in which modes are followed; each is exact for a load that changes evenly within it."""
EXCITED = 0.01
"""Share of the greatest deflection at rest from which the motion of a mode beside that counts."""
CRITICAL = 1e-6
"""Distance of a damping ratio from that of critical damping, where two motions are one."""


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
    """Deflections of the tool point by C at each pose and the wrench there [n x 6]."""
    result = np.full((motion.path.size, 6), np.nan)
    for start in range(0, motion.path.size, NUMPY_SLAB):
        part = slice(start, min(start + NUMPY_SLAB, motion.path.size))
        columns = {path: rows[part] for path, rows in motion.path.columns.items()}
        with np.errstate(all="ignore"):
            response = states_at(machine, columns, part.stop - start).free
            rows = [
                [
                    np.broadcast_to(np.asarray(response.compliance.entry(i, j), dtype=float), part.stop - start)
                    for j in range(6)
                ]
                for i in range(6)
            ]
            moved = np.einsum("ijn,jn->ni", np.array(rows), forces.wrench[:, part])
            good = np.broadcast_to(np.asarray(response.status) == Status.OK, part.stop - start)
        result[part] = np.where(good[:, None] & np.isfinite(moved), moved, np.nan)
    return result


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
    still = with_every_drive(state.machine, {"drives.rotor_inertia": 0.0, "drives.rotor_damping": 0.0})
    try:
        answer = modes(still)
    except InputError:  # nothing has a mass, or no spring deflects
        return None
    if answer.solution is None or answer.damping is None or not answer.solution.ringing or motion.timeless:
        return None
    solution, count = answer.solution, answer.solution.ringing
    ratios = answer.damping.ratios(solution)
    times = np.linspace(motion.times[0], motion.times[-1], STEPS + 1)
    even = np.array([np.interp(times, motion.times, row) for row in wrench])
    tool = solution.tool[:, :count]
    loads = tool.T @ even
    rates = 2.0 * np.pi * solution.frequencies
    # Before and after a motion the machine stands still, while accelerations may begin and end with a jump.
    ends = tool.T @ _at_rest(form, motion)
    amounts, end = swings_under(loads, rates, ratios, times[1] - times[0], None if motion.periodic else ends[:, 0])
    beside = amounts - loads
    at_rest = np.linalg.norm(tool[3:] @ loads, axis=0).max()
    # A mode turns about its own shape: its size at the tool point is that of the displacement.
    sizes = np.linalg.norm(tool[3:], axis=0) * np.abs(beside).max(axis=1)
    counted = sizes > EXCITED * at_rest
    surplus = (tool[:, counted] @ beside[counted]).T
    # What is left swings about the deflection at rest, each mode by the size of its rate and its distance together.
    swing = np.hypot(amounts[:, -1] - ends[:, 1], end / rates) * np.linalg.norm(tool[3:], axis=0)
    after = 0.0 if motion.periodic else float(swing[counted].sum())
    known = tuple(float(f) for f in solution.frequencies[counted])
    return ModesAlong(float(solution.frequencies[0]), known, times, surplus, after)


def _at_rest(form: RigidForm, motion: Motion) -> Array:
    """The wrench at the tool point where the motion begins and where it ends, at rest [6 x 2]."""
    ends = motion.path.at(np.array([0, -1]))
    still = {name: np.zeros(2) for name in ends.pose}
    return forces_on_path(form, replace(ends, rates=still, accelerations=still), joints=True, compiled=False).wrench


def swings_under(loads: Array, rates: Array, ratios: Array, step: float, before: Array | None) -> tuple[Array, Array]:
    """Amounts of damped swings under loads at equal times, q'' + 2 zeta omega q' + omega² q = omega² p.

    A swing is the difference of two motions z' = lambda z + p, each of which is exact for a load that changes evenly
    from one time to the next.

    Args:
        loads: load p of each swing [m x n].
        rates: angular frequency omega of each, rad/s [m].
        ratios: damping ratio zeta of each [m].
        step: time from one load to the next, s.
        before: loads under which all is at rest before the first time [m]; None if the loads go on for ever.

    Returns:
        Amounts q [m x n], and the rates of these at the end [m].
    """
    ratios = np.where(np.abs(ratios - 1.0) < CRITICAL, 1.0 + CRITICAL, ratios)
    roots = np.sqrt((ratios**2 - 1.0).astype(complex))
    both: Complex = np.concatenate([rates * (roots - ratios), -rates * (roots + ratios)])
    grown, z = np.exp(both * step), both * step
    first = np.expm1(z) / z
    later = (first - 1.0) / z
    given = np.vstack([loads, loads]).T
    pushes = step * ((first - later) * given[:-1] + later * given[1:])
    moved = np.zeros(given.shape, dtype=complex)
    if before is not None:
        moved[0] = -np.concatenate([before, before]) / both
    _follow(moved, grown, pushes)
    if before is None:  # the beginning that comes back to itself after a period
        moved[0] = moved[-1] / (1.0 - grown ** len(pushes))
        _follow(moved, grown, pushes)
    first, second = np.split(moved, 2, axis=1)
    slow, fast = np.split(both, 2)
    factor = rates**2 / (slow - fast)
    return (factor * (first - second)).real.T, (factor * (slow * first[-1] - fast * second[-1])).real


def _follow(moved: Complex, grown: Complex, pushes: Complex) -> None:
    """Fill in all rows of a motion after its first one."""
    for k, push in enumerate(pushes):
        moved[k + 1] = grown * moved[k] + push

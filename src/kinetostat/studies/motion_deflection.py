"""Deflections of the tool along a motion: those of all springs pose by pose, and whether the motion excites modes."""

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import NUMPY_SLAB
from kinetostat.engine.moving import PathForces
from kinetostat.equilibrium.state import MachineState, states_at
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE
from kinetostat.spec.errors import InputError
from kinetostat.studies.motions import Motion
from kinetostat.studies.vibration import modes

SLOW = 1.0 / 3.0
"""Share of the lowest natural frequency up to which springs follow a motion as at rest, within an eighth."""


def deflections(machine: Machine, motion: Motion, forces: PathForces) -> Array:
    """Deflections of the tool point by C at each pose and the wrench there [n x 6]."""
    result = np.full((motion.path.size, 6), np.nan)
    for start in range(0, motion.path.size, NUMPY_SLAB):
        part = slice(start, min(start + NUMPY_SLAB, motion.path.size))
        columns = {POSE + name: rows[part] for name, rows in motion.path.pose.items()}
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


def excitation(state: MachineState, motion: Motion) -> tuple[float | None, float]:
    """The lowest natural frequency, Hz, and the share of the motion's accelerations above a third of it."""
    try:
        answer = modes(state)
    except InputError:  # nothing has a mass, or no spring deflects
        return None, 0.0
    if answer.solution is None or not answer.solution.ringing or motion.timeless:
        return None, 0.0
    lowest = float(answer.solution.frequencies[0])
    count = 4096
    even = np.linspace(motion.times[0], motion.times[-1], count, endpoint=False)
    spectrum = np.zeros(count // 2 + 1)
    for name, rows in motion.path.accelerations.items():
        scale = 1.0 if name in ("x", "y", "z") else float(state.configuration.length)
        spectrum += np.abs(np.fft.rfft(scale * np.interp(even, motion.times, rows))) ** 2
    fast = np.fft.rfftfreq(count, motion.duration / count) > SLOW * lowest
    whole = float(spectrum.sum())
    return lowest, float(spectrum[fast].sum()) / whole if whole > 0.0 else 0.0

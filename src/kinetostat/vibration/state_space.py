"""A vibrating machine as linear equations of first order: x' = A x + B u, y = C x + D u, for control and simulation.

Each mode is two states. Motions without mass follow at once and are in D, unless friction slows them: then each is one
state. So the response at every frequency is that of `receptance`, to round-off.

Source: theory (61) and (62). SI, base axes, at the tool point.
"""

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.tolerances import UNRESISTED
from kinetostat.vibration.modes import Modes
from kinetostat.vibration.receptance import Damper


@dataclass(frozen=True)
class Equations:
    """The matrices of a state space.

    Attributes:
        a: rates of the states by the states, 1/s [states x states].
        b: rates of the states by the inputs [states x inputs].
        c: outputs by the states [outputs x states].
        d: outputs by the inputs [outputs x inputs].
        states: what each state is, in words.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    states: tuple[str, ...]


def state_space(modes: Modes, damping: Damper, inputs: Array, outputs: Array, count: int | None = None) -> Equations:
    """Write the vibrations of a machine as equations of first order.

    Args:
        modes: modes at the pose.
        damping: damping of the modes.
        inputs: motion in each mode of each point and direction in which a force acts [inputs x m], SI per root of a
            joule.
        outputs: motion in each mode of each point and direction whose motion is an output [outputs x m].
        count: number of the lowest modes that become states; all that have mass if None. The others follow at once,
            without friction, and what they add to the compliance stays in D.
    """
    with_mass = modes.ringing
    kept = with_mass if count is None else min(count, with_mass)
    friction = damping.friction
    least = UNRESISTED * float(np.abs(friction).max())
    creeping, turns = _principal_friction(friction[with_mass:, with_mass:], least)
    without_mass = with_mass + np.arange(turns.shape[1])
    creep, free = turns[:, : len(creeping)], turns[:, len(creeping) :]
    # What follows at once: modes with mass that are no states, and motions without mass that no friction slows.
    pushed, seen = (
        np.concatenate([rows[:, kept:with_mass], rows[:, without_mass] @ free], axis=1) for rows in (inputs, outputs)
    )
    roots = np.sqrt(modes.squares[:kept])
    coupling = creep.T @ friction[with_mass:, :kept] / roots
    push, slide = inputs[:, :kept].T / roots[:, None], creep.T @ inputs[:, without_mass].T
    drag = friction[:kept, :kept] / np.outer(roots, roots) + np.diag(2.0 * damping.ratio / roots)
    by_creep = coupling.T / creeping
    zeros, unit, size = np.zeros((kept, kept)), np.eye(kept), len(creeping)
    rates = [
        [zeros, unit, np.zeros((kept, size))],
        [-np.diag(1.0 / roots**2), by_creep @ coupling - drag, by_creep],
        [np.zeros((size, kept)), -coupling / creeping[:, None], -np.diag(1.0 / creeping)],
    ]
    forced = [np.zeros((kept, len(inputs))), push - by_creep @ slide, slide / creeping[:, None]]
    motions = [outputs[:, :kept] / roots, np.zeros((len(outputs), kept)), outputs[:, without_mass] @ creep]
    states = [f"{kind} of mode {k + 1}" for kind in ("amplitude", "speed") for k in range(kept)]
    states += [f"creeping motion {k + 1}" for k in range(size)]
    return Equations(np.block(rates), np.vstack(forced), np.hstack(motions), seen @ pushed.T, tuple(states))


def _principal_friction(friction: Array, least: float) -> tuple[Array, Array]:
    """Friction of the motions without mass along its principal directions, of which those with friction creep.

    Args:
        friction: friction between these motions, s [n x n].
        least: friction up to which it is round-off, s.

    Returns:
        The frictions beyond that, the greatest first [k]; all directions as columns [n x n], in the same order.
    """
    sizes, directions = np.linalg.eigh(friction)
    sizes, directions = sizes[::-1], directions[:, ::-1]
    return sizes[sizes > least], directions

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
        modes: at the pose.
        damping: the damping of the modes.
        inputs: motion of each point and direction in which a force acts, in each mode [inputs x m], SI per root of a
            joule.
        outputs: likewise, motions that are looked at [outputs x m].
        count: of the lowest modes that are states; all that have mass if None. Higher ones follow at once, without
            friction, and what they add to the compliance stays in D.
    """
    rings = modes.ringing if count is None else min(count, modes.ringing)
    friction = damping.friction
    slow, turned = _slow_friction(
        friction[modes.ringing :, modes.ringing :], UNRESISTED * float(np.abs(friction).max())
    )
    slowed = modes.ringing + np.arange(turned.shape[1])
    kept, drag = slice(0, rings), turned[:, : len(slow)]
    at_once = np.concatenate([inputs[:, rings : modes.ringing], inputs[:, slowed] @ turned[:, len(slow) :]], axis=1)
    seen = np.concatenate([outputs[:, rings : modes.ringing], outputs[:, slowed] @ turned[:, len(slow) :]], axis=1)
    roots = np.sqrt(modes.squares[kept])
    coupling = drag.T @ friction[modes.ringing :, kept] / roots
    push, slide = inputs[:, kept].T / roots[:, None], drag.T @ inputs[:, slowed].T
    against = friction[kept, kept] / np.outer(roots, roots) + np.diag(2.0 * damping.ratio / roots)
    lag = coupling.T / slow
    zeros, unit = np.zeros((rings, rings)), np.eye(rings)
    rates = [
        [zeros, unit, np.zeros((rings, len(slow)))],
        [-np.diag(1.0 / roots**2), lag @ coupling - against, lag],
        [np.zeros((len(slow), rings)), -coupling / slow[:, None], -np.diag(1.0 / slow)],
    ]
    forced = [np.zeros((rings, len(inputs))), push - lag @ slide, slide / slow[:, None]]
    motions = [outputs[:, kept] / roots, np.zeros((len(outputs), rings)), outputs[:, slowed] @ drag]
    names = [f"{what} of mode {k + 1}" for what in ("amplitude", "speed") for k in range(rings)]
    names += [f"creeping motion {k + 1}" for k in range(len(slow))]
    return Equations(np.block(rates), np.vstack(forced), np.hstack(motions), seen @ at_once.T, tuple(names))


def _slow_friction(friction: Array, least: float) -> tuple[Array, Array]:
    """Friction of the motions without mass along its principal directions.

    Args:
        friction: between them, s [n x n].
        least: up to which it is round-off, s.

    Returns:
        The frictions beyond that [k]; all directions as columns [n x n], those of the frictions first.
    """
    sizes, directions = np.linalg.eigh(friction)
    sizes, directions = sizes[::-1], directions[:, ::-1]
    return sizes[sizes > least], directions

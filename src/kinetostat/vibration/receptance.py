"""A machine under forces that vary: the receptance of its tool, alone and with a tool that is coupled to it, and its
equations of first order.

A receptance is the motion under a force that varies as a sine. All motions of the modes carry their part of it, those
without mass as springs do; so the receptance at no frequency is the compliance.

Source: theory (59)-(62) and (108). SI, base axes, at the tool point.
"""

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.equilibrium.balance import Balance
from kinetostat.frozen import dataclass
from kinetostat.tolerances import UNRESISTED
from kinetostat.vibration.modes import Modes, damping_matrix

ASSUMED_RATIO = 0.02
"""Damping ratio of every mode where a file says nothing about damping: that of many machine tools."""
PARTS_BETWEEN = (0.25, 0.5, 0.75)
"""Places of further frequencies between two of a tool's own, as shares of their distance: a peak of machine and tool
together may lie between two of the tool's."""


@dataclass(frozen=True)
class Damper:
    """Damping of the modes.

    Shapes of modes have a strain energy of one half, so that the stiffness of each is 1 and its mass 1 / omega².

    Attributes:
        friction: friction of joints and rotors, and Rayleigh's damping, between the modes [m x m], s.
        ratio: damping ratio that every mode has besides.
    """

    friction: Array
    ratio: float

    def ratios(self, modes: Modes) -> Array:
        """Damping ratio of each mode with mass, all its damping counted, for light damping [modes]."""
        count = modes.mode_count
        roots = np.sqrt(modes.inverse_squares[:count])  # 1 / omega, s
        return np.asarray(self.ratio + 0.5 * np.diagonal(self.friction)[:count] / roots)


def damper(equations: Balance, modes: Modes, ratio: float, per_mass: float, per_stiffness: float) -> Damper:
    """Return the damping of the modes of one pose.

    Args:
        equations: the machine at its state.
        modes: the vibrations of the machine.
        ratio: damping ratio of every mode.
        per_mass, per_stiffness: Rayleigh's factors, 1/s and s.
    """
    friction = modes.shapes.T @ damping_matrix(equations)[0] @ modes.shapes
    rayleigh = per_mass * modes.inverse_squares + per_stiffness * np.ones_like(modes.inverse_squares)
    return Damper(friction + np.diag(rayleigh), ratio)


def receptance(modes: Modes, damping: Damper, frequencies: Array) -> Complex:
    """Return the motion of the tool per unit of a varying wrench on it, rad and m per N·m and N [frequencies x 6 x 6].

    Args:
        modes: modes at the pose.
        damping: the damping of the modes.
        frequencies: Hz [frequencies].
    """
    rates = 2.0 * np.pi * np.asarray(frequencies, dtype=float)[:, None]
    roots = np.sqrt(modes.inverse_squares)  # 1 / omega, s
    diagonal = 1.0 - rates**2 * modes.inverse_squares + 2.0j * damping.ratio * rates * roots
    if not damping.friction.any():
        return np.asarray(np.einsum("ik,fk,jk->fij", modes.tool, 1.0 / diagonal, modes.tool))
    coupled = 1.0j * rates[:, :, None] * damping.friction + diagonal[:, :, None] * np.eye(len(roots))
    tools = np.broadcast_to(modes.tool.T, (len(rates), *modes.tool.T.shape))
    return np.asarray(modes.tool @ np.linalg.solve(coupled, tools))


def along(receptances: Complex, direction: Array) -> Complex:
    """Return the receptance of a point along a direction, m/N [frequencies]: motion along it by a force along it.

    Args:
        receptances: receptances of the point [frequencies x 6 x 6].
        direction: a vector of any length, base axes [3].
    """
    unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    return np.asarray(np.einsum("i,fij,j->f", unit, receptances[:, 3:, 3:], unit))


@dataclass(frozen=True)
class FreeTool:
    """The receptance of a tool with its holder while nothing holds it, as it was measured or computed.

    Attributes:
        frequencies: Hz, ascending [f].
        tip: components of its tip that are known, places in rx ry rz x y z [t].
        flange: components in which it is coupled at its flange, the same way [c].
        tip_tip: motion of the tip per wrench on it, rad and m per N·m and N [f x t x t].
        tip_flange: motion of the tip per wrench on the flange [f x t x c].
        flange_flange: motion of the flange per wrench on it [f x c x c].
    """

    frequencies: Array
    tip: tuple[int, ...]
    flange: tuple[int, ...]
    tip_tip: Complex
    tip_flange: Complex
    flange_flange: Complex

    @property
    def search_frequencies(self) -> Array:
        """Frequencies that are close enough to follow it: its own, and some between them, Hz."""
        between = [self.frequencies[:-1] + share * np.diff(self.frequencies) for share in PARTS_BETWEEN]
        return np.unique(np.concatenate([self.frequencies, *between]))


def couple(machine: Complex, tool: FreeTool, frequencies: Array) -> Complex:
    """Couple a tool to a machine: motion of its tip per wrench on it, rad and m per N·m and N [n x 6 x 6].

    The holder is held at its flange, which is the tool point of the machine: there both move alike and push each other.
    In components that the tool lacks at its tip, the tip is taken to be the flange: motion and wrench are then those of
    the machine there. Receptances are symmetric (Maxwell), so that `tip_flange` serves in both directions.

    Args:
        machine: receptance of the machine at the tool point, base axes [n x 6 x 6].
        tool: the tool; between its frequencies, its receptance follows straight lines.
        frequencies: frequencies within those of the tool, Hz [n].

    Source: theory (108); R. E. D. Bishop and D. C. Johnson, The Mechanics of Vibration (1960); T. L. Schmitz and R. R.
    Donaldson, "Predicting high-speed machining dynamics by substructure analysis", CIRP Annals 49 (2000).
    """
    receptances = tool.tip_tip, tool.tip_flange, tool.flange_flange
    at_tip, across, at_flange = (_interpolate(tool, values, frequencies) for values in receptances)
    tip, flange = list(tool.tip), list(tool.flange)
    others = [part for part in range(6) if part not in tip]
    # Apart, each unit wrench moves the flange of the tool, or that of the machine: forces between both close this gap.
    gaps = np.zeros((len(frequencies), len(flange), 6), dtype=complex)
    gaps[:, :, tip] = across.mT
    gaps[:, :, others] = -machine[:, flange][:, :, others]
    forces = np.linalg.solve(at_flange + machine[:, flange][:, :, flange], gaps)
    result = np.zeros((len(frequencies), 6, 6), dtype=complex)
    for part in others:
        result[:, part, others] = machine[:, part][:, others]
        result[:, part] += np.einsum("fc,fcw->fw", machine[:, part][:, flange], forces)
    for place, part in enumerate(tip):
        result[:, part, tip] = at_tip[:, place]
        result[:, part] -= np.einsum("fc,fcw->fw", across[:, place], forces)
    return result


def _interpolate(tool: FreeTool, values: Complex, frequencies: Array) -> Complex:
    """Return values at frequencies between those of a tool, along straight lines [n x ...]."""
    place = np.clip(np.searchsorted(tool.frequencies, frequencies) - 1, 0, len(tool.frequencies) - 2)
    start, end = tool.frequencies[place], tool.frequencies[place + 1]
    share = ((frequencies - start) / (end - start))[:, None, None]
    return np.asarray((1.0 - share) * values[place] + share * values[place + 1])


@dataclass(frozen=True)
class StateSpaceMatrices:
    """The matrices of a state space: x' = a x + b u, y = c x + d u, with states x, inputs u and outputs y.

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


def state_space(
    modes: Modes, damping: Damper, inputs: Array, outputs: Array, count: int | None = None
) -> StateSpaceMatrices:
    """Write the vibrations of a machine as equations of first order, theory (61) and (62).

    Args:
        modes: modes at the pose.
        damping: damping of the modes.
        inputs: motion in each mode of each point and direction in which a force acts [inputs x m], m or rad per root of
            a joule.
        outputs: motion in each mode of each point and direction whose motion is an output [outputs x m], the same way.
        count: number of the lowest modes that become states; all that have mass if None. The others follow at once,
            without friction, and what they add to the compliance stays in D.
    """
    with_mass = modes.mode_count
    size = with_mass if count is None else min(count, with_mass)
    friction = damping.friction
    creeping, creep, free = _motions_without_mass(friction, with_mass)
    # What follows at once: modes with mass that are no states, and motions without mass that no friction slows.
    direct_inputs, direct_outputs = (
        np.concatenate([rows[:, size:with_mass], rows[:, with_mass:] @ free], axis=1) for rows in (inputs, outputs)
    )
    # Amplitudes are scaled to the kinetic energy by 1 / omega, so that the mass matrix of the modes is 1.
    roots, creep_count = np.sqrt(modes.inverse_squares[:size]), len(creeping)
    coupling = creep.T @ friction[with_mass:, :size] / roots
    by_creep = coupling.T / creeping
    mode_friction = friction[:size, :size] / np.outer(roots, roots) + np.diag(2.0 * damping.ratio / roots)
    mode_forces, creep_forces = inputs[:, :size].T / roots[:, None], creep.T @ inputs[:, with_mass:].T
    rates_by_states = [
        [np.zeros((size, size)), np.eye(size), np.zeros((size, creep_count))],
        [-np.diag(1.0 / roots**2), by_creep @ coupling - mode_friction, by_creep],
        [np.zeros((creep_count, size)), -coupling / creeping[:, None], -np.diag(1.0 / creeping)],
    ]
    rates_by_inputs = [
        np.zeros((size, len(inputs))),
        mode_forces - by_creep @ creep_forces,
        creep_forces / creeping[:, None],
    ]
    outputs_by_states = [
        outputs[:, :size] / roots,
        np.zeros((len(outputs), size)),
        outputs[:, with_mass:] @ creep,
    ]
    states = [f"{kind} of mode {k + 1}" for kind in ("amplitude", "speed") for k in range(size)]
    states += [f"creeping motion {k + 1}" for k in range(creep_count)]
    return StateSpaceMatrices(
        a=np.block(rates_by_states),
        b=np.vstack(rates_by_inputs),
        c=np.hstack(outputs_by_states),
        d=direct_outputs @ direct_inputs.T,
        states=tuple(states),
    )


def _motions_without_mass(friction: Array, with_mass: int) -> tuple[Array, Array, Array]:
    """Split motions without mass along the principal directions of their friction: some creep, the others are free.

    Args:
        friction: friction between the modes [m x m], s.
        with_mass: number of the modes with mass, which come first.

    Returns:
        The friction of each creeping motion, s, from the greatest; their directions, and those of the others, as
        columns over the modes without mass.
    """
    sizes, directions = np.linalg.eigh(friction[with_mass:, with_mass:])
    sizes, directions = sizes[::-1], directions[:, ::-1]
    creeping = sizes[sizes > UNRESISTED * float(np.abs(friction).max())]
    creep, free = np.split(directions, [len(creeping)], axis=1)
    return creeping, creep, free

"""Motion of the tool under a force that varies as a sine: its receptance, with a tool of its own, and unstable cuts.

All motions of the modes carry their part, those without mass as springs do; so the receptance at no frequency is the
compliance.

Source: theory (59), (60) and (108); the limit of a cut, J. Tlusty and M. Polacek (1963). SI, base axes.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.equilibrium.balance import Balance, balance, free_state
from kinetostat.equilibrium.state import MachineState
from kinetostat.frozen import dataclass
from kinetostat.machine.column import stacked_columns
from kinetostat.vibration.modes import Modes, damping_matrix, modes

ASSUMED_RATIO = 0.02
"""Damping ratio of every mode where a file says nothing about damping: that of many machine tools."""
TRIED = 200
"""Frequencies that are tried about each mode, and then about the best of them: that gives 1e-8 of the real part."""
LEAST_RATIO = 1e-9
"""Damping ratio below which a peak is as sharp as this one: then it has no least real part that means anything."""
BANDWIDTHS = 6.0
"""Distance from a mode's frequency, in multiples of its half-power bandwidth."""


@dataclass(frozen=True)
class Damper:
    """Damping of the modes.

    Attributes:
        friction: of joints and rotors, and Rayleigh's damping, between the modes [m x m], s.
        ratio: damping ratio that every mode has besides.
    """

    friction: Array
    ratio: float

    def ratios(self, modes: Modes) -> Array:
        """Damping ratio of each mode with mass, all its damping counted, for light damping [ringing]."""
        count = modes.ringing
        roots = np.sqrt(modes.squares[:count])
        return np.asarray(self.ratio + 0.5 * np.diagonal(self.friction)[:count] / roots)


def damper(equations: Balance, modes: Modes, ratio: float, per_mass: float, per_stiffness: float) -> Damper:
    """The damping of the modes of one pose.

    Args:
        equations: at the state.
        modes: the vibrations of the machine.
        ratio: damping ratio of every mode.
        per_mass, per_stiffness: Rayleigh's factors, 1/s and s.
    """
    friction = modes.shapes.T @ damping_matrix(equations)[0] @ modes.shapes
    rayleigh = per_mass * modes.squares + per_stiffness * np.ones_like(modes.squares)
    return Damper(friction + np.diag(rayleigh), ratio)


def receptance(modes: Modes, damping: Damper, frequencies: Array) -> Complex:
    """Motion of the tool per unit of a varying wrench on it, rad and m per N·m and N [frequencies x 6 x 6].

    Args:
        modes: at the pose.
        damping: the damping of the modes.
        frequencies: Hz [frequencies].
    """
    rates = 2.0 * np.pi * np.asarray(frequencies, dtype=float)[:, None]
    roots = np.sqrt(modes.squares)
    diagonal = 1.0 - rates**2 * modes.squares + 2.0j * damping.ratio * rates * roots
    if not damping.friction.any():
        return np.asarray(np.einsum("ik,fk,jk->fij", modes.tool, 1.0 / diagonal, modes.tool))
    whole = 1.0j * rates[:, :, None] * damping.friction + diagonal[:, :, None] * np.eye(len(roots))
    tools = np.broadcast_to(modes.tool.T, (len(rates), *modes.tool.T.shape))
    return np.asarray(modes.tool @ np.linalg.solve(whole, tools))


def along(receptances: Complex, direction: Array) -> Complex:
    """The receptance of a point in a direction, m/N [frequencies]: of the force along it, the motion along it.

    Args:
        receptances: [frequencies x 6 x 6].
        direction: any length, base axes [3].
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
        between = [self.frequencies[:-1] + share * np.diff(self.frequencies) for share in (0.25, 0.5, 0.75)]
        return np.unique(np.concatenate([self.frequencies, *between]))


def couple(machine: Complex, tool: FreeTool, frequencies: Array) -> Complex:
    """Couple a tool to a machine: motion of its tip per wrench on it, rad and m per N·m and N [n x 6 x 6].

    The holder is held at its flange, which is the tool point of the machine: there both move alike and push each other.
    Components that the tool does not give for its tip are those of the flange, where a wrench then acts on the machine.

    Args:
        machine: receptance at the tool point, base axes [n x 6 x 6].
        tool: between its frequencies, straight lines are followed.
        frequencies: within those of the tool, Hz [n].

    Source: theory (108); R. E. D. Bishop and D. C. Johnson, The Mechanics of Vibration (1960); T. L. Schmitz and R. R.
    Donaldson, "Predicting high-speed machining dynamics by substructure analysis", CIRP Annals 49 (2000).
    """
    receptances = tool.tip_tip, tool.tip_flange, tool.flange_flange
    at_tip, across, at_flange = (_interpolate(tool, values, frequencies) for values in receptances)
    tip, flange = list(tool.tip), list(tool.flange)
    rest = [part for part in range(6) if part not in tip]
    # Apart, each unit wrench moves the flange of the tool, or that of the machine: forces between both close this gap.
    gaps = np.zeros((len(frequencies), len(flange), 6), dtype=complex)
    gaps[:, :, tip] = np.swapaxes(across, 1, 2)
    gaps[:, :, rest] = -machine[:, flange][:, :, rest]
    forces = np.linalg.solve(at_flange + machine[:, flange][:, :, flange], gaps)
    result = np.zeros((len(frequencies), 6, 6), dtype=complex)
    for part in rest:
        result[:, part, rest] = machine[:, part][:, rest]
        result[:, part] += np.einsum("fc,fcw->fw", machine[:, part][:, flange], forces)
    for place, part in enumerate(tip):
        result[:, part, tip] = at_tip[:, place]
        result[:, part] -= np.einsum("fc,fcw->fw", across[:, place], forces)
    return result


def _interpolate(tool: FreeTool, values: Complex, frequencies: Array) -> Any:
    """Values at frequencies between those of a tool, along straight lines [n x ...]."""
    place = np.clip(np.searchsorted(tool.frequencies, frequencies) - 1, 0, len(tool.frequencies) - 2)
    start, end = tool.frequencies[place], tool.frequencies[place + 1]
    share = ((frequencies - start) / (end - start))[:, None, None]
    return (1.0 - share) * values[place] + share * values[place + 1]


@dataclass(frozen=True)
class Softest:
    """Least real part of a receptance, and its frequency.

    Attributes:
        frequency: Hz.
        real: the least real part, m/N; it is negative unless nothing rings.
    """

    frequency: float
    real: float

    def depth(self, pressure: float) -> float:
        """Width of cut up to which every spindle speed is stable, m; infinite where nothing rings.

        Args:
            pressure: cutting force per area of the chip, N/m².
        """
        return -0.5 / (pressure * self.real) if self.real < 0.0 and pressure else float("inf")


def least_real_part(modes: Modes, damping: Damper, direction: Array) -> Softest:
    """Find where the receptance along a direction has its least real part: near one of the modes, a little above it."""
    tried = [np.zeros(1)]
    spread = np.linspace(-BANDWIDTHS, BANDWIDTHS, TRIED)
    for frequency, ratio in zip(modes.frequencies, damping.ratios(modes), strict=True):
        tried.append(frequency * np.abs(1.0 + max(float(ratio), LEAST_RATIO) * spread))
    return softest_of(
        lambda given: along(receptance(modes, damping, given), direction), np.unique(np.concatenate(tried))
    )


def softest_of(response: Callable[[Array], Complex], tried: Array) -> Softest:
    """Find where a response has its least real part: at the frequencies that are tried, then closer about the best.

    Args:
        response: motion per force at frequencies, m/N [n].
        tried: frequencies, Hz, ascending.
    """
    near = int(np.argmin(response(tried).real))
    fine = np.linspace(tried[max(near - 1, 0)], tried[min(near + 1, len(tried) - 1)], TRIED)
    lowest = int(np.argmin(response(fine).real))
    return Softest(float(fine[lowest]), float(response(fine[lowest : lowest + 1]).real[0]))


def cut_receptances(state: MachineState) -> Array:
    """The least real part of the receptance across the cut at n poses, m/N [n]; NaN where nothing holds the machine.

    Poses are taken in turn: a few milliseconds each.

    Args:
        state: of a machine with its tables [cutting] and [damping], at n poses.
    """
    machine, mechanism, count = state.machine, state.free_equations.mechanism, state.count
    table, result = machine.tables["damping"], np.full(count, np.nan)
    directions = stacked_columns(machine.tables["cutting"].direction, count)
    damping = stacked_columns([table.ratio, table.per_mass, table.per_stiffness], count)
    for row in range(count):
        here = mechanism.at(np.array([row]))
        equations = balance(here, free_state(here))
        solution = modes(equations)
        if solution is not None:
            ratio, per_mass, per_stiffness = damping[row]
            friction = any(leg.dampers.any() for leg in here.legs)
            ratio = ratio if friction or damping[row].any() else ASSUMED_RATIO
            damped = damper(equations, solution, ratio, per_mass, per_stiffness)
            result[row] = least_real_part(solution, damped, directions[row]).real
    return result

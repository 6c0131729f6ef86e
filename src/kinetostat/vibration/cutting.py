"""The width of cut at which a tool begins to chatter: at any speed of its spindle, and over the speed (lobes).

An edge cuts the surface that the edge before it has left. The chip is as thick as both paths differ, and the force
grows with it, so that a wave of one edge can raise a larger wave of the next: chatter. Where one edge stays in the cut,
the width up to which every speed is stable follows from the least real part of the receptance across the cut. In
milling, edges turn through the cut, and the force per difference of the paths is replaced by its mean over a turn.

Source: theory (60), (106) and (107); J. Tlusty and M. Polacek (1963) for one edge that stays in the cut; Y. Altintas
and E. Budak, "Analytical prediction of stability lobes in milling", CIRP Annals 44 (1995), for milling. SI.
"""

import math
from collections.abc import Callable

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.equilibrium.balance import balance, free_state
from kinetostat.equilibrium.state import MachineState
from kinetostat.frozen import dataclass
from kinetostat.machine.column import stacked_columns
from kinetostat.vibration.modes import Modes, modes
from kinetostat.vibration.receptance import ASSUMED_RATIO, Damper, along, damper, receptance

LEAST_RATIO = 1e-9
"""Damping ratio below which a peak is taken to be as sharp as this one: frequencies about it would coincide."""
LIMIT_FREQUENCIES = 200
"""Number of frequencies that are tried about each mode for the least real part, and again about the best of them: that
gives 1e-8 of it."""
LIMIT_BANDWIDTHS = 6.0
"""Their greatest distance from the mode in half-power bandwidths; the least real part of a lone mode is half of one
above it."""
LOBE_FREQUENCIES = 600
"""Number of frequencies that are tried about each mode for lobes, between which borders are straight."""
LOBE_BANDWIDTHS = 12.0
"""Their greatest distance from the mode in half-power bandwidths; beyond it `RANGE_FREQUENCIES` are close enough."""
RANGE_FREQUENCIES = 3000
"""Number of frequencies that are tried over the whole range besides."""
LOWEST_SHARE = 0.2
"""Lowest frequency that is tried, as a share of the lowest mode's: below it the machine follows like a spring."""
HIGHEST_RATIO = 5.0
"""Highest frequency that is tried, in multiples of the highest mode's: beyond it masses hardly move."""
MOST_LOBES = 2000
"""Waves between two edges up to which lobes are followed; further ones lie below the speeds that are asked for."""


@dataclass(frozen=True)
class LeastRealPart:
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


def _frequencies_about(frequencies: Array, ratios: Array, bandwidths: float, count: int) -> list[Array]:
    """Return frequencies about each mode, Hz, so many of them and up to so many half-power bandwidths from it."""
    spread = np.linspace(-bandwidths, bandwidths, count)
    return [f * np.abs(1.0 + max(float(r), LEAST_RATIO) * spread) for f, r in zip(frequencies, ratios, strict=True)]


def least_real_part(modes: Modes, damping: Damper, direction: Array) -> LeastRealPart:
    """Find where the receptance along a direction has its least real part: near one of the modes, a little above it."""
    about_modes = _frequencies_about(modes.frequencies, damping.ratios(modes), LIMIT_BANDWIDTHS, LIMIT_FREQUENCIES)
    return least_real_part_of(
        lambda frequencies: along(receptance(modes, damping, frequencies), direction),
        np.unique(np.concatenate([np.zeros(1), *about_modes])),
    )


def least_real_part_of(response: Callable[[Array], Complex], frequencies: Array) -> LeastRealPart:
    """Find where a response has its least real part: at some frequencies, then at closer ones about the best of these.

    Args:
        response: motion per force at frequencies, m/N [n].
        frequencies: Hz, ascending.
    """
    near = int(np.argmin(response(frequencies).real))
    ends = frequencies[max(near - 1, 0)], frequencies[min(near + 1, len(frequencies) - 1)]
    close = np.linspace(*ends, LIMIT_FREQUENCIES)
    lowest = int(np.argmin(response(close).real))
    return LeastRealPart(float(close[lowest]), float(response(close[lowest : lowest + 1]).real[0]))


def cut_receptances(state: MachineState) -> Array:
    """Return the least real part of the receptance across the cut at n poses, m/N [n]; NaN where nothing holds it.

    Poses are taken in turn: a few milliseconds each.

    Args:
        state: the state of a machine with its tables [cutting] and [damping], at n poses.
    """
    machine, mechanism, count = state.machine, state.free_equations.mechanism, state.count
    table, result = machine.tables["damping"], np.full(count, np.nan)
    directions = stacked_columns(machine.tables["cutting"].direction, count)
    damping = stacked_columns([table.ratio, table.per_mass, table.per_stiffness], count)
    for row in range(count):
        placed = mechanism.at(np.array([row]))
        equations = balance(placed, free_state(placed))
        solution = modes(equations)
        if solution is not None:
            ratio, per_mass, per_stiffness = damping[row]
            has_friction = any(leg.dampers.any() for leg in placed.legs)
            ratio = ratio if has_friction or damping[row].any() else ASSUMED_RATIO
            modal_damping = damper(equations, solution, ratio, per_mass, per_stiffness)
            result[row] = least_real_part(solution, modal_damping, directions[row]).real
    return result


@dataclass(frozen=True)
class Engagement:
    """Edges in the cut, and the force with which they answer a difference of their paths.

    Attributes:
        teeth: number of edges that pass in a turn of the spindle.
        pressure: tangential force per area of the chip, N/m².
        directions: unit vectors along which paths of edges differ, base axes [k x 3].
        mean_force: mean of the force per pressure, width of cut, and difference of paths, in these directions [k x k].
    """

    teeth: int
    pressure: float
    directions: Array
    mean_force: Array


def turning(pressure: float, direction: Array) -> Engagement:
    """Return the engagement of one edge that stays in the cut; it is pushed back across it where the chip is too thick.

    Args:
        pressure: cutting force per area of the chip, N/m².
        direction: across the cut, unit vector in base axes [3].
    """
    return Engagement(1, pressure, direction[None], np.array([[-1.0]]))


def milling(
    pressure: float, radial: float, teeth: int, entry: float, leaving: float, feed: Array, spindle: Array
) -> Engagement:
    """Return the engagement of edges that turn through the cut.

    Args:
        pressure: tangential force per area of the chip, N/m².
        radial: radial force as a share of the tangential one.
        teeth: number of edges, at equal angles.
        entry, leaving: angles at which an edge enters and leaves the cut, rad, from the normal to the feed in the sense
            of the rotation: 0 to pi is a slot, 0 to pi/2 half of it in up milling, pi/2 to pi in down milling.
        feed: direction of the feed, unit vector in base axes [3].
        spindle: axis of the spindle, from the workpiece to the machine, at right angles to the feed [3].
    """
    # The force on an edge is integrated from entry to exit; these are the integrals over the angle, without 1/2.
    angles = np.array([entry, leaving])
    cosine, sine = np.cos(2.0 * angles), np.sin(2.0 * angles)
    integrals = [
        [cosine - 2.0 * radial * angles + radial * sine, -sine - 2.0 * angles + radial * cosine],
        [-sine + 2.0 * angles + radial * cosine, -cosine - 2.0 * radial * angles - radial * sine],
    ]
    factors = np.array([[0.5 * (value[1] - value[0]) for value in row] for row in integrals])
    return Engagement(teeth, pressure, np.stack([feed, np.cross(spindle, feed)]), teeth / (4.0 * math.pi) * factors)


def tried_frequencies(frequencies: Array, ratios: Array) -> Array:
    """Return the frequencies at which chatter is looked for, Hz: close together about each mode [n].

    Args:
        frequencies: natural frequencies, Hz, ascending.
        ratios: damping ratios of the modes.
    """
    about_modes = _frequencies_about(frequencies, ratios, LOBE_BANDWIDTHS, LOBE_FREQUENCIES)
    whole_range = np.geomspace(LOWEST_SHARE * frequencies[0], HIGHEST_RATIO * frequencies[-1], RANGE_FREQUENCIES)
    return np.unique(np.concatenate([*about_modes, whole_range]))


@dataclass(frozen=True)
class Borders:
    """Widths of cut beyond which a tool chatters.

    Attributes:
        frequencies: frequencies of the chatter, Hz [n].
        widths: widths of cut, m; NaN where no width chatters so [n x k].
        phases: angle by which the wave of an edge is behind that of the edge before it, rad, from 0 to 2 pi [n x k].
        teeth: number of edges that pass in a turn.
    """

    frequencies: Array
    widths: Array
    phases: Array
    teeth: int

    @property
    def least(self) -> tuple[float, float]:
        """Return the width of cut up to which every speed is stable, m, and the frequency of chatter beyond it, Hz."""
        if not np.isfinite(self.widths).any():
            return math.inf, math.nan
        place = np.unravel_index(np.nanargmin(self.widths), self.widths.shape)
        return float(self.widths[place]), float(self.frequencies[place[0]])

    def widths_at(self, speeds: Array) -> Array:
        """Return the width of cut up to which each speed of the spindle is stable, m; infinite where all are [n].

        Args:
            speeds: turns per second, ascending [n].
        """
        result = np.full(len(speeds), np.inf)
        for widths, phases in zip(self.widths.T, self.phases.T, strict=True):
            fastest = float(np.nanmax(self.frequencies)) / (self.teeth * float(speeds[0]))
            for waves in range(min(int(fastest) + 1, MOST_LOBES)):
                turns = self.frequencies / (self.teeth * (waves + phases / (2.0 * math.pi)))
                _lower_to_curve(result, speeds, turns, widths)
        return result


def _lower_to_curve(result: Array, speeds: Array, turns: Array, widths: Array) -> None:
    """Lower the stable width at each speed to a curve, where the curve is lower; it is straight between its points.

    Args:
        result: stable widths so far, which are changed in place [n].
        speeds: turns per second, ascending [n].
        turns, widths: points of the curve, turns per second and m; NaN where it is interrupted.
    """
    start, end, start_width, end_width = turns[:-1], turns[1:], widths[:-1], widths[1:]
    is_whole = np.isfinite(start_width) & np.isfinite(end_width) & np.isfinite(start) & np.isfinite(end)
    first = np.searchsorted(speeds, np.where(is_whole, np.minimum(start, end), np.inf))
    last = np.searchsorted(speeds, np.where(is_whole, np.maximum(start, end), np.inf), side="right")
    # Each piece of the curve is above the speeds `first` to `last`: both lists name each pair of piece and speed once.
    counts = np.maximum(last - first, 0)
    pieces = np.repeat(np.arange(len(counts)), counts)
    if not len(pieces):
        return
    places = np.arange(len(pieces)) - np.repeat(np.cumsum(counts) - counts, counts) + first[pieces]
    length = (end - start)[pieces]
    share = np.where(length != 0.0, (speeds[places] - start[pieces]) / np.where(length != 0.0, length, 1.0), 0.0)
    np.minimum.at(result, places, start_width[pieces] + share * (end_width - start_width)[pieces])


def borders(receptances: Complex, frequencies: Array, engagement: Engagement) -> Borders:
    """Find the widths of cut that begin to chatter at given frequencies.

    Args:
        receptances: receptances of the tool point, m/N, base axes [n x 3 x 3].
        frequencies: Hz, ascending [n].
        engagement: the edges in the cut.
    """
    directions = engagement.directions
    oriented = np.einsum("ia,fab,jb->fij", directions, receptances, directions)
    gains = engagement.pressure * np.linalg.eigvals(engagement.mean_force @ oriented)
    # Each column shall follow one eigenvalue over the frequencies: two are exchanged where that continues them better.
    if gains.shape[1] == 2:
        for n in range(1, len(gains)):
            if abs(gains[n, 0] - gains[n - 1, 0]) > abs(gains[n, 1] - gains[n - 1, 0]):
                gains[n] = gains[n, ::-1]
    inverse = 1.0 / gains
    growing = inverse.real > 0.0
    widths = np.where(growing, np.abs(inverse) ** 2 / (2.0 * np.where(growing, inverse.real, 1.0)), np.nan)
    phases = 2.0 * np.arctan2(inverse.real, inverse.imag)
    return Borders(frequencies, widths, np.where(growing, phases, np.nan), engagement.teeth)

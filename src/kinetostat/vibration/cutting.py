"""The width of cut at which a tool begins to chatter, over the speed of its spindle: stability lobes.

An edge cuts the surface that the edge before it has left. The chip is as thick as both paths differ, and the force
grows with it, so that a wave of one edge can raise a larger wave of the next: chatter. In milling, edges turn through
the cut, and the force per difference of the paths is replaced by its mean over a turn.

Source: theory (106) and (107); J. Tlusty and M. Polacek (1963) for one edge that stays in the cut; Y. Altintas and
E. Budak, "Analytical prediction of stability lobes in milling", CIRP Annals 44 (1995), for milling. SI.
"""

import math

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.frozen import dataclass

TRIED_PER_MODE, BANDWIDTHS = 600, 12.0
"""Number of frequencies that are tried about each mode, and their greatest distance from it in half-power
bandwidths."""
TRIED_OVER_RANGE = 3000
"""Number of frequencies that are tried over the whole range besides."""
LEAST_RATIO = 1e-9
"""Damping ratio below which a peak is taken to be as sharp as this one."""
MOST_LOBES = 2000
"""Waves between two edges up to which lobes are followed; further ones lie below the speeds that are asked for."""


@dataclass(frozen=True)
class Engagement:
    """Edges in the cut, and the force with which they answer a difference of their paths.

    Attributes:
        teeth: number of edges that pass in a turn of the spindle.
        pressure: tangential force per area of the chip, N/m².
        ways: unit vectors along which paths of edges differ, base axes [k x 3].
        mean: mean of the force per pressure, width of cut, and difference of paths, in the same directions [k x k].
    """

    teeth: int
    pressure: float
    ways: Array
    mean: Array


def turning(pressure: float, direction: Array) -> Engagement:
    """One edge that stays in the cut, and is pushed back across it where the chip is too thick.

    Args:
        pressure: cutting force per area of the chip, N/m².
        direction: across the cut, unit vector in base axes [3].
    """
    return Engagement(1, pressure, direction[None], np.array([[-1.0]]))


def milling(
    pressure: float, radial: float, teeth: int, entry: float, leaving: float, feed: Array, spindle: Array
) -> Engagement:
    """Edges that turn through the cut.

    Args:
        pressure: tangential force per area of the chip, N/m².
        radial: radial force as a share of the tangential one.
        teeth: number of edges, at equal angles.
        entry, leaving: angles at which an edge enters and leaves the cut, rad, from the normal to the feed in the sense
            of the rotation: 0 to pi is a slot, 0 to pi/2 half of it in up milling, pi/2 to pi in down milling.
        feed: direction of the feed, unit vector in base axes [3].
        spindle: axis of the spindle, from the workpiece to the machine, at right angles to the feed [3].
    """
    ends = np.array([entry, leaving])
    double, single = np.cos(2.0 * ends), np.sin(2.0 * ends)
    primitives = [
        [double - 2.0 * radial * ends + radial * single, -single - 2.0 * ends + radial * double],
        [-single + 2.0 * ends + radial * double, -double - 2.0 * radial * ends - radial * single],
    ]
    factors = np.array([[0.5 * (value[1] - value[0]) for value in row] for row in primitives])
    return Engagement(teeth, pressure, np.stack([feed, np.cross(spindle, feed)]), teeth / (4.0 * math.pi) * factors)


def tried_frequencies(frequencies: Array, ratios: Array) -> Array:
    """Frequencies at which chatter is looked for, Hz: close together about each mode [n].

    Args:
        frequencies: of the modes, Hz, ascending.
        ratios: their damping ratios.
    """
    spread = np.linspace(-BANDWIDTHS, BANDWIDTHS, TRIED_PER_MODE)
    rows = [f * np.abs(1.0 + max(float(r), LEAST_RATIO) * spread) for f, r in zip(frequencies, ratios, strict=True)]
    rows.append(np.geomspace(0.2 * frequencies[0], 5.0 * frequencies[-1], TRIED_OVER_RANGE))
    return np.unique(np.concatenate(rows))


@dataclass(frozen=True)
class Borders:
    """Widths of cut beyond which a tool chatters.

    Attributes:
        frequencies: of the chatter, Hz [n].
        widths: of cut, m; NaN where no width chatters so [n x k].
        phases: by which the wave of an edge is behind that of the edge before it, rad, from 0 to 2 pi [n x k].
        teeth: number of edges that pass in a turn.
    """

    frequencies: Array
    widths: Array
    phases: Array
    teeth: int

    @property
    def least(self) -> tuple[float, float]:
        """Width of cut up to which every speed is stable, m, and the frequency of the chatter beyond it, Hz."""
        if not np.isfinite(self.widths).any():
            return math.inf, math.nan
        place = np.unravel_index(np.nanargmin(self.widths), self.widths.shape)
        return float(self.widths[place]), float(self.frequencies[place[0]])

    def widths_at(self, speeds: Array) -> Array:
        """The width of cut up to which each speed of the spindle is stable, m; infinite where all are [n].

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
    start, end, low, high = turns[:-1], turns[1:], widths[:-1], widths[1:]
    known = np.isfinite(low) & np.isfinite(high) & np.isfinite(start) & np.isfinite(end)
    first = np.searchsorted(speeds, np.where(known, np.minimum(start, end), np.inf))
    last = np.searchsorted(speeds, np.where(known, np.maximum(start, end), np.inf), side="right")
    counts = np.maximum(last - first, 0)
    pieces = np.repeat(np.arange(len(counts)), counts)
    if not len(pieces):
        return
    places = np.arange(len(pieces)) - np.repeat(np.cumsum(counts) - counts, counts) + first[pieces]
    size = (end - start)[pieces]
    share = np.where(size != 0.0, (speeds[places] - start[pieces]) / np.where(size != 0.0, size, 1.0), 0.0)
    np.minimum.at(result, places, low[pieces] + share * (high - low)[pieces])


def borders(receptances: Complex, frequencies: Array, engagement: Engagement) -> Borders:
    """Find the widths of cut that begin to chatter at given frequencies.

    Args:
        receptances: of the tool point, m/N, base axes [n x 3 x 3].
        frequencies: Hz, ascending [n].
        engagement: of the edges.
    """
    ways = engagement.ways
    oriented = np.einsum("ia,fab,jb->fij", ways, receptances, ways)
    gains = engagement.pressure * np.linalg.eigvals(engagement.mean @ oriented)
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

"""Moves from rest to rest: lines and arcs between poses, and profiles of the speed on them, of three or seven phases.

They know coordinates and lengths; machines and files are in `motions`.

Source: theory (97) and (98).
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass

STRAIGHT = 1e-9
"""Sine of the angle between two chords of an arc below which it is a straight line."""


@dataclass(frozen=True)
class Curve:
    """A line or an arc in the coordinates of the pose, by the length on the path.

    Attributes:
        start, end: values of all coordinates.
        length: length of the path of P or, of turns alone, of a point at the machine's length from their axis, m.
        arc: centre, two vectors of the size of its radius, and its angle, of the coordinates at `places`; None of a
            line.
        places: which coordinates are those of P.
        middle: length at which an arc passes the point through which it leads; None of a line.
    """

    start: Array
    end: Array
    length: float
    places: tuple[int, ...]
    arc: tuple[Array, Array, Array, float] | None = None
    middle: float | None = None

    def at(self, lengths: Array) -> tuple[Array, Array, Array]:
        """Coordinates with their first and second derivatives by the length [n x coordinates]."""
        share = (lengths / self.length)[:, None]
        slope = np.broadcast_to((self.end - self.start) / self.length, (len(lengths), len(self.start))).copy()
        place, bend = self.start + (self.end - self.start) * share, np.zeros_like(slope)
        if self.arc is not None:
            centre, first, second, angle = self.arc
            turned, rate = share * angle, angle / self.length
            at, across = (
                np.cos(turned) * first + np.sin(turned) * second,
                np.cos(turned) * second - np.sin(turned) * first,
            )
            place[:, self.places], slope[:, self.places], bend[:, self.places] = (
                centre + at,
                across * rate,
                -at * rate**2,
            )
        return place, slope, bend


def curve_between(table: Array, start: int, end: int, places: Sequence[int], size: float, round_: bool) -> Curve:
    """The line from a pose of a table to another one, or the arc through the pose before the other one.

    Args:
        table: coordinates of the poses [n x coordinates].
        start, end: rows of the table.
        places: which coordinates are those of P.
        size: the machine's length, m.
        round_: whether it is an arc; where the three points are in a line, it is that line.
    """
    first, last = table[start], table[end]
    chord = last[places] - first[places]
    length = float(np.linalg.norm(chord))
    arc, middle = None, None
    if round_ and (circle := _arc(first[places], table[end - 1][places], last[places])):
        arc, turned_at_middle = circle
        radius = float(np.linalg.norm(arc[1]))
        length, middle = radius * arc[3], radius * turned_at_middle
    turned = float(np.linalg.norm(np.delete(last - first, places)))
    return Curve(first, last, length or turned * size, tuple(places), arc, middle)


def _arc(start: Array, middle: Array, end: Array) -> tuple[tuple[Array, Array, Array, float], float] | None:
    """The circle through three points from the first to the last, and the angle of the second; None where straight."""
    along, across = middle - start, end - start
    sizes = along @ along, across @ across
    both = along @ across
    square = sizes[0] * sizes[1] - both * both
    if square <= STRAIGHT**2 * sizes[0] * sizes[1]:
        return None
    centre = start + (
        (sizes[0] * sizes[1] - sizes[1] * both) * along + (sizes[0] * sizes[1] - sizes[0] * both) * across
    ) / (2.0 * square)
    first = start - centre
    radius = np.linalg.norm(first)
    side = along - (along @ first) / radius**2 * first
    second = side / np.linalg.norm(side) * radius
    turns = [np.arctan2((p - centre) @ second, (p - centre) @ first) % (2.0 * np.pi) for p in (middle, end)]
    if turns[0] > turns[1]:
        second, turns = -second, [2.0 * np.pi - turn for turn in turns]
    return (centre, first, second, float(turns[1])), float(turns[0])


def profile(length: float, feed: float, acceleration: float, jerk: float = np.inf) -> list[tuple[float, float, float]]:
    """The phases of a move from rest to rest: duration (s), and acceleration at both ends of each, theory (98).

    Args:
        length: length of the path, m.
        feed, acceleration, jerk: greatest values along it; an infinite jerk leaves three phases of seven.
    """
    if np.isinf(jerk):
        speed = min(feed, np.sqrt(length * acceleration))
        rise, cruise = speed / acceleration, length / speed - speed / acceleration
        return [(rise, acceleration, acceleration), (cruise, 0.0, 0.0), (rise, -acceleration, -acceleration)]
    speed = np.cbrt(length**2 * jerk / 4.0)
    if speed * jerk > acceleration**2:
        lag = acceleration**2 / jerk
        speed = 0.5 * (np.sqrt(lag**2 + 4.0 * acceleration * length) - lag)
    speed = min(feed, float(speed))
    grows = acceleration / jerk if speed * jerk > acceleration**2 else float(np.sqrt(speed / jerk))
    most = jerk * grows
    holds = max(speed / most - grows, 0.0)
    cruise = max(length / speed - (2.0 * grows + holds), 0.0)
    rise = [(grows, 0.0, most), (holds, most, most), (grows, most, 0.0)]
    return [*rise, (cruise, 0.0, 0.0), *((time, -a, -b) for time, a, b in rise)]


def along_profile(
    phases: Sequence[tuple[float, float, float]], points: int
) -> tuple[Array, tuple[Array, Array, Array]]:
    """Times (s) in all phases, so many in each with both of its ends, and length, speed and acceleration then."""
    times, lengths, speeds, gains = [], [], [], []
    clock = at = speed = 0.0
    for duration, first, last in phases:
        if duration <= 0.0:
            continue
        time = np.linspace(0.0, duration, points)
        jerk = (last - first) / duration
        gains.append(first + jerk * time)
        speeds.append(speed + first * time + jerk * time**2 / 2.0)
        lengths.append(at + speed * time + first * time**2 / 2.0 + jerk * time**3 / 6.0)
        times.append(clock + time)
        clock, at, speed = clock + duration, float(lengths[-1][-1]), float(speeds[-1][-1])
    return np.concatenate(times), (np.concatenate(lengths), np.concatenate(speeds), np.concatenate(gains))


def moment_at(phases: Sequence[tuple[float, float, float]], length: float) -> float:
    """The time at which a move has come so far, s.

    Args:
        phases: phases of the move, see `profile`.
        length: between 0 and that of its path, m.
    """
    clock = at = speed = 0.0
    for duration, first, last in phases:
        if duration <= 0.0:
            continue
        way = Polynomial([at - length, speed, first / 2.0, (last - first) / (6.0 * duration)])
        if way(duration) >= 0.0:
            return clock + float(brentq(way, 0.0, duration, xtol=1e-15))
        at, speed = float(way(duration)) + length, float(way.deriv()(duration))
        clock += duration
    return clock

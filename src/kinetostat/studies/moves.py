"""Moves from rest to rest: lines and arcs between poses, and profiles of the speed on them, of three or seven phases.

They know coordinates and lengths; machines and files are in `motions`.

Source: theory (97) and (98).
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.spec.errors import InputError

Phases = list[tuple[float, float, float]]
"""Phases of a move: duration, s, and the acceleration at the begin and at the end of each, m/s²."""

STRAIGHT = 1e-9
"""Sine of the angle between two chords of an arc below which it is a straight line."""
ROUND_OFF_OF_TIME = 1e-15
"""Error of the time at which a point is passed, s: the round-off of a move of some seconds."""


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

    def in_time(self, lengths: Array, speeds: Array, accelerations: Array) -> tuple[Array, Array, Array]:
        """Coordinates with their rates and accelerations [n x coordinates], by the length, m, and its rates [n]."""
        place, slope, bend = self.at(lengths)
        return place, slope * speeds[:, None], bend * speeds[:, None] ** 2 + slope * accelerations[:, None]


@dataclass(frozen=True)
class Move:
    """A move from rest to rest.

    Attributes:
        start, end: rows of its first and its last pose in the table; an arc leads through the row between them.
        curve: the line or the arc.
    """

    start: int
    end: int
    curve: Curve

    def moments(self, phases: Phases) -> list[float]:
        """The times, s, at which it is at the poses of its rows, from its start.

        Raises:
            InputError: the point between its ends is in line with these, so that nobody can say when it is passed.
        """
        duration = sum(time for time, _, _ in phases if time > 0.0)
        if self.end - self.start == 1:
            return [0.0, duration]
        if self.curve.middle is None:
            raise InputError(
                "the point through which an arc leads is in line with its ends, so that no moment belongs to the "
                "forces there; write that arc as a line."
            )
        return [0.0, moment_at(phases, self.curve.middle), duration]


def moves_between(table: Array, shapes: Sequence[str], places: Sequence[int], size: float) -> list[Move]:
    """The moves from pose to pose of a table, without those that lead nowhere.

    Args:
        table: coordinates of the poses [n x coordinates].
        shapes: of each row: "line" or "arc" leads to it, "through" is a point of the next arc.
        places, size: see `curve_between`.

    Raises:
        InputError: there is only one pose, or nothing moves.
    """
    ends = [row for row, shape in enumerate(shapes) if shape != "through"]
    if len(ends) < 2:
        raise InputError("it has only one pose; give the pose where the motion begins and those to which it moves.")
    pairs = [(start, end) for start, end in pairwise(ends) if np.abs(table[end] - table[start]).max() > 0.0]
    if not pairs:
        raise InputError("all of its poses are alike, so that nothing moves; change a coordinate from line to line.")
    return [
        Move(start, end, curve_between(table, start, end, places, size, shapes[end] == "arc")) for start, end in pairs
    ]


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


def profile(length: float, feed: float, acceleration: float, jerk: float = np.inf) -> Phases:
    """The phases of a move from rest to rest, theory (98).

    The speed is the greatest that can be reached and left again on this length, at most the feed rate. The acceleration
    grows and falls with the jerk, and holds between, if it comes to its limit.

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
    growing = acceleration / jerk if speed * jerk > acceleration**2 else float(np.sqrt(speed / jerk))
    peak = jerk * growing
    holding = max(speed / peak - growing, 0.0)
    cruise = max(length / speed - (2.0 * growing + holding), 0.0)
    rise = [(growing, 0.0, peak), (holding, peak, peak), (growing, peak, 0.0)]
    return [*rise, (cruise, 0.0, 0.0), *((time, -a, -b) for time, a, b in rise)]


def along_profile(phases: Phases, points: int) -> tuple[Array, tuple[Array, Array, Array]]:
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


def moment_at(phases: Phases, length: float) -> float:
    """The time at which a move has come so far, s.

    Args:
        phases: phases of the move, see `profile`.
        length: between 0 and that of its path, m.
    """
    clock = at = speed = 0.0
    for duration, first, last in phases:
        if duration <= 0.0:
            continue
        remaining = Polynomial([at - length, speed, first / 2.0, (last - first) / (6.0 * duration)])
        if remaining(duration) >= 0.0:
            return clock + float(brentq(remaining, 0.0, duration, xtol=ROUND_OFF_OF_TIME))
        at, speed = float(remaining(duration)) + length, float(remaining.deriv()(duration))
        clock += duration
    return clock

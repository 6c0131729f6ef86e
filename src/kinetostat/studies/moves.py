"""Moves from rest to rest: lines and arcs between poses, and profiles of the speed on them, of three or seven phases.

They know coordinates and lengths; machines and files are in `motions`.

Source: theory (97) and (98).
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.spec.errors import InputError

STRAIGHT = 1e-9
"""Sine of the angle between two chords of an arc below which it is a straight line: with eight digits of a chord, the
circle through its points has none."""
ROUND_OFF_OF_TIME = 1e-15
"""Error of the time at which a point is passed, s: the round-off of a move of some seconds."""


class Phase(NamedTuple):
    """A part of a move whose acceleration changes evenly.

    Attributes:
        duration: s, more than 0.
        first, last: acceleration at its beginning and at its end, m/s².
    """

    duration: float
    first: float
    last: float


Phases: TypeAlias = list[Phase]
"""All parts of a move, in order."""


class LengthInTime(NamedTuple):
    """The length that a move has covered over time.

    Attributes:
        times: times from its start, s [n].
        lengths, speeds, accelerations: the covered length and its rates, m, m/s and m/s² [n].
    """

    times: Array
    lengths: Array
    speeds: Array
    accelerations: Array


@dataclass(frozen=True)
class Arc:
    """A part of a circle: centre + cos a first + sin a second, for a from 0 to its angle.

    Attributes:
        centre: the centre.
        first, second: two vectors at right angles, each as long as the radius; `first` leads to the beginning.
        angle: angle of the end, rad.
        middle: angle of the point through which the arc leads, rad.
    """

    centre: Array
    first: Array
    second: Array
    angle: float
    middle: float

    @property
    def radius(self) -> float:
        """The radius, m."""
        return float(np.linalg.norm(self.first))


@dataclass(frozen=True)
class Curve:
    """A line or an arc in the coordinates of the pose, by the length on the path.

    Attributes:
        start, end: values of all coordinates.
        length: length of the path of P or, of turns alone, of a point at the machine's length from their axis, m.
        places: numbers of the coordinates of P.
        arc: the arc in the coordinates of P; None of a line.
    """

    start: Array
    end: Array
    length: float
    places: tuple[int, ...]
    arc: Arc | None = None

    def at(self, lengths: Array) -> tuple[Array, Array, Array]:
        """Coordinates with their first and second derivatives by the length [n x coordinates]."""
        share = (lengths / self.length)[:, None]
        slope = np.broadcast_to((self.end - self.start) / self.length, (len(lengths), len(self.start))).copy()
        place, curvature = self.start + (self.end - self.start) * share, np.zeros_like(slope)
        if self.arc is not None:
            angle, rate = share * self.arc.angle, self.arc.angle / self.length
            outward = np.cos(angle) * self.arc.first + np.sin(angle) * self.arc.second
            onward = np.cos(angle) * self.arc.second - np.sin(angle) * self.arc.first
            place[:, self.places] = self.arc.centre + outward
            slope[:, self.places] = onward * rate
            curvature[:, self.places] = -outward * rate**2
        return place, slope, curvature

    def in_time(self, covered: LengthInTime) -> tuple[Array, Array, Array]:
        """Coordinates with their rates and accelerations while a length is covered [n x coordinates]."""
        place, slope, curvature = self.at(covered.lengths)
        speeds = covered.speeds[:, None]
        return place, slope * speeds, curvature * speeds**2 + slope * covered.accelerations[:, None]


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
        duration = sum(phase.duration for phase in phases)
        if self.end - self.start == 1:
            return [0.0, duration]
        if self.curve.arc is None:
            raise InputError(
                "the point through which an arc leads is in line with its ends, so that no moment belongs to the "
                "forces there; write that arc as a line."
            )
        return [0.0, moment_at(phases, self.curve.arc.radius * self.curve.arc.middle), duration]


def moves_between(table: Array, shapes: Sequence[str], places: Sequence[int], size: float) -> list[Move]:
    """The moves from pose to pose of a table, without those that lead nowhere.

    Args:
        table: coordinates of the poses [n x coordinates].
        shapes: shape of each row: "line" or "arc" leads to it, "through" is a point of the next arc.
        places: numbers of the coordinates of P.
        size: the machine's length, m, at which turns alone have a path.

    Raises:
        InputError: there is only one pose, or nothing moves.
    """
    ends = [row for row, shape in enumerate(shapes) if shape != "through"]
    if len(ends) < 2:
        raise InputError("it has only one pose; give the pose where the motion begins and those to which it moves.")
    pairs = [(start, end) for start, end in pairwise(ends) if np.abs(table[end] - table[start]).max() > 0.0]
    if not pairs:
        raise InputError("all of its poses are alike, so that nothing moves; change a coordinate from line to line.")
    moves = []
    for start, end in pairs:
        first, last = table[start], table[end]
        arc = _arc(first[places], table[end - 1][places], last[places]) if shapes[end] == "arc" else None
        moves.append(Move(start, end, _curve(first, last, places, size, arc)))
    return moves


def _curve(first: Array, last: Array, places: Sequence[int], size: float, arc: Arc | None) -> Curve:
    """The line from a pose to another one, or the arc if there is one; arguments as of `moves_between`."""
    length = float(np.linalg.norm(last[places] - first[places])) if arc is None else arc.radius * arc.angle
    turn = float(np.linalg.norm(np.delete(last - first, places)))
    return Curve(start=first, end=last, length=length or turn * size, places=tuple(places), arc=arc)


def _arc(start: Array, middle: Array, end: Array) -> Arc | None:
    """The circle through three points from the first to the last; None where they are in a line."""
    to_middle, to_end = middle - start, end - start
    middle_square, end_square, product = to_middle @ to_middle, to_end @ to_end, to_middle @ to_end
    # Gram's determinant is the square of twice the area of the triangle.
    gram = middle_square * end_square - product * product
    if gram <= STRAIGHT**2 * middle_square * end_square:
        return None
    centre = start + (
        (middle_square * end_square - end_square * product) * to_middle
        + (middle_square * end_square - middle_square * product) * to_end
    ) / (2.0 * gram)
    first = start - centre
    radius = np.linalg.norm(first)
    side = to_middle - (to_middle @ first) / radius**2 * first
    second = side / np.linalg.norm(side) * radius
    angles = [np.arctan2((p - centre) @ second, (p - centre) @ first) % (2.0 * np.pi) for p in (middle, end)]
    if angles[0] > angles[1]:
        second, angles = -second, [2.0 * np.pi - angle for angle in angles]
    return Arc(centre, first, second, angle=float(angles[1]), middle=float(angles[0]))


def profile(length: float, feed: float, acceleration: float, jerk: float = np.inf) -> Phases:
    """The phases of a move from rest to rest that take time, theory (98).

    The speed is the greatest that can be reached and left again on this length, at most the feed rate. The acceleration
    grows and falls with the jerk, and holds between, if it comes to its limit.

    Args:
        length: length of the path, m.
        feed, acceleration, jerk: greatest values along it; an infinite jerk leaves three phases of seven.
    """
    if np.isinf(jerk):
        speed = min(feed, np.sqrt(length * acceleration))
        rise_time, cruise_time = speed / acceleration, length / speed - speed / acceleration
        rise = [Phase(rise_time, acceleration, acceleration)]
        return _with_cruise_and_braking(rise, cruise_time)
    # The speed that the jerk alone allows on this length, or, where the acceleration comes to its limit, that with it.
    speed = np.cbrt(length**2 * jerk / 4.0)
    if speed * jerk > acceleration**2:
        lag = acceleration**2 / jerk
        speed = 0.5 * (np.sqrt(lag**2 + 4.0 * acceleration * length) - lag)
    speed = min(feed, float(speed))
    growing = acceleration / jerk if speed * jerk > acceleration**2 else float(np.sqrt(speed / jerk))
    peak = jerk * growing
    holding = max(speed / peak - growing, 0.0)
    cruising = max(length / speed - (2.0 * growing + holding), 0.0)
    rise = [Phase(growing, 0.0, peak), Phase(holding, peak, peak), Phase(growing, peak, 0.0)]
    return _with_cruise_and_braking(rise, cruising)


def _with_cruise_and_braking(rise: Phases, cruise_time: float) -> Phases:
    """A rise of the speed, a cruise, and the fall that mirrors the rise; without phases that take no time."""
    braking = [Phase(phase.duration, -phase.last, -phase.first) for phase in reversed(rise)]
    return [phase for phase in (*rise, Phase(cruise_time, 0.0, 0.0), *braking) if phase.duration > 0.0]


def along_profile(phases: Phases, points: int) -> LengthInTime:
    """The length at so many times of each phase, both of its ends among them."""
    times, lengths, speeds, accelerations = [], [], [], []
    end_time = end_length = end_speed = 0.0
    for duration, first, last in phases:
        time = np.linspace(0.0, duration, points)
        jerk = (last - first) / duration
        accelerations.append(first + jerk * time)
        speeds.append(end_speed + first * time + jerk * time**2 / 2.0)
        lengths.append(end_length + end_speed * time + first * time**2 / 2.0 + jerk * time**3 / 6.0)
        times.append(end_time + time)
        end_time += duration
        end_length, end_speed = float(lengths[-1][-1]), float(speeds[-1][-1])
    return LengthInTime(*map(np.concatenate, (times, lengths, speeds, accelerations)))


def moment_at(phases: Phases, length: float) -> float:
    """The time at which a move has covered a length, s.

    Args:
        phases: phases of the move, see `profile`.
        length: between 0 and that of its path, m.
    """
    clock = passed = speed = 0.0  # time, length and speed at the end of the phases before
    for duration, first, last in phases:
        beyond = Polynomial([passed - length, speed, first / 2.0, (last - first) / (6.0 * duration)])
        if beyond(duration) >= 0.0:
            return clock + float(brentq(beyond, 0.0, duration, xtol=ROUND_OFF_OF_TIME))
        passed, speed = float(beyond(duration)) + length, float(beyond.deriv()(duration))
        clock += duration
    return clock

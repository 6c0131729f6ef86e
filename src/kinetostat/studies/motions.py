"""Motions: poses over time from a CSV file, as positions, rates and accelerations of the coordinates of the pose.

The head of the file says of which kind it is: poses at times; moves with a feed rate, which begin and end at rest; or
sines about the pose of the machine. A machine file may name such files in its requirements.

Source: theory (96)-(98).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from kinetostat.arrays import Array
from kinetostat.engine.moving import PosePath
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import POINT
from kinetostat.machine.machine import Machine
from kinetostat.machine.orientation import ANGLES, part_of
from kinetostat.machine.parameters import POSE, find, named_entry, values
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.spec.requirements import Requirement, is_text
from kinetostat.studies.csv_columns import GivenColumn, columns_of
from kinetostat.studies.moves import along_profile, moves_between, profile
from kinetostat.studies.poses import Where, column_values, read_columns, unit_doubt

TIME, FEED, ACCELERATION, JERK, SHAPE = "time", "feed", "acceleration", "jerk", "shape"
"""Names of columns beside those of the pose and of loads: when, or how fast, each pose is reached."""
FIELD, AMPLITUDE, FREQUENCY, PHASE = "field", "amplitude", "frequency", "phase"
"""Names of the columns of a file of sines: a file that has the first one is one."""
QUANTITIES = {
    TIME: Quantity("duration", "when the pose is reached"),
    FEED: Quantity("speed", "greatest speed of the move", positive=True),
    ACCELERATION: Quantity("acceleration", "greatest acceleration along the path", positive=True),
    JERK: Quantity("jerk", "greatest jerk along the path", positive=True),
}
"""The quantities of those columns of a file of poses that are numbers."""
SHAPES = ("line", "through", "arc")
"""Words of the column `shape`: a straight line to the pose, a point through which the next arc leads, an arc to it."""
SPLINE_DEGREE = 5
"""Degree of the spline through poses at times: the least odd one with which accelerations have no corner."""
_LOAD = re.compile(r"load\.(.+\.)?(force|moment)\.\d")
"""Paths of components of forces and moments on the platform, those of named loads among them."""
SAME_POSE = 1e-12
"""Difference of a coordinate of the first and the last pose, SI, up to which the motion is a closed one."""
WHOLE_PERIODS = 1e-9
"""Difference from a whole number of periods of the slowest sine up to which a sine has come back to its start."""
POINTS_PER_PERIOD = 256
"""Least number of points in a period of the fastest sine: its greatest value is missed by less than 1e-4."""
MOST_PERIODS = 200
"""Most periods of the fastest sine in a motion of sines, so that this has 51,200 points at most by that."""


@dataclass(frozen=True)
class Motion:
    """A motion of a machine.

    Attributes:
        kind: the sort of motion, in a few words.
        times: times of its points, s [n]; a point stands twice where the acceleration jumps.
        path: coordinates of the pose with their rates and accelerations.
        periodic: whether it closes and goes on for ever.
        timeless: whether its points are no time apart, but speeds and accelerations in many directions at one pose.
        unit_doubt: doubt about the units of its file, see `PoseColumns`; empty where there is none.
    """

    kind: str
    times: Array
    path: PosePath
    periodic: bool = False
    timeless: bool = False
    unit_doubt: str = ""

    @property
    def duration(self) -> float:
        """Time from its first point to its last, s."""
        return float(self.times[-1] - self.times[0])

    @property
    def loads(self) -> dict[str, dict[str, Any]]:
        """Forces and moments that it says, by name, with their units, as JSON has columns of poses."""
        units = {path: "N" if ".force." in path else "N·m" for path in self.path.loads}
        return {named_entry(path): {"units": units[path], "values": self.path.loads[path]} for path in units}


def read_motion(machine: Machine, path: Path, points: int = 400, text: str | None = None) -> Motion:
    """Read a motion from a CSV file, whose head says the unit of each column.

    Beside fields of the pose, all notations of orientation among them, and forces and moments on the platform, which
    change evenly from line to line over time, there may be

    - `time`: the pose is reached then; a spline of degree five leads through all of them;
    - `feed`, and if wanted `acceleration`, `jerk` and `shape`: each pose is the end of a move that begins and ends at
      rest, with these limits: trapezoids of speed, or with a jerk seven phases. `shape` is line, through or arc;
    - `field`, `amplitude`, `frequency`, `phase` instead: a line for each coordinate that swings about its pose.

    Args:
        machine: the machine whose pose moves; coordinates that no column names stay as they are.
        path: path of the file.
        points: number of points at which a motion is looked at, about.
        text: text of the file, where it is known; the path then only names it in messages.

    Raises:
        InputError: the file cannot be read, or is not a motion.
    """
    columns, numbers = columns_of(path, text=text)
    by_name = {column.name: column for column in columns}
    try:
        if FIELD in by_name:
            motion = _sines(machine, by_name, points)
        else:
            motion = _through_lines(machine, by_name, points, numbers)
    except InputError as error:
        raise InputError(f'"{path}": {error}') from None
    return replace(motion, unit_doubt=unit_doubt(machine, columns))


def motion_of(requirement: Requirement, machine: Machine, points: int = 400) -> Motion:
    """Read the motion that a requirement names; `points` as in `read_motion`.

    Raises:
        InputError: the file was not read with the machine, or is not a motion.
    """
    check_lines("motion", requirement.motion)
    return read_motion(machine, Path("motion"), points, requirement.motion)


def required_motion(machine: Machine, points: int = 400) -> Motion | None:
    """Read the motion that the requirements of a machine's file name; None without one. Arguments as of `motion_of`.

    Raises:
        InputError: they name several motions, or what `motion_of` refuses.
    """
    names = motions_required(machine)
    if len(names) > 1:
        listed = ", ".join(f"requirements.{name}" for name in names)
        raise InputError(f"the file names several motions ({listed}); give the one that is meant.")
    return motion_of(machine.requirements[names[0]], machine, points) if names else None


def motions_required(machine: Machine) -> tuple[str, ...]:
    """Names of the requirements of a machine's file that have a motion; of those with the same one, the last."""
    return tuple({each.motion: name for name, each in machine.requirements.items() if each.motion}.values())


def check_lines(part: str, given: str) -> None:
    """Check that a part of a requirement has the lines of its file.

    Raises:
        InputError: it has the name of the file, because the machine was not read from one.
    """
    if not is_text(given):
        raise InputError(
            f"{part} is {shorten(given)}, the name of a file; it is read where the machine is read from a file, beside "
            f"that. This machine was made of a text: write the lines of the file as {part}."
        )


def _through_lines(machine: Machine, columns: Mapping[str, GivenColumn], points: int, numbers: Sequence[int]) -> Motion:
    """The motion through the poses of a file, at their times or by moves.

    Args:
        machine: the machine whose pose moves.
        columns: columns of the file by their names.
        points: as of `read_motion`.
        numbers: number of the line of each pose in the file, for messages.
    """

    def where(name: str, row: int) -> str:
        return f"line {numbers[row]}, column {name}"

    amounts = {name: column_values(columns[name], QUANTITIES[name], where) for name in QUANTITIES if name in columns}
    of_poses = [column for name, column in columns.items() if name not in (*QUANTITIES, SHAPE)]
    coordinates, loads = _coordinates_and_loads(machine, of_poses, where)
    if TIME in amounts:
        for name in (FEED, ACCELERATION, JERK, SHAPE):
            if name in columns:
                raise InputError(f"a motion with times has no column {name}; remove it.")
        return _through_poses(coordinates, loads, amounts[TIME], points)
    if FEED not in amounts:
        raise InputError(
            "it has neither times nor a feed rate; add a column such as time [s] or feed [mm/s] beside the pose."
        )
    if ACCELERATION not in amounts:
        raise InputError("it has a feed rate but no acceleration; add a column such as acceleration [m/s**2].")
    return _moves(machine, coordinates, loads, amounts, _shapes(columns.get(SHAPE), len(numbers)), points)


def _coordinates_and_loads(
    machine: Machine, columns: Sequence[GivenColumn], where: Where
) -> tuple[dict[str, Array], dict[str, Array]]:
    """All coordinates of the pose by name, and the forces and moments that are given by leaf path, at each line."""
    poses = read_columns(machine, columns, where)
    loads = {path: column for path, column in poses.leaves.items() if _LOAD.fullmatch(path)}
    for path in poses.leaves:
        if not path.startswith(POSE) and path not in loads:
            raise InputError(
                f"{path} does not move; a motion has coordinates of the pose, and forces and moments such as force.x."
            )
    of_pose = {path: float(value) for path, value in values(machine).items() if path.startswith(POSE)}
    if any(part_of(column.name)[0] for column in columns):  # angles of quaternions and matrices may jump by a turn
        leaves = {
            path: np.unwrap(rows) if path.removeprefix(POSE) in ANGLES else rows for path, rows in poses.leaves.items()
        }
        poses = replace(poses, values=tuple(leaves[field.leaves[0]] for field in poses.fields))
    coordinates = {
        path.removeprefix(POSE): np.array(poses.leaves.get(path, np.full(poses.count, value)), dtype=float)
        for path, value in of_pose.items()
    }
    return coordinates, loads


def _through_poses(coordinates: Mapping[str, Array], loads: Mapping[str, Array], times: Array, points: int) -> Motion:
    """The spline through poses at times, theory (96); periodic where it ends at its first pose and loads."""
    not_later = np.flatnonzero(np.diff(times) <= 0.0)
    if len(times) < 2 or not_later.size:
        after = "there is only one pose"
        if not_later.size:
            after = f"after {times[not_later[0]]:g} s comes {times[not_later[0] + 1]:g} s"
        raise InputError(f"times must grow from line to line, but {after}; put the poses in their order.")
    table = np.stack(list(coordinates.values()), axis=1)
    # A periodic spline needs more points than its degree, beside the last one, which is the first again.
    closed = len(times) > SPLINE_DEGREE + 1 and bool((np.abs(table[0] - table[-1]) < SAME_POSE).all())
    if closed:
        table[-1] = table[0]
    degree = min(SPLINE_DEGREE, len(times) - 1)
    spline = make_interp_spline(times, table, k=degree, bc_type="periodic" if closed else None)
    fine = np.unique(np.concatenate([times, np.linspace(times[0], times[-1], points + 1)]))
    rows = [np.asarray(spline(fine, nu=order)) for order in range(3)]
    kind = f"{len(times)} poses over {times[-1] - times[0]:.4g} s"
    path = _path(list(coordinates), rows, {name: np.interp(fine, times, column) for name, column in loads.items()})
    periodic = closed and all(column[0] == column[-1] for column in loads.values())
    return Motion(kind=kind, times=fine, path=path, periodic=periodic)


def _path(names: Sequence[str], rows: Sequence[Array], loads: Mapping[str, Array]) -> PosePath:
    """Coordinates, rates and accelerations [n x coordinates] by name, with loads."""
    pose, rates, accelerations = (dict(zip(names, np.ascontiguousarray(part.T), strict=True)) for part in rows)
    return PosePath(pose, rates, accelerations, loads)


def _shapes(column: GivenColumn | None, count: int) -> list[str]:
    """The words of the column `shape`, one for each of so many lines; lines without a column or a word.

    Raises:
        InputError: a word is not a shape, or an arc lacks the point through which it leads, or the pose where it ends.
    """
    if column is None:
        return ["line"] * count
    words = [str(word).strip().lower() or "line" for word in column.entries]
    for word in words:
        if word not in SHAPES:
            raise InputError(f"{shorten(word)} is not a shape of a move; write {', '.join(SHAPES)}.")
    if "through" in (words[0], words[-1]) or words[0] == "arc":
        raise InputError(
            "the first pose is where the motion begins, and the last one ends a move: neither is on an arc."
        )
    for previous, word in pairwise(words):
        if (previous == "through") is not (word == "arc"):
            raise InputError("an arc needs a line with the shape through before it, and that one an arc behind it.")
    return words


def _moves(
    machine: Machine,
    coordinates: Mapping[str, Array],
    loads: Mapping[str, Array],
    amounts: Mapping[str, Array],
    shapes: Sequence[str],
    points: int,
) -> Motion:
    """Moves one after the other, each from rest to rest, theory (97) and (98); loads jump where a pose is twice."""
    names = list(coordinates)
    table = np.stack([coordinates[name] for name in names], axis=1)
    positions = [number for number, name in enumerate(names) if name in POINT]
    length = float(machine.configure().length) if machine.family.chains is None else float(machine.chains().length)
    moves = moves_between(table, shapes, positions, length)
    points_of_phase = max(2, points // max(1, 4 * len(moves)))
    times, rows, clock = [], [], 0.0
    loads_of_moves: dict[str, list[Array]] = {name: [] for name in loads}
    for move in moves:
        limits = {name: float(column[move.end]) for name, column in amounts.items()}
        phases = profile(move.curve.length, limits[FEED], limits[ACCELERATION], limits.get(JERK, np.inf))
        covered = along_profile(phases, points_of_phase)
        rows.append(move.curve.in_time(covered))
        for name, column in loads.items():
            of_poses = column[move.start : move.end + 1]
            loads_of_moves[name].append(np.interp(covered.times, move.moments(phases), of_poses))
        times.append(clock + covered.times)
        clock += float(covered.times[-1])
    joined_rows = [np.concatenate(parts) for parts in zip(*rows, strict=True)]
    joined_loads = {name: np.concatenate(parts) for name, parts in loads_of_moves.items()}
    phases_in_words = "seven phases" if JERK in amounts else "three phases"
    kind = f"{_number_of(len(moves), 'move')} of {phases_in_words}, {clock:.4g} s"
    return Motion(kind=kind, times=np.concatenate(times), path=_path(names, joined_rows, joined_loads))


@dataclass(frozen=True)
class _Sine:
    """A line of a file of sines: how a coordinate of the pose, or a component of a load, swings about its value.

    Attributes:
        path: path of what swings.
        amplitude: greatest displacement, SI.
        rate: 2 pi times the frequency, rad/s.
        phase: phase at the time 0, rad.
    """

    path: str
    amplitude: float
    rate: float
    phase: float

    def at(self, times: Array) -> tuple[Array, Array, Array]:
        """Displacement, rate and acceleration at times, s [n]."""
        angle = self.rate * times + self.phase
        displacement = self.amplitude * np.sin(angle)
        return displacement, self.amplitude * self.rate * np.cos(angle), -self.amplitude * self.rate**2 * np.sin(angle)


def _sines(machine: Machine, columns: Mapping[str, GivenColumn], points: int) -> Motion:
    """Sines about the pose of the machine and about its loads: of shakers and flight simulators, theory (96)."""
    sines = _sines_of_lines(machine, columns)
    fastest, slowest = max(sine.rate for sine in sines), min(sine.rate for sine in sines)
    if fastest > MOST_PERIODS * slowest:
        raise InputError(
            f"the fastest sine swings more than {MOST_PERIODS} times in a period of the slowest; part them."
        )
    count = max(points, int(np.ceil(POINTS_PER_PERIOD * fastest / slowest)))
    times = np.linspace(0.0, 2.0 * np.pi / slowest, count + 1)
    swinging = {sine.path for sine in sines}
    starts = {path: float(v) for path, v in values(machine).items() if path.startswith(POSE) or path in swinging}
    curves = {path: (np.full(times.shape, v), *np.zeros((2, *times.shape))) for path, v in starts.items()}
    for sine in sines:
        changes = zip(curves[sine.path], sine.at(times), strict=True)
        curves[sine.path] = tuple(curve + change for curve, change in changes)
    coordinates, rates, accelerations = (
        {path.removeprefix(POSE): parts[order] for path, parts in curves.items() if path.startswith(POSE)}
        for order in range(3)
    )
    loads = {path: parts[0] for path, parts in curves.items() if not path.startswith(POSE)}
    periods = [sine.rate / slowest for sine in sines]
    closes = all(abs(number - round(number)) < WHOLE_PERIODS for number in periods)
    kind = f"{_number_of(len(sines), 'sine')}, {times[-1]:.4g} s"
    path = PosePath(coordinates, rates, accelerations, loads)
    return Motion(kind=kind, times=times, path=path, periodic=closes)


def _sines_of_lines(machine: Machine, columns: Mapping[str, GivenColumn]) -> list[_Sine]:
    """The sines of the lines of a file, whose amplitudes have the units of what swings."""
    for name in columns:
        if name not in (FIELD, AMPLITUDE, FREQUENCY, PHASE):
            raise InputError(
                f"a motion of sines has no column {shorten(name)}; it has field, amplitude, frequency, phase. What "
                "swings, a coordinate of the pose or a force, stands in the column field of its line."
            )
    for name in (AMPLITUDE, FREQUENCY):
        if name not in columns:
            raise InputError(f"a motion of sines has no column {name}; add one, e.g. amplitude, frequency [Hz].")
    sines = []
    for number, entry in enumerate(columns[FIELD].entries):
        word = str(entry).strip()
        path = _path_of_swing(machine, word)
        cell = {key: GivenColumn(key, [column.entries[number]], column.unit) for key, column in columns.items()}
        # An amplitude is read as a value of what swings, whose kind of quantity it has.
        of_field = replace(cell[AMPLITUDE], name=word)
        amplitude = read_columns(machine, [of_field], lambda name, _: f"amplitude of {name}").values[0][0]
        frequency = column_values(cell[FREQUENCY], Quantity("frequency", "", positive=True), _words_of_column)[0]
        phase = column_values(cell[PHASE], Quantity("angle", ""), _words_of_column)[0] if PHASE in cell else 0.0
        sines.append(_Sine(path, float(amplitude), 2.0 * np.pi * float(frequency), float(phase)))
    return sines


def _path_of_swing(machine: Machine, word: str) -> str:
    """The path of what swings: a coordinate of the pose, or a component of a force or moment on the platform."""
    field = find(machine.family, word)
    if not (field.path.startswith(POSE) or _LOAD.fullmatch(field.path)):
        raise InputError(
            f"{field.shown} does not swing; write a coordinate of the pose, or a component of a force or moment such "
            "as force.x."
        )
    return field.path


def _number_of(number: int, what: str) -> str:
    return f"{number} {what}" + ("s" if number > 1 else "")


def _words_of_column(name: str, _row: int) -> str:
    return f"column {name}"

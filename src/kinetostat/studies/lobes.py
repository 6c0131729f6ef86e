"""The question of how wide a cut stays stable at which speed of the spindle: stability lobes.

The receptance of the tool is the machine's own, at its pose or at the worst of several; what the edges do is in
`vibration.cutting`.

Source: theory (106) and (107).
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress, silent
from kinetostat.equilibrium.state import AnswerInState, MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity, positive_number
from kinetostat.studies.directions import unit_direction
from kinetostat.studies.poses import chosen_axes, grid_of
from kinetostat.studies.tool_receptance import read_tool
from kinetostat.studies.vibration import Vibration, frequency_ends, modes
from kinetostat.units import UnitError
from kinetostat.vibration.cutting import Borders, Engagement, borders, milling, turning
from kinetostat.vibration.receptance import FreeTool

CURVE_SPEEDS = 1200
"""Speeds of the curve: more than a page has dots, so that no lobe of the usual range falls between two of them."""
SLOWEST_SHARE = 0.08
"""Slowest speed of the curve as a share of the fastest, if none is given: there, eight periods of
the chatter pass from edge to edge, and lobes run into one."""
FASTEST_MULTIPLE = 1.6
"""Fastest speed of the curve as a multiple of that at which an edge passes once per period of the chatter, if none is
given: the last lobe ends at 1."""
MOST_POSES = 2000
"""Poses of a range: each takes some milliseconds, as a machine of its own."""
MOST_OBLIQUE = 1e-6
"""Sine of the angle by which the feed may miss being at right angles to the spindle: directions in six digits."""
MOST_TEETH = 100
"""Edges of a cutter: more is a slip of the pen."""
MOST_RADIAL = 10.0
"""Radial force over the tangential one: more is a slip of the pen."""
ROUND_OFF_OF_DEGREES = 1e-12
"""Share by which 180 degrees may come out as more than pi when a text is converted."""


@dataclass(frozen=True, eq=False)
class Lobes(AnswerInState):
    """Widths of cut that stay stable over the speed of the spindle.

    Attributes:
        state: the state of the machine at its pose.
        status: status of the pose.
        message: why there is no answer; empty where there is one.
        teeth: number of edges that pass in a turn; 1 for one that stays in the cut.
        pressure: cutting force per area of the chip, N/m².
        speeds: speeds of the spindle, turns per second [n].
        widths: width of cut up to which each is stable at every pose, m; infinite where every width is [n].
        least: width of cut up to which every speed is stable at every pose, m.
        frequency: frequency of the chatter beyond the width `least`, Hz.
        best: speed of the curve at which the widest cut is stable, and that width; None where none is wider.
        assumed: whether nothing is said of the machine's damping, so that it is a usual one.
        poses: number of poses with an answer.
        worst: coordinates of the pose that allows least, by leaf path; empty for one pose.
        tool: a tool that is coupled to the machine; None without one.
    """

    state: MachineState
    status: Status
    message: str
    teeth: int
    pressure: float
    speeds: Array
    widths: Array
    least: float = math.inf
    frequency: float = math.nan
    best: tuple[float, float] | None = None
    assumed: bool = False
    poses: int = 1
    worst: tuple[tuple[str, float], ...] = ()
    tool: FreeTool | None = None

    def __repr__(self) -> str:
        return f"<Lobes of {self.machine.name!r}: {len(self.speeds)} speeds>"


@checked
def lobes(
    machine: Machine | MachineState,
    teeth: int | None = None,
    entry: float | str | None = None,
    leaving: float | str | None = None,
    feed: Sequence[float] = (),
    spindle: Sequence[float] = (),
    radial: float = 0.3,
    cutting_pressure: float | str | None = None,
    lowest: float | str | None = None,
    highest: float | str | None = None,
    over: str | Sequence[str] = (),
    tool_receptance: str | Path | None = None,
    progress: Progress = silent,
) -> Lobes:
    """Find the widths of cut that stay stable over the speed of the spindle.

    Without `teeth` one edge stays in the cut, across the direction of [cutting], as in turning. With `teeth` they turn
    through the cut, as in milling.

    Args:
        machine: the machine with pose, masses and [cutting], or its state; under load where `machine.loaded` is set.
        teeth: number of edges of a milling cutter.
        entry, leaving: angles at which an edge enters and leaves the cut, rad or with a unit, from the normal to the
            feed in the sense of the rotation; 0 and 180 deg, a slot, if None. 90 and 180 deg is half of it, down
            milling.
        feed: direction of the feed, base axes; x if empty.
        spindle: axis of the spindle from the workpiece to the machine, base axes; z if empty.
        radial: radial force as a share of the tangential one.
        cutting_pressure: tangential force per area of the chip, N/m² or with a unit; that of [cutting] if None.
        lowest, highest: ends of the range of speeds, turns per second or with a unit, "12000 1/min".
        over: ranges of coordinates of the pose, as "x=-10 cm:10 cm:5": widths are then stable at all of these poses.
        tool_receptance: CSV file with the receptance of a free tool and holder, which are coupled to the tool point.
        progress: receives how far the work is.

    Raises:
        InputError: nothing says a mass, the pressure or a direction, a number is out of range, the feed is not at right
            angles to the spindle, or there are more than 2000 poses.
    """
    state = state_of(machine)
    engagement = _engagement_of(state.machine, teeth, entry, leaving, feed, spindle, radial, cutting_pressure)
    ends = frequency_ends(lowest, highest)
    if not over:
        return _lobes_of(state, [_VibrationAtPose(modes(state, tool_receptance=tool_receptance))], engagement, ends)
    tool = read_tool(tool_receptance) if tool_receptance is not None else None
    return _lobes_of(state, _vibrations_over(state.machine, over, tool, progress), engagement, ends)


@dataclass(frozen=True)
class _VibrationAtPose:
    """The vibrations at a pose, and its coordinates by leaf path, SI; none for the pose of the machine itself."""

    vibration: Vibration
    pose: tuple[tuple[str, float], ...] = ()

    def borders(self, engagement: Engagement) -> Borders | None:
        """The borders of stability at the pose; None where nothing vibrates."""
        if self.vibration.solution is None or not self.vibration.solution.mode_count:
            return None
        frequencies = self.vibration.search_frequencies
        displacements = self.vibration.receptance(frequencies.tolist())[:, 3:, 3:]
        return borders(displacements, frequencies, engagement)


def _vibrations_over(
    machine: Machine, over: str | Sequence[str], tool: FreeTool | None, progress: Progress
) -> list[_VibrationAtPose]:
    """The vibrations at all poses of some ranges, each with the same tool coupled."""
    grid = grid_of(chosen_axes(machine, over))
    if grid.size > MOST_POSES:
        raise InputError(f"over has {grid.size:,} poses; at most {MOST_POSES:,} are computed: lower the counts.")
    columns, vibrations = grid.columns(0, grid.size), []
    for place in range(grid.size):
        pose = tuple((path, float(column[place])) for path, column in columns.items())
        vibrations.append(_VibrationAtPose(replace(modes(with_values(machine, dict(pose))), tool=tool), pose))
        progress(place + 1, grid.size)
    return vibrations


def _engagement_of(
    machine: Machine,
    teeth: int | None,
    entry: float | str | None,
    leaving: float | str | None,
    feed: Sequence[float],
    spindle: Sequence[float],
    radial: float,
    cutting_pressure: float | str | None,
) -> Engagement:
    """The engagement of turning or milling by the arguments of `lobes`, each of which is checked."""
    cutting = machine.tables["cutting"]
    written = cutting.pressure or None if cutting_pressure is None else cutting_pressure
    if written is None:
        raise InputError(
            f'Nothing says the cutting pressure of {machine.name}; write pressure = "2000 N/mm**2" under [cutting], or '
            "give cutting_pressure."
        )
    pressure = positive_number(written, "cutting pressure", "cutting_pressure")
    if teeth is None:
        if not any(cutting.direction):
            raise InputError(
                "Nothing says the direction across the cut; write direction = [1, 0, 0] under [cutting], or give teeth "
                "for a milling cutter."
            )
        return turning(pressure, np.array(unit_direction(cutting.direction, "cutting.direction")))
    if not 1 <= teeth <= MOST_TEETH:
        raise InputError(f"teeth is {teeth}; a cutter has 1 to {MOST_TEETH}.")
    if not 0.0 <= radial <= MOST_RADIAL:
        raise InputError(f"radial is {radial:g}; a share of the tangential force from 0 to {MOST_RADIAL:g} is allowed.")
    start, end = _entry_and_leaving(entry, leaving)
    feed_direction = np.array(unit_direction(feed or (1.0, 0.0, 0.0), "feed"))
    axis = np.array(unit_direction(spindle or (0.0, 0.0, 1.0), "spindle"))
    if abs(feed_direction @ axis) > MOST_OBLIQUE:
        raise InputError("The feed is not at right angles to the spindle; change feed or spindle.")
    return milling(pressure, radial, teeth, start, end, feed_direction, axis)


def _entry_and_leaving(entry: float | str | None, leaving: float | str | None) -> tuple[float, float]:
    """The angles, rad, at which an edge enters and leaves the cut; those of a slot where they are not given."""
    start = 0.0 if entry is None else _angle(entry, "entry")
    end = math.pi if leaving is None else _angle(leaving, "leaving")
    if not 0.0 <= start < end <= math.pi * (1.0 + ROUND_OFF_OF_DEGREES):
        raise InputError(
            f"entry and leaving are {math.degrees(start):g} and {math.degrees(end):g} deg; an edge enters at 0 deg or "
            "later and leaves after that, at 180 deg at the latest."
        )
    return start, end


def _angle(value: float | str, name: str) -> float:
    """An angle from a number, rad, or a text with a unit; `name` is the argument, for messages."""
    try:
        return Quantity("angle", "").number(value)
    except UnitError as error:
        raise InputError(f"{name} is {shorten(value)}: {error}.") from None


def _lobes_of(
    state: MachineState,
    vibrations: Sequence[_VibrationAtPose],
    engagement: Engagement,
    ends: tuple[float | None, float | None],
) -> Lobes:
    """The widths that are stable at all poses with vibrations: at each speed the least of theirs."""
    all_borders = [(at_pose.borders(engagement), at_pose) for at_pose in vibrations]
    known_borders = [(border, at_pose) for border, at_pose in all_borders if border is not None]
    if not known_borders:
        return _no_lobes(state, [at_pose.vibration for at_pose in vibrations], engagement)
    worst_border, worst = min(known_borders, key=lambda pair: pair[0].least[0])
    least, frequency = worst_border.least
    # Where every width is stable, nothing chatters: the curve then reaches to the highest frequency that was tried.
    chatter = frequency if math.isfinite(frequency) else float(worst_border.frequencies[-1])
    speeds = _speeds(chatter, engagement.teeth, ends)
    widths = np.min([border.widths_at(speeds) for border, _ in known_borders], axis=0)
    widest = int(np.argmax(widths))
    return Lobes(
        state=state,
        status=Status.OK,
        message="",
        teeth=engagement.teeth,
        pressure=engagement.pressure,
        speeds=speeds,
        widths=widths,
        least=least,
        frequency=frequency,
        best=(float(speeds[widest]), float(widths[widest])) if widths[widest] > least else None,
        assumed=any(at_pose.vibration.assumed for _, at_pose in known_borders),
        poses=len(known_borders),
        worst=worst.pose,
        tool=worst.vibration.tool,
    )


def _no_lobes(state: MachineState, vibrations: Sequence[Vibration], engagement: Engagement) -> Lobes:
    """The answer where nothing vibrates at any pose."""
    message = "At none of these poses does the machine have vibrations."
    return Lobes(
        state=state,
        status=vibrations[0].status,
        message=vibrations[0].message if len(vibrations) == 1 else message,
        teeth=engagement.teeth,
        pressure=engagement.pressure,
        speeds=np.zeros(0),
        widths=np.zeros(0),
        poses=0,
    )


def _speeds(chatter: float, teeth: int, ends: tuple[float | None, float | None]) -> Array:
    """The speeds of the curve, turns per second: over the given range, or one that has its last lobes.

    Args:
        chatter: frequency of the chatter, Hz.
        teeth: edges that pass in a turn.
        ends: slowest and fastest speed, as they are given; None where not.

    Raises:
        InputError: the slowest is not below the fastest.
    """
    fastest = ends[1] or FASTEST_MULTIPLE * chatter / teeth
    speeds = np.linspace(ends[0] or SLOWEST_SHARE * fastest, fastest, CURVE_SPEEDS)
    if speeds[0] >= speeds[-1]:
        raise InputError(
            f"lowest is above the range that is shown, up to {60.0 * fastest:.4g} 1/min; give highest too."
        )
    return speeds

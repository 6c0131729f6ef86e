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
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.spec.answer import ImmutableAnswer
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity, positive
from kinetostat.studies.indices import unit_direction
from kinetostat.studies.poses import chosen_axes, grid_of
from kinetostat.studies.tool_receptance import read_tool
from kinetostat.studies.vibration import Vibration, modes
from kinetostat.units import UnitError
from kinetostat.vibration.coupling import FreeTool
from kinetostat.vibration.cutting import Borders, Engagement, borders, milling, turning

SPEEDS = 1200
"""Speeds of the curve."""
SLOWEST_SHARE = 0.08
"""Slowest speed of the curve as a share of the fastest, if none is given."""
FASTEST = 1.6
"""Fastest speed of the curve, in turns in which an edge passes once per period of the chatter, if none is given."""
MOST_POSES = 2000
STRAIGHT = 1e-6
"""Sine of the angle by which the feed may miss being at right angles to the spindle."""


@dataclass(frozen=True, eq=False)
class Lobes(ImmutableAnswer):
    """Widths of cut that stay stable over the speed of the spindle.

    Attributes:
        state: the state of the machine at its pose.
        status: status of the pose.
        message: why there is no answer; empty where there is one.
        teeth: edges that pass in a turn; 1 for one that stays in the cut.
        pressure: cutting force per area of the chip, N/m².
        speeds: speeds of the spindle, turns per second [n].
        widths: width of cut up to which each is stable at every pose, m; infinite where every width is [n].
        least: width of cut up to which every speed is stable at every pose, m.
        frequency: frequency of the chatter beyond the width `least`, Hz.
        best: speed of the curve at which the widest cut is stable, and that width; None where none is wider.
        assumed: whether nothing is said of the machine's damping, so that it is a usual one.
        poses: number of poses with an answer.
        worst: coordinates of the pose that allows least, by leaf path; empty for one pose.
        tool: coupled to the machine; None where there is none.
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

    @property
    def machine(self) -> Machine:
        """The machine with its pose."""
        return self.state.machine


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
    engagement = _cutter_of(state.machine, teeth, entry, leaving, feed, spindle, radial, cutting_pressure)
    ends = [None if end is None else positive(end, "frequency", name)
            for end, name in ((lowest, "lowest"), (highest, "highest"))]  # fmt: skip
    if ends[0] is not None and ends[1] is not None and ends[0] >= ends[1]:
        raise InputError("lowest is not below highest; exchange them.")
    if not over:
        return _answer(state, [(modes(state, tool_receptance=tool_receptance), ())], engagement, ends)
    pairs = chosen_axes(state.machine, over)
    grid = grid_of(pairs)
    if grid.size > MOST_POSES:
        raise InputError(f"over has {grid.size:,} poses; at most {MOST_POSES:,} are computed: lower the counts.")
    columns = grid.columns(0, grid.size)
    tool = read_tool(tool_receptance) if tool_receptance is not None else None
    vibrations: list[tuple[Vibration, tuple[tuple[str, float], ...]]] = []
    for place in range(grid.size):
        pose = tuple((path, float(column[place])) for path, column in columns.items())
        there = modes(with_values(state.machine, dict(pose)))
        vibrations.append((replace(there, tool=tool), pose))
        progress(place + 1, grid.size)
    return _answer(state, vibrations, engagement, ends)


def _cutter_of(
    machine: Machine,
    teeth: int | None,
    entry: float | str | None,
    leaving: float | str | None,
    feed: Sequence[float],
    spindle: Sequence[float],
    radial: float,
    cutting_pressure: float | str | None,
) -> Engagement:
    cutting = machine.tables["cutting"]
    given = cutting.pressure or None if cutting_pressure is None else cutting_pressure
    if given is None:
        raise InputError(
            f'Nothing says the cutting pressure of {machine.name}; write pressure = "2000 N/mm**2" under [cutting], or '
            "give cutting_pressure."
        )
    pressure = positive(given, "cutting pressure", "cutting_pressure")
    if teeth is None:
        if not any(cutting.direction):
            raise InputError(
                "Nothing says the direction across the cut; write direction = [1, 0, 0] under [cutting], or give teeth "
                "for a milling cutter."
            )
        return turning(pressure, np.array(unit_direction(cutting.direction, "cutting.direction")))
    if not 1 <= teeth <= 100:
        raise InputError(f"teeth is {teeth}; a cutter has 1 to 100.")
    if not 0.0 <= radial <= 10.0:
        raise InputError(f"radial is {radial:g}; a share of the tangential force from 0 to 10 is allowed.")
    start = 0.0 if entry is None else _angle(entry, "entry")
    end = math.pi if leaving is None else _angle(leaving, "leaving")
    if not 0.0 <= start < end <= math.pi * (1.0 + 1e-12):
        raise InputError(
            f"entry and leaving are {math.degrees(start):g} and {math.degrees(end):g} deg; an edge enters at 0 deg or "
            "later and leaves after that, at 180 deg at the latest."
        )
    along = np.array(unit_direction(feed or (1.0, 0.0, 0.0), "feed"))
    axis = np.array(unit_direction(spindle or (0.0, 0.0, 1.0), "spindle"))
    if abs(along @ axis) > STRAIGHT:
        raise InputError("The feed is not at right angles to the spindle; change feed or spindle.")
    return milling(pressure, radial, teeth, start, end, along, axis)


def _angle(value: float | str, name: str) -> float:
    try:
        return Quantity("angle", "").number(value)
    except UnitError as error:
        raise InputError(f"{name} is {shorten(value)}: {error}.") from None


def _answer(
    state: MachineState,
    vibrations: Sequence[tuple[Vibration, tuple[tuple[str, float], ...]]],
    engagement: Engagement,
    ends: Sequence[float | None],
) -> Lobes:
    rows = [(_borders_of(each, engagement), pose, each) for each, pose in vibrations]
    known = [(border, pose, each) for border, pose, each in rows if border is not None]
    nothing = np.zeros(0)
    if not known:
        first = vibrations[0][0]
        message = first.message if len(vibrations) == 1 else "At none of these poses does the machine have vibrations."
        return Lobes(state, first.status, message, engagement.teeth, engagement.pressure, nothing, nothing, poses=0)
    border, pose, _ = min(known, key=lambda row: row[0].least[0])
    least, frequency = border.least
    chatter = frequency if math.isfinite(frequency) else float(border.frequencies[-1])
    fastest = ends[1] or FASTEST * chatter / engagement.teeth
    speeds = np.linspace(ends[0] or SLOWEST_SHARE * fastest, fastest, SPEEDS)
    if speeds[0] >= speeds[-1]:
        raise InputError(
            f"lowest is above the range that is shown, up to {60.0 * fastest:.4g} 1/min; give highest too."
        )
    widths = np.min([each.widths_at(speeds) for each, _, _ in known], axis=0)
    place = int(np.argmax(widths))
    best = (float(speeds[place]), float(widths[place])) if widths[place] > least else None
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
        best=best,
        assumed=any(each.assumed for _, _, each in known),
        poses=len(known),
        worst=pose,
        tool=known[0][2].tool,
    )


def _borders_of(vibration: Vibration, engagement: Engagement) -> Borders | None:
    if vibration.solution is None or not vibration.solution.ringing:
        return None
    tried = vibration.search_frequencies
    return borders(vibration.receptance(tried.tolist())[:, 3:, 3:], tried, engagement)

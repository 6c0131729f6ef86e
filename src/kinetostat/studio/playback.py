"""Motions that the machine makes on the page: a path of poses, and a motion over time with the curves of its drives.

A path comes from a CSV file (`studies.poses`) or from poses that the designer keeps; a motion from a CSV file or from
the requirements of the machine's file, and `answers` computes what it asks of the drives. Every pose that is shown is a
pose of the session, so that all linked views follow.
"""

import tempfile
from collections.abc import Callable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
from nicegui import ui

from kinetostat.arrays import Array
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.spec.errors import InputError
from kinetostat.studies.drives import DriveLoads
from kinetostat.studies.poses import read_poses
from kinetostat.studio.answers import MotionRequest, Report, drives_along, finite
from kinetostat.studio.elements import CurveView, csv_button, icon_button, refuse, toggle
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.session import Session
from kinetostat.studio.wording import paragraph
from kinetostat.units import motion_unit
from kinetostat.views.drives import DRIVES

STEPS_BETWEEN_KEPT_POSES = 24
"""Steps from one kept pose to the next: at `PATH_PERIOD` two seconds of motion."""
PATH_PERIOD = 0.08
"""Seconds between two poses of a path, if the computer keeps up: each is a whole analysis."""
NO_PATH = "No path yet: open a CSV file of poses (as `kinetostat path` reads it), or keep two poses or more."
FRAMES = 100
"""Steps of a motion that is played: a movement to the eye, and each is a whole analysis."""
FRAME_PERIOD = 0.12
"""Seconds between two steps of a motion, if the computer keeps up: the longest at which they still look like one."""
POINTS_SHOWN = 300
"""Points of a curve: about as many as it has pixels across."""
NO_MOTION = (
    "No motion yet: open a CSV file of one (poses with times, poses with a feed rate, or sines), or name it in a "
    'requirement of the file, { fits = "MOTOR", motion = "motion.csv" }.'
)

Poses: TypeAlias = dict[str, Array]
"""Values of each field along a path, SI."""


class Player:
    """A slider over the steps of a motion, and a button that lets it run to its end and stops it.

    Both are made together, and can then be moved to their places on the page.
    """

    def __init__(
        self,
        period: float,
        last: int,
        on_change: Callable[[], None],
        is_busy: Callable[[], bool],
        meaning: str,
        mark: str,
    ) -> None:
        """Build slider and button where the page is being built.

        Args:
            period: the time from one step to the next, s.
            last: the last step; the first is 0.
            on_change: called after every change of the slider.
            is_busy: whether the last step is still being drawn; the next one then waits.
            meaning: the tooltip of the button.
            mark: beginning of the names by which tests know both: "path" makes "path-play" and "path-place".
        """
        self._period, self._is_busy, self._last = period, is_busy, last
        self._timer: ui.timer | None = None
        self.button = icon_button("play_arrow", meaning, self._toggle, f"{mark}-play")
        self.slider = ui.slider(min=0, max=last, value=0, on_change=on_change).props("dense").mark(f"{mark}-place")

    def begin_again(self, last: int) -> None:
        """Stop, and go back to the first step of a motion whose last step is `last`; a single step cannot be played."""
        self.pause()
        self._last = max(last, 1)
        self.slider.props(f"max={self._last}").set_value(0)
        for element in (self.slider, self.button):
            element.set_enabled(last > 0)

    def pause(self) -> None:
        """Stop the slider where it is."""
        if self._timer is not None:
            self._timer.deactivate()  # a cancelled timer is there until its next turn
            self._timer.cancel()
        self._timer = None
        self.button.props("icon=play_arrow")

    def _toggle(self) -> None:
        if self._timer is not None:
            self.pause()
            return
        if self.slider.value >= self._last:
            self.slider.set_value(0)
        with self.button:  # a timer lives while something is played: an idle page asks for nothing
            self._timer = ui.timer(self._period, self._step)
        self.button.props("icon=pause")

    def _step(self) -> None:
        if self._is_busy():
            return
        if self.slider.value >= self._last:
            self.pause()
        else:
            self.slider.set_value(int(self.slider.value) + 1)


class Playback:
    """A button beside the views of the picture, and what it opens: a path, a slider along it, play and pause."""

    def __init__(self, session: Session, on_change: Callable[[], None], is_busy: Callable[[], bool]) -> None:
        """Build it where the page is being built.

        Args:
            session: the session whose machine follows the path.
            on_change: called after every change of the machine.
            is_busy: whether the last pose is still being drawn; the next one then waits.
        """
        self._session, self._on_change = session, on_change
        self._path: Poses = {}
        self._kept: list[dict[str, float]] = []
        with icon_button("route", "Follow a path of poses", lambda: self.menu.open(), "path"):
            self.menu = ui.menu().props("no-parent-event persistent").classes("playback")
        with self.menu:
            self.about = ui.label(NO_PATH).classes("note").mark("path-about")
            with ui.row().classes("panel-tools"):
                self._player = Player(PATH_PERIOD, 1, self._go, is_busy, "Play or pause", "path")
                icon_button("add_location_alt", "Keep this pose", self._keep, "path-keep")
                csv_button("Open a CSV file of poses", self._open, "path")
                icon_button("delete_outline", "Forget the path", self.clear, "path-clear")
                ui.space()
                icon_button("close", "Close", self.menu.close, "path-close")
            self._player.slider.move(self.menu, 1)  # above the buttons
        self._show()

    @property
    def count(self) -> int:
        """Number of poses of the path."""
        return len(next(iter(self._path.values()))) if self._path else 0

    def clear(self) -> None:
        """Forget the path, because its poses are those of another machine or nobody wants it any more."""
        self._kept, self._path = [], {}
        self._show()

    def _open(self, text: str) -> None:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "poses.csv"
            file.write_text(text, "utf-8")
            self._path = dict(read_poses(self._session.machine, file).leaves)
        self._kept = []
        self._show()

    def _keep(self) -> None:
        """Add the present pose to the path; the machine moves evenly from one kept pose to the next."""
        present = values(self._session.machine)
        self._kept.append({path: float(value) for path, value in present.items() if path.startswith(POSE)})
        self._path = poses_between(self._kept) if len(self._kept) > 1 else {}
        self._show()

    def _show(self) -> None:
        self._player.begin_again(self.count - 1)
        kept = f"{len(self._kept)} kept pose{'s' if len(self._kept) > 1 else ''}. " if self._kept else ""
        self.about.set_text(f"{kept}A path of {self.count} poses." if self.count > 1 else kept + NO_PATH)

    def _go(self) -> None:
        if self.count < 2:  # `begin_again` puts the slider back to 0, which also arrives here
            return
        place = min(int(self._player.slider.value), self.count - 1)
        pose = {path: float(column[place]) for path, column in self._path.items()}
        _move(self._session, pose, self._player, self._on_change)


def poses_between(kept: list[dict[str, float]]) -> Poses:
    """Return the poses of an even movement from each kept pose to the next, the kept ones among them.

    Args:
        kept: two poses or more, values by path, SI.
    """
    places = np.linspace(0.0, len(kept) - 1.0, (len(kept) - 1) * STEPS_BETWEEN_KEPT_POSES + 1)
    return {path: np.interp(places, range(len(kept)), [pose[path] for pose in kept]) for path in kept[0]}


def _move(session: Session, pose: Mapping[str, float], player: Player, on_change: Callable[[], None]) -> None:
    """Move the machine of a session to a pose of the motion that is played; stop where the pose is refused."""
    try:
        session.move(pose)
    except InputError as error:
        player.pause()
        refuse(str(error))
    else:
        on_change()


class CurveKind(StrEnum):
    """Kinds of curves of a motion, as their buttons name them."""

    FORCE = "Force"
    SPEED = "Speed"
    MOTOR = "Motor"
    POWER = "Power"
    TOOL = "Tool"


class DrivesPanel(Panel):
    """Demands of a motion on the drives over time; the machine follows a slider, or the motion is played."""

    name = "Drives"

    def build(self) -> None:
        self._session: Session | None = None
        self._answer: DriveLoads | None = None
        self._asked: Machine | None = None
        self._text = ""
        self._lane = Lane(drives_along, self._deliver)
        with ui.row().classes("panel-tools"):
            csv_button("Open a CSV file of a motion", self._open, "drives")
            self.kind = toggle([kind.value for kind in CurveKind], CurveKind.FORCE.value, self._draw, "drives-kind")
        self.about = ui.html(paragraph(NO_MOTION), sanitize=False).mark("drives-about")
        with ui.element("div").classes("vibration") as self.content:
            with ui.row().classes("panel-tools"):
                self._player = Player(
                    FRAME_PERIOD, FRAMES, self._go, self.is_busy, "Play or pause the motion", "drives"
                )
                self._player.slider.props('aria-label="time"').classes("grow")
                self.time = ui.label("").classes("note").mark("drives-time")
            self.curves = (
                CurveView("curves of the drives over the time of the motion").classes("tall").mark("drives-curves")
            )
            self.further = ui.html("", sanitize=False).style("flex: none").mark("drives-further")
        self._show_content(False)

    def shows(self, report: Report) -> bool:
        return report.answered

    def show(self, _report: Report, session: Session) -> None:
        self._session = session
        if self._asked is None or _apart_from_pose(self._asked) != _apart_from_pose(session.machine):
            self._ask()

    def leave(self) -> None:
        self._player.pause()

    def close(self) -> None:
        self._player.pause()
        self._lane.close()

    def _ask(self) -> None:
        if self._session is None:
            return
        self._player.pause()
        self._asked = self._session.machine
        self._lane.ask(MotionRequest(self._session.machine, self._text))

    def _open(self, text: str) -> None:
        self._text = text
        self._ask()

    def _deliver(self, _request: MotionRequest, answer: DriveLoads | str) -> None:
        """Show the curves of a motion, or the reason why there are none."""
        if isinstance(answer, str) or answer.curves is None:
            self._answer = None
            self._show_content(False)
            self.about.set_content(paragraph((answer if isinstance(answer, str) else answer.message) or NO_MOTION))
            self.further.set_content("")
            return
        self._answer = answer
        self._show_content(True)
        first, *others = (sentence for _, sentence in DRIVES.sentences(answer))
        self.about.set_content(paragraph(first, "lead"))
        self.further.set_content("".join(paragraph(text) for text in others))
        self._player.slider.set_value(0)  # if it was elsewhere, the machine also goes to the beginning of the motion
        self._draw()

    def _show_content(self, is_shown: bool) -> None:
        self.content.set_visibility(is_shown)
        self.kind.set_visibility(is_shown)

    def _draw(self) -> None:
        if self._answer is None:
            return
        times = np.linspace(self._answer.motion.times[0], self._answer.motion.times[-1], POINTS_SHOWN)
        plot = plot_of(self._answer, CurveKind(str(self.kind.value)), times)
        data = {
            "x": finite(times),
            "lines": [{"name": name, "values": finite(values)} for name, values in plot.lines],
            "label": {"x": "time (s)", "y": plot.label},
            "signed": True,
            "here": self._time_shown,
            "across": "s",
            "unit": plot.unit,
        }
        self.curves.run_method("show", data)

    @property
    def _time_shown(self) -> float:
        """The time under the slider, s."""
        if self._answer is None:
            return 0.0
        times = self._answer.motion.times
        return float(times[0] + (times[-1] - times[0]) * float(self._player.slider.value) / FRAMES)

    def _go(self) -> None:
        if self._answer is None or self._session is None or self._asked is None:
            return
        motion, time = self._answer.motion, self._time_shown
        self.time.set_text(f"{time:.3f} s")
        self.curves.run_method("mark", time)
        pose = {POSE + name: float(np.interp(time, motion.times, row)) for name, row in motion.path.pose.items()}
        _move(self._session, pose, self._player, self.show_change)


def _apart_from_pose(machine: Machine) -> tuple[object, ...]:
    """Return all numbers of a machine that a motion does not change."""
    numbers = {path: value for path, value in values(machine).items() if not path.startswith(POSE)}
    return machine.name, machine.family.name, machine.requirements, numbers


class Plot(NamedTuple):
    """The label of an upright axis, its unit, and the curves over it, each with its name."""

    label: str
    unit: str
    lines: list[tuple[str, Array]]


def plot_of(answer: DriveLoads, kind: CurveKind, times: Array) -> Plot:
    """Return the curves of one kind at some times.

    Args:
        answer: an answer with curves.
        kind: the kind of curve.
        times: s.
    """
    return _tool_plot(answer, times) if kind is CurveKind.TOOL else _drive_plot(answer, kind, times)


def _tool_plot(answer: DriveLoads, times: Array) -> Plot:
    """Return the deflection of the tool: as if the machine stood still, and with its modes where these are known."""
    if answer.deflection is None:
        raise ValueError("an answer without curves has no deflection")
    scale = answer.machine.display.deflection("m")
    rest = [np.interp(times, answer.motion.times, row) for row in answer.deflection[:, 3:].T]
    lines = [("at rest", np.linalg.norm(rest, axis=0) * scale.factor)]
    if answer.along_modes is not None and answer.along_modes.modes:
        surplus = [np.interp(times, answer.along_modes.times, row) for row in answer.along_modes.surplus[:, 3:].T]
        lines.append(("modes", np.linalg.norm(np.add(rest, surplus), axis=0) * scale.factor))
    return Plot(scale.label("deflection of the tool"), scale.unit, lines)


def _drive_plot(answer: DriveLoads, kind: CurveKind, times: Array) -> Plot:
    """Return a curve for each drive, by its number.

    Drives of the kind of the first one are drawn, sliding or turning, so that all have one unit.
    """
    if answer.curves is None:
        raise ValueError("an answer without curves cannot be drawn")
    display, first = answer.machine.display, answer.drives[0]
    length, force, torque = map(display.scale, (motion_unit(not first.slides), first.unit, first.motor_unit))
    curves, motor_word = answer.curves, "torque of the motor" if first.rotary else "force of the motor"
    values, factor, unit, word = {
        CurveKind.FORCE: (curves.force, force.factor, force.unit, "force"),
        CurveKind.SPEED: (curves.speed, length.factor, f"{length.unit}/s", "speed"),
        CurveKind.MOTOR: (curves.motor_torque, torque.factor, torque.unit, motor_word),
        CurveKind.POWER: (curves.power, 1.0, "W", "power of the motor"),
    }[kind]
    numbers = [k for k, drive in enumerate(answer.drives) if drive.slides is first.slides]
    lines = [(f"{k + 1}", np.interp(times, answer.motion.times, values[k]) * factor) for k in numbers]
    return Plot(f"{word} ({unit})", unit, lines)

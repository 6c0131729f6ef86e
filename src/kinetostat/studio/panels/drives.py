"""Drives along a motion: the machine makes it in the picture, and the curves of its drives follow.

The motion is a CSV file that is sent, or the one that the requirements of the machine's file name. What it asks of the
drives is computed by `answers`; every shown pose is a pose of the session, so that all linked views follow.
"""

import numpy as np
from nicegui import events, ui

from kinetostat.arrays import Array
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.spec.document import text_of
from kinetostat.spec.errors import InputError
from kinetostat.studies.drives import DriveLoads
from kinetostat.studio.answers import MotionRequest, Report, drives_along, finite
from kinetostat.studio.elements import CurveView, icon_button, refuse, toggle, upload_field
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.playback import Player
from kinetostat.studio.session import Session
from kinetostat.studio.wording import paragraph
from kinetostat.units import motion_unit
from kinetostat.views.drives import DRIVES

FORCE, SPEED, TORQUE, POWER, TOOL = "Force", "Speed", "Motor", "Power", "Tool"
FRAMES = 100
"""Steps of a motion that is played: a movement to the eye, and each is a whole analysis."""
PERIOD = 0.12
"""Seconds between two of them, if the computer keeps up: the longest at which steps still look like a motion."""
SHOWN = 300
"""Points of a curve: about as many as it has pixels across."""
NO_MOTION = (
    "No motion yet: open a CSV file of one (poses with times, poses with a feed rate, or sines), or name it in a "
    'requirement of the file, { fits = "MOTOR", motion = "motion.csv" }.'
)


class DrivesPanel(Panel):
    """Demands of a motion on the drives over time; the machine follows a slider, or the motion is played."""

    name = "Drives"

    def build(self) -> None:
        self._session: Session | None = None
        self._answer: DriveLoads | None = None
        self._asked: Machine | None = None
        self._text = ""
        self._player = Player(PERIOD, self.is_busy)
        self._lane = Lane(drives_along, self._deliver)
        with ui.row().classes("panel-tools"):
            self.upload = upload_field(self._open, refuse, "drives-upload", ".csv")
            icon_button("folder_open", "Open a CSV file of a motion", self._pick, "drives-open")
            self.kind = toggle([FORCE, SPEED, TORQUE, POWER, TOOL], FORCE, self._draw, "drives-kind")
        self.about = ui.html(paragraph(NO_MOTION), sanitize=False).mark("drives-about")
        with ui.element("div").classes("vibration") as self.content:
            with ui.row().classes("panel-tools"):
                self.play = self._player.build_button("Play or pause the motion", "drives-play")
                self.place = self._player.build_slider(FRAMES, self._go)
                self.place.props('aria-label="time"').classes("grow").mark("drives-place")
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
        """Compute what the motion asks of the machine as it is now."""
        if self._session is None:
            return
        self._player.pause()
        self._asked = self._session.machine
        self._lane.ask(MotionRequest(self._session.machine, self._text))

    def _pick(self) -> None:
        self.upload.run_method("pickFiles")

    async def _open(self, event: events.UploadEventArguments) -> None:
        """Take the motion of a CSV file."""
        data, name = await event.file.read(), event.file.name
        self.upload.reset()
        try:
            self._text = text_of(data, name, "CSV")
        except InputError as error:
            refuse(str(error))
        else:
            self._ask()

    def _deliver(self, _request: MotionRequest, new: DriveLoads | str) -> None:
        self._answer = None if isinstance(new, str) or new.curves is None else new
        self._show_content(self._answer is not None)
        self.further.set_content("")
        if isinstance(new, str) or new.curves is None:
            self.about.set_content(paragraph((new if isinstance(new, str) else new.message) or NO_MOTION))
            return
        first, *others = (sentence for _, sentence in DRIVES.sentences(new))
        self.about.set_content(paragraph(first, "lead"))
        self.further.set_content("".join(paragraph(text) for text in others))
        self.place.set_value(0)
        self._draw()

    def _show_content(self, shown: bool) -> None:
        """Show the curves with what chooses them, where there is a motion."""
        self.content.set_visibility(shown)
        self.kind.set_visibility(shown)

    def _draw(self) -> None:
        """Draw the curves that are chosen, and mark the time."""
        answer = self._answer
        if answer is None or answer.curves is None:
            return
        times = np.linspace(answer.motion.times[0], answer.motion.times[-1], SHOWN)
        label, unit, lines = curves_of(answer, str(self.kind.value), times)
        shown = [{"name": name, "values": finite(row)} for name, row in lines]
        labels = {"x": "time (s)", "y": label}
        options = {"signed": True, "here": self._time_shown, "across": "s", "unit": unit}
        self.curves.run_method("show", {"x": finite(times), "lines": shown, "label": labels, **options})

    @property
    def _time_shown(self) -> float:
        """The time under the slider, s."""
        if self._answer is None:
            return 0.0
        times = self._answer.motion.times
        return float(times[0] + (times[-1] - times[0]) * float(self.place.value) / FRAMES)

    def _go(self) -> None:
        """Move the machine to where it is at the time under the slider."""
        if self._answer is None or self._session is None or self._asked is None:
            return
        motion, moment = self._answer.motion, self._time_shown
        self.time.set_text(f"{moment:.3f} s")
        self.curves.run_method("mark", moment)
        pose = {POSE + name: float(np.interp(moment, motion.times, row)) for name, row in motion.path.pose.items()}
        try:
            self._session.move(pose)
        except InputError as error:
            self._player.pause()
            refuse(str(error))
        else:
            self.show_change()


def _apart_from_pose(machine: Machine) -> tuple[object, ...]:
    """Return all numbers of a machine that a motion does not change."""
    numbers = {path: value for path, value in values(machine).items() if not path.startswith(POSE)}
    return machine.name, machine.family.name, machine.requirements, numbers


def curves_of(answer: DriveLoads, kind: str, times: Array) -> tuple[str, str, list[tuple[str, Array]]]:
    """Return the curves of an answer at some times: the label of their axis, their unit, and each with its name.

    Drives of the kind of the first one are drawn, so that all have one unit.

    Args:
        answer: an answer with curves.
        kind: the kind of curve, as the panel offers them.
        times: s.
    """
    display, moments = answer.machine.display, answer.motion.times
    if kind == TOOL and answer.deflection is not None:
        scale = display.deflection("m")
        rows = [np.interp(times, moments, row) for row in answer.deflection[:, 3:].T]
        lines = [("at rest", np.linalg.norm(rows, axis=0) * scale.factor)]
        if answer.along_modes is not None and answer.along_modes.modes:
            surplus = [np.interp(times, answer.along_modes.times, row) for row in answer.along_modes.surplus[:, 3:].T]
            lines.append(("modes", np.linalg.norm(np.add(rows, surplus), axis=0) * scale.factor))
        return scale.label("deflection of the tool"), scale.unit, lines
    if answer.curves is None:
        return "", "", []
    first = answer.drives[0]
    length, force, torque = map(display.scale, (motion_unit(not first.slides), first.unit, first.motor_unit))
    curve, factor, unit, word = {
        SPEED: (answer.curves.speed, length.factor, f"{length.unit}/s", "speed"),
        TORQUE: (answer.curves.motor_torque, torque.factor, torque.unit,
                 "torque of the motor" if first.rotary else "force of the motor"),
        POWER: (answer.curves.power, 1.0, "W", "power of the motor"),
    }.get(kind, (answer.curves.force, force.factor, force.unit, "force"))  # fmt: skip
    alike = [k for k, drive in enumerate(answer.drives) if drive.slides is first.slides]
    return f"{word} ({unit})", unit, [(f"{k + 1}", np.interp(times, moments, curve[k]) * factor) for k in alike]

"""A path of poses that the machine follows on the page: from a CSV file, or from poses that the designer has kept.

Files are read by `studies.poses`; every shown pose is a pose of the session, so that all linked views follow.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np
from nicegui import events, ui

from kinetostat.arrays import Array
from kinetostat.machine.parameters import POSE, values
from kinetostat.spec.document import text_of
from kinetostat.spec.errors import InputError
from kinetostat.studies.poses import read_poses
from kinetostat.studio.elements import icon_button, refuse, upload_field
from kinetostat.studio.session import Session

BETWEEN = 24
"""Poses from one kept pose to the next: two seconds of motion."""
PERIOD = 0.08
"""Seconds between two poses of a path, if the computer keeps up: each is a whole analysis."""
EMPTY = "No path yet: open a CSV file of poses (as `kinetostat path` reads it), or keep two poses or more."

Poses: TypeAlias = dict[str, Array]
"""Values of each field along a path, SI."""


class Player:
    """A slider, and a button that lets it run to its end and stops it; each is built where the page is being built."""

    def __init__(self, period: float, is_busy: Callable[[], bool]) -> None:
        """Prepare it.

        Args:
            period: the time from one step to the next, s.
            is_busy: whether the last step is still being drawn; the next one then waits.
        """
        self._period, self._is_busy = period, is_busy
        self._timer: ui.timer | None = None

    def build_slider(self, last: int, on_change: Callable[[], None]) -> ui.slider:
        """Build the slider, whose steps are 0 to `last`."""
        self.last = last
        self.place = ui.slider(min=0, max=last, value=0, on_change=on_change).props("dense")
        return self.place

    def build_button(self, meaning: str, mark: str) -> ui.button:
        """Build the button."""
        self.button = icon_button("play_arrow", meaning, self._toggle, mark)
        return self.button

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
        if self.place.value >= self.last:
            self.place.set_value(0)
        with self.button:  # a timer lives while something is played: an idle page asks for nothing
            self._timer = ui.timer(self._period, self._step)
        self.button.props("icon=pause")

    def _step(self) -> None:
        if self._is_busy():
            return
        if self.place.value >= self.last:
            self.pause()
        else:
            self.place.set_value(int(self.place.value) + 1)


class Playback:
    """A button beside the views of the picture, and what it opens: a path, a slider along it, play and pause."""

    def __init__(self, session: Session, on_change: Callable[[], None], is_busy: Callable[[], bool]) -> None:
        """Build it where the page is being built.

        Args:
            session: the session whose machine follows the path.
            on_change: called after every change of the machine.
            is_busy: whether the last pose is still being drawn; the next one then waits.
        """
        self._session, self._on_change, self._player = session, on_change, Player(PERIOD, is_busy)
        self._path: Poses = {}
        self._kept: list[dict[str, float]] = []
        with icon_button("route", "Follow a path of poses", lambda: self.menu.open(), "path"):
            self.menu = ui.menu().props("no-parent-event persistent").classes("playback")
        with self.menu:
            self.about = ui.label(EMPTY).classes("note").mark("path-about")
            self.place = self._player.build_slider(1, self._go).mark("path-place")
            with ui.row().classes("panel-tools"):
                self.play = self._player.build_button("Play or pause", "path-play")
                icon_button("add_location_alt", "Keep this pose", self._keep, "path-keep")
                self.upload = upload_field(self._open, refuse, "path-upload", ".csv")
                icon_button("folder_open", "Open a CSV file of poses", self._pick, "path-open")
                icon_button("delete_outline", "Forget the path", self.clear, "path-clear")
                ui.space()
                icon_button("close", "Close", self.menu.close, "path-close")
        self._show()

    @property
    def count(self) -> int:
        """Number of poses of the path."""
        return len(next(iter(self._path.values()))) if self._path else 0

    def clear(self) -> None:
        """Forget the path, because its poses are those of another machine or nobody wants it any more."""
        self._kept, self._path = [], {}
        self._show()

    def _pick(self) -> None:
        self.upload.run_method("pickFiles")

    async def _open(self, event: events.UploadEventArguments) -> None:
        """Take the poses of a CSV file."""
        data, name = await event.file.read(), event.file.name
        self.upload.reset()
        try:
            text = text_of(data, name, "CSV")
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "poses.csv"
                file.write_text(text, "utf-8")
                self._path = dict(read_poses(self._session.machine, file).leaves)
        except InputError as error:
            refuse(str(error))
            return
        self._kept = []
        self._show()

    def _keep(self) -> None:
        """Add the present pose to the path; the machine moves evenly from one kept pose to the next."""
        present = values(self._session.machine)
        self._kept.append({path: float(value) for path, value in present.items() if path.startswith(POSE)})
        self._path = poses_between(self._kept) if len(self._kept) > 1 else {}
        self._show()

    def _show(self) -> None:
        self._player.pause()
        self._player.last = max(self.count - 1, 1)
        self.place.props(f"max={self._player.last}").set_value(0)
        self.place.set_enabled(self.count > 1)
        self.play.set_enabled(self.count > 1)
        kept = f"{len(self._kept)} kept pose{'s' if len(self._kept) > 1 else ''}. " if self._kept else ""
        self.about.set_text(f"{kept}A path of {self.count} poses." if self.count > 1 else kept + EMPTY)

    def _go(self) -> None:
        """Move the machine to the pose under the slider."""
        if self.count < 2:
            return
        at = min(int(self.place.value), self.count - 1)
        try:
            self._session.move({path: float(column[at]) for path, column in self._path.items()})
        except InputError as error:
            self._player.pause()
            refuse(str(error))
        else:
            self._on_change()


def poses_between(kept: list[dict[str, float]]) -> Poses:
    """Return the poses of an even movement from each kept pose to the next, the kept ones among them.

    Args:
        kept: two poses or more, values by path, SI.
    """
    places = np.linspace(0.0, len(kept) - 1.0, (len(kept) - 1) * BETWEEN + 1)
    return {path: np.interp(places, range(len(kept)), [pose[path] for pose in kept]) for path in kept[0]}

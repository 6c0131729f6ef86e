"""The handles of the picture: pulls that the browser sends become numbers of the machine, one step of its history each.

Which numbers follow a pull is the business of `pulling`.
"""

from collections.abc import Callable

from nicegui.element import Element
from nicegui.events import GenericEventArguments

from kinetostat.algebra.vector import Displacement
from kinetostat.spec.errors import InputError
from kinetostat.studio.elements import THROTTLE, refuse
from kinetostat.studio.lanes import Lane
from kinetostat.studio.pulling import PLATFORM, Pull, goal_of, placed, point_goal, pulled
from kinetostat.studio.session import Session


class Handles:
    """Listens to a view while its handles are pulled; the latest wish counts, those in between are never computed."""

    def __init__(self, session: Session, view: Element, on_change: Callable[[], None]) -> None:
        """Listen.

        Args:
            session: whose machine is pulled.
            view: of the machine; sends `pull` and `settle`.
            on_change: called after every change of the machine.
        """
        self._session, self._on_change = session, on_change
        self._lane = Lane(pulled, self._follow)
        self._pull_number: object = None
        self._home: Displacement | None = None
        self._ended = False
        view.on("pull", self._ask, throttle=THROTTLE)
        view.on("settle", self._settle)

    def close(self) -> None:
        self._lane.close()

    def _ask(self, event: GenericEventArguments) -> None:
        of, leg, axis, goal, number = (event.args[key] for key in ("of", "leg", "axis", "goal", "start"))
        machine = self._session.machine
        if self._home is None or number != self._pull_number:
            self._pull_number, self._home = number, placed(machine).platform
        self._ended = False
        target = goal_of(self._home, axis, float(goal)) if of == PLATFORM else point_goal([float(c) for c in goal])
        self._lane.ask(Pull(machine, of, leg, axis, target))

    def _follow(self, _pull: Pull, numbers: dict[str, float]) -> None:
        if numbers:
            try:
                self._session.move(numbers)
            except InputError:
                return  # a pull beyond what the file allows, such as a negative radius, leads no further
            self._on_change()
        if self._ended:
            self._end()

    def _settle(self, _event: GenericEventArguments) -> None:
        self._ended = True
        if not self._lane.busy:
            self._end()

    def _end(self) -> None:
        self._ended, self._home = False, None
        try:
            self._session.settle()
        except InputError as error:
            refuse(str(error))
        self._on_change()

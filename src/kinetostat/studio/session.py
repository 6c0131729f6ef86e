"""One designer's machine: what it is now, what it was, how it changes. Knows no page."""

from collections.abc import Mapping
from dataclasses import dataclass

from kinetostat.kinetostatics.response import respond
from kinetostat.machine.changing import changed, read_value, rebuilt, related
from kinetostat.machine.loading import as_toml, build, bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values
from kinetostat.spec.document import LARGEST_FILE, parse
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studio.controls import Control, controls

REMEMBERED = 200
"""Steps that can be undone."""


@dataclass(frozen=True)
class Memory:
    """What a session remembers of a machine: nothing in it changes, so that it may be kept and shared.

    Attributes:
        origin: as it was loaded.
        name: of a bundled machine; empty for any other.
        now: as it is; `origin` if None.
        past: what it was, the latest last.
        exaggeration: of the deflected shape; None to choose one for every load.
    """

    origin: Machine
    name: str = ""
    now: Machine | None = None
    past: tuple[Machine, ...] = ()
    exaggeration: float | None = None


class Session:
    """A machine and its history.

    Attributes:
        machine: as it is now; it need not be able to reach its pose.
        origin: as it was loaded; `name` if it is a bundled one.
        controls: its numbers with their ranges, fixed when it was loaded.
        exaggeration: factor of its deflected shape, None to choose one for every load; it has no history.
    """

    def __init__(self, memory: Memory) -> None:
        """A session that goes on from what is remembered."""
        self._start(memory)

    def _start(self, memory: Memory) -> None:
        machine, self.name = memory.origin, memory.name
        self.origin = machine
        self.machine = memory.now or machine
        length = float(respond(machine).configuration.length)
        self.controls: dict[str, Control] = {one.path: one for one in controls(machine, length)}
        self.exaggeration = memory.exaggeration
        self._past = [*memory.past]
        self._future: list[Machine] = []
        self._dragged: tuple[str, ...] = ()

    @property
    def memory(self) -> Memory:
        """All that is needed to go on later."""
        return Memory(self.origin, self.name, self.machine, tuple(self._past), self.exaggeration)

    def open(self, name: str) -> None:
        """Take a bundled machine.

        Raises:
            InputError: no such machine; the session stays as it was.
        """
        if name not in bundled():
            raise InputError(f"{shorten(name)} is not a bundled machine; choose one of {', '.join(bundled())}.")
        self._start(Memory(load(name), name))

    def open_bytes(self, data: bytes, name: str) -> None:
        """Take a machine file that was sent: data only, of bounded size.

        Raises:
            InputError: too large, not text, or a mistake in it; the session stays as it was.
        """
        if len(data) > LARGEST_FILE:
            raise InputError(f'"{name}" is larger than {LARGEST_FILE >> 20} MiB; a machine file is a short TOML text.')
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            raise InputError(f'"{name}" is not text; a machine file is TOML, saved as UTF-8.') from None
        self._start(Memory(build(parse(text, name), name)))

    def take(self, machine: Machine) -> bool:
        """Take another design; returns whether it is one step of the history, as any of a machine of the same kind is.

        A machine of another kind is taken as one that was loaded.
        """
        alike = (
            machine.family.name == self.machine.family.name and values(machine).keys() == values(self.machine).keys()
        )
        if alike:
            self._past = [*self._past[-REMEMBERED + 1 :], self.machine]
            self._future.clear()
            self.machine, self._dragged = machine, ()
        else:
            self._start(Memory(machine))
        return alike

    def value(self, path: str) -> float:
        """The SI value of a control; of one for several entries the first."""
        return float(values(self.machine)[self.controls[path].parameter.leaves[0]])

    def values(self) -> dict[str, float]:
        """The SI values of all controls."""
        held = values(self.machine)
        return {path: float(held[control.parameter.leaves[0]]) for path, control in self.controls.items()}

    def slide(self, path: str, position: int) -> None:
        """Move a slider; all movements until `settle` are one step of the history.

        Raises:
            InputError: the machine cannot have this value; it stays as it was.
        """
        self._change({path: self.controls[path].value_at(position)})

    def settle(self) -> None:
        """Let go of what is being dragged: what was changed is now checked against everything else.

        Raises:
            InputError: the numbers contradict each other; the machine is again what it was before.
        """
        dragged, self._dragged = self._dragged, ()
        if any(related(self.machine, path) for path in dragged):
            try:
                self.machine = rebuilt(self.machine)
            except InputError:
                self.machine = self._past.pop()
                raise

    def write(self, path: str, text: str) -> None:
        """Give a number as text with a unit.

        Raises:
            InputError: it is not one, or the machine cannot have it.
        """
        self.settle()
        self._change({path: read_value(self.machine, path, text)})
        self.settle()

    def move(self, where: Mapping[str, float]) -> None:
        """Set several numbers at once, SI, as by a click on a map; repeated moves of the same are one step.

        Raises:
            InputError: the machine cannot have them.
        """
        self._change(where)

    def _change(self, numbers: Mapping[str, float]) -> None:
        new = changed(self.machine, numbers)
        paths = tuple(numbers)
        if self._dragged != paths:
            self._past = [*self._past[-REMEMBERED + 1 :], self.machine]
        self._dragged = paths
        self._future.clear()
        self.machine = new

    @property
    def can_undo(self) -> bool:
        """Whether there is a step to undo."""
        return bool(self._past)

    @property
    def can_redo(self) -> bool:
        """Whether there is an undone step."""
        return bool(self._future)

    def undo(self) -> None:
        """Go back by one step, if there is one."""
        if self._past:
            self._future.append(self.machine)
            self.machine, self._dragged = self._past.pop(), ()

    def redo(self) -> None:
        """Take back an undo, if there is one."""
        if self._future:
            self._past.append(self.machine)
            self.machine, self._dragged = self._future.pop(), ()

    def reset(self) -> None:
        """Return to the machine as it was loaded; this can be undone."""
        if self.machine is not self.origin:
            self._past.append(self.machine)
            self._future.clear()
            self.machine, self._dragged = self.origin, ()

    def as_file(self) -> tuple[str, bytes]:
        """A file name and the machine as TOML."""
        kept = "".join(c if c.isalnum() and c.isascii() else "-" for c in self.machine.name.lower()).strip("-")
        return f"{kept or 'machine'}.toml", as_toml(self.machine).encode()

"""The machine of one designer, and the history of its changes.

No element of a page is known here, so that tests drive a session directly.
"""

from collections.abc import Mapping
from dataclasses import replace

from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.machine.loading import build, bundled, is_checked_against_others, load, read_again
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, values
from kinetostat.machine.saving import as_file
from kinetostat.spec.document import text_of
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studio.controls import Control, controls
from kinetostat.studio.wording import typed_value, unit_shown
from kinetostat.units import UnitError

TYPED_TEXT = "text"
"""Entry of an open step, in the place of a path, while the text of the machine is being typed."""
MOST_UNDONE_STEPS = 200
"""Steps that can be undone: more than anybody goes back, at some kilobytes each."""


@dataclass(frozen=True)
class Memory:
    """The state of a session as frozen data, kept by the server while the browser loads the page again.

    Attributes:
        origin: the machine as it was loaded.
        name: the name of a bundled machine; empty for any other.
        now: the machine as it is; `origin` if None.
        past: earlier states of the machine, the latest last.
        exaggeration: the factor on deflections in the shape shown; None to choose one for every load.
    """

    origin: Machine
    name: str = ""
    now: Machine | None = None
    past: tuple[Machine, ...] = ()
    exaggeration: float | None = None


class Session:
    """A machine and its history.

    Numbers change by `slide` (a slider), `move` (a handle, the map, a moving machine) and `write` (a field), the whole
    machine by `take`. All changes of the same numbers are one step of the history, which is open until `settle`.

    Attributes:
        machine: the machine as it is now; its pose may be out of reach.
        origin: the machine as it was loaded.
        name: the name of a bundled machine; empty for any other.
        exaggeration: factor of its deflected shape, None to choose one for every load; it has no history.
    """

    def __init__(self, memory: Memory) -> None:
        """Go on from what is remembered."""
        self._start(memory)

    def _start(self, memory: Memory) -> None:
        machine, self.name = memory.origin, memory.name
        self.origin = machine
        self.machine = memory.now or machine
        length = float(state_of(machine).configuration.length)
        self._controls = {control.path: control for control in controls(machine, length)}
        self.exaggeration = memory.exaggeration
        self._past = [*memory.past]
        self._future: list[Machine] = []
        self._open_step: tuple[str, ...] = ()  # paths of the numbers that change until `settle`; nothing can be redone

    @property
    def controls(self) -> dict[str, Control]:
        """The machine's numbers with their ranges, which stay fixed so that sliders do not move under the hand."""
        loaded = self.machine.loaded
        return {path: control for path, control in self._controls.items() if loaded or not control.of_loads}

    @property
    def memory(self) -> Memory:
        """The state from which another session can go on."""
        return Memory(self.origin, self.name, self.machine, tuple(self._past), self.exaggeration)

    def open(self, name: str) -> None:
        """Open a bundled machine.

        Raises:
            InputError: no bundled machine has this name; the session stays as it was.
        """
        if name not in bundled():
            raise InputError(f"{shorten(name)} is not a bundled machine; choose one of {', '.join(bundled())}.")
        self._start(Memory(load(name), name))

    def open_bytes(self, data: bytes, name: str) -> None:
        """Open a machine file that was sent by the browser.

        Raises:
            InputError: it is too large, is not text, or has a mistake; the session stays as it was.
        """
        self._start(Memory(build(text_of(data, name), name)))

    def take(self, machine: Machine, typed: bool = False) -> bool:
        """Take another design: as a change that can be undone if it is of the same kind, else as a new machine.

        Args:
            machine: the design.
            typed: whether it was typed as text; what is typed without another change in between is one step.

        Returns:
            Whether it is of the same kind, so that all controls are still valid.
        """
        same_family = machine.family.name == self.machine.family.name
        if not same_family or values(machine).keys() != values(self.machine).keys():
            self._start(Memory(machine))
            return False
        step = (TYPED_TEXT,) if typed else ()
        if not typed or self._open_step != step:
            self._close_step()
            self._note()
        self.machine, self._open_step = machine, step
        return True

    def value(self, path: str) -> float:
        """Return the SI value of a control; the first one if it moves several entries."""
        return float(values(self.machine)[self.controls[path].parameter.leaves[0]])

    def values(self) -> dict[str, float]:
        """Return the SI values of all controls."""
        present = values(self.machine)
        return {path: float(present[control.parameter.leaves[0]]) for path, control in self.controls.items()}

    def slide(self, path: str, position: int) -> None:
        """Move a slider; all movements until `settle` are one step of the history.

        Raises:
            InputError: the machine cannot have this value; it stays as it was.
        """
        control = self.controls[path]
        self.move(dict.fromkeys(control.parameter.leaves, control.value_at(position)))

    def settle(self) -> None:
        """End the open step, and check the numbers that changed against all others.

        Raises:
            InputError: the numbers contradict each other; the machine is again as it was before the step.
        """
        paths, self._open_step = self._open_step, ()
        if any(path != TYPED_TEXT and is_checked_against_others(self.machine, path) for path in paths):
            try:
                self.machine = read_again(self.machine)
            except InputError:
                self.machine = self._past.pop()
                raise

    def write(self, path: str, text: str) -> None:
        """Set a number from what was typed: `typed_value` in the unit that its field shows, or a word such as "rigid".

        Raises:
            InputError: the text is not such a number, or the machine cannot have it.
        """
        self.settle()
        parameter = self.controls[path].parameter
        unit = unit_shown(parameter.quantity, self.value(path), self.machine.display)
        value = read_typed(parameter, text, unit)
        present = values(self.machine)
        if any(present[leaf] != value for leaf in parameter.leaves):
            self.move(dict.fromkeys(parameter.leaves, value))
            self.settle()

    def move(self, numbers: Mapping[str, float]) -> None:
        """Set several numbers at once, in SI, as a click on the map does; repeated moves of the same are one step.

        Raises:
            InputError: the machine cannot have them, or those that were changed before contradict each other.
        """
        step = tuple(numbers)
        if self._open_step != step:
            self.settle()
        machine = self.machine.with_drafted_values(numbers)  # first, so that a refusal leaves no step in the history
        if self._open_step != step:
            self._note()
        self.machine, self._open_step = machine, step

    def show_loaded(self, loaded: bool) -> None:
        """Show the machine at rest under its loads, or without them, as `state` in [load] says it."""
        if loaded is not self.machine.loaded:
            self._close_step()
            self._note()
            self.machine = replace(self.machine, loaded=loaded)

    def _close_step(self) -> bool:
        """Settle before the machine is replaced; return False where the open step has been taken back instead."""
        try:
            self.settle()
        except InputError:
            return False
        return True

    def _note(self) -> None:
        """Add the present machine to the history; a new branch begins, so nothing can be redone."""
        self._past = [*self._past[-MOST_UNDONE_STEPS + 1 :], self.machine]
        self._future.clear()

    @property
    def can_undo(self) -> bool:
        return bool(self._past)

    @property
    def can_redo(self) -> bool:
        return bool(self._future)

    def undo(self) -> None:
        """Go back by one step, if there is one."""
        if self._close_step() and self._past:
            self._future.append(self.machine)
            self.machine = self._past.pop()

    def redo(self) -> None:
        """Take back the last undo, if there is one."""
        if self._future:
            self._past.append(self.machine)
            self.machine = self._future.pop()

    def reset(self) -> None:
        """Return to the machine as it was loaded; this can be undone."""
        self._close_step()
        if self.machine is not self.origin:
            self._note()
            self.machine = self.origin

    def as_file(self) -> tuple[str, bytes]:
        """Return a file name and the machine as TOML."""
        return f"{file_stem(self.machine.name)}.toml", as_file(self.machine).encode()


def read_typed(parameter: Parameter, text: str, shown_unit: str) -> float:
    """Return the SI value that was typed into the field of a parameter, which shows numbers in `shown_unit`.

    Raises:
        InputError: the text is not such a number.
    """
    quantity = parameter.quantity
    if quantity.unset is not None and text.strip().lower() == quantity.show(quantity.unset):
        return quantity.unset
    try:
        return typed_value(text, quantity.kind, shown_unit)
    except UnitError as error:
        raise InputError(f"{parameter.shown} is {shorten(text)}: {error}.") from None


def file_stem(name: str) -> str:
    """Return the name of a machine as that of a file."""
    return "".join(c if c.isalnum() and c.isascii() else "-" for c in name.lower()).strip("-") or "machine"

"""Machines that a designer keeps: one file each, with a note. Knows no page."""

from dataclasses import dataclass, replace
from pathlib import Path

from kinetostat.machine.loading import as_toml, load
from kinetostat.machine.machine import Machine
from kinetostat.spec.document import read
from kinetostat.spec.errors import InputError
from kinetostat.studies.storage import write_text
from kinetostat.studio.design.place import numbered, slug

MOST = 100
"""Machines that are kept."""
LONGEST_NAME, LONGEST_NOTE = 80, 400
REMARK = "# "


@dataclass(frozen=True)
class Favourite:
    """A machine that is kept.

    Attributes:
        number: of it.
        path: of its machine file, which every command reads.
        name: of the machine.
        note: what the designer wrote about it.
    """

    number: int
    path: Path
    name: str
    note: str

    def machine(self) -> Machine:
        """Read it.

        Raises:
            InputError: its file has been changed and has a mistake, or is gone.
        """
        return load(self.path)


class Favourites:
    """All machines that are kept below a state folder."""

    def __init__(self, state: Path) -> None:
        """Those below `state`; nothing is written before the first one."""
        self._place = state / "favourites"

    def every(self) -> list[Favourite]:
        """All of them, the latest first; the note is the comment that its file begins with."""
        found = []
        for number, path in numbered(self._place).items():
            try:
                name = str(read(path).get("name", path.stem))
                first = path.read_text("utf-8").partition("\n")[0]
            except (OSError, InputError):
                continue
            found.append(Favourite(number, path, name, first.removeprefix(REMARK) if first.startswith(REMARK) else ""))
        return found

    def keep(self, machine: Machine, name: str, note: str = "") -> Favourite:
        """Keep a machine under a name.

        Raises:
            InputError: no name, or one that is too long; too many are kept; the folder cannot be written.
        """
        said, remark = _printable(name), _printable(note)
        if not said or len(said) > LONGEST_NAME:
            raise InputError(f"the name of a favourite must have 1 to {LONGEST_NAME} characters.")
        if len(remark) > LONGEST_NOTE:
            raise InputError(f"the note has {len(remark)} characters; at most {LONGEST_NOTE} are kept.")
        held = numbered(self._place)
        if len(held) >= MOST:
            raise InputError(f"{MOST} favourites are kept already; delete one that is no longer needed.")
        number = max(held, default=0) + 1
        path = self._place / f"{number:04d}-{slug(said, 'machine')}.toml"
        head = f"{REMARK}{remark}\n" if remark else ""
        write_text(path, head + as_toml(replace(machine, name=said)))
        return Favourite(number, path, said, remark)

    def delete(self, number: int) -> None:
        """Forget one."""
        path = numbered(self._place).get(number)
        if path is not None:
            path.unlink(missing_ok=True)


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text).strip()

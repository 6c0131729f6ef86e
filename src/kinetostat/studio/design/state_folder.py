"""The state folder, which outlives the page: where it is, its numbered entries, and the favourite machines in it.

The searches in it are those of `runs`.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path

from kinetostat.frozen import dataclass
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.machine.saving import as_file
from kinetostat.spec.document import read
from kinetostat.spec.errors import InputError
from kinetostat.studies.storage import write_text

MOST_FAVOURITES = 100
"""Machines that are kept: more than anybody reads in a list."""
LONGEST_FAVOURITE_NAME, LONGEST_FAVOURITE_NOTE = 80, 400
"""Characters of a name and of a note: a line, and some sentences of a list."""
LONGEST_SLUG = 40
"""Characters of a study's or a machine's name in that of its file: with its number, a listing still shows it whole."""
RUNS, FAVOURITES = "runs", "favourites"
"""Folders of searches and of machines that are kept, in the state folder."""
REMARK = "# Note:"
"""The beginning of the first line of a favourite; files of earlier versions have the bare note as a comment."""


def usual_state() -> Path:
    """Return the state folder among the user's data, by the custom of the operating system."""
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Application Support"
    else:
        base = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    return base / "kinetostat" / "studio"


def check_state(folder: Path) -> None:
    """Check that a state folder can be read, or is not there yet.

    Raises:
        InputError: a file is in its place, or the folder or its runs may not be read.
    """
    for path in (folder, folder / RUNS, folder / FAVOURITES):
        try:
            next(path.iterdir(), None)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise InputError(
                f'"{path}" cannot be read: {error.strerror}; choose another folder with --state.'
            ) from None


def slug(name: str, otherwise: str) -> str:
    """Return a name as part of a file name: letters, digits and single hyphens; `otherwise` if none are left."""
    hyphenated = "".join(c if c.isalnum() and c.isascii() else "-" for c in name.lower())
    return "-".join(part for part in hyphenated.split("-") if part)[:LONGEST_SLUG] or otherwise


def numbered_entries(folder: Path) -> dict[int, Path]:
    """Return the entries of a folder whose names begin with a number of four digits, the latest first.

    A folder that is not there has none, and one that cannot be read shows none.
    """
    try:
        paths = list(folder.iterdir())
    except OSError:
        paths = []
    numbered = {int(path.name[:4]): path for path in paths if path.name[:4].isdecimal() and path.name[4:5] == "-"}
    return dict(sorted(numbered.items(), reverse=True))


@dataclass(frozen=True)
class Favourite:
    """A machine that is kept.

    Attributes:
        number: its number, with which the name of its file begins.
        path: the path of its machine file, which every command reads.
        name: the name of the machine.
        note: the designer's words about it.
    """

    number: int
    path: Path
    name: str
    note: str

    def machine(self) -> Machine:
        """Read the machine from its file.

        Raises:
            InputError: the file has been changed and has a mistake, or is gone.
        """
        return load(self.path)


class Favourites:
    """All machines that are kept in a state folder: a machine file each, its note as the first comment."""

    def __init__(self, state: Path) -> None:
        """Favourites below `state`; nothing is written before the first one."""
        self._folder = state / FAVOURITES

    def entries(self) -> list[Favourite]:
        """Return all favourites, the latest first; files that cannot be read are left out."""
        favourites = []
        for number, path in numbered_entries(self._folder).items():
            try:
                name = str(read(path).get("name", path.stem))
                first_line = path.read_text("utf-8").partition("\n")[0]
            except (OSError, InputError):
                continue
            note = first_line.removeprefix(REMARK).removeprefix("# ").strip() if first_line.startswith("#") else ""
            favourites.append(Favourite(number, path, name, note))
        return favourites

    def keep(self, machine: Machine, name: str, note: str = "") -> Favourite:
        """Keep a machine under a name.

        Raises:
            InputError: the name is empty or too long, too many machines are kept, or the folder cannot be written.
        """
        name, note = _printable(name), _printable(note)
        if not name or len(name) > LONGEST_FAVOURITE_NAME:
            raise InputError(
                f"the name has {len(name)} characters; the name of a favourite has 1 to {LONGEST_FAVOURITE_NAME}."
            )
        if len(note) > LONGEST_FAVOURITE_NOTE:
            raise InputError(f"the note has {len(note)} characters; it may have at most {LONGEST_FAVOURITE_NOTE}.")
        present = numbered_entries(self._folder)
        if len(present) >= MOST_FAVOURITES:
            raise InputError(
                f"{MOST_FAVOURITES} favourites are kept, the most there may be; delete one that you no longer need."
            )
        number = max(present, default=0) + 1
        path = self._folder / f"{number:04d}-{slug(name, 'machine')}.toml"
        lines = as_file(replace(machine, name=name)).splitlines(keepends=True)
        content = lines[1:] if lines[0].startswith(REMARK) else lines
        write_text(path, "".join([f"{REMARK} {note}".rstrip() + "\n", *content]))
        return Favourite(number, path, name, note)

    def delete(self, number: int) -> None:
        """Delete a favourite; nothing happens if it is gone already."""
        path = numbered_entries(self._folder).get(number)
        if path is not None:
            path.unlink(missing_ok=True)


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text).strip()

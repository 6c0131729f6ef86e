"""Where the studio keeps what must outlive a page: searches and favourites. Nothing is written here."""

import os
import sys
from pathlib import Path


def usual_state() -> Path:
    """The folder for it among the user's data."""
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Application Support"
    else:
        base = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    return base / "kinetostat" / "studio"


def slug(name: str, otherwise: str) -> str:
    """A name as part of the name of a file."""
    kept = "".join(c if c.isalnum() and c.isascii() else "-" for c in name.lower())
    return "-".join(part for part in kept.split("-") if part)[:40] or otherwise


def numbered(folder: Path) -> dict[int, Path]:
    """What a folder holds under names that begin with a number, by that number, the latest first."""
    found = folder.iterdir() if folder.is_dir() else ()
    known = {int(path.name[:4]): path for path in found if path.name[:4].isdecimal() and path.name[4:5] == "-"}
    return dict(sorted(known.items(), reverse=True))

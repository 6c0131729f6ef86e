"""Machines, answers and figures as files, by the suffix of the path. What is in them is made elsewhere."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, choice
from kinetostat.studies.storage import replacing, write_dataset, write_text
from kinetostat.studies.workspace.workspace import Workspace
from kinetostat.views.answers import kind_of
from kinetostat.views.figures import FORMATS, save_figure
from kinetostat.views.picture import Picture, machine_picture
from kinetostat.views.scene.glb import glb
from kinetostat.views.scene.machine_scene import scene_of

Writer = Callable[[Path], None]


def save(what: object, path: str | Path) -> Path:
    """Write something to a file, whole or not at all; the suffix says as what.

    Args:
        what: a machine (.toml; .png, a picture; .glb, its solids), an answer (.json), a grid or a workspace (.json,
            .nc), a figure (.png, .svg, .pdf), a picture (.png).
        path: of the file; one that is there is replaced.

    Returns:
        The path.

    Raises:
        InputError: there is no such way to keep it, or the place cannot be written.
    """
    place = Path(path)
    writers = _writers(what)
    writers[choice(place.suffix.lower(), writers, f'the suffix of "{place}"')](place)
    return place


def _writers(what: object) -> dict[str, Writer]:
    """How something can be written, by suffix."""
    match what:
        case Figure():
            return dict.fromkeys((f".{name}" for name in FORMATS), lambda path: save_figure(what, path))
        case Picture():
            return {".png": lambda path: _write_bytes(path, what)}
        case Machine():
            return {
                ".toml": lambda path: write_text(path, as_toml(what)),
                ".png": lambda path: _write_bytes(path, machine_picture(what)),
                ".glb": lambda path: _write_bytes(path, glb(scene_of(what))),
            }
    data = kind_of(what).data
    if data is None:
        raise InputError(f"A {type(what).__name__} cannot be saved.")
    written: dict[str, Writer] = {".json": lambda path: _write_json(path, data(what))}
    match what:
        case xr.Dataset():
            written[".nc"] = lambda path: write_dataset(path, what)
        case Workspace():
            written[".nc"] = lambda path: write_dataset(path, what.dataset)
    return written


def _write_json(path: Path, data: dict[str, Any]) -> None:
    write_text(path, json.dumps(data, ensure_ascii=False, allow_nan=False, indent=1) + "\n")


def _write_bytes(path: Path, data: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(data)

"""The machine's solids at its pose as GLB for 3-D viewers and as STEP for CAD programs.

The solids themselves are made by `views.scene`; Open CASCADE, which writes STEP, is imported only when STEP is wanted.
"""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kinetostat.spec.errors import InputError
from kinetostat.spec.installation import extra_command
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_bytes
from kinetostat.views.scene.glb import glb
from kinetostat.views.scene.machine_scene import scene_of

NEEDED = "STEP needs Open CASCADE, which "
MISSING = "is not installed; install it with `{}`."
BROKEN = "does not start: {reason}. On Debian and Ubuntu: apt-get install libgl1 libx11-6."


def write_glb(analysis: Analysis, path: Path) -> list[Path]:
    """Write the machine at its pose as binary glTF: metres, y up."""
    return _write(glb(scene_of(analysis.machine)), path)


def write_step(analysis: Analysis, path: Path) -> list[Path]:
    """Write the machine at its pose as STEP: mm, z up.

    Raises:
        InputError: Open CASCADE is not installed, or lacks a library of the system.
    """
    return _write(_step_writer().step_bytes(scene_of(analysis.machine), analysis.machine.name), path)


def _write(content: bytes, path: Path) -> list[Path]:
    write_bytes(path, content)
    return [path]


def _step_writer() -> Any:
    if find_spec("OCP") is None:
        raise InputError(NEEDED + MISSING.format(extra_command("cad")))
    try:
        return import_module("kinetostat.exchange.step_file")
    except ImportError as error:
        raise InputError(NEEDED + BROKEN.format(reason=error)) from None

"""The machine's solids as STEP: what `views.scene` shows of it, for CAD programs."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import replacing
from kinetostat.views.scene.machine_scene import scene_of

INSTALL = "STEP needs Open CASCADE, which is not installed; install it with: pip install 'kinetostat[cad]'."


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the machine at its pose, in mm, z up.

    Raises:
        InputError: Open CASCADE is not installed.
    """
    if find_spec("OCP") is None:
        raise InputError(INSTALL)
    writer: Any = import_module("kinetostat.exchange.step_file")
    content = writer.step_bytes(scene_of(analysis.machine), analysis.machine.name)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    return [path]

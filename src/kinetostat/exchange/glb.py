"""The machine's solids as glTF binary: what `views.scene` shows of it, written to a file."""

from pathlib import Path

from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import replacing
from kinetostat.views.scene.glb import glb
from kinetostat.views.scene.machine_scene import scene_of


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the machine at its pose, in metres, y up, as glTF wants it."""
    with replacing(path) as temporary:
        temporary.write_bytes(glb(scene_of(analysis.machine)))
    return [path]

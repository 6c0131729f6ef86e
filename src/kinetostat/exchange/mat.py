"""K, C, pose and reference point as a MATLAB file (level 5), under names that MATLAB takes. Computes nothing."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from kinetostat.exchange.results import UNITS, pose_of, reference_point
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import replacing


def variables(analysis: Analysis) -> dict[str, Any]:
    """What the file holds: K and C are [] where they are not finite; `units` names the unit of everything else."""
    if analysis.platform is None:
        raise ValueError("an analysis without an answer has no results")
    position, rotation = analysis.platform
    pose = {_name(name.removeprefix("pose_")): variable for name, variable in pose_of(analysis).items()}
    return {
        "name": analysis.machine.name,
        "K": _matrix(analysis.stiffness),
        "C": _matrix(analysis.compliance),
        "order": np.array(analysis.components, dtype=object),
        "axes": analysis.axes,
        "reference_point": np.array([reference_point(analysis)]).T,
        "platform_position": np.array([position]).T,
        "platform_rotation": np.array(rotation),
        "pose": {name: float(value) for name, (_, value, _) in pose.items()},
        "units": {
            "K": ", ".join(UNITS["stiffness"]),
            "C": ", ".join(UNITS["compliance"]),
            "reference_point": "m, base frame",
            "platform_position": "m, base frame",
            "pose": {name: said["units"] for name, (_, _, said) in pose.items()},
        },
    }


def _matrix(rows: list[list[float]] | None) -> Any:
    return np.zeros((0, 0)) if rows is None else np.array(rows)


def _name(text: str) -> str:
    """A name that MATLAB takes for a field: letters, digits and underscores, a letter first, at most 63."""
    return re.sub(r"\W", "_", text if text[:1].isalpha() else f"x{text}", flags=re.ASCII)[:63]


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the file."""
    with replacing(path) as temporary:
        savemat(temporary, variables(analysis), appendmat=False, long_field_names=True, oned_as="column")
    return [path]

"""K at the tool point for Ansys Mechanical APDL: a MATRIX27 between a fixed node and the tool's, at one place."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kinetostat.exchange.tool_stiffness import GROUND, TOOL, ToolStiffness, comments, tool_stiffness
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text

PER_COMMAND = 6
"""Constants that one command takes."""


def text_of(stiffness: ToolStiffness) -> str:
    """Commands for nodes, element type and its 78 constants: the upper triangle of the 12 x 12, row by row.

    Both nodes lie at the tool point, so that moving them together strains nothing.
    """
    at = ",".join(repr(c) for c in stiffness.point)
    lines = [
        comments(stiffness, "!").rstrip("\n"),
        "! Read it in /PREP7; numbers of nodes, element type and constants may be changed.",
        f"N,{GROUND},{at}",
        f"N,{TOOL},{at}",
        "ET,1,MATRIX27",
        "KEYOPT,1,2,0          ! symmetric",
        "KEYOPT,1,3,4          ! stiffness",
        *_constants(stiffness),
        "TYPE,1",
        "REAL,1",
        f"E,{GROUND},{TOOL}",
        f"D,{GROUND},ALL,0",
    ]
    return "\n".join(lines) + "\n"


def _constants(stiffness: ToolStiffness) -> Iterator[str]:
    own = stiffness.matrix
    whole = np.block([[own, 0.0 - own], [0.0 - own, own]])  # 0 - 0 is 0, where -0 would be written as -0
    constants = whole[np.triu_indices(len(whole))].tolist()
    for first in range(0, len(constants), PER_COMMAND):
        command = "R,1" if first == 0 else "RMORE"
        yield ",".join([command, *(repr(c) for c in constants[first : first + PER_COMMAND])])


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the commands.

    Raises:
        InputError: if K is not finite.
    """
    write_text(path, text_of(tool_stiffness(analysis)))
    return [path]

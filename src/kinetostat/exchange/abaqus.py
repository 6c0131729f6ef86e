"""K at the tool point for Abaqus: a linear user element with one node, to be included in a model."""

from pathlib import Path

from kinetostat.exchange.tool_stiffness import TOOL, ToolStiffness, comments, tool_stiffness
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text

PER_LINE = 4
"""Entries of a matrix in one line."""


def text_of(stiffness: ToolStiffness) -> str:
    """The element and its matrix, the lower triangle row by row, as Abaqus itself writes element matrices."""
    lines = [
        comments(stiffness, "**").rstrip("\n"),
        "*NODE, NSET=TOOL",
        ", ".join([str(TOOL), *(repr(c) for c in stiffness.point)]),
        "*USER ELEMENT, TYPE=U1, NODES=1, LINEAR",
        ", ".join(str(number) for number in stiffness.present),
        "*MATRIX, TYPE=STIFFNESS",
    ]
    for place, row in enumerate(stiffness.present, 1):
        entries = [repr(float(stiffness.matrix[row - 1, column - 1])) for column in stiffness.present[:place]]
        lines += [", ".join(entries[at : at + PER_LINE]) for at in range(0, place, PER_LINE)]
    lines += ["*ELEMENT, TYPE=U1, ELSET=MACHINE", f"1, {TOOL}", "*UEL PROPERTY, ELSET=MACHINE"]
    return "\n".join(lines) + "\n"


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the text to include.

    Raises:
        InputError: if K is not finite.
    """
    write_text(path, text_of(tool_stiffness(analysis)))
    return [path]

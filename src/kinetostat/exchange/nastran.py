"""K at the tool point for Nastran: a direct matrix (DMIG) on one grid point, selected by K2GG.

DMIG rather than GENEL or CBUSH: GENEL wants a flexibility and its rigid motions, CBUSH has no coupling.
"""

from itertools import count
from pathlib import Path

from kinetostat.exchange.tool_stiffness import TOOL, ToolStiffness, comments, tool_stiffness
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text

NAME = "KTOOL"
WIDTH = 16
"""Characters of a field in the large format."""


def text_of(stiffness: ToolStiffness) -> str:
    """Bulk data: a grid point and the lower triangle of K, in the large format, which keeps ten digits."""
    lines = [
        comments(stiffness, "$") + f"$ Select it with K2GG = {NAME} in the case control section.",
        _card("GRID*", str(TOOL), "", *(_number(c) for c in stiffness.point[:2])),
        _card("*", _number(stiffness.point[2])),
        f"DMIG    {NAME:<8}{0:>8}{6:>8}{2:>8}{0:>8}",
    ]
    for column in stiffness.present:
        entries = [row for row in stiffness.present if row >= column]
        lines.append(_card("DMIG*", NAME, str(TOOL), str(column)))
        for row in entries:
            value = float(stiffness.matrix[row - 1, column - 1])
            lines.append(_card("*", str(TOOL), str(row), _number(value)))
    return "\n".join(lines) + "\n"


def _card(name: str, *fields: str) -> str:
    return f"{name:<8}" + "".join(f"{field:>{WIDTH}}" for field in fields)


def _number(value: float) -> str:
    """A double-precision number that fits a field, with as many digits as do."""
    for digits in count(10, -1):
        text = f"{value:.{digits}E}".replace("E", "D")
        if len(text) <= WIDTH:
            return text
    raise ValueError("no number needs more than 16 characters")


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the bulk data.

    Raises:
        InputError: if K is not finite.
    """
    write_text(path, text_of(tool_stiffness(analysis)))
    return [path]

"""K at the tool point for finite-element programs: Nastran, Abaqus and Ansys Mechanical APDL.

All three get the machine as one linear elastic element at a node; K itself comes from the analysis.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.exchange.formats import ascii_line, reference_point
from kinetostat.frozen import dataclass
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text
from kinetostat.tolerances import ROUND_OFF_OF_COUPLING

DEGREES_OF_FREEDOM = ("x", "y", "z", "rx", "ry", "rz")
"""1 to 6 of a node in every finite-element program: kinetostat's rx ry rz x y z with the halves exchanged."""
TOOL, GROUND = 1, 2
"""Numbers of the nodes in the files."""
DMIG_NAME = "KTOOL"
"""Name of the matrix in the file for Nastran, by which K2GG selects it."""
FIELD_WIDTH = 16
"""Characters of a field in Nastran's large format."""
MOST_DIGITS = 10
"""Decimals of a positive number, whose exponent has two digits, that fill such a field."""
ENTRIES_PER_LINE = 4
"""Matrix entries in one line of an Abaqus file."""
CONSTANTS_PER_COMMAND = 6
"""Constants that one APDL command takes."""


@dataclass(frozen=True)
class ToolStiffness:
    """The machine as one elastic element between the ground and its tool point.

    Attributes:
        matrix: K, rows x y z rx ry rz, base axes, N/m, N/rad, N·m/rad [6 x 6]; rows that a planar machine lacks are 0.
        present: numbers, 1 to 6, of the degrees of freedom that the machine has.
        point: the tool point, base frame, m.
        notes: what a reader of the file must know, line by line.
    """

    matrix: Array
    present: tuple[int, ...]
    point: tuple[float, ...]
    notes: tuple[str, ...]


def tool_stiffness(analysis: Analysis) -> ToolStiffness:
    """Return the machine's K in the order of finite elements: translations first.

    Raises:
        InputError: if K is not finite, as these programs have no rigid directions.
    """
    if analysis.stiffness is None:
        raise InputError(
            "K is not finite at this pose, and a finite-element program cannot hold that; give every part a "
            "finite stiffness with --set, or export to csv, netcdf or mat, which hold C."
        )
    names = analysis.components
    matrix = np.zeros((6, 6))
    places = [DEGREES_OF_FREEDOM.index(name) for name in names]
    matrix[np.ix_(places, places)] = _without_round_off(np.array(analysis.stiffness))
    present = tuple(sorted(place + 1 for place in places))
    missing = [name for name in COMPONENTS if name not in names]
    plane = (f"The machine is planar: {' '.join(missing)} are absent, fix them.",) if missing else ()
    notes = (
        f"Cartesian stiffness of {ascii_line(analysis.machine.name)} at its tool point, by kinetostat.",
        "Order of the degrees of freedom: ux uy uz rotx roty rotz. (kinetostat's own order is rx ry rz x y z.)",
        "SI: N/m, N/rad, N.m/rad; node coordinates in m; axes of the machine's base.",
        "A wrench at the node moves it by the tool's deflection against the base of the machine.",
        *plane,
    )
    return ToolStiffness(matrix, present, tuple(reference_point(analysis)), notes)


def _without_round_off(matrix: Array) -> Array:
    """Return the symmetric matrix with exact zeros where an entry is only round-off."""
    sizes = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    return np.where(np.abs(matrix) > ROUND_OFF_OF_COUPLING * sizes, (matrix + matrix.T) / 2.0, 0.0)


def _comments(stiffness: ToolStiffness, mark: str) -> str:
    """Return the notes as lines that begin with a mark."""
    return "".join(f"{mark} {note}\n" for note in stiffness.notes)


def nastran_text(stiffness: ToolStiffness) -> str:
    """Write bulk data for Nastran: a grid point and a direct matrix (DMIG) on it, selected by K2GG.

    DMIG rather than GENEL or CBUSH: GENEL wants a flexibility and its rigid motions, and CBUSH has no coupling. The
    lower triangle of K is written in the large format, which keeps ten digits.
    """
    lines = [
        _comments(stiffness, "$") + f"$ Select it with K2GG = {DMIG_NAME} in the case control section.",
        _card("GRID*", str(TOOL), "", *(_nastran_number(c) for c in stiffness.point[:2])),
        _card("*", _nastran_number(stiffness.point[2])),
        f"DMIG    {DMIG_NAME:<8}{0:>8}{6:>8}{2:>8}{0:>8}",
    ]
    for column in stiffness.present:
        entries = [row for row in stiffness.present if row >= column]
        lines.append(_card("DMIG*", DMIG_NAME, str(TOOL), str(column)))
        for row in entries:
            value = float(stiffness.matrix[row - 1, column - 1])
            lines.append(_card("*", str(TOOL), str(row), _nastran_number(value)))
    return "\n".join(lines) + "\n"


def _card(name: str, *fields: str) -> str:
    return f"{name:<8}" + "".join(f"{field:>{FIELD_WIDTH}}" for field in fields)


def _nastran_number(value: float) -> str:
    """Return a double-precision number with as many digits as a field has room for."""
    texts = (f"{value:.{digits}E}".replace("E", "D") for digits in range(MOST_DIGITS, -1, -1))
    return next(text for text in texts if len(text) <= FIELD_WIDTH)


def abaqus_text(stiffness: ToolStiffness) -> str:
    """Write a linear user element with one node, to be included in an Abaqus model.

    The lower triangle of K stands row by row, as Abaqus itself writes element matrices.
    """
    lines = [
        _comments(stiffness, "**").rstrip("\n"),
        "*NODE, NSET=TOOL",
        ", ".join([str(TOOL), *(repr(c) for c in stiffness.point)]),
        "*USER ELEMENT, TYPE=U1, NODES=1, LINEAR",
        ", ".join(str(number) for number in stiffness.present),
        "*MATRIX, TYPE=STIFFNESS",
    ]
    for place, row in enumerate(stiffness.present, 1):
        entries = [repr(float(stiffness.matrix[row - 1, column - 1])) for column in stiffness.present[:place]]
        lines += [", ".join(entries[at : at + ENTRIES_PER_LINE]) for at in range(0, place, ENTRIES_PER_LINE)]
    lines += ["*ELEMENT, TYPE=U1, ELSET=MACHINE", f"1, {TOOL}", "*UEL PROPERTY, ELSET=MACHINE"]
    return "\n".join(lines) + "\n"


def ansys_text(stiffness: ToolStiffness) -> str:
    """Write APDL commands for a MATRIX27 element between a fixed node and the tool's.

    Both nodes lie at the tool point, so that moving them together strains nothing. The 78 constants of the element are
    the upper triangle of its 12 x 12 matrix, row by row.
    """
    at = ",".join(repr(c) for c in stiffness.point)
    lines = [
        _comments(stiffness, "!").rstrip("\n"),
        "! Read it in /PREP7; numbers of nodes, element type and constants may be changed.",
        f"N,{GROUND},{at}",
        f"N,{TOOL},{at}",
        "ET,1,MATRIX27",
        "KEYOPT,1,2,0          ! symmetric",
        "KEYOPT,1,3,4          ! stiffness",
        *_constants(stiffness.matrix),
        "TYPE,1",
        "REAL,1",
        f"E,{GROUND},{TOOL}",
        f"D,{GROUND},ALL,0",
    ]
    return "\n".join(lines) + "\n"


def _constants(matrix: Array) -> Iterator[str]:
    whole = np.block([[matrix, 0.0 - matrix], [0.0 - matrix, matrix]])  # 0 - 0 is 0; -0 would be written as -0
    constants = whole[np.triu_indices(len(whole))].tolist()
    for first in range(0, len(constants), CONSTANTS_PER_COMMAND):
        command = "R,1" if first == 0 else "RMORE"
        yield ",".join([command, *(repr(c) for c in constants[first : first + CONSTANTS_PER_COMMAND])])


def write_nastran(analysis: Analysis, path: Path) -> list[Path]:
    """Write K as Nastran bulk data; errors are those of `tool_stiffness`."""
    return _write(nastran_text, analysis, path)


def write_abaqus(analysis: Analysis, path: Path) -> list[Path]:
    """Write K as a user element for Abaqus; errors are those of `tool_stiffness`."""
    return _write(abaqus_text, analysis, path)


def write_ansys(analysis: Analysis, path: Path) -> list[Path]:
    """Write K as commands for Ansys; errors are those of `tool_stiffness`."""
    return _write(ansys_text, analysis, path)


def _write(text: Callable[[ToolStiffness], str], analysis: Analysis, path: Path) -> list[Path]:
    write_text(path, text(tool_stiffness(analysis)))
    return [path]

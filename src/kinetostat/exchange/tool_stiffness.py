"""K at the tool point as programs for finite elements want it: translations first. Writes nothing."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.exchange.names import plain
from kinetostat.exchange.results import reference_point
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis

Array = npt.NDArray[np.float64]

DEGREES_OF_FREEDOM = ("x", "y", "z", "rx", "ry", "rz")
"""1 to 6 of a node in every program for finite elements: our rx ry rz x y z, halves exchanged."""
ROUNDING = 1e-14
"""Share of the root of two diagonal entries below which the entry that couples them is the rounding of zero."""
TOOL, GROUND = 1, 2
"""Numbers of the nodes in the files."""


@dataclass(frozen=True)
class ToolStiffness:
    """The machine as one elastic element between the ground and its tool point.

    Attributes:
        matrix: K, rows x y z rx ry rz, base axes, N/m, N/rad, N·m/rad [6 x 6]; what a planar machine does not have
            is 0.
        present: numbers, 1 to 6, of the degrees of freedom that the machine has.
        point: the tool point, base frame, m.
        notes: what a reader of the file must know, line by line.
    """

    matrix: Array
    present: tuple[int, ...]
    point: tuple[float, ...]
    notes: tuple[str, ...]


def tool_stiffness(analysis: Analysis) -> ToolStiffness:
    """The machine's K in the order of finite elements.

    Raises:
        InputError: if K is not finite, as these programs have no rigid directions.
    """
    if analysis.stiffness is None:
        raise InputError(
            "K is not finite at this pose, and a program for finite elements cannot hold that; give every part a "
            "finite stiffness with --set, or take csv, netcdf or mat, which hold C."
        )
    names = analysis.components
    matrix = np.zeros((6, 6))
    places = [DEGREES_OF_FREEDOM.index(name) for name in names]
    matrix[np.ix_(places, places)] = _without_rounding(np.array(analysis.stiffness))
    present = tuple(sorted(place + 1 for place in places))
    missing = [name for name in COMPONENTS if name not in names]
    plane = (f"The machine is planar: {' '.join(missing)} are absent, fix them.",) if missing else ()
    notes = (
        f"Cartesian stiffness of {plain(analysis.machine.name)} at its tool point, by kinetostat.",
        "Order of the degrees of freedom: ux uy uz rotx roty rotz. (kinetostat's own order is rx ry rz x y z.)",
        "SI: N/m, N/rad, N.m/rad; node coordinates in m; axes of the machine's base.",
        "A wrench at the node moves it by the tool's deflection against the base of the machine.",
        *plane,
    )
    return ToolStiffness(matrix, present, tuple(reference_point(analysis)), notes)


def _without_rounding(matrix: Array) -> Array:
    """The symmetric matrix with exact zeros where an entry is but rounding."""
    sizes = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    return np.where(np.abs(matrix) > ROUNDING * sizes, (matrix + matrix.T) / 2.0, 0.0)


def comments(stiffness: ToolStiffness, mark: str) -> str:
    """The notes as lines that begin with a mark."""
    return "".join(f"{mark} {note}\n" for note in stiffness.notes)

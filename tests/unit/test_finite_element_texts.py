"""K for finite-element programs: each text, read as its program does, gives back the matrix."""

import numpy as np
import pytest

from kinetostat.exchange.finite_elements import abaqus_text, ansys_text, nastran_text, tool_stiffness
from kinetostat.machine.loading import load
from kinetostat.studies.analysis import analyze
from refusals import refused

MACHINES = ("hexapod", "zhang-gosselin-4dof", "passive-leg-5dof", "planar-3rpr")
FORCES_FIRST = [3, 4, 5, 0, 1, 2]
SMALL = 1e-13
"""Of the diagonal: entries below are written as 0."""


def expected(found):
    """K of the analysis, six by six, translations first."""
    names = ["rx", "ry", "rz", "x", "y", "z"]
    places = [names.index(name) for name in found.components]
    matrix = np.zeros((6, 6))
    matrix[np.ix_(places, places)] = found.stiffness
    return matrix[np.ix_(FORCES_FIRST, FORCES_FIRST)]


def same(matrix, wanted, share):
    sizes = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
    return np.all(np.abs(matrix - wanted) <= share * np.abs(wanted) + SMALL * sizes)


def read_dmig(text):
    """Large fields of 16 characters; the first entry of a column names its degree of freedom."""
    matrix = np.zeros((6, 6))
    column = None
    for line in text.splitlines():
        fields = [line[at : at + 16].strip() for at in range(8, len(line), 16)]
        if line.startswith("DMIG*"):
            assert fields[:2] == ["KTOOL", "1"]
            column = int(fields[2])
        elif line.startswith("DMIG "):
            assert line.split() == ["DMIG", "KTOOL", "0", "6", "2", "0"]
        elif line.startswith("*") and column is not None:
            row = int(fields[1])
            assert row >= column, "either half, not both"
            matrix[row - 1, column - 1] = matrix[column - 1, row - 1] = float(fields[2].replace("D", "E"))
    return matrix


def read_user_element(text):
    """Abaqus: the lower triangle, each row on a line of its own, four entries a line."""
    lines = text.splitlines()
    start = lines.index("*MATRIX, TYPE=STIFFNESS")
    present = [int(number) for number in lines[start - 1].split(",")]
    entries = []
    for line in lines[start + 1 :]:
        if line.startswith("*"):
            break
        assert len(line.split(",")) <= 4
        entries += [float(entry) for entry in line.split(",")]
    matrix = np.zeros((6, 6))
    for (i, j), entry in zip(np.argwhere(np.tri(len(present), dtype=bool)), entries, strict=True):
        row, column = present[i] - 1, present[j] - 1
        matrix[row, column] = matrix[column, row] = entry
    return matrix


def read_matrix27(text):
    """Ansys: 78 constants, the upper triangle of the 12 x 12 row by row."""
    lines = [line for line in text.splitlines() if line.startswith(("R,1,", "RMORE,"))]
    constants = [float(c) for line in lines for c in line.removeprefix("R,1,").removeprefix("RMORE,").split(",")]
    upper = np.zeros((12, 12))
    upper[np.triu_indices(12)] = constants
    whole = upper + upper.T - np.diag(np.diag(upper))
    assert np.array_equal(whole[:6, :6], whole[6:, 6:])
    assert np.array_equal(whole[:6, :6], -whole[:6, 6:]), "moved together, the two nodes strain nothing"
    return whole[:6, :6]


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize(
    ("write", "reader", "share"),
    [(nastran_text, read_dmig, 1e-9), (abaqus_text, read_user_element, 1e-15), (ansys_text, read_matrix27, 1e-15)],
    ids=["nastran", "abaqus", "ansys"],
)
def test_the_text_gives_back_the_matrix(write, reader, share, name):
    found = analyze(load(name))
    text = write(tool_stiffness(found))
    assert same(reader(text), expected(found), share)
    assert "ux uy uz rotx roty rotz" in text
    assert text.isascii()


def test_the_constants_of_ansys_are_those_of_its_manual():
    """The manual's example: a spring K along x has C1 = C58 = K and C7 = -K."""
    found = tool_stiffness(analyze(load("hexapod")))
    constants = [c for line in ansys_text(found).splitlines() if line.startswith("R") for c in line.split(",")[1:]]
    constants = [float(c) for c in constants[1:]]
    assert constants[0] == constants[57] == -constants[6] == found.matrix[0, 0]


def test_nastran_fields_hold_any_number():
    found = analyze(load("zhang-gosselin-4dof", ["stiffness.passive_links=1e16"]))
    text = nastran_text(tool_stiffness(found))
    assert same(read_dmig(text), expected(found), 1e-8)
    assert all(len(line) <= 72 for line in text.splitlines() if not line.startswith("$"))


def test_an_infinite_stiffness_is_refused():
    found = analyze(load("zhang-gosselin-4dof", ["stiffness.passive_links=rigid"]))
    with refused(r"K is not finite at this pose.*csv, netcdf or mat"):
        tool_stiffness(found)

"""Hexapods published elsewhere: tdehaeze/stewart-simscape (MIT), as bare legs and as the bundled machines."""

import math

import numpy as np
import pytest

from kinetostat.algebra.vector import IDENTITY, ZERO, Displacement, Vector
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Configuration
from kinetostat.machine.parts import two_force_legs
from kinetostat.studies.analysis import analyze
from numeric import answer, array


def hexapod(base, platform, reference, stiffness):
    legs = two_force_legs(base, platform, [stiffness] * len(base))
    return answer(Configuration(Displacement(IDENTITY, reference), tuple(legs), (), 0.1))


def ring(radius, height, degrees):
    return [Vector(radius * math.cos(a), radius * math.sin(a), height) for a in map(math.radians, degrees)]


GENERAL = hexapod(
    ring(0.115, 0.015, (-10, 10, 110, 130, 230, 250)),
    ring(0.090, 0.075, (-50, 50, 70, 170, 190, -70)),
    Vector(0.0, 0.0, 0.135),
    20e6,
)
PUBLISHED = {
    ("rx", "rx"): (5.2e-6, 5.186272e-6),
    ("ry", "ry"): (5.2e-6, 5.186272e-6),
    ("rz", "rz"): (1.7e-6, 1.707296e-6),
    ("x", "x"): (4.7e-8, 4.749957e-8),
    ("y", "y"): (4.7e-8, 4.749957e-8),
    ("z", "z"): (2.1e-8, 2.099046e-8),
    ("x", "ry"): (3.2e-7, 3.209330e-7),
    ("y", "rx"): (3.2e-7, 3.209330e-7),
}
"""Absolute entries of C: printed to two digits there, and computed to seven (REFERENCE.md)."""
ORDER = ("rx", "ry", "rz", "x", "y", "z")


@pytest.mark.parametrize("entry", PUBLISHED)
def test_a_general_hexapod(entry):
    """To one unit in the second printed digit: x = 4.74996e-8 is printed 4.7e-8, cut or rounded."""
    row, column = (ORDER.index(name) for name in entry)
    value = abs(array(GENERAL.compliance)[row, column])
    two_digits, seven_digits = PUBLISHED[entry]
    assert value == pytest.approx(two_digits, rel=0.0125)
    assert value == pytest.approx(seven_digits, rel=3e-7)


def test_its_other_entries_vanish_by_symmetry():
    compliance = abs(array(GENERAL.compliance))
    for i, row in enumerate(ORDER):
        for j, column in enumerate(ORDER):
            if (row, column) not in PUBLISHED and (column, row) not in PUBLISHED:
                assert compliance[i, j] <= 1e-12 * math.sqrt(compliance[i, i] * compliance[j, j])


@pytest.mark.parametrize("size", [0.01, 0.1, 3.0])
def test_a_cubic_hexapod_has_a_diagonal_stiffness(size):
    """Struts along the edges of a cube that stands on a corner, reference point at its centre, edge Hc sqrt(3)."""
    edge, stiffness = size * math.sqrt(3), 1e6
    upright = np.array([[1, -1, 0], [1, 1, -2], [1, 1, 1]]) / np.sqrt([[2], [6], [3]])
    corners = {
        (i, j, k): Vector(*map(float, upright @ (edge * (np.array([i, j, k]) - 0.5))))
        for i in (0, 1)
        for j in (0, 1)
        for k in (0, 1)
    }
    low = [(1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 0, 1)]
    high = [(1, 1, 0), (1, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (0, 1, 1)]
    found = array(hexapod([corners[c] for c in low], [corners[c] for c in high], ZERO, stiffness).stiffness)
    expected = stiffness * np.diag([1.5 * size**2, 1.5 * size**2, 6 * size**2, 2, 2, 2])
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.all(abs(found - expected) <= 1e-12 * scale)


def test_the_bundled_hexapod_is_the_published_one():
    found = np.array(analyze(load("hexapod")).compliance)
    assert np.diag(found) == pytest.approx(
        [5.186272e-6, 5.186272e-6, 1.707296e-6, 4.749957e-8, 4.749957e-8, 2.099046e-8], rel=1e-6
    )
    assert [abs(found[3, 1]), abs(found[4, 0])] == pytest.approx([3.209330e-7, 3.209330e-7], rel=1e-6)


def test_the_bundled_cubic_hexapod_has_its_closed_form():
    height, k = 0.1, 20e6
    expected = k * np.diag([1.5 * height**2, 1.5 * height**2, 6 * height**2, 2.0, 2.0, 2.0])
    found = np.array(analyze(load("hexapod-cubic")).stiffness)
    scale = np.sqrt(np.diag(expected))
    assert np.abs((found - expected) / np.outer(scale, scale)).max() < 1e-12

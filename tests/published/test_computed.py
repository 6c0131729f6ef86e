"""Every computed number of `reference.json`, to 1e-9."""

import numpy as np
import pytest
from reference import COMPONENTS, COMPUTED, OPTIMISED, at, coefficients, design, reference, with_passive

from numeric import array, assert_blocks_close


@pytest.mark.parametrize("matrix", ["K", "C"])
def test_full_matrices_at_the_reference_pose(matrix):
    expected = np.array(reference()["reference_pose_k52_k54_1e3"][matrix])
    response = with_passive("1000")
    found = array(response.stiffness if matrix == "K" else response.compliance)
    assert found == pytest.approx(expected, rel=COMPUTED)


def test_full_compliance_with_a_rigid_passive_leg():
    """Its zeros are exact or the square of a rounding error: rotation about z and translation along y are held."""
    expected = np.array(reference()["reference_pose_rigid_passive_leg"]["C"])
    response = with_passive("rigid")
    assert_blocks_close(array(response.compliance), expected, COMPUTED)
    assert array(response.compliance)[expected != 0.0] == pytest.approx(expected[expected != 0.0], rel=COMPUTED)
    assert np.all(abs(array(response.compliance)[expected == 0.0]) < 1e-14)
    assert [k == float("inf") for k in response.stiffness.diagonal()] == [name in ("rz", "y") for name in COMPONENTS]


@pytest.mark.parametrize("passive", reference()["stiffness_sweep"])
def test_the_stiffness_sweep(passive):
    expected, response = reference()["stiffness_sweep"][passive], with_passive(passive)
    assert response.stiffness.diagonal() == pytest.approx(expected["K_diag"], rel=COMPUTED)
    assert response.compliance.diagonal() == pytest.approx(expected["C_diag"], rel=COMPUTED)


def test_the_optimised_design():
    expected = reference()["optimised_design_1e10"]
    found = design(*OPTIMISED, passive="1e10").compliance.diagonal()
    assert found == pytest.approx(expected["C_diag"], rel=COMPUTED)
    assert sum(found) == pytest.approx(expected["sum"], rel=COMPUTED)


@pytest.mark.parametrize(("lower", "upper"), [(69.04, 53.03), (68.78, 52.42)])
def test_the_minimum_of_the_papers_box(lower, upper):
    """Two points of its ridge (REFERENCE.md), rounded to 0.01 cm, and the bottom of the ridge beside each."""
    minimum = reference()["minimum_of_the_papers_box_rigid"]

    def objective(l52):
        return sum(design(14, 26, lower, l52, 66, 35, 55, passive="rigid").compliance.diagonal())

    assert objective(upper) == pytest.approx(minimum, abs=5e-8)
    assert bottom(objective, upper - 0.02, upper + 0.02) == pytest.approx(minimum, abs=1e-9)


def bottom(function, low, high):
    """Least value of a function with one valley, by cutting thirds off."""
    for _ in range(25):
        third = (high - low) / 3
        if function(low + third) < function(high - third):
            high -= third
        else:
            low += third
    return function(0.5 * (low + high))


COEFFICIENTS = {
    "rx": (0.00850551, 0.0, 0.0),
    "ry": (0.0262118, 0.0, 0.0),
    "rz": (0.00324089, 0.592593, 0.148148),
    "x": (0.0704587, 0.0, 0.0),
    "y": (0.301223, 0.961169, 0.961169),
    "z": (3.62832, 0.0, 0.0),
}
"""Factors of Ka, k52 and k54 in the diagonal of K (eqs. 33-38), to the six digits of REFERENCE.md."""


def test_the_coefficients_of_equations_33_to_38():
    found = dict(zip(COMPONENTS, coefficients(at()), strict=True))
    for name, expected in COEFFICIENTS.items():
        assert [float(f"{value:.6g}") for value in found[name]] == pytest.approx(expected, rel=1e-12, abs=1e-24)


def test_the_diagonal_of_k_is_affine_in_the_stiffnesses():
    """Eqs. 33-38 at other stiffnesses than they were found at."""
    response = at("stiffness.actuator=2345 N/m", 'stiffness.passive_links=["6e4 N*m/rad", "7e5 N*m/rad"]')
    expected = coefficients(at()) @ np.array([2345.0, 6e4, 7e5])
    assert response.stiffness.diagonal() == pytest.approx(expected, rel=COMPUTED)

"""Machines with more legs than freedoms: the force method against the sum of leg stiffnesses, and its rigid limits."""

import numpy as np
import pytest

from kinetostat.algebra.vector import Vector
from kinetostat.kinetostatics.assembly import compliance_matrix, solve_statics, stiffness_matrix
from kinetostat.machine.loading import load
from kinetostat.machine.parts import two_force_leg

EXTRA = (
    (Vector(0.3, 0.1, 0.0), Vector(0.02, 0.05, 0.13)),
    (Vector(-0.1, 0.2, 0.02), Vector(-0.06, -0.03, 0.12)),
)
LENGTH = 0.1


def redundant(extra_stiffness, own_stiffness="20 N/um"):
    """The hexapod with two more legs."""
    configuration = load("hexapod", [f"stiffness.actuator={own_stiffness}"]).configure()
    more = [two_force_leg(f"extra {i}", *ends, extra_stiffness) for i, ends in enumerate(EXTRA)]
    reference = configuration.platform.translation
    return solve_statics([leg.screws(reference, LENGTH) for leg in (*configuration.legs, *more)], LENGTH)


def matrices(statics):
    return np.array(stiffness_matrix(statics).rows()), np.array(compliance_matrix(statics).rows())


@pytest.mark.parametrize("extra", [1e3, 1e6, 20e6, 1e9])
def test_c_by_least_energy_is_the_inverse_of_the_sum_of_legs(extra):
    stiffness, compliance = matrices(redundant(extra))
    scale = np.repeat([1.0 / LENGTH, 1.0], 3)
    error = (stiffness @ compliance - np.eye(6)) * scale[:, None] / scale
    assert np.abs(error).max() < 1e-10


def test_rigid_extra_legs_hold_exactly_two_directions():
    _, rigid = matrices(redundant(float("inf")))
    _, near = matrices(redundant(1e15))
    scale = np.repeat([1.0 / LENGTH, 1.0], 3)
    scaled = rigid * scale[:, None] * scale
    assert np.abs((near - rigid) * scale[:, None] * scale).max() < 1e-7 * np.abs(scaled).max()
    assert np.linalg.matrix_rank(scaled, 1e-12 * np.abs(scaled).max(), hermitian=True) == 4


def test_rigid_everywhere_no_displacement_depends_on_what_statics_leaves_open():
    _, compliance = matrices(redundant(float("inf"), "rigid"))
    assert np.abs(compliance).max() == 0.0


def test_shares_of_energy_add_up():
    statics = redundant(5e6)
    loads = np.array([twist.components() for twist in statics.flexibility]).T
    total = (loads * np.array(statics.compliance)) @ loads.T
    np.testing.assert_allclose(total, matrices(statics)[1], rtol=1e-12, atol=1e-20)


def test_too_few_wrenches_are_singular_not_an_error():
    configuration = load("hexapod").configure()
    legs = [leg.screws(configuration.platform.translation, LENGTH) for leg in configuration.legs[:5]]
    assert solve_statics(legs, LENGTH).singularity_margin == 0.0

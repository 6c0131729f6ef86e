"""K and C of every machine: symmetric, positive, inverse to each other, and linear in what they are linear in."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.kinetostatics.assembly import flexible_stiffness
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.parameters import values, with_values
from machines import CONTRASTING, MODERATE, every_machine, machines, regular, regular_machines, stiffness_paths
from numeric import U, array, assert_blocks_close, assert_psd, dimensionless, trace_product

INVERSE = 1e-9
"""What K C may differ from 1 at moderate contrast.

K = sum_e k_e b_e b_e^T and C = sum_e s_e xi_e xi_e^T, and the computed b_e . xi_f differs from 1 or 0 by some rounding
units times |b_e| |xi_f|. So K C differs from 1 by at most c u sum_ef k_e |b_e|^2 s_f |xi_f|^2 = c u tr K tr C (in one
unit, moments divided by the length of the machine), with c below 2 over thousands of random machines. The product of
the traces is kept below `SPREAD`, so that this bound is 2e-10 c.
"""
SPREAD = 1e6
ROUNDINGS = 30
"""Bound on c at any contrast: a margin of more than ten over what was seen."""
every_contrast = pytest.mark.parametrize("stiffness", [MODERATE, CONTRASTING], ids=["moderate", "contrasting"])


def product_error(response, length):
    """K C - 1 [6 x 6] in one unit."""
    stiffness = dimensionless(response.stiffness, length, Wrench)
    return stiffness @ dimensionless(response.compliance, length, Twist) - np.eye(6)


@every_machine
@every_contrast
@given(data=st.data())
def test_both_are_symmetric_and_positive(case, stiffness, data):
    response = data.draw(regular(case, stiffness))
    length = float(response.configuration.length)
    assert_psd(response.stiffness, length, Wrench)
    assert_psd(response.compliance, length, Twist)
    assert min(response.stiffness.diagonal()) > 0.0
    assert min(response.compliance.diagonal()) > 0.0


@every_machine
@given(data=st.data())
def test_they_are_inverse_at_moderate_contrast(case, data):
    response = data.draw(regular(case))
    length = float(response.configuration.length)
    assume(trace_product(response.stiffness, response.compliance, length) < SPREAD)
    assert np.max(abs(product_error(response, length))) < INVERSE


@every_machine
@given(data=st.data())
def test_they_are_inverse_at_any_contrast_to_what_their_terms_allow(case, data):
    """Norm-wise to some rounding units of tr K tr C; entry by entry to 1e-9 of what the terms that cancel may be.

    In positive matrices |K_il C_lj| is at most sqrt(K_ii K_ll C_ll C_jj). The terms themselves would be no bound: an
    entry that is small by symmetry still has the rounding of the large ones that made it.
    """
    response = data.draw(regular(case, CONTRASTING))
    length = float(response.configuration.length)
    assert np.max(abs(product_error(response, length))) <= ROUNDINGS * U * trace_product(
        response.stiffness, response.compliance, length
    )
    stiffness, compliance = array(response.stiffness), array(response.compliance)
    k, c = np.sqrt(np.diag(stiffness)), np.sqrt(np.diag(compliance))
    assert np.all(abs(stiffness @ compliance - np.eye(6)) <= 1e-9 * np.outer(k, c) * (k @ c))


@every_machine
@every_contrast
@given(data=st.data())
def test_twice_the_stiffness_is_twice_k_and_half_c(case, stiffness, data):
    """Exactly: doubling is exact in binary, and both are linear in it."""
    machine = data.draw(machines(case, stiffness))
    now = values(machine)
    twice = respond(with_values(machine, {path: 2.0 * now[path] for path in stiffness_paths(machine)}))
    once = respond(machine)
    assert np.array_equal(array(twice.stiffness), 2.0 * array(once.stiffness))
    assert np.array_equal(array(twice.compliance), 0.5 * array(once.compliance))


@every_machine
@given(data=st.data())
def test_more_stiffness_anywhere_is_never_softer_in_any_direction(case, data):
    """Rayleigh: K(k + dk) - K(k) and C(k) - C(k + dk) are positive semi-definite, to the rounding of the larger."""
    machine = data.draw(regular_machines(case))
    path = data.draw(st.sampled_from(stiffness_paths(machine)))
    once, more = respond(machine), respond(with_values(machine, {path: 3.0 * values(machine)[path]}))
    length = float(once.configuration.length)
    for kind, soft, stiff in ((Wrench, once.stiffness, more.stiffness), (Twist, more.compliance, once.compliance)):
        low, high = dimensionless(soft, length, kind), dimensionless(stiff, length, kind)
        assert np.linalg.eigvalsh(high - low)[0] >= -20 * U * np.linalg.norm(high, 2)
        assert np.trace(high) > np.trace(low)


@every_machine
@given(data=st.data())
def test_the_sum_over_legs_is_the_same_stiffness(case, data):
    """Second route (DESIGN section 2, eq. 32): sum_i W_i G_i^-1 W_i^T knows neither W^-1 nor the springs' duals.

    Its inverse of G, as its only solve, costs the contrast within a leg: 1e3 here, times some hundred for geometry.
    """
    response = data.draw(regular(case))
    length = float(response.configuration.length)
    assume(trace_product(response.stiffness, response.compliance, length) < SPREAD)
    assert_blocks_close(array(flexible_stiffness(response.legs)), array(response.stiffness), 1e-9)

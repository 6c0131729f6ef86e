"""K and C of every machine: symmetric, positive, inverse to each other, and linear in what they are linear in."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.kinetostatics.assembly import flexible_stiffness
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import springs
from kinetostat.machine.parameters import values, with_values
from machines import CASES, CONTRASTING, MODERATE, elastic_machine, elastic_paths, every_machine, few, machines, regular
from numeric import (
    U,
    array,
    assert_blocks_close,
    assert_psd,
    lost,
    motions,
    reduced,
    respring,
    screw,
    trace_product,
)

INVERSE = 1e-9
"""What K C may differ from 1 at moderate contrast.

K = sum_e k_e b_e b_e^T and C = sum_e s_e xi_e xi_e^T, and the computed b_e . xi_f differs from 1 or 0 by some rounding
units times |b_e| |xi_f|. So K C differs from 1 by at most c u sum_ef k_e |b_e|^2 s_f |xi_f|^2 = c u tr K tr C (in one
unit, moments divided by the length of the machine), with c below 2 over thousands of random machines. The product of
the traces is kept below `SPREAD`, so that this bound is 2e-10 c.
"""
SPREAD = 1e6
ROUNDINGS = 30
"""Bound on c at any contrast: a margin of more than ten over what was seen, where legs are solved spring by spring."""
UNDERFLOW = 1e-290
"""Below it products have lost digits to the end of float64's range."""
FELT = 1e-6
"""Share of a spring in C from which the change it causes is surely not lost in rounding."""
every_contrast = pytest.mark.parametrize("stiffness", [MODERATE, CONTRASTING], ids=["moderate", "contrasting"])


def product_error(response):
    """K C - 1 over the motions that exist, in one unit."""
    stiffness, compliance = reduced(response, response.stiffness, Wrench), reduced(response, response.compliance, Twist)
    return stiffness @ compliance - np.eye(len(stiffness))


def outside(response, matrix):
    """Largest entry of a matrix of twists or wrenches [6 x 6] outside the motions that exist, of its largest."""
    inside = motions(response)
    apart = matrix - inside @ inside.T @ matrix @ inside @ inside.T
    return np.max(abs(apart)) / np.max(abs(matrix))


def test_laws_about_k_leave_out_no_machine_but_those_with_legs_of_rigid_joints():
    """A machine that became rigid by mistake would else leave the laws in silence."""
    left_out = {case.name for case in CASES if not case.is_elastic}
    assert all(case.machine.family.name == "legs" for case in CASES if case.name in left_out)
    assert not left_out & {"tripteron", "cogiro", "hexapod-hardware"}


@elastic_machine
@every_contrast
@few
@given(data=st.data())
def test_both_are_symmetric_and_positive(case, stiffness, data):
    response = data.draw(regular(case, stiffness))
    matrices = (reduced(response, response.stiffness, Wrench), reduced(response, response.compliance, Twist))
    for matrix in matrices:
        assert_psd(matrix)
        assert min(np.diag(matrix)) > 0.0
    assert outside(response, array(response.compliance)) <= 100 * U
    assert outside(response, array(response.stiffness)) <= 100 * U


@elastic_machine
@few
@given(data=st.data())
def test_they_are_inverse_at_moderate_contrast(case, data):
    response = data.draw(regular(case))
    assume(trace_product(response) < SPREAD)
    assert np.max(abs(product_error(response))) < INVERSE


@elastic_machine
@few
@given(data=st.data())
def test_they_are_inverse_at_any_contrast_to_what_their_terms_allow(case, data):
    """Norm-wise to some rounding units of tr K tr C; entry by entry to 1e-9 of what the terms that cancel may be.

    In positive matrices |K_il C_lj| is at most sqrt(K_ii K_ll C_ll C_jj). The terms themselves would be no bound: an
    entry that is small by symmetry still has the rounding of the large ones that made it.
    """
    response = data.draw(regular(case, CONTRASTING))
    error = abs(product_error(response))
    assert np.max(error) <= ROUNDINGS * U * trace_product(response) * (1.0 if lost(response) == 0.0 else 10.0)
    matrices = (reduced(response, response.stiffness, Wrench), reduced(response, response.compliance, Twist))
    k, c = (np.sqrt(np.diag(matrix)) for matrix in matrices)
    assert np.all(error <= 1e-9 * np.outer(k, c) * (k @ c))


@every_machine
@every_contrast
@few
@given(data=st.data())
def test_twice_the_stiffness_is_twice_k_and_half_c(case, stiffness, data):
    """Exactly, but for numbers at the end of float64: doubling is exact in binary, and both are linear in it."""
    machine = data.draw(machines(case, stiffness))
    now = values(machine)
    twice = respond(with_values(machine, {path: 2.0 * now[path] for path in elastic_paths(machine)}))
    once = respond(machine)
    for double, single in ((twice.stiffness, once.stiffness), (once.compliance, twice.compliance)):
        np.testing.assert_allclose(array(double), 2.0 * array(single), rtol=0, atol=UNDERFLOW)


@elastic_machine
@few
@given(data=st.data())
def test_more_stiffness_anywhere_is_never_softer_in_any_direction(case, data):
    """Rayleigh: K(k + dk) - K(k) and C(k) - C(k + dk) are positive semi-definite, to what the larger may lose."""
    once = data.draw(regular(case))
    every = springs(once.configuration)
    e = data.draw(st.integers(0, len(every) - 1))
    more = respring(once, {e: 3.0 * every[e].stiffness})
    length = float(once.configuration.length)
    scale = np.repeat([length, 1.0], 3)
    motion = np.linalg.norm(screw(once.statics.flexibility[e]) * scale)
    share = motion**2 / every[e].stiffness / np.trace(reduced(once, once.compliance, Twist))
    for kind, soft, stiff in ((Wrench, once.stiffness, more.stiffness), (Twist, more.compliance, once.compliance)):
        low, high = reduced(once, soft, kind), reduced(once, stiff, kind)
        assert np.linalg.eigvalsh(high - low)[0] >= -(20 * U + lost(once)) * np.linalg.norm(high, 2)
        if share > FELT:
            assert np.trace(high) > np.trace(low)


@elastic_machine
@few
@given(data=st.data())
def test_the_sum_over_legs_is_the_same_stiffness(case, data):
    """Second route (DESIGN section 2, eq. 32): sum_i W_i G_i^-1 W_i^T knows neither W^-1 nor the springs' duals.

    Its inverse of G, as its only solve, costs the contrast within a leg: 1e3 here, times some hundred for geometry.
    """
    response = data.draw(regular(case))
    assume(trace_product(response) < SPREAD)
    assert_blocks_close(array(flexible_stiffness(response.legs)), array(response.stiffness), 1e-9)

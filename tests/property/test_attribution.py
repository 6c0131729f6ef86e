"""Who is to blame: the shares of the springs are exact, and their sums are K and C."""

import math

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from kinetostat.kinetostatics.attribution import compliance_shares, stiffness_coefficients, stiffness_shares
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import springs
from kinetostat.machine.parameters import values, with_values
from machines import CONTRASTING, decades, every_machine, regular, regular_machines, stiffness_paths
from numeric import U, array, assert_blocks_close, columns, screw

SUMMED = 10 * U
"""Six terms of one sign on the diagonal, summed in any order."""


UNDERFLOW = 1e-300
"""Squares below it have lost digits to the end of float64's range."""


def total(shares):
    return np.sum([array(share) for share in shares], axis=0)


@every_machine
@given(data=st.data())
def test_shares_sum_to_the_whole(case, data):
    response = data.draw(regular(case, CONTRASTING))
    assert_blocks_close(total(compliance_shares(response.statics)), array(response.compliance), SUMMED)
    assert_blocks_close(total(stiffness_shares(response.statics)), array(response.stiffness), SUMMED)


@every_machine
@given(data=st.data())
def test_each_share_is_a_square(case, data):
    """s_e xi_e xi_e^T and k_e b_e b_e^T: no share is negative, and each is of rank one."""
    response = data.draw(regular(case, CONTRASTING))
    for shares in (compliance_shares(response.statics), stiffness_shares(response.statics)):
        for share in map(array, shares):
            assert np.all(np.diag(share) >= 0.0)
            products = np.outer(np.diag(share), np.diag(share))
            assert np.allclose(share**2, products, rtol=10 * U, atol=UNDERFLOW)


@every_machine
@given(data=st.data())
def test_coefficients_are_k_per_unit_stiffness(case, data):
    response = data.draw(regular(case))
    weights = response.statics.stiffness
    expected = [array(c) * k for c, k in zip(stiffness_coefficients(response.statics), weights, strict=True)]
    assert np.allclose([array(s) for s in stiffness_shares(response.statics)], expected, rtol=10 * U, atol=0.0)


@every_machine
@given(data=st.data())
def test_the_load_in_a_spring_is_the_same_from_the_wrench_and_from_the_motion(case, data):
    """xi_e = C times the load in e per unit platform twist, for springs alone in a leg and for springs in series."""
    response = data.draw(regular(case))
    statics = response.statics
    scale = np.repeat([float(response.configuration.length), 1.0], 3)[:, None]
    per_twist = columns(statics.resistance) * np.sqrt(np.array(statics.stiffness) / np.array(statics.compliance))
    expected, found = array(response.compliance) @ per_twist * scale, columns(statics.flexibility) * scale
    assert np.all(np.linalg.norm(found - expected, axis=0) <= 1e-9 * np.linalg.norm(found, axis=0))


@every_machine
@given(data=st.data())
def test_what_the_platform_would_gain_and_lose(case, data):
    """A share is what C loses when its spring becomes rigid, and what K loses when it becomes free."""
    machine = data.draw(regular_machines(case))
    path = data.draw(st.sampled_from(stiffness_paths(machine)))
    whole = respond(machine)
    rigid, free = (respond(with_values(machine, {path: k})) for k in (math.inf, 0.0))
    (e,) = [e for e, spring in enumerate(springs(free.configuration)) if spring.stiffness == 0.0]
    softer, stiffer = array(compliance_shares(whole.statics)[e]), array(stiffness_shares(whole.statics)[e])
    assert_blocks_close(array(rigid.compliance) + softer, array(whole.compliance), SUMMED)
    assert_blocks_close(array(free.stiffness) + stiffer, array(whole.stiffness), SUMMED)


@every_machine
@given(data=st.data())
def test_a_spring_moves_the_platform_as_its_flexibility_says(case, data):
    """xi_e xi_e^T is dC/ds_e, found without it: K^-1 by NumPy before and after a change of one spring.

    Stiffnesses of one decade keep the change well above the rounding of the inverses.
    """
    machine = data.draw(regular_machines(case, decades(3, 4)))
    path = data.draw(st.sampled_from(stiffness_paths(machine)))
    before, after = respond(machine), respond(with_values(machine, {path: 0.5 * values(machine)[path]}))
    (e,) = np.flatnonzero(np.array(before.statics.compliance) != np.array(after.statics.compliance))
    assume(max(np.linalg.cond(array(r.stiffness)) for r in (before, after)) < 1e6)
    soft, softer = (np.linalg.inv(array(r.stiffness)) for r in (before, after))
    twist = screw(before.statics.flexibility[e])
    assert_blocks_close(softer, soft + np.outer(twist, twist) / values(machine)[path], 1e-8)


@every_machine
@given(data=st.data())
def test_legs_carry_no_load_on_their_passive_joints(case, data):
    """J_p^T W = 0 (DESIGN section 2), every wrench against every passive twist of its leg."""
    response = data.draw(regular(case))
    length = float(response.configuration.length)
    for leg in response.legs:
        wrenches = columns(leg.wrenches) / np.repeat([length, 1.0], 3)[:, None]
        passive = columns(leg.passive) * np.repeat([length, 1.0], 3)[:, None]
        sizes = np.outer(np.linalg.norm(passive, axis=0), np.linalg.norm(wrenches, axis=0))
        assert np.all(abs(passive.T @ wrenches) <= 100 * U * sizes)
        assert np.linalg.matrix_rank(wrenches) == len(leg.wrenches)
        assert np.linalg.matrix_rank(passive) == 6 - len(leg.wrenches)

"""Who is to blame: the shares of the springs are exact, and their sums are K and C."""

import math

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.kinetostatics.assembly import compliance_shares, stiffness_coefficients, stiffness_shares
from kinetostat.machine.machine import springs
from kinetostat.tolerances import CLOSING_ROUND_OFF
from machines import CONTRASTING, decades, elastic_machine, every_machine, few, regular
from numeric import (
    U,
    array,
    assert_blocks_close,
    columns,
    dimensionless,
    lost,
    motions,
    reduced,
    respring,
    screw,
    trace_product,
)

SUMMED = 10 * U
"""Six terms of one sign on the diagonal, summed in any order."""
UNDERFLOW = 1e-300
"""Squares below it have lost digits to the end of float64's range."""
PARTED = 1e-10
"""What a change of one spring may lose to rounding, as a share of K or C: differences of two solutions."""
SPREAD = 1e6
"""Bound on tr K tr C of machines whose K is inverted by NumPy, in one unit: then some ten digits are left."""


def total(shares):
    return np.sum([array(share) for share in shares], axis=0)


def some_spring(response):
    """The number of one of its springs, and its stiffness."""
    every = springs(response.configuration)
    return st.integers(0, len(every) - 1).map(lambda e: (e, every[e].stiffness))


def alone(response, e):
    """Whether the leg of a spring has one spring for each wrench, so that no other in it takes the load over."""
    first = 0
    for leg in response.legs:
        if first <= e < first + len(leg.loads):
            return len(leg.loads) == len(leg.wrenches)
        first += len(leg.loads)
    raise AssertionError(e)


def taken_as_round_off(response, e):
    """The share of K that a freed spring may leave in its leg: that of wrenches that load it by round-off."""
    rows = [pair for leg in response.legs for pair in zip(leg.loads, leg.load_squares, strict=True)]
    loads, largest_square = rows[e]
    round_off = CLOSING_ROUND_OFF * math.sqrt(largest_square)
    return CLOSING_ROUND_OFF if any(0.0 < abs(load) < round_off for load in loads) else 0.0


def redundant(response):
    """Whether its legs carry more wrenches than the platform has motions."""
    return sum(len(leg.wrenches) for leg in response.legs) > motions(response).shape[1]


@every_machine
@few
@given(data=st.data())
def test_shares_sum_to_the_whole(case, data):
    """Energies: half the deformation energy of any load or motion is the sum over springs."""
    response = data.draw(regular(case, CONTRASTING))
    tolerance = SUMMED + lost(response)
    assert_blocks_close(total(compliance_shares(response.statics)), array(response.compliance), tolerance)
    assert_blocks_close(total(stiffness_shares(response.statics)), array(response.stiffness), tolerance)


@every_machine
@few
@given(data=st.data())
def test_each_share_is_a_square(case, data):
    """No share is negative, and each is of rank one."""
    response = data.draw(regular(case, CONTRASTING))
    for shares in (compliance_shares(response.statics), stiffness_shares(response.statics)):
        assert len(shares) == len(springs(response.configuration))
        for share in map(array, shares):
            assert np.all(np.diag(share) >= 0.0)
            products = np.outer(np.diag(share), np.diag(share))
            assert np.allclose(share**2, products, rtol=10 * U, atol=UNDERFLOW)


@every_machine
@few
@given(data=st.data())
def test_coefficients_are_k_per_unit_weight(case, data):
    response = data.draw(regular(case))
    pairs = zip(stiffness_coefficients(response.statics), response.statics.stiffness, strict=True)
    expected = [array(c) * k for c, k in pairs][: len(springs(response.configuration))]
    assert np.allclose([array(s) for s in stiffness_shares(response.statics)], expected, rtol=10 * U, atol=0.0)


@every_machine
@few
@given(data=st.data())
def test_the_load_in_a_spring_is_the_same_from_the_wrench_and_from_the_motion(case, data):
    """xi_e = C times the load in e per unit platform twist, for springs alone in a leg and in a row, however many legs.

    Compared through the energy that they store: springs that feel next to nothing feel but rounding.
    """
    response = data.draw(regular(case))
    statics, length = response.statics, float(response.configuration.length)
    softness = np.sqrt(np.array(statics.compliance))
    weights = np.array(statics.stiffness[: len(softness)])
    per_twist = columns(statics.resistance[: len(softness)]) * np.sqrt(weights / softness**2)
    scale = np.repeat([length, 1.0], 3)[:, None]
    expected, found = array(response.compliance) @ per_twist * softness, columns(statics.flexibility) * softness
    size = math.sqrt(np.trace(dimensionless(response.compliance, length, Twist)))
    assert np.all(np.linalg.norm((found - expected) * scale, axis=0) <= 1e-9 * size)


@elastic_machine
@few
@given(data=st.data())
def test_what_the_platform_would_gain_and_lose(case, data):
    """C loses at least the share of a spring that becomes rigid, K at least that of one that becomes free.

    Not more, where no other path takes the load over: in C without redundancy, in K in a leg with a spring for each
    wrench. (C is concave in compliances and K in stiffnesses, and the shares are their slopes.)
    """
    whole = data.draw(regular(case))
    e, _ = data.draw(some_spring(whole))
    rigid, free = (respring(whole, {e: k}) for k in (math.inf, 0.0))
    changes = (
        (whole.compliance, rigid.compliance, compliance_shares(whole.statics)[e], Twist, not redundant(whole)),
        (whole.stiffness, free.stiffness, stiffness_shares(whole.statics)[e], Wrench, alone(whole, e)),
    )
    for before, after, share, kind, exact in changes:
        if exact:
            tolerance = SUMMED + lost(whole) + (taken_as_round_off(whole, e) if kind is Wrench else 0.0)
            assert_blocks_close(array(after) + array(share), array(before), tolerance)
        left = reduced(whole, before, kind) - reduced(whole, after, kind) - reduced(whole, share, kind)
        least = np.linalg.eigvalsh(left)[0]
        assert least >= -(PARTED + lost(whole)) * np.linalg.norm(reduced(whole, before, kind))


@elastic_machine
@few
@given(data=st.data())
def test_a_spring_moves_the_platform_as_its_flexibility_says(case, data):
    """xi_e xi_e^T is dC/ds_e, found without it: K^-1 by NumPy as one spring becomes softer, twice.

    A change d of s_e adds xi_e xi_e^T / (1/d + h) to C, where the rest of the machine resists a deformation of e by a
    stiffness h (0 without redundancy). The first change gives h, the second checks it. Stiffnesses of one decade keep
    the changes well above the rounding of the inverses.
    """
    whole = data.draw(regular(case, decades(3, 4)))
    e, stiffness = data.draw(some_spring(whole))
    assume(trace_product(whole) < SPREAD)
    share = reduced(whole, compliance_shares(whole.statics)[e], Twist) * stiffness
    before = inverse_of_k(whole)
    softened = [inverse_of_k(respring(whole, {e: stiffness / (1.0 + n)})) - before for n in (1, 2)]
    if np.linalg.norm(share) / stiffness <= 1e-6 * np.linalg.norm(before):
        assert np.linalg.norm(softened[1]) <= 1e-5 * np.linalg.norm(before)
        return
    added = np.sum(softened[0] * share) / np.sum(share * share)
    resistance = max(1.0 / added - stiffness, 0.0) if added > 0.0 else math.inf
    expected = share / (0.5 * stiffness + resistance)
    assert np.linalg.norm(softened[1] - expected) <= 1e-7 * np.linalg.norm(before)
    if not redundant(whole):
        assert resistance <= 1e-2 * stiffness


def inverse_of_k(response):
    return np.linalg.inv(reduced(response, response.stiffness, Wrench))


@every_machine
@few
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


@every_machine
@few
@given(data=st.data())
def test_leg_wrenches_hold_any_load(case, data):
    """W times the sharing is the unit wrench itself, over the motions that exist: statics are in balance."""
    response = data.draw(regular(case))
    shares = np.array([screw(t) for leg in response.statics.sharing for t in leg])
    wrenches = columns([w for leg in response.statics.wrenches for w in leg])
    exists = motions(response) @ motions(response).T
    length = float(response.configuration.length)
    scale = np.repeat([1.0 / length, 1.0], 3)
    balance = exists @ (wrenches @ shares) @ exists * scale[:, None] / scale
    assert np.allclose(balance, exists, rtol=0, atol=1e-9)

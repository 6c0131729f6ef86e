"""The two ends of the stiffness scale, rigid and free, are exact: no large number stands in for infinity."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import springs
from kinetostat.machine.parameters import values, with_values
from kinetostat.tolerances import ROUND_OFF_OF_COMPLIANCE
from machines import CASES, elastic_machine, every_machine, few, regular, stiffness_paths
from numeric import (
    BLOCKS,
    U,
    array,
    assert_blocks_close,
    assert_psd,
    lost,
    motions,
    reached,
    reduced,
    respring,
    screw,
    trace_product,
)

STIFF = 1e17
"""N/m or N·m/rad: 1e11 times and more the other springs here, so that where they share loads with those, in redundant
machines, the square of what they yield is nothing."""
SOFT = 1e-3
"""N/m or N·m/rad: one part in 1e6 and less of the other springs here."""
MOST_FREE = 3
"""Springs set free at once, so that the machines do not all fall apart."""
ROUNDINGS = 30
"""As for any K C, see `test_stiffness_and_compliance`."""


def some_springs(response):
    """Numbers of some of its springs, at least one."""
    return st.lists(st.integers(0, len(springs(response.configuration)) - 1), min_size=1, unique=True)


UNFELT = 1e-9
"""Share of a unit load below which a spring that should be free or rigid feels but the rounding of one, if any."""


CLEARLY = 0.03
"""Share of a unit load from which a spring surely feels it."""


def felt(response, e):
    """How much of a unit wrench of its leg a spring feels at most: 1 along a line of force, its arm over the length."""
    length = float(response.configuration.length)
    rows = [row for leg in response.legs for row in leg.loads]
    turning = springs(response.configuration)[e].joint.point is not None
    return max(map(abs, rows[e])) / (length if turning else 1.0)


def not_in_doubt(response, some, least=UNFELT):
    """Refuse machines of which a spring is loaded so little that only rounding decides whether it is."""
    assume(not any(0.0 < felt(response, e) < least for e in some))


def unit(screws, length):
    """Screws as rows of unit size in one unit (m for twists); those that are zero are left out [n x 6]."""
    rows = np.array([screw(s) for s in screws]).reshape(-1, 6) * np.repeat([length, 1.0], 3)
    sizes = np.linalg.norm(rows, axis=1)
    return rows[sizes > 0.0] / sizes[sizes > 0.0, None]


@every_machine
@few
@given(data=st.data())
def test_rigid_is_the_exact_limit(case, data):
    """C(1e17) - C(rigid) is the compliance of the stiff springs and nothing else, to the rounding of C before.

    A component of C(rigid) stands for 0, with its couplings, where it is the square of what closing legs may leave.
    """
    response = data.draw(regular(case))
    some = data.draw(some_springs(response))
    rigid, stiff = (respring(response, dict.fromkeys(some, k)) for k in (math.inf, STIFF))
    assume(rigid.statics.doubt == 0.0)
    twists = np.array([screw(stiff.statics.flexibility[e]) for e in some])
    remainder = twists.T @ twists / STIFF
    before, exact, limit = array(response.compliance), array(rigid.compliance), array(stiff.compliance) - remainder
    lengths = np.repeat([1.0, float(response.configuration.length)], 3)
    least = ROUND_OFF_OF_COMPLIANCE * np.sum(np.diag(before) / lengths**2) * lengths**2
    zero = (np.diag(exact) == 0.0) & (np.diag(limit) <= least)
    assert_blocks_close(exact, np.where(zero | zero[:, None], 0.0, limit), 1e-12 + lost(stiff), before)


@elastic_machine
@few
@given(data=st.data())
def test_free_is_the_limit(case, data):
    """K(1e-3) - K(free) is small: what other springs hold stays held, and a leg carries what loads no free spring.

    Where free springs together are hardly loaded, or with short levers, the limit is still some way off; then springs
    ten times softer come nearer to it in proportion, from some softness on.
    """
    response = data.draw(regular(case))
    some = data.draw(some_springs(response).map(lambda every: every[:MOST_FREE]))
    not_in_doubt(response, some, CLEARLY)
    free = array(respring(response, dict.fromkeys(some, 0.0)).stiffness)
    softer = [array(respring(response, dict.fromkeys(some, SOFT * 0.1**n)).stiffness) for n in range(MOST_TENTHS)]
    if any(is_nearer(free, soft, next_one) for soft, next_one in pairwise(softer)):
        return
    assert_blocks_close(free, softer[0], 1e-2, array(response.stiffness))


MOST_TENTHS = 5
"""Softnesses that are tried: each is a tenth of the one before it."""


def is_nearer(free, soft, softer):
    """Whether a tenth of the stiffness leaves at most a fifth of the difference, in every block of K."""
    left, before = softer - free, soft - free
    return all(
        np.linalg.norm(left[rows, columns]) <= 0.2 * np.linalg.norm(before[rows, columns])
        for rows in BLOCKS
        for columns in BLOCKS
    )


SEEN = 1e-14
"""Share of the compliance below which a motion is none: a stiff spring with a short lever may have 1e-12 of it."""
ONE_STIFFNESS = [(case, path) for case in CASES for path in stiffness_paths(case.machine)]


@pytest.mark.parametrize(("case", "path"), ONE_STIFFNESS)
def test_at_the_reference_design_very_stiff_is_rigid_to_nine_digits(case, path):
    """Beside the 1000 N/m of the paper's actuators that is 1e15 N/m, beside a tool machine's beams much more."""
    now = [values(case.machine)[other] for other in stiffness_paths(case.machine)]
    stiffest = max(k for k in now if math.isfinite(k))
    rigid, stiff = (respond(with_values(case.machine, {path: k})) for k in (math.inf, 1e12 * stiffest))
    present = array(respond(case.machine).compliance)  # a platform that nothing turns any more has no scale of its own
    assert_blocks_close(array(stiff.compliance), array(rigid.compliance), 1e-9, scale_of=present)


@elastic_machine
@few
@given(data=st.data())
def test_a_rigid_spring_adds_nothing_to_c_and_is_never_nan(case, data):
    """Each takes at most one dimension from C, and no motion works against what holds rigidly."""
    response = data.draw(regular(case))
    some = data.draw(some_springs(response))
    not_in_doubt(response, some)
    found = respring(response, dict.fromkeys(some, math.inf))
    length = float(found.configuration.length)
    compliance, before = reduced(found, found.compliance, Twist), reduced(response, response.compliance, Twist)
    assert_psd(compliance, np.trace(before))
    rank = np.linalg.matrix_rank(compliance / np.trace(before), SEEN, hermitian=True)
    assert len(compliance) - len(some) <= rank <= len(springs(found.configuration)) - len(some)
    stiffness = array(found.stiffness)
    assert not np.any(np.isnan(stiffness))
    holding = [wrench for wrench, k in found.statics.actions if k == math.inf]
    assert np.array_equal(np.isinf(stiffness), reached(holding, 1.0 / length))
    against = unit(holding, 1.0 / length) @ motions(found)
    assert np.linalg.matrix_rank(against, 1e-9) == len(compliance) - rank
    assert np.all(np.linalg.norm(against @ compliance, axis=1) <= 1e-9 * np.linalg.norm(before))


@elastic_machine
@few
@given(data=st.data())
def test_a_free_spring_leaves_k_finite_and_frees_just_what_it_moves(case, data):
    """What is freed meets no resistance; where other springs still hold the platform, K and C stay inverse.

    A redundant machine that lets go altogether is singular: its legs have become mechanisms.
    """
    response = data.draw(regular(case))
    some = data.draw(some_springs(response))
    not_in_doubt(response, some)
    found = respring(response, dict.fromkeys(some, 0.0))
    length = float(found.configuration.length)
    stiffness, compliance = reduced(found, found.stiffness, Wrench), array(found.compliance)
    assert_psd(stiffness)
    if found.status != Status.OK:
        assert found.status == Status.SINGULAR
        assert np.linalg.eigvalsh(stiffness)[0] <= 1e-9 * np.linalg.norm(stiffness, 2)
        return
    assert not np.any(np.isnan(compliance))
    moving = [found.statics.flexibility[e] for e in some]
    freed = reached(moving, length)
    assert np.array_equal(np.isinf(compliance), freed)
    moved = unit(moving, length) @ motions(found)
    assert np.all(np.linalg.norm(moved @ stiffness, axis=1) <= 1e-9 * np.linalg.norm(stiffness))
    if not freed.any():
        error = stiffness @ reduced(found, found.compliance, Twist) - np.eye(len(stiffness))
        assert np.max(abs(error)) <= ROUNDINGS * U * trace_product(found)


@elastic_machine
def test_all_rigid_does_not_move_and_all_free_does_not_resist(case):
    response = respond(case.machine)
    every = range(len(springs(response.configuration)))
    rigid, free = (respring(response, dict.fromkeys(every, k)) for k in (math.inf, 0.0))
    exist = np.any(motions(response) != 0.0, axis=1)
    assert np.array_equal(array(rigid.compliance), np.zeros((6, 6)))
    assert np.array_equal(array(free.stiffness), np.zeros((6, 6)))
    assert np.all(np.diag(array(rigid.stiffness))[exist] == math.inf)
    assert free.status == Status.SINGULAR or np.all(np.diag(array(free.compliance))[exist] == math.inf)


@elastic_machine
@few
@given(data=st.data())
def test_a_rigid_machine_with_free_actuators_keeps_its_freedoms(case, data):
    """K of the rest has the rank of the constraints."""
    response = data.draw(regular(case))
    actuators = [e for e, spring in enumerate(springs(response.configuration)) if spring.actuated]
    found = respring(response, dict.fromkeys(actuators, 0.0))
    eigenvalues = np.linalg.eigvalsh(reduced(found, found.stiffness, Wrench))
    assert np.all(abs(eigenvalues[: case.freedoms]) <= 1e-12 * trace_of_k(response))
    assert np.all(eigenvalues[case.freedoms :] > 1e-12 * trace_of_k(response))


def trace_of_k(response):
    return np.trace(reduced(response, response.stiffness, Wrench))

"""What may not matter: where the machine stands, how it is turned, the point of reference, order of legs and units."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry import displacements, vectors
from kinetostat.algebra.vector import ZERO
from kinetostat.kinetostatics.assembly import solve_statics
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Configuration
from kinetostat.machine.parameters import parameters, values, with_values
from machines import CONTRASTING, MODERATE, every_machine, regular, regular_machines, stiffness_paths
from numeric import (
    array,
    assert_blocks_close,
    displaced,
    matrices,
    matrix,
    statics_at,
    twist_transport,
    vector,
    wrench_transport,
)

INVARIANT = 1e-12
"""Of each 3x3 block, norm-wise: some rounding units times the condition of W, which regularity 0.02 holds below 1e3.

The trick of imitating free joints by huge compliances errs by percents here (DESIGN section 2).
"""
every_contrast = pytest.mark.parametrize("stiffness", [MODERATE, CONTRASTING], ids=["moderate", "contrasting"])


def transported(response, turn, offset):
    """K and C of the machine turned, then referred to the point at `offset` from the turned P."""
    forces, motions = wrench_transport(turn, offset), twist_transport(turn, offset)
    return forces @ array(response.stiffness) @ forces.T, motions @ array(response.compliance) @ motions.T


def assert_same(found, expected):
    for actual, wanted in zip(found, expected, strict=True):
        assert_blocks_close(actual, wanted, INVARIANT)


@every_machine
@every_contrast
@given(data=st.data(), motion=displacements(2.0))
def test_the_machine_moved_as_a_whole(case, stiffness, data, motion):
    response = data.draw(regular(case, stiffness))
    moved = displaced(response.configuration, motion)
    found = matrices(statics_at(moved, moved.platform.translation))
    assert_same(found, transported(response, matrix(motion.rotation), np.zeros(3)))


@every_machine
@given(data=st.data(), offset=vectors(0.3))
def test_another_reference_point(case, data, offset):
    """A tool point within some platform radii: twist and wrench are transported there, and K and C with them."""
    response = data.draw(regular(case))
    found = matrices(statics_at(response.configuration, response.configuration.platform.translation + offset))
    assert_same(found, transported(response, np.eye(3), vector(offset)))


@every_machine
@given(data=st.data(), motion=displacements(0.5))
def test_moved_and_seen_from_the_origin(case, data, motion):
    response = data.draw(regular(case))
    moved = displaced(response.configuration, motion)
    found = matrices(statics_at(moved, ZERO))
    assert_same(found, transported(response, matrix(motion.rotation), -vector(moved.platform.translation)))


@every_machine
@given(data=st.data())
def test_the_order_of_the_legs(case, data):
    response = data.draw(regular(case, CONTRASTING))
    placed = response.configuration
    legs = data.draw(st.permutations(placed.legs))
    shuffled = Configuration(placed.platform, tuple(legs), placed.closures, placed.length)
    expected = array(response.stiffness), array(response.compliance)
    assert_same(matrices(statics_at(shuffled, placed.platform.translation)), expected)


@every_machine
@given(data=st.data(), factor=st.floats(0.1, 10.0))
def test_the_length_that_scales_rows(case, data, factor):
    response = data.draw(regular(case))
    length = factor * float(response.configuration.length)
    point = response.configuration.platform.translation
    statics = solve_statics([leg.screws(point, length) for leg in response.configuration.legs], length)
    assert_same(matrices(statics), (array(response.stiffness), array(response.compliance)))


def in_other_units(machine, metre, newton):
    """The same machine written in another unit of length and of force: `metre` and `newton` are their values."""
    size = {"length": metre, "angle": 1.0, "linear stiffness": newton / metre, "torsional stiffness": newton * metre}
    now = values(machine)
    leaves = [p for p in parameters(machine.family) if p.leaves == (p.path,)]
    return with_values(machine, {p.path: now[p.path] * size[p.quantity.kind] for p in leaves})


def unit_of_stiffness(metre, newton):
    """What an entry of K in the other units has to be multiplied by [6 x 6]; its inverse is for C."""
    motion = np.repeat([1.0, metre], 3)
    return np.outer(motion, motion) / (newton * metre)


@every_machine
@given(data=st.data(), metre=st.sampled_from([1e-9, 1e-3, 1e3, 1e6]), newton=st.sampled_from([1.0, 1e3]))
def test_the_units_of_length_and_of_force(case, metre, newton, data):
    """Written in mm or km and mN, the machine has the same status, regularity, K and C."""
    machine = data.draw(regular_machines(case))
    here, there = respond(machine), respond(in_other_units(machine, metre, newton))
    assert there.status == here.status
    assert there.regularity == pytest.approx(here.regularity, rel=1e-9)
    unit = unit_of_stiffness(metre, newton)
    assert_blocks_close(array(there.stiffness) * unit, array(here.stiffness), INVARIANT)
    assert_blocks_close(array(there.compliance) / unit, array(here.compliance), INVARIANT)


@every_machine
@pytest.mark.parametrize("metre", [1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e12])
@pytest.mark.parametrize("end", [0.0, math.inf], ids=["free", "rigid"])
def test_what_is_rigid_or_free_does_not_depend_on_units(case, end, metre):
    """At the reference design, spring by spring: no threshold compares metres with radians (DESIGN section 1)."""
    for path in stiffness_paths(load(case.name)):
        machine = with_values(load(case.name), {path: end})
        here, there = respond(machine), respond(in_other_units(machine, metre, 1.0))
        assert np.array_equal(np.isfinite(array(there.stiffness)), np.isfinite(array(here.stiffness))), path
        assert np.array_equal(np.isfinite(array(there.compliance)), np.isfinite(array(here.compliance))), path

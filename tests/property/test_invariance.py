"""What may not matter: where the machine stands, how it is turned, the point of reference, order of legs and units."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry import displacements, vectors
from kinetostat.algebra.vector import ZERO
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.parameters import parameters, values, with_values
from machines import (
    CONTRASTING,
    MODERATE,
    elastic_machine,
    every_machine,
    few,
    regular,
    regular_machines,
    stiffness_paths,
)
from numeric import (
    answer,
    array,
    assert_blocks_close,
    displaced,
    lost,
    matrices,
    matrix,
    motions,
    twist_transport,
    vector,
    wrench_transport,
)

INVARIANT = 1e-12
"""Of each 3x3 block, norm-wise: some rounding units times the condition of W, below 1e3 from a margin of 0.02.

The trick of imitating free joints by huge compliances errs by percents here (DESIGN section 2).
"""
every_contrast = pytest.mark.parametrize("stiffness", [MODERATE, CONTRASTING], ids=["moderate", "contrasting"])


def assert_transported(found, response, turn, offset):
    """`found` is the machine of `response` turned, and referred to the point at `offset` (m) from the turned one.

    Compared over the motions that exist: a planar machine has no others, wherever its reference point lies.
    """
    forces, twists = wrench_transport(turn, offset), twist_transport(turn, offset)
    stiffness, compliance = matrices(response)
    exists = motions(found) @ motions(found).T
    for actual, wanted in zip(
        matrices(found), (forces @ stiffness @ forces.T, twists @ compliance @ twists.T), strict=True
    ):
        assert_blocks_close(exists @ actual @ exists, exists @ wanted @ exists, INVARIANT + lost(response))


def assert_same(found, response):
    assert_transported(found, response, np.eye(3), np.zeros(3))


def assert_as_regular(found, response):
    assert found.singularity_margin == pytest.approx(response.singularity_margin, rel=lost(response) + INVARIANT)


@elastic_machine
@every_contrast
@few
@given(data=st.data(), motion=displacements(2.0))
def test_the_machine_moved_as_a_whole(case, stiffness, data, motion):
    response = data.draw(regular(case, stiffness))
    found = answer(displaced(response.configuration, motion), motion.apply(response.reference))
    assert_transported(found, response, matrix(motion.rotation), np.zeros(3))
    assert_as_regular(found, response)


@elastic_machine
@few
@given(data=st.data(), offset=vectors(0.3))
def test_another_reference_point(case, data, offset):
    """A tool point within some platform radii: twist and wrench are transported there, and K and C with them."""
    response = data.draw(regular(case))
    found = answer(response.configuration, response.reference + offset)
    assert_transported(found, response, np.eye(3), vector(offset))


@elastic_machine
@few
@given(data=st.data(), motion=displacements(0.5))
def test_moved_and_seen_from_the_origin(case, data, motion):
    response = data.draw(regular(case))
    found = answer(displaced(response.configuration, motion), ZERO)
    assert_transported(found, response, matrix(motion.rotation), -vector(motion.apply(response.reference)))


@elastic_machine
@few
@given(data=st.data())
def test_the_tool_lies_on_the_platform(case, data):
    """The tool point of a file is P moved by the offset in platform axes, and goes where the platform goes."""
    machine = data.draw(regular_machines(case))
    response = respond(machine)
    platform = response.configuration.platform
    offset = np.array(machine.tables["tool"].offset)
    at_p = respond(with_values(machine, dict.fromkeys((f"tool.offset.{i}" for i in range(3)), 0.0)))
    assert vector(at_p.reference) == pytest.approx(vector(platform.translation), abs=1e-15)
    assert_transported(response, at_p, np.eye(3), matrix(platform.rotation) @ offset)


@elastic_machine
@few
@given(data=st.data())
def test_the_order_of_the_legs(case, data):
    response = data.draw(regular(case, CONTRASTING))
    legs = data.draw(st.permutations(response.configuration.legs))
    found = answer(replace(response.configuration, legs=tuple(legs)), response.reference)
    assert_same(found, response)
    assert_as_regular(found, response)


@elastic_machine
@few
@given(data=st.data(), factor=st.floats(0.1, 10.0))
def test_the_length_that_scales_rows(case, data, factor):
    response = data.draw(regular(case))
    other = replace(response.configuration, length=factor * float(response.configuration.length))
    assert_same(answer(other, response.reference), response)


UNITS = {
    "angle": (0, 0),
    "direction": (0, 0),
    "density": (0, 0),  # of what weighs: K and C do not feel it
    "linear density": (0, 0),
    "mass": (0, 0),
    "moment of inertia": (0, 0),
    "inertia": (0, 0),
    "ratio": (0, 0),
    "linear damping": (0, 0),
    "torsional damping": (0, 0),
    "linear friction": (0, 0),
    "torsional friction": (0, 0),
    "rate": (0, 0),
    "speed": (0, 0),
    "jerk": (0, 0),
    "cutting pressure": (0, 0),
    "duration": (0, 0),
    "acceleration": (1, 0),
    "temperature difference": (0, 0),
    "thermal expansion": (0, 0),
    "E I": (2, 1),
    "length": (1, 0),
    "area": (2, 0),
    "second moment of area": (4, 0),
    "linear stiffness": (-1, 1),
    "torsional stiffness": (1, 1),
    "axial rigidity": (0, 1),
    "torsional rigidity": (2, 1),
    "bending rigidity": (2, 1),
    "force": (0, 1),
    "moment": (1, 1),
    "elastic modulus": (-2, 1),
}
"""Powers of the units of length and of force in each kind of quantity."""


def in_other_units(machine, metre, newton):
    """The same machine written in another unit of length and of force: `metre` and `newton` are their values."""
    size = {kind: metre**length * newton**force for kind, (length, force) in UNITS.items()}
    now = values(machine)
    leaves = [p for p in parameters(machine.family) if p.leaves == (p.path,)]
    return with_values(machine, {p.path: now[p.path] * size[p.quantity.kind] for p in leaves})


def unit_of_stiffness(metre, newton):
    """What an entry of K in the other units has to be multiplied by [6 x 6]; its inverse is for C."""
    motion = np.repeat([1.0, metre], 3)
    return np.outer(motion, motion) / (newton * metre)


@elastic_machine
@few
@given(data=st.data(), metre=st.sampled_from([1e-9, 1e-3, 1e3, 1e6]), newton=st.sampled_from([1.0, 1e3]))
def test_the_units_of_length_and_of_force(case, metre, newton, data):
    """Written in mm or km and mN, the machine has the same status, singularity margin, K and C."""
    machine = data.draw(regular_machines(case))
    here, there = respond(machine), respond(in_other_units(machine, metre, newton))
    assert there.status == here.status
    assert_as_regular(there, here)
    unit = unit_of_stiffness(metre, newton)
    assert_blocks_close(array(there.stiffness) * unit, array(here.stiffness), INVARIANT + lost(here))
    assert_blocks_close(array(there.compliance) / unit, array(here.compliance), INVARIANT + lost(here))


@every_machine
@pytest.mark.parametrize("end", [0.0, math.inf], ids=["free", "rigid"])
@pytest.mark.numbers
def test_what_is_rigid_or_free_does_not_depend_on_units(case, end):
    """At the reference design, spring by spring: no threshold compares metres with radians (DESIGN section 1)."""
    for path in stiffness_paths(case.machine):
        machine = with_values(case.machine, {path: end})
        here = respond(machine)
        for metre in (1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e12):
            there = respond(in_other_units(machine, metre, 1.0))
            assert here.status == there.status, (path, metre)
            for ours, theirs in zip(matrices(here), matrices(there), strict=True):
                assert np.array_equal(np.isfinite(ours), np.isfinite(theirs)), (path, metre)

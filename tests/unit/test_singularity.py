"""Singularities told from screws: the twist that is left free, in words and in numbers."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.algebra.screw import Twist, force_along
from kinetostat.algebra.vector import X_AXIS, Y_AXIS, Z_AXIS, ZERO, Vector
from kinetostat.kinematics.mobility import conditioning, describe, free_twist, why_singular
from kinetostat.machine.leg_screws import LegScrews
from machines import CASES, every_machine, few, regular
from numeric import U, columns

SIX = [
    force_along(X_AXIS, Z_AXIS),
    force_along(X_AXIS, Y_AXIS),
    force_along(Y_AXIS, X_AXIS),
    force_along(Y_AXIS, Z_AXIS),
    force_along(Z_AXIS, X_AXIS),
    force_along(Z_AXIS, Y_AXIS * -1.0),
]
"""Six independent unit forces at unit arms."""


def legs_of(wrenches, singularity_margin=1.0):
    return [LegScrews((), (), (), (wrench,), (), (), singularity_margin) for wrench in wrenches]


@pytest.mark.parametrize(
    ("free", "kept"),
    [
        ([0, 0, 1, 0, 0, 0], [(Z_AXIS, ZERO), (X_AXIS, ZERO), (Y_AXIS, ZERO), (Z_AXIS, X_AXIS), (Z_AXIS, Y_AXIS)]),
        ([0, 0, 0, 0, 0, 1], [(X_AXIS, Z_AXIS), (X_AXIS, Y_AXIS), (Y_AXIS, X_AXIS), (Y_AXIS, Z_AXIS), (X_AXIS, ZERO)]),
    ],
)
@pytest.mark.parametrize("length", [0.01, 1.0, 100.0])
def test_the_free_twist_is_the_one_no_leg_resists(free, kept, length):
    found = np.array(free_twist(legs_of([force_along(*line) for line in kept]), length))
    assert np.allclose(abs(found), free, atol=1e-9)


def test_conditioning_does_not_depend_on_the_unit_of_length():
    wrenches = SIX
    metres = conditioning(legs_of(wrenches), 0.5)
    millimetres = [
        force_along(w.translational, Vector(*(1000.0 * c for c in arm))) for w, arm in zip(SIX, _arms(), strict=True)
    ]
    assert conditioning(legs_of(millimetres), 500.0) == pytest.approx(metres, rel=1e-12)
    assert all(a >= b for a, b in pairwise(metres))


def _arms():
    return [v.components() for v in (Z_AXIS, Y_AXIS, X_AXIS, Z_AXIS, X_AXIS, Y_AXIS * -1.0)]


@every_machine
@few
@given(data=st.data())
def test_a_regular_pose_is_well_conditioned(case, data):
    """Far from a singularity the wrenches of the legs, and of a plane, span all six dimensions."""
    response = data.draw(regular(case))
    sizes = conditioning(response.legs, float(response.configuration.length), response.guide)
    assert len(sizes) == 6
    assert sizes[-1] > 1e-3 * sizes[0]


SPATIAL = [case for case in CASES if not case.machine.family.planar]


@pytest.mark.parametrize("case", SPATIAL, ids=repr)
@few
@given(data=st.data())
def test_a_regular_pose_resists_its_softest_twist(case, data):
    """The singular vectors of W, and the free twist among them, agree with the singular values."""
    response = data.draw(regular(case))
    length = float(response.configuration.length)
    sizes = conditioning(response.legs, length)
    twist = np.array(free_twist(response.legs, length)) * np.repeat([length, 1.0], 3)
    scaled = columns([w for leg in response.legs for w in leg.wrenches]) / np.repeat([length, 1.0], 3)[:, None]
    assert np.linalg.norm(scaled.T @ twist) == pytest.approx(sizes[-1] * np.linalg.norm(twist), abs=100 * U * sizes[0])


def test_locked_legs_are_named_and_come_first():
    legs = legs_of(SIX[:5], singularity_margin=0.0)
    message = why_singular([f"leg {i}" for i in range(5)], legs[:2] + legs_of(SIX[2:5]), 1.0, 1e-9)
    assert "leg 0 and the leg 1 lock up" in message
    assert "leg 2" not in message
    assert "lock up" in why_singular(["arm"], legs_of(SIX[:1], singularity_margin=math.nan), 1.0, 1e-9)


def test_a_platform_singularity_names_the_free_twist():
    message = why_singular(["a"] * 5, legs_of(SIX[:5]), 1.0, 1e-9)
    assert "With all actuators locked the platform can still move" in message
    assert "rad" in message


def test_a_twist_in_words_leaves_rounding_out():
    twist = Twist(Vector(0.5, 1e-12, 0.0), Vector(0.0, -2.0, 0.0)).components()
    assert describe(twist, ("rad", "m")) == "rx +0.5 rad, y -2 m"

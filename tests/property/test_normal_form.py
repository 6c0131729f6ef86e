"""Indices, centres and eigenscrews of whole machines, rigid links included: from C, and from K where it is finite."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elastic import compliance_at
from kinetostat.kinetostatics.eigenscrews import centre_of_compliance, compliance_eigenscrews
from kinetostat.kinetostatics.indices import (
    free_stiffness_along,
    free_stiffnesses,
    guided_stiffness_along,
    guided_stiffnesses,
    principal_compliances,
)
from machines import every_machine, regular
from numeric import BLOCKS, array

ROUNDING = 1e-12
BOUND = 1e-6
"""Of stiffnesses that come from differences in C."""
DIRECTIONS = np.random.default_rng(0).normal(size=(50, 3))
UNIT = DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=1)[:, None]


@every_machine
@given(data=st.data())
def test_no_direction_is_softer_or_stiffer_than_the_principal_ones(case, data):
    compliance = data.draw(regular(case)).compliance
    found = principal_compliances(compliance)
    for name, block in zip(("rotation", "translation"), BLOCKS, strict=True):
        matrix, principal = array(compliance)[block, block], found[name]
        along = np.einsum("ij,jk,ik->i", UNIT, matrix, UNIT)
        size = max(principal.compliances)
        assert principal.compliances.tolist() == sorted(principal.compliances)
        assert np.all(along <= size * (1 + ROUNDING))
        assert np.all(along >= min(principal.compliances) - ROUNDING * size)
        for value, direction in zip(principal.compliances, principal.directions, strict=True):
            assert np.allclose(matrix @ direction, value * np.array(direction), rtol=0, atol=ROUNDING * size)
            assert np.linalg.norm(direction) == pytest.approx(1.0, rel=ROUNDING)


@every_machine
@given(data=st.data())
def test_a_guided_platform_is_at_least_as_stiff_as_a_free_one(case, data):
    compliance = data.draw(regular(case)).compliance
    free, guided = free_stiffnesses(None, compliance), guided_stiffnesses(None, compliance)
    for name in ("rotation", "translation"):
        pairs = zip(free[name].stiffnesses, guided[name].stiffnesses, strict=True)
        assert all(0.0 < soft <= held * (1 + BOUND) for soft, held in pairs)
        for n in UNIT[:5]:
            soft, held = (f(n, name, None, compliance) for f in (free_stiffness_along, guided_stiffness_along))
            assert free[name].stiffnesses[0] * (1 - BOUND) <= soft <= held * (1 + BOUND)


@every_machine
@given(data=st.data())
def test_the_compliance_is_a_sum_over_its_eigenscrews_and_symmetric_at_its_centre(case, data):
    compliance = array(data.draw(regular(case)).compliance)
    total = np.zeros((6, 6))
    for screw in compliance_eigenscrews(compliance):
        n = np.array(screw.direction)
        twist = [0, 0, 0, *n] if screw.point is None else [*n, *(screw.pitch * n + np.cross(screw.point, n))]
        total += screw.weight * np.outer(twist, twist)
    for rows in BLOCKS:
        for columns in BLOCKS:
            size = np.sqrt(np.trace(compliance[rows, rows]) * np.trace(compliance[columns, columns]))
            assert np.allclose(total[rows, columns], compliance[rows, columns], rtol=0, atol=1e-10 * size)
    centre = centre_of_compliance(compliance)
    if centre is not None:
        coupling = compliance_at(compliance, centre)[:3, 3:]
        size = np.linalg.norm(compliance[:3, :3]) * max(1.0, np.linalg.norm(centre))
        assert np.allclose(coupling, coupling.T, rtol=0, atol=1e-9 * size)

"""Principal compliances: the extremes of what a unit load causes along itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.kinetostatics.indices import principal_compliances
from machines import every_machine, regular
from numeric import BLOCKS, array

ROUNDING = 1e-12
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
        assert principal.compliances == sorted(principal.compliances)
        assert np.all(along <= size * (1 + ROUNDING))
        assert np.all(along >= min(principal.compliances) - ROUNDING * size)
        for value, direction in zip(principal.compliances, principal.directions, strict=True):
            assert np.allclose(matrix @ direction, value * np.array(direction), rtol=0, atol=ROUNDING * size)
            assert np.linalg.norm(direction) == pytest.approx(1.0, rel=ROUNDING)

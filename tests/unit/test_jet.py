"""Jets against derivatives by hand, of floats and of columns."""

import math

import numpy as np
import pytest

from kinetostat.algebra.jet import Jet
from kinetostat.algebra.scalar import arctan2, cos, sin, sqrt, where
from kinetostat.machine.column import Column

A, B = 0.7, 1.3
CASES = (
    (lambda x, y: x * y, A * B, B, A, 1.0),
    (lambda x, y: x / y, A / B, 1.0 / B, -A / B**2, -1.0 / B**2),
    (lambda x, y: 2.0 / (x * y), 2.0 / (A * B), -2.0 / (A * A * B), -2.0 / (A * B * B), 2.0 / (A * B) ** 2),
    (lambda x, y: sin(x) * cos(y), math.sin(A) * math.cos(B), math.cos(A) * math.cos(B),
     -math.sin(A) * math.sin(B), -math.cos(A) * math.sin(B)),
    (lambda x, y: sqrt(x * y), math.sqrt(A * B), 0.5 * math.sqrt(B / A), 0.5 * math.sqrt(A / B),
     0.25 / math.sqrt(A * B)),
    (lambda x, y: arctan2(x, y), math.atan2(A, B), B / (A * A + B * B), -A / (A * A + B * B),
     (A * A - B * B) / (A * A + B * B) ** 2),
    (lambda x, y: where(x < y, x * y, x), A * B, B, A, 1.0),
    (lambda x, y: 3.0 - abs(x - y), 3.0 - (B - A), 1.0, -1.0, 0.0),
)  # fmt: skip


@pytest.mark.parametrize(("formula", "value", "first", "second", "mixed"), CASES)
@pytest.mark.parametrize("kind", [float, lambda number: Column(np.full(3, number))])
def test_first_and_mixed_derivatives_are_exact(formula, value, first, second, mixed, kind):
    result = formula(Jet(kind(A), 1.0, 0.0), Jet(kind(B), 0.0, 1.0))
    for part, expected in zip(result.parts, (value, first, second, mixed), strict=True):
        assert np.asarray(part, dtype=float) == pytest.approx(expected, rel=1e-14)


def test_along_one_direction_twice_it_is_velocity_and_acceleration():
    """Of sin(t^2) at t, moved by t' = 2 and t'' = 3."""
    t, rate, gain = 0.4, 2.0, 3.0
    moving = Jet(t, rate, rate, gain)
    result = sin(moving * moving)
    inner, rates = t * t, 2.0 * t * rate
    assert result.first == result.second == pytest.approx(math.cos(inner) * rates)
    gains = 2.0 * rate * rate + 2.0 * t * gain
    assert result.mixed == pytest.approx(-math.sin(inner) * rates**2 + math.cos(inner) * gains)


def test_a_jet_is_not_a_truth_value():
    with pytest.raises(TypeError, match="truth value"):
        bool(Jet(1.0))

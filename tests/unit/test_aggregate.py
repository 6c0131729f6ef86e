"""One number from many: against NumPy, and as the weighted sum that gives its derivatives."""

import numpy as np
import pytest

from kinetostat.studies.optimisation.terms import parse_aggregate
from refusals import refused

VALUES = np.random.default_rng(0).normal(size=(40, 9))
ALL = np.ones(VALUES.shape, dtype=bool)
TEXTS = ["worst", "mean", "percentile 95", "percentile 50", "percentile 0", "percentile 100"]


def by_numpy(text, values, high_is_bad):
    sign = 1.0 if high_is_bad else -1.0
    if text == "worst":
        return sign * np.max(sign * values, axis=-1)
    if text == "mean":
        return values.mean(axis=-1)
    return sign * np.percentile(sign * values, float(text.split()[1]), axis=-1)


@pytest.mark.parametrize("high_is_bad", [True, False])
@pytest.mark.parametrize("text", TEXTS)
def test_it_is_that_of_numpy(text, high_is_bad):
    found = parse_aggregate(text, "over").over(VALUES, ALL, high_is_bad)
    np.testing.assert_allclose(found, by_numpy(text, VALUES, high_is_bad), rtol=1e-14)


@pytest.mark.parametrize("high_is_bad", [True, False])
@pytest.mark.parametrize("text", TEXTS)
def test_what_does_not_count_changes_nothing(text, high_is_bad):
    aggregate = parse_aggregate(text, "over")
    there = np.random.default_rng(1).random(VALUES.shape) < 0.6
    there[0] = False
    spoiled = np.where(there, VALUES, np.nan)
    found = aggregate.over(spoiled, there, high_is_bad)
    assert np.isnan(found[0])
    for value, row, mask in zip(found[1:], VALUES[1:], there[1:], strict=True):
        assert value == pytest.approx(float(by_numpy(text, row[mask], high_is_bad)), rel=1e-13)


@pytest.mark.parametrize("high_is_bad", [True, False])
@pytest.mark.parametrize("text", TEXTS)
def test_its_weights_make_it(text, high_is_bad):
    aggregate = parse_aggregate(text, "over")
    there = np.random.default_rng(2).random(VALUES.shape) < 0.7
    there[:, 0] = True
    for row, mask in zip(VALUES, there, strict=True):
        weights = aggregate.weights(row, mask, high_is_bad)
        assert weights.sum() == pytest.approx(1.0)
        assert not weights[~mask].any()
        assert weights @ row == pytest.approx(float(aggregate.over(row[None], mask[None], high_is_bad)[0]))


def test_an_infinite_value_is_the_worst():
    values = np.array([[1.0, np.inf, 2.0]])
    assert parse_aggregate("worst", "over").over(values, values > 0, True)[0] == np.inf
    assert parse_aggregate("percentile 50", "over").over(values, values > 0, True)[0] == 2.0


@pytest.mark.parametrize("text", ["best", "percentile", "percentile 101", "percentile -3", ""])
def test_anything_else_is_refused(text):
    with refused(r"objectives\.0\.over"):
        parse_aggregate(text, "objectives.0.over")

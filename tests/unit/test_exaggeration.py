"""The factor of the deflected shape: steps of a slider, text, refusals."""

import pytest

from refusals import refused

pytest.importorskip("nicegui", reason="the extra kinetostat[studio] is not installed")

from kinetostat.studio.controls import FACTOR_STEPS, factor_at, factor_position, factor_text, read_factor


def test_the_slider_knows_round_factors_only():
    factors = [factor_at(position) for position in range(FACTOR_STEPS + 1)]
    assert factors[:4] == [0.001, 0.002, 0.005, 0.01]
    assert factors[-1] == 1e9
    assert [factor_position(factor) for factor in factors] == list(range(FACTOR_STEPS + 1))
    assert factor_at(factor_position(230.0)) == 200.0


@pytest.mark.parametrize(("text", "factor"), [("250", 250.0), ("× 1,000", 1000.0), ("2e3", 2000.0), ("auto", None)])
def test_a_factor_is_read(text, factor):
    assert read_factor(text) == factor


def test_what_the_page_shows_is_read_again():
    assert read_factor(factor_text(123456.0, automatic=False)) == 123456.0
    assert read_factor(factor_text(123456.0, automatic=True)) is None


@pytest.mark.parametrize("text", ["much", "0", "-3", "inf", "nan", "1e10"])
def test_what_is_no_factor_is_refused(text):
    with refused(r"must be a number from 0\.001 to 1e"):
        read_factor(text)

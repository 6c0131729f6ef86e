"""What moves freely in a leg, its wrenches and least steps, and motions about fixed screws: against other routes."""

import numpy as np
import pytest

from kinetostat.accuracy.closing import LEAST_SEEN_RATIO, Screws, independent_columns
from kinetostat.numerics.motions import each_about, exponential


def leg_screws(count=30, seed=4):
    """Free screws of a leg with two idle freedoms: the third and the last follow from others [n x 6 x 6]."""
    rng = np.random.default_rng(seed)
    screws = rng.normal(size=(count, 6, 6))
    screws[:, :, 2] = screws[:, :, 0] - 0.3 * screws[:, :, 1]
    screws[:, :, 5] = screws[:, :, 3] + 2.0 * screws[:, :, 1]
    return screws


def test_freedoms_that_follow_from_others_are_left_out():
    assert independent_columns(leg_screws()) == (0, 1, 3, 4)
    assert independent_columns(np.zeros((5, 6, 0))) == ()


def test_steps_are_those_of_singular_values_and_wrenches_do_no_work():
    screws = leg_screws()
    screws[7, :, 4] = screws[7, :, 3] + 1e-6 * screws[7, :, 4]  # places at which a regular leg is nearly singular,
    screws[8, :, 4] = screws[8, :, 3]  # and singular
    screws[9] = np.nan
    free = Screws(screws, independent_columns(leg_screws()))
    twists = np.random.default_rng(5).normal(size=(len(screws), 6))
    steps = free.steps(twists)
    regular = np.array([n for n in range(len(screws)) if n not in (8, 9)])
    assert np.einsum("nim,nik->nmk", free.wrenches, free.screws)[regular] == pytest.approx(0.0, abs=1e-11)
    assert np.swapaxes(free.wrenches, 1, 2)[:9] @ free.wrenches[:9] == pytest.approx(np.tile(np.eye(2), (9, 1, 1)))
    for number in (n for n in range(len(screws)) if n != 9):
        least = np.linalg.pinv(screws[number], rcond=LEAST_SEEN_RATIO) @ twists[number]
        assert steps[number] == pytest.approx(least, rel=1e-9, abs=1e-9 * np.abs(least).max())
    assert np.isnan(free.wrenches[9]).all()
    assert not np.isnan(np.delete(steps, 9, axis=0)).any()


def test_screw_motions_about_fixed_axes_are_exponentials():
    rng = np.random.default_rng(6)
    twists, amounts = rng.normal(size=(5, 6)), rng.normal(size=(20, 5)) * 10.0 ** rng.uniform(-9, 1, (20, 1))
    twists[1, :3] = 0.0  # a slide
    twists[2, 3:] = np.cross([0.3, -0.2, 0.5], twists[2, :3])  # a turn about a line
    twists[3] *= 1e-3
    for number, motion in enumerate(each_about(twists, amounts)):
        other = exponential(twists[number] * amounts[:, number, None])
        assert motion.rotation == pytest.approx(other.rotation, abs=1e-14)
        assert motion.translation == pytest.approx(other.translation, rel=1e-13, abs=1e-14)

"""Volumes from random points in cells, what hangs together on a grid, and the surface around it."""

import math
from itertools import pairwise

import numpy as np
import pytest

from kinetostat.engine.points import Axis, Cells
from kinetostat.numerics.isosurface import surface
from kinetostat.studies.workspace import FEWEST_CELLS, connected_to, estimate_volume


def cells(*counts, seed=0, ends=(-1.0, 1.0)):
    return Cells([Axis((f"pose.{i}",), np.linspace(*ends, count + 1)) for i, count in enumerate(counts)], seed)


def points(where):
    return np.stack(list(where.columns(0, where.size).values()))


class TestCells:
    def test_each_cell_holds_two_points_one_after_the_other(self):
        where = cells(3, 4, 5)
        steps = np.array([2 / 3, 2 / 4, 2 / 5])
        found = np.floor((points(where).T + 1.0) / steps).astype(int)
        assert where.size == 120
        assert np.array_equal(found, np.repeat(np.indices((3, 4, 5)).reshape(3, -1).T, 2, axis=0))

    @pytest.mark.parametrize("cuts", [(0, 1, 2, 3, 120), (0, 7, 31, 90, 120), (0, 120)])
    def test_runs_of_points_are_those_of_the_whole_bit_for_bit(self, cuts):
        where = cells(3, 4, 5, seed=9)
        parts = [where.columns(a, b)["pose.2"] for a, b in pairwise(cuts)]
        assert np.array_equal(np.concatenate(parts), where.columns(0, 120)["pose.2"])

    def test_points_are_uniform_and_independent(self):
        shares = (points(cells(40, 40)) + 1.0) * 20.0 % 1.0
        one, other = shares[0, ::2], shares[0, 1::2]
        for values in (one, other, shares[1]):
            counts, _ = np.histogram(values, 10, (0.0, 1.0))
            assert (abs(counts - len(values) / 10) < 5 * math.sqrt(len(values) / 10)).all()
        assert abs(np.corrcoef(one, other)[0, 1]) < 4 / math.sqrt(len(one))
        assert abs(np.corrcoef(*shares)[0, 1]) < 4 / math.sqrt(shares.shape[1])

    def test_seeds_give_other_points(self):
        assert not np.isin(points(cells(5, 5, seed=1)), points(cells(5, 5, seed=2))).any()


def ball(dims, count, seed):
    where = cells(*[count] * dims, seed=seed)
    inside = (points(where) ** 2).sum(axis=0) <= 0.81
    return estimate_volume(inside, np.zeros_like(inside), [2.0] * dims, ["m"] * dims)


ALL, NONE = np.ones(8, dtype=bool), np.zeros(8, dtype=bool)
TRUE = {2: math.pi * 0.9**2, 3: 4 / 3 * math.pi * 0.9**3, 4: math.pi**2 / 2 * 0.9**4}


class TestVolume:
    @pytest.mark.parametrize(("dims", "count"), [(2, 12), (3, 8), (4, 6)])
    def test_a_ball_is_met_without_bias_and_the_error_is_honest(self, dims, count):
        """200 seeds: the mean error is nothing, and the errors spread as they are said to."""
        found = [ball(dims, count, seed) for seed in range(200)]
        scores = np.array([(one.value - TRUE[dims]) / one.standard_error for one in found])
        assert abs(scores.mean()) < 4 / math.sqrt(200)
        assert 0.85 < scores.std() < 1.15
        assert (abs(scores) < 2).mean() > 0.9

    @pytest.mark.parametrize("dims", [2, 3])
    def test_the_error_falls_faster_than_that_of_independent_points(self, dims):
        least = {2: 40, 3: 12}[dims]
        coarse, fine = ball(dims, least, 0), ball(dims, 4 * least, 0)
        expected = 4.0 ** -((dims + 1) / 2)
        assert fine.standard_error / coarse.standard_error == pytest.approx(expected, rel=0.25)

    def test_units_are_those_of_the_axes(self):
        for units, unit in ((["m", "m"], "m²"), (["m", "rad", "m"], "m²·rad"), (["rad"] * 3, "rad³")):
            assert estimate_volume(ALL, NONE, [1] * len(units), units).unit == unit

    def test_all_or_nothing_has_no_error(self):
        every = np.ones(2 * FEWEST_CELLS, dtype=bool)
        full = estimate_volume(every, ~every, [2.0, 3.0], ["m", "m"])
        assert (full.value, full.standard_error, full.unknown, full.share) == (6.0, 0.0, 0.0, 1.0)
        assert estimate_volume(NONE, NONE, [2.0, 3.0], ["m", "m"]).value == 0.0

    def test_too_few_cells_have_no_error(self):
        assert math.isnan(estimate_volume(ALL, NONE, [2.0, 3.0], ["m", "m"]).standard_error)

    def test_a_cell_with_an_unknown_point_counts_whole_and_once(self):
        unknown = np.array([1, 1, 0, 1, 0, 0, 0, 0], dtype=bool)
        volume = estimate_volume(NONE, unknown, [2.0, 3.0], ["m", "m"])
        assert (volume.value, volume.unknown_cells, volume.unknown) == (0.0, 2, 3.0)


class TestConnected:
    MAZE = np.array([[c == "#" for c in row] for row in ("####.#", ".....#", "######", "#.....", "######")])

    def test_it_goes_round_corners_and_not_through_gaps(self):
        everything = connected_to(self.MAZE, (4, 5))
        assert not everything[0, :4].any()
        assert everything.sum() == self.MAZE.sum() - 4

    def test_corners_do_not_join(self):
        assert connected_to(np.eye(4, dtype=bool), (2, 2)).sum() == 1

    def test_outside_is_joined_to_nothing(self):
        assert not connected_to(self.MAZE, (1, 0)).any()

    @pytest.mark.parametrize("dims", [2, 3, 4])
    def test_borders_are_walls(self, dims):
        """A region that touches opposite borders must not leak round the grid."""
        region = np.ones([4] * dims, dtype=bool)
        region[1:3] = False
        assert connected_to(region, (0,) * dims).sum() == 4 ** (dims - 1)


class TestSurface:
    AXES = (np.linspace(-1, 1, 33),) * 3

    def ball(self, radius=0.7):
        far = sum(c**2 for c in np.meshgrid(*self.AXES, indexing="ij")) ** 0.5
        return np.clip((radius - far) * 16.0, -1.0, 1.0)

    def test_it_is_closed(self):
        triangles = surface(self.ball(), self.AXES)
        corners = [tuple(p) for p in triangles.reshape(-1, 3).round(9)]
        edges = [(corners[3 * t + i], corners[3 * t + (i + 1) % 3]) for t in range(len(triangles)) for i in range(3)]
        assert sorted(edges) == sorted((b, a) for a, b in edges)

    @pytest.mark.parametrize(("radius", "volume"), [(0.7, 4 / 3 * math.pi * 0.7**3), (2.0, 8.0)])
    def test_it_looks_outward_and_holds_the_volume(self, radius, volume):
        """The second ball fills the box, whose sides then close it."""
        a, b, c = surface(self.ball(radius), self.AXES).transpose(1, 0, 2)
        assert (np.cross(a, b) * c).sum() / 6.0 == pytest.approx(volume, rel=0.01)

    def test_axes_may_have_any_scale(self):
        stretched = surface(self.ball(), (self.AXES[0], 10 * self.AXES[1], self.AXES[2] + 5))
        assert np.allclose(stretched, surface(self.ball(), self.AXES) * [1, 10, 1] + [0, 0, 5])

    def test_nothing_has_no_surface(self):
        assert surface(-np.ones((4, 4, 4)), (np.arange(4.0),) * 3).shape == (0, 3, 3)

"""Where the next poses to measure are looked for: within the limits of the machine's file, or where it has been."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from kinetostat import load
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.parameters import values, with_values
from kinetostat.spec.fields import Field, Quantity, made_table
from kinetostat.studies.identification.identification import identification_of
from kinetostat.studies.identification.next_poses import LONGEST_RAY, RAY_STEPS, _alike, unit_of, within_limits
from machines import load_without_limits
from synthetic_measurements import measured, posed, truth_of


@pytest.fixture(scope="module")
def answers():
    """Fits of a hexapod with and without limits to the same measurements of a small range."""
    model, poses = posed(load("hexapod"), 24)
    data = measured(model, poses, truth_of(model))
    free, _ = posed(load_without_limits("hexapod"), 24)
    return [identification_of(each, data, more=5).next for each in (model, free)], poses


def test_next_poses_keep_the_limits_one_by_one(answers):
    (proposed, _), _ = answers
    for row in range(5):
        at = with_values(load("hexapod"), {path: float(column[row]) for path, column in proposed.poses.items()})
        response = respond(at)
        assert response.status == Status.OK
        assert response.checks
        assert all(check.kept for check in response.checks)
    assert "within the [limits]" in proposed.area


def test_limits_let_them_go_farther_than_what_was_measured_and_make_them_worth_more(answers):
    (within, without), poses = answers
    for path, column in poses.items():
        low, high = within.ranges[path]
        assert low < column.min()
        assert high > column.max()
        low, high = without.ranges[path]
        assert low >= column.min()
        assert high <= column.max()
    assert within.gain > 1.2 * without.gain
    assert "sets no [limits]" in without.area


def test_distances_are_measured_from_where_a_file_measures_them_also_if_few_of_its_lines_do():
    model, poses = posed(load("hexapod"), 8)
    data = measured(model, poses, truth_of(model))
    station = np.array([0.3, -0.2, 1.1])
    origins = np.full((8, 3), np.nan)
    origins[:2] = station
    proposed = _alike(replace(data, origins=origins), poses, 4)
    np.testing.assert_array_equal(proposed.origins, np.tile(station, (4, 1)))
    np.testing.assert_array_equal(_alike(data, poses, 4).origins, np.zeros((4, 3)))


def test_rays_end_at_the_strokes_of_slides():
    """A Tripteron's slides are its coordinates: it goes 0.4 m to either side, less the last step of a ray."""
    machine = load("tripteron")
    given = values(machine)
    paths = [path for path in given if path.startswith("pose.")]
    length = float(machine.chains().length)
    home = {path: np.array([float(given[path])]) for path in paths}
    poses = within_limits(machine, home, dict.fromkeys(paths, length), 3000, np.random.default_rng(1))
    for path in paths:
        off = poses[path] - given[path]
        for farthest in (off.max(), -off.min()):
            assert 0.35 - LONGEST_RAY * length / RAY_STEPS < farthest <= 0.4


def test_nothing_is_drawn_where_nothing_is_limited_or_no_measured_pose_keeps_the_limits():
    rng, units = np.random.default_rng(0), {"pose.z": 1.0}
    assert within_limits(load_without_limits("hexapod"), {"pose.z": np.array([0.135])}, units, 10, rng) is None
    assert within_limits(load("hexapod"), {"pose.z": np.array([0.5])}, units, 10, rng) is None


def test_the_unit_of_a_coordinate_follows_from_its_kind_whatever_its_name():
    fields = {"lift": Field(Quantity("length", "height")), "swing": Field(Quantity("angle", "turn"))}
    machine = SimpleNamespace(family=SimpleNamespace(every_table={"pose": made_table("Pose", fields)}))
    assert [unit_of(machine, path) for path in ("pose.lift", "pose.swing")] == ["m", "rad"]

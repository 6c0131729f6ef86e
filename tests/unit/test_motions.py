"""Motions: what files of poses over time, of moves and of sines say, and the profiles of moves."""

import numpy as np
import pytest

from kinetostat.machine.loading import load
from kinetostat.spec.errors import InputError
from kinetostat.studies.motions import read_motion
from kinetostat.studies.moves import along_profile, profile


@pytest.fixture
def hexapod():
    return load("hexapod")


def motion_of(machine, folder, text, points=400):
    path = folder / "motion.csv"
    path.write_text(text, "utf-8")
    return read_motion(machine, path, points)


@pytest.mark.parametrize("jerk", [np.inf, 200.0, 30.0])
@pytest.mark.parametrize(("length", "feed"), [(0.5, 0.2), (0.01, 5.0), (1.0, 0.8), (1e-4, 1.0)])
def test_a_move_ends_where_it_shall_and_keeps_its_limits(length, feed, jerk):
    phases = profile(length, feed, 4.0, jerk)
    time, way, speed, gain = along_profile(phases, 50)
    assert way[-1] == pytest.approx(length, rel=1e-12)
    assert speed[-1] == pytest.approx(0.0, abs=1e-12 * feed)
    assert speed.max() <= feed * (1.0 + 1e-12)
    assert np.abs(gain).max() <= 4.0 * (1.0 + 1e-12)
    rises = np.diff(gain)[np.diff(time) > 0.0] / np.diff(time)[np.diff(time) > 0.0]
    assert np.isinf(jerk) or np.abs(rises).max() <= jerk * (1.0 + 1e-9)
    # One of the limits is reached, so that no move of this form is faster.
    reached = [speed.max() / feed, np.abs(gain).max() / 4.0, 1.0 if np.isfinite(jerk) else 0.0]
    assert max(reached) == pytest.approx(1.0, rel=1e-12)


def test_seven_phases_by_hand():
    """1 m at 1 m/s, 2 m/s², 10 m/s³: 0.2 s of jerk, 0.3 s at 2 m/s², and a cruise of 1 - 0.7 = 0.3 s."""
    times = [duration for duration, *_ in profile(1.0, 1.0, 2.0, 10.0)]
    assert times == pytest.approx([0.2, 0.3, 0.2, 0.3, 0.2, 0.3, 0.2])


def test_an_arc_leads_through_its_point_at_the_pull_of_its_radius(hexapod, tmp_path):
    text = (
        "feed [mm/s], acceleration [m/s**2], shape, x [mm], y [mm], z [mm]\n"
        "100, 5, line, 20, 0, 140\n100, 5, through, 0, 20, 140\n100, 5, arc, -20, 0, 140\n"
    )
    motion = motion_of(hexapod, tmp_path, text)
    x, y = motion.path.pose["x"], motion.path.pose["y"]
    assert np.hypot(x, y) == pytest.approx(0.02)
    assert y.max() == pytest.approx(0.02, rel=1e-3)
    speed = np.hypot(motion.path.rates["x"], motion.path.rates["y"])
    assert speed.max() == pytest.approx(0.1)
    cruising = np.isclose(speed, 0.1)
    pull = np.hypot(motion.path.accelerations["x"], motion.path.accelerations["y"])[cruising]
    assert np.median(pull) == pytest.approx(0.1**2 / 0.02)


def test_rates_are_those_of_the_positions(hexapod, tmp_path):
    texts = (
        "time [s], x [mm], pitch [deg]\n0,0,0\n0.1,5,1\n0.2,9,3\n0.3,5,2\n0.4,-3,0\n0.5,-4,-1\n0.6,-1,-1\n0.7,0,0\n",
        "feed [mm/s], acceleration [m/s**2], jerk [m/s**3], x [mm], roll [deg]\n200,5,100,0,0\n200,5,100,20,3\n",
        "field, amplitude, frequency [Hz], phase [deg]\nz, 5 mm, 10, 0\nroll, 2 deg, 20, 90\n",
    )
    for text in texts:
        motion = motion_of(hexapod, tmp_path, text, 4000)
        step = np.diff(motion.times)
        for whole, rate in ((motion.path.pose, motion.path.rates), (motion.path.rates, motion.path.accelerations)):
            for name in whole:
                change = 0.5 * (rate[name][1:] + rate[name][:-1]) * step
                assert np.diff(whole[name]) == pytest.approx(
                    change, abs=2e-4 * max(np.abs(np.diff(whole[name])).max(), 1e-9)
                )


def test_a_spline_through_a_polynomial_is_it(hexapod, tmp_path):
    times = np.linspace(0.0, 1.0, 9)
    rows = "\n".join(f"{t!r}, {0.01 * t**5 - 0.02 * t**2!r}" for t in times.tolist())
    motion = motion_of(hexapod, tmp_path, f"time, x\n{rows}\n")
    assert motion.path.accelerations["x"] == pytest.approx(0.2 * motion.times**3 - 0.04, abs=1e-10)
    assert not motion.periodic


def test_quaternions_turn_on_past_half_a_turn(tmp_path):
    """A yaw from 170 to 190 deg, written as quaternions, goes on by 20 deg and not back by 340."""
    yaw = np.radians(np.linspace(170.0, 190.0, 5))
    rows = "\n".join(f"{t}, {np.cos(a / 2):.17g}, 0, 0, {np.sin(a / 2):.17g}" for t, a in enumerate(yaw.tolist()))
    heads = "time, quaternion.w, quaternion.x, quaternion.y, quaternion.z"
    motion = motion_of(load("hexapod"), tmp_path, f"{heads}\n{rows}\n")
    assert np.ptp(motion.path.pose["yaw"]) == pytest.approx(np.radians(20.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x [mm]\n0\n1\n", "neither times nor a feed rate"),
        ("feed, x [mm]\n1, 0\n1, 1\n", "no acceleration"),
        ("time, x\n0, 0\n0, 1\n", "times must grow"),
        ("time, feed, x\n0, 1, 0\n1, 1, 1\n", "no column feed"),
        ("feed, acceleration, shape, x\n1, 1, line, 0\n1, 1, arc, 1\n", "through before it"),
        ("feed, acceleration, shape, x\n1, 1, line, 0\n1, 1, spline, 1\n", "not a shape"),
        ("feed, acceleration, x\n1, 1, 0\n1, 1, 0\n", "nothing moves"),
        ("time, base_radius\n0, 0.1\n1, 0.2\n", "does not move"),
        ("field, amplitude, frequency\nw, 1, 1\n", '"w" is not a field.*its pose are x, y, z'),
        ("field, amplitude, frequency\ntool.mass, 1, 1\n", "tool.mass does not swing; write a coordinate"),
        ("field, amplitude [mm], frequency\nforce.x, 1, 1\n", "amplitude of force.x is .* not a unit of force"),
        ("field, amplitude\nx, 1\n", "no column frequency"),
    ],
)
def test_what_is_no_motion_is_said(hexapod, tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        motion_of(hexapod, tmp_path, text)

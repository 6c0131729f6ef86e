"""Stability lobes: closed forms of one mode, and the delayed equations of the whole machine, integrated in the test."""

import math

import numpy as np
import pytest

from chatter import edges, growth
from kinetostat import evaluate, load, lobes, modes
from kinetostat.spec.errors import InputError
from kinetostat.vibration.cutting import borders, milling, tried_frequencies, turning

PRESSURE = 2e9
HEXAPOD = ["tool.mass=12 kg", "cutting.direction=[1, 0.3, 0.2]", "cutting.pressure=2000 N/mm**2", "damping.ratio=0.03"]
HEXAPOD.append("tool.inertia=[0.05, 0.06, 0.08, 0, 0, 0]")


def one_mode(frequency, stiffness, ratio):
    """Receptances of one mode along x, and the frequencies at which they are."""
    tried = tried_frequencies(np.array([frequency]), np.array([ratio]))
    share = tried / frequency
    receptances = np.zeros((len(tried), 3, 3), dtype=complex)
    receptances[:, 0, 0] = 1.0 / (stiffness * (1.0 - share**2 + 2j * ratio * share))
    return tried, receptances


def test_one_mode_has_the_width_of_the_closed_form():
    """b = 2 k zeta (1 + zeta) / p at omega sqrt(1 + 2 zeta); J. Tlusty, Manufacturing Processes and Equipment, 2000."""
    tried, receptances = one_mode(120.0, 3e7, 0.04)
    border = borders(receptances, tried, turning(PRESSURE, np.array([1.0, 0.0, 0.0])))
    least, frequency = border.least
    assert least == pytest.approx(2 * 3e7 * 0.04 * 1.04 / PRESSURE, rel=1e-5)
    assert frequency == pytest.approx(120.0 * math.sqrt(1.08), rel=1e-3)


def test_waves_between_edges_are_those_of_the_textbook():
    """omega T = 3 pi + 2 atan(Im / Re) + 2 pi k, from the same book: the speeds of each lobe."""
    tried, receptances = one_mode(120.0, 3e7, 0.04)
    border = borders(receptances, tried, turning(PRESSURE, np.array([1.0, 0.0, 0.0])))
    chatters = np.isfinite(border.widths[:, 0])
    response = receptances[chatters, 0, 0]
    expected = 3.0 * math.pi + 2.0 * np.arctan(response.imag / response.real)
    difference = (border.phases[chatters, 0] - expected) / (2.0 * math.pi)
    np.testing.assert_allclose(difference, np.round(difference), atol=1e-9)


def test_a_slot_has_the_factors_of_altintas_and_budak():
    """Full immersion: the mean directional factors are those of the paper, pi (-r, -1; 1, -r)."""
    engagement = milling(PRESSURE, 0.07, 3, 0.0, math.pi, np.array([1.0, 0, 0]), np.array([0, 0, 1.0]))
    np.testing.assert_allclose(
        engagement.mean_force, 3 / (4 * math.pi) * math.pi * np.array([[-0.07, -1.0], [1.0, -0.07]]), atol=1e-15
    )
    np.testing.assert_allclose(engagement.directions, [[1, 0, 0], [0, 1, 0]], atol=1e-15)


def grown(machine, ways, force, width, period):
    """The factor by which a disturbance of the machine's tool grows from edge to edge."""
    vibration = modes(machine)
    solution = vibration.solution
    assert solution.mode_count == len(solution.inverse_squares)
    return growth(
        solution.inverse_squares,
        vibration.damping.ratio,
        ways @ solution.tool[3:],
        lambda share: PRESSURE * width * force(share),
        period,
    )


def edge(radial):
    """Force of an edge at an angle, per pressure, width and difference of paths along the feed and across it."""

    def push(angle):
        sine, cosine = math.sin(angle), math.cos(angle)
        return np.outer([-cosine - radial * sine, sine - radial * cosine], [sine, cosine])

    return push


@pytest.mark.parametrize("speed", [1500.0, 2500.0, 8000.0])
def test_a_turning_machine_begins_to_chatter_at_the_width(speed):
    machine = load("hexapod", HEXAPOD)
    answer = lobes(machine, lowest=f"{speed} 1/min", highest=f"{2 * speed} 1/min")
    direction = np.array([1, 0.3, 0.2]) / np.linalg.norm([1, 0.3, 0.2])
    width = answer.widths[0]
    for share, grows in ((0.97, False), (1.03, True)):
        factor = grown(machine, direction[None], lambda _: np.array([[-1.0]]), share * width, 1.0 / answer.speeds[0])
        assert (factor > 1.0) is grows


@pytest.mark.parametrize(
    ("entry", "leaving", "teeth", "agreed"), [(0.0, math.pi, 4, 0.03), (math.pi / 2, math.pi, 3, 0.15)]
)
@pytest.mark.parametrize("speed", [1300.0, 2000.0, 3500.0])
@pytest.mark.numbers
def test_a_milling_machine_begins_to_chatter_at_the_width(entry, leaving, teeth, agreed, speed):
    """Four edges in a slot push the same at any time, so that the mean is exact; half a slot is near it."""
    machine = load("hexapod", HEXAPOD)
    answer = lobes(machine, teeth, entry, leaving, radial=0.25, lowest=f"{speed} 1/min", highest=f"{2 * speed} 1/min")
    width, period = answer.widths[0], 1.0 / (teeth * answer.speeds[0])
    ways = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    for share, grows in ((1.0 - agreed, False), (1.0 + agreed, True)):
        factor = grown(machine, ways, edges(teeth, entry, leaving, edge(0.25)), share * width, period)
        assert (factor > 1.0) is grows


def test_the_least_width_is_the_stable_width_of_maps_and_no_speed_allows_less():
    machine = load("hexapod", HEXAPOD)
    answer = lobes(machine)
    assert answer.least == pytest.approx(
        float(evaluate(machine, {"x": [0.0]}, ["stable_width"])["stable_width"][0]), rel=1e-5
    )
    assert answer.widths.min() >= answer.least * (1.0 - 1e-9)
    assert answer.best[1] > 3.0 * answer.least
    assert answer.frequency == pytest.approx(modes(machine).softest([1, 0.3, 0.2]).frequency, rel=1e-3)


def test_over_poses_the_least_counts():
    machine = load("hexapod", HEXAPOD)
    speeds = {"lowest": "1000 1/min", "highest": "5000 1/min"}
    whole = lobes(machine, teeth=4, over=["x=-2 cm:2 cm:3"], **speeds)
    each = [lobes(load("hexapod", [*HEXAPOD, f"pose.x={x} cm"]), teeth=4, **speeds) for x in (-2, 0, 2)]
    np.testing.assert_allclose(whole.widths, np.min([one.widths for one in each], axis=0), rtol=1e-12)
    assert whole.least == min(one.least for one in each)
    assert whole.poses == 3
    assert dict(whole.worst)["pose.x"] == [-0.02, 0.0, 0.02][int(np.argmin([one.least for one in each]))]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"teeth": 0}, "1 to 100"),
        ({"teeth": 2, "entry": "1 mm"}, "entry is"),
        ({"teeth": 2, "entry": "100 deg", "leaving": "90 deg"}, "leaves after that"),
        ({"teeth": 2, "feed": [0, 0, 1]}, "right angles"),
        ({"teeth": 2, "radial": -1.0}, "radial is"),
        ({"lowest": "5000 1/min", "highest": "4000 1/min"}, "exchange"),
        ({"cutting_pressure": "-1 Pa"}, "cutting_pressure"),
        ({"over": "x=0 mm:1 mm:3000"}, "at most 2,000"),
    ],
)
def test_what_is_no_cut_is_refused(options, says):
    with pytest.raises(InputError, match=says):
        lobes(load("hexapod", HEXAPOD), **options)


def test_a_machine_that_says_nothing_of_its_cut_is_told_what_to_write():
    with pytest.raises(InputError, match="pressure = "):
        lobes(load("hexapod", ["tool.mass=12 kg"]))
    with pytest.raises(InputError, match="direction = "):
        lobes(load("hexapod", ["tool.mass=12 kg"]), cutting_pressure=PRESSURE)

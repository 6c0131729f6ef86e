"""Cables that hang: against a catenary that the test integrates itself, and against weights and differences."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kinetostat.equilibrium.cables import Hanging, hanging_cables, leaving_points

WEIGHT, RIGIDITY = 0.064 * 9.81, 50528.43 * 9.736
SPANS = [(9.13, 3.39), (3.0, 5.0), (8.0, -2.0), (0.4, 4.0), (12.0, 0.0)]


def cable(level, rise, tension, weight=WEIGHT, rigidity=RIGIDITY):
    given = (np.full((1, 1), value) for value in (level, rise, tension, weight, rigidity))
    return hanging_cables(*given)


def integrated(hung):
    """The path of the cable from its platform end: position by unstretched length, from equilibrium of its pieces."""
    across, up, length = (float(part[0, 0]) for part in (hung.across, hung.up, hung.length))

    def rates(s, _place):
        pull = np.array([across, up + WEIGHT * s])
        size = np.linalg.norm(pull)
        return pull / size * (1.0 + size / RIGIDITY)

    points = np.linspace(0.0, length, 4001)
    return solve_ivp(rates, (0.0, length), [0.0, 0.0], t_eval=points, method="DOP853", rtol=1e-13, atol=1e-13).y


@pytest.mark.parametrize(("level", "rise"), SPANS)
@pytest.mark.parametrize("tension", [20.0, 100.0, 360.0, 4000.0])
def test_a_cable_hangs_as_the_integrated_one(level, rise, tension):
    hung = cable(level, rise, tension)
    path = integrated(hung)
    assert path[:, -1] == pytest.approx([level, rise], abs=1e-8)
    assert hung.tension[0, 0] == pytest.approx(tension, rel=1e-13)
    chord = np.array([level, rise]) / np.hypot(level, rise)
    apart = np.abs(path[0] * chord[1] - path[1] * chord[0])
    place = int(apart.argmax())
    fit = np.polyfit(np.arange(-2, 3), apart[place - 2 : place + 3], 2)  # the deepest point lies between two steps
    assert hung.sag[0, 0] == pytest.approx(fit[2] - fit[1] ** 2 / (4.0 * fit[0]), abs=1e-8)


def test_both_ends_carry_the_weight():
    hung = cable(9.13, 3.39, 100.0)
    down = hung.base_tension * np.sin(hung.base_slope) - hung.up
    assert down == pytest.approx(hung.weight * hung.length, rel=1e-12)
    assert hung.base_tension * np.cos(hung.base_slope) == pytest.approx(hung.across, rel=1e-12)


@pytest.mark.parametrize(("level", "rise"), SPANS)
def test_its_compliance_is_the_rate_of_its_spans(level, rise):
    hung, step = cable(level, rise, 120.0), 1e-3
    for column, (across, up) in enumerate([(step, 0.0), (0.0, step)]):
        ends = [
            np.array(Hanging(hung.across + s * across, hung.up + s * up, hung.weight, hung.rigidity, hung.length).spans)
            for s in (1.0, -1.0)
        ]
        rate = (ends[0] - ends[1])[:, 0, 0] / (2.0 * step)
        assert hung.compliance[0, 0, :, column] == pytest.approx(rate, rel=1e-6, abs=1e-12)


def test_a_cable_of_cogiro_keeps_43_percent_of_its_stiffness_at_100_newtons_and_97_at_360():
    assert round(100.0 * float(cable(9.14, 3.39, 100.0).stiffness_share[0, 0])) == 43
    assert round(100.0 * float(cable(9.14, 3.39, 360.0).stiffness_share[0, 0])) == 97


def test_a_light_cable_is_straight_and_a_vertical_one_only_stretches():
    light = cable(9.13, 3.39, 100.0, weight=1e-7)
    assert light.length[0, 0] == pytest.approx(np.hypot(9.13, 3.39) / (1.0 + 100.0 / RIGIDITY), rel=1e-12)
    upright = cable(0.0, 4.0, 50.0)
    stretched = upright.length * (1.0 + (50.0 + 0.5 * WEIGHT * upright.length) / RIGIDITY)
    assert stretched[0, 0] == pytest.approx(4.0, rel=1e-12)


@pytest.mark.parametrize("slope", [0.3, 1.2, -0.4])
def test_a_cable_leaves_its_wheel_along_its_slope_where_it_touches(slope):
    guide, end, radius = np.array([[[1.0, 2.0, 3.0]]]), np.array([[[4.0, 6.0, 1.0]]]), 0.1
    point, wound = leaving_points(guide, end, np.array([radius]), np.array([[slope]]))
    ahead, up = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])
    spoke = point[0, 0] - (guide[0, 0] + radius * ahead)
    assert np.linalg.norm(spoke) == pytest.approx(radius, rel=1e-12)
    assert spoke @ (np.cos(slope) * -ahead + np.sin(slope) * up) == pytest.approx(0.0, abs=1e-15)
    turned = np.arctan2(spoke @ up, -spoke @ ahead) % (2.0 * np.pi)  # from the guide's side of the wheel, over its top
    assert wound[0, 0] == pytest.approx(radius * turned, rel=1e-12)

"""Widths of cut that chatter, against a printed table of how disturbances of a milling tool grow from edge to edge.

Tool: T. Insperger and G. Stepan, "Updated semi-discretization method for periodic delay-differential equations with
discrete delay", International Journal for Numerical Methods in Engineering 61 (2004): two edges, 922 Hz and 0.03993 kg
both along the feed and across it, tangential force 600 N/mm² and normal force 200 N/mm² per area of the chip.
Table: results/label_spotcheck.json of github.com/tkkpku/sld-ml-benchmark (4627bb7, CC-BY-4.0), `rho_label`, with 80
steps between two edges. Its program has the radial force of `xy` with the other sign than Altintas and Budak have
(code/sdm_solver.py, `direction_coeffs`), and what it calls down milling goes from 0 upwards; so does this test.
"""

import math

import numpy as np
import pytest

from chatter import edges, growth
from kinetostat.vibration.cutting import Engagement, borders, tried_frequencies

TEETH, PRESSURE, RADIAL, MASS = 2, 6e8, 1.0 / 3.0, 0.03993
CUTS = ((4000.0, 5e-5), (7037.9746835, 4.1535433070866146e-4), (10075.9493670, 7.807086614173229e-4),
        (13113.9240506, 1.1460629921259842e-3), (16000.0, 1.5e-3))  # fmt: skip
"""Speeds of the spindle, 1/min, and widths of cut, m."""
PRINTED = {
    (0.50, 0.011, 922.0): (0.6474094, 0.8870603, 1.4715559, 0.7583596, 1.6973263),
    (0.10, 0.011, 922.0): (0.6283559, 0.7956261, 0.9453729, 0.8020911, 1.0195655),
    (0.50, 0.005, 922.0): (0.8272600, 1.0288438, 1.5938119, 0.8077617, 1.7834008),
    (0.50, 0.011, 800.0): (0.6784369, 1.4215302, 1.7389723, 1.5370005, 1.7219419),
    (0.50, 0.008, 700.0): (0.7798073, 0.9081450, 0.8207101, 1.9984246, 1.8452413),
    (0.05, 0.011, 922.0): (0.6285189, 0.7972111, 0.9237557, 0.8448576, 1.0023533),
    (0.25, 0.005, 922.0): (0.8184280, 0.9499476, 1.2239021, 0.8165387, 1.3455218),
    (0.60, 0.005, 922.0): (0.8319829, 1.0888183, 1.8161531, 0.8895455, 2.0597078),
    (0.15, 0.030, 922.0): (0.2873651, 0.5354354, 0.7655434, 0.5869532, 0.9226709),
}  # fmt: skip
"""Growth from edge to edge, by radial immersion as a share of the diameter, damping ratio, and frequency in Hz."""


def push(angle):
    """Force of an edge per pressure, width and difference of paths, as the program of the table has it."""
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.array(
        [
            [-sine * cosine - RADIAL * sine**2, -(cosine**2) + RADIAL * sine * cosine],
            [sine**2 - RADIAL * sine * cosine, sine * cosine - RADIAL * cosine**2],
        ]
    )


def leaving(immersion):
    return math.acos(1.0 - 2.0 * immersion)


@pytest.mark.parametrize(("tool", "printed"), PRINTED.items(), ids=str)
def test_cuts_chatter_where_the_table_grows(tool, printed):
    """The mean of the force is exact for no cut of this table: between 3/4 and 5/4 of the border nobody can say."""
    immersion, ratio, frequency = tool
    angles = np.linspace(0.0, leaving(immersion), 4001)
    mean = TEETH / (2.0 * math.pi) * np.trapezoid(push(angles), angles)
    tried = tried_frequencies(np.array([frequency]), np.array([ratio]))
    share = tried / frequency
    stiffness = MASS * (2.0 * math.pi * frequency) ** 2
    response = 1.0 / (stiffness * (1.0 - share**2 + 2j * ratio * share))
    border = borders(
        response[:, None, None] * np.eye(3), tried, Engagement(TEETH, PRESSURE, np.eye(3)[:2], mean)
    ).widths_at(np.array([speed / 60.0 for speed, _ in CUTS]))
    decided = 0
    for (_, width), limit, factor in zip(CUTS, border, printed, strict=True):
        if not 0.75 < width / limit < 1.25:
            assert (factor > 1.0) is bool(width > limit)
            decided += 1
    assert decided >= 3


@pytest.mark.parametrize("cut", range(len(CUTS)))
def test_the_integration_of_the_tests_gives_the_printed_factors(cut):
    """With as many steps as the table has; both take the delayed path as straight over a step, in another way."""
    immersion, ratio, frequency = tool = next(iter(PRINTED))
    speed, width = CUTS[cut]
    square = 1.0 / (2.0 * math.pi * frequency) ** 2
    force = edges(TEETH, 0.0, leaving(immersion), push)
    factor = growth(
        np.full(2, square),
        ratio,
        np.eye(2) * math.sqrt(square / MASS),
        lambda share: PRESSURE * width * force(share),
        60.0 / (TEETH * speed),
        steps=80,
    )
    assert factor == pytest.approx(PRINTED[tool][cut], rel=3e-3)

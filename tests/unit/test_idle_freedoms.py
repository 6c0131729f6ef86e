"""Idle freedoms are so by form; beside such a form a leg is nearly locked, and its margin falls to zero steadily."""

import math

import numpy as np
import pytest

from kinetostat import build
from kinetostat.kinetostatics.response import respond

LEG = """
[[legs]]
name = "leg {number}"
joints = [
  {{ name = "ball", type = "spherical", joins = ["base", "tube"], point = {foot} }},
  {{ name = "slide", type = "prismatic", joins = ["tube", "rod"], point = {foot}, axis = {line}, actuated = true, stiffness = 1e7 }},
  {{ name = "fork", type = "universal", joins = ["rod", "platform"], point = {head}, first_axis = {first}, second_axis = {second} }},
]
"""  # noqa: E501
TOP = """
schema = 1
name = "six struts"
family = "legs"
platform.point = [0, 0, 0.4]
pose = { x = 0, y = 0, z = 0.4, roll = 0, pitch = 0, yaw = 0 }
"""


def first_leg(angle):
    """A hexapod whose first strut has a fork at a small angle to its line: margin and idle freedoms of that leg."""
    legs = []
    for i, (low, high) in enumerate(zip([0, 60, 120, 180, 240, 300], [-20, 80, 100, 200, 220, 320], strict=True)):
        foot = np.array([0.3 * math.cos(math.radians(low)), 0.3 * math.sin(math.radians(low)), 0.0])
        head = np.array([0.15 * math.cos(math.radians(high)), 0.15 * math.sin(math.radians(high)), 0.4])
        line = (head - foot) / np.linalg.norm(head - foot)
        across = np.cross([0.0, 0.0, 1.0], line)
        across /= np.linalg.norm(across)
        first = math.cos(angle) * line + math.sin(angle) * across if i == 0 else across
        vectors = {"foot": foot, "head": head, "line": line, "first": first, "second": np.cross(line, across)}
        legs.append(LEG.format(number=i + 1, **{name: vector.tolist() for name, vector in vectors.items()}))
    response = respond(build(TOP + "".join(legs)))
    return float(response.legs[0].singularity_margin), response.configuration.legs[0].idle


@pytest.mark.parametrize("angle", [1e-4, 1e-6, 1e-8, 1e-10])
def test_the_margin_falls_with_the_angle_that_is_left(angle):
    margin, idle = first_leg(angle)
    assert idle == ()
    assert margin == pytest.approx(angle * first_leg(1e-3)[0] / 1e-3, rel=1e-3)


def test_a_fork_along_the_strut_is_idle():
    margin, idle = first_leg(0.0)
    assert len(idle) == 1
    assert margin > 0.1

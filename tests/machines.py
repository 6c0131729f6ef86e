"""The table of machines: one row per bundled machine, over which every property test runs.

A new machine is one more row of `CASES`: the range of each of its lengths and angles, in which random designs and poses
are drawn. Stiffnesses need no range; each test says which it wants.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import radians

import pytest
from hypothesis import strategies as st

from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

REGULAR = 0.02
"""Least regularity of a drawn pose. Statics solve W; this near a singularity they lose less than three digits of 16."""


@dataclass(frozen=True)
class Case:
    """A bundled machine and where its geometry and pose may vary.

    Attributes:
        name: of the bundled machine.
        ranges: per leaf path of [geometry] and [pose], least and greatest value, SI.
        freedoms: of the platform when all links are rigid and the actuators free.
    """

    name: str
    ranges: Mapping[str, tuple[float, float]]
    freedoms: int

    def __repr__(self) -> str:
        return self.name


def degrees(low: float, high: float) -> tuple[float, float]:
    return radians(low), radians(high)


CASES = [
    Case(
        "zhang-gosselin-4dof",
        {
            "geometry.base_radius": (0.15, 0.40),
            "geometry.platform_radius": (0.06, 0.20),
            "geometry.base_angle": degrees(10, 60),
            "geometry.platform_angle": degrees(30, 80),
            "geometry.passive_links.0": (0.45, 0.80),
            "geometry.passive_links.1": (0.45, 0.80),
            "geometry.passive_leg_offset": (-0.10, 0.10),
            "pose.x": (-0.20, 0.20),
            "pose.z": (0.40, 0.85),
            "pose.theta5": degrees(-85, 0),
            "pose.theta6": degrees(80, 160),
        },
        freedoms=4,
    ),
    Case(
        "passive-leg-3dof-pu",
        {
            "geometry.base_radius": (0.15, 0.40),
            "geometry.platform_radius": (0.06, 0.14),
            "geometry.base_angles.0": degrees(22, 38),
            "geometry.base_angles.1": degrees(142, 158),
            "geometry.base_angles.2": degrees(262, 278),
            "geometry.platform_angles.0": degrees(22, 38),
            "geometry.platform_angles.1": degrees(142, 158),
            "geometry.platform_angles.2": degrees(262, 278),
            "pose.z": (0.40, 0.85),
            "pose.theta1": degrees(-30, 30),
            "pose.theta2": degrees(-30, 30),
        },
        freedoms=3,
    ),
    Case(
        "tricept",
        {
            "geometry.base_radius": (0.30, 0.70),
            "geometry.platform_radius": (0.10, 0.25),
            "geometry.base_angles.0": degrees(22, 38),
            "geometry.base_angles.1": degrees(142, 158),
            "geometry.base_angles.2": degrees(262, 278),
            "geometry.platform_angles.0": degrees(22, 38),
            "geometry.platform_angles.1": degrees(142, 158),
            "geometry.platform_angles.2": degrees(262, 278),
            "pose.theta1": degrees(-30, 30),
            "pose.theta2": degrees(-30, 30),
            "pose.length": (0.8, 1.5),
        },
        freedoms=3,
    ),
    Case(
        "hexapod",
        {
            "geometry.base_radius": (0.09, 0.15),
            "geometry.platform_radius": (0.06, 0.12),
            "geometry.base_angles.0": degrees(-18, -2),
            "geometry.base_angles.1": degrees(2, 12),
            "geometry.base_angles.2": degrees(102, 112),
            "geometry.base_angles.3": degrees(122, 132),
            "geometry.base_angles.4": degrees(222, 232),
            "geometry.base_angles.5": degrees(242, 252),
            "geometry.platform_angles.0": degrees(-52, -42),
            "geometry.platform_angles.1": degrees(48, 58),
            "geometry.platform_angles.2": degrees(68, 78),
            "geometry.platform_angles.3": degrees(168, 178),
            "geometry.platform_angles.4": degrees(188, 198),
            "geometry.platform_angles.5": degrees(-72, -62),
            "geometry.base_height": (0.0, 0.03),
            "geometry.platform_height": (-0.08, 0.05),
            "pose.x": (-0.03, 0.03),
            "pose.y": (-0.03, 0.03),
            "pose.z": (0.10, 0.20),
            "pose.roll": degrees(-15, 15),
            "pose.pitch": degrees(-15, 15),
            "pose.yaw": degrees(-15, 15),
        },
        freedoms=6,
    ),
]

every_machine = pytest.mark.parametrize("case", CASES, ids=repr)


def stiffness_paths(machine: Machine) -> list[str]:
    """The leaf paths of all stiffnesses."""
    return [leaf for p in parameters(machine.family) if p.quantity.stiff and len(p.leaves) == 1 for leaf in p.leaves]


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """Stiffnesses from 10^low to 10^high, evenly over the decades."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


MODERATE = decades(3, 6)
"""Stiffnesses within a contrast of 1e3, as between actuators and links that are built to match."""
CONTRASTING = decades(1, 11)
"""Stiffnesses as different as a soft servo and a link that is all but rigid."""


@st.composite
def machines(draw: st.DrawFn, case: Case, stiffness: st.SearchStrategy[float] = MODERATE) -> Machine:
    """A random design of the machine at a random regular pose, with every single field varied."""
    machine = load(case.name)
    drawn = {path: draw(st.floats(low, high), label=path) for path, (low, high) in case.ranges.items()}
    drawn |= {path: draw(stiffness, label=path) for path in stiffness_paths(machine)}
    assert set(drawn) == set(values(machine)), "a field of the machine has no range in its row of CASES"
    return with_values(machine, drawn)


def is_regular(machine: Machine) -> bool:
    """Whether the pose can be reached and is not near a singularity."""
    response = respond(machine)
    return response.status == Status.OK and response.regularity > REGULAR


def regular_machines(case: Case, stiffness: st.SearchStrategy[float] = MODERATE) -> st.SearchStrategy[Machine]:
    """Random designs at poses that can be reached and are not near a singularity."""
    return machines(case, stiffness).filter(is_regular)


def regular(case: Case, stiffness: st.SearchStrategy[float] = MODERATE) -> st.SearchStrategy[Response]:
    """What they answer."""
    return regular_machines(case, stiffness).map(respond)

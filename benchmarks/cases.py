"""The machines that are timed, each with batched NumPy and hand-written C++ that share no code with kinetostat."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import radians

import numpy as np
import numpy.typing as npt

import numpy_4dof
import numpy_hexapod
import numpy_tripteron
from kinetostat.kinetostatics.quantities import GROUPS

Array = npt.NDArray[np.float64]

TWELVE = (*GROUPS["compliance"], *GROUPS["stiffness"])
SUM = dict.fromkeys(GROUPS["compliance"], 1.0)
"""The paper's objective, eq. 40: all six compliances with weight 1."""


@dataclass(frozen=True)
class Case:
    """A machine and how it is timed.

    Attributes:
        title: for people.
        machine: name of the bundled machine.
        ranges: of the pose coordinates, SI: poses are drawn at random between them.
        design: seven parameters by which the compliance sum is differentiated.
        diagonals: in batched NumPy, from pose coordinates to the diagonals of C and K [12 x n].
        kernels: what the C++ kernels of it do, and their numbers in `kernels.cpp`.
        numbers: the memory that they take the machine from.
    """

    title: str
    machine: str
    ranges: Mapping[str, tuple[float, float]]
    design: tuple[str, ...]
    diagonals: Callable[..., Array]
    kernels: Mapping[str, int]
    numbers: Array

    def poses(self, count: int) -> dict[str, Array]:
        """Random poses, columns by leaf path."""
        random = np.random.default_rng(2002)
        return {path: random.uniform(low, high, count) for path, (low, high) in self.ranges.items()}


FOUR_DOF = Case(
    "The paper's 4-dof machine",
    "zhang-gosselin-4dof",
    {
        "pose.x": (-0.02, 0.02),
        "pose.z": (0.66, 0.70),
        "pose.theta5": (radians(-70), radians(-50)),
        "pose.theta6": (radians(110), radians(130)),
    },
    (
        "geometry.platform_radius",
        "geometry.base_radius",
        "geometry.passive_links.0",
        "geometry.passive_links.1",
        "geometry.base_angle",
        "geometry.platform_angle",
        "pose.z",
    ),
    numpy_4dof.diagonals,
    {"6x6 Cholesky (eq. 32)": 0, "reduced by hand to 4x4": 1},
    np.concatenate(
        [
            *numpy_4dof.BASE.T[:2],
            *numpy_4dof.PLATFORM.T[:2],
            [numpy_4dof.FIRST_LINK, numpy_4dof.SECOND_LINK],
            [numpy_4dof.ACTUATOR] * 4,
            numpy_4dof.BENDING,
        ]
    ),
)

HEXAPOD = Case(
    "A hexapod, 6-UPS",
    "hexapod",
    {
        "pose.x": (-0.01, 0.01),
        "pose.y": (-0.01, 0.01),
        "pose.z": (0.13, 0.14),
        "pose.roll": (-0.1, 0.1),
        "pose.pitch": (-0.1, 0.1),
        "pose.yaw": (-0.1, 0.1),
    },
    (
        "geometry.base_radius",
        "geometry.platform_radius",
        "geometry.base_height",
        "geometry.platform_height",
        "geometry.base_angles.0",
        "geometry.platform_angles.0",
        "pose.z",
    ),
    numpy_hexapod.diagonals,
    {"6x6 Cholesky": 2, "with margin and limits": 4},
    np.concatenate(
        [
            *numpy_hexapod.BASE.T,
            *numpy_hexapod.PLATFORM.T,
            [numpy_hexapod.ACTUATOR] * 6,
            [numpy_hexapod.SHORTEST**2, numpy_hexapod.LONGEST**2, *[np.cos(numpy_hexapod.STEEPEST) ** 2] * 2],
            [numpy_hexapod.LENGTH, numpy_hexapod.LEAST_MARGIN],
        ]
    ),
)

TRIPTERON = Case(
    "The Tripteron, written leg by leg: 39 springs, overconstrained",
    "tripteron",
    {"pose.x": (0.2, 0.8), "pose.y": (0.2, 0.8), "pose.z": (0.2, 0.8)},
    (
        "sections.bar.diameter",
        "legs.x.slide.stiffness",
        "legs.y.slide.stiffness",
        "legs.z.slide.stiffness",
        "legs.z.shoulder.point.0",
        "legs.z.elbow.point.0",
        "pose.z",
    ),
    numpy_tripteron.diagonals,
    {"3x3 per leg by hand, 6x6 Cholesky": 3},
    np.array(
        [
            numpy_tripteron.LINK,
            numpy_tripteron.LINK / (numpy_tripteron.SHEAR * 2 * numpy_tripteron.SECOND),
            numpy_tripteron.LINK / (numpy_tripteron.YOUNG * numpy_tripteron.SECOND),
            numpy_tripteron.LINK**3 / (12 * numpy_tripteron.YOUNG * numpy_tripteron.SECOND),
            numpy_tripteron.ACTUATOR,
        ]
    ),
)

CASES = {"4-dof": FOUR_DOF, "hexapod": HEXAPOD, "tripteron": TRIPTERON}

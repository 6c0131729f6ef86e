"""Speeds and accelerations at one pose in the directions that are worst for each drive, where no motion is given."""

from collections.abc import Mapping, Sequence

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.moving import PosePath, RigidForm, forces_on_path
from kinetostat.kinematics.closing import POINT
from kinetostat.machine.parameters import POSE, values
from kinetostat.motion.machine_at_pose import NUMBERS_OF_DRIVE
from kinetostat.spec.errors import InputError
from kinetostat.studies.motions import Motion

DIRECTIONS_OF_SPEED = 32
"""Directions of the speed, beside those in which a drive is fastest: in space they are some 35 degrees apart."""


def every_direction(form: RigidForm, speed: float, acceleration: float) -> Motion:
    """A speed and an acceleration of the platform point in the directions that are worst for each drive.

    A drive is fastest where the speed is along its row of J, and its inertia is greatest where the acceleration is
    along its row of J^-T M, either way; each of these accelerations is met by each of those speeds, by others spread
    evenly over all directions, and by rest.

    Args:
        form: form of the machine's equations, at its pose.
        speed, acceleration: speed and acceleration of the platform point, m/s and m/s².

    Raises:
        InputError: no coordinate of the pose is x, y or z.
    """
    coordinates = {
        path.removeprefix(POSE): float(v) for path, v in values(form.machine).items() if path.startswith(POSE)
    }
    moving = [name for name in coordinates if name in POINT]
    if not moving:
        raise InputError(f"no coordinate of the pose of {form.machine.name} is x, y or z; give a motion instead.")
    count = len(moving)
    units, zeros = np.eye(count), np.zeros((count, count))
    # Unit speeds at rest of all else, then unit accelerations: their numbers are the columns of J and of J^-T M.
    unit_path = _at_pose(coordinates, moving, np.concatenate([units, zeros]), np.concatenate([zeros, units]))
    drives = forces_on_path(form, unit_path).drives
    fastest = drives[:, NUMBERS_OF_DRIVE.index("speed"), :count]
    hardest = drives[:, NUMBERS_OF_DRIVE.index("inertia"), count:]
    speeds = np.concatenate([np.zeros((1, count)), *_both_ways(fastest), _spread(count)]) * speed
    accelerations = np.concatenate(_both_ways(hardest)) * acceleration
    each_speed, each_acceleration = (
        np.repeat(speeds, len(accelerations), axis=0),
        np.tile(accelerations, (len(speeds), 1)),
    )
    return Motion(
        kind=f"every direction at {speed:.4g} m/s and {acceleration:.4g} m/s²",
        times=np.zeros(len(each_speed)),
        path=_at_pose(coordinates, moving, each_speed, each_acceleration),
        timeless=True,
    )


def _at_pose(pose: Mapping[str, float], moving: Sequence[str], rates: Array, accelerations: Array) -> PosePath:
    """Rates and accelerations of the moving coordinates [n x moving], all at one pose; the others are at rest."""
    count = len(rates)

    def by_name(table: Array) -> dict[str, Array]:
        return {name: table[:, moving.index(name)] if name in moving else np.zeros(count) for name in pose}

    return PosePath(
        {name: np.full(count, value) for name, value in pose.items()}, by_name(rates), by_name(accelerations)
    )


def _both_ways(rows: Array) -> list[Array]:
    """Unit vectors along rows that are not zero, and against them."""
    sizes = np.linalg.norm(rows, axis=1, keepdims=True)
    units = rows[sizes[:, 0] > 0.0] / sizes[sizes[:, 0] > 0.0]
    return [units, -units]


def _spread(size: int) -> Array:
    """Directions spread evenly over a sphere, a circle or a line [n x size]."""
    if size == 1:
        return np.array([[1.0], [-1.0]])
    shares = (np.arange(DIRECTIONS_OF_SPEED) + 0.5) / DIRECTIONS_OF_SPEED
    if size == 2:
        return np.column_stack([np.cos(2.0 * np.pi * shares), np.sin(2.0 * np.pi * shares)])
    # Fibonacci's lattice: even steps of height, and turns by the golden angle.
    height, angle = 1.0 - 2.0 * shares, np.pi * (1.0 + np.sqrt(5.0)) * DIRECTIONS_OF_SPEED * shares
    across = np.sqrt(1.0 - height**2)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), height])

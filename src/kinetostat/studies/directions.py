"""Directions that a user gives as three numbers, and the stiffness of a machine along and about one of them."""

import math
from collections.abc import Callable, Iterable, Sequence
from numbers import Real

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.indices import Block, free_stiffness_along, guided_stiffness_along
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.immutable import ImmutableAnswer

LARGEST_COMPONENT = 1e100
"""Greatest component of a direction, whose square is still a finite number."""


@dataclass(frozen=True, eq=False)
class DirectionalStiffness(ImmutableAnswer):
    """Stiffness along and about one direction, in the axes of K and C.

    Attributes:
        direction: the direction as it was given [3].
        force, force_held: force per displacement along it, N/m, with rotations free and with rotations held (the
            `guided` ones of `Indices`); None if the machine has no such direction, or the stiffness no finite value.
        moment, moment_held: moment per angle about it, N·m/rad, with the tool point free and with it held.
    """

    direction: Array
    force: float | None
    force_held: float | None
    moment: float | None
    moment_held: float | None


def stiffness_along(
    direction: Sequence[float], stiffness: Array | None, compliance: Array | None, components: tuple[int, ...]
) -> DirectionalStiffness:
    """Compute the stiffness of the tool point along and about a direction.

    Args:
        direction: a vector of any length, in the axes of K and C [3].
        stiffness, compliance: K and C [n x n]; None for one that is not finite.
        components: the components of their rows, from rx ry rz x y z = 0 ... 5.

    Raises:
        InputError: the direction has no length, or none in the plane of a planar machine.
    """
    direction = three_numbers(direction)

    def along(block: Block, function: Callable[..., float | None]) -> float | None:
        try:
            return function(direction, block, stiffness, compliance, components)
        except ValueError:  # the direction is zero or not one of this block; below, one of neither block is refused
            return None

    force, force_held = along("translation", free_stiffness_along), along("translation", guided_stiffness_along)
    moment, moment_held = along("rotation", free_stiffness_along), along("rotation", guided_stiffness_along)
    if all(value is None for value in (force, force_held, moment, moment_held)):
        raise InputError(
            f"The direction {shorten(direction)} is zero, or perpendicular to the plane of this machine; give three "
            "numbers, e.g. (1, 0, 0), on the command line --along 1,0,0."
        )
    return DirectionalStiffness(
        direction=np.array(direction), force=force, force_held=force_held, moment=moment, moment_held=moment_held
    )


def three_numbers(direction: Sequence[float]) -> tuple[float, ...]:
    """A direction as three finite floats of a size that can be squared.

    Raises:
        InputError: it is not three finite numbers.
    """
    entries = [] if isinstance(direction, str) or not isinstance(direction, Iterable) else list(direction)
    numbers = [float(c) for c in entries if isinstance(c, Real) and not isinstance(c, bool)]
    if len(entries) != 3 or len(numbers) != 3 or not all(abs(c) <= LARGEST_COMPONENT for c in numbers):
        raise InputError(
            f"The direction is {shorten(direction)}; give three finite numbers, e.g. (0, 0, 1), on the command line "
            "--along 0,0,1; its length does not matter."
        )
    return tuple(numbers)


def unit_direction(direction: Sequence[float], name: str) -> tuple[float, ...]:
    """A direction at unit length.

    Args:
        direction: three numbers of any size.
        name: name of the argument, for messages.

    Raises:
        InputError: it is not three finite numbers, or zero.
    """
    numbers = three_numbers(direction)
    size = math.hypot(*numbers)
    if size == 0.0:
        raise InputError(f"{name} is {shorten(direction)}; give three numbers that are not all zero, e.g. (0, 0, 1).")
    return tuple(c / size for c in numbers)

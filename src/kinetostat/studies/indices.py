"""Indices of one pose that follow from K and C: principal stiffnesses, condition number, centres, eigenscrews.

The formulas are in `kinetostatics`.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from numbers import Real
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.eigenscrews import (
    Eigenscrew,
    Point,
    centre_of_compliance,
    centre_of_elasticity,
    centre_of_stiffness,
    compliance_eigenscrews,
    eigenscrews,
)
from kinetostat.kinetostatics.indices import (
    SPATIAL,
    Block,
    Principal,
    PrincipalStiffness,
    free_stiffness_along,
    free_stiffnesses,
    guided_stiffness_along,
    guided_stiffnesses,
    principal_compliances,
    stiffness_condition,
)
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names

LARGEST_COMPONENT = 1e100
"""Greatest component of a direction, whose square is still a finite number."""


@former_names(principal="principal_compliances", condition="stiffness_condition")
@dataclass(frozen=True, eq=False)
class Indices(ImmutableAnswer):
    """Indices of a pose, at T and in the axes of K and C.

    Attributes:
        principal_compliances: principal compliances by block; None if a direction is free.
        free, guided: principal stiffnesses by block, with the other block free or held (`kinetostatics.indices`).
        stiffness_condition: condition number of K, with rotations times the characteristic length; infinite if the
            machine is rigid or free in a direction.
        centres: centres of stiffness, compliance and elasticity, from T, m; None for a centre that does not exist.
        eigenscrews: eigenscrews of K, or of C if K is not finite; empty for a planar machine.
    """

    principal_compliances: dict[str, Principal] | None
    free: dict[str, PrincipalStiffness] | None
    guided: dict[str, PrincipalStiffness] | None
    stiffness_condition: float
    centres: dict[str, Point | None]
    eigenscrews: tuple[Eigenscrew, ...]


@dataclass(frozen=True, eq=False)
class Along(ImmutableAnswer):
    """Stiffness along one direction, in the axes of K and C. What is `held` here is `guided` in `Indices`.

    Attributes:
        direction: the direction as it was given [3].
        force, force_held: force per displacement along it, N/m, with rotations free and with rotations held; None if
            the machine has no such direction, or the stiffness no finite value.
        moment, moment_held: moment per angle about it, N·m/rad, with the tool point free and with it held.
    """

    direction: Array
    force: float | None
    force_held: float | None
    moment: float | None
    moment_held: float | None


def stiffness_along(
    direction: Sequence[float], stiffness: Array | None, compliance: Array | None, components: tuple[int, ...]
) -> Along:
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
        except ValueError:  # The direction is zero, or not one of this block; below, none of either block is an error.
            return None

    force, force_held = along("translation", free_stiffness_along), along("translation", guided_stiffness_along)
    moment, moment_held = along("rotation", free_stiffness_along), along("rotation", guided_stiffness_along)
    if all(value is None for value in (force, force_held, moment, moment_held)):
        raise InputError(
            f"The direction {shorten(direction)} is zero, or perpendicular to the plane of this machine; give three "
            "numbers, e.g. (1, 0, 0), on the command line --along 1,0,0."
        )
    return Along(np.array(direction), force, force_held, moment, moment_held)


def three_numbers(direction: Sequence[float]) -> tuple[float, ...]:
    """A direction as three finite floats of a size that can be squared.

    Raises:
        InputError: it is not three finite numbers.
    """
    given = [] if isinstance(direction, str) or not isinstance(direction, Iterable) else list(direction)
    numbers = [float(c) for c in given if isinstance(c, Real) and not isinstance(c, bool)]
    if len(given) != 3 or len(numbers) != 3 or not all(abs(c) <= LARGEST_COMPONENT for c in numbers):
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


def indices_of(
    stiffness: Array | None, compliance: Array | None, length: float, components: tuple[int, ...]
) -> Indices:
    """Compute every index that K [n x n] and C [n x n] give; either matrix may be missing.

    Args:
        stiffness, compliance: K and C [n x n]; None for one that is not finite.
        length: characteristic length, m.
        components: the components of their rows, from rx ry rz x y z = 0 ... 5.
    """
    screws: list[Eigenscrew] = []
    if components == SPATIAL:
        if stiffness is not None:
            screws = eigenscrews(stiffness)
        elif compliance is not None:
            screws = compliance_eigenscrews(compliance)
    return Indices(
        None if compliance is None else principal_compliances(compliance, components),
        free_stiffnesses(stiffness, compliance, components),
        guided_stiffnesses(stiffness, compliance, components),
        stiffness_condition(stiffness, compliance, length, components),
        {
            "stiffness": centre_of_stiffness(stiffness, components),
            "compliance": centre_of_compliance(compliance, components),
            "elasticity": centre_of_elasticity(stiffness, compliance, components),
        },
        tuple(screws),
    )


def indices_json(indices: Indices) -> dict[str, Any]:
    """The indices as plain data, for the JSON of an analysis."""
    compliances = (indices.principal_compliances or {}).items()
    stiffnesses = {"free": indices.free or {}, "guided": indices.guided or {}}
    return {
        "principal_compliances": {
            block: {"values": c.compliances, "directions": c.directions} for block, c in compliances
        }
        or None,
        "principal_stiffnesses": {
            kind: {block: {"values": k.stiffnesses, "directions": k.directions} for block, k in blocks.items()}
            for kind, blocks in stiffnesses.items()
        },
        "stiffness_condition": indices.stiffness_condition,
        "centres": indices.centres,
        "eigenscrews": indices.eigenscrews,
    }

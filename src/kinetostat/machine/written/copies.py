"""Copies of a leg that is written once: turned about the z axis of the base, and mirrored in its x-z plane.

Numbers belong to the leg that is written, so that a change of one changes it in every copy. Points, axes and 6x6
matrices are in the base frame at the home pose.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.loads import turned_tensor
from kinetostat.machine.written.plan import Copies, JointPlan, LegPlan, Matrix
from kinetostat.spec.errors import InputError, shorten
from kinetostat.units import UnitError, parse

COPY_KEYS = ("copies", "angles", "mirrored")
"""Fields of a leg about its copies."""
SNAP = 1e-15
"""Distance from 0, 1/2 or 1 at which a cosine or sine is meant to be that number: multiples of 30 deg are exact."""

MOST_COPIES = 24
"""Legs that a machine may have; more copies would only be made to be refused."""


@dataclass(frozen=True)
class CopyPlacement:
    """The way a copy lies: first the mirror image in the x-z plane of the base, if `mirrored`, then the turn about z.

    Attributes:
        cosine, sine: the cosine and sine of the angle of the turn.
        mirrored: whether it is a mirror image.
    """

    cosine: float
    sine: float
    mirrored: bool

    def vector(self, vector: Vector) -> Vector:
        """A point or direction of the written leg in the copy."""
        y = -vector.y if self.mirrored else vector.y
        return Vector(vector.x * self.cosine - y * self.sine, vector.x * self.sine + y * self.cosine, vector.z)

    def matrix(self, matrix: Matrix) -> Matrix:
        """A compliance of the written leg in the copy: rows rx ry rz x y z. A mirror turns rotations the other way."""
        if not matrix:
            return matrix
        columns = [self.vector(Vector(*axis)).components() for axis in np.eye(3).tolist()]
        turn = np.array(columns, dtype=float).T
        both = np.kron(np.diag([-1.0 if self.mirrored else 1.0, 1.0]), turn)
        return tuple(tuple(row) for row in (both @ np.array(matrix) @ both.T).tolist())


def placements(copies: Copies, where: str) -> list[CopyPlacement]:
    """The placement of each of the copies, the first one first; mirror images follow the copies that they mirror.

    Raises:
        InputError: an entry of angles is not an angle; names the leg.
    """
    turns = copies.count // 2 if copies.mirrored else copies.count
    angles = [_angle(angle, where) for angle in copies.angles] or [2.0 * math.pi * i / turns for i in range(turns)]
    images = (False, True) if copies.mirrored else (False,)
    return [
        CopyPlacement(_without_round_off(math.cos(a)), _without_round_off(math.sin(a)), image)
        for a in angles
        for image in images
    ]


def _angle(angle: object, where: str) -> float:
    try:
        return parse(angle, "angle")
    except UnitError as error:
        raise InputError(f"{where}: an entry of angles is {shorten(angle)}: {error}.") from None


def _without_round_off(number: float) -> float:
    near = round(2.0 * number) / 2.0
    return near if abs(number - near) < SNAP else number


def copies_in(leg: dict[str, Any], where: str) -> Copies | None:
    """Take out of a leg its fields about copies; None if it has none.

    Raises:
        InputError: no number of copies, or one that does not go with the angles; names the leg.
    """
    count, angles, mirrored = leg.pop("copies", None), leg.pop("angles", []), leg.pop("mirrored", False)
    if count is None and angles == [] and mirrored is False:
        return None
    if not isinstance(mirrored, bool):
        raise InputError(f"{where}: mirrored is {shorten(mirrored)}; it must be true or false.")
    if not isinstance(angles, list):
        raise InputError(f'{where}: angles is {shorten(angles)}; give a list, e.g. ["0 deg", "120 deg", "240 deg"].')
    each = 2 if mirrored else 1
    count = count if count is not None else each * max(1, len(angles))
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_COPIES or count % each:
        even = ", and even, as mirrored legs come in pairs" if mirrored else ""
        raise InputError(
            f"{where}: copies is {shorten(count)}; it must be the number of legs, {each} to {MOST_COPIES}{even}."
        )
    if angles and len(angles) * each != count:
        raise InputError(
            f"{where}: angles has {len(angles)} entries for {count} copies; give {count // each}, or leave it out "
            "for equal steps around the z axis."
        )
    return Copies(count, tuple(angles), mirrored)


def legs_of(leg: LegPlan, copies: Copies | None, where: str) -> tuple[LegPlan, ...]:
    """The legs that a written leg stands for: itself, or its copies, numbered from 1.

    Raises:
        InputError: as `placements` does.
    """
    if copies is None:
        return (leg,)
    return tuple(
        replace(leg, name=f"{leg.name} {i}", copy_of=leg.name, copies=copies, placement=placement)
        for i, placement in enumerate(placements(copies, where), 1)
    )


def joint_numbers(leg: LegPlan, joint: JointPlan, tables: Mapping[str, Any]) -> Any:
    """The numbers of a joint, with points and axes where they are in this leg."""
    data = tables[leg.table(joint.name)]
    if leg.placement is None:
        return data
    return SimpleNamespace(**{name: _number_in_copy(value, leg.placement) for name, value in vars(data).items()})


def matrix_in(leg: LegPlan, matrix: Matrix) -> Matrix:
    """A compliance that is written for a leg, where it is in this leg."""
    return matrix if leg.placement is None else leg.placement.matrix(matrix)


def direction_in(leg: LegPlan, direction: Sequence[float]) -> Vector:
    """A direction that is written for a leg, where it points in this leg."""
    return Vector(*direction) if leg.placement is None else leg.placement.vector(Vector(*direction))


def inertia_in(leg: LegPlan, tensor: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """An inertia tensor that is written for a leg, in the axes of this leg; a mirror image is turned likewise."""
    return tuple(tensor) if leg.placement is None else turned_tensor(leg.placement.vector, tensor)


def _number_in_copy(value: Any, placement: CopyPlacement) -> Any:
    return placement.vector(Vector(*value)).components() if isinstance(value, tuple) else value

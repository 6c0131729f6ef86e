"""Screws: twists and wrenches, their reciprocal product, and their transport to another point or other axes.

Rotation first, as everywhere in kinetostat: a twist is [omega; v], a wrench [moment; force]. Nothing here knows legs.

Source: theory (28); Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation (1994), sections 2.4
and 2.5. Axes are whatever the caller's are; every function names the point at which its screw is.
"""

from collections.abc import Sequence
from typing import Self

from kinetostat.algebra.scalar import Scalar, is_zero
from kinetostat.algebra.vector import ZERO, Rotation, Vector
from kinetostat.frozen import dataclass

COMPONENTS = ("rx", "ry", "rz", "x", "y", "z")
"""Names of the six components, in order, in every array, table, file and axis label."""


@dataclass(frozen=True)
class Screw:
    """Six scalars in two vectors: what twists and wrenches have in common."""

    rotational: Vector
    translational: Vector

    @classmethod
    def of(cls, components: Sequence[Scalar]) -> Self:
        """Return the screw of six components, in the order of `components`."""
        return cls(Vector(*components[:3]), Vector(*components[3:]))

    def components(self) -> tuple[Scalar, ...]:
        """The six scalars in the order rx ry rz x y z."""
        return self.rotational.components() + self.translational.components()

    def __add__(self, other: Self) -> Self:
        return type(self)(self.rotational + other.rotational, self.translational + other.translational)

    def __sub__(self, other: Self) -> Self:
        return type(self)(self.rotational - other.rotational, self.translational - other.translational)

    def __mul__(self, factor: Scalar) -> Self:
        return type(self)(self.rotational * factor, self.translational * factor)

    def turned_by(self, rotation: Rotation) -> Self:
        """The same screw carried along by a rotation of everything about the reference point."""
        return type(self)(rotation.apply(self.rotational), rotation.apply(self.translational))


@dataclass(frozen=True)
class Twist(Screw):
    """Angular velocity (rad/s) and velocity of the reference point (m/s), or a small displacement (rad; m)."""

    def at_offset(self, offset: Vector) -> "Twist":
        """The same motion at the point whose vector from the present one is `offset` (m): v' = v + omega x offset."""
        return Twist(self.rotational, self.translational + self.rotational.cross(offset))

    @property
    def is_translation(self) -> bool:
        """Whether it is a translation by form: its angular part is exactly zero, not only small."""
        return all(is_zero(c) for c in self.rotational.components())


@dataclass(frozen=True)
class Wrench(Screw):
    """Moment about the reference point (N·m) and force (N)."""

    def at_offset(self, offset: Vector) -> "Wrench":
        """The same load about the point whose vector from the present one is `offset` (m): m' = m + force x offset."""
        return Wrench(self.rotational + self.translational.cross(offset), self.translational)

    def work(self, twist: Twist) -> Scalar:
        """Reciprocal product: the power (W) of this wrench on that twist, or its work (J) on a small displacement.

        Both screws are at one point and in the same axes.
        """
        return self.rotational.dot(twist.rotational) + self.translational.dot(twist.translational)

    def in_newtons(self, shrink: Scalar) -> tuple[Scalar, ...]:
        """The components, N, with the moment times `shrink` (1/m), so that it compares with the force."""
        return (*(self.rotational * shrink).components(), *self.translational.components())


NO_MOTION = Twist(ZERO, ZERO)
NO_WRENCH = Wrench(ZERO, ZERO)


def rotation_about(axis: Vector, arm: Vector) -> Twist:
    """Unit twist of a revolute with unit direction `axis`, at the point whose vector from the joint is `arm` (m)."""
    return Twist(axis, axis.cross(arm))


def translation_along(axis: Vector) -> Twist:
    """Unit twist of a prismatic joint with unit direction `axis`; the same at every point."""
    return Twist(ZERO, axis)


def force_along(axis: Vector, arm: Vector) -> Wrench:
    """Unit force along the unit vector `axis`, through the point whose vector from the reference point is `arm` (m)."""
    return Wrench(arm.cross(axis), axis)


def pure_moment(axis: Vector) -> Wrench:
    """Moment of the direction and size of the vector `axis`, unit or not; the same at every point."""
    return Wrench(axis, ZERO)

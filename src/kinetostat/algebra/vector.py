"""Vectors of three scalars, and the rotations and rigid displacements that act on them.

No screws here (see `screw`) and no machine. All components are in the axes the caller names; lengths are in m.

Source: R. M. Murray, Z. Li and S. S. Sastry, A Mathematical Introduction to Robotic Manipulation (1994), section 2.2.
"""

from collections.abc import Sequence
from functools import cached_property

from kinetostat.algebra.scalar import Scalar, cos, is_one, is_zero, reciprocal, sin, sqrt, where
from kinetostat.frozen import dataclass


@dataclass(frozen=True)
class Vector:
    """A free vector or the coordinates of a point: three scalars (x, y, z)."""

    x: Scalar
    y: Scalar
    z: Scalar

    def components(self) -> tuple[Scalar, Scalar, Scalar]:
        """The three scalars in order."""
        return self.x, self.y, self.z

    def __add__(self, other: "Vector") -> "Vector":
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: "Vector") -> "Vector":
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def __mul__(self, factor: Scalar) -> "Vector":
        return Vector(self.x * factor, self.y * factor, self.z * factor)

    def __neg__(self) -> "Vector":
        return ZERO - self

    def dot(self, other: "Vector") -> Scalar:
        """Inner product."""
        return self.x * other.x + self.y * other.y + self.z * other.z

    def cross(self, other: "Vector") -> "Vector":
        """Vector product self x other."""
        return Vector(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )

    def across(self, axis: "Vector") -> "Vector":
        """The part at right angles to a unit vector."""
        return self - axis * self.dot(axis)

    def is_at(self, other: "Vector") -> bool:
        """Whether this is the same point as another one, at every pose."""
        pairs = zip(self.components(), other.components(), strict=True)
        return all(a is b or (same if isinstance(same := a == b, bool) else bool(same.all())) for a, b in pairs)

    def norm(self) -> Scalar:
        """Euclidean length."""
        return sqrt(self.dot(self))


ZERO = Vector(0.0, 0.0, 0.0)
X_AXIS = Vector(1.0, 0.0, 0.0)
Y_AXIS = Vector(0.0, 1.0, 0.0)
Z_AXIS = Vector(0.0, 0.0, 1.0)
AXES = (X_AXIS, Y_AXIS, Z_AXIS)


@dataclass(frozen=True)
class Rotation:
    """A rotation Q held by its three columns: the images of the x, y and z axes."""

    x: Vector
    y: Vector
    z: Vector

    def apply(self, v: Vector) -> Vector:
        """Q v."""
        return self.x * v.x + self.y * v.y + self.z * v.z

    def __matmul__(self, other: "Rotation") -> "Rotation":
        if self is IDENTITY or other is IDENTITY:
            return other if self is IDENTITY else self
        return Rotation(self.apply(other.x), self.apply(other.y), self.apply(other.z))

    def inverse(self) -> "Rotation":
        """Q^T, which is Q^-1."""
        rows = zip(self.x.components(), self.y.components(), self.z.components(), strict=True)
        return Rotation(*(Vector(*row) for row in rows))


IDENTITY = Rotation(X_AXIS, Y_AXIS, Z_AXIS)


class TriadRotation(Rotation):
    """The rotation that takes one right-handed triad of unit vectors to another; columns are made when asked for.

    What it turns is `Carried`: products of vectors that one rotation has turned are those from before.
    """

    _before: tuple[Vector, ...]
    _after: tuple[Vector, ...]

    def __init__(self, before: Sequence[Vector], after: Sequence[Vector]) -> None:
        object.__setattr__(self, "_before", tuple(before))
        object.__setattr__(self, "_after", tuple(after))

    @cached_property
    def x(self) -> Vector:
        """Image of the x axis."""
        return self.apply(X_AXIS)

    @cached_property
    def y(self) -> Vector:
        """Image of the y axis."""
        return self.apply(Y_AXIS)

    @cached_property
    def z(self) -> Vector:
        """Image of the z axis."""
        return self.apply(Z_AXIS)

    def apply(self, v: Vector) -> Vector:
        """Q v; exactly a vector of the second triad for one of the first."""
        members = (axis for unit, axis in zip(self._before, AXES, strict=True) if unit.is_at(v))
        parts = next(members, None) or Vector(*(unit.dot(v) for unit in self._before))
        first, second, third = self._after
        image = first * parts.x + second * parts.y + third * parts.z
        return Carried(image.x, image.y, image.z, self, parts)


@dataclass(frozen=True, eq=False)
class Carried(Vector):
    """A vector that a rotation has turned.

    Attributes:
        rotation: the rotation.
        parts: its components along the rotation's triad.
    """

    rotation: TriadRotation
    parts: Vector

    def dot(self, other: Vector) -> Scalar:
        """Inner product: that of the components along the triad, where one rotation has turned both."""
        if isinstance(other, Carried) and other.rotation is self.rotation:
            return self.parts.dot(other.parts)
        return super().dot(other)


@dataclass(frozen=True, eq=False)
class Normal(Vector):
    """A unit vector at right angles to others.

    Attributes:
        others: the vectors to which it is normal.
    """

    others: tuple[Vector, ...]

    def dot(self, other: Vector) -> Scalar:
        """Inner product: exactly 0 with the vectors to which it is normal."""
        return 0.0 if any(other is each for each in self.others) else super().dot(other)


def axis_between(first: Vector, last: Vector, to_first: Scalar, to_last: Scalar, side: Scalar) -> tuple[Vector, Scalar]:
    """Find the unit vector that has given products with two unit vectors (theory (74)).

    Args:
        first, last: the unit vectors.
        to_first, to_last: the products.
        side: a number with the sign of the vector's product with first x last.

    Returns:
        The vector, NaN where there is none, and the square of what it misses.
    """
    normal, sign = first.cross(last), where(side < 0.0, -1.0, 1.0)
    if is_zero(to_first) and is_zero(to_last):
        unit = normal * (reciprocal(normal.norm()) * sign)
        axis: Vector = Normal(unit.x, unit.y, unit.z, (first, last))
    else:
        slant, shrink = first.dot(last), reciprocal(normal.dot(normal))
        alpha, beta = (to_first - to_last * slant) * shrink, (to_last - to_first * slant) * shrink
        aside = sqrt((1.0 - alpha * to_first - beta * to_last) * shrink)
        axis = first * alpha + last * beta + normal * (aside * sign)
    excess = axis.dot(axis) - 1.0
    return axis, excess * excess


def rotation_x(c: Scalar, s: Scalar) -> Rotation:
    """Rotation about x by the angle whose cosine is c and sine s."""
    return Rotation(X_AXIS, Vector(0.0, c, s), Vector(0.0, -s, c))


def rotation_y(c: Scalar, s: Scalar) -> Rotation:
    """Rotation about y by the angle whose cosine is c and sine s."""
    return Rotation(Vector(c, 0.0, -s), Y_AXIS, Vector(s, 0.0, c))


def rotation_z(c: Scalar, s: Scalar) -> Rotation:
    """Rotation about z by the angle whose cosine is c and sine s."""
    return Rotation(Vector(c, s, 0.0), Vector(-s, c, 0.0), Z_AXIS)


def rotation_of_angles(roll: Scalar, pitch: Scalar, yaw: Scalar) -> Rotation:
    """Rotation Rz(yaw) Ry(pitch) Rx(roll), angles in rad: about x first and about z last, always about axes at rest."""
    return rotation_z(cos(yaw), sin(yaw)) @ rotation_y(cos(pitch), sin(pitch)) @ rotation_x(cos(roll), sin(roll))


def rotation_along(axis: Vector, c: Scalar, s: Scalar, rest: Scalar | None = None) -> Rotation:
    """Rotation about the unit vector `axis` by the angle whose cosine is c and sine s (Rodrigues).

    What is 1 by form on the diagonal stays so: about a base axis, it is as sparse as `rotation_x`. Of small angles the
    difference 1 - c has few digits: `rest` is it, where it is known better.
    """
    rest = 1.0 - c if rest is None else rest
    columns = []
    for i, (unit, part) in enumerate(zip(AXES, axis.components(), strict=True)):
        column = list((unit * c + axis * (rest * part) + axis.cross(unit) * s).components())
        if is_one(part * part):
            column[i] = 1.0
        columns.append(Vector(*column))
    return Rotation(*columns)


def polar(radius: Scalar, angle: Scalar) -> Vector:
    """The point of the x-y plane at `radius` (m) from the origin and `angle` (rad) from x."""
    return Vector(radius * cos(angle), radius * sin(angle), 0.0)


def ring(radius: Scalar, angles: Sequence[Scalar], height: Scalar = 0.0) -> list[Vector]:
    """Points at `radius` (m) about z, at the given angles from x (rad) and one height (m)."""
    flat = [polar(radius, angle) for angle in angles]
    return [Vector(point.x, point.y, height) for point in flat]


@dataclass(frozen=True)
class Displacement:
    """A rigid displacement: rotate by `rotation`, then translate by `translation` (m)."""

    rotation: Rotation
    translation: Vector

    def apply(self, point: Vector) -> Vector:
        """The point after the displacement (base frame, m)."""
        return self.rotation.apply(point) + self.translation

    def __matmul__(self, other: "Displacement") -> "Displacement":
        return Displacement(self.rotation @ other.rotation, self.apply(other.translation))

    def inverse(self) -> "Displacement":
        """The displacement that undoes this one."""
        back = self.rotation.inverse()
        return Displacement(back, -back.apply(self.translation))

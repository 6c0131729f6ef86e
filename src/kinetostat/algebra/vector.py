"""Vectors of three scalars, and the rotations and rigid displacements that act on them.

No screws here (see `screw`) and no machine. All components are in the axes the caller names; lengths are in m.

Source: R. M. Murray, Z. Li and S. S. Sastry, A Mathematical Introduction to Robotic Manipulation (1994), section 2.2.
"""

from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, cos, is_one, sin, sqrt
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
        return Rotation(self.apply(other.x), self.apply(other.y), self.apply(other.z))

    def inverse(self) -> "Rotation":
        """Q^T, which is Q^-1."""
        rows = zip(self.x.components(), self.y.components(), self.z.components(), strict=True)
        return Rotation(*(Vector(*row) for row in rows))


IDENTITY = Rotation(X_AXIS, Y_AXIS, Z_AXIS)


def rotation_x(c: Scalar, s: Scalar) -> Rotation:
    """Rotation about x by the angle whose cosine is c and sine s."""
    return Rotation(X_AXIS, Vector(0.0, c, s), Vector(0.0, -s, c))


def rotation_y(c: Scalar, s: Scalar) -> Rotation:
    """Rotation about y by the angle whose cosine is c and sine s."""
    return Rotation(Vector(c, 0.0, -s), Y_AXIS, Vector(s, 0.0, c))


def rotation_z(c: Scalar, s: Scalar) -> Rotation:
    """Rotation about z by the angle whose cosine is c and sine s."""
    return Rotation(Vector(c, s, 0.0), Vector(-s, c, 0.0), Z_AXIS)


def rotation_along(axis: Vector, c: Scalar, s: Scalar) -> Rotation:
    """Rotation about the unit vector `axis` by the angle whose cosine is c and sine s (Rodrigues).

    What is 1 by form on the diagonal stays so: about a base axis, it is as sparse as `rotation_x`.
    """
    rest = 1.0 - c
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

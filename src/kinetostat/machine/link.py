"""Flexible links as springs: beams, lumped virtual joints, parallelograms, and compliance matrices from elsewhere.

What a cross-section and a material make of a link is `cross_section`'s; where links lie is the family's business.

Source: theory (17) and (18); Tables I and II of the paper for lumped joints. Points and axes are in the base frame.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import Scalar, cos, is_infinite, is_zero, ordinary, reciprocal, sin, where
from kinetostat.algebra.vector import (
    AXES,
    IDENTITY,
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
    ZERO,
    Displacement,
    Rotation,
    Vector,
    rotation_along,
)
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import RIGID, Joint, Spring
from kinetostat.tolerances import NO_PITCH, ROUND_OFF_OF_BLOCK, ROUND_OFF_OF_COMPLEMENT


@dataclass(frozen=True)
class Rigidity:
    """Resistance of a prismatic bar, from its cross-section and material; infinity where it is rigid.

    Attributes:
        axial: E A, N.
        torsion: G J, N·m².
        bending_y, bending_z: E I about the cross-section's y and z axes, N·m².
        shear_y, shear_z: kappa G A along them, N: finite for a Timoshenko beam, infinite for an Euler-Bernoulli one.
    """

    axial: Scalar = RIGID
    torsion: Scalar = RIGID
    bending_y: Scalar = RIGID
    bending_z: Scalar = RIGID
    shear_y: Scalar = RIGID
    shear_z: Scalar = RIGID


def link_axes(start: Vector, end: Vector, up: Vector) -> tuple[Rotation, Scalar]:
    """The link's axes in the base frame and its length (m): x from start to end, z nearest to `up`, y = z x x."""
    span = end - start
    length = ordinary(span.norm())  # as `written.checking` makes sure
    along = span * reciprocal(length)
    side = up.cross(along)
    side = side * reciprocal(side.norm())
    return Rotation(along, side, along.cross(side)), length


def any_up(along: Vector) -> Vector:
    """The base axis that is furthest from a direction: z of a cross-section that looks alike from all directions."""
    sizes = [c * c for c in along.components()]
    across = [axis for axis, size in zip(AXES, sizes, strict=True) if is_zero(size)]
    if across:
        return across[0]
    best, least = X_AXIS, sizes[0]
    for axis, size in ((Y_AXIS, sizes[1]), (Z_AXIS, sizes[2])):
        nearer = size < least
        chosen = [where(nearer, a, b) for a, b in zip(axis.components(), best.components(), strict=True)]
        best, least = Vector(*chosen), where(nearer, size, least)
    return best


@dataclass(frozen=True)
class Beam:
    """A prismatic link built in at both ends, with its full 6x6 compliance: Euler-Bernoulli, or Timoshenko.

    The compliance of one end against the other is diagonal at the middle of the link, so that six springs there are
    exact (theory section 5).

    Attributes:
        name: the name of the link.
        start, end: ends of its axis, base frame, m.
        up: a vector that is not along the link; the cross-section's z axis lies in the plane of both.
        rigidity: the rigidity of its cross-section.
        placed: its axes and its length, m, of a link that has been displaced; None: they follow from the ends.
    """

    name: str
    start: Vector
    end: Vector
    up: Vector
    rigidity: Rigidity
    placed: tuple[Rotation, Scalar] | None = None

    @property
    def axes_and_length(self) -> tuple[Rotation, Scalar]:
        """The cross-section's axes in the base frame and the length of the link, m."""
        return self.placed or link_axes(self.start, self.end, self.up)

    @property
    def freedoms(self) -> tuple[Joint, ...]:
        """A beam has no freedom."""
        return ()

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Six at the middle: torsion GJ/L, bending EI/L, tension EA/L, and shear 1/(L^3/12EI + L/kappa GA)."""
        axes, length = self.axes_and_length
        middle, shrink, rigidity = (self.start + self.end) * 0.5, reciprocal(length), self.rigidity
        return _springs(
            self.name,
            ("torsion", Joint(axes.x, middle), _times(rigidity.torsion, shrink)),
            ("bending y", Joint(axes.y, middle), _times(rigidity.bending_y, shrink)),
            ("bending z", Joint(axes.z, middle), _times(rigidity.bending_z, shrink)),
            ("tension", Joint(axes.x), _times(rigidity.axial, shrink)),
            ("shear y", Joint(axes.y), _shear(rigidity.bending_z, rigidity.shear_y, length)),
            ("shear z", Joint(axes.z), _shear(rigidity.bending_y, rigidity.shear_z, length)),
        )

    @property
    def path(self) -> tuple[Vector, ...]:
        """Its ends, base frame, m."""
        return self.start, self.end

    def displaced(self, motion: Displacement) -> "Beam":
        """The link after a rigid displacement of the whole machine."""
        axes, length = self.axes_and_length
        placed = motion.rotation @ axes, length
        ends = motion.apply(self.start), motion.apply(self.end)
        return Beam(self.name, *ends, motion.rotation.apply(self.up), self.rigidity, placed)


def lumped_springs(name: str, start: Vector, end: Vector, up: Vector, rigidity: Rigidity) -> tuple[Spring, ...]:
    """A flexible link as virtual joints where it is built in (`start`): torsion, two bendings 3EI/L, and EA/L.

    Those about an axis that a passive joint there leaves free do nothing, which gives the paper's Tables I and II:
    an actuated revolute keeps the actuator and three torsional springs, a passive one two, Hooke and spherical joints
    of a two-force link none, and a planar revolute one or none (theory section 5).
    """
    axes, length = link_axes(start, end, up)
    shrink = reciprocal(length)
    return _springs(
        name,
        ("torsion", Joint(axes.x, start), _times(rigidity.torsion, shrink)),
        ("bending y", Joint(axes.y, start), _times(rigidity.bending_y, 3.0 * shrink)),
        ("bending z", Joint(axes.z, start), _times(rigidity.bending_z, 3.0 * shrink)),
        ("tension", Joint(axes.x), _times(rigidity.axial, shrink)),
    )


def _times(stiffness: Scalar, factor: Scalar) -> Scalar:
    """A stiffness times a positive factor; it stays rigid by form if it is."""
    return stiffness if is_infinite(stiffness) else stiffness * factor


def _shear(bending: Scalar, shear: Scalar, length: Scalar) -> Scalar:
    """The stiffness of a beam in shear by two of its rigidities; it is free or rigid by form if they make it so."""
    if is_zero(bending) or is_zero(shear):
        return 0.0
    if is_infinite(bending) and is_infinite(shear):
        return RIGID
    cubed = length * length * length * (1.0 / 12.0)
    return reciprocal(cubed * reciprocal(bending) + length * reciprocal(shear))


def _springs(name: str, *rows: tuple[str, Joint, Scalar]) -> tuple[Spring, ...]:
    """The springs of a link: what each resists, its screw and its stiffness."""
    return tuple(Spring(f"{name} {load}", joint, stiffness, part=name) for load, joint, stiffness in rows)


@dataclass(frozen=True)
class Parallelogram:
    """Two equal bars between two equal short sides: one freedom, a translation that turns nothing.

    Attributes:
        name: the name of the joint.
        near, far: middles of the short sides nearer to the base and to the platform, base frame, m.
        side: unit vector along the short sides.
        width: the width of the short sides, m.
        bar: axial stiffness of each bar, N/m.
        fixed_normal: unit normal of its plane once it has moved. If it were computed from the sides, its sign and the
            direction of the motion would change where the bars pass the short sides.
    """

    name: str
    near: Vector
    far: Vector
    side: Vector
    width: Scalar
    bar: Scalar = RIGID
    fixed_normal: Vector | None = None

    @property
    def along(self) -> Vector:
        """Unit vector of the bars."""
        span = self.far - self.near
        return span * reciprocal(span.norm())

    @property
    def normal(self) -> Vector:
        """Unit normal of its plane."""
        if self.fixed_normal is not None:
            return self.fixed_normal
        across = self.side.cross(self.along)
        return across * reciprocal(across.norm())

    @property
    def bars(self) -> tuple[tuple[Vector, Vector], ...]:
        """Near and far end of each bar, base frame, m."""
        offset = self.side * (0.5 * self.width)
        return (self.near + offset, self.far + offset), (self.near - offset, self.far - offset)

    @property
    def freedoms(self) -> tuple[Joint, ...]:
        """The translation in its plane, across the bars."""
        return (Joint(self.normal.cross(self.along), None, self.name),)

    @property
    def mover(self) -> Joint:
        """The freedom in which it moves."""
        return self.freedoms[0]

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Both bars together: along them 2 k, and about the normal k (width sin)^2 / 2."""
        along, normal = self.along, self.normal
        arm = self.width * normal.cross(self.side).dot(along)
        return _springs(
            self.name,
            ("tension", Joint(along), _times(self.bar, 2.0)),
            ("turning", Joint(normal, (self.near + self.far) * 0.5), _times(0.5 * self.bar, arm * arm)),
        )

    @property
    def path(self) -> tuple[Vector, ...]:
        """The middles of its short sides, base frame, m."""
        return self.near, self.far

    def displaced(self, motion: Displacement) -> "Parallelogram":
        """The parallelogram after a rigid displacement of the whole machine."""
        turn = motion.rotation.apply
        normal = None if self.fixed_normal is None else turn(self.fixed_normal)
        near, far = motion.apply(self.near), motion.apply(self.far)
        return replace(self, near=near, far=far, side=turn(self.side), fixed_normal=normal)

    def motion_by(self, amount: Scalar) -> tuple["Parallelogram", Displacement]:
        """The parallelogram once its far side has run by `amount` (m of arc), and how that displaces what follows."""
        angle = amount * reciprocal((self.far - self.near).norm())
        normal = self.normal
        turn = rotation_along(normal, cos(angle), sin(angle))
        far = self.near + turn.apply(self.far - self.near)
        return replace(self, far=far, fixed_normal=normal), Displacement(IDENTITY, far - self.far)


def seat_springs(name: str, axis: Vector, point: Vector, stiffness: Mapping[str, Scalar]) -> tuple[Spring, ...]:
    """Springs of a joint's bearings in the joint's own frame, as data sheets give their stiffness.

    Args:
        name: the name of the part that the springs stand for.
        axis: the axis of the joint, of any length, base frame.
        point: centre of the bearings, base frame, m.
        stiffness: "radial" in any direction across the axis and "axial" along it, N/m; "tilt" about any axis across it
            and "torsion" about it, N·m/rad. What is not given is rigid.
    """
    axes, _ = link_axes(ZERO, axis, any_up(axis))
    freedoms = {
        "radial": (Joint(axes.y), Joint(axes.z)),
        "axial": (Joint(axes.x),),
        "tilt": (Joint(axes.y, point), Joint(axes.z, point)),
        "torsion": (Joint(axes.x, point),),
    }
    return tuple(
        Spring(f"{name} {way}{f' {i}' if len(freedoms[way]) > 1 else ''}", joint, k, part=name)
        for way, k in stiffness.items()
        for i, joint in enumerate(freedoms[way], 1)
    )


def matrix_springs(name: str, compliance: npt.ArrayLike, point: Vector) -> tuple[Spring, ...]:
    """Return springs that together deflect as a 6x6 compliance does: turns about its principal axes, then slides.

    Where it turns under a pure moment gives up to three screws; what it moves beyond them, the Schur complement of that
    block, up to three slides. Their dyads add up to the matrix.

    Args:
        name: the name of the link or joint.
        compliance: symmetric, >= 0, rows rx ry rz x y z, of one end against the other at `point`, SI [6 x 6].
        point: base frame, m.
    """
    matrix = np.asarray(compliance, dtype=float)
    turning, coupling, moving = matrix[:3, :3], matrix[3:, :3], matrix[3:, 3:]
    springs: list[tuple[Joint, float]] = []
    turns = _principal(turning, ROUND_OFF_OF_BLOCK * float(np.trace(turning)))
    for value, axis in turns:
        translation = coupling @ axis / value  # of the point, per unit turn
        moving = moving - value * np.outer(translation, translation)
        pitch = float(axis @ translation)
        pitch = pitch if abs(pitch) > NO_PITCH * np.linalg.norm(translation) else 0.0
        foot = point + Vector(*np.cross(axis, translation).tolist())
        springs.append((Joint(Vector(*axis.tolist()), foot, pitch=pitch), 1.0 / value))
    # Subtracting the turns' share loses as many digits as the root of the ratio of the largest to the smallest turn.
    lost = math.sqrt(turns[0][0] / turns[-1][0]) if turns else 1.0
    for value, axis in _principal(moving, ROUND_OFF_OF_COMPLEMENT * lost * float(np.trace(matrix[3:, 3:]))):
        springs.append((Joint(Vector(*axis.tolist())), 1.0 / value))
    return tuple(Spring(f"{name} mode {n}", joint, k, part=name) for n, (joint, k) in enumerate(springs, 1))


def _principal(block: Array, least: float) -> list[tuple[float, Array]]:
    """Principal compliances of a block above the `least` and their directions, the softest first."""
    values, axes = np.linalg.eigh(block)
    pairs = zip(values[::-1].tolist(), axes.T[::-1], strict=True)
    return [(value, axis) for value, axis in pairs if value > least]

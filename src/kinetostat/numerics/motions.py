"""Finite displacements of many bodies at once: exponentials of screws, their inverse, and how screws change with them.

Arrays of NumPy, rotation first, all screws at the origin and in base axes; leading axes are poses. An array may also
hold scalars of any kind as objects, for one pose: the same sums and products are then traced. `exponential` takes any
screws of floats, `along` and `each_along` also traced ones; `each_about` is faster for screws that all poses share.

Source: R. M. Murray, Z. Li and S. S. Sastry, A Mathematical Introduction to Robotic Manipulation (1994), section 2.3
and appendix A; theory section 12.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.scalar import Scalar, cos, is_zero, sin
from kinetostat.algebra.vector import Vector, rotation_along
from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.machine.column import stacked_columns
from kinetostat.numerics.iteration import with_rows

IDENTITY = np.eye(3)
"""The rotation of a body that is not turned."""
SMALL_ANGLE = 0.05
"""Angle, rad, below which quotients like (t - sin t) / t^3 come from their series: the first term left out is 2e-16."""


@dataclass(frozen=True)
class Motions:
    """Rigid displacements of n bodies.

    Attributes:
        rotation: [n x 3 x 3].
        translation: m [n x 3].
    """

    rotation: Array
    translation: Array

    def __matmul__(self, other: "Motions") -> "Motions":
        """First `other`, then this one."""
        return Motions(self.rotation @ other.rotation, self.point(other.translation))

    def point(self, points: Array) -> Array:
        """Return points [n x 3] after the displacements."""
        return np.asarray(np.einsum("nij,nj->ni", self.rotation, points) + self.translation)

    def shift(self, points: Array) -> Array:
        """Return by how much points [n x 3] move, without the round-off of where they are.

        The columns of a rotation are of length 1, so that small entries beside the diagonal give 1 minus the diagonal's
        entry with all digits.
        """
        change = self.rotation - IDENTITY
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            squares = self.rotation[:, j, i] * self.rotation[:, j, i] + self.rotation[:, k, i] * self.rotation[:, k, i]
            change[:, i, i] = -squares / (1.0 + self.rotation[:, i, i])
        return np.asarray(np.einsum("nij,nj->ni", change, points) + self.translation)

    def twist(self, twists: Array) -> Array:
        """Return screws fixed in the bodies [n x 6] after the displacements (the adjoint map)."""
        turning = np.einsum("nij,nj->ni", self.rotation, twists[:, :3])
        moving = np.einsum("nij,nj->ni", self.rotation, twists[:, 3:])
        return np.concatenate([turning, moving + cross(self.translation, turning)], axis=1)

    def amounts(self) -> Array:
        """Rotation vectors and translations [n x 6]: how far bodies are turned, and where their origins are."""
        twists = logarithm(Motions(self.rotation, np.zeros_like(self.translation)))
        return np.concatenate([twists[:, :3], self.translation], axis=1)

    def at(self, rows: Integers) -> "Motions":
        """The displacements of some of the bodies, by number."""
        return Motions(self.rotation[rows], self.translation[rows])

    def with_part(self, rows: Integers, part: "Motions") -> "Motions":
        """The displacements with those of some of the bodies, by number, in their places."""
        return Motions(
            with_rows(self.rotation, rows, part.rotation), with_rows(self.translation, rows, part.translation)
        )

    def inverse(self) -> "Motions":
        """The displacements that undo these."""
        back = np.swapaxes(self.rotation, 1, 2)
        return Motions(back, -np.einsum("nij,nj->ni", back, self.translation))


def still(count: int) -> Motions:
    """No displacement, of n bodies."""
    return Motions(np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3)))


def exponential(twists: Array) -> Motions:
    """The displacement by a screw motion for one unit of time [n x 6]."""
    turning, moving = twists[:, :3], twists[:, 3:]
    first, second, third = _quotients(_lengths(turning))
    skew = skew_of(turning)
    squared = skew @ skew
    rotation = IDENTITY + first[:, None, None] * skew + second[:, None, None] * squared
    along = IDENTITY + second[:, None, None] * skew + third[:, None, None] * squared
    return Motions(rotation, np.einsum("nij,nj->ni", along, moving))


def along(twists: Array, amounts: Array) -> Motions:
    """The displacements by screw motions [n x 6] by some amounts [n]."""
    if twists.dtype != object and amounts.dtype != object:
        return exponential(twists * amounts[:, None])
    turning, moving, amount = Vector(*twists[0, :3]), Vector(*twists[0, 3:]), amounts[0]
    if is_zero(amount):
        return still(1)
    if all(is_zero(part) for part in turning.components()):
        return Motions(np.eye(3)[None], of_scalars((moving * amount).components()))
    size = turning.norm()
    axis, moving, angle = turning * (1.0 / size), moving * (1.0 / size), size * amount
    # By half of the angle, 1 - cos t has as many digits as t, and so have the shifts by small angles.
    half = sin(0.5 * angle)
    sine, rest = 2.0 * half * cos(0.5 * angle), 2.0 * half * half
    rotation = rotation_along(axis, 1.0 - rest, sine, rest)
    slid = axis * axis.dot(moving)
    shift = slid * angle + (moving - slid) * sine + axis.cross(moving) * rest
    columns = [of_scalars(column.components())[0] for column in (rotation.x, rotation.y, rotation.z)]
    return Motions(np.stack(columns, axis=1)[None], of_scalars(shift.components()))


def each_along(twists: Array, amounts: Array) -> list[Motions]:
    """m displacements at each of n poses: the k-th by the screws `twists[:, k]` [n x m x 6] times `amounts[:, k]`."""
    count, motions = amounts.shape
    if twists.dtype == object or amounts.dtype == object:
        return [along(twists[:, k], amounts[:, k]) for k in range(motions)]
    all_motions = exponential((twists * amounts[:, :, None]).reshape(-1, 6))
    rotation = all_motions.rotation.reshape(count, motions, 3, 3)
    translation = all_motions.translation.reshape(count, motions, 3)
    return [Motions(rotation[:, k], translation[:, k]) for k in range(motions)]


def each_about(twists: Array, amounts: Array) -> list[Motions]:
    """m displacements at each of n poses: the k-th by screws that all poses share, times `amounts[:, k]`.

    With K the cross product with the unit axis and t the angle, rotations are 1 + sin t K + (1 - cos t) K^2: fixed
    matrices times two numbers of each pose, in a quarter of the time of exponentials.

    Args:
        twists: the screws [m x 6], or those of several legs [legs x m x 6], each for an equal part of the poses.
        amounts: their amounts [n x m]; the poses of one leg stand before those of the next.

    Source: Murray, Li and Sastry (1994), equations 2.14 and 2.36.
    """
    (count, motions), screws = amounts.shape, twists.reshape(-1, 6)
    legs = len(screws) // max(motions, 1)
    size = np.linalg.norm(screws[:, :3], axis=1)
    unit = np.where(size > 0.0, size, 1.0)[:, None]
    across = skew_of(screws[:, :3] / unit)
    squared = across @ across
    across_moving, squared_moving = (np.einsum("mij,mj->mi", k, screws[:, 3:] / unit) for k in (across, squared))
    # What 1, the amount, sin t and 1 - cos t are multiplied by: nine numbers of the rotation and three of the shift.
    parts = np.zeros((len(screws), 4, 12))
    parts[:, 0, :9] = np.eye(3).ravel()
    parts[:, 1, 9:] = screws[:, 3:] + squared_moving * unit
    parts[:, 2] = np.concatenate([across.reshape(-1, 9), -squared_moving], axis=1)
    parts[:, 3] = np.concatenate([squared.reshape(-1, 9), across_moving], axis=1)
    amount = np.swapaxes(amounts.reshape(legs, -1, motions), 1, 2).reshape(len(screws), -1)
    angle = amount * size[:, None]
    terms = np.stack([np.ones_like(angle), amount, np.sin(angle), 2.0 * np.sin(0.5 * angle) ** 2], axis=2)
    numbers = (terms @ parts).reshape(legs, motions, -1, 12)
    of_motions = [numbers[:, k].reshape(count, 12) for k in range(motions)]
    return [Motions(each[:, :9].reshape(-1, 3, 3), each[:, 9:]) for each in of_motions]


def each_twist(motions: Sequence[Motions], twists: Array) -> Array:
    """Return screws fixed in m bodies [n x m x 6] after the motions of these, each with its own [n x m x 6]."""
    if twists.dtype == object or any(motion.rotation.dtype == object for motion in motions):
        return np.stack([motion.twist(twists[:, k]) for k, motion in enumerate(motions)], axis=1)
    rotation = np.stack([motion.rotation for motion in motions], axis=1)
    turning, moving = ((rotation @ part[..., None])[..., 0] for part in (twists[..., :3], twists[..., 3:]))
    lever = np.stack([motion.translation for motion in motions], axis=1)
    return np.concatenate([turning, moving + cross(lever, turning)], axis=2)


def of_scalars(scalars: Sequence[Scalar], count: int | None = None) -> Array:
    """Scalars as columns [n x scalars]; without a count as objects, whatever they are [1 x scalars]."""
    if count is not None:
        return stacked_columns(scalars, count)
    result = np.empty((1, len(scalars)), dtype=object)
    for place, scalar in enumerate(scalars):
        result[0, place] = float(scalar) if isinstance(scalar, int | np.floating) else scalar
    return result


def logarithm(motions: Motions) -> Array:
    """The screw [n x 6] whose exponential a displacement is, for rotations below half a turn."""
    rotation = motions.rotation
    sines = 0.5 * np.stack(
        [
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ],
        axis=1,
    )
    angle = np.arctan2(_lengths(sines), 0.5 * (np.trace(rotation, axis1=1, axis2=2) - 1.0))
    first, second, _ = _quotients(angle)
    turning = sines / first[:, None]
    skew = skew_of(turning)
    # 1/t^2 - (1 + cos t)/(2 t sin t) = (1 - first / (2 second)) / t^2, which is 1/12 for no angle at all.
    small = angle < SMALL_ANGLE
    square = np.where(small, 1.0, angle * angle)
    series = 1.0 / 12.0 + angle**2 / 720.0 + angle**4 / 30240.0 + angle**6 / 1209600.0
    rest = np.where(small, series, (1.0 - 0.5 * first / second) / square)
    back = IDENTITY - 0.5 * skew + rest[:, None, None] * (skew @ skew)
    return np.concatenate([turning, np.einsum("nij,nj->ni", back, motions.translation)], axis=1)


def _quotients(angle: Array) -> tuple[Array, Array, Array]:
    """sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3 [n]."""
    small = angle < SMALL_ANGLE
    if small.all():  # as of errors: nothing but series is needed
        return _series(angle)
    safe = np.where(small, 1.0, angle)
    sine, half = np.sin(safe), np.sin(0.5 * safe) / (0.5 * safe)
    closed = sine / safe, 0.5 * half * half, (safe - sine) / safe**3
    if not small.any():
        return closed
    first, second, third = (np.where(small, *both) for both in zip(_series(angle), closed, strict=True))
    return first, second, third


def _series(angle: Array) -> tuple[Array, Array, Array]:
    """Compute what `_quotients` returns, by series, for small angles."""
    square = angle * angle
    fourth, sixth = square**2, square**3
    first = 1.0 - square / 6.0 + fourth / 120.0 - sixth / 5040.0
    half = 1.0 - square / 24.0 + fourth / 1920.0 - sixth / 322560.0
    third = 1.0 / 6.0 - square / 120.0 + fourth / 5040.0 - sixth / 362880.0
    return first, 0.5 * half * half, third


def _lengths(vectors: Array) -> Array:
    """The lengths of vectors [n x 3], in half of the time that NumPy's function takes for a few of them."""
    return np.sqrt(np.add.reduce(vectors * vectors, axis=1))


def cross(a: Array, b: Array) -> Array:
    """The vector product over the last axis, in a quarter of the time that NumPy's takes for a few of them."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    first = np.asarray(a1 * b2 - a2 * b1)
    result = np.empty((*first.shape, 3), dtype=first.dtype)
    result[..., 0] = first
    result[..., 1] = a2 * b0 - a0 * b2
    result[..., 2] = a0 * b1 - a1 * b0
    return result


def skew_of(vectors: Array) -> Array:
    """The matrices [n x 3 x 3] that multiply by vectors [n x 3]: skew_of(a) b = a x b."""
    result = np.zeros((len(vectors), 3, 3), dtype=vectors.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[:, k, j], result[:, j, k] = vectors[:, i], -vectors[:, i]
    return result


def brackets_by(wrench: Array, twists: Array) -> Array:
    """The covectors c_k [n x m x 6] with t . c_k = w . [t, t_k], by a wrench w [n x 6], for twists t_k [n x m x 6].

    The bracket [t, t_k] is the change of the screw t_k by a unit motion along t.
    """
    moment, force = wrench[:, None, :3], wrench[:, None, 3:]
    turning, moving = twists[..., :3], twists[..., 3:]
    return np.concatenate([cross(turning, moment) + cross(moving, force), cross(turning, force)], axis=-1)


def work_on_exponents(wrenches: Array, carriers: Sequence[Motions], exponents: Array) -> Array:
    """Return the work of wrenches per unit that is added to the exponents e of small displacements [k x n x 6 x m].

    Where e changes, exp(e) changes on the left by screws of the body that carries it. As e is small, the series
    1 + B / 2 + B^2 / 6 in its transposed bracket B suffices for these.

    Args:
        wrenches: m wrenches at the origin [n x 6 x m].
        carriers: for each of the k displacements, that of the body that carries it [n].
        exponents: the screws e [k x n x 6].
    """
    rotation = np.stack([carrier.rotation for carrier in carriers])
    translation = np.stack([carrier.translation for carrier in carriers])
    moments, forces = np.swapaxes(wrenches[:, :3], 1, 2), np.swapaxes(wrenches[:, 3:], 1, 2)
    moments = moments + cross(forces, translation[..., None, :])
    in_body = np.concatenate([np.swapaxes(part @ rotation, -2, -1) for part in (moments, forces)], axis=-2)
    if not exponents.any():
        return in_body
    once = _work_on_brackets(exponents, in_body)
    return np.asarray(in_body + once / 2.0 + _work_on_brackets(exponents, once) / 6.0)


def _work_on_brackets(screw: Array, wrenches: Array) -> Array:
    """Return the work of wrenches [... x 6 x m] on the brackets of a screw [... x 6] with others."""
    moments, forces = np.swapaxes(wrenches[..., :3, :], -2, -1), np.swapaxes(wrenches[..., 3:, :], -2, -1)
    rotation, translation = screw[..., None, :3], screw[..., None, 3:]
    parts = cross(moments, rotation) + cross(forces, translation), cross(forces, rotation)
    return np.concatenate([np.swapaxes(part, -2, -1) for part in parts], axis=-2)

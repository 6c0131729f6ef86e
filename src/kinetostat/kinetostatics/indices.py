"""Indices of K, C or a Jacobian at one pose: stiffness by direction, and how unevenly the directions are treated.

Stiffness by direction never mixes rotation and translation and needs no characteristic length. Of K and C either may be
missing or not finite, as where a spring is rigid or free: all is then taken from the other by Schur complement. A
planar machine has the `components` rz x y and matrices 3 x 3. Conditioning makes rotations comparable by a length, the
choice of the caller, which goes with every number printed.

"Free": the other block carries no load and follows (a machine alone, loaded at its tool). "Guided": the other block is
held, as by a second guide. Free is never stiffer than guided.

Source: theory section 10; for conditioning J. Salisbury and J. Craig, "Articulated hands", Int. J. Robotics Research
1(1), 1982.
"""

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import reciprocal
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.tolerances import (
    AT_RIGHT_ANGLES,
    LARGEST_FREE,
    LEAST_DIVISOR,
    ROUND_OFF_OF_COMPLEMENT,
    ROUND_OFF_OF_EIGENVALUE,
)

Matrix: TypeAlias = Symmetric6 | npt.ArrayLike
Block: TypeAlias = Literal["rotation", "translation"]

SPATIAL = (0, 1, 2, 3, 4, 5)
"""Components of a machine that moves in space: rx ry rz x y z."""
PLANAR = (2, 3, 4)
"""Components of a machine that moves in the x-y plane: rz x y."""


@dataclass(frozen=True, eq=False)
class PrincipalCompliances(ImmutableAnswer):
    """Principal compliances of one block, the other free, in increasing order.

    Attributes:
        compliances: rad/(N·m) for rotation, m/N for translation [n]; n = 3 in space.
        directions: unit vectors, base axes, one row each [n x 3].
    """

    compliances: Array
    directions: Array


@dataclass(frozen=True, eq=False)
class PrincipalStiffness(ImmutableAnswer):
    """Principal stiffnesses of one block, in increasing order: the semi-axes of its stiffness ellipsoid.

    Attributes:
        stiffnesses: N·m/rad for rotation, N/m for translation [n]; 0 where free, infinity where rigid.
        directions: unit vectors, base axes, one row each [n x 3].
    """

    stiffnesses: Array
    directions: Array


def finite(matrix: Matrix | None, components: Sequence[int] = SPATIAL) -> Array | None:
    """K or C as an array [n x n], n = len(components); None where it is missing or not all of it is finite.

    Raises:
        ValueError: if its shape is another.
    """
    if matrix is None:
        return None
    array = np.asarray(matrix.rows() if isinstance(matrix, Symmetric6) else matrix, dtype=float)
    if array.shape != (len(components), len(components)):
        raise ValueError(f"a matrix of {len(components)} components is square of that size, not {array.shape}")
    return array if bool(np.isfinite(array).all()) else None


def principal_compliances(compliance: Matrix, components: Sequence[int] = SPATIAL) -> dict[str, PrincipalCompliances]:
    """Principal compliances of the platform, from its stiffest to its softest direction, for rotation and translation.

    A compliance is the rotation (translation) that a pure moment (force) along a direction causes along itself. Its
    extremes over all directions are the eigenvalues of the diagonal block C_rr (C_tt).

    Args:
        compliance: C at P, base axes, all entries finite [n x n].
        components: its rows, increasing, of rx ry rz x y z = 0 ... 5.

    Returns:
        "rotation" and "translation", as far as there are such components.

    Raises:
        ValueError: if C is not of that shape, or not finite.
    """
    matrix = finite(compliance, components)
    if matrix is None:
        raise ValueError("principal compliances need a finite C: where a spring is free there is none")
    result: dict[str, PrincipalCompliances] = {}
    for block in _blocks(components):
        values, vectors = np.linalg.eigh(block.part(matrix)[0])
        result[block.name] = PrincipalCompliances(np.maximum(values, 0.0), vectors.T @ block.axes)
    return result


def free_stiffnesses(
    stiffness: Matrix | None, compliance: Matrix | None, components: Sequence[int] = SPATIAL
) -> dict[str, PrincipalStiffness] | None:
    """Principal stiffnesses against a pure force (moment) while the rotations (translations) follow: 1 / eig(C_bb).

    A tool meets this stiffness at P where nothing but the legs holds the platform. From K it is
    eig(K_bb - K_bo K_oo^+ K_ob). Where C is not finite, some direction is free, and a stiffness that may be round-off
    counts as zero.

    Args:
        stiffness, compliance: K and C at P, base axes [n x n]; C is used where it is finite.
        components: their rows, increasing, of rx ry rz x y z = 0 ... 5.

    Returns:
        "rotation" and "translation", as far as there are such components; None where neither matrix is finite.

    Raises:
        ValueError: if a matrix has another shape.
    """
    soft, stiff = finite(compliance, components), finite(stiffness, components)
    if soft is not None:
        return {block.name: _of_compliances(block, *block.part(soft)) for block in _blocks(components)}
    if stiff is not None:
        blocks = _blocks(components)
        return {block.name: _of_stiffnesses(block, *block.complement(stiff, some_free=True)) for block in blocks}
    return None


def guided_stiffnesses(
    stiffness: Matrix | None, compliance: Matrix | None, components: Sequence[int] = SPATIAL
) -> dict[str, PrincipalStiffness] | None:
    """Principal stiffnesses against a displacement (rotation) while the other block is held at zero: eig(K_bb).

    These stiffnesses remain if something else, a second guide or a clamped workpiece, takes the rotations; they are at
    least those of `free_stiffnesses`. From C they are 1 / eig(C_bb - C_bo C_oo^+ C_ob). Arguments, results and errors
    are as there; K is used where it is finite.
    """
    soft, stiff = finite(compliance, components), finite(stiffness, components)
    if stiff is not None:
        return {block.name: _of_stiffnesses(block, *block.part(stiff)) for block in _blocks(components)}
    if soft is not None:
        return {block.name: _of_compliances(block, *block.complement(soft)) for block in _blocks(components)}
    return None


def free_stiffness_along(
    direction: Sequence[float],
    block: Block,
    stiffness: Matrix | None,
    compliance: Matrix | None,
    components: Sequence[int] = SPATIAL,
) -> float | None:
    """Force along n over the displacement along n it causes, with all other motions free: 1 / (n^T C_bb n).

    Args:
        direction: n times any length, base axes [3]; along an axis that has no component it must be zero.
        block: "translation" for a force (N/m), "rotation" for a moment (N·m/rad).
        stiffness, compliance, components: as for `free_stiffnesses`.

    Returns:
        From 0 (free) to infinity (rigid); None where neither matrix is finite.

    Raises:
        ValueError: if the direction is zero or leaves the space of the components, or a matrix has another shape.
    """
    blocks = free_stiffnesses(stiffness, compliance, components)
    shares = _shares(direction, block, components, blocks)
    if blocks is None:
        return None
    return reciprocal(
        math.fsum(s * reciprocal(k) for s, k in zip(shares, blocks[block].stiffnesses.tolist(), strict=True) if s)
    )


def guided_stiffness_along(
    direction: Sequence[float],
    block: Block,
    stiffness: Matrix | None,
    compliance: Matrix | None,
    components: Sequence[int] = SPATIAL,
) -> float | None:
    """Force along n over a displacement along n, with all other motions held: n^T K_bb n.

    Arguments, results and errors are as for `free_stiffness_along`.
    """
    blocks = guided_stiffnesses(stiffness, compliance, components)
    shares = _shares(direction, block, components, blocks)
    if blocks is None:
        return None
    return math.fsum(s * k for s, k in zip(shares, blocks[block].stiffnesses.tolist(), strict=True) if s)


class _DiagonalBlock(NamedTuple):
    """The rotations or the translations among the components of a machine.

    Attributes:
        name: "rotation" or "translation".
        rows: its rows in a matrix of all components, n of them.
        other_rows: the rows of the other block.
        axes: the base axis of each of its rows [n x 3].
    """

    name: Block
    rows: list[int]
    other_rows: list[int]
    axes: Array

    def part(self, matrix: Array) -> tuple[Array, float]:
        """Return this block of K or C [n x n], and the size up to which an eigenvalue of it may be round-off."""
        part = matrix[np.ix_(self.rows, self.rows)]
        return part, ROUND_OFF_OF_EIGENVALUE * float(np.linalg.norm(part, 2))

    def complement(self, matrix: Array, some_free: bool = False) -> tuple[Array, float]:
        """Return the Schur complement of the other block in K or C [n x n], and its round-off as `part` does.

        Where some direction is known to be free, the complement loses as many digits as the condition of the other
        block has.
        """
        part, round_off = self.part(matrix)
        if not self.other_rows:
            return part, round_off
        coupling = matrix[np.ix_(self.rows, self.other_rows)]
        opposite = matrix[np.ix_(self.other_rows, self.other_rows)]
        share = ROUND_OFF_OF_COMPLEMENT
        if some_free:
            sizes = np.linalg.svd(opposite, compute_uv=False)
            least = sizes[sizes > ROUND_OFF_OF_COMPLEMENT * sizes[0]].min(initial=sizes[0])
            share = min(max(share, ROUND_OFF_OF_EIGENVALUE * sizes[0] / max(least, LEAST_DIVISOR)), LARGEST_FREE)
        inverse = np.linalg.pinv(opposite, ROUND_OFF_OF_COMPLEMENT, hermitian=True)
        return part - coupling @ inverse @ coupling.T, share * float(np.linalg.norm(part, 2))


def _blocks(components: Sequence[int]) -> list[_DiagonalBlock]:
    """Return each block that the machine has."""
    turns = [row for row, component in enumerate(components) if component < 3]
    moves = [row for row, component in enumerate(components) if component >= 3]
    axes = np.eye(3)[[component % 3 for component in components]]
    blocks = [
        _DiagonalBlock("rotation", turns, moves, axes[turns]),
        _DiagonalBlock("translation", moves, turns, axes[moves]),
    ]
    return [block for block in blocks if block.rows]


def _of_stiffnesses(block: _DiagonalBlock, matrix: Array, round_off: float) -> PrincipalStiffness:
    """Return the eigenvalues of a matrix of stiffnesses [n x n], zero where they may be round-off."""
    values, vectors = np.linalg.eigh(matrix)
    return PrincipalStiffness(np.where(values <= round_off, 0.0, values), vectors.T @ block.axes)


def _of_compliances(block: _DiagonalBlock, matrix: Array, round_off: float) -> PrincipalStiffness:
    """Return the reciprocal eigenvalues of a matrix of compliances [n x n], infinite where these may be round-off."""
    values, vectors = np.linalg.eigh(matrix)
    stiffnesses = [math.inf if value <= round_off else reciprocal(float(value)) for value in values[::-1]]
    return PrincipalStiffness(np.array(stiffnesses), (vectors.T @ block.axes)[::-1])


def _shares(
    direction: Sequence[float], block: Block, components: Sequence[int], blocks: dict[str, PrincipalStiffness] | None
) -> list[float]:
    """Squares of the cosines between a direction and the principal ones; exactly zero where it is at right angles."""
    axes = next((known.axes for known in _blocks(components) if known.name == block), None)
    vector = np.asarray(direction, dtype=float)
    size = float(np.linalg.norm(vector))
    if (
        axes is None
        or not size > 0.0
        or float(np.linalg.norm(vector - axes.T @ (axes @ vector))) > AT_RIGHT_ANGLES * size
    ):
        raise ValueError(f"direction {list(direction)} is zero or has no {block} component in this machine's space")
    cosines = np.array(blocks[block].directions) @ (vector / size) if blocks else np.zeros(0)
    return [float(c) ** 2 if abs(c) > AT_RIGHT_ANGLES else 0.0 for c in cosines]


def stiffness_condition(
    stiffness: Matrix | None, compliance: Matrix | None, length: float, components: Sequence[int] = SPATIAL
) -> float:
    """Condition number of K made homogeneous: cond(D K D) with D = diag(1/L for rotations, 1 for translations).

    All entries of D K D are in N/m: moments are forces at an arm L, rotations displacements at an arm L. It is also
    cond(D^-1 C D^-1). The length is the characteristic length of Angeles, Fundamentals of Robotic Mechanical Systems.

    Args:
        stiffness, compliance: K and C at P, base axes [n x n]; K is used where it is finite, else C.
        length: L > 0, m.
        components: rows of the matrices, increasing, of rx ry rz x y z = 0 ... 5.

    Returns:
        1 (isotropic) to infinity (something is rigid or free while other parts deflect, or neither matrix is finite).

    Raises:
        ValueError: if the length is not positive, or a matrix has another shape.
    """
    stiff, soft = finite(stiffness, components), finite(compliance, components)
    scale = _scale(components, 1.0 / _positive(length) if stiff is not None else length)
    matrix = soft if stiff is None else stiff
    if matrix is None:
        return np.inf
    values = np.linalg.eigvalsh(matrix * np.outer(scale, scale))
    return _ratio(values[-1], values[0])


def twist_condition(twists: npt.ArrayLike, length: float, components: Sequence[int] = SPATIAL) -> float:
    """Condition number of a Jacobian whose columns are twists, angles multiplied by `length`: sigma_max / sigma_min.

    It was introduced for Jacobians by Salisbury and Craig (1982).

    Args:
        twists: unit twists of the actuators at P, base axes [n x m], rotations (rad) above translations (m); of
            actuators of one kind, or each divided by what makes its rates comparable.
        length: L > 0, m.
        components: the n rows, increasing, of rx ry rz x y z = 0 ... 5.

    Returns:
        1 to infinity (dependent columns; with m > n, dependent rows).

    Raises:
        ValueError: if the length is not positive, or the array is not [n x m] and finite.
    """
    scale, matrix = _scale(components, _positive(length)), np.asarray(twists, dtype=float)
    if matrix.ndim != 2 or len(matrix) != len(scale) or not matrix.size or not np.isfinite(matrix).all():
        raise ValueError(f"screws are {len(scale)} rows of finite numbers, one column each, not {matrix.shape}")
    values = np.linalg.svd(matrix * scale[:, None], compute_uv=False)
    return _ratio(values[0], values[-1])


def _positive(length: float) -> float:
    if not 0.0 < length < np.inf:
        raise ValueError(f"a characteristic length is positive, not {length}")
    return length


def _scale(components: Sequence[int], rotational: float) -> Array:
    return np.array([rotational if c < 3 else 1.0 for c in components])


def _ratio(largest: float, smallest: float) -> float:
    """The quotient; infinity where the smallest is only round-off."""
    return float(largest / smallest) if smallest > ROUND_OFF_OF_EIGENVALUE * largest else np.inf

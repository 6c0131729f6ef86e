"""The normal form of K and C: eigenscrews, on which a twist causes a wrench on the same screw, and centres.

Neither depends on the reference point: they belong to the machine and move with it. Eigenscrews are computed of 6 x 6
matrices only, because in a plane all pitches are zero; centres (of stiffness, of compliance, of elasticity) exist in
space and in the plane (3 x 3, rows rz x y).

Sources: T. Patterson and H. Lipkin, "Structure of robot compliance", ASME J. Mechanical Design 115(3), 1993; S. Huang
and J. M. Schimmels, "The eigenscrew decomposition of spatial stiffness matrices", IEEE Trans. Robotics and Automation
16(2), 2000; J. Loncaric, "Normal forms of stiffness and compliance matrices", IEEE J. Robotics and Automation 3(6),
1987; N. Ciblak and H. Lipkin, "Centers of stiffness, compliance, and elasticity in the analysis of robotic systems",
ASME DE-72, 1994.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.indices import PLANAR, SPATIAL, Matrix, finite
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.tolerances import NO_UNIQUE_CENTRE, PURE_COUPLE, ZERO_EIGENSCREW

ROTATION, TRANSLATION = slice(0, 3), slice(3, 6)
MOMENT, FORCE = ROTATION, TRANSLATION


@dataclass(frozen=True, eq=False)
class Eigenscrew(ImmutableAnswer):
    """A screw on which a twist causes a wrench on the same screw.

    Attributes:
        eigenvalue: force of the wrench over rotation of the twist, N/rad: K t = eigenvalue * (t as a wrench). It is
            zero for a motion that a singular K does not resist, and infinite for one that a singular C does not allow.
        pitch: pitch with the sign of the eigenvalue, m/rad; infinite for a couple (a translation).
        direction: unit vector of the axis, base axes [3]; its largest component is positive.
        point: foot of the perpendicular from P on the axis, base axes, m [3]; None at infinite pitch.
        weight: k in K = sum k w w^T, the stiffness of a spring on the unit wrench w = [h n + r x n; n] (N/m), or [n; 0]
            at infinite pitch (N·m/rad); from C, s in C = sum s t t^T with t = [n; h n + r x n] (rad/(N·m)), or [0; n]
            (m/N).
    """

    eigenvalue: float
    pitch: float
    direction: Array
    point: Array | None
    weight: float


def eigenscrews(stiffness: Matrix) -> list[Eigenscrew]:
    """The eigenscrews of K, solutions of K t = lambda Delta t, where Delta exchanges the halves of a screw.

    With K = F F^T their wrenches are w = F y with F^T Delta F y = lambda y. This problem is symmetric, so that its
    solutions are real, and K = sum k w w^T follows. If K is regular, three pitches are positive and three negative, and
    2 h k = lambda.
    Patterson and Lipkin (1993); the decomposition, Huang and Schimmels (2000).

    Args:
        stiffness: K at P, base axes [6 x 6], finite, positive semi-definite.

    Returns:
        As many eigenscrews as the rank of K, by increasing eigenvalue. Those of a repeated eigenvalue (zero, if K is
        singular) are one of many choices that all give the sum.

    Raises:
        ValueError: K is not 6 x 6 and finite.
    """
    return [_eigenscrew(dyad, dyad.product) for dyad in _dyads(_finite(stiffness), line=FORCE, moment=MOMENT)]


def compliance_eigenscrews(compliance: Matrix) -> list[Eigenscrew]:
    """The eigenscrews of C: those of K = C^-1, also where K is infinite because the machine is rigid in a direction.

    With C = F F^T their twists are t = F y with F^T Delta F y = y / lambda. Arguments and results as for `eigenscrews`.
    """
    terms = _dyads(_finite(compliance), line=ROTATION, moment=TRANSLATION)
    screws = [_eigenscrew(dyad, 1.0 / dyad.product if dyad.product else math.inf) for dyad in terms]
    return sorted(screws, key=lambda screw: screw.eigenvalue)


def _finite(matrix: Matrix) -> Array:
    array = finite(matrix)
    if array is None:
        raise ValueError("eigenscrews need a finite matrix: take C where K is infinite, K where C is")
    return array


class _Dyad(NamedTuple):
    """A screw whose dyad is a term of the sum that a matrix is.

    Attributes:
        product: twice line . moment.
        line, moment: the halves of the screw [3]: its direction, and its moment about P.
    """

    product: float
    line: Array
    moment: Array


def _dyads(matrix: Array, line: slice, moment: slice) -> list[_Dyad]:
    """Return the eigenscrews of a matrix, which is the sum of their dyads; `line` and `moment` are rows of it.

    They are computed in a unit of length in which both diagonal blocks have the same trace. A line that is only
    round-off is set to zero.
    """
    moments, lines = float(np.trace(matrix[moment, moment])), float(np.trace(matrix[line, line]))
    length = math.sqrt(moments / lines) if moments > 0.0 and lines > 0.0 else 1.0
    scale = np.ones(6)
    scale[moment] = 1.0 / length
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    is_term = values > ZERO_EIGENSCREW * values[-1]
    factor = vectors[:, is_term] * np.sqrt(values[is_term])
    products, mixes = np.linalg.eigh(factor.T @ np.roll(factor, 3, axis=0))
    products[np.abs(products) <= ZERO_EIGENSCREW * values[-1]] = 0.0
    screws = (factor @ mixes).T
    is_couple = np.linalg.norm(screws[:, line], axis=1) <= PURE_COUPLE * np.linalg.norm(screws, axis=1)
    screws[is_couple, line] = 0.0
    return [_Dyad(float(p) * length, w[line], w[moment] * length) for p, w in zip(products, screws, strict=True)]


def _eigenscrew(dyad: _Dyad, eigenvalue: float) -> Eigenscrew:
    """The eigenscrew of a dyad: its pitch is line . moment over line . line."""
    is_couple = not dyad.line.any()
    axis = dyad.moment if is_couple else dyad.line
    size = float(np.linalg.norm(axis))
    direction = axis * math.copysign(1.0 / size, axis[np.argmax(np.abs(axis))])
    point = None if is_couple else np.cross(dyad.line, dyad.moment) / size**2
    pitch = math.inf if is_couple else 0.5 * dyad.product / size**2
    return Eigenscrew(eigenvalue, pitch, direction, point, weight=size**2)


Point: TypeAlias = Array
"""From the reference point P, base axes, m [3]."""


def centre_of_stiffness(stiffness: Matrix | None, components: Sequence[int] = SPATIAL) -> Point | None:
    """The point at which the coupling block of K is symmetric: (tr(K_tt) 1 - K_tt) d = vee(K_rt - K_tr).

    In a planar machine the block is zero there: a force through the point causes no rotation. Source: Loncaric (1987);
    Ciblak and Lipkin (1994).

    Args:
        stiffness: K at P, base axes [6 x 6], or [3 x 3] with rows rz x y.
        components: (0, ..., 5) or (2, 3, 4).

    Returns:
        d, from P to the centre in base axes, m [3]; None where K is missing or not finite, or where the point is not
        unique: K_tt of rank below 2 (planar: singular), as springs resist translation along one direction only. An
        isotropic K_tt is not such a case.

    Raises:
        ValueError: for other components, or a matrix of another shape.
    """
    matrix = _spatial(stiffness, components)
    return None if matrix is None else _centre(matrix[3:, 3:], matrix[:3, 3:], components)


def centre_of_compliance(compliance: Matrix | None, components: Sequence[int] = SPATIAL) -> Point | None:
    """The point at which the coupling block of C is symmetric: (tr(C_rr) 1 - C_rr) d = vee(C_tr - C_rt).

    Exact for rigid springs too. Of a planar machine it is the centre of stiffness. Ciblak and Lipkin (1994).
    Arguments and errors as for `centre_of_stiffness`.

    Returns:
        d as there; None where C is missing or not finite, or where the platform rotates about one direction at most
        (planar: not at all).
    """
    matrix = _spatial(compliance, components)
    return None if matrix is None else _centre(matrix[:3, :3], matrix[3:, :3], components)


def centre_of_elasticity(
    stiffness: Matrix | None, compliance: Matrix | None, components: Sequence[int] = SPATIAL
) -> Point | None:
    """The point to which the three wrench-compliant axes, and the three twist-compliant axes, have balanced distances.

    Those are the lines of forces that cause a parallel translation, and of rotations that cause a parallel couple; from
    the centre, the perpendiculars onto either three add to zero: [d x] is the skew part of K_rt K_tt^-1, which is that
    of C_tr C_rr^-1. Patterson and Lipkin (1993); Ciblak and Lipkin (1994).

    Args:
        stiffness, compliance: K and C as for the other centres; K is used where it is finite, else C.
        components: (0, ..., 5) or (2, 3, 4); of a planar machine all three centres are one.

    Returns:
        d, from P in base axes, m [3]; None where neither is finite, or where K_tt, or C_rr if K is not finite, is
        singular.

    Raises:
        ValueError: as there.
    """
    if tuple(components) == PLANAR:
        centre = centre_of_stiffness(stiffness, components)
        return centre_of_compliance(compliance, components) if centre is None else centre
    stiff, soft = _spatial(stiffness, components), _spatial(compliance, components)
    if stiff is not None:
        return _skew_part(stiff[:3, 3:], stiff[3:, 3:])
    return None if soft is None else _skew_part(soft[3:, :3], soft[:3, :3])


def _spatial(matrix: Matrix | None, components: Sequence[int]) -> Array | None:
    """The matrix with zeros for what a planar machine lacks [6 x 6]."""
    if tuple(components) not in (SPATIAL, PLANAR):
        raise ValueError(f"a centre exists in space or in the plane, not with components {tuple(components)}")
    array = finite(matrix, components)
    if array is None:
        return None
    whole = np.zeros((6, 6))
    whole[np.ix_(components, components)] = array
    return whole


def _centre(block: Array, coupling: Array, components: Sequence[int]) -> Point | None:
    """d with coupling - [d x] block symmetric, since [d x] A + A [d x] = [(tr(A) 1 - A) d x]; zero out of the plane."""
    axes = [c - 3 for c in components if c >= 3]
    matrix = (np.trace(block) * np.eye(3) - block)[np.ix_(axes, axes)]
    values = np.linalg.eigvalsh(matrix)
    if values[0] <= NO_UNIQUE_CENTRE * values[-1]:
        return None
    offset = np.zeros(3)
    offset[axes] = np.linalg.solve(matrix, _vee(coupling)[axes])
    return offset


def _skew_part(coupling: Array, block: Array) -> Point | None:
    """d with [d x] the skew part of coupling block^-1."""
    values = np.linalg.eigvalsh(block)
    if values[0] <= NO_UNIQUE_CENTRE * values[-1]:
        return None
    return 0.5 * _vee(np.asarray(np.linalg.solve(block, coupling.T).T, dtype=float))


def _vee(matrix: Array) -> Array:
    """a, where matrix - matrix^T = [a x]."""
    return np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])

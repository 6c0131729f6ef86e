"""Centres of the elasticity of a machine: of stiffness, of compliance, of elasticity.

They belong to the machine and move with it: the point of space found does not depend on the reference point. In space
(6 x 6) or in the plane (3 x 3, rows rz x y). The normal form's screws are in `eigenscrews`.

Sources: J. Loncaric, "Normal forms of stiffness and compliance matrices", IEEE J. Robotics and Automation 3(6), 1987;
T. Patterson and H. Lipkin, "Structure of robot compliance", ASME J. Mechanical Design 115(3), 1993; N. Ciblak and
H. Lipkin, "Centers of stiffness, compliance, and elasticity in the analysis of robotic systems", ASME DE-72, 1994.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from kinetostat.arrays import Array
from kinetostat.kinetostatics.indices import PLANAR, SPATIAL, Matrix, finite
from kinetostat.tolerances import NO_UNIQUE_CENTRE

Point: TypeAlias = list[float]
"""From the reference point P, base axes, m [3]."""


def centre_of_stiffness(stiffness: Matrix | None, components: Sequence[int] = SPATIAL) -> Point | None:
    """The point at which the coupling block of K is symmetric: (tr(K_tt) 1 - K_tt) d = vee(K_rt - K_tr).

    Of a planar machine, where it is zero: a force through it causes no rotation. Loncaric (1987); Ciblak and Lipkin
    (1994).

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
        return centre_of_stiffness(stiffness, components) or centre_of_compliance(compliance, components)
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
    return [float(c) for c in offset]


def _skew_part(coupling: Array, block: Array) -> Point | None:
    """d with [d x] the skew part of coupling block^-1."""
    values = np.linalg.eigvalsh(block)
    if values[0] <= NO_UNIQUE_CENTRE * values[-1]:
        return None
    return [0.5 * float(c) for c in _vee(np.asarray(np.linalg.solve(block, coupling.T).T, dtype=float))]


def _vee(matrix: Array) -> Array:
    """a, where matrix - matrix^T = [a x]."""
    return np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])

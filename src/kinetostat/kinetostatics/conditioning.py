"""Conditioning: how unevenly K or a Jacobian treats the directions, rotations made comparable by a given length.

No index of one unit here (see `indices`). The length is the caller's choice and goes with every number printed.

Source: theory section 10; J. Salisbury and J. Craig, "Articulated hands", Int. J. Robotics Research 1(1), 1982.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from kinetostat.arrays import Array
from kinetostat.kinetostatics.indices import SPATIAL, Matrix, finite
from kinetostat.tolerances import ROUND_OFF_OF_EIGENVALUE


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

    Introduced for Jacobians by Salisbury and Craig, "Articulated hands", Int. J. Robotics Research 1(1), 1982.

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
    return _condition(twists, _scale(components, _positive(length)))


def _positive(length: float) -> float:
    if not 0.0 < length < np.inf:
        raise ValueError(f"a characteristic length is positive, not {length}")
    return length


def _scale(components: Sequence[int], rotational: float) -> Array:
    return np.array([rotational if c < 3 else 1.0 for c in components])


def _condition(screws: npt.ArrayLike, scale: Array) -> float:
    matrix = np.asarray(screws, dtype=float)
    if matrix.ndim != 2 or len(matrix) != len(scale) or not matrix.size or not np.isfinite(matrix).all():
        raise ValueError(f"screws are {len(scale)} rows of finite numbers, one column each, not {matrix.shape}")
    values = np.linalg.svd(matrix * scale[:, None], compute_uv=False)
    return _ratio(values[0], values[-1])


def _ratio(largest: float, smallest: float) -> float:
    """The quotient; infinity where the smallest is only round-off."""
    return float(largest / smallest) if smallest > ROUND_OFF_OF_EIGENVALUE * largest else np.inf

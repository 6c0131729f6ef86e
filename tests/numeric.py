"""Numbers for tests: our structures as NumPy arrays, and comparisons that never mix rotation with translation."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from hypothesis import assume

from kinetostat.algebra.screw import Screw, Twist, Wrench
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.algebra.vector import Displacement, Rotation, Vector
from kinetostat.kinetostatics.assembly import Statics, compliance_matrix, solve_statics, stiffness_matrix
from kinetostat.machine.machine import Configuration

Array = npt.NDArray[np.float64]

U = float(np.finfo(float).eps)
"""Rounding unit of float64, 2.2e-16."""
BLOCKS = (slice(0, 3), slice(3, 6))
REACHED = 1e-9
"""Share of a screw, in one unit, above which a component is surely no rounding; see `reached`."""


def array(symmetric: Symmetric6) -> Array:
    """K or C as an array [6 x 6]."""
    return np.array(symmetric.rows(), dtype=float)


def vector(v: Vector) -> Array:
    """A vector as an array [3]."""
    return np.array(v.components(), dtype=float)


def matrix(rotation: Rotation) -> Array:
    """A rotation as an array [3 x 3]."""
    return np.array([rotation.x.components(), rotation.y.components(), rotation.z.components()], dtype=float).T


def screw(s: Screw) -> Array:
    """A twist or wrench as an array [6], order rx ry rz x y z."""
    return np.array(s.components(), dtype=float)


def skew(a: Array) -> Array:
    """The matrix of a x . [3 x 3]."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def wrench_transport(turn: Array, offset: Array) -> Array:
    """The matrix [6 x 6] that turns a wrench by `turn` and then refers it to the point at `offset` (m) from before."""
    return np.block([[turn, -skew(offset) @ turn], [np.zeros((3, 3)), turn]])


def twist_transport(turn: Array, offset: Array) -> Array:
    """Likewise for a twist."""
    return np.block([[turn, np.zeros((3, 3))], [-skew(offset) @ turn, turn]])


def dimensionless(symmetric: Symmetric6, length: float, kind: type[Screw]) -> Array:
    """K (kind Wrench) or C (kind Twist), moments divided and angles multiplied by `length` (m): all in N/m or m/N."""
    scale = np.repeat([1.0 / length if kind is Wrench else length, 1.0], 3)
    return scale[:, None] * array(symmetric) * scale


def trace_product(stiffness: Symmetric6, compliance: Symmetric6, length: float) -> float:
    """tr K tr C in one unit: 36 at best; times the rounding unit, what K C can differ from 1."""
    scaled = dimensionless(stiffness, length, Wrench), dimensionless(compliance, length, Twist)
    return float(np.trace(scaled[0]) * np.trace(scaled[1]))


def assert_blocks_close(actual: Array, expected: Array, relative: float) -> None:
    """Compare two symmetric 6x6 block by block, in the Frobenius norm.

    The scale of the coupling block is the geometric mean of the rotational and the translational block: for a
    positive semi-definite matrix it is at most that, and it has the same unit, so that no length has to be chosen.
    """
    sizes = [np.linalg.norm(expected[block, block]) for block in BLOCKS]
    for i, rows in enumerate(BLOCKS):
        for j, columns in enumerate(BLOCKS):
            error = np.linalg.norm(actual[rows, columns] - expected[rows, columns])
            scale = np.sqrt(sizes[i] * sizes[j])
            assert error <= relative * scale, f"block {i},{j}: {error:.3g} of {scale:.3g}"


def assert_psd(symmetric: Symmetric6, length: float, kind: type[Screw]) -> None:
    """All entries finite and no eigenvalue below zero beyond rounding; symmetric by construction."""
    scaled = dimensionless(symmetric, length, kind)
    assert np.all(np.isfinite(scaled))
    assert np.array_equal(scaled, scaled.T)
    eigenvalues = np.linalg.eigvalsh(scaled)
    assert eigenvalues[0] >= -20 * U * eigenvalues[-1]


def statics_at(configuration: Configuration, reference: Vector) -> Statics:
    """Statics of a placed machine at any reference point (base frame, m)."""
    length = configuration.length
    return solve_statics([leg.screws(reference, length) for leg in configuration.legs], length)


def displaced(configuration: Configuration, motion: Displacement) -> Configuration:
    """The whole placed machine moved as one."""
    legs = tuple(leg.displaced(motion) for leg in configuration.legs)
    return Configuration(motion @ configuration.platform, legs, configuration.closures, configuration.length)


def matrices(statics: Statics) -> tuple[Array, Array]:
    """K and C as arrays [6 x 6]."""
    return array(stiffness_matrix(statics)), array(compliance_matrix(statics))


def columns(screws: Sequence[Screw]) -> Array:
    """Screws as the columns of an array [6 x n]."""
    return np.array([s.components() for s in screws], dtype=float).T


def reached(screws: Sequence[Screw], indices: Sequence[int], length: float) -> npt.NDArray[np.bool_]:
    """Entries [6 x 6] to which the screws of these springs contribute beyond rounding; refuses doubtful machines.

    For twists `length` is that of the machine (m), for wrenches its inverse: then all six components compare.
    """
    touched = np.zeros((6, 6), dtype=bool)
    for e in indices:
        parts = abs(screw(screws[e])) * np.repeat([length, 1.0], 3)
        share = parts / np.linalg.norm(parts)
        assume(not np.any((share > 100 * U) & (share < REACHED)))
        touched |= np.outer(share > REACHED, share > REACHED)
    return touched

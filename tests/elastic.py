"""Random elasticity for tests without a machine: sums of springs on screws, turned and referred to other points."""

import numpy as np
from hypothesis import strategies as st

from geometry import rotations, vectors
from kinetostat.algebra.scalar import total, weighted
from kinetostat.algebra.vector import Rotation

LENGTH = 0.3
"""m: the size of the machines whose stiffness is drawn."""
PLANE = (2, 3, 4)


def turn(rotation: Rotation) -> np.ndarray:
    """A rotation as an array [3 x 3]."""
    return np.array([rotation.x.components(), rotation.y.components(), rotation.z.components()]).T


def cross(a) -> np.ndarray:
    """The matrix of a x . [3 x 3]."""
    return np.array([np.cross(a, axis) for axis in np.eye(3)]).T


def wrench_moved(rotation, offset) -> np.ndarray:
    """Turn a wrench, then refer it to the point at `offset` [6 x 6]."""
    return np.block([[rotation, -cross(offset) @ rotation], [np.zeros((3, 3)), rotation]])


def spring_matrix(seed: int, count: int, contrast: float = 3.0) -> np.ndarray:
    """K of `count` springs on random screws, their stiffnesses spread over `contrast` decades [6 x 6]."""
    rng = np.random.default_rng(seed)
    forces = rng.normal(size=(count, 3))
    moments = LENGTH * rng.normal(size=(count, 3))
    stiffnesses = 1e5 * 10.0 ** rng.uniform(-contrast / 2, contrast / 2, count)
    wrenches = np.hstack([moments, forces])
    matrix = np.einsum("s,si,sj->ij", stiffnesses, wrenches, wrenches)
    return 0.5 * (matrix + matrix.T)


def condition(matrix: np.ndarray) -> float:
    """Of K in units of LENGTH."""
    scale = np.repeat([1.0 / LENGTH, 1.0], 3)
    return float(np.linalg.cond(matrix * np.outer(scale, scale)))


stiffnesses = st.integers(0, 10**6).map(lambda seed: spring_matrix(seed, 8)).filter(lambda k: condition(k) < 1e6)
"""Regular K."""
turns = rotations().map(turn)
offsets = vectors(0.5).map(lambda v: np.array(v.components(), dtype=float))
directions = rotations().map(lambda rotation: np.array(rotation.z.components(), dtype=float))


def stiffness_at(stiffness, offset) -> np.ndarray:
    """K [6 x 6] referred to the point at `offset` (m, base axes) from the present one."""
    back = np.block([[np.eye(3), np.zeros((3, 3))], [cross(offset), np.eye(3)]])
    return back.T @ stiffness @ back


def compliance_at(compliance, offset) -> np.ndarray:
    """C [6 x 6] likewise."""
    there = np.block([[np.eye(3), np.zeros((3, 3))], [-cross(offset), np.eye(3)]])
    return there @ compliance @ there.T


def leg_compliance(leg):
    """G = W^T J_e S J_e^T W [m x m] of theory (3): W^T t = G lambda."""
    size, springs = range(len(leg.wrenches)), list(zip(leg.compliance, leg.loads, strict=True))
    return [[total([weighted(s, row[a] * row[b]) for s, row in springs]) for b in size] for a in size]

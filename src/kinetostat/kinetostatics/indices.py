"""Indices: one number (or one direction) at one pose. Rotation and translation are never mixed (theory section 1)."""

from dataclasses import dataclass

import numpy as np

from kinetostat.algebra.symmetric import Symmetric6

BLOCKS = {"rotation": slice(0, 3), "translation": slice(3, 6)}
"""The two diagonal blocks of a 6x6, each of one unit."""


@dataclass(frozen=True)
class Principal:
    """Principal compliances of one block, in increasing order.

    Attributes:
        compliances: rad/(N·m) for rotation, m/N for translation [3].
        directions: unit vectors, base axes, one row each [3 x 3].
    """

    compliances: list[float]
    directions: list[list[float]]


def principal_compliances(compliance: Symmetric6) -> dict[str, Principal]:
    """How soft the platform is in its softest and stiffest directions, for rotation and for translation.

    Under a pure moment (force) along a direction, the rotation (translation) it causes along itself; the extremes of
    that are the eigenvalues of the block.

    Args:
        compliance: C at P, base axes, all entries finite.
    """
    matrix = np.array(compliance.rows(), dtype=float)
    result = {}
    for name, block in BLOCKS.items():
        values, vectors = np.linalg.eigh(matrix[block, block])
        result[name] = Principal(np.maximum(values, 0.0).tolist(), vectors.T.tolist())
    return result

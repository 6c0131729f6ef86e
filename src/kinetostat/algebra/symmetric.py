"""Symmetric 6x6 matrices held as their 21 upper entries: what K and C are.

Only sums of weighted dyads and look-ups live here; factorisations are in `solve`.

Source: theory (10), whose dyads they are sums of. In the axes and at the point of the screws that they are made of.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from kinetostat.algebra.scalar import Scalar, total, weighted
from kinetostat.algebra.screw import Screw

SIZE = 6
POSITIONS = [(i, j) for i in range(SIZE) for j in range(i, SIZE)]
"""Row and column of each of the 21 stored entries."""
_INDEX = {position: k for k, position in enumerate(POSITIONS)}


@dataclass(frozen=True)
class Symmetric6:
    """A symmetric 6x6 matrix, rows and columns in the order rx ry rz x y z: its upper triangle, row by row."""

    upper: tuple[Scalar, ...]

    @classmethod
    def dyad(cls, a: Screw, b: Screw) -> "Symmetric6":
        """The symmetric part of the dyad a b^T; for b = a, a a^T itself."""
        p, q = a.components(), b.components()
        if a is b:
            return cls(tuple(p[i] * p[j] for i, j in POSITIONS))
        return cls(tuple(0.5 * (p[i] * q[j] + p[j] * q[i]) for i, j in POSITIONS))

    @classmethod
    def total(cls, terms: Sequence["Symmetric6"]) -> "Symmetric6":
        """Sum of matrices; the zero matrix when there are none."""
        return cls(tuple(total([term.upper[k] for term in terms]) for k in range(len(POSITIONS))))

    def __mul__(self, factor: Scalar) -> "Symmetric6":
        return Symmetric6(tuple(weighted(factor, entry) for entry in self.upper))

    def entry(self, i: int, j: int) -> Scalar:
        """Entry in row i, column j (0-based)."""
        return self.upper[_INDEX[min(i, j), max(i, j)]]

    def diagonal(self) -> tuple[Scalar, ...]:
        """The six diagonal entries."""
        return tuple(self.entry(i, i) for i in range(SIZE))

    def rows(self) -> list[list[Scalar]]:
        """The full matrix as nested lists [6][6]."""
        return [[self.entry(i, j) for j in range(SIZE)] for i in range(SIZE)]

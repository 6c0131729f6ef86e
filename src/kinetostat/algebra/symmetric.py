"""Symmetric matrices: K and C by their 21 upper entries, and the eigenvalues of small ones, without branches.

Factorisations are in `solve`. K and C refer to the axes and the point of the screws whose dyads add up to them.

Source: theory (10); for the eigenvalue, Jacobi's rotations in cyclic order, Golub and Van Loan, Matrix Computations,
4th ed., section 8.5. The closed trigonometric form is shorter, but loses half of its digits where two eigenvalues are
nearly equal, and needs an arc.
"""

from collections.abc import Sequence
from itertools import combinations

from kinetostat.algebra.scalar import Scalar, sqrt, steady, total, weighted, where
from kinetostat.algebra.screw import Screw
from kinetostat.frozen import dataclass

SIZE = 6
"""Rows of K and C: the components of a screw."""
POSITIONS = [(i, j) for i in range(SIZE) for j in range(i, SIZE)]
"""Row and column of each of the 21 stored entries."""
_INDEX = {position: k for k, position in enumerate(POSITIONS)}
"""The place of each of these entries, by its row and column."""
SWEEPS = 4
"""Sweeps of a 3x3 matrix. In thousands of random matrices, the largest entry off the diagonal is 1e-6 of the greatest
eigenvalue after three of them and 1e-23 after four; the eigenvalues are wrong by about the square of that."""
SWEEPS_OF_LARGER = 7
"""Sweeps of larger matrices. In those of size 8, this entry is 3e-6 after six of them and 3e-10 after seven."""


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
    def sum_of(cls, terms: Sequence["Symmetric6"]) -> "Symmetric6":
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


def greatest_eigenvalue(rows: Sequence[Sequence[Scalar]]) -> Scalar:
    """Return the greatest eigenvalue of a symmetric matrix [n x n]; see `eigenvalues`."""
    values = eigenvalues(rows)
    greatest = values[0]
    for value in values[1:]:
        greatest = where(value > greatest, value, greatest)
    return greatest


def eigenvalues(rows: Sequence[Sequence[Scalar]], sloped: bool = False) -> list[Scalar]:
    """Return the eigenvalues of a symmetric matrix [n x n], in no order.

    They are accurate to some units of round-off of the greatest, also if eigenvalues are equal, and NaN if an entry is
    infinite.

    Args:
        rows: the rows of the matrix.
        sloped: whether derivatives will be taken where eigenvalues may be equal. Each eigenvalue is then computed as
            v^T A v with its eigenvector v held constant: its derivative is v^T dA v, and the mean of equal ones has
            the right derivative. The derivative of the rotations themselves is lost in the round-off of their angles.
    """
    size = len(rows)
    entries = {(i, j): rows[i][j] for i in range(size) for j in range(i, size)}
    axes = [[1.0 if i == j else 0.0 for j in range(size)] for i in range(size)]
    for _ in range(_sweeps(size)):
        for p, q in combinations(range(size), 2):
            cosine, sine = _rotate(entries, p, q, [i for i in range(size) if i not in (p, q)])
            if sloped:
                for axis in axes:
                    axis[p], axis[q] = cosine * axis[p] - sine * axis[q], sine * axis[p] + cosine * axis[q]
    if not sloped:
        return [entries[i, i] for i in range(size)]
    vectors = [[steady(axis[k]) for axis in axes] for k in range(size)]
    return [_rayleigh_quotient(rows, vector) for vector in vectors]


def _sweeps(size: int) -> int:
    """Number of sweeps that leave only round-off in the eigenvalues: a single rotation solves a 2x2 matrix."""
    return {1: 0, 2: 1, 3: SWEEPS}.get(size, SWEEPS_OF_LARGER)


def _rayleigh_quotient(rows: Sequence[Sequence[Scalar]], vector: Sequence[Scalar]) -> Scalar:
    """The quotient v^T A v / v^T v; only the upper triangle of A is read."""
    size = range(len(rows))
    diagonal = total([rows[i][i] * (vector[i] * vector[i]) for i in size])
    off_diagonal = total([rows[i][j] * (vector[i] * vector[j]) for i in size for j in range(i + 1, len(rows))])
    return (diagonal + 2.0 * off_diagonal) / total([part * part for part in vector])


def _rotate(entries: dict[tuple[int, int], Scalar], p: int, q: int, others: Sequence[int]) -> tuple[Scalar, Scalar]:
    """Turn rows and columns p and q so that their common entry vanishes, by the smaller of the two angles.

    Returns:
        The cosine and the sine of the angle.
    """
    difference, coupling = entries[q, q] - entries[p, p], entries[p, q]
    # Where the diagonal entries are equal and uncoupled nothing needs a turn; then `where` keeps the quotient finite.
    square = difference * difference + 4.0 * (coupling * coupling)
    needs_turn = square > 0.0
    size = abs(difference) + sqrt(where(needs_turn, square, 1.0))
    tangent = where(needs_turn, where(difference < 0.0, -2.0, 2.0) * coupling / size, 0.0)
    entries[p, p] = entries[p, p] - tangent * coupling
    entries[q, q] = entries[q, q] + tangent * coupling
    entries[p, q] = 0.0
    cosine = 1.0 / sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    for other in others:
        first, second = (min(p, other), max(p, other)), (min(q, other), max(q, other))
        a, b = entries[first], entries[second]
        entries[first], entries[second] = cosine * a - sine * b, sine * a + cosine * b
    return cosine, sine

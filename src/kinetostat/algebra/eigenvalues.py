"""The greatest eigenvalue of small symmetric matrices, in arithmetic without branches. No vectors are returned.

Source: Jacobi's rotations in cyclic order; Golub and Van Loan, Matrix Computations, 4th ed., section 8.5. The closed
trigonometric form is shorter, but loses half of its digits where two eigenvalues are nearly equal, and needs an arc.
"""

from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, sqrt, where

SWEEPS = 4
"""Of three rotations each; the entries off the diagonal fall with the cube, so that four leave the rounding."""


def greatest_eigenvalue(rows: Sequence[Sequence[Scalar]]) -> Scalar:
    """The greatest eigenvalue of a symmetric matrix without negative ones [n x n], n = 1, 2 or 3.

    Accurate to some rounding units, also where eigenvalues are equal. NaN where an entry is infinite. Derivatives are
    those of the eigenvalue that is chosen.
    """
    at = {(i, j): rows[i][j] for i in range(len(rows)) for j in range(i, len(rows))}
    if len(rows) == 2:
        _rotate(at, 0, 1, None)
    if len(rows) == 3:
        for _ in range(SWEEPS):
            for p, q, other in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
                _rotate(at, p, q, other)
    greatest = at[0, 0]
    for i in range(1, len(rows)):
        greatest = where(at[i, i] > greatest, at[i, i], greatest)
    return greatest


def _rotate(at: dict[tuple[int, int], Scalar], p: int, q: int, other: int | None) -> None:
    """Turn rows and columns p and q so that their common entry vanishes, by the smaller of the two angles."""
    apart, coupling = at[q, q] - at[p, p], at[p, q]
    square = apart * apart + 4.0 * (coupling * coupling)
    turned = square > 0.0
    size = abs(apart) + sqrt(where(turned, square, 1.0))
    tangent = where(turned, where(apart < 0.0, -2.0, 2.0) * coupling / size, 0.0)
    at[p, p], at[q, q], at[p, q] = at[p, p] - tangent * coupling, at[q, q] + tangent * coupling, 0.0
    if other is not None:
        cosine = 1.0 / sqrt(1.0 + tangent * tangent)
        sine = tangent * cosine
        first, second = (min(p, other), max(p, other)), (min(q, other), max(q, other))
        at[first], at[second] = cosine * at[first] - sine * at[second], sine * at[first] + cosine * at[second]

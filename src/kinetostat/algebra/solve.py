"""Solve small dense systems, unrolled over scalars: dual basis and complement by Householder, modes by Gram-Schmidt.

Every loop runs over a size known while tracing, so that traced code has no loop and no LAPACK call. Structural
zeros are used: sparse vectors are taken first and only their non-zero rows are touched.

Source: theory (1), (6), (7) and (9); G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed. (2013), section 5.2.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from kinetostat.algebra.scalar import (
    Scalar,
    inner_product,
    is_zero,
    larger,
    reciprocal,
    smaller,
    sqrt,
    total,
    weighted,
    where,
)
from kinetostat.frozen import dataclass
from kinetostat.tolerances import CLOSING_ROUND_OFF, SURE_PIVOT, SURELY_MORE, UNRESISTED, ZERO_PIVOT

Row = list[Scalar]


@dataclass(frozen=True)
class _Triangular:
    """Q^T V = R for given vectors V: `vectors` holds R by columns.

    Vector `order[k]` ends in row `pivots[k]`, whose entry has the reciprocal `shrink[k]`; `free` are the rows without a
    pivot. Q is the product of the `reflections`. `least` is the smallest pivot, 0 where the vectors are dependent.
    """

    vectors: list[Row]
    order: list[int]
    pivots: list[int]
    shrink: Row
    free: list[int]
    least: Scalar
    reflections: list["_Reflection"]

    @property
    def images(self) -> list[Row]:
        """Q^T by columns: the images of the unit vectors."""
        columns = [self.column(row) for row in range(len(self.vectors[0]))]
        return [list(image) for image in zip(*columns, strict=True)]

    def column(self, row: int) -> Row:
        """The column of Q of one row: in reverse, the first reflections meet most zeros."""
        result = identity(len(self.vectors[0]))[row]
        for reflection in reversed(self.reflections):
            reflection.apply(result)
        return result

    def inverse(self) -> list[Row]:
        """R^-T: row k gives the component along pivot k for each vector's coefficient."""
        size = range(len(self.order))
        steps: list[Row] = [[] for _ in size]
        for k in size:
            vector = self.order[k]
            above = [(self.vectors[vector][self.pivots[i]], steps[i]) for i in range(k)]
            for j in size:
                from_above = total([factor * step[j] for factor, step in above])
                steps[k].append(weighted(self.shrink[k], (1.0 if j == vector else 0.0) - from_above))
        return steps


def dual_basis(
    basis: Sequence[Sequence[Scalar]], squares: Sequence[Scalar | None] | None = None
) -> tuple[list[Row], Scalar]:
    """Return the n vectors xi_a with xi_a . w_b = 1 if a = b, else 0, for n vectors w_b of n components.

    With the w_b as columns of W, the xi_a are the rows of W^-1.

    Args:
        basis: the vectors w_b, each of n scalars; components of comparable size (scale rows before).
        squares: the square of the size of each vector that the margin takes with unit size; None for the others.

    Returns:
        The n dual vectors, and the singularity margin n / (|W| |W^-1|), Frobenius norms: the reciprocal of a
        condition number, 1 where the w_b are orthogonal and of one size, 0 where they are dependent and the dual
        vectors meaningless.
    """
    solved = _triangularise(basis)
    inverse = [list(row) for row in zip(*solved.inverse(), strict=True)]
    dual: list[Row] = []
    for coefficients in inverse:  # a row of R^-1, and of W^-1 = R^-1 Q^T when it has been reflected
        row: Row = [0.0] * len(basis)
        for pivot, component in zip(solved.pivots, coefficients, strict=True):
            row[pivot] = component
        for reflection in reversed(solved.reflections):
            reflection.apply(row)
        dual.append(row)
    return dual, _singularity_margin(basis, inverse, solved.least, squares)


class RightInverse(NamedTuple):
    """All solutions of A x = b for n independent rows of m >= n components: x = A+ b plus any mix of null vectors.

    Attributes:
        solution: A+ as m rows of n scalars: the solution of least norm.
        null: the m - n orthonormal null vectors, of m scalars each.
        margin: the singularity margin n / (|A| |A+|), as in `dual_basis`.
    """

    solution: list[Row]
    null: list[Row]
    margin: Scalar


def right_inverse(rows: Sequence[Sequence[Scalar]]) -> RightInverse:
    """Solve A x = b, by the rows of A."""
    solved = _triangularise(rows)
    size, steps, images = len(rows), solved.inverse(), solved.images
    solution = [
        [total([column[p] * steps[k][j] for k, p in enumerate(solved.pivots)]) for j in range(size)]
        for column in images
    ]
    null = [[column[row] for column in images] for row in solved.free]
    return RightInverse(solution, null, _singularity_margin(rows, steps, solved.least))


def complement(vectors: Sequence[Sequence[Scalar]]) -> tuple[list[Row], Scalar]:
    """Return an orthonormal basis of the space orthogonal to a independent vectors of n components, a < n.

    Returns:
        The n - a basis vectors, and the singularity margin a / (|V| |V+|) of the given ones, as in `dual_basis`.
    """
    solved = _triangularise(vectors)
    basis = [solved.column(row) for row in solved.free]
    return basis, _singularity_margin(vectors, solved.inverse(), solved.least)


def _singularity_margin(
    vectors: Sequence[Sequence[Scalar]],
    inverse: Sequence[Sequence[Scalar]],
    least: Scalar,
    squares: Sequence[Scalar | None] | None = None,
) -> Scalar:
    """n / (|V| |V+|) for n vectors and anything of the size of their inverse, at most 1; 0 where they are dependent.

    Vectors whose square is known are divided by their size, and the rows of the inverse multiplied by it.
    """
    known_squares = squares or [None] * len(vectors)
    sizes = [
        [
            _square(vector) if square is None else 1.0,
            _square(row) if square is None else square * _square(row),
        ]
        for vector, row, square in zip(vectors, inverse, known_squares, strict=True)
    ]
    of_vectors, of_inverse = (total(list(column)) for column in zip(*sizes, strict=True))
    margin = float(len(vectors)) * reciprocal(sqrt(of_vectors * of_inverse))
    return where(least > ZERO_PIVOT, smaller(1.0, margin), 0.0)


def _square(vector: Sequence[Scalar]) -> Scalar:
    return total([c * c for c in vector])


def handedness(vectors: Sequence[Sequence[Scalar]]) -> Scalar:
    """Return the sign, +1 or -1, of the determinant of a independent vectors of n components and their complement.

    The complement is the basis that `complement` returns for a < n, whose vectors need not move continuously with the
    given ones; for a = n there is none.
    """
    solved = _triangularise(vectors)
    columns = [*zip(solved.order, solved.pivots, strict=True), *enumerate(solved.free, len(vectors))]
    rows = [row for _, row in sorted(columns)]
    swaps = sum(rows[i] > rows[j] for j in range(len(rows)) for i in range(j))
    sign: Scalar = -1.0 if (swaps + len(solved.reflections)) % 2 else 1.0
    for vector, row in zip(solved.order, solved.pivots, strict=True):
        sign = where(solved.vectors[vector][row] < 0.0, -sign, sign)
    return sign


def _triangularise(vectors: Sequence[Sequence[Scalar]]) -> _Triangular:
    """Householder QR, backward stable without pivoting, so that it needs no data-dependent branch."""
    reduced = [list(vector) for vector in vectors]
    waiting, free = list(range(len(vectors))), list(range(len(vectors[0])))
    order: list[int] = []
    pivots: list[int] = []
    shrink: Row = []
    least: Scalar = math.inf
    reflections: list[_Reflection] = []
    while waiting:
        # The sparsest vector first: its few rows fill the others least, so that structural zeros last longest.
        sparsest = min(waiting, key=lambda j: sum(not is_zero(reduced[j][i]) for i in free))
        waiting.remove(sparsest)
        filled = [i for i in free if not is_zero(reduced[sparsest][i])] or free[:1]
        if len(filled) > 1:
            reflections.append(_reflection(reduced[sparsest], filled))
            for other in waiting:
                reflections[-1].apply(reduced[other])
            shrink.append(reflections[-1].shrink)
        else:
            shrink.append(reciprocal(reduced[sparsest][filled[0]]))
        order.append(sparsest)
        pivots.append(filled[0])
        free.remove(filled[0])
        least = smaller(least, abs(reduced[sparsest][filled[0]]))
    return _Triangular(reduced, order, pivots, shrink, free, least, reflections)


@dataclass(frozen=True)
class _Reflection:
    """A reflection of some rows: what it subtracts is the product with `normal`, times `weight`, of the normal.

    `shrink` is the reciprocal of the pivot that it leaves.
    """

    rows: list[int]
    normal: Row
    weight: Scalar
    shrink: Scalar

    def apply(self, other: Row) -> None:
        """Reflect a vector in place."""
        share = weighted(self.weight, total([a * other[i] for a, i in zip(self.normal, self.rows, strict=True)]))
        for a, i in zip(self.normal, self.rows, strict=True):
            other[i] = other[i] - share * a


def _reflection(column: Row, rows: list[int]) -> _Reflection:
    """The reflection after which a vector keeps, of some rows, only the first; the vector is changed so."""
    pivot = sqrt(total([column[i] * column[i] for i in rows]))
    # The sign opposite to the first entry: the difference below then adds two sizes and loses no digits.
    pivot = where(column[rows[0]] < 0.0, pivot, -pivot)
    normal = [column[rows[0]] - pivot, *(column[i] for i in rows[1:])]
    for i in rows:
        column[i] = 0.0
    column[rows[0]] = pivot
    weight = reciprocal(pivot * -normal[0])
    return _Reflection(rows, normal, weight, weight * -normal[0])  # one division for both


def identity(size: int) -> list[Row]:
    """The rows of a unit matrix."""
    return [[1.0 if i == j else 0.0 for i in range(size)] for j in range(size)]


@dataclass(frozen=True)
class Conjugated:
    """Columns made conjugate, A'^T S A' = diag(d), and how the given ones are made of them, A = A' L^T.

    Attributes:
        columns: the columns of A'.
        shares: rows of the unit lower triangular L below the diagonal; row k has k entries.
        pivots: d >= 0, exactly 0 where S does not see a column beyond those before it.
        inverses: 1/d, and 0 where d is 0.
        doubt: 1 where some column is so nearly unseen that nobody can say whether it is, else 0.
    """

    columns: list[Row]
    shares: list[Row]
    pivots: Row
    inverses: Row
    doubt: Scalar


def conjugate(columns: Sequence[Sequence[Scalar]], weights: Sequence[Scalar], squares: Sequence[Scalar]) -> Conjugated:
    """Make the columns of A conjugate with the weights S, by Gram and Schmidt's method, one column after the other.

    A^T S A = L diag(d) L^T is never formed, so that half as many digits are lost where weights differ much.

    Whether S sees a column is a question of geometry: its components are compared with the size that they can have, and
    not with the energies of others, so that no contrast of the weights decides it. Subtracting columns that were seen
    before enlarges round-off, and this is followed. A column all of whose components are round-off is unseen
    (`CLOSING_ROUND_OFF`); one whose components are neither round-off nor surely more (`SURELY_MORE`) is seen in doubt.

    Args:
        columns: the columns of A; components beyond the weights have none and are carried along.
        weights: the diagonal of S, >= 0.
        squares: for each weight, the square of the size that its component of a column of unit size may have, > 0; its
            order of magnitude counts.
    """
    reduced = [list(column) for column in columns]
    shares: list[Row] = [[] for _ in reduced]
    pivots: Row = []
    inverses: Row = []
    doubt: Scalar = 0.0
    growth: Row = [1.0] * len(reduced)  # of round-off, by what was subtracted
    scales = [reciprocal(square) for square in squares]
    for k, column in enumerate(reduced):
        weighted_column = [weighted(w, c) for w, c in zip(weights, column, strict=False)]
        pivot = _product(weighted_column, column)
        round_off = growth[k] * growth[k]
        size = _squared_shares(column, weights, scales)
        is_seen = size > CLOSING_ROUND_OFF * CLOSING_ROUND_OFF * round_off
        doubt_if_seen = where(size > SURELY_MORE * SURELY_MORE * round_off, 0.0, 1.0)
        doubt = larger(doubt, where(is_seen, doubt_if_seen, 0.0))
        pivots.append(where(is_seen, pivot, 0.0))
        inverses.append(where(is_seen, reciprocal(where(is_seen, pivot, 1.0)), 0.0))
        for i in range(k + 1, len(reduced)):
            share = weighted(_product(weighted_column, reduced[i]), inverses[k])
            shares[i].append(share)
            reduced[i] = _difference(reduced[i], share, column)
            growth[i] = growth[i] + abs(share) * growth[k]
    return Conjugated(reduced, shares, pivots, inverses, doubt)


def _squared_shares(column: Sequence[Scalar], weights: Sequence[Scalar], scales: Sequence[Scalar]) -> Scalar:
    """Sum the squares of the components that have a weight, each as a share of the square that it may have."""
    return total(
        [
            where(weight > 0.0, component * component * scale, 0.0)
            for component, weight, scale in zip(column, weights, scales, strict=False)
            if not (is_zero(component) or is_zero(weight))
        ]
    )


def least_energy(
    columns: Sequence[Sequence[Scalar]],
    internal: Sequence[Sequence[Scalar]],
    weights: Sequence[Scalar],
    squares: Sequence[Scalar],
) -> tuple[list[Row], Scalar]:
    """Subtract from each column x the mix of the internal ones that makes x^T S x least; S as in `conjugate`.

    Mixes of internal columns that S does not see are left out: nothing that S weighs depends on them.

    Returns:
        The columns, and the doubt as in `Conjugated`, about the internal ones.
    """
    modes = conjugate(internal, weights, squares)
    reduced = [list(column) for column in columns]
    for mode, inverse in zip(modes.columns, modes.inverses, strict=True):
        weighted_mode = [weighted(w, c) for w, c in zip(weights, mode, strict=True)]
        reduced = [_difference(column, weighted(_product(weighted_mode, column), inverse), mode) for column in reduced]
    return reduced, modes.doubt


def _product(weighted_column: Sequence[Scalar], column: Sequence[Scalar]) -> Scalar:
    """Inner product of a column that the weights have multiplied with another one."""
    return total([weighted(a, b) for a, b in zip(weighted_column, column, strict=False)])


def _difference(column: Sequence[Scalar], share: Scalar, other: Sequence[Scalar]) -> Row:
    """A column less a share of another one."""
    return [a - share * b for a, b in zip(column, other, strict=True)]


@dataclass(frozen=True)
class Eliminated:
    """A square matrix A = L U by Gauss's elimination without pivoting, L with ones on its diagonal.

    Without pivoting it is stable for matrices that are positive definite, which their pivots show: all of them are then
    positive (Sylvester's law of inertia).

    Attributes:
        lower: rows of L below the diagonal; row k has k entries.
        upper: rows of U; what is left of the diagonal is not used.
        shrink: reciprocals of the pivots.
    """

    lower: list[Row]
    upper: list[Row]
    shrink: Row

    @property
    def pivots(self) -> Row:
        """The diagonal of U."""
        return [row[k] for k, row in enumerate(self.upper)]

    def forward(self, right: Sequence[Scalar]) -> Row:
        """L^-1 b."""
        result: Row = []
        for row, value in zip(self.lower, right, strict=True):
            result.append(value - inner_product(row, result))
        return result

    def solve(self, right: Sequence[Scalar]) -> Row:
        """A^-1 b."""
        solution = self.forward(right)
        for k in reversed(range(len(solution))):
            from_later = total([self.upper[k][j] * solution[j] for j in range(k + 1, len(solution))])
            solution[k] = (solution[k] - from_later) * self.shrink[k]
        return solution


def elimination(rows: Sequence[Sequence[Scalar]], symmetric: bool = True) -> Eliminated:
    """Factorise a square matrix; of a symmetric one only the upper triangle is read."""
    upper, size = [list(row) for row in rows], len(rows)
    lower: list[Row] = [[] for _ in rows]
    shrink: Row = []
    for k in range(size):
        shrink.append(1.0 / upper[k][k])
        for i in range(k + 1, size):
            share = (upper[k][i] if symmetric else upper[i][k]) * shrink[k]
            lower[i].append(share)
            for j in range(i if symmetric else k + 1, size):
                upper[i][j] = upper[i][j] - share * upper[k][j]
    return Eliminated(lower, upper, shrink)


def definite(factors: Eliminated, rows: Sequence[Sequence[Scalar]]) -> Scalar:
    """Whether a symmetric matrix is surely positive definite, by the pivots of its elimination."""
    is_definite: Scalar = True
    for k, pivot in enumerate(factors.pivots):
        is_definite = is_definite & (pivot > SURE_PIVOT * abs(rows[k][k]))
    return is_definite


def semidefinite_root(rows: Sequence[Sequence[Scalar]]) -> list[Row]:
    """The lower triangle G with G G^T = A of a matrix that may be semidefinite, by Cholesky's factorisation."""
    size = range(len(rows))
    rest: list[Row] = [list(row) for row in rows]
    root: list[Row] = [[0.0 for _ in size] for _ in size]
    for k in size:
        is_resisted = rest[k][k] > UNRESISTED * abs(rows[k][k])
        pivot_root = sqrt(where(is_resisted, rest[k][k], 1.0))
        root[k][k] = where(is_resisted, pivot_root, 0.0)
        for i in range(k + 1, len(rows)):
            root[i][k] = where(is_resisted, rest[i][k] / pivot_root, 0.0)
            for j in range(k + 1, i + 1):
                rest[i][j] = rest[i][j] - root[i][k] * root[j][k]
    return root

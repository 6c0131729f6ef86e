"""Machine code that encloses the largest eigenvalues of tridiagonal matrices at many points, in all lanes at once.

An interval for each is parted again and again, by counts of the eigenvalues above a number: as many as neighbours of
equal sign in a Sturm sequence. So equal eigenvalues cost no digits, and no branch depends on a number.

Source: Golub and Van Loan, Matrix Computations, section 8.4.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from kinetostat.engine.llvm_source import LoopCode, Value
from kinetostat.frozen import dataclass

HALVINGS = 50
"""Halvings of the interval from zero to the bound of the largest eigenvalue: 2^-50 of it is four units of round-off."""
SEQUENCES_TOGETHER = 6
"""Sturm sequences that are computed together: each step waits for the one before, and steps of others fill the time.
Three take as long; of twelve the values do not stay in registers, so that the whole program takes up to half longer."""
BOUND_FACTOR = 1.0 + math.sqrt(2.0) / 100.0
"""Factor of the bound, so that no number at which eigenvalues are counted is one that is simply related to the largest:
a sequence that is exactly zero has no signs."""
ROWS_BETWEEN_SCALINGS = 12
"""Rows after which a small Sturm sequence is scaled up. Numbers at which eigenvalues are counted come hardly nearer to
an entry than 1e-16 of the bound, so that twelve rows shrink a sequence from `SMALL_SEQUENCE` to 1e-292 at most: it does
not underflow."""
SMALL_SEQUENCE = 1e-100
"""Size of a sequence below which it is scaled up, by its reciprocal. In a row it grows by |d - x| + 1/4 at most: one of
a hundred rows overflows only where the diagonal goes a thousand times as far below zero as the bound above it."""


@dataclass(frozen=True)
class Tridiagonal:
    """A symmetric tridiagonal matrix in the workspace.

    Attributes:
        diagonal: place at which its diagonal begins.
        squares: place at which the squares of the entries beside the diagonal begin, in rows from the second; the first
            is zero.
        size: number of rows.
    """

    diagonal: int
    squares: int
    size: int


def enclose(code: LoopCode, matrix: Tridiagonal, count: int) -> None:
    """Write the largest eigenvalues of a matrix as results; those that are negative or not there are zero.

    Args:
        code: to which lines are appended.
        matrix: the matrix, which is scaled in its place.
        count: number of eigenvalues.
    """
    bound = _bound(code, matrix)
    _divide(code, matrix, bound)
    shares = _enclosed_shares(code, matrix, min(count, matrix.size))
    zero = code.number(0.0)
    # Numbers that are not finite compare as false everywhere. This is NaN for them, and brings them back, else zero.
    not_finite = code.mul(zero, code.load(matrix.diagonal, 0))
    for k in range(count):
        eigenvalue = code.mul(bound, shares[k]) if k < len(shares) else zero
        code.store_result(code.add(eigenvalue, not_finite), k)


def _bound(code: LoopCode, matrix: Tridiagonal) -> Value:
    """A bound of the largest eigenvalue, by Gershgorin's circles.

    None exceeds the largest entry of the diagonal by more than twice the largest entry beside it.
    """
    zero = code.number(0.0)
    with code.loop(0, matrix.size, [zero, zero]) as loop:
        entries = [code.load(start, loop.index) for start in (matrix.diagonal, matrix.squares)]
        loop.after = [
            code.where(code.is_less(largest, entry), entry, largest)
            for largest, entry in zip(loop.values, entries, strict=True)
        ]
    largest, largest_square = loop.values
    twice_beside = code.mul(code.number(2.0), code.call("sqrt", largest_square))
    return code.mul(code.number(BOUND_FACTOR), code.add(largest, twice_beside))


def _divide(code: LoopCode, matrix: Tridiagonal, bound: Value) -> None:
    """Divide a matrix by a number, so that its eigenvalues are at most 1; 0 where this is not positive."""
    zero, unit = code.number(0.0), code.number(1.0)
    positive = code.is_less(zero, bound)
    inverse = code.where(positive, code.div(unit, code.where(positive, bound, unit)), zero)
    with code.loop(0, matrix.size) as loop:
        code.store(code.mul(inverse, code.load(matrix.diagonal, loop.index)), matrix.diagonal, loop.index)
        square = code.mul(inverse, code.mul(inverse, code.load(matrix.squares, loop.index)))
        code.store(square, matrix.squares, loop.index)


def _enclosed_shares(code: LoopCode, matrix: Tridiagonal, count: int) -> list[Value]:
    """The largest eigenvalues of a matrix whose eigenvalues are at most 1: the lower ends of their last intervals.

    Each turn divides the interval of each eigenvalue by points at equal distances, and counts the eigenvalues above
    each point.
    """
    points_each = max(1, SEQUENCES_TOGETHER // count)
    turns = math.ceil(HALVINGS * math.log(2.0) / math.log(points_each + 1.0))
    with code.loop(0, turns, [code.number(0.0)] * count + [code.number(1.0)] * count) as turn:
        low, high = turn.values[:count], turn.values[count:]
        share = code.number(1.0 / (points_each + 1))
        steps = [code.mul(share, code.sub(b, a)) for a, b in zip(low, high, strict=True)]
        points = [
            [code.add(low[k], code.mul(code.number(number), steps[k])) for number in range(1, points_each + 1)]
            for k in range(count)
        ]
        counts = iter(_counts_above(code, [point for of_eigenvalue in points for point in of_eigenvalue], matrix))
        for k in range(count):
            is_above = [code.is_less(code.number(k + 0.5), next(counts)) for _ in range(points_each)]
            pairs = list(zip(is_above, points[k], strict=True))
            for above, point in pairs:
                low[k] = code.where(above, point, low[k])
            for above, point in reversed(pairs):
                high[k] = code.where(above, high[k], point)
        turn.after = [*low, *high]
    return turn.values[:count]


class SturmSequence(NamedTuple):
    """A Sturm sequence after some rows, scaled by a positive number.

    Attributes:
        last, before_last: its last two terms.
        equal_signs: number of neighbours of equal sign so far, which is the number of eigenvalues above.
    """

    last: Value
    before_last: Value
    equal_signs: Value


def _counts_above(code: LoopCode, numbers: Sequence[Value], matrix: Tridiagonal) -> list[Value]:
    """Count the eigenvalues of a matrix above each of some numbers, by the signs in Sturm sequences."""
    parts, remaining_rows = divmod(matrix.size, ROWS_BETWEEN_SCALINGS)
    end = parts * ROWS_BETWEEN_SCALINGS
    start = SturmSequence(last=code.number(1.0), before_last=code.number(0.0), equal_signs=code.number(0.0))
    with code.loop(0, end, [*start] * len(numbers), ROWS_BETWEEN_SCALINGS) as loop:
        continued = _sequences_after(
            code, numbers, _sequences_of(loop.values), matrix, loop.index, ROWS_BETWEEN_SCALINGS
        )
        loop.after = [value for sequence in continued for value in sequence]
    whole = _sequences_after(code, numbers, _sequences_of(loop.values), matrix, str(end), remaining_rows)
    return [sequence.equal_signs for sequence in whole]


def _sequences_of(values: Sequence[Value]) -> list[SturmSequence]:
    """Take sequences off the values that a loop carries."""
    size = len(SturmSequence._fields)
    return [SturmSequence(*values[first : first + size]) for first in range(0, len(values), size)]


def _sequences_after(
    code: LoopCode,
    numbers: Sequence[Value],
    sequences: Sequence[SturmSequence],
    matrix: Tridiagonal,
    first: Value,
    rows: int,
) -> list[SturmSequence]:
    """Continue Sturm sequences p_i = (d_i - x) p_(i-1) - e_i^2 p_(i-2) by some rows, and scale them.

    Args:
        code: to which lines are appended.
        numbers: the number x of each sequence.
        sequences: the sequences before these rows.
        matrix: the matrix with diagonal d and entries e beside it.
        first: the first row.
        rows: number of rows.
    """
    terms = [(sequence.last, sequence.before_last) for sequence in sequences]
    signs = [code.append_sign(code.integer(0), sequence.last) for sequence in sequences]
    for row in range(rows):
        place = code.index("add", first, row)
        entry, square = (code.load(start, place) for start in (matrix.diagonal, matrix.squares))
        for k, number in enumerate(numbers):
            last, before_last = terms[k]
            subtracted = code.mul(square, before_last)
            term = code.sub(code.mul(code.sub(entry, number), last), subtracted)
            signs[k] = code.append_sign(signs[k], term)
            terms[k] = term, last
    small, scale_up, unit = (code.number(value) for value in (SMALL_SEQUENCE, 1.0 / SMALL_SEQUENCE, 1.0))
    result = []
    for (last, before_last), sign_row, sequence in zip(terms, signs, sequences, strict=True):
        equal_signs = code.sub(code.number(float(rows)), code.count_sign_changes(sign_row, rows))
        size = code.add(code.call("abs", last), code.call("abs", before_last))
        scale = code.where(code.is_less(size, small), scale_up, unit)
        scaled = code.mul(last, scale), code.mul(before_last, scale)
        result.append(SturmSequence(*scaled, code.add(sequence.equal_signs, equal_signs)))
    return result

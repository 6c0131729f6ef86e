"""Machine code that encloses the largest eigenvalues of tridiagonal matrices at many points, in all lanes at once.

An interval for each is parted again and again, by counts of the eigenvalues above a number: as many as neighbours of
equal sign in a Sturm sequence. So equal eigenvalues cost no digits, and no branch depends on a number.

Source: Golub and Van Loan, Matrix Computations, section 8.4.
"""

import math
from collections.abc import Sequence

from kinetostat.engine.loops import LoopCode, Value

HALVINGS = 50
"""Halvings of the interval from zero to a bound of the largest eigenvalue: it is then as long as round-off."""
TOGETHER = 6
"""Sturm sequences that are computed together, because each of their sums waits for the one before."""
APART = 1.0 + math.sqrt(2.0) / 100.0
"""Factor of the bound, so that no middle is an eigenvalue that is simply related to the largest: a sequence that is
exactly zero has no signs."""
RESCALED_AFTER, SMALL = 12, 1e-100
"""Rows after which a Sturm sequence that has become this small is scaled up, before it underflows."""


def enclose(code: LoopCode, diagonal: int, squares: int, size: int, count: int) -> None:
    """Write the largest eigenvalues of a tridiagonal matrix as results; those that are negative or not there are zero.

    Args:
        code: to which lines are appended.
        diagonal, squares: where the diagonal of the matrix begins in the workspace, and where the squares of what is
            beside it, in rows from the second. Both are scaled.
        size: number of rows.
        count: number of eigenvalues.
    """
    zero, unit = code.number(0.0), code.number(1.0)
    with code.loop(0, size, [zero, zero]) as loop:
        largest, widest = loop.values
        entry, square = code.load(diagonal, loop.index), code.load(squares, loop.index)
        loop.after = [
            code.where(code.is_less(largest, entry), entry, largest),
            code.where(code.is_less(widest, square), square, widest),
        ]
    double = code.mul(code.number(2.0), code.call("sqrt", loop.values[1]))
    bound = code.mul(code.number(APART), code.add(loop.values[0], double))
    sound = code.is_less(zero, bound)
    share = code.where(sound, code.div(unit, code.where(sound, bound, unit)), zero)
    with code.loop(0, size) as loop:
        code.store(code.mul(share, code.load(diagonal, loop.index)), diagonal, loop.index)
        squared = code.mul(share, code.mul(share, code.load(squares, loop.index)))
        code.store(squared, squares, loop.index)
    shown = min(count, size)
    inner = max(1, TOGETHER // shown)
    turns = math.ceil(HALVINGS * math.log(2.0) / math.log(inner + 1.0))
    with code.loop(0, turns, [zero] * shown + [unit] * shown) as turn:
        low, high = turn.values[:shown], turn.values[shown:]
        width = [code.mul(code.number(1.0 / (inner + 1)), code.sub(b, a)) for a, b in zip(low, high, strict=True)]
        inside = [
            code.add(low[k], code.mul(code.number(part), width[k]))
            for k in range(shown)
            for part in range(1, inner + 1)
        ]
        above = _counts_above(code, inside, (diagonal, squares), size)
        for k in range(shown):
            points = inside[k * inner : (k + 1) * inner]
            counts = above[k * inner : (k + 1) * inner]
            beyond = [code.is_less(code.number(k + 0.5), count) for count in counts]
            for more, point in zip(beyond, points, strict=True):
                low[k] = code.where(more, point, low[k])
            for more, point in reversed([*zip(beyond, points, strict=True)]):
                high[k] = code.where(more, high[k], point)
        turn.after = [*low, *high]
    # Numbers that are not finite compare as false everywhere; their sum brings them back.
    lost = code.mul(zero, code.load(diagonal, 0))
    for k in range(count):
        value = code.mul(bound, turn.values[k]) if k < shown else zero
        code.give(code.add(value, lost), k)


def _counts_above(code: LoopCode, middles: Sequence[Value], matrix: tuple[int, int], size: int) -> list[Value]:
    """Count the eigenvalues of a matrix above some numbers, by the signs in Sturm sequences."""
    zero, unit = code.number(0.0), code.number(1.0)
    whole, rest = divmod(size, RESCALED_AFTER)
    start = [value for _ in middles for value in (unit, zero, zero)]
    with code.loop(0, whole * RESCALED_AFTER, start, RESCALED_AFTER) as loop:
        loop.after = _sequences(code, middles, loop.values, matrix, loop.index, RESCALED_AFTER)
    return _sequences(code, middles, loop.values, matrix, str(whole * RESCALED_AFTER), rest)[2::3]


def _sequences(
    code: LoopCode, middles: Sequence[Value], values: Sequence[Value], matrix: tuple[int, int], first: Value, rows: int
) -> list[Value]:
    """Continue Sturm sequences p' = (d - x) p - e^2 p'' by some rows.

    Args:
        code: to which lines are appended.
        middles: the number x of each sequence.
        values: p, p'' and the number of neighbours of equal sign, of each sequence.
        matrix: where its diagonal d and the squares e^2 begin.
        first: the first row.
        rows: how many.

    Returns:
        The same behind these rows.
    """
    result = list(values)
    signs = [code.sign_after(code.bits(0), values[3 * k]) for k in range(len(middles))]
    for row in range(rows):
        place = code.index("add", first, row)
        entry, square = (code.load(start, place) for start in matrix)
        for k, middle in enumerate(middles):
            now, before = result[3 * k : 3 * k + 2]
            across = code.mul(square, before)
            following = code.sub(code.mul(code.sub(entry, middle), now), across)
            signs[k] = code.sign_after(signs[k], following)
            result[3 * k : 3 * k + 2] = following, now
    for k, sign in enumerate(signs):
        now, before, count = result[3 * k : 3 * k + 3]
        equal = code.sub(code.number(float(rows)), code.changes(sign, rows))
        size = code.add(code.call("fabs", now), code.call("fabs", before))
        scale = code.where(code.is_less(size, code.number(SMALL)), code.number(1.0 / SMALL), code.number(1.0))
        result[3 * k : 3 * k + 3] = code.mul(now, scale), code.mul(before, scale), code.add(count, equal)
    return result

"""Machine code for the largest eigenvalues of symmetric matrices at many points: loops over rows, in all lanes at once.

A program of straight code would have a hundred thousand operations here. The matrices are those over the deflections of
springs (`vibration.springwise`): mirrors bring them to tridiagonal form, those along conditions first, so that what is
excluded leaves the matrix; then the eigenvalues are enclosed by halving, with counts of changes of sign. No branch
depends on a number.

Source: Golub and Van Loan, Matrix Computations, sections 5.1, 8.3 and 8.4.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from kinetostat.engine.loops import LoopCode, Value
from kinetostat.engine.machine_code import Program, compile_source, unpack
from kinetostat.engine.program_files import read_program, write_program
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.vibration.springwise import SpringSizes

if TYPE_CHECKING:
    from kinetostat.engine import native
else:  # as in `loops`
    native = LateModule("kinetostat.engine.native")

BLOCK = 4
"""Rows of a matrix that a loop goes through together, so that what they share is loaded once."""
HALVINGS = 54
"""Of the interval from zero to a bound of the largest eigenvalue, after which it is as long as round-off."""
APART = 1.0 + math.sqrt(2.0) / 100.0
"""Factor of the bound, so that no middle is an eigenvalue that is simply related to the largest: a sequence that is
exactly zero has no signs."""
RESCALED_AFTER, SMALL = 12, 1e-100
"""Rows after which a Sturm sequence that has become this small is scaled up, before it underflows."""


@dataclass(frozen=True)
class Pencil:
    """The matrices of which eigenvalues are sought, and how many of them.

    Columns of the program are, row by row, T, H [ways x springs], A [conditions x springs] and the upper triangle of D,
    of the matrix T^T H + H^T T + D where A y = 0. F and E of another matrix, 1 + T^T F + F^T T + E, follow.

    Attributes:
        sizes: of the matrices.
        count: number of eigenvalues, the largest first; those that there are not are zero.
        loaded: whether eigenvalues are relative to the other matrix.
    """

    sizes: SpringSizes
    count: int
    loaded: bool

    @property
    def stride(self) -> int:
        """Entries from a row of a matrix in the workspace to the next; whole blocks."""
        return -(-self.sizes.springs // BLOCK) * BLOCK

    @property
    def workspace(self) -> int:
        """Number of vectors in the workspace that the program is given in the place of fixed inputs."""
        sizes = self.sizes
        rows = 3 * sizes.ways + sizes.conditions
        return rows * sizes.springs + 2 * BLOCK + 2 * self.stride**2 + 6 * (self.stride + BLOCK)


@lru_cache
def eigenvalue_program(pencil: Pencil) -> Program:
    """Return the program of a pencil, as an earlier process has left it on disk, or compiled.

    In the place of fixed inputs it takes a workspace, which is filled with zeros and begins where a vector may.
    """
    text = repr(pencil)
    kept = read_program(text)
    if kept:
        return Program(unpack(kept))
    code = compile_source(pencil_source(pencil, native.host_lanes()), pencil.count)
    write_program(text, code.pack())
    return Program(code)


def pencil_source(pencil: Pencil, lanes: int) -> str:
    """Write the program of a pencil as LLVM assembly; lanes are the points of a vector."""
    code = LoopCode(lanes)
    _PencilCode(pencil, code).write()
    return code.source()


class _PencilCode:
    """Writes the program of a pencil."""

    def __init__(self, pencil: Pencil, code: LoopCode) -> None:
        """Lay out the workspace."""
        self._pencil, self._sizes, self._code = pencil, pencil.sizes, code
        over_ways, long = pencil.sizes.ways * pencil.sizes.springs, pencil.stride + BLOCK
        self._twists, self._mixed_mass, self._mixed_stiffness = 0, over_ways, 2 * over_ways
        self._conditions = 3 * over_ways + BLOCK  # entries between them are read beyond the last row, and stay zero
        self._mass = self._conditions + pencil.sizes.conditions * pencil.sizes.springs + BLOCK
        self._stiffness = self._mass + pencil.stride**2
        lists = self._stiffness + pencil.stride**2
        self._mirror, self._image, self._moved = lists, lists + long, lists + 2 * long
        self._diagonal, self._squares, self._inverses = lists + 3 * long, lists + 4 * long, lists + 5 * long
        self._zero = code.number(0.0)

    def write(self) -> None:
        """Write all of it."""
        matrices = self._write_matrices()
        for row in range(self._sizes.conditions):
            self._leave_out(row, matrices)
        size = self._sizes.springs - self._sizes.conditions
        if self._pencil.loaded:
            self._factor(size)
            self._divide(size)
        self._tridiagonal(size)
        self._enclose(size)

    def _write_matrices(self) -> list[int]:
        """Put the matrices together from the columns; gives where they begin."""
        ways, springs, conditions = self._sizes.ways, self._sizes.springs, self._sizes.conditions
        over_ways, triangle = ways * springs, springs * (springs + 1) // 2
        self._copy(0, 2 * over_ways, self._twists)
        self._copy(2 * over_ways, conditions * springs, self._conditions)
        first = 2 * over_ways + conditions * springs
        self._put_together(self._mass, self._mixed_mass, first, 0.0)
        if not self._pencil.loaded:
            return [self._mass]
        self._copy(first + triangle, over_ways, self._mixed_stiffness)
        self._put_together(self._stiffness, self._mixed_stiffness, first + triangle + over_ways, 1.0)
        return [self._mass, self._stiffness]

    def _copy(self, first: int, count: int, start: int) -> None:
        """Copy columns into the workspace."""
        code = self._code
        with code.loop(0, count) as loop:
            code.store(code.column(code.index("add", loop.index, first)), start, loop.index)

    def _put_together(self, matrix: int, mixed: int, upper: int, diagonal: float) -> None:
        """Write T^T X + X^T T + Z + diagonal 1 of the mixed part X and the columns of the upper triangle Z.

        Whatever fills up the last block is finite, and mirrors are zero there.
        """
        code, springs, block = self._code, self._sizes.springs, range(BLOCK)
        with code.loop(0, springs, step=BLOCK) as rows:
            places = [code.index("add", rows.index, k) for k in block]
            starts = self._row_starts(rows.index)
            shown = [self._at_most(place, springs - 1) for place in places]
            here = [self._twist_and_mixed(mixed, place) for place in places]
            with code.loop(0, rows.index) as before:
                j, there = before.index, self._twist_and_mixed(mixed, before.index)
                column = self._column_of_row(upper, j)
                for k in block:
                    entry = self._product(code.column(code.index("add", column, shown[k])), here[k], there)
                    code.store(entry, matrix, code.index("add", starts[k], j))
            columns = [self._column_of_row(upper, row) for row in shown]
            for i in block:
                for j in block:
                    column = code.index("add", columns[min(i, j)], shown[max(i, j)])
                    entry = self._product(code.column(column), here[i], here[j])
                    if diagonal and i == j:
                        entry = code.add(entry, code.number(diagonal))
                    code.store(entry, matrix, code.index("add", starts[i], places[j]))

    def _at_most(self, index: Value, last: int) -> Value:
        """The lesser of two integers."""
        inside = self._code.do(f"icmp slt i64 {index}, {last}")
        return self._code.do(f"select i1 {inside}, i64 {index}, i64 {last}")

    def _column_of_row(self, upper: int, row: Value) -> Value:
        """The column that the entry of a row in column 0 would have, if entries before the diagonal were there."""
        code, springs = self._code, self._sizes.springs
        before = code.index("mul", row, code.index("sub", 2 * springs - 1, row))
        return code.index("add", code.index("sdiv", before, 2), upper)

    def _twist_and_mixed(self, mixed: int, place: Value) -> list[tuple[Value, Value]]:
        """The entries of T and of X at a spring, in each way."""
        code, springs = self._code, self._sizes.springs
        starts = [springs * way for way in range(self._sizes.ways)]
        return [(code.load(self._twists + start, place), code.load(mixed + start, place)) for start in starts]

    def _product(self, entry: Value, here: list[tuple[Value, Value]], there: list[tuple[Value, Value]]) -> Value:
        """An entry of T^T X + X^T T + Z."""
        code = self._code
        for (twist, mixed), (other_twist, other_mixed) in zip(here, there, strict=True):
            entry = code.add(entry, code.mul(twist, other_mixed))
            entry = code.add(entry, code.mul(mixed, other_twist))
        return entry

    def _leave_out(self, row: int, matrices: Sequence[int]) -> None:
        """Turn a condition onto the last coordinate that is left, which is thereby zero."""
        code, springs = self._code, self._sizes.springs
        size = springs - row
        scale, _ = self._mirror_of(self._conditions + row * springs, size)
        for other in range(row + 1, self._sizes.conditions):
            start = self._conditions + other * springs
            with code.loop(0, size, [self._zero]) as loop:
                product = code.mul(code.load(start, loop.index), code.load(self._mirror, loop.index))
                loop.after = [code.add(loop.values[0], product)]
            share = code.mul(scale, loop.values[0])
            with code.loop(0, size) as loop:
                moved = code.mul(share, code.load(self._mirror, loop.index))
                code.store(code.less(code.load(start, loop.index), moved), start, loop.index)
        for matrix in matrices:
            self._reflect(matrix, str(size), scale)

    def _mirror_of(self, start: int | Value, size: Value | int, first: Value | int = 0) -> tuple[Value, Value]:
        """Find the mirror u that turns a row onto its last coordinate.

        Args:
            start: where the row begins in the workspace.
            size: number of its entries.
            first: what is added to the start.

        Returns:
            The scale s of the reflection 1 - s u u^T, and the square of the row's length.
        """
        code = self._code
        with code.loop(0, size, [self._zero]) as loop:
            entry = code.load(start, code.index("add", loop.index, first))
            code.store(entry, self._mirror, loop.index)
            loop.after = [code.add(loop.values[0], code.mul(entry, entry))]
        square, last = loop.values[0], code.index("sub", size, 1)
        entry, length = code.load(self._mirror, last), code.call("sqrt", square)
        negative = code.below(entry, self._zero)
        signed = code.where(negative, code.less(self._zero, length), length)
        code.store(code.add(entry, signed), self._mirror, last)
        for beyond in range(BLOCK):
            code.store(self._zero, self._mirror, code.index("add", size, beyond))
        half = code.add(square, code.mul(signed, entry))
        positive = code.below(self._zero, half)
        unit = code.number(1.0)
        return code.where(positive, code.div(unit, code.where(positive, half, unit)), self._zero), square

    def _reflect(self, matrix: int, size: Value, scale: Value) -> None:
        """Turn a symmetric matrix by the mirror u from both sides: A - u w^T - w u^T, of its first rows.

        The lower triangle is kept, and whole blocks on the diagonal. Beyond the size, u and w are zero.
        """
        code, block = self._code, range(BLOCK)
        filled = code.index("mul", code.index("sdiv", code.index("add", size, BLOCK - 1), BLOCK), BLOCK)
        with code.loop(0, filled, step=BLOCK) as rows:
            starts = self._row_starts(rows.index)
            mirror = [code.load(self._mirror, code.index("add", rows.index, k)) for k in block]
            with code.loop(0, rows.index, [self._zero] * BLOCK) as columns:
                j, other = columns.index, code.load(self._mirror, columns.index)
                image, sums = code.load(self._image, j), []
                for k in block:
                    entry = code.load(matrix, code.index("add", starts[k], j))
                    image = code.add(image, code.mul(entry, mirror[k]))
                    sums.append(code.add(columns.values[k], code.mul(entry, other)))
                code.store(image, self._image, j)
                columns.after = sums
            for k in block:
                result = columns.values[k]
                for column in block:
                    place = code.index("add", starts[k], code.index("add", rows.index, column))
                    result = code.add(result, code.mul(code.load(matrix, place), mirror[column]))
                code.store(result, self._image, code.index("add", rows.index, k))
        with code.loop(0, size, [self._zero]) as loop:
            product = code.mul(code.load(self._mirror, loop.index), code.load(self._image, loop.index))
            loop.after = [code.add(loop.values[0], product)]
        back = code.mul(code.mul(code.number(0.5), code.mul(scale, scale)), loop.values[0])
        with code.loop(0, size) as loop:
            along = code.mul(back, code.load(self._mirror, loop.index))
            moved = code.less(code.mul(scale, code.load(self._image, loop.index)), along)
            code.store(moved, self._moved, loop.index)
        for beyond in block:
            code.store(self._zero, self._moved, code.index("add", size, beyond))
        with code.loop(0, filled, step=BLOCK) as rows:
            starts = self._row_starts(rows.index)
            places = [code.index("add", rows.index, k) for k in block]
            mirror = [code.load(self._mirror, place) for place in places]
            moved_rows = [code.load(self._moved, place) for place in places]
            with code.loop(0, code.index("add", rows.index, BLOCK)) as columns:
                j = columns.index
                other, other_moved = code.load(self._mirror, j), code.load(self._moved, j)
                for k in block:
                    place = code.index("add", starts[k], j)
                    entry = code.less(code.load(matrix, place), code.mul(mirror[k], other_moved))
                    code.store(code.less(entry, code.mul(moved_rows[k], other)), matrix, place)

    def _row_starts(self, row: Value) -> list[Value]:
        """The places at which the rows of a block begin in a matrix."""
        code = self._code
        return [code.index("mul", code.index("add", row, k), self._pencil.stride) for k in range(BLOCK)]

    def _factor(self, size: int) -> None:
        """Factor the stiffness, S = L L^T, in its place; NaN where it is not positive definite."""
        code, stride, matrix = self._code, self._pencil.stride, self._stiffness
        unit = code.number(1.0)
        with code.loop(0, size) as rows:
            start = code.index("mul", rows.index, stride)
            with code.loop(0, code.index("add", rows.index, 1)) as columns:
                other = code.index("mul", columns.index, stride)
                place = code.index("add", start, columns.index)
                with code.loop(0, columns.index, [code.load(matrix, place)]) as loop:
                    left = code.load(matrix, code.index("add", start, loop.index))
                    right = code.load(matrix, code.index("add", other, loop.index))
                    loop.after = [code.less(loop.values[0], code.mul(left, right))]
                code.store(loop.values[0], self._image, 0)
                inverse = code.load(self._inverses, columns.index)
                code.store(code.mul(loop.values[0], inverse), matrix, place)
            pivot = code.load(self._image, 0)
            code.store(code.div(unit, code.call("sqrt", pivot)), self._inverses, rows.index)

    def _divide(self, size: int) -> None:
        """Replace the mass M by L^-1 M L^-T."""
        code, stride = self._code, self._pencil.stride
        # Above the diagonal, entries are those below it.
        with code.loop(0, size) as rows, code.loop(rows.index, size) as columns:
            lower = code.index("add", code.index("mul", columns.index, stride), rows.index)
            upper = code.index("add", code.index("mul", rows.index, stride), columns.index)
            code.store(code.load(self._mass, lower), self._mass, upper)
        with code.loop(0, size) as rows:
            start = code.index("mul", rows.index, stride)
            inverse = code.load(self._inverses, rows.index)
            with code.loop(0, stride, step=BLOCK) as columns:
                places = [code.index("add", columns.index, k) for k in range(BLOCK)]
                entries = [code.load(self._mass, code.index("add", start, place)) for place in places]
                with code.loop(0, rows.index, entries) as loop:
                    factor = code.load(self._stiffness, code.index("add", start, loop.index))
                    above = code.index("mul", loop.index, stride)
                    solved = [code.load(self._mass, code.index("add", above, place)) for place in places]
                    loop.after = [
                        code.less(value, code.mul(factor, other))
                        for value, other in zip(loop.values, solved, strict=True)
                    ]
                for place, value in zip(places, loop.values, strict=True):
                    code.store(code.mul(value, inverse), self._mass, code.index("add", start, place))
        with code.loop(0, size) as columns:
            start = code.index("mul", columns.index, stride)
            inverse = code.load(self._inverses, columns.index)
            with code.loop(columns.index, size) as rows:
                row = code.index("mul", rows.index, stride)
                place = code.index("add", row, columns.index)
                with code.loop(0, columns.index, [code.load(self._mass, place)]) as loop:
                    factor = code.load(self._stiffness, code.index("add", start, loop.index))
                    before = code.load(self._mass, code.index("add", row, loop.index))
                    loop.after = [code.less(loop.values[0], code.mul(factor, before))]
                entry = code.mul(loop.values[0], inverse)
                code.store(entry, self._mass, place)
                code.store(entry, self._mass, code.index("add", start, rows.index))

    def _tridiagonal(self, size: int) -> None:
        """Bring the mass to tridiagonal form, from the last row: its diagonal, and the squares of what is beside it."""
        code, stride = self._code, self._pencil.stride
        code.store(self._zero, self._squares, 0)
        with code.loop(1, size) as loop:
            left = code.index("sub", size, loop.index)  # coordinates before the row
            start = code.index("mul", left, stride)
            code.store(code.load(self._mass, code.index("add", start, left)), self._diagonal, left)
            scale, square = self._mirror_of(self._mass, left, start)
            code.store(square, self._squares, left)
            self._reflect(self._mass, left, scale)
        code.store(code.load(self._mass, 0), self._diagonal, 0)

    def _enclose(self, size: int) -> None:
        """Enclose the largest eigenvalues by halving an interval for each."""
        code, zero, unit = self._code, self._zero, self._code.number(1.0)
        with code.loop(0, size, [zero, zero]) as loop:
            largest, widest = loop.values
            entry, square = code.load(self._diagonal, loop.index), code.load(self._squares, loop.index)
            loop.after = [
                code.where(code.below(largest, entry), entry, largest),
                code.where(code.below(widest, square), square, widest),
            ]
        double = code.mul(code.number(2.0), code.call("sqrt", loop.values[1]))
        bound = code.mul(code.number(APART), code.add(loop.values[0], double))
        sound = code.below(zero, bound)
        share = code.where(sound, code.div(unit, code.where(sound, bound, unit)), zero)
        with code.loop(0, size) as loop:
            code.store(code.mul(share, code.load(self._diagonal, loop.index)), self._diagonal, loop.index)
            squared = code.mul(share, code.mul(share, code.load(self._squares, loop.index)))
            code.store(squared, self._squares, loop.index)
        shown = min(self._pencil.count, size)
        ends = [zero] * shown + [unit] * shown
        with code.loop(0, HALVINGS, ends) as halving:
            low, high = halving.values[:shown], halving.values[shown:]
            half = code.number(0.5)
            middles = [code.mul(half, code.add(a, b)) for a, b in zip(low, high, strict=True)]
            above = self._counts_above(middles, size)
            beyond = [code.below(code.number(k + 0.5), count) for k, count in enumerate(above)]
            pairs = zip(beyond, middles, low, strict=True)
            raised = [code.where(more, middle, a) for more, middle, a in pairs]
            pairs = zip(beyond, middles, high, strict=True)
            halving.after = [*raised, *(code.where(more, b, middle) for more, middle, b in pairs)]
        # Numbers that are not finite compare as false everywhere; their sum brings them back.
        lost = code.mul(zero, code.load(self._diagonal, 0))
        for k in range(self._pencil.count):
            value = code.mul(bound, halving.values[k]) if k < shown else zero
            code.give(code.add(value, lost), k)

    def _counts_above(self, middles: Sequence[Value], size: int) -> list[Value]:
        """Count the eigenvalues above some numbers, by the signs in Sturm sequences."""
        code, zero, unit = self._code, self._zero, self._code.number(1.0)
        whole, rest = divmod(size, RESCALED_AFTER)
        start = [value for _ in middles for value in (unit, zero, zero)]
        with code.loop(0, whole * RESCALED_AFTER, start, RESCALED_AFTER) as loop:
            loop.after = self._sequences(middles, loop.values, loop.index, RESCALED_AFTER)
        return self._sequences(middles, loop.values, str(whole * RESCALED_AFTER), rest)[2::3]

    def _sequences(self, middles: Sequence[Value], values: Sequence[Value], first: Value, rows: int) -> list[Value]:
        """Continue Sturm sequences p' = (d - x) p - e^2 p'' by some rows.

        Args:
            middles: the number x of each sequence.
            values: p, p'' and the number of neighbours of equal sign, of each sequence.
            first: the first row.
            rows: how many.

        Returns:
            The same behind these rows.
        """
        code, result = self._code, list(values)
        signs = [code.sign_after(code.bits(0), values[3 * k]) for k in range(len(middles))]
        for row in range(rows):
            place = code.index("add", first, row)
            entry, square = code.load(self._diagonal, place), code.load(self._squares, place)
            for k, middle in enumerate(middles):
                now, before = result[3 * k : 3 * k + 2]
                across = code.mul(square, before)
                following = code.less(code.mul(code.less(entry, middle), now), across)
                signs[k] = code.sign_after(signs[k], following)
                result[3 * k : 3 * k + 2] = following, now
        for k, sign in enumerate(signs):
            now, before, count = result[3 * k : 3 * k + 3]
            equal = code.less(code.number(float(rows)), code.changes(sign, rows))
            size = code.add(code.call("fabs", now), code.call("fabs", before))
            scale = code.where(code.below(size, code.number(SMALL)), code.number(1.0 / SMALL), code.number(1.0))
            result[3 * k : 3 * k + 3] = code.mul(now, scale), code.mul(before, scale), code.add(count, equal)
        return result

"""Machine code for the largest eigenvalues of symmetric matrices at many points: loops over rows, in all lanes at once.

A program of straight code would have a hundred thousand operations here. The matrices are those over the deflections of
springs (`vibration.springwise`): mirrors bring them to tridiagonal form, those along conditions first, so that what is
excluded leaves the matrix; then `sturm` encloses the eigenvalues. No branch depends on a number.

Source: Golub and Van Loan, Matrix Computations, sections 5.1 and 8.3.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

from kinetostat.engine.loops import LoopCode, Value
from kinetostat.engine.machine_code import Program, compile_source, unpack
from kinetostat.engine.program_files import read_program, write_program
from kinetostat.engine.sturm import enclose
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.vibration.springwise import SpringSizes

if TYPE_CHECKING:
    from kinetostat.engine import native
else:  # as in `loops`
    native = LateModule("kinetostat.engine.native")

Pairs: TypeAlias = list[tuple[Value, Value]]
BLOCK = 4
"""Rows of a matrix that a loop goes through together, so that what they share is loaded once."""


@dataclass(frozen=True)
class Pencil:
    """The matrices of which eigenvalues are sought, and how many of them.

    Columns of the program are, row by row, T, H [ways x springs], A [conditions x springs] and the upper triangles of
    D, one for each leg, of the matrix T^T H + H^T T + D where A y = 0. F and E follow, those of another matrix
    1 + T^T F + F^T T + E.

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
        return rows * sizes.springs + 2 * BLOCK + 2 * self.stride**2 + 7 * (self.stride + BLOCK)


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
        self._before = lists + 6 * long
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
        enclose(self._code, self._diagonal, self._squares, size, self._pencil.count)

    def _write_matrices(self) -> list[int]:
        """Put the matrices together from the columns; gives where they begin."""
        ways, springs, conditions = self._sizes.ways, self._sizes.springs, self._sizes.conditions
        over_ways, triangles = ways * springs, sum(leg * (leg + 1) // 2 for leg in self._sizes.legs)
        self._copy(0, 2 * over_ways, self._twists)
        self._copy(2 * over_ways, conditions * springs, self._conditions)
        first = 2 * over_ways + conditions * springs
        self._write_legs(self._mass, first, 0.0)
        self._add_mixed(self._mass, self._mixed_mass)
        if not self._pencil.loaded:
            return [self._mass]
        self._copy(first + triangles, over_ways, self._mixed_stiffness)
        self._write_legs(self._stiffness, first + triangles + over_ways, 1.0)
        self._add_mixed(self._stiffness, self._mixed_stiffness)
        return [self._mass, self._stiffness]

    def _copy(self, first: int, count: int, start: int) -> None:
        """Copy columns into the workspace."""
        code = self._code
        with code.loop(0, count) as loop:
            code.store(code.column(code.index("add", loop.index, first)), start, loop.index)

    def _write_legs(self, matrix: int, column: int, diagonal: float) -> None:
        """Write a matrix that couples no springs of different legs, with a number on its diagonal.

        Args:
            matrix: where it begins in the workspace.
            column: the first column of the upper triangles of its legs.
            diagonal: added to its diagonal.
        """
        code, sizes, stride = self._code, self._sizes, self._pencil.stride
        with code.loop(0, stride, step=BLOCK) as rows:
            starts = self._row_starts(rows.index)
            with code.loop(0, code.index("add", rows.index, BLOCK)) as columns:
                for start in starts:
                    code.store(self._zero, matrix, code.index("add", start, columns.index))
        for place in range(sizes.springs if diagonal else 0):
            code.store(code.number(diagonal), matrix + place * (stride + 1), 0)
        first = sizes.springs - sum(sizes.legs)
        for leg in sizes.legs:
            corner = matrix + first * (stride + 1)
            with code.loop(0, leg) as rows:
                i = rows.index
                # The i rows before row i have (2 leg - i + 1) / 2 entries each in the mean, and row i begins at its
                # diagonal: entry j of it stands j - i further.
                before = code.index("sdiv", code.index("mul", i, code.index("sub", 2 * leg - 1, i)), 2)
                start = code.index("add", before, column)
                with code.loop(i, leg) as columns:
                    j, places = columns.index, [code.index("mul", index, stride) for index in (i, columns.index)]
                    entry = code.column(code.index("add", start, j))
                    entry = code.add(entry, code.load(corner, code.index("add", places[1], i)))
                    code.store(entry, corner, code.index("add", places[0], j))
                    code.store(entry, corner, code.index("add", places[1], i))
            first, column = first + leg, column + leg * (leg + 1) // 2

    def _add_mixed(self, matrix: int, mixed: int) -> None:
        """Add T^T X + X^T T of the mixed part X to a matrix.

        Whatever fills up the last block is finite, and mirrors are zero there.
        """
        code, springs, block = self._code, self._sizes.springs, range(BLOCK)

        def add(start: Value, j: Value, here: Pairs, there: Pairs) -> None:
            place = code.index("add", start, j)
            entry = code.load(matrix, place)
            for (twist, other), (twist_there, other_there) in zip(here, there, strict=True):
                entry = code.add(entry, code.mul(twist, other_there))
                entry = code.add(entry, code.mul(other, twist_there))
            code.store(entry, matrix, place)

        with code.loop(0, springs, step=BLOCK) as rows:
            places, starts = [code.index("add", rows.index, k) for k in block], self._row_starts(rows.index)
            here = [self._twist_and_mixed(mixed, place) for place in places]
            with code.loop(0, rows.index) as before:
                there = self._twist_and_mixed(mixed, before.index)
                for k in block:
                    add(starts[k], before.index, here[k], there)
            for i in block:
                for j in block:
                    add(starts[i], places[j], here[i], here[j])

    def _twist_and_mixed(self, mixed: int, place: Value) -> Pairs:
        """The entries of T and of X at a spring, in each way."""
        code, springs = self._code, self._sizes.springs
        starts = [springs * way for way in range(self._sizes.ways)]
        return [(code.load(self._twists + start, place), code.load(mixed + start, place)) for start in starts]

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
                code.store(code.sub(code.load(start, loop.index), moved), start, loop.index)
        for matrix in matrices:
            self._reflect(matrix, str(size), scale)

    def _mirror_of(self, start: int, size: Value | int, first: Value | int = 0) -> tuple[Value, Value]:
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
        negative = code.is_less(entry, self._zero)
        signed = code.where(negative, code.sub(self._zero, length), length)
        code.store(code.add(entry, signed), self._mirror, last)
        for beyond in range(BLOCK):
            code.store(self._zero, self._mirror, code.index("add", size, beyond))
        half = code.add(square, code.mul(signed, entry))
        positive = code.is_less(self._zero, half)
        unit = code.number(1.0)
        return code.where(positive, code.div(unit, code.where(positive, half, unit)), self._zero), square

    def _reflect(self, matrix: int, size: Value, scale: Value) -> None:
        """Turn the first rows of a symmetric matrix by the mirror from both sides."""
        self._go_through(matrix, size, turned=False)
        self._move(size, scale)
        self._go_through(matrix, size, imaged=False)

    def _go_through(self, matrix: int, size: Value, turned: bool = True, imaged: bool = True) -> None:
        """Turn the first rows of a symmetric matrix by the mirror before, and find the image A u in the next one.

        The lower triangle is kept, and whole blocks on the diagonal. Beyond the size, mirrors are zero.

        Args:
            matrix: where it begins in the workspace.
            size: number of rows.
            turned: whether there is a mirror u before: A - u w^T - w u^T.
            imaged: whether there is a mirror next.
        """
        code, block = self._code, range(BLOCK)
        filled = code.index("mul", code.index("sdiv", code.index("add", size, BLOCK - 1), BLOCK), BLOCK)

        def entry_at(row: int, column: Value, there: list[Value]) -> Value:
            place = code.index("add", starts[row], column)
            entry = code.load(matrix, place)
            if turned:
                entry = code.sub(entry, code.mul(here[row][1], there[2]))
                entry = code.sub(entry, code.mul(here[row][2], there[1]))
                code.store(entry, matrix, place)
            return entry

        def of_mirrors(place: Value) -> list[Value]:
            lists = (self._mirror, *((self._before, self._moved) if turned else ()))
            return [code.load(start, place) for start in lists]

        with code.loop(0, filled, step=BLOCK) as rows:
            starts, places = self._row_starts(rows.index), [code.index("add", rows.index, k) for k in block]
            here = [of_mirrors(place) for place in places]
            with code.loop(0, rows.index, [self._zero] * BLOCK) as columns:
                j, there = columns.index, of_mirrors(columns.index)
                image, sums = code.load(self._image, j), []
                for k in block:
                    entry = entry_at(k, j, there)
                    if imaged:
                        image = code.add(image, code.mul(entry, here[k][0]))
                        sums.append(code.add(columns.values[k], code.mul(entry, there[0])))
                if imaged:
                    code.store(image, self._image, j)
                    columns.after = sums
            for k in block:
                result = columns.values[k]
                for column in block:
                    entry = entry_at(k, places[column], here[column])
                    result = code.add(result, code.mul(entry, here[column][0]))
                if imaged:
                    code.store(result, self._image, places[k])

    def _move(self, size: Value, scale: Value) -> None:
        """Find what a mirror moves, w = s A u - s^2 (u^T A u) u / 2, and leave the mirror behind."""
        code = self._code
        with code.loop(0, size, [self._zero]) as loop:
            product = code.mul(code.load(self._mirror, loop.index), code.load(self._image, loop.index))
            loop.after = [code.add(loop.values[0], product)]
        back = code.mul(code.mul(code.number(0.5), code.mul(scale, scale)), loop.values[0])
        with code.loop(0, size) as loop:
            mirror = code.load(self._mirror, loop.index)
            moved = code.sub(code.mul(scale, code.load(self._image, loop.index)), code.mul(back, mirror))
            code.store(moved, self._moved, loop.index)
            code.store(mirror, self._before, loop.index)
        for beyond in range(BLOCK):
            for start in (self._moved, self._before):
                code.store(self._zero, start, code.index("add", size, beyond))

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
                    loop.after = [code.sub(loop.values[0], code.mul(left, right))]
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
                        code.sub(value, code.mul(factor, other))
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
                    loop.after = [code.sub(loop.values[0], code.mul(factor, before))]
                entry = code.mul(loop.values[0], inverse)
                code.store(entry, self._mass, place)
                code.store(entry, self._mass, code.index("add", start, rows.index))

    def _tridiagonal(self, size: int) -> None:
        """Bring the mass to tridiagonal form, from the last row: its diagonal, and the squares of what is beside it.

        Each row is turned by the mirror before it in advance of the others, so that they can be gone through once.
        """
        code, stride = self._code, self._pencil.stride
        with code.loop(0, size + BLOCK) as loop:
            code.store(self._zero, self._before, loop.index)
            code.store(self._zero, self._moved, loop.index)
        code.store(self._zero, self._squares, 0)
        with code.loop(0, size - 1) as loop:
            left = code.index("sub", size - 1, loop.index)  # coordinates before the row
            start = code.index("mul", left, stride)
            before, moved = code.load(self._before, left), code.load(self._moved, left)
            with code.loop(0, code.index("add", left, 1)) as columns:
                place = code.index("add", start, columns.index)
                entry = code.sub(code.load(self._mass, place), code.mul(before, code.load(self._moved, columns.index)))
                entry = code.sub(entry, code.mul(moved, code.load(self._before, columns.index)))
                code.store(entry, self._mass, place)
            code.store(code.load(self._mass, code.index("add", start, left)), self._diagonal, left)
            scale, square = self._mirror_of(self._mass, left, start)
            code.store(square, self._squares, left)
            self._go_through(self._mass, left)
            self._move(left, scale)
        # Of the first row, the entry alone is left, and its mirror has been turned with it.
        twice = code.mul(code.number(2.0), code.mul(code.load(self._before, 0), code.load(self._moved, 0)))
        code.store(code.sub(code.load(self._mass, 0), twice), self._diagonal, 0)

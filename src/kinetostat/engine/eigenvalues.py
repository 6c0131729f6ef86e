"""Machine code for the largest eigenvalues of symmetric matrices at many points: loops over rows, in all lanes at once.

A program of straight code would have a hundred thousand operations here. The matrices are those over the deflections of
springs (`vibration.springwise`). Reflections bring them to tridiagonal form: those along conditions first, so that what
is excluded leaves the matrix; then `sturm` encloses the eigenvalues. No branch depends on a number.

Source: Golub and Van Loan, Matrix Computations, sections 5.1 and 8.3; names of vectors are those of their section 8.3.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple, TypeAlias

from kinetostat.engine.llvm_source import LoopCode, Value
from kinetostat.engine.sturm import Tridiagonal, enclose
from kinetostat.frozen import dataclass
from kinetostat.vibration.springwise import SpringSizes

BLOCK = 4
"""Rows of a matrix that a loop goes through together, so that what they share is loaded once: an update takes three
vectors for each row and three for the column, which the 16 registers of AVX2 hold for four rows. Matrices of 12 to 40
springs take up to a tenth less time with two rows, and a fifth more with eight."""


@dataclass(frozen=True)
class Pencil:
    """The matrices of which eigenvalues are sought, and how many of them.

    Columns of the program are, row by row, T, H [ways x springs], A [conditions x springs] and the upper triangles of
    D, one for each leg, of the matrix T^T H + H^T T + D where A y = 0. F and E follow, those of another matrix
    1 + T^T F + F^T T + E.

    Attributes:
        sizes: sizes of the matrices.
        count: number of eigenvalues, the largest first; those that there are not are zero.
        loaded: whether eigenvalues are relative to the other matrix.
    """

    sizes: SpringSizes
    count: int
    loaded: bool

    @cached_property
    def layout(self) -> "WorkspaceLayout":
        """Layout of the workspace that the program is given in the place of fixed inputs."""
        return WorkspaceLayout(self.sizes)


class WorkspaceLayout:
    """Places of matrices and lists in the workspace of a program: where each begins, counted in vectors.

    Attributes:
        twists: T.
        mixed_mass, mixed_stiffness: H and F.
        conditions: A.
        mass, stiffness: both matrices.
        stride: entries from a row of them to the next; whole blocks.
        mirror: v, the vector of the reflection 1 - beta v v^T that comes next.
        image: A v.
        last_mirror, update: v and w of the update A - v w^T - w v^T by the last reflection.
        tridiagonal: the result of the reduction.
        inverse_pivots: reciprocals of the diagonal of the Cholesky factor.
        size: number of all vectors.
    """

    def __init__(self, sizes: SpringSizes) -> None:
        self.size, self.stride = 0, -(-sizes.springs // BLOCK) * BLOCK
        over_ways, longest = sizes.ways * sizes.springs, self.stride + BLOCK
        # The program has T and H in adjacent columns, which are copied at once: H must follow T here too.
        self.twists, self.mixed_mass, self.mixed_stiffness = (self._take(over_ways) for _ in range(3))
        self._take(BLOCK)  # read beyond the last row where a block is not full, and zero
        self.conditions = self._take(sizes.conditions * sizes.springs)
        self._take(BLOCK)
        self.mass, self.stiffness = (self._take(self.stride**2) for _ in range(2))
        self.mirror, self.image, self.update, diagonal, squares, self.inverse_pivots, self.last_mirror = (
            self._take(longest) for _ in range(7)
        )
        self.tridiagonal = Tridiagonal(diagonal, squares, sizes.springs - sizes.conditions)

    def _take(self, count: int) -> int:
        start, self.size = self.size, self.size + count
        return start


def pencil_source(pencil: Pencil, lanes: int) -> str:
    """Write the program of a pencil as LLVM assembly; lanes are the points of a vector."""
    code = LoopCode(lanes)
    _PencilCode(pencil, code).write()
    return code.source()


Pairs: TypeAlias = list[tuple[Value, Value]]
"""Entries of T and of a mixed part at a spring, in each way."""


class Mirrors(NamedTuple):
    """Entries at one place of the vectors of two reflections: `WorkspaceLayout` says what they are."""

    mirror: Value
    last_mirror: Value
    update: Value


class _PencilCode:
    """Writes the program of a pencil."""

    def __init__(self, pencil: Pencil, code: LoopCode) -> None:
        self._pencil, self._sizes = pencil, pencil.sizes
        self._at, self._stride = pencil.layout, pencil.layout.stride
        self._code, self._zero = code, code.number(0.0)

    def write(self) -> None:
        """Write the whole program."""
        matrices = self._assemble()
        for number in range(self._sizes.conditions):
            self._eliminate_condition(number, matrices)
        if self._pencil.loaded:
            self._factor()
            self._copy_to_upper()
            self._divide_from_left()
            self._divide_from_right()
        self._make_tridiagonal()
        enclose(self._code, self._at.tridiagonal, self._pencil.count)

    def _assemble(self) -> list[int]:
        """Put the matrices together from the columns, and return where they begin."""
        at, sizes = self._at, self._sizes
        over_ways, triangles = sizes.ways * sizes.springs, sum(leg * (leg + 1) // 2 for leg in sizes.legs)
        first_triangle = 2 * over_ways + sizes.conditions * sizes.springs
        self._copy_columns(0, 2 * over_ways, at.twists)
        self._copy_columns(2 * over_ways, sizes.conditions * sizes.springs, at.conditions)
        self._write_legs(at.mass, first_triangle, 0.0)
        self._add_mixed(at.mass, at.mixed_mass)
        if not self._pencil.loaded:
            return [at.mass]
        first_mixed = first_triangle + triangles
        self._copy_columns(first_mixed, over_ways, at.mixed_stiffness)
        self._write_legs(at.stiffness, first_mixed + over_ways, 1.0)
        self._add_mixed(at.stiffness, at.mixed_stiffness)
        return [at.mass, at.stiffness]

    def _copy_columns(self, first: int, count: int, start: int) -> None:
        """Copy columns into the workspace."""
        code = self._code
        with code.loop(0, count) as loop:
            code.store(code.load_column(code.index("add", loop.index, first)), start, loop.index)

    def _write_legs(self, matrix: int, column: int, diagonal: float) -> None:
        """Write a matrix that couples no springs of different legs, with a number on its diagonal.

        Args:
            matrix: the place at which it begins in the workspace.
            column: the first column of the upper triangles of its legs.
            diagonal: what is added to its diagonal.
        """
        code, sizes, stride = self._code, self._sizes, self._stride
        self._clear_lower(matrix)
        for place in range(sizes.springs if diagonal else 0):
            code.store(code.number(diagonal), matrix + place * (stride + 1), 0)
        first = sizes.springs - sum(sizes.legs)
        for leg in sizes.legs:
            corner = matrix + first * (stride + 1)
            with code.loop(0, leg) as rows:
                i = rows.index
                # The rows before row i of a packed upper triangle hold i (2 leg - i + 1) / 2 entries; entry (i, j)
                # follows j - i after them.
                before = code.index("sdiv", code.index("mul", i, code.index("sub", 2 * leg - 1, i)), 2)
                start = code.index("add", before, column)
                with code.loop(i, leg) as columns:
                    j, (row, other_row) = columns.index, (code.index("mul", k, stride) for k in (i, columns.index))
                    # Only the diagonal holds something already.
                    entry = code.add(code.load_column(code.index("add", start, j)), code.load(corner, other_row, i))
                    code.store(entry, corner, row, j)
                    code.store(entry, corner, other_row, i)
            first, column = first + leg, column + leg * (leg + 1) // 2

    def _clear_lower(self, matrix: int) -> None:
        """Fill the lower triangle of a matrix, and whole blocks on its diagonal, with zeros."""
        code = self._code
        with code.loop(0, self._stride, step=BLOCK) as rows:
            starts = self._row_starts(rows.index)
            with code.loop(0, code.index("add", rows.index, BLOCK)) as columns:
                for start in starts:
                    code.store(self._zero, matrix, start, columns.index)

    def _add_mixed(self, matrix: int, mixed: int) -> None:
        """Add T^T X + X^T T of the mixed part X to a matrix.

        Whatever fills up the last block is finite, and mirrors are zero there.
        """
        code, block = self._code, range(BLOCK)

        def add(start: Value, column: Value, at_row: Pairs, at_column: Pairs) -> None:
            place = code.index("add", start, column)
            entry = code.load(matrix, place)
            for (row_twist, row_mixed), (column_twist, column_mixed) in zip(at_row, at_column, strict=True):
                entry = code.add(entry, code.mul(row_twist, column_mixed))
                entry = code.add(entry, code.mul(row_mixed, column_twist))
            code.store(entry, matrix, place)

        with code.loop(0, self._sizes.springs, step=BLOCK) as rows:
            places, starts = self._places_of_block(rows.index), self._row_starts(rows.index)
            at_rows = [self._twist_and_mixed(mixed, place) for place in places]
            with code.loop(0, rows.index) as columns:
                at_column = self._twist_and_mixed(mixed, columns.index)
                for k in block:
                    add(starts[k], columns.index, at_rows[k], at_column)
            for i in block:
                for j in block:
                    add(starts[i], places[j], at_rows[i], at_rows[j])

    def _twist_and_mixed(self, mixed: int, spring: Value) -> Pairs:
        """The entries of T and of X at a spring, in each way."""
        starts = [self._sizes.springs * way for way in range(self._sizes.ways)]
        load = self._code.load
        return [(load(self._at.twists + start, spring), load(mixed + start, spring)) for start in starts]

    def _places_of_block(self, first: Value) -> list[Value]:
        return [self._code.index("add", first, k) for k in range(BLOCK)]

    def _row_starts(self, first: Value) -> list[Value]:
        """The places at which the rows of a block begin in a matrix."""
        return [self._code.index("mul", place, self._stride) for place in self._places_of_block(first)]

    def _eliminate_condition(self, number: int, matrices: Sequence[int]) -> None:
        """Reflect a condition onto the last coordinate that is left, which is thereby zero."""
        code, springs, mirror = self._code, self._sizes.springs, self._at.mirror
        size = springs - number
        beta, _ = self._reflection_of(self._at.conditions + number * springs, size)
        for other in range(number + 1, self._sizes.conditions):
            row = self._at.conditions + other * springs
            factor = code.mul(beta, self._product(row, mirror, size))
            with code.loop(0, size) as loop:
                change = code.mul(factor, code.load(mirror, loop.index))
                code.store(code.sub(code.load(row, loop.index), change), row, loop.index)
        for matrix in matrices:
            self._pass_through(matrix, str(size), update=False)
            self._prepare_update(str(size), beta)
            self._pass_through(matrix, str(size), multiply=False)

    def _product(self, left: int, right: int, size: Value | int) -> Value:
        """The product of two lists, given by where they begin."""
        code = self._code
        with code.loop(0, size, [self._zero]) as loop:
            product = code.mul(code.load(left, loop.index), code.load(right, loop.index))
            loop.after = [code.add(loop.values[0], product)]
        return loop.values[0]

    def _reflection_of(self, start: int, size: Value | int, first: Value | int = 0) -> tuple[Value, Value]:
        """Find the reflection 1 - beta v v^T that turns a row onto its last coordinate, and write its mirror v.

        Args:
            start: the place at which the row begins in the workspace.
            size: number of its entries.
            first: what is added to the start.

        Returns:
            beta, and the square of the row's length.
        """
        code, mirror, unit = self._code, self._at.mirror, self._code.number(1.0)
        with code.loop(0, size, [self._zero]) as loop:
            entry = code.load(start, loop.index, first)
            code.store(entry, mirror, loop.index)
            loop.after = [code.add(loop.values[0], code.mul(entry, entry))]
        square, last = loop.values[0], code.index("sub", size, 1)
        entry, length = code.load(mirror, last), code.call("sqrt", square)
        # With the sign of the last entry, so that their sum does not cancel.
        signed_length = code.where(code.is_less(entry, self._zero), code.sub(self._zero, length), length)
        code.store(code.add(entry, signed_length), mirror, last)
        self._clear_beyond(mirror, size)
        half_square = code.add(square, code.mul(signed_length, entry))
        positive = code.is_less(self._zero, half_square)
        beta = code.where(positive, code.div(unit, code.where(positive, half_square, unit)), self._zero)
        return beta, square

    def _clear_beyond(self, start: int, size: Value | int) -> None:
        """Write zeros beyond the end of a list, where a block reads them."""
        for beyond in range(BLOCK):
            self._code.store(self._zero, start, size, beyond)

    def _pass_through(self, matrix: int, size: Value, update: bool = True, multiply: bool = True) -> None:
        """Pass once through the first rows of a symmetric matrix A: update it, and multiply what comes of it.

        The lower triangle is kept, and whole blocks on the diagonal. Beyond the size, mirrors are zero.

        Args:
            matrix: the place at which it begins in the workspace.
            size: number of rows.
            update: whether to subtract v w^T + w v^T of the last reflection.
            multiply: whether to write the image A v of the next mirror.
        """
        code, block, image = self._code, range(BLOCK), self._at.image
        filled = code.index("mul", code.index("sdiv", code.index("add", size, BLOCK - 1), BLOCK), BLOCK)

        def entry_at(start: Value, column: Value, at_row: Mirrors, at_column: Mirrors) -> Value:
            place = code.index("add", start, column)
            entry = code.load(matrix, place)
            if update:
                entry = code.sub(entry, code.mul(at_row.last_mirror, at_column.update))
                entry = code.sub(entry, code.mul(at_row.update, at_column.last_mirror))
                code.store(entry, matrix, place)
            return entry

        with code.loop(0, filled, step=BLOCK) as rows:
            starts, places = self._row_starts(rows.index), self._places_of_block(rows.index)
            at_rows = [self._mirrors_at(place) for place in places]
            with code.loop(0, rows.index, [self._zero] * BLOCK) as columns:
                column, at_column, sums = columns.index, self._mirrors_at(columns.index), []
                column_image = code.load(image, column)  # an earlier block of rows has written it
                for k in block:
                    entry = entry_at(starts[k], column, at_rows[k], at_column)
                    # By symmetry, the entry stands in the column of its row as well.
                    column_image = code.add(column_image, code.mul(entry, at_rows[k].mirror))
                    sums.append(code.add(columns.values[k], code.mul(entry, at_column.mirror)))
                if multiply:
                    code.store(column_image, image, column)
                    columns.after = sums
            for i in block:
                row_image = columns.values[i]
                for j in block:
                    entry = entry_at(starts[i], places[j], at_rows[i], at_rows[j])
                    row_image = code.add(row_image, code.mul(entry, at_rows[j].mirror))
                if multiply:
                    code.store(row_image, image, places[i])

    def _mirrors_at(self, place: Value) -> Mirrors:
        starts = self._at.mirror, self._at.last_mirror, self._at.update
        return Mirrors(*(self._code.load(start, place) for start in starts))

    def _prepare_update(self, size: Value, beta: Value) -> None:
        """Find the update w = beta A v - beta^2 (v^T A v) v / 2 of a reflection, which then is the last one."""
        code, at = self._code, self._at
        half = code.mul(code.number(0.5), code.mul(beta, beta))
        share = code.mul(half, self._product(at.mirror, at.image, size))
        with code.loop(0, size) as loop:
            mirror = code.load(at.mirror, loop.index)
            update = code.sub(code.mul(beta, code.load(at.image, loop.index)), code.mul(share, mirror))
            code.store(update, at.update, loop.index)
            code.store(mirror, at.last_mirror, loop.index)
        self._clear_beyond(at.update, size)
        self._clear_beyond(at.last_mirror, size)

    def _factor(self) -> None:
        """Factor the stiffness, S = L L^T, in its place; NaN where it is not positive definite.

        The diagonal of L is left out: its reciprocals, by which others multiply, have a list of their own.
        """
        code, matrix, inverse_pivots = self._code, self._at.stiffness, self._at.inverse_pivots
        with code.loop(0, self._at.tridiagonal.size) as rows:
            row = code.index("mul", rows.index, self._stride)
            with code.loop(0, rows.index) as columns:
                other_row = code.index("mul", columns.index, self._stride)
                place = code.index("add", row, columns.index)
                entry = self._less_products(code.load(matrix, place), (matrix, row), (matrix, other_row), columns.index)
                code.store(code.mul(entry, code.load(inverse_pivots, columns.index)), matrix, place)
            pivot = code.load(matrix, row, rows.index)
            pivot = self._less_products(pivot, (matrix, row), (matrix, row), rows.index)
            code.store(code.div(code.number(1.0), code.call("sqrt", pivot)), inverse_pivots, rows.index)

    def _less_products(self, entry: Value, left: tuple[int, Value], right: tuple[int, Value], count: Value) -> Value:
        """Subtract from an entry the products of the first entries of two rows: matrices, and where the rows begin."""
        code = self._code
        with code.loop(0, count, [entry]) as loop:
            product = code.mul(code.load(*left, loop.index), code.load(*right, loop.index))
            loop.after = [code.sub(loop.values[0], product)]
        return loop.values[0]

    def _copy_to_upper(self) -> None:
        """Fill the upper triangle of the mass with the lower one."""
        code, mass, size = self._code, self._at.mass, self._at.tridiagonal.size
        with code.loop(0, size) as rows, code.loop(rows.index, size) as columns:
            lower = code.load(mass, code.index("mul", columns.index, self._stride), rows.index)
            code.store(lower, mass, code.index("mul", rows.index, self._stride), columns.index)

    def _divide_from_left(self) -> None:
        """Replace the mass M, all of it, by L^-1 M: a block of columns at a time."""
        code, mass, stride = self._code, self._at.mass, self._stride
        with code.loop(0, self._at.tridiagonal.size) as rows:
            row = code.index("mul", rows.index, stride)
            inverse_pivot = code.load(self._at.inverse_pivots, rows.index)
            with code.loop(0, stride, step=BLOCK) as columns:
                places = self._places_of_block(columns.index)
                with code.loop(0, rows.index, [code.load(mass, row, place) for place in places]) as loop:
                    factor = code.load(self._at.stiffness, row, loop.index)
                    row_above = code.index("mul", loop.index, stride)
                    solved = [code.load(mass, row_above, place) for place in places]
                    loop.after = [code.sub(a, code.mul(factor, b)) for a, b in zip(loop.values, solved, strict=True)]
                for place, value in zip(places, loop.values, strict=True):
                    code.store(code.mul(value, inverse_pivot), mass, row, place)

    def _divide_from_right(self) -> None:
        """Replace L^-1 M by L^-1 M L^-T, of which the lower triangle is computed."""
        code, mass, size = self._code, self._at.mass, self._at.tridiagonal.size
        with code.loop(0, size) as columns:
            factor_row = code.index("mul", columns.index, self._stride)
            inverse_pivot = code.load(self._at.inverse_pivots, columns.index)
            with code.loop(columns.index, size) as rows:
                row = code.index("mul", rows.index, self._stride)
                factors = self._at.stiffness, factor_row
                entry = self._less_products(code.load(mass, row, columns.index), factors, (mass, row), columns.index)
                entry = code.mul(entry, inverse_pivot)
                code.store(entry, mass, row, columns.index)
                code.store(entry, mass, factor_row, rows.index)

    def _make_tridiagonal(self) -> None:
        """Bring the mass to tridiagonal form, from the last row: its diagonal, and the squares of what is beside it.

        Each row is updated by the last reflection in advance of the others, so that one pass updates these and
        multiplies them by the next mirror.
        """
        code, at, matrix, size = self._code, self._at, self._at.mass, self._at.tridiagonal.size
        with code.loop(0, size + BLOCK) as loop:
            code.store(self._zero, at.last_mirror, loop.index)
            code.store(self._zero, at.update, loop.index)
        code.store(self._zero, at.tridiagonal.squares, 0)
        with code.loop(0, size - 1) as loop:
            last = code.index("sub", size - 1, loop.index)
            row = code.index("mul", last, self._stride)
            last_mirror, update = code.load(at.last_mirror, last), code.load(at.update, last)
            with code.loop(0, code.index("add", last, 1)) as columns:
                entry = code.load(matrix, row, columns.index)
                entry = code.sub(entry, code.mul(last_mirror, code.load(at.update, columns.index)))
                entry = code.sub(entry, code.mul(update, code.load(at.last_mirror, columns.index)))
                code.store(entry, matrix, row, columns.index)
            code.store(code.load(matrix, row, last), at.tridiagonal.diagonal, last)
            beta, square = self._reflection_of(matrix, last, row)
            code.store(square, at.tridiagonal.squares, last)
            self._pass_through(matrix, last)
            self._prepare_update(last, beta)
        # Of the first row, the diagonal alone is left, and is still to be updated by the last reflection.
        twice = code.mul(code.number(2.0), code.mul(code.load(at.last_mirror, 0), code.load(at.update, 0)))
        code.store(code.sub(code.load(matrix, 0), twice), at.tridiagonal.diagonal, 0)

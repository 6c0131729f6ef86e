"""A table that fits any terminal without cutting a number or a name. What stands in its cells is not known here.

Where it is too wide, spaces between columns go first, texts are broken between words next, and at last the columns of
numbers are printed in blocks below each other, each with the names of the rows.
"""

import re
from collections.abc import Iterator, Sequence

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text

_DECIMAL = re.compile(r"([-+−]?[\d,]+)((?:\.\d+)?)")
COLUMN_GAP = 3
"""Characters between two columns, and 1 where room is short."""
EDGE_SPACE = 2
"""Characters left and right of a table."""


class FittedTable(Table):
    """A table of Rich whose columns are as wide as their texts need, within the width of the terminal."""

    def __init__(self, title: str = "") -> None:
        """An empty table with a title."""
        super().__init__(title=title or None, box=box.SIMPLE_HEAD, pad_edge=False)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Print the title, and the table in one block or in as many as its columns need."""
        if self.title:
            yield Text(str(self.title), "bold")
        columns = [_ColumnWidths(column) for column in self.columns]
        gap = COLUMN_GAP if _fits(columns, COLUMN_GAP, options.max_width) else 1
        for block in _blocks(columns, gap, options.max_width):
            yield from self._part(block, gap, options.max_width).__rich_console__(console, options)

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        """Return the widths that the table may have: at most that at which nothing is broken."""
        columns = [_ColumnWidths(column) for column in self.columns]
        whole = sum(column.aligned for column in columns) + COLUMN_GAP * (len(columns) - 1) + EDGE_SPACE
        most = min(max(whole, cell_len(str(self.title or ""))), options.max_width)
        return Measurement(min(most, EDGE_SPACE + max((column.least for column in columns), default=0)), most)

    def _part(self, shown: "Sequence[_ColumnWidths]", gap: int, width: int) -> Table:
        """Return a table of some columns, of fixed widths."""
        space = (gap - 1) // 2
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, space))
        widths = _widths(shown, gap, width)
        for column, size in zip(shown, widths, strict=True):
            head = column.texts[0]
            head.justify = "right" if column.numeric else "default"
            table.add_column(head, width=size, overflow="fold")
        cells = [column.cells(size) for column, size in zip(shown, widths, strict=True)]
        for row, content in zip(self.rows, zip(*cells, strict=True), strict=True):
            table.add_row(*content, style=row.style, end_section=row.end_section)
        return table


class _ColumnWidths:
    """A column with the widths that it may have."""

    def __init__(self, column: Column) -> None:
        self.texts = [
            cell.copy() if isinstance(cell, Text) else Text(str(cell)) for cell in (column.header, *column.cells)
        ]
        self.numeric = column.justify == "right"
        lines = [line for text in self.texts for line in text.plain.split("\n")]
        parts = lines if column.no_wrap else [word for line in lines for word in line.split(" ")]
        self.most = max(map(cell_len, lines), default=0)
        self.least = max(map(cell_len, parts), default=0)
        matches = [_DECIMAL.fullmatch(cell.plain) for cell in self.texts[1:]]
        whole = max((len(match[1]) for match in matches if match), default=0)
        self.decimals = max((len(match[2]) for match in matches if match), default=0)
        self.aligned = max(self.most, whole + self.decimals if self.numeric else 0)

    def cells(self, width: int) -> Iterator[Text]:
        """Return the cells, numbers padded so that their decimal points stand below each other where there is room."""
        for cell in self.texts[1:]:
            match = _DECIMAL.fullmatch(cell.plain) if self.numeric and width >= self.aligned else None
            end = self.decimals - len(match[2]) if match else 0
            if self.numeric:
                cell.pad_left(max(width - end - cell_len(cell.plain), 0))
            yield cell


def _fits(columns: Sequence[_ColumnWidths], gap: int, width: int) -> bool:
    return sum(column.least for column in columns) + gap * (len(columns) - 1) + EDGE_SPACE <= width


def _blocks(columns: Sequence[_ColumnWidths], gap: int, width: int) -> Iterator[list[_ColumnWidths]]:
    """Part the columns of numbers into as few blocks as fit, each with the first column, as even as they can be."""
    first, rest = columns[:1], columns[1:]
    room = width - EDGE_SPACE - sum(column.least for column in first)
    for count in range(1, max(len(rest), 1) + 1):
        size = -(-len(rest) // count)
        blocks = [rest[start : start + size] for start in range(0, len(rest), size)] or [[]]
        if all(sum(column.least + gap for column in block) <= room for block in blocks):
            break
    yield from ([*first, *block] for block in blocks)


def _widths(columns: Sequence[_ColumnWidths], gap: int, width: int) -> list[int]:
    """Return the width of each column: its longest text, less in the widest texts where room is short."""
    room = width - EDGE_SPACE - gap * (len(columns) - 1)
    widths = [column.aligned for column in columns]
    if sum(widths) > room:
        widths = [column.most for column in columns]
    while sum(widths) > room:
        loose = [i for i, column in enumerate(columns) if widths[i] > column.least]
        if not loose:
            widths[0] = max(widths[0] - (sum(widths) - room), 1)  # a name longer than the line is folded, not cut
            break
        widths[max(loose, key=widths.__getitem__)] -= 1
    return widths

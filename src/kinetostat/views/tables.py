"""Tables and answers on a terminal, which fit it without cutting a number or a name. Nothing is computed but rounding.

Where a table is too wide, spaces between columns go first, texts are broken between words next, and at last the columns
of numbers are printed in blocks below each other, each with the names of the rows. An answer is printed by its
description: machine and state, sentences, requirements, tables. Reports and pages take requirements in lines from here.
"""

import math
import os
import re
import sys
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text

from kinetostat.display import ENGINEERING, Display, without_round_off
from kinetostat.machine.loading import kinds_of_machine
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import doubts, parameters, values
from kinetostat.spec.document import Document
from kinetostat.spec.fields import Quantity
from kinetostat.units import KINDS
from kinetostat.views.question import Description

if TYPE_CHECKING:
    from kinetostat.studies.requirements import Verdict

_DECIMAL = re.compile(r"([-+−]?[\d,]+)((?:\.\d+)?)")
"""A number without a power of ten: its sign and whole part, and what follows from the decimal point on."""
COLUMN_GAP = 3
"""Characters between two columns; where room is short, there is one."""
EDGE_SPACE = 2
"""Characters left and right of a table."""
DIGITS_OF_INPUT = 10
"""Digits of what people have written themselves: they find it again as it was."""
PIPED_WIDTH = 100
"""Width of texts, in characters, where there is no terminal: that of a wide one, in which most tables fit."""
UNBOUND_WIDTH = 10_000
"""Width that no table reaches, to measure what a table needs."""
LEAST_HEAD_WIDTH = 11
"""Least width of the words that stand before the sentences, in columns of the terminal: sentences then begin alike."""
HEAD_GAP = 2
"""Width of the gap between these words and the sentences, in columns of the terminal."""


class FittedTable(Table):
    """A table of Rich whose columns are as wide as their texts need, within the width of the terminal."""

    def __init__(self, title: str = "") -> None:
        """Make an empty table with a title."""
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
        greatest = min(max(whole, cell_len(str(self.title or ""))), options.max_width)
        return Measurement(min(greatest, EDGE_SPACE + max((column.least for column in columns), default=0)), greatest)

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
    """A column with the widths that it may have, in characters.

    Attributes:
        texts: the head and the cells.
        numeric: whether it holds numbers.
        aligned: width at which decimal points stand below each other and no text is broken.
        unbroken: width of its longest line.
        least: width of its longest word; of numbers, which are not broken, of the longest one.
        decimals: greatest number of characters from the decimal point on.
    """

    def __init__(self, column: Column) -> None:
        cells = [*column.cells]
        self.texts = [cell.copy() if isinstance(cell, Text) else Text(str(cell)) for cell in (column.header, *cells)]
        for text, shown in zip(self.texts[1:], without_round_off([*map(str, cells)]), strict=True):
            text.plain = shown
        self.numeric = column.justify == "right"
        lines = [line for text in self.texts for line in text.plain.split("\n")]
        words = lines if column.no_wrap else [word for line in lines for word in line.split(" ")]
        self.unbroken = max(map(cell_len, lines), default=0)
        self.least = max(map(cell_len, words), default=0)
        matches = [_DECIMAL.fullmatch(cell.plain) for cell in self.texts[1:]]
        whole = max((len(match[1]) for match in matches if match), default=0)
        self.decimals = max((len(match[2]) for match in matches if match), default=0)
        self.aligned = max(self.unbroken, whole + self.decimals if self.numeric else 0)

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
        size = math.ceil(len(rest) / count)
        blocks = [rest[start : start + size] for start in range(0, len(rest), size)] or [[]]
        if all(sum(column.least + gap for column in block) <= room for block in blocks):
            break
    yield from ([*first, *block] for block in blocks)


def _widths(columns: Sequence[_ColumnWidths], gap: int, width: int) -> list[int]:
    """Return the width of each column: its longest text, less in the widest texts where room is short."""
    room = width - EDGE_SPACE - gap * (len(columns) - 1)
    widths = [column.aligned for column in columns]
    if sum(widths) > room:
        widths = [column.unbroken for column in columns]
    while sum(widths) > room:
        loose = [i for i, column in enumerate(columns) if widths[i] > column.least]
        if not loose:
            widths[0] = max(widths[0] - (sum(widths) - room), 1)  # a name longer than the line is folded, not cut
            break
        widths[max(loose, key=widths.__getitem__)] -= 1
    return widths


def print_machines(console: Console, heads: Mapping[str, Document]) -> None:
    """Print the bundled machines, by what stands at the top of their files, and the families a file can name."""
    table = text_table("Bundled machines", "name", "machine", "family")
    for name, head in heads.items():
        table.add_row(name, head["name"], head["family"])
    console.print(table)
    table = text_table("Families (kinetostat new FAMILY prints a commented file)", "family", "machine")
    for name, summary in kinds_of_machine().items():
        table.add_row(name, summary)
    console.print(table)


def print_studies(console: Console, heads: Mapping[str, Document]) -> None:
    """Print the bundled studies by name."""
    table = text_table("Bundled studies (kinetostat optimize STUDY)", "name", "study", "machine")
    for name, head in heads.items():
        table.add_row(name, head["name"], head["machine"])
    console.print(table)


def print_machine(console: Console, machine: Machine, verdict: str = "") -> None:
    """Print a verdict, every value of a machine with its meaning, and notes on implausible ones."""
    if verdict:
        console.print(verdict, highlight=False)
    console.print(machine_table(machine))
    print_doubts(console, machine)


def print_doubts(console: Console, machine: Machine) -> None:
    """Print a note on each implausible value."""
    for doubt in doubts(machine):
        console.print(f"Note: {doubt}", style="yellow", highlight=False)


def machine_table(machine: Machine) -> Table:
    """Return every value of a machine with its meaning."""
    table = text_table(f"{machine.name} ({machine.family.name})", "field", "value", "meaning")
    numbers = values(machine)
    fields = list(parameters(machine.family))
    entries = {leaf for parameter in fields if parameter.quantity.count for leaf in parameter.leaves}
    whole = [parameter for parameter in fields if parameter.path not in entries]
    for parameter in whole:
        shown = readable([numbers[leaf] for leaf in parameter.leaves], parameter.quantity, machine.display)
        table.add_row(parameter.path, shown, parameter.quantity.meaning)
    if machine.loaded:
        table.add_row("load.state", machine.state, "what is shown where no quantity is named")
    for about, tolerance in machine.tolerances.items():
        table.add_row(f"tolerances.{about}", tolerance.text, "how far manufacture may miss the drawing")
    return table


def readable(values: Sequence[float], quantity: Quantity, display: Display = ENGINEERING) -> str:
    """Return all entries of a field for a table, in up to ten digits, e.g. "3 x 500 mm" where they are equal."""
    texts = [readable_value(value, quantity, display) for value in values]
    alike = f"{len(texts)} x {texts[0]}" if len(texts) > 1 else texts[0]
    return alike if len(set(texts)) == 1 else ", ".join(texts)


def readable_value(value: float, quantity: Quantity, display: Display = ENGINEERING) -> str:
    """Return a value of a machine file as people read it, e.g. "500 mm", "rigid", "none"."""
    if math.isinf(value):
        return quantity.show(value)
    return display.show(value, KINDS[quantity.kind].unit, digits=DIGITS_OF_INPUT)


class PipedConsole(Console):
    """Console for pipes and files: texts wrap at `piped_width()`, tables of numbers take the width they need."""

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as `Console` does, but cut no number and no name."""
        tables = [
            item for item in objects if isinstance(item, Table) and all(column.no_wrap for column in item.columns)
        ]
        unbound = self.options.update(width=UNBOUND_WIDTH)
        page = self.width
        self.width = max([page, *(self.measure(table, options=unbound).maximum for table in tables)])
        super().print(*objects, **options)
        self.width = page


def terminal() -> Console:
    """Return the console of this process: as wide as the terminal, or where there is none, as its tables need it.

    Texts are shown as they are, whatever brackets and colons are in them; what is styled is a `Text`.
    """
    plain: dict[str, Any] = {"markup": False, "emoji": False}
    return Console(**plain) if sys.stdout.isatty() else PipedConsole(width=piped_width(), **plain)


def piped_width() -> int:
    """Return the width of the terminal from which a pipe or a file is written; `PIPED_WIDTH` without a terminal."""
    for stream in (sys.stderr, sys.stdin):
        try:
            return os.get_terminal_size(stream.fileno()).columns or PIPED_WIDTH
        except (AttributeError, OSError, ValueError):  # closed, replaced, or no terminal
            continue
    return PIPED_WIDTH


def print_written(console: Console, paths: Iterable[Path]) -> None:
    """Name the files that were written."""
    for path in paths:
        console.print(f"wrote {path}", highlight=False)


def words_on_omitted(count: int) -> str:
    """Return the words for parameters that a table leaves out."""
    noun, verb = ("parameter", "is") if count == 1 else ("parameters", "are")
    return f"{count} {noun} with less effect {verb} omitted"


def text_table(title: str, *columns: str, numeric: Collection[str] = ()) -> FittedTable:
    """Return a table of texts, which are broken between words where the terminal is narrow.

    Args:
        title: the title of the table.
        columns: the heads of the columns.
        numeric: those of the columns that hold numbers, which are aligned to the right.
    """
    table = FittedTable(title)
    for column in columns:
        table.add_column(column, justify="right" if column in numeric else "left")
    return table


def numeric_table(title: str, first: str, columns: Sequence[str]) -> FittedTable:
    """Return a table whose columns after the first hold numbers."""
    table = FittedTable(title)
    table.add_column(first, no_wrap=True)
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    return table


def headline(verdicts: "Sequence[Verdict]") -> str:
    """Say how many requirements are met."""
    failed = sum(not verdict.met for verdict in verdicts)
    if len(verdicts) == 1:
        return f"The requirement is {'not ' if failed else ''}met."
    if not failed:
        return "All requirements are met."
    return f"{failed} of {len(verdicts)} requirements {'is' if failed == 1 else 'are'} not met."


def requirement_lines(verdicts: "Sequence[Verdict]", display: Display) -> "Iterator[tuple[Verdict, str, str]]":
    """Give each requirement with its verdict in a word and its sentence; those that are not met come first."""
    for verdict in sorted(verdicts, key=lambda verdict: verdict.met):
        yield verdict, "met" if verdict.met else "not met", f"{verdict.name}: {verdict.sentence(display)}"


def print_requirements(console: Console, verdicts: "Sequence[Verdict]", display: Display) -> None:
    """Print the headline and a line for each requirement."""
    console.print(Text(headline(verdicts), "bold" if all(verdict.met for verdict in verdicts) else "bold red"))
    lines = Table.grid(padding=(0, 2, 0, 0))
    for verdict, word, sentence in requirement_lines(verdicts, display):
        lines.add_row(Text(word, "green" if verdict.met else "red"), sentence)
    console.print(lines)


def print_answer(console: Console, description: Description, answer: Any, full: bool = False) -> None:
    """Print an answer: first the machine with its state, then a line for each sentence, notes, and the tables.

    Args:
        console: the console that prints it.
        description: the description of answers of this kind.
        answer: an answer of the kind that is described.
        full: whether tables show every row.
    """
    machine = description.machine_of(answer)
    console.print(Text.assemble((machine.name, "bold"), f"  {description.state(answer)}".rstrip()))
    lines = Table.grid(padding=(0, HEAD_GAP, 0, 0))
    sentences = [*description.sentences(answer)]
    room = console.width - max([LEAST_HEAD_WIDTH, *(len(head) + HEAD_GAP for head, _ in sentences)])
    for head, sentence in sentences:
        # Rich would also break a line between a number and its percent sign, at a space that is not for breaking.
        lines.add_row(Text(head, "bold"), "\n".join(textwrap.wrap(sentence, room)))
    console.print(lines)
    if verdicts := getattr(answer, "requirements", ()):
        print_requirements(console, verdicts, machine.display)
    print_doubts(console, machine)
    for part in description.tables(answer, full):
        if isinstance(part, str):
            console.print(part, highlight=False)
        else:
            console.print(part)

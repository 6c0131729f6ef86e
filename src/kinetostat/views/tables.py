"""Machines as tables on a terminal, and the tables that every view is made of. Nothing is computed but rounding."""

import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from kinetostat.display import ENGINEERING, Display
from kinetostat.machine.loading import kinds_of_machine
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import doubts, parameters, values
from kinetostat.spec.document import Document
from kinetostat.spec.fields import Quantity
from kinetostat.units import KINDS
from kinetostat.views.fitted_table import FittedTable

if TYPE_CHECKING:
    pass

DIGITS_OF_INPUT = 10
"""Digits of what people have written themselves."""
PIPED = 100
"""Width of texts, in characters, where there is no terminal."""
UNBOUND = 10_000
"""Width that no table reaches, to measure what a table needs."""


def print_machines(console: Console, heads: Mapping[str, Document]) -> None:
    """The bundled machines, by what stands at the top of their files, and the families a file can name."""
    table = text_table("Bundled machines", "name", "machine", "family")
    for name, head in heads.items():
        table.add_row(name, head["name"], head["family"])
    console.print(table)
    table = text_table("Families (kinetostat new FAMILY prints a commented file)", "family", "machine")
    for name, summary in kinds_of_machine().items():
        table.add_row(name, summary)
    console.print(table)


def print_studies(console: Console, heads: Mapping[str, Document]) -> None:
    """The bundled studies by name."""
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
    """Every value of a machine with its meaning."""
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


class Piped(Console):
    """Console for pipes and files: texts wrap at `PIPED` characters, tables of numbers take the width they need."""

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as `Console` does, but cut no number and no name."""
        tables = [
            item for item in objects if isinstance(item, Table) and all(column.no_wrap for column in item.columns)
        ]
        unbound = self.options.update(width=UNBOUND)
        self.width = max([PIPED, *(self.measure(table, options=unbound).maximum for table in tables)])
        super().print(*objects, **options)
        self.width = PIPED


def terminal() -> Console:
    """The console of this process: as wide as the terminal, or where there is none, as its tables need it.

    Texts are shown as they are, whatever brackets and colons are in them; what is styled is a `Text`.
    """
    plain: dict[str, Any] = {"markup": False, "emoji": False}
    return Console(**plain) if sys.stdout.isatty() else Piped(width=PIPED, **plain)


def print_written(console: Console, paths: Iterable[Path]) -> None:
    """Name the files that were written."""
    for path in paths:
        console.print(f"wrote {path}", highlight=False)


def words_on_omitted(count: int) -> str:
    """Return the words for parameters that a table leaves out."""
    noun, verb = ("parameter", "is") if count == 1 else ("parameters", "are")
    return f"{count} {noun} with less effect {verb} omitted"


def text_table(title: str, *columns: str) -> FittedTable:
    """A table of texts, which are broken between words where the terminal is narrow."""
    table = FittedTable(title)
    for column in columns:
        table.add_column(column)
    return table


def numeric_table(title: str, first: str, columns: Sequence[str]) -> FittedTable:
    """A table whose columns after the first hold numbers."""
    table = FittedTable(title)
    table.add_column(first, no_wrap=True)
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    return table

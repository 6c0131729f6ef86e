"""Machines as tables on a terminal, and the tables that every view is made of. Nothing is computed but rounding."""

import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from kinetostat.machine.loading import kinds_of_machine
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import doubts, parameters, values
from kinetostat.spec.fields import Quantity
from kinetostat.spec.study import StudyFile
from kinetostat.units import KINDS, show

Number = float | None

LARGE = 1e6
"""Size from which a value of a machine is written with a power of ten."""
PIPED = 100
"""Width of texts, in characters, where there is no terminal."""
UNBOUND = 10_000
"""Width that no table reaches, to measure what a table needs."""


def print_machines(console: Console, bundled: Sequence[Machine], names: Sequence[str]) -> None:
    """The bundled machines, and the families a file can name."""
    table = text_table("Bundled machines", "name", "machine", "family")
    for name, machine in zip(names, bundled, strict=True):
        table.add_row(name, machine.name, machine.family.name)
    console.print(table)
    table = text_table("Families (kinetostat new FAMILY prints a commented file)", "family", "machine")
    for name, summary in kinds_of_machine().items():
        table.add_row(name, summary)
    console.print(table)


def print_studies(console: Console, studies: Mapping[str, StudyFile]) -> None:
    """The bundled studies by name."""
    table = text_table("Bundled studies (kinetostat optimize STUDY)", "name", "study", "machine")
    for name, study in studies.items():
        table.add_row(name, study.name, study.machine)
    console.print(table)


def print_machine(console: Console, machine: Machine) -> None:
    """Print every value of a machine with its meaning, and notes on implausible ones."""
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
        shown = readable([numbers[leaf] for leaf in parameter.leaves], parameter.quantity)
        table.add_row(parameter.path, shown, parameter.quantity.meaning)
    return table


def readable(values: Sequence[float], quantity: Quantity) -> str:
    """Return all entries of a field for a table, e.g. "3 x 0.5 m" where they are equal."""
    texts = [_readable(value, quantity) for value in values]
    alike = f"{len(texts)} x {texts[0]}" if len(texts) > 1 else texts[0]
    return alike if len(set(texts)) == 1 else ", ".join(texts)


def _readable(value: float, quantity: Quantity) -> str:
    """Return a value with ten digits, large ones with a power of ten (7e10 Pa), angles in degrees."""
    unit = KINDS[quantity.kind].unit
    if math.isinf(value):
        return quantity.show(value)
    if abs(value) < LARGE:
        return show(value, unit, 10)
    digits, _, power = f"{value:.9e}".partition("e")
    return f"{digits.rstrip('0').rstrip('.')}e{int(power)} {unit}".rstrip()


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


def number(value: Number, endless: str = "∞") -> str:
    """A number for a table: at most ten characters, a word where it is infinite, a dash where there is none."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return endless
    return f"{value:.6g}" if value == 0.0 or 1e-2 <= abs(value) < 1e6 else f"{value:.4g}"


def print_written(console: Console, paths: Iterable[Path]) -> None:
    """Name the files that were written."""
    for path in paths:
        console.print(f"wrote {path}", highlight=False)


def omitted(count: int) -> str:
    """Return the words for parameters that a table leaves out."""
    noun, verb = ("parameter", "is") if count == 1 else ("parameters", "are")
    return f"{count} {noun} with less effect {verb} omitted"


def text_table(title: str, *columns: str) -> Table:
    """A table without rules between its rows."""
    table = _titled(title)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "default")
    return table


def numeric_table(title: str, first: str, columns: Sequence[str]) -> Table:
    """A table whose columns after the first hold numbers."""
    table = _titled(title)
    table.add_column(first, no_wrap=True)
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    return table


def _titled(title: str) -> Table:
    """An empty table, wide enough for its title on one line."""
    return Table(
        title=title, min_width=len(title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False
    )

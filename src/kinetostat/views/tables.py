"""Machines and analyses as tables on a terminal, with units. Nothing is computed here but rounding and percent."""

import math
import sys
from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.machine.catalogue import families
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.studies.analysis import Analysis, Rows
from kinetostat.units import show

Number = float | None

UNITS_OF_K = "N·m/rad, N/rad, N/m"
UNITS_OF_C = "rad/(N·m), rad/N, m/N"


def print_machines(console: Console, bundled: Sequence[Machine], names: Sequence[str]) -> None:
    """The bundled machines, and the families a file can name."""
    table = text_table("Bundled machines", "name", "machine", "family")
    for name, machine in zip(names, bundled, strict=True):
        table.add_row(name, machine.name, machine.family.name)
    console.print(table)
    table = text_table("Families (kinetostat new FAMILY prints a commented file)", "family", "machine")
    for family in families().values():
        table.add_row(family.name, family.summary)
    console.print(table)


def print_machine(console: Console, machine: Machine) -> None:
    """Every value of a machine with its meaning."""
    table = text_table(f"{machine.name} ({machine.family.name})", "field", "value", "meaning")
    held = values(machine)
    whole = [parameter for parameter in parameters(machine.family) if parameter.path.count(".") == 1]
    for parameter in whole:
        texts = [_readable(held[leaf], parameter.quantity.kind) for leaf in parameter.leaves]
        alike = f"{len(texts)} x {texts[0]}" if len(texts) > 1 else texts[0]
        shown = alike if len(set(texts)) == 1 else ", ".join(texts)
        table.add_row(parameter.path, shown, parameter.quantity.meaning)
    console.print(table)


def _readable(value: float, kind: str) -> str:
    """A value for a table: ten digits, angles in degrees."""
    if kind == "angle":
        return f"{math.degrees(value):.10g} deg"
    return show(float(f"{value:.10g}"), kind)


def print_analysis(console: Console, analysis: Analysis) -> None:
    """K, C, attribution and indices at one pose."""
    console.print(f"[bold]{analysis.machine.name}[/bold]  {analysis.status.word}")
    console.print(analysis.message, highlight=False)
    console.print(f"Components rx ry rz x y z at the platform point P, base axes. Rank {analysis.rank}.", style="dim")
    _print_matrix(console, "Stiffness K", UNITS_OF_K, analysis.stiffness, analysis.stiffness_diagonal, "rigid")
    _print_matrix(console, "Compliance C", UNITS_OF_C, analysis.compliance, analysis.compliance_diagonal, "free")
    _print_shares(console, analysis)
    _print_indices(console, analysis)


def terminal() -> Console:
    """The console of this process: as wide as the terminal, wide enough for six columns where there is none."""
    return Console() if sys.stdout.isatty() else Console(width=100)


def number(value: Number, endless: str = "∞") -> str:
    """A number for a table: at most ten characters, a word where it is infinite, a dash where there is none."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return endless
    return f"{value:.6g}" if value == 0.0 or 1e-2 <= abs(value) < 1e6 else f"{value:.4g}"


def text_table(title: str, *columns: str) -> Table:
    """A table without rules between its rows."""
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "default")
    return table


def numeric_table(title: str, first: str, columns: Sequence[str]) -> Table:
    """A table whose columns after the first hold numbers."""
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column(first, no_wrap=True)
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    return table


def _print_matrix(
    console: Console, title: str, units: str, rows: Rows | None, diagonal: Sequence[float], endless: str
) -> None:
    table = numeric_table(f"{title} ({units})", "", COMPONENTS)
    if rows is None:
        table.add_row("diagonal", *(number(value, endless) for value in diagonal))
    else:
        for name, row in zip(COMPONENTS, rows, strict=True):
            table.add_row(name, *(number(value) for value in row))
    console.print(table)


def _print_shares(console: Console, analysis: Analysis) -> None:
    table = numeric_table("Attribution: shares in the diagonal of C", "spring", COMPONENTS)
    for share in analysis.shares:
        table.add_row(share.name, *("–" if part is None else f"{100 * part:.1f} %" for part in share.compliance))
    console.print(table)


def _print_indices(console: Console, analysis: Analysis) -> None:
    table = numeric_table("Principal compliances", "", ["least", "middle", "largest", "softest direction"])
    for unit, found in zip(("rad/(N·m)", "m/N"), (analysis.principal or {}).values(), strict=False):
        direction = " ".join(f"{component:+.3f}" for component in found.directions[-1])
        table.add_row(unit, *(number(value) for value in found.compliances), direction)
    if table.row_count:
        console.print(table)
    console.print(
        f"Condition of the leg wrenches: {number(analysis.condition)} "
        f"(moments divided by the characteristic length {number(analysis.length)} m)",
        highlight=False,
    )

"""Findings about an installation on a terminal, line by line as they are made. Needs no library but Rich."""

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.studies.diagnosis.diagnosis import Check, State

MARKS = {State.SOUND: ("✓", "green"), State.ABSENT: ("–", "bright_black"), State.FAILED: ("✗", "bold red")}
NAMES = 14
"""Columns for names."""


def print_checks(console: Console, checks: Iterable[Check]) -> list[Check]:
    """Print findings under their headings, with what to do about failures; returns them."""
    shown: list[Check] = []
    for check in checks:
        if not shown or shown[-1].group != check.group:
            console.print(Text(("\n" if shown else "") + check.group.capitalize(), "bold"))
        shown.append(check)
        console.print(_line(check))
    return shown


def print_verdict(console: Console, checks: Iterable[Check]) -> None:
    """One sentence: sound, or what to see to."""
    failed = [check.name for check in checks if check.state is State.FAILED]
    if failed:
        console.print(Text.assemble(("\nTo repair:", "bold red"), f" {', '.join(failed)}."))
    else:
        sound = " Everything needed is installed; the self-test gives the known numbers."
        console.print(Text.assemble(("\nSound.", "bold green"), sound))


def _line(check: Check) -> Table:
    mark, style = MARKS[check.state]
    line = Table.grid(padding=(0, 2, 0, 0))
    line.add_column(width=1)
    line.add_column(width=NAMES)
    line.add_column(overflow="fold")
    line.add_row(Text(mark, style), check.name, Text(check.detail, "" if check.state is State.SOUND else style))
    if check.fix:
        line.add_row("", "", Text(f"→ {check.fix}", "cyan"))
    return line

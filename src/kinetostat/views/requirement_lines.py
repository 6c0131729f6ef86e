"""Requirements in lines, for terminals, reports and pages: what is met, what is not, by how much and where."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.display import Display

if TYPE_CHECKING:
    from kinetostat.studies.requirements import Verdict


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

"""Answers on a terminal, made of their description: machine and state, sentences, requirements, tables.

Requirements in lines are made here for reports and pages as well. Nothing is computed.
"""

import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.display import Display
from kinetostat.views.question import Description
from kinetostat.views.tables import print_doubts

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


HEADS = 11
"""Least width of the words that stand before the sentences, in columns of the terminal."""
GAP = 2
"""Width of the gap between these words and the sentences, in columns of the terminal."""


def tell(console: Console, description: Description, answer: Any, full: bool = False) -> None:
    """Print an answer: first the machine with its state, then a line for each sentence, notes, and the tables.

    Args:
        console: on which it is printed.
        description: of answers of this kind.
        answer: of the kind that is described.
        full: whether tables show every row.
    """
    machine = description.machine_of(answer)
    console.print(Text.assemble((machine.name, "bold"), f"  {description.state(answer)}".rstrip()))
    lines = Table.grid(padding=(0, GAP, 0, 0))
    sentences = [*description.sentences(answer)]
    room = console.width - max([HEADS, *(len(head) + GAP for head, _ in sentences)])
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

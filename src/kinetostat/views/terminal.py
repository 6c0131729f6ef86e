"""Answers on a terminal, made of their description: machine and state, sentences, tables. Nothing is computed."""

import textwrap
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.views.question import Description
from kinetostat.views.requirement_lines import print_requirements
from kinetostat.views.tables import print_doubts

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

"""Pages of the documentation as what they tell a reader to do: blocks of commands, files, programs and answers.

The convention, for every fenced block of README.md, CONTRIBUTING.md and docs/:

    ```toml NAME          a file of this name in the page's folder; machine and study files are read as such
    ```toml NAME PATH     what stands at PATH of that file instead; `.` is what is written below its end
    ```sh                 commands, run in order in the page's folder; each must succeed
    ```console            `$ command` and what it says, whatever its exit code
    ```python             run, all blocks of a page in one namespace
    ```text               lines that the block before has said, in this order; `...` leaves some out
    ```xml                elements of a file, which must be well formed
    ```                   a quotation; nothing is done with it

Blank space does not count when lines are compared; every digit does.
"""

import re
import shlex
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
FENCE = re.compile(r"^(?P<indent> *)```(?P<info>[^\n`]*)\n(?P<text>.*?)^(?P=indent)```$", re.MULTILINE | re.DOTALL)
KINDS = ("toml", "sh", "console", "python", "text", "xml", "")


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the words after it, its text, and where it stands."""

    kind: str
    words: tuple[str, ...]
    text: str
    line: int


def pages() -> list[Path]:
    """Every page that people read."""
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page: Path) -> Iterator[Block]:
    """The fenced blocks of a page, in order."""
    text = page.read_text("utf-8")
    for found in FENCE.finditer(text):
        kind, *words = found["info"].split() or [""]
        yield Block(kind, tuple(words), textwrap.dedent(found["text"]), text.count("\n", 0, found.start()) + 1)


def commands(text: str) -> Iterator[list[str]]:
    """The commands of a block, each as words; a comment is none, and `\\` joins lines."""
    for line in text.replace("\\\n", " ").splitlines():
        if words := shlex.split(line, comments=True):
            yield words


def dialogues(text: str) -> Iterator[tuple[list[str], str]]:
    """Each `$ command` of a block with what stands below it."""
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command, _, said = part.partition("\n")
        yield shlex.split(command), said


def missing(expected: str, said: str) -> str | None:
    """The first line of `expected` that `said` does not hold after the line before it; None if all are there."""
    rest = _plain(said)
    for line in expected.splitlines():
        wanted = _plain(line.strip().removesuffix("..."))
        if wanted:
            _, found, rest = rest.partition(wanted)
            if not found:
                return line
    return None


def _plain(text: str) -> str:
    """Text without blank space and the rules of tables: where a line ends depends on the width of the terminal."""
    return re.sub(r"[\s─━]+", "", text)

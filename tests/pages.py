"""Pages of the documentation as what they tell a reader to do: blocks of commands, files, programs and answers.

The convention, for every fenced block of README.md, CONTRIBUTING.md and docs/:

    ```toml NAME          a file of this name in the page's folder; machine and study files are read as such
    ```toml NAME PATH     what stands at PATH of that file instead; `.` is what is written below its end
    ```csv NAME           a file of this name in the page's folder
    ```sh                 commands, run in order in the page's folder; each must succeed
    ```console            `$ command` and what it says, whatever its exit code
    ```python             run, all blocks of a page in one namespace
    ```text               what the block before has said, from its first line to its last; `...` leaves lines out
    ```xml                elements of a file, which must be well formed
    ```                   a quotation; nothing is done with it

Blank space does not count when lines are compared; every digit does.
"""

import re
import shlex
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import accumulate
from pathlib import Path

ROOT = Path(__file__).parents[1]
FENCE = re.compile(r"^(?P<indent> *)```(?P<info>[^\n`]*)\n(?P<text>.*?)^(?P=indent)```$", re.MULTILINE | re.DOTALL)
KINDS = ("toml", "csv", "sh", "console", "python", "c", "text", "xml", "matlab", "ini", "md", "")


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
    """The first part of `expected` that `said` does not hold where it has to be; None if `said` is as expected.

    Both are the same from the first line to the last. `...` on a line of its own leaves out any lines, at the end of a
    line what follows in that line and any lines after it.
    """
    lines = [line for line in map(_plain, said.splitlines()) if line]
    starts = list(accumulate(map(len, lines), initial=0))
    whole, at, gap = "".join(lines), 0, False
    *parts, last = re.split(r"\.\.\.[ \t]*$", expected, flags=re.MULTILINE)
    for part in (*parts, last):
        wanted, cut = _plain(part), bool(part) and not part.endswith("\n") and part is not last
        places = [start for start in starts if start >= at] if gap else [at]
        ends = [p + len(wanted) for p in places if whole.startswith(wanted, p) and (cut or p + len(wanted) in starts)]
        if not ends:
            return part.strip()
        at, gap = ends[0], True
    return None if at == len(whole) or not _plain(last) else last.strip()


def corrected(expected: str, said: str) -> str:
    """The quotation `expected` with each of its parts replaced by the lines of `said` that resemble it most.

    What `...` leaves out stays left out. The result is a proposal: read it before it is kept.
    """
    lines, result, start = [line.rstrip() for line in said.splitlines()], [], 0
    for part in re.split(r"(^[ \t]*\.\.\.[ \t]*\n)", expected, flags=re.MULTILINE):
        if not part.strip(" .\n"):
            result.append(part)
            continue
        wanted, size = _plain(part), len(part.splitlines())
        spans = [(i, i + n) for n in range(max(size - 2, 1), size + 3) for i in range(start, len(lines) - n + 1)]
        resemblance = {span: _alike(wanted, _plain("".join(lines[slice(*span)]))) for span in spans}
        first, start = max(resemblance, key=resemblance.__getitem__)
        result.append("\n".join(lines[first:start]).strip("\n") + "\n")
    return "".join(result)


def _alike(one: str, other: str) -> float:
    matcher = SequenceMatcher(None, one, other, autojunk=False)
    return 0.0 if matcher.real_quick_ratio() < 0.5 or matcher.quick_ratio() < 0.5 else matcher.ratio()


def _plain(text: str) -> str:
    """Text without blank space and the rules of tables: where a line ends depends on the width of the terminal."""
    return re.sub(r"[\s─━]+", "", text)

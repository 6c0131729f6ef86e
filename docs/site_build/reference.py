"""The reference of the Python interface: every public name, from its docstring."""

import inspect
import re
from pathlib import Path
from typing import Any

import kinetostat


def reference(_folder: Path) -> str:
    """All public names of the package, what makes something first, then what is made."""
    entries = ["```{eval-rst}"]
    for name in sorted(kinetostat.__all__, key=lambda name: (inspect.isclass(getattr(kinetostat, name)), name)):
        found = getattr(kinetostat, name)
        kind = "autoclass" if inspect.isclass(found) else "autofunction"
        entries += [f".. {kind}:: kinetostat.{name}", "   :members:" if kind == "autoclass" else "", ""]
    return "\n".join([*entries, "```"])


def as_markup(_app: Any, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Docstrings are plain text: what reStructuredText would take for markup is escaped, code in backticks kept."""
    lines[:] = [escaped(line) for line in lines]


def escaped(line: str) -> str:
    """A line of plain text as reStructuredText."""
    parts = re.split(r"(`[^`]+`|:[a-z]+:`?)", line)
    return "".join(part if i % 2 else re.sub(r"([*|]|_(?=\W|$))", r"\\\1", part) for i, part in enumerate(parts))

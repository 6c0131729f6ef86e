"""The reference of the Python interface: every public name and every answer, from its docstring."""

import inspect
import re
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, get_type_hints

from matplotlib.figure import Figure

import kinetostat
from kinetostat.studies.evaluation import Buffers, CompiledFunction

COMPILED = (CompiledFunction, Buffers)
"""What `compile` returns, and what that returns: classes that are no data."""


def reference(_folder: Path) -> str:
    """All public names of the package, what makes something first, then what is made."""
    entries = ["```{eval-rst}"]
    for name in sorted(kinetostat.__all__, key=lambda name: (inspect.isclass(getattr(kinetostat, name)), name)):
        found = getattr(kinetostat, name)
        kind = "autoclass" if inspect.isclass(found) else "autofunction"
        entries += [f".. {kind}:: kinetostat.{name}", "   :members:" if kind == "autoclass" else "", ""]
    entries += ["```", "", "## Answers", "", "What these functions return; made by them alone.", "", "```{eval-rst}"]
    for answer in answers():
        entries += [f".. autoclass:: {answer.__module__}.{answer.__name__}", "   :members:", ""]
    return "\n".join([*entries, "```"])


def answers() -> list[type]:
    """The classes of ours that public functions and compiled ones return, and that have no public name of their own."""
    functions = (inspect.unwrap(getattr(kinetostat, name)) for name in kinetostat.__all__)
    drawn = {"Figure": Figure}  # which the module of `plot` does not import
    returned = {get_type_hints(one, localns=drawn).get("return") for one in functions if inspect.isfunction(one)}
    ours = (one for one in returned if is_dataclass(one) and one.__name__ not in kinetostat.__all__)
    return sorted([*ours, *COMPILED], key=lambda one: one.__name__)


def without_signature(
    _app: Any, what: str, _name: str, found: Any, _options: Any, _signature: str, _returns: str
) -> tuple[str, None] | None:
    """Answers are made by functions: how they would be called is nobody's business."""
    return ("", None) if what == "class" and (is_dataclass(found) or found in COMPILED) else None


def as_markup(_app: Any, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Docstrings are plain text: what reStructuredText would take for markup is escaped, code in backticks kept."""
    lines[:] = [escaped(line) for line in lines]


def escaped(line: str) -> str:
    """A line of plain text as reStructuredText."""
    parts = re.split(r"(`[^`]+`|:[a-z]+:`?)", line)
    return "".join(part if i % 2 else re.sub(r"([*|]|_(?=\W|$))", r"\\\1", part) for i, part in enumerate(parts))

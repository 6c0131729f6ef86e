"""Statements of the documents and of messages that were true once: each is compared with what the program does today.

A statement is a pattern, and the words that must stand there; it is looked for in all pages and in all texts of the
source. What a new capability makes false is found here, where nobody would have read the page again.
"""

import argparse
import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import kinetostat
from kinetostat.cli import _parser

ROOT = Path(__file__).parent.parent.parent
NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight")


@cache
def texts():
    """All pages and sources as running text, by their paths."""
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "src").rglob("*.py")]
    return {
        str(path.relative_to(ROOT)): " ".join(path.read_text("utf-8").split())
        for path in pages
        if path.name != "CHANGELOG.md"  # which tells what was
    }


def listed(names):
    """Names in a sentence."""
    return f"{', '.join(names[:-1])} and {names[-1]}"


def commands_without_json():
    (action,) = [a for a in _parser()._actions if isinstance(a, argparse._SubParsersAction)]
    for parser in action.choices.values():
        parser.fill()
    flags = {name: {flag for each in parser._actions for flag in each.option_strings}
             for name, parser in action.choices.items()}  # fmt: skip
    return [f"`{name}`" for name in sorted(flags) if "--json" not in flags[name]]


def notebooks():
    return sorted((ROOT / "examples").glob("*.ipynb"))


def have_outputs():
    """Whether the cells of all notebooks are stored with what they print and draw; of none otherwise."""
    stored = [any(cell.get("outputs") for cell in json.loads(path.read_text("utf-8"))["cells"]) for path in notebooks()]
    assert len(set(stored)) == 1
    return stored[0]


def links_weigh():
    """Whether the mass of links moves the tool of a machine written leg by leg at rest under gravity."""
    weight = ["load.gravity=[0, 0, -9.81]", "tool.mass=1 kg"]
    light, heavy = (
        kinetostat.under_load(kinetostat.load("tripteron", [*weight, *more]))
        for more in ([], ["sections.bar.density=7850 kg/m^3"])
    )
    return not np.allclose(light.displacement, heavy.displacement, rtol=1e-3)


STATEMENTS = {
    r"All but [^.]* takes? `--json`": lambda: f"All but {listed(commands_without_json())} take `--json`",
    r"cells are stored with(?:out)?(?: their)? outputs": lambda: (
        "cells are stored with their outputs" if have_outputs() else "cells are stored without outputs"
    ),
    r"\w+ of these tutorials are notebooks": lambda: (
        f"{NUMBERS[len(notebooks())].capitalize()} of these tutorials are notebooks"
    ),
    r"Links have (?:a|no) weight(?: where their mass is known)?": lambda: (
        "Links have a weight where their mass is known" if links_weigh() else "Links have no weight"
    ),
}
"""What must stand where a pattern is met."""


@pytest.mark.parametrize("pattern", STATEMENTS)
def test_what_is_stated_is_so(pattern):
    true = STATEMENTS[pattern]()
    met = {path: re.findall(pattern, text) for path, text in texts().items()}
    met = {path: stated for path, stated in met.items() if stated}
    assert met, "the statement has gone: take its pattern out as well"
    assert {path: stated for path, stated in met.items() if set(stated) != {true}} == {}, true

"""Bounds of a TOML text that hold before it is parsed: a parser's time and memory can grow faster than its text.

A key of n parts takes Python's parser n^2 steps and as much memory, so 100 kB of `a.a.a...` would stop a server. One
pass over the text, in linear time, counts what matters; it knows strings and comments and nothing else of TOML.
"""

import re

from kinetostat.spec.errors import InputError

DEEPEST = 8
"""Most levels of nested tables and lists, and most parts of a key; a machine file has three or four."""
MOST_ENTRIES = 30_000
"""Most keys, parts of keys, values of lists and brackets together; machines of forty legs have some thousand."""

_TOKEN = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\Z)'  # an open string reaches to the end, where the parser refuses it
    r"|'''(?:[^']|'(?!''))*+(?:'{3,5}|\Z)"
    r'|"(?:[^"\\\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|\#[^\n]*+"
    r"|[.=,\[\]{}]|\n++",
    re.DOTALL,
)


def check_bounds(text: str, origin: str) -> None:
    """Check that a text has no more entries, and no deeper keys and brackets, than a machine or study needs.

    Args:
        text: TOML, or what should be.
        origin: names it in messages.

    Raises:
        InputError: it has.
    """
    entries = depth = parts = 0
    for token in _TOKEN.finditer(text):
        match text[token.start()]:
            case ".":
                entries, parts = entries + 1, parts + 1
            case "=" | ",":
                entries, parts = entries + 1, 0
            case "[" | "{":
                entries, depth, parts = entries + 1, depth + 1, 0
            case "]" | "}":
                depth, parts = max(depth - 1, 0), 0
            case "\n":
                parts = 0
        if parts >= DEEPEST or depth > DEEPEST + 1:
            raise InputError(
                f'"{origin}" is nested too deeply: a key of more than {DEEPEST} parts, or brackets in more than '
                f"{DEEPEST} others; it should have tables of values and lists."
            )
        if entries > MOST_ENTRIES:
            raise InputError(
                f'"{origin}" has more than {MOST_ENTRIES:,} keys and values; it should describe one machine or study.'
            )

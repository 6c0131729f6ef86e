"""Machine and study files as text: reading them safely, overriding values, and writing values.

What a document means is decided in `spec.validation`. A parser's time and memory can grow faster than its text: a key
of n parts takes Python's n^2 steps and as much memory, so 100 kB of `a.a.a...` would stop a server. So one pass over
the text, in linear time, counts keys, values and brackets before it is parsed; it passes over strings and comments.
"""

import copy
import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from kinetostat.spec.arguments import as_list
from kinetostat.spec.errors import InputError, shorten

LARGEST_FILE = 1 << 20
"""Largest file that is read, bytes. A machine file has some thousand; a megabyte is a mistake or an attack."""
DEEPEST = 8
"""Most levels of nested tables and lists, and most parts of a key; a machine file has three or four."""
MOST_ENTRIES = 30_000
"""Most keys, parts of keys, values of lists and brackets together; machines of forty legs have some thousand."""
LONGEST_COUNT = 9
"""Digits of a number that counts: more than any count needs here. Python refuses to convert thousands of digits."""

_TOKEN = re.compile(  # strings in four kinds of quotes, a comment, or one of the signs that are counted
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\Z)'  # an open string reaches to the end, where the parser refuses it
    r"|'''(?:[^']|'(?!''))*+(?:'{3,5}|\Z)"
    r'|"(?:[^"\\\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|\#[^\n]*+"
    r"|[.=,\[\]{}]|\n++",
    re.DOTALL,
)

Document = dict[str, Any]
"""A TOML document: its tables, lists and values by key."""


def is_study(document: Document) -> bool:
    """Tell whether a document is meant as a study, not as a machine."""
    return "family" not in document and bool({"machine", "variables", "objectives"} & document.keys())


def exists(path: Path) -> bool:
    """Tell whether there is a file or folder at a path; False where the name is not possible on this system."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def read(path: Path) -> Document:
    """Read the TOML document in a file.

    Raises:
        InputError: if there is no such file, or if it is a folder, too large, not text, or not TOML.
    """
    return parse(read_text(path), str(path))


def read_text(path: Path) -> str:
    """Read the text of a file.

    Raises:
        InputError: if there is no such file, or if it is a folder, too large, or not text.
    """
    try:
        with path.open("rb") as stream:
            # A pipe or device has no size to ask for: one byte more than allowed shows that it is too large.
            data = stream.read(LARGEST_FILE + 1)
    except IsADirectoryError:
        raise InputError(f'"{path}" is a folder; give the machine file in it.') from None
    except OSError as error:
        raise InputError(f'"{path}" cannot be read: {error.strerror}.') from None
    return text_of(data, str(path))


def text_of(data: bytes, origin: str, kind: str = "TOML") -> str:
    """Return the text of a file of bounded size; `origin` names it in messages, and `kind` what it should be.

    A mark of the byte order at its start, as Windows editors write it, is left out.

    Raises:
        InputError: if it is too large or not text.
    """
    if len(data) > LARGEST_FILE:
        raise InputError(f'"{origin}" is larger than {LARGEST_FILE >> 20} MiB; it should be a short {kind} text.')
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f'"{origin}" is not text: byte {error.start} is not UTF-8; it must be {kind}, saved as UTF-8.'
        ) from None


def parse(text: str, origin: str) -> Document:
    """Read the TOML document in a text; `origin` names it in messages.

    Raises:
        InputError: if it is not TOML (the message gives line and column), nested too deeply, or has too many entries.
    """
    check_bounds(text, origin)
    try:
        document = tomllib.loads(text)
    except ValueError as error:
        raise InputError(f'"{origin}" is not valid TOML: {error}. Text values need quotes, e.g. x = "2 cm".') from None
    if _is_deeper_than(document, DEEPEST):
        raise InputError(f'"{origin}" is nested too deeply; it should have tables of values and lists.')
    return document


def head(text: str, origin: str) -> Document:
    """Read the keys at the top of a shipped file, which stand before its first table, without reading the rest.

    Raises:
        InputError: they are not TOML.
    """
    return parse(text.partition("\n[")[0], origin)


def check_bounds(text: str, origin: str) -> None:
    """Check that a text has no more entries, and no deeper keys and brackets, than a machine or study needs.

    Args:
        text: TOML, or what should be.
        origin: the name of the file, for messages.

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


def _is_deeper_than(document: Any, levels: int) -> bool:
    """Tell whether tables and lists are nested in more than so many levels."""
    level = [document]
    for _ in range(levels):
        nested = [part for part in level if isinstance(part, dict | list)]
        level = [child for part in nested for child in (part.values() if isinstance(part, dict) else part)]
    return any(isinstance(part, dict | list) for part in level)


def override(document: Document, settings: Sequence[str], counts: Mapping[str, int]) -> Document:
    """Return a copy of a document in which each setting "path=value" has replaced or added a value.

    A value is read as TOML, and taken as text if it is not TOML: quotes may be left out.

    Args:
        document: the document as it was read.
        settings: the overrides, in order; a single one may be given without a list.
        counts: number of entries of each field, by path, for which one value may stand. If the document has a single
            value for all entries and an override changes one entry, the value is first written out for each entry.

    Raises:
        InputError: if a setting has no "=", an empty path, or a path through something that is not a table or list.
    """
    result = copy.deepcopy(document)
    for setting in as_list(settings):
        path, equals, text = setting.partition("=")
        if not equals or not path.strip():
            raise InputError(f'--set {shorten(setting)} must be path=value, e.g. --set geometry.base_radius="26 cm".')
        if path.count(".") >= DEEPEST:
            raise InputError(f"--set {shorten(path)} has more than {DEEPEST} parts; no field is nested so deeply.")
        _repeat_for_entries(result, path.strip(), counts)
        _put(result, path.strip(), setting_value(text.strip()))
    return result


def _repeat_for_entries(document: Document, path: str, counts: Mapping[str, int]) -> None:
    """Write a single value out for each entry of its field if `path` names an entry, such as `stiffness.legs.2`.

    The document is changed; for all other paths it stays as it is.
    """
    field, _, entry = path.rpartition(".")
    *tables, name = field.split(".")
    table: Any = document
    for key in tables:
        table = table.get(key) if isinstance(table, dict) else None
    if field not in counts or not entry.isdecimal() or not isinstance(table, dict):
        return
    if name in table and not isinstance(table[name], list):
        table[name] = [table[name]] * counts[field]


def setting_value(text: str) -> object:
    """Read the value of an override as TOML, or else as text."""
    try:
        check_bounds(text, "--set")
        parsed = tomllib.loads(f"value = {text}\n")
    except ValueError:  # InputError is one: what is too deep or too long for a value is text
        return text
    # A line break in the text could begin a second key: then it is not a value.
    return parsed["value"] if len(parsed) == 1 else text


def _put(document: Document, path: str, value: object) -> None:
    """Put a value at a path, and make the tables on the way that do not exist yet."""
    parent: Any = document
    *parents, last = path.split(".")
    for key in parents:
        parent = _child(parent, key, path)
    if isinstance(parent, list):
        parent[_index(parent, last, path)] = value
    elif isinstance(parent, dict):
        parent[last] = value
    else:
        raise InputError(f"--set {shorten(path)}: nothing can be set inside {shorten(parent)}; give a shorter path.")


def _child(parent: Any, key: str, path: str) -> Any:
    """Return what stands in a table or list under a key; a table that has no such key gets an empty table there."""
    if isinstance(parent, dict):
        return parent.setdefault(key, {})
    if isinstance(parent, list):
        return parent[_index(parent, key, path)]
    raise InputError(
        f"--set {shorten(path)}: {shorten(parent)} has no part called {shorten(key)}; give a shorter path."
    )


def is_whole_number(text: str) -> bool:
    """Whether a text is a whole number from 0 with at most `LONGEST_COUNT` digits."""
    return text.isdecimal() and len(text) <= LONGEST_COUNT


def _index(entries: list[Any], key: str, path: str) -> int:
    if not is_whole_number(key) or int(key) >= len(entries):
        known = f"the list has entries 0 to {len(entries) - 1}"
        raise InputError(f"--set {shorten(path)}: {shorten(key)} is not an entry; {known}.")
    return int(key)


def toml_key(name: str) -> str:
    """Return a name as it must stand in the header of a TOML table: in quotes unless it is a plain word."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def toml_pairs(table: Mapping[str, Any]) -> Iterator[str]:
    """Give the lines "key = value" of a table."""
    for key, value in table.items():
        yield f"{toml_key(key)} = {toml_value(value)}"


def toml_value(value: object) -> str:
    """Return a value as TOML in one line, also a table or a list."""
    if isinstance(value, dict):
        return f"{{ {', '.join(toml_pairs(value))} }}"
    if isinstance(value, list):
        return f"[{', '.join(toml_value(entry) for entry in value)}]"
    return json.dumps(value, ensure_ascii=False)

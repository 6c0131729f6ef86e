"""Machine and study files as text: read safely, override, write. Nothing is interpreted here; see `validation`."""

import copy
import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kinetostat.spec.errors import InputError, several, shorten

LARGEST_FILE = 1 << 20
"""Bytes. A machine file has a few hundred; a megabyte is a mistake or an attack."""

DEEPEST = 8
"""Levels of tables and lists; a machine file has three or four."""

Document = dict[str, Any]


def is_study(document: Document) -> bool:
    """Whether a document is meant as a study, not as a machine."""
    return "family" not in document and bool({"machine", "variables", "objectives"} & document.keys())


def exists(path: Path) -> bool:
    """Whether there is a file or folder of that name; not where no file can have it."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def read(path: Path) -> Document:
    """The TOML document in a file.

    Raises:
        InputError: no such file, not a file, too large, not text, or not TOML.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(LARGEST_FILE + 1)
    except IsADirectoryError:
        raise InputError(f'"{path}" is a folder; give the machine file in it.') from None
    except OSError as error:
        raise InputError(f'"{path}" cannot be read: {error.strerror}.') from None
    if len(data) > LARGEST_FILE:
        raise InputError(f'"{path}" is larger than {LARGEST_FILE >> 20} MiB; it should be a short TOML text.')
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f'"{path}" is not text: byte {error.start} is not UTF-8; it must be TOML, saved as UTF-8.'
        ) from None
    return parse(text, str(path))


def parse(text: str, origin: str) -> Document:
    """The TOML document in a text; `origin` names it in messages.

    Raises:
        InputError: not TOML; the message gives line and column.
    """
    try:
        document = tomllib.loads(text)
    except ValueError as error:
        raise InputError(f'"{origin}" is not valid TOML: {error}. Text values need quotes, e.g. x = "2 cm".') from None
    except RecursionError:
        document = None
    if document is None or _deeper_than(document, DEEPEST):
        raise InputError(f'"{origin}" is nested too deeply; it should have tables of values and lists.')
    return document


def _deeper_than(document: Any, levels: int) -> bool:
    """Whether tables and lists are nested in more than so many levels."""
    at = [document]
    for _ in range(levels):
        nested = [part for part in at if isinstance(part, dict | list)]
        at = [child for part in nested for child in (part.values() if isinstance(part, dict) else part)]
    return any(isinstance(part, dict | list) for part in at)


def override(document: Document, settings: Sequence[str], counts: Mapping[str, int]) -> Document:
    """A copy of the document with each "path=value" put in; the value is TOML, and what is not TOML is text.

    Args:
        document: what was written.
        settings: the overrides, in order, or one of them.
        counts: entries of each field that holds a list; where one value was written for all and an override names
            an entry, the value is first repeated.

    Raises:
        InputError: no "=", an empty path, or a path that leads through something that is not a table or list.
    """
    result = copy.deepcopy(document)
    for setting in several(settings):
        path, equals, text = setting.partition("=")
        if not equals or not path.strip():
            raise InputError(f'--set {shorten(setting)} must be path=value, e.g. --set geometry.base_radius="26 cm".')
        _repeat(result, path.strip(), counts)
        _put(result, path.strip(), _value(text.strip()))
    return result


def _repeat(document: Document, path: str, counts: Mapping[str, int]) -> None:
    field, _, entry = path.rpartition(".")
    *tables, name = field.split(".")
    table: Any = document
    for key in tables:
        table = table.get(key) if isinstance(table, dict) else None
    if field not in counts or not entry.isdecimal() or not isinstance(table, dict):
        return
    if name in table and not isinstance(table[name], list):
        table[name] = [table[name]] * counts[field]


def _value(text: str) -> object:
    try:
        parsed = tomllib.loads(f"value = {text}\n")
    except (ValueError, RecursionError):
        return text
    return parsed["value"] if len(parsed) == 1 else text


def _put(document: Document, path: str, value: object) -> None:
    at: Any = document
    *parents, last = path.split(".")
    for key in parents:
        at = _child(at, key, path)
    if isinstance(at, list):
        at[_index(at, last, path)] = value
    elif isinstance(at, dict):
        at[last] = value
    else:
        raise InputError(f"--set {shorten(path)}: nothing can be set inside {shorten(at)}; give a shorter path.")


def _child(at: Any, key: str, path: str) -> Any:
    if isinstance(at, dict):
        return at.setdefault(key, {})
    if isinstance(at, list):
        return at[_index(at, key, path)]
    raise InputError(f"--set {shorten(path)}: {shorten(at)} has no part called {shorten(key)}; give a shorter path.")


def _index(entries: list[Any], key: str, path: str) -> int:
    if not key.isdecimal() or len(key) > 9 or int(key) >= len(entries):
        known = f"the list has entries 0 to {len(entries) - 1}"
        raise InputError(f"--set {shorten(path)}: {shorten(key)} is not an entry; {known}.")
    return int(key)


def toml_key(name: str) -> str:
    """A name as TOML takes it in a table's header."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)

"""A document against the tables of a family: SI data in these tables, or one paragraph that says what to mend.

The tables are the family's own dataclasses; the JSON Schema of the same tables is made in `machine.file_schema`.
"""

import re
from collections.abc import Iterator, Mapping
from enum import Enum, auto
from typing import Any

from kinetostat.display import DIGITS, EXAMPLE, SI
from kinetostat.frozen import dataclass
from kinetostat.spec.document import Document
from kinetostat.spec.errors import PRINTABLE, InputError, cut, first_mistakes, hint, shorten
from kinetostat.spec.fields import Quantity, optional, quantities
from kinetostat.units import KINDS, UnitError

SCHEMA_VERSION = 1
LONGEST_MACHINE_NAME = 80
"""Characters of a machine's name: titles of figures and pages have room for it."""
HEAD = ("schema", "name", "family")
"""Keys at the top of a file that are not tables."""

DISPLAY_SCHEMA: dict[str, Any] = {
    "type": "object",
    "description": "units and digits in which results are shown; files and JSON stay SI",
    "properties": {
        "units": {
            "anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}],
            "examples": [EXAMPLE, SI],
        },
        "digits": {"type": "integer", "minimum": DIGITS[0], "maximum": DIGITS[1], "default": 4},
    },
    "additionalProperties": False,
}
"""The schema of the table [display], which `display.read_display` reads."""


class MistakeKind(Enum):
    """Kind of a mistake, which decides its sentence."""

    MISSING = auto()
    UNKNOWN = auto()
    NO_TABLE = auto()
    WRONG_VALUE = auto()


@dataclass(frozen=True)
class Mistake:
    """Something in a document that its tables do not have, or do not allow.

    Attributes:
        kind: what is wrong about it.
        place: the keys that lead to it.
        reason: the reason why a value is wrong, where there is one to tell; else empty.
    """

    kind: MistakeKind
    place: tuple[object, ...]
    reason: str = ""


def validated_tables(
    document: Document, origin: str, family: str, tables: Mapping[str, type]
) -> tuple[str, dict[str, Any]]:
    """Read what a machine file says, without its table [display], into the tables of its family.

    Args:
        document: the document as written; its family has been looked up before overrides.
        origin: name of the file, for messages.
        family: the name of the family, which no override may change.
        tables: classes of the tables, by dotted name.

    Returns:
        The name of the machine, and one instance of each table, by dotted name.

    Raises:
        InputError: one sentence for each mistake, at most five.
    """
    reader = _TableReader(tables)
    reader.read(document)
    mistakes = [*_mistakes_in_head(document, family), *reader.mistakes]
    if mistakes:
        sentences = first_mistakes(mistakes, lambda mistake: _sentence(mistake, document, reader))
        raise InputError(f'"{origin}": {sentences}')
    return document["name"], {path: reader.instances[path] for path in tables}


def _mistakes_in_head(document: Document, family: str) -> Iterator[Mistake]:
    """Check the version of the format, the name of the machine and its family."""
    version, name = document.get("schema", SCHEMA_VERSION), document.get("name")
    if version != SCHEMA_VERSION:
        yield Mistake(MistakeKind.WRONG_VALUE, ("schema",))
    if "name" not in document:
        yield Mistake(MistakeKind.MISSING, ("name",))
    elif not (isinstance(name, str) and 0 < len(name) <= LONGEST_MACHINE_NAME and re.fullmatch(PRINTABLE, name)):
        yield Mistake(MistakeKind.WRONG_VALUE, ("name",))
    if document.get("family") != family:
        reason = f'an override cannot change it from "{family}"; start from another machine'
        yield Mistake(MistakeKind.WRONG_VALUE, ("family",), reason)


class _TableReader:
    """Reads a document into instances of tables, and collects the mistakes in it.

    Attributes:
        tables: classes of the tables, by dotted name.
        subtables: names of the tables that each table holds, by its dotted name, in their order.
        instances: the tables that have been read, by dotted name.
        mistakes: the mistakes that have been met, in the order of fields.
    """

    def __init__(self, tables: Mapping[str, type]) -> None:
        self.tables = tables
        self.subtables: dict[str, dict[str, None]] = {}
        self.instances: dict[str, Any] = {}
        self.mistakes: list[Mistake] = []
        for path in tables:
            names = path.split(".")
            for depth, name in enumerate(names):
                self.subtables.setdefault(".".join(names[:depth]), {})[name] = None

    def read(self, content: object, place: tuple[str, ...] = ()) -> None:
        """Read the content of the table at a place of the document, and of the tables in it."""
        path = ".".join(place)
        table, subtables = self.tables.get(path), self.subtables.get(path, {})
        if not isinstance(content, dict):
            self.mistakes.append(Mistake(MistakeKind.NO_TABLE, place))
            return
        if table:
            self._read_fields(content, place, table)
        for name in subtables:
            self._read_subtable(content, (*place, name))
        fields = quantities(table) if table else {}
        unknown = [key for key in content if key not in fields and key not in subtables and (place or key not in HEAD)]
        self.mistakes += [Mistake(MistakeKind.UNKNOWN, (*place, key)) for key in unknown]

    def _read_fields(self, content: Document, place: tuple[str, ...], table: type) -> None:
        """Read the fields of a table; it is made if all of them can be read."""
        values = {}
        for name, quantity in quantities(table).items():
            if name in content:
                try:
                    values[name] = quantity.read(content[name])
                except UnitError as error:
                    self.mistakes.append(Mistake(MistakeKind.WRONG_VALUE, (*place, name), str(error)))
            elif name not in optional(table):
                self.mistakes.append(Mistake(MistakeKind.MISSING, (*place, name)))
        if {*quantities(table)} - optional(table) <= values.keys():
            self.instances[".".join(place)] = table(**values)

    def _read_subtable(self, content: Document, place: tuple[str, ...]) -> None:
        """Read a table in another one. It may be left out if all its fields may, unless it holds tables itself."""
        path = ".".join(place)
        table = self.tables.get(path)
        if place[-1] in content:
            self.read(content[place[-1]], place)
        elif table is not None and path not in self.subtables and optional(table) == {*quantities(table)}:
            self.instances[path] = table()
        else:
            self.mistakes.append(Mistake(MistakeKind.MISSING, place))


def _sentence(mistake: Mistake, document: Document, reader: _TableReader) -> str:
    """The sentence about a mistake: what is wrong, and what to write."""
    path = [str(part) for part in mistake.place]
    name, last = ".".join(cut(part) for part in path), cut(path[-1])
    parent = ".".join(path[:-1])
    fields = quantities(reader.tables[parent]) if parent in reader.tables else {}
    if mistake.kind is MistakeKind.MISSING:
        return _missing(parent, name, last, fields, document.get("family"))
    if mistake.kind is MistakeKind.UNKNOWN:
        allowed = list(fields) or [*([] if parent else HEAD), *reader.subtables.get(parent, ())]
        advice = hint(last, allowed, f"it may hold {', '.join(allowed)}.", quoted=False)
        return f"{name} is not known; {advice}"
    value = shorten(_look_up(document, path))
    if mistake.kind is MistakeKind.NO_TABLE:
        return f"{name} is {value}; it must be a table, written as [{name}] with one line for each value."
    if name == "schema":
        return f"schema is {value}; this version reads schema = {SCHEMA_VERSION}."
    if name == "name":
        printable = f"text of 1 to {LONGEST_MACHINE_NAME} characters that can be printed"
        return f'name is {value}; it must be {printable}, e.g. name = "my machine".'
    return f"{name} is {value}: {mistake.reason}."


def _missing(parent: str, name: str, last: str, fields: Mapping[str, Quantity], family: object) -> str:
    """The sentence about a field or a table that is missing in its parent table.

    Args:
        parent: dotted name of that table; empty for the top of the file.
        name: dotted name of what is missing.
        last: its name within the parent.
        fields: the fields of the parent.
        family: the family that the file names.
    """
    if last in fields:
        quantity = fields[last]
        start = f"{name} is missing ({quantity.meaning}); add {last}"
        if quantity.apart:
            complete = f"`kinetostat new {family}` prints a complete file"
            return f"{start} to [{parent}], {quantity.entries}; {complete}."
        return f'{start} = "{KINDS[quantity.kind].example}" to [{parent}].'
    if name not in ("name", "family"):
        return f"the table [{name}] is missing; `kinetostat new` prints a complete file."
    return f'{name} is missing; add {last} = "..." at the top of the file.'


def _look_up(document: Document, path: list[str]) -> object:
    """Return what stands at a path; if a value stands on the way, in the place of a table, that value."""
    value: Any = document
    for key in path:
        value = value.get(key) if isinstance(value, dict) else value
    return value

"""A document against the tables of a family: validated SI data, or one paragraph that says what to mend.

The model of a file is made by pydantic from the family's own dataclasses; this module only words its findings.
"""

import difflib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from kinetostat.display import DIGITS, EXAMPLE, SI
from kinetostat.spec.document import Document
from kinetostat.spec.errors import PRINTABLE, InputError, cut, first_mistakes, shorten
from kinetostat.spec.fields import Quantity, optional, quantities
from kinetostat.units import KINDS

SCHEMA_VERSION = 1


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

MODELS = 64
"""Models of files that are kept: making one takes longer than all else that reading a file is."""


def file_model(family: str, tables: Mapping[str, type]) -> type[BaseModel]:
    """The model of a machine file of one family."""
    return _file_model(family, tuple(tables.items()))


@lru_cache(MODELS)
def _file_model(family: str, tables: tuple[tuple[str, type], ...]) -> type[BaseModel]:
    content: dict[str, Any] = {
        "schema_version": (
            Literal[1],
            Field(alias="schema", description="version of the file format", default=SCHEMA_VERSION),
        ),
        "name": (
            str,
            Field(description="what people call the machine", min_length=1, max_length=80, pattern=PRINTABLE),
        ),
        "family": (Literal[family], Field(description="kind of machine, see `kinetostat list`")),
    }
    content["display"] = (dict[str, Any], Field(default={}, json_schema_extra=DISPLAY_SCHEMA))
    return _table_model("MachineFile", dict(tables), content)


def _table_model(title: str, tables: Mapping[str, type], content: dict[str, Any]) -> type[BaseModel]:
    """Make the model of a table from the tables in it by dotted name; tables in tables become models in models."""
    for i, name in enumerate(dict.fromkeys(path.partition(".")[0] for path in tables)):
        inner = {path.partition(".")[2]: kind for path, kind in tables.items() if path.partition(".")[0] == name}
        alone = inner.pop("", None)
        model = alone if alone and not inner else _table_model(name, inner, _fields(alone) if alone else {})
        may_miss = model is alone and set(quantities(model)) == optional(model)
        default: Any = {"default_factory": model} if may_miss else {}
        about: Any = Field(alias=name, description=f"the machine's {name}", **default)
        content[f"table_{i}"] = (model, about)
    return create_model(title, __config__=ConfigDict(extra="forbid"), **content)


def _fields(table: type) -> dict[str, Any]:
    """The fields of a table that holds tables as well, for the model of both."""
    hints = get_type_hints(table, include_extras=True)
    return {
        f"field_{name}": (hints[name], Field(alias=name, **({"default": getattr(table, name)} if may_miss else {})))
        for name, may_miss in ((name, name in optional(table)) for name in quantities(table))
    }


def tables_in(data: BaseModel, tables: Mapping[str, type]) -> dict[str, Any]:
    """Return one instance per table, by dotted name, from a validated document."""
    instances = {}
    for path, table in tables.items():
        at: Any = data
        for key in path.split("."):
            at = _entries(at)[key]
        fields = quantities(table)
        within = {} if isinstance(at, table) else {k: v for k, v in _entries(at).items() if k in fields}
        instances[path] = table(**within) if within else at
    return instances


def _entries(model: BaseModel) -> dict[str, Any]:
    """The content of a model, under the names that files have for it."""
    return {field.alias or name: getattr(model, name) for name, field in type(model).model_fields.items()}


def validate(document: Document, origin: str, model: type[BaseModel], tables: Mapping[str, type]) -> BaseModel:
    """The document as validated data.

    Args:
        document: what was written.
        origin: name of the file, for messages.
        model, tables: the model and tables from `file_model` and the family.

    Raises:
        InputError: one sentence for each mistake, at most five.
    """
    try:
        return model.model_validate(document)
    except ValidationError as error:
        mistakes = first_mistakes(error.errors(), lambda mistake: _sentence(mistake, document, tables))
        raise InputError(f'"{origin}": {mistakes}') from None


def _sentence(mistake: dict[str, Any], document: Document, tables: Mapping[str, type]) -> str:
    path = [str(part) for part in mistake["loc"]]
    name, last = ".".join(cut(part) for part in path), cut(path[-1])
    within = ".".join(path[:-1])
    known = quantities(tables[within]) if within in tables else {}
    if mistake["type"] in ("missing", "missing_argument"):
        return _missing(within, name, last, known, document.get("family"))
    if mistake["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        allowed = list(known) or _tables_in(within, tables)
        close = difflib.get_close_matches(last, allowed, 1)
        hint = f"did you mean {close[0]}?" if close else f"it may hold {', '.join(allowed)}."
        return f"{name} is not known; {hint}"
    value = shorten(_look_up(document, path))
    if mistake["type"] == "dataclass_type":
        return f"{name} is {value}; it must be a table, written as [{name}] with one line for each value."
    if name == "schema":
        return f"schema is {value}; this version reads schema = {SCHEMA_VERSION}."
    if name == "name":
        return f'name is {value}; it must be text of 1 to 80 characters that can be printed, e.g. name = "my machine".'
    return f"{name} is {value}: {mistake['msg']}."


def _tables_in(within: str, tables: Mapping[str, type]) -> list[str]:
    """Names of the tables that a table of tables may hold."""
    start = f"{within}." if within else ""
    names = [path.removeprefix(start).partition(".")[0] for path in tables if path.startswith(start)]
    return list(dict.fromkeys([*([] if within else ["schema", "name", "family"]), *names]))


def _missing(within: str, name: str, last: str, known: Mapping[str, Quantity], family: object) -> str:
    if last in known:
        quantity = known[last]
        start = f"{name} is missing ({quantity.meaning}); add {last}"
        if quantity.apart:
            complete = f"`kinetostat new {family}` prints a complete file"
            return f"{start} to [{within}], {quantity.entries}; {complete}."
        return f'{start} = "{KINDS[quantity.kind].example}" to [{within}].'
    if name not in ("name", "family"):
        return f"the table [{name}] is missing; `kinetostat new` prints a complete file."
    return f'{name} is missing; add {last} = "..." at the top of the file.'


def _look_up(document: Document, path: list[str]) -> object:
    at: Any = document
    for key in path:
        at = at.get(key) if isinstance(at, dict) else at
    return at

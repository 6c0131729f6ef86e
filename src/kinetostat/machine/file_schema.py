"""The JSON Schema of machine files, for editors: made by pydantic of the tables that files are read into.

Reading a file is the business of `loading`, which needs no model.
"""

import math
import operator
from collections.abc import Mapping
from functools import reduce
from typing import Any, Literal, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, create_model

from kinetostat.machine.catalogue import families
from kinetostat.machine.common_tables import STATES, Drives, NamedLoad, ServoGains
from kinetostat.machine.orientation import ANGLES, orientation_schema
from kinetostat.machine.written.schema import written_schema
from kinetostat.spec.errors import PRINTABLE
from kinetostat.spec.fields import NO_LIMIT, optional, quantities
from kinetostat.spec.requirements import TABLE, requirements_schema
from kinetostat.spec.tolerance_table import TABLE as TOLERANCES
from kinetostat.spec.tolerance_table import tolerances_schema
from kinetostat.spec.validation import DISPLAY_SCHEMA, LONGEST_MACHINE_NAME, SCHEMA_VERSION
from kinetostat.units import RIGID

STATE = "what is shown where no quantity is named: the free machine, or the machine at rest under its loads"


def machine_schema() -> dict[str, Any]:
    """The JSON Schema of machine files of every family."""
    models = [_file_model(family.name, family.every_table) for family in families().values()]
    union: Any = reduce(operator.or_, models)
    schema = TypeAdapter(union).json_schema()
    schema["anyOf"].append(written_schema(SCHEMA_VERSION))
    files = [kind for kind in (*schema["$defs"].values(), *schema["anyOf"]) if "family" in kind.get("properties", {})]
    for kind in files:
        kind["properties"] |= {TABLE: requirements_schema(), TOLERANCES: tolerances_schema()}
    for table in schema["$defs"].values():
        if {*ANGLES} <= table.get("properties", {}).keys():
            table["properties"] |= orientation_schema()
        for drives in (Drives, ServoGains):
            if table.get("title") == drives.__name__:
                table["additionalProperties"] = TypeAdapter(drives).json_schema()
        if "gravity" in table.get("properties", {}):
            table["additionalProperties"] = TypeAdapter(NamedLoad).json_schema()
            table["properties"]["state"] = {"enum": [*STATES], "default": "free", "description": STATE}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "kinetostat machine file",
        **_as_written(schema),
    }


def _as_written(schema: Any) -> Any:
    """A schema whose defaults are as people write them: an infinite stiffness is "rigid", no limit has no default."""
    if isinstance(schema, dict):
        unset = NO_LIMIT in str(schema.get("description")) and "default" in schema
        return {key: _as_written(value) for key, value in schema.items() if not (unset and key == "default")}
    if isinstance(schema, list | tuple):
        return [_as_written(value) for value in schema]
    return RIGID if schema == math.inf else schema


def _file_model(family: str, tables: Mapping[str, type]) -> type[BaseModel]:
    """Make the model of a machine file of one family."""
    content: dict[str, Any] = {
        "schema_version": (
            Literal[SCHEMA_VERSION],
            Field(alias="schema", description="version of the file format", default=SCHEMA_VERSION),
        ),
        "name": (
            str,
            Field(
                description="what people call the machine",
                min_length=1,
                max_length=LONGEST_MACHINE_NAME,
                pattern=PRINTABLE,
            ),
        ),
        "family": (Literal[family], Field(description="kind of machine, see `kinetostat list`")),
    }
    content["display"] = (dict[str, Any], Field(default={}, json_schema_extra=DISPLAY_SCHEMA))
    return _table_model("MachineFile", tables, content)


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

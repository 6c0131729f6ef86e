"""The JSON Schema of machine files, for editors: files of families, and files that are written leg by leg.

For families pydantic makes it of the tables that files are read into. For files leg by leg it is written by hand, with
every field that any plan may have; `written.tables` makes the tables of a single plan. Reading a file is the business
of `loading`, which needs neither schema nor pydantic.
"""

import math
import operator
from collections.abc import Mapping
from functools import reduce
from typing import Any, Literal, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, create_model

from kinetostat.machine.catalogue import families
from kinetostat.machine.common_tables import COMMON_TABLES, STATES, Drives, NamedLoad, ServoGains
from kinetostat.machine.cross_section import MATERIALS, SHAPE_KINDS, SHAPES
from kinetostat.machine.orientation import ANGLES, orientation_schema
from kinetostat.machine.written.joints import JOINT_TYPES, MOTORS, SEAT
from kinetostat.machine.written.plan import CABLE, LINK_MODELS, NAME, ONE_SIDED, SPATIAL_POSE, SUMMARY
from kinetostat.machine.written.struts import AXIAL
from kinetostat.machine.written.tables import MATERIAL_FIELDS, ROD, WEIGHT
from kinetostat.spec.errors import PRINTABLE
from kinetostat.spec.fields import NO_LIMIT, optional, quantities
from kinetostat.spec.fields import Field as TableField
from kinetostat.spec.requirements import TABLE as REQUIREMENTS
from kinetostat.spec.requirements import requirements_schema
from kinetostat.spec.tolerance_table import TABLE as TOLERANCES
from kinetostat.spec.tolerance_table import tolerances_schema
from kinetostat.spec.validation import DISPLAY_SCHEMA, LONGEST_MACHINE_NAME, SCHEMA_VERSION
from kinetostat.units import KINDS, RIGID

Schema = dict[str, Any]
"""A JSON Schema, or a part of one."""

STATE_MEANING = "what is shown where no quantity is named: the free machine, or the machine at rest under its loads"
TABLES_BY_NAME = {"Drives": Drives, "ServoGains": ServoGains, "Load": NamedLoad}
"""Tables that also hold tables by name, [drives.NAME] for instance: the class of those, by the title of the schema."""


def machine_schema() -> Schema:
    """The JSON Schema of machine files of every family, and of those written leg by leg."""
    models = [_file_model(family.name, family.every_table) for family in families().values()]
    union: Any = reduce(operator.or_, models)
    schema = TypeAdapter(union).json_schema()
    schema["anyOf"].append(_written_file())
    for part in (*schema["$defs"].values(), *schema["anyOf"]):
        if "family" in part.get("properties", {}):
            part["properties"] |= {REQUIREMENTS: requirements_schema(), TOLERANCES: tolerances_schema()}
    for table in schema["$defs"].values():
        if {*ANGLES} <= table.get("properties", {}).keys():
            table["properties"] |= orientation_schema()
        if table.get("title") in TABLES_BY_NAME:
            table["additionalProperties"] = TypeAdapter(TABLES_BY_NAME[table["title"]]).json_schema()
        if table.get("title") == "Load":
            table["properties"]["state"] = {"enum": [*STATES], "default": "free", "description": STATE_MEANING}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "kinetostat machine file",
        **_as_written(schema),
    }


def _as_written(schema: Any) -> Any:
    """A schema whose defaults are as people write them: an infinite stiffness is "rigid", no limit has no default."""
    if isinstance(schema, dict):
        # The word in the description is the only mark of a field without a limit that pydantic passes on.
        unlimited = NO_LIMIT in str(schema.get("description")) and "default" in schema
        return {key: _as_written(value) for key, value in schema.items() if not (unlimited and key == "default")}
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
        "display": (dict[str, Any], Field(default={}, json_schema_extra=DISPLAY_SCHEMA)),
    }
    return _table_model("MachineFile", tables, content)


def _table_model(title: str, tables: Mapping[str, type], content: dict[str, Any]) -> type[BaseModel]:
    """Make the model of a table from the tables in it by dotted name; tables in tables become models in models.

    The names of its fields are numbers: pydantic's must be identifiers, and those of tables, the aliases, need not be.
    """
    for i, name in enumerate(dict.fromkeys(path.partition(".")[0] for path in tables)):
        subtables = {path.partition(".")[2]: table for path, table in tables.items() if path.partition(".")[0] == name}
        table = subtables.pop("", None)
        model = table if table and not subtables else _table_model(name, subtables, _fields(table) if table else {})
        is_optional = model is table and set(quantities(model)) == optional(model)
        default: Any = {"default_factory": model} if is_optional else {}
        about: Any = Field(alias=name, description=f"the machine's {name}", **default)
        content[f"table_{i}"] = (model, about)
    return create_model(title, __config__=ConfigDict(extra="forbid"), **content)


def _fields(table: type) -> dict[str, Any]:
    """The fields of a table that holds tables as well, for the model of both."""
    hints = get_type_hints(table, include_extras=True)
    defaults = {name: {"default": getattr(table, name)} for name in optional(table)}
    return {f"field_{name}": (hints[name], Field(alias=name, **defaults.get(name, {}))) for name in quantities(table)}


QUANTITY = {"type": ["number", "string"]}
"""A number in SI, or text with a unit."""
# Fields that several tables of a file leg by leg have.
POINT = {"type": "array", "items": QUANTITY, "minItems": 3, "maxItems": 3}
DIRECTION = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
BODIES = {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2}
COMPLIANCE = {"type": "array", "minItems": 6, "maxItems": 6, "description": "rx ry rz x y z, rad/(N·m), rad/N, m/N"}
COPIES = {
    "copies": {"type": "integer", "minimum": 1, "description": "how many legs, turned about z of the base"},
    "angles": {"type": "array", "items": QUANTITY, "description": "of the copies; left out: equal steps"},
    "mirrored": {"type": "boolean", "description": "every other copy is a mirror image in the x-z plane"},
}
STIFFNESS = {
    "type": ["number", "string", "array", "object"],
    "description": 'of its actuator or flexure; "rigid" is exact; parts in a row: ["screw 200 N/um", ...]',
}
PRELOAD = {**QUANTITY, "description": "load of its spring where that is not deformed; a cable's pretension"}


def _written_file() -> Schema:
    """A machine file that is written leg by leg."""
    return _table(
        {
            "schema": {"const": SCHEMA_VERSION},
            "name": {"type": "string", "minLength": 1, "maxLength": LONGEST_MACHINE_NAME, "pattern": PRINTABLE},
            "family": {"const": NAME, "description": SUMMARY},
            "space": {"enum": ["spatial", "planar"], "description": "planar: the x-y plane"},
            "platform": _table({"point": {**POINT, "description": "P at the home pose, base frame"}}, ["point"]),
            "pose": {**_table({**dict.fromkeys(SPATIAL_POSE, QUANTITY), **orientation_schema()}), "minProperties": 1},
            "sections": {"type": "object", "additionalProperties": _cross_section()},
            "legs": {"type": "array", "minItems": 1, "items": _leg()},
            **{name: {"type": "object"} for name in COMMON_TABLES},
            "display": DISPLAY_SCHEMA,
        },
        ["name", "family", "platform", "pose", "legs"],
    )


def _table(properties: Schema, required: list[str] | None = None) -> Schema:
    """A table that has these fields and no others."""
    return {"type": "object", "properties": properties, "required": required or [], "additionalProperties": False}


def _cross_section() -> Schema:
    sizes = {name: {**QUANTITY, "examples": [KINDS[kind].example]} for name, kind in SHAPE_KINDS.items()}
    known = {"shape": {"enum": list(SHAPES)}, "material": {"enum": list(MATERIALS)}}
    material = dict.fromkeys(MATERIAL_FIELDS, QUANTITY)
    return _table({**known, **sizes, **material}, ["shape"])


def _leg() -> Schema:
    """A leg: a chain of joints and links, or a cable between two points."""
    joints = {"type": "array", "minItems": 1, "items": _joint()}
    links = {"type": "object", "additionalProperties": _link()}
    chain = _table({"name": {"type": "string"}, **COPIES, "joints": joints, "links": links}, ["name", "joints"])
    cable = {
        "type": {"const": CABLE, "description": "an actuator that only pulls, between two points"},
        "from": {**POINT, "description": "its end at the base, base frame at the home pose"},
        "to": {**POINT, "description": "its end at the platform, base frame at the home pose"},
        "stiffness": STIFFNESS,
        "preload": PRELOAD,
    }
    rope = _table({"name": {"type": "string"}, **COPIES, **cable}, ["name", "type", "from", "to", "stiffness"])
    return {"anyOf": [chain, rope]}


def _joint() -> Schema:
    """A joint of any type: the fields that all have, then those of each type."""
    about = "; ".join(f"{name}: {kind.meaning}" for name, kind in JOINT_TYPES.items())
    common = {
        "name": {"type": "string"},
        "type": {"enum": list(JOINT_TYPES), "description": about},
        "joins": {**BODIES, "description": "bodies on the base side and on the platform side"},
        "actuated": {"enum": [True, False, *MOTORS], "description": "of a joint with several freedoms: which one"},
        "stiffness": STIFFNESS,
        **{f"stiffness_{way}": {**QUANTITY, "description": field.quantity.meaning} for way, field in SEAT.items()},
        "compliance": COMPLIANCE,
        "preload": PRELOAD,
        "acts": {"enum": list(ONE_SIDED), "description": "of a spring that carries loads of one sign only"},
        "section": {"type": "string", "description": "of the rod of a strut: its stiffness is EA/L at the pose"},
        AXIAL: {**QUANTITY, "description": ROD.quantity.meaning},
    }
    fields = {name: _field(field) for kind in JOINT_TYPES.values() for name, field in kind.fields.items()}
    return _table({**common, **fields}, ["name", "type", "joins"])


def _link() -> Schema:
    """A link between two joints."""
    models = "; ".join(f"{model}: {meaning}" for model, meaning in LINK_MODELS.items())
    link = {
        "model": {"enum": list(LINK_MODELS), "description": models},
        "section": {"type": "string"},
        "up": DIRECTION,
        "compliance": COMPLIANCE,
        **{name: _field(field) for name, field in WEIGHT.items()},
    }
    return _table(link, ["model"])


def _field(field: TableField) -> Schema:
    """A field of a joint: one quantity, or a list of them."""
    count = field.quantity.count
    if count is None:
        return {**QUANTITY, "description": field.quantity.meaning}
    many = {"type": "array", "items": QUANTITY, "minItems": count, "maxItems": count}
    if field.quantity.kind == "direction":
        return {"anyOf": [many, {"type": "string"}], "description": f"{field.quantity.meaning}, or a joint's name"}
    return {**many, "description": field.quantity.meaning}

"""The JSON Schema of machine files that are written leg by leg, for editors: every field that any plan may have.

The tables of one plan, into which its file is read, are in `tables`.
"""

from typing import Any

from kinetostat.machine.common_tables import COMMON
from kinetostat.machine.cross_section import MATERIALS, SHAPE_KINDS, SHAPES
from kinetostat.machine.orientation import orientation_schema
from kinetostat.machine.written.joints import JOINT_TYPES, MOTORS, SEAT
from kinetostat.machine.written.plan import CABLE, LINK_MODELS, NAME, ONE_SIDED, SPATIAL_POSE, SUMMARY
from kinetostat.machine.written.struts import AXIAL
from kinetostat.machine.written.tables import MATERIAL_FIELDS, ROD, WEIGHT
from kinetostat.spec.fields import Field
from kinetostat.spec.validation import DISPLAY_SCHEMA, LONGEST_MACHINE_NAME
from kinetostat.units import KINDS

QUANTITY = {"type": ["number", "string"]}
"""A number in SI, or text with a unit."""
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


def written_schema(version: int) -> dict[str, Any]:
    """The schema; `version` is that of the file format."""
    return _table(
        {
            "schema": {"const": version},
            "name": {"type": "string", "minLength": 1, "maxLength": LONGEST_MACHINE_NAME},
            "family": {"const": NAME, "description": SUMMARY},
            "space": {"enum": ["spatial", "planar"], "description": "planar: the x-y plane"},
            "platform": _table({"point": {**POINT, "description": "P at the home pose, base frame"}}, ["point"]),
            "pose": {**_table({**dict.fromkeys(SPATIAL_POSE, QUANTITY), **orientation_schema()}), "minProperties": 1},
            "sections": {"type": "object", "additionalProperties": _cross_section()},
            "legs": {"type": "array", "minItems": 1, "items": _leg()},
            **{name: {"type": "object"} for name in COMMON},
            "display": DISPLAY_SCHEMA,
        },
        ["name", "family", "platform", "pose", "legs"],
    )


def _table(properties: dict[str, Any], required: list[str] | None = None) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": required or [], "additionalProperties": False}


def _cross_section() -> dict[str, Any]:
    sizes = {name: {**QUANTITY, "examples": [KINDS[kind].example]} for name, kind in SHAPE_KINDS.items()}
    known = {"shape": {"enum": list(SHAPES)}, "material": {"enum": list(MATERIALS)}}
    material = dict.fromkeys(MATERIAL_FIELDS, QUANTITY)
    return _table({**known, **sizes, **material}, ["shape"])


def _leg() -> dict[str, Any]:
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


def _joint() -> dict[str, Any]:
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


def _link() -> dict[str, Any]:
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


def _field(field: Field) -> dict[str, Any]:
    """A field of a joint: one quantity, or a list of them."""
    count = field.quantity.count
    if count is None:
        return {**QUANTITY, "description": field.quantity.meaning}
    many = {"type": "array", "items": QUANTITY, "minItems": count, "maxItems": count}
    if field.quantity.kind == "direction":
        return {"anyOf": [many, {"type": "string"}], "description": f"{field.quantity.meaning}, or a joint's name"}
    return {**many, "description": field.quantity.meaning}

"""The JSON Schema of machine files written leg by leg, so that editors complete and check them."""

from typing import Any

from kinetostat.machine.cross_section import MATERIALS
from kinetostat.machine.written.family import NAME, SUMMARY
from kinetostat.machine.written.plan import JOINT_TYPES, LINK_MODELS, SHAPES, SPATIAL_POSE
from kinetostat.machine.written.tables import JOINT_FIELDS, SHAPE_KINDS
from kinetostat.spec.fields import Field
from kinetostat.units import KINDS

QUANTITY = {"type": ["number", "string"]}
BODIES = {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2}
DIRECTION = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
COMPLIANCE = {"type": "array", "minItems": 6, "maxItems": 6, "description": "rx ry rz x y z, rad/(N·m), rad/N, m/N"}


def written_schema(version: int) -> dict[str, Any]:
    """The schema; `version` is that of the file format."""
    point = {"type": "array", "items": QUANTITY, "minItems": 3, "maxItems": 3}
    return _table(
        {
            "schema": {"const": version},
            "name": {"type": "string", "minLength": 1, "maxLength": 80},
            "family": {"const": NAME, "description": SUMMARY},
            "space": {"enum": ["spatial", "planar"], "description": "planar: the x-y plane"},
            "platform": _table({"point": {**point, "description": "P at the home pose, base frame"}}, ["point"]),
            "pose": {**_table(dict.fromkeys(SPATIAL_POSE, QUANTITY)), "minProperties": 1},
            "sections": {"type": "object", "additionalProperties": _cross_section()},
            "legs": {"type": "array", "minItems": 1, "items": _leg()},
            "tool": {"type": "object"},
            "load": {"type": "object"},
            "limits": {"type": "object"},
        },
        ["name", "family", "platform", "pose", "legs"],
    )


def _table(properties: dict[str, Any], required: list[str] | None = None) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": required or [], "additionalProperties": False}


def _cross_section() -> dict[str, Any]:
    sizes = {name: {**QUANTITY, "examples": [KINDS[kind].example]} for name, kind in SHAPE_KINDS.items()}
    known = {"shape": {"enum": list(SHAPES)}, "material": {"enum": list(MATERIALS)}}
    moduli = dict.fromkeys(("youngs_modulus", "shear_modulus", "density"), QUANTITY)
    return _table({**known, **sizes, **moduli}, ["shape"])


def _leg() -> dict[str, Any]:
    fields = {name: _field(field) for kind in JOINT_FIELDS.values() for name, field in kind.items()}
    about = "; ".join(f"{kind}: {meaning}" for kind, meaning in JOINT_TYPES.items())
    joint = {
        "name": {"type": "string"},
        "type": {"enum": list(JOINT_TYPES), "description": about},
        "joins": {**BODIES, "description": "bodies on the base side and on the platform side"},
        "actuated": {"type": "boolean"},
        "stiffness": {**QUANTITY, "description": 'of its actuator or flexure; "rigid" is exact'},
        "compliance": COMPLIANCE,
    }
    models = "; ".join(f"{model}: {meaning}" for model, meaning in LINK_MODELS.items())
    link = {
        "model": {"enum": list(LINK_MODELS), "description": models},
        "section": {"type": "string"},
        "up": DIRECTION,
        "compliance": COMPLIANCE,
    }
    joints = {"type": "array", "minItems": 1, "items": _table({**joint, **fields}, ["name", "type", "joins"])}
    links = {"type": "object", "additionalProperties": _table(link, ["model"])}
    return _table({"name": {"type": "string"}, "joints": joints, "links": links}, ["name", "joints"])


def _field(field: Field) -> dict[str, Any]:
    """A field of a joint: one quantity, or a list of them."""
    count = field.quantity.count
    if count is None:
        return {**QUANTITY, "description": field.quantity.meaning}
    many = {"type": "array", "items": QUANTITY, "minItems": count, "maxItems": count}
    return {**many, "description": field.quantity.meaning}

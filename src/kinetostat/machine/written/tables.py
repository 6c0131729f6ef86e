"""Files of machines written leg by leg: the tables of numbers that a plan has, and the JSON Schema."""

from typing import Any

from kinetostat.machine.common_tables import COMMON
from kinetostat.machine.cross_section import MATERIALS, SHAPE_KINDS, SHAPES
from kinetostat.machine.orientation import orientation_schema
from kinetostat.machine.series import label
from kinetostat.machine.written.joints import AXIS, JOINT_TYPES, MOTORS, SEAT, needs_axis, stiffness_kind
from kinetostat.machine.written.plan import CABLE, LINK_MODELS, NAME, ONE_SIDED, SPATIAL_POSE, SUMMARY, JointPlan, Plan
from kinetostat.machine.written.struts import AXIAL
from kinetostat.spec.fields import Field, Quantity, made_table
from kinetostat.spec.validation import DISPLAY_SCHEMA
from kinetostat.units import KINDS

POSE_KINDS = {"x": "length", "y": "length", "z": "length", "roll": "angle", "pitch": "angle", "yaw": "angle"}


ROD = Field(Quantity("axial rigidity", "EA of a strut's rod, whose stiffness is EA/L at the pose", positive=True))


WEIGHT = {
    "mass": Field(Quantity("mass", "of the link, in the place of what its cross-section weighs")),
    "centre_of_mass": Field(Quantity("length", "of that mass, base frame at the home pose", count=3, apart=True)),
    "inertia": Field(
        Quantity(
            "inertia",
            "of that mass about its centre, base axes at the home pose: xx, yy, zz, xy, xz, yz",
            count=6,
            apart=True,
        )
    ),
}
"""Fields of a link about its mass; each needs those before it."""


def tables_of(plan: Plan) -> dict[str, type]:
    """The tables of the plan's machine files, by dotted name."""
    point = Quantity("length", "platform point P at the home pose, base frame", count=3, apart=True)
    tables = {"platform": made_table("Platform", {"point": Field(point)})}
    for name, shape in plan.shapes.items():
        tables[f"sections.{name}"] = made_table("CrossSection", _shape_fields(shape, plan.materials[name]))
    for leg in plan.legs_of_file:
        for joint in leg.joints:
            tables[leg.table(joint.name)] = made_table("JointTable", _joint_fields(joint))
            if joint.series:
                tables[f"{leg.table(joint.name)}.stiffness"] = made_table("Series", _series_fields(joint))
        for link in leg.links.values():
            if link.weight:
                tables[leg.table(link.name)] = made_table("Link", {name: WEIGHT[name] for name in link.weight})
    pose = {name: Field(Quantity(POSE_KINDS[name], f"{name} of the platform")) for name in plan.pose}
    return {**tables, "pose": made_table("Pose", pose)}


def _joint_fields(joint: JointPlan) -> dict[str, Field]:
    fields = dict(JOINT_TYPES[joint.kind].fields)
    if joint.motor:
        fields |= JOINT_TYPES[joint.kind].motors[joint.motor].fields
    if joint.seat:
        fields |= {"axis": AXIS} if needs_axis(joint.kind) else {}
        fields |= {f"stiffness_{way}": SEAT[way] for way in joint.seat}
    if joint.sprung and not joint.series:
        kind = stiffness_kind(joint.kind, joint.motor)
        what = "its actuator, held by its servo" if joint.actuated else "the joint's own, as of a flexure hinge"
        fields["stiffness"] = Field(Quantity(kind, what))
    if joint.preloaded:
        kind = "force" if stiffness_kind(joint.kind, joint.motor) == "linear stiffness" else "moment"
        fields["preload"] = Field(Quantity(kind, "what it carries undeformed, positive if it pulls its ends together"))
    if joint.rod and not joint.cross_section:
        fields[AXIAL] = ROD
    return fields


def _series_fields(joint: JointPlan) -> dict[str, Field]:
    kind = stiffness_kind(joint.kind, joint.motor)
    return {key: Field(Quantity(kind, f"{label(key)}, in a row with the others")) for key in joint.series}


def _shape_fields(shape: str, material: str) -> dict[str, Field]:
    fields = {
        name: Field(Quantity(SHAPE_KINDS[name], name.replace("_", " "), positive=name != "inner_diameter"))
        for name in SHAPES[shape]
    }
    known = MATERIALS.get(material)
    modulus = Quantity("elastic modulus", "Young's modulus E", positive=True)
    shear = Quantity("elastic modulus", "shear modulus G", positive=True)
    density = Quantity("density", "of the material")
    fields["youngs_modulus"] = Field(modulus, known.youngs_modulus if known else None)
    fields["shear_modulus"] = Field(shear, known.shear_modulus if known else None)
    fields["density"] = Field(density, known.density if known else 0.0)
    expansion = Quantity("thermal expansion", "relative growth of the material per kelvin; 0: not known")
    rise = Quantity("temperature difference", "how much warmer these links are than the machine was when built")
    fields["expansion"] = Field(expansion, known.expansion if known else 0.0)
    fields["temperature_rise"] = Field(rise, 0.0)
    return fields


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
    moduli = dict.fromkeys(("youngs_modulus", "shear_modulus", "density", "expansion", "temperature_rise"), QUANTITY)
    return _table({**known, **sizes, **moduli}, ["shape"])


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


def _leg() -> dict[str, Any]:
    """A leg: a chain of joints and links, or a cable between two points."""
    joints = {"type": "array", "minItems": 1, "items": _joint()}
    links = {"type": "object", "additionalProperties": _link()}
    chain = _table({"name": {"type": "string"}, **COPIES, "joints": joints, "links": links}, ["name", "joints"])
    end = {"type": "array", "items": QUANTITY, "minItems": 3, "maxItems": 3}
    cable = {
        "type": {"const": CABLE, "description": "an actuator that only pulls, between two points"},
        "from": {**end, "description": "its end at the base, base frame at the home pose"},
        "to": {**end, "description": "its end at the platform, base frame at the home pose"},
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

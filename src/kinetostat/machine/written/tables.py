"""Files of machines written leg by leg: the tables of numbers that a plan has, and the fields in them.

The words of such files are in `plan`, the JSON Schema of all plans is in `machine.file_schema`.
"""

from kinetostat.machine.cross_section import MATERIALS, SHAPE_KINDS, SHAPES
from kinetostat.machine.series import label
from kinetostat.machine.written.joints import AXIS, JOINT_TYPES, LOAD_OF_STIFFNESS, SEAT, needs_axis, stiffness_kind
from kinetostat.machine.written.plan import JointPlan, Plan
from kinetostat.machine.written.struts import AXIAL
from kinetostat.spec.fields import Field, Quantity, along_axes, inertia_tensor, made_table

POSE_KINDS = {"x": "length", "y": "length", "z": "length", "roll": "angle", "pitch": "angle", "yaw": "angle"}
"""Kinds of quantity of the coordinates of a pose."""

ROD = Field(Quantity("axial rigidity", "EA of a strut's rod, whose stiffness is EA/L at the pose", positive=True))
"""The field of a strut whose rod has no cross-section."""

MATERIAL_FIELDS = {
    "youngs_modulus": Field(Quantity("elastic modulus", "Young's modulus E", positive=True)),
    "shear_modulus": Field(Quantity("elastic modulus", "shear modulus G", positive=True)),
    "density": Field(Quantity("density", "density of the material"), 0.0),
    "expansion": Field(Quantity("thermal expansion", "relative growth of the material per kelvin; 0: not known"), 0.0),
    "temperature_rise": Field(
        Quantity("temperature difference", "how much warmer these links are than the machine was when built"), 0.0
    ),
}
"""Fields of a cross-section beside its sizes, with what they are if neither the file nor a known material says it."""

WEIGHT = {
    "mass": Field(Quantity("mass", "mass of the link, in the place of what its cross-section weighs")),
    "centre_of_mass": Field(along_axes("length", "centre of mass of the link, base frame at the home pose")),
    "inertia": Field(
        inertia_tensor("inertia of the link about centre_of_mass, base axes at the home pose: xx, yy, zz, xy, xz, yz")
    ),
}
"""Fields of a link about its mass; each needs those before it."""


def tables_of(plan: Plan) -> dict[str, type]:
    """The tables of the plan's machine files, by dotted name."""
    point = along_axes("length", "platform point P at the home pose, base frame")
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
    kind = stiffness_kind(joint.kind, joint.motor)
    if joint.sprung and not joint.series:
        meaning = "its actuator, held by its servo" if joint.actuated else "the joint's own, as of a flexure hinge"
        fields["stiffness"] = Field(Quantity(kind, meaning))
    if joint.preloaded:
        load = LOAD_OF_STIFFNESS[kind]
        fields["preload"] = Field(Quantity(load, "what it carries undeformed, positive if it pulls its ends together"))
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
    # Of a known material the file may leave out what the catalogue says; no material has a temperature.
    material_data = MATERIALS.get(material)
    fields |= {
        name: Field(field.quantity, getattr(material_data, name, field.default))
        for name, field in MATERIAL_FIELDS.items()
    }
    return fields

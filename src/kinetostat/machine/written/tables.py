"""The numbers of a machine written leg by leg: one table for each of its parts, as the plan has them."""

from collections.abc import Mapping
from typing import Any

from kinetostat.algebra.scalar import Scalar, times
from kinetostat.machine.cross_section import MATERIALS, CrossSection, rectangle, rigidity, tube
from kinetostat.machine.leg import RIGID
from kinetostat.machine.link import Rigidity
from kinetostat.machine.written.plan import SHAPES, JointPlan, Plan
from kinetostat.spec.fields import Field, Quantity, made_table

AXIS = Quantity("direction", "direction of the joint, of any length, base axes at the home pose", count=3, apart=True)
POINT = Quantity("length", "a point of the joint, base frame, at the home pose", count=3, apart=True)


JOINT_FIELDS: Mapping[str, Mapping[str, Field]] = {
    "revolute": {"point": Field(POINT), "axis": Field(AXIS)},
    "prismatic": {"point": Field(POINT), "axis": Field(AXIS)},
    "cylindrical": {"point": Field(POINT), "axis": Field(AXIS)},
    "universal": {"point": Field(POINT), "first_axis": Field(AXIS), "second_axis": Field(AXIS)},
    "spherical": {"point": Field(POINT)},
    "helical": {"point": Field(POINT), "axis": Field(AXIS), "pitch": Field(Quantity("length", "advance per radian"))},
    "parallelogram": {
        "point": Field(POINT),
        "far": Field(
            Quantity("length", "middle of the far short side, base frame, at the home pose", count=3, apart=True)
        ),
        "axis": Field(AXIS),
        "width": Field(Quantity("length", "of the short sides", positive=True)),
        "bar_stiffness": Field(Quantity("linear stiffness", "axial stiffness of each bar"), RIGID),
    },
    "fixed": {"point": Field(POINT)},
}

SHAPE_KINDS = {
    "diameter": "length",
    "outer_diameter": "length",
    "inner_diameter": "length",
    "width": "length",
    "height": "length",
    "area": "area",
    "second_moment_y": "second moment of area",
    "second_moment_z": "second moment of area",
    "torsion_constant": "second moment of area",
}

POSE_KINDS = {"x": "length", "y": "length", "z": "length", "roll": "angle", "pitch": "angle", "yaw": "angle"}


def tables_of(plan: Plan) -> dict[str, type]:
    """The tables of the plan's machine files, by dotted name."""
    point = Quantity("length", "platform point P at the home pose, base frame", count=3, apart=True)
    found = {"platform": made_table("Platform", {"point": Field(point)})}
    for name, shape in plan.shapes.items():
        found[f"sections.{name}"] = made_table("CrossSection", _shape_fields(shape, plan.materials[name]))
    for leg in plan.legs:
        for joint in leg.joints:
            found[f"legs.{leg.name}.{joint.name}"] = made_table("JointTable", _joint_fields(joint))
    pose = {name: Field(Quantity(POSE_KINDS[name], f"{name} of the platform")) for name in plan.pose}
    return {**found, "pose": made_table("Pose", pose)}


def _joint_fields(joint: JointPlan) -> dict[str, Field]:
    fields = dict(JOINT_FIELDS[joint.kind])
    if joint.sprung:
        kind = "linear stiffness" if joint.kind == "prismatic" else "torsional stiffness"
        what = "its actuator, held by its servo" if joint.actuated else "the joint's own, as of a flexure hinge"
        fields["stiffness"] = Field(Quantity(kind, what))
    return fields


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
    return fields


def rigidity_of(shape: str, data: Any, shear: bool) -> Rigidity:
    """The rigidity of a bar with a cross-section of the file.

    Args:
        shape: a key of `SHAPES`.
        data: an instance of its table.
        shear: whether it yields in shear (Timoshenko).
    """
    return rigidity(data.youngs_modulus, data.shear_modulus, _profile(shape, data), shear)


def linear_density_of(shape: str, data: Any) -> Scalar:
    """Mass per length of such a bar, kg/m; arguments as for `rigidity_of`."""
    return times(data.density, _profile(shape, data).area)


def _profile(shape: str, data: Any) -> CrossSection:
    poisson = 0.5 * data.youngs_modulus / data.shear_modulus - 1.0
    if shape == "round":
        return tube(data.diameter, 0.0, poisson)
    if shape == "tube":
        return tube(data.outer_diameter, data.inner_diameter, poisson)
    if shape == "rectangle":
        return rectangle(data.width, data.height)
    return CrossSection(data.area, data.second_moment_y, data.second_moment_z, data.torsion_constant, 5.0 / 6.0)

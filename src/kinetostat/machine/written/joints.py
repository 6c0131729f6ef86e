"""The types of joints that a machine written leg by leg may have: what is written about one, and what it is made of.

A type is one row of `JOINT_TYPES`. Reading, units, schema, messages and `--set` follow from its row; how its joints
are joined to legs is `family`'s business. Points and axes are in the base frame, at the home pose.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

from kinetostat.algebra.scalar import Scalar, reciprocal
from kinetostat.algebra.vector import AXES, Z_AXIS, Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import RIGID, Element, Joint, revolutes
from kinetostat.machine.link import Parallelogram, any_up
from kinetostat.spec.errors import choice
from kinetostat.spec.fields import Field, Quantity, along_axes
from kinetostat.units import UnitError, parse

AXIS = Field(along_axes("direction", "direction of the joint, of any length, base axes at the home pose"))
POINT = Field(along_axes("length", "a point of the joint, base frame, at the home pose"))


@dataclass(frozen=True)
class Motor:
    """A freedom of a joint that may have an actuator, while the joint's others stay passive.

    Attributes:
        place: the place of its element among those of the joint.
        stiffness: kind of quantity of its stiffness.
        elements: the elements of the joint with this actuator, where they differ from those without it.
        fields: the fields that it needs besides those of the joint.
    """

    place: int
    stiffness: str
    elements: Callable[[str, Any], Sequence[Element]] | None = None
    fields: Mapping[str, Field] = field(default_factory=dict)


@dataclass(frozen=True)
class JointType:
    """A type of joint.

    Attributes:
        meaning: the meaning of its numbers, in words.
        fields: the fields that a file writes for it, by name.
        elements: makes what the chain of a leg has for a joint, base to platform, from its name and its numbers.
        stiffness: kind of quantity of its stiffness, for a type of one freedom, which may have an actuator or a spring
            of its own; None for all others.
        motors: the motors of a type of several freedoms, those that may have an actuator each, by what `actuated` says.
        seat: directions in which its bearings may have a stiffness: those of `SEAT` in which it does not move.
        bearings_travel: whether bearings given by `seat` go with the body that it moves, as those of a carriage do;
            those of other joints stay on the base side, and so does the matrix of any joint.
        in_plane: direction that its axis must have in a planar machine, "normal" to the plane or "along" it; "always"
            if it has no axis, and empty if a planar machine cannot have it.
    """

    meaning: str
    fields: Mapping[str, Field]
    elements: Callable[[str, Any], Sequence[Element]]
    stiffness: str | None = None
    in_plane: str = ""
    seat: tuple[str, ...] = ()
    bearings_travel: bool = False
    motors: Mapping[str, Motor] = field(default_factory=dict)


SEAT = {
    "radial": Field(
        Quantity(
            "linear stiffness", "stiffness of the bearings in any direction across the joint's axis", positive=True
        )
    ),
    "axial": Field(Quantity("linear stiffness", "stiffness of the bearings along the joint's axis", positive=True)),
    "tilt": Field(
        Quantity("torsional stiffness", "stiffness of the bearings about any axis across the joint's", positive=True)
    ),
    "torsion": Field(
        Quantity("torsional stiffness", "stiffness of the bearings about the joint's axis", positive=True)
    ),
}
"""Directions in which data sheets give the stiffness of a joint: what is written as stiffness_radial and so on."""


def needs_axis(kind: str) -> bool:
    """Whether a type of joint has no axis unless its bearings have a stiffness."""
    return not {"axis", "first_axis"} & JOINT_TYPES[kind].fields.keys()


def departure(data: Any) -> Vector:
    """The point (m) at which the link behind a joint begins: at the far side of a parallelogram, else at the joint."""
    return Vector(*getattr(data, "far", data.point))


def own_axis(data: Any) -> Vector:
    """The axis from which the stiffness of a joint's bearings counts; of a universal joint, the normal of both axes."""
    if hasattr(data, "axis"):
        return Vector(*data.axis)
    return unit(data.first_axis).cross(unit(data.second_axis))


def unit(axis: Sequence[Scalar]) -> Vector:
    """Return the unit vector along an axis as written."""
    vector = Vector(*axis)
    return vector * reciprocal(vector.norm())


def _revolute(name: str, data: Any) -> Sequence[Element]:
    return (Joint(unit(data.axis), Vector(*data.point), name),)


def _prismatic(name: str, data: Any) -> Sequence[Element]:
    return (Joint(unit(data.axis), None, name, carriage=Vector(*data.point)),)


def _cylindrical(name: str, data: Any) -> Sequence[Element]:
    axis = unit(data.axis)
    return Joint(axis, Vector(*data.point), name), Joint(axis, None, name)


def _universal(name: str, data: Any) -> Sequence[Element]:
    return revolutes(Vector(*data.point), [unit(data.first_axis), unit(data.second_axis)], name)


def _spherical(name: str, data: Any) -> Sequence[Element]:
    return revolutes(Vector(*data.point), AXES, name)


def _driven_spherical(name: str, data: Any) -> Sequence[Element]:
    """A spherical joint with a motor: which axes the other freedoms turn about matters, so that the file says it."""
    return revolutes(Vector(*data.point), (unit(data.first_axis), unit(data.second_axis), _normal(data)), name)


def _normal(data: Any) -> Vector:
    """The unit normal of both axes of a joint."""
    normal = unit(data.first_axis).cross(unit(data.second_axis))
    return normal * reciprocal(normal.norm())


def _planar(name: str, data: Any) -> Sequence[Element]:
    point = Vector(*data.point)
    slides = [Joint(unit(axis), None, name, carriage=point) for axis in (data.first_axis, data.second_axis)]
    return *slides, Joint(_normal(data), point, name)


def _helical(name: str, data: Any) -> Sequence[Element]:
    return (Joint(unit(data.axis), Vector(*data.point), name, data.pitch),)


def _parallelogram(name: str, data: Any) -> Sequence[Element]:
    ends = Vector(*data.point), Vector(*data.far)
    return (Parallelogram(name, *ends, unit(data.axis), data.width, data.bar_stiffness),)


def _fixed_joint(_name: str, _data: Any) -> Sequence[Element]:
    return ()


JOINT_TYPES = {
    "revolute": JointType(
        "turns about `axis` through `point`",
        {"point": POINT, "axis": AXIS},
        _revolute,
        stiffness="torsional stiffness",
        seat=("radial", "axial", "tilt"),
        in_plane="normal",
    ),
    "prismatic": JointType(
        "slides along `axis`",
        {"point": POINT, "axis": AXIS},
        _prismatic,
        stiffness="linear stiffness",
        seat=("radial", "tilt", "torsion"),
        bearings_travel=True,
        in_plane="along",
    ),
    "cylindrical": JointType(
        "turns about and slides along `axis` through `point`",
        {"point": POINT, "axis": AXIS},
        _cylindrical,
        seat=("radial", "tilt"),
        bearings_travel=True,
        motors={"rotation": Motor(0, "torsional stiffness"), "translation": Motor(1, "linear stiffness")},
    ),
    "universal": JointType(
        "turns about `first_axis`, then about `second_axis`, both through `point` (Hooke joint)",
        {"point": POINT, "first_axis": AXIS, "second_axis": AXIS},
        _universal,
        seat=("radial", "axial", "torsion"),
        motors={"first_axis": Motor(0, "torsional stiffness"), "second_axis": Motor(1, "torsional stiffness")},
    ),
    "spherical": JointType(
        "turns about `point`",
        {"point": POINT},
        _spherical,
        seat=("radial", "axial"),
        motors={
            name: Motor(i, "torsional stiffness", _driven_spherical, {"first_axis": AXIS, "second_axis": AXIS})
            for i, name in enumerate(("first_axis", "second_axis", "normal"))
        },
    ),
    "planar": JointType(
        "slides along `first_axis`, then along `second_axis`, and turns about their normal through `point`",
        {"point": POINT, "first_axis": AXIS, "second_axis": AXIS},
        _planar,
        seat=("axial", "tilt"),
        bearings_travel=True,
        motors={
            "first_axis": Motor(0, "linear stiffness"),
            "second_axis": Motor(1, "linear stiffness"),
            "rotation": Motor(2, "torsional stiffness"),
        },
    ),
    "helical": JointType(
        "turns about `axis` through `point` and advances by `pitch` per radian",
        {"point": POINT, "axis": AXIS, "pitch": Field(Quantity("length", "advance per radian"))},
        _helical,
        stiffness="torsional stiffness",
        seat=("radial", "axial", "tilt"),
        bearings_travel=True,
    ),
    "parallelogram": JointType(
        "two bars from the short side at `point` to the one at `far`, short sides along `axis`",
        {
            "point": POINT,
            "far": Field(along_axes("length", "middle of the far short side, base frame, at the home pose")),
            "axis": AXIS,
            "width": Field(Quantity("length", "width of the short sides", positive=True)),
            "bar_stiffness": Field(Quantity("linear stiffness", "axial stiffness of each bar"), RIGID),
        },
        _parallelogram,
    ),
    "fixed": JointType(
        "joins two bodies at `point` and does not move",
        {"point": POINT},
        _fixed_joint,
        in_plane="always",
        seat=tuple(SEAT),
    ),
}
"""Types of joints by the name that machine files give them."""

MOTORS = tuple(dict.fromkeys(name for kind in JOINT_TYPES.values() for name in kind.motors))
"""Words of `actuated` for joints with several freedoms."""


LOAD_OF_STIFFNESS = {"linear stiffness": "force", "torsional stiffness": "moment"}
"""Kind of quantity of the load of a spring, by that of its stiffness."""


def stiffness_kind(kind: str, motor: str) -> str:
    """Kind of quantity of the stiffness of a joint's actuator or hinge; `motor` says which freedom it is on, if any."""
    joint_type = JOINT_TYPES[kind]
    if motor:
        return joint_type.motors[motor].stiffness
    return joint_type.stiffness or "torsional stiffness"  # of a type without one it is not used


ONE_FREEDOM = tuple(name for name, kind in JOINT_TYPES.items() if kind.stiffness)
"""Types that may have an actuator or a spring of their own."""


AXIS_FIELDS = ("axis", "first_axis", "second_axis")
"""Fields of a joint that are directions; each may be the name of a joint of the leg, towards which it then points."""


def with_directions(joints: Mapping[str, dict[str, Any]], where: str) -> dict[str, dict[str, Any]]:
    """The joints with numbers in the place of names of joints, and both axes in that of a universal joint's shaft.

    Args:
        joints: the joints of a leg by name, as written.
        where: names the leg in messages.

    Raises:
        InputError: no such joint in the leg.
    """
    result = {}
    for name, written in joints.items():
        joint = dict(written)
        for key in AXIS_FIELDS:
            if isinstance(joint.get(key), str):
                other = choice(joint[key], joints, f'{where}, joint "{name}": {key}, which may name a joint,')
                joint[key] = _direction_to(joint, joints[other], joint[key])
        if joint.get("type") == "universal" and "axis" in joint and not {"first_axis", "second_axis"} & joint.keys():
            joint |= _axes_across(joint.pop("axis"))
        result[name] = joint
    return result


def _direction_to(joint: Mapping[str, Any], other: Mapping[str, Any], as_written: str) -> list[float] | str:
    """From the point of one joint to that of another; the text itself if they are not points, which `spec` refuses."""
    try:
        ends = [[parse(entry, "length") for entry in each.get("point", ())] for each in (joint, other)]
        return [far - near for near, far in zip(*ends, strict=True)]
    except (UnitError, TypeError, ValueError):
        return as_written


def _axes_across(axis: object) -> dict[str, Any]:
    """Axes of a universal joint square to its shaft: the first one level, unless the shaft is upright."""
    try:
        shaft = Vector(*(parse(entry, "direction") for entry in axis))  # type: ignore[attr-defined]
    except (UnitError, TypeError, ValueError):
        return {"first_axis": axis, "second_axis": axis}
    first = Z_AXIS.cross(shaft)
    if not any(first.components()):
        first = any_up(shaft)
    return {"first_axis": list(first.components()), "second_axis": list(shaft.cross(first).components())}

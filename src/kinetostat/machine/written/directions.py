"""Directions that a file gives by the name of another joint of the leg: axis = "ball" points from this joint to it.

They become numbers when the file is read. Points are in the base frame at the home pose.
"""

from collections.abc import Mapping
from typing import Any

from kinetostat.algebra.vector import Z_AXIS, Vector
from kinetostat.machine.link import any_up
from kinetostat.spec.errors import choice
from kinetostat.units import UnitError, parse

AXES = ("axis", "first_axis", "second_axis")


def directed(joints: Mapping[str, dict[str, Any]], where: str) -> None:
    """Put numbers in the place of names of joints, and both axes in the place of a universal joint's shaft.

    Args:
        joints: of a leg by name, as written; they are changed.
        where: names the leg in messages.

    Raises:
        InputError: no such joint in the leg.
    """
    for name, joint in joints.items():
        for field in AXES:
            if isinstance(joint.get(field), str):
                other = choice(joint[field], joints, f'{where}, joint "{name}": {field}, which may name a joint,')
                joint[field] = _between(joint, joints[other], joint[field])
        if joint.get("type") == "universal" and "axis" in joint and not {"first_axis", "second_axis"} & joint.keys():
            joint |= _cross_of(joint.pop("axis"))


def _between(joint: Mapping[str, Any], other: Mapping[str, Any], given: str) -> list[float] | str:
    """From the point of one joint to that of another; as it was given if they are not points, which `spec` refuses."""
    try:
        ends = [[parse(entry, "length") for entry in each.get("point", ())] for each in (joint, other)]
        return [far - near for near, far in zip(*ends, strict=True)]
    except (UnitError, TypeError, ValueError):
        return given


def _cross_of(axis: object) -> dict[str, Any]:
    """Axes of a universal joint square to its shaft: the first one level, unless the shaft is upright."""
    try:
        shaft = Vector(*(parse(entry, "direction") for entry in axis))  # type: ignore[attr-defined]
    except (UnitError, TypeError, ValueError):
        return {"first_axis": axis, "second_axis": axis}
    first = Z_AXIS.cross(shaft)
    if not any(first.components()):
        first = any_up(shaft)
    return {"first_axis": list(first.components()), "second_axis": list(shaft.cross(first).components())}

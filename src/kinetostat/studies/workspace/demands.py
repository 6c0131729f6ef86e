"""What a set of poses asks of legs, joints and actuators: the figures by which they are chosen, limited or not."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from kinetostat.engine.limits import used
from kinetostat.engine.points import Array
from kinetostat.kinematics.limits import READINGS
from kinetostat.machine.limits import Limits
from kinetostat.machine.machine import Machine

EVERYTHING = {
    "shortest_leg": -1e6,
    "longest_leg": 1e6,
    "travel_from": -1e6,
    "travel_to": 1e6,
    "base_joint_angle": math.pi / 2,
    "platform_joint_angle": math.pi / 2,
    "actuator_force": 1e20,
    "actuator_moment": 1e20,
    "leg_diameter": 1e-9,
}
"""Limits that are set but far away: what they are compared with is then known."""
TITLES = {
    "longest_leg": "length of the legs",
    "travel_to": "travel of the slides",
    "base_joint_angle": "angle at the base joints",
    "platform_joint_angle": "angle at the platform joints",
    "actuator_force": "force of the actuators",
    "actuator_moment": "moment of the actuators",
    "leg_diameter": "distance between leg axes",
}
"""By the limit whose measure it is."""


@dataclass(frozen=True)
class Demand:
    """The range of what a limit is about.

    Attributes:
        name: of the limit.
        title: for people.
        least, greatest: over all poses and parts, in the unit.
        unit: m, deg, N or N·m.
    """

    name: str
    title: str
    least: float
    greatest: float
    unit: str


def demands(machine: Machine, poses: Mapping[str, Array]) -> tuple[Demand, ...]:
    """What poses that can be reached ask of a machine; nothing where there are none.

    Args:
        machine: with its load.
        poses: coordinates by leaf path, SI [poses].
    """
    if not next(iter(poses.values())).size:
        return ()
    wanted = {name: value for name, value in EVERYTHING.items() if not (machine.family.planar and "angle" in name)}
    watched = replace(machine, tables={**machine.tables, "limits": Limits(**wanted)})
    found = used(watched, poses)
    told = []
    for name in (name for name in TITLES if name in found):
        ends = sorted(READINGS[name].value(measure) for measure in found[name])
        told.append(Demand(name, TITLES[name], ends[0], ends[1], READINGS[name].unit))
    return tuple(told)

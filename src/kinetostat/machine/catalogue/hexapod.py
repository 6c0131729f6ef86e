"""Gough-Stewart hexapods: six U-P-S legs between two rings of joints, six freedoms.

What people may write about one and its closed-form kinematics. Leg i goes from base joint i to platform joint i.
"""

from typing import Annotated

from kinetostat.algebra.scalar import cos, sin
from kinetostat.algebra.vector import Displacement, Vector, ring, rotation_x, rotation_y, rotation_z
from kinetostat.machine.leg import two_force_legs
from kinetostat.machine.machine import Configuration, Family
from kinetostat.spec.fields import Quantity, section

LEGS = 6
Six = tuple[float, float, float, float, float, float]


@section
class Geometry:
    """Table [geometry]; the base frame has its origin at the base centre, the platform frame at P."""

    base_radius: Annotated[float, Quantity("length", "radius of the base joints", positive=True)]
    base_angles: Annotated[Six, Quantity("angle", "angles of the base joints from x, leg by leg", count=LEGS)]
    platform_radius: Annotated[float, Quantity("length", "radius of the platform joints", positive=True)]
    platform_angles: Annotated[Six, Quantity("angle", "angles of the platform joints from x, leg by leg", count=LEGS)]
    base_height: Annotated[float, Quantity("length", "z of the base joints, base frame")] = 0.0
    platform_height: Annotated[float, Quantity("length", "z of the platform joints, platform frame (from P)")] = 0.0


@section
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Six, Quantity("linear stiffness", "stiffness of the six legs with their actuators held", count=LEGS)
    ]


@section
class Pose:
    """Table [pose]: Q = Rz(yaw) Ry(pitch) Rx(roll)."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P")]
    roll: Annotated[float, Quantity("angle", "rotation about x, first")] = 0.0
    pitch: Annotated[float, Quantity("angle", "rotation about y, second")] = 0.0
    yaw: Annotated[float, Quantity("angle", "rotation about z, last")] = 0.0


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form; every pose can be reached while no leg limits are given.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    turn = rotation_z(cos(pose.yaw), sin(pose.yaw)) @ rotation_y(cos(pose.pitch), sin(pose.pitch))
    turn = turn @ rotation_x(cos(pose.roll), sin(pose.roll))
    platform = Displacement(turn, Vector(pose.x, pose.y, pose.z))
    base = ring(geometry.base_radius, geometry.base_angles, geometry.base_height)
    top = ring(geometry.platform_radius, geometry.platform_angles, geometry.platform_height)
    legs = two_force_legs(base, [platform.apply(point) for point in top], stiffness.actuator)
    return Configuration(platform, tuple(legs), (), 0.5 * (geometry.base_radius + geometry.platform_radius))


FAMILY = Family(
    name="hexapod",
    summary="6 U-P-S legs (Gough-Stewart); freedoms x, y, z, roll, pitch, yaw",
    sections={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
)

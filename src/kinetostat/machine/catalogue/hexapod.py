"""Gough-Stewart hexapods: six struts U-P-S, or cranks R-U-S, between two rings of joints; six freedoms.

The fields of their files and their kinematics in closed form are here. Leg i goes from base joint i to platform joint
i. Points and axes are in the base frame.
"""

from typing import Annotated

from kinetostat.algebra.vector import Displacement, Vector, rotation_of_angles
from kinetostat.machine.leg import RIGID
from kinetostat.machine.rings import Placement, Rings, joint_angles, leg_ends, with_struts_or_cranks
from kinetostat.spec.fields import Quantity, table

LEGS = 6
"""Number of legs, one for each freedom."""
Six = tuple[float, float, float, float, float, float]


@table
class Geometry(Rings):
    """Table [geometry]; the base frame has its origin at the base centre, the platform frame at P."""

    base_angles: Annotated[Six, joint_angles("base", LEGS)]
    platform_angles: Annotated[Six, joint_angles("platform", LEGS)]
    base_height: Annotated[float, Quantity("length", "z of the base joints, base frame")] = 0.0
    platform_height: Annotated[float, Quantity("length", "z of the platform joints, platform frame (from P)")] = 0.0


@table
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Six,
        Quantity("linear stiffness", "stiffness of the six legs with their actuators held", count=LEGS, per_leg=True),
    ]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the legs, EA")] = RIGID


@table
class Pose:
    """Table [pose]; the platform is turned by Rz(yaw) Ry(pitch) Rx(roll) against the base frame."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P")]
    roll: Annotated[float, Quantity("angle", "rotation about x, first")] = 0.0
    pitch: Annotated[float, Quantity("angle", "rotation about y, second")] = 0.0
    yaw: Annotated[float, Quantity("angle", "rotation about z, last")] = 0.0


def hexapod_platform(geometry: Geometry, _stiffness: Stiffness, pose: Pose) -> Placement:
    """Place the platform and the joints at both ends of its legs (SI, base frame).

    No pose is out of reach: strokes are limits, which are compared elsewhere.
    """
    platform = Displacement(rotation_of_angles(pose.roll, pose.pitch, pose.yaw), Vector(pose.x, pose.y, pose.z))
    heights = geometry.base_height, geometry.platform_height
    return Placement(platform, leg_ends(geometry, geometry.base_angles, geometry.platform_angles, platform, *heights))


FAMILIES = with_struts_or_cranks(
    "hexapod",
    (
        "6 U-P-S legs (Gough-Stewart); freedoms x, y, z, roll, pitch, yaw",
        "6 R-U-S legs with actuated cranks; freedoms x, y, z, roll, pitch, yaw",
    ),
    {"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    hexapod_platform,
)

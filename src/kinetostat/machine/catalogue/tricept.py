"""Three U-P-S legs and a central tube U-P (Tricept): a Hooke joint at the base, a slide, the platform built in.

The paper names the class of 3-dof machines but no leg; this leg is chosen here (theory section 4).
"""

from typing import Annotated

from kinetostat.algebra.scalar import cos, sin
from kinetostat.algebra.vector import Y_AXIS, ZERO, Displacement, rotation_x, rotation_y
from kinetostat.machine.leg import RIGID, Joint, Leg, revolutes
from kinetostat.machine.links import LinkKind, from_origin
from kinetostat.machine.parts import built_in_bar, servo
from kinetostat.machine.rings import Placement, Three, ThreeLegs, ends, with_struts_or_cranks
from kinetostat.spec.fields import Quantity, table

LEGS = 3


@table
class Geometry(ThreeLegs):
    """Table [geometry]; the base frame has its origin at the Hooke joint of the tube."""


@table
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Three, Quantity("linear stiffness", "stiffness of the three actuators, Ka", count=LEGS, per_leg=True)
    ]
    tube: Annotated[
        Three,
        Quantity("torsional stiffness", "tube at its platform end: bending about its x and y, torsion", count=3),
    ]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the legs, EA")] = RIGID
    tube_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the tube, EI")] = RIGID
    tube_torsion: Annotated[float, Quantity("torsional rigidity", "torsional rigidity of the tube, GJ")] = RIGID
    tube_actuator: Annotated[
        float, Quantity("linear stiffness", "actuator of the tube's slide; 0 leaves it passive")
    ] = 0.0


@table
class Pose:
    """Table [pose]: Q = Ry(theta1) Rx(theta2), P = length Q z."""

    theta1: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta2: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]
    length: Annotated[float, Quantity("length", "from the Hooke joint to the platform point P", positive=True)]


def placement(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Placement:
    """The platform and the tube, in closed form; every pose can be reached (SI, base frame)."""
    pitch = rotation_y(cos(pose.theta1), sin(pose.theta1))
    turn = pitch @ rotation_x(cos(pose.theta2), sin(pose.theta2))
    platform = Displacement(turn, turn.z * pose.length)
    link = stiffness.tube_bending, stiffness.tube_torsion, pose.length
    springs = built_in_bar("tube", (turn.x, turn.y, turn.z), platform.translation, stiffness.tube, link)
    slide = servo(Joint(turn.z, None, "tube slide"), "tube actuator", stiffness.tube_actuator)
    leg = Leg("tube", (*revolutes(ZERO, (Y_AXIS, pitch.x), "tube Hooke joint"), slide, *springs))
    joints = ends(geometry, geometry.base_angles, geometry.platform_angles, platform)
    return Placement(platform, joints, (leg,))


TUBE = LinkKind("tube", ("tube_bending", "tube_torsion"), from_origin("tube"))

TABLES = {"geometry": Geometry, "stiffness": Stiffness, "pose": Pose}
FAMILY, WITH_CRANKS = with_struts_or_cranks(
    "tricept",
    (
        "3 U-P-S legs and a passive U-P tube (Tricept); freedoms theta1, theta2, length",
        "3 R-U-S legs and a passive U-P tube; freedoms theta1, theta2, length",
    ),
    TABLES,
    placement,
    (TUBE,),
)

"""Three U-P-S legs and a central ram P-U: P slides along the base z axis and carries the platform on a Hooke joint.

The paper names the class of 3-dof machines but no leg; this leg is chosen here (theory section 4).
"""

from typing import Annotated

from kinetostat.algebra.scalar import cos, sin
from kinetostat.algebra.vector import AXES, Y_AXIS, Z_AXIS, ZERO, Displacement, Vector, rotation_x, rotation_y
from kinetostat.machine.leg import RIGID, Joint, Leg, revolutes
from kinetostat.machine.links import LinkKind, from_origin
from kinetostat.machine.parts import built_in_bar, servo
from kinetostat.machine.rings import Placement, Three, ThreeLegs, ends, with_struts_or_cranks
from kinetostat.spec.fields import Quantity, table

LEGS = 3


@table
class Geometry(ThreeLegs):
    """Table [geometry]; the base frame has its origin at the base centre, the ram slides along its z axis."""


@table
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Three, Quantity("linear stiffness", "stiffness of the three actuators, Ka", count=LEGS, per_leg=True)
    ]
    ram: Annotated[
        Three, Quantity("torsional stiffness", "ram at its base end: bending about x and y, torsion about z", count=3)
    ]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the legs, EA")] = RIGID
    ram_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the ram from base to P, EI")] = (
        RIGID
    )
    ram_torsion: Annotated[float, Quantity("torsional rigidity", "torsional rigidity of the ram, GJ")] = RIGID
    ram_actuator: Annotated[float, Quantity("linear stiffness", "actuator of the ram's slide; 0 leaves it passive")] = (
        0.0
    )


@table
class Pose:
    """Table [pose]: Q = Ry(theta1) Rx(theta2)."""

    z: Annotated[float, Quantity("length", "z of the platform point P, on the base axis")]
    theta1: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta2: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def placement(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Placement:
    """The platform and the ram, in closed form; every pose can be reached (SI, base frame)."""
    pitch = rotation_y(cos(pose.theta1), sin(pose.theta1))
    tip = Vector(0.0, 0.0, pose.z)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta2), sin(pose.theta2)), tip)
    link = stiffness.ram_bending, stiffness.ram_torsion, abs(pose.z)
    springs = built_in_bar("ram", AXES, ZERO, stiffness.ram, link)
    slide = servo(Joint(Z_AXIS, None, "ram slide"), "ram actuator", stiffness.ram_actuator)
    leg = Leg("ram", (*springs, slide, *revolutes(tip, (Y_AXIS, pitch.x), "ram Hooke joint")))
    joints = ends(geometry, geometry.base_angles, geometry.platform_angles, platform)
    return Placement(platform, joints, (leg,))


RAM = LinkKind("ram", ("ram_bending", "ram_torsion"), from_origin("ram"))

TABLES = {"geometry": Geometry, "stiffness": Stiffness, "pose": Pose}
FAMILY, WITH_CRANKS = with_struts_or_cranks(
    "passive-leg-3dof-pu",
    (
        "3 U-P-S legs and a passive P-U ram; freedoms z, theta1, theta2",
        "3 R-U-S legs and a passive P-U ram; freedoms z, theta1, theta2",
    ),
    TABLES,
    placement,
    (RAM,),
)

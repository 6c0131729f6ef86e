"""Five U-P-S legs and a passive leg U - link - R - link - U: the 4-dof machine's leg whose base joint is a Hooke joint.

The paper names the class of 5-dof machines but no leg; this leg is chosen here (theory section 4).
"""

from collections.abc import Sequence
from typing import Annotated

from kinetostat.algebra.lines import apex
from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin, sqrt
from kinetostat.algebra.vector import X_AXIS, Y_AXIS, ZERO, Displacement, Rotation, Vector, rotation_x
from kinetostat.machine.catalogue.passive_leg_4dof import (
    PASSIVE_LINKS,
    PassiveLegStiffness,
    PassiveLinks,
    platform_pitch,
)
from kinetostat.machine.leg import Joint, Leg, Spring, revolutes
from kinetostat.machine.machine import Closure
from kinetostat.machine.parts import bent_links, servo
from kinetostat.machine.rings import Placement, ends, joint_angles, with_struts_or_cranks
from kinetostat.spec.fields import Quantity, table

LEGS = 5
Five = tuple[float, float, float, float, float]


@table
class Geometry(PassiveLinks):
    """Table [geometry]; the base frame has its origin O at the foot of the passive leg, z up."""

    base_angles: Annotated[Five, joint_angles("base", LEGS)]
    platform_angles: Annotated[Five, joint_angles("platform", LEGS)]


@table
class Stiffness(PassiveLegStiffness):
    """Table [stiffness]."""

    actuator: Annotated[
        Five, Quantity("linear stiffness", "stiffness of the five actuators, Ka", count=LEGS, per_leg=True)
    ]
    passive_actuator: Annotated[
        float, Quantity("torsional stiffness", "actuator of the passive leg's first foot axis; 0 leaves it passive")
    ] = 0.0


@table
class Pose:
    """Table [pose]: the five task coordinates; Q = Rx(psi) Ry(pitch) Rx(theta6), where psi tilts the leg's plane."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P, above the base", positive=True)]
    theta5: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, normal to the leg's plane")]
    theta6: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def placement(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Placement:
    """The platform and the passive leg: that of the 4-dof machine in a plane tilted about x through O and P.

    In closed form; NaN where the passive leg cannot reach (SI, base frame).
    """
    height = sqrt(pose.y * pose.y + pose.z * pose.z)
    tilt = rotation_x(pose.z * reciprocal(height), -pose.y * reciprocal(height))
    first, second = geometry.passive_links
    tip = Vector(pose.x, 0.0, height)
    elbow, _ = apex(ZERO, tip, first, second)
    links = elbow * (1.0 / first), (tip - elbow) * (1.0 / second)
    pitch = tilt @ platform_pitch(links[1], pose.theta5)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta6), sin(pose.theta6)), tilt.apply(tip))
    bending = bent_links(geometry.passive_links, stiffness.passive_links, stiffness.passive_link_bending)
    springs = tuple(
        Spring(f"passive link {i}", Joint(tilt.apply(Vector(-link.z, 0.0, link.x)), tilt.apply(low)), k)
        for i, (link, low, k) in enumerate(zip(links, (ZERO, elbow), bending, strict=True), 1)
    )
    leg = _passive_leg(tilt, elbow, tip, pitch.x, springs, stiffness.passive_actuator)
    joints = ends(geometry, geometry.base_angles, geometry.platform_angles, platform)
    closure = Closure("passive leg", tip.norm(), abs(first - second), first + second)
    return Placement(platform, joints, (leg,), (closure,))


def _passive_leg(
    tilt: Rotation, elbow: Vector, tip: Vector, last_axis: Vector, springs: Sequence[Spring], actuator: Scalar
) -> Leg:
    """Base Hooke joint along x and the plane's normal, elbow and platform joints along the normal, last along x''."""
    normal = tilt.apply(Y_AXIS)
    end = tilt.apply(tip)
    chain = (
        servo(Joint(X_AXIS, ZERO, "passive leg foot"), "passive leg actuator", actuator),
        Joint(normal, ZERO, "passive leg foot"),
        springs[0],
        Joint(normal, tilt.apply(elbow), "passive leg elbow"),
        springs[1],
        *revolutes(end, (normal, last_axis), "passive leg Hooke joint"),
    )
    return Leg("passive leg", chain)


TABLES = {"geometry": Geometry, "stiffness": Stiffness, "pose": Pose}
FAMILY, WITH_CRANKS = with_struts_or_cranks(
    "passive-leg-5dof",
    (
        "5 U-P-S legs and a passive U-R-U leg; freedoms x, y, z, theta5, theta6",
        "5 R-U-S legs and a passive U-R-U leg; freedoms x, y, z, theta5, theta6",
    ),
    TABLES,
    placement,
    (PASSIVE_LINKS,),
)

"""The paper's machine: four U-P-S legs and a passive leg R - link - R - link - Hooke that leaves four freedoms.

What people may write about it and its closed-form kinematics (theory (12), base frame). Its stiffness is computed
elsewhere, as for any machine.
"""

from typing import Annotated

from kinetostat.algebra.lines import apex
from kinetostat.algebra.scalar import Scalar, cos, sin
from kinetostat.algebra.vector import Y_AXIS, Displacement, Rotation, Vector, rotation_x, rotation_y
from kinetostat.machine.leg import RIGID, Joint, Leg, Spring, revolutes
from kinetostat.machine.links import LinkKind, of_passive_leg
from kinetostat.machine.machine import Closure
from kinetostat.machine.parts import bent_links, servo
from kinetostat.machine.rings import Placement, Rings, four_joints, with_struts_or_cranks
from kinetostat.spec.fields import Quantity, table

LEGS = 4
Four = tuple[float, float, float, float]
Two = tuple[float, float]


@table
class PassiveLinks(Rings):
    """Part of a table [geometry]: the rings, and the two links of the passive leg."""

    passive_links: Annotated[
        Two,
        Quantity("length", "lengths of the passive leg's links l51 (base) and l52 (platform)", positive=True, count=2),
    ]


@table
class Geometry(PassiveLinks):
    """Table [geometry]; the base frame has its origin O at the foot of the passive leg, z up."""

    base_angle: Annotated[float, Quantity("angle", "angle of the first base joint from x, Ta")]
    platform_angle: Annotated[float, Quantity("angle", "angle of the first platform joint from x, Tb")]
    passive_leg_offset: Annotated[
        float, Quantity("length", "y of the plane in which the passive leg and the platform point P move")
    ] = 0.0


@table
class PassiveLegStiffness:
    """Part of a table [stiffness]: what machines have in common whose passive leg has two links."""

    actuator: tuple[float, ...]
    passive_links: Annotated[
        Two,
        Quantity("torsional stiffness", "out-of-plane bending of the links at their lower ends, k52 and k54", count=2),
    ]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the actuated legs, EA")] = RIGID
    passive_link_bending: Annotated[
        Two, Quantity("bending rigidity", "out-of-plane bending rigidity of the passive leg's links, EI", count=2)
    ] = (RIGID, RIGID)


@table
class Stiffness(PassiveLegStiffness):
    """Table [stiffness]."""

    actuator: Annotated[
        Four,
        Quantity(
            "linear stiffness", "stiffness of the four actuators held by their servos, Ka", count=LEGS, per_leg=True
        ),
    ]
    passive_actuator: Annotated[
        float, Quantity("torsional stiffness", "actuator of the passive leg's first revolute; 0 leaves it passive")
    ] = 0.0


@table
class Pose:
    """Table [pose]: the four task coordinates."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P")]
    theta5: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta6: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def placement(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Placement:
    """The platform and the passive leg, in closed form; NaN where the passive leg cannot reach (SI, base frame).

    The elbow lies on the +x side of the line from O to P; el2, the elevation of link 2, fixes the pitch:
    pitch = 90 deg - el2 - theta5, and Q = Ry(pitch) Rx(theta6).
    """
    foot = Vector(0.0, geometry.passive_leg_offset, 0.0)
    tip = Vector(pose.x, geometry.passive_leg_offset, pose.z)
    first, second = geometry.passive_links
    elbow, _ = apex(foot, tip, first, second)
    pitch = platform_pitch((tip - elbow) * (1.0 / second), pose.theta5)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta6), sin(pose.theta6)), tip)
    closure = Closure("passive leg", (tip - foot).norm(), abs(first - second), first + second)
    base = four_joints(geometry.base_radius, geometry.base_angle)
    top = four_joints(geometry.platform_radius, geometry.platform_angle)
    leg = _passive_leg(foot, elbow, tip, pitch.x, geometry, stiffness)
    return Placement(platform, (base, [platform.apply(point) for point in top]), (leg,), (closure,))


def platform_pitch(link: Vector, theta5: Scalar) -> Rotation:
    """Ry(90 deg - el2 - theta5), from the unit vector of link 2 in the leg's plane: (cos el2, 0, sin el2)."""
    c, s = cos(theta5), sin(theta5)
    return rotation_y(link.z * c + link.x * s, link.x * c - link.z * s)


def _passive_leg(
    foot: Vector, elbow: Vector, tip: Vector, last_axis: Vector, geometry: Geometry, stiffness: Stiffness
) -> Leg:
    """Revolutes 51, 53, 55 along y and 56 along the pitched x; virtual joints 52 and 54 bend the links out of plane."""
    first, second = geometry.passive_links
    lower, upper = (elbow - foot) * (1.0 / first), (tip - elbow) * (1.0 / second)
    bending = bent_links(geometry.passive_links, stiffness.passive_links, stiffness.passive_link_bending)
    chain = (
        servo(Joint(Y_AXIS, foot, "passive leg foot"), "passive leg actuator", stiffness.passive_actuator),
        Spring("passive link 1", Joint(Vector(-lower.z, 0.0, lower.x), foot), bending[0]),
        Joint(Y_AXIS, elbow, "passive leg elbow"),
        Spring("passive link 2", Joint(Vector(-upper.z, 0.0, upper.x), elbow), bending[1]),
        *revolutes(tip, (Y_AXIS, last_axis), "passive leg Hooke joint"),
    )
    return Leg("passive leg", chain)


PASSIVE_LINKS = LinkKind(
    "passive_links", ("passive_link_bending",), of_passive_leg("passive link", "passive_links"), count=2
)

TABLES = {"geometry": Geometry, "stiffness": Stiffness, "pose": Pose}
FAMILY, WITH_CRANKS = with_struts_or_cranks(
    "passive-leg-4dof",
    (
        "4 U-P-S legs and a passive R-R-Hooke leg (Zhang and Gosselin); freedoms x, z, theta5, theta6",
        "4 R-U-S legs and a passive R-R-Hooke leg; freedoms x, z, theta5, theta6",
    ),
    TABLES,
    placement,
    (PASSIVE_LINKS,),
)

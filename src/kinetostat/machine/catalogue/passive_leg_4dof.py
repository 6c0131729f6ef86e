"""The paper's machine: four U-P-S legs and a passive leg R - link - R - link - Hooke that leaves four freedoms.

What people may write about it and its closed-form kinematics (theory section 3). Its stiffness is computed elsewhere,
as for any machine.
"""

from typing import Annotated

from kinetostat.algebra.scalar import Scalar, cos, sin
from kinetostat.algebra.triangle import apex
from kinetostat.algebra.vector import Y_AXIS, Displacement, Rotation, Vector, polar, rotation_x, rotation_y
from kinetostat.machine.leg import Joint, Leg, Spring, revolutes, two_force_legs
from kinetostat.machine.machine import Closure, Configuration, Family
from kinetostat.spec.fields import Quantity, section

LEGS = 4


@section
class Geometry:
    """Table [geometry]; the base frame has its origin O at the foot of the passive leg, z up."""

    base_radius: Annotated[float, Quantity("length", "radius of the base joints, Rb", positive=True)]
    platform_radius: Annotated[float, Quantity("length", "radius of the platform joints, Rp", positive=True)]
    base_angle: Annotated[float, Quantity("angle", "angle of the first base joint from x, Ta")]
    platform_angle: Annotated[float, Quantity("angle", "angle of the first platform joint from x, Tb")]
    passive_links: Annotated[
        tuple[float, float],
        Quantity("length", "lengths of the passive leg's links l51 (base) and l52 (platform)", positive=True, count=2),
    ]
    passive_leg_offset: Annotated[
        float, Quantity("length", "y of the plane in which the passive leg and the platform point P move")
    ] = 0.0


@section
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        tuple[float, float, float, float],
        Quantity("linear stiffness", "stiffness of the four actuators held by their servos, Ka", count=LEGS),
    ]
    passive_links: Annotated[
        tuple[float, float],
        Quantity("torsional stiffness", "out-of-plane bending of the links at their lower ends, k52 and k54", count=2),
    ]


@section
class Pose:
    """Table [pose]: the four task coordinates."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P")]
    theta5: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta6: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form.

    The elbow lies on the +x side of the line from O to P; el2, the elevation of link 2, fixes the pitch:
    pitch = 90 deg - el2 - theta5, and Q = Ry(pitch) Rx(theta6).

    Args:
        geometry, stiffness, pose: SI; base frame.

    Returns:
        The passive leg and the four actuated legs, placed; NaN where the passive leg cannot reach.
    """
    foot = Vector(0.0, geometry.passive_leg_offset, 0.0)
    tip = Vector(pose.x, geometry.passive_leg_offset, pose.z)
    first, second = geometry.passive_links
    elbow, _ = apex(foot, tip, first, second)
    pitch = platform_pitch((tip - elbow) * (1.0 / second), pose.theta5)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta6), sin(pose.theta6)), tip)
    closure = Closure("passive leg", (tip - foot).norm(), abs(first - second), first + second)
    passive = _passive_leg(foot, elbow, tip, pitch.x, geometry, stiffness)
    legs = _actuated_legs(platform, geometry, stiffness)
    length = 0.5 * (geometry.base_radius + geometry.platform_radius)
    return Configuration(platform, (passive, *legs), (closure,), length)


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
    chain = (
        Joint(Y_AXIS, foot, "passive leg foot"),
        Spring("passive link 1", Joint(Vector(-lower.z, 0.0, lower.x), foot), stiffness.passive_links[0]),
        Joint(Y_AXIS, elbow, "passive leg elbow"),
        Spring("passive link 2", Joint(Vector(-upper.z, 0.0, upper.x), elbow), stiffness.passive_links[1]),
        *revolutes(tip, (Y_AXIS, last_axis), "passive leg Hooke joint"),
    )
    return Leg("passive leg", chain)


def _actuated_legs(platform: Displacement, geometry: Geometry, stiffness: Stiffness) -> list[Leg]:
    base = attachments(geometry.base_radius, geometry.base_angle)
    top = attachments(geometry.platform_radius, geometry.platform_angle)
    return two_force_legs(base, [platform.apply(point) for point in top], stiffness.actuator)


def attachments(radius: Scalar, angle: Scalar) -> list[Vector]:
    """Joint centres at `radius` (m) and the angles T, 90 deg + T, -(90 deg + T), -T for T = `angle` (rad)."""
    p = polar(radius, angle)
    return [p, Vector(-p.y, p.x, 0.0), Vector(-p.y, -p.x, 0.0), Vector(p.x, -p.y, 0.0)]


FAMILY = Family(
    name="passive-leg-4dof",
    summary="4 U-P-S legs and a passive R-R-Hooke leg (Zhang and Gosselin); freedoms x, z, theta5, theta6",
    sections={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
)

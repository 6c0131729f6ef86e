"""Five U-P-S legs and a passive leg U - link - R - link - U: the 4-dof machine's leg whose base joint is a Hooke joint.

The paper names the class of 5-dof machines but no leg; this one is ours (theory section 4).
"""

from collections.abc import Sequence
from typing import Annotated

from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin, sqrt
from kinetostat.algebra.triangle import apex
from kinetostat.algebra.vector import X_AXIS, Y_AXIS, ZERO, Displacement, Rotation, Vector, rotation_x
from kinetostat.machine.catalogue.passive_leg_4dof import Two, platform_pitch
from kinetostat.machine.guide import Guide
from kinetostat.machine.leg import RIGID, Joint, Leg, Spring, revolutes, two_force_legs
from kinetostat.machine.links import LinkKind, listed, straight_legs
from kinetostat.machine.machine import Closure, Configuration, Family
from kinetostat.machine.parts import bent_links, servo
from kinetostat.machine.rings import Rings, ends
from kinetostat.spec.fields import Quantity, section

LEGS = 5
Five = tuple[float, float, float, float, float]


@section
class Geometry(Rings):
    """Table [geometry]; the base frame has its origin O at the foot of the passive leg, z up."""

    base_angles: Annotated[Five, Quantity("angle", "angles of the base joints from x, leg by leg", count=LEGS)]
    platform_angles: Annotated[Five, Quantity("angle", "angles of the platform joints from x, leg by leg", count=LEGS)]
    passive_links: Annotated[
        Two,
        Quantity("length", "lengths of the passive leg's links l51 (base) and l52 (platform)", positive=True, count=2),
    ]


@section
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[Five, Quantity("linear stiffness", "stiffness of the five actuators, Ka", count=LEGS)]
    passive_links: Annotated[
        Two,
        Quantity("torsional stiffness", "out-of-plane bending of the links at their lower ends, k52 and k54", count=2),
    ]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the actuated legs, EA")] = RIGID
    passive_link_bending: Annotated[
        Two, Quantity("bending rigidity", "out-of-plane bending rigidity of the passive leg's links, EI", count=2)
    ] = (RIGID, RIGID)
    passive_actuator: Annotated[
        float, Quantity("torsional stiffness", "actuator of the passive leg's first foot axis; 0 leaves it passive")
    ] = 0.0


@section
class Pose:
    """Table [pose]: the five task coordinates; Q = Rx(psi) Ry(pitch) Rx(theta6), where psi tilts the leg's plane."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P, above the base", positive=True)]
    theta5: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, normal to the leg's plane")]
    theta6: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def guide(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Guide:
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
    return Guide(platform, leg, (Closure("passive leg", tip.norm(), abs(first - second), first + second),))


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form: the passive leg and five U-P-S legs; NaN out of reach.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    passive = guide(geometry, stiffness, pose)
    base, top = ends(geometry, geometry.base_angles, geometry.platform_angles, passive.platform)
    return passive.moved_by(two_force_legs(base, top, stiffness.actuator, stiffness.leg_axial), geometry.size)


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


PASSIVE_LINKS = LinkKind("passive_links", ("passive_link_bending",), listed("passive link", "passive_links"), count=2)


FAMILY = Family(
    name="passive-leg-5dof",
    summary="5 U-P-S legs and a passive U-R-U leg; freedoms x, y, z, theta5, theta6",
    sections={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
    links=(LinkKind("legs", ("leg_axial",), straight_legs), PASSIVE_LINKS),
)

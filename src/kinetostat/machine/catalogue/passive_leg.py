"""Machines whose actuated legs are guided by a passive leg: struts U-P-S, or cranks R-U-S, around it.

The paper's machine has four actuated legs, and a passive leg of two links that leaves four freedoms; a Hooke joint at
the foot of this leg makes it the machine of five. Of the 3-dof class the paper names no leg: the ram P-U and the tube
U-P (Tricept) are chosen here, and so is the leg of the 5-dof machine. The fields of their files and their kinematics in
closed form (theory (12) and section 4) are here. Points and axes are in the base frame.
"""

from collections.abc import Sequence
from typing import Annotated

from kinetostat.algebra.lines import apex
from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin, sqrt
from kinetostat.algebra.vector import (
    AXES,
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
    ZERO,
    Displacement,
    Rotation,
    Vector,
    rotation_x,
    rotation_y,
)
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, Spring, revolutes
from kinetostat.machine.links import LinkKind, from_origin, of_passive_leg
from kinetostat.machine.machine import Closure
from kinetostat.machine.parts import BarRigidity, bent_links, built_in_bar, servo
from kinetostat.machine.rings import (
    LegEnds,
    Placement,
    Rings,
    Three,
    ThreeLegs,
    four_joints,
    joint_angles,
    leg_ends,
    of_three_legs,
    with_struts_or_cranks,
)
from kinetostat.spec.fields import Quantity, table

Two = tuple[float, float]
Four = tuple[float, float, float, float]
Five = tuple[float, float, float, float, float]


@table
class LinksGeometry(Rings):
    """Part of a table [geometry]: the rings, and the two links of the passive leg."""

    passive_links: Annotated[
        Two,
        Quantity("length", "lengths of the passive leg's links l51 (base) and l52 (platform)", positive=True, count=2),
    ]


@table
class LinksStiffness:
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


def _link_directions(points: Sequence[Vector], lengths: Two) -> tuple[Vector, Vector]:
    """Unit vectors along both links, from the foot, the elbow and the tip of the leg (m)."""
    foot, elbow, tip = points
    first, second = lengths
    return (elbow - foot) * (1.0 / first), (tip - elbow) * (1.0 / second)


def _bending_axis(link: Vector) -> Vector:
    """The axis about which a link in a plane y = constant bends out of it: in the plane, square to the link.

    Within the plane links do not bend: passive revolutes at both ends let them carry only a force along themselves.
    """
    return Vector(-link.z, 0.0, link.x)


def _platform_pitch(upper: Vector, theta5: Scalar) -> Rotation:
    """Ry(90 deg - el2 - theta5), from the unit vector of link 2 in the leg's plane: (cos el2, 0, sin el2)."""
    c, s = cos(theta5), sin(theta5)
    return rotation_y(upper.z * c + upper.x * s, upper.x * c - upper.z * s)


def _two_link_leg(
    foot: Sequence[Element],
    elbow: Joint,
    hooke_joint: Sequence[Joint],
    bending: Sequence[Joint],
    geometry: LinksGeometry,
    stiffness: LinksStiffness,
) -> Leg:
    """The passive leg of two links.

    Args:
        foot, elbow, hooke_joint: its joints, from the base.
        bending: the virtual joints by which link 1 and link 2 bend at their lower ends.
        geometry, stiffness: the numbers of the links.
    """
    lower, upper = bent_links(geometry.passive_links, stiffness.passive_links, stiffness.passive_link_bending)
    links = Spring("passive link 1", bending[0], lower), Spring("passive link 2", bending[1], upper)
    return Leg("passive leg", (*foot, links[0], elbow, links[1], *hooke_joint))


@table
class FourDofGeometry(LinksGeometry):
    """Table [geometry]; the base frame has its origin O at the foot of the passive leg, z up."""

    base_angle: Annotated[float, Quantity("angle", "angle of the first base joint from x, Ta")]
    platform_angle: Annotated[float, Quantity("angle", "angle of the first platform joint from x, Tb")]
    passive_leg_offset: Annotated[
        float, Quantity("length", "y of the plane in which the passive leg and the platform point P move")
    ] = 0.0


@table
class FourDofStiffness(LinksStiffness):
    """Table [stiffness]."""

    actuator: Annotated[
        Four,
        Quantity("linear stiffness", "stiffness of the four actuators held by their servos, Ka", count=4, per_leg=True),
    ]
    passive_actuator: Annotated[
        float, Quantity("torsional stiffness", "actuator of the passive leg's first revolute; 0 leaves it passive")
    ] = 0.0


@table
class FourDofPose:
    """Table [pose]: the four task coordinates."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P")]
    theta5: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta6: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def four_dof_platform(geometry: FourDofGeometry, stiffness: FourDofStiffness, pose: FourDofPose) -> Placement:
    """The platform and the passive leg R - link - R - link - Hooke of the paper's machine, in closed form.

    NaN where the passive leg cannot reach (SI, base frame). The elbow lies on the +x side of the line from O to P; el2,
    the elevation of link 2, fixes the pitch: pitch = 90 deg - el2 - theta5, and Q = Ry(pitch) Rx(theta6). Revolutes 51,
    53, 55 are along y and 56 along the pitched x; the virtual joints 52 and 54 bend the links.
    """
    foot = Vector(0.0, geometry.passive_leg_offset, 0.0)
    tip = Vector(pose.x, geometry.passive_leg_offset, pose.z)
    first, second = geometry.passive_links
    elbow, _ = apex(foot, tip, first, second)
    lower, upper = _link_directions((foot, elbow, tip), geometry.passive_links)
    pitch = _platform_pitch(upper, pose.theta5)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta6), sin(pose.theta6)), tip)
    leg = _two_link_leg(
        (servo(Joint(Y_AXIS, foot, "passive leg foot"), "passive leg actuator", stiffness.passive_actuator),),
        Joint(Y_AXIS, elbow, "passive leg elbow"),
        revolutes(tip, (Y_AXIS, pitch.x), "passive leg Hooke joint"),
        (Joint(_bending_axis(lower), foot), Joint(_bending_axis(upper), elbow)),
        geometry,
        stiffness,
    )
    base = four_joints(geometry.base_radius, geometry.base_angle)
    top = four_joints(geometry.platform_radius, geometry.platform_angle)
    closure = Closure("passive leg", (tip - foot).norm(), abs(first - second), first + second)
    return Placement(platform, LegEnds(base, [platform.apply(point) for point in top]), (leg,), (closure,))


@table
class FiveDofGeometry(LinksGeometry):
    """Table [geometry]; the base frame has its origin O at the foot of the passive leg, z up."""

    base_angles: Annotated[Five, joint_angles("base", 5)]
    platform_angles: Annotated[Five, joint_angles("platform", 5)]


@table
class FiveDofStiffness(LinksStiffness):
    """Table [stiffness]."""

    actuator: Annotated[
        Five, Quantity("linear stiffness", "stiffness of the five actuators, Ka", count=5, per_leg=True)
    ]
    passive_actuator: Annotated[
        float, Quantity("torsional stiffness", "actuator of the passive leg's first foot axis; 0 leaves it passive")
    ] = 0.0


@table
class FiveDofPose:
    """Table [pose]: the five task coordinates.

    Q = Rx(psi) Ry(pitch) Rx(theta6); psi = atan2(-y, z) tilts the leg's plane about x so that it holds P.
    """

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P, above the base", positive=True)]
    theta5: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, normal to the leg's plane")]
    theta6: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def five_dof_platform(geometry: FiveDofGeometry, stiffness: FiveDofStiffness, pose: FiveDofPose) -> Placement:
    """The platform and the passive leg Hooke - link - R - link - Hooke, in closed form.

    It is the leg of the 4-dof machine in a plane through the x axis and P: all is computed as if psi were 0, and tilted
    by psi about x at the end. NaN where the passive leg cannot reach (SI, base frame).
    """
    distance_from_x = sqrt(pose.y * pose.y + pose.z * pose.z)
    tilt = rotation_x(pose.z * reciprocal(distance_from_x), -pose.y * reciprocal(distance_from_x))
    first, second = geometry.passive_links
    tip = Vector(pose.x, 0.0, distance_from_x)
    elbow, _ = apex(ZERO, tip, first, second)
    lower, upper = _link_directions((ZERO, elbow, tip), geometry.passive_links)
    pitch = tilt @ _platform_pitch(upper, pose.theta5)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta6), sin(pose.theta6)), tilt.apply(tip))
    normal, tilted_elbow = tilt.apply(Y_AXIS), tilt.apply(elbow)
    first_axis = Joint(X_AXIS, ZERO, "passive leg foot")
    leg = _two_link_leg(
        (
            servo(first_axis, "passive leg actuator", stiffness.passive_actuator),
            Joint(normal, ZERO, "passive leg foot"),
        ),
        Joint(normal, tilted_elbow, "passive leg elbow"),
        revolutes(platform.translation, (normal, pitch.x), "passive leg Hooke joint"),
        (Joint(tilt.apply(_bending_axis(lower)), ZERO), Joint(tilt.apply(_bending_axis(upper)), tilted_elbow)),
        geometry,
        stiffness,
    )
    joints = leg_ends(geometry, geometry.base_angles, geometry.platform_angles, platform)
    closure = Closure("passive leg", tip.norm(), abs(first - second), first + second)
    return Placement(platform, joints, (leg,), (closure,))


@table
class RamGeometry(ThreeLegs):
    """Table [geometry]; the base frame has its origin at the base centre, the ram slides along its z axis."""


@table
class RamStiffness:
    """Table [stiffness]."""

    actuator: Annotated[Three, of_three_legs("linear stiffness", "stiffness of the three actuators, Ka")]
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
class RamPose:
    """Table [pose]: Q = Ry(theta1) Rx(theta2)."""

    z: Annotated[float, Quantity("length", "z of the platform point P, on the base axis")]
    theta1: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta2: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def ram_platform(geometry: RamGeometry, stiffness: RamStiffness, pose: RamPose) -> Placement:
    """The platform and the ram P-U, built in at the base; every pose can be reached (SI, base frame)."""
    pitch = rotation_y(cos(pose.theta1), sin(pose.theta1))
    tip = Vector(0.0, 0.0, pose.z)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta2), sin(pose.theta2)), tip)
    bar = BarRigidity(stiffness.ram_bending, stiffness.ram_torsion, abs(pose.z))
    springs = built_in_bar("ram", AXES, ZERO, stiffness.ram, bar)
    slide = servo(Joint(Z_AXIS, None, "ram slide"), "ram actuator", stiffness.ram_actuator)
    leg = Leg("ram", (*springs, slide, *revolutes(tip, (Y_AXIS, pitch.x), "ram Hooke joint")))
    return Placement(platform, leg_ends(geometry, geometry.base_angles, geometry.platform_angles, platform), (leg,))


@table
class TubeGeometry(ThreeLegs):
    """Table [geometry]; the base frame has its origin at the Hooke joint of the tube."""


@table
class TubeStiffness:
    """Table [stiffness]."""

    actuator: Annotated[Three, of_three_legs("linear stiffness", "stiffness of the three actuators, Ka")]
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
class TubePose:
    """Table [pose]: Q = Ry(theta1) Rx(theta2), P = length Q z."""

    theta1: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta2: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]
    length: Annotated[float, Quantity("length", "from the Hooke joint to the platform point P", positive=True)]


def tube_platform(geometry: TubeGeometry, stiffness: TubeStiffness, pose: TubePose) -> Placement:
    """The platform and the tube U-P, built in at the platform; every pose can be reached (SI, base frame)."""
    pitch = rotation_y(cos(pose.theta1), sin(pose.theta1))
    turn = pitch @ rotation_x(cos(pose.theta2), sin(pose.theta2))
    platform = Displacement(turn, turn.z * pose.length)
    bar = BarRigidity(stiffness.tube_bending, stiffness.tube_torsion, pose.length)
    springs = built_in_bar("tube", (turn.x, turn.y, turn.z), platform.translation, stiffness.tube, bar)
    slide = servo(Joint(turn.z, None, "tube slide"), "tube actuator", stiffness.tube_actuator)
    leg = Leg("tube", (*revolutes(ZERO, (Y_AXIS, pitch.x), "tube Hooke joint"), slide, *springs))
    return Placement(platform, leg_ends(geometry, geometry.base_angles, geometry.platform_angles, platform), (leg,))


PASSIVE_LINKS = LinkKind(
    "passive_links", ("passive_link_bending",), of_passive_leg("passive link", "passive_links"), count=2
)

FAMILIES = (
    *with_struts_or_cranks(
        "passive-leg-4dof",
        (
            "4 U-P-S legs and a passive R-R-Hooke leg (Zhang and Gosselin); freedoms x, z, theta5, theta6",
            "4 R-U-S legs and a passive R-R-Hooke leg; freedoms x, z, theta5, theta6",
        ),
        {"geometry": FourDofGeometry, "stiffness": FourDofStiffness, "pose": FourDofPose},
        four_dof_platform,
        (PASSIVE_LINKS,),
    ),
    *with_struts_or_cranks(
        "passive-leg-5dof",
        (
            "5 U-P-S legs and a passive U-R-U leg; freedoms x, y, z, theta5, theta6",
            "5 R-U-S legs and a passive U-R-U leg; freedoms x, y, z, theta5, theta6",
        ),
        {"geometry": FiveDofGeometry, "stiffness": FiveDofStiffness, "pose": FiveDofPose},
        five_dof_platform,
        (PASSIVE_LINKS,),
    ),
    *with_struts_or_cranks(
        "passive-leg-3dof-pu",
        (
            "3 U-P-S legs and a passive P-U ram; freedoms z, theta1, theta2",
            "3 R-U-S legs and a passive P-U ram; freedoms z, theta1, theta2",
        ),
        {"geometry": RamGeometry, "stiffness": RamStiffness, "pose": RamPose},
        ram_platform,
        (LinkKind("ram", ("ram_bending", "ram_torsion"), from_origin("ram")),),
    ),
    *with_struts_or_cranks(
        "tricept",
        (
            "3 U-P-S legs and a passive U-P tube (Tricept); freedoms theta1, theta2, length",
            "3 R-U-S legs and a passive U-P tube; freedoms theta1, theta2, length",
        ),
        {"geometry": TubeGeometry, "stiffness": TubeStiffness, "pose": TubePose},
        tube_platform,
        (LinkKind("tube", ("tube_bending", "tube_torsion"), from_origin("tube")),),
    ),
)

"""Planar machines: three legs in the x-y plane between two rings of joints; freedoms x, y and one angle.

The slides of the 3-RPR are actuated, and the base revolutes of the 3-RRR. The fields of their files and their
kinematics in closed form (theory section 4) are here. Points and axes are in the base frame.

Source: Gosselin and Angeles, "The optimum kinematic design of a planar three-degree-of-freedom parallel manipulator"
(1988), for the architecture of the 3-RRR; symbols are those of the theory.
"""

from typing import Annotated

from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin
from kinetostat.algebra.vector import Z_AXIS, Displacement, Vector, rotation_z
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, Line, PartName, Spring
from kinetostat.machine.links import LinkKind, in_each_leg, straight_legs
from kinetostat.machine.machine import Configuration, Family, Plane
from kinetostat.machine.parts import Arm, if_elastic, per_length, two_force_legs
from kinetostat.machine.rings import (
    CrankLinks,
    LegEnds,
    PlacedLeg,
    Three,
    ThreeLegs,
    leg_ends,
    legs_and_closures,
    of_three_legs,
    place_elbow,
)
from kinetostat.spec.fields import Quantity, table


@table
class Pose:
    """Table [pose]."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    angle: Annotated[float, Quantity("angle", "rotation of the platform about z")]


def platform_and_joints(geometry: ThreeLegs, pose: Pose) -> tuple[Displacement, LegEnds]:
    """The platform in the x-y plane, and base and platform joints of its legs (SI, base frame)."""
    platform = Displacement(rotation_z(cos(pose.angle), sin(pose.angle)), Vector(pose.x, pose.y, 0.0))
    return platform, leg_ends(geometry, geometry.base_angles, geometry.platform_angles, platform)


@table
class SlideGeometry(ThreeLegs):
    """Table [geometry]; all joints lie in the x-y plane, the base ones about O, the platform ones about P."""


@table
class SlideStiffness:
    """Table [stiffness]."""

    actuator: Annotated[Three, of_three_legs("linear stiffness", "stiffness of the three actuated slides")]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the legs, EA")] = RIGID


def planar_3rpr(geometry: SlideGeometry, stiffness: SlideStiffness, pose: Pose) -> Configuration:
    """The 3-RPR at a pose, in closed form; every pose can be reached while no leg limits are given (SI, base frame)."""
    platform, joints = platform_and_joints(geometry, pose)
    legs = two_force_legs(*joints, stiffness.actuator, stiffness.leg_axial, [Z_AXIS])
    return Configuration(platform, tuple(legs), (), geometry.size, Plane())


@table
class CrankGeometry(ThreeLegs):
    """Table [geometry]; all joints lie in the x-y plane, the base ones about O, the platform ones about P."""

    proximal_link: Annotated[float, Quantity("length", "from the actuated base revolute to the elbow", positive=True)]
    distal_link: Annotated[float, Quantity("length", "from the elbow to the platform joint", positive=True)]


@table
class CrankStiffness:
    """Table [stiffness]."""

    actuator: Annotated[Three, of_three_legs("torsional stiffness", "stiffness of the actuated revolutes")]
    proximal_bending: Annotated[
        float, Quantity("bending rigidity", "bending rigidity of the proximal links in the plane, EI")
    ] = RIGID
    distal_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the distal links, EA")] = RIGID


def planar_3rrr(geometry: CrankGeometry, stiffness: CrankStiffness, pose: Pose) -> Configuration:
    """The 3-RRR at a pose, in closed form; NaN where a leg does not reach (SI, base frame).

    All elbows lie on the left of the way from base joint to platform joint, seen from +z.
    """
    platform, joints = platform_and_joints(geometry, pose)
    links = CrankLinks(geometry.proximal_link, geometry.distal_link, stiffness.proximal_bending, stiffness.distal_axial)
    legs, closures = legs_and_closures(
        _crank_leg(f"leg {i}", base, tip, k, links)
        for i, (base, tip, k) in enumerate(zip(*joints, stiffness.actuator, strict=True), 1)
    )
    return Configuration(platform, legs, closures, geometry.size, Plane())


def _crank_leg(name: str, base: Vector, tip: Vector, stiffness: Scalar, links: CrankLinks) -> PlacedLeg:
    """R-R-R: a force along the distal link; the base revolute is two springs, actuator and 3 EI / length (Table I)."""
    elbow, closures = place_elbow(name, base, tip, Z_AXIS, links)
    along, pivot = (tip - elbow) * reciprocal(links.rod), Joint(Z_AXIS, base)
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), pivot, stiffness, actuated=True),
        *if_elastic(Spring(PartName(name, "proximal link"), pivot, per_length(links.bending, links.crank, 3.0))),
        Arm(base, elbow),
        Joint(Z_AXIS, elbow, f"{name} elbow"),
        *if_elastic(Spring(PartName(name, "distal link"), Joint(along), per_length(links.axial, links.rod))),
        Joint(Z_AXIS, tip, f"{name} platform joint"),
    )
    return Leg(name, chain, (Line(tip, along),)), closures


FAMILIES = (
    Family(
        name="planar-3rpr",
        summary="planar: 3 R-P-R legs with actuated slides; freedoms x, y, angle",
        tables={"geometry": SlideGeometry, "stiffness": SlideStiffness, "pose": Pose},
        configure=planar_3rpr,
        links=(LinkKind("legs", ("leg_axial",), straight_legs),),
        planar=True,
    ),
    Family(
        name="planar-3rrr",
        summary="planar: 3 R-R-R legs with actuated base revolutes; freedoms x, y, angle",
        tables={"geometry": CrankGeometry, "stiffness": CrankStiffness, "pose": Pose},
        configure=planar_3rrr,
        links=(
            LinkKind("proximal_links", ("proximal_bending",), in_each_leg("proximal link", "proximal_link", 0)),
            LinkKind("distal_links", ("distal_axial",), in_each_leg("distal link", "distal_link", 1)),
        ),
        planar=True,
    ),
)

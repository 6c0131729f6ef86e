"""Planar 3-RRR: three legs R-R-R in the x-y plane, their base revolutes actuated; freedoms x, y and one angle.

All elbows lie on the left of the way from base joint to platform joint, seen from +z (theory section 4).
Source: Gosselin and Angeles, "The optimum kinematic design of a planar three-degree-of-freedom parallel manipulator"
(1988), for the architecture; symbols are those of the theory.
"""

from typing import Annotated

from kinetostat.algebra.scalar import Scalar, reciprocal
from kinetostat.algebra.vector import Z_AXIS, Vector
from kinetostat.machine.catalogue.planar_3rpr import LEGS, Pose, platform_and_joints
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, Line, PartName, Spring, with_numbers
from kinetostat.machine.links import LinkKind, in_each_leg
from kinetostat.machine.machine import Closure, Configuration, Family, Plane
from kinetostat.machine.parts import Arm, if_elastic, per_length
from kinetostat.machine.rings import CrankLinks, Three, ThreeLegs, place
from kinetostat.spec.fields import Quantity, table


@table
class Geometry(ThreeLegs):
    """Table [geometry]; all joints lie in the x-y plane, the base ones about O, the platform ones about P."""

    proximal_link: Annotated[float, Quantity("length", "from the actuated base revolute to the elbow", positive=True)]
    distal_link: Annotated[float, Quantity("length", "from the elbow to the platform joint", positive=True)]


@table
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Three, Quantity("torsional stiffness", "stiffness of the actuated revolutes", count=LEGS, per_leg=True)
    ]
    proximal_bending: Annotated[
        float, Quantity("bending rigidity", "bending rigidity of the proximal links in the plane, EI")
    ] = RIGID
    distal_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the distal links, EA")] = RIGID


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form; NaN where a leg does not reach.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    platform, joints = platform_and_joints(geometry, pose)
    links = CrankLinks(geometry.proximal_link, geometry.distal_link, stiffness.proximal_bending, stiffness.distal_axial)
    built = [
        _leg(f"leg {i}", base, tip, k, links)
        for i, (base, tip, k) in enumerate(zip(*joints, stiffness.actuator, strict=True), 1)
    ]
    limits = tuple(limit for _, conditions in built for limit in conditions)
    return Configuration(platform, tuple(with_numbers(leg for leg, _ in built)), limits, geometry.size, Plane())


def _leg(name: str, base: Vector, tip: Vector, stiffness: Scalar, links: CrankLinks) -> tuple[Leg, tuple[Closure, ...]]:
    """R-R-R: a force along the distal link; the base revolute is two springs, actuator and 3 EI / length (Table I)."""
    elbow, limits = place(name, base, tip, Z_AXIS, links)
    along, pivot = (tip - elbow) * reciprocal(links.rod), Joint(Z_AXIS, base)
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), pivot, stiffness, actuated=True),
        *if_elastic(Spring(PartName(name, "proximal link"), pivot, per_length(links.bending, links.crank, 3.0))),
        Arm(base, elbow),
        Joint(Z_AXIS, elbow, f"{name} elbow"),
        *if_elastic(Spring(PartName(name, "distal link"), Joint(along), per_length(links.axial, links.rod))),
        Joint(Z_AXIS, tip, f"{name} platform joint"),
    )
    return Leg(name, chain, (Line(tip, along),)), limits


FAMILY = Family(
    name="planar-3rrr",
    summary="planar: 3 R-R-R legs with actuated base revolutes; freedoms x, y, angle",
    tables={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
    links=(
        LinkKind("proximal_links", ("proximal_bending",), in_each_leg("proximal link", "proximal_link", 0)),
        LinkKind("distal_links", ("distal_axial",), in_each_leg("distal link", "distal_link", 1)),
    ),
    planar=True,
)

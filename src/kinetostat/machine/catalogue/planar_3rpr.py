"""Planar 3-RPR: three legs R-P-R in the x-y plane, their slides actuated; freedoms x, y and one angle.

What people may write about one and its closed-form kinematics (theory section 4).
"""

from typing import Annotated

from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin
from kinetostat.algebra.vector import Z_AXIS, Displacement, Vector, rotation_z
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, Line, PartName, Spring, with_numbers
from kinetostat.machine.links import LinkKind, straight_legs
from kinetostat.machine.machine import Configuration, Family, Plane
from kinetostat.machine.parts import if_elastic, per_length
from kinetostat.machine.rings import Three, ThreeLegs, ends
from kinetostat.spec.fields import Quantity, table

LEGS = 3


@table
class Geometry(ThreeLegs):
    """Table [geometry]; all joints lie in the x-y plane, the base ones about O, the platform ones about P."""


@table
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Three, Quantity("linear stiffness", "stiffness of the three actuated slides", count=LEGS, per_leg=True)
    ]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the legs, EA")] = RIGID


@table
class Pose:
    """Table [pose]."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    angle: Annotated[float, Quantity("angle", "rotation of the platform about z")]


def platform_and_joints(geometry: ThreeLegs, pose: Pose) -> tuple[Displacement, tuple[list[Vector], list[Vector]]]:
    """The platform in the x-y plane, and base and platform joints of its legs (SI, base frame)."""
    platform = Displacement(rotation_z(cos(pose.angle), sin(pose.angle)), Vector(pose.x, pose.y, 0.0))
    return platform, ends(geometry, geometry.base_angles, geometry.platform_angles, platform)


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form; every pose can be reached while no leg limits are given.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    platform, joints = platform_and_joints(geometry, pose)
    legs = [
        planar_leg(f"leg {i}", base, tip, k, stiffness.leg_axial)
        for i, (base, tip, k) in enumerate(zip(*joints, stiffness.actuator, strict=True), 1)
    ]
    return Configuration(platform, tuple(with_numbers(legs)), (), geometry.size, Plane())


def planar_leg(name: str, base: Vector, tip: Vector, stiffness: Scalar, axial: Scalar) -> Leg:
    """Return a leg R-P-R with an actuated slide: it carries a force along the line of its joints.

    Args:
        name: the name of the leg.
        base, tip: its joints on the base and on the platform, base frame, m.
        stiffness: the stiffness of the actuator, N/m.
        axial: axial rigidity EA, N.
    """
    span = tip - base
    size = span.norm()
    along = span * reciprocal(size)
    chain: tuple[Element, ...] = (
        Joint(Z_AXIS, base, f"{name} base joint"),
        Spring(PartName(name, "actuator"), Joint(along), stiffness, actuated=True),
        *if_elastic(Spring(PartName(name, "rod"), Joint(along), per_length(axial, size))),
        Joint(Z_AXIS, tip, f"{name} platform joint"),
    )
    return Leg(name, chain, (Line(tip, along),))


FAMILY = Family(
    name="planar-3rpr",
    summary="planar: 3 R-P-R legs with actuated slides; freedoms x, y, angle",
    tables={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
    links=(LinkKind("legs", ("leg_axial",), straight_legs),),
    planar=True,
)

"""Three U-P-S legs and a central tube U-P (Tricept): a Hooke joint at the base, a slide, the platform built in.

The paper names the class of 3-dof machines but no leg; this one is ours (theory section 4).
"""

from typing import Annotated

from kinetostat.algebra.scalar import cos, sin
from kinetostat.algebra.vector import Y_AXIS, ZERO, Displacement, ring, rotation_x, rotation_y
from kinetostat.machine.leg import Joint, Leg, Spring, revolutes, two_force_legs
from kinetostat.machine.machine import Configuration, Family
from kinetostat.spec.fields import Quantity, section

LEGS = 3
Three = tuple[float, float, float]


@section
class Geometry:
    """Table [geometry]; the base frame has its origin at the Hooke joint of the tube."""

    base_radius: Annotated[float, Quantity("length", "radius of the base joints, Rb", positive=True)]
    base_angles: Annotated[Three, Quantity("angle", "angles of the base joints from x, leg by leg", count=LEGS)]
    platform_radius: Annotated[float, Quantity("length", "radius of the platform joints, Rp", positive=True)]
    platform_angles: Annotated[Three, Quantity("angle", "angles of the platform joints from x, leg by leg", count=LEGS)]


@section
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[Three, Quantity("linear stiffness", "stiffness of the three actuators, Ka", count=LEGS)]
    tube: Annotated[
        Three,
        Quantity("torsional stiffness", "tube at its platform end: bending about its x and y, torsion", count=3),
    ]


@section
class Pose:
    """Table [pose]: Q = Ry(theta1) Rx(theta2), P = length Q z."""

    theta1: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta2: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]
    length: Annotated[float, Quantity("length", "from the Hooke joint to the platform point P", positive=True)]


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    pitch = rotation_y(cos(pose.theta1), sin(pose.theta1))
    turn = pitch @ rotation_x(cos(pose.theta2), sin(pose.theta2))
    platform = Displacement(turn, turn.z * pose.length)
    springs = tuple(
        Spring(f"tube {name}", Joint(axis, platform.translation), k)
        for name, axis, k in zip(
            ("bending x", "bending y", "torsion"), (turn.x, turn.y, turn.z), stiffness.tube, strict=True
        )
    )
    joints = (*revolutes(ZERO, (Y_AXIS, pitch.x), "tube Hooke joint"), Joint(turn.z, None, "tube slide"))
    tube = Leg("tube", (*joints, *springs))
    base = ring(geometry.base_radius, geometry.base_angles)
    top = [platform.apply(point) for point in ring(geometry.platform_radius, geometry.platform_angles)]
    legs = two_force_legs(base, top, stiffness.actuator)
    return Configuration(platform, (tube, *legs), (), 0.5 * (geometry.base_radius + geometry.platform_radius))


FAMILY = Family(
    name="tricept",
    summary="3 U-P-S legs and a passive U-P tube (Tricept); freedoms theta1, theta2, length",
    sections={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
)

"""Three U-P-S legs and a central ram P-U: P slides along the base z axis and carries the platform on a Hooke joint.

The paper names the class of 3-dof machines but no leg; this one is ours (theory section 4).
"""

from typing import Annotated

from kinetostat.algebra.scalar import cos, sin
from kinetostat.algebra.vector import AXES, Y_AXIS, Z_AXIS, ZERO, Displacement, Vector, ring, rotation_x, rotation_y
from kinetostat.machine.leg import Joint, Leg, Spring, revolutes, two_force_legs
from kinetostat.machine.machine import Configuration, Family
from kinetostat.spec.fields import Quantity, section

LEGS = 3
Three = tuple[float, float, float]


@section
class Geometry:
    """Table [geometry]; the base frame has its origin at the base centre, the ram slides along its z axis."""

    base_radius: Annotated[float, Quantity("length", "radius of the base joints, Rb", positive=True)]
    base_angles: Annotated[Three, Quantity("angle", "angles of the base joints from x, leg by leg", count=LEGS)]
    platform_radius: Annotated[float, Quantity("length", "radius of the platform joints, Rp", positive=True)]
    platform_angles: Annotated[Three, Quantity("angle", "angles of the platform joints from x, leg by leg", count=LEGS)]


@section
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[Three, Quantity("linear stiffness", "stiffness of the three actuators, Ka", count=LEGS)]
    ram: Annotated[
        Three, Quantity("torsional stiffness", "ram at its base end: bending about x and y, torsion about z", count=3)
    ]


@section
class Pose:
    """Table [pose]: Q = Ry(theta1) Rx(theta2)."""

    z: Annotated[float, Quantity("length", "z of the platform point P, on the base axis")]
    theta1: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, about y")]
    theta2: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    pitch = rotation_y(cos(pose.theta1), sin(pose.theta1))
    tip = Vector(0.0, 0.0, pose.z)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta2), sin(pose.theta2)), tip)
    springs = tuple(
        Spring(f"ram {name}", Joint(axis, ZERO), k)
        for name, axis, k in zip(("bending x", "bending y", "torsion"), AXES, stiffness.ram, strict=True)
    )
    ram = Leg("ram", (*springs, Joint(Z_AXIS, None, "ram slide"), *revolutes(tip, (Y_AXIS, pitch.x), "ram Hooke joint")))
    base = ring(geometry.base_radius, geometry.base_angles)
    top = [platform.apply(point) for point in ring(geometry.platform_radius, geometry.platform_angles)]
    legs = two_force_legs(base, top, stiffness.actuator)
    return Configuration(platform, (ram, *legs), (), 0.5 * (geometry.base_radius + geometry.platform_radius))


FAMILY = Family(
    name="passive-leg-3dof-pu",
    summary="3 U-P-S legs and a passive P-U ram; freedoms z, theta1, theta2",
    sections={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
)

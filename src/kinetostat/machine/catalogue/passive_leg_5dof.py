"""Five U-P-S legs and a passive leg U - link - R - link - U: the 4-dof machine's leg whose base joint is a Hooke joint.

The paper names the class of 5-dof machines but no leg; this one is ours (theory section 4).
"""

from typing import Annotated

from kinetostat.algebra.scalar import cos, reciprocal, sin, sqrt
from kinetostat.algebra.triangle import apex
from kinetostat.algebra.vector import X_AXIS, Y_AXIS, ZERO, Displacement, Rotation, Vector, ring, rotation_x
from kinetostat.machine.catalogue.passive_leg_4dof import platform_pitch
from kinetostat.machine.leg import Joint, Leg, Spring, revolutes, two_force_legs
from kinetostat.machine.machine import Closure, Configuration, Family
from kinetostat.spec.fields import Quantity, section

LEGS = 5
Five = tuple[float, float, float, float, float]


@section
class Geometry:
    """Table [geometry]; the base frame has its origin O at the foot of the passive leg, z up."""

    base_radius: Annotated[float, Quantity("length", "radius of the base joints, Rb", positive=True)]
    base_angles: Annotated[Five, Quantity("angle", "angles of the base joints from x, leg by leg", count=LEGS)]
    platform_radius: Annotated[float, Quantity("length", "radius of the platform joints, Rp", positive=True)]
    platform_angles: Annotated[Five, Quantity("angle", "angles of the platform joints from x, leg by leg", count=LEGS)]
    passive_links: Annotated[
        tuple[float, float],
        Quantity("length", "lengths of the passive leg's links l51 (base) and l52 (platform)", positive=True, count=2),
    ]


@section
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[Five, Quantity("linear stiffness", "stiffness of the five actuators, Ka", count=LEGS)]
    passive_links: Annotated[
        tuple[float, float],
        Quantity("torsional stiffness", "out-of-plane bending of the links at their lower ends, k52 and k54", count=2),
    ]


@section
class Pose:
    """Table [pose]: the five task coordinates; Q = Rx(psi) Ry(pitch) Rx(theta6), where psi tilts the leg's plane."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P, above the base", positive=True)]
    theta5: Annotated[float, Quantity("angle", "angle of the Hooke joint's first axis, normal to the leg's plane")]
    theta6: Annotated[float, Quantity("angle", "angle of the Hooke joint's second axis, about the pitched x")]


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form: the 4-dof machine's leg in a plane tilted about x through O and P.

    Args:
        geometry, stiffness, pose: SI; base frame.

    Returns:
        The passive leg and the five actuated legs, placed; NaN where the passive leg cannot reach.
    """
    height = sqrt(pose.y * pose.y + pose.z * pose.z)
    tilt = rotation_x(pose.z * reciprocal(height), -pose.y * reciprocal(height))
    first, second = geometry.passive_links
    flat_tip = Vector(pose.x, 0.0, height)
    elbow, _ = apex(ZERO, flat_tip, first, second)
    lower, upper = elbow * (1.0 / first), (flat_tip - elbow) * (1.0 / second)
    pitch = tilt @ platform_pitch(upper, pose.theta5)
    platform = Displacement(pitch @ rotation_x(cos(pose.theta6), sin(pose.theta6)), tilt.apply(flat_tip))
    passive = _passive_leg(tilt, elbow, flat_tip, (lower, upper), pitch.x, stiffness)
    base = ring(geometry.base_radius, geometry.base_angles)
    top = [platform.apply(point) for point in ring(geometry.platform_radius, geometry.platform_angles)]
    legs = two_force_legs(base, top, stiffness.actuator)
    closure = Closure("passive leg", flat_tip.norm(), abs(first - second), first + second)
    length = 0.5 * (geometry.base_radius + geometry.platform_radius)
    return Configuration(platform, (passive, *legs), (closure,), length)


def _passive_leg(
    tilt: Rotation, elbow: Vector, tip: Vector, links: tuple[Vector, Vector], last_axis: Vector, stiffness: Stiffness
) -> Leg:
    """Base Hooke joint along x and the plane's normal, elbow and platform joints along the normal, last along x''."""
    normal = tilt.apply(Y_AXIS)
    knee, end = tilt.apply(elbow), tilt.apply(tip)
    bending = [tilt.apply(Vector(-link.z, 0.0, link.x)) for link in links]
    chain = (
        *revolutes(ZERO, (X_AXIS, normal), "passive leg foot"),
        Spring("passive link 1", Joint(bending[0], ZERO), stiffness.passive_links[0]),
        Joint(normal, knee, "passive leg elbow"),
        Spring("passive link 2", Joint(bending[1], knee), stiffness.passive_links[1]),
        *revolutes(end, (normal, last_axis), "passive leg Hooke joint"),
    )
    return Leg("passive leg", chain)


FAMILY = Family(
    name="passive-leg-5dof",
    summary="5 U-P-S legs and a passive U-R-U leg; freedoms x, y, z, theta5, theta6",
    sections={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
)

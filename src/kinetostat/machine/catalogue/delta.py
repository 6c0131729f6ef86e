"""Delta: three actuated cranks, each with a pair of bars that keeps the platform from turning; freedoms x, y, z.

Source: R. Clavel, "Delta, a fast robot with parallel geometry" (1988), for the architecture; symbols as in
theory section 4. The base plate is at z = 0, the platform below it.
"""

from typing import Annotated

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import IDENTITY, Z_AXIS, Displacement, Vector, polar, ring
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, PartName, Spring, with_numbers
from kinetostat.machine.links import LinkKind, in_each_leg
from kinetostat.machine.machine import Closure, Configuration, Family
from kinetostat.machine.parts import Arm, BarPair, Translations
from kinetostat.machine.rings import CrankLinks, Rings, Three, place
from kinetostat.spec.fields import Quantity, table

LEGS = 3


@table
class Geometry(Rings):
    """Table [geometry]; the base frame has its origin at the base centre, the platform's axes stay parallel to it."""

    leg_angles: Annotated[
        Three,
        Quantity("angle", "angles of the legs from x, in base and platform", count=LEGS, per_leg=True, apart=True),
    ]
    arm_length: Annotated[
        float, Quantity("length", "from the actuated revolute to the middle of the elbow", positive=True)
    ]
    bar_length: Annotated[float, Quantity("length", "of the bars, from elbow to platform", positive=True)]
    bar_spacing: Annotated[float, Quantity("length", "distance of the two bars of a leg", positive=True)]


@table
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Three, Quantity("torsional stiffness", "stiffness of the actuated revolutes", count=LEGS, per_leg=True)
    ]
    bar_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of each bar, EA")] = RIGID
    arm_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the arms, EI")] = RIGID
    arm_torsion: Annotated[float, Quantity("torsional rigidity", "torsional rigidity of the arms, GJ")] = RIGID


def configure(geometry: Geometry, stiffness: Stiffness, pose: Translations) -> Configuration:
    """The machine at a pose, in closed form, elbows outward; NaN where the bars do not reach.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    tip = Vector(pose.x, pose.y, pose.z)
    base, top = ring(geometry.base_radius, geometry.leg_angles), ring(geometry.platform_radius, geometry.leg_angles)
    radial = [polar(1.0, angle) for angle in geometry.leg_angles]
    placed = [
        _leg(f"leg {i}", low, tip + high, outward.cross(Z_AXIS), k, geometry, stiffness)
        for i, (low, high, outward, k) in enumerate(zip(base, top, radial, stiffness.actuator, strict=True), 1)
    ]
    limits = tuple(limit for _, conditions in placed for limit in conditions)
    return Configuration(
        Displacement(IDENTITY, tip), tuple(with_numbers(leg for leg, _ in placed)), limits, geometry.size
    )


def _leg(
    name: str, base: Vector, tip: Vector, axis: Vector, actuator: Scalar, geometry: Geometry, stiffness: Stiffness
) -> tuple[Leg, tuple[Closure, ...]]:
    """R - arm - pair of bars; `axis` of the revolute such that an elbow at +90 deg from a way down is outward."""
    elbow, limits = place(name, base, tip, axis, CrankLinks(geometry.arm_length, geometry.bar_length))
    bars = BarPair(name, elbow, tip, axis, geometry.bar_length, geometry.bar_spacing, stiffness.bar_axial)
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), Joint(axis, base), actuator, actuated=True),
        Arm(base, elbow, PartName(name, "arm"), axis, stiffness.arm_bending, stiffness.arm_torsion),
        *bars.chain,
    )
    return Leg(name, chain, bars.lines), limits


FAMILY = Family(
    name="delta",
    summary="Delta: 3 actuated cranks with pairs of bars; freedoms x, y, z",
    tables={"geometry": Geometry, "stiffness": Stiffness, "pose": Translations},
    configure=configure,
    links=(
        LinkKind("arms", ("arm_bending", "arm_torsion"), in_each_leg("arm", "arm_length", 0)),
        LinkKind("bars", ("bar_axial",), in_each_leg("bar", "bar_length", 1, bars=2)),
    ),
)

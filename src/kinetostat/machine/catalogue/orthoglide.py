"""Orthoglide: three actuated slides along x, y and z, each with a pair of bars to the platform; freedoms x, y, z.

Source: Chablat and Wenger, "Architecture optimization of a 3-DOF translational parallel mechanism for machining
applications, the Orthoglide" (2003), for the architecture; bars on spherical joints and symbols as in theory
section 4. At the origin all bars point along their slides: there the machine is isotropic.
"""

from dataclasses import replace
from typing import Annotated

from kinetostat.algebra.lines import slide_travel
from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import AXES, IDENTITY, ZERO, Displacement, Vector
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, PartName, Spring, with_numbers
from kinetostat.machine.links import LinkKind, in_each_leg
from kinetostat.machine.machine import Closure, Configuration, Family
from kinetostat.machine.parts import Arm, BarPair, Translations
from kinetostat.machine.rings import Three
from kinetostat.spec.fields import Quantity, table

LEGS = 3


@table
class Geometry:
    """Table [geometry]; the origin of the base frame is the point P at the isotropic pose."""

    bar_length: Annotated[float, Quantity("length", "of the bars, from slide to platform", positive=True)]
    bar_spacing: Annotated[float, Quantity("length", "distance of the two bars of a leg", positive=True)]
    platform_radius: Annotated[
        float, Quantity("length", "from the platform joints, on the negative x, y, z axes of the platform, to P")
    ]
    foot_length: Annotated[
        float, Quantity("length", "of the foot on each slide, square to the rail, that carries the bars", positive=True)
    ]


@table
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Three, Quantity("linear stiffness", "stiffness of the slides along x, y, z", count=LEGS, per_leg=True)
    ]
    bar_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of each bar, EA")] = RIGID
    foot_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the feet, EI")] = RIGID
    foot_torsion: Annotated[float, Quantity("torsional rigidity", "torsional rigidity of the feet, GJ")] = RIGID


def configure(geometry: Geometry, stiffness: Stiffness, pose: Translations) -> Configuration:
    """The machine at a pose, in closed form, the slides behind the platform; NaN where the bars do not reach.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    tip = Vector(pose.x, pose.y, pose.z)
    placed = [
        _leg(f"leg {name}", tip, (AXES[i], AXES[(i + 1) % LEGS]), k, geometry, stiffness)
        for i, (name, k) in enumerate(zip("xyz", stiffness.actuator, strict=True))
    ]
    legs, limits = (
        tuple(with_numbers(replace(leg, short=axis) for axis, (leg, _) in zip("xyz", placed, strict=True))),
        tuple(limit for _, limit in placed),
    )
    return Configuration(Displacement(IDENTITY, tip), legs, limits, geometry.bar_length)


def _leg(
    name: str, tip: Vector, axes: tuple[Vector, Vector], actuator: Scalar, geometry: Geometry, stiffness: Stiffness
) -> tuple[Leg, Closure]:
    """Slide, foot and pair of bars; `axes` are those of the slide and from bar to bar; the foot is square to both."""
    forward, side = axes
    joint = tip - forward * geometry.platform_radius
    travel, aside = slide_travel(ZERO, joint, forward, geometry.bar_length)
    slide = forward * travel
    bars = BarPair(name, slide, joint, side, geometry.bar_length, geometry.bar_spacing, stiffness.bar_axial)
    rail = slide + side.cross(forward) * geometry.foot_length
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), Joint(forward), actuator, actuated=True),
        Arm(rail, slide, PartName(name, "foot"), forward, stiffness.foot_bending, stiffness.foot_torsion),
        *bars.chain,
    )
    return Leg(name, chain, bars.lines), Closure(f"pair of bars of {name}", aside, 0.0, geometry.bar_length)


FAMILY = Family(
    name="orthoglide",
    summary="Orthoglide: 3 actuated slides along x, y, z with pairs of bars; freedoms x, y, z",
    tables={"geometry": Geometry, "stiffness": Stiffness, "pose": Translations},
    configure=configure,
    links=(
        LinkKind("feet", ("foot_bending", "foot_torsion"), in_each_leg("foot", "foot_length", 0)),
        LinkKind("bars", ("bar_axial",), in_each_leg("bar", "bar_length", 1, bars=2)),
    ),
)

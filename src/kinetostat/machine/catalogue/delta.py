"""Delta machines: three legs, each with a pair of bars that keeps the platform from turning; freedoms x, y, z.

Cranks drive the bars of the Delta, carriages on towers those of the linear delta (most 3D printers of this kind), and
slides along x, y and z those of the Orthoglide. The fields of their files and their kinematics in closed form are here;
the pair of bars is in `parts`. Points and axes are in the base frame; symbols are those of theory section 4.

Sources: R. Clavel, "Delta, a fast robot with parallel geometry" (1988); carriages on towers: the printer Kossel
(J. Rocholl, 2012); Chablat and Wenger, "Architecture optimization of a 3-DOF translational parallel mechanism for
machining applications, the Orthoglide" (2003), here with bars on spherical joints.
"""

from collections.abc import Iterable
from typing import Annotated

from kinetostat.algebra.lines import slide_travel
from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin
from kinetostat.algebra.vector import AXES, IDENTITY, Z_AXIS, ZERO, Displacement, Vector, polar, ring
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, PartName, Spring
from kinetostat.machine.links import LinkKind, in_each_leg, pair_in_each_leg
from kinetostat.machine.machine import Closure, Configuration, Family
from kinetostat.machine.parts import Arm, BarPair, Translations
from kinetostat.machine.rings import CrankLinks, PlacedLeg, Rings, Three, legs_and_closures, of_three_legs, place_elbow
from kinetostat.spec.fields import Quantity, table

LEGS = 3


def translated_platform(tip: Vector, placed: Iterable[PlacedLeg], size: Scalar) -> Configuration:
    """The machine whose platform has its point P at `tip` (base frame, m) and does not turn.

    Args:
        tip: P.
        placed: the actuated legs in order, with their closures.
        size: characteristic length of the machine, m.
    """
    return Configuration(Displacement(IDENTITY, tip), *legs_and_closures(placed), size)


@table
class DeltaGeometry(Rings):
    """Table [geometry]; the base frame has its origin at the base centre, the platform's axes stay parallel to it."""

    leg_angles: Annotated[Three, of_three_legs("angle", "angles of the legs from x, in base and platform", apart=True)]
    arm_length: Annotated[
        float, Quantity("length", "from the actuated revolute to the middle of the elbow", positive=True)
    ]
    bar_length: Annotated[float, Quantity("length", "length of the bars from elbow to platform", positive=True)]
    bar_spacing: Annotated[float, Quantity("length", "distance of the two bars of a leg", positive=True)]


@table
class DeltaStiffness:
    """Table [stiffness]."""

    actuator: Annotated[Three, of_three_legs("torsional stiffness", "stiffness of the actuated revolutes")]
    bar_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of each bar, EA")] = RIGID
    arm_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the arms, EI")] = RIGID
    arm_torsion: Annotated[float, Quantity("torsional rigidity", "torsional rigidity of the arms, GJ")] = RIGID


def delta(geometry: DeltaGeometry, stiffness: DeltaStiffness, pose: Translations) -> Configuration:
    """The Delta at a pose, in closed form; NaN where the bars do not reach (SI, base frame).

    The base joints are at z = 0, the platform is below them, and the elbows are outward.
    """
    tip = Vector(pose.x, pose.y, pose.z)
    base = ring(geometry.base_radius, geometry.leg_angles)
    platform = ring(geometry.platform_radius, geometry.leg_angles)
    # Seen along this axis, an elbow at +90 deg from the way down to the platform is outward.
    axes = [polar(1.0, angle).cross(Z_AXIS) for angle in geometry.leg_angles]
    legs = [
        _arm_leg(f"leg {i}", low, tip + high, axis, k, geometry, stiffness)
        for i, (low, high, axis, k) in enumerate(zip(base, platform, axes, stiffness.actuator, strict=True), 1)
    ]
    return translated_platform(tip, legs, geometry.size)


def _arm_leg(
    name: str,
    base: Vector,
    platform_joint: Vector,
    axis: Vector,
    actuator: Scalar,
    geometry: DeltaGeometry,
    stiffness: DeltaStiffness,
) -> PlacedLeg:
    """R - arm - pair of bars, side by side along the axis of the revolute."""
    elbow, closures = place_elbow(
        name, base, platform_joint, axis, CrankLinks(geometry.arm_length, geometry.bar_length)
    )
    bars = BarPair(name, elbow, platform_joint, axis, geometry.bar_length, geometry.bar_spacing, stiffness.bar_axial)
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), Joint(axis, base), actuator, actuated=True),
        Arm(base, elbow, PartName(name, "arm"), axis, stiffness.arm_bending, stiffness.arm_torsion),
        *bars.chain,
    )
    return Leg(name, chain, bars.lines), closures


TOWERS = "ABC"
"""Names of the towers, as firmware of printers has them."""
NO_LEAN = (0.0, 0.0, 0.0)


@table
class LinearDeltaGeometry:
    """Table [geometry]; the base frame has its origin at the middle of the bed, z up."""

    tower_angles: Annotated[Three, of_three_legs("angle", "angles of the towers from x about z", apart=True)]
    tower_radius: Annotated[
        Three, of_three_legs("length", "from the z axis to the rods' joints on each carriage", positive=True)
    ]
    platform_radius: Annotated[
        float, Quantity("length", "from the middle of the platform to the rods' joints on it", positive=True)
    ]
    rod_length: Annotated[
        Three, of_three_legs("length", "length of the rods of each tower, joint to joint", positive=True)
    ]
    rod_spacing: Annotated[float, Quantity("length", "distance of the two rods of a tower", positive=True)]
    platform_height: Annotated[float, Quantity("length", "height of the rods' joints over the nozzle, P")]
    carriage_offset: Annotated[
        float, Quantity("length", "from the rail of a tower inwards to the rods' joints", positive=True)
    ]
    lean_out: Annotated[
        Three, of_three_legs("angle", "angle by which each tower leans away from the z axis, from the bed up")
    ] = NO_LEAN
    lean_aside: Annotated[
        Three, of_three_legs("angle", "angle by which each tower leans sideways, to greater tower angles")
    ] = NO_LEAN

    @property
    def size(self) -> Scalar:
        """Characteristic length of the machine, m: the mean of the mean radii of towers and platform."""
        mean = (self.tower_radius[0] + self.tower_radius[1] + self.tower_radius[2]) * (1.0 / LEGS)
        return 0.5 * (mean + self.platform_radius)


@table
class LinearDeltaStiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Three, of_three_legs("linear stiffness", "stiffness of each carriage along its tower: belt and motor")
    ]
    bar_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of each rod, EA")] = RIGID
    carriage_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the carriages, EI")] = RIGID
    carriage_torsion: Annotated[float, Quantity("torsional rigidity", "torsional rigidity of the carriages, GJ")] = (
        RIGID
    )


def linear_delta(geometry: LinearDeltaGeometry, stiffness: LinearDeltaStiffness, pose: Translations) -> Configuration:
    """The linear delta at a pose, in closed form; NaN where the rods do not reach (SI, base frame).

    The bed is at z = 0, P is the nozzle, and the carriages are above the platform.
    """
    tip = Vector(pose.x, pose.y, pose.z)
    return translated_platform(tip, [_tower_leg(i, tip, geometry, stiffness) for i in range(LEGS)], geometry.size)


def _tower_leg(number: int, tip: Vector, geometry: LinearDeltaGeometry, stiffness: LinearDeltaStiffness) -> PlacedLeg:
    """P - carriage - pair of rods; the slide moves up along its tower."""
    name, length = f"tower {TOWERS[number]}", geometry.rod_length[number]
    radial = polar(1.0, geometry.tower_angles[number])
    tangential = Z_AXIS.cross(radial)
    upward = _tower_axis(radial, tangential, geometry.lean_out[number], geometry.lean_aside[number])
    foot = radial * geometry.tower_radius[number]
    platform_joint = tip + radial * geometry.platform_radius + Z_AXIS * geometry.platform_height
    travel, distance = slide_travel(foot, platform_joint, -upward, length)
    carriage = foot - upward * travel
    rods = BarPair(name, carriage, platform_joint, tangential, length, geometry.rod_spacing, stiffness.bar_axial)
    rail, rail_foot = (point + radial * geometry.carriage_offset for point in (carriage, foot))
    bending, torsion = stiffness.carriage_bending, stiffness.carriage_torsion
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), Joint(upward, foot=rail_foot), stiffness.actuator[number], actuated=True),
        Arm(rail, carriage, PartName(name, "carriage"), upward, bending, torsion),
        *rods.chain,
    )
    closure = Closure(f"pair of rods of {name}", distance, 0.0, length)
    return Leg(name, chain, rods.lines, short=TOWERS[number]), (closure,)


def _tower_axis(radial: Vector, tangential: Vector, lean_out: Scalar, lean_aside: Scalar) -> Vector:
    """Unit vector up along a tower; slopes add (tangents, not rotations), so that the order of both does not matter."""
    slope = radial * (sin(lean_out) * reciprocal(cos(lean_out)))
    slope = slope + tangential * (sin(lean_aside) * reciprocal(cos(lean_aside)))
    leaning = slope + Z_AXIS
    return leaning * reciprocal(leaning.norm())


@table
class OrthoglideGeometry:
    """Table [geometry]; the origin of the base frame is the point P at the isotropic pose."""

    bar_length: Annotated[float, Quantity("length", "length of the bars from slide to platform", positive=True)]
    bar_spacing: Annotated[float, Quantity("length", "distance of the two bars of a leg", positive=True)]
    platform_radius: Annotated[
        float,
        Quantity("length", "distance of each platform joint from P, on the negative x, y or z axis of the platform"),
    ]
    foot_length: Annotated[
        float,
        Quantity(
            "length", "length of the foot on each slide, square to the rail, that carries the bars", positive=True
        ),
    ]


@table
class OrthoglideStiffness:
    """Table [stiffness]."""

    actuator: Annotated[Three, of_three_legs("linear stiffness", "stiffness of the slides along x, y, z")]
    bar_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of each bar, EA")] = RIGID
    foot_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the feet, EI")] = RIGID
    foot_torsion: Annotated[float, Quantity("torsional rigidity", "torsional rigidity of the feet, GJ")] = RIGID


def orthoglide(geometry: OrthoglideGeometry, stiffness: OrthoglideStiffness, pose: Translations) -> Configuration:
    """The Orthoglide at a pose, in closed form; NaN where the bars do not reach (SI, base frame).

    The slides are behind the platform. At the origin all bars point along their slides, and the machine is isotropic.
    """
    tip = Vector(pose.x, pose.y, pose.z)
    legs = [_slide_leg(i, tip, geometry, stiffness) for i in range(LEGS)]
    return translated_platform(tip, legs, geometry.bar_length)


def _slide_leg(number: int, tip: Vector, geometry: OrthoglideGeometry, stiffness: OrthoglideStiffness) -> PlacedLeg:
    """Slide, foot and pair of bars; the foot is square to the slide and to the line from bar to bar."""
    axis = "xyz"[number]
    name = f"leg {axis}"
    # The bars lie side by side along the next axis, so that the three pairs hold three different rotations.
    forward, side = AXES[number], AXES[(number + 1) % LEGS]
    platform_joint = tip - forward * geometry.platform_radius
    travel, distance = slide_travel(ZERO, platform_joint, forward, geometry.bar_length)
    slide = forward * travel
    bars = BarPair(name, slide, platform_joint, side, geometry.bar_length, geometry.bar_spacing, stiffness.bar_axial)
    rail = slide + side.cross(forward) * geometry.foot_length
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), Joint(forward), stiffness.actuator[number], actuated=True),
        Arm(rail, slide, PartName(name, "foot"), forward, stiffness.foot_bending, stiffness.foot_torsion),
        *bars.chain,
    )
    closure = Closure(f"pair of bars of {name}", distance, 0.0, geometry.bar_length)
    return Leg(name, chain, bars.lines, short=axis), (closure,)


FAMILIES = (
    Family(
        name="delta",
        summary="Delta: 3 actuated cranks with pairs of bars; freedoms x, y, z",
        tables={"geometry": DeltaGeometry, "stiffness": DeltaStiffness, "pose": Translations},
        configure=delta,
        links=(
            LinkKind("arms", ("arm_bending", "arm_torsion"), in_each_leg("arm", "arm_length", 0)),
            LinkKind("bars", ("bar_axial",), pair_in_each_leg("bar", "bar_length", 1)),
        ),
    ),
    Family(
        name="delta-linear",
        summary="linear delta: 3 carriages on towers with pairs of rods; freedoms x, y, z",
        tables={"geometry": LinearDeltaGeometry, "stiffness": LinearDeltaStiffness, "pose": Translations},
        configure=linear_delta,
        links=(
            LinkKind(
                "carriages", ("carriage_bending", "carriage_torsion"), in_each_leg("carriage", "carriage_offset", 0)
            ),
            LinkKind("rods", ("bar_axial",), pair_in_each_leg("rod", "rod_length", 1)),
        ),
    ),
    Family(
        name="orthoglide",
        summary="Orthoglide: 3 actuated slides along x, y, z with pairs of bars; freedoms x, y, z",
        tables={"geometry": OrthoglideGeometry, "stiffness": OrthoglideStiffness, "pose": Translations},
        configure=orthoglide,
        links=(
            LinkKind("feet", ("foot_bending", "foot_torsion"), in_each_leg("foot", "foot_length", 0)),
            LinkKind("bars", ("bar_axial",), pair_in_each_leg("bar", "bar_length", 1)),
        ),
    ),
)

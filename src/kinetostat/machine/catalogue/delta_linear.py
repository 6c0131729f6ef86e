"""Linear delta, as in 3D printers: three carriages on towers, each with a pair of rods; freedoms x, y, z.

Source: R. Clavel, "Delta, a fast robot with parallel geometry" (1988), for pairs of rods; carriages on towers: the
printer Kossel (J. Rocholl, 2012); symbols as in theory section 4. The bed is at z = 0, and P is the nozzle.
"""

from dataclasses import replace
from typing import Annotated

from kinetostat.algebra.lines import slide_travel
from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin
from kinetostat.algebra.vector import IDENTITY, Z_AXIS, Displacement, Vector, polar
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, PartName, Spring, with_numbers
from kinetostat.machine.links import LinkKind, in_each_leg
from kinetostat.machine.machine import Closure, Configuration, Family
from kinetostat.machine.parts import Arm, BarPair, Translations
from kinetostat.machine.rings import Three
from kinetostat.spec.fields import Quantity, table

LEGS = 3
NO_LEAN = (0.0, 0.0, 0.0)


@table
class Geometry:
    """Table [geometry]; the base frame has its origin at the middle of the bed, z up."""

    tower_angles: Annotated[
        Three, Quantity("angle", "angles of the towers from x about z", count=LEGS, per_leg=True, apart=True)
    ]
    tower_radius: Annotated[
        Three,
        Quantity(
            "length", "from the z axis to the rods' joints on each carriage", count=LEGS, per_leg=True, positive=True
        ),
    ]
    platform_radius: Annotated[
        float, Quantity("length", "from the middle of the platform to the rods' joints on it", positive=True)
    ]
    rod_length: Annotated[
        Three,
        Quantity("length", "of the rods of each tower, joint to joint", count=LEGS, per_leg=True, positive=True),
    ]
    rod_spacing: Annotated[float, Quantity("length", "distance of the two rods of a tower", positive=True)]
    platform_height: Annotated[float, Quantity("length", "of the rods' joints over the nozzle, P")]
    carriage_offset: Annotated[
        float, Quantity("length", "from the rail of a tower inwards to the rods' joints", positive=True)
    ]
    lean_out: Annotated[
        Three, Quantity("angle", "by which each tower leans outwards from the bed on", count=LEGS, per_leg=True)
    ] = NO_LEAN
    lean_aside: Annotated[
        Three,
        Quantity("angle", "by which it leans aside, to greater angles", count=LEGS, per_leg=True),
    ] = NO_LEAN

    @property
    def size(self) -> Scalar:
        """Characteristic length of the machine, m: the mean of the mean radii of towers and platform."""
        mean = (self.tower_radius[0] + self.tower_radius[1] + self.tower_radius[2]) * (1.0 / LEGS)
        return 0.5 * (mean + self.platform_radius)


@table
class Stiffness:
    """Table [stiffness]."""

    actuator: Annotated[
        Three,
        Quantity(
            "linear stiffness", "stiffness of each carriage along its tower: belt and motor", count=LEGS, per_leg=True
        ),
    ]
    bar_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of each rod, EA")] = RIGID
    carriage_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the carriages, EI")] = RIGID
    carriage_torsion: Annotated[float, Quantity("torsional rigidity", "torsional rigidity of them, GJ")] = RIGID


def configure(geometry: Geometry, stiffness: Stiffness, pose: Translations) -> Configuration:
    """The machine at a pose, in closed form, carriages above the platform; NaN where the rods do not reach.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    tip = Vector(pose.x, pose.y, pose.z)
    placed = [_leg(i, tip, geometry, stiffness) for i in range(LEGS)]
    legs = tuple(with_numbers(replace(leg, short=name) for name, (leg, _) in zip("ABC", placed, strict=True)))
    return Configuration(Displacement(IDENTITY, tip), legs, tuple(limit for _, limit in placed), geometry.size)


def _leg(number: int, tip: Vector, geometry: Geometry, stiffness: Stiffness) -> tuple[Leg, Closure]:
    """P - carriage - pair of rods; the slide moves up along its tower."""
    name, angle, length = f"tower {'ABC'[number]}", geometry.tower_angles[number], geometry.rod_length[number]
    outward, aside = polar(1.0, angle), polar(1.0, angle).cross(Z_AXIS) * -1.0
    out, side = geometry.lean_out[number], geometry.lean_aside[number]
    lean = outward * (sin(out) * reciprocal(cos(out))) + aside * (sin(side) * reciprocal(cos(side))) + Z_AXIS
    upward = lean * reciprocal(lean.norm())
    foot = outward * geometry.tower_radius[number]
    joint = tip + outward * geometry.platform_radius + Z_AXIS * geometry.platform_height
    travel, distance = slide_travel(foot, joint, -upward, length)
    carriage = foot - upward * travel
    rods = BarPair(name, carriage, joint, aside, length, geometry.rod_spacing, stiffness.bar_axial)
    rail, start = (point + outward * geometry.carriage_offset for point in (carriage, foot))
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), Joint(upward, foot=start), stiffness.actuator[number], actuated=True),
        Arm(
            rail,
            carriage,
            PartName(name, "carriage"),
            upward,
            stiffness.carriage_bending,
            stiffness.carriage_torsion,
        ),
        *rods.chain,
    )
    return Leg(name, chain, rods.lines), Closure(f"pair of rods of {name}", distance, 0.0, length)


FAMILY = Family(
    name="delta-linear",
    summary="linear delta: 3 carriages on towers with pairs of rods; freedoms x, y, z",
    tables={"geometry": Geometry, "stiffness": Stiffness, "pose": Translations},
    configure=configure,
    links=(
        LinkKind("carriages", ("carriage_bending", "carriage_torsion"), in_each_leg("carriage", "carriage_offset", 0)),
        LinkKind("rods", ("bar_axial",), in_each_leg("rod", "rod_length", 1, bars=2)),
    ),
)

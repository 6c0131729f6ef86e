"""Legs with an actuated crank at the base and a rod to the platform: R-U-S. The platform is the family's business.

Source: theory (13)-(15). Points and axes are in the base frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from kinetostat.algebra.lines import crank_end, crank_range
from kinetostat.algebra.scalar import Scalar, cos, reciprocal, sin
from kinetostat.algebra.vector import AXES, Z_AXIS, Vector, rotation_z
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, Line, PartName, Spring, numbered, revolutes
from kinetostat.machine.links import LinkKind, in_each_leg
from kinetostat.machine.machine import Closure
from kinetostat.machine.parts import Arm, if_elastic, per_length
from kinetostat.spec.fields import Quantity, table


@table
class Cranks:
    """Part of a table [geometry]: the links of R-U-S legs."""

    crank_length: Annotated[
        float, Quantity("length", "from the actuated revolute to the joint of the rod", positive=True)
    ]
    rod_length: Annotated[float, Quantity("length", "from the crank to the platform joint", positive=True)]


@dataclass(frozen=True)
class CrankLinks:
    """The two links of a crank leg.

    Attributes:
        crank, rod: lengths, m.
        bending: E I of the crank, N·m².
        axial: E A of the rod, N.
    """

    crank: Scalar
    rod: Scalar
    bending: Scalar = RIGID
    axial: Scalar = RIGID


CRANK_LINKS = (
    LinkKind("cranks", ("crank_bending",), in_each_leg("crank", "crank_length", 0)),
    LinkKind("rods", ("leg_axial",), in_each_leg("rod", "rod_length", 1)),
)
"""The links of R-U-S legs, whose rods have the rigidity `leg_axial`."""


def outward(base: Sequence[Vector], radius: Scalar, turns: Sequence[Scalar]) -> list[Vector]:
    """Unit vectors of the x-y plane that the cranks' vertical planes hold: away from z, each turned about it.

    Args:
        base: base joints, on a ring about z, m.
        radius: of the ring, m.
        turns: rad.
    """
    shrink = reciprocal(radius)
    radial = [Vector(point.x, point.y, 0.0) * shrink for point in base]
    return [rotation_z(cos(turn), sin(turn)).apply(v) for v, turn in zip(radial, turns, strict=True)]


def place(name: str, base: Vector, tip: Vector, axis: Vector, links: CrankLinks) -> tuple[Vector, tuple[Closure, ...]]:
    """The elbow of a crank about `axis` through `base` and a rod that ends at `tip` (base frame, m), and its limits.

    Seen along the axis, the elbow lies at +90 deg from the way from base to tip; it is NaN out of reach.
    """
    near, far = crank_range(base, tip, axis, links.crank)
    rod = f"rod of {name}"
    limits = (Closure(rod, near, 0.0, links.rod), Closure(rod, far, links.rod, RIGID))
    return crank_end(base, tip, axis, links.crank, links.rod), limits


def crank_leg(
    name: str, base: Vector, tip: Vector, axis: Vector, stiffness: Scalar, links: CrankLinks
) -> tuple[Leg, tuple[Closure, ...]]:
    """R-U-S with the revolute actuated: a force along the rod and nothing else (theory section 4).

    The crank bends at its built-in end, in its plane and across it, by 3 E I / length each: of the four torsional
    springs of the paper's Table II those that a force through the elbow loads.

    Args:
        name: of the leg.
        base, tip: centres of the actuated revolute and of the spherical joint, base frame, m.
        axis: of the revolute, unit vector; see `place` for its sign.
        stiffness: of the actuator, N·m/rad.
        links: crank and rod.
    """
    elbow, limits = place(name, base, tip, axis, links)
    along, crank = (tip - elbow) * reciprocal(links.rod), (elbow - base) * reciprocal(links.crank)
    bending, part = per_length(links.bending, links.crank, 3.0), PartName(name, "crank")
    chain: tuple[Element, ...] = (
        Spring(PartName(name, "actuator"), Joint(axis, base), stiffness, actuated=True),
        *if_elastic(
            Spring(f"{part} in plane", Joint(axis, base), bending, part),
            Spring(f"{part} across", Joint(axis.cross(crank), base), bending, part),
        ),
        Arm(base, elbow),
        *revolutes(elbow, AXES, f"{name} elbow"),
        *if_elastic(Spring(PartName(name, "rod"), Joint(along), per_length(links.axial, links.rod))),
        *revolutes(tip, AXES, f"{name} platform joint"),
    )
    return Leg(name, chain, (Line(tip, along),)), limits


def crank_legs(
    ends: tuple[Sequence[Vector], Sequence[Vector]],
    sides: Sequence[Vector],
    stiffness: Sequence[Scalar],
    links: CrankLinks,
) -> tuple[list[Leg], list[Closure]]:
    """R-U-S legs "leg 1", "leg 2", ... whose cranks turn in vertical planes, and their limits.

    For a platform joint above its base joint the crank points to its side, else away from it.

    Args:
        ends: base joints and platform joints in order, base frame, m.
        sides: horizontal unit vectors in the planes of the cranks, see `outward`.
        stiffness: of the actuators, N·m/rad.
        links: crank and rod, alike in all legs.
    """
    placed = [
        crank_leg(f"leg {i}", base, tip, Z_AXIS.cross(side), k, links)
        for i, (base, tip, side, k) in enumerate(zip(*ends, sides, stiffness, strict=True), 1)
    ]
    return numbered(leg for leg, _ in placed), [limit for _, limits in placed for limit in limits]

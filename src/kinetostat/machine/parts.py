"""Parts from which families are built: joints with a servo, links that may be flexible, struts, pairs of bars.

This file knows no family. A stiffness is "rigid by form" if it is the Python float infinity, as many defaults are, and
"zero by form" if it is the float 0.0. A part that is rigid by form has no spring, and a joint whose stiffness is zero
by form is free. Arrays and traced values always give a spring, whatever numbers they contain.

Points and axes are in the base frame.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Annotated, NamedTuple

from kinetostat.algebra.scalar import Scalar, is_infinite, is_zero, reciprocal
from kinetostat.algebra.vector import AXES, Z_AXIS, Displacement, Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import (
    RIGID,
    Element,
    Joint,
    Leg,
    Line,
    PartName,
    Spring,
    revolutes,
    series,
    with_numbers,
)
from kinetostat.machine.link import Parallelogram, link_axes
from kinetostat.spec.fields import Quantity, table


@table
class Translations:
    """Table [pose] of a machine whose platform moves along x, y and z and does not turn."""

    x: Annotated[float, Quantity("length", "x of the platform point P")]
    y: Annotated[float, Quantity("length", "y of the platform point P")]
    z: Annotated[float, Quantity("length", "z of the platform point P")]


def if_elastic(*springs: Spring) -> tuple[Spring, ...]:
    """Return the springs that are not rigid by form."""
    return tuple(spring for spring in springs if not is_infinite(spring.stiffness))


def per_length(rigidity: Scalar, length: Scalar, factor: float = 1.0) -> Scalar:
    """Return the stiffness of a whole link, factor x rigidity / length (SI); it is rigid by form if the rigidity is."""
    return rigidity if is_infinite(rigidity) else factor * rigidity * reciprocal(length)


def in_series(stiffness: Scalar, rigidity: Scalar, length: Scalar, factor: float = 1.0) -> Scalar:
    """Return the stiffness of a joint in series with the link built into it: factor x rigidity / length (SI)."""
    return stiffness if is_infinite(rigidity) else series(stiffness, per_length(rigidity, length, factor))


class BarRigidity(NamedTuple):
    """E I and G J of a bar, N·m², and its length, m."""

    bending: Scalar
    torsion: Scalar
    length: Scalar


def bent_links(lengths: Sequence[Scalar], stiffness: Sequence[Scalar], bending: Sequence[Scalar]) -> list[Scalar]:
    """Return the rotational stiffness, N·m/rad, of each joint in series with the link that is clamped to it.

    Under a force at its end, a cantilever deflects there like a rigid link on a rotational spring of 3 EI / length.
    """
    return [in_series(k, rigidity, size, 3.0) for k, rigidity, size in zip(stiffness, bending, lengths, strict=True)]


def built_in_bar(
    name: str, axes: Iterable[Vector], point: Vector, stiffness: Sequence[Scalar], bar: BarRigidity
) -> tuple[Spring, ...]:
    """Return the springs of a bar at the end where it is built in: bending about two axes and torsion about the third.

    Its other end bends by 3 EI / length and twists by GJ / length; each is in series with the stiffness of the seat.

    Args:
        name: the name of the bar.
        axes: x and y across the bar, and z along it, base frame.
        point: the point of that end, base frame, m.
        stiffness: the stiffness of its seat about these axes, N·m/rad.
        bar: the rigidities and the length of the bar.
    """
    deflections = (("bending x", bar.bending, 3.0), ("bending y", bar.bending, 3.0), ("torsion", bar.torsion, 1.0))
    return tuple(
        Spring(f"{name} {deflection}", Joint(axis, point), in_series(k, rigidity, bar.length, factor))
        for (deflection, rigidity, factor), axis, k in zip(deflections, axes, stiffness, strict=True)
    )


def servo(joint: Joint, name: str, stiffness: Scalar) -> Joint | Spring:
    """Return the joint itself, passive, if the stiffness is zero by form, and otherwise an actuator with a name.

    The driven joint has the name of its actuator, so that its coordinate and its load stand under one name.
    """
    return joint if is_zero(stiffness) else Spring(name, replace(joint, name=name), stiffness, actuated=True)


def two_force_leg(
    name: str,
    base_joint: Vector,
    platform_joint: Vector,
    stiffness: Scalar,
    axial: Scalar = RIGID,
    axes: Sequence[Vector] = AXES,
) -> Leg:
    """Return a leg with an actuated slide between two joints: it carries a force along their line and nothing else.

    Source: theory (2); row a_i of A over rho_i in eqs. 1-4.

    Args:
        name: the name of the leg.
        base_joint, platform_joint: centres of the two joints, base frame, m.
        stiffness: the stiffness of the actuator, N/m.
        axial: EA of the leg's cross-section, N: the leg is stretched over its whole length.
        axes: axes of each of the two joints: all three for U-P-S, whose spin about itself changes nothing, and z alone
            for R-P-R in the x-y plane.
    """
    span = platform_joint - base_joint
    length = span.norm()
    along = span * reciprocal(length)
    chain: tuple[Element, ...] = (
        *revolutes(base_joint, axes, f"{name} base joint"),
        Spring(PartName(name, "actuator"), Joint(along), stiffness, actuated=True),
        *if_elastic(Spring(PartName(name, "rod"), Joint(along), per_length(axial, length))),
        *revolutes(platform_joint, axes, f"{name} platform joint"),
    )
    return Leg(name, chain, (Line(platform_joint, along),))


def two_force_legs(
    base_joints: Sequence[Vector],
    platform_joints: Sequence[Vector],
    stiffness: Sequence[Scalar],
    axial: Scalar = RIGID,
    axes: Sequence[Vector] = AXES,
) -> list[Leg]:
    """Two-force legs "leg 1", "leg 2", ... between joint centres, base frame, m; arguments as for `two_force_leg`."""
    rows = enumerate(zip(base_joints, platform_joints, stiffness, strict=True), 1)
    return with_numbers(two_force_leg(f"leg {i}", base, top, k, axial, axes) for i, (base, top, k) in rows)


@dataclass(frozen=True)
class Arm:
    """A link that is rigid in tension, and bends or twists unless it is rigid by form: a beam (theory section 5).

    Attributes:
        start, end: ends of its axis, base frame, m.
        name: the name of the link.
        up: unit vector that fixes the y and z axes of the cross-section; not along the link.
        bending, torsion: E I, the same about both axes of the cross-section, and G J, N·m².
    """

    start: Vector
    end: Vector
    name: str = ""
    up: Vector = Z_AXIS
    bending: Scalar = RIGID
    torsion: Scalar = RIGID

    @property
    def freedoms(self) -> tuple[Joint, ...]:
        """No joints: an arm only deflects."""
        return ()

    @property
    def springs(self) -> tuple[Spring, ...]:
        """The springs of a `Beam` that are not rigid by form.

        They are torsion GJ/L, bending EI/L twice and shear 12EI/L^3 twice, and act at the middle of the beam, where
        bending and shear are not coupled.
        """
        if is_infinite(self.bending) and is_infinite(self.torsion):
            return ()
        axes, length = link_axes(self.start, self.end, self.up)
        middle = (self.start + self.end) * 0.5
        bend, shear = per_length(self.bending, length), per_length(self.bending, length * length * length, 12.0)
        return if_elastic(
            Spring(f"{self.name} torsion", Joint(axes.x, middle), per_length(self.torsion, length), self.name),
            Spring(f"{self.name} bending y", Joint(axes.y, middle), bend, self.name),
            Spring(f"{self.name} bending z", Joint(axes.z, middle), bend, self.name),
            Spring(f"{self.name} shear y", Joint(axes.y), shear, self.name),
            Spring(f"{self.name} shear z", Joint(axes.z), shear, self.name),
        )

    @property
    def path(self) -> tuple[Vector, ...]:
        """Its ends, base frame, m."""
        return self.start, self.end

    def displaced(self, motion: Displacement) -> "Arm":
        """The link after a rigid displacement of the whole machine."""
        ends = motion.apply(self.start), motion.apply(self.end)
        return Arm(*ends, self.name, motion.rotation.apply(self.up), self.bending, self.torsion)


@dataclass(frozen=True)
class BarPair:
    """Two parallel bars with spherical joints between a link of a leg and the platform, as in a Delta (theory (16)).

    Attributes:
        name: the name of the leg it belongs to.
        near, far: midpoints between the two bars at the leg and at the platform, base frame, m.
        side: unit vector from one bar to the other; not along the bars.
        length, spacing: the length of the bars and the distance between them, m.
        axial: E A of each bar, N.
    """

    name: str
    near: Vector
    far: Vector
    side: Vector
    length: Scalar
    spacing: Scalar
    axial: Scalar

    @property
    def along(self) -> Vector:
        """Unit vector of the bars."""
        return (self.far - self.near) * reciprocal(self.length)

    @property
    def chain(self) -> tuple[Element, ...]:
        """A serial chain with the same freedoms: R about the side, R about the bars, parallelogram, R about the side.

        These four span exactly the motions on which a force along either bar does no work (theory section 4).
        """
        bar = per_length(self.axial, self.length)
        return (
            Joint(self.side, self.near, f"{self.name} elbow"),
            Joint(self.along, self.near, f"{self.name} bars"),
            Parallelogram(PartName(self.name, "bars"), self.near, self.far, self.side, self.spacing, bar),
            Joint(self.side, self.far, f"{self.name} platform joint"),
        )

    @property
    def lines(self) -> tuple[Line, Line]:
        """The lines of both bars. The bars carry forces along these lines and nothing else."""
        offset = self.side * (0.5 * self.spacing)
        return Line(self.far + offset, self.along), Line(self.far - offset, self.along)

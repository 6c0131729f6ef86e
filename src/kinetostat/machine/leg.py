"""Legs at one pose as geometry: joints by point and axis in the base frame, springs with their stiffness.

Legs turn themselves into screws (J_p, J_e, W) at the platform point; how a pose places the joints is the family's
business (`catalogue`), what the screws do to the platform is that of `kinetostatics`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal
from kinetostat.algebra.screw import Twist, Wrench, force_along, rotation_about, translation_along
from kinetostat.algebra.solve import complement
from kinetostat.algebra.vector import AXES, Displacement, Vector


@dataclass(frozen=True)
class Joint:
    """One freedom: a revolute about the line through `point` (m) along the unit vector `axis`, or a slide along it."""

    axis: Vector
    point: Vector | None = None

    def twist(self, reference: Vector) -> Twist:
        """Its unit twist at `reference` (base frame, m)."""
        if self.point is None:
            return translation_along(self.axis)
        return rotation_about(self.axis, reference - self.point)

    def displaced(self, motion: Displacement) -> "Joint":
        """The joint after a rigid displacement of the whole machine."""
        point = None if self.point is None else motion.apply(self.point)
        return Joint(motion.rotation.apply(self.axis), point)


def revolutes(point: Vector, axes: Sequence[Vector]) -> tuple[Joint, ...]:
    """Revolutes with a common point: a Hooke joint has two axes, a spherical joint three."""
    return tuple(Joint(axis, point) for axis in axes)


@dataclass(frozen=True)
class Spring:
    """An elastic coordinate: an actuator held by its servo, or a virtual joint that stands for a flexible link.

    Attributes:
        name: unique within the machine, e.g. "leg 1 actuator".
        joint: the freedom it resists.
        stiffness: N/m for a slide, N·m/rad for a revolute; 0 (free) and infinity (rigid) are exact.
    """

    name: str
    joint: Joint
    stiffness: Scalar


@dataclass(frozen=True)
class LegScrews:
    """What a leg is to the platform: screws at P in base axes (theory section 2).

    Attributes:
        passive: unit twists that span what the passive joints allow (J_p).
        elastic: unit twist of each spring (J_e).
        compliance: of each spring (diagonal of S): 0 rigid, infinity free; m/N or rad/(N·m).
        wrenches: basis of what the leg can carry (W): no work on any passive twist.
        regularity: 0 where the passive joints lock up, 1 where they are orthogonal (dimensionless).
        loads: load in each spring per unit of each wrench (J_e^T W), where the leg type knows it in closed form.
    """

    passive: tuple[Twist, ...]
    elastic: tuple[Twist, ...]
    compliance: tuple[Scalar, ...]
    wrenches: tuple[Wrench, ...]
    regularity: Scalar
    loads: tuple[tuple[Scalar, ...], ...] | None = None


class Leg(Protocol):
    """A leg type: geometry that can be moved and turned into screws. A new one needs these members."""

    @property
    def name(self) -> str:
        """Unique within the machine."""

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Its elastic coordinates."""

    @property
    def path(self) -> tuple[Vector, ...]:
        """Its joint centres from base to platform, base frame, m: what a drawing connects."""

    def displaced(self, motion: Displacement) -> "Leg":
        """The leg after a rigid displacement of the whole machine."""

    def screws(self, reference: Vector, length: Scalar) -> LegScrews:
        """Its screws at `reference` (base frame, m); `length` (m) scales rows, the result does not depend on it."""


@dataclass(frozen=True)
class TwoForceLeg:
    """U-P-S with the prismatic joint actuated: it carries a force along its line and nothing else.

    Attributes:
        name: of the leg.
        base_joint, platform_joint: centres of the universal and of the spherical joint, base frame, m.
        stiffness: of the actuator, N/m.
    """

    name: str
    base_joint: Vector
    platform_joint: Vector
    stiffness: Scalar

    @property
    def springs(self) -> tuple[Spring, ...]:
        """The actuator."""
        return (Spring(f"{self.name} actuator", Joint(self._direction()), self.stiffness),)

    @property
    def path(self) -> tuple[Vector, ...]:
        """Its two joint centres, base frame, m."""
        return self.base_joint, self.platform_joint

    def _direction(self) -> Vector:
        line = self.platform_joint - self.base_joint
        return line * reciprocal(line.norm())

    def displaced(self, motion: Displacement) -> "TwoForceLeg":
        """The leg after a rigid displacement of the whole machine."""
        base, platform = motion.apply(self.base_joint), motion.apply(self.platform_joint)
        return replace(self, base_joint=base, platform_joint=platform)

    def screws(self, reference: Vector, length: Scalar) -> LegScrews:
        """The wrench [r x u; u], r from P to the platform joint: row a_i of A over rho_i in eqs. 1-4."""
        along = self._direction()
        ends = [*revolutes(self.base_joint, AXES), *revolutes(self.platform_joint, AXES)]
        return LegScrews(
            passive=tuple(joint.twist(reference) for joint in ends),
            elastic=(translation_along(along),),
            compliance=(reciprocal(self.stiffness),),
            wrenches=(force_along(along, self.platform_joint - reference),),
            regularity=1.0,
            loads=((1.0,),),
        )


def two_force_legs(
    base_joints: Sequence[Vector], platform_joints: Sequence[Vector], stiffness: Sequence[Scalar]
) -> list[Leg]:
    """Actuated U-P-S legs "leg 1", "leg 2", ... between joint centres (base frame, m) with their actuators (N/m)."""
    pairs = zip(base_joints, platform_joints, stiffness, strict=True)
    return [TwoForceLeg(f"leg {i}", base, top, k) for i, (base, top, k) in enumerate(pairs, 1)]


@dataclass(frozen=True)
class SerialLeg:
    """Any chain of passive joints and springs, for instance a passive constraining leg.

    Attributes:
        name: of the leg.
        passive: its passive joints at this pose, independent of each other.
        springs: its elastic coordinates at this pose.
    """

    name: str
    passive: tuple[Joint, ...]
    springs: tuple[Spring, ...]

    @property
    def path(self) -> tuple[Vector, ...]:
        """The centres of its passive revolutes in order, base frame, m."""
        return tuple(joint.point for joint in self.passive if joint.point is not None)

    def displaced(self, motion: Displacement) -> "SerialLeg":
        """The leg after a rigid displacement of the whole machine."""
        springs = tuple(replace(spring, joint=spring.joint.displaced(motion)) for spring in self.springs)
        return replace(self, passive=tuple(joint.displaced(motion) for joint in self.passive), springs=springs)

    def screws(self, reference: Vector, length: Scalar) -> LegScrews:
        """Jacobians from the joints; the wrenches are the space reciprocal to the passive twists (theory section 2)."""
        passive = tuple(joint.twist(reference) for joint in self.passive)
        wrenches, regularity = reciprocal_wrenches(passive, length)
        return LegScrews(
            passive=passive,
            elastic=tuple(spring.joint.twist(reference) for spring in self.springs),
            compliance=tuple(reciprocal(spring.stiffness) for spring in self.springs),
            wrenches=wrenches,
            regularity=regularity,
        )


def reciprocal_wrenches(passive: Sequence[Twist], length: Scalar) -> tuple[tuple[Wrench, ...], Scalar]:
    """Wrenches that do no work on any of `passive`: a basis of the reciprocal space (J_p^T W = 0).

    Args:
        passive: a independent unit twists, a < 6, at P in base axes.
        length: m; translations are compared with rotations through it, the space does not depend on it.

    Returns:
        W, 6 - a wrenches at P in base axes (orthonormal once moments are divided by `length`), and the regularity:
        0 where the twists are dependent.
    """
    shrink = reciprocal(length)
    basis, regularity = complement([_comparable(twist, shrink) for twist in passive])
    return tuple(Wrench(Vector(*row[:3]) * length, Vector(*row[3:])) for row in basis), regularity


def _comparable(twist: Twist, shrink: Scalar) -> tuple[Scalar, ...]:
    """The components of a unit twist, translations shrunk to compare with rotations; a slide stays of unit size."""
    if all(is_zero(c) for c in twist.rotational.components()):
        return twist.components()
    return Twist(twist.rotational, twist.translational * shrink).components()

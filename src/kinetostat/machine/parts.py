"""Parts that a machine has only where its file says so: links that yield, joints that a servo holds.

A stiffness that is infinite by form (the float itself, as a default is) leaves no spring behind, one that is zero by
form leaves a free joint; arrays and traced values always leave a spring, whatever they hold.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal
from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.machine.leg import RIGID, Element, Joint, Spring, series
from kinetostat.machine.link import Beam, Rigidity


def is_rigid(stiffness: Scalar) -> bool:
    """Whether a stiffness or rigidity is infinite by form: the float itself."""
    return type(stiffness) is float and stiffness == RIGID


def if_elastic(*springs: Spring) -> tuple[Spring, ...]:
    """Those springs that are not rigid by form."""
    return tuple(spring for spring in springs if not is_rigid(spring.stiffness))


def per_length(rigidity: Scalar, length: Scalar, factor: float = 1.0) -> Scalar:
    """Stiffness of a whole link: factor x rigidity / length (SI), rigid by form where the rigidity is."""
    return rigidity if is_rigid(rigidity) else factor * rigidity * reciprocal(length)


def in_series(stiffness: Scalar, rigidity: Scalar, length: Scalar, factor: float = 1.0) -> Scalar:
    """A joint's own stiffness and that of the link built into it, factor x rigidity / length, in a row (SI)."""
    return stiffness if is_rigid(rigidity) else series(stiffness, per_length(rigidity, length, factor))


def bent_links(lengths: Sequence[Scalar], stiffness: Sequence[Scalar], bending: Sequence[Scalar]) -> list[Scalar]:
    """Torsional springs (N·m/rad) for links built in at their lower ends: k52, k54 in a row with 3 EI / length."""
    return [in_series(k, own, size, 3.0) for k, own, size in zip(stiffness, bending, lengths, strict=True)]


def servo(joint: Joint, name: str, stiffness: Scalar) -> Joint | Spring:
    """A joint that is passive where the stiffness is zero by form, and otherwise an actuator of that name."""
    return joint if is_zero(stiffness) else Spring(name, joint, stiffness, actuated=True)


@dataclass(frozen=True)
class RigidLink:
    """A link that does not yield: nothing but a line between two points (base frame, m) for those who draw."""

    start: Vector
    end: Vector

    @property
    def freedoms(self) -> tuple[Joint, ...]:
        """None."""
        return ()

    @property
    def springs(self) -> tuple[Spring, ...]:
        """None."""
        return ()

    @property
    def path(self) -> tuple[Vector, ...]:
        """Its ends, base frame, m."""
        return self.start, self.end

    def displaced(self, motion: Displacement) -> "RigidLink":
        """The link after a rigid displacement of the whole machine."""
        return RigidLink(motion.apply(self.start), motion.apply(self.end))


def arm(name: str, start: Vector, end: Vector, up: Vector, bending: Scalar, torsion: Scalar) -> Element:
    """A link between two points (base frame, m): a beam, or a rigid link where it is rigid by form.

    Args:
        name: of the link.
        start, end: of its axis.
        up: unit vector, not along the link.
        bending, torsion: E I about both axes of its section, and G J, N·m².
    """
    if is_rigid(bending) and is_rigid(torsion):
        return RigidLink(start, end)
    return Beam(name, start, end, up, Rigidity(torsion=torsion, bending_y=bending, bending_z=bending))

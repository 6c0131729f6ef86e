"""Pairs of equal bars on spherical joints, as in the legs of a Delta: what they let move and what they carry.

Source: theory (16). Points and axes are in the base frame.
"""

from dataclasses import dataclass

from kinetostat.algebra.scalar import Scalar, reciprocal
from kinetostat.algebra.vector import Vector
from kinetostat.machine.leg import Element, Joint, Line
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.parts import per_length


@dataclass(frozen=True)
class BarPair:
    """Two parallel bars, on spherical joints at both ends, between a link of a leg and the platform.

    Attributes:
        name: of the leg it belongs to.
        near, far: middles between the two bars at the leg and at the platform, base frame, m.
        side: unit vector from one bar to the other; not along the bars.
        length, spacing: of the bars and between them, m.
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
        """The same freedoms as a chain: R about the side, R about the bars, parallelogram, R about the side.

        They span what does no work with a force along either bar, and no more (theory section 4).
        """
        bar = per_length(self.axial, self.length)
        return (
            Joint(self.side, self.near, f"{self.name} elbow"),
            Joint(self.along, self.near, f"{self.name} bars"),
            Parallelogram(f"{self.name} bars", self.near, self.far, self.side, self.spacing, bar),
            Joint(self.side, self.far, f"{self.name} platform joint"),
        )

    @property
    def lines(self) -> tuple[Line, Line]:
        """The lines of both bars: all that they carry."""
        half = self.side * (0.5 * self.spacing)
        return Line(self.far + half, self.along), Line(self.far - half, self.along)

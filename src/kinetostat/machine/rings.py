"""Two rings of joints, on the base and on the platform: how most families say where their legs begin and end.

Points are in the base frame, those of the platform's ring before it is moved in its own.
"""

from collections.abc import Sequence
from typing import Annotated

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Displacement, Vector, polar, ring
from kinetostat.spec.fields import Quantity, table

Three = tuple[float, float, float]


@table
class Rings:
    """Part of a table [geometry]: the radii."""

    base_radius: Annotated[float, Quantity("length", "radius of the base joints, Rb", positive=True)]
    platform_radius: Annotated[float, Quantity("length", "radius of the platform joints, Rp", positive=True)]

    @property
    def size(self) -> Scalar:
        """Characteristic length of the machine, m: the mean radius."""
        return 0.5 * (self.base_radius + self.platform_radius)


@table
class ThreeLegs(Rings):
    """Part of a table [geometry]: rings of three legs."""

    base_angles: Annotated[
        Three, Quantity("angle", "angles of the base joints from x, leg by leg", count=3, apart=True)
    ]
    platform_angles: Annotated[
        Three, Quantity("angle", "angles of the platform joints from x, leg by leg", count=3, apart=True)
    ]


def ends(
    rings: Rings,
    base_angles: Sequence[Scalar],
    platform_angles: Sequence[Scalar],
    platform: Displacement,
    heights: tuple[Scalar, Scalar] = (0.0, 0.0),
) -> tuple[list[Vector], list[Vector]]:
    """Base joints and platform joints of the legs in order, base frame, m.

    Args:
        rings: the radii.
        base_angles, platform_angles: of the joints from x, rad.
        platform: its placement.
        heights: z of the base ring in the base frame, and of the platform ring in the platform frame, m.
    """
    base = ring(rings.base_radius, base_angles, heights[0])
    return base, [platform.apply(point) for point in ring(rings.platform_radius, platform_angles, heights[1])]


def four_joints(radius: Scalar, angle: Scalar) -> list[Vector]:
    """Joint centres at `radius` (m) and the angles T, 90 deg + T, -(90 deg + T), -T for T = `angle` (rad)."""
    p = polar(radius, angle)
    return [p, Vector(-p.y, p.x, 0.0), Vector(-p.y, -p.x, 0.0), Vector(p.x, -p.y, 0.0)]

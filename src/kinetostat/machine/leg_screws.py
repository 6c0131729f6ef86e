"""The screws by which a leg acts on the platform: twists of its joints and springs, and the wrenches that it carries.

Wrenches are the space reciprocal to the passive twists. Which joints and springs a leg has is in `leg`.

Source: theory (1). Screws are at one reference point in base axes.
"""

from collections.abc import Sequence
from dataclasses import replace

from kinetostat.algebra.scalar import Scalar, reciprocal, sqrt, where
from kinetostat.algebra.screw import Twist, Wrench, force_along, pure_moment
from kinetostat.algebra.solve import complement
from kinetostat.algebra.vector import AXES, ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.tolerances import CLOSING_ROUND_OFF


@dataclass(frozen=True)
class LegScrews:
    """The screws by which a leg acts on the platform, at one reference point in base axes (theory section 2).

    Attributes:
        passive: unit twists that span what the passive joints allow (J_p).
        elastic: unit twist of each spring (J_e).
        compliance: of each spring (diagonal of S): 0 rigid, infinity free; m/N or rad/(N·m).
        wrenches: basis of what the leg can carry (W): no work on any passive twist.
        loads: load in each spring per unit of each wrench (J_e^T W).
        load_squares: square of the size each load has, wrenches' moments over the characteristic length (N², N²m²).
        singularity_margin: 0 where the passive joints lock up, 1 where they are orthogonal (dimensionless).
        wrench_squares: squared size of each wrench, moments over the characteristic length, where wrenches are not of
            unit size: the margin of a platform counts them as if they were. Empty where it counts them as they are.
    """

    passive: tuple[Twist, ...]
    elastic: tuple[Twist, ...]
    compliance: tuple[Scalar, ...]
    wrenches: tuple[Wrench, ...]
    loads: tuple[tuple[Scalar, ...], ...]
    load_squares: tuple[Scalar, ...]
    singularity_margin: Scalar
    wrench_squares: tuple[Scalar, ...] = ()

    @property
    def with_unit_wrenches(self) -> "LegScrews":
        """The same with wrenches of unit size."""
        if not self.wrench_squares:
            return self
        shrink = [reciprocal(sqrt(square)) for square in self.wrench_squares]
        wrenches = tuple(wrench * factor for wrench, factor in zip(self.wrenches, shrink, strict=True))
        loads = tuple(tuple(c * factor for c, factor in zip(row, shrink, strict=True)) for row in self.loads)
        return replace(self, wrenches=wrenches, loads=loads, wrench_squares=())


def work_on_free(wrench: Wrench, twist: Twist) -> Scalar:
    """The work of a wrench on the twist of a free spring, exactly 0 if it is only round-off.

    A free spring gives way to the least load, so that round-off would move it without end. Both are at one point.
    """
    turning = wrench.rotational.norm() * twist.rotational.norm()
    size = turning + wrench.translational.norm() * twist.translational.norm()
    load = wrench.work(twist)
    return where(abs(load) > CLOSING_ROUND_OFF * size, load, 0.0)


def reciprocal_wrenches(passive: Sequence[Twist], length: Scalar) -> tuple[tuple[Wrench, ...], Scalar]:
    """Wrenches that do no work on any of `passive`: a basis of the reciprocal space (J_p^T W = 0).

    Args:
        passive: n independent unit twists, at P in base axes.
        length: m; translations are compared with rotations through it, the space does not depend on it.

    Returns:
        W, 6 - n wrenches at P in base axes (orthonormal once moments are divided by `length`), and the singularity
        margin: 0 where the twists are dependent.
    """
    if not passive:
        return (*(force_along(axis, ZERO) for axis in AXES), *(pure_moment(axis) * length for axis in AXES)), 1.0
    shrink = reciprocal(length)
    basis, singularity_margin = complement([comparable(twist, shrink) for twist in passive])
    return tuple(Wrench(Vector(*row[:3]) * length, Vector(*row[3:])) for row in basis), singularity_margin


def comparable(twist: Twist, shrink: Scalar) -> tuple[Scalar, ...]:
    """The components of a unit twist, translations times `shrink` (1/m); a slide stays of unit size."""
    if twist.slides:
        return twist.components()
    return Twist(twist.rotational, twist.translational * shrink).components()

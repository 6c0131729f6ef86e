"""A platform and the passive leg that guides it: what machines share whose freedoms a passive leg determines."""

from collections.abc import Sequence
from dataclasses import dataclass

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Displacement
from kinetostat.machine.leg import Leg
from kinetostat.machine.machine import Closure, Configuration


@dataclass(frozen=True)
class Guide:
    """A platform at its pose and the passive leg that holds it there.

    Attributes:
        platform: placement of the platform; its translation is P.
        leg: the passive leg, placed.
        closures: what the passive leg needs to close.
    """

    platform: Displacement
    leg: Leg
    closures: tuple[Closure, ...] = ()

    def moved_by(self, legs: Sequence[Leg], size: Scalar, closures: Sequence[Closure] = ()) -> Configuration:
        """The machine with its actuated legs, their closures, and its characteristic length (m)."""
        return Configuration(self.platform, (self.leg, *legs), (*self.closures, *closures), size)

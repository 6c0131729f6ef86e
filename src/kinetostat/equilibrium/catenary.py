"""Cables that sag under their own weight, and leave the base over pulleys that swivel.

A cable of uniform weight hangs in a vertical plane. From its platform end, along its unstretched length, the horizontal
part of its tension stays the same and the vertical part grows by its weight, so that its shape is known in closed form.
Here its tension at the platform is given; its slope there and its unstretched length follow by Newton's method.

Source: theory (79) and (80); M. Irvine, Cable Structures (1981), section 1.2; pulleys: A. Pott, "Influence of pulley
kinematics on cable-driven parallel robots", Latest Advances in Robot Kinematics (2012).
"""

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.tolerances import HANGING, SURELY_HANGING, UNRESISTED

MOST_STEPS = 30
"""Most steps of Newton's method for slope and length of a cable: three or four unless it hangs like a chain."""


@dataclass(frozen=True)
class Hanging:
    """Cables in their vertical planes; each array [n x cables].

    Attributes:
        across, up: parts of the tension at the platform end, horizontally to the base end and upwards, N.
        weight: weight per metre of unstretched cable, N/m.
        rigidity: EA, N.
        length: unstretched, between both ends, m.
    """

    across: Array
    up: Array
    weight: Array
    rigidity: Array
    length: Array

    @property
    def tension(self) -> Array:
        """Tension at the platform end, N."""
        return np.hypot(self.across, self.up)

    @property
    def base_tension(self) -> Array:
        """Tension at the base end, N."""
        return np.hypot(self.across, self.up + self.weight * self.length)

    @property
    def base_slope(self) -> Array:
        """Angle by which the cable rises at its base end, rad."""
        return np.arctan2(self.up + self.weight * self.length, self.across)

    @property
    def spans(self) -> tuple[Array, Array]:
        """Distance of both ends horizontally, and by which the base end is higher, m."""
        stretched, twice = self.length / self.rigidity, 2.0 * self.up + self.weight * self.length
        return self.across * (stretched + self._slope_change), 0.5 * twice * stretched + self.length * self._mean_sine

    @property
    def _mean_sine(self) -> Array:
        """Vertical parts of both end tensions together, over these together: a sine between those of both slopes."""
        return (2.0 * self.up + self.weight * self.length) / (self.tension + self.base_tension)

    @property
    def _slope_change(self) -> Array:
        """Difference of the inverse hyperbolic sines of both slopes over the weight of a metre, however small."""
        high, heavy = self.up + self.weight * self.length, self.weight * self.length
        rising = heavy * (1.0 + self._mean_sine) / (self.up + self.tension)
        falling = heavy * (1.0 - self._mean_sine) / (self.base_tension - high)
        return np.asarray(np.log1p(np.where(self._mean_sine > 0.0, rising, falling)) / self.weight)

    @property
    def compliance(self) -> Array:
        """Rates of both spans by `across` and `up`, m/N [n x cables x 2 x 2]."""
        stretched, both = self.length / self.rigidity, self.tension * self.base_tension
        turning = self.length * (self.tension - self.up * self._mean_sine) / both
        mixed = -self.across * self.length * self._mean_sine / both
        first, last = stretched + self._slope_change - turning, stretched + turning
        return np.stack([np.stack([first, mixed], axis=-1), np.stack([mixed, last], axis=-1)], axis=-2)

    @property
    def stiffness(self) -> Array:
        """Stiffness in its plane, N/m [n x cables x 2 x 2]."""
        return np.asarray(np.linalg.inv(self.compliance))

    @property
    def stiffness_share(self) -> Array:
        """Share of the stiffness EA/L of a straight cable that it has along the line of its ends."""
        level, rise = self.spans
        chord = np.stack([level, rise], axis=-1) / np.hypot(level, rise)[..., None]
        along = np.einsum("nma,nmab,nmb->nm", chord, self.stiffness, chord)
        return np.asarray(along * self.length / self.rigidity)

    @property
    def sag(self) -> Array:
        """Greatest distance of the cable from the line of its ends, m."""
        level, rise = self.spans
        # The farthest point is where the cable runs along that line: up + w s = across * rise / level.
        part = np.clip((self.across * rise / np.maximum(level, UNRESISTED) - self.up) / self.weight, 0.0, self.length)
        there = Hanging(self.across, self.up, self.weight, self.rigidity, np.maximum(part, UNRESISTED))
        x, z = there.spans
        return np.abs(z * level - x * rise) / np.hypot(level, rise)


def hanging_cables(level: Array, rise: Array, tension: Array, weight: Array, rigidity: Array) -> Hanging:
    """Find the cables that hang between two points with given tensions at the platform [n x cables each].

    Args:
        level, rise: distance of the points horizontally, and by which the base end is higher, m.
        tension: tension at the platform end, N.
        weight: weight per metre of unstretched cable, N/m; greater than 0.
        rigidity: EA, N.

    Returns:
        The cables; NaN where none hangs so.
    """
    level = np.maximum(level, HANGING * np.abs(rise))  # a cable that hangs straight down, but for round-off
    slope, length = np.arctan2(rise, level), np.hypot(level, rise) / (1.0 + tension / rigidity)
    with np.errstate(all="ignore"):
        for _ in range(MOST_STEPS):
            across, up = tension * np.cos(slope), tension * np.sin(slope)
            cable = Hanging(across, up, weight, rigidity, length)
            missed = np.stack([level, rise], axis=-1) - np.stack(cable.spans, axis=-1)
            turned = np.einsum("nmab,nmb->nma", cable.compliance, np.stack([-up, across], axis=-1))
            direction = cable.base_slope
            longer = np.stack([np.cos(direction), np.sin(direction)], axis=-1)
            longer = longer * (1.0 + cable.base_tension / rigidity)[..., None]
            rates = np.stack([turned, longer], axis=-1)
            regular = np.abs(np.linalg.det(rates)) > 0.0
            step = np.linalg.solve(np.where(regular[..., None, None], rates, np.eye(2)), missed[..., None])[..., 0]
            slope, length = slope + step[..., 0], np.abs(length + step[..., 1])
            if not (np.abs(step).max(axis=-1) > HANGING * np.hypot(level, rise)).any():
                break
    good = np.abs(step).max(axis=-1) <= SURELY_HANGING * np.hypot(level, rise)
    length = np.where(good, length, np.nan)
    return Hanging(tension * np.cos(slope), tension * np.sin(slope), weight, rigidity, length)


def leaving_points(guides: Array, ends: Array, radius: Array, slope: Array) -> tuple[Array, Array]:
    """Find where cables leave pulleys that swivel about the vertical through their guides.

    A cable comes up through its guide, runs over the wheel, whose centre lies by its radius nearer to the platform, and
    leaves it along its own slope.

    Args:
        guides: where cables enter their pulleys [n x cables x 3], m.
        ends: their ends at the platform [n x cables x 3], m.
        radius: radius of the wheels, m [n].
        slope: angles by which the cables rise where they leave [n x cables], rad.

    Returns:
        The points where they leave [n x cables x 3], m, and lengths that lie on the wheels [n x cables], m.
    """
    ahead = (ends - guides) * [1.0, 1.0, 0.0]
    ahead = ahead / np.maximum(np.sqrt((ahead * ahead).sum(axis=2, keepdims=True)), UNRESISTED)
    forward = radius[:, None] * (1.0 + np.sin(slope))
    points = guides + forward[:, :, None] * ahead
    points[:, :, 2] += radius[:, None] * np.cos(slope)
    return points, radius[:, None] * (0.5 * np.pi + slope)

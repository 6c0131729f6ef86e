"""Free screws of a leg at many places, and the wrenches that it carries there. No leg is followed here.

Which freedoms are independent is a matter of the leg's form. Where it is known, an orthogonal basis of these gives the
wrenches, and with them the least steps follow from linear equations; places at which freedoms are nearly dependent are
decomposed by their singular values.

Source: theory (46) and (48).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.numerics.motions import cross
from kinetostat.tolerances import NEARLY_DEPENDENT, SEEN_BY_LEG

SEEN = 1e-7
"""Least ratio of a singular value of joint screws to the largest one, with lengths in units of the machine's."""


def scaled(twists: Array, length: float, axis: int = -1) -> Array:
    """Twists with their translations in units of a length; `axis` has their six components."""
    units = np.array([1.0, 1.0, 1.0] + [1.0 / length] * 3)
    shape = [1] * twists.ndim
    shape[axis] = 6
    return twists * units.reshape(shape)


def moved_to(twists: Array, point: Array) -> Array:
    """Twists given at the base origin [n x ... x 6], at points [n x 3]."""
    turning, moving = twists[..., :3], twists[..., 3:]
    at = point.reshape(len(point), *([1] * (twists.ndim - 2)), 3)
    return np.concatenate([turning, moving + cross(turning, np.broadcast_to(at, moving.shape))], axis=-1)


def independent(screws: Array) -> tuple[int, ...]:
    """Choose the screws of a leg that do not follow from those before them.

    Args:
        screws: at random places, where nothing is dependent but by form [n x 6 x k].
    """
    basis, chosen = np.zeros((*screws.shape[:2], 0)), []
    for place in range(screws.shape[2]):
        column = screws[:, :, place, None]
        rest = column
        for _ in range(2):
            rest = rest - basis @ (np.swapaxes(basis, 1, 2) @ rest)
        left, size = (np.linalg.norm(part, axis=1, keepdims=True) for part in (rest, column))
        if (left > SEEN_BY_LEG * size).any():
            basis = np.concatenate([basis, rest / np.maximum(left, 1e-300)], axis=2)
            chosen.append(place)
    return tuple(chosen)


@dataclass(frozen=True)
class Screws:
    """Screws of the free motions of a leg at n places.

    Attributes:
        screws: in units of the length [n x 6 x k]; results are NaN where they are not finite.
        chosen: which of them are independent by form, r of them.
    """

    screws: Array
    chosen: tuple[int, ...]

    @cached_property
    def wrenches(self) -> Array:
        """An orthonormal basis of what the leg carries: what does no work on any of them [n x 6 x (6 - r)]."""
        return self._carried[0]

    def steps(self, twists: Array) -> Array:
        """The least steps that come nearest to twists [n x 6] in units of the length [n x coordinates].

        A^T (A A^T + W W^T)^-1 is the pseudo-inverse of A if the columns of W are a basis of what A does not reach.
        """
        wrenches, thin = self._carried
        every, rest = np.swapaxes(self.screws, 1, 2), np.swapaxes(wrenches, 1, 2)
        whole = self.screws @ every + wrenches @ rest
        whole[thin | ~np.isfinite(whole).all(axis=(1, 2))] = np.eye(6)
        result = (every @ np.linalg.solve(whole, twists[:, :, None]))[:, :, 0]
        if thin.any():
            backward = np.linalg.pinv(self.screws[thin], rcond=SEEN)
            result[thin] = (backward @ twists[thin, :, None])[:, :, 0]
        return np.asarray(result)

    @cached_property
    def _carried(self) -> tuple[Array, Mask]:
        """The wrenches, and where the independent screws are nearly dependent."""
        rank, finite = len(self.chosen), np.isfinite(self.screws).all(axis=(1, 2))
        orthogonal, triangle = np.linalg.qr(self.screws[:, :, list(self.chosen)], mode="complete")
        wrenches = np.array(orthogonal[:, :, rank:])
        pivots = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
        thin = finite & ~(pivots.min(axis=1, initial=np.inf) > NEARLY_DEPENDENT * pivots.max(axis=1, initial=0.0))
        if thin.any():
            wrenches[thin] = np.linalg.svd(self.screws[thin])[0][:, :, rank:]
        wrenches[~finite] = np.nan
        return wrenches, np.asarray(thin)

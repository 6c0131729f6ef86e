"""Which nodes of a grid hang together: what can be reached from one of them without leaving a region."""

from math import prod

import numpy as np
import numpy.typing as npt

Mask = npt.NDArray[np.bool_]


def connected_to(region: Mask, seed: tuple[int, ...]) -> Mask:
    """The nodes of the region that steps along the axes, within it, lead to from `seed`; none if that is outside.

    Args:
        region: over a grid of any number of dimensions.
        seed: index of a node.
    """
    walled = np.pad(region, 1)
    left = walled.ravel()
    strides = [prod(walled.shape[axis + 1 :]) for axis in range(region.ndim)]
    steps = np.array([sign * stride for stride in strides for sign in (-1, 1)])
    found = np.zeros_like(left)
    front = np.array([sum((i + 1) * stride for i, stride in zip(seed, strides, strict=True))])
    front = front[left[front]]
    while front.size:
        left[front], found[front] = False, True
        around = (front[:, None] + steps).ravel()
        front = np.unique(around[left[around]])
    inner = (slice(1, -1),) * region.ndim
    return found.reshape(walled.shape)[inner]

"""The values of a map that matter to the eye: all but the few next to a singularity, where compliance has no bound."""

import numpy as np

from kinetostat.arrays import Array

USUAL = (2.0, 98.0)
"""Percentiles between which values are usual."""
FAR = 1.0
"""Distance of an extreme from the usual values, in units of their range, beyond which a map leaves it out."""
WIDE = 30.0
"""Ratio of the usual values of a map, if all are positive, from which its colours follow the logarithm."""


def usual_range(values: Array) -> tuple[float, float]:
    """Return the ends between which a map should resolve values: extremes only where they lie near all others.

    A map of 41 x 41 poses with a single pose next to a singularity would otherwise be of one colour.

    Args:
        values: of any shape; those that are not finite are ignored, at least one must be finite.
    """
    finite = values[np.isfinite(values)]
    least, low, high, greatest = np.percentile(finite, [0.0, *USUAL, 100.0])
    far = FAR * (high - low)
    return float(low if low - least > far else least), float(high if greatest - high > far else greatest)

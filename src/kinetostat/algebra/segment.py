"""Line segments: how near two of them come. No machine here.

Points are in axes that the caller chooses.
"""

from kinetostat.algebra.scalar import Scalar, reciprocal, smaller, where
from kinetostat.algebra.vector import Vector

PARALLEL = 1e-14
"""Square of the sine of the angle between two segments below which they are parallel: any point then serves."""


def squared_distance(one: tuple[Vector, Vector], other: tuple[Vector, Vector]) -> Scalar:
    """Square of the least distance of two line segments, each given by its ends, m².

    Source: C. Ericson, Real-Time Collision Detection (2005), section 5.1.9, with choices in place of branches.
    """
    along, across, between = one[1] - one[0], other[1] - other[0], one[0] - other[0]
    a, b, c = along.dot(along), along.dot(across), across.dot(across)
    d, e = along.dot(between), across.dot(between)
    crossed = a * c - b * b
    apart = crossed > PARALLEL * (a * c)
    s = where(apart, _clamped((b * e - c * d) * reciprocal(where(apart, crossed, 1.0))), 0.0)
    t = (b * s + e) * reciprocal(c)
    begin, end = _clamped(-d * reciprocal(a)), _clamped((b - d) * reciprocal(a))
    s = where(t < 0.0, begin, where(t > 1.0, end, s))
    gap = between + along * s - across * _clamped(t)
    return gap.dot(gap)


def _clamped(share: Scalar) -> Scalar:
    """The share, brought between 0 and 1."""
    return where(share > 0.0, smaller(share, 1.0), 0.0)

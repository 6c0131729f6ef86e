"""Plane triangles: the one closed form that two-link legs need. Knows no machine."""

from kinetostat.algebra.scalar import Scalar, reciprocal, sqrt
from kinetostat.algebra.vector import Vector


def apex(start: Vector, end: Vector, first: Scalar, second: Scalar) -> tuple[Vector, Scalar]:
    """Apex of the triangle over the side start-end, in the plane y = constant, on the right of that side seen from -y.

    For an end above the start that is the apex on the +x side.

    Args:
        start, end: two corners in one plane y = constant, m.
        first, second: lengths of the sides that meet start and end, m.

    Returns:
        The apex, and the sine of the angle there: 0 where the triangle is flat, both NaN where it cannot close.
    """
    span = end - start
    square = span.dot(span)
    shrink = reciprocal(square)
    along = 0.5 * (1.0 + (first * first - second * second) * shrink)
    across = sqrt(first * first * shrink - along * along)
    point = start + span * along + Vector(span.z, 0.0, -span.x) * across
    return point, across * square * reciprocal(first * second)

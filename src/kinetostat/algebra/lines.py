"""Lines and segments: where two links meet, or a link and a rail, and how near two links come. Knows no machine.

Source: theory (13), (14) and (23). All points are in axes that the caller chooses.
"""

from kinetostat.algebra.scalar import Scalar, reciprocal, smaller, sqrt, where
from kinetostat.algebra.vector import Vector
from kinetostat.tolerances import PARALLEL_SEGMENTS


def apex(start: Vector, end: Vector, first: Scalar, second: Scalar) -> tuple[Vector, Scalar]:
    """Return the apex of the triangle over start-end in the plane y = constant, on its right seen from -y.

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


def crank_end(start: Vector, end: Vector, axis: Vector, crank: Scalar, rod: Scalar) -> Vector:
    """Intersect the circle of a crank about an axis through `start` with the sphere of a rod that ends at `end`.

    Of the two points the one that lies, seen along the axis, at +90 deg from the way from start to end. With `axis`
    along y and start and end in one plane y = constant, it is the `apex`.

    Args:
        start, end: centre of the crank's circle, and far end of the rod, m.
        axis: unit vector.
        crank, rod: lengths, m.

    Returns:
        The common end of both, m; not a number where they do not meet.
    """
    span = end - start
    offset = span.dot(axis)
    in_plane = span - axis * offset
    shrink = reciprocal(in_plane.dot(in_plane))
    rod_square = rod * rod - offset * offset  # of the rod as seen along the axis
    along = 0.5 * (1.0 + (crank * crank - rod_square) * shrink)
    across = sqrt(crank * crank * shrink - along * along)
    return start + in_plane * along + axis.cross(in_plane) * across


def crank_range(start: Vector, end: Vector, axis: Vector, crank: Scalar) -> tuple[Scalar, Scalar]:
    """Least and greatest distance (m) of `end` from the circle of the crank's end: a rod must be between them."""
    span = end - start
    offset = span.dot(axis)
    radius = (span - axis * offset).norm()
    near, far = radius - crank, radius + crank
    return sqrt(near * near + offset * offset), sqrt(far * far + offset * offset)


def slide_travel(start: Vector, end: Vector, direction: Vector, rod: Scalar) -> tuple[Scalar, Scalar]:
    """Return how far a slide must go from `start` to meet a rod that ends at `end`: a line and a sphere.

    Of the two positions the one behind `end`, from where the rod points forward.

    Args:
        start: a point of the rail, m.
        end: far end of the rod, m.
        direction: unit vector of the rail.
        rod: length, m.

    Returns:
        The travel along `direction`, m, NaN where the rod is too short; and the distance of `end` from the rail, m.
    """
    span = end - start
    ahead = span.dot(direction)
    aside = span - direction * ahead
    square = aside.dot(aside)
    return ahead - sqrt(rod * rod - square), sqrt(square)


def squared_distance(first: tuple[Vector, Vector], second: tuple[Vector, Vector]) -> Scalar:
    """Return the square of the least distance of two line segments, each given by its ends, m².

    Neither segment may be a point.

    Source: C. Ericson, Real-Time Collision Detection (2005), section 5.1.9, with choices in place of branches.
    """
    along, across, between = first[1] - first[0], second[1] - second[0], first[0] - second[0]
    a, b, c = along.dot(along), along.dot(across), across.dot(across)
    d, e = along.dot(between), across.dot(between)
    determinant = a * c - b * b
    crossing = determinant > PARALLEL_SEGMENTS * (a * c)
    s = where(crossing, _within_ends((b * e - c * d) * reciprocal(where(crossing, determinant, 1.0))), 0.0)
    t = (b * s + e) * reciprocal(c)
    begin, end = _within_ends(-d * reciprocal(a)), _within_ends((b - d) * reciprocal(a))
    s = where(t < 0.0, begin, where(t > 1.0, end, s))
    gap = between + along * s - across * _within_ends(t)
    return gap.dot(gap)


def _within_ends(share: Scalar) -> Scalar:
    """Limit a share to the range from 0 to 1."""
    return where(share > 0.0, smaller(share, 1.0), 0.0)

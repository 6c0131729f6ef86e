"""Hypothesis strategies for vectors, rotations and displacements, dense near the identity as well as far from it."""

import math

from hypothesis import strategies as st

from kinetostat.algebra.vector import Displacement, Rotation, Vector, rotation_x, rotation_y

LARGE = st.floats(-math.pi, math.pi)
TINY = st.builds(lambda sign, exponent: sign * 10.0**exponent, st.sampled_from([-1.0, 1.0]), st.floats(-12, -4))
"""Angles so near zero that a cosine rounds to 1 or loses half of its digits."""
ANGLES = LARGE | TINY | st.just(0.0)


def about_x(angle: float) -> Rotation:
    return rotation_x(math.cos(angle), math.sin(angle))


def about_y(angle: float) -> Rotation:
    return rotation_y(math.cos(angle), math.sin(angle))


def coordinates(size: float) -> st.SearchStrategy[float]:
    """Coordinates up to `size`; those below 1e-12 of it become exact zeros, to keep squares far from underflow."""
    return st.floats(-size, size).map(lambda c: c if abs(c) > 1e-12 * size else 0.0)


def vectors(size: float = 1.0) -> st.SearchStrategy[Vector]:
    return st.builds(Vector, coordinates(size), coordinates(size), coordinates(size))


@st.composite
def rotations(draw: st.DrawFn, angles: st.SearchStrategy[float] = ANGLES) -> Rotation:
    """Any rotation, as Ry Rx Ry."""
    first, second, third = draw(angles), draw(angles), draw(angles)
    return about_y(first) @ about_x(second) @ about_y(third)


def displacements(size: float = 1.0) -> st.SearchStrategy[Displacement]:
    return st.builds(Displacement, rotations(), vectors(size))


def unit_vectors() -> st.SearchStrategy[Vector]:
    return rotations().map(lambda rotation: rotation.z)

"""Cosine and sine by arithmetic alone, over any scalar, so that traced code vectorises. No library is called."""

import math

from kinetostat.algebra.scalar import Scalar, where

LARGEST_ANGLE = 1e6
"""rad; up to here the number of quarter turns fits 20 bits, so that its products with `QUARTER` are exact."""
QUARTER = (float.fromhex("0x1.921fb544p+0"), float.fromhex("0x1.0b4611a6p-34"), float.fromhex("0x1.3198a2e037073p-69"))
"""pi / 2 in three parts, the first two of 33 bits (fdlibm, e_rem_pio2.c)."""
NEAREST_SHIFT = 1.5 * 2.0**52
"""Added to a smaller number and taken off again, it leaves the nearest integer."""
SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
"""sin r = r + r^3 (SINE[0] + SINE[1] r^2 + ...) for |r| <= pi / 4 (fdlibm, k_sin.c)."""
COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)
"""cos r = 1 - r^2 / 2 + r^4 (COSINE[0] + COSINE[1] r^2 + ...) for |r| <= pi / 4 (fdlibm, k_cos.c)."""


def cos_and_sin(angle: Scalar) -> tuple[Scalar, Scalar]:
    """Return cosine and sine of an angle (rad, at most `LARGEST_ANGLE`), to two units in the last place.

    Take off the nearest number of quarter turns q, use the series for the rest r, and turn back by q modulo 4.
    """
    quarters = _nearest(angle * (2.0 / math.pi))
    rest = angle
    for part in QUARTER:
        rest = rest - quarters * part
    square = rest * rest
    sine = rest + rest * square * _polynomial(SINE, square)
    half = 0.5 * square
    most = 1.0 - half
    cosine = most + ((1.0 - most - half) + square * square * _polynomial(COSINE, square))
    turn = quarters - 4.0 * _nearest(0.25 * quarters)  # -2 to 2
    odd = (abs(turn) > 0.5) & (abs(turn) < 1.5)
    sign = where(odd, turn, 1.0 - 0.5 * turn * turn)
    return sign * where(odd, -sine, cosine), sign * where(odd, cosine, sine)


def _nearest(a: Scalar) -> Scalar:
    return (a + NEAREST_SHIFT) - NEAREST_SHIFT


def _polynomial(coefficients: tuple[float, ...], x: Scalar) -> Scalar:
    result: Scalar = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        result = result * x + coefficient
    return result

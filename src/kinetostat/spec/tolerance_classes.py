"""Tolerance classes of two standards by nominal size: grades IT1 to IT14 of ISO 286-1, classes of ISO 2768-1.

The numbers are those that the standards print. `spec.tolerance_table` reads what a machine file says about tolerances.
"""

import math
from bisect import bisect_left

from kinetostat.spec.errors import InputError

MM, UM, MINUTE = 1e-3, 1e-6, math.pi / 180.0 / 60.0

SIZES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500, 630, 800, 1000, 1250, 1600, 2000, 2500, 3150)
"""Upper ends of the ranges of nominal sizes, mm. Source: ISO 286-1:2010, table 1."""
GRADES = {
    1: (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8, 9, 10, 11, 13, 15, 18, 22, 26),
    2: (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10, 11, 13, 15, 18, 21, 25, 30, 36),
    3: (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15, 16, 18, 21, 24, 29, 35, 41, 50),
    4: (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 22, 25, 28, 33, 39, 46, 55, 68),
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27, 32, 36, 40, 47, 55, 65, 78, 96),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40, 44, 50, 56, 66, 78, 92, 110, 135),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63, 70, 80, 90, 105, 125, 150, 175, 210),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97, 110, 125, 140, 165, 195, 230, 280, 330),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155, 175, 200, 230, 260, 310, 370, 440, 540),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250, 280, 320, 360, 420, 500, 600, 700, 860),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400, 440, 500, 560, 660, 780, 920, 1100, 1350),
    12: (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630, 700, 800, 900, 1050, 1250, 1500, 1750, 2100),
    13: (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970, 1100, 1250, 1400, 1650, 1950, 2300, 2800,
         3300),
    14: (250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550, 1750, 2000, 2300, 2600, 3100, 3700,
         4400, 5400),
}  # fmt: skip
"""Width of the whole tolerance zone, µm, by grade and range of sizes. Source: ISO 286-1:2010, table 1."""
LENGTHS = (3, 6, 30, 120, 400, 1000, 2000, 4000)
"""Upper ends of the ranges of lengths, mm. Source: ISO 2768-1:1989, table 1."""
LENGTH_LIMITS = {
    "f": (0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, None),
    "m": (0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0),
    "c": (0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 4.0),
    "v": (None, 0.5, 1.0, 1.5, 2.5, 4.0, 6.0, 8.0),
}
"""Plus-minus, mm; None where the standard gives no value. Source: ISO 2768-1:1989, table 1."""
SIDES = (10, 50, 120, 400, math.inf)
"""Upper ends of the ranges of the shorter side of an angle, mm. Source: ISO 2768-1:1989, table 3."""
ANGLE_LIMITS = {
    "f": (60, 30, 20, 10, 5),
    "m": (60, 30, 20, 10, 5),
    "c": (90, 60, 30, 15, 10),
    "v": (180, 120, 60, 30, 20),
}
"""Plus-minus, minutes of arc. Source: ISO 2768-1:1989, table 3."""


def within_grade(grade: int, size: float) -> float:
    """Half of the tolerance zone of a grade: how far a length may be from its nominal size either way, m.

    Args:
        grade: 1 to 14, of ISO 286-1.
        size: nominal size, m.

    Raises:
        InputError: the size is beyond the table.
    """
    place = bisect_left(SIZES, _mm(size, SIZES[-1], f"IT{grade}"))
    return 0.5 * UM * GRADES[grade][place]


def within_class(name: str, size: float, kind: str) -> float:
    """Limit of a class of ISO 2768-1: how far a length (m) or an angle (rad) may be from its nominal value either way.

    Args:
        name: "f", "m", "c" or "v".
        size: nominal length, or length of the shorter side of the angle, m.
        kind: "length" or "angle".

    Raises:
        InputError: the size is beyond the table, or the class has no value there.
    """
    if kind == "angle":
        return MINUTE * ANGLE_LIMITS[name][bisect_left(SIDES, size / MM)]
    limit = LENGTH_LIMITS[name][bisect_left(LENGTHS, _mm(size, LENGTHS[-1], f"ISO 2768-{name}"))]
    if limit is None:
        raise InputError(
            f"ISO 2768-{name} has no value for {size / MM:g} mm; take another class, or write the tolerance in mm."
        )
    return MM * limit


def _mm(size: float, most: float, name: str) -> float:
    """A nominal size in mm, rounded so that 400 mm is not above 400 mm."""
    millimetres = round(size / MM, 9)
    if not 0.0 < millimetres <= most:
        raise InputError(
            f"{name} has values for sizes up to {most:g} mm, not for {millimetres:g} mm; write the tolerance in mm."
        )
    return millimetres

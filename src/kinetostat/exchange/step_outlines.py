"""The lines and arcs of which an outline consists, found in its points. Knows no solid and no format."""

import cmath
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

from kinetostat.views.scene.solids import Point2

Piece: TypeAlias = tuple[Point2, Point2] | tuple[Point2, Point2, Point2]
"""The ends of a line; or those of an arc, with a point of it between them."""

EVEN = 1e-9
"""How far chords of one arc may differ, in units of their length: what rounding leaves, and far less than one sees."""
CORNER = math.radians(30)
"""Turn from one chord to the next, rad, from which on there is a corner: a scene rounds in finer steps."""
FEWEST = 3
"""Chords of an arc: of fewer one cannot tell that they are of a circle."""


def pieces(points: Sequence[Point2]) -> Iterator[Piece]:
    """A path through points as lines and arcs, in order: an arc where points follow each other evenly round a circle.

    An arc is at most half a circle, so that its three points lie well apart.

    Args:
        points: of the path, m; no two in a row coincide.
    """
    chords = [complex(x2 - x1, y2 - y1) for (x1, y1), (x2, y2) in pairwise(points)]
    at = 0
    while at < len(chords):
        count = _chords_of_arc(chords, at)
        if count < FEWEST:
            yield points[at], points[at + 1]
            at += 1
        else:
            yield points[at], points[at + count // 2], points[at + count]
            at += count


def _chords_of_arc(chords: Sequence[complex], start: int) -> int:
    """How many chords from one on have the same length and turn by the same angle, up to half a circle."""
    if start + 1 == len(chords):
        return 1
    turn = chords[start + 1] / chords[start]
    angle = abs(cmath.phase(turn))
    if abs(abs(turn) - 1.0) > EVEN or not EVEN < angle < CORNER:
        return 1
    end = min(len(chords), start + math.floor(math.pi / angle + EVEN))
    following = range(start + 1, end)
    return next((i for i in following if abs(chords[i] / chords[i - 1] - turn) > EVEN), end) - start

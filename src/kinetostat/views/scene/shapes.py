"""Shapes of the parts of machines: shafts, balls, forks, blocks, coils, arrows. Each in its own axes, m.

Their places and materials are decided elsewhere.
"""

import math
from functools import lru_cache

from kinetostat.views.scene.solids import Extruded, Point2, Swept, Turned

HALF_CIRCLE_POINTS = 24
"""Points of a half circle: it looks round on a screen."""
COIL_TURN_POINTS = 18
"""Points of a turn of a coil, which is small: it looks round."""
CORNER_POINTS = 8
"""Points of a rounded corner, a quarter of a circle: it looks round."""
CUP_RADIUS, RIM_RADIUS = 1.22, 1.02
"""Outer radius and rim of the cup around a ball, in radii of the ball: the ball is seen to move in it."""
HEAD_RADIUS, HEAD_LENGTH = 2.6, 6.0
"""Radius and length of an arrow's head, in radii of its shaft: it is seen as a point, and not as a ball."""
MOST_HEAD_SHARE = 0.4
"""Length of all heads of an arrow as a share of its length, at most: some of the shaft is left of a short one."""

shared = lru_cache(512)
"""Decorator: a shape that does not change while a machine moves is one object, whose mesh is made once."""


@shared
def shaft(radius: float, length: float, chamfer: float = 0.0, start: float = 0.0) -> Turned:
    """Return a cylinder about z from height `start`, its ends chamfered."""
    c = min(chamfer, 0.5 * radius, 0.45 * length)  # some of the faces is left, however thin or short the shaft is
    end = start + length
    return Turned(
        ((0.0, start), (radius - c, start), (radius, start + c), (radius, end - c), (radius - c, end), (0.0, end))
    )


@shared
def pin(radius: float, length: float) -> Turned:
    """Return a shaft about z through the origin, centred there."""
    return shaft(radius, length, 0.18 * radius, -0.5 * length)


@shared
def ball(radius: float) -> Turned:
    """Return a ball about the origin."""
    angles = [math.pi * (i / HALF_CIRCLE_POINTS - 0.5) for i in range(HALF_CIRCLE_POINTS + 1)]
    return Turned(tuple((abs(radius * math.cos(a)), radius * math.sin(a)) for a in angles))


@shared
def cone(bottom: float, top: float, length: float) -> Turned:
    """Return a frustum about z from the origin."""
    return Turned(((0.0, 0.0), (bottom, 0.0), (top, length), (0.0, length)))


@shared
def waist(radius: float, neck: float, length: float) -> Turned:
    """Return a shaft with a thin neck in its middle, centred at the origin: a flexure."""
    half = 0.5 * length
    heights = [half * (i / CORNER_POINTS - 1.0) for i in range(2 * CORNER_POINTS + 1)]
    sides = [(neck + (radius - neck) * (h / half) ** 2, h) for h in heights]
    return Turned(((0.0, -half), *sides, (0.0, half)))


@shared
def socket(radius: float) -> Turned:
    """Return a cup around the lower half of a ball of this radius, with its stem towards -z."""
    angles = [math.radians(a) for a in range(-60, 21, 10)]
    outer = [(CUP_RADIUS * radius * math.cos(a), CUP_RADIUS * radius * math.sin(a)) for a in angles]
    rim = (RIM_RADIUS * radius * math.cos(angles[-1]), RIM_RADIUS * radius * math.sin(angles[-1]))
    return Turned(((0.0, outer[0][1]), *outer, rim, (0.0, rim[1])))


@shared
def block(width: float, depth: float, height: float, chamfer: float = 0.0) -> Extruded:
    """Return a box on the x-y plane, centred on z."""
    w, d = 0.5 * width, 0.5 * depth
    return Extruded(((-w, -d), (w, -d), (w, d), (-w, d)), height, chamfer)


@shared
def fork(gap: float, arm: float, reach: float, foot: float) -> tuple[Point2, ...]:
    """Return the outline of a fork with arms on both sides of a gap that is centred at the origin.

    Args:
        gap: distance of the arms, m.
        arm: width of an arm, m; the arms end round above the origin.
        reach: distance of the lower side of the bridge from the origin, towards -y, m.
        foot: thickness of the bridge, m.
    """
    inner, outer = 0.5 * gap, 0.5 * gap + arm
    bridge = -reach + foot

    def tip(middle: float) -> list[Point2]:
        angles = [math.pi * i / CORNER_POINTS for i in range(CORNER_POINTS + 1)]
        return [(middle + 0.5 * arm * math.cos(a), arm * 0.9 + 0.5 * arm * math.sin(a)) for a in angles]

    right, left = tip(inner + 0.5 * arm), tip(-inner - 0.5 * arm)
    return (
        (-outer + 0.4 * arm, -reach), (outer - 0.4 * arm, -reach), (outer, -reach + 0.6 * arm),
        *right, (inner, bridge), (-inner, bridge), *left, (-outer, -reach + 0.6 * arm),
    )  # fmt: skip


@shared
def spiral(inner: float, outer: float, turns: float, wire: float) -> Swept:
    """Return a flat spiral in the x-y plane with a straight end: the symbol of a torsional spring about z."""
    count = round(COIL_TURN_POINTS * turns)
    steps = [i / count for i in range(count + 1)]
    curve = [((inner + (outer - inner) * t), math.tau * turns * t) for t in steps]
    path = [(r * math.cos(a), r * math.sin(a), 0.0) for r, a in curve]
    x, y, _ = path[-1]
    return Swept((*path, (x * 1.12, y * 1.12, 0.0)), wire)


@shared
def helix(radius: float, length: float, turns: float, wire: float) -> Swept:
    """Return a coil about z, centred at the origin: the symbol of a linear spring."""
    count = round(COIL_TURN_POINTS * turns)
    angles = [math.tau * turns * i / count for i in range(count + 1)]
    path = [(radius * math.cos(a), radius * math.sin(a), length * (i / count - 0.5)) for i, a in enumerate(angles)]
    return Swept(tuple(path), wire)


@shared
def arc(radius: float, turn: float, wire: float) -> Swept:
    """Return a wire arc in the x-y plane, from x over the angle `turn` (rad)."""
    angles = [turn * i / (2 * HALF_CIRCLE_POINTS) for i in range(2 * HALF_CIRCLE_POINTS + 1)]
    return Swept(tuple((radius * math.cos(a), radius * math.sin(a), 0.0) for a in angles), wire)


@shared
def arrow(length: float, radius: float) -> Turned:
    """Return an arrow along z from the origin."""
    neck = length - min(MOST_HEAD_SHARE * length, HEAD_LENGTH * radius)
    return Turned(((0.0, 0.0), (radius, 0.0), (radius, neck), (HEAD_RADIUS * radius, neck), (0.0, length)))


@shared
def double_arrow(length: float, radius: float) -> Turned:
    """Return an arrow along z with a head at either end, centred at the origin."""
    half, wide = 0.5 * length, HEAD_RADIUS * radius
    neck = half - min(MOST_HEAD_SHARE * half, HEAD_LENGTH * radius)
    return Turned(((0.0, -half), (wide, -neck), (radius, -neck), (radius, neck), (wide, neck), (0.0, half)))

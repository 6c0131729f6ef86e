"""Legs that close by construction: joints are placed where the legs stand at the home pose, base to platform.

Each leg is drawn for the motion that the machine shall have. Links, stiffnesses and files are `grown_machines`'
business. Points and axes are in the base frame at the home pose, m; twists are about its origin, rotation first.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from random import Random
from typing import Any

import numpy as np

from kinetostat.arrays import Array

LEAST_SINE = 0.3
"""Sine of the angle that axes of one joint make at least."""
JITTER = 0.07
"""How far a joint lies beside the straight line from foot to head, m."""
LENGTH = 0.3
"""Of a machine, m: makes rotations comparable with translations."""
FREEDOMS = {
    "revolute": 1, "prismatic": 1, "helical": 1, "parallelogram": 1, "cylindrical": 2, "universal": 2, "planar": 3,
    "spherical": 3, "fixed": 0,
}  # fmt: skip
"""Freedoms of the types of joints that drawn machines have."""
SLIDES = {"prismatic": 1, "parallelogram": 1, "cylindrical": 1, "planar": 2}
"""Freedoms of these that are translations; no more than three of a leg are independent."""


@dataclass(frozen=True)
class Joint:
    """A joint of a leg: its type, and what its file says about where it is."""

    kind: str
    fields: dict[str, Any]

    @property
    def end(self) -> Array:
        """Where the link behind it begins, m."""
        return np.array(self.fields.get("far", self.fields["point"]))

    @cached_property
    def twists(self) -> Array:
        """Of its freedoms [6 x freedoms], in the order in which they follow each other."""
        f, point = self.fields, np.array(self.fields["point"])
        if self.kind == "fixed":
            return np.zeros((6, 0))
        if self.kind == "parallelogram":
            bars = unit(self.end - point)
            return _columns(slide(unit(np.cross(np.cross(f["axis"], bars), bars))))
        if self.kind == "prismatic":
            return _columns(slide(unit(f["axis"])))
        if self.kind in ("revolute", "helical"):
            return _columns(turn(unit(f["axis"]), point) + f.get("pitch", 0.0) * slide(unit(f["axis"])))
        if self.kind == "cylindrical":
            return _columns(turn(unit(f["axis"]), point), slide(unit(f["axis"])))
        if self.kind == "spherical" and "first_axis" not in f:
            return _columns(*(turn(axis, point) for axis in np.eye(3)))
        first, second = unit(f["first_axis"]), unit(f["second_axis"])
        normal = unit(np.cross(first, second))
        if self.kind == "planar":
            return _columns(slide(first), slide(second), turn(normal, point))
        return _columns(*(turn(axis, point) for axis in (first, second, normal)[: FREEDOMS[self.kind]]))


def _columns(*twists: Array) -> Array:
    return np.array(twists).T


def turn(axis: Array, point: Array) -> Array:
    """The twist of a rotation about an axis through a point."""
    return np.concatenate([axis, np.cross(point, axis)])


def slide(axis: Array) -> Array:
    """The twist of a translation."""
    return np.concatenate([np.zeros(3), axis])


def unit(vector: Sequence[float] | Array) -> Array:
    """The unit vector along another."""
    array = np.array(vector, dtype=float)
    return array / np.linalg.norm(array)


def direction(rng: Random, across: Array | None = None, apart: Array | None = None) -> Array:
    """A random direction: square to `across` where that is given, and clearly another one than `apart`."""
    while True:
        drawn = np.array([rng.gauss(0.0, 1.0) for _ in range(3)])
        if across is not None:
            drawn -= across * (drawn @ across)
        size = np.linalg.norm(drawn)
        if size < 0.1:
            continue
        drawn = drawn / size
        if rng.random() < 0.2 and across is None:  # machines stand along the axes of their drawings
            drawn = np.eye(3)[int(np.argmax(abs(drawn)))]
        if apart is None or np.linalg.norm(np.cross(drawn, unit(apart))) > LEAST_SINE:
            return drawn


Word = tuple[str, ...]
"""The types of the joints of a leg."""


def word(rng: Random, kinds: Sequence[str], freedoms: int, slides: int = 3, turns: int = 0) -> Word:
    """Types of joints that have so many freedoms together, at most so many slides, and at least so many turns."""
    while True:
        drawn: list[str] = []
        while sum(FREEDOMS[kind] for kind in drawn) < freedoms:
            drawn.append(rng.choice(kinds))
        count = sum(FREEDOMS[kind] for kind in drawn)
        sliding = sum(SLIDES.get(kind, 0) for kind in drawn)
        if count == freedoms and sliding <= slides and count - sliding >= turns:
            return tuple(drawn)


ANY = ("revolute", "prismatic", "helical", "parallelogram", "cylindrical", "universal", "planar", "spherical")
ABOUT_ONE = ("revolute", "prismatic", "helical", "parallelogram", "cylindrical", "planar")
IN_PLANE = ("revolute", "prismatic", "parallelogram", "planar")
ABOUT_POINT = ("revolute", "revolute", "universal", "spherical")
IDLE = (("spherical", "prismatic", "spherical"), ("spherical", "spherical"), ("spherical", "cylindrical", "universal"))
"""Legs with a freedom that moves nothing but a part of them."""


@dataclass(frozen=True)
class Place:
    """Where a leg stands: its foot, its head, and what its joints are about."""

    foot: Array
    head: Array
    axis: Array
    centre: Array


Leg = list[Joint]
Drawn = Callable[[Random, Place], Leg]


def line(rng: Random, place: Place, count: int) -> list[Array]:
    """Points from the foot to the head, and one behind it."""
    shares = [i / max(count - 1, 1) for i in range(count)]
    beside = [np.zeros(3) if share in (0.0, 1.0) else JITTER * direction(rng) for share in shares]
    points = [place.foot + share * (place.head - place.foot) + b for share, b in zip(shares, beside, strict=True)]
    return [*points, place.head + 0.2 * direction(rng)]


def free_leg(freedoms: int) -> Drawn:
    """A leg of joints of any type about any axes, with so many freedoms."""

    def drawn(rng: Random, place: Place) -> Leg:
        kinds = rng.choice(IDLE) if freedoms == 6 and rng.random() < 0.06 else word(rng, ANY, freedoms)
        return _leg(rng, place, kinds, lambda _kind, _point: {})

    return drawn


def about_one_axis(rng: Random, place: Place) -> Leg:
    """A leg that holds the platform against turning about all but one axis."""
    kinds = word(rng, ABOUT_ONE, 4, turns=1)
    return _leg(rng, place, kinds, lambda kind, _point: _parallel(rng, kind, place.axis))


def _parallel(rng: Random, kind: str, axis: Array) -> dict[str, Array]:
    if kind == "planar":
        first = direction(rng, across=axis)
        return {"first_axis": first, "second_axis": np.cross(axis, first)}
    return {} if kind in ("prismatic", "parallelogram") else {"axis": axis * rng.choice((-1.0, 1.0))}


def with_cardans(rng: Random, place: Place) -> Leg:
    """A slide and two cardan joints whose axes are parallel crosswise: it holds the platform against one turn."""
    first, second = direction(rng), place.axis
    second = second if np.linalg.norm(np.cross(first, second)) > LEAST_SINE else direction(rng, apart=first)
    crosses = iter([{"first_axis": first, "second_axis": second}, {"first_axis": second, "second_axis": first}])
    kinds = (rng.choice(("prismatic", "parallelogram")), "universal", "universal")
    return _leg(rng, place, kinds, lambda kind, _point: next(crosses) if kind == "universal" else {})


def in_plane(rng: Random, place: Place) -> Leg:
    """A leg that moves across an axis, and turns about it, without any other motion."""
    kinds = word(rng, IN_PLANE, 3, slides=2, turns=1)

    def fields(kind: str, _point: Array) -> dict[str, Array]:
        if kind in ("prismatic", "parallelogram"):
            return {"axis": direction(rng, across=place.axis), "across": place.axis}
        return _parallel(rng, kind, place.axis)

    return _leg(rng, place, kinds, fields)


def about_centre(rng: Random, place: Place) -> Leg:
    """A leg that turns about a centre, without any other motion."""

    def fields(kind: str, point: Array) -> dict[str, Array]:
        return {"axis": unit(point - place.centre)} if kind == "revolute" else {"point": place.centre}

    return _leg(rng, place, word(rng, ABOUT_POINT, 3), fields)


def along_one_axis(rng: Random, place: Place) -> Leg:
    """A leg that turns about an axis through the centre and slides along it."""
    kinds = rng.choice((("cylindrical",), ("revolute", "prismatic"), ("helical", "prismatic"), ("helical", "revolute")))
    start = rng.uniform(-0.2, 0.1)

    def fields(_kind: str, _point: Array) -> dict[str, Array]:
        nonlocal start
        start += rng.uniform(0.05, 0.2)
        return {"axis": place.axis, "point": place.centre + start * place.axis}

    return _leg(rng, place, kinds, fields)


def _leg(rng: Random, place: Place, kinds: Word, fields: Callable[[str, Array], dict[str, Array]]) -> Leg:
    points = line(rng, place, len(kinds))
    return [_joint(rng, kind, points[i : i + 2], fields(kind, points[i])) for i, kind in enumerate(kinds)]


def _joint(rng: Random, kind: str, points: list[Array], fixed: dict[str, Array]) -> Joint:
    """A joint at the first of two points of its leg; what its motion fixes is given."""
    point, fields = fixed.get("point", points[0]), {k: v for k, v in fixed.items() if k != "across"}
    fields["point"] = point
    if kind in ("revolute", "prismatic", "helical", "cylindrical") and "axis" not in fields:
        fields["axis"] = direction(rng)
    if kind in ("universal", "planar") and "first_axis" not in fields:
        fields["first_axis"] = direction(rng)
        square = rng.random() < 0.5
        first = fields["first_axis"]
        fields["second_axis"] = direction(rng, across=first) if square else direction(rng, apart=first)
    numbers: dict[str, Any] = {}
    if kind == "helical":
        numbers["pitch"] = rng.choice((-1.0, 1.0)) * rng.uniform(0.003, 0.05)
    if kind == "parallelogram":
        across, span = fixed.get("across"), (points[1] - point) * rng.choice((1.0, 0.6))
        span = span if across is None else span - across * (span @ across)
        span = span if np.linalg.norm(span) > 0.05 else 0.2 * direction(rng, across=across)
        while "axis" not in fields or np.linalg.norm(np.cross(fields["axis"], unit(span))) < LEAST_SINE:
            fields["axis"] = direction(rng, across=across)
        fields["far"] = point + span
        numbers["width"] = rng.uniform(0.03, 0.15)
        if rng.random() < 0.6:
            numbers["bar_stiffness"] = 10.0 ** rng.uniform(5.0, 8.0)
    return Joint(kind, {**{name: vector.tolist() for name, vector in fields.items()}, **numbers})


def planar_leg(freedoms: int) -> Drawn:
    """A leg of a machine in the x-y plane."""

    def drawn(rng: Random, place: Place) -> Leg:
        kinds = word(rng, ("revolute", "revolute", "prismatic"), freedoms, slides=2)

        def fields(kind: str, point: Array) -> dict[str, Array]:
            normal = np.array([0.0, 0.0, 1.0])
            axis = normal if kind == "revolute" else direction(rng, across=normal)
            return {"axis": axis, "point": point * [1.0, 1.0, 0.0]}

        return _leg(rng, place, kinds, fields)

    return drawn


def weighed(twists: Array, about: Array) -> Array:
    """Twists about another point, angles in units of the machine's length, each of size 1 or less."""
    moved = twists.copy()
    moved[3:] += np.cross(twists[:3].T, about).T
    moved[:3] *= LENGTH
    sizes = np.linalg.norm(moved, axis=0)
    return moved / np.where(sizes > 0.0, sizes, 1.0)


def held_by(twists: Array, about: Array) -> Array:
    """Wrenches that joints of these twists let through, orthonormal [6 x m], in the same units."""
    left, sizes, _ = np.linalg.svd(weighed(twists, about), full_matrices=True)
    return left[:, np.sum(sizes > 1e-9) :]


def least_share(twists: Array, about: Array) -> float:
    """Smallest singular value of some twists: how far they are from depending on each other."""
    sizes = np.linalg.svd(weighed(twists, about), compute_uv=False)
    return float(sizes[-1]) if len(sizes) == twists.shape[1] else 0.0


def rotation(axis: Array, angle: float) -> Array:
    """The matrix of a rotation."""
    x, y, z = unit(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross

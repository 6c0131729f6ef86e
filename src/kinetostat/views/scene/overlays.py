"""Symbols over a machine: load, compliance ellipsoids, soft and free directions, and frames.

Sizes of the machine decide how large they are; their directions and values come from `analysis_overlays`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.vector import ZERO, Displacement, Rotation, Vector
from kinetostat.kinetostatics.indices import Principal
from kinetostat.views.scene import shapes
from kinetostat.views.scene.proportions import Proportions
from kinetostat.views.scene.solids import Label, Solid, Swept, Turned, unit, upright

LARGEST_ELLIPSOID = {"translation": 0.16, "rotation": 0.11}
"""Longest semi-axis of an ellipsoid as a share of the machine's diagonal."""
THINNEST = 0.012
"""Least semi-axis in units of the longest: an ellipsoid that is flat or thin can still be seen."""


def frame_solids(name: str, place: Displacement, length: float) -> list[Solid]:
    """Draw the axes of a frame as arrows (m)."""
    axes = place.rotation
    return [
        Solid(
            f"frame {name}/{axis}", shapes.arrow(length, 0.028 * length), f"{axis} axis",
            upright(place.translation, direction), layer="frames",
        )
        for axis, direction in zip("xyz", (axes.x, axes.y, axes.z), strict=True)
    ]  # fmt: skip


def frame_labels(name: str, place: Displacement, length: float) -> list[Label]:
    """Write the name of a frame at its origin and the letters of its axes."""
    axes = place.rotation
    tips = zip("xyz", (axes.x, axes.y, axes.z), strict=True)
    letters = [Label(letter, place.translation + axis * (1.12 * length), "frames") for letter, axis in tips]
    return [Label(name, place.translation, "frames"), *letters]


def ellipsoid_solids(block: str, principal: Principal, point: Vector, sizes: Proportions) -> list[Solid]:
    """Draw the compliance ellipsoid of a block at the tool point; of a planar machine, the part that exists.

    Translation is a body, rotation a cage of three rings, so that both are seen where they overlap.
    """
    largest = max(principal.compliances, default=0.0)
    if largest <= 0.0:
        return []
    longest = LARGEST_ELLIPSOID[block] * sizes.diagonal
    axes = _three(principal.directions)
    shares = [*(c / largest for c in principal.compliances), *[0.0] * (3 - len(principal.compliances))]
    axis_lengths = [longest * max(share, THINNEST) for share in shares]
    place = Displacement(axes, point)
    if block == "translation":
        radii = (axis_lengths[0], axis_lengths[1], axis_lengths[2])
        return [Solid("ellipsoid of translation", shapes.ball(1.0), block, place, radii, "ellipsoids")]
    wire = 0.006 * sizes.diagonal
    return [
        Solid(f"ellipsoid of rotation/ring {n}", _ellipse(i, j, axis_lengths, wire), block, place, layer="ellipsoids")
        for n, (i, j) in enumerate(((0, 1), (1, 2), (0, 2)), 1)
    ]


def _three(directions: Sequence[Sequence[float]]) -> Rotation:
    """Right-handed axes along up to three directions."""
    given = [Vector(*direction) for direction in directions]
    first = given[0]
    second = given[1] if len(given) > 1 else upright(ZERO, first).rotation.x
    return Rotation(first, second, first.cross(second))


def _ellipse(i: int, j: int, lengths: Sequence[float], wire: float) -> Swept:
    path = []
    for n in range(2 * shapes.HALF_CIRCLE_POINTS):
        point = [0.0, 0.0, 0.0]
        angle = math.pi * n / shapes.HALF_CIRCLE_POINTS
        point[i], point[j] = lengths[i] * math.cos(angle), lengths[j] * math.sin(angle)
        path.append((point[0], point[1], point[2]))
    return Swept(tuple(path), wire, closed=True)


def softest_solids(principal: Mapping[str, Principal], point: Vector, sizes: Proportions) -> list[Solid]:
    """Draw arrows along and about the softest directions of translation and rotation."""
    solids = []
    for block, axes in principal.items():
        if not axes.compliances or axes.compliances[-1] <= 0.0:
            continue
        axis = Vector(*axes.directions[-1])
        solids += _direction_solids(f"softest {block}", f"soft {block}", block == "rotation", axis, point, sizes)
    return solids


def twist_solids(twists: Sequence[Sequence[float]], point: Vector, sizes: Proportions) -> list[Solid]:
    """Draw arrows of twists [omega; v] at a point (base frame, m), such as the free motion of a singular pose."""
    solids = []
    for n, twist in enumerate(twists, 1):
        turning, sliding = Vector(*twist[:3]), Vector(*twist[3:])
        if turning.norm() > 0.0:
            foot = point + turning.cross(sliding) * (1.0 / turning.dot(turning))
            near = foot + turning * ((point - foot).dot(turning) / turning.dot(turning))
            solids += _direction_solids(f"free twist {n}", "soft rotation", True, unit(turning), near, sizes)
        else:
            solids += _direction_solids(f"free twist {n}", "soft translation", False, unit(sliding), point, sizes)
    return solids


def _direction_solids(
    name: str, material: str, turning: bool, axis: Vector, point: Vector, sizes: Proportions
) -> list[Solid]:
    size, thick = 0.3 * sizes.diagonal, 0.006 * sizes.diagonal
    place = upright(point, axis)
    if not turning:
        return [Solid(name, shapes.double_arrow(1.5 * size, thick), material, place, layer="directions")]
    head = shapes.cone(2.8 * thick, 0.0, 7.0 * thick)
    bent = _bent_arrow((name, f"{name}/head"), 0.34 * size, math.radians(290), thick, head, material, place)
    straight = Solid(f"{name}/axis", shapes.double_arrow(0.9 * size, 0.55 * thick), material, place)
    return [replace(solid, layer="directions") for solid in (*bent, straight)]


def load_solids(load: Wrench, point: Vector, sizes: Proportions) -> list[Solid]:
    """Draw the wrench on the tool: a straight arrow that ends there, and one around the axis of the moment."""
    solids = []
    size, thick = 0.2 * sizes.diagonal, 0.008 * sizes.diagonal
    if load.translational.norm() > 0.0:
        along = unit(load.translational)
        solids.append(Solid("load/force", shapes.arrow(size, thick), "load", upright(point - along * size, along)))
    if load.rotational.norm() > 0.0:
        names, place = ("load/moment", "load/moment head"), upright(point, load.rotational)
        head = shapes.cone(2.6 * thick, 0.0, 6.0 * thick)
        solids += _bent_arrow(names, 0.45 * size, math.radians(250), 0.8 * thick, head, "load", place)
    return [replace(solid, layer="load") for solid in solids]


def _bent_arrow(
    names: tuple[str, str], radius: float, turn: float, wire: float, head: Turned, material: str, place: Displacement
) -> list[Solid]:
    """An arrow around the z axis of a place: an arc over the angle `turn`, and a head at its end."""
    tip = place.apply(Vector(radius * math.cos(turn), radius * math.sin(turn), 0.0))
    heading = place.rotation.apply(Vector(-math.sin(turn), math.cos(turn), 0.0))
    return [
        Solid(names[0], shapes.arc(radius, turn, wire), material, place),
        Solid(names[1], head, material, upright(tip, heading)),
    ]

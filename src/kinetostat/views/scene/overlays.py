"""What a machine does, drawn into its scene: load, deflected shape, compliance ellipsoids, soft directions, frames."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from kinetostat.algebra.scalar import cos, sin
from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.vector import IDENTITY, ZERO, Displacement, Rotation, Vector, rotation_along
from kinetostat.kinetostatics.deflected import DeflectedLink
from kinetostat.kinetostatics.indices import Principal
from kinetostat.views.scene import shapes
from kinetostat.views.scene.solids import Label, Solid, Swept, unit, upright

LARGEST_ELLIPSOID = {"translation": 0.16, "rotation": 0.11}
"""Longest semi-axis of an ellipsoid as a share of the machine's diagonal."""
THINNEST = 0.012
"""Least semi-axis in units of the longest: what does not yield is still seen as a disc or a needle."""
SHOWN_DEFLECTION = 0.09
"""Greatest displacement of an exaggerated shape as a share of the machine's diagonal."""
GHOST_WIDTH = 0.7
"""Radius of a deflected link, in radii of its leg."""
GHOST_POINTS = 12
"""Points along a deflected link."""
LEAST_LOAD = 1e-12
"""Share of a wrench's largest component below which another is rounding."""


@dataclass(frozen=True)
class Measure:
    """Sizes from which overlays are drawn, m: the machine's diagonal and the radius of a leg."""

    diagonal: float
    leg: float


def frame_solids(name: str, place: Displacement, length: float) -> list[Solid]:
    """The axes of a frame as arrows (m)."""
    axes = place.rotation
    return [
        Solid(
            f"frame {name}/{axis}", shapes.arrow(length, 0.028 * length), f"{axis} axis",
            upright(place.translation, direction), layer="frames",
        )
        for axis, direction in zip("xyz", (axes.x, axes.y, axes.z), strict=True)
    ]  # fmt: skip


def frame_labels(name: str, place: Displacement, length: float) -> list[Label]:
    """The name of a frame at its origin and the letters of its axes."""
    axes = place.rotation
    tips = zip("xyz", (axes.x, axes.y, axes.z), strict=True)
    letters = [Label(letter, place.translation + axis * (1.12 * length), "frames") for letter, axis in tips]
    return [Label(name, place.translation, "frames"), *letters]


def ellipsoid_solids(block: str, principal: Principal, point: Vector, measure: Measure) -> list[Solid]:
    """The compliance ellipsoid of a block at the tool point; of a planar machine, what of it exists.

    Translation is a body, rotation a cage of three rings, so that both are seen where they overlap.
    """
    largest = max(principal.compliances, default=0.0)
    if largest <= 0.0:
        return []
    size = LARGEST_ELLIPSOID[block] * measure.diagonal
    axes = _three(principal.directions)
    shares = [*(c / largest for c in principal.compliances), *[0.0] * (3 - len(principal.compliances))]
    sizes = [size * max(share, THINNEST) for share in shares]
    place = Displacement(axes, point)
    if block == "translation":
        radii = (sizes[0], sizes[1], sizes[2])
        return [Solid("ellipsoid of translation", shapes.ball(1.0), block, place, radii, "ellipsoids")]
    wire = 0.006 * measure.diagonal
    return [
        Solid(f"ellipsoid of rotation/ring {n}", _ellipse(i, j, sizes, wire), block, place, layer="ellipsoids")
        for n, (i, j) in enumerate(((0, 1), (1, 2), (0, 2)), 1)
    ]


def _three(directions: Sequence[Sequence[float]]) -> Rotation:
    """Right-handed axes along up to three directions."""
    given = [Vector(*direction) for direction in directions]
    first = given[0]
    second = given[1] if len(given) > 1 else upright(ZERO, first).rotation.x
    return Rotation(first, second, first.cross(second))


def _ellipse(i: int, j: int, sizes: Sequence[float], wire: float) -> Swept:
    path = []
    for n in range(2 * shapes.ROUND):
        point = [0.0, 0.0, 0.0]
        angle = math.pi * n / shapes.ROUND
        point[i], point[j] = sizes[i] * math.cos(angle), sizes[j] * math.sin(angle)
        path.append((point[0], point[1], point[2]))
    return Swept(tuple(path), wire, closed=True)


def softest_solids(principal: dict[str, Principal], point: Vector, measure: Measure) -> list[Solid]:
    """Arrows along and about the softest directions of translation and rotation."""
    found = []
    for block, one in principal.items():
        if not one.compliances or one.compliances[-1] <= 0.0:
            continue
        axis = Vector(*one.directions[-1])
        found += _direction_solids(f"softest {block}", f"soft {block}", block == "rotation", axis, point, measure)
    return found


def twist_solids(twists: Sequence[Sequence[float]], point: Vector, measure: Measure) -> list[Solid]:
    """Arrows of twists [omega; v] at a point (base frame, m), as of a singular pose."""
    found = []
    for n, twist in enumerate(twists, 1):
        turning, sliding = Vector(*twist[:3]), Vector(*twist[3:])
        if turning.norm() > 0.0:
            foot = point + turning.cross(sliding) * (1.0 / turning.dot(turning))
            near = foot + turning * ((point - foot).dot(turning) / turning.dot(turning))
            found += _direction_solids(f"free twist {n}", "soft rotation", True, unit(turning), near, measure)
        else:
            found += _direction_solids(f"free twist {n}", "soft translation", False, unit(sliding), point, measure)
    return found


def _direction_solids(
    name: str, material: str, turning: bool, axis: Vector, point: Vector, measure: Measure
) -> list[Solid]:
    size, thick = 0.3 * measure.diagonal, 0.006 * measure.diagonal
    place = upright(point, axis)
    if not turning:
        return [Solid(name, shapes.double_arrow(1.5 * size, thick), material, place, layer="directions")]
    radius, turn = 0.34 * size, math.radians(290)
    tip = Vector(radius * math.cos(turn), radius * math.sin(turn), 0.0)
    heading = place.rotation.apply(Vector(-math.sin(turn), math.cos(turn), 0.0))
    return [
        Solid(name, shapes.arc(radius, turn, thick), material, place, layer="directions"),
        Solid(
            f"{name}/head", shapes.cone(2.8 * thick, 0.0, 7.0 * thick), material, upright(place.apply(tip), heading),
            layer="directions",
        ),
        Solid(f"{name}/axis", shapes.double_arrow(0.9 * size, 0.55 * thick), material, place, layer="directions"),
    ]  # fmt: skip


def load_solids(load: Wrench, point: Vector, measure: Measure) -> list[Solid]:
    """The wrench on the tool: a straight arrow that ends there, and one around the moment's axis."""
    found = []
    size, thick = 0.2 * measure.diagonal, 0.008 * measure.diagonal
    if load.translational.norm() > 0.0:
        along = unit(load.translational)
        found.append(
            Solid("load/force", shapes.arrow(size, thick), "load", upright(point - along * size, along), layer="load")
        )
    if load.rotational.norm() > 0.0:
        place, radius, turn = upright(point, load.rotational), 0.45 * size, math.radians(250)
        tip = place.apply(Vector(radius * math.cos(turn), radius * math.sin(turn), 0.0))
        heading = place.rotation.apply(Vector(-math.sin(turn), math.cos(turn), 0.0))
        found.append(Solid("load/moment", shapes.arc(radius, turn, 0.8 * thick), "load", place, layer="load"))
        found.append(
            Solid(
                "load/moment head",
                shapes.cone(2.6 * thick, 0.0, 6.0 * thick),
                "load",
                upright(tip, heading),
                layer="load",
            )
        )
    return found


def exaggeration(links: Sequence[DeflectedLink], platform: Twist, reach: float, diagonal: float) -> float:
    """A round factor (1, 2 or 5 times a power of ten) that makes a deflected shape visible.

    Args:
        links: of the machine.
        platform: its small motion at the tool point.
        reach: of the platform from there, m.
        diagonal: of the machine, m.
    """
    moved = [motion.translational.norm() for link in links for motion in (link.start_motion, link.end_motion)]
    largest = max([*moved, platform.translational.norm() + platform.rotational.norm() * reach])
    if not 0.0 < largest < math.inf:
        return 1.0
    wanted = SHOWN_DEFLECTION * diagonal / largest
    power = 10.0 ** math.floor(math.log10(wanted))
    return max((step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted * 1.0001), default=power)


def ghost_solids(
    links: Sequence[DeflectedLink],
    platform: Sequence[Solid],
    motion: Twist,
    point: Vector,
    factor: float,
    radii: Mapping[str, float],
) -> list[Solid]:
    """The deflected machine: its links as bent wires and its platform, displacements times `factor`.

    Args:
        links: of the machine.
        platform: solids of it, before the load.
        motion: of the platform at `point`, base frame.
        point: the tool point, m.
        factor: of exaggeration.
        radii: from which each leg is drawn, m, by its name.
    """
    found = []
    for n, link in enumerate(links):
        points = [link.point(i / GHOST_POINTS, factor) for i in range(GHOST_POINTS + 1)]
        path = tuple((p.x, p.y, p.z) for p in points)
        found.append(Solid(f"ghost/link {n}", Swept(path, GHOST_WIDTH * radii[link.leg]), "ghost", layer="deflection"))
    moved = _exaggerated(motion, point, factor)
    return [
        *found,
        *(solid.moved(moved, name=f"ghost/{solid.name}", material="ghost", layer="deflection") for solid in platform),
    ]


def _exaggerated(motion: Twist, point: Vector, factor: float) -> Displacement:
    """A small motion of a body at a point, times a factor, as a rigid displacement of it."""
    angle = motion.rotational.norm() * factor
    axis = unit(motion.rotational)
    turn = rotation_along(axis, cos(angle), sin(angle)) if angle > LEAST_LOAD else IDENTITY
    return Displacement(turn, point + motion.translational * factor - turn.apply(point))

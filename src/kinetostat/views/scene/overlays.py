"""Overlays of an analysis over its machine: compliance ellipsoids, soft and free directions, load, deflected shape.

The symbols come first: their sizes are shares of the machine's diagonal, so that they are seen beside its legs. After
them the answer of the machine is turned into symbols.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from kinetostat.algebra.scalar import cos, sin
from kinetostat.algebra.screw import COMPONENTS, Twist, Wrench
from kinetostat.algebra.vector import IDENTITY, ZERO, Displacement, Rotation, Vector, rotation_along
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.indices import Principal
from kinetostat.kinetostatics.loading import Deflection, deflected_links, deflection
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.under_load import LoadedState
from kinetostat.tolerances import NO_TURN
from kinetostat.views.scene import shapes
from kinetostat.views.scene.anatomy import Proportions, anatomy
from kinetostat.views.scene.leg_solids import joint_radius
from kinetostat.views.scene.machine_scene import plates, tool_solids
from kinetostat.views.scene.solids import Solid, Swept, Turned, solid_data, unit, upright

LARGEST_ELLIPSOID = {"translation": 0.16, "rotation": 0.11}
"""Longest semi-axis of an ellipsoid as a share of the machine's diagonal: it stands out and hides no leg."""
DIRECTION_LENGTH, DIRECTION_RADIUS, TURN_RADIUS = 0.45, 0.006, 0.102
"""Length and thickness of the arrow along a direction, and radius of the one around it, as shares of the machine's
diagonal: they end beside the legs."""
THINNEST = 0.012
"""Least semi-axis in units of the longest: an ellipsoid that is flat or thin can still be seen."""


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


def _three(directions: Array) -> Rotation:
    """Return right-handed axes along up to three directions."""
    axes = [Vector(*direction) for direction in directions]
    first = axes[0]
    second = axes[1] if len(axes) > 1 else upright(ZERO, first).rotation.x
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
        if len(axes.compliances) and axes.compliances[-1] > 0.0:
            arrow = _turning_arrow if block == "rotation" else _straight_arrow
            solids += arrow(f"softest {block}", f"soft {block}", Vector(*axes.directions[-1]), point, sizes)
    return solids


def twist_solids(twists: Sequence[Sequence[float]], point: Vector, sizes: Proportions) -> list[Solid]:
    """Draw arrows of twists [omega; v] at a point (base frame, m), such as the free motion of a singular pose."""
    solids = []
    for n, twist in enumerate(twists, 1):
        turning, sliding = Vector(*twist[:3]), Vector(*twist[3:])
        if turning.norm() > 0.0:  # the arrow stands on the axis of the twist, where that is nearest to the point
            nearest = point + turning.cross(sliding) * (1.0 / turning.dot(turning))
            solids += _turning_arrow(f"free twist {n}", "soft rotation", unit(turning), nearest, sizes)
        else:
            solids += _straight_arrow(f"free twist {n}", "soft translation", unit(sliding), point, sizes)
    return solids


def _straight_arrow(name: str, material: str, axis: Vector, point: Vector, sizes: Proportions) -> list[Solid]:
    """Return an arrow to both sides of a point along an axis."""
    shape = shapes.double_arrow(DIRECTION_LENGTH * sizes.diagonal, DIRECTION_RADIUS * sizes.diagonal)
    return [Solid(name, shape, material, upright(point, axis), layer="directions")]


def _turning_arrow(name: str, material: str, axis: Vector, point: Vector, sizes: Proportions) -> list[Solid]:
    """Return an arrow around an axis through a point, and the axis as a thinner one."""
    length, radius = DIRECTION_LENGTH * sizes.diagonal, DIRECTION_RADIUS * sizes.diagonal
    place, head = upright(point, axis), shapes.cone(2.8 * radius, 0.0, 7.0 * radius)
    bent = _bent_arrow(
        (name, f"{name}/head"), TURN_RADIUS * sizes.diagonal, math.radians(290), radius, head, material, place
    )
    straight = Solid(f"{name}/axis", shapes.double_arrow(0.6 * length, 0.55 * radius), material, place)
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
    """Return an arrow around the z axis of a place: an arc over the angle `turn`, and a head at its end."""
    tip = place.apply(Vector(radius * math.cos(turn), radius * math.sin(turn), 0.0))
    heading = place.rotation.apply(Vector(-math.sin(turn), math.cos(turn), 0.0))
    return [
        Solid(names[0], shapes.arc(radius, turn, wire), material, place),
        Solid(names[1], head, material, upright(tip, heading)),
    ]


SHOWN_DEFLECTION = 0.09
"""Greatest displacement of an exaggerated shape as a share of the machine's diagonal: seen, and still the same
machine."""
GHOST_WIDTH = 0.7
"""Radius of a deflected link, in radii of its leg: the leg and the link can both be seen where they cross."""
GHOST_POINTS = 12
"""Points along a deflected link: enough for a beam that bends both ways."""


def overlays_of(
    analysis: Analysis, sizes: Proportions, factor: float | None = None
) -> tuple[list[Solid], float | None]:
    """Draw the results of an analysis, and return the factor by which the deflected shape is exaggerated.

    Args:
        analysis: the analysis in base axes; for a pose without an answer nothing is drawn.
        sizes: the proportions of the machine.
        factor: the factor of exaggeration; None to choose a round one.

    Returns:
        The solids, and the factor; None without a load.
    """
    if analysis.indices is None:
        return [], None
    machine, response = analysis.machine, analysis.state.free
    configuration = response.configuration
    solids = compliance_overlays(machine, configuration, sizes, analysis.indices.principal_compliances)
    if analysis.load is None:
        return solids, None
    load = response.load
    motions = Deflection(load, deflection(response.statics, load), tuple(deflected_links(response, load)))
    ghost, chosen = deflection_overlays(machine, configuration, sizes, motions, factor)
    return solids + ghost, chosen


def loaded_overlays(
    state: LoadedState, sizes: Proportions, factor: float | None = None
) -> tuple[list[Solid], float | None]:
    """Draw a machine at rest under its loads over the unloaded one; the factor as `overlays_of`, never below 1.

    Args:
        state: the state of the machine; where it comes to no rest nothing is drawn.
        sizes: the proportions of the machine.
        factor: the factor of exaggeration; None to choose a round one.
    """
    if not state.has_rest:
        return [], None
    response = state.state.free
    motions = motions_of(state, response)
    chosen = factor or exaggeration_of(response, motions, sizes.diagonal)
    return deflection_overlays(state.machine, response.configuration, sizes, motions, chosen)


def motions_of(state: LoadedState, response: Response) -> Deflection:
    """Return the motions of a machine from its unloaded pose, of which the response is, to its rest."""
    by_name = dict(zip(state.components, state.displacement, strict=True))
    amounts = [by_name.get(name, 0.0) for name in COMPONENTS]
    return Deflection(response.load, Twist(Vector(*amounts[:3]), Vector(*amounts[3:])), state.links)


def exaggeration_of(response: Response, motions: Deflection, diagonal: float) -> float:
    """Return a round factor, at least 1, that makes the motions of a loaded machine visible.

    Args:
        response: the response of the machine at its unloaded pose.
        motions: the displacements from that pose.
        diagonal: the diagonal of the machine, m.
    """
    legs, point = response.configuration.legs, response.reference
    reach = max(((leg.path[-1] - point).norm() for leg in legs if leg.path), default=0.0)
    return max(1.0, _exaggeration(motions, float(reach), diagonal))


def compliance_overlays(
    machine: Machine, configuration: Configuration, sizes: Proportions, principal: Mapping[str, Principal] | None
) -> list[Solid]:
    """Draw ellipsoids and softest directions at the tool point; nothing where a direction is free.

    Args:
        machine, configuration, sizes: as for `machine_scene`.
        principal: principal compliances of the blocks "translation" and "rotation", base axes.
    """
    if not principal:
        return []
    point, blocks = machine.tool_point(configuration.platform), principal.items()
    ellipsoids = [s for name, block in blocks for s in ellipsoid_solids(name, block, point, sizes)]
    return [*ellipsoids, *softest_solids(principal, point, sizes)]


def deflection_overlays(
    machine: Machine, configuration: Configuration, sizes: Proportions, motions: Deflection, factor: float | None = None
) -> tuple[list[Solid], float]:
    """Draw the load and the deflected shape, and return the factor by which it is exaggerated.

    Of a machine with infinite deflections only the load is drawn.

    Args:
        machine, configuration, sizes: as for `machine_scene`.
        motions: the small motions of the machine.
        factor: the factor of exaggeration; None to choose a round one.
    """
    loads = load_solids(motions.load, machine.tool_point(configuration.platform), sizes)
    if not _finite(motions):
        return loads, 1.0
    parts = _moving_parts(machine, configuration, sizes)
    chosen = factor or _exaggeration(motions, parts.reach, sizes.diagonal)
    return [*loads, *_ghost(motions, parts, chosen)], chosen


def swing_data(
    machine: Machine, configuration: Configuration, sizes: Proportions, motions: Deflection
) -> list[dict[str, Any]]:
    """Return both ends of a swing as plain data, so that a browser needs nothing else to move the machine between them.

    Each solid is in the middle of its swing, as `solid_data` has it, with `ends`: how far every point of its path
    moves to one end, or its two extreme places. It swings as far as a deflected shape is drawn. Nothing is drawn of
    motions that are infinite or zero.

    Args:
        machine, configuration, sizes: as for `machine_scene`.
        motions: small motions, of any size.
    """
    parts = _moving_parts(machine, configuration, sizes)
    largest = _largest(motions, parts.reach)
    if not 0.0 < largest < math.inf:
        return []
    factor = SHOWN_DEFLECTION * sizes.diagonal / largest
    solids = []
    for first, middle, last in zip(*(_ghost(motions, parts, share) for share in (factor, 0.0, -factor)), strict=True):
        ends = [solid_data(end)["place"] for end in (first, last)]
        if isinstance(first.shape, Swept) and isinstance(middle.shape, Swept):
            pairs = zip(first.shape.path, middle.shape.path, strict=True)
            ends = [[a - b for a, b in zip(*pair, strict=True)] for pair in pairs]
        solids.append({**solid_data(middle), "ends": ends})
    return solids


@dataclass(frozen=True)
class _MovingParts:
    """Solids and sizes of the parts that a machine moves when it deflects.

    Attributes:
        body: platform and tool.
        point: the tool point, base frame, m.
        reach: greatest distance of a joint of the platform from that point, m.
        radii: the radii of the links by leg, m.
    """

    body: Sequence[Solid]
    point: Vector
    reach: float
    radii: Mapping[str, float]


def _moving_parts(machine: Machine, configuration: Configuration, sizes: Proportions) -> _MovingParts:
    point, legs = machine.tool_point(configuration.platform), [anatomy(leg) for leg in configuration.legs]
    _, platform = plates(configuration, legs, sizes.leg)
    body = [*platform.solids(), *tool_solids(machine, configuration, platform, sizes.leg)]
    reach = max((joint - point).norm() for joint in platform.joints)
    return _MovingParts(body, point, float(reach), {leg.leg: joint_radius(leg, sizes) for leg in legs})


def _finite(motions: Deflection) -> bool:
    numbers = [*motions.motion.components(), *(c for link in motions.links for c in link.end_motion.components())]
    return all(math.isfinite(c) for c in numbers)


def _exaggeration(motions: Deflection, reach: float, diagonal: float) -> float:
    """Return a round factor (1, 2 or 5 times a power of ten) that makes a deflected shape visible.

    Args:
        motions: the small motions.
        reach: the reach of the platform from the tool point, m.
        diagonal: the diagonal of the machine, m.
    """
    largest = _largest(motions, reach)
    if not 0.0 < largest < math.inf:
        return 1.0
    # A little more is allowed, so that a factor that is round already does not fall to the next one by round-off.
    most = 1.0001 * SHOWN_DEFLECTION * diagonal / largest
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most)


def _largest(motions: Deflection, reach: float) -> float:
    """Return the greatest displacement of all ends of links and of the platform, m."""
    links = [motion.translational.norm() for link in motions.links for motion in (link.start_motion, link.end_motion)]
    return max([*links, motions.motion.translational.norm() + motions.motion.rotational.norm() * reach])


def _ghost(motions: Deflection, parts: _MovingParts, factor: float) -> list[Solid]:
    """Return the deflected machine: its links as bent wires, and its platform at its displaced place."""
    wires = []
    for n, link in enumerate(motions.links):
        points = [link.point(i / GHOST_POINTS, factor) for i in range(GHOST_POINTS + 1)]
        path, radius = tuple((p.x, p.y, p.z) for p in points), GHOST_WIDTH * parts.radii[link.leg]
        if len(set(path)) == len(path):  # a link without a length is no wire
            wires.append(Solid(f"ghost/link {n}", Swept(path, radius), "ghost", layer="deflection"))
    motion = exaggerated_displacement(motions.motion, parts.point, factor)
    body = [s.moved_by(motion, name=f"ghost/{s.name}", material="ghost", layer="deflection") for s in parts.body]
    return [*wires, *body]


def exaggerated_displacement(motion: Twist, point: Vector, factor: float) -> Displacement:
    """Return a small motion of a body at a point, times a factor, as a rigid displacement of the body."""
    angle = motion.rotational.norm() * factor
    axis = unit(motion.rotational)
    turn = rotation_along(axis, cos(angle), sin(angle)) if abs(angle) > NO_TURN else IDENTITY
    return Displacement(turn, point + motion.translational * factor - turn.apply(point))

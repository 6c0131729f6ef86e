"""Overlays of answers over their machine: compliance ellipsoids, soft and free directions, load, deflected shape.

The symbols stand first; then the overlays of each answer, which choose among them; and last the deflected shape.
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
from kinetostat.kinetostatics.indices import PrincipalCompliances
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
from kinetostat.views.scene.solids import Solid, Swept, solid_data, unit, upright

LARGEST_ELLIPSOID = {"translation": 0.16, "rotation": 0.11}
"""Longest semi-axis of an ellipsoid as a share of the machine's diagonal: it stands out and hides no leg."""
THINNEST = 0.012
"""Least semi-axis in units of the longest: an ellipsoid that is flat or thin can still be seen."""
RING_RADIUS = 0.006
"""Radius of the wire of the rings of an ellipsoid, as a share of the machine's diagonal."""
DIRECTION_LENGTH, DIRECTION_RADIUS, TURN_RADIUS = 0.45, 0.006, 0.102
"""Length and thickness of the arrow along a direction, and radius of the one around it, as shares of the machine's
diagonal: they end beside the legs."""
TURN_HEAD_RADIUS, TURN_HEAD_LENGTH = 2.8, 7.0
"""Radius and length of the head of an arrow around a direction, in radii of its wire: a little more than those of a
straight arrow (`shapes`), because most of it is seen foreshortened."""
TURN_AXIS_LENGTH, TURN_AXIS_RADIUS = 0.6, 0.55
"""Length and thickness of the axis of such an arrow, as shares of those of an arrow along a direction: the arrow around
the axis counts."""
DIRECTION_TURN, MOMENT_TURN = math.radians(290.0), math.radians(250.0)
"""Angles of the arcs of arrows around a direction and around the axis of a moment: the gap shows where they begin."""
LOAD_LENGTH, LOAD_RADIUS = 0.2, 0.008
"""Length and thickness of the arrow of a force, as shares of the machine's diagonal: it is seen beside the tool."""
MOMENT_RADIUS, MOMENT_WIRE = 0.45, 0.8
"""Radius of the arrow of a moment in lengths of that of a force, and thickness of its wire in thicknesses of that."""
SHOWN_DEFLECTION = 0.09
"""Greatest displacement of an exaggerated shape as a share of the machine's diagonal: seen, and still the same
machine."""
ROUND_OFF_OF_FACTOR = 1.0001
"""Ratio by which a factor may show more than that: one that is round already does not fall to the next by round-off."""
ROUND_STEPS = (1.0, 2.0, 5.0)
"""Round factors of exaggeration within each power of ten."""
GHOST_WIDTH = 0.7
"""Radius of a deflected link, in radii of its leg: the leg and the link can both be seen where they cross."""
GHOST_POINTS = 12
"""Pieces of a deflected link: enough for a beam that bends both ways."""


def ellipsoid_solids(block: str, principal: PrincipalCompliances, point: Vector, sizes: Proportions) -> list[Solid]:
    """Draw the compliance ellipsoid of a block at the tool point; of a planar machine, the part that exists.

    Translation is a body, rotation a cage of three rings, so that both are seen where they overlap.
    """
    largest = max(principal.compliances, default=0.0)
    if largest <= 0.0:
        return []
    longest = LARGEST_ELLIPSOID[block] * sizes.diagonal
    axes = _axes_along(principal.directions)
    shares = [*(c / largest for c in principal.compliances), *[0.0] * (3 - len(principal.compliances))]
    axis_lengths = [longest * max(share, THINNEST) for share in shares]
    place = Displacement(axes, point)
    if block == "translation":
        radii = (axis_lengths[0], axis_lengths[1], axis_lengths[2])
        return [Solid("ellipsoid of translation", shapes.ball(1.0), block, place, radii, "ellipsoids")]
    wire = RING_RADIUS * sizes.diagonal
    return [
        Solid(f"ellipsoid of rotation/ring {n}", _ellipse(i, j, axis_lengths, wire), block, place, layer="ellipsoids")
        for n, (i, j) in enumerate(((0, 1), (1, 2), (0, 2)), 1)
    ]


def _axes_along(directions: Array) -> Rotation:
    """Return right-handed axes along one to three perpendicular directions; they begin with these."""
    axes = [Vector(*direction) for direction in directions]
    first = axes[0]
    second = axes[1] if len(axes) > 1 else upright(ZERO, first).rotation.x
    return Rotation(first, second, first.cross(second))


def _ellipse(i: int, j: int, lengths: Sequence[float], wire: float) -> Swept:
    """Return the ellipse of an ellipsoid in the plane of its axes i and j, as a wire of a radius, m."""
    path = []
    for n in range(2 * shapes.HALF_CIRCLE_POINTS):
        point = [0.0, 0.0, 0.0]
        angle = math.pi * n / shapes.HALF_CIRCLE_POINTS
        point[i], point[j] = lengths[i] * math.cos(angle), lengths[j] * math.sin(angle)
        path.append((point[0], point[1], point[2]))
    return Swept(tuple(path), wire, closed=True)


def softest_solids(principal: Mapping[str, PrincipalCompliances], point: Vector, sizes: Proportions) -> list[Solid]:
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
    place, head = upright(point, axis), shapes.cone(TURN_HEAD_RADIUS * radius, 0.0, TURN_HEAD_LENGTH * radius)
    arc = shapes.arc(TURN_RADIUS * sizes.diagonal, DIRECTION_TURN, radius)
    bent = [Solid(name, arc, material, place)]
    bent.append(Solid(f"{name}/head", head, material, _end_of_arc(TURN_RADIUS * sizes.diagonal, DIRECTION_TURN, place)))
    line = shapes.double_arrow(TURN_AXIS_LENGTH * length, TURN_AXIS_RADIUS * radius)
    return [replace(solid, layer="directions") for solid in (*bent, Solid(f"{name}/axis", line, material, place))]


def load_solids(load: Wrench, point: Vector, sizes: Proportions) -> list[Solid]:
    """Draw the wrench on the tool: a straight arrow that ends there, and one around the axis of the moment."""
    solids = []
    length, thickness = LOAD_LENGTH * sizes.diagonal, LOAD_RADIUS * sizes.diagonal
    if load.translational.norm() > 0.0:
        along = unit(load.translational)
        arrow = shapes.arrow(length, thickness)
        solids.append(Solid("load/force", arrow, "load", upright(point - along * length, along)))
    if load.rotational.norm() > 0.0:
        place, radius = upright(point, load.rotational), MOMENT_RADIUS * length
        arc = shapes.arc(radius, MOMENT_TURN, MOMENT_WIRE * thickness)
        head = shapes.cone(shapes.HEAD_RADIUS * thickness, 0.0, shapes.HEAD_LENGTH * thickness)
        solids.append(Solid("load/moment", arc, "load", place))
        solids.append(Solid("load/moment head", head, "load", _end_of_arc(radius, MOMENT_TURN, place)))
    return [replace(solid, layer="load") for solid in solids]


def _end_of_arc(radius: float, turn: float, place: Displacement) -> Displacement:
    """Return the place of an arrow's head at the end of an arc.

    Args:
        radius: radius of the arc about the z axis of its place, m.
        turn: angle of the arc from the x axis of its place, rad.
        place: place of the arc.
    """
    tip = place.apply(Vector(radius * math.cos(turn), radius * math.sin(turn), 0.0))
    heading = place.rotation.apply(Vector(-math.sin(turn), math.cos(turn), 0.0))
    return upright(tip, heading)


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
    if factor is None:
        factor = exaggeration_of(state.machine, response.configuration, motions, sizes.diagonal)
    return deflection_overlays(state.machine, response.configuration, sizes, motions, factor)


def motions_of(state: LoadedState, response: Response) -> Deflection:
    """Return the motions of a machine from its unloaded pose, of which the response is, to its rest."""
    by_name = dict(zip(state.components, state.displacement, strict=True))
    amounts = [by_name.get(name, 0.0) for name in COMPONENTS]
    return Deflection(response.load, Twist(Vector(*amounts[:3]), Vector(*amounts[3:])), state.links)


def exaggeration_of(machine: Machine, configuration: Configuration, motions: Deflection, diagonal: float) -> float:
    """Return a round factor, at least 1, that makes the motions of a loaded machine visible.

    Args:
        machine, configuration: the machine at its unloaded pose, as for `machine_scene`.
        motions: the displacements from that pose.
        diagonal: the diagonal of the machine, m.
    """
    heads = [anatomy(leg).head for leg in configuration.legs]
    return max(1.0, _exaggeration(motions, _reach(heads, machine.tool_point(configuration.platform)), diagonal))


def compliance_overlays(
    machine: Machine,
    configuration: Configuration,
    sizes: Proportions,
    principal: Mapping[str, PrincipalCompliances] | None,
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
    parts = _moving_parts(machine, configuration, sizes)
    if not math.isfinite(_greatest_displacement(motions, parts.reach)):
        return loads, 1.0
    if factor is None:
        factor = _exaggeration(motions, parts.reach, sizes.diagonal)
    return [*loads, *_ghost(motions, parts, factor)], factor


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
    greatest = _greatest_displacement(motions, parts.reach)
    if not 0.0 < greatest < math.inf:
        return []
    factor = SHOWN_DEFLECTION * sizes.diagonal / greatest
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
    radii = {leg.leg: joint_radius(leg, sizes) for leg in legs}
    return _MovingParts(body, point, _reach(platform.joints, point), radii)


def _reach(joints: Sequence[Vector], point: Vector) -> float:
    """Return the greatest distance of the joints of a platform from the tool point, m."""
    return float(max((joint - point).norm() for joint in joints))


def _exaggeration(motions: Deflection, reach: float, diagonal: float) -> float:
    """Return a round factor (1, 2 or 5 times a power of ten) that makes a deflected shape visible.

    Args:
        motions: the small motions.
        reach: the reach of the platform from the tool point, m.
        diagonal: the diagonal of the machine, m.
    """
    greatest = _greatest_displacement(motions, reach)
    if not 0.0 < greatest < math.inf:
        return 1.0
    most = ROUND_OFF_OF_FACTOR * SHOWN_DEFLECTION * diagonal / greatest
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in ROUND_STEPS if step * power <= most)


def _greatest_displacement(motions: Deflection, reach: float) -> float:
    """Return the greatest displacement of all ends of links and of the platform, m; infinite where any motion is."""
    twists = [motion for link in motions.links for motion in (link.start_motion, link.end_motion)]
    if not all(math.isfinite(part) for twist in (motions.motion, *twists) for part in twist.components()):
        return math.inf
    of_platform = motions.motion.translational.norm() + motions.motion.rotational.norm() * reach
    return max([of_platform, *(twist.translational.norm() for twist in twists)])


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

"""Overlays of an analysis over its machine: compliance ellipsoids, softest directions, load and deflected shape.

The symbols themselves are drawn in `overlays`; here the machine's answer is turned into them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from kinetostat.algebra.scalar import cos, sin
from kinetostat.algebra.screw import COMPONENTS, Twist, Wrench
from kinetostat.algebra.vector import IDENTITY, Displacement, Vector, rotation_along
from kinetostat.kinetostatics.deflected import DeflectedLink, deflected_links
from kinetostat.kinetostatics.indices import Principal
from kinetostat.kinetostatics.loading import deflection
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.under_load import LoadedState
from kinetostat.tolerances import NO_TURN
from kinetostat.views.scene import overlays
from kinetostat.views.scene.anatomy import anatomy
from kinetostat.views.scene.leg_solids import joint_radius
from kinetostat.views.scene.machine_scene import plates, tool_solids
from kinetostat.views.scene.proportions import Proportions
from kinetostat.views.scene.solids import Solid, Swept, unit

SHOWN_DEFLECTION = 0.09
"""Greatest displacement of an exaggerated shape as a share of the machine's diagonal."""
GHOST_WIDTH = 0.7
"""Radius of a deflected link, in radii of its leg."""
GHOST_POINTS = 12
"""Points along a deflected link."""


@dataclass(frozen=True)
class Deflection:
    """Small motions of a loaded machine.

    Attributes:
        load: at the tool point, base axes, N·m and N.
        motion: of the tool point, rad and m.
        links: deflected links of the legs.
    """

    load: Wrench
    motion: Twist
    links: tuple[DeflectedLink, ...]


def overlays_of(
    analysis: Analysis, sizes: Proportions, factor: float | None = None
) -> tuple[list[Solid], float | None]:
    """Draw the results of an analysis, and return the factor by which the deflected shape is exaggerated.

    Args:
        analysis: in base axes; for a pose without an answer nothing is drawn.
        sizes: of the machine.
        factor: of exaggeration; None to choose a round one.

    Returns:
        The solids, and the factor; None without a load.
    """
    if analysis.indices is None:
        return [], None
    machine, response = analysis.machine, respond(analysis.machine)
    configuration = response.configuration
    solids = compliance_overlays(machine, configuration, sizes, analysis.indices.principal_compliances)
    if analysis.load is None:
        return solids, None
    load = Wrench(Vector(*analysis.load.wrench[:3]), Vector(*analysis.load.wrench[3:]))
    moved = Deflection(load, deflection(response.statics, load), tuple(deflected_links(response, load)))
    ghost, chosen = deflection_overlays(machine, configuration, sizes, moved, factor)
    return solids + ghost, chosen


def loaded_overlays(
    state: LoadedState, sizes: Proportions, factor: float | None = None
) -> tuple[list[Solid], float | None]:
    """Draw a machine at rest under its loads over the unloaded one; the factor as `overlays_of`, never below 1.

    Args:
        state: of the machine; where it comes to no rest nothing is drawn.
        sizes: of the machine.
        factor: of exaggeration; None to choose a round one.
    """
    if not state.displacement:
        return [], None
    configuration, moved = respond(state.machine).configuration, motions_of(state)
    chosen = factor or exaggeration_of(state, moved, sizes.diagonal)
    return deflection_overlays(state.machine, configuration, sizes, moved, chosen)


def motions_of(state: LoadedState) -> Deflection:
    """The motions of a machine from its unloaded pose to its rest."""
    by_name = dict(zip(state.components, state.displacement, strict=True))
    turned, moved = ([by_name.get(name, 0.0) for name in COMPONENTS[part]] for part in (slice(3), slice(3, 6)))
    return Deflection(state.machine.load, Twist(Vector(*turned), Vector(*moved)), state.links)


def exaggeration_of(state: LoadedState, moved: Deflection, diagonal: float) -> float:
    """A round factor, at least 1, that makes the motions of a loaded machine visible.

    Args:
        state, moved: of the machine.
        diagonal: of it, m.
    """
    configuration = respond(state.machine).configuration
    point = state.machine.tool_point(configuration.platform)
    reach = max(((leg.path[-1] - point).norm() for leg in configuration.legs if leg.path), default=0.0)
    return max(1.0, _exaggeration(moved, float(reach), diagonal))


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
    ellipsoids = [s for name, block in blocks for s in overlays.ellipsoid_solids(name, block, point, sizes)]
    return [*ellipsoids, *overlays.softest_solids(principal, point, sizes)]


def deflection_overlays(
    machine: Machine, configuration: Configuration, sizes: Proportions, moved: Deflection, factor: float | None = None
) -> tuple[list[Solid], float]:
    """Draw the load and the deflected shape, and return the factor by which it is exaggerated.

    Of a machine with infinite deflections only the load is drawn.

    Args:
        machine, configuration, sizes: as for `machine_scene`.
        moved: its small motions.
        factor: of exaggeration; None to choose a round one.
    """
    point = machine.tool_point(configuration.platform)
    loads = overlays.load_solids(moved.load, point, sizes)
    numbers = [*moved.motion.components(), *(c for link in moved.links for c in link.end_motion.components())]
    if not all(math.isfinite(c) for c in numbers):
        return loads, 1.0
    legs = [anatomy(leg) for leg in configuration.legs]
    _, platform = plates(configuration, legs, sizes.leg)
    radii = {leg.leg: joint_radius(leg, sizes) for leg in legs}
    reach = max((joint - point).norm() for joint in platform.joints)
    chosen = factor or _exaggeration(moved, reach, sizes.diagonal)
    body = [*platform.solids(), *tool_solids(machine, configuration, platform, sizes.leg)]
    return [*loads, *_ghost(moved, body, point, chosen, radii)], chosen


def _exaggeration(moved: Deflection, reach: float, diagonal: float) -> float:
    """A round factor (1, 2 or 5 times a power of ten) that makes a deflected shape visible.

    Args:
        moved: the small motions.
        reach: of the platform from the tool point, m.
        diagonal: of the machine, m.
    """
    links = [motion.translational.norm() for link in moved.links for motion in (link.start_motion, link.end_motion)]
    platform = moved.motion.translational.norm() + moved.motion.rotational.norm() * reach
    largest = max([*links, platform])
    if not 0.0 < largest < math.inf:
        return 1.0
    wanted = SHOWN_DEFLECTION * diagonal / largest
    power = 10.0 ** math.floor(math.log10(wanted))
    # A little more than wanted is allowed, so that a factor that is round already does not fall to the next one.
    return max((step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted * 1.0001), default=power)


def _ghost(
    moved: Deflection, platform: Sequence[Solid], point: Vector, factor: float, radii: Mapping[str, float]
) -> list[Solid]:
    """The deflected machine: its links as bent wires, and its platform at its displaced place."""
    wires = []
    for n, link in enumerate(moved.links):
        points = [link.point(i / GHOST_POINTS, factor) for i in range(GHOST_POINTS + 1)]
        path = tuple((p.x, p.y, p.z) for p in points)
        wires.append(Solid(f"ghost/link {n}", Swept(path, GHOST_WIDTH * radii[link.leg]), "ghost", layer="deflection"))
    motion = exaggerated(moved.motion, point, factor)
    body = [s.moved(motion, name=f"ghost/{s.name}", material="ghost", layer="deflection") for s in platform]
    return [*wires, *body]


def exaggerated(motion: Twist, point: Vector, factor: float) -> Displacement:
    """A small motion of a body at a point, times a factor, as a rigid displacement of the body."""
    angle = motion.rotational.norm() * factor
    axis = unit(motion.rotational)
    turn = rotation_along(axis, cos(angle), sin(angle)) if angle > NO_TURN else IDENTITY
    return Displacement(turn, point + motion.translational * factor - turn.apply(point))

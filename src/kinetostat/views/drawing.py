"""Drawings of machines by lines: front, side and plan to scale, and a machine that has moved over the one at its pose.

Geometry comes from the configuration alone.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeAlias

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.display import with_minus_signs
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.loading import Deflection
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Leg
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.tolerances import SAME_TO_THE_EYE
from kinetostat.views.figures import COLOURS, NOTE_COLOUR, NOTE_SIZE, STYLE, Drawings, set_title
from kinetostat.views.layout import fix_layout
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.scene.overlays import exaggerated_displacement, exaggeration_of

THREE_VIEWS = (("front", "x", "z"), ("side", "y", "z"), ("plan", "x", "y"))
"""Names of the views, each with the axes across and up."""
VIEW_MARGIN = 0.12
"""Room beside a machine, as a share of its size: its marks and names reach beyond its joints."""
MOST_TICKS = 4
"""Intervals of an axis at most: views are for shapes, and half of the time of drawing one goes into its numbers."""
MILLIMETRES = 1e3
"""Millimetres of a metre: views are labelled in mm whatever units the file displays."""
LEG_COLOUR, CONSTRAINT_COLOUR = COLOURS[0], COLOURS[1]
"""Colours of actuated and of passive legs: blue and orange, as in pictures."""
PLATE_COLOUR, PLATE_FILL = "#555555", "#dddddd"
"""Greys of the edge and of the face of a plate: legs are seen over them."""
THREE_VIEWS_WIDTH, ONE_VIEW_WIDTH, VIEWS_HEIGHT = 7.6, 4.0, 3.3
"""Width of a figure of three views and of one, and its height, inches."""
MOVED_COLOUR, SLACK_COLOUR, UNMOVED_COLOUR = COLOURS[0], COLOURS[1], "#9a9a9a"
"""Colours of a machine that has moved, of its slack legs, and of the machine at its pose behind it."""
PIECES_OF_LINK = 12
"""Straight pieces of which a bent link is drawn: its corners cannot be seen in a view of a few centimetres."""
CYLINDER_SHARE = 0.55
"""Share of the first link of an actuated leg that is drawn thick, as the cylinder of a telescope."""
NEIGHBOUR_SHARE = 0.3
"""Two base joints whose distance is a smaller share of that of the farthest are neighbours: their names would meet."""
NAME_DISTANCE = 6
"""Distance of a name from its base joint, points: beyond the mark of the joint."""
CENTRED_COMPONENT = 0.38
"""Component of a unit vector (sine of 22 deg) below which a text is centred along this axis: half of the way from a
side to a corner."""
OFFSETS = {"P": (4, 4), "T": (4, -10)}
"""Shift of the letters of reference points, in points: both can be read where the points coincide in a view."""

Points: TypeAlias = list[Vector]
Projection: TypeAlias = Callable[[Points], tuple[list[float], list[float]]]
"""Gives the coordinates of points in a picture, across and up."""


def three_views(machine: Machine, title: str) -> Figure:
    """Draw front, side and plan of a machine to scale, in mm; of a planar machine only the plan. Actuated legs: blue.

    Args:
        machine: the machine at its pose; P is marked, and T where the machine has a tool.
        title: above the figure.
    """
    configuration = state_of(machine).configuration
    tool = machine.reference_point(configuration)
    with mpl.rc_context(STYLE):
        figure = views_of(configuration, partial(_draw_view, configuration, tool))
        set_title(figure, title)
        fix_layout(figure)
    return figure


def views_of(configuration: Configuration, draw: Callable[[Axes, str, str], None]) -> Figure:
    """Begin a figure with front, side and plan, of a planar machine only the plan, to scale in mm.

    Args:
        configuration: the placed machine.
        draw: fills a panel, given the axes across and up.
    """
    views = THREE_VIEWS if configuration.plane is None else THREE_VIEWS[2:]
    width = THREE_VIEWS_WIDTH if len(views) > 1 else ONE_VIEW_WIDTH
    figure = Figure(figsize=(width, VIEWS_HEIGHT), layout="constrained")
    panels = dict(zip(views, figure.subplots(1, len(views), squeeze=False).flat, strict=True))
    ends: dict[str, list[float]] = {}
    for (name, across, up), panel in panels.items():
        draw(panel, across, up)
        panel.set(title=name, xlabel=f"{across} (mm)", ylabel=f"{up} (mm)", aspect="equal")
        panel.locator_params(nbins=MOST_TICKS)
        for axis, interval in ((across, panel.dataLim.intervalx), (up, panel.dataLim.intervaly)):
            ends.setdefault(axis, []).extend(interval)
    # One scale for all views, so that what stands side by side can be compared; a machine in a point has none.
    size = max(max(part) - min(part) for part in ends.values())
    if 0.0 < size < math.inf:
        middle = {axis: 0.5 * (max(part) + min(part)) for axis, part in ends.items()}
        half = (0.5 + VIEW_MARGIN) * size
        for (_, across, up), panel in panels.items():
            panel.set_xlim(middle[across] - half, middle[across] + half)
            panel.set_ylim(middle[up] - half, middle[up] + half)
    return figure


def _draw_view(configuration: Configuration, tool: Vector, panel: Axes, across: str, up: str) -> None:
    reference = configuration.platform.translation
    actuated = [leg for leg in configuration.legs if leg.actuated]
    spanning = [leg for leg in actuated if len(leg.path) > 1]
    for plate in (ring_of([leg.path[0] for leg in spanning]), ring_of([leg.path[-1] for leg in spanning])):
        panel.fill(*flat(plate, across, up), facecolor=PLATE_FILL, edgecolor=PLATE_COLOUR, linewidth=0.8, alpha=0.8)
    for leg in configuration.legs:
        _draw_leg(panel, leg, across, up, leg in actuated)
    if up == "y":
        for leg, name in zip(spanning, _short_names(spanning), strict=True):
            _write_name(panel, name, leg, [other for other in spanning if other is not leg])
    marks = {"P": reference} if (tool - reference).norm() == 0.0 else {"P": reference, "T": tool}
    for name, point in marks.items():
        (x,), (y,) = flat([point], across, up)
        panel.plot(x, y, "+", color="black", markersize=7, markeredgewidth=1.2)
        panel.annotate(name, (x, y), textcoords="offset points", xytext=OFFSETS[name])


def _draw_leg(panel: Axes, leg: Leg, across: str, up: str, actuated: bool) -> None:
    x, y = flat(list(leg.path), across, up)
    colour = LEG_COLOUR if actuated else CONSTRAINT_COLOUR
    panel.plot(x, y, "-", color=colour, linewidth=1.4 if actuated else 2.2, solid_capstyle="round")
    panel.plot(x, y, "o", color="white", markeredgecolor=colour, markersize=4 if actuated else 5, markeredgewidth=1.0)
    if actuated and len(x) > 1:
        ends = [first + CYLINDER_SHARE * (second - first) for first, second, *_ in (x, y)]
        panel.plot([x[0], ends[0]], [y[0], ends[1]], color=colour, linewidth=3.2, solid_capstyle="butt")


def _short_names(legs: Sequence[Leg]) -> list[str]:
    """Return the names of legs in the plan: "1" of "cable 1" where all are cables."""
    parts = [leg.label.rpartition(" ") for leg in legs]
    return [last for _, _, last in parts] if len({first for first, _, _ in parts}) == 1 else [leg.label for leg in legs]


def _write_name(panel: Axes, name: str, leg: Leg, others: Sequence[Leg]) -> None:
    """Write the name of a leg in the plan beside its base joint.

    It stands away from the leg, or from the origin where the leg goes up, and also away from a base joint beside it.
    """
    (x, y), *further = zip(*flat(list(leg.path), "x", "y"), strict=True)
    across, up = _first_direction([*((x - a, y - b) for a, b in further), (x, y), (-1.0, 0.0)])
    from_others = [(x - a, y - b) for a, b in zip(*flat([other.path[0] for other in others], "x", "y"), strict=True)]
    nearest = min(from_others, key=lambda offset: math.hypot(*offset), default=(0.0, 0.0))
    distance = math.hypot(*nearest)
    if 0.0 < distance < NEIGHBOUR_SHARE * max(math.hypot(*offset) for offset in from_others):
        across, up = across + nearest[0] / distance, up + nearest[1] / distance
        size = math.hypot(across, up) or 1.0
        across, up = across / size, up / size
    panel.annotate(
        name, (x, y), xytext=(NAME_DISTANCE * across, NAME_DISTANCE * up), textcoords="offset points",
        color=LEG_COLOUR, zorder=5,
        ha=_alignment(across, "right", "left"), va=_alignment(up, "top", "bottom"),
        path_effects=[withStroke(linewidth=2.0, foreground="white")],
    )  # fmt: skip


def _first_direction(offsets: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the direction of the first of some offsets (mm) that is not zero to the eye, as a unit vector."""
    least = MILLIMETRES * SAME_TO_THE_EYE
    return next((dx / length, dy / length) for dx, dy in offsets if (length := math.hypot(dx, dy)) > least)


def _alignment(component: float, low: str, high: str) -> str:
    """Align a text along one axis so that it does not cover its point, from which it stands in some direction.

    Args:
        component: component of this direction (a unit vector) along the axis.
        low, high: alignments where the text stands on the negative and on the positive side.
    """
    return "center" if abs(component) < CENTRED_COMPONENT else high if component > 0.0 else low


def ring_of(points: Points) -> Points:
    """Sort points by their angle about their centre in the x-y plane, so that the line through them is a plate."""
    if not points:
        return []
    cx, cy = sum(p.x for p in points) / len(points), sum(p.y for p in points) / len(points)
    return sorted(points, key=lambda p: math.atan2(p.y - cy, p.x - cx))


def flat(points: Points, across: str, up: str) -> tuple[list[float], list[float]]:
    """Return the coordinates of points along two axes, mm."""
    return [MILLIMETRES * getattr(p, across) for p in points], [MILLIMETRES * getattr(p, up) for p in points]


@dataclass(frozen=True)
class MotionOverlay:
    """A machine that has moved, in blue over the machine at its pose in grey.

    Attributes:
        configuration: the machine at its pose.
        motions: small motions of tool and links from that pose.
        factor: the factor by which they are exaggerated.
        point: the tool point at the pose, base frame, m.
        displacement: the exaggerated motion of the platform.
        slack_legs: the names of the legs whose links are dashed.
    """

    configuration: Configuration
    motions: Deflection
    factor: float
    point: Vector
    displacement: Displacement
    slack_legs: Sequence[str]

    def draw(self, panel: Axes, project: Projection) -> None:
        """Draw both machines in a panel: legs, platform, tool point."""
        legs = self.configuration.legs
        heads = ring_of([leg.path[-1] for leg in legs if leg.actuated and leg.path])
        moved_heads = [self.displacement.apply(head) for head in heads]
        for leg in legs:
            panel.plot(*project(list(leg.path)), color=UNMOVED_COLOUR, linewidth=1.6, solid_capstyle="round")
        for points, colour in ((heads, UNMOVED_COLOUR), (moved_heads, MOVED_COLOUR)):
            panel.fill(*project(points), facecolor=colour, alpha=0.25, edgecolor=colour, linewidth=0.8)
        for link in self.motions.links:
            points_of_link = [link.point(i / PIECES_OF_LINK, self.factor) for i in range(PIECES_OF_LINK + 1)]
            is_slack = link.leg in self.slack_legs
            dash, width, colour = ("--", 0.9, SLACK_COLOUR) if is_slack else ("-", 1.6, MOVED_COLOUR)
            panel.plot(*project(points_of_link), dash, color=colour, linewidth=width)
        for tip, colour in ((self.point, UNMOVED_COLOUR), (self.displacement.apply(self.point), MOVED_COLOUR)):
            panel.plot(*project([tip]), "+", color=colour, markersize=7, markeredgewidth=1.2)


def motion_overlay(
    machine: Machine, response: Response, motions: Deflection, slack_legs: Sequence[str] = ()
) -> MotionOverlay:
    """Return a machine that has moved over the machine at its pose, with motions as large as can be seen.

    Args:
        machine: the machine at its pose.
        response: the response of the machine there.
        motions: motions of tool and links from that pose.
        slack_legs: the names of the legs whose links are dashed.
    """
    configuration = response.configuration
    factor = exaggeration_of(machine, configuration, motions, proportions_of(machine, configuration).diagonal)
    point = machine.tool_point(configuration.platform)
    displacement = exaggerated_displacement(motions.motion, point, factor)
    return MotionOverlay(configuration, motions, factor, point, displacement, slack_legs)


def add_overlay_legend(figure: Figure, names: tuple[str, str], setting: str, slack: bool = False) -> None:
    """Name the grey and the blue machine of a figure below it, and the setting for which it holds.

    Args:
        figure: the figure of a machine that has moved.
        names: words for the machine at its pose, and for the moved one.
        setting: lines on where the machine is, and how much larger its motions are drawn.
        slack: whether dashed legs are explained as well.
    """
    styles: list[tuple[str, str, Any]] = [(names[0], UNMOVED_COLOUR, "-"), (names[1], MOVED_COLOUR, "-")]
    styles += [("slack", SLACK_COLOUR, "--")] if slack else []
    legend = figure.legend(
        handles=[Line2D([], [], color=colour, linestyle=dash, label=text) for text, colour, dash in styles],
        loc="outside lower center", ncols=len(styles), title_fontsize=NOTE_SIZE, title=with_minus_signs(setting),
    )  # fmt: skip
    legend.get_title().set(multialignment="center", color=NOTE_COLOUR)


def machine_figures(machine: Machine) -> Drawings:
    """Return the front, side and plan view of a machine as the one figure that it has."""
    return {"views": partial(three_views, machine, machine.name)}

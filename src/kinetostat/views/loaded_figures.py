"""Pictures of a machine under load: its shape over the unloaded one, and the curve while the load grows."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeAlias

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from kinetostat.arrays import Array
from kinetostat.display import Scale, number, with_minus_signs
from kinetostat.kinetostatics.loading import Deflection
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import Machine, setting_of
from kinetostat.studies.under_load import LoadedState, load_curve
from kinetostat.views.drawing import Points, flat, ring_of, views_of
from kinetostat.views.figures import COLOURS, STYLE, look_of, new_figure, set_title
from kinetostat.views.layout import fix_layout
from kinetostat.views.lettering import width_of
from kinetostat.views.loaded_tables import named_leg_springs
from kinetostat.views.question import Drawing
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.scene.overlays import exaggerated_displacement, exaggeration_of, motions_of

UNLOADED, LOADED, SLACK = "#9a9a9a", COLOURS[0], COLOURS[1]
BAR_HEIGHT = 0.24
"""Height of the figure for each bar, inches: names of legs stand line by line beside them."""
LEAST_NAME_WIDTH = 2.0
"""Least room for the names of legs, inches: figures of different machines then begin alike."""
PIECES_OF_LINK = 12
"""Straight pieces of which a bent link is drawn: its corners cannot be seen in a view of a few centimetres."""
MOST_SPRINGS = 12
"""Springs of which a curve is drawn, those with the greatest loads: more cannot be told apart."""

Projection: TypeAlias = Callable[[Points], tuple[list[float], list[float]]]
"""Gives the coordinates of points in a picture, across and up."""


def load_figure(state: LoadedState, title: str = "{}: under growing load") -> Figure:
    """Draw displacement and spring loads over the share of the load, with the linear answer as thin lines.

    Args:
        state: the state of the machine under its whole load.
        title: over the figure, with braces for the name of the machine.
    """
    machine, curve = state.machine, load_curve(state.state)
    display, share = machine.display, 100.0 * curve.shares
    groups = [
        ([i for i, name in enumerate(state.components) if name.startswith("r")], "rotation", "rad"),
        ([i for i, name in enumerate(state.components) if not name.startswith("r")], "displacement", "m"),
    ]
    turning = {spring.name: spring.turning for spring in state.springs}
    kinds = [(unit, turns) for unit, turns in (("N", False), ("N·m", True)) if turns in turning.values()]
    with new_figure(
        (6.6, 0.7 + 1.8 * (2 + len(kinds))),
        title.format(machine.name),
        setting_of(machine, []),
        "thin lines: to first order" if state.linear is not None else "",
    ) as figure:
        panels = list(figure.subplots(2 + len(kinds), 1, sharex=True, squeeze=False).flat)
        for panel, (rows, what, unit) in zip(panels, groups, strict=False):
            scale = display.fitting(unit, curve.displacement[:, rows].flat)
            named = {state.components[i]: curve.displacement[:, i] * scale.factor for i in rows}
            _curves(panel, share, named, scale.label(what))
            if state.linear is not None:
                _first_order(panel, share, [state.linear[i] for i in rows], scale)
        for panel, (unit, turns) in zip(panels[2:], kinds, strict=True):
            scale = display.scale(unit)
            loads = {n: curve.loads[:, i] * scale.factor for i, n in enumerate(curve.springs) if turning[n] is turns}
            largest = sorted(loads, key=lambda name: -abs(loads[name]).max())[:MOST_SPRINGS]
            _curves(panel, share, {name: loads[name] for name in loads if name in largest}, scale.label("load"))
        panels[-1].set_xlabel("share of the loads (%)")
    return figure


def shape_figure(state: LoadedState, title: str = "{}: under load") -> Figure:
    """Draw the loaded machine over the unloaded one, in front, side and plan; slack legs are dashed.

    Args:
        state: the state of a machine that is at rest.
        title: over the figure, with braces for the name of the machine.
    """
    machine, response = state.machine, state.state.free
    moved, named = motions_of(state, response), ("without loads", "at rest under load")
    draw, factor = moved_machine(machine, response, moved, state.slack_legs)
    with mpl.rc_context(STYLE):
        figure = views_of(
            response.configuration, lambda panel, across, up: draw(panel, lambda points: flat(points, across, up))
        )
        moved_legend(figure, named, f"{setting_of(machine, [])}\n{drawn_larger(factor)}", bool(state.slack_legs))
        set_title(figure, title.format(machine.name))
        fix_layout(figure)
    return figure


def moved_machine(
    machine: Machine, response: Response, moved: Deflection, slack_legs: Sequence[str] = ()
) -> tuple[Callable[[Axes, Projection], None], float]:
    """Return how to draw a machine with exaggerated motions over the machine where it was, and the exaggeration.

    Args:
        machine: the machine at its pose.
        response: the response of the machine.
        moved: motions of tool and links from there.
        slack_legs: the names of the legs whose links are dashed.
    """
    configuration = response.configuration
    factor = exaggeration_of(response, moved, proportions_of(machine, configuration).diagonal)
    point = machine.tool_point(configuration.platform)
    motion = exaggerated_displacement(moved.motion, point, factor)
    heads = ring_of([leg.path[-1] for leg in configuration.legs if leg.actuated and leg.path])

    def draw(panel: Axes, project: Projection) -> None:
        for leg in configuration.legs:
            panel.plot(*project(list(leg.path)), color=UNLOADED, linewidth=1.6, solid_capstyle="round")
        for points, colour in ((heads, UNLOADED), ([motion.apply(head) for head in heads], LOADED)):
            panel.fill(*project(points), facecolor=colour, alpha=0.25, edgecolor=colour, linewidth=0.8)
        for link in moved.links:
            bent = [link.point(i / PIECES_OF_LINK, factor) for i in range(PIECES_OF_LINK + 1)]
            slack = link.leg in slack_legs
            dash, wide = ("--", 0.9) if slack else ("-", 1.6)
            panel.plot(*project(bent), dash, color=SLACK if slack else LOADED, linewidth=wide)
        for tip, colour in ((point, UNLOADED), (motion.apply(point), LOADED)):
            panel.plot(*project([tip]), "+", color=colour, markersize=7, markeredgewidth=1.2)

    return draw, factor


def moved_legend(figure: Figure, named: tuple[str, str], setting: str, slack: bool = False) -> None:
    """Say below a figure what grey and blue machines are, and where; `named` has the one that has moved last."""
    styles: list[tuple[str, str, Any]] = [(named[0], UNLOADED, "-"), (named[1], LOADED, "-")]
    styles += [("slack", SLACK, "--")] if slack else []
    legend = figure.legend(
        handles=[Line2D([], [], color=colour, linestyle=dash, label=text) for text, colour, dash in styles],
        loc="outside lower center", ncols=len(styles), title_fontsize=6.5, title=with_minus_signs(setting),
    )  # fmt: skip
    legend.get_title().set(multialignment="center", color="#555555")


def bars_figure(state: LoadedState) -> Figure:
    """Draw a bar for the load of each leg: to the right where it pulls, to the left where it pushes, none if slack."""
    shown, display = named_leg_springs(state), state.machine.display
    kinds = [
        (unit, turns) for unit, turns in (("N", False), ("N·m", True)) if any(s.turning is turns for _, s in shown)
    ]
    groups = [[(name, spring) for name, spring in shown if spring.turning is turns] for _, turns in kinds]
    beside = max(LEAST_NAME_WIDTH, width_of(name for name, _ in shown))
    with new_figure((beside + 4.6, 0.6 * len(groups) + BAR_HEIGHT * len(shown))) as figure:
        heights = [len(group) + 1 for group in groups]
        panels = figure.subplots(len(groups), 1, squeeze=False, height_ratios=heights).flat
        for panel, (unit, _), group in zip(panels, kinds, groups, strict=True):
            scale, places = display.scale(unit), range(len(group))
            loads = [spring.load * scale.factor for _, spring in group]
            panel.barh(places, loads, height=0.6, color=[COLOURS[0] if load > 0.0 else COLOURS[1] for load in loads])
            for place, load, (_, spring) in zip(places, loads, group, strict=True):
                text = "slack" if spring.slack else number(load, digits=display.digits)
                panel.annotate(
                    text, (load, place), xytext=(-4 if load < 0.0 else 4, 0), textcoords="offset points",
                    ha="right" if load < 0.0 else "left", va="center",
                )  # fmt: skip
            panel.set_yticks(places, [name for name, _ in group])
            panel.axvline(0.0, color="#444444", linewidth=0.8)
            panel.set_xlabel(scale.label("load, positive where it pulls"))
            panel.margins(x=0.15)
            panel.set_axisbelow(True)
            panel.invert_yaxis()
    return figure


def drawn_larger(factor: float) -> str:
    """Say how much larger than they are displacements are drawn."""
    return "displacements to scale" if factor == 1.0 else f"displacements drawn {factor:,.0f} times larger"


def _curves(panel: Axes, share: Array, curves: dict[str, Array], label: str) -> None:
    for place, (name, values) in enumerate(curves.items()):
        panel.plot(share, values, label=name, **look_of(place))
    panel.axvline(100.0, color="#999999", linewidth=0.8)
    panel.set_ylabel(label)
    panel.margins(x=0.0)
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _first_order(panel: Axes, share: Array, values: Sequence[float], scale: Scale) -> None:
    for colour, value in zip(COLOURS, values, strict=False):
        panel.plot(share, value * scale.factor * share / 100.0, color=colour, linewidth=0.6)


def loaded_figures(state: LoadedState) -> dict[str, Drawing]:
    """Return the curve over the growing load, and the shape; a machine without rest has neither."""
    if not state.has_rest:
        return {}
    growing = "Displacement and loads while the loads grow, beside the linear answer."
    shape = "The machine at rest under its loads over the machine without them."
    return {
        "growing load": Drawing(growing, partial(load_figure, state), file="growing-load"),
        "shape": Drawing(shape, partial(shape_figure, state)),
    }

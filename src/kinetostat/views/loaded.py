"""A machine under load for people: its sentences, tables and figures.

Sentences and tables say what holds at rest; figures show its shape over the unloaded one, what each leg carries, and
the curve while the load grows. Nothing is computed here.
"""

import math
from collections import Counter
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.algebra.scalar import reciprocal
from kinetostat.arrays import Array
from kinetostat.display import DASH, Scale, number
from kinetostat.late import LateModule
from kinetostat.machine.machine import setting_of
from kinetostat.studies.under_load import LoadedState, SpringState, load_curve
from kinetostat.units import component_units, load_unit, motion_unit
from kinetostat.views.analysis_tables import entry_unit, softest_sentence, stiffness_sentence
from kinetostat.views.question import Drawing, Lines
from kinetostat.views.tables import FittedTable, numeric_table

if TYPE_CHECKING:
    import matplotlib as mpl
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.views import drawing, figures, layout
    from kinetostat.views.scene import overlays
else:
    mpl = LateModule("matplotlib")
    drawing = LateModule("kinetostat.views.drawing")
    figures = LateModule("kinetostat.views.figures")
    layout = LateModule("kinetostat.views.layout")
    overlays = LateModule("kinetostat.views.scene.overlays")

KINDS_OF_LOADS = ((False, "force"), (True, "moment"))
"""Whether an actuator turns, and the kind of its load."""
MOST_LISTED_SPRINGS = 12
"""Springs that have a row each: a machine with more has many alike, which are told by kind."""
NOTHING_LOADS = "[load] has no force, no moment and no preload, and no mass under gravity"
SIGNS = (
    "A load is positive where it pulls: of an actuator, cable or link, where it pulls its ends together. Of a bearing "
    "or flexure it is positive along the axis that the file gives, so that mirrored copies of a leg differ in sign."
)
"""Meaning of the signs of loads, which stands beside their tables."""
CURVES_HEIGHT, ROOM_FOR_TITLE = 1.8, 0.7
"""Height of a panel over a growing load, whose legend stands to its right, and of title and labels, inches."""
BARS_WIDTH, ROOM_FOR_SCALE = 4.6, 0.6
"""Width of the panels of bars beside the names of legs, and height of the labels below each panel, inches."""
BAR_HEIGHT, BAR_SHARE = 0.24, 0.6
"""Height of the figure for each bar, inches: names of legs stand line by line; and the share of it that a bar takes."""
ROOM_BESIDE_BARS = 0.15
"""Room beyond the ends of bars for their numbers, as a share of the range of the bars."""
FULL_LOAD_COLOUR = "#999999"
"""Grey of the line at the whole load."""
LEAST_NAME_WIDTH = 2.0
"""Least room for the names of legs, inches: figures of different machines then begin alike."""
MOST_CURVES = 12
"""Springs of which a curve is drawn, those with the greatest loads: more cannot be told apart."""


def stability_of(state: LoadedState) -> str:
    """Say how far the load may grow, for the springs and for the struts."""
    first = min(state.struts, key=lambda strut: strut.factor, default=None)
    if first is None or math.isinf(first.factor):
        return _stability_of_springs(state.factor)
    bends = f"Strut {first.name} bends away at about {number(first.factor, digits=3)} times this load."
    return f"{bends} {_stability_of_springs(state.factor)}"


def _stability_of_springs(factor: float | None) -> str:
    if factor is None:
        return "The springs alone hold nothing here: weight and tension do."
    if math.isinf(factor):
        return "No growth of this load makes the springs unstable."
    if factor < 1.0:
        return f"The springs are unstable beyond {number(factor)} times this load."
    return f"The load may grow to {number(factor)} times its size until the springs become unstable."


def loaded_lines(state: LoadedState) -> Lines:
    """Say what a machine at rest does under its loads: stiffness, softest direction, sag, actuators, stability.

    Args:
        state: a state of rest.
    """
    display, names = state.machine.display, state.components
    if not state.loaded:
        yield "Loads", f"Nothing loads the machine: {NOTHING_LOADS}."
    if state.compliance is not None:
        stiffnesses = stiffness_sentence(names, [row[i] for i, row in enumerate(state.compliance)], display)
        yield "Stiffness", f"{stiffnesses} (against further loads, at the loaded {state.machine.reference}, base axes)."
    if state.softest:
        yield "Softest", softest_sentence(state.softest, display)
    if state.loaded:
        yield "Sag", sag_sentence(state)
        yield "Actuators", actuator_sentence(state)
        yield "Stability", stability_of(state)


def sag_sentence(state: LoadedState) -> str:
    """Say how far the loads move and turn the tool."""
    show = state.machine.display.show_deflection
    displacement, rotation = map(show, state.tool_motion, ("m", "rad"))
    return f"The loads move the {state.machine.reference} by {displacement} and turn it by {rotation}."


def actuator_sentence(state: LoadedState) -> str:
    """Say which actuators carry most, and how much of their limits they use."""
    show, parts = state.machine.display.show, []
    for turns, kind in KINDS_OF_LOADS:
        springs = [spring for spring in actuator_springs(state) if spring.turning is turns]
        if springs:
            hardest = max(springs, key=lambda spring: abs(spring.load))
            direction = "" if turns or not hardest.load else ", which pulls" if hardest.load > 0.0 else ", which pushes"
            size = show(abs(hardest.load), load_unit(turns))
            parts.append(f"the greatest {kind} of an actuator is {size} ({hardest.name}{direction})")
    if not parts:
        return ""
    use = state.limit_use
    text = "; ".join([*parts, "the file limits no load of actuators" if use is None else use_of_limit(use)])
    return f"{text[0].upper()}{text[1:]}."


def use_of_limit(use: float) -> str:
    """Say how much of its limit the load of an actuator is, and whether it passes the limit.

    Args:
        use: the load over its limit.
    """
    return f"{number(100.0 * use, digits=3)} % of its limit" + (", which it passes" if use > 1.0 else "")


def actuator_springs(state: LoadedState) -> list[SpringState]:
    """Return the spring of each actuator: the first of those in series, because all of these carry the same load."""
    first: dict[tuple[str, bool], SpringState] = {}
    for spring in state.springs:
        if spring.actuated:
            first.setdefault((spring.leg, spring.turning), spring)
    return list(first.values())


def displacement_table(state: LoadedState) -> FittedTable:
    """Return the displacement of the tool under its loads, beside that of linear equations."""
    display, units = state.machine.display, component_units(state.components)
    scales = [display.deflection(unit) for unit in units]
    names_of_units = ", ".join(dict.fromkeys(scale.unit for scale in scales))
    table = numeric_table(f"Displacement of the tool point ({names_of_units})", "", state.components)
    for row, values in (("under load", state.displacement), ("to first order", state.linear)):
        if values is not None:
            cells = (number(v * s.factor, "free", display.digits) for v, s in zip(values, scales, strict=True))
            table.add_row(row, *cells)
    return table


def named_leg_springs(state: LoadedState) -> list[tuple[str, SpringState]]:
    """Name what carries each leg: its actuator by the name of the leg, or by its own where a leg has several."""
    shown = [spring for spring in state.springs if spring.actuated] or list(state.springs)
    count = Counter(spring.leg for spring in shown)
    return [(spring.leg if count[spring.leg] == 1 else spring.name, spring) for spring in shown]


def tangent_table(state: LoadedState, free: Sequence[float] = (), stiff: Sequence[float] = ()) -> FittedTable | None:
    """Return the stiffness to further loads in each direction, beside that of the machine without loads.

    Args:
        state: a state of rest; None is returned where its stiffness is not finite.
        free: diagonal of 1/C without loads, SI; left out if empty.
        stiff: diagonal of K without loads, SI.
    """
    if state.tangent is None or state.compliance is None:
        return None
    display, names = state.machine.display, state.components
    columns = {
        "1/C under load": [reciprocal(entry) for entry in np.diag(state.compliance).tolist()],
        "1/C free state": list(free),
        "K under load": np.diag(state.tangent).tolist(),
        "of springs": [] if state.elastic is None else np.diag(state.elastic).tolist(),
        "K free state": list(stiff),
    }
    columns = {head: values for head, values in columns.items() if values}
    table = numeric_table("Stiffness to further loads", "", list(columns))
    for i, name in enumerate(names):
        unit = entry_unit("stiffness", name, name)
        cells = (display.number(values[i], unit, "rigid") for values in columns.values())
        table.add_row(display.scale(unit).label(name), *cells)
    return table


def springs_or_kinds_table(state: LoadedState, full: bool = False) -> FittedTable:
    """Return the table of the springs: each by itself where they are few or `full`, else by kind."""
    few = len(state.springs) <= MOST_LISTED_SPRINGS
    return spring_table(state) if few or full else _kinds_table(state)


def _kinds_table(state: LoadedState) -> FittedTable:
    """Return least and greatest load and greatest deformation of the springs of each kind, and how many are slack."""
    display = state.machine.display
    kinds: dict[tuple[str, bool], list[SpringState]] = {}
    for spring in state.springs:
        kinds.setdefault((spring.name.removeprefix(f"{spring.leg} "), spring.turning), []).append(spring)
    table = numeric_table("Springs by kind", "spring", ["least load", "greatest load", "deformation", "slack"])
    for (kind, turning), members in kinds.items():
        loads = [spring.load for spring in members]
        ends = (display.show(end, load_unit(turning)) for end in (min(loads), max(loads)))
        deformation = max((spring.deformation for spring in members), key=abs)
        name = f"{kind} ×{len(members)}" if len(members) > 1 else members[0].name
        slack = sum(spring.slack for spring in members)
        deformation_text = display.show_deflection(deformation, motion_unit(turning))
        table.add_row(name, *ends, deformation_text, str(slack) if slack else DASH)
    return table


def spring_table(state: LoadedState) -> FittedTable:
    """Return the load, deformation and state of every spring."""
    display = state.machine.display
    table = numeric_table("Springs", "spring", ["load", "deformation", "state"])
    for spring in state.springs:
        load = display.show(spring.load, load_unit(spring.turning))
        amount = display.show_deflection(spring.deformation, motion_unit(spring.turning))
        table.add_row(spring.name, load, amount, "slack" if spring.slack else "carries")
    return table


def strut_table(state: LoadedState) -> FittedTable:
    """Return the compression of each strut, and the load at which it would buckle."""
    display = state.machine.display
    table = numeric_table("Struts: columns between two hinges", "strut", ["compression", "Euler's load", "reserve"])
    for strut in state.struts:
        reserve = DASH if math.isinf(strut.factor) else f"{number(strut.factor)} x"
        table.add_row(strut.name, display.show(strut.compression, "N"), display.show(strut.euler_load, "N"), reserve)
    return table


def load_figure(state: LoadedState, title: str = "{}: under growing load") -> "Figure":
    """Draw displacement and spring loads over the share of the load, with the linear answer as thin lines."""
    machine, curve = state.machine, load_curve(state.state)
    display, share = machine.display, 100.0 * curve.shares
    rotations = [i for i, name in enumerate(state.components) if name.startswith("r")]
    displacements = [i for i in range(len(state.components)) if i not in rotations]
    turning = {spring.name: spring.turning for spring in state.springs}
    kinds = [turns for turns, _ in KINDS_OF_LOADS if turns in turning.values()]
    with figures.new_figure(
        (figures.PAGE_WIDTH, ROOM_FOR_TITLE + CURVES_HEIGHT * (2 + len(kinds))),
        title.format(machine.name),
        setting_of(machine, []),
        "thin lines: to first order" if state.linear is not None else "",
    ) as figure:
        panels = list(figure.subplots(2 + len(kinds), 1, sharex=True, squeeze=False).flat)
        motions = ((rotations, "rotation", "rad"), (displacements, "displacement", "m"))
        for panel, (places, meaning, unit) in zip(panels, motions, strict=False):
            scale = display.fitting(unit, curve.displacement[:, places].flat)
            named = {state.components[i]: curve.displacement[:, i] * scale.factor for i in places}
            _curves(panel, share, named, scale.label(meaning))
            if state.linear is not None:
                _first_order(panel, share, [state.linear[i] for i in places], scale)
        for panel, turns in zip(panels[2:], kinds, strict=True):
            scale = display.scale(load_unit(turns))
            loads = {n: curve.loads[:, i] * scale.factor for i, n in enumerate(curve.springs) if turning[n] is turns}
            largest = sorted(loads, key=lambda name: -abs(loads[name]).max())[:MOST_CURVES]
            _curves(panel, share, {name: loads[name] for name in loads if name in largest}, scale.label("load"))
        panels[-1].set_xlabel("share of the loads (%)")
    return figure


def shape_figure(state: LoadedState, title: str = "{}: under load") -> "Figure":
    """Draw the loaded machine over the unloaded one, in front, side and plan; slack legs are dashed."""
    machine, response = state.machine, state.state.free
    names = ("without loads", "at rest under load")
    overlay = drawing.motion_overlay(machine, response, overlays.motions_of(state, response), state.slack_legs)
    with mpl.rc_context(figures.STYLE):
        figure = drawing.views_of(
            response.configuration,
            lambda panel, across, up: overlay.draw(panel, lambda points: drawing.flat(points, across, up)),
        )
        setting = f"{setting_of(machine, [])}\n{drawn_larger(overlay.factor)}"
        drawing.add_overlay_legend(figure, names, setting, bool(state.slack_legs))
        figures.set_title(figure, title.format(machine.name))
        layout.fix_layout(figure)
    return figure


def bars_figure(state: LoadedState) -> "Figure":
    """Draw a bar for the load of each leg: to the right where it pulls, to the left where it pushes, none if slack."""
    shown, display = named_leg_springs(state), state.machine.display
    by_kind = {
        turns: [(name, spring) for name, spring in shown if spring.turning is turns] for turns, _ in KINDS_OF_LOADS
    }
    groups = {turns: group for turns, group in by_kind.items() if group}
    name_width = max(LEAST_NAME_WIDTH, layout.width_of(name for name, _ in shown))
    size = name_width + BARS_WIDTH, ROOM_FOR_SCALE * len(groups) + BAR_HEIGHT * len(shown)
    with figures.new_figure(size) as figure:
        heights = [len(group) + 1 for group in groups.values()]
        panels = figure.subplots(len(groups), 1, squeeze=False, height_ratios=heights).flat
        for panel, (turns, group) in zip(panels, groups.items(), strict=True):
            scale, places = display.scale(load_unit(turns)), range(len(group))
            loads = [spring.load * scale.factor for _, spring in group]
            colours = [figures.COLOURS[0 if load > 0.0 else 1] for load in loads]
            panel.barh(places, loads, height=BAR_SHARE, color=colours)
            for place, load, (_, spring) in zip(places, loads, group, strict=True):
                text = "slack" if spring.slack else number(load, digits=display.digits)
                panel.annotate(
                    text, (load, place), xytext=(-4 if load < 0.0 else 4, 0), textcoords="offset points",
                    ha="right" if load < 0.0 else "left", va="center",
                )  # fmt: skip
            panel.set_yticks(places, [name for name, _ in group])
            panel.axvline(0.0, color=figures.GUIDE_COLOUR, linewidth=0.8)
            panel.set_xlabel(scale.label("load, positive where it pulls"))
            panel.margins(x=ROOM_BESIDE_BARS)
            panel.set_axisbelow(True)
            panel.invert_yaxis()
    return figure


def drawn_larger(factor: float) -> str:
    """Say how much larger than they are displacements are drawn."""
    return "displacements to scale" if factor == 1.0 else f"displacements drawn {factor:,.0f} times larger"


def _curves(panel: "Axes", share: Array, curves: dict[str, Array], label: str) -> None:
    for place, (name, values) in enumerate(curves.items()):
        panel.plot(share, values, label=name, **figures.look_of(place))
    panel.axvline(100.0, color=FULL_LOAD_COLOUR, linewidth=0.8)
    panel.set_ylabel(label)
    panel.margins(x=0.0)
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _first_order(panel: "Axes", share: Array, values: Sequence[float], scale: Scale) -> None:
    for colour, value in zip(figures.COLOURS, values, strict=False):
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

"""The curve of a machine under growing load: how far its tool moves, and what its springs carry."""

from collections.abc import Sequence

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kinetostat.display import Scale
from kinetostat.engine.points import Array
from kinetostat.studies.setting import setting_of
from kinetostat.studies.under_load import LoadedState, load_curve
from kinetostat.views.figures import COLOURS, DASHES, STYLE, fix_layout, note_setting, set_title

MOST_SPRINGS = 12
"""Springs of which a curve is drawn, those with the greatest loads: more cannot be told apart."""


def load_figure(state: LoadedState) -> Figure:
    """Draw displacement and spring loads over the share of the load, with the linear answer as thin lines.

    Args:
        state: of the machine under its whole load.
    """
    machine, curve = state.machine, load_curve(state.machine)
    display, share = machine.display, 100.0 * curve.shares
    groups = [
        ([i for i, name in enumerate(state.components) if name.startswith("r")], "rotation", "rad"),
        ([i for i, name in enumerate(state.components) if not name.startswith("r")], "displacement", "m"),
    ]
    turning = {spring.name: spring.turning for spring in state.springs}
    with mpl.rc_context(STYLE):
        kinds = [(unit, turns) for unit, turns in (("N", False), ("N·m", True)) if turns in turning.values()]
        figure = Figure(figsize=(6.6, 0.7 + 1.8 * (2 + len(kinds))), layout="constrained")
        panels = list(figure.subplots(2 + len(kinds), 1, sharex=True, squeeze=False).flat)
        for panel, (rows, what, unit) in zip(panels, groups, strict=False):
            scale = display.deflection(unit)
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
        set_title(figure, f"{machine.name}: under growing load")
        note_setting(figure, setting_of(machine, []), "thin lines: to first order" if state.linear else "")
        fix_layout(figure)
    return figure


def _curves(panel: Axes, share: Array, curves: dict[str, Array], label: str) -> None:
    for number, (name, values) in enumerate(curves.items()):
        dash = DASHES[number % len(DASHES)]
        panel.plot(share, values, color=COLOURS[number % len(COLOURS)], linestyle=dash, label=name)
    panel.axvline(100.0, color="#999999", linewidth=0.8)
    panel.set_ylabel(label)
    panel.margins(x=0.0)
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _first_order(panel: Axes, share: Array, values: Sequence[float], scale: Scale) -> None:
    for colour, value in zip(COLOURS, values, strict=False):
        panel.plot(share, value * scale.factor * share / 100.0, color=colour, linewidth=0.6)

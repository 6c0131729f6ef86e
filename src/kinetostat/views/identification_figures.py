"""Pictures of an identification: residuals before and after, correlations of the unknowns, and the poses."""

from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from kinetostat.studies.identification.identification import Identification
from kinetostat.studies.identification.measurements import EULER, TURNED
from kinetostat.views.figures import COLOURS, STYLE, Drawings

FEW_NAMES = 60
"""Unknowns whose paths still fit beside a matrix."""


def identification_figures(answer: Identification) -> Drawings:
    """Functions that draw its figures, by name."""
    return {
        "residuals": partial(residual_figure, answer),
        "correlations": partial(correlation_figure, answer),
        "poses": partial(pose_figure, answer),
    }


def residual_figure(answer: Identification) -> Figure:
    """Residuals of every measured value over the line of the file, as drawn and as identified."""
    fit, seen = answer.fit, answer.observed
    turns = np.array([name.removeprefix("deflection.") in (*TURNED, *EULER) for name in seen.names])
    parts = [(rows, unit) for rows, unit in ((~turns, "m"), (turns, "rad")) if rows.any()]
    lines = np.array(seen.data.lines)[seen.pose]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 2.3 * len(parts) + 0.4), layout="constrained")
        panels = figure.subplots(len(parts), 2, squeeze=False, sharex=True)
        for row, (rows, unit) in zip(panels, parts, strict=True):
            scale = answer.machine.display.deflection(unit)
            for panel, residuals, title in zip(
                row, (fit.before, fit.after), ("as drawn", "as identified"), strict=True
            ):
                off = residuals * seen.sigma * scale.factor
                for kept, colour, marker, label in (
                    (fit.kept, COLOURS[0], ".", "values"),
                    (~fit.kept, COLOURS[1], "x", "outliers"),
                ):
                    if (rows & kept).any():
                        panel.plot(lines[rows & kept], off[rows & kept], marker, color=colour, ms=3, label=label)
                inside = np.abs(off[rows & fit.kept]).max(initial=1e-12)
                panel.set(title=title, ylim=(-1.3 * inside, 1.3 * inside))
            row[0].set_ylabel(scale.label("residual"))
        for panel in panels[-1]:
            panel.set_xlabel("line of the file")
        panels[0][-1].legend(loc="upper right")
    return figure


def correlation_figure(answer: Identification) -> Figure:
    """The correlations of the unknowns; those that are not seen at all are left white."""
    matrix = answer.fit.correlations.copy()
    hidden = ~np.isfinite(answer.fit.sure)
    matrix[hidden] = matrix[:, hidden] = np.nan
    size = min(2.5 + 0.14 * len(matrix), 9.0)  # inches
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(size + 2.6, size + 0.4), layout="constrained")
        panel = figure.subplots()
        image = panel.imshow(matrix, cmap="RdBu_r", vmin=-1.0, vmax=1.0, interpolation="nearest")
        panel.grid(visible=False)
        if len(matrix) <= FEW_NAMES:
            names = [unknown.path.removeprefix("legs.") for unknown in answer.unknowns]
            panel.set_yticks(range(len(names)), names, fontsize=5)
            panel.set_xticks(range(len(names)), names, fontsize=5, rotation=90)
        figure.colorbar(image, ax=panel, shrink=0.8, label="correlation")
    return figure


def pose_figure(answer: Identification) -> Figure:
    """The commanded tool points, from the front and from above, and the poses to be measured next."""
    scale = answer.machine.display.scale("m")
    tool = answer.observed.model.tool * scale.factor
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 3.2), layout="constrained")
        for panel, (across, up) in zip(figure.subplots(1, 2), ((0, 1), (0, 2)), strict=True):
            panel.plot(tool[:, across], tool[:, up], ".", color=COLOURS[0], label="measured")
            if answer.next is not None and {"pose.x", "pose.y", "pose.z"} <= answer.next.poses.keys():
                places = [answer.next.poses[f"pose.{'xyz'[axis]}"] * scale.factor for axis in (across, up)]
                panel.plot(*places, "o", mfc="none", color=COLOURS[1], label="next (platform point)")
            panel.set(xlabel=scale.label("xyz"[across]), ylabel=scale.label("xyz"[up]), aspect="equal")
        panel.legend(loc="best")
    return figure

"""Figures of an identification: residuals, correlations of what was found, and the places that were measured.

Nothing is computed here.
"""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kinetostat.arrays import AnyArray, Array, Mask
from kinetostat.studies.identification.identification import Identification
from kinetostat.studies.identification.measurements import EULER, ROTATION
from kinetostat.units import motion_unit
from kinetostat.views.figures import COLOURS, colour_of, new_figure, slim_bar
from kinetostat.views.layout import width_of
from kinetostat.views.question import Drawing

MOST_PATHS = 60
"""Greatest number of unknowns whose paths fit beside a matrix without meeting each other."""
PATH_SIZE = 6.0
"""Size of the letters of these paths, points."""
LEAST_PATH_WIDTH = 1.4
"""Least room for these paths, inches."""
MATRIX_SIZES, UNKNOWN_SIZE = (2.5, 9.0), 0.14
"""Least and greatest side of the matrix of correlations, and what an unknown adds to it, a line of its path; inches."""
FIGURE_WIDTH, RESIDUAL_HEIGHT, PLACES_HEIGHT = 6.4, 2.3, 3.6
"""Width of the figures of residuals and of places, height of a row of residuals, and of the places; inches."""
ROOM_FOR_TITLE, ROOM_BESIDE_MATRIX = 0.7, (0.8, 0.2)
"""Height of title and notes of the residuals; width of the bar beside a matrix, and height of its title; inches."""
LEAST_HEIGHT = 0.3
"""Least height of a panel of places as a share of its width: places on a bed lie on a line, seen from the front."""
ROOM_ABOVE_RESIDUALS, OUTLIER_PLACE = 1.3, 0.94
"""Half the height of a panel over its greatest residual, and where an outlier beyond it stands, as a share of that."""
LEAST_RESIDUAL = 1e-12
"""Residual that a panel shows at least, in its unit: one whose values fit exactly still has a scale."""
FIT_CAPTIONS = {
    "residuals": "What is left of every measured value, as drawn and as identified.",
    "correlations": "Correlations of the numbers: which ones were found together.",
    "poses": "The tool points at which was measured, from above and from the front.",
}
"""Caption of each figure by its name; a report writes them below the pictures of a record, too."""


def identification_figures(answer: Identification) -> dict[str, Drawing]:
    """Return the drawings of an identification, by name."""
    figures = {"residuals": residual_figure, "correlations": correlation_figure, "poses": pose_figure}
    return {name: Drawing(FIT_CAPTIONS[name], partial(draw, answer)) for name, draw in figures.items()}


def residual_figure(answer: Identification, title: str = "{}: what is left of the measurements") -> Figure:
    """Draw residuals of every measured value over the line of the file, as drawn and as identified.

    Each component has a colour. Panels are as high as what was kept asks for; outliers beyond stand at the edge.
    """
    fit, observed = answer.fit, answer.observed
    turns = np.isin(_component_names(answer), (*ROTATION, *EULER))
    kinds = [(rows, turning) for rows, turning in ((~turns, False), (turns, True)) if rows.any()]
    outlier_note = "outliers stand at the edge of a panel where they lie beyond it" if answer.outliers else ""
    with new_figure(
        (FIGURE_WIDTH, RESIDUAL_HEIGHT * len(kinds) + ROOM_FOR_TITLE),
        title.format(answer.machine.name),
        "measured less computed",
        outlier_note,
    ) as figure:
        panels = figure.subplots(len(kinds), 2, squeeze=False, sharex=True)
        for row, (rows, turning) in zip(panels, kinds, strict=True):
            scale = answer.machine.display.deflection(motion_unit(turning))
            for panel, residuals, head in zip(row, (fit.before, fit.after), ("as drawn", "as identified"), strict=True):
                _draw_residuals(panel, answer, rows, residuals * observed.sigma * scale.factor)
                panel.set_title(head)
            row[0].set_ylabel(scale.label("residual"))
            row[-1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handletextpad=0.2)
        for panel in panels[-1]:
            panel.set_xlabel("line of the file")
    return figure


def _component_names(answer: Identification) -> AnyArray:
    """Return for each measured value the component that it is of."""
    return np.array([name.removeprefix("deflection.") for name in answer.observed.row_names])


def _draw_residuals(panel: Axes, answer: Identification, rows: Mask, residuals: Array) -> None:
    """Draw the residuals of some rows over their lines, a colour for each component; outliers are black crosses."""
    names, is_kept = _component_names(answer), answer.fit.kept
    lines = np.array(answer.observed.data.lines)[answer.observed.row_poses]
    for place, name in enumerate(dict.fromkeys(names[rows])):
        of_name = rows & is_kept & (names == name)
        panel.plot(lines[of_name], residuals[of_name], ".", color=colour_of(place), ms=3, label=name)
    edge = ROOM_ABOVE_RESIDUALS * np.abs(residuals[rows & is_kept]).max(initial=LEAST_RESIDUAL)
    outliers = rows & ~is_kept
    if outliers.any():
        shown = np.clip(residuals[outliers], -OUTLIER_PLACE * edge, OUTLIER_PLACE * edge)
        panel.plot(lines[outliers], shown, "x", color="black", ms=4, mew=0.9, label="outlier")
    panel.set_ylim(-edge, edge)


def correlation_figure(answer: Identification, title: str = "{}: numbers that were found together") -> Figure:
    """Draw the correlations of the unknowns; those that are not seen at all are left white."""
    matrix = answer.fit.correlations.copy()
    hidden = ~np.isfinite(answer.fit.half_intervals)
    matrix[hidden] = matrix[:, hidden] = np.nan
    least, greatest = MATRIX_SIZES
    size = min(least + UNKNOWN_SIZE * len(matrix), greatest)
    named = answer.unknowns if len(matrix) <= MOST_PATHS else ()
    names = [unknown.path.removeprefix("legs.").replace(".", " ") for unknown in named]
    path_width = max(LEAST_PATH_WIDTH, width_of(names, PATH_SIZE))
    width, height = (size + path_width + room for room in ROOM_BESIDE_MATRIX)
    with new_figure((width, height), title.format(answer.machine.name)) as figure:
        panel = figure.subplots()
        image = panel.imshow(matrix, cmap="RdBu_r", vmin=-1.0, vmax=1.0, interpolation="nearest")
        panel.grid(visible=False)
        if names:
            panel.set_yticks(range(len(names)), names, fontsize=PATH_SIZE)
            panel.set_xticks(range(len(names)), names, fontsize=PATH_SIZE, rotation=90)
        slim_bar(figure.colorbar(image, ax=panel, shrink=0.5, pad=0.02, label="correlation"))
    return figure


def pose_figure(answer: Identification, title: str = "{}: commanded places of the tool") -> Figure:
    """Draw the commanded tool points, from above and from the front, and the poses to be measured next."""
    scale = answer.machine.display.scale("m")
    tool = answer.observed.model.drawn.tool * scale.factor
    with new_figure((FIGURE_WIDTH, PLACES_HEIGHT), title.format(answer.machine.name)) as figure:
        for panel, (view, across, up) in zip(figure.subplots(1, 2), (("plan", 0, 1), ("front", 0, 2)), strict=True):
            panel.plot(tool[:, across], tool[:, up], ".", color=COLOURS[0], label="measured")
            if answer.next is not None and {"pose.x", "pose.y", "pose.z"} <= answer.next.poses.keys():
                places = [answer.next.poses[f"pose.{'xyz'[axis]}"] * scale.factor for axis in (across, up)]
                panel.plot(*places, "o", mfc="none", color=COLOURS[1], label="to be measured next (platform point)")
            panel.set(title=view, xlabel=scale.label("xyz"[across]), ylabel=scale.label("xyz"[up]), aspect="equal")
            low, high = panel.get_ylim()
            shortfall = max(0.0, LEAST_HEIGHT * float(np.ptp(panel.get_xlim())) - (high - low))
            panel.set_ylim(low - shortfall / 2.0, high + shortfall / 2.0)
        handles, labels = panel.get_legend_handles_labels()  # those of the other panel are the same
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure

"""The workspace of a machine: the question, the description of its answer, and its figures.

Figures are regions filled by verdict, cuts, and the solid. Verdicts come from `studies.workspace`; nothing is judged
here.
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import cycle
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from scipy import ndimage

from kinetostat.arrays import Array, Mask
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.late import LateModule
from kinetostat.machine.limits import Limits, no_limits_sentence
from kinetostat.machine.parameters import dimension, shown
from kinetostat.numerics.isosurface import surface
from kinetostat.studies.datasets import field_of
from kinetostat.studies.quantities import PoseCondition
from kinetostat.studies.workspace import (
    BORDER_VARIABLES,
    COLOURING_QUANTITY,
    FEWEST_CELLS,
    VOLUME_METHOD,
    Workspace,
    workspace,
)
from kinetostat.studies.workspace_verdicts import (
    BEYOND,
    CONDITION_VERDICT,
    INSIDE,
    LIMIT_VERDICT,
    STATUS_VERDICTS,
    depth,
    phrase,
)
from kinetostat.views.question import (
    LOADS_LEFT_OUT,
    NAME,
    Description,
    Drawing,
    Field,
    Lines,
    Option,
    Question,
    ranges_option,
)
from kinetostat.views.tables import FittedTable, numeric_table

if TYPE_CHECKING:
    from matplotlib import cm, colors, lines, patches
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import art3d

    from kinetostat.views import figures, grid, map_scales
else:
    cm = LateModule("matplotlib.cm")
    colors = LateModule("matplotlib.colors")
    lines = LateModule("matplotlib.lines")
    patches = LateModule("matplotlib.patches")
    art3d = LateModule("mpl_toolkits.mplot3d.art3d")
    figures = LateModule("kinetostat.views.figures")
    grid = LateModule("kinetostat.views.grid")
    map_scales = LateModule("kinetostat.views.map_scales")

SHOWN_ERRORS = 2
"""Standard errors that are printed: the truth lies within them 95 times of 100."""
SHADES = ("#9fd8c4", "#e4e4e4", "#555555", "#b0b0b0", "#d9c79a", "#c9c0d9", "#e3bcd1")
VERDICT_COLOURS = dict(zip([*STATUS_VERDICTS.values(), BEYOND], SHADES, strict=True))
"""Colours of verdicts that need no limit and no condition: green inside, grey and dull ones outside."""
LIMIT_COLOURS = ("#f2c77a", "#eea27a", "#f3ea9a", "#d8b98a", "#e7d3b5", "#c9a27e", "#f5dfa8", "#dcae92", "#cfc08a")
"""Colours of verdicts on limits: yellow to brown."""
CONDITION_COLOURS = ("#a9d2ee", "#7fa8cf", "#c5cbe9", "#8fc4d4", "#b7c7d9", "#9db4e0")
"""Colours of verdicts on conditions: blue."""
MOST_CUTS = 9
"""Greatest number of cuts in a picture: three rows of three fit on a page."""
OUTLINE_COLOUR = "#1d6b55"
"""Colour of the outline of the inside."""
MOST_NODES = 64
"""Nodes along an axis that the picture of a solid shows at most: its triangles are then as small as dots."""
LIGHT = np.array([-0.45, -0.7, 0.55])
"""Direction towards the light: over the left shoulder of the reader, so that edges are seen."""
WIDTH_ALONE, WIDTH_AMONG_OTHERS, CUT_HEIGHT, SQUARE_HEIGHT = 4.6, 2.6, 0.9, 0.85
"""Width of the panel of a cut with its numbers, alone and among others, inches; its height, and that of a square in it
without numbers, in widths of the panel."""
ROOM_BESIDE_CUTS, SOLID_SIZE = (0.3, 0.9), (5.2, 4.8)
"""Width of the margins of cuts and height of their title and legend; size of the figure of a solid; inches."""
PATCH_EDGE: dict[str, Any] = {"edgecolor": "#888888", "linewidth": 0.4}
"""Thin grey edge of the colours in a legend: a pale one is seen on white."""
SHADE = 0.24
"""Share of the brightness that depends on how a surface faces the light: colours still tell the quantity."""


def _volume_lines(answer: Workspace) -> Lines:
    """Give the sentences on the size of the workspace, and on what is not known of it."""
    volume = answer.volume
    name = "Area" if len(answer.dataset["verdict"].dims) == 2 else "Volume"
    if volume.cells < FEWEST_CELLS:
        cells = "1 cell" if volume.cells == 1 else f"{volume.cells:,} cells"
        yield (
            name,
            f"About {volume.value:.2g} {volume.unit} ({100.0 * volume.share:.3g} % of the box). The grid is too coarse "
            f"to say how far that may be wrong: it has {cells}; give the axes more points, for {FEWEST_CELLS} cells or "
            "more.",
        )
    else:
        yield (
            name,
            f"{volume.value:.5g} ± {SHOWN_ERRORS * volume.standard_error:.2g} {volume.unit} "
            f"({100.0 * volume.share:.4g} % of the box; two random points in each of {volume.cells:,} cells, ± two "
            "standard errors).",
        )
    if volume.unknown_cells:
        yield (
            "Unknown",
            f"It may be larger by up to {volume.unknown:.2g} {volume.unit}: in {volume.unknown_cells:,} of the cells a "
            "point did not converge or is undecided. Whether it belongs to the workspace is not known; it counts as "
            "outside.",
        )


def _border_lines(answer: Workspace) -> Lines:
    """Give the sentences on the borders of the workspace, and on the part of it that can be reached."""
    if "assembly_mode" in answer.dataset.attrs:
        yield (
            "Mode",
            "The machine keeps to the assembly mode of its home pose, the one in which its legs are written down.",
        )
    if not answer.limits:
        yield "Limits", no_limits_sentence(Limits())
    if not answer.exists:
        yield "Inside", "No pose of the box is in the workspace; the table shows why."
    elif answer.connected is None:
        yield (
            "Connected",
            "The pose of the file is outside the workspace, so it is unknown which part can be reached from it.",
        )
    elif answer.connected < 1.0:
        share = f"{100.0 * answer.connected:.3g} %"
        yield "Connected", f"Only {share} of the workspace is connected with the pose of the file."
    if not answer.singularities_divide:
        yield (
            "Singular",
            "Singularities are not borders here: they do not divide the poses of this machine, or the pose of the file "
            "is singular.",
        )


def _tables(answer: Workspace, _full: bool) -> Iterator[FittedTable]:
    total, display = answer.dataset["verdict"].size, answer.machine.display
    table = numeric_table(f"Nodes of the grid ({total:,})", "", ["nodes", "share"])
    for label, count in sorted(answer.nodes.items(), key=lambda item: (item[0] != INSIDE, -item[1])):
        if count:
            table.add_row(phrase(label), f"{count:,}", f"{100.0 * count / total:.3g} %")
    yield table
    if answer.extents:
        table = numeric_table("Extent of the workspace", "", ["from", "to", ""])
        for field, ends in answer.extents.items():
            unit = answer.dataset[dimension(field)].attrs["units"]
            low, high = (display.number(end, unit) for end in ends)
            table.add_row(shown(field), low, high, display.scale(unit).unit)
        yield table
    if answer.demands:
        table = numeric_table("Demands on the machine within the workspace", "", ["from", "to", ""])
        for demand in answer.demands:
            cells = (display.number(value, demand.unit) for value in (demand.least, demand.greatest))
            table.add_row(demand.title, *cells, display.scale(demand.unit).unit)
        yield table


def workspace_figures(answer: Workspace) -> dict[str, Drawing]:
    """Return the figures of a workspace by name.

    Over two coordinates there is a map of the region; over three, cuts along the third coordinate and the solid. With
    more coordinates, the others stay at the values of the pose in the file.
    """
    dataset, title = answer.dataset, answer.machine.name
    dims = [str(dim) for dim in dataset["verdict"].dims]
    if len(dims) == 2:
        region = partial(_draw_cuts, [dataset], answer, title=title)
        return {"region": Drawing("The workspace.", region, file="workspace")}
    fixed = {dim: float(dataset.attrs.get(field_of(dataset[dim]), dataset[dim].values.mean())) for dim in dims[3:]}
    if fixed:
        dataset = dataset.sel(fixed, method="nearest")
        title = f"{title}, {', '.join(_coordinate_text(dataset, dim) for dim in fixed)}"
    cuts = [dataset.isel({dims[2]: int(i)}) for i in _chosen_cuts(dataset, dims)]
    quantity = next((condition.quantity for condition in answer.conditions), COLOURING_QUANTITY)
    sections = partial(_draw_cuts, cuts, answer, along=dims[2], title=title)
    solid = partial(_draw_solid, dataset, dims[:3], quantity, title=title)
    return {
        "sections": Drawing("The workspace.", sections, file="workspace-sections"),
        "solid": Drawing("The workspace.", solid, file="workspace-solid"),
    }


def _chosen_cuts(dataset: xr.Dataset, dims: Sequence[str]) -> Array:
    """Choose the cuts: equally spaced values of the third coordinate, at most a step beyond the workspace."""
    reached = np.flatnonzero((dataset["verdict"] == 0).any(dims[:2]).values)
    last = dataset.sizes[dims[2]] - 1
    first, final = (max(0, reached[0] - 1), min(last, reached[-1] + 1)) if reached.size else (0, last)
    span = final - first
    finest = max(1, math.ceil(span / (MOST_CUTS - 1)))
    # A step that divides the span shows both ends; without one near the finest, the cuts lie in its middle.
    step = next((candidate for candidate in range(finest, 2 * finest) if span % candidate == 0), finest)
    return np.arange(first + span % step // 2, final + 1, step)


def _coordinate_text(dataset: xr.Dataset, dim: str) -> str:
    """Write a coordinate and its value, for titles."""
    coordinate = dataset[dim]
    value = grid.display_of(dataset).show(float(coordinate), coordinate.attrs["units"])
    return f"{dim.removeprefix('pose.')} = {value}"


def _colours(labels: Sequence[str]) -> list[str]:
    limits, unmet = cycle(LIMIT_COLOURS), cycle(CONDITION_COLOURS)
    return [
        VERDICT_COLOURS.get(label) or next(limits if label.startswith(LIMIT_VERDICT) else unmet) for label in labels
    ]


def _draw_cuts(cuts: Sequence[xr.Dataset], answer: Workspace, title: str, along: str = "") -> "Figure":
    """Draw a panel for each cut, filled by verdict, with the contours of the conditions.

    Args:
        cuts: the answer's dataset at values of a coordinate; a single one fills the figure.
        answer: the answer, which has the verdicts and the conditions.
        title: over the figure.
        along: the coordinate whose value is the title of each panel; none if empty.
    """
    rows, columns = figures.grid_shape(len(cuts))
    width = WIDTH_ALONE if len(cuts) == 1 else WIDTH_AMONG_OTHERS
    (room_beside, room_above), conditions = ROOM_BESIDE_CUTS, answer.conditions
    size = width * columns + room_beside, CUT_HEIGHT * width * rows + room_above
    with figures.new_figure(size, title) as figure:
        panels = figures.panel_grid(figure, len(cuts), sharex=True, sharey=True)
        borders: set[PoseCondition] = set()
        for panel, cut in zip(panels, cuts, strict=True):
            borders |= _draw_cut(panel, cut, answer)
            if along and len(cuts) > 1:
                panel.set_title(_coordinate_text(cut, along))
        map_scales.trim_height(figure, panels[0], SQUARE_HEIGHT * width * rows)
        frame = cuts[0].attrs.get("frame", "") if conditions else ""
        figure.legend(
            handles=[*_patches(cuts, answer.verdicts), *_border_legend(conditions, borders)],
            loc="outside lower center", ncols=min(3, 1 + columns), title=frame, title_fontsize=figures.NOTE_SIZE,
        )  # fmt: skip
    return figure


def _draw_cut(panel: "Axes", cut: xr.Dataset, answer: Workspace) -> set[PoseCondition]:
    """Fill a panel by verdict and draw the border of each condition; return the conditions that have one."""
    labels, (across, up) = answer.verdicts, map(str, cut["verdict"].dims)
    (x, x_label), (y, y_label) = grid.axis_values(cut, across), grid.axis_values(cut, up)
    verdict, colours = cut["verdict"].transpose(up, across).values, _colours(labels)
    figures.fill_regions(panel, x, y, verdict, np.ones_like(verdict, dtype=bool), colours)
    shares = [cut[f"{BORDER_VARIABLES}{dim}"].transpose(up, across).values for dim in (up, across)]
    for code in sorted(np.unique(verdict), reverse=True):  # the inside, 0, comes last and lies over the others
        within = depth(verdict == code, shares)
        if within.min() < 0.0 < within.max():
            panel.contourf(x, y, within, levels=[0.0, 2.0], colors=[colours[code]])  # depths are at most 1
            if code == 0:
                panel.contour(x, y, within, levels=[0.0], colors=OUTLINE_COLOUR, linewidths=0.9)
    judged = [i for i, label in enumerate(labels) if label == INSIDE or label.startswith(CONDITION_VERDICT)]
    drawn = set()
    for condition, colour in zip(answer.conditions, figures.COLOURS, strict=False):
        values = np.ma.masked_where(~np.isin(verdict, judged), cut[condition.quantity].transpose(up, across).values)
        if values.count() and values.min() < condition.value < values.max():
            panel.contour(x, y, values, levels=[condition.value], colors=colour, linewidths=1.2, linestyles="--")
            drawn.add(condition)
    panel.set(xlabel=x_label, ylabel=y_label, xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    map_scales.set_axis_scales(panel, cut, across, up)
    panel.label_outer()
    return drawn


def _patches(cuts: Sequence[xr.Dataset], labels: Sequence[str]) -> list["patches.Patch"]:
    """Return the legend of the colours that occur."""
    present = {int(code) for cut in cuts for code in np.unique(cut["verdict"].values)}
    return [
        patches.Patch(facecolor=colour, label=phrase(label), **PATCH_EDGE)
        for code, (label, colour) in enumerate(zip(labels, _colours(labels), strict=True))
        if code in present
    ]


def _border_legend(conditions: Sequence[PoseCondition], drawn: set[PoseCondition]) -> list["lines.Line2D"]:
    """Return the legend of the borders of conditions that are drawn."""
    texts = {condition: condition.text.replace(condition.comparison, "=", 1) for condition in conditions}
    return [
        lines.Line2D([], [], color=colour, linestyle="--", linewidth=1.2, label=texts[condition])
        for condition, colour in zip(conditions, figures.COLOURS, strict=False)
        if condition in drawn
    ]


def _draw_solid(dataset: xr.Dataset, dims: Sequence[str], quantity: str, title: str) -> "Figure":
    """Draw the inside as a lit solid in a box with scales, coloured by a quantity on its surface."""
    triangles, values = _coloured_surface(dataset, dims, quantity)
    axes = [grid.axis_values(dataset, dim) for dim in dims]
    scale = grid.display_of(dataset).scale(dataset[quantity].attrs["units"])
    values = scale.factor * values
    with figures.new_figure(SOLID_SIZE, title) as figure:
        panel = figure.add_subplot(projection="3d")
        norm = _norm_of(values)
        low, high = norm.vmin or 0.0, norm.vmax or 1.0
        colouring = cm.ScalarMappable(norm, "viridis")
        colours = _brightness(triangles) * colouring.to_rgba(values)[:, :3]
        solid = art3d.Poly3DCollection(
            triangles, facecolors=colours, edgecolors=colours, linewidths=0.2, rasterized=True
        )
        panel.add_collection3d(solid)
        panel.set(xlabel=axes[0][1], ylabel=axes[1][1], zlabel=axes[2][1])
        panel.set(**{f"{axis}lim": (ends[0], ends[-1]) for axis, (ends, _) in zip("xyz", axes, strict=True)})
        lengths = all(dataset[dim].attrs["kind"] == "length" for dim in dims)
        panel.set_box_aspect([float(np.ptp(dataset[dim].values)) for dim in dims] if lengths else None, zoom=0.9)
        bar = figure.colorbar(
            colouring, ax=panel, shrink=0.6, pad=0.12, label=scale.label(plain_name(quantity)),
            extend=map_scales.exceeded_ends(values, low, high),
        )  # fmt: skip
        figures.slim_bar(bar)
    return figure


def _coloured_surface(dataset: xr.Dataset, dims: Sequence[str], quantity: str) -> tuple[Array, Array]:
    """Return the triangles of the border of the inside [n x 3 x 3], and a quantity on each, SI.

    A large grid is thinned to `MOST_NODES`.
    """
    thin = dataset.isel({dim: slice(None, None, math.ceil(dataset.sizes[dim] / MOST_NODES)) for dim in dims})
    axes = [grid.axis_values(thin, dim)[0] for dim in dims]
    inside = thin["verdict"].transpose(*dims).values == 0
    if thin.sizes == dataset.sizes:
        shares = [dataset[f"{BORDER_VARIABLES}{dim}"].transpose(*dims).values for dim in dims]
    else:  # borders hold for steps of the whole grid; those of a thinned one are taken half-way between its nodes
        shares = [np.full(inside.shape, 0.5)] * inside.ndim
    triangles = surface(depth(inside, shares), axes)
    return triangles, _surface_values(triangles, thin[quantity].transpose(*dims).values, inside, axes)


def _norm_of(values: Array) -> "colors.Normalize":
    """Return a colour scale over the usual values on a surface, logarithmic where these span decades."""
    low, high = map_scales.usual_range(values) if np.isfinite(values).any() else (0.0, 1.0)
    return (
        colors.LogNorm(low, high) if low > 0.0 and high > map_scales.WIDE_RATIO * low else colors.Normalize(low, high)
    )


def _surface_values(triangles: Array, values: Array, inside: Mask, axes: Sequence[Array]) -> Array:
    """Interpolate values of nodes at the middle of each triangle; nodes outside have that of the nearest one inside."""
    if not len(triangles):
        return np.zeros(0)
    has_value = inside & np.isfinite(values)
    nearest = ndimage.distance_transform_edt(~has_value, return_distances=False, return_indices=True)
    steps = [(triangles[:, :, k].mean(axis=1) - axis[0]) / (axis[1] - axis[0]) for k, axis in enumerate(axes)]
    return np.asarray(ndimage.map_coordinates(values[tuple(nearest)], steps, order=1, mode="nearest"))


def _brightness(triangles: Array) -> Array:
    """Compute the brightness of each triangle by how it faces the light, scales made equal [n x 1]."""
    if not len(triangles):
        return np.zeros((0, 1))
    spread = np.ptp(triangles.reshape(-1, 3), axis=0)
    scaled = triangles / np.where(spread > 0.0, spread, 1.0)
    normals = np.cross(scaled[:, 1] - scaled[:, 0], scaled[:, 2] - scaled[:, 0])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    facing = (normals / np.where(sizes > 0.0, sizes, 1.0)) @ (LIGHT / np.linalg.norm(LIGHT))
    return np.asarray(1.0 - SHADE + SHADE * facing)[:, None]


def _coordinates(answer: Workspace) -> dict[str, Any]:
    dataset = answer.dataset
    return {
        field_of(dataset[dim]): {
            "units": dataset[dim].attrs["units"],
            "from": dataset[dim].values[0],
            "to": dataset[dim].values[-1],
            "count": dataset.sizes[dim],
            "inside": answer.extents.get(field_of(dataset[dim])),
        }
        for dim in dataset["verdict"].dims
    }


def _volume(answer: Workspace) -> dict[str, Any]:
    volume = answer.volume
    return {
        "value": volume.value,
        "standard_error": None if math.isnan(volume.standard_error) else volume.standard_error,
        "unknown": volume.unknown,
        "units": volume.unit,
        "share_of_box": volume.share,
        "cells": volume.cells,
        "method": VOLUME_METHOD,
    }


WORKSPACE = Description(
    title="Workspace",
    fields=(
        NAME,
        Field("coordinates", _coordinates),
        Field("volume", _volume),
        Field("assembly_mode", lambda answer: answer.dataset.attrs.get("assembly_mode")),
        Field("limits", lambda answer: list(answer.limits)),
        LOADS_LEFT_OUT,
        Field("nodes"),
        Field("connected"),
        Field("singularities_divide"),
        Field("demands"),
    ),
    lines=lambda answer: [*_volume_lines(answer), *_border_lines(answer)],
    tables=_tables,
    figures=workspace_figures,
    makers={"nc": attrgetter("dataset")},
    state=lambda _answer: "",
    answered=lambda answer: answer.exists,
    files={"workspace.nc": "nc"},
)
WORKSPACE_QUESTION = Question(
    example='kinetostat workspace hexapod --set "limits.longest_leg=20 cm" --over "x=-8 cm:8 cm:41" '
    '--over "y=-8 cm:8 cm:41" --over "z=10 cm:25 cm:41" --where "free_stiffness_z > 20 N/um" -o out',
    answer=workspace,
    options=(
        ranges_option("a coordinate of the pose and its range; give two to six", required=True),
        Option(
            "conditions",
            "text",
            'a condition that a pose must meet, e.g. "free_stiffness_z > 20 N/um"; repeatable, all must be met',
            metavar="CONDITION",
            many=True,
            word="--where",
        ),
        Option("seed", "count", "seed of the random points for the volume (default: 0)", metavar="SEED", default=0),
    ),
    loaded="only poses at which the machine comes to rest under its loads",
    output="NetCDF and pictures",
    reports_progress=True,
)

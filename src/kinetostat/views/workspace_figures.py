"""Figures of a workspace: regions filled by verdict, cuts, and the solid; each axis has its unit.

Verdicts come from `studies.workspace`; nothing is judged here.
"""

from collections.abc import Sequence
from functools import partial

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy import ndimage

from kinetostat.arrays import Array
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.studies.datasets import field_of
from kinetostat.studies.workspace import BORDER_VARIABLES, COLOURING_QUANTITY, Workspace
from kinetostat.studies.workspace_verdicts import (
    BEYOND,
    CONDITION_VERDICT,
    INSIDE,
    LIMIT_VERDICT,
    STATUS_VERDICTS,
    PoseCondition,
    depth,
    phrase,
    surface,
)
from kinetostat.views.figures import COLOURS, Drawings, fill_regions, new_figure, slim_bar
from kinetostat.views.grid import axis_values, display_of
from kinetostat.views.map_scales import WIDE_RATIO, exceeded_ends, set_axis_scales, trim_height, usual_range
from kinetostat.views.question import Drawing

SHADES = ("#9fd8c4", "#e4e4e4", "#555555", "#b0b0b0", "#d9c79a", "#c9c0d9", "#e3bcd1")
VERDICT_COLOURS = dict(zip([*STATUS_VERDICTS.values(), BEYOND], SHADES, strict=True))
"""Colours of verdicts that need no limit and no condition."""
LIMIT_COLOURS = ("#f2c77a", "#eea27a", "#f3ea9a", "#d8b98a", "#e7d3b5", "#c9a27e", "#f5dfa8", "#dcae92", "#cfc08a")
CONDITION_COLOURS = ("#a9d2ee", "#7fa8cf", "#c5cbe9", "#8fc4d4", "#b7c7d9", "#9db4e0")
MOST_CUTS = 9
"""Greatest number of cuts in a picture: three rows of three fit on a page."""
EDGE = "#1d6b55"
"""Colour of the outline of the inside."""
MOST_NODES = 64
"""Nodes along an axis that the picture of a solid shows at most: its triangles are then as small as dots."""
LIGHT = np.array([-0.45, -0.7, 0.55])
"""Direction towards the light: over the left shoulder of the reader, so that edges are seen."""


def pictures(dataset: xr.Dataset, labels: Sequence[str], conditions: Sequence[PoseCondition], title: str) -> Drawings:
    """Return the pictures of a workspace by what is added to the file's name.

    Over two coordinates there is a map of the region; over three, cuts along the third coordinate and the solid. With
    more coordinates, the others stay at the values of the pose in the file.

    Args:
        dataset: the dataset of a `studies.workspace.Workspace`.
        labels: its verdicts.
        conditions: the conditions whose contours are drawn.
        title: over each picture.
    """
    dims = [str(dim) for dim in dataset["verdict"].dims]
    fixed = {dim: float(dataset.attrs.get(field_of(dataset[dim]), dataset[dim].values.mean())) for dim in dims[3:]}
    if fixed:
        dataset = dataset.sel(fixed, method="nearest")
        shown = ", ".join(_coordinate_text(dataset, dim) for dim in fixed)
        title = f"{title}, {shown}"
    if len(dims) == 2:
        return {"": partial(_sections, [dataset], labels, conditions, title=title)}
    cuts = [dataset.isel({dims[2]: int(i)}) for i in _chosen_cuts(dataset, dims)]
    return {
        "-sections": partial(_sections, cuts, labels, conditions, title=title),
        "-solid": partial(_solid, dataset, dims[:3], _colouring_quantity(conditions), title=title),
    }


def _chosen_cuts(dataset: xr.Dataset, dims: Sequence[str]) -> Array:
    """Choose the cuts: equally spaced values of the third coordinate, at most a step beyond the workspace."""
    reached = np.flatnonzero((dataset["verdict"] == 0).any(dims[:2]).values)
    last = dataset.sizes[dims[2]] - 1
    first, final = (max(0, reached[0] - 1), min(last, reached[-1] + 1)) if reached.size else (0, last)
    span = final - first
    finest = max(1, -(-span // (MOST_CUTS - 1)))
    step = next((candidate for candidate in range(finest, 2 * finest) if span % candidate == 0), finest)
    return np.arange(first + span % step // 2, final + 1, step)


def _coordinate_text(dataset: xr.Dataset, dim: str) -> str:
    """Write a coordinate and its value, for titles."""
    coordinate = dataset[dim]
    value = display_of(dataset).show(float(coordinate), coordinate.attrs["units"])
    return f"{dim.removeprefix('pose.')} = {value}"


def _colours(labels: Sequence[str]) -> list[str]:
    limits, unmet = iter(LIMIT_COLOURS), iter(CONDITION_COLOURS * 6)
    return [
        VERDICT_COLOURS.get(label) or next(limits if label.startswith(LIMIT_VERDICT) else unmet) for label in labels
    ]


def _sections(
    cuts: Sequence[xr.Dataset], labels: Sequence[str], conditions: Sequence[PoseCondition], title: str
) -> Figure:
    """Draw a panel for each cut, filled by verdict, with the contours of the conditions."""
    columns = min(3, len(cuts))
    rows = -(-len(cuts) // columns)
    wide = 4.6 if len(cuts) == 1 else 2.6
    with new_figure((wide * columns + 0.3, 0.9 * wide * rows + 0.9), title) as figure:
        panels = list(figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).flat)
        edges: set[PoseCondition] = set()
        for panel, cut in zip(panels, cuts, strict=False):
            edges |= _fill(panel, cut, labels, conditions)
            if len(cuts) > 1:
                across = str(next(dim for dim in cut.coords if dim not in cut["verdict"].dims and cut[dim].attrs))
                panel.set_title(_coordinate_text(cut, _varied_coordinate(cuts, across)))
        for panel in panels[len(cuts) :]:
            panel.remove()
        trim_height(figure, panels[0], 0.85 * wide * rows)
        frame = cuts[0].attrs.get("frame", "") if conditions else ""
        figure.legend(
            handles=[*_patches(cuts, labels), *_lines(conditions, edges)],
            loc="outside lower center", ncols=min(3, 1 + columns), title=frame, title_fontsize=6.5,
        )  # fmt: skip
    return figure


def _varied_coordinate(cuts: Sequence[xr.Dataset], fallback: str) -> str:
    """Find the coordinate that differs between cuts."""
    names = [str(n) for n in cuts[0].coords if n not in cuts[0]["verdict"].dims]
    return next((n for n in names if len({float(cut[n]) for cut in cuts}) > 1), fallback)


def _fill(
    panel: Axes, cut: xr.Dataset, labels: Sequence[str], conditions: Sequence[PoseCondition]
) -> set[PoseCondition]:
    """Fill a panel by verdict and draw the border of each condition; return the conditions that have one."""
    across, up = (str(dim) for dim in cut["verdict"].dims)
    (x, x_label), (y, y_label) = axis_values(cut, across), axis_values(cut, up)
    verdict = cut["verdict"].transpose(up, across).values
    fill_regions(panel, x, y, verdict, np.ones_like(verdict, dtype=bool), _colours(labels))
    shares = [cut[f"{BORDER_VARIABLES}{dim}"].transpose(up, across).values for dim in (up, across)]
    for code in sorted(np.unique(verdict), reverse=True):
        within = depth(verdict == code, shares)
        if within.min() < 0.0 < within.max():
            panel.contourf(x, y, within, levels=[0.0, 2.0], colors=[_colours(labels)[code]])
            if code == 0:
                panel.contour(x, y, within, levels=[0.0], colors=EDGE, linewidths=0.9)
    elsewhere = ~np.isin(
        verdict, [i for i, label in enumerate(labels) if label == INSIDE or label.startswith(CONDITION_VERDICT)]
    )
    edges = set()
    for condition, colour in zip(conditions, COLOURS, strict=False):
        values = np.ma.masked_where(elsewhere, cut[condition.quantity].transpose(up, across).values)
        if values.count() and values.min() < condition.value < values.max():
            panel.contour(x, y, values, levels=[condition.value], colors=colour, linewidths=1.2, linestyles="--")
            edges.add(condition)
    panel.set(xlabel=x_label, ylabel=y_label, xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    set_axis_scales(panel, cut, across, up)
    panel.label_outer()
    return edges


def _patches(cuts: Sequence[xr.Dataset], labels: Sequence[str]) -> list[Patch]:
    """Return the legend of the colours that occur."""
    present = {int(code) for cut in cuts for code in np.unique(cut["verdict"].values)}
    return [
        Patch(facecolor=colour, edgecolor="#888888", linewidth=0.4, label=phrase(label))
        for code, (label, colour) in enumerate(zip(labels, _colours(labels), strict=True))
        if code in present
    ]


def _lines(conditions: Sequence[PoseCondition], edges: set[PoseCondition]) -> list[Line2D]:
    """Return the legend of the lines that are drawn."""
    return [
        Line2D([], [], color=colour, linestyle="--", linewidth=1.2, label=_edge(condition))
        for condition, colour in zip(conditions, COLOURS, strict=False)
        if condition in edges
    ]


def _edge(condition: PoseCondition) -> str:
    return condition.text.replace(condition.comparison, "=", 1)


def _colouring_quantity(conditions: Sequence[PoseCondition]) -> str:
    """Choose the quantity that colours a solid: that of the first condition, else the least stiffness."""
    return next((condition.quantity for condition in conditions), COLOURING_QUANTITY)


def _solid(dataset: xr.Dataset, dims: Sequence[str], quantity: str, title: str) -> Figure:
    """Draw the inside as a lit solid in a box with scales, coloured by a quantity on its surface."""
    triangles, values = _coloured_surface(dataset, dims, quantity)
    axes = [axis_values(dataset, dim) for dim in dims]
    scale = display_of(dataset).scale(dataset[quantity].attrs["units"])
    values = scale.factor * values
    with new_figure((5.2, 4.8), title) as figure:
        panel = figure.add_subplot(projection="3d")
        norm = _norm_of(values)
        low, high = norm.vmin or 0.0, norm.vmax or 1.0
        colours = _brightness(triangles) * mpl.colormaps["viridis"](norm(values))[:, :3]
        solid = Poly3DCollection(triangles, facecolors=colours, edgecolors=colours, linewidths=0.2, rasterized=True)
        panel.add_collection3d(solid)
        panel.set(xlabel=axes[0][1], ylabel=axes[1][1], zlabel=axes[2][1])
        panel.set(**{f"{axis}lim": (ends[0], ends[-1]) for axis, (ends, _) in zip("xyz", axes, strict=True)})
        lengths = all(dataset[dim].attrs["kind"] == "length" for dim in dims)
        panel.set_box_aspect([float(np.ptp(dataset[dim].values)) for dim in dims] if lengths else None, zoom=0.9)
        bar = figure.colorbar(
            ScalarMappable(norm, "viridis"), ax=panel, shrink=0.6, pad=0.12, label=scale.label(plain_name(quantity)),
            extend=exceeded_ends(values, low, high),
        )  # fmt: skip
        slim_bar(bar)
    return figure


def _coloured_surface(dataset: xr.Dataset, dims: Sequence[str], quantity: str) -> tuple[Array, Array]:
    """Return the triangles of the border of the inside [n x 3 x 3], and a quantity on each, SI.

    A large grid is thinned to `MOST_NODES`.
    """
    thin = dataset.isel({dim: slice(None, None, -(-dataset.sizes[dim] // MOST_NODES)) for dim in dims})
    axes = [axis_values(thin, dim)[0] for dim in dims]
    inside = thin["verdict"].transpose(*dims).values == 0
    # Borders hold for steps of the whole grid; a thinned one has none of its own.
    is_whole = thin.sizes == dataset.sizes
    shares = [dataset[f"{BORDER_VARIABLES}{dim}"].transpose(*dims).values for dim in dims] if is_whole else []
    triangles = surface(depth(inside, shares or _halves(inside)), axes)
    return triangles, _surface_values(triangles, thin[quantity].transpose(*dims).values, inside, axes)


def _norm_of(values: Array) -> Normalize:
    """Return a colour scale over the usual values on a surface, logarithmic where these span decades."""
    low, high = usual_range(values) if np.isfinite(values).any() else (0.0, 1.0)
    return LogNorm(low, high) if low > 0.0 and high > WIDE_RATIO * low else Normalize(low, high)


def _halves(inside: np.ndarray) -> list[np.ndarray]:
    """Return borders half-way between nodes."""
    return [np.full(inside.shape, 0.5)] * inside.ndim


def _surface_values(triangles: Array, values: Array, inside: np.ndarray, axes: Sequence[Array]) -> Array:
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
    even = triangles / np.where(spread > 0.0, spread, 1.0)
    normals = np.cross(even[:, 1] - even[:, 0], even[:, 2] - even[:, 0])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    facing = (normals / np.where(sizes > 0.0, sizes, 1.0)) @ (LIGHT / np.linalg.norm(LIGHT))
    return np.asarray(0.76 + 0.24 * facing)[:, None]


def workspace_figures(workspace: Workspace) -> dict[str, Drawing]:
    """Return the pictures of a workspace by name; its region over two coordinates is "region"."""
    name, dataset = workspace.machine.name, workspace.dataset
    drawn = pictures(dataset, workspace.verdicts, workspace.conditions, name)
    return {
        suffix.removeprefix("-") or "region": Drawing("The workspace.", draw, file=f"workspace{suffix}")
        for suffix, draw in drawn.items()
    }

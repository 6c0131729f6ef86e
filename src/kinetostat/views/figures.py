"""Figures for print: contour maps and curves of a dataset from `studies.grid`. Every axis has its unit."""

import io
import struct
import textwrap
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import QuadMesh
from matplotlib.colorbar import Colorbar
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from PIL import Image

from kinetostat.arrays import Array
from kinetostat.display import Scale, number, with_minus_signs, with_unit
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, plain_name
from kinetostat.late import LateModule
from kinetostat.studies.storage import replacing
from kinetostat.views.layout import fix_layout, steady_ticks
from kinetostat.views.levels import levels_of
from kinetostat.views.map_scales import set_axis_scales, thin_numbers, trim_height

if TYPE_CHECKING:
    import xarray as xr

    from kinetostat.studies import datasets, grid
    from kinetostat.views import grid as grid_view
else:  # figures of other answers need no xarray, which takes as long to import as a figure takes to draw
    datasets, grid = LateModule("kinetostat.studies.datasets"), LateModule("kinetostat.studies.grid")
    grid_view = LateModule("kinetostat.views.grid")

STYLE: Any = {
    "font.family": "DejaVu Sans",
    "text.hinting": "no_hinting",
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titley": 1.0,  # no panel has ticks above it; else each one is measured twice more, whenever a title is placed
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "#444444",
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "svg.fonttype": "none",
    "svg.hashsalt": "kinetostat",
    "pdf.fonttype": 42,
    "figure.dpi": 200,
}
FORMATS: dict[str, Any] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""In which figures are written, and what leaves the date out: equal figures are equal files."""
PNG_LEVEL = 3
"""Of the compression; a higher one takes twice the time for a tenth of the size."""
METRES_PER_INCH = 0.0254
MOST_STEPS = 5
"""Steps between the numbers along an axis of a map: as many across as up, whatever shape the panel has."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Okabe and Ito: distinct for colour-blind readers and in grey."""
DASHES: tuple[Any, ...] = ("-", "--", ":", "-.", (0, (5, 1)), (0, (1, 1)))
MOST_INSIDE = 6
"""Curves of which the legend stands in the panel; of more it would cover them, and stands beside it."""
CHARACTERS = 19
"""Of the small line below a figure, per inch."""
TITLE_CHARACTERS = 12
"""Of the title over a figure, per inch."""
MARGIN = 0.04
"""Inches around a figure that stands in a page."""
FLAT = 1e-9
"""Relative spread below which a map is constant and has no contours."""
MOST_COUNTS = 12
"""Whole numbers that have a colour each; more of them are drawn as contours."""

Drawings: TypeAlias = dict[str, Callable[[], Figure]]
"""Functions that draw a figure, by its name: a figure that nobody asks for is never drawn."""
Tell: TypeAlias = Callable[[int, int, str], None]
"""Called with how many figures are done, how many there are, and which one comes next."""


@contextmanager
def new_figure(size: tuple[float, float], title: str | None = None, *notes: str) -> Iterator[Figure]:
    """Give an empty figure to fill, in the style of all figures; at the end write title and notes, and fix the layout.

    Args:
        size: width and height, inches.
        title: over the figure; without one (None), the panels take its room.
        notes: small lines below the figure; see `note_setting`.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        yield figure
        if title is not None:
            set_title(figure, title)
        if notes:
            note_setting(figure, *notes)
        fix_layout(figure)


def contour_maps(dataset: "xr.Dataset", names: Sequence[str], title: str) -> Figure:
    """One panel per quantity over the two dimensions of the dataset, contours labelled with their values.

    Args:
        dataset: two-dimensional, from `studies.grid.evaluate_grid`.
        names: which quantities.
        title: over the whole figure.
    """
    across, up = dataset["status"].dims
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    with new_figure((2.75 * columns + 0.3, 2.45 * rows + 0.4), title, *setting_lines(dataset)) as figure:
        mpl.rcParams["axes.grid"] = False
        panels = figure.subplots(rows, columns, squeeze=False).flat
        x, x_label = grid_view.axis_values(dataset, str(across))
        y, y_label = grid_view.axis_values(dataset, str(up))
        lines = []
        for place, (panel, name) in enumerate(zip(panels, names, strict=False)):
            scale = grid_view.display_of(dataset).fitting(dataset[name].attrs["units"], dataset[name].values.flat)
            panel_of = _count_panel if _is_count(dataset[name]) else _contour_panel
            lines += panel_of(panel, x, y, dataset[name].transpose(up, across), scale)
            _label_outside(panel, x_label if place + columns >= len(names) else "", "" if place % columns else y_label)
            set_axis_scales(panel, dataset, str(across), str(up))
            thin_numbers(panel)
        trim_height(figure, figure.axes[0], 1.4 * rows)
        for unused in list(figure.axes)[len(names) : rows * columns]:
            unused.remove()
    with mpl.rc_context(STYLE):
        for contours in lines:
            _write_levels(contours)
    return figure


def curves(dataset: "xr.Dataset", names: Sequence[str], title: str) -> Figure:
    """Quantities over the one dimension of the dataset, one panel for each unit; logarithmic where the range is.

    Args:
        dataset: one-dimensional, from `studies.grid.evaluate_grid`.
        names: which quantities.
        title: over the whole figure.
    """
    (across,) = dataset["status"].dims
    units = list(dict.fromkeys(dataset[name].attrs["units"] for name in names))
    with new_figure((3.4 * len(units) + 0.2, 3.0), title, *setting_lines(dataset)) as figure:
        for panel, unit in zip(figure.subplots(1, len(units), squeeze=False).flat, units, strict=True):
            shown = [name for name in names if dataset[name].attrs["units"] == unit]
            _curve_panel(panel, dataset, str(across), shown)
    return figure


def save(
    drawings: Mapping[str, Callable[[], Figure]],
    folder: Path,
    formats: Sequence[str] = ("png",),
    tell: Tell | None = None,
) -> list[Path]:
    """Draw figures and write them into a folder.

    Args:
        drawings: functions that draw them, by the name of the file without its suffix.
        folder: the folder of the files.
        formats: some of `FORMATS`.
        tell: called before each figure with how many are done, how many there are, and which one comes next.

    Returns:
        The paths.
    """
    written = []
    for done, (name, draw) in enumerate(drawings.items()):
        if tell:
            tell(done, len(drawings), f"figure {done + 1} of {len(drawings)}: {name}")
        figure = draw()
        for suffix in formats:
            written.append(folder / f"{name}.{suffix}")
            save_figure(figure, written[-1])
    return written


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure to a file whose suffix is one of `FORMATS`; PNG has 200 dpi."""
    suffix = path.suffix[1:].lower()
    with replacing(path) as temporary, mpl.rc_context(STYLE):
        if suffix == "png":
            temporary.write_bytes(_png_of(figure))
        else:
            figure.savefig(temporary, metadata=FORMATS[suffix])


def _png_of(figure: Figure) -> bytes:
    """Draw a figure as a PNG of opaque pixels.

    `savefig` would go through all artists once more before it draws them, and Pillow would try five filters on each
    line: without a filter, areas of one colour take less room and a third of the time. The canvas that the layout was
    made with knows the sizes of all texts.
    """
    canvas = figure.canvas if isinstance(figure.canvas, FigureCanvasAgg) else FigureCanvasAgg(figure)
    with steady_ticks(figure.axes):
        canvas.draw()  # type: ignore[no-untyped-call]
    width, height = canvas.get_width_height()
    pixels = Image.frombuffer("RGBA", (width, height), canvas.buffer_rgba()).convert("RGB")  # type: ignore[no-untyped-call]
    lines = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # each begins with the number of its filter
    lines[:, 1:] = np.asarray(pixels).reshape(height, 3 * width)
    parts = {
        b"IHDR": struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0),
        b"pHYs": struct.pack(">IIB", *2 * (round(figure.dpi / METRES_PER_INCH),), 1),
        b"IDAT": zlib.compress(lines.tobytes(), PNG_LEVEL),
        b"IEND": b"",
    }
    chunks = (
        struct.pack(">I", len(part)) + kind + part + struct.pack(">I", zlib.crc32(kind + part))
        for kind, part in parts.items()
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def as_svg(figure: Figure) -> str:
    """A figure as one SVG element, to stand inside a page."""
    text = io.StringIO()
    with mpl.rc_context({**STYLE, "svg.fonttype": "path"}):
        figure.savefig(text, format="svg", metadata={"Date": None}, bbox_inches="tight", pad_inches=MARGIN)
    return text.getvalue()[text.getvalue().index("<svg") :]


def look_of(place: int) -> dict[str, Any]:
    """Colour and dash of a curve by its place among others; no two of the first 36 look alike."""
    turn, colour = divmod(place, len(COLOURS))
    return {"color": COLOURS[colour], "linestyle": DASHES[(colour + turn) % len(DASHES)]}


def set_title(figure: Figure, title: str) -> None:
    """Write the title over a figure, in as many lines as its width asks for."""
    lines = textwrap.wrap(title, int(TITLE_CHARACTERS * figure.get_figwidth()))
    # Names from files stand in titles: two dollar signs in one are no mathematics.
    figure.suptitle("\n".join(lines), fontsize=10, parse_math=False)


def note_setting(figure: Figure, *lines: str) -> None:
    """Small lines below a figure: where its numbers hold, and what is missing; wrapped to its width."""
    room = int(CHARACTERS * figure.get_figwidth())
    shown = [with_minus_signs(part) for line in lines if line for part in textwrap.wrap(line, room)]
    figure.supxlabel("\n".join(shown), fontsize=6.5, color="#555555")


def missing_line(counts: Mapping[Status, int], poses: int, shown: str = "") -> str:
    """Say how many poses have no result, and why; empty where all have one.

    Args:
        counts: the numbers of poses by their status.
        poses: number of all.
        shown: the words in brackets on how the figure shows them.
    """
    words = {status.word.replace("_", " "): count for status, count in counts.items()}
    why = ", ".join(words if len(words) == 1 else (f"{word}: {count:,}" for word, count in words.items()))
    return f"no result{shown} at {sum(words.values()):,} of {poses:,} poses ({why})" if words else ""


def setting_lines(dataset: "xr.Dataset") -> tuple[str, str, str]:
    """Frame and pose of a grid, loads that do not count, and how many of its poses have no result."""
    missing = missing_line(grid.failures(dataset), dataset["status"].size)
    where = "; ".join(text for text in (dataset.attrs.get("frame"), dataset.attrs.get("pose")) if text)
    return where, dataset.attrs.get(datasets.LOADS_LEFT_OUT, ""), missing


def _contour_panel(panel: Axes, x: Array, y: Array, data: "xr.DataArray", scale: Scale) -> list[QuadContourSet]:
    """Fill a panel with bands of colour; return its lines, whose values can be written once the layout is fixed."""
    values = np.ma.masked_invalid(data.values * scale.factor)
    panel.set_title(scale.label(data.attrs["symbol"]))
    panel.set_facecolor("#eeeeee")
    panel.set(xlim=(x.min(), x.max()), ylim=(y.min(), y.max()))
    panel.locator_params(nbins=MOST_STEPS)
    if values.count() == 0:
        _note(panel, "no result")
        return []
    if np.ptp(values.compressed()) <= FLAT * np.abs(values).max():
        panel.set_facecolor("#b5dbe3")
        _note(panel, f"constant: {with_unit(number(float(values.compressed()[0])), scale.unit)}")
        return []
    levels = levels_of(values.compressed())
    norm = LogNorm(levels.bounds[0], levels.bounds[-1]) if levels.logarithmic else None
    filled = panel.contourf(x, y, values, levels.bounds, cmap="viridis", norm=norm, extend=levels.extend)
    bar = panel.figure.colorbar(filled, ax=panel, shrink=0.85, pad=0.03)
    if levels.logarithmic:
        bar.set_ticks(levels.bounds.tolist(), labels=[f"{bound:g}" for bound in levels.bounds])
    slim_bar(bar)
    return [panel.contour(filled, levels=levels.bounds[::2], colors="white", linewidths=0.5)]


def _label_outside(panel: Axes, below: str, beside: str) -> None:
    """Label the axes of a panel of several that share them; a label is empty where another panel has it."""
    panel.set(xlabel=below, ylabel=beside)
    panel.tick_params(labelbottom=bool(below), labelleft=bool(beside))


def _is_count(data: "xr.DataArray") -> bool:
    """Whether a quantity counts, and takes so few values that each can have a colour."""
    name = str(data.name)
    return name in QUANTITIES and QUANTITIES[name].whole and np.unique(data.values).size <= MOST_COUNTS


def _count_panel(panel: Axes, x: Array, y: Array, data: "xr.DataArray", scale: Scale) -> list[QuadContourSet]:
    """Fill a panel with a colour for each whole number; between two poses there is no line to draw."""
    values = np.unique(data.values[np.isfinite(data.values)])
    if values.size < 2:
        return _contour_panel(panel, x, y, data, scale)
    panel.set_title(scale.label(data.attrs["symbol"]))
    colours = region_colours(values.size)
    mesh = fill_regions(panel, x, y, np.searchsorted(values, data.values), np.isfinite(data.values), colours)
    bar = panel.figure.colorbar(mesh, ax=panel, shrink=0.85, pad=0.03, ticks=np.arange(values.size))
    bar.set_ticklabels([f"{value:g}" for value in values])
    slim_bar(bar)
    return []


def region_colours(count: int) -> Array:
    """Return so many colours for regions, from dark to light [count x 4]."""
    return np.asarray(mpl.colormaps["viridis"](np.linspace(0.1, 0.95, count)))


def fill_regions(panel: Axes, x: Array, y: Array, places: Any, known: Any, colours: Any) -> QuadMesh:
    """Fill a panel pose by pose, without any value between two poses.

    Args:
        panel: the panel to fill.
        x, y: the coordinates of the poses, as the axes show them.
        places: the place of each pose's colour [y x x].
        known: whether there is a result; elsewhere the panel is grey [y x x].
        colours: the colours from which they are taken.
    """
    panel.set_facecolor("#eeeeee")
    panel.grid(visible=False)
    shown, most = np.ma.masked_array(places, ~known), len(colours) - 0.5
    palette = ListedColormap(colours)
    return panel.pcolormesh(x, y, shown, cmap=palette, vmin=-0.5, vmax=most, shading="nearest", rasterized=True)


def slim_bar(bar: Colorbar) -> None:
    """Give a colour bar thin lines, small numbers, and ticks at its numbers alone."""
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(labelsize=6.5, width=0.4)
    bar.minorticks_off()


def _write_levels(lines: QuadContourSet) -> None:
    """Write the values of lines where they fit into the panel; the layout of the figure must be fixed."""
    frame, uncut = lines.axes.get_window_extent(), [*lines.get_paths()]
    texts = lines.clabel(fontsize=6, fmt="%.6g")
    boxes = [text.get_window_extent() for text in texts]
    fitting = [frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1) for box in boxes]
    if not all(fitting):
        for text in texts:
            text.remove()
        lines.set_paths(uncut)
        if any(fitting):
            places = [text.get_position() for text, fits in zip(texts, fitting, strict=True) if fits]
            lines.clabel(fontsize=6, fmt="%.6g", manual=places)


def _note(panel: Axes, text: str) -> None:
    panel.text(0.5, 0.5, text, transform=panel.transAxes, ha="center", va="center", fontsize=7.5)


def _curve_panel(panel: Axes, dataset: "xr.Dataset", across: str, names: Sequence[str]) -> None:
    x, x_label = grid_view.axis_values(dataset, across)
    logarithmic = bool(dataset[across].attrs["log"])
    values = np.concatenate([dataset[name].values for name in names])
    unit = dataset[names[0]].attrs["units"]
    scale = grid_view.display_of(dataset).fitting(unit, values)
    for place, name in enumerate(names):
        panel.plot(x, dataset[name].values * scale.factor, label=dataset[name].attrs["symbol"], **look_of(place))
    if logarithmic:
        panel.set(xscale="log", yscale="log" if np.nanmin(values) > 0 else "linear")
    about = dataset[names[0]].attrs.get("long_name") or ", ".join(
        plain_name(group) for group in dict.fromkeys(group_of([name]) or name for name in names)
    )
    panel.set(xlabel=x_label, ylabel=scale.label(about))
    panel.margins(x=0.0)
    if len(names) > MOST_INSIDE:
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    else:
        panel.legend(loc="best")

"""The style that all figures for print share: sizes, colours, titles, notes; and how they are written to files.

What a figure shows is drawn by the module of its answer.
"""

import io
import math
import struct
import textwrap
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import QuadMesh
from matplotlib.colorbar import Colorbar
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from PIL import Image

from kinetostat.arrays import Array
from kinetostat.display import with_minus_signs
from kinetostat.kinematics.status import Status
from kinetostat.studies.storage import replacing
from kinetostat.views.layout import fix_layout, steady_ticks

GUIDE_COLOUR = "#444444"
"""Dark grey of lines and signs that are no result: axes, zero, what was before."""
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "text.hinting": "no_hinting",
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titley": 1.0,  # no panel has ticks above it; else each one is measured twice more, whenever a title is placed
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": GUIDE_COLOUR,
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
"""Formats of files, each with the metadata that leaves the date out: equal figures are equal files."""
PNG_LEVEL = 3
"""Level of compression; a higher one takes twice the time and saves a tenth of the size."""
METRES_PER_INCH = 0.0254
"""Metres of an inch: PNG states its resolution in pixels per metre."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Okabe and Ito: distinct for colour-blind readers and in grey."""
NOTE_COLOUR, NOTE_SIZE, TITLE_SIZE = "#555555", 6.5, 10
"""Grey and size of the notes below a figure, and size of its title, points; long legends are as small as notes."""
BAR_SHARE = 0.92
"""Width of a bar as a share of its place beside others: a line of white parts it from the next."""
NO_RESULT_COLOUR = "#eeeeee"
"""Pale grey of poses without a result."""
DASHES: tuple[Any, ...] = ("-", "--", ":", "-.", (0, (5, 1)), (0, (1, 1)))
"""Dashes of curves, which tell them apart without colours."""
NOTE_CHARACTERS_PER_INCH, TITLE_CHARACTERS_PER_INCH = 19, 12
"""Characters of the notes below a figure and of its title that fit into an inch, at the sizes of both."""
MOST_COLUMNS = 3
"""Panels side by side, as a rule at most: with more, a figure would be wider than a page."""
PAGE_WIDTH = 6.6
"""Width of a figure whose panels stand below each other, inches: that of the text of a page."""
PAGE_MARGIN = 0.04
"""Room around a figure that stands in a page, inches: the page has margins of its own."""

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


def grid_shape(count: int, most_columns: int = MOST_COLUMNS) -> tuple[int, int]:
    """Return the numbers of rows and of columns of so many panels, which are filled row by row."""
    columns = min(most_columns, count)
    return math.ceil(count / columns), columns


def panel_grid(
    figure: Figure, count: int, most_columns: int = MOST_COLUMNS, sharex: bool = False, sharey: bool = False
) -> list[Axes]:
    """Add panels to a figure row by row, and return them; what is left over of the last row stays empty.

    Args:
        figure: the figure, which has no panels yet.
        count: number of panels.
        most_columns: number of panels side by side at most.
        sharex, sharey: whether all panels have one scale across, and up.
    """
    shape = grid_shape(count, most_columns)
    panels = list(figure.subplots(*shape, squeeze=False, sharex=sharex, sharey=sharey).flat)
    for unused in panels[count:]:
        unused.remove()
    return panels[:count]


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
    """Write a figure as one SVG element that stands inside a page."""
    text = io.StringIO()
    with mpl.rc_context({**STYLE, "svg.fonttype": "path"}):
        figure.savefig(text, format="svg", metadata={"Date": None}, bbox_inches="tight", pad_inches=PAGE_MARGIN)
    return text.getvalue()[text.getvalue().index("<svg") :]


def colour_of(place: int) -> str:
    """Choose the colour of a thing by its place among others; every seventh has that of the first."""
    return COLOURS[place % len(COLOURS)]


def look_of(place: int) -> dict[str, Any]:
    """Choose colour and dash of a curve by its place among others; no two of the first 36 look alike."""
    turn, colour = divmod(place, len(COLOURS))
    return {"color": COLOURS[colour], "linestyle": DASHES[(colour + turn) % len(DASHES)]}


def set_title(figure: Figure, title: str) -> None:
    """Write the title over a figure, in as many lines as its width asks for."""
    lines = textwrap.wrap(title, int(TITLE_CHARACTERS_PER_INCH * figure.get_figwidth()))
    # Names from files stand in titles: two dollar signs in one are no mathematics.
    figure.suptitle("\n".join(lines), fontsize=TITLE_SIZE, parse_math=False)


def note_setting(figure: Figure, *lines: str) -> None:
    """Write small lines below a figure, wrapped to its width: where its numbers hold, and what is missing."""
    room = int(NOTE_CHARACTERS_PER_INCH * figure.get_figwidth())
    shown = [with_minus_signs(part) for line in lines if line for part in textwrap.wrap(line, room)]
    figure.supxlabel("\n".join(shown), fontsize=NOTE_SIZE, color=NOTE_COLOUR)


def missing_line(counts: Mapping[Status, int], poses: int, shown: str = "") -> str:
    """Say how many poses have no result, and why; empty where all have one.

    Args:
        counts: the numbers of poses by their status.
        poses: number of all.
        shown: the words in brackets on how the figure shows them.
    """
    words = {status.phrase: count for status, count in counts.items()}
    why = ", ".join(words if len(words) == 1 else (f"{word}: {count:,}" for word, count in words.items()))
    return f"no result{shown} at {sum(words.values()):,} of {poses:,} poses ({why})" if words else ""


def region_colours(count: int) -> Array:
    """Return so many colours for regions, from dark to light [count x 4]."""
    return np.asarray(mpl.colormaps["viridis"](np.linspace(0.1, 0.95, count)))


def fill_regions(panel: Axes, x: Array, y: Array, places: Any, has_result: Any, colours: Any) -> QuadMesh:
    """Fill a panel pose by pose, without any value between two poses.

    Args:
        panel: the panel to fill.
        x, y: the coordinates of the poses, as the axes show them.
        places: the place of each pose's colour [y x x].
        has_result: whether there is a result; elsewhere the panel is grey [y x x].
        colours: the colours from which they are taken.
    """
    panel.set_facecolor(NO_RESULT_COLOUR)
    panel.grid(visible=False)
    shown, end = np.ma.masked_array(places, ~has_result), len(colours) - 0.5
    palette = ListedColormap(colours)
    return panel.pcolormesh(x, y, shown, cmap=palette, vmin=-0.5, vmax=end, shading="nearest", rasterized=True)


def slim_bar(bar: Colorbar) -> None:
    """Give a colour bar thin lines, small numbers, and ticks at its numbers alone."""
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(labelsize=NOTE_SIZE, width=0.4)
    bar.minorticks_off()

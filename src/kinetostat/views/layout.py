"""The layout of figures: texts in fonts that have their characters, and room for the labels around panels.

A character that no font has is shown by its number. Matplotlib takes text between two dollar signs as mathematics: here
symbols of quantities stay mathematics, and names from files do not become it. Labels are measured as seldom as
possible, because measuring them takes most of the time of a figure. Nothing is drawn here.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, fontManager, get_font
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FixedLocator, LogFormatter, ScalarFormatter
from matplotlib.transforms import Bbox

from kinetostat.kinetostatics.quantities import QUANTITIES

USUAL_FONT = "DejaVu Sans"
"""The font that Matplotlib brings with it: figures are the same on every computer."""
WIDE_FONTS = (
    "Noto Sans CJK JP", "Noto Sans CJK SC", "Noto Sans CJK KR", "Noto Sans JP", "Noto Sans SC", "Source Han Sans",
    "WenQuanYi Zen Hei", "WenQuanYi Micro Hei", "IPAGothic", "Droid Sans Fallback", "Microsoft YaHei", "Yu Gothic",
    "Malgun Gothic", "Hiragino Sans", "PingFang SC", "Arial Unicode MS", "Unifont",
)  # fmt: skip
"""Fonts that have Chinese, Japanese and Korean characters; those that are installed follow the usual font."""
MATHEMATICS = re.compile(r"\$[^$]*\$")
"""Text that Matplotlib takes as mathematics."""
POINTS_PER_INCH = 72
"""Points of an inch, as printers and Matplotlib count."""
TICK_LABEL_SIZE = 7.5
"""Size of the labels beside an axis, points: that of the style of all figures."""
NUMBER_COMMAND = r"\mathdefault"
"""The command that Matplotlib writes around numbers on an axis, such as powers of ten."""
NUMBERS = (ScalarFormatter, LogFormatter)
"""Formatters that write nothing but numbers along an axis."""
MEASURING_METHODS = ("_update_ticks", "_get_ticklabel_bboxes")
"""Private methods of Matplotlib that place and measure the numbers along an axis. Where a version of Matplotlib has not
these methods, figures are the same, and take longer."""


@cache
def font_families() -> tuple[str, ...]:
    """Return the fonts of figures that are installed, the usual one first."""
    installed = {entry.name for entry in fontManager.ttflist}
    return (USUAL_FONT, *(name for name in WIDE_FONTS if name in installed))


@cache
def _known_characters() -> frozenset[int]:
    """Return the codes of the characters that the installed fonts have."""
    paths = [fontManager.findfont(name) for name in font_families()]
    return frozenset(code for path in paths for code in get_font(path).get_charmap())


def drawable_text(text: str) -> str:
    """Return a text with the number of each character that no installed font has, such as U+6A5F, in its place."""
    return "".join(c if c.isspace() or ord(c) in _known_characters() else f"[U+{ord(c):04X}]" for c in text)


@cache
def _symbols() -> frozenset[str]:
    return frozenset(part for quantity in QUANTITIES.values() for part in MATHEMATICS.findall(quantity.symbol))


def is_mathematics(text: str) -> bool:
    """Return whether all text between dollar signs is a symbol of a quantity or a number, and not part of a name."""
    return all(part in _symbols() or NUMBER_COMMAND in part for part in MATHEMATICS.findall(text))


def width_of(labels: Iterable[str], size: float = TICK_LABEL_SIZE) -> float:
    """Return the width of the widest label, inches; the labels stand beside an axis."""
    font = FontProperties(family=[*font_families()], size=size)
    widths = (text_to_path.get_text_width_height_descent(drawable_text(label), font, False)[0] for label in labels)
    return float(max(widths, default=0.0)) / POINTS_PER_INCH


def _texts(artist: Artist) -> Iterator[Text]:
    """Give the texts within an artist, except for numbers along axes, which every font has."""
    if isinstance(artist, Text):
        yield artist
    if isinstance(artist, Axis) and isinstance(artist.get_major_formatter(), NUMBERS):
        parts: Sequence[Artist] = (artist.label, artist.offsetText)
    else:
        parts = artist.get_children()
    for part in parts:
        yield from _texts(part)


def make_drawable(figure: Figure) -> None:
    """Make all texts of a figure drawable: symbols of quantities are mathematics, names with dollar signs are not."""
    for axis in (axis for panel in figure.axes for axis in (panel.xaxis, panel.yaxis)):
        if isinstance(axis.get_major_locator(), FixedLocator):
            names = axis.get_major_formatter().format_ticks([*axis.get_majorticklocs()])  # also of ticks out of view
            if any(drawable_text(name) != name for name in names):
                axis.set_ticklabels([drawable_text(name) for name in names])
        if not isinstance(axis.get_major_formatter(), NUMBERS):
            axis.get_ticklabels()  # now they have texts, not only when drawn
    for text in _texts(figure):
        written = text.get_text()
        if not is_mathematics(written):
            text.set_parse_math(False)
        if not written.isascii():
            text.set_text(drawable_text(written))
            text.set_fontfamily([*font_families()])


def fix_layout(figure: Figure) -> None:
    """Lay out once, not again for each file format, and without drawing anything for it."""
    FigureCanvasAgg(figure)  # without it, each size of a text would be measured by a renderer of its own
    make_drawable(figure)
    if layout := figure.get_layout_engine():
        with _replaced_methods([(panel, "get_tightbbox", _CachedTightBox(panel).box) for panel in figure.axes]):
            layout.execute(figure)
    figure.set_layout_engine("none")
    for panel in figure.axes:
        panel.apply_aspect()


@contextmanager
def _replaced_methods(methods: Sequence[tuple[object, str, Callable[..., Any]]]) -> Iterator[None]:
    """Replace methods of single objects, each by its object and name, and give the old ones back at the end."""
    for owner, name, method in methods:
        setattr(owner, name, method)
    try:
        yield
    finally:
        for owner, name, _ in methods:
            delattr(owner, name)


def steady_ticks(panels: Sequence[Axes]) -> AbstractContextManager[None]:
    """Let Matplotlib place and measure the numbers along axes once, while nothing moves that they depend on.

    It would do so again for the edges, the labels and the axes themselves, four times for each picture. Within another
    such context it does nothing for axes that this one keeps steady already.
    """
    axes = [axis for panel in panels for axis in (panel.xaxis, panel.yaxis)]
    methods = [(axis, name) for axis in axes for name in MEASURING_METHODS if hasattr(axis, name)]
    changing = [(axis, name) for axis, name in methods if name not in vars(axis)]
    return _replaced_methods([(axis, name, _first_result(getattr(axis, name))) for axis, name in changing])


def _first_result(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function that computes at its first call, and returns that result at every later one.

    Later calls may have other arguments: within `steady_ticks` the results are the same.
    """
    results: list[Any] = []

    def first(*arguments: Any) -> Any:
        if not results:
            results.append(function(*arguments))
        return results[0]

    return first


class _CachedTightBox:
    """The box of a panel with its labels and numbers, measured again only where other numbers come along its axes.

    The layout asks for it three times, of which all but the first find the same labels around another place. Legends
    and texts need not move with the edges of their panel: where there are some, all is measured each time.
    """

    def __init__(self, panel: Axes) -> None:
        self._panel = panel
        self._measure: Any = panel.get_tightbbox
        self._has_own_texts = bool(panel.get_legend() or panel.texts or panel.artists or panel.child_axes)
        self._tick_places: tuple[bytes, ...] = ()
        self._overhang = np.zeros((2, 2))  # of labels over the panel, pixels, at its lower left and upper right

    def box(self, renderer: Any, **options: Any) -> Any:
        """Return the box of the panel with its labels, pixels; arguments are those of Matplotlib's `get_tightbbox`."""
        panel = self._panel
        if self._has_own_texts or not panel.get_visible():
            return self._measure(renderer, **options)
        locator: Any = panel.get_axes_locator()  # None where the figure has not placed the panel itself
        panel.apply_aspect(locator(panel, renderer) if locator else None)
        tick_places = tuple(np.asarray(axis.get_majorticklocs()).tobytes() for axis in (panel.xaxis, panel.yaxis))
        if tick_places != self._tick_places:
            with steady_ticks([panel]):
                self._overhang = self._measure(renderer, **options).get_points() - panel.bbox.get_points()
            self._tick_places = tick_places
        return Bbox(panel.bbox.get_points() + self._overhang)

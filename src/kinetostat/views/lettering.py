"""Texts of figures in fonts that have their characters; a character that no font has is shown by its number.

Matplotlib takes text between two dollar signs as mathematics. Here symbols of quantities stay mathematics, and names
from files do not become it.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cache

from matplotlib.artist import Artist
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, fontManager, get_font
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FixedLocator, LogFormatter, ScalarFormatter

from kinetostat.kinetostatics.quantities import QUANTITIES

USUAL_FONT = "DejaVu Sans"
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


@cache
def families() -> tuple[str, ...]:
    """Return the fonts of figures that are installed, the usual one first."""
    installed = {entry.name for entry in fontManager.ttflist}
    return (USUAL_FONT, *(name for name in WIDE_FONTS if name in installed))


@cache
def _known_characters() -> frozenset[int]:
    """Return the codes of the characters that the installed fonts have."""
    paths = [fontManager.findfont(name) for name in families()]
    return frozenset(code for path in paths for code in get_font(path).get_charmap())


def drawable(text: str) -> str:
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
    font = FontProperties(family=[*families()], size=size)
    widths = (text_to_path.get_text_width_height_descent(drawable(label), font, False)[0] for label in labels)
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


def letter(figure: Figure) -> None:
    """Make all texts of a figure drawable: symbols of quantities are mathematics, names with dollar signs are not."""
    for axis in (axis for panel in figure.axes for axis in (panel.xaxis, panel.yaxis)):
        if isinstance(axis.get_major_locator(), FixedLocator):
            names = axis.get_major_formatter().format_ticks([*axis.get_majorticklocs()])  # also of ticks out of view
            if any(drawable(name) != name for name in names):
                axis.set_ticklabels([drawable(name) for name in names])
        if not isinstance(axis.get_major_formatter(), NUMBERS):
            axis.get_ticklabels()  # now they have texts, not only when drawn
    for text in _texts(figure):
        written = text.get_text()
        if not is_mathematics(written):
            text.set_parse_math(False)
        if not written.isascii():
            text.set_text(drawable(written))
            text.set_fontfamily([*families()])

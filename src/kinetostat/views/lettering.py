"""Texts of figures in fonts that have their characters; a character that no font has is shown by its number."""

from functools import cache

from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager, get_font
from matplotlib.text import Text

USUAL = "DejaVu Sans"
WIDE = (
    "Noto Sans CJK JP", "Noto Sans CJK SC", "Noto Sans CJK KR", "Noto Sans JP", "Noto Sans SC", "Source Han Sans",
    "WenQuanYi Zen Hei", "WenQuanYi Micro Hei", "IPAGothic", "Droid Sans Fallback", "Microsoft YaHei", "Yu Gothic",
    "Malgun Gothic", "Hiragino Sans", "PingFang SC", "Arial Unicode MS", "Unifont",
)  # fmt: skip
"""Fonts that have Chinese, Japanese and Korean characters; those that are installed stand behind the usual font."""


@cache
def families() -> tuple[str, ...]:
    """Return the fonts of figures that are installed, the usual one first."""
    installed = {entry.name for entry in fontManager.ttflist}
    return (USUAL, *(name for name in WIDE if name in installed))


@cache
def _known() -> frozenset[int]:
    """The characters that the fonts have."""
    paths = [fontManager.findfont(name) for name in families()]
    return frozenset(code for path in paths for code in get_font(path).get_charmap())


def drawable(text: str) -> str:
    """Return a text with the number of each character that no installed font has, such as U+6A5F, in its place."""
    return "".join(c if c.isspace() or ord(c) in _known() else f"[U+{ord(c):04X}]" for c in text)


def letter(figure: Figure) -> None:
    """Make all texts of a figure drawable; symbols of quantities, which are mathematics, stay as they are."""
    for text in figure.findobj(Text):
        written = text.get_text()
        if not written.isascii():
            text.set_text(drawable(written))
            text.set_fontfamily([*families()])

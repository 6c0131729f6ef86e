"""The frame, the style and the tables of all HTML pages. Texts are escaped here; HTML itself is a `Markup`."""

import re
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path


class Markup(str):
    """A text that is HTML, not to be escaped."""

    __slots__ = ()


_OPTION = re.compile(r"(?<![\w-])--[a-z-]+")
_NAME = re.compile(r"(?<=[a-z])([._])(?=[a-z])")
STYLE = Path(__file__).with_name("page.css").read_text("utf-8")
"""Style of every page: light and dark, screen and paper."""


def whole_page(title: str, style: str, body: Iterable[str]) -> str:
    """Return a self-contained page.

    Args:
        title: title of the window.
        style: CSS that follows `STYLE`.
        body: elements in order, HTML.
    """
    head = (
        '<!doctype html>\n<html lang="en-GB">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{STYLE}{style}</style>\n</head>\n"
    )
    return f"{head}<body>\n" + "\n".join(body) + "\n</body>\n</html>\n"


def table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], numeric: Sequence[bool]) -> str:
    """Write a table, in a box that scrolls if the table is too wide.

    Args:
        caption: text above the table; none if empty.
        heads: heads of the columns; if all are empty, there is no row of heads.
        rows: cells as text, or as HTML in a `Markup`.
        numeric: whether each column holds numbers, which are aligned to the right.
    """
    above = f"<caption>{as_markup(caption)}</caption>" if caption else ""
    top = f"<thead>{_row('th', heads, numeric)}</thead>" if any(heads) else ""
    body = "".join(_row("td", row, numeric) for row in rows)
    return f'<div class="scroll"><table>{above}{top}<tbody>{body}</tbody></table></div>'


def _row(tag: str, cells: Sequence[str], numeric: Sequence[bool]) -> str:
    kinds = (' class="n"' if number else "" for number in numeric)
    written = (as_markup(cell) if i or tag == "th" else breakable(cell) for i, cell in enumerate(cells))
    return f"<tr>{''.join(f'<{tag}{kind}>{cell}</{tag}>' for cell, kind in zip(written, kinds, strict=True))}</tr>"


def breakable(text: str) -> str:
    """Return a text as HTML whose names may be broken after dots and underscores, such as "geometry.base_radius"."""
    return text if isinstance(text, Markup) else _NAME.sub(r"\1<wbr>", escape(text))


def figure(picture: str, caption: str) -> str:
    """Return a picture (an HTML element) with its caption."""
    return f"<figure>{picture}<figcaption>{as_markup(caption)}</figcaption></figure>"


def as_markup(text: str) -> str:
    """Return a text as HTML, in which no line ends within a word of the command line, such as "--loaded"."""
    return text if isinstance(text, Markup) else _OPTION.sub(r'<span class="option">\g<0></span>', escape(text))

"""What all pages share: their frame, their look, tables. Texts are escaped here; what is HTML already is a `Markup`."""

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path


class Markup(str):
    """A text that is HTML, not to be escaped."""

    __slots__ = ()


STYLE = Path(__file__).with_name("page.css").read_text("utf-8")
"""Of every page: light and dark, screen and paper."""


def whole_page(title: str, style: str, body: Iterable[str]) -> str:
    """A self-contained page.

    Args:
        title: of the window.
        style: CSS after `STYLE`.
        body: elements in order, HTML.
    """
    head = (
        '<!doctype html>\n<html lang="en-GB">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{STYLE}{style}</style>\n</head>\n"
    )
    return f"{head}<body>\n" + "\n".join(body) + "\n</body>\n</html>\n"


def table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], numeric: Sequence[bool]) -> str:
    """A table that scrolls by itself where it is too wide; `numeric` says which columns hold numbers."""
    kinds = [' class="n"' if number else "" for number in numeric]
    top = "".join(f"<th{kind}>{marked(head)}</th>" for head, kind in zip(heads, kinds, strict=True))
    lines = ("".join(f"<td{kind}>{marked(cell)}</td>" for cell, kind in zip(row, kinds, strict=True)) for row in rows)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return (
        f'<div class="scroll"><table><caption>{marked(caption)}</caption><thead><tr>{top}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def figure(picture: str, caption: str) -> str:
    """A picture (an HTML element) with its caption."""
    return f"<figure>{picture}<figcaption>{marked(caption)}</figcaption></figure>"


def marked(text: str) -> str:
    """A text as HTML."""
    return text if isinstance(text, Markup) else escape(text)

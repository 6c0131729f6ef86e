"""Tables and bars as HTML text; whatever comes from a file is escaped here."""

import math
from collections.abc import Sequence
from html import escape

BAR_CLASSES = ("", "negative")
LEAST_GAIN = 1e-3
"""Logarithm of a gain that is worth a whole bar where none is greater."""


def table(caption: str, head: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "") -> str:
    """A table whose first column names the rows; `caption` is read aloud, not shown."""
    top = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    body = "".join(
        f'<tr><th scope="row">{escape(first)}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in rest)}</tr>'
        for first, *rest in rows
    )
    shown = f"<thead><tr>{top}</tr></thead>" if any(head) else ""
    return f'<table class="figures {kind}"><caption>{escape(caption)}</caption>{shown}<tbody>{body}</tbody></table>'


def bars(caption: str, rows: Sequence[tuple[str, float, str]]) -> str:
    """Horizontal bars: name, share of the longest (negative ones in another colour), and text."""
    if not rows:
        return paragraph("Nothing to show here.")
    items = "".join(
        f'<li><span class="bar-name" title="{escape(name)}">{escape(name)}</span>'
        f'<span class="bar-track"><span class="bar-fill {BAR_CLASSES[share < 0]}" '
        f'style="width:{100 * min(abs(share), 1.0):.2f}%"></span></span>'
        f'<span class="bar-value">{escape(text)}</span></li>'
        for name, share, text in rows
    )
    return f'<ol class="bars" aria-label="{escape(caption)}">{items}</ol>'


def gains(caption: str, rows: Sequence[tuple[str, float]]) -> str:
    """How many times better something has become, as bars of its logarithm; worse ones in another colour."""
    sizes = {name: math.log(gain) if 0.0 < gain < math.inf else 0.0 for name, gain in rows}
    longest = max([LEAST_GAIN, *map(abs, sizes.values())])
    return bars(caption, [(name, sizes[name] / longest, f"× {gain:.4g}") for name, gain in rows])


def heading(text: str) -> str:
    """A heading within a panel."""
    return f"<h3>{escape(text)}</h3>"


def paragraph(text: str, kind: str = "note") -> str:
    """A sentence."""
    return f'<p class="{kind}">{escape(text)}</p>'

"""Machines and answers in a notebook: the terminal's tables as HTML, with a picture. Nothing is computed here.

Texts have the page's own colour; those of verdicts are readable on light and dark ground, and figures keep a white one.
Nothing is fetched from elsewhere.
"""

import base64
import io
from html import escape
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console
from rich.padding import Padding
from rich.style import Style
from rich.table import Table
from rich.text import Text

from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.views.answers import kind_of
from kinetostat.views.page import Markup, table
from kinetostat.views.picture import machine_picture

LINE_LENGTH = 200
"""Greatest number of characters in a line: a notebook scrolls, and no table is folded."""
PICTURE_PIXELS = (640, 480)
"""Pixels of a picture, which is shown at half this size to be sharp."""
PIXELS_PER_INCH = 110
"""Resolution of a figure."""
CSS = """
.kinetostat{font-size:13px;line-height:1.45;max-width:72em;display:flow-root}
.kinetostat p{margin:.2em 0}
.kinetostat .dim{opacity:.65}
.kinetostat .good{color:#1a9a50}.kinetostat .bad{color:#e0506a}.kinetostat .warn{color:#c98a1b}
.kinetostat .scroll{overflow-x:auto}
.kinetostat table{font-size:inherit;border-collapse:collapse;border:0;margin:.9em 0 .6em}
.kinetostat table{font-variant-numeric:tabular-nums}
.kinetostat caption{caption-side:top;text-align:left;font-weight:600;padding:0 0 .3em;color:inherit;white-space:nowrap}
.kinetostat tr,.kinetostat tbody tr:nth-child(odd),.kinetostat tbody tr:hover{background:none}
.kinetostat th,.kinetostat td{padding:.16em .9em .16em 0;text-align:left;border:0;color:inherit;vertical-align:top}
.kinetostat .n{text-align:right;white-space:nowrap;padding-left:.6em}
.kinetostat th{font-weight:600;opacity:.75;border-bottom:1px solid rgba(128,128,128,.45)}
.kinetostat td{border-bottom:1px solid rgba(128,128,128,.14)}
.kinetostat img{display:block;max-width:100%;height:auto;margin:.4em 0}
.kinetostat img.aside{float:right;margin:0 0 1em 2em}
.kinetostat img.figure{background:#fff;border-radius:6px;padding:4px}
.kinetostat summary{cursor:pointer;opacity:.75;margin:.4em 0}
""".strip()
"""Style of the pieces. Notebooks give stripes to tables, and a ground to the row under the pointer: the rule on `tr`
takes both away."""
CLASSES = {"green": "good", "red": "bad", "yellow": "warn"}
"""Classes of the style sheet by the terminal's colours."""
_PLAIN = Console(file=io.StringIO(), width=LINE_LENGTH)


def html_of(answer: object) -> str:
    """Return a machine or an answer as a piece of HTML: its picture, if it has one, and the tables of the terminal."""
    console = _HtmlConsole()
    kind_of(answer).print_to(console, answer)
    tables = "".join(console.parts)
    if isinstance(answer, Machine):
        heading = f"<p><b>{escape(answer.name)}</b> <span class='dim'>{escape(answer.family.summary)}</span></p>"
        tables = f"{heading}{_picture(answer)}<details><summary>all fields</summary>{tables}</details>"
    elif isinstance(answer, Analysis):
        tables = _picture(answer.machine, "aside") + tables
    else:
        tables += _figures(answer)
    return f'<div class="kinetostat"><style>{CSS}</style>{tables}</div>'


def png_of(figure: Figure) -> bytes:
    """Return a figure as a PNG."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=PIXELS_PER_INCH, metadata={"Software": None})
    return stream.getvalue()


def _figures(answer: object) -> str:
    figures = kind_of(answer).figures(answer)
    return "".join(_image(png_of(draw()), name, "figure") for name, draw in figures.items())


def _picture(machine: Machine, kind: str = "machine") -> str:
    """Return a picture of the machine, or a sentence that says why it cannot be drawn."""
    try:
        data = machine_picture(machine, PICTURE_PIXELS, transparent=True)
    except InputError as error:
        return f"<p class='dim'>{escape(str(error))}</p>"
    return _image(data, machine.name, kind, PICTURE_PIXELS[0] // 2)


def _image(data: bytes, text: str, kind: str, width: int | None = None) -> str:
    source = "data:image/png;base64," + base64.b64encode(data).decode()
    size = f' width="{width}"' if width else ""
    return f'<img class="{kind}" alt="{escape(text)}"{size} src="{source}">'


class _HtmlConsole(Console):
    """A console that keeps what is printed as parts of HTML: a paragraph for a line, and a table for a table."""

    def __init__(self) -> None:
        super().__init__(file=io.StringIO(), width=LINE_LENGTH)
        self.parts: list[str] = []
        self._line = ""

    def print(self, *objects: Any, end: str = "\n", style: str | Style | None = None, **_: Any) -> None:
        """Keep what `Console` would print; texts without `end` are parts of the line that follows.

        A page has its own layout: other arguments (`justify`, `overflow`, ...) are ignored, and blank lines left out.
        """
        for printed in objects:
            content = printed.renderable if isinstance(printed, Padding) else printed
            if isinstance(content, Table):
                self.parts.append(_table(content))
            else:
                self._line += _html_with_style(_text(content), style)
        if end == "\n":
            self.parts += [f"<p>{line}</p>" for line in self._line.split("\n") if line.strip()]
            self._line = ""


def _text(content: object) -> Text:
    return content if isinstance(content, Text) else Text(str(content))


def _html_with_style(text: Text, style: str | Style | None = None) -> str:
    """Return a text as HTML: each part in its own style, and all of it in a further one."""
    parts = [_styled_html(escape(part.text), part.style) for part in text.render(_PLAIN)]
    return _styled_html("".join(parts), Style.parse(style) if isinstance(style, str) else style)


def _styled_html(content: str, style: Style | None) -> str:
    """Return HTML in the colour, weight and dimness of a style, whose other properties are not shown."""
    if style is None or not content:
        return content
    colour = [CLASSES[style.color.name]] if style.color and style.color.name in CLASSES else []
    classes = " ".join([*colour, *(["dim"] if style.dim else [])])
    content = f"<b>{content}</b>" if style.bold else content
    return f'<span class="{classes}">{content}</span>' if classes else content


def _table(terminal: Table) -> str:
    """Return a table of the terminal as a table of HTML."""
    texts = zip(*(column.cells for column in terminal.columns), strict=True)
    rows = [[_markup(cell, row.style) for cell in cells] for row, cells in zip(terminal.rows, texts, strict=True)]
    caption = _markup(terminal.title) if terminal.title else ""
    heads = [_markup(column.header) for column in terminal.columns]
    return table(caption, heads, rows, [column.justify == "right" for column in terminal.columns])


def _markup(content: object, style: str | Style | None = None) -> Markup:
    return Markup(_html_with_style(_text(content), style).replace("\n", "<br>"))

"""A report as one self-contained HTML page: pictures, data and the renderer are inside it, and it needs no server.

The content comes from `content.Report`; only its form is decided here.
"""

import json
from base64 import b64encode
from html import escape
from itertools import count
from pathlib import Path

from kinetostat.views.page import Markup, as_markup, whole_page
from kinetostat.views.page import table as plain_table
from kinetostat.views.report.content import (
    Block,
    Bullets,
    Figure,
    Formula,
    InnerPage,
    Listing,
    Paragraph,
    Report,
    Section,
    Table,
)
from kinetostat.views.report.pictures import live_html

REPORT_STYLE = Path(__file__).with_name("report.css").read_text("utf-8")
MEDIA_TYPES = {"json": "application/json", "toml": "text/plain"}
"""Media types of attachments, by the ending of their name."""


def html_page(report: Report) -> str:
    """Write a report as an HTML page."""
    return whole_page(f"{report.title}: {report.kind.lower()}", REPORT_STYLE, _Writer(report).body())


class _Writer:
    """Writer of the blocks, in order, which numbers figures, tables and formulas."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._figures, self._tables, self._formulas = count(1), count(1), count(1)
        self._live = ""

    def body(self) -> list[str]:
        """Return all elements of the page."""
        report = self._report
        facts = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in report.facts)
        head = (
            f'<header><p class="kind">{escape(report.kind)}</p><h1>{escape(report.title)}</h1>'
            f'<dl class="facts">{facts}</dl></header>'
        )
        main = "\n".join(self._section(section, f"{n}") for n, section in enumerate(report.sections, 1))
        attached = [_attachment(name, text) for name, text in report.attachments.items()]
        return [head, self._contents(), f"<main>\n{main}\n</main>", *attached, self._live]

    def _contents(self) -> str:
        entries = "".join(
            f'<li><a href="#s{n}">{escape(section.title)}</a></li>'
            for n, section in enumerate(self._report.sections, 1)
        )
        return f'<nav aria-label="contents"><ol>{entries}</ol></nav>'

    def _section(self, section: Section, number: str) -> str:
        level = 2 + number.count(".")
        inner, parts = count(1), []
        for block in section.blocks:
            if isinstance(block, Section):
                parts.append(self._section(block, f"{number}.{next(inner)}"))
            else:
                parts.append(self._block(block))
        title = f'<h{level}><span class="number">{number}</span> {escape(section.title)}</h{level}>'
        return f'<section id="s{number}">{title}\n' + "\n".join(parts) + "\n</section>"

    def _block(self, block: Block) -> str:
        match block:
            case Paragraph(text, lead):
                return f"<p>{f'<b>{escape(lead)}</b> ' if lead else ''}{as_markup(text)}</p>"
            case Bullets(items):
                return f"<ul>{''.join(_point(text, aside) for text, aside in items)}</ul>"
            case Table():
                return self._table(block)
            case Figure():
                return self._figure(block)
            case Formula(mathml):
                shown = f'<math display="block">{mathml}</math>'
                return f'<p class="formula">{shown}<span>({next(self._formulas)})</span></p>'
            case Listing(caption, text):
                return f'<p class="listing">{escape(caption)}</p><pre>{escape(text.rstrip())}</pre>'
            case InnerPage(title, text):
                return (
                    f'<iframe class="machine" title="{escape(title)}" loading="lazy" srcdoc="{escape(text)}"></iframe>'
                )
        raise TypeError(f"a page cannot show {type(block).__name__}")

    def _table(self, block: Table) -> str:
        caption = Markup(f"<b>Table {next(self._tables)}.</b> {escape(block.caption)}")
        written = plain_table(caption, block.heads, block.rows, block.numeric)
        wide = " wide" if block.split or sum(block.numeric) > 2 else ""
        return f'<div class="table{wide} split-{block.split}">{written}</div>'

    def _figure(self, block: Figure) -> str:
        picture = block.picture if isinstance(block.picture, str) else _png(block.picture, block.caption)
        stage = ""
        if block.live is not None:
            self._live = live_html(block.live)
            stage = f'<div id="live" data-label="{escape(block.caption)} Drag, or use arrow keys, to turn it."></div>'
        caption = f"<b>Figure {next(self._figures)}.</b> {escape(block.caption)}"
        style = f"max-width:{100 * block.width:g}%;--share:{block.width:g}"
        still = f'<div class="still" style="{style}">{picture}</div>'
        return f"<figure>{stage}{still}<figcaption>{caption}</figcaption></figure>"


def _point(text: str, aside: str) -> str:
    softer = f' <span class="soft">({escape(aside)})</span>' if aside else ""
    return f"<li>{as_markup(text)}{softer}</li>"


def _png(picture: bytes, caption: str) -> str:
    return f'<img alt="{escape(caption)}" src="data:image/png;base64,{b64encode(picture).decode()}">'


def _attachment(name: str, text: str) -> str:
    """Return a text inside the page as JSON, with "<" written as an escape, so that no text ends the script element."""
    kind = MEDIA_TYPES[name.rpartition(".")[2]]
    data = text if kind == MEDIA_TYPES["json"] else json.dumps(text, ensure_ascii=False)
    return f'<script type="{kind}" id="{escape(name)}">{data.replace("<", chr(92) + "u003c")}</script>'

"""The two writers of a report: one self-contained HTML page, or one PDF. The content is that of `content.Report`.

A page has pictures, data and the renderer of scenes inside it, and needs no server. A PDF is laid out by a Typst
template, which reads the content as JSON, so that no text of a name or a file is taken for a command.
"""

import gzip
import json
import struct
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import asdict
from html import escape
from importlib import import_module
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any

import matplotlib as mpl

from kinetostat.spec.errors import InputError
from kinetostat.spec.installation import extra_command
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
from kinetostat.views.scene import renderer_modules
from kinetostat.views.scene.solids import looks_data

REPORT_STYLE = Path(__file__).with_name("report.css").read_text("utf-8")
LIVE_SCRIPT = Path(__file__).with_name("live.js")
"""Script of a page that unpacks the renderer and the scene."""
MEDIA_TYPES = {"json": "application/json", "toml": "text/plain"}
"""Media types of attachments, by the ending of their name."""
TEMPLATE = Path(__file__).with_name("report.typ")
INSTALL_TYPST = "A PDF needs Typst; install it with `{}`, or write an HTML page: -o report.html."
FIRST_SYSTEM_CHARACTER = "\u2e80"
"""From this character on, a text may need the fonts of the system. Without such characters the system's fonts are
ignored, so that the bytes are the same on every computer."""


def html_page(report: Report) -> str:
    """Write a report as an HTML page."""
    return whole_page(f"{report.title}: {report.kind.lower()}", REPORT_STYLE, _PageWriter(report).body())


class _PageWriter:
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
            self._live = _live_html(block.live)
            stage = f'<div id="live" data-label="{escape(block.caption)} Drag, or use arrow keys, to turn it."></div>'
        caption = f"<b>Figure {next(self._figures)}.</b> {escape(block.caption)}"
        style = f"max-width:{100 * block.width:g}%;--share:{block.width:g}"
        picture_box = f'<div class="still" style="{style}">{picture}</div>'
        return f"<figure>{stage}{picture_box}<figcaption>{caption}</figcaption></figure>"


def _point(text: str, remark: str) -> str:
    softer = f' <span class="soft">({escape(remark)})</span>' if remark else ""
    return f"<li>{as_markup(text)}{softer}</li>"


def _png(picture: bytes, caption: str) -> str:
    return f'<img alt="{escape(caption)}" src="data:image/png;base64,{b64encode(picture).decode()}">'


def _attachment(name: str, text: str) -> str:
    """Return a text inside the page as JSON, with "<" written as an escape, so that no text ends the script element."""
    kind = MEDIA_TYPES[name.rpartition(".")[2]]
    data = text if kind == MEDIA_TYPES["json"] else json.dumps(text, ensure_ascii=False)
    return f'<script type="{kind}" id="{escape(name)}">{data.replace("<", chr(92) + "u003c")}</script>'


def _live_html(scene: Mapping[str, Any]) -> str:
    """Return elements that unpack the renderer and show a scene in the element "live"; none without libraries.

    Renderer and scene are compressed together, without a time stamp: the same scene gives the same bytes.
    """
    modules = renderer_modules()
    if modules is None:
        return ""
    content = {"modules": modules, "looks": looks_data(), **scene}
    data = json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode()
    packed = b64encode(gzip.compress(data, 9, mtime=0)).decode()
    script = LIVE_SCRIPT.read_text("utf-8")
    return f'<script type="text/plain" id="live-data">{packed}</script>\n<script>\n{script}</script>'


def check_typst() -> None:
    """Check that Typst is installed.

    Raises:
        InputError: it is not; the message says how to install it.
    """
    if find_spec("typst") is None:
        raise InputError(INSTALL_TYPST.format(extra_command("report")))


def pdf_bytes(report: Report) -> bytes:
    """Write a report as a PDF; the same report gives the same bytes.

    Raises:
        InputError: Typst is not installed.
    """
    return bytes(_compile(report, format="pdf"))


def page_pictures(report: Report, dots: float) -> list[bytes]:
    """Draw every page as a PNG, with so many dots to an inch.

    Raises:
        InputError: Typst is not installed.
    """
    return list(_compile(report, format="png", ppi=dots))


def _compile(report: Report, **form: Any) -> Any:
    check_typst()
    compiler: Any = import_module("typst")

    files: dict[str, bytes] = {}
    content = {
        "kind": report.kind,
        "title": report.title,
        "facts": report.facts,
        "sections": [_section_data(section, files) for section in report.sections],
        "attachments": dict(report.attachments),
    }
    text = json.dumps(content, ensure_ascii=False)
    sources: dict[str, Any] = {"main": TEMPLATE.read_bytes(), "report.json": text.encode(), **files}
    fonts = [str(Path(mpl.get_data_path()) / "fonts" / "ttf")]
    plain = max(text) < FIRST_SYSTEM_CHARACTER
    return compiler.compile(sources, font_paths=fonts, ignore_system_fonts=plain, **form)


def _section_data(section: Section, files: dict[str, bytes]) -> dict[str, Any]:
    return {
        "kind": "section",
        "title": section.title,
        "blocks": [_block_data(block, files) for block in section.blocks],
    }


def _block_data(block: Block, files: dict[str, bytes]) -> dict[str, Any]:
    match block:
        case Section():
            return _section_data(block, files)
        case Figure(caption, picture, width):
            name = f"figure-{len(files) + 1}.svg"
            files[name] = (picture if isinstance(picture, str) else _svg_around(picture)).encode()
            return {"kind": "figure", "caption": caption, "file": name, "width": width}
        case Formula(_, typst):
            return {"kind": "formula", "typst": typst}
    return {"kind": type(block).__name__.lower(), **asdict(block)}


def _svg_around(png: bytes) -> str:
    """Return a PNG inside an SVG element, because the files handed to Typst must be text."""
    width, height = struct.unpack(">II", png[16:24])
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}">'
    data = b64encode(png).decode()
    return f'{head}<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/></svg>'

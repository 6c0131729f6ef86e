"""A report as a PDF: its content as data, and a Typst template that lays it out.

Typst reads the content as JSON, so that no text of a name or a file is taken for a command.
"""

import json
import struct
from base64 import b64encode
from dataclasses import asdict
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import matplotlib as mpl

from kinetostat.spec.errors import InputError
from kinetostat.spec.installation import extra_command
from kinetostat.views.report.content import Block, Figure, Formula, Report, Section

TEMPLATE = Path(__file__).with_name("report.typ")
INSTALL_TYPST = "A PDF needs Typst; install it with `{}`, or write an HTML page: -o report.html."
FIRST_SYSTEM_CHARACTER = "\u2e80"
"""From this character on, a text may need the fonts of the system. Without such characters the system's fonts are
ignored, so that the bytes are the same on every computer."""


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
        "sections": [_section(section, files) for section in report.sections],
        "attachments": dict(report.attachments),
    }
    text = json.dumps(content, ensure_ascii=False)
    sources: dict[str, Any] = {"main": TEMPLATE.read_bytes(), "report.json": text.encode(), **files}
    fonts = [str(Path(mpl.get_data_path()) / "fonts" / "ttf")]
    plain = max(text) < FIRST_SYSTEM_CHARACTER
    return compiler.compile(sources, font_paths=fonts, ignore_system_fonts=plain, **form)


def _section(section: Section, files: dict[str, bytes]) -> dict[str, Any]:
    return {"kind": "section", "title": section.title, "blocks": [_block(block, files) for block in section.blocks]}


def _block(block: Block, files: dict[str, bytes]) -> dict[str, Any]:
    match block:
        case Section():
            return _section(block, files)
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

"""Equations as MathML, which browsers draw by themselves: no script and no font is fetched."""

import re
from html import escape

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

BRACKET = re.compile(r"<mo>(&#x0005B;)</mo>(?=<mtable>)|(?<=</mtable>)<mo>(&#x0005D;)</mo>")
"""Beside a matrix, which it is as high as."""
NUMBER = re.compile(r"\\tag\{(.+?)\}")


def add_renderer(app: Sphinx) -> None:
    """Offer the renderer under the name "mathml"."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))


def inline(writer: nodes.NodeVisitor, node: nodes.Element) -> None:
    """A formula within a line."""
    writer.body.append(drawn(node.astext()))  # type: ignore[attr-defined]
    raise nodes.SkipNode


def display(writer: nodes.NodeVisitor, node: nodes.Element) -> None:
    """An equation of its own, with the number that `\\tag` gives it and an anchor of that number."""
    text = node.astext()
    number = NUMBER.search(text)
    body = drawn(NUMBER.sub("", text).strip(), "block")
    anchor = f"eq-{escape(number[1])}" if number else ""
    label = f'<a class="eqno" id="{anchor}" href="#{anchor}">({escape(number[1])})</a>' if number else ""
    writer.body.append(f'<div class="equation">{body}{label}</div>\n')  # type: ignore[attr-defined]
    raise nodes.SkipNode


def drawn(text: str, display: str = "inline") -> str:
    """LaTeX as MathML."""
    return BRACKET.sub(r'<mo stretchy="true" fence="true">\1\2</mo>', convert(text, display=display))

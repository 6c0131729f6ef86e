"""Equations as MathML, which browsers draw by themselves: no script and no font is fetched."""

import re
from html import escape

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

NUMBER = re.compile(r"\\tag\{(.+?)\}")


def add_renderer(app: Sphinx) -> None:
    """Offer the renderer under the name "mathml"."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))


def inline(writer: nodes.NodeVisitor, node: nodes.Element) -> None:
    """A formula within a line."""
    writer.body.append(convert(node.astext()))  # type: ignore[attr-defined]
    raise nodes.SkipNode


def display(writer: nodes.NodeVisitor, node: nodes.Element) -> None:
    """An equation of its own, with the number that `\\tag` gives it and an anchor of that number."""
    text = node.astext()
    number = NUMBER.search(text)
    body = convert(NUMBER.sub("", text).strip(), display="block")
    label = f'<a class="eqno" id="eq-{escape(number[1])}" href="#eq-{escape(number[1])}">({escape(number[1])})</a>' if number else ""
    writer.body.append(f'<div class="equation">{body}{label}</div>\n')  # type: ignore[attr-defined]
    raise nodes.SkipNode

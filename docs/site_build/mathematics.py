"""Equations as MathML, which browsers draw by themselves: no script and no font is fetched."""

import re
from html import escape
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

PRIME = "<mo>&#x02032;</mo>"
REPAIRS = (
    # Brackets beside a matrix are as high as it.
    (r"<mo>(&#x0005B;)</mo>(?=<mtable>)", r'<mo stretchy="true" fence="true">\1</mo>'),
    (r"(?<=</mtable>)<mo>(&#x0005D;)</mo>", r'<mo stretchy="true" fence="true">\1</mo>'),
    # Slashes, bars of norms and names of functions stand close.
    (r"<mo[^>]*>(&#x0002F;|&#x0007C;|&#x02016;)</mo>", r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>'),
    (r'<mo movablelimits="true">', r'<mo lspace="0" rspace="0">'),
    # Infinity is a number, not an operator.
    (r"<mo>(&#x0221E;)</mo>", r"<mi>\1</mi>"),
    # The sign of a prime is raised by itself: as a superscript it would be raised twice.
    (r"<msup>(<mi>\w</mi>)<mi>&#x02032;</mi></msup>", rf"<mrow>\1{PRIME}</mrow>"),
    (r"<msubsup>(<mi>\w</mi>)(<mi>\w</mi>)<mi>&#x02032;</mi></msubsup>", rf"<msub><mrow>\1{PRIME}</mrow>\2</msub>"),
)
"""What the converter writes, and what browsers draw as it is meant."""
BESIDE = re.compile(r'(\(?)(<math [^>]*display="inline">(?:(?!</math>).)*</math>)([).,:;]*)', re.DOTALL)
"""A formula within a line, with a bracket and punctuation that touch it."""
NUMBER = re.compile(r"\\tag\{(.+?)\}")


def add_renderer(app: Sphinx) -> None:
    """Offer the renderer under the name "mathml"."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    app.connect("html-page-context", keep_together)


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
    found = convert(text, display=display)
    for written, meant in REPAIRS:
        found = re.sub(written, meant, found)
    return found


def keep_together(_app: Sphinx, _page: str, _template: str, context: dict[str, Any], _tree: nodes.document) -> None:
    """No line breaks between a formula and the bracket or punctuation that touches it."""
    if "body" in context:
        context["body"] = BESIDE.sub(_unbroken, context["body"])


def _unbroken(found: re.Match[str]) -> str:
    return f'<span class="formula">{found[0]}</span>' if found[1] or found[3] else found[0]

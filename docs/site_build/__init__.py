"""What the site has beside its pages: parts that are generated, maths as MathML, one order of pages. No prose."""

import re
from collections.abc import Callable
from pathlib import Path

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx
from sphinx.errors import SphinxError

from site_build import gallery, mathematics, navigation, reference, verification

GENERATED: dict[str, Callable[[Path], str]] = {
    "contents": navigation.contents,
    "changelog": navigation.changelog,
    "gallery": gallery.gallery,
    "api": reference.reference,
    "printed": verification.printed_beside_computed,
    "equations": verification.equations,
    "statements": verification.statements,
    "closed forms": verification.closed_forms,
    "published": verification.published_elsewhere,
    "routes": verification.second_routes,
    "engine": verification.engine,
}
"""What `<!-- generated: NAME -->` in a page stands for; each is told the folder for pictures."""
MARK = re.compile(r"^<!-- generated: (.+) -->$", re.MULTILINE)
MEASURED = re.compile(r"^\[.+\]\((measured/.+\.md)\)$", re.MULTILINE)
"""A line that is only a link to what a benchmark has written: the site shows it in its place."""
ELSEWHERE = re.compile(r"<(?:script|link|img|iframe)\b[^>]*\b(?:src|href)=\"(?:https?:)?//[^>]*>")


def fill(app: Sphinx, _page: str, source: list[str]) -> None:
    """Put what is generated and what was measured into a page as it is read."""
    root = Path(app.srcdir)
    text = MEASURED.sub(lambda found: (root / found[1]).read_text("utf-8").rstrip(), source[0])
    source[0] = MARK.sub(lambda found: GENERATED[found[1]](root), text)


def check_alone(app: Sphinx, error: Exception | None) -> None:
    """Refuse a site that would fetch anything from elsewhere."""
    if error is not None or app.builder.name != "html":
        return
    for page in Path(app.outdir).rglob("*.html"):
        if found := ELSEWHERE.search(page.read_text("utf-8")):
            raise SphinxError(f"{page.name} fetches from elsewhere: {found[0]}")


def setup(app: Sphinx) -> dict[str, bool]:
    """Make Sphinx know all of it."""
    mathematics.add_renderer(app)
    app.add_lexer("csv", TextLexer)
    app.connect("source-read", fill)
    app.connect("autodoc-process-docstring", reference.as_markup)
    app.connect("autodoc-process-signature", reference.without_signature)
    app.connect("build-finished", gallery.write_pages)
    app.connect("build-finished", check_alone)
    return {"parallel_read_safe": False}

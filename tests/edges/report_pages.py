"""Reports for tests: made by the command, drawn as far as a test looks at them, and read back from their pages."""

import io
import json
import re
from html.parser import HTMLParser

from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from PIL import Image

from kinetostat.cli import main
from kinetostat.views.rendering import light
from kinetostat.views.report import summary

MACHINE = "zhang-gosselin-4dof"
QUICK = [word for part in ("guidelines", "sensitivity", "validation") for word in ("--without", part)]
"""What leaves out all that takes time but maps."""
RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")


def reported(path, subject, *words):
    """The text of a page that the command has written, or the bytes of a PDF."""
    assert main(["report", str(subject), "-o", str(path), *words]) == 0
    return path.read_text("utf-8") if path.suffix == ".html" else path.read_bytes()


def small_pictures(patch):
    """Draw the machine small and by few lamps, because that is what takes longest."""
    patch.setattr(summary, "PICTURE_SIZE", (160, 112))
    few_lamps(patch)


def few_lamps(patch):
    """Light pictures by few lamps, each of which draws the whole machine; `test_picture` looks at light and shadow."""
    patch.setattr(light, "SUNS", 1)
    patch.setattr(light, "SKIES", 3)


def no_pictures(patch):
    """Draw no machine at all."""
    blank = io.BytesIO()
    Image.new("RGB", (8, 6)).save(blank, "png")
    patch.setattr(summary, "picture", lambda *_: blank.getvalue())


def no_layout(patch):
    """Leave the parts of figures where they are first put: `test_files_and_figures` looks at the places of texts."""
    patch.setattr(ConstrainedLayoutEngine, "execute", lambda *_: None)


def no_drawing(patch):
    """Leave all figures blank, where a test asks for their files at most."""
    no_layout(patch)
    patch.setattr(Figure, "draw", lambda *_: None)


class Page(HTMLParser):
    """A page as a program sees it: texts, tables by caption, addresses, and what is attached to it."""

    def __init__(self, text):
        super().__init__()
        self.words, self.tables, self.addresses, self.attached, self.tags = [], {}, [], {}, []
        self._script, self._rows, self._cell, self._caption = "", [], None, None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        held = dict(attributes)
        self.tags.append(tag)
        self.addresses += [held[key] for key in ("src", "href", "xlink:href", "data", "action") if key in held]
        self._script = held.get("id", "?") if tag in ("script", "style") else ""
        if tag == "table":
            self._rows = []
        elif tag == "tr":
            self._rows.append([])
        elif tag in ("td", "th"):
            self._cell = ""
        elif tag == "caption":
            self._caption = ""

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self._rows[-1].append(self._cell)
            self._cell = None
        elif tag == "caption":
            self._named, self._caption = self._caption, None
        elif tag == "table":
            self.tables[re.sub(r"^Table \d+\. ", "", self._named)] = self._rows
        elif tag in ("script", "style"):
            self._script = ""

    def handle_data(self, data):
        if self._script:
            self.attached[self._script] = self.attached.get(self._script, "") + data
            return
        self.words.append(data)
        if self._cell is not None:
            self._cell += data
        if self._caption is not None:
            self._caption += data

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())

    @property
    def results(self):
        return json.loads(self.attached["results.json"])

    def table(self, start):
        """The rows of the table whose caption starts so, its heads first."""
        (found,) = (rows for caption, rows in self.tables.items() if caption.startswith(start))
        return found


def number(text):
    """The number that a cell shows."""
    return float(re.sub(r"×10([-\d]+)", r"e\1", text.translate(RAISED)))

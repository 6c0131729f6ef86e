"""Content of a report as plain data: sections of paragraphs, lists, tables, figures, formulas and listings.

All texts are plain: no writer reads markup in them. The writers (`html_page`, `pdf`) number sections, figures and
tables, and only they know a format.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias


@dataclass(frozen=True)
class Paragraph:
    """Sentences, with the words of `lead` in bold before them."""

    text: str
    lead: str = ""


@dataclass(frozen=True)
class Points:
    """A list of short statements, each with a remark in grey, which may be empty."""

    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Table:
    """A table with its caption.

    Attributes:
        caption: a phrase or a sentence.
        heads: of the columns.
        rows: as many texts each.
        numeric: whether a column holds numbers; of the other columns all but the first may be broken into lines.
        split: number of rows, and of columns after the first, after which a rule is drawn; 0 for none.
    """

    caption: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[bool, ...]
    split: int = 0


@dataclass(frozen=True)
class Figure:
    """A picture with its caption.

    Attributes:
        caption: a phrase or a sentence.
        picture: an SVG element as text, or the bytes of a PNG.
        width: share of the width of the text.
        live: a scene of solids that a page may show in place of the picture, as `views.scene` gives it.
    """

    caption: str
    picture: str | bytes
    width: float = 1.0
    live: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Formula:
    """A displayed formula in both notations: MathML for pages, Typst's mathematics for PDF."""

    mathml: str
    typst: str


@dataclass(frozen=True)
class Listing:
    """A text that keeps its lines as they are: a file, a command."""

    caption: str
    text: str


Block: TypeAlias = "Paragraph | Points | Table | Figure | Formula | Listing | Section"


@dataclass(frozen=True)
class Section:
    """A numbered heading and the blocks below it, which may be sections themselves."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Report:
    """A whole report.

    Attributes:
        kind: of report, printed above the title.
        title: name of the machine or the study.
        facts: name and text of each line of the title block.
        sections: in order.
        attachments: texts that the file carries along, by file name.
    """

    kind: str
    title: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...]
    attachments: Mapping[str, str] = field(default_factory=dict)

"""Content of a report as plain data: sections of paragraphs, lists, tables, figures, formulas and listings.

All texts are plain: writers do not interpret markup in them. The writers (`html_page`, `pdf`) number sections, figures
and tables; file formats are known only to them.
"""

from collections.abc import Mapping
from dataclasses import field
from typing import Any, TypeAlias

from kinetostat.frozen import dataclass


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of sentences, which begins with the words of `lead` in bold."""

    text: str
    lead: str = ""


@dataclass(frozen=True)
class Bullets:
    """A list of short statements, each with a remark in grey, which may be empty."""

    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Table:
    """A table with its caption.

    Attributes:
        caption: a phrase or a sentence.
        heads: headings of the columns.
        rows: texts of each row, one for each column.
        numeric: whether each column contains numbers. Of the other columns, all but the first may be broken into lines.
        split: number of rows above the horizontal rule and of columns, besides the first, left of the vertical rule, as
            between rotations and translations of a matrix; 0 for no rules.
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
        width: as a share of the width of the text.
        live: a scene of solids, in the form of `views.scene`, that a page may show in three dimensions in place of the
            picture.
    """

    caption: str
    picture: str | bytes
    width: float = 1.0
    live: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Formula:
    """A displayed formula in two notations: MathML for HTML pages, and that of Typst for PDF."""

    mathml: str
    typst: str


@dataclass(frozen=True)
class Listing:
    """A text whose lines are kept as they are, such as a file or a command."""

    caption: str
    text: str


@dataclass(frozen=True)
class InnerPage:
    """A whole page inside of a report that is a page itself; no other report has one.

    Attributes:
        title: what it shows.
        text: HTML.
    """

    title: str
    text: str


Block: TypeAlias = "Paragraph | Bullets | Table | Figure | Formula | Listing | InnerPage | Section"


@dataclass(frozen=True)
class Section:
    """A numbered heading and the blocks below it, which may be sections themselves."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Report:
    """A whole report.

    Attributes:
        kind: kind of the report, printed above the title.
        title: name of the machine or the study.
        facts: name and text of each line of the title block.
        sections: the sections, in order.
        attachments: files embedded in the report: their texts by file name.
    """

    kind: str
    title: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...]
    attachments: Mapping[str, str] = field(default_factory=dict)

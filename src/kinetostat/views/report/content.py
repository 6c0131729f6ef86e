"""What a report says, as plain data that knows neither HTML nor PDF: sections of paragraphs, tables, figures, formulas.

All texts are plain: no writer reads markup in them. Sections, figures and tables are numbered by the writers.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias


@dataclass(frozen=True)
class Paragraph:
    """Sentences, after a word in bold if there is a `lead`."""

    text: str
    lead: str = ""


@dataclass(frozen=True)
class Points:
    """A list of short statements, each with an aside in a softer voice or without one."""

    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Table:
    """A table with its caption.

    Attributes:
        caption: a phrase or a sentence.
        heads: of the columns.
        rows: as many texts each.
        numeric: whether a column holds numbers; the others may be broken into lines, but for the first.
        split: rows, and columns after the first, behind which a block ends; 0 for none.
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
    """A formula of the theory, by its name in `formulas`."""

    name: str


@dataclass(frozen=True)
class Listing:
    """A text to be read line by line as it is: a file, a command."""

    caption: str
    text: str


Block: TypeAlias = "Paragraph | Points | Table | Figure | Formula | Listing | Section"


@dataclass(frozen=True)
class Section:
    """A numbered heading and what stands under it, further sections included."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Report:
    """A whole report.

    Attributes:
        kind: what it is, over the title.
        title: the machine or the study.
        facts: name and text of each line of the title block.
        sections: in order.
        attachments: texts that the file carries along, by file name.
    """

    kind: str
    title: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...]
    attachments: Mapping[str, str] = field(default_factory=dict)

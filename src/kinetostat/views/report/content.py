"""Content of a report as plain data: sections of paragraphs, lists, tables, figures, formulas and listings.

All texts are plain: writers do not interpret markup in them. Sentences and tables of the terminal are typeset here,
with proper powers of ten, minus signs and degrees, and drawings become figures. The writers (`writers`) number
sections, figures and tables; file formats are known only to them.
"""

import re
from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any, TypeAlias

from rich.table import Table as TerminalTable

from kinetostat.display import with_minus_signs, without_round_off
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure

    from kinetostat.views import figures
else:
    figures = LateModule("kinetostat.views.figures")

FULL_WIDTH_INCHES = 7.4
"""Width of a drawing that takes the whole width of the text, which is 6.7 inches on A4: drawings are shrunk to nine
tenths of their size, and their letters of 8 points to 7.2, less than those of captions."""


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
        width: width of the picture as a share of that of the text.
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
        title: the words on its content.
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


_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_UNIT = r"(?= (?:m|rad|N|kg|Pa)\b)"
_POWER = re.compile(r"(?<=\d)e([+-]?)0*(\d+)\b")  # 1.2e-05: 1.2×10⁻⁵
_EXPONENT = re.compile(r"\*\*([2-4])\b")  # m**2: m²
_DEGREES = re.compile(r"(?<=\d) deg\b")  # 30 deg: 30°
_WHOLE = re.compile(r"(?<=\d)\.0" + _UNIT)  # 5.0 m: 5 m
_PLAIN_NUMBER = re.compile(r"[-+.\de]+(?: deg)?")  # a cell that is nothing but a number
# 210000000 Pa: 2.1e8 Pa. Fewer than six zeros are counted at a glance.
_ZEROS = re.compile(r"(?<![\w.,])(\d+?)(0{6,})(?:\.0)?" + _UNIT)
_TIMES = re.compile(r"^(\d+) x ")  # 3 x M8: 3 × M8


def typeset(text: str) -> str:
    """Typeset the numbers of a text: 1.2e-05 as 1.2×10⁻⁵, -3 with a minus sign, 30 deg as 30°, m**2 as m²."""
    text = _EXPONENT.sub(lambda match: match[1].translate(_SUPERSCRIPTS), text)
    text = _ZEROS.sub(lambda match: _scientific(match[1], len(match[2])), text)
    text = _POWER.sub(lambda match: "×10" + f"{match[1].replace('+', '')}{match[2]}".translate(_SUPERSCRIPTS), text)
    text = _TIMES.sub("\\1 × ", _WHOLE.sub("", text))
    return _DEGREES.sub("°", with_minus_signs(text))


def _scientific(digits: str, zeros: int) -> str:
    """Write a large whole number with a power of ten, given its leading digits and the number of zeros after them."""
    decimals = f".{digits[1:]}" if digits[1:] else ""
    return f"{digits[0]}{decimals}e{zeros + len(digits) - 1}"


def as_figure(drawing: "MatplotlibFigure", caption: str) -> Figure:
    """Convert a drawing of Matplotlib for a report, in which all drawings have one scale."""
    return Figure(caption, figures.as_svg(drawing), min(1.0, drawing.get_figwidth() / FULL_WIDTH_INCHES))


def as_table(table: TerminalTable, caption: str, split: int = 0) -> Table:
    """Convert a table of the terminal for a report.

    Args:
        table: a table as the terminal shows it.
        caption: the caption in place of its title.
        split: rows above the horizontal rule and columns left of the vertical one, as in `Table`.
    """
    columns = [without_round_off([*map(str, column.cells)]) for column in table.columns]
    numeric = tuple(column.justify == "right" for column in table.columns)
    shown = [
        # The first column has names, which keep their signs as in the file.
        [typeset(cell) if place or is_numeric or _PLAIN_NUMBER.fullmatch(cell) else cell for cell in column]
        for place, (column, is_numeric) in enumerate(zip(columns, numeric, strict=True))
    ]
    heads = tuple(str(column.header).replace("\n", " ") for column in table.columns)
    return Table(caption, heads, tuple(zip(*shown, strict=True)), numeric, split)

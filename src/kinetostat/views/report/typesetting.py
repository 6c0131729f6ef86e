"""Typesetting: sentences and tables of the terminal with proper powers of ten, minus signs and degrees.

No number changes its value here.
"""

import re

from rich.table import Table as TerminalTable

from kinetostat.views.report.content import Table

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<=\d)e([+-]?)0*(\d+)\b")
_EXPONENT = re.compile(r"\*\*([2-4])\b")
_MINUS = re.compile(r"(?<![\w.,)-])-(?=[\d.])")
_DEGREES = re.compile(r"(?<=\d) deg\b")
_WHOLE = re.compile(r"(?<=\d)\.0(?= (?:m|rad|N|kg|Pa)\b)")
_PLAIN_NUMBER = re.compile(r"[-+.\de]+")
_ZEROS = re.compile(r"(?<![\w.,])(\d+?)(0{6,})(?:\.0)?(?= (?:m|rad|N|kg|Pa)\b)")
_TIMES = re.compile(r"^(\d+) x ")


def typeset(text: str) -> str:
    """Typeset the numbers of a text: 1.2e-05 as 1.2×10⁻⁵, -3 with a minus sign, 30 deg as 30°, m**2 as m²."""
    text = _EXPONENT.sub(lambda match: match[1].translate(_SUPERSCRIPTS), text)
    text = _ZEROS.sub(lambda match: _scientific(match[1], len(match[2])), text)
    text = _POWER.sub(lambda match: "×10" + f"{match[1].replace('+', '')}{match[2]}".translate(_SUPERSCRIPTS), text)
    text = _TIMES.sub("\\1 × ", _WHOLE.sub("", text))
    return _DEGREES.sub("°", _MINUS.sub("−", text))


def _scientific(digits: str, zeros: int) -> str:
    """A large whole number, given by its leading digits and the number of zeros that follow, with a power of ten."""
    rest = f".{digits[1:]}" if digits[1:] else ""
    return f"{digits[0]}{rest}e{zeros + len(digits) - 1}"


def as_table(table: TerminalTable, caption: str, split: int = 0) -> Table:
    """Convert a table of the terminal for a report.

    Args:
        table: from one of the `*_tables` of `views`.
        caption: in place of its title.
        split: see `content.Table`.
    """
    columns = [[str(cell) for cell in column.cells] for column in table.columns]
    numeric = tuple(column.justify == "right" for column in table.columns)
    shown = [
        [typeset(cell) if i or other or _PLAIN_NUMBER.fullmatch(cell) else cell for cell in column]
        for i, (column, other) in enumerate(zip(columns, numeric, strict=True))
    ]
    heads = tuple(str(column.header).replace("\n", " ") for column in table.columns)
    return Table(caption, heads, tuple(zip(*shown, strict=True)), numeric, split)

"""Terminal tables and sentences as print has them: powers of ten, minus signs, degrees. No number changes its value."""

import re

from rich.table import Table as TerminalTable

from kinetostat.views.report.content import Table

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<=\d)e([+-]?)0*(\d+)\b")
_EXPONENT = re.compile(r"\*\*([2-4])\b")
_MINUS = re.compile(r"(?<![\w.,)-])-(?=[\d.])")
_DEGREES = re.compile(r"(?<=\d) deg\b")
_WHOLE = re.compile(r"(?<=\d)\.0(?= (?:m|rad|N|kg|Pa)\b)")
_NUMBER = re.compile(r"[-+.\de]+")
_ZEROS = re.compile(r"(?<![\w.,])(\d+?)(0{6,})(?:\.0)?(?= (?:m|rad|N|kg|Pa)\b)")
_TIMES = re.compile(r"^(\d+) x ")


def typeset(text: str) -> str:
    """A text with numbers as print has them: 1.2e-05 as 1.2×10⁻⁵, -3 with a minus sign, 30 deg as 30°, m**2 as m²."""
    text = _EXPONENT.sub(lambda found: found[1].translate(_SUPERSCRIPTS), text)
    text = _ZEROS.sub(lambda found: _scientific(found[1], len(found[2])), text)
    text = _POWER.sub(lambda found: "×10" + f"{found[1].replace('+', '')}{found[2]}".translate(_SUPERSCRIPTS), text)
    text = _TIMES.sub("\\1 × ", _WHOLE.sub("", text))
    return _DEGREES.sub("°", _MINUS.sub("−", text))


def _scientific(digits: str, zeros: int) -> str:
    """A whole number, given by its leading digits and how many zeros follow, as people write large ones."""
    rest = f".{digits[1:]}" if digits[1:] else ""
    return f"{digits[0]}{rest}e{zeros + len(digits) - 1}"


def printed(table: TerminalTable, caption: str, split: int = 0) -> Table:
    """A table of a terminal as one for print.

    Args:
        table: from one of the `*_tables` of `views`.
        caption: in place of its title.
        split: see `content.Table`.
    """
    columns = [[str(cell) for cell in column.cells] for column in table.columns]
    numeric = tuple(column.justify == "right" for column in table.columns)
    shown = [
        [typeset(cell) if i or other or _NUMBER.fullmatch(cell) else cell for cell in column]
        for i, (column, other) in enumerate(zip(columns, numeric, strict=True))
    ]
    heads = tuple(str(column.header).replace("\n", " ") for column in table.columns)
    return Table(caption, heads, tuple(zip(*shown, strict=True)), numeric, split)

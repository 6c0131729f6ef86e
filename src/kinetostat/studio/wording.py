"""Numbers, names, tables and bars as the page writes them, and numbers as people type them into its fields.

Values come in SI and leave as text; names and texts that may come from a file are escaped before they become HTML. What
is typed is a number with its unit, or arithmetic with such numbers, e.g. "10+5 mm"; it is never run as a program.
"""

import math
import re
from collections.abc import Mapping, Sequence
from html import escape

from kinetostat.display import ENGINEERING, Display, with_minus_signs, without_round_off
from kinetostat.frozen import dataclass
from kinetostat.machine.parameters import Parameter, entry_name
from kinetostat.spec.fields import Quantity
from kinetostat.units import KINDS, UNIT, UnitError, parse
from kinetostat.views.page import breakable

FIELD_DIGITS = 6
"""Significant digits of a value in a field that may be typed over: what was written in a file comes back as it was."""
FIRST_CHARACTERS_OF_NUMBERS = tuple("+-.0123456789")
"""Characters with which a number begins, and no word such as "rigid"."""
LEAST_FULL_BAR = 1e-3
"""Least logarithm of a gain that fills a whole bar, so that bars stay short if all gains are tiny."""
LONGEST_ARITHMETIC = 64
"""Characters that are read as arithmetic: longer texts are no number that anybody types."""
_TOKEN = re.compile(
    rf"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<unit>{UNIT.pattern})|(?P<sign>[-+*/()]))"
)
"""A number, a unit or a sign of arithmetic, with blanks before it; the name of the group says which."""


def shown_value(quantity: Quantity, value: float, display: Display = ENGINEERING) -> str:
    """Return a value as a field shows it, e.g. "220 mm", "30 deg", "20 N/µm"; `units.parse` reads it back."""
    if value == quantity.unset or math.isinf(value):
        return quantity.show(value)
    return display.show(value, KINDS[quantity.kind].unit, digits=FIELD_DIGITS)


def unit_shown(quantity: Quantity, value: float, display: Display = ENGINEERING) -> str:
    """Return the unit that a field shows beside a value; empty for "rigid", "no limit" and numbers without a unit."""
    text = shown_value(quantity, value, display)
    return text.partition(" ")[2] if text.startswith(FIRST_CHARACTERS_OF_NUMBERS) else ""


def engineering(value: float | None, unit: str = "1", display: Display = ENGINEERING) -> str:
    """Return a result with its unit, e.g. "3.628 N/µm"; "∞" if it is infinite, a dash if there is none."""
    return display.show(value, unit)


def entry(value: float | None, unit: str, display: Display = ENGINEERING) -> str:
    """Return a matrix entry without its unit, e.g. "0.5094"; a dash if there is none."""
    return with_minus_signs(display.number(value, unit))


def label(parameter: Parameter) -> str:
    """Return the name of a parameter within its table, e.g. "base radius", "actuator 2", "offset z"."""
    name = parameter.path.split(".")[-1]
    if not name.isdecimal():
        return name.replace("_", " ")
    field = parameter.path.split(".")[-2]
    return f"{field.replace('_', ' ')} {entry_name(field, int(name))}"


def table_of(parameter: Parameter) -> str:
    """Return the table of the machine file in which a parameter stands, e.g. "pose"; of a joint "leg 1, upper"."""
    within = 2 if parameter.path.split(".")[-1].isdecimal() else 1
    table = parameter.path.rsplit(".", within)[0]
    legs, *place = table.split(".")
    if legs != "legs" or not place:
        return table.replace(".", " ")
    first = place[0] if place[0].startswith("leg") else f"leg {place[0]}"
    return ", ".join([first, *place[1:]])


def full_label(parameter: Parameter) -> str:
    """Return the name of a parameter with its table: "stiffness: actuator", "leg 1, upper: point x", "load: force x".

    The pose and the geometry, where most numbers stand, are left out: "x", "base radius".
    """
    table_name = table_of(parameter)
    return label(parameter) if table_name in ("pose", "geometry") else f"{table_name}: {label(parameter)}"


def table(
    caption: str, head: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "", numeric: Sequence[bool] = ()
) -> str:
    """Return an HTML table whose first column names the rows.

    Args:
        caption: text for screen readers, not shown.
        head: heads of the columns; no head is shown if all are empty.
        rows: rows of texts.
        kind: further class for the style sheet.
        numeric: whether each column has numbers; words are broken into lines. If it is empty, all but the first have.
    """
    columns = [without_round_off(column) for column in zip(*rows, strict=True)]
    columns[1:] = [[*map(with_minus_signs, column)] for column in columns[1:]]
    classes = ["" if is_numeric else ' class="words"' for is_numeric in numeric or [True] * len(head)]
    heads = "".join(f'<th scope="col"{name}>{escape(cell)}</th>' for cell, name in zip(head, classes, strict=True))
    body = "".join(
        f'<tr><th scope="row">{escape(first)}</th>{_cells(rest, classes[1:])}</tr>'
        for first, *rest in zip(*columns, strict=True)
    )
    top = f"<thead><tr>{heads}</tr></thead>" if any(head) else ""
    return f'<table class="figures {kind}"><caption>{escape(caption)}</caption>{top}<tbody>{body}</tbody></table>'


def titled_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "") -> str:
    """Return an HTML table under a heading that says what it shows; arguments are those of `table`."""
    return heading(title) + table(title, head, rows, kind)


def _cells(cells: Sequence[str], classes: Sequence[str]) -> str:
    return "".join(f"<td{name}>{escape(cell)}</td>" for cell, name in zip(cells, classes, strict=True))


def bars(caption: str, rows: Sequence[tuple[str, float, str]], legs: Mapping[str, str] | None = None) -> str:
    """Return horizontal bars.

    Args:
        caption: text for screen readers, not shown.
        rows: name of each bar, its length as a share of the track (in another colour if negative), and a text.
        legs: name of a leg by the name of a bar; the picture lights the leg while the pointer is over the bar.
    """
    if not rows:
        return paragraph("There is nothing to show.")
    of_leg = {name: f' data-leg="{escape(leg)}"' for name, leg in (legs or {}).items()}
    items = "".join(
        f'<li{of_leg.get(name, "")}><span class="bar-name" title="{escape(name)}">{breakable(name)}</span>'
        f'<span class="bar-track"><span class="bar-fill {"negative" if share < 0 else ""}" '
        f'style="width:{100 * min(abs(share), 1.0):.2f}%"></span></span>'
        f'<span class="bar-value">{escape(with_minus_signs(text))}</span></li>'
        for name, share, text in rows
    )
    return f'<ol class="bars" aria-label="{escape(caption)}">{items}</ol>'


def gains(caption: str, rows: Sequence[tuple[str, float]]) -> str:
    """Return bars of factors of improvement on a logarithmic scale, with losses in another colour."""
    sizes = {name: math.log(gain) if 0.0 < gain < math.inf else 0.0 for name, gain in rows}
    longest = max([LEAST_FULL_BAR, *map(abs, sizes.values())])
    return bars(caption, [(name, sizes[name] / longest, f"× {gain:.4g}") for name, gain in rows])


def heading(text: str) -> str:
    """Return a heading within a panel."""
    return f"<h3>{escape(text)}</h3>"


def paragraph(text: str, kind: str = "note") -> str:
    """Return a paragraph of the class `kind`."""
    return f'<p class="{kind}">{escape(with_minus_signs(text))}</p>'


@dataclass(frozen=True)
class _Term:
    """A number and its unit, which is empty as long as there is none."""

    number: float
    unit: str = ""


class _UnreadableError(Exception):
    """The text is not arithmetic."""


def typed_value(text: str, kind: str, shown_unit: str) -> float:
    """Return the SI value of what was typed.

    A number without a unit has the unit of the next number to its right in the sum, or else the unit that the field
    shows: in a field of mm, "20" is 20 mm, "10+5 cm" is 15 cm, and "1 m + 5" is 1.005 m.

    Args:
        text: a quantity as `units.parse` reads it, or sums, products and quotients of such quantities and numbers.
        kind: a key of `units.KINDS`.
        shown_unit: unit that the field shows; empty if it shows none, as "rigid" does.

    Raises:
        UnitError: it cannot be read, or it is not a quantity of this kind.
    """
    try:
        return _Reader(text, kind, shown_unit).value()
    except _UnreadableError:
        return parse(text, kind, shown_unit)  # "rigid", or a message about what may be written


def _tokens(text: str) -> list[tuple[str, str]]:
    """Part a text into pairs of a kind ("number", "unit" or "sign") and its text; an empty pair marks the end."""
    tokens, place, text = [], 0, text.strip()
    if len(text) > LONGEST_ARITHMETIC:
        raise _UnreadableError
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None or match.lastgroup is None:
            raise _UnreadableError
        tokens.append((match.lastgroup, match[match.lastgroup]))
        place = match.end()
    return [*tokens, ("", "")]


class _Reader:
    """Reads a sum of products of factors from left to right; a factor is a number, or a sum in parentheses.

    There is a method for each of the three; each goes on from the place where the last one has stopped.
    """

    def __init__(self, text: str, kind: str, shown_unit: str) -> None:
        self._tokens, self._place = _tokens(text), 0
        self._kind, self._shown_unit = KINDS[kind], shown_unit

    def value(self) -> float:
        """Return the SI value of the whole text."""
        term = self._sum()
        if self._tokens[self._place][0]:
            raise _UnreadableError
        return self._si(term.number, term.unit or self._shown_unit)

    def _si(self, number: float, unit: str) -> float:
        if number and self._kind.unit and not unit:
            raise UnitError(f'it has no unit, and the field shows none; write for example "{self._kind.example}"')
        return parse(f"{number!r} {unit}", self._kind.name, self._shown_unit)

    def _take(self, kind: str, signs: str = "") -> str:
        """Return the next token and go on behind it if it is of this kind, and one of these signs; else return ""."""
        token_kind, text = self._tokens[self._place]
        if token_kind != kind or (signs and text not in [*signs]):
            return ""
        self._place += 1
        return text

    def _sum(self) -> _Term:
        terms = [self._product()]
        while sign := self._take("sign", "+-"):
            term = self._product()
            terms.append(_Term(-term.number, term.unit) if sign == "-" else term)
        if len(terms) == 1:
            return terms[0]
        if not any(term.unit for term in terms):
            return _Term(sum(term.number for term in terms))
        totals: dict[str, float] = {}
        unit = self._shown_unit
        for term in reversed(terms):  # a number without a unit has the next one to its right
            unit = term.unit or unit
            totals[unit] = totals.get(unit, 0.0) + term.number
        if len(totals) == 1:
            return _Term(totals[unit], unit)
        return _Term(sum(self._si(number, unit) for unit, number in totals.items()), self._kind.unit)

    def _product(self) -> _Term:
        term = self._factor()
        while sign := self._take("sign", "*/"):
            other = self._factor()
            if term.unit and other.unit:
                raise UnitError(
                    f"two quantities with units are multiplied or divided, which gives no {self._kind.name}"
                )
            if sign == "/" and other.number == 0.0:
                raise UnitError("it divides by zero")
            number = term.number * other.number if sign == "*" else term.number / other.number
            term = _Term(number, term.unit or other.unit)
        return term

    def _factor(self) -> _Term:
        if sign := self._take("sign", "+-"):
            term = self._factor()
            return _Term(-term.number, term.unit) if sign == "-" else term
        if self._take("sign", "("):
            term = self._sum()
            if not self._take("sign", ")"):
                raise _UnreadableError
        elif number := self._take("number"):
            term = _Term(float(number))
        else:
            raise _UnreadableError
        unit = self._take("unit")
        if unit and term.unit:
            raise _UnreadableError
        return _Term(term.number, term.unit or unit)

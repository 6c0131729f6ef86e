"""Texts typed into a field of the page: a number with its unit, or arithmetic with such numbers, e.g. "10+5 mm".

The text is read by the rules below and never run as a program.
"""

import re

from kinetostat.frozen import dataclass
from kinetostat.units import KINDS, UNIT, UnitError, parse

LONGEST = 64
"""Characters that are read as arithmetic: longer texts are no number that anybody types."""
_TOKEN = re.compile(
    rf"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<unit>{UNIT.pattern})|(?P<sign>[-+*/()]))"
)


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
    """Part a text into numbers, units and signs; the last entry is empty."""
    tokens, place, text = [], 0, text.strip()
    if len(text) > LONGEST:
        raise _UnreadableError
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None or match.lastgroup is None:
            raise _UnreadableError
        tokens.append((match.lastgroup, match[match.lastgroup]))
        place = match.end()
    return [*tokens, ("", "")]


class _Reader:
    """Reads a sum of products of factors from left to right; a factor is a number, or a sum in parentheses."""

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

    def _take(self, kind: str, texts: str = "") -> str:
        """Return the next token and go on behind it if it is of this kind and one of these texts; else return ""."""
        known, text = self._tokens[self._place]
        if known != kind or (texts and text not in texts):
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
        for term in reversed(terms):
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

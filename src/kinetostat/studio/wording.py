"""Numbers, names, tables and bars as the page writes them.

Values come in SI and leave as text; names and texts that may come from a file are escaped before they become HTML.
"""

import math
from collections.abc import Mapping, Sequence
from html import escape

from kinetostat.display import ENGINEERING, Display, with_minus_signs, without_round_off
from kinetostat.machine.parameters import Parameter, entry_name
from kinetostat.spec.fields import Quantity
from kinetostat.units import KINDS
from kinetostat.views.page import breakable

FIELD_DIGITS = 6
"""Significant digits of a value in a field that may be typed over: what was written in a file comes back as it was."""
LEAST_FULL_BAR = 1e-3
"""Least logarithm of a gain that fills a whole bar, so that bars stay short if all gains are tiny."""


def shown_value(quantity: Quantity, value: float, display: Display = ENGINEERING) -> str:
    """Return a value as a field shows it, e.g. "220 mm", "30 deg", "20 N/µm"; `units.parse` reads it back."""
    if value == quantity.unset or math.isinf(value):
        return quantity.show(value)
    return display.show(value, KINDS[quantity.kind].unit, digits=FIELD_DIGITS)


def unit_shown(quantity: Quantity, value: float, display: Display = ENGINEERING) -> str:
    """Return the unit that a field shows beside a value; empty for "rigid", "no limit" and numbers without a unit."""
    text = shown_value(quantity, value, display)
    return text.partition(" ")[2] if text[-1:] and text[0] in "+-.0123456789" else ""


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
    kinds = ["" if number else ' class="words"' for number in numeric or [True] * len(head)]
    top = "".join(f'<th scope="col"{name}>{escape(cell)}</th>' for cell, name in zip(head, kinds, strict=True))
    body = "".join(
        f'<tr><th scope="row">{escape(first)}</th>{_cells(rest, kinds[1:])}</tr>'
        for first, *rest in zip(*columns, strict=True)
    )
    heads = f"<thead><tr>{top}</tr></thead>" if any(head) else ""
    return f'<table class="figures {kind}"><caption>{escape(caption)}</caption>{heads}<tbody>{body}</tbody></table>'


def titled_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "") -> str:
    """Return an HTML table under a heading that says what it shows; arguments are those of `table`."""
    return heading(title) + table(title, head, rows, kind)


def _cells(cells: Sequence[str], kinds: Sequence[str]) -> str:
    return "".join(f"<td{name}>{escape(cell)}</td>" for cell, name in zip(cells, kinds, strict=True))


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

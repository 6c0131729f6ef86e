"""A table of corrections on a terminal: its error, how large corrections are, and their law. Nothing is computed."""

from collections.abc import Sequence

import numpy as np
from rich.console import Console

from kinetostat.display import Display, number
from kinetostat.machine.parameters import Parameter
from kinetostat.studies.corrections import CorrectionTable, Term
from kinetostat.views.tables import numeric_table

MOST_TERMS = 40
"""Terms of a law that are printed; a longer one is in JSON."""
DIGITS = 7
"""Significant digits of coefficients, which are typed into a controller."""
PLAIN = ("pose.", "load.")
"""Tables whose names are left out."""
RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def print_corrections(console: Console, table: CorrectionTable) -> None:
    """Print the errors, the range of each correction, and the law."""
    command = table.command
    display = command.machine.display
    sizes = " × ".join(f"{_name(field)} ({len(axis)})" for field, axis in zip(table.fields, table.axes, strict=True))
    console.print(f"{command.machine.name}: corrections over {sizes}", style="bold", highlight=False)
    console.print(table.message, highlight=False)
    if not table.before:
        return
    ranges = numeric_table("Corrections: what is added to each actuator", "actuator", ["least", "largest"])
    for name, unit, values in zip(command.actuators, command.units, command.corrections.T, strict=True):
        ends = (float(np.nanmin(values)), float(np.nanmax(values)))
        ranges.add_row(name, *(display.show_deflection(end, unit) for end in ends))
    console.print(ranges)
    _print_law(console, table, display)


def _print_law(console: Console, table: CorrectionTable, display: Display) -> None:
    law, command = table.law, table.command
    error, wanted = (display.show_deflection(value, "m") for value in (table.law_error, table.tolerance))
    if table.law_error > table.tolerance:
        console.print(
            f"No law reaches the tolerance of {wanted}; the best one has {len(law.terms)} terms and leaves {error}. "
            "Give more points, or use the table.",
            highlight=False,
        )
        return
    leaves = f"; at the tool it leaves at most {error} (tolerance: {wanted})."
    console.print(
        f"Law: each correction is a sum of {_counted(len(law.terms))}"
        + (", exact to round-off." if table.exact else leaves),
        highlight=False,
    )
    for axis in sorted({i for term in law.terms for i, (kind, k) in enumerate(term) if kind == "power" and k}):
        field, unit = table.fields[axis], table.fields[axis].unit
        middle, half = (display.show(value, unit) for value in (law.middles[axis], law.halves[axis]))
        console.print(f"{_letter(field)} is ({_name(field)} - {middle}) / {half}.", highlight=False)
    if len(law.terms) > MOST_TERMS:
        console.print("Its coefficients are printed with --json.")
        return
    scales = [display.deflection(unit) for unit in command.units]
    heads = [f"{name}\n{scale.unit}" for scale, name in zip(scales, command.actuators, strict=True)]
    rows = numeric_table("Law: coefficients of its terms", "term", heads)
    for term, coefficients in zip(law.terms, law.coefficients, strict=True):
        pairs = zip(coefficients.tolist(), scales, strict=True)
        rows.add_row(_text(term, table.fields), *(number(c * scale.factor, digits=DIGITS) for c, scale in pairs))
    console.print(rows)


def _counted(terms: int) -> str:
    return "one term" if terms == 1 else f"{terms} terms"


def _name(field: Parameter) -> str:
    """The field by its path, without a table that says nothing."""
    return field.path.split(".", 1)[1] if field.path.startswith(PLAIN) else field.shown


def _letter(field: Parameter) -> str:
    """What stands for the field in powers, from -1 to 1."""
    return f"[{_name(field)}]"


def _text(term: Term, fields: Sequence[Parameter]) -> str:
    """A term as people write it: 1, [x]², [y] cos(2 gravity_angle)."""
    parts = []
    for (kind, k), field in zip(term, fields, strict=True):
        if kind != "power":
            parts.append(f"{kind}({f'{k} ' if k > 1 else ''}{_name(field)})")
        elif k:
            parts.append(_letter(field) + (str(k).translate(RAISED) if k > 1 else ""))
    return " ".join(parts) or "1"

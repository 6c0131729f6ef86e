"""Designs side by side as HTML: where they differ, how stiff each is, who gains what. Rounds, and computes nothing."""

import math
import string
from html import escape

from kinetostat.studies.comparison.design_rows import Better, Row
from kinetostat.studies.comparison.designs import Blame, Comparison
from kinetostat.studio.wording import DASH, engineering, gains, heading, paragraph, table
from kinetostat.views.tables import readable

SAME = 0.05
"""Percent up to which there is no difference worth a number."""
MOST_SHARES = 3


def comparison_text(found: Comparison) -> str:
    """Everything that the comparison has to say."""
    letters = string.ascii_uppercase[: len(found.designs)]
    parts = [
        _legend(found, letters),
        heading("Times stiffer than A; softer in orange; bars are logarithmic"),
        _gains(found, letters),
    ]
    parts += [heading("At the pose of each design"), _rows(found, letters)]
    parts += [heading("Where they differ"), _differences(found, letters)]
    if any(found.softest):
        blame = [[letter, *_softest(own)] for letter, own in zip(letters, found.softest, strict=True)]
        title = "Largest contributions in the softest directions"
        parts += [heading(title), table(title, ["", "rotation", "translation"], blame, "words")]
    return "".join(parts)


def _legend(found: Comparison, letters: str) -> str:
    items = []
    for letter, design in zip(letters, found.designs, strict=True):
        why = "" if design.answered else f": {design.analysis.message}"
        items.append(f"<li><b>{letter}</b> {escape(design.label + why)}</li>")
    return f'<ul class="legend">{"".join(items)}</ul>'


def _gains(found: Comparison, letters: str) -> str:
    """Compliance of A over that of each other design."""
    own = [row for row in found.rows if row.group == "compliance"]
    columns = []
    for k, letter in enumerate(letters[1:], 1):
        known = [(row.name.removeprefix("C_"), _gain(row, k)) for row in own]
        shown = gains(f"{letter} against A", [(name, gain) for name, gain in known if gain is not None])
        columns.append(f"<div><h4>{letter}</h4>{shown}</div>")
    return f'<div class="gains">{"".join(columns)}</div>'


def _gain(row: Row, k: int) -> float | None:
    first, other = row.values[0], row.values[k]
    if first is None or other is None or not other or not math.isfinite(first) or not math.isfinite(other):
        return None
    return first / other


def _rows(found: Comparison, letters: str) -> str:
    head = "".join(f'<th scope="col">{letter}</th>' for letter in letters)
    body = "".join(_row(row) for row in found.rows)
    caption = "<caption>At the pose of each design</caption>"
    return f'<table class="figures">{caption}<thead><tr><th></th>{head}</tr></thead><tbody>{body}</tbody></table>'


def _row(row: Row) -> str:
    cells = []
    for i, (value, percent) in enumerate(zip(row.values, row.percents, strict=True)):
        shown = escape(engineering(value, row.unit))
        strong = f"<b>{shown}</b>" if i in row.best else shown
        cells.append(f"<td>{strong}{_change(row, percent) if i else ''}</td>")
    return f'<tr><th scope="row">{escape(row.name.replace("_", " "))}</th>{"".join(cells)}</tr>'


def _change(row: Row, percent: float | None) -> str:
    if percent is None:
        return ""
    if abs(percent) < SAME:
        return ' <span class="change">=</span>'
    kind = "better" if (percent < 0.0) == (row.better is Better.LESS) else "worse"
    shown = f"{percent:+.1f} %" if abs(percent) < 1000.0 else f"× {1.0 + percent / 100.0:.3g}"
    return f' <span class="change {kind}">{shown}</span>'


def _differences(found: Comparison, letters: str) -> str:
    rows = []
    for one in found.differences:
        pairs = zip(one.values, one.parameters, strict=True)
        rows.append([one.path, *(readable(values, p.quantity) if p else DASH for values, p in pairs)])
    families = [design.machine.family.name for design in found.designs]
    if len(set(families)) > 1:
        rows = [["family", *families], *rows]
    return table("Where they differ", ["", *letters], rows) if rows else paragraph("They do not differ.")


def _softest(own: tuple[Blame, ...]) -> list[str]:
    turning = next((one for one in own if one.component.startswith("r")), None)
    sliding = next((one for one in own if not one.component.startswith("r")), None)
    return [_blame(turning), _blame(sliding)]


def _blame(one: Blame | None) -> str:
    if one is None:
        return DASH
    parts = [f"{name} {100 * share:.0f} %" for name, share in one.shares[:MOST_SHARES] if share >= 0.005]
    return f"{one.component}: {', '.join(parts)}"

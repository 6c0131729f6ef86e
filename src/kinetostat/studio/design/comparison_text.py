"""Two to four designs side by side as HTML: how stiff each is, where they differ, and what makes each compliant.

The numbers come from `studies.comparison`; here they are only rounded and arranged.
"""

import math
import string
from html import escape

from kinetostat.display import DASH, Display
from kinetostat.studies.comparison import Better, Comparison, DesignRow, SoftDirection
from kinetostat.studio.wording import engineering, gains, heading, paragraph, table
from kinetostat.views.tables import readable

SAME = 0.05
"""Percent of difference up to which two values are shown as equal."""
MOST_SHARES = 3
"""Parts that are named for a direction."""
LEAST_SHARE = 0.005
"""Share below which a part is not named: it would read 0 %."""


def comparison_text(comparison: Comparison) -> str:
    """Return the whole comparison: gains, values at the pose of each design, differences, contributions."""
    letters = string.ascii_uppercase[: len(comparison.designs)]
    parts = [
        _legend(comparison, letters),
        heading("Stiffness, times that of A (logarithmic bars; orange: less stiff)"),
        _gains(comparison, letters),
    ]
    parts += [heading("At the pose of each design"), _rows(comparison, letters)]
    parts += [heading("Where they differ"), _differences(comparison, letters)]
    if any(comparison.softest):
        parts_of = [[letter, *_softest(weakest)] for letter, weakest in zip(letters, comparison.softest, strict=True)]
        title = "Largest contributions in the softest directions"
        parts += [heading(title), table(title, ["", "rotation", "translation"], parts_of, "words")]
    return "".join(parts)


def _legend(comparison: Comparison, letters: str) -> str:
    items = []
    for letter, design in zip(letters, comparison.designs, strict=True):
        reason = "" if design.answered else f": {design.analysis.message}"
        items.append(f"<li><b>{letter}</b> {escape(design.label + reason)}</li>")
    return f'<ul class="legend">{"".join(items)}</ul>'


def _gains(comparison: Comparison, letters: str) -> str:
    """Return bars of the compliance of A over that of each other design."""
    compliances = [row for row in comparison.rows if row.group == "compliance"]
    columns = []
    for k, letter in enumerate(letters[1:], 1):
        known = [(row.name.removeprefix("C_"), _gain(row, k)) for row in compliances]
        shown = gains(f"{letter} against A", [(name, gain) for name, gain in known if gain is not None])
        columns.append(f"<div><h4>{letter}</h4>{shown}</div>")
    return f'<div class="gains">{"".join(columns)}</div>'


def _gain(row: DesignRow, k: int) -> float | None:
    first, other = row.values[0], row.values[k]
    if first is None or other is None or not other or not math.isfinite(first) or not math.isfinite(other):
        return None
    return first / other


def _rows(comparison: Comparison, letters: str) -> str:
    head = "".join(f'<th scope="col">{letter}</th>' for letter in letters)
    body = "".join(_row(row, comparison.machine.display) for row in comparison.rows)
    caption = "<caption>At the pose of each design</caption>"
    return f'<table class="figures">{caption}<thead><tr><th></th>{head}</tr></thead><tbody>{body}</tbody></table>'


def _row(row: DesignRow, display: Display) -> str:
    cells = []
    for i, (value, percent) in enumerate(zip(row.values, row.percents, strict=True)):
        shown = escape(engineering(value, row.unit, display))
        strong = f"<b>{shown}</b>" if i in row.best else shown
        cells.append(f"<td>{strong}{_change(row, percent) if i else ''}</td>")
    return f'<tr><th scope="row">{escape(row.name.replace("_", " "))}</th>{"".join(cells)}</tr>'


def _change(row: DesignRow, percent: float | None) -> str:
    if percent is None:
        return ""
    if abs(percent) < SAME:
        return ' <span class="change">=</span>'
    kind = "better" if (percent < 0.0) == (row.better is Better.LESS) else "worse"
    shown = f"{percent:+.1f} %" if abs(percent) < 1000.0 else f"× {1.0 + percent / 100.0:.3g}"
    return f' <span class="change {kind}">{shown}</span>'


def _differences(comparison: Comparison, letters: str) -> str:
    rows = []
    for difference in comparison.differences:
        pairs = zip(difference.values, difference.parameters, strict=True)
        rows.append(
            [
                difference.path,
                *(readable(values, p.quantity, comparison.machine.display) if p else DASH for values, p in pairs),
            ]
        )
    families = [design.machine.family.name for design in comparison.designs]
    if len(set(families)) > 1:
        rows = [["family", *families], *rows]
    return table("Where they differ", ["", *letters], rows) if rows else paragraph("The designs do not differ.")


def _softest(weakest: tuple[SoftDirection, ...]) -> list[str]:
    """Write the most compliant rotation and translation of a design, each with the parts that contribute most."""
    turning = next((each for each in weakest if each.direction.startswith("r")), None)
    sliding = next((each for each in weakest if not each.direction.startswith("r")), None)
    return [_contributions(turning), _contributions(sliding)]


def _contributions(weakest: SoftDirection | None) -> str:
    if weakest is None:
        return DASH
    parts = [f"{name} {100 * share:.0f} %" for name, share in weakest.shares[:MOST_SHARES] if share >= LEAST_SHARE]
    return f"{weakest.direction}: {', '.join(parts)}"

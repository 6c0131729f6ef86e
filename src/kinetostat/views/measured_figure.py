"""A figure of a measured and a computed stiffness: differences over their uncertainty, and what that is made of.

Nothing is computed here.
"""

from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from kinetostat.studies.measured.comparison import COVERAGE_FACTOR, MeasuredComparison
from kinetostat.studies.setting import setting_of
from kinetostat.views.figures import COLOURS, STYLE, fix_layout, note_setting, set_title
from kinetostat.views.measured import SOURCE_WORDS
from kinetostat.views.question import Drawing

MOST_BARS_OF_ENTRIES = 60
"""Measured numbers that have bars; of more, those with the largest differences."""


def measured_figure(answer: MeasuredComparison, title: str = "{}: measured and computed stiffness") -> Figure:
    """Draw differences in standard uncertainties, and the shares of computation, numbers and measurement in these."""
    size = np.array([row.error / row.u_val for row in answer.rows])
    order = np.sort(np.argsort(-np.abs(size), kind="stable")[:MOST_BARS_OF_ENTRIES])
    rows = [answer.rows[n] for n in order]
    places = np.arange(len(rows))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 1.9 + 0.2 * len(rows)), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        left.axvspan(-COVERAGE_FACTOR, COVERAGE_FACTOR, color="#e8e8e8", zorder=0)
        left.axvline(0.0, color="black", linewidth=0.6)
        colours = [COLOURS[0] if row.explained else COLOURS[1] for row in rows]
        left.barh(places, size[order], 0.6, color=colours)
        left.set(xlabel="computed less measured (standard uncertainties)")
        reach = 1.1 * max(np.abs(size).max(), 1.5 * COVERAGE_FACTOR)
        left.set_xlim(-reach, reach)
        names = [f"{row.entry.name} (line {row.entry.line})" for row in rows]
        left.set_yticks(places, names)
        left.set_ylim(len(rows) - 0.4, -0.6)
        start = np.zeros(len(rows))
        parts = np.array([[row.u_num, row.u_input, row.u_data] for row in rows]) ** 2
        shares = 100.0 * parts / parts.sum(axis=1, keepdims=True)
        for share, colour, words in zip(shares.T, COLOURS[2:], SOURCE_WORDS.values(), strict=False):
            right.barh(places, share, 0.6, start, color=colour, label=words)
            start = start + share
        right.set(xlabel="share of the variance (%)", xlim=(0, 100))
        for panel in (left, right):
            panel.grid(visible=False, axis="y")
            panel.tick_params(axis="y", length=0)
        right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=6.5, borderaxespad=0.2)
        set_title(figure, title.format(answer.machine.name))
        note_setting(figure, setting_of(answer.machine), "grey: explained by uncertainties")
        fix_layout(figure)
    return figure


def measured_figures(answer: MeasuredComparison) -> dict[str, Drawing]:
    """Return the comparison with a measured stiffness as the one figure that it has."""
    caption = "Differences of computed and measured numbers over their uncertainty, and what the variance is made of."
    return {"measured": Drawing(caption, partial(measured_figure, answer))}

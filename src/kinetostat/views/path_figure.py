"""The picture along a path: quantities, and below them the coordinates that vary, over the numbers of the poses."""

from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kinetostat.arrays import Array, Integers
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, group_of, spoken
from kinetostat.studies.evaluation import PoseAnswers
from kinetostat.studies.setting import setting_of
from kinetostat.views.figures import STYLE, fix_layout, look_of, note_setting, set_title
from kinetostat.views.question import Drawing

ABSENT = "#dddddd"
"""Behind poses that have no result."""
FEW = 60
"""Poses up to which each is marked with a dot."""


def path_figures(answers: PoseAnswers) -> dict[str, Drawing]:
    """Return the one figure of quantities along a path."""
    return {"path": Drawing("Quantities along the poses.", partial(path_figure, answers))}


def path_figure(answers: PoseAnswers, title: str = "{}") -> Figure:
    """Draw quantities along a path, a panel for each unit; poses without a result are grey.

    Args:
        answers: at the poses, which are taken as neighbours in the order in which they are given.
        title: over the figure, with braces for the name of the machine.
    """
    names = list(answers.values)
    groups = {unit: [n for n in names if QUANTITIES[n].unit == unit] for unit in (QUANTITIES[n].unit for n in names)}
    fields = [pair for pair in zip(answers.poses.fields, answers.poses.values, strict=True) if np.ptp(pair[1]) > 0.0]
    kinds = list(dict.fromkeys(field.quantity.kind for field, _ in fields))
    with mpl.rc_context(STYLE):
        rows = len(groups) + len(kinds)
        figure = Figure(figsize=(6.6, 0.7 + 1.9 * len(groups) + 1.25 * len(kinds)), layout="constrained")
        ratios = [1.9] * len(groups) + [1.25] * len(kinds)
        panels = list(figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=ratios).flat)
        for panel, (unit, members) in zip(panels, groups.items(), strict=False):
            every = (v for name in members for v in answers.values[name])
            scale = answers.machine.display.fitting(unit, every)
            curves = {QUANTITIES[name].symbol: answers.values[name] * scale.factor for name in members}
            _panel(panel, answers, curves, scale.label(spoken(group_of(members) or members[0])))
        for panel, kind in zip(panels[len(groups) :], kinds, strict=True):
            shown = [(field, values) for field, values in fields if field.quantity.kind == kind]
            scale = answers.machine.display.scale(shown[0][0].unit)
            _panel(panel, answers, {f.shown: values * scale.factor for f, values in shown}, scale.label(kind))
        panels[-1].set_xlabel("pose")
        set_title(figure, title.format(answers.machine.name))
        note_setting(figure, *_notes(answers))
        fix_layout(figure)
    return figure


def _panel(panel: Axes, answers: PoseAnswers, curves: dict[str, Array], label: str) -> None:
    numbers = np.arange(1, answers.poses.count + 1)
    _shade(panel, np.flatnonzero(answers.status != Status.OK) + 1)
    marker = "." if len(numbers) <= FEW else ""
    for place, (name, values) in enumerate(curves.items()):
        finite = np.where(np.isfinite(values), values, np.nan)
        panel.plot(numbers, finite, marker=marker, label=name, **look_of(place))
    panel.set_ylabel(label)
    panel.margins(x=0.0)
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _shade(panel: Axes, numbers: Integers) -> None:
    """Shade runs of poses."""
    for run in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1):
        if len(run):
            panel.axvspan(run[0] - 0.5, run[-1] + 0.5, color=ABSENT, linewidth=0.0)


def _notes(answers: PoseAnswers) -> tuple[str, str, str]:
    counts = [f"{status.word.replace('_', ' ')}: {len(numbers):,}" for status, numbers in answers.failures.items()]
    missing = f"no result (grey) at {', '.join(counts)} of {answers.poses.count:,} poses" if counts else ""
    return setting_of(answers.machine, list(answers.poses.leaves)), answers.loads_left_out, missing

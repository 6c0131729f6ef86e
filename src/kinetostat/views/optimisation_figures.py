"""Figures of a study for print: convergence, what each direction gains, the Pareto front, and scatter by tolerances."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.display import Display, Scale
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.studies.optimisation.assessment import COMMON_SHARE, Scatter
from kinetostat.studies.optimisation.log import Log
from kinetostat.studies.optimisation.problem import Objective
from kinetostat.studies.optimisation.result import Result
from kinetostat.views.figures import COLOURS, GUIDE_COLOUR, NOTE_SIZE, grid_shape, new_figure, panel_grid
from kinetostat.views.question import Drawing

HISTOGRAM_WIDTH = 3.6
"""Width of a histogram with its numbers, inches."""
BINS = 40
"""Bars of a histogram of scatter: about 25 machines each for the usual 1000."""
CAPTIONS = {
    "comparison": "Left: how many times stiffer each direction is. Right: each variable between its bounds.",
    "convergence": "Best and mean of the designs that each step kept, and their distance from the final best.",
    "front": "Designs over the objectives; on the front no design is better than another in all objectives.",
    "tolerances": "Scatter of the objectives over machines made to the tolerances from the best design.",
}
SHOWN_PERCENTILE = 99.0
"""Percentile of all designs up to which the surroundings of a front are drawn: far designs would squeeze it."""
FRONT_MARGIN = 0.05
"""Room between a front and the edge of its panel, as a share of its span: points at the edge are not cut in half."""
WIDEST_LINEAR_RATIO = 30.0
"""Ratio of the greatest gain to the least beyond which their axis is logarithmic: the least could not be seen."""
LEAST_SHOWN, GREATEST_SHOWN = -0.05, 1.05
"""Ends of the scale of a variable, in units of the distance of its bounds: an initial design beyond is not drawn."""
PLACE_OF_VALUES, END_OF_VALUES = 1.04, 1.45
"""Place at which the value of a variable begins to the right of its scale, and right edge of the panel, in the same
units: room for a number with its unit."""
ROOM_BEYOND_BARS = 0.18
"""Room to both sides of bars for the numbers at their ends, as a share of the range of the bars."""
ROOM_ABOVE_HISTOGRAM = 1.4
"""Height of a panel over that of its tallest bar: the legend with three values stands above the bars."""
COMPARISON_WIDTH = 7.2
"""Width of the figure that compares two designs, inches."""
LINE_HEIGHT = 0.3
"""Height of a line of that figure, a direction or a variable, inches."""
ROOM_FOR_TITLE = 0.9
"""Height that its title and its labels take, inches."""
WIDTH_ALONE, WIDTH_AMONG_OTHERS, FRONT_HEIGHT = 4.2, 3.1, 3.2
"""Width of the panel of a pair of objectives, alone and among others, and its height, inches."""
CONVERGENCE_SIZE = (6.8, 3.0)
"""Width and height of the figure of convergence, inches: two panels side by side on a page."""
HISTOGRAM_HEIGHT, HISTOGRAM_MARGIN = 2.9, 0.6
"""Height of the figure of histograms with its title, and width of its margins, inches."""
NOMINAL_COLOUR = "#222222"
"""Nearly black of the value of the best design as it is drawn."""
BAR_SHARE = 0.6
"""Height of a bar of the gains as a share of its line."""
PALE_GREY = "#cccccc"
"""Colour of what stands behind the result: designs beside a front, and the scale of a variable."""
MIDDLE_GREY = "#777777"
"""Colour of what explains a scale: the numbers at its ends, and the way from before to after."""


def pictures(result: Result) -> dict[str, Drawing]:
    """Return the figures of a solved study, by file name."""
    if not result.solved:
        return {}
    name = result.problem.study.name
    draw = {"comparison": partial(comparison, result, title=f"{name}: {result.problem.machine.name}")}
    if len(result.problem.objectives) == 1:
        draw["convergence"] = partial(convergence, result.log, title=name)
    else:
        draw["front"] = partial(front, result, title=name)
    if result.robustness:
        draw["tolerances"] = partial(tolerances, result, title=f"{name}: under the tolerances")
    return {key: Drawing(CAPTIONS[key], function) for key, function in draw.items()}


def convergence(log: Log, title: str) -> Figure:
    """Draw best and mean of the population after each step (Fig. 6 of the paper), and their distance to the end."""
    objective = log.problem.objectives[0]
    across = "descent" if log.problem.method == "gradient" else "generation"
    steps = np.arange(1, len(log.steps) + 1)
    best, mean = (np.array([step.get(key, np.nan) for step in log.steps], dtype=float) for key in ("best", "mean"))
    with new_figure(CONVERGENCE_SIZE, title) as figure:
        left, right = figure.subplots(1, 2)
        scale = log.problem.machine.display.scale(objective.term.unit)
        left.plot(steps, mean * scale.factor, color=COLOURS[1], label="mean of the population", linestyle="--")
        left.plot(steps, best * scale.factor, color=COLOURS[0], label="best")
        left.set(xlabel=across, ylabel=_axis(objective, scale))
        left.legend()
        last_best = next((value for value in best[::-1] if np.isfinite(value)), np.nan)
        for values, colour, label, dash in ((mean, COLOURS[1], "mean", "--"), (best, COLOURS[0], "best", "-")):
            distance = np.abs(values - last_best) / np.abs(last_best)
            right.plot(steps, np.where(distance > 0.0, distance, np.nan), dash, color=colour, label=label)
        right.set(xlabel=across, ylabel="relative distance to the last best", yscale="log")
        for panel in (left, right):
            panel.margins(x=0.02)
    return figure


def comparison(result: Result, title: str) -> Figure:
    """Draw how many times stiffer each direction is, and each variable between its bounds before and after."""
    with new_figure(
        (COMPARISON_WIDTH, ROOM_FOR_TITLE + LINE_HEIGHT * max(len(COMPONENTS), result.problem.space.size)), title
    ) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
        _draw_gains(left, result)
        _draw_variables(right, result)
    return figure


def _draw_gains(panel: Axes, result: Result) -> None:
    """Draw for each direction how many times stiffer it is, as a bar from 1 (as stiff as before)."""
    compared = [
        direction for direction in result.compliance_changes if np.isfinite(direction.gain) and direction.gain > 0.0
    ]
    places, gains = np.arange(len(compared)), np.array([direction.gain for direction in compared])
    colours = [COLOURS[2] if gain >= 1.0 else COLOURS[1] for gain in gains]
    panel.barh(places, gains - 1.0, left=1.0, color=colours, height=BAR_SHARE)
    panel.axvline(1.0, color=GUIDE_COLOUR, linewidth=0.8)
    is_wide = gains.size and gains.max() / gains.min() > WIDEST_LINEAR_RATIO
    panel.set(xscale="log" if is_wide else "linear", xlabel="times as stiff as before")
    panel.set_yticks(places, [direction.name.removeprefix("compliance_") for direction in compared])
    panel.invert_yaxis()
    panel.grid(visible=False, axis="y")
    for place, gain in zip(places, gains, strict=True):
        is_long = is_wide and gain < 1.0 / WIDEST_LINEAR_RATIO  # its bar to the left of 1 has room for the number
        panel.annotate(
            f"{gain:.3g}", (gain if is_long else max(gain, 1.0), place), (3, 0), textcoords="offset points",
            va="center", fontsize=7, color="white" if is_long else "black",
        )  # fmt: skip
    panel.margins(x=ROOM_BEYOND_BARS)


def _draw_variables(panel: Axes, result: Result) -> None:
    """Draw each variable on a scale from its lower to its upper bound."""
    space, display = result.problem.space, result.problem.machine.display
    last_choices = np.where(space.catalogue > 0, np.maximum(space.catalogue - 1, 1), 1)
    before, after = space.initial / last_choices, result.genes / last_choices
    for place, variable in enumerate(space.searched_variables):
        panel.plot([0.0, 1.0], [place, place], color=PALE_GREY, linewidth=1.2, zorder=1)
        if LEAST_SHOWN <= before[place] <= GREATEST_SHOWN:
            panel.plot(before[place], place, "o", color="white", markeredgecolor=GUIDE_COLOUR, zorder=2)
            panel.annotate(
                "", (after[place], place), (before[place], place),
                arrowprops={"arrowstyle": "-", "color": MIDDLE_GREY, "linewidth": 0.8}, zorder=1,
            )  # fmt: skip
        panel.plot(after[place], place, "o", color=COLOURS[0], zorder=3)
        value = variable.in_words(float(space.values(result.genes)[place]), display)
        panel.annotate(value, (PLACE_OF_VALUES, place), va="center", fontsize=7)
        ends = [variable.in_words(0.0 if variable.choices is not None else variable.low, display)]
        ends.append(variable.in_words(variable.high, display))
        for x, text, side in zip((0.0, 1.0), ends, ("left", "right"), strict=True):
            panel.annotate(
                text, (x, place), (0, 5), textcoords="offset points", ha=side, fontsize=5.5, color=MIDDLE_GREY
            )
    panel.set_yticks(range(space.size), [variable.name for variable in space.searched_variables])
    panel.set(xlim=(LEAST_SHOWN, END_OF_VALUES), xticks=[], xlabel="between its bounds")
    was = Line2D([], [], color="white", marker="o", markeredgecolor=GUIDE_COLOUR, linestyle="", label="before")
    best = Line2D([], [], color=COLOURS[0], marker="o", linestyle="", label="best")
    panel.legend(handles=[was, best], loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    panel.set_ylim(space.size - 0.4, -0.7)
    panel.grid(visible=False)
    panel.spines[["top", "right", "bottom"]].set_visible(False)


def front(result: Result, title: str) -> Figure:
    """Draw every pair of objectives: all feasible designs, the front, and its knee."""
    problem, outcome = result.problem, result.log.outcome()
    feasible = outcome.objectives[outcome.violation == 0.0]
    best = outcome.objectives[result.front]
    pairs = [(i, j) for i in range(best.shape[1]) for j in range(i + 1, best.shape[1])]
    rows, columns = grid_shape(len(pairs))
    width = WIDTH_ALONE if columns == 1 else WIDTH_AMONG_OTHERS
    with new_figure((width * columns, FRONT_HEIGHT * rows), title) as figure:
        for panel, (i, j) in zip(panel_grid(figure, len(pairs)), pairs, strict=True):
            x, y = (problem.machine.display.scale(problem.objectives[k].term.unit) for k in (i, j))
            panel.scatter(
                feasible[:, i] * x.factor, feasible[:, j] * y.factor, s=3, color=PALE_GREY, linewidths=0,
                rasterized=True, label="evaluated designs",
            )  # fmt: skip
            panel.plot(best[:, i] * x.factor, best[:, j] * y.factor, "o", markersize=3, color=COLOURS[0], label="front")
            knee = best[result.knee, [i, j]] * (x.factor, y.factor)
            panel.plot(*knee, "D", markersize=7, markerfacecolor="none", markeredgecolor=COLOURS[1], label="knee")
            if np.isfinite(result.initial.objectives).all():
                before = result.initial.objectives[0, [i, j]] * (x.factor, y.factor)
                panel.plot(*before, "s", color=GUIDE_COLOUR, markersize=4, label="initial")
            panel.set(xlabel=_axis(problem.objectives[i], x), ylabel=_axis(problem.objectives[j], y))
            panel.set_xlim(*front_limits(best[:, i] * x.factor, feasible[:, i] * x.factor))
            panel.set_ylim(*front_limits(best[:, j] * y.factor, feasible[:, j] * y.factor))
        figure.axes[0].legend(loc="best")
    return figure


def tolerances(result: Result, title: str) -> Figure:
    """Draw how each objective scatters over random machines within the tolerances of the best design."""
    scatters = result.robustness.scatters if result.robustness else ()
    with new_figure((HISTOGRAM_WIDTH * len(scatters) + HISTOGRAM_MARGIN, HISTOGRAM_HEIGHT), title) as figure:
        for panel, scatter in zip(figure.subplots(1, len(scatters), squeeze=False).flat, scatters, strict=True):
            _histogram(panel, scatter, result.problem.machine.display)
    return figure


def _histogram(panel: Axes, scatter: Scatter, display: Display) -> None:
    samples = scatter.samples[np.isfinite(scatter.samples)]
    scale = display.scale(scatter.unit)
    panel.hist(samples * scale.factor, bins=BINS, color=COLOURS[5], edgecolor="white", linewidth=0.3)
    usual = f"reached by {100.0 * COMMON_SHARE:g} %"
    marks = (("nominal", scatter.nominal, "-"), (usual, scatter.usual, "--"), ("worst", scatter.worst, ":"))
    for (label, value, dash), colour in zip(marks, (NOMINAL_COLOUR, COLOURS[0], COLOURS[1]), strict=True):
        panel.axvline(value * scale.factor, color=colour, linestyle=dash, label=f"{label}: {value * scale.factor:.6g}")
    panel.set(xlabel=scale.label(scatter.label), ylabel="machines")
    panel.margins(x=0.03)
    panel.set_ylim(top=panel.get_ylim()[1] * ROOM_ABOVE_HISTOGRAM)
    panel.legend(loc="upper left", fontsize=NOTE_SIZE, frameon=True, framealpha=1.0, edgecolor="none")


def _axis(objective: Objective, scale: Scale) -> str:
    return scale.label(plain_name(objective.term.label))


def front_limits(front_values: Array, every_value: Array) -> tuple[float, float]:
    """Return the ends of the axis of an objective: the whole front, and most designs within its span to both sides.

    Args:
        front_values: values of the objective on the front.
        every_value: its values in all designs.
    """
    low, high = float(front_values.min()), float(front_values.max())
    span = (high - low) or abs(high) or 1.0
    near, far = map(float, np.percentile(every_value, [100.0 - SHOWN_PERCENTILE, SHOWN_PERCENTILE]))
    margin = FRONT_MARGIN * span
    return max(min(near, low), low - span) - margin, min(max(far, high), high + span) + margin

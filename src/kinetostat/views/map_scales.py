"""Levels of the contours of a map, which a few extreme poses cannot spoil, and the layout of its axes.

Nothing is drawn here. Next to a singularity compliance has no bound: levels follow the usual values.
"""

import math
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.views.layout import width_of

if TYPE_CHECKING:
    import xarray as xr

ExceededEnds: TypeAlias = Literal["neither", "min", "max", "both"]

USUAL_PERCENTILES = (2.0, 98.0)
"""Percentiles between which values are usual: one pose in twenty-five may lie next to a singularity."""
FAR_EXTREME = 1.0
"""Distance of an extreme from the usual values, in units of their range, beyond which a map leaves it out."""
WIDE_RATIO = 30.0
"""Ratio of the usual values of a map, if all are positive, from which its colours follow the logarithm."""
LEVELS = 12
"""Approximate number of bands of a map: as many colours as the eye tells apart."""
SAME_LEVEL = 1e-9
"""Share of the range of levels within which a level and an extreme differ by round-off alone."""
STEPS_OF_DECADE = ((1.0, 2.0, 5.0), (1.0, 3.0), (1.0,))
"""Levels within a decade, from few decades to many: the first are taken of which a bar can show all."""
MAP_WIDTH, LONG_NUMBER = 1.8, 0.3
"""Width of a map among others without its scales, and of a number that is long below it, inches."""
NUMBER_PITCH = 1.4
"""Least distance of long numbers below a map, in widths of the widest one: a gap is seen between them."""
EQUAL_SCALES = (0.5, 2.0)
"""Ratios of two lengths between which a map has equal scales: others would leave half of its panel empty."""


def usual_range(values: Array) -> tuple[float, float]:
    """Return the ends between which a map should resolve values: extremes only where they lie near all others.

    A map of 41 x 41 poses with a single pose next to a singularity would otherwise be of one colour.

    Args:
        values: an array of any shape; those that are not finite are ignored, at least one must be finite.
    """
    finite = values[np.isfinite(values)]
    least, low, high, greatest = np.percentile(finite, [0.0, *USUAL_PERCENTILES, 100.0])
    margin = FAR_EXTREME * (high - low)
    return float(low if low - least > margin else least), float(high if greatest - high > margin else greatest)


@dataclass(frozen=True)
class Levels:
    """Levels of a map.

    Attributes:
        bounds: bounds of the bands, increasing.
        logarithmic: whether they follow the logarithm.
        extend: at which ends values lie beyond the bounds, as matplotlib calls it.
    """

    bounds: Array
    logarithmic: bool
    extend: ExceededEnds


def levels_of(values: Array) -> Levels:
    """Choose about `LEVELS` round levels over the usual range, by the logarithm where that is wide.

    Args:
        values: an array of any shape; two finite ones must differ.
    """
    finite = values[np.isfinite(values)]
    low, high = usual_range(finite)
    if low == high:  # nearly all values are equal, and only the extremes say something
        low, high = float(finite.min()), float(finite.max())
    logarithmic = low > 0.0 and high > WIDE_RATIO * low
    linear = MaxNLocator(LEVELS + 1, min_n_ticks=1).tick_values
    bounds = np.asarray(_round_powers(low, high) if logarithmic else linear(low, high))
    for end, extreme in ((0, finite.min()), (-1, finite.max())):
        if abs(bounds[end] - extreme) <= SAME_LEVEL * (bounds[-1] - bounds[0]):
            bounds[end] = extreme  # a level that misses an extreme by round-off would leave a hole there
    return Levels(bounds, logarithmic, exceeded_ends(finite, bounds[0], bounds[-1]))


def exceeded_ends(values: Array, low: float, high: float) -> ExceededEnds:
    """Say at which ends of a colour bar values lie beyond it, in the words of Matplotlib; NaN lies nowhere."""
    below, above = bool((values < low).any()), bool((values > high).any())
    return "both" if below and above else "min" if below else "max" if above else "neither"


def _round_powers(low: float, high: float) -> Array:
    """Return powers of ten times 1, 2 and 5, times 1 and 3, or alone, from at most `low` to at least `high`.

    They are the first of these that a bar can show all; of more than that many powers of ten, every n-th.
    """
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    for steps in STEPS_OF_DECADE:
        candidates = [step * 10.0**power for power in range(first, last + 1) for step in steps]
        inner = [n for n, value in enumerate(candidates) if low < value < high]
        chosen = candidates[inner[0] - 1 : inner[-1] + 2]  # with the next one on either side
        if len(chosen) <= LEVELS + 2:
            return np.array(chosen)
    return np.array([*chosen[: -1 : math.ceil(len(chosen) / LEVELS)], chosen[-1]])


def set_axis_scales(panel: Axes, dataset: "xr.Dataset", across: str, up: str) -> None:
    """Set equal scales for two lengths of similar range, and logarithmic ones where the grid is."""
    lengths = [dataset[name].attrs["kind"] == "length" for name in (across, up)]
    spans = [np.ptp(dataset[name].values) for name in (across, up)]
    least, greatest = EQUAL_SCALES
    if all(lengths) and least < spans[0] / spans[1] < greatest:
        panel.set_aspect("equal")
    if dataset[across].attrs["log"]:
        panel.set_xscale("log")
    if dataset[up].attrs["log"]:
        panel.set_yscale("log")


def trim_height(figure: Figure, panel: Axes, height: float) -> None:
    """Take out of a figure what panels of equal scales leave empty above and below them.

    Args:
        figure: a figure whose layout is not fixed yet.
        panel: one of the panels, which are all alike.
        height: the height of all rows of panels together if they were square, inches.
    """
    if panel.get_aspect() == 1.0:
        (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
        figure.set_figheight(figure.get_figheight() - height * max(0.0, 1.0 - (high - low) / (right - left)))


def thin_numbers(panel: Axes) -> None:
    """Let long numbers below a map stand apart; Matplotlib counts on three digits, and lets longer ones meet."""
    width = width_of(f"{end:.6g}" for end in panel.get_xlim())
    if width > LONG_NUMBER and panel.get_xscale() == "linear":
        panel.locator_params(axis="x", nbins=max(2, int(MAP_WIDTH / (NUMBER_PITCH * width))))

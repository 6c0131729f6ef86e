"""Scales of a map: which are equal or logarithmic, which numbers stand along them, and the room that they leave.

Nothing is drawn here, and no values of the map are known.
"""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kinetostat.views.lettering import width_of

if TYPE_CHECKING:
    import xarray as xr

MAP_WIDTH, LONG_NUMBER = 1.8, 0.3
"""Width of a map among others without its scales, and of a number that is long below it, inches."""


def set_axis_scales(panel: Axes, dataset: "xr.Dataset", across: str, up: str) -> None:
    """Equal scales for two lengths of similar range, logarithmic ones where the grid is."""
    lengths = [dataset[name].attrs["kind"] == "length" for name in (across, up)]
    spans = [np.ptp(dataset[name].values) for name in (across, up)]
    if all(lengths) and 0.5 < spans[0] / spans[1] < 2.0:
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
    wide = width_of(f"{end:.6g}" for end in panel.get_xlim())
    if wide > LONG_NUMBER and panel.get_xscale() == "linear":
        panel.locator_params(axis="x", nbins=max(2, int(MAP_WIDTH / (1.4 * wide))))

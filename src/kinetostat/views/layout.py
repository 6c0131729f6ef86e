"""The layout of figures: room for the labels and numbers around panels, measured as seldom as possible.

Nothing is drawn here.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from kinetostat.views.lettering import letter

MEASURING = ("_update_ticks", "_get_ticklabel_bboxes")
"""Private methods of Matplotlib that place and measure the numbers along an axis; without them all takes longer."""


def fix_layout(figure: Figure) -> None:
    """Lay out once, not again for each file format, and without drawing anything for it."""
    FigureCanvasAgg(figure)  # without it, each size of a text would be measured by a renderer of its own
    letter(figure)
    if layout := figure.get_layout_engine():
        for panel in figure.axes:
            panel.get_tightbbox = _Surroundings(panel).box  # type: ignore[method-assign, assignment]
        try:
            layout.execute(figure)
        finally:
            for panel in figure.axes:
                del panel.get_tightbbox
    figure.set_layout_engine("none")
    for panel in figure.axes:
        panel.apply_aspect()


@contextmanager
def steady_ticks(panels: Sequence[Axes]) -> Iterator[None]:
    """Let Matplotlib place and measure the numbers along axes once, while nothing moves that they depend on.

    It would do so again for the edges, the labels and the axes themselves, four times for each picture. Not to be
    nested: the inner one would give the methods of the outer one back.
    """
    axes = [axis for panel in panels for axis in (panel.xaxis, panel.yaxis)]
    replaced = [(axis, name) for axis in axes for name in MEASURING if hasattr(axis, name)]
    for axis, name in replaced:
        setattr(axis, name, _first_result(getattr(axis, name)))
    try:
        yield
    finally:
        for axis, name in replaced:
            delattr(axis, name)


def _first_result(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function that computes at its first call, and returns that result at every later one."""
    results: list[Any] = []

    def first(*arguments: Any) -> Any:
        if not results:
            results.append(function(*arguments))
        return results[0]

    return first


class _Surroundings:
    """The labels and numbers around a panel, measured again only where other numbers come along its axes.

    The layout asks for it three times, of which all but the first find the same labels around another place. Legends
    and texts need not move with the edges of their panel: where there are some, all is measured each time.
    """

    def __init__(self, panel: Axes) -> None:
        self._panel = panel
        self._measure: Any = panel.get_tightbbox
        self._moves = bool(panel.get_legend() or panel.texts or panel.artists or panel.child_axes)
        self._numbers: tuple[bytes, ...] = ()
        self._beyond = np.zeros((2, 2))

    def box(self, renderer: Any, **options: Any) -> Any:
        """Return the box of the panel with its labels, pixels; arguments are those of Matplotlib's `get_tightbbox`."""
        panel = self._panel
        if self._moves or not panel.get_visible():
            return self._measure(renderer, **options)
        locator: Any = panel.get_axes_locator()  # None where the figure has not placed the panel itself
        panel.apply_aspect(locator(panel, renderer) if locator else None)
        numbers = tuple(np.asarray(axis.get_majorticklocs()).tobytes() for axis in (panel.xaxis, panel.yaxis))
        if numbers != self._numbers:
            with steady_ticks([panel]):
                self._beyond = self._measure(renderer, **options).get_points() - panel.bbox.get_points()
            self._numbers = numbers
        return Bbox(panel.bbox.get_points() + self._beyond)

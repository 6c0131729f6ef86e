"""Pictures of vibrations: the receptance of the tool over frequency with the modes marked, and shapes of the modes."""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.arrays import Array
from kinetostat.display import Scale
from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Configuration, Machine, setting_of
from kinetostat.studies.vibration import DRAWN_MODES, Vibration, frequency_range
from kinetostat.views.drawing import Points, add_overlay_legend, motion_overlay
from kinetostat.views.figures import COLOURS, DASHES, GUIDE_COLOUR, STYLE, grid_shape, new_figure
from kinetostat.views.question import Drawing
from kinetostat.views.rendering.camera import VIEWPOINTS, axes_towards
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.vibration import AXES, drawn_directions

AXES_IN_DIAGONAL = 10.0
"""Axes of the base that would fit into the diagonal of the machine, about: their length is rounded to one digit."""
ROOM = 0.1
"""Room on one side of a machine, as a share of its diagonal: its motion is drawn nearly so large."""
LEAST_GAP = 0.025
"""Least distance between the numbers of two modes, as a share of the width of a panel: two digits and a gap."""
ROOM_BESIDE, ROOM_ABOVE, HEADING_HEIGHT = 2.0 * ROOM, 3.5 * ROOM, 1.5 * ROOM
"""Room between machines side by side and below each other, and height of a heading above its machine, in diagonals: a
mode moves the machine to all sides, and a line of text stands above it."""
MACHINE_WIDTH = 2.4
"""Width of a machine with the room beside it, inches: a heading is as wide."""
RESPONSE_SIZE = (7.6, 5.6)
"""Width and height of the figure of a response, inches: a page wide, and four panels high enough for their scales."""
MODE_COLOUR = "#bbbbbb"
"""Pale grey of the lines at natural frequencies, which cross the curves."""
ROOM_FOR_TITLE, MARGINS = 0.9, 0.4
"""Height of title and legend of the shapes, and width of both margins of their figure, inches."""
AXES_CORNER = (0.5, 0.4)
"""Place of the origin of the axes, left of and below the machine, in units of the room beside it."""
LETTER_DISTANCE = 1.3
"""Place of the letter of an axis, in lengths of the axis: beyond its end."""
ANY_SIZE = "a mode has a shape, and no size: the motion is as large as can be seen"
"""Sentence below the shapes."""


def vibration_figures(answer: Vibration) -> dict[str, Drawing]:
    """Return the drawings of the vibrations of a machine, by name; none where there are no modes."""
    if not answer.modes:
        return {}
    response = "Motion of the tool per force along it: size, phase, real part and Nyquist curve."
    drawings = {"response": Drawing(response, partial(response_figure, answer))}
    if any(mode.shape is not None for mode in answer.modes[:DRAWN_MODES]):
        shapes = "Shapes of the first modes over the machine at rest."
        drawings["shapes"] = Drawing(shapes, partial(shapes_figure, answer))
    return drawings


def response_figure(answer: Vibration, title: str = "{}: motion of the tool per force") -> Figure:
    """Draw magnitude, phase and real part of the receptance over frequency, and the Nyquist curve.

    They are those along the direction that was asked for; along x, y and z if there was none.
    """
    machine, frequencies = answer.machine, frequency_range(answer)
    motors = "" if answer.loops is None else " with motors that stand still"
    legend = f"grey lines: natural frequencies{motors}, numbered from the lowest; circles: least real part, "
    legend += "which limits a cut"
    with new_figure(RESPONSE_SIZE, title.format(machine.name), setting_of(machine, []), legend) as figure:
        panels = _response_panels(figure)
        for place, (name, axis) in enumerate(drawn_directions(answer.direction, answer.components).items()):
            look = {"color": COLOURS[place], "linestyle": DASHES[place % len(DASHES)], "label": f"along {name}"}
            _draw_response(panels, answer, frequencies, axis, look)
        for panel in (panels.size, panels.phase, panels.real):
            _mark_modes(panel, answer, frequencies)
        _label_response(panels, machine.display.scale("m/N"))
        _number_modes(panels.size, answer, frequencies)
        panels.size.legend(loc="best")
    return figure


class ResponsePanels(NamedTuple):
    """The panels of a receptance: its magnitude, phase and real part over frequency, and the Nyquist curve."""

    size: Axes
    phase: Axes
    real: Axes
    nyquist: Axes


def _response_panels(figure: Figure) -> ResponsePanels:
    """Make the three panels over frequency below each other, and the one of the Nyquist curve beside them."""
    grid = figure.add_gridspec(3, 2, width_ratios=(1.5, 1.0), height_ratios=(1.25, 1.0, 1.0))
    size = figure.add_subplot(grid[0, 0])
    phase, real = (figure.add_subplot(grid[row, 0], sharex=size) for row in (1, 2))
    return ResponsePanels(size, phase, real, figure.add_subplot(grid[:, 1]))


def _draw_response(
    panels: ResponsePanels, answer: Vibration, frequencies: Array, axis: Sequence[float], look: dict[str, Any]
) -> None:
    """Draw the receptance along an axis, with a circle at the point that limits the width of a cut."""
    factor = answer.machine.display.scale("m/N").factor
    curve = answer.along(axis, frequencies.tolist()) * factor
    panels.size.loglog(frequencies, np.abs(curve), **look)
    panels.phase.semilogx(frequencies, np.degrees(np.unwrap(np.angle(curve))), **look)
    panels.real.semilogx(frequencies, curve.real, **look)
    softest = answer.softest(axis)
    if frequencies[0] <= softest.frequency <= frequencies[-1]:
        panels.real.plot(softest.frequency, softest.real * factor, "o", color=look["color"], ms=3.5, mfc="white")
    panels.nyquist.plot(curve.real, curve.imag, **look)


def _mark_modes(panel: Axes, answer: Vibration, frequencies: Array) -> None:
    """Draw a line at each natural frequency, and give the axis of frequencies numbers that can be read."""
    for mode in answer.modes:
        if frequencies[0] <= mode.frequency <= frequencies[-1]:
            panel.axvline(mode.frequency, color=MODE_COLOUR, linewidth=0.6, zorder=0)
    panel.margins(x=0.0)
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_formatter("")
    panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.label_outer()


def _label_response(panels: ResponsePanels, scale: Scale) -> None:
    panels.real.set_xlabel("frequency (Hz)")
    panels.size.yaxis.set_major_formatter("{x:g}")  # powers of ten would ask for a parser of mathematics
    panels.size.set_ylabel(scale.label("receptance"))
    panels.phase.set_ylabel("phase (deg)")
    panels.real.set_ylabel(scale.label("real part"))
    panels.nyquist.set(xlabel=scale.label("real part"), ylabel=scale.label("imaginary part"))
    panels.nyquist.margins(0.1)
    panels.nyquist.set_aspect("equal", adjustable="datalim")


def _number_modes(panel: Axes, answer: Vibration, frequencies: Array) -> None:
    """Write the numbers of the modes above their lines; of modes that are too near to each other, the lowest only."""
    next_free, gap = float(frequencies[0]), (frequencies[-1] / frequencies[0]) ** LEAST_GAP
    for number, mode in enumerate(answer.modes, 1):
        if next_free <= mode.frequency <= frequencies[-1]:
            place = (mode.frequency, 1.01)
            panel.annotate(str(number), place, xycoords=panel.get_xaxis_transform(), ha="center", va="bottom", size=7)
            next_free = mode.frequency * gap


def shapes_figure(answer: Vibration, title: str = "{}: shapes of modes") -> Figure:
    """Draw the shapes of the first modes over the machine at rest, seen from in front above; a planar one in plan.

    All stand side by side in one panel without numbers: a panel each takes twice the time."""
    machine, response = answer.machine, answer.state.free
    planar = response.configuration.plane is not None
    view = _view_of(machine, response.configuration)
    shown = [(k, mode, mode.shape) for k, mode in enumerate(answer.modes[:DRAWN_MODES], 1) if mode.shape is not None]
    rows, columns = grid_shape(len(shown))
    width = MARGINS + MACHINE_WIDTH * columns
    size = (width, ROOM_FOR_TITLE + width * rows * view.height / (columns * view.width))
    axis_length = float(f"{view.diagonal / AXES_IN_DIAGONAL:.0e}")
    with new_figure(size, title.format(machine.name)) as figure:
        panel = figure.add_subplot(aspect="equal")
        for number, mode, shape in shown:
            row, column = divmod(number - shown[0][0], columns)
            place = (column * view.width, -row * view.height)
            motion_overlay(machine, response, shape).draw(panel, partial(view.project, place=place))
            heading = f"{number}: {machine.display.show(mode.frequency, 'Hz')} (tool: {mode.direction})"
            panel.annotate(heading, view.heading(place), ha="center", va="bottom", size=STYLE["axes.titlesize"])
        _draw_axes(panel, view, axis_length, "xy" if planar else "xyz")
        left, top = view.low[0] - ROOM * view.diagonal, view.high[1] + (ROOM_ABOVE - ROOM) * view.diagonal
        panel.set(xlim=(left, left + columns * view.width), ylim=(top - rows * view.height, top))
        panel.set_axis_off()
        setting = f"{setting_of(machine, [])}; axes as long as {machine.display.show(axis_length, 'm')}\n{ANY_SIZE}"
        add_overlay_legend(figure, ("at rest", "in the mode"), setting)
    return figure


@dataclass(frozen=True)
class ShapeView:
    """A view of a machine that is drawn several times in one panel, once for each shape.

    Attributes:
        directions: the directions across and up in the picture, base axes [2 x 3].
        low, high: corners of the rectangle that holds the machine in the picture, m.
        diagonal: size of the machine, m.
    """

    directions: Array
    low: Array
    high: Array
    diagonal: float

    def project(self, points: Points, place: tuple[float, float] = (0.0, 0.0)) -> tuple[list[float], list[float]]:
        """Return coordinates across and up of points in the base frame, for a machine that stands at a place."""
        across, up = picture_coordinates(points, self.directions)
        return (across + place[0]).tolist(), (up + place[1]).tolist()

    @property
    def width(self) -> float:
        """Distance of a machine from the next one beside it, m."""
        return float(self.high[0] - self.low[0] + ROOM_BESIDE * self.diagonal)

    @property
    def height(self) -> float:
        """Distance of a machine from the next one below it, m."""
        return float(self.high[1] - self.low[1] + ROOM_ABOVE * self.diagonal)

    def heading(self, place: tuple[float, float]) -> tuple[float, float]:
        """Return the point above the machine at a place over which its heading stands."""
        middle = 0.5 * (self.low[0] + self.high[0])
        return middle + place[0], self.high[1] + place[1] + HEADING_HEIGHT * self.diagonal


def _view_of(machine: Machine, configuration: Configuration) -> ShapeView:
    """Choose the direction of view, and find what a machine takes up in it."""
    right, down, _ = axes_towards([-part for part in VIEWPOINTS["iso" if configuration.plane is None else "top"]])
    directions = np.stack([right, -down])
    points = [machine.tool_point(configuration.platform), *(point for leg in configuration.legs for point in leg.path)]
    picture = picture_coordinates(points, directions)
    return ShapeView(
        directions, picture.min(axis=1), picture.max(axis=1), proportions_of(machine, configuration).diagonal
    )


def picture_coordinates(points: Points, directions: Array) -> Array:
    """Return the coordinates of points along the directions of a picture [2 x points]."""
    return (np.array([point.components() for point in points]).reshape(-1, 3) @ directions.T).T


def _draw_axes(panel: Axes, view: ShapeView, length: float, names: str) -> None:
    """Draw axes of the base of a length (m) in the lower left corner of a picture, with their names."""
    corner = tuple(view.low - np.array(AXES_CORNER) * ROOM * view.diagonal)
    for name in names:
        axis = Vector(*AXES[name]) * length
        panel.plot(*view.project([ZERO, axis], corner), color=GUIDE_COLOUR, linewidth=0.8)
        (end,) = zip(*view.project([axis * LETTER_DISTANCE], corner), strict=True)
        panel.annotate(name, end, ha="center", va="center", size=7)

"""Pictures of vibrations: the receptance of the tool over frequency with the modes marked, and shapes of the modes."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.machine.machine import setting_of
from kinetostat.studies.vibration import DRAWN, Vibration, frequency_range
from kinetostat.views.drawing import Loop
from kinetostat.views.figures import COLOURS, DASHES, STYLE, new_figure
from kinetostat.views.loaded_figures import moved_legend, moved_machine
from kinetostat.views.question import Drawing
from kinetostat.views.rendering.camera import VIEWPOINTS, axes_towards
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.vibration import axis_of

MOST_COLUMNS = 3
"""Of the shapes of modes, side by side."""
AXES_IN_DIAGONAL = 10.0
"""Lengths of an axis of the base that is drawn, in the diagonal of the machine, about."""
ROOM = 0.1
"""Around each of them, as a share of the diagonal of the machine: its motion is drawn nearly so large."""
LEAST_GAP = 0.025
"""Least distance between the numbers of two modes, as a share of the width of a panel."""
ANY_SIZE = "a mode has a shape, and no size: the motion is as large as can be seen"
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
ORIGIN = Vector(0.0, 0.0, 0.0)


def vibration_figures(answer: Vibration) -> dict[str, Drawing]:
    """Drawings of the vibrations of a machine, by name; none where there are no modes."""
    if not answer.modes:
        return {}
    response = "Motion of the tool per force along it: size, phase, real part and Nyquist curve."
    drawings = {"response": Drawing(response, partial(response_figure, answer))}
    if any(mode.shape is not None for mode in answer.modes[:DRAWN]):
        shapes = "Shapes of the first modes over the machine at rest."
        drawings["shapes"] = Drawing(shapes, partial(shapes_figure, answer))
    return drawings


def response_figure(answer: Vibration, title: str = "{}: motion of the tool per force") -> Figure:
    """Draw magnitude, phase and real part of the receptance over frequency, and the Nyquist curve.

    Args:
        answer: an answer with modes; along x, y and z where it has no direction.
        title: over the figure, with braces for the name of the machine.
    """
    machine = answer.machine
    given = frequency_range(answer)
    scale = machine.display.scale("m/N")
    ways = {axis_of(answer.direction): answer.direction} if answer.direction else AXES
    ways = {name: way for name, way in ways.items() if name not in AXES or name in answer.components}
    still = "" if answer.loops is None else " with motors that stand still"
    about = f"grey lines: natural frequencies{still}, numbered from the lowest; circles: least real part, "
    about += "which limits a cut"
    with new_figure((7.6, 5.6), title.format(machine.name), setting_of(machine, []), about) as figure:
        grid = figure.add_gridspec(3, 2, width_ratios=(1.5, 1.0), height_ratios=(1.25, 1.0, 1.0))
        size = figure.add_subplot(grid[0, 0])
        phase, real = (figure.add_subplot(grid[row, 0], sharex=size) for row in (1, 2))
        nyquist = figure.add_subplot(grid[:, 1])
        for place, (name, way) in enumerate(ways.items()):
            curve = answer.along(way, given.tolist()) * scale.factor
            look = {"color": COLOURS[place], "linestyle": DASHES[place % len(DASHES)], "label": f"along {name}"}
            size.loglog(given, np.abs(curve), **look)
            phase.semilogx(given, np.degrees(np.unwrap(np.angle(curve))), **look)
            real.semilogx(given, curve.real, **look)
            softest = answer.softest(way)
            if given[0] <= softest.frequency <= given[-1]:  # the point that limits the width of a cut
                real.plot(
                    softest.frequency, softest.real * scale.factor, "o", color=COLOURS[place], ms=3.5, mfc="white"
                )
            nyquist.plot(curve.real, curve.imag, **look)
        for panel in (size, phase, real):
            for mode in answer.modes:
                if given[0] <= mode.frequency <= given[-1]:
                    panel.axvline(mode.frequency, color="#bbbbbb", linewidth=0.6, zorder=0)
            panel.margins(x=0.0)
            panel.xaxis.set_major_formatter("{x:g}")
            panel.xaxis.set_minor_formatter("")
            panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            panel.label_outer()
        real.set_xlabel("frequency (Hz)")
        size.yaxis.set_major_formatter("{x:g}")  # powers of ten would ask for a parser of mathematics
        size.set_ylabel(scale.label("receptance"))
        phase.set_ylabel("phase (deg)")
        real.set_ylabel(scale.label("real part"))
        nyquist.set(xlabel=scale.label("real part"), ylabel=scale.label("imaginary part"))
        nyquist.margins(0.1)
        nyquist.set_aspect("equal", adjustable="datalim")
        _number_modes(size, answer, given)
        size.legend(loc="best")
    return figure


def _number_modes(panel: Axes, answer: Vibration, given: Array) -> None:
    """Write the numbers of the modes above their lines; of modes that are too near to each other, the lowest only."""
    free, room = float(given[0]), (given[-1] / given[0]) ** LEAST_GAP
    for number, mode in enumerate(answer.modes, 1):
        if free <= mode.frequency <= given[-1]:
            place = (mode.frequency, 1.01)
            panel.annotate(str(number), place, xycoords=panel.get_xaxis_transform(), ha="center", va="bottom", size=7)
            free = mode.frequency * room


def shapes_figure(answer: Vibration, title: str = "{}: shapes of modes") -> Figure:
    """Draw the shapes of the first modes over the machine at rest, seen from in front above; a planar one in plan.

    All stand side by side in one panel without numbers: a panel each takes twice the time.

    Args:
        answer: an answer with modes.
        title: over the figure, with braces for the name of the machine.
    """
    machine, response = answer.machine, answer.state.free
    configuration, display = response.configuration, machine.display
    planar = configuration.plane is not None
    right, down, _ = axes_towards([-part for part in VIEWPOINTS["top" if planar else "iso"]])
    diagonal = proportions_of(machine, configuration).diagonal
    axis = float(f"{diagonal / AXES_IN_DIAGONAL:.0e}")

    def project(points: Loop, place: tuple[float, float] = (0.0, 0.0)) -> tuple[list[float], list[float]]:
        across, up = (np.array([point.components() for point in points]).reshape(-1, 3) @ np.stack([right, -down]).T).T
        return (across + place[0]).tolist(), (up + place[1]).tolist()

    points = [machine.tool_point(configuration.platform), *(point for leg in configuration.legs for point in leg.path)]
    low, high = (np.array([bound(part) for part in project(points)]) for bound in (min, max))
    width, height = (
        high - low + np.array([2.0, 3.5]) * ROOM * diagonal
    )  # a mode moves to all sides; a line stands above
    shown = [(k, mode, mode.shape) for k, mode in enumerate(answer.modes[:DRAWN], 1) if mode.shape is not None]
    columns = min(MOST_COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    across = 0.4 + 2.4 * columns
    with new_figure((across, 0.9 + across * rows * height / (columns * width)), title.format(machine.name)) as figure:
        panel = figure.add_subplot(aspect="equal")
        for number, mode, shape in shown:
            row, column = divmod(number - shown[0][0], columns)
            place = (column * width, -row * height)
            moved_machine(machine, response, shape)[0](panel, partial(project, place=place))
            heading = f"{number}: {display.show(mode.frequency, 'Hz')} (tool: {mode.direction})"
            middle = (0.5 * (low[0] + high[0]) + place[0], high[1] + place[1] + 1.5 * ROOM * diagonal)
            panel.annotate(heading, middle, ha="center", va="bottom", size=STYLE["axes.titlesize"])
        corner = tuple(low - np.array([0.5, 0.4]) * ROOM * diagonal)
        for name in "xy" if planar else "xyz":
            way = Vector(*AXES[name]) * axis
            panel.plot(*project([ORIGIN, way], corner), color="#444444", linewidth=0.8)
            (end,) = zip(*project([way * 1.3], corner), strict=True)
            panel.annotate(name, end, ha="center", va="center", size=7)
        left, top = low[0] - ROOM * diagonal, high[1] + 2.5 * ROOM * diagonal
        panel.set(xlim=(left, left + columns * width), ylim=(top - rows * height, top))
        panel.set_axis_off()
        setting = f"{setting_of(machine, [])}; axes as long as {display.show(axis, 'm')}\n{ANY_SIZE}"
        moved_legend(figure, ("at rest", "in the mode"), setting)
    return figure

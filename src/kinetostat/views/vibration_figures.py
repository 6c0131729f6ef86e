"""Pictures of vibrations: the receptance of the tool over frequency with the modes marked, and shapes of the modes."""

from collections.abc import Sequence
from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from kinetostat.arrays import Array
from kinetostat.kinetostatics.response import respond
from kinetostat.studies.setting import setting_of
from kinetostat.studies.vibration import DRAWN, Vibration, frequency_range
from kinetostat.views.figures import COLOURS, DASHES, STYLE, Drawings, fix_layout, note_setting, set_title
from kinetostat.views.loaded_figures import moved_figure
from kinetostat.views.vibration_tables import axis_of

LEAST_GAP = 0.025
"""Least distance between the numbers of two modes, as a share of the width of a panel."""
ANY_SIZE = "a mode has a shape, and no size: the motion is as large as can be seen"
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def vibration_figures(answer: Vibration, direction: Sequence[float] = (), frequencies: Array | None = None) -> Drawings:
    """The functions that draw the vibrations of a machine, by name; none where there are no modes."""
    if not answer.modes:
        return {}
    drawn: Drawings = {"response": partial(response_figure, answer, direction, frequencies)}
    return drawn | {f"mode-{k + 1}": partial(shape_figure, answer, k) for k in range(min(DRAWN, len(answer.modes)))}


def response_figure(
    answer: Vibration,
    direction: Sequence[float] = (),
    frequencies: Array | None = None,
    title: str = "{}: motion of the tool per force",
) -> Figure:
    """Draw magnitude, phase and real part of the receptance over frequency, and the Nyquist curve.

    Args:
        answer: with its modes.
        direction: in which the tool is pushed, base axes; along x, y and z if empty.
        frequencies: Hz; about the first six modes if None.
        title: over the figure, with braces for the name of the machine.
    """
    machine = answer.machine
    given = frequency_range(answer) if frequencies is None else frequencies
    scale = machine.display.scale("m/N")
    ways = {axis_of(direction): tuple(direction)} if direction else AXES
    ways = {name: way for name, way in ways.items() if name not in AXES or name in answer.components}
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.6, 5.6), layout="constrained")
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
        size.set_ylabel(scale.label("receptance"))
        phase.set_ylabel("phase (deg)")
        real.set_ylabel(scale.label("real part"))
        nyquist.set(xlabel=scale.label("real part"), ylabel=scale.label("imaginary part"))
        nyquist.margins(0.1)
        nyquist.set_aspect("equal", adjustable="datalim")
        _number_modes(size, answer, given)
        size.legend(loc="best")
        set_title(figure, title.format(machine.name))
        about = (
            "grey lines: natural frequencies, numbered from the lowest; circles: least real part, which limits a cut"
        )
        note_setting(figure, setting_of(machine, []), about)
        fix_layout(figure)
    return figure


def _number_modes(panel: Axes, answer: Vibration, given: Array) -> None:
    """Write the numbers of the modes above their lines; of modes that are too near to each other, the lowest only."""
    free, room = float(given[0]), (given[-1] / given[0]) ** LEAST_GAP
    for number, mode in enumerate(answer.modes, 1):
        if free <= mode.frequency <= given[-1]:
            place = (mode.frequency, 1.01)
            panel.annotate(str(number), place, xycoords=panel.get_xaxis_transform(), ha="center", va="bottom", size=7)
            free = mode.frequency * room


def shape_figure(answer: Vibration, number: int, title: str = "{}: mode {} at {}") -> Figure:
    """Draw the shape of a mode over the machine at rest, in front, side and plan.

    Args:
        answer: with its modes.
        number: of the mode, from 0.
        title: over the figure, with braces for the machine, the number from 1 and the frequency.

    Raises:
        IndexError: there is no such mode.
    """
    machine, mode = answer.machine, answer.modes[number]
    if mode.shape is None:
        raise IndexError(number)
    heading = title.format(machine.name, number + 1, machine.display.show(mode.frequency, "Hz"))
    return moved_figure(machine, respond(machine), mode.shape, heading, ("at rest", "in the mode"), size=ANY_SIZE)

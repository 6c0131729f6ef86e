"""Pictures of vibrations: the receptance of the tool over frequency with the modes marked, and shapes of the modes."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from kinetostat.arrays import Array
from kinetostat.machine.machine import setting_of
from kinetostat.studies.vibration import DRAWN, Vibration, frequency_range
from kinetostat.views.figures import COLOURS, DASHES, new_figure
from kinetostat.views.loaded_figures import moved_figure
from kinetostat.views.question import Drawing
from kinetostat.views.vibration import axis_of

IN_REPORTS = 3
"""Modes of which reports draw the shape."""
LEAST_GAP = 0.025
"""Least distance between the numbers of two modes, as a share of the width of a panel."""
ANY_SIZE = "a mode has a shape, and no size: the motion is as large as can be seen"
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def vibration_figures(answer: Vibration) -> dict[str, Drawing]:
    """Drawings of the vibrations of a machine, by name; none where there are no modes."""
    if not answer.modes:
        return {}
    response = "Motion of the tool per force along it: size, phase, real part and Nyquist curve."
    shapes = {
        f"mode-{k + 1}": Drawing(
            f"Shape of mode {k + 1}, {answer.machine.display.show(mode.frequency, 'Hz')}.",
            partial(shape_figure, answer, k),
            minor=k >= IN_REPORTS or mode.shape is None,
        )
        for k, mode in enumerate(answer.modes[:DRAWN])
    }
    return {"response": Drawing(response, partial(response_figure, answer)), **shapes}


def response_figure(answer: Vibration, title: str = "{}: motion of the tool per force") -> Figure:
    """Draw magnitude, phase and real part of the receptance over frequency, and the Nyquist curve.

    Args:
        answer: with its modes; along x, y and z where it has no direction.
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
    return moved_figure(machine, answer.state.free, mode.shape, heading, ("at rest", "in the mode"), size=ANY_SIZE)

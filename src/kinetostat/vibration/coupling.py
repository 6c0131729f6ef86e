"""A tool with its holder coupled to the machine, from its own receptance, as it was measured or computed free.

The holder is held at its flange, which is the tool point of the machine: there both move alike and push each other.
Nothing is read from files here.

Source: theory (108); R. E. D. Bishop and D. C. Johnson, The Mechanics of Vibration (1960); T. L. Schmitz and R. R.
Donaldson, "Predicting high-speed machining dynamics by substructure analysis", CIRP Annals 49 (2000). SI, base axes.
"""

from typing import Any

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.frozen import dataclass


@dataclass(frozen=True)
class FreeTool:
    """The receptance of a tool with its holder while nothing holds it.

    Attributes:
        frequencies: Hz, ascending [f].
        tip: components of its tip that are known, places in rx ry rz x y z [t].
        flange: components in which it is coupled at its flange, the same way [c].
        tip_tip: motion of the tip per wrench on it, rad and m per N·m and N [f x t x t].
        tip_flange: motion of the tip per wrench on the flange [f x t x c].
        flange_flange: motion of the flange per wrench on it [f x c x c].
    """

    frequencies: Array
    tip: tuple[int, ...]
    flange: tuple[int, ...]
    tip_tip: Complex
    tip_flange: Complex
    flange_flange: Complex

    @property
    def search_frequencies(self) -> Array:
        """Frequencies that are close enough to follow it: its own, and some between them, Hz."""
        between = [self.frequencies[:-1] + share * np.diff(self.frequencies) for share in (0.25, 0.5, 0.75)]
        return np.unique(np.concatenate([self.frequencies, *between]))


def couple(machine: Complex, tool: FreeTool, frequencies: Array) -> Complex:
    """Couple a tool to a machine: motion of its tip per wrench on it, rad and m per N·m and N [n x 6 x 6].

    Components that the tool does not give for its tip are those of the flange, where a wrench then acts on the machine.

    Args:
        machine: receptance at the tool point, base axes [n x 6 x 6].
        tool: between its frequencies, straight lines are followed.
        frequencies: within those of the tool, Hz [n].
    """
    receptances = tool.tip_tip, tool.tip_flange, tool.flange_flange
    at_tip, across, at_flange = (_interpolate(tool, values, frequencies) for values in receptances)
    tip, flange = list(tool.tip), list(tool.flange)
    rest = [part for part in range(6) if part not in tip]
    # Apart, each unit wrench moves the flange of the tool, or that of the machine: forces between both close this gap.
    gaps = np.zeros((len(frequencies), len(flange), 6), dtype=complex)
    gaps[:, :, tip] = np.swapaxes(across, 1, 2)
    gaps[:, :, rest] = -machine[:, flange][:, :, rest]
    forces = np.linalg.solve(at_flange + machine[:, flange][:, :, flange], gaps)
    result = np.zeros((len(frequencies), 6, 6), dtype=complex)
    for part in rest:
        result[:, part, rest] = machine[:, part][:, rest]
        result[:, part] += np.einsum("fc,fcw->fw", machine[:, part][:, flange], forces)
    for place, part in enumerate(tip):
        result[:, part, tip] = at_tip[:, place]
        result[:, part] -= np.einsum("fc,fcw->fw", across[:, place], forces)
    return result


def _interpolate(tool: FreeTool, values: Complex, frequencies: Array) -> Any:
    """Values at frequencies between those of a tool, along straight lines [n x ...]."""
    place = np.clip(np.searchsorted(tool.frequencies, frequencies) - 1, 0, len(tool.frequencies) - 2)
    start, end = tool.frequencies[place], tool.frequencies[place + 1]
    share = ((frequencies - start) / (end - start))[:, None, None]
    return (1.0 - share) * values[place] + share * values[place + 1]

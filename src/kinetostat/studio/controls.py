"""The numbers of a machine as sliders: which there are, in which panel, over which range. Knows no page."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, parameters, values
from kinetostat.studio.wording import VECTORS, label

PANELS = ("Pose", "Geometry", "Stiffness", "Load")
STEPS = 1000
"""Positions of a slider."""
AROUND = 0.75
"""How far a length varies about its value: in units of the machine's length in the pose, of itself elsewhere."""
TURN = {"pose": math.radians(40.0), "geometry": math.radians(30.0)}
FACTOR = 1e3
"""How far a stiffness varies about its value, up and down."""
USUAL_STIFFNESS = 1e6
"""Middle of the range of a stiffness that is rigid or free, SI."""
LARGEST_LOAD = {"force": 1000.0, "moment": 100.0}
"""Ends of the range of a load that is zero: N, N·m."""


@dataclass(frozen=True)
class Control:
    """One number, or one field whose entries move together.

    Attributes:
        parameter: what it sets.
        panel: one of `PANELS`.
        group: heading within the panel.
        low, high: ends of its slider, SI; equal where there is none.
        logarithmic: whether positions are spaced by a constant factor; of a stiffness the
            first is 0 and the last is "rigid".
    """

    parameter: Parameter
    panel: str
    group: str
    low: float
    high: float
    logarithmic: bool

    @property
    def path(self) -> str:
        """Of its parameter."""
        return self.parameter.path

    @property
    def label(self) -> str:
        """For people."""
        return label(self.parameter)

    @property
    def slides(self) -> bool:
        """Whether it has a slider; limits are typed only."""
        return self.low < self.high

    def value_at(self, position: int) -> float:
        """The SI value at a position from 0 to `STEPS`."""
        share = min(max(position, 0), STEPS) / STEPS
        if not self.logarithmic:
            return self.low + (self.high - self.low) * share
        if self.parameter.quantity.stiff and share in (0.0, 1.0):
            return math.inf if share else 0.0
        return float(f"{self.low * (self.high / self.low) ** share:.4g}")

    def position_of(self, value: float) -> int:
        """The position nearest to a value."""
        if not self.slides:
            return 0
        if not self.logarithmic:
            share = (value - self.low) / (self.high - self.low)
        elif 0.0 < value < math.inf:
            share = math.log(value / self.low) / math.log(self.high / self.low)
        else:
            share = float(value > 0.0)
        return round(STEPS * min(max(share, 0.0), 1.0))


def controls(machine: Machine, length: float) -> tuple[Control, ...]:
    """All controls of a machine, in the order of its file.

    Args:
        machine: whose present numbers the ranges lie about.
        length: its characteristic length, m.
    """
    held = values(machine)
    return tuple(_control(parameter, held, length) for parameter in _shown(machine, held))


def _shown(machine: Machine, held: dict[str, float]) -> Iterator[Parameter]:
    """Fields whose entries are alike in kind and value are one control beside those of the entries."""
    for parameter in parameters(machine.family):
        several = len(parameter.leaves) > 1
        alike = len({held[leaf] for leaf in parameter.leaves}) == 1
        vector = parameter.path.split(".")[-1] in VECTORS
        if not several or (not vector and (alike or parameter.quantity.stiff)):
            yield parameter


def _control(parameter: Parameter, held: dict[str, float], length: float) -> Control:
    section = parameter.path.split(".")[0]
    value, quantity = held[parameter.leaves[0]], parameter.quantity
    panel = "Stiffness" if quantity.stiff else {"pose": "Pose", "geometry": "Geometry"}.get(section, "Geometry")
    panel = "Load" if section in ("load", "tool", "limits") else panel
    group = parameter.path.rsplit(".", 2 if parameter.path.split(".")[-1].isdecimal() else 1)[0].replace(".", " ")
    if quantity.unset is not None:
        return Control(parameter, panel, group, 0.0, 0.0, False)
    low, high, logarithmic = _range(quantity.kind, quantity.stiff, value, section, length)
    if quantity.positive:
        low = max(low, 0.02 * high)
    return Control(parameter, panel, group, low, min(high, quantity.most), logarithmic)


def _range(kind: str, stiff: bool, value: float, section: str, length: float) -> tuple[float, float, bool]:
    """Ends of a slider and whether it is logarithmic."""
    if stiff:
        middle = value if 0.0 < value < math.inf else USUAL_STIFFNESS
        return middle / FACTOR, middle * FACTOR, True
    if kind == "angle":
        around = TURN.get(section, TURN["geometry"])
        return value - around, value + around, False
    if kind == "length":
        around = AROUND * (length if section == "pose" or value == 0.0 else abs(value))
        return value - around, value + around, False
    if kind in LARGEST_LOAD:
        most = max(LARGEST_LOAD[kind], 2.0 * abs(value))
        return -most, most, False
    if kind == "direction":
        return -1.0, 1.0, False
    return value / 10.0, value * 10.0, True

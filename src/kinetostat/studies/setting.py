"""Where numbers of a machine hold, in words: reference point, axes, and the pose as far as it does not vary."""

import math
from collections.abc import Collection

from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.units import KINDS


def frame_of(machine: Machine, axes: str = "base") -> str:
    """The point to which K and C of a machine refer, and their axes, "base" or "platform"."""
    return f"{axes} axes at the {machine.reference}"


def pose_of(machine: Machine, varied: Collection[str] = ()) -> str:
    """The coordinates of its pose but those that vary, lengths in mm, angles in degrees; empty where all vary."""
    held = values(machine)
    found = [p for p in parameters(machine.family) if p.path.startswith("pose.") and p.path not in varied]
    return ", ".join(f"{p.path.removeprefix('pose.')} {_shown(float(held[p.path]), p.quantity.kind)}" for p in found)


def setting_of(machine: Machine, varied: Collection[str] = ()) -> str:
    """Frame and pose in one line, arguments as for `pose_of`."""
    return "; ".join(text for text in (frame_of(machine), pose_of(machine, varied)) if text)


def _shown(value: float, kind: str) -> str:
    scale, unit = {"length": (1e3, "mm"), "angle": (180.0 / math.pi, "deg")}.get(kind, (1.0, KINDS[kind].unit))
    return f"{value * scale + 0.0:.6g} {unit}".rstrip()

"""Captions of results: their reference point, their axes, and the coordinates of the pose that do not vary."""

from collections.abc import Collection

from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.units import KINDS

DIGITS = 6
"""Digits of a coordinate, which people have written themselves."""


def frame_of(machine: Machine, axes: str = "base") -> str:
    """Name the axes, "base" or "platform", and the point to which K and C of a machine refer."""
    return f"{axes} axes at the {machine.reference}"


def pose_of(machine: Machine, varied: Collection[str] = ()) -> str:
    """List the coordinates of the pose that do not vary, in the units of its display; empty where all vary."""
    here = values(machine)
    fixed = [p for p in parameters(machine.family) if p.path.startswith("pose.") and p.path not in varied]
    shown = (machine.display.show(float(here[p.path]), KINDS[p.quantity.kind].unit, digits=DIGITS) for p in fixed)
    return ", ".join(f"{p.path.removeprefix('pose.')} {text}" for p, text in zip(fixed, shown, strict=True))


def setting_of(machine: Machine, varied: Collection[str] = ()) -> str:
    """Write frame and pose in one line; the arguments are those of `pose_of`."""
    return "; ".join(text for text in (frame_of(machine), pose_of(machine, varied)) if text)

"""Captions of results: their reference point, their axes, and the coordinates of the pose that do not vary."""

import math
from collections.abc import Collection

from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.units import KINDS


def frame_of(machine: Machine, axes: str = "base") -> str:
    """Name the axes, "base" or "platform", and the point to which K and C of a machine refer."""
    return f"{axes} axes at the {machine.reference}"


def pose_of(machine: Machine, varied: Collection[str] = ()) -> str:
    """List the coordinates of the pose that do not vary, lengths in mm, angles in degrees; empty where all vary."""
    here = values(machine)
    fixed = [p for p in parameters(machine.family) if p.path.startswith("pose.") and p.path not in varied]
    return ", ".join(f"{p.path.removeprefix('pose.')} {_shown(float(here[p.path]), p.quantity.kind)}" for p in fixed)


def setting_of(machine: Machine, varied: Collection[str] = ()) -> str:
    """Write frame and pose in one line; the arguments are those of `pose_of`."""
    return "; ".join(text for text in (frame_of(machine), pose_of(machine, varied)) if text)


def _shown(value: float, kind: str) -> str:
    scale, unit = {"length": (1e3, "mm"), "angle": (180.0 / math.pi, "deg")}.get(kind, (1.0, KINDS[kind].unit))
    return f"{value * scale + 0.0:.6g} {unit}".rstrip()

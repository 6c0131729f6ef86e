"""Errors of the numbers of a family that several legs share, such as its base radius: combinations of those of legs.

Where such a number changes, joints lie elsewhere at the home place and actuators count from elsewhere. The rates of
both make one error of them, which is exact for what enters linearly.

Source: theory (49).
"""

from collections.abc import Iterator

import numpy as np

from kinetostat.accuracy.errors import Insertion, MachineError, Source
from kinetostat.accuracy.rows import Rows, Unit, rows_of
from kinetostat.arrays import Array
from kinetostat.equilibrium.motion import Motions, logarithm
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

STEP = 1e-5
"""Of central differences, rad or in units of the machine's length: what they leave out is its square."""
GEOMETRY = "geometry."


def shared_errors(machine: Machine, rows: Rows) -> list[Source]:
    """List the lengths and angles of the table [geometry] of a family; none of a machine written leg by leg.

    Args:
        machine: with numbers.
        rows: the machine at its home place.
    """
    if machine.family.chains:
        return []
    given, sources = values(machine), []
    fields = {leaf: p for p in parameters(machine.family) if p.path.startswith(GEOMETRY) for leaf in p.leaves}
    for path, field in fields.items():
        kind = field.quantity.kind
        if kind not in ("length", "angle"):
            continue
        step = STEP * (rows.length if kind == "length" else 1.0)
        more, less = (rows_of(with_values(machine, {path: float(given[path]) + s * step})) for s in (1.0, -1.0))
        insertions = tuple(_insertions(rows, more, less, 2.0 * step))
        if insertions and all(np.isfinite(insertion.twist).all() for insertion in insertions):
            sources.append((MachineError(path, kind, "shared", field.quantity.meaning, ""), insertions))
    return sources


def _insertions(rows: Rows, more: Rows, less: Rows, step: float) -> Iterator[Insertion]:
    """Change of the legs per unit of a number, from the machine with more and less of it."""
    home = Motions(more.rotation[None], more.point[None]) @ Motions(less.rotation[None], less.point[None]).inverse()
    platform = logarithm(home)[0] / step
    for number, row in enumerate(rows.legs):
        legs = more.legs[number], less.legs[number]
        for place, unit in enumerate(row.units):
            units = legs[0].units[place], legs[1].units[place]
            for motion in range(unit.first, unit.last):
                twist = _moved(motion, unit, *units) / step
                if twist.any():
                    yield Insertion(number, motion, twist)
                    yield Insertion(number, motion + 1, -twist)
            drives = units[0].drive, units[1].drive
            if unit.drive and drives[0] and drives[1] and drives[0].home != drives[1].home:
                rate = unit.drive.sense * (drives[1].home - drives[0].home) / step
                yield Insertion(number, unit.first, row.twists[unit.first] * rate)
        if platform.any():
            yield Insertion(number, len(row.twists), platform)


def _moved(motion: int, unit: Unit, more: Unit, less: Unit) -> Array:
    """The screw motion that takes the axis of a motion from one place to another [6]."""
    which = motion - unit.first
    axis = 0 if unit.bars else which
    turning = less.axes[axis].cross(more.axes[axis])
    points = [end.bars.far if end.bars and which else end.point for end in (unit, more, less)]
    if points[0] is None or points[1] is None or points[2] is None or unit.kind == "slide":
        return np.array([*turning.components(), 0.0, 0.0, 0.0], dtype=float)
    shift = points[0].cross(turning) + points[1] - points[2]
    return np.array([*turning.components(), *shift.components()], dtype=float)

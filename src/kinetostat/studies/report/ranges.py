"""Over which two coordinates of its pose a machine is mapped, and how far, where nobody says it."""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import Array, Table
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, parameters, values
from kinetostat.spec.ranges import parse_range

PROBES = 48
"""Steps to each side in which it is tried how far a coordinate goes."""
NEAR = {"length": 0.3, "angle": math.radians(15.0)}
"""Farthest from the pose, by kind: in units of the characteristic length, and in rad."""
FAR = {"length": 1.0, "angle": math.radians(90.0)}
"""Likewise of a machine whose file has limits, which then say how far it goes."""
REGULAR = 0.1
"""Share of the pose's singularity margin that is kept, so that maps are not about singularities."""
SLACK = 1e-6
"""Of a step, within which an end counts as round already."""
UNIT = {"length": 1.0, "angle": math.radians(1.0)}
"""In which numbers of a kind are round."""


def usual_ranges(machine: Machine, count: int) -> list[str]:
    """Two ranges "pose.x=from:to:count" about the pose, translations first; fewer where fewer coordinates can change.

    Each coordinate goes as far as the machine can follow while the others stay: within its limits if the file has some,
    else not far from the pose, and never near a singularity.

    Args:
        machine: whose pose has an answer.
        count: of points of each.
    """
    limited = machine.tables["limits"]
    kinds = FAR if any(map(is_set, vars(limited).values())) else NEAR
    coordinates = [p for p in parameters(machine.family) if p.path.startswith("pose.") and len(p.leaves) == 1]
    ordered = sorted(coordinates, key=lambda p: p.quantity.kind != "length")
    length, found = float(respond(machine).configuration.length), []
    for parameter in ordered:
        reach = kinds[parameter.quantity.kind] * (length if parameter.quantity.kind == "length" else 1.0)
        low, high = _extent(machine, parameter, reach)
        if high > low:
            found.append(f"{parameter.path}={low:.9g}:{high:.9g}:{count}")
        if len(found) == 2:
            break
    return found


def coarser(ranges: Sequence[str], most: int) -> list[str]:
    """The same ranges "FIELD=from:to:count[:log]" with at most that many points each.

    Raises:
        InputError: not of that form.
    """
    read = [parse_range(text) for text in ranges]
    return [
        f"{one.field}={one.start}:{one.end}:{min(one.count, most)}{':log' if one.logarithmic else ''}" for one in read
    ]


def _extent(machine: Machine, parameter: Parameter, reach: float) -> tuple[float, float]:
    """How far a coordinate goes to each side, SI, before there is no good answer."""
    (path,), here = parameter.leaves, float(values(machine)[parameter.path])
    steps = np.linspace(-reach, reach, 2 * PROBES + 1)
    answer = evaluate(machine, Table({path: here + steps}), ["singularity_margin"])
    singularity_margin = np.nan_to_num(answer.values["singularity_margin"])
    good = (answer.status == Status.OK) & (singularity_margin >= REGULAR * singularity_margin[PROBES])
    bad = np.flatnonzero(~good)
    first = bad[bad < PROBES].max(initial=-1) + 1
    last = bad[bad > PROBES].min(initial=len(steps)) - 1
    return _rounded(here + steps[[first, last]], UNIT[parameter.quantity.kind])


def _rounded(ends: Array, unit: float) -> tuple[float, float]:
    """The ends, inwards to numbers that are round to a tenth of the range or less."""
    low, high = (float(end) for end in ends)
    if high == low:
        return low, high
    step = 10.0 ** math.floor(math.log10((high - low) / unit / 10.0)) * unit
    return math.ceil(low / step - SLACK) * step, math.floor(high / step + SLACK) * step

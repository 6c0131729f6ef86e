"""Ranges of the pose for maps for which none are given: as far as the machine can follow. Nothing is mapped here."""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.status import Status
from kinetostat.machine.limits import limits_set
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, parameters, values
from kinetostat.spec.ranges import parse_range

MOST_RANGES = 2
"""Greatest number of ranges, because a map has two axes."""
PROBE_STEPS = 48
"""Number of poses to each side that are tried along a coordinate."""
LARGEST_REACH = {"length": 0.3, "angle": math.radians(15.0)}
"""Largest distance from the pose, by kind of coordinate: in units of the characteristic length, and in rad."""
LARGEST_REACH_IN_LIMITS = {"length": 1.0, "angle": math.radians(90.0)}
"""The same for a machine whose file has limits, which then end its ranges."""
LEAST_MARGIN_SHARE = 0.1
"""Least singularity margin in a range, as a share of that of the pose: near a singularity a map shows nothing else."""
ROUND_SLACK = 1e-6
"""Share of a step within which an end counts as round already."""
ROUND_UNIT = {"length": 1.0, "angle": math.radians(1.0)}
"""Unit in which coordinates of a kind are round numbers."""


def usual_ranges(machine: Machine, count: int) -> list[str]:
    """Two ranges "pose.x=from:to:count" about the pose, translations first; fewer where fewer coordinates can change.

    Each coordinate goes as far as the machine can follow while the others stay: within its limits if the file has some,
    else not far from the pose, and never near a singularity.

    Args:
        machine: a machine whose pose has an answer.
        count: number of points of each range.
    """
    reaches = LARGEST_REACH_IN_LIMITS if limits_set(machine.tables["limits"]) else LARGEST_REACH
    coordinates = [p for p in parameters(machine.family) if p.path.startswith("pose.") and len(p.leaves) == 1]
    ordered = sorted(coordinates, key=lambda p: p.quantity.kind != "length")
    length, ranges = float(state_of(machine).configuration.length), []
    for parameter in ordered:
        reach = reaches[parameter.quantity.kind] * (length if parameter.quantity.kind == "length" else 1.0)
        low, high = _extent(machine, parameter, reach)
        if high > low:
            ranges.append(f"{parameter.path}={low:.9g}:{high:.9g}:{count}")
        if len(ranges) == MOST_RANGES:
            break
    return ranges


def coarser_ranges(ranges: Sequence[str], most: int) -> list[str]:
    """The same ranges "FIELD=from:to:count[:log]" with at most `most` points each.

    Raises:
        InputError: a text that is not of that form.
    """
    spans = [parse_range(text) for text in ranges]
    return [
        f"{span.field}={span.start}:{span.end}:{min(span.count, most)}{':log' if span.logarithmic else ''}"
        for span in spans
    ]


def _extent(machine: Machine, parameter: Parameter, reach: float) -> tuple[float, float]:
    """Both ends of the range of a coordinate, SI: the farthest poses without a bad one before them."""
    (path,), here = parameter.leaves, float(values(machine)[parameter.path])
    steps = np.linspace(-reach, reach, 2 * PROBE_STEPS + 1)
    answer = evaluate(machine, PointTable({path: here + steps}), ["singularity_margin"])
    singularity_margin = np.nan_to_num(answer.values["singularity_margin"])
    good = (answer.status == Status.OK) & (singularity_margin >= LEAST_MARGIN_SHARE * singularity_margin[PROBE_STEPS])
    bad = np.flatnonzero(~good)
    first = bad[bad < PROBE_STEPS].max(initial=-1) + 1
    last = bad[bad > PROBE_STEPS].min(initial=len(steps)) - 1
    return _rounded_inwards(here + steps[[first, last]], ROUND_UNIT[parameter.quantity.kind])


def _rounded_inwards(ends: Array, unit: float) -> tuple[float, float]:
    """Move both ends inwards to round numbers, by a tenth of the range at most."""
    low, high = (float(end) for end in ends)
    if high == low:
        return low, high
    step = 10.0 ** math.floor(math.log10((high - low) / unit / 10.0)) * unit
    return math.ceil(low / step - ROUND_SLACK) * step, math.floor(high / step + ROUND_SLACK) * step

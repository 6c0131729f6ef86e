"""What a set of poses asks of legs, joints and actuators: the figures by which they are chosen, limited or not."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from kinetostat.engine.batch import limits_used
from kinetostat.engine.points import Array
from kinetostat.machine.limits import LIMITS, Limit, Limits
from kinetostat.machine.machine import Machine
from kinetostat.units import as_read


@dataclass(frozen=True)
class Demand:
    """The range of what a limit is about.

    Attributes:
        name: of the limit.
        title: for people.
        least, greatest: over all poses and parts, in the unit.
        unit: m, deg, N or N·m.
    """

    name: str
    title: str
    least: float
    greatest: float
    unit: str


def demands(machine: Machine, poses: Mapping[str, Array]) -> tuple[Demand, ...]:
    """What poses that can be reached ask of a machine; nothing where there are none.

    Args:
        machine: with its load.
        poses: coordinates by leaf path, SI [poses].
    """
    if not next(iter(poses.values())).size:
        return ()
    # A limit is compared with the poses only where it is set; how high it is set does not change what it is about.
    watched = replace(machine, tables={**machine.tables, "limits": Limits(**dict.fromkeys(LIMITS, 1.0))})
    ranges = limits_used(watched, poses)
    last = {limit.title: limit for limit in LIMITS.values()}  # the least and the greatest length share one range
    return tuple(_demand(limit, ranges[limit.name]) for limit in last.values() if limit.name in ranges)


def _demand(limit: Limit, ends: tuple[float, float]) -> Demand:
    (least, unit), (greatest, _) = (as_read(number, limit.unit) for number in sorted(map(limit.shown, ends)))
    return Demand(limit.name, limit.title, least, greatest, unit)

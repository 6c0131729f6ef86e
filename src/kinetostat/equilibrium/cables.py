"""Cables that hold a platform at n poses: their lines, their tensions, and the wrenches that they can hold.

Cables are straight here, so that the platform's pose alone says along which lines they pull, whatever stretches. A
machine is one of cables if each of its legs is an actuated slide between two joints that only pulls (or pushes).

Source: theory (76) to (78).
"""

from collections.abc import Collection
from functools import cached_property

import numpy as np

from kinetostat.arrays import Array, Codes, Mask
from kinetostat.equilibrium.chains import SIGNS
from kinetostat.equilibrium.state import check_loads
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import platform_placement
from kinetostat.kinematics.status import Status
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.leg import Leg
from kinetostat.machine.loads import load_on_platform, platform_masses
from kinetostat.machine.machine import Chains, Machine
from kinetostat.machine.rods import Rod, rods
from kinetostat.numerics.distribution import Rule, distribution
from kinetostat.numerics.motions import of_scalars
from kinetostat.numerics.wrench_sets import capacity, closure


def cable_signs(machine: Machine) -> tuple[float, ...]:
    """Return 1 for each leg that is a cable, or -1 for one that only pushes; nothing if a leg is anything else."""
    if machine.family.chains is None:
        return ()
    chains, signs = machine.chains(), []
    for rod, leg in zip(_rods(chains, machine.family.planar), chains.legs, strict=True):
        springs = [spring for step in leg for spring in step.element.springs]
        if rod is None or not (rod.telescopic and rod.on_base and rod.on_platform) or len(springs) != 1:
            return ()
        signs.append(SIGNS[springs[0].acts])
    return tuple(signs) if all(signs) else ()


def _rods(chains: Chains, planar: bool) -> list[Rod | None]:
    legs = (Leg("", tuple(step.element for step in steps)) for steps in chains.legs)
    return [next(iter(rods([leg], planar)), None) for leg in legs]


@dataclass(frozen=True)
class Cables:
    """The cables of a machine at n poses.

    Attributes:
        near, far: where they leave the base, and where they hold the platform, base frame, m [n x cables x 3].
        wrenches: what a tension of 1 N does to the platform at the tool point, base axes: moments over the length of
            the machine, so that all is in N; of a planar machine rz, x, y [n x d x cables].
        load: all loads on the platform, the same way [n x d].
        least, most: bounds of the tensions, N [n].
        rule: how they are chosen.
        box: half the sizes of the box of wrenches that must be held about the load [n x d].
    """

    near: Array
    far: Array
    wrenches: Array
    load: Array
    least: Array
    most: Array
    rule: Rule
    box: Array

    @cached_property
    def tensions(self) -> tuple[Array, Mask]:
        """Tensions that hold the load within their bounds, N [n x cables], and where there are any [n]."""
        return distribution(self.wrenches, -self.load, self.least, self.most, self.rule)

    def capacity(self, required: Array | None = None) -> Array:
        """The distance of the load, with its box, from the end of what the cables can hold, N [n]; negative beyond it.

        Args:
            required: wrenches that must be held instead of the load, in its units [k x d].
        """
        shape = (*self.wrenches.shape[::2],)
        least, most = (np.broadcast_to(bound[:, None], shape) for bound in (self.least, self.most))
        wanted = self.load[:, None] if required is None else np.broadcast_to(required, (shape[0], *required.shape))
        return capacity(self.wrenches, least, most, -wanted, self.box)


def cables_of(machine: Machine, signs: tuple[float, ...], count: int) -> Cables:
    """Place the cables of a machine.

    Args:
        machine: the machine with columns of n poses, and its loads.
        signs: see `cable_signs`.
        count: number of poses, n.

    Raises:
        InputError: gravity pulls, but nothing says a mass.
    """
    chains = machine.chains()
    platform = platform_placement(chains)
    check_loads(machine, count, bool(platform_masses(machine, platform)))
    moved, tool = platform @ chains.home.inverse(), machine.tool_point(platform)
    ends = [rod for rod in _rods(chains, machine.family.planar) if rod is not None]
    near, far = (
        np.stack([of_scalars(point.components(), count) for point in points], axis=1)
        for points in ([rod.start for rod in ends], [moved.apply(rod.end) for rod in ends])
    )
    if machine.family.planar:
        near[:, :, 2] = far[:, :, 2] = 0.0
    span, arm = near - far, far - of_scalars(tool.components(), count)[:, None]
    line = span * (np.array(signs)[:, None] / np.sqrt((span * span).sum(axis=2, keepdims=True)))
    length = of_scalars([chains.length], count)[:, 0]
    moment = np.cross(arm, line) / length[:, None, None]
    parts = list(machine.family.components)
    wrench = of_scalars(load_on_platform(machine, platform).components(), count)
    wrench[:, :3] /= length[:, None]
    table, load = machine.tables["cables"], machine.tables["load"]
    least, most = (stacked_columns([getattr(load, f"{end}_tension")], count)[:, 0] for end in ("min", "max"))
    box = np.abs(stacked_columns([*table.moment_box, *table.force_box], count))
    box[:, :3] /= length[:, None]
    return Cables(
        near,
        far,
        np.concatenate([moment, line], axis=2)[:, :, parts].transpose(0, 2, 1),
        wrench[:, parts],
        np.where(np.isinf(least), 0.0, least),
        most,
        Rule(*stacked_columns([table.level, table.exponent], count).T),
        box[:, parts],
    )


def cable_numbers(machine: Machine, names: Collection[str], count: int) -> tuple[dict[str, Array], Codes]:
    """Compute quantities of cables at n poses.

    Args:
        machine: the machine with columns of n poses, and its loads.
        names: what is wanted: "tension_1", ..., "least_tension", "greatest_tension", "tension_reserve", "capacity",
            "wrench_closure".
        count: number of poses, n.

    Returns:
        By name their values, SI [n], NaN where there is none, and `Status` codes [n]: NO_REST where tensions are wanted
        and none within their bounds hold the load.
    """
    cables = cables_of(machine, cable_signs(machine), count)
    result, status = {}, np.full(count, Status.OK, dtype=np.int8)
    if "wrench_closure" in names:
        result["wrench_closure"] = closure(cables.wrenches)
    if "capacity" in names:
        result["capacity"] = cables.capacity()
    if any("tension" in name for name in names):
        tensions, exist = cables.tensions
        status[~exist] = Status.NO_REST
        result |= {f"tension_{number}": row for number, row in enumerate(tensions.T, 1)}
        result["least_tension"], result["greatest_tension"] = tensions.min(axis=1), tensions.max(axis=1)
        nearest = np.minimum(result["least_tension"] - cables.least, cables.most - result["greatest_tension"])
        result["tension_reserve"] = np.maximum(nearest, np.where(exist, 0.0, np.nan))
    for name in names:
        status[np.isnan(result[name]) & (status == Status.OK)] = Status.SINGULAR
    return result, status

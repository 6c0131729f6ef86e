"""Cables that hold a platform at n poses: their lines, their tensions, and the wrenches that they can hold.

Straight cables pull along lines that follow from the pose of the platform alone, whatever stretches. Cables that have
weight, or leave the base over pulleys, pull along lines that depend on their tensions as well. A machine has cables if
each of its legs is an actuated slide between two joints that only pulls (or only pushes).

A cable of uniform weight hangs in a vertical plane. From its platform end, along its unstretched length, the horizontal
part of its tension stays the same and the vertical part grows by its weight, so that its shape is known in closed form.
Here its tension at the platform is given; its slope there and its unstretched length follow by Newton's method. As
tensions are chosen with the directions in which cables then pull, both follow from each other in steps.

Source: theory (76)-(80); M. Irvine, Cable Structures (1981), section 1.2; pulleys: A. Pott, "Influence of pulley
kinematics on cable-driven parallel robots", Latest Advances in Robot Kinematics (2012).
"""

from collections.abc import Collection
from dataclasses import replace
from functools import cached_property

import numpy as np

from kinetostat.arrays import Array, Codes, Mask
from kinetostat.equilibrium.leg_reader import SIGNS
from kinetostat.equilibrium.state import check_loads
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import platform_placement
from kinetostat.kinematics.status import Status
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.leg import Leg
from kinetostat.machine.links import Rod, rods
from kinetostat.machine.loads import gravity_of, load_on_platform, platform_masses
from kinetostat.machine.machine import Chains, Machine
from kinetostat.numerics.distribution import Rule, distribution
from kinetostat.numerics.motions import of_scalars
from kinetostat.numerics.polytopes import capacity, wrench_closure
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import HANGING, LEAST_DIVISOR, SETTLED_CABLE, SURELY_HANGING, SURELY_SETTLED_CABLE

MOST_NEWTON_STEPS = 30
"""Most steps of Newton's method for slope and length of a cable: three or four unless it hangs like a chain."""
MOST_TENSION_STEPS = 60
"""Most steps in which directions and tensions of hanging cables follow from each other: each changes hardly more than a
hundredth of what the last one has changed, so that some seven do unless cables hang like chains. Those may swing
between two shapes for ever, and then have none."""


@dataclass(frozen=True)
class Hanging:
    """Cables in their vertical planes; each array [n x cables].

    With H across, U up, the weight q per metre and the length L, the base end is away by
    H (L/EA + (arsinh((U + q L)/H) - arsinh(U/H)) / q), and higher by
    (2 U + q L) L / (2 EA) + (hypot(H, U + q L) - hypot(H, U)) / q. Neither difference is formed here: each is written
    as a product, so that the digits of light and taut cables are kept.

    Attributes:
        across, up: parts of the tension at the platform end, horizontally to the base end and upwards, N.
        weight: weight per metre of unstretched cable, N/m.
        rigidity: EA, N.
        length: unstretched, between both ends, m.
    """

    across: Array
    up: Array
    weight: Array
    rigidity: Array
    length: Array

    @property
    def tension(self) -> Array:
        """Tension at the platform end, N."""
        return np.hypot(self.across, self.up)

    @property
    def base_tension(self) -> Array:
        """Tension at the base end, N."""
        return np.hypot(self.across, self.up + self.weight * self.length)

    @property
    def base_slope(self) -> Array:
        """Angle by which the cable rises at its base end, rad."""
        return np.arctan2(self.up + self.weight * self.length, self.across)

    @property
    def spans(self) -> tuple[Array, Array]:
        """Horizontal distance of both ends, and height of the base end above the other, m."""
        stretching = self.length / self.rigidity
        distance = self.across * (stretching + self._slope_change)
        return distance, 0.5 * self._sum_of_ups * stretching + self.length * self._mean_sine

    @property
    def _sum_of_ups(self) -> Array:
        """Sum of the upward parts of the tension at both ends, N."""
        return 2.0 * self.up + self.weight * self.length

    @property
    def _mean_sine(self) -> Array:
        """Sum of the upward parts of both end tensions over the sum of these tensions: a sine between both end's."""
        return self._sum_of_ups / (self.tension + self.base_tension)

    @property
    def _slope_change(self) -> Array:
        """Difference of the inverse hyperbolic sines of both slopes over the weight of a metre, m/N.

        It is the logarithm of a quotient, of whose two forms the one is taken in which nothing cancels.
        """
        whole_weight = self.weight * self.length
        rising = whole_weight * (1.0 + self._mean_sine) / (self.up + self.tension)
        falling = whole_weight * (1.0 - self._mean_sine) / (self.base_tension - (self.up + whole_weight))
        return np.asarray(np.log1p(np.where(self._mean_sine > 0.0, rising, falling)) / self.weight)

    @property
    def compliance(self) -> Array:
        """Rates of both spans by `across` and `up`, m/N [n x cables x 2 x 2]."""
        stretching, tensions = self.length / self.rigidity, self.tension * self.base_tension
        turning = self.length * (self.tension - self.up * self._mean_sine) / tensions
        mixed = -self.across * self.length * self._mean_sine / tensions
        first, last = stretching + self._slope_change - turning, stretching + turning
        return np.stack([np.stack([first, mixed], axis=-1), np.stack([mixed, last], axis=-1)], axis=-2)

    @property
    def stiffness(self) -> Array:
        """Stiffness in its plane, N/m [n x cables x 2 x 2]."""
        return np.asarray(np.linalg.inv(self.compliance))

    @property
    def stiffness_share(self) -> Array:
        """Share of the stiffness EA/L of a straight cable that it has along the line of its ends."""
        distance, rise = self.spans
        chord = np.stack([distance, rise], axis=-1) / np.hypot(distance, rise)[..., None]
        along = np.einsum("nma,nmab,nmb->nm", chord, self.stiffness, chord)
        return np.asarray(along * self.length / self.rigidity)

    @property
    def sag(self) -> Array:
        """Greatest distance of the cable from the line of its ends, m."""
        distance, rise = self.spans
        # The farthest point is where the cable runs along that line: up + w s = across * rise / distance.
        up_there = self.across * rise / np.maximum(distance, LEAST_DIVISOR)
        part = np.clip((up_there - self.up) / self.weight, 0.0, self.length)
        x, z = replace(self, length=part).spans
        return np.abs(z * distance - x * rise) / np.hypot(distance, rise)


def hanging_cables(distance: Array, rise: Array, tension: Array, weight: Array, rigidity: Array) -> Hanging:
    """Find the cables that hang between two points with given tensions at the platform [n x cables each].

    Args:
        distance, rise: horizontal distance of the points, and height of the base end above the other, m.
        tension: tension at the platform end, N.
        weight: weight per metre of unstretched cable, N/m; greater than 0.
        rigidity: EA, N.

    Returns:
        The cables; NaN where none hangs so.
    """
    distance = np.maximum(distance, HANGING * np.abs(rise))  # a cable that hangs straight down, but for round-off
    chord = np.hypot(distance, rise)
    slope, length = np.arctan2(rise, distance), chord / (1.0 + tension / rigidity)
    with np.errstate(all="ignore"):
        for _ in range(MOST_NEWTON_STEPS):
            across, up = tension * np.cos(slope), tension * np.sin(slope)
            cable = Hanging(across, up, weight, rigidity, length)
            missing = np.stack([distance, rise], axis=-1) - np.stack(cable.spans, axis=-1)
            by_slope = np.einsum("nmab,nmb->nma", cable.compliance, np.stack([-up, across], axis=-1))
            base_direction = np.stack([np.cos(cable.base_slope), np.sin(cable.base_slope)], axis=-1)
            by_length = base_direction * (1.0 + cable.base_tension / rigidity)[..., None]
            rates = np.stack([by_slope, by_length], axis=-1)
            regular = np.abs(np.linalg.det(rates)) > 0.0
            step = np.linalg.solve(np.where(regular[..., None, None], rates, np.eye(2)), missing[..., None])[..., 0]
            slope, length = slope + step[..., 0], np.abs(length + step[..., 1])
            if not (np.abs(step).max(axis=-1) > HANGING * chord).any():
                break
    converged = np.abs(step).max(axis=-1) <= SURELY_HANGING * chord
    length = np.where(converged, length, np.nan)
    return Hanging(tension * np.cos(slope), tension * np.sin(slope), weight, rigidity, length)


def leaving_points(guides: Array, ends: Array, radius: Array, slope: Array) -> tuple[Array, Array]:
    """Find where cables leave pulleys that swivel about the vertical through their guides.

    A cable comes up through its guide, runs over the wheel, whose centre lies by its radius nearer to the platform, and
    leaves it along its own slope.

    Args:
        guides: points at which cables enter their pulleys [n x cables x 3], m.
        ends: their ends at the platform [n x cables x 3], m.
        radius: radius of the wheels, m [n].
        slope: angles by which the cables rise where they leave [n x cables], rad.

    Returns:
        The points where they leave [n x cables x 3], m, and lengths that lie on the wheels [n x cables], m.
    """
    ahead = _units((ends - guides) * [1.0, 1.0, 0.0])
    forward = radius[:, None] * (1.0 + np.sin(slope))
    points = guides + forward[:, :, None] * ahead
    points[:, :, 2] += radius[:, None] * np.cos(slope)
    return points, radius[:, None] * (0.5 * np.pi + slope)


def cable_signs(machine: Machine) -> tuple[float, ...]:
    """Return 1 for each leg that is a cable, or -1 for one that only pushes; an empty tuple if any leg is neither."""
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
    """Return the straight part of each leg at the home pose; None for a leg that has none."""
    legs = (Leg("", tuple(step.element for step in steps)) for steps in chains.legs)
    return [next(iter(rods([leg], planar)), None) for leg in legs]


@dataclass(frozen=True)
class Cables:
    """The cables of a machine at n poses.

    Attributes:
        near, far: points where they leave the base, and where they hold the platform, base frame, m [n x cables x 3].
        directions: directions in which they pull the platform, base axes [n x cables x 3].
        arms: vectors from the tool point to their platform ends, over the length of the machine [n x cables x 3].
        signs: 1 for each cable, -1 for a leg that only pushes [cables].
        components: numbers of those of rx ry rz x y z that the machine has [d].
        load: all loads on the platform at the tool point, base axes, moments over the length of the machine, N [n x d].
        least, most: bounds of the tensions, N [n].
        rule: the rule by which tensions are chosen.
        box: half the sizes of the box of wrenches that must be held about the load [n x d].
        stiffness: stiffness of each straight cable with its winch, N/m [n x cables].
        wound: length of each cable that lies on its pulley, m [n x cables].
        shape: their shapes as they hang; None for straight ones.

    Where sagging cables find no shape, their directions are NaN, and all that follows from these.
    """

    near: Array
    far: Array
    directions: Array
    arms: Array
    signs: Array
    components: tuple[int, ...]
    load: Array
    least: Array
    most: Array
    rule: Rule
    box: Array
    stiffness: Array
    wound: Array
    shape: Hanging | None = None

    @cached_property
    def settled(self) -> Mask:
        """Whether the cables of a pose have directions: straight ones always, sagging ones if they find a shape [n]."""
        return np.asarray(np.isfinite(self.directions).all(axis=(1, 2)))

    @cached_property
    def wrenches(self) -> Array:
        """Wrenches of tensions of 1 N at the tool point, moments over the length of the machine [n x d x cables]."""
        lines = self.directions * self.signs[:, None]
        whole = np.concatenate([np.cross(self.arms, lines), lines], axis=2)
        return whole[:, :, list(self.components)].transpose(0, 2, 1)

    @cached_property
    def tensions(self) -> tuple[Array, Mask]:
        """Tensions that hold the load within their bounds, N [n x cables], and where there are any [n]."""
        return distribution(self.wrenches, -self.load, self.least, self.most, self.rule)

    def capacity(self, required: Array | None = None) -> Array:
        """The distance of the load, with its box, from the end of what the cables can hold, N [n]; negative beyond it.

        Args:
            required: wrenches that must be held instead of the load, in its units [k x d].
        """
        poses, _, cables = self.wrenches.shape
        least, most = (np.broadcast_to(bound[:, None], (poses, cables)) for bound in (self.least, self.most))
        wanted = self.load[:, None] if required is None else np.broadcast_to(required, (poses, *required.shape))
        return capacity(self.wrenches, least, most, -wanted, self.box)


def cables_of(machine: Machine, signs: tuple[float, ...], count: int) -> Cables:
    """Place the cables of a machine: straight, or as they hang and leave their pulleys where its file describes these.

    Args:
        machine: the machine with columns of n poses, and its loads.
        signs: see `cable_signs`.
        count: number of poses, n.

    Raises:
        InputError: gravity pulls, but nothing says a mass; or pulleys of a planar machine, or of one that is tilted.
    """
    table, load = machine.tables["cables"], machine.tables["load"]
    density, radius = stacked_columns([table.linear_density, table.pulley_radius], count).T
    weighs = bool(platform_masses(machine, platform_placement(machine.chains()))) or bool(density.any())
    check_loads(machine, count, weighs)
    cables = _straight_cables(machine, signs, count)
    gravity = of_scalars(gravity_of(load).components(), count)
    weight = density * np.linalg.norm(gravity, axis=1)
    if not (weight.any() or radius.any()):
        return cables
    if radius.any() and (machine.family.planar or (gravity[:, :2].any() and weight.any())):
        raise InputError(
            f"{machine.name}: cables.pulley_radius is that of pulleys which swivel about the z axis of the base, so "
            "that cables hang and pull in planes through it; leave it out of a planar machine, and where gravity is "
            "not along z."
        )
    return _hanging_cables(cables, np.where(weight[:, None] > 0.0, -_units(gravity), [0.0, 0.0, 1.0]), weight, radius)


def _straight_cables(machine: Machine, signs: tuple[float, ...], count: int) -> Cables:
    """Return the cables of a machine as straight lines, whatever their weight; arguments as of `cables_of`."""
    chains, planar = machine.chains(), machine.family.planar
    table, load = machine.tables["cables"], machine.tables["load"]
    platform = platform_placement(chains)
    motion, tool = platform @ chains.home.inverse(), machine.tool_point(platform)
    lines = [rod for rod in _rods(chains, planar) if rod is not None]  # of cables, no leg lacks one
    near, far = (
        np.stack([of_scalars(point.components(), count) for point in points], axis=1)
        for points in ([rod.start for rod in lines], [motion.apply(rod.end) for rod in lines])
    )
    if planar:
        near[:, :, 2] = far[:, :, 2] = 0.0
    length = of_scalars([chains.length], count)
    wrench = of_scalars(load_on_platform(machine, platform).components(), count)
    box = np.abs(stacked_columns([*table.moment_box, *table.force_box], count))
    wrench[:, :3], box[:, :3] = wrench[:, :3] / length, box[:, :3] / length
    least, most = stacked_columns([load.min_tension, load.max_tension], count).T
    components = machine.family.components
    springs = [step.element.springs[0] for leg in chains.legs for step in leg if step.element.springs]
    return Cables(
        near=near,
        far=far,
        directions=_units(near - far),
        arms=(far - of_scalars(tool.components(), count)[:, None]) / length[:, None],
        signs=np.array(signs),
        components=components,
        load=wrench[:, components],
        least=np.where(np.isinf(least), 0.0, least),
        most=most,
        rule=Rule(*stacked_columns([table.level, table.exponent], count).T),
        box=box[:, components],
        stiffness=of_scalars([spring.stiffness for spring in springs], count),
        wound=np.zeros(near.shape[:2]),
    )


def _units(vectors: Array) -> Array:
    """Return the directions of vectors [... x 3]; a vector of zeros stays as it is."""
    sizes = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    return np.asarray(vectors / np.where(sizes > 0.0, sizes, 1.0))


def _hanging_cables(cables: Cables, up: Array, weight: Array, radius: Array) -> Cables:
    """Return cables as they hang, and run over their pulleys, with the tensions that they have in these places.

    Tensions are chosen with the directions of the last step, and new directions follow from them, until nothing
    changes. Where that does not end within `MOST_TENSION_STEPS`, directions and lengths are NaN.

    Args:
        cables: the cables, straight and without pulleys.
        up: unit vectors against gravity [n x 3].
        weight: weight of a metre of unstretched cable, N/m [n].
        radius: radius of the pulleys, m [n].
    """
    hung = cables
    for _ in range(MOST_TENSION_STEPS):
        last, hung = hung, _cables_with_tensions_of(hung, cables, up, weight, radius)
        changes = np.abs([hung.directions - last.directions, hung.near - last.near])
        changes_by_pose = np.nan_to_num(changes).max(axis=(0, 2, 3))
        if changes_by_pose.max() < SETTLED_CABLE:
            break
    zero_or_nan = np.where(changes_by_pose < SURELY_SETTLED_CABLE, 0.0, np.nan)
    shape = None if hung.shape is None else replace(hung.shape, length=hung.shape.length + zero_or_nan[:, None])
    return replace(hung, directions=hung.directions + zero_or_nan[:, None, None], shape=shape)


def _cables_with_tensions_of(hung: Cables, cables: Cables, up: Array, weight: Array, radius: Array) -> Cables:
    """Return cables as they hang with the tensions of `hung`; the other arguments as for `_hanging_cables`."""
    heavy = weight > 0.0
    span = hung.near - hung.far
    rise = np.einsum("nmk,nk->nm", span, up)
    sideways = span - rise[:, :, None] * up[:, None]
    distance = np.sqrt((sideways * sideways).sum(axis=2))
    tensions = np.where(np.isnan(hung.tensions[0]), np.inf, hung.tensions[0])
    sags = np.isfinite(tensions) & heavy[:, None] & (tensions > 0.0)
    rigidity = cables.stiffness * np.sqrt(((cables.near - cables.far) ** 2).sum(axis=2))
    # Cables without a weight or without a tension are straight: their shape, by 1 N/m and 1 N, is not read.
    weights = np.broadcast_to(np.where(heavy, weight, 1.0)[:, None], distance.shape)
    shape = hanging_cables(distance, rise, np.where(sags, tensions, 1.0), weights, rigidity)
    straight = np.arctan2(rise, distance)
    slope = np.where(sags, np.arctan2(shape.up, shape.across), straight)
    directions = np.cos(slope)[:, :, None] * _units(sideways) + np.sin(slope)[:, :, None] * up[:, None]
    near, wound = cables.near, cables.wound
    if radius.any():
        leaving = np.where(sags, shape.base_slope, straight)
        near, wound = leaving_points(cables.near, cables.far, radius, leaving)
    return replace(cables, near=near, directions=directions, wound=wound, shape=shape if heavy.any() else None)


def cable_numbers(machine: Machine, names: Collection[str], count: int) -> tuple[dict[str, Array], Codes]:
    """Compute quantities of cables at n poses.

    Args:
        machine: the machine with columns of n poses, and its loads.
        names: names of the quantities: "tension_1", ..., "least_tension", "greatest_tension", "tension_reserve",
            "capacity", "wrench_closure".
        count: number of poses, n.

    Returns:
        Their values by name, SI [n], NaN where there is none or legs are no cables, and `Status` codes [n]: NO_REST
        where sagging cables find no shape, or tensions are wanted and none within their bounds hold the load.
    """
    signs, status = cable_signs(machine), np.full(count, Status.OK, dtype=np.int8)
    if not signs:
        return {name: np.full(count, np.nan) for name in names}, status
    cables = cables_of(machine, signs, count)
    status[~cables.settled] = Status.NO_REST
    result = {}
    if "wrench_closure" in names:
        result["wrench_closure"] = wrench_closure(cables.wrenches)
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

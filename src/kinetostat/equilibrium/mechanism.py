"""A machine as a mechanism that can move far: coordinates of its joints and springs, its masses, and its loads.

The free state is the machine at its pose with relaxed springs; all coordinates are zero there. Each leg is a row of
screw motions from base to platform (a product of exponentials). Nothing is solved here.

Everything is made comparable: lengths are in units of the machine's length, forces in units of a typical stiffness
times it. Arrays have the poses first [n]. The origin is the tool point of the free state; axes are those of the base.

Source: theory (35).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal
from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.motion import Array, exponential
from kinetostat.kinematics.closing import stacked
from kinetostat.kinematics.closure import Joints
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Element, Joint, Leg, Spring, Station
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Load, Machine, Member
from kinetostat.machine.mass import located_members
from kinetostat.tolerances import DEPENDENT

SIGNS = {"": 0.0, "pulls": 1.0, "pushes": -1.0}
"""Sign of the loads that a spring carries if it carries those of one sign only, by what its file says."""


@dataclass(frozen=True)
class Masses:
    """Point masses that move with a body.

    Attributes:
        carried: how many of the leg's screw motions carry each [m]; not used of the platform.
        point: where they are in the free state [n x m x 3].
        mass: in units of force per m/s² [n x m].
    """

    carried: tuple[int, ...]
    point: Array
    mass: Array


@dataclass(frozen=True)
class Chain:
    """A leg as a row of screw motions.

    Attributes:
        name: of the leg.
        twists: unit twist of each motion in the free state [n x motions x 6].
        coordinate: which coordinate of the leg each motion follows [motions]; -1 where its amount is given.
        given: which of the given amounts of the machine each motion follows [motions]: those of its actuators, then
            the growths of its links; -1 where a coordinate moves it.
        springs: the spring of each coordinate [coordinates]; None of a passive one.
        stiffness: of each coordinate, 0 of a passive one [n x coordinates].
        preload: what each carries where it is zero [n x coordinates].
        sign: of the loads that it can carry, 0 for both [coordinates].
        idle: a basis of motions of the passive coordinates that move nothing [n x coordinates x coordinates], with
            columns of zeros.
        masses: that it carries.
    """

    name: str
    twists: Array
    coordinate: tuple[int, ...]
    given: tuple[int, ...]
    springs: tuple[Spring | None, ...]
    stiffness: Array
    preload: Array
    sign: Array
    idle: Array
    masses: Masses

    @property
    def size(self) -> int:
        """How many coordinates it has."""
        return len(self.springs)

    def follows(self, which: tuple[int, ...], count: int) -> Array:
        """1 where a motion follows a coordinate, or a given amount [motions x count]; 0 elsewhere.

        Args:
            which: `coordinate` or `given`.
            count: how many there are.
        """
        return (np.array(which, dtype=int)[:, None] == np.arange(count)).astype(float)


@dataclass(frozen=True)
class Mechanism:
    """A machine at n poses, in units of its own.

    Attributes:
        legs: of it.
        actuators: names of the actuators that can be driven, in the order of the legs.
        growth: by which links are longer because they are warmer, in units of length [n x links].
        platform: masses of platform, tool and payload.
        wrench: the moment of all loads, and the force at the tool point, base axes [n x 6].
        pushed: points of the platform at which further forces act, in the free state [n x forces x 3].
        forces: that act there, base axes [n x forces x 3].
        gravity: [n x 3].
        ways: orthonormal twists that exist, as columns [6 x 6, or 6 x 3 of a planar machine].
        length: m [n].
        force: unit of force, N [n].
        weighs: whether any mass is known.
    """

    legs: tuple[Chain, ...]
    actuators: tuple[str, ...]
    growth: Array
    platform: Masses
    wrench: Array
    pushed: Array
    forces: Array
    gravity: Array
    ways: Array
    length: Array
    force: Array
    weighs: bool

    def taken(self, rows: npt.NDArray[np.int64]) -> "Mechanism":
        """The mechanism at some of its poses [rows]."""
        return replace(
            self,
            legs=tuple(_taken(leg, rows) for leg in self.legs),
            platform=replace(self.platform, point=self.platform.point[rows], mass=self.platform.mass[rows]),
            growth=self.growth[rows],
            wrench=self.wrench[rows],
            pushed=self.pushed[rows],
            forces=self.forces[rows],
            gravity=self.gravity[rows],
            length=self.length[rows],
            force=self.force[rows],
        )

    @property
    def twist_units(self) -> Array:
        """Units of the components of twists, rad and m [n x 6]."""
        return np.concatenate([np.ones((len(self.length), 3)), np.repeat(self.length[:, None], 3, axis=1)], axis=1)

    @property
    def compliance_units(self) -> Array:
        """Units of the entries of compliances, SI [n x 6 x 6]."""
        units = self.twist_units
        return units[:, :, None] * units[:, None] / (self.length * self.force)[:, None, None]


def _wrench_units(length: Array, force: Array) -> Array:
    return np.stack([force * length] * 3 + [force] * 3, axis=1)


def _taken(leg: Chain, rows: npt.NDArray[np.int64]) -> Chain:
    masses = replace(leg.masses, point=leg.masses.point[rows], mass=leg.masses.mass[rows])
    parts = {name: getattr(leg, name)[rows] for name in ("twists", "stiffness", "preload", "idle")}
    return replace(leg, masses=masses, **parts)


def mechanism_of(machine: Machine, response: Response, joints: Joints | None, count: int = 1) -> Mechanism:
    """The mechanism of a machine at its pose, or at n poses.

    Args:
        machine: with its pose, or columns of n poses.
        response: of it.
        joints: coordinates that close its legs, if it is written leg by leg.
        count: of poses, n.
    """
    configuration, origin = response.configuration, response.reference
    length = stacked([configuration.length], count)[:, 0]
    known = [_linear(spring, configuration.length) for leg in configuration.legs for spring in leg.springs]
    typical = _typical(stacked(known, count)) if known else np.ones(count)
    force = typical * length
    units = _Units(origin, length, force, count)
    members = located_members(machine, configuration, None if joints is None else joints.coordinates)
    driven = [s for leg in configuration.legs for s in leg.springs if s.actuated and not is_zero(s.stiffness)]
    amounts = _Given(len(driven))
    legs = []
    for leg in configuration.legs:
        here = [m for m in members if m.leg == leg.name or (not m.leg and leg.number is None)]
        legs.append(_chain(leg, units, amounts, here))
    platform = configuration.platform
    tool = machine.tables["tool"]
    centres = [
        platform.apply(Vector(*tool.centre_of_mass)),
        response.reference + platform.rotation.apply(Vector(*tool.payload_centre)),
    ]
    pairs = zip(centres, (tool.mass, tool.payload), strict=True)
    weights = [(0, point, mass) for point, mass in pairs if not is_zero(mass)]
    load = machine.tables["load"]
    named = machine.named_loads
    moment = machine.load.rotational
    for _, other in named:
        moment = moment + other.rotational
    wrench = stacked([*moment.components(), *load.force], count) / _wrench_units(length, force)
    ways = np.eye(6)
    if configuration.plane is not None:
        turn, *slides = (np.array(joint.axis.components(), dtype=float) for joint in configuration.plane.freedoms)
        ways = np.column_stack([[*turn, 0.0, 0.0, 0.0], *([0.0, 0.0, 0.0, *axis] for axis in slides)])
    return Mechanism(
        tuple(legs),
        tuple(spring.joint.name or spring.of for spring in amounts.actuators),
        stacked(amounts.growth, count) / length[:, None],
        units.masses(weights),
        wrench,
        units.points([platform.apply(point) for point, _ in named]),
        units.forces([other.translational for _, other in named]),
        _gravity(load, count),
        ways,
        length,
        force,
        bool(weights) or any(leg.masses.carried for leg in legs),
    )


def _gravity(load: Load, count: int) -> Array:
    """Acceleration by gravity, turned as the machine is tilted, m/s² [n x 3]."""
    axis = stacked(load.gravity_axis, count)
    sizes = np.linalg.norm(axis, axis=1, keepdims=True)
    turn = axis / np.where(sizes > 0.0, sizes, 1.0) * stacked([load.gravity_angle], count)
    return exponential(np.concatenate([turn, np.zeros_like(turn)], axis=1)).point(stacked(load.gravity, count))


@dataclass(frozen=True)
class _Units:
    """What lengths and forces are counted in, and where from."""

    origin: Vector
    length: Array
    force: Array
    count: int

    def twist(self, joint: Joint, rate: Scalar = 1.0) -> Array:
        """Unit twist of a joint at the origin, times a rate [n x 6]; a slide by one unit of length."""
        components = stacked(joint.twist(self.origin).components(), self.count) * stacked([rate], self.count)
        if joint.point is not None:
            components[:, 3:] /= self.length[:, None]
        return components

    def points(self, points: Sequence[Vector]) -> Array:
        """Points [n x m x 3]."""
        rows = [stacked((point - self.origin).components(), self.count) / self.length[:, None] for point in points]
        return np.stack(rows, axis=1) if rows else np.zeros((self.count, 0, 3))

    def forces(self, forces: Sequence[Vector]) -> Array:
        """Forces [n x m x 3]."""
        rows = [stacked(force.components(), self.count) / self.force[:, None] for force in forces]
        return np.stack(rows, axis=1) if rows else np.zeros((self.count, 0, 3))

    def masses(self, given: Sequence[tuple[int, Vector, Scalar]]) -> Masses:
        """Masses in units of force per m/s²: how many motions carry each, where it is, kg."""
        mass = stacked([m for _, _, m in given], self.count) / self.force[:, None]
        return Masses(tuple(n for n, _, _ in given), self.points([point for _, point, _ in given]), mass)

    def stiffness(self, spring: Spring) -> Array:
        """Of a spring [n]."""
        unit = self.force / self.length if spring.joint.point is None else self.force * self.length
        return stacked([spring.stiffness], self.count)[:, 0] / unit

    def load(self, spring: Spring, load: Scalar) -> Array:
        """In a spring [n]."""
        unit = self.force if spring.joint.point is None else self.force * self.length
        return stacked([load], self.count)[:, 0] / unit


def _linear(spring: Spring, length: Scalar) -> Scalar:
    """The stiffness of a spring as that of a slide, N/m."""
    return spring.stiffness if spring.joint.point is None else spring.stiffness * (1.0 / (length * length))


def _typical(stiffness: Array) -> Array:
    """The geometric mean of those that are finite and not zero [n]."""
    usable = np.isfinite(stiffness) & (stiffness > 0.0)
    logs = np.log(np.where(usable, stiffness, 1.0)).sum(axis=1)
    return np.asarray(np.exp(logs / np.maximum(usable.sum(axis=1), 1)))


@dataclass
class _Given:
    """The motions of given amounts that the legs have so far.

    Attributes:
        most: how many actuators there will be.
        actuators: so far.
        growth: of links so far, m.
    """

    most: int
    actuators: list[Spring] = field(default_factory=list)
    growth: list[Scalar] = field(default_factory=list)

    def actuator(self, spring: Spring) -> int:
        """Count another actuator and return its number."""
        self.actuators.append(spring)
        return len(self.actuators) - 1

    def link(self, growth: Scalar) -> int:
        """Count another link that grows and return its number."""
        self.growth.append(growth)
        return self.most + len(self.growth) - 1


@dataclass
class _Row:
    """The motions of a leg from base to platform as they come, see `Chain`.

    Attributes:
        carried: for each number of elements, how many motions carry what these carry: without the growth of the links
            that end there, and with it.
    """

    units: _Units
    amounts: _Given
    links: list[tuple[Member, Station, Station]]
    twists: list[Array] = field(default_factory=list)
    coordinate: list[int] = field(default_factory=list)
    given: list[int] = field(default_factory=list)
    springs: list[Spring | None] = field(default_factory=list)
    stiffness: list[Array] = field(default_factory=list)
    preload: list[Array] = field(default_factory=list)
    carried: list[tuple[int, int]] = field(default_factory=list)

    def add(self, element: Element, number: int) -> None:
        """Add an element, which is the number-th from the base, and the growth of the links that end behind it."""
        if isinstance(element, Parallelogram):
            self._parallelogram(element, number)
        else:
            for joint in element.freedoms:
                self._move(self.units.twist(joint), self._coordinate(None))
        for spring in element.springs:
            self._spring(spring)
        before = len(self.twists)
        if not isinstance(element, Parallelogram):
            self.grow(number)
        self.carried.append((before, len(self.twists)))

    def grow(self, number: int) -> None:
        """Add the growth of the links that end behind so many elements: slides along them."""
        for link, (_, start), (behind, end) in self.links:
            if behind == number and not is_zero(link.growth):
                span = end - start
                slide = Joint(span * reciprocal(span.norm()))
                self._move(self.units.twist(slide), -1, self.amounts.link(link.growth))

    def masses(self) -> Masses:
        """The masses of the links: the potential of a straight uniform one is that of half its mass at either end."""
        halves = []
        for link, (first, start), (last, end) in self.links:
            half = 0.5 * link.length * link.linear_density
            if not is_zero(half):
                begins = self.carried[first][first < last]  # a rigid link begins before it grows
                halves += [(begins, start, half), (self.carried[last][1], end, half)]
        return self.units.masses(halves)

    def _move(self, twist: Array, coordinate: int, given: int = -1) -> None:
        self.twists.append(twist)
        self.coordinate.append(coordinate)
        self.given.append(given)

    def _coordinate(self, spring: Spring | None) -> int:
        """Count another coordinate, with a spring or passive, and return its number."""
        nothing = np.zeros(self.units.count)
        self.springs.append(spring)
        self.stiffness.append(nothing if spring is None else self.units.stiffness(spring))
        self.preload.append(nothing if spring is None else self.units.load(spring, spring.preload))
        return len(self.springs) - 1

    def _parallelogram(self, bars: Parallelogram, number: int) -> None:
        """Turn about the near side and back about the far one; in between, the bars grow."""
        rate = 1.0 / (bars.far - bars.near).norm() * self.units.length
        near, far = (Joint(bars.normal, point) for point in (bars.near, bars.far))
        coordinate = self._coordinate(None)
        self._move(self.units.twist(near, rate), coordinate)
        self.grow(number)
        self._move(-self.units.twist(far, rate), coordinate)

    def _spring(self, spring: Spring) -> None:
        twist = self.units.twist(spring.joint)
        if is_zero(spring.stiffness):
            self._move(twist, self._coordinate(None))
            return
        if spring.actuated:
            self._move(twist, -1, self.amounts.actuator(spring))
        if not (isinstance(spring.stiffness, float) and np.isinf(spring.stiffness)):
            self._move(twist, self._coordinate(spring))


def _chain(leg: Leg, units: _Units, amounts: _Given, members: Sequence[Member]) -> Chain:
    links: list[tuple[Member, Station, Station]] = []
    for link in members:
        if link.ends is not None:
            start, end = link.ends()
            links.append((link, start, end))
    row = _Row(units, amounts, links)
    row.grow(0)
    row.carried.append((0, len(row.twists)))
    for number, element in enumerate(leg.chain, 1):
        row.add(element, number)
    return Chain(
        leg.name,
        np.stack(row.twists, axis=1) if row.twists else np.zeros((units.count, 0, 6)),
        tuple(row.coordinate),
        tuple(row.given),
        tuple(row.springs),
        np.stack(row.stiffness, axis=1) if row.stiffness else np.zeros((units.count, 0)),
        np.stack(row.preload, axis=1) if row.preload else np.zeros((units.count, 0)),
        np.array([SIGNS[spring.acts] if spring else 0.0 for spring in row.springs]),
        _idle(row.twists, row.coordinate, row.springs, units.count),
        row.masses(),
    )


def _idle(twists: Sequence[Array], coordinate: Sequence[int], springs: Sequence[Spring | None], count: int) -> Array:
    """Motions of the passive coordinates that leave the leg's end where it is, to first order [n x c x c]."""
    passive = [i for i, spring in enumerate(springs) if spring is None]
    result = np.zeros((count, len(springs), len(springs)))
    if not passive:
        return result
    columns = np.stack(
        [sum((t for t, c in zip(twists, coordinate, strict=True) if c == i), np.zeros((count, 6))) for i in passive],
        axis=2,
    )
    columns = np.where(np.isfinite(columns), columns, 0.0)  # where a pose has no place, nothing is idle
    _, sizes, rows = np.linalg.svd(columns, full_matrices=True)
    weights = np.zeros((count, len(passive)))
    weights[:, : sizes.shape[1]] = sizes
    kept = rows * (weights < DEPENDENT)[:, :, None]
    result[:, passive, : len(passive)] = np.swapaxes(kept, 1, 2)
    return result

"""Legs as rows of screw motions with springs and masses, and the units of their numbers; `mechanism` is made of them.

Nothing is solved here. Units, axes and origin are those of `mechanism`.

Source: theory (35).
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from itertools import pairwise

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.masses import Masses, Weight
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import Chain, bar_turns
from kinetostat.machine.column import plain
from kinetostat.machine.leg import Element, Joint, Leg, Spring, Station
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Member
from kinetostat.numerics.motions import of_scalars
from kinetostat.tolerances import DEPENDENT, PARALLEL_AXES

SIGNS = {"": 0.0, "pulls": 1.0, "pushes": -1.0}
"""Sign of the loads that a spring carries if it carries those of one sign only, by what its file says."""


@dataclass(frozen=True)
class ElasticLeg:
    """A leg as a row of screw motions with its springs, masses and friction.

    Attributes:
        name: name of the leg.
        chain: its motions in the free state; given amounts are those of the machine's actuators, then the growths of
            its links.
        springs: the spring of each coordinate [coordinates]; None of a passive one.
        stiffness: the stiffness of each coordinate, 0 of a passive one [n x coordinates].
        preload: load of each where it is zero [n x coordinates].
        sign: sign of the loads that each can carry, 0 for both [coordinates].
        idle: a basis of motions of the passive coordinates that move nothing [n x coordinates x coordinates], with
            columns of zeros.
        masses: masses that it carries.
        rotors: inertia that the drives add to each coordinate, in the unit of masses times length, squared for a turn
            [n x coordinates].
        dampers: viscous friction of each coordinate, in units of force per velocity [n x coordinates].
        rod: joint centres nearer to the base and to the platform in the free state [n x 3], of a leg that only carries
            a force between them and has its masses there; None of others.
        ends: how many of its motions carry what so many of its elements carry, from none to all of them.
        spin: number of the first of three coordinates that turn about the centre of a ball joint, and the way to the
            centre of the next one [n x 3], if the link between both is free to spin about it; None without one.
    """

    name: str
    chain: Chain
    springs: tuple[Spring | None, ...]
    stiffness: Array
    preload: Array
    sign: Array
    idle: Array
    masses: Masses
    rotors: Array
    dampers: Array
    rod: tuple[Array, Array] | None = None
    ends: tuple[int, ...] = ()
    spin: tuple[int, Array] | None = None

    @property
    def size(self) -> int:
        """Number of its coordinates."""
        return len(self.springs)

    @property
    def hinged(self) -> Mask:
        """Whether each coordinate is a flexure hinge, which pulls back to the home pose [coordinates]."""
        return np.array([spring is not None and not is_zero(spring.returns) for spring in self.springs], dtype=bool)

    def at(self, rows: Integers) -> "ElasticLeg":
        """The leg at some of n poses [rows]."""
        parts = {name: getattr(self, name)[rows] for name in ("stiffness", "preload", "idle", "rotors", "dampers")}
        spin = self.spin and (self.spin[0], self.spin[1][rows])
        rod = self.rod and (self.rod[0][rows], self.rod[1][rows])
        return replace(self, chain=self.chain.at(rows), masses=self.masses.at(rows), spin=spin, rod=rod, **parts)


@dataclass(frozen=True)
class Units:
    """Units of length and force, and the origin of points."""

    origin: Vector
    length: Array
    force: Array
    count: int | None

    @property
    def nothing(self) -> Array:
        """0 at each pose [n]."""
        return of_scalars([0.0], self.count)[:, 0]

    @property
    def shrink(self) -> Array:
        """Units of length in a metre [n x 1]; products with it keep what is zero by form."""
        return (1.0 / self.length)[:, None]

    def twist(self, joint: Joint, rate: float | Array = 1.0) -> Array:
        """Unit twist of a joint at the origin, times a rate or rates [n], as [n x 6]; a slide by one unit of length."""
        components = of_scalars(joint.twist(self.origin).components(), self.count) * np.reshape(rate, (-1, 1))
        if joint.point is not None:
            components[:, 3:] *= self.shrink
        return components

    def points(self, points: Sequence[Vector]) -> Array:
        """Points [n x m x 3]."""
        rows = [of_scalars((point - self.origin).components(), self.count) * self.shrink for point in points]
        return np.stack(rows, axis=1) if rows else np.zeros((len(self.length), 0, 3))

    def forces(self, forces: Sequence[Vector]) -> Array:
        """Forces [n x m x 3]."""
        rows = [of_scalars(force.components(), self.count) * (1.0 / self.force)[:, None] for force in forces]
        return np.stack(rows, axis=1) if rows else np.zeros((len(self.length), 0, 3))

    def masses(self, given: Sequence[Weight]) -> Masses:
        """Masses in units of force per m/s²."""
        lighter = (1.0 / self.force)[:, None]
        mass = of_scalars([weight.mass for weight in given], self.count) * lighter
        share = np.array([2.0 / 3.0 if weight.bar else 1.0 for weight in given])
        bars = [number for number, weight in enumerate(given) if weight.bar]
        tensors = [of_scalars(tuple(weight.inertia) or (0.0,) * 6, self.count) for weight in given]
        tensors = [tensor * (lighter * self.shrink * self.shrink) for tensor in tensors]
        return Masses(
            tuple(weight.name for weight in given),
            tuple(weight.carried for weight in given),
            tuple(zip(bars[::2], bars[1::2], strict=True)),
            self.points([weight.point for weight in given]),
            mass,
            mass * share,
            np.stack(tensors, axis=1) if tensors else np.zeros((len(self.length), 0, 6)),
        )

    def inertia(self, number: Scalar, turns: bool) -> Array:
        """An inertia or friction of a slide, kg or N·s/m, or of a turn, kg·m² or N·m·s/rad [n]."""
        lighter = 1.0 / self.force
        return of_scalars([number], self.count)[:, 0] * (lighter / (self.length * self.length) if turns else lighter)

    def stiffness(self, spring: Spring) -> Array:
        """Stiffness of a spring [n]."""
        unit = self.length / self.force if spring.joint.point is None else 1.0 / (self.force * self.length)
        return of_scalars([spring.stiffness], self.count)[:, 0] * unit

    def load(self, spring: Spring, load: Scalar) -> Array:
        """Load in a spring [n]."""
        unit = self.force if spring.joint.point is None else self.force * self.length
        return of_scalars([load], self.count)[:, 0] * (1.0 / unit)


@dataclasses.dataclass
class GivenMotions:
    """Motions whose amounts are given, as they are counted leg by leg: those of actuators, then the growth of links.

    Attributes:
        most: number of all actuators, so that numbers of links follow theirs.
        actuators: springs of the actuators counted so far.
        growth: growth of the links counted so far, m.
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


@dataclasses.dataclass
class _Row:
    """The motions of a leg from base to platform as they come, see `Chain`.

    Attributes:
        carried: for each number of elements, how many motions carry what these carry: without the growth of the links
            that end there, and with it.
    """

    units: Units
    amounts: GivenMotions
    links: list[tuple[Member, Station, Station]]
    travels: Sequence[Array]
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
            self._spring(spring, number)
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

    def masses(self) -> list[Weight]:
        """The masses of the links: the potential of a straight uniform one is that of half its mass at either end."""
        masses: list[Weight] = []
        for link, (first, start), (last, end) in self.links:
            begins = self.carried[first][first < last]  # a rigid link begins before it grows
            if is_zero(link.mass):
                continue
            if link.centre is not None:
                tensor = () if link.inertia is None else link.inertia()
                masses.append(Weight(link.name, begins, link.centre()[1], link.mass, tensor))
            else:
                half = 0.5 * link.mass
                masses += [
                    Weight(link.name, begins, start, half, bar=True),
                    Weight(link.name, self.carried[last][1], end, half, bar=True),
                ]
        return masses

    def _move(self, twist: Array, coordinate: int, given: int = -1) -> None:
        self.twists.append(twist)
        self.coordinate.append(coordinate)
        self.given.append(given)

    def _coordinate(self, spring: Spring | None) -> int:
        """Count another coordinate, with a spring or passive, and return its number."""
        nothing = self.units.nothing
        self.springs.append(spring)
        self.stiffness.append(nothing if spring is None else self.units.stiffness(spring))
        self.preload.append(nothing if spring is None else self.units.load(spring, spring.preload))
        return len(self.springs) - 1

    def _parallelogram(self, bars: Parallelogram, number: int) -> None:
        """Turn about the near side and back about the far one; in between, the bars grow."""
        near, far, turn = bar_turns(bars)
        rate = self.units.length * of_scalars([turn], self.units.count)[:, 0]
        coordinate = self._coordinate(None)
        self._move(self.units.twist(near, rate), coordinate)
        self.grow(number)
        self._move(-self.units.twist(far, rate), coordinate)

    def _spring(self, spring: Spring, number: int) -> None:
        twist = self.units.twist(spring.joint)
        if is_zero(spring.stiffness):
            self._move(twist, self._coordinate(None))
            return
        if spring.actuated:
            self._move(twist, -1, self.amounts.actuator(spring))
        if not _is_rigid(spring.stiffness):
            coordinate = self._coordinate(spring)
            self._move(twist, coordinate)
            if self.travels and not is_zero(spring.returns):
                returned = self.units.load(spring, spring.returns) * self.travels[number - 1]
                self.preload[coordinate] = self.preload[coordinate] + returned


def _is_rigid(stiffness: Scalar) -> bool:
    """Whether a stiffness is infinite, at every pose if it is a column."""
    numbers = plain(stiffness)
    return isinstance(numbers, float | np.ndarray) and bool(np.isinf(numbers).all())


def elastic_leg(
    leg: Leg, units: Units, amounts: GivenMotions, members: Sequence[Member], travels: Sequence[Array] = ()
) -> ElasticLeg:
    """Read a leg as a row of motions.

    Args:
        leg: the leg at the pose.
        units: the units in which it is counted.
        amounts: the given amounts of the legs before; those of this leg are added.
        members: links that belong to it.
        travels: for each element, how far what moves there or last before it is from the home pose, rad or m [n]; empty
            where no flexure hinge asks for it.
    """
    links: list[tuple[Member, Station, Station]] = []
    for link in members:
        ends = () if link.ends is None else link.ends()
        if len(ends) == 2:  # a driven joint at the base is a spring, which gives the link behind it no first end
            links.append((link, *ends))
    row = _Row(units, amounts, links, travels)
    row.grow(0)
    row.carried.append((0, len(row.twists)))
    joints: dict[int, Joint] = {}
    for number, element in enumerate(leg.chain, 1):
        if not isinstance(element, Parallelogram):
            joints.update(enumerate(element.freedoms, len(row.springs)))
        row.add(element, number)
    count, masses, size = len(units.length), row.masses(), len(row.springs)
    twists = np.stack(row.twists, axis=1) if row.twists else np.zeros((count, 0, 6))
    chain = Chain(twists, tuple(row.coordinate), tuple(row.given), size)
    idle = np.zeros((count, size, size))
    if units.count is not None:
        idle = idle_motions(np.swapaxes(twists, 1, 2) @ chain.follows, row.springs)
    return ElasticLeg(
        leg.name,
        chain,
        tuple(row.springs),
        np.stack(row.stiffness, axis=1) if row.stiffness else np.zeros((count, 0)),
        np.stack(row.preload, axis=1) if row.preload else np.zeros((count, 0)),
        np.array([SIGNS[spring.acts] if spring else 0.0 for spring in row.springs]),
        idle,
        units.masses(masses),
        np.zeros((count, size)),
        np.zeros((count, size)),
        _rod(leg, units, [weight.point for weight in masses]),
        tuple(whole for _, whole in row.carried),
        _spin(row, joints, masses),
    )


def _spin(row: _Row, joints: Mapping[int, Joint], masses: Sequence[Weight]) -> tuple[int, Array] | None:
    """The link of a leg that spins between two ball joints, see `ElasticLeg`: it bears no mass beside their centres.

    Args:
        row: the motions of the leg.
        joints: the leg's joints by the numbers of their coordinates.
        masses: the masses that the leg carries.
    """
    passive = [number for number, spring in enumerate(row.springs) if spring is None]
    groups = [passive[k : k + 3] for k in range(len(passive) - 2)]
    balls = [ball for ball in groups if ball[2] == ball[0] + 2 and _centre(joints, ball) is not None]
    for near, far in pairwise(balls):
        start, end = _centre(joints, near), _centre(joints, far)
        if start is None or end is None or start.is_at(end) or passive.index(far[0]) != passive.index(near[2]) + 1:
            continue
        between = range(row.coordinate.index(near[0]) + 1, row.coordinate.index(far[2]) + 1)
        if all(mass.carried not in between or mass.point.is_at(start) or mass.point.is_at(end) for mass in masses):
            return near[0], row.units.points([end])[:, 0] - row.units.points([start])[:, 0]
    return None


def _centre(joints: Mapping[int, Joint], ball: Sequence[int]) -> Vector | None:
    """The point about which three coordinates turn; None if they have no common one."""
    points = [joints[number].point for number in ball if number in joints and is_zero(joints[number].pitch)]
    point = points[0] if len(points) == len(ball) else None
    return point if point is not None and all(other is not None and point.is_at(other) for other in points) else None


def _rod(leg: Leg, units: Units, weights: Sequence[Vector]) -> tuple[Array, Array] | None:
    """Both ends of a leg that is a rod between two joints with one centre each, and its springs along it.

    A family says so by the line of its force. A leg of a file is judged by its numbers; those of a program are judged
    before it is traced (`cut.cut_machine`).
    """
    if len(leg.lines) > 1:
        return None
    turning = [number for number, element in enumerate(leg.chain) if element.freedoms]
    slides = [number for number, element in enumerate(leg.chain) if element.springs]
    ends = [leg.chain[n].freedoms[0].point for n in (0, -1) if leg.chain[n].freedoms]
    if len(ends) != 2 or not slides or slides != list(range(slides[0], slides[-1] + 1)) or set(slides) & set(turning):
        return None
    points = [ends[number > slides[0]] for number in turning]
    centred = all(j.point is p for n, p in zip(turning, points, strict=True) for j in leg.chain[n].freedoms)
    if not (centred and all(any(point is end for end in ends) for point in weights)):
        return None
    near, far = (units.points([end])[:, 0] for end in ends if end is not None)
    if leg.lines:
        straight = all(s.joint.point is None and s.joint.axis is leg.lines[0].direction for s in leg.springs)
    else:
        axes = [joint for number in turning for joint in leg.chain[number].freedoms]
        at_base = sum(joint.point is ends[0] for joint in axes)
        balls = min(at_base, len(axes) - at_base) >= 2 and len(axes) >= 5 and not any(j.pitch for j in axes)
        straight = balls and all(
            s.joint.point is None and _is_along(s.joint.axis, far - near, units) for s in leg.springs
        )
    return (near, far) if straight else None


def _is_along(axis: Vector, span: Array, units: Units) -> bool:
    """Whether an axis has the direction of a rod [n x 3] at all poses; of a program it has been judged before."""
    if units.count is None:
        return True
    across = np.cross(of_scalars(axis.components(), units.count), span)
    sizes = np.linalg.norm(across, axis=1) / np.linalg.norm(span, axis=1)
    return bool(np.all(sizes[np.isfinite(sizes)] < PARALLEL_AXES))


def idle_motions(rates: Array, springs: Sequence[Spring | None]) -> Array:
    """Motions of the passive coordinates that leave the leg's end where it is, to first order [n x c x c].

    They are those of a state: where loads have moved a leg, a strut spins about another line than in the free state.

    Args:
        rates: twist of the leg's end per unit of each coordinate [n x 6 x c].
        springs: the spring of each coordinate; None of a passive one.
    """
    passive = [i for i, spring in enumerate(springs) if spring is None]
    count = len(rates)
    result = np.zeros((count, len(springs), len(springs)))
    if not passive:
        return result
    # Where a pose has no place, nothing is idle.
    moving = np.where(np.isfinite(rates), rates, 0.0)[:, :, passive]
    _, sizes, rows = np.linalg.svd(moving, full_matrices=True)
    weights = np.zeros((count, len(passive)))
    weights[:, : sizes.shape[1]] = sizes
    kept = rows * (weights < DEPENDENT)[:, :, None]
    result[:, passive, : len(passive)] = np.swapaxes(kept, 1, 2)
    return result

"""Reads a leg of a machine as a row of screw motions with springs and masses, in the units of a mechanism.

Nothing is solved here. Units, axes and origin are those of `mechanism`.

Source: theory (35).
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import pairwise

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.elastic_legs import ElasticLeg, FreeSpin, Masses, RodEnds, idle_motions
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import Chain, bar_turns
from kinetostat.machine.column import plain
from kinetostat.machine.leg import Element, Joint, Leg, Spring, Station
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Member
from kinetostat.numerics.motions import of_scalars
from kinetostat.tolerances import PARALLEL_AXES

SIGNS = {"": 0.0, "pulls": 1.0, "pushes": -1.0}
"""Sign of the loads that a spring carries if it carries those of one sign only, by what its file says."""
UNCOUPLED_SHARE_OF_BAR = 2.0 / 3.0
"""Share of half a bar, at either end, whose kinetic energy is its own: a third of the bar, see `Masses`."""


@dataclass(frozen=True)
class Weight:
    """A mass at a point.

    Attributes:
        name: name of the part to which it belongs.
        carried: number of the leg's screw motions that carry it; not used of the platform.
        point: its place in the free state, m.
        mass: its mass, kg.
        inertia: inertia about the point, base axes: xx, yy, zz, xy, xz, yz, kg·m²; zero if empty.
        bar: whether it is half of a uniform straight bar, whose other half is its neighbour in a list.
    """

    name: str
    carried: int
    point: Vector
    mass: Scalar
    inertia: Sequence[Scalar] = ()
    bar: bool = False


@dataclass(frozen=True)
class Units:
    """Units of a mechanism at n poses, and the conversion of a machine's numbers to them.

    Attributes:
        origin: the point from which places are measured, m.
        length: unit of length, m [n].
        force: unit of force, N [n].
        count: number of poses, n; None for one pose whose numbers are of any kind, see `mechanism_of`.
    """

    origin: Vector
    length: Array
    force: Array
    count: int | None

    @property
    def zero(self) -> Array:
        """0 at each pose [n]."""
        return of_scalars([0.0], self.count)[:, 0]

    @property
    def per_metre(self) -> Array:
        """Units of length in a metre [n x 1]; products with it keep what is zero by form."""
        return (1.0 / self.length)[:, None]

    def twist(self, joint: Joint, rate: float | Array = 1.0) -> Array:
        """Unit twist of a joint at the origin, times a rate or rates [n], as [n x 6]; a slide by one unit of length."""
        components = of_scalars(joint.twist(self.origin).components(), self.count) * np.reshape(rate, (-1, 1))
        if joint.point is not None:
            components[:, 3:] *= self.per_metre
        return components

    def points(self, points: Sequence[Vector]) -> Array:
        """Points [n x m x 3]."""
        rows = [of_scalars((point - self.origin).components(), self.count) * self.per_metre for point in points]
        return self.vectors(rows, 3)

    def forces(self, forces: Sequence[Vector]) -> Array:
        """Forces [n x m x 3]."""
        rows = [of_scalars(force.components(), self.count) * (1.0 / self.force)[:, None] for force in forces]
        return self.vectors(rows, 3)

    def masses(self, weights: Sequence[Weight]) -> Masses:
        """Masses in units of force per m/s²."""
        per_newton = (1.0 / self.force)[:, None]
        mass = of_scalars([weight.mass for weight in weights], self.count) * per_newton
        uncoupled_shares = np.array([UNCOUPLED_SHARE_OF_BAR if weight.bar else 1.0 for weight in weights])
        halves = [number for number, weight in enumerate(weights) if weight.bar]
        tensors = [of_scalars(tuple(weight.inertia) or (0.0,) * 6, self.count) for weight in weights]
        return Masses(
            names=tuple(weight.name for weight in weights),
            carried=tuple(weight.carried for weight in weights),
            pairs=tuple(zip(halves[::2], halves[1::2], strict=True)),
            point=self.points([weight.point for weight in weights]),
            mass=mass,
            uncoupled=mass * uncoupled_shares,
            inertia=self.vectors([tensor * (per_newton * self.per_metre * self.per_metre) for tensor in tensors], 6),
        )

    def inertia(self, number: Scalar, turns: bool) -> Array:
        """An inertia or friction of a slide, kg or N·s/m, or of a turn, kg·m² or N·m·s/rad [n]."""
        per_newton = 1.0 / self.force
        unit = per_newton / (self.length * self.length) if turns else per_newton
        return of_scalars([number], self.count)[:, 0] * unit

    def stiffness(self, spring: Spring) -> Array:
        """Stiffness of a spring [n]."""
        unit = self.length / self.force if spring.joint.point is None else 1.0 / (self.force * self.length)
        return of_scalars([spring.stiffness], self.count)[:, 0] * unit

    def load(self, spring: Spring, load: Scalar) -> Array:
        """Load in a spring [n]."""
        unit = self.force if spring.joint.point is None else self.force * self.length
        return of_scalars([load], self.count)[:, 0] * (1.0 / unit)

    def columns(self, numbers: Sequence[Array]) -> Array:
        """Numbers at the poses, m arrays [n], as one [n x m], also where there are none."""
        return np.stack(numbers, axis=1) if numbers else np.zeros((len(self.length), 0))

    def vectors(self, vectors: Sequence[Array], width: int) -> Array:
        """Vectors at the poses, m arrays [n x width], as one [n x m x width], also where there are none."""
        return np.stack(vectors, axis=1) if vectors else np.zeros((len(self.length), 0, width))


@dataclasses.dataclass
class GivenMotions:
    """Motions whose amounts are given, as they are counted leg by leg: those of actuators, then the growth of links.

    Attributes:
        actuator_count: number of all actuators of the machine, so that numbers of links follow theirs.
        actuators: springs of the actuators counted so far.
        growth: growth of the links counted so far, m.
    """

    actuator_count: int
    actuators: list[Spring] = field(default_factory=list)
    growth: list[Scalar] = field(default_factory=list)

    def actuator(self, spring: Spring) -> int:
        """Count another actuator and return its number."""
        self.actuators.append(spring)
        return len(self.actuators) - 1

    def link(self, growth: Scalar) -> int:
        """Count another link that grows and return its number."""
        self.growth.append(growth)
        return self.actuator_count + len(self.growth) - 1


@dataclasses.dataclass
class _LegReader:
    """The motions of a leg from base to platform as they come, see `Chain`.

    Attributes:
        units, amounts, travels: arguments of `elastic_leg`.
        links: links of the leg, with both of their ends.
        twists, coordinate, given: as in `Chain`, motion by motion.
        springs, stiffness, preload: as in `ElasticLeg`, coordinate by coordinate.
        counts: entry k is the number of motions before the end of element k.
        counts_without_growth: the same without the growth of the links that end there.
    """

    units: Units
    amounts: GivenMotions
    travels: Sequence[Array]
    links: list[tuple[Member, Station, Station]]
    twists: list[Array] = field(default_factory=list)
    coordinate: list[int] = field(default_factory=list)
    given: list[int] = field(default_factory=list)
    springs: list[Spring | None] = field(default_factory=list)
    stiffness: list[Array] = field(default_factory=list)
    preload: list[Array] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    counts_without_growth: list[int] = field(default_factory=list)

    def read(self, chain: Sequence[Element]) -> dict[int, Joint]:
        """Add all elements and links, and return the passive joints by the numbers of their coordinates."""
        joints: dict[int, Joint] = {}
        self._count_motions(0)
        for number, element in enumerate(chain, 1):
            if isinstance(element, Parallelogram):
                self._add_parallelogram(element, number)
            else:
                joints.update(enumerate(element.freedoms, len(self.springs)))
                for joint in element.freedoms:
                    self._add_motion(self.units.twist(joint), self._new_coordinate(None))
            for spring in element.springs:
                self._add_spring(spring, number)
            self._count_motions(number, grows=not isinstance(element, Parallelogram))
        return joints

    def weights(self) -> list[Weight]:
        """The masses of the links: the potential of a straight uniform one is that of half its mass at either end."""
        weights: list[Weight] = []
        for link, (first, start), (last, end) in self.links:
            if is_zero(link.mass):
                continue
            # A link between two places of one body begins before it grows, and only its end is carried by its growth.
            begins = self.counts[first] if first < last else self.counts_without_growth[first]
            if link.centre is not None:
                tensor = () if link.inertia is None else link.inertia()
                weights.append(Weight(link.name, begins, link.centre()[1], link.mass, tensor))
            else:
                half = 0.5 * link.mass
                weights.append(Weight(link.name, begins, start, half, bar=True))
                weights.append(Weight(link.name, self.counts[last], end, half, bar=True))
        return weights

    def _count_motions(self, number: int, grows: bool = True) -> None:
        """Note how many motions end with an element; links that end there grow, unless they have done so inside it."""
        self.counts_without_growth.append(len(self.twists))
        if grows:
            self._grow_links(number)
        self.counts.append(len(self.twists))

    def _grow_links(self, number: int) -> None:
        """Add the growth of the links that end behind an element: slides along them."""
        for link, (_, start), (behind, end) in self.links:
            if behind == number and not is_zero(link.growth):
                span = end - start
                slide = Joint(span * reciprocal(span.norm()))
                self._add_motion(self.units.twist(slide), -1, self.amounts.link(link.growth))

    def _add_motion(self, twist: Array, coordinate: int, given: int = -1) -> None:
        self.twists.append(twist)
        self.coordinate.append(coordinate)
        self.given.append(given)

    def _new_coordinate(self, spring: Spring | None) -> int:
        """Count another coordinate, with a spring or passive, and return its number."""
        zero = self.units.zero
        self.springs.append(spring)
        self.stiffness.append(zero if spring is None else self.units.stiffness(spring))
        self.preload.append(zero if spring is None else self.units.load(spring, spring.preload))
        return len(self.springs) - 1

    def _add_parallelogram(self, bars: Parallelogram, number: int) -> None:
        """Turn about the near side and back about the far one; in between, the bars grow."""
        near, far, turn = bar_turns(bars)
        rate = self.units.length * of_scalars([turn], self.units.count)[:, 0]
        coordinate = self._new_coordinate(None)
        self._add_motion(self.units.twist(near, rate), coordinate)
        self._grow_links(number)
        self._add_motion(-self.units.twist(far, rate), coordinate)

    def _add_spring(self, spring: Spring, number: int) -> None:
        """Add a spring of the element with this number: its drive, if it has one, and what deflects."""
        twist = self.units.twist(spring.joint)
        if is_zero(spring.stiffness):
            self._add_motion(twist, self._new_coordinate(None))
            return
        if spring.actuated:
            self._add_motion(twist, -1, self.amounts.actuator(spring))
        if not _is_rigid(spring.stiffness):
            coordinate = self._new_coordinate(spring)
            self._add_motion(twist, coordinate)
            if self.travels and not is_zero(spring.return_stiffness):
                returning_load = self.units.load(spring, spring.return_stiffness) * self.travels[number - 1]
                self.preload[coordinate] = self.preload[coordinate] + returning_load


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
        travels: travel from the home pose, for each element, of the joint there or the last one before it, rad or m
            [n]; empty where no flexure hinge asks for it.
    """
    links: list[tuple[Member, Station, Station]] = []
    for link in members:
        ends = () if link.ends is None else link.ends()
        if len(ends) == 2:  # a driven joint at the base is a spring, which gives the link behind it no first end
            links.append((link, *ends))
    row = _LegReader(units, amounts, travels, links)
    joints = row.read(leg.chain)
    count, size, weights = len(units.length), len(row.springs), row.weights()
    twists = units.vectors(row.twists, 6)
    chain = Chain(twists, tuple(row.coordinate), tuple(row.given), size)
    idle = np.zeros((count, size, size))
    if units.count is not None:
        idle = idle_motions(twists.mT @ chain.follows, row.springs)
    return ElasticLeg(
        name=leg.name,
        chain=chain,
        springs=tuple(row.springs),
        stiffness=units.columns(row.stiffness),
        preload=units.columns(row.preload),
        sign=np.array([SIGNS[spring.acts] if spring else 0.0 for spring in row.springs]),
        idle=idle,
        masses=units.masses(weights),
        rotors=np.zeros((count, size)),
        dampers=np.zeros((count, size)),
        motion_counts=tuple(row.counts),
        rod=_rod_ends(leg, units, weights),
        spin=_free_spin(row, joints, weights),
    )


def _free_spin(row: _LegReader, joints: Mapping[int, Joint], weights: Sequence[Weight]) -> FreeSpin | None:
    """The link of a leg that spins between two ball joints: it bears no mass beside their centres.

    Args:
        row: the motions of the leg.
        joints: the leg's joints by the numbers of their coordinates.
        weights: the masses that the leg carries.
    """
    passive = [number for number, spring in enumerate(row.springs) if spring is None]
    triples = [passive[k : k + 3] for k in range(len(passive) - 2)]
    balls = [triple for triple in triples if triple[2] == triple[0] + 2 and _centre(joints, triple) is not None]
    for near, far in pairwise(balls):
        start, end = _centre(joints, near), _centre(joints, far)
        if start is None or end is None or start.is_at(end) or passive.index(far[0]) != passive.index(near[2]) + 1:
            continue
        between = range(row.coordinate.index(near[0]) + 1, row.coordinate.index(far[2]) + 1)
        if all(mass.carried not in between or mass.point.is_at(start) or mass.point.is_at(end) for mass in weights):
            return FreeSpin(near[0], row.units.points([end])[:, 0] - row.units.points([start])[:, 0])
    return None


def _centre(joints: Mapping[int, Joint], coordinates: Sequence[int]) -> Vector | None:
    """The point about which three coordinates turn; None if they have no common one."""
    points = [joints[number].point for number in coordinates if number in joints and is_zero(joints[number].pitch)]
    point = points[0] if len(points) == len(coordinates) else None
    return point if point is not None and all(other is not None and point.is_at(other) for other in points) else None


def _rod_ends(leg: Leg, units: Units, weights: Sequence[Weight]) -> RodEnds | None:
    """Both ends of a leg that is a rod between two joints with one centre each, and its springs along it.

    A family says so by the line of its force. A leg of a file is judged by its numbers; those of a program are judged
    before it is traced (`cut.cut_machine`).
    """
    centres = None if len(leg.lines) > 1 else _end_centres(leg)
    if centres is None or any(all(weight.point is not centre for centre in centres) for weight in weights):
        return None
    axes = [spring.joint.axis for spring in leg.springs if spring.joint.point is None]
    if len(axes) < len(leg.springs):
        return None
    near, far = (units.points([centre])[:, 0] for centre in centres)
    if leg.lines:
        is_rod = all(axis is leg.lines[0].direction for axis in axes)
    else:
        is_rod = _turns_at_both_ends(leg, centres) and all(_is_along(axis, far - near, units) for axis in axes)
    return RodEnds(near, far) if is_rod else None


def _end_centres(leg: Leg) -> tuple[Vector, Vector] | None:
    """The two points about which all joints before and behind the springs of a leg turn; None if there are no such.

    Points are the same if they are one object: the numbers of traced ones are not known.
    """
    places = [number for number, element in enumerate(leg.chain) if element.springs]
    if not (places and leg.chain[0].freedoms and leg.chain[-1].freedoms):
        return None
    first, last = places[0], places[-1]
    if any(element.freedoms or not element.springs for element in leg.chain[first : last + 1]):
        return None
    near, far = (
        [joint.point for element in part for joint in element.freedoms]
        for part in (leg.chain[:first], leg.chain[last + 1 :])
    )
    start, end = near[0], far[0]
    if start is None or end is None:  # a slide
        return None
    return (start, end) if all(p is start for p in near) and all(p is end for p in far) else None


def _turns_at_both_ends(leg: Leg, centres: tuple[Vector, Vector]) -> bool:
    """Whether the joints of a leg pass on a force alone: at one end a ball joint, at the other that or a universal."""
    joints = [joint for element in leg.chain for joint in element.freedoms]
    at_start = sum(joint.point is centres[0] for joint in joints)
    return len(joints) >= 5 and min(at_start, len(joints) - at_start) >= 2 and not any(joint.pitch for joint in joints)


def _is_along(axis: Vector, span: Array, units: Units) -> bool:
    """Whether an axis has the direction of a rod [n x 3] at all poses; of a program it has been judged before."""
    if units.count is None:
        return True
    across = np.cross(of_scalars(axis.components(), units.count), span)
    sizes = np.linalg.norm(across, axis=1) / np.linalg.norm(span, axis=1)
    return bool(np.all(sizes[np.isfinite(sizes)] < PARALLEL_AXES))

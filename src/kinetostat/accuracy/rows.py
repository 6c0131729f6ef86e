"""Legs as rows of screw motions from a home place, with the joints that these belong to: what errors displace.

The home place of a machine written leg by leg is its home pose; that of a family is the pose of its file. Screws are at
the base origin, in base axes, SI. Nothing is solved here. Flexure hinges count as joints that move freely, and springs
as rigid.

Source: theory (35) and (45).
"""

import dataclasses
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property, partial
from itertools import chain as chained
from itertools import count as counted

import numpy as np

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.elastic_legs import FEW_POSES
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import Chain, PlacedChain, bar_turns
from kinetostat.machine.actuators import actuators_of, joint_actuators, senses_of
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Configuration, Machine

SAMPLES = 40
"""Number of random configurations of a leg at which ranks are taken: one would nearly always do, but might lie near a
singular one."""
LARGEST_TURN = 0.35
"""Farthest rotation of joints there from the home place, rad: 20 deg, so that most legs stay within reach."""
LARGEST_TRAVEL = 0.15
"""Farthest displacement of joints there, as a share of the machine's length."""
CENTRES = {2: "universal", 3: "ball"}
"""Names of revolutes in a row through one point, by their number."""
ErrorScrews = list[dict[int, Array]]
"""For each leg, the small screw motions by its errors in home place [n x 6], by the number of motions before them;
[1 x 6] where one is the same at all poses."""


@dataclass(frozen=True)
class ActuatorReading:
    """Coordinate of an actuator as a function of the joint's.

    Attributes:
        coordinate: number of its coordinate in the leg.
        number: number of the actuator in the machine.
        home: coordinate of the actuator at the home place, m or rad.
        sense: 1 where it grows with the joint's coordinate, else -1.
        slides: whether it is linear.
    """

    coordinate: int
    number: int
    home: float
    sense: float
    slides: bool


ReadingAt = Callable[[int], ActuatorReading]
"""Makes the reading of an actuator from the number of its coordinate, which is known once its leg is a row."""


@dataclass(frozen=True)
class Unit:
    """A joint of a leg: motions that belong together.

    Attributes:
        name: in its leg, "base joint".
        kind: "revolute", "slide", "screw", "universal", "ball" or "parallelogram".
        first, last: number of its first motion, and of the first motion behind it.
        point: its centre, m, base frame; None for a slide that has none.
        axes: unit vectors of its motions; of a parallelogram the normal of its plane.
        drive: reading of its actuator; None for a joint without one.
        bars: the parallelogram that it is; None for other joints.
    """

    name: str
    kind: str
    first: int
    last: int
    point: Vector | None
    axes: tuple[Vector, ...]
    drive: ActuatorReading | None = None
    bars: Parallelogram | None = None


@dataclasses.dataclass
class LegRow:
    """A leg at its home place as a row of screw motions.

    `home_rows` adds its joints one after another; the properties are asked for only when all of them are there.

    Attributes:
        name: name of the leg.
        twists: unit twist of each motion at the base origin [motions][6]; slides per m, turns per rad.
        coordinate: number of the leg's coordinate that each motion follows [motions].
        units: its joints from base to platform.
        slides: whether each coordinate is a length [coordinates].
        motions_before: number of the motions before each element of the leg's chain [elements].
    """

    name: str
    twists: list[Array] = field(default_factory=list)
    coordinate: list[int] = field(default_factory=list)
    units: list[Unit] = field(default_factory=list)
    slides: list[bool] = field(default_factory=list)
    motions_before: list[int] = field(default_factory=list)

    @property
    def size(self) -> int:
        """Number of its coordinates."""
        return len(self.slides)

    @cached_property
    def driven_coordinates(self) -> tuple[int, ...]:
        """Its coordinates that actuators hold."""
        return tuple(unit.drive.coordinate for unit in self.units if unit.drive)

    @cached_property
    def free_coordinates(self) -> tuple[int, ...]:
        """Its coordinates that move freely."""
        return tuple(i for i in range(self.size) if i not in self.driven_coordinates)

    @cached_property
    def chain(self) -> Chain:
        """Its motions."""
        twists = np.array(self.twists, dtype=float).reshape(1, -1, 6)
        return Chain(twists, tuple(self.coordinate), (-1,) * len(self.twists), self.size)

    def add_joint(self, kind: str, name: str, joints: Sequence[Joint], drive: ActuatorReading | None = None) -> None:
        """Add a joint of one motion, or of several about one point, from its freedoms."""
        first = len(self.twists)
        for joint in joints:
            self._add_motion(joint, self._new_coordinate(joint.point is None))
        point = joints[0].point if joints[0].point is not None else joints[0].carriage
        axes = tuple(joint.axis for joint in joints)
        self.units.append(Unit(name, kind, first, len(self.twists), point, axes, drive=drive))

    def add_parallelogram(self, name: str, bars: Parallelogram) -> None:
        """Add a parallelogram: a turn about its near side and a turn back about its far one, m of arc."""
        first, coordinate = len(self.twists), self._new_coordinate(slides=True)
        near, far, rate = bar_turns(bars)
        self._add_motion(near, coordinate, rate)
        self._add_motion(far, coordinate, -rate)
        self.units.append(Unit(name, "parallelogram", first, first + 2, bars.near, (bars.normal,), bars=bars))

    def _new_coordinate(self, slides: bool) -> int:
        self.slides.append(slides)
        return len(self.slides) - 1

    def _add_motion(self, joint: Joint, coordinate: int, rate: float = 1.0) -> None:
        self.twists.append(rate * np.array(joint.twist(ZERO).components(), dtype=float))
        self.coordinate.append(coordinate)


@dataclass(frozen=True)
class HomeRows:
    """A machine at its home place.

    Attributes:
        legs: the legs of the machine.
        configuration: the machine there.
        rotation, point: placement of the platform there, with its axes as columns [3 x 3], and P, m [3].
        length: a characteristic length, m.
        absent: twists that a planar machine does not have, at the base origin [k x 6].
    """

    legs: tuple[LegRow, ...]
    configuration: Configuration
    rotation: Array
    point: Array
    length: float
    absent: Array


def random_coordinates(row: LegRow, length: float) -> Array:
    """Return random coordinates of a leg around its home place [samples x coordinates].

    The seed is fixed, so that the list of errors of a machine never depends on chance.

    Args:
        row: the leg.
        length: a characteristic length of the machine, m.
    """
    units = np.where(row.slides, LARGEST_TRAVEL * length, LARGEST_TURN)
    return np.random.default_rng(0).uniform(-1.0, 1.0, (SAMPLES, row.size)) * units


def home_rows(machine: Machine) -> HomeRows:
    """Read a machine at its home place.

    Args:
        machine: the machine with numbers; a family at its pose, at which it must have a place.
    """
    if machine.family.chains is None:
        configuration = machine.configure()
        pairs = zip(actuators_of(configuration), senses_of(configuration), strict=True)
        readings = [(a.leg, float(a.coordinate), float(sense), a.slides) for a, sense in pairs]
    else:
        chains = machine.chains()
        configuration = machine.configure((0.0,) * chains.size)
        actuators = joint_actuators(chains, [leg.name for leg in configuration.legs])
        readings = [(a.leg, a.offset, a.sign, a.slides) for a in actuators]
    readings_of_leg: dict[str, list[ReadingAt]] = {leg.name: [] for leg in configuration.legs}
    for number, (leg_name, home, sense, slides) in enumerate(readings):
        readings_of_leg[leg_name].append(partial(ActuatorReading, number=number, home=home, sense=sense, slides=slides))
    turn, plane = configuration.platform.rotation, configuration.plane
    absent = () if plane is None else plane.missing_freedoms
    return HomeRows(
        legs=tuple(_row(leg, iter(readings_of_leg[leg.name])) for leg in configuration.legs),
        configuration=configuration,
        rotation=np.array([axis.components() for axis in (turn.x, turn.y, turn.z)], dtype=float).T,
        point=np.array(configuration.platform.translation.components(), dtype=float),
        length=float(configuration.length),
        absent=np.array([joint.twist(ZERO).components() for joint in absent], dtype=float).reshape(-1, 6),
    )


def _row(leg: Leg, readings: Iterator[ReadingAt]) -> LegRow:
    """Return a leg as a row of motions, with the readings of its actuators, which stand in the order of the leg."""
    row, names, elements = LegRow(leg.name), _JointNames(leg.name), list(leg.chain)
    place = 0
    while place < len(elements):
        element, motions_before = elements[place], len(row.twists)
        row.motions_before.append(motions_before)
        if isinstance(element, Parallelogram):
            row.add_parallelogram(names.free_name(element.name, "parallelogram"), element)
        elif isinstance(element, Joint):
            count = _count_about_point(elements[place:])
            joints = [joint for joint in elements[place : place + count] if isinstance(joint, Joint)]
            row.add_joint(CENTRES.get(count, _kind(element)), names.free_name(element.name), joints)
            place += count - 1
            row.motions_before += range(motions_before + 1, motions_before + count)
        elif isinstance(element, Spring) and _is_motion(element, elements[:place]):
            reading_at = next(readings) if element.actuated else None
            if is_zero(element.stiffness):
                reading_at = None  # an actuator without stiffness moves freely
            drive = reading_at(row.size) if reading_at else None
            name = names.free_name(element.joint.name or element.part_name)
            row.add_joint(_kind(element.joint), name, [element.joint], drive)
        place += 1
    return row


def _is_motion(spring: Spring, before: Sequence[Element]) -> bool:
    """Whether a spring is a motion: an actuator, a hinge or a free one, and the first of a row of springs."""
    if not (spring.actuated or spring.hinge or is_zero(spring.stiffness)):
        return False
    last = before[-1] if before else None
    return not (isinstance(last, Spring) and last.joint == spring.joint and (last.actuated or last.hinge))


def _kind(joint: Joint) -> str:
    if joint.point is None:
        return "slide"
    return "revolute" if is_zero(joint.pitch) else "screw"


def _count_about_point(elements: Sequence[Element]) -> int:
    """Count the revolutes at the head of a chain that turn about one point and have one name: 1 to 3."""
    first, count = elements[0], 1
    if not (isinstance(first, Joint) and _kind(first) == "revolute"):
        return 1
    for other in elements[1:3]:
        if not (isinstance(other, Joint) and _kind(other) == "revolute" and other.name == first.name):
            break
        if other.point != first.point:
            break
        count += 1
    return count


class _JointNames:
    """Names of the joints of a leg, each once."""

    def __init__(self, leg: str) -> None:
        self.leg, self.used = leg, set[str]()

    def free_name(self, title: str, second_choice: str = "") -> str:
        """Return the name of a joint without that of its leg; if it is used, the second choice, or one with a number.

        A name is a part of a path, and so it has no dot.
        """
        name = title.removeprefix(f"{self.leg} ").replace(".", " ") or "joint"
        if second_choice and name in self.used:
            name = second_choice
        names = chained([name], (f"{name} {number}" for number in counted(2)))
        name = next(name for name in names if name not in self.used)
        self.used.add(name)
        return name


@dataclass(frozen=True)
class LikeRows:
    """Legs whose motions, freedoms and drives are alike: all poses of the first of them, then all of the second.

    At a few poses, time goes into calls of NumPy more than into numbers: six legs take little longer than one.

    Attributes:
        numbers: numbers of the legs.
        row: the first of them.
        chain: the motions of all of them [legs x motions x 6].
        independent: numbers of the free screws of each that are independent, see `closing.Screws`.
    """

    numbers: tuple[int, ...]
    row: LegRow
    chain: Chain
    independent: tuple[int, ...]

    def place(self, coordinates: Sequence[Array], screws: ErrorScrews) -> PlacedChain:
        """Place the legs [legs * n] by coordinates [n x coordinates] and error screws of all legs of the machine."""
        count = len(coordinates[self.numbers[0]])
        places = sorted({behind for k in self.numbers for behind in screws[k]})
        screws_of_group = {behind: self._screws_behind(behind, screws, count) for behind in places}
        return self.chain.place(np.concatenate([coordinates[k] for k in self.numbers]), errors=screws_of_group)

    def _screws_behind(self, behind: int, screws: ErrorScrews, count: int) -> Array:
        """Return the screws behind so many motions [legs x 6], or [legs * n x 6] if those of a leg differ by pose."""
        screws_of_legs = [screws[k].get(behind, np.zeros((1, 6))) for k in self.numbers]
        if any(len(screw) > 1 for screw in screws_of_legs):
            screws_of_legs = [np.broadcast_to(screw, (count, 6)) for screw in screws_of_legs]
        return np.concatenate(screws_of_legs)


def like_rows(rows: HomeRows, independent: Sequence[tuple[int, ...]], count: int) -> list[LikeRows]:
    """Put the legs that are alike together; at more than `FEW_POSES` poses each leg is a group by itself.

    Args:
        rows: the machine.
        independent: for each leg, numbers of its free screws that are independent, see `closing.Screws`.
        count: number of poses.
    """
    groups: dict[Hashable, list[int]] = {}
    for number, row in enumerate(rows.legs):
        alone = number if count > FEW_POSES else None
        form = alone, tuple(row.coordinate), tuple(row.slides), row.free_coordinates, independent[number]
        groups.setdefault(form, []).append(number)
    result = []
    for numbers in groups.values():
        first = rows.legs[numbers[0]]
        twists = np.concatenate([rows.legs[k].chain.twists for k in numbers])
        chain_of_legs = replace(first.chain, twists=twists)
        result.append(LikeRows(tuple(numbers), first, chain_of_legs, independent[numbers[0]]))
    return result


def by_leg(groups: Sequence[LikeRows], values: Sequence[Array]) -> list[Array]:
    """Return values of groups [legs * n x ...] as those of each leg [n x ...], in the order of the machine's legs."""
    value_of_leg: dict[int, Array] = {}
    for group, group_values in zip(groups, values, strict=True):
        value_of_leg.update(zip(group.numbers, np.split(group_values, len(group.numbers)), strict=True))
    return [value_of_leg[number] for number in range(len(value_of_leg))]

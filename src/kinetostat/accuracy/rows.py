"""Legs as rows of screw motions from a home place, with the joints that these belong to: what errors displace.

The home place of a machine written leg by leg is its home pose; that of a family is the pose of its file. Screws are at
the base origin, in base axes, SI. Nothing is solved here. Flexure hinges count as joints that move freely, and springs
as rigid.

Source: theory (35) and (45).
"""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

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
Errors = list[dict[int, Array]]
"""For each leg, by the number of motions before it, the small screw motion of an error in home place [n x 6]; [1 x 6]
where it is the same at all poses."""


@dataclass(frozen=True)
class ActuatorReading:
    """Coordinate of an actuator as a function of the joint's.

    Attributes:
        number: number of the actuator in the machine.
        coordinate: number of its coordinate in the leg.
        home: coordinate of the actuator at the home place, m or rad.
        sense: 1 where it grows with the joint's coordinate, else -1.
        slides: whether it is linear.
    """

    number: int
    coordinate: int
    home: float
    sense: float
    slides: bool


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

    Attributes:
        name: name of the leg.
        twists: unit twist of each motion at the base origin [motions][6]; slides per m, turns per rad.
        coordinate: number of the leg's coordinate that each motion follows [motions].
        units: its joints from base to platform.
        slides: whether each coordinate is a length [coordinates].
        carried: for each element of the leg's chain, the number of motions before it.
    """

    name: str
    twists: list[Array] = field(default_factory=list)
    coordinate: list[int] = field(default_factory=list)
    units: list[Unit] = field(default_factory=list)
    slides: list[bool] = field(default_factory=list)
    carried: list[int] = field(default_factory=list)

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
        """Its motions, once all of them are known."""
        twists = np.array(self.twists, dtype=float).reshape(1, -1, 6)
        return Chain(twists, tuple(self.coordinate), (-1,) * len(self.twists), self.size)

    def add(self, kind: str, name: str, joints: Sequence[Joint], drive: ActuatorReading | None = None) -> None:
        """Add a joint of one motion, or of several about one point, from its freedoms."""
        first = len(self.twists)
        for joint in joints:
            self._move(joint, self._coordinate(joint.point is None))
        point = joints[0].point if joints[0].point is not None else joints[0].carriage
        axes = tuple(joint.axis for joint in joints)
        self.units.append(Unit(name, kind, first, len(self.twists), point, axes, drive=drive))

    def add_bars(self, name: str, bars: Parallelogram) -> None:
        """Add a parallelogram: a turn about its near side and a turn back about its far one, m of arc."""
        first, coordinate = len(self.twists), self._coordinate(True)
        near, far, rate = bar_turns(bars)
        self._move(near, coordinate, rate)
        self._move(far, coordinate, -rate)
        self.units.append(Unit(name, "parallelogram", first, first + 2, bars.near, (bars.normal,), bars=bars))

    def _coordinate(self, slides: bool) -> int:
        self.slides.append(slides)
        return len(self.slides) - 1

    def _move(self, joint: Joint, coordinate: int, rate: float = 1.0) -> None:
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
    """Return random coordinates of a leg around its home place [samples x coordinates], the same ones each time.

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
    of_legs: dict[str, list[ActuatorReading]] = {leg.name: [] for leg in configuration.legs}
    for number, (leg_name, home, sense, slides) in enumerate(readings):
        # Its coordinate is known once its leg is a row.
        of_legs[leg_name].append(ActuatorReading(number, -1, home, sense, slides))
    turn, plane = configuration.platform.rotation, configuration.plane
    absent = () if plane is None else plane.missing_freedoms
    return HomeRows(
        legs=tuple(_row(leg, iter(of_legs[leg.name])) for leg in configuration.legs),
        configuration=configuration,
        rotation=np.array([axis.components() for axis in (turn.x, turn.y, turn.z)], dtype=float).T,
        point=np.array(configuration.platform.translation.components(), dtype=float),
        length=float(configuration.length),
        absent=np.array([joint.twist(ZERO).components() for joint in absent], dtype=float).reshape(-1, 6),
    )


def _row(leg: Leg, readings: Iterator[ActuatorReading]) -> LegRow:
    """Return a leg as a row of motions; readings of its actuators, in its order, get their coordinates in the row."""
    row, names, elements = LegRow(leg.name), _Names(leg.name), list(leg.chain)
    place = 0
    while place < len(elements):
        element, before = elements[place], len(row.twists)
        row.carried.append(before)
        if isinstance(element, Parallelogram):
            row.add_bars(names.of(element.name, "parallelogram"), element)
        elif isinstance(element, Joint):
            count = _count_about_point(elements[place:])
            joints = [joint for joint in elements[place : place + count] if isinstance(joint, Joint)]
            row.add(CENTRES.get(count, _kind(element)), names.of(element.name), joints)
            place += count - 1
            row.carried += range(before + 1, before + count)
        elif isinstance(element, Spring) and _is_motion(element, elements[:place]):
            reading = next(readings) if element.actuated else None
            if reading is not None:
                reading = None if is_zero(element.stiffness) else replace(reading, coordinate=row.size)
            row.add(_kind(element.joint), names.of(element.joint.name or element.part_name), [element.joint], reading)
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


class _Names:
    """Names of the joints of a leg, each once."""

    def __init__(self, leg: str) -> None:
        self.leg, self.used = leg, set[str]()

    def of(self, title: str, other: str = "") -> str:
        """Return the name of a joint without that of its leg; another, or one with a number, if it has been used."""
        name = title.removeprefix(f"{self.leg} ").replace(".", " ") or "joint"
        name = other if other and name in self.used else name
        numbered = (f"{name} {number}" for number in range(2, 99))
        name = name if name not in self.used else next(other for other in numbered if other not in self.used)
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

    def place(self, coordinates: Sequence[Array], errors: Errors) -> PlacedChain:
        """Place the legs [legs * n] by coordinates of all legs of the machine [n x coordinates] and their errors."""
        count = len(coordinates[self.numbers[0]])
        places = sorted({behind for k in self.numbers for behind in errors[k]})
        of_group = {behind: self._errors(behind, errors, count) for behind in places}
        return self.chain.place(np.concatenate([coordinates[k] for k in self.numbers]), errors=of_group)

    def _errors(self, behind: int, errors: Errors, count: int) -> Array:
        """Return the errors behind so many motions [legs x 6], or [legs * n x 6] if those of a leg differ by pose."""
        of_legs = [errors[k].get(behind, np.zeros((1, 6))) for k in self.numbers]
        if any(len(error) > 1 for error in of_legs):
            of_legs = [np.broadcast_to(error, (count, 6)) for error in of_legs]
        return np.concatenate(of_legs)


def like_rows(rows: HomeRows, independent: Sequence[tuple[int, ...]], count: int) -> list[LikeRows]:
    """Put the legs that are alike together; at many poses each is left by itself.

    Args:
        rows: the machine.
        independent: for each leg, numbers of its free screws that are independent, see `closing.Screws`.
        count: number of poses.
    """
    groups: dict[Any, list[int]] = {}
    for number, row in enumerate(rows.legs):
        alone = number if count > FEW_POSES else None
        form = alone, tuple(row.coordinate), tuple(row.slides), row.free_coordinates, independent[number]
        groups.setdefault(form, []).append(number)
    result = []
    for numbers in groups.values():
        first = rows.legs[numbers[0]]
        twists = np.concatenate([rows.legs[k].chain.twists for k in numbers])
        chain = replace(first.chain, twists=twists)
        result.append(LikeRows(tuple(numbers), first, chain, independent[numbers[0]]))
    return result


def by_leg(groups: Sequence[LikeRows], values: Sequence[Array]) -> list[Array]:
    """Return values of groups [legs * n x ...] as those of each leg [n x ...], in the order of the machine's legs."""
    parts: dict[int, Array] = {}
    for group, of_group in zip(groups, values, strict=True):
        parts.update(zip(group.numbers, np.split(of_group, len(group.numbers)), strict=True))
    return [parts[number] for number in range(len(parts))]

"""Legs as rows of screw motions from a home place, with the joints that these belong to: what errors displace.

The home place of a machine written leg by leg is its home pose; that of a family is the pose of its file. Screws are at
the base origin, in base axes, SI. Nothing is solved here. Flexure hinges count as joints that move freely, and springs
as rigid.

Source: theory (35) and (45).
"""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import field
from functools import cached_property

import numpy as np

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import Chain, bar_turns
from kinetostat.machine.actuators import actuators_of, joint_actuators, senses_of
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Configuration, Machine

SAMPLES, TURN, TRAVEL = 40, 0.35, 0.15
"""Number of random configurations of a leg at which ranks are taken, and how far its joints go there: rad, and shares
of the machine's length."""
CENTRES = {2: "universal", 3: "ball"}
"""Names of revolutes in a row through one point, by their number."""


@dataclass(frozen=True)
class ActuatorReading:
    """Coordinate of an actuator as a function of the joint's.

    Attributes:
        number: of the actuator in the machine.
        coordinate: number of its coordinate in the leg.
        home: of the actuator at the home place, m or rad.
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
        first, last: the numbers of its motions begin and end (exclusive) here.
        point: its centre, m, base frame; None for a slide that has none.
        axes: unit vectors of its motions; of a parallelogram the normal of its plane.
        drive: of an actuated joint; None of others.
        bars: of a parallelogram.
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
        name: of the leg.
        twists: unit twist of each motion at the base origin [motions][6]; slides per m, turns per rad.
        coordinate: which coordinate of the leg each motion follows [motions].
        units: its joints from base to platform.
        slides: which coordinates are lengths [coordinates].
        carried: for each element of the leg's chain, how many motions stand before it.
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
        self.units.append(Unit(name, kind, first, len(self.twists), point, tuple(j.axis for j in joints), drive))

    def add_bars(self, name: str, bars: Parallelogram) -> None:
        """Add a parallelogram: a turn about its near side and a turn back about its far one, m of arc."""
        first, coordinate = len(self.twists), self._coordinate(True)
        near, far, rate = bar_turns(bars)
        self._move(near, coordinate, rate)
        self._move(far, coordinate, -rate)
        self.units.append(Unit(name, "parallelogram", first, first + 2, bars.near, (bars.normal,), None, bars))

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
        rotation, point: placement of the platform there: its axes as columns [3 x 3], and P, m [3].
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
    """Random coordinates of a leg around its home place [samples x coordinates], the same ones each time.

    Args:
        row: the leg.
        length: of the machine, m.
    """
    units = np.where(row.slides, TRAVEL * length, TURN)
    return np.random.default_rng(0).uniform(-1.0, 1.0, (SAMPLES, row.size)) * units


def home_rows(machine: Machine) -> HomeRows:
    """Read a machine at its home place.

    Args:
        machine: with numbers; a family at its pose, at which it must have a place.
    """
    if machine.family.chains is None:
        configuration = machine.configure()
        pairs = zip(actuators_of(configuration), senses_of(configuration), strict=True)
        drives = [(n, a.leg, float(a.coordinate), float(sense), a.slides) for n, (a, sense) in enumerate(pairs)]
    else:
        chains = machine.chains()
        configuration = machine.configure((0.0,) * chains.size)
        driven = joint_actuators(chains, [leg.name for leg in configuration.legs])
        drives = [(n, a.leg, a.offset, a.sign, a.slides) for n, a in enumerate(driven)]
    legs = tuple(_row(leg, iter([d for d in drives if d[1] == leg.name])) for leg in configuration.legs)
    return HomeRows(
        legs,
        configuration,
        *_platform_placement(configuration),
        float(configuration.length),
        _absent_twists(configuration),
    )


def _platform_placement(configuration: Configuration) -> tuple[Array, Array]:
    turn = configuration.platform.rotation
    columns = np.array([axis.components() for axis in (turn.x, turn.y, turn.z)], dtype=float)
    return columns.T, np.array(configuration.platform.translation.components(), dtype=float)


def _absent_twists(configuration: Configuration) -> Array:
    joints = () if configuration.plane is None else configuration.plane.missing_freedoms
    return np.array([joint.twist(ZERO).components() for joint in joints], dtype=float).reshape(-1, 6)


def _row(leg: Leg, drives: Iterator[tuple[int, str, float, float, bool]]) -> LegRow:
    row, names, elements = LegRow(leg.name), _Names(leg.name), list(leg.chain)
    place = 0
    while place < len(elements):
        element, before = elements[place], len(row.twists)
        row.carried.append(before)
        together = _about_one_point(elements[place:])
        if isinstance(element, Parallelogram):
            row.add_bars(names.of(element.name, "parallelogram"), element)
        elif isinstance(element, Joint):
            joints = [joint for joint in elements[place : place + together] if isinstance(joint, Joint)]
            row.add(CENTRES.get(together, _kind(element)), names.of(element.name), joints)
            place += together - 1
            row.carried += range(before + 1, before + together)
        elif isinstance(element, Spring) and _is_motion(element, elements[:place]):
            drive, given = None, next(drives) if element.actuated else None
            if given is not None and not is_zero(element.stiffness):
                number, _, home, sense, slides = given
                drive = ActuatorReading(number, row.size, home, sense, slides)
            row.add(_kind(element.joint), names.of(element.joint.name or element.of), [element.joint], drive)
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


def _about_one_point(elements: Sequence[Element]) -> int:
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
        """The name of a joint without that of its leg; another one, or one with a number, if it has been used."""
        name = title.removeprefix(f"{self.leg} ").replace(".", " ") or "joint"
        name = other if other and name in self.used else name
        numbered = (f"{name} {number}" for number in range(2, 99))
        name = name if name not in self.used else next(other for other in numbered if other not in self.used)
        self.used.add(name)
        return name

"""Actuators: the coordinates at which they stand, and the numbers of the drives behind them.

An actuated slide between two passive joints has the length of its leg. All other actuators of machines written leg by
leg count from the home pose; those of families, which have no home pose, have a position or an angle in the base frame.

The tables [drives] and [servo] hold for all drives. A file may have a table [drives.NAME] or [servo.NAME] for a leg or
a drive, with the fields in which it differs; a machine with such tables gets a family of its own, whose files have
them. Nothing is solved here. Points and axes are in the base frame.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import compress
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar, arctan2, is_zero, reciprocal
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.column import plain
from kinetostat.machine.common_tables import COMMON_TABLES
from kinetostat.machine.leg import Joint, Leg, PartName, Spring, Turn
from kinetostat.machine.links import rods
from kinetostat.machine.machine import Chains, Configuration, Family, Machine
from kinetostat.machine.parameters import KEPT_FAMILIES, AnyMachine, with_values
from kinetostat.spec.document import Document, toml_key
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.fields import quantities
from kinetostat.tolerances import NO_LINK, PARALLEL_AXES

TRIAL_MOTION = 1e-4
"""Motion of an actuator, m or rad, that shows its sense: far above round-off, too small to pass a turning point."""
LENGTH, POSITION = "length of the leg", "position along its axis from the base origin"
HEIGHT = "position along its rail from the foot of that"
ELEVATION, BEARING = "angle of the crank above the x-y plane", "angle of the crank from x"
TRAVEL, TURN = "travel from the home pose", "turn from the home pose"
"""Meanings of the coordinates of actuators, for people."""
TABLES_OF_DRIVES = ("drives", "servo")
"""Tables of which a drive may have its own."""
MOST_DRIVES = 64
"""Drives that may have tables of their own: more than any machine has, so that more are a mistake."""


@dataclass(frozen=True)
class Actuator:
    """An actuator with its coordinate.

    Attributes:
        name: the name of the joint that it drives, e.g. "leg 1 actuator".
        leg: the name of its leg.
        meaning: the meaning of its coordinate, in words.
        coordinate: m, or rad.
        slides: whether it is linear.
    """

    name: str
    leg: str
    meaning: str
    coordinate: Scalar
    slides: bool

    @property
    def kind(self) -> str:
        """Kind of its coordinate's quantity."""
        return "length" if self.slides else "angle"

    @property
    def unit(self) -> str:
        """SI unit of its coordinate."""
        return "m" if self.slides else "rad"


def actuators_of(configuration: Configuration) -> list[Actuator]:
    """Measure the actuators of a placed machine of a family, over floats or columns.

    A rotary actuator has the angle of its crank above the x-y plane, from the horizontal direction that points away
    from the z axis (towards +x or +y where none does); about a vertical axis, the angle from x, counter-clockwise.

    Args:
        configuration: the configuration of a machine in closed form.
    """
    lengths = {rod.leg: rod.length for rod in rods(configuration.legs) if rod.telescopic}
    actuators, end = [], configuration.platform.translation
    for leg in configuration.legs:
        for place, spring in enumerate(leg.chain):
            if not (isinstance(spring, Spring) and spring.actuated):
                continue
            slides = spring.joint.point is None
            if slides and leg.name in lengths:
                meaning, coordinate = LENGTH, lengths[leg.name]
            elif slides:
                point, foot = _next_point(leg, place, end), spring.joint.foot
                meaning, reached = (POSITION, point) if foot is None else (HEIGHT, point - foot)
                coordinate = reached.dot(spring.joint.axis)
            else:
                meaning, coordinate = _crank_angle(spring.joint, leg, place, end)
            actuators.append(
                Actuator(name=name_of(spring), leg=leg.name, meaning=meaning, coordinate=coordinate, slides=slides)
            )
    return actuators


def senses_of(configuration: Configuration) -> list[Scalar]:
    """Tell for each of `actuators_of` whether its coordinate grows (1) or falls (-1) as its joint moves forward.

    Args:
        configuration: the configuration of a machine in closed form, over floats or columns.
    """
    senses: list[Scalar] = []
    for leg in configuration.legs:
        driven = [(place, part) for place, part in enumerate(leg.chain) if isinstance(part, Spring) and part.actuated]
        # The coordinate of an actuator depends on its own leg and the platform alone.
        before = actuators_of(replace(configuration, legs=(leg,))) if driven else []
        for number, (place, spring) in enumerate(driven):
            moved_spring, motion = spring.motion_by(TRIAL_MOTION)
            following = [element.displaced(motion) for element in leg.chain[place + 1 :]]
            moved_leg = replace(leg, chain=(*leg.chain[:place], moved_spring, *following))
            after = actuators_of(replace(configuration, platform=motion @ configuration.platform, legs=(moved_leg,)))
            senses.append(np.sign(np.asarray(after[number].coordinate, dtype=float) - before[number].coordinate))
    return senses


def name_of(spring: Spring) -> str:
    """The name of the joint that an actuator drives, or of the part that it is where the joint has none."""
    return spring.joint.name or spring.part_name


def _next_point(leg: Leg, place: int, end: Vector, other: Vector | None = None) -> Vector:
    """The first point of a leg after an element that does not coincide with another point; its end if there is none."""
    points = (point for element in leg.chain[place + 1 :] for point in element.path)
    return next((point for point in points if other is None or not _coincide(point, other)), end)


def _coincide(first: Vector, second: Vector) -> bool:
    """Whether points are one, at every pose; traced points are if they are so by form."""
    span = first - second
    if not all(isinstance(plain(c), float | np.ndarray) for c in span.components()):
        return all(is_zero(c) for c in span.components())
    return bool((np.asarray(span.norm(), dtype=float) <= NO_LINK).all())


def _crank_angle(joint: Joint, leg: Leg, place: int, end: Vector) -> tuple[str, Scalar]:
    """The meaning and the value, rad, of the coordinate of a driven revolute, as `actuators_of` describes it."""
    centre, axis = joint.point, joint.axis
    if centre is None:
        raise ValueError("a slide has no crank")
    crank = _next_point(leg, place, end, centre) - centre
    if np.abs(np.asarray(axis.z, dtype=float)).max() > 1.0 - PARALLEL_AXES:
        return BEARING, arctan2(crank.y, crank.x)
    level = np.hypot(axis.x, axis.y)
    outward = Vector(axis.y / level, -axis.x / level, 0.0)
    radius = np.asarray(outward.dot(centre), dtype=float)
    # Where neither horizontal direction points away from the z axis, the one towards +x (or +y) is taken.
    towards_x = np.where(np.abs(outward.x) > NO_LINK, outward.x, outward.y)
    outward = outward * np.where(np.where(np.abs(radius) < NO_LINK, towards_x, radius) < 0.0, -1.0, 1.0)
    upward = Vector(-axis.x * axis.z / level, -axis.y * axis.z / level, level)
    return ELEVATION, arctan2(crank.dot(upward), crank.dot(outward))


@dataclass(frozen=True)
class JointActuator:
    """An actuated joint of a machine written leg by leg.

    Attributes:
        name, leg, meaning, slides: see `Actuator`.
        place: the place of its coordinate among the joint coordinates.
        offset, sign: its coordinate is offset + sign times the joint coordinate; m or rad.
    """

    name: str
    leg: str
    meaning: str
    slides: bool
    place: int
    offset: float
    sign: float

    def at(self, joints: Sequence[Scalar | Turn]) -> Actuator:
        """The actuator at given joint coordinates (m, and rad or turns)."""
        amount = joints[self.place]
        angle = arctan2(amount.sine, amount.cosine) if isinstance(amount, Turn) else amount
        coordinate = self.offset + self.sign * angle
        return Actuator(name=self.name, leg=self.leg, meaning=self.meaning, coordinate=coordinate, slides=self.slides)

    def joint_coordinate(self, coordinate: Scalar) -> Scalar:
        """The joint coordinate (m or rad from the home pose) at a coordinate of the actuator."""
        return (coordinate - self.offset) * self.sign


def joint_actuators(chains: Chains, names: Sequence[str]) -> list[JointActuator]:
    """The actuated joints of a machine written leg by leg, in the order of its joint coordinates.

    Args:
        chains: the legs of the machine at the home pose; floats.
        names: the names of the legs.
    """
    actuators, place = [], 0
    for name, steps in zip(names, chains.legs, strict=True):
        leg = Leg(name, tuple(step.element for step in steps))
        rod = next((rod for rod in rods([leg]) if rod.telescopic), None)
        for step in steps:
            if not step.moves:
                continue
            if isinstance(step.element, Spring) and step.element.actuated:
                slides = step.element.joint.point is None
                offset, sign, meaning = 0.0, 1.0, TRAVEL if slides else TURN
                along_rod = _cosine(rod.span, step.element.joint.axis) if slides and rod is not None else 0.0
                if rod is not None and abs(along_rod) > 1.0 - PARALLEL_AXES:
                    offset, sign, meaning = float(rod.length), float(np.sign(along_rod)), LENGTH
                actuators.append(
                    JointActuator(
                        name=name_of(step.element),
                        leg=name,
                        meaning=meaning,
                        slides=slides,
                        place=place,
                        offset=offset,
                        sign=sign,
                    )
                )
            place += 1
    return actuators


def _cosine(span: Vector, axis: Vector) -> float:
    """The cosine between a span and a unit vector."""
    return float(span.dot(axis) / span.norm())


def family_with_own_drives(family: Family, document: Document, origin: str) -> Family:
    """The family whose machine files have the tables of single drives that a document has; itself without any.

    Args:
        family: the family of the machine.
        document: the tables of its file.
        origin: names the file in messages.

    Raises:
        InputError: a field that drives do not have, or too many tables.
    """
    tables = []
    for table in TABLES_OF_DRIVES:
        known, written = quantities(COMMON_TABLES[table]), document.get(table)
        entries = written.items() if isinstance(written, dict) else ()
        for name, fields in entries:
            if name in known or not isinstance(fields, dict):
                continue  # a field of the table itself, known or not
            for field in fields:
                choice(field, known, f'"{origin}": the field of {table}.{toml_key(name)}')
            tables.append((f"{table}.{name}", tuple(field for field in known if field in fields)))
    if len(tables) > len(TABLES_OF_DRIVES) * MOST_DRIVES:
        raise InputError(
            f'"{origin}" has {len(tables)} tables of single drives; at most {MOST_DRIVES} drives have any.'
        )
    return _with_own_drives(family, tuple(tables)) if tables else family


@lru_cache(KEPT_FAMILIES)
def _with_own_drives(family: Family, tables: tuple[tuple[str, tuple[str, ...]], ...]) -> Family:
    return replace(family, own_drives=tables, recipe=(_with_own_drives, (family, tables)))


def check_own_drives(family: Family, legs: Sequence[Leg], origin: str) -> None:
    """Refuse tables of drives that a machine does not have.

    Args:
        family: the family of the machine, whose files have these tables.
        legs: the legs of the machine.
        origin: names its file in messages.

    Raises:
        InputError: names the table, and the drives that there are.
    """
    if not family.own_drives:
        return
    names = dict.fromkeys(
        name for leg in legs for spring in leg.springs if spring.actuated for name in (leg.name, name_of(spring))
    )
    for path, _ in family.own_drives:
        table, _, name = path.partition(".")
        choice(name, names, f'"{origin}": the leg or drive of [{table}.{toml_key(name)}]')


def numbers_of_drive(machine: Machine, table: str, spring: Spring) -> Any:
    """A table of `TABLES_OF_DRIVES` as a drive has it: its own fields in the place of those of all drives.

    A table of the drive comes before that of its leg.

    Args:
        machine: the machine with its tables.
        table: "drives" or "servo".
        spring: the spring of the actuator.
    """
    numbers, part = machine.tables[table], spring.part_name
    tables = [path for path, _ in machine.family.own_drives if path.startswith(f"{table}.")]
    names = [path.removeprefix(f"{table}.") for path in tables]
    of_leg = [part.leg == name if isinstance(part, PartName) else part.startswith(f"{name} ") for name in names]
    of_drive = [name == name_of(spring) for name in names]
    for path in (*compress(tables, of_leg), *compress(tables, of_drive)):
        numbers = replace(numbers, **vars(machine.tables[path]))
    return numbers


def with_every_drive(machine: AnyMachine, changes: Mapping[str, float]) -> AnyMachine:
    """The machine with fields of [drives] or [servo] replaced for every drive, whether it has its own or not.

    Args:
        machine: a machine.
        changes: new values by path, such as "drives.lead", SI.
    """
    shared_paths = {f"{path}.{field}": f"{path.partition('.')[0]}.{field}" for path, field in _own_fields(machine)}
    single = {path: changes[shared] for path, shared in shared_paths.items() if shared in changes}
    return with_values(machine, {**changes, **single})


def values_of_drives(machine: Machine, path: str) -> list[Any]:
    """All values that a machine has of a field of [drives] or [servo], shared ones first.

    Args:
        machine: a machine.
        path: the path of the field, such as "drives.lead".
    """
    table, _, field = path.partition(".")
    single = [path for path, own_field in _own_fields(machine) if own_field == field and path.startswith(f"{table}.")]
    return [getattr(machine.tables[name], field) for name in (table, *single)]


def _own_fields(machine: AnyMachine) -> list[tuple[str, str]]:
    """Each field in a table of a single drive: the path of the table, and the name of the field."""
    return [(path, field) for path, fields in machine.family.own_drives for field in fields]


def rotor_turns(spring: Spring, drives: Any) -> Scalar:
    """Radians by which the rotor of an actuator turns per metre or radian of the actuator; 0.0 if nothing says it.

    Args:
        spring: the actuator's spring.
        drives: the table [drives] as this drive has it, see `numbers_of_drive`.

    Raises:
        InputError: rotors have an inertia or friction, but nothing says how far they turn.
    """
    slides = spring.joint.point is None
    transmission = drives.lead if slides else drives.ratio
    if is_zero(transmission):
        if all(is_zero(number) for number in (drives.rotor_inertia, drives.rotor_damping, drives.rotor_friction)):
            return 0.0
        field, example, kind = ("lead", '"10 mm"', "linear") if slides else ("ratio", "50", "rotary")
        raise InputError(
            f"drives.{field} is 0, but drives.rotor_inertia, drives.rotor_damping or drives.rotor_friction is given "
            f"and the actuators are {kind}: nothing says how far a rotor turns; write {field} = {example} in the "
            "table [drives]."
        )
    return reciprocal(transmission) * (2.0 * math.pi) if slides else transmission

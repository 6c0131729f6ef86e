"""Actuators: the coordinates at which they stand, and then the numbers of the drives behind them.

Coordinates are measured on a placed machine. An actuated slide between two passive joints has the length of its leg.
All other actuators of machines written leg by leg count from the home pose; those of families, which have no home pose,
have a position or an angle in the base frame.

The tables [drives] and [servo] hold for all drives. A file may have a table [drives.NAME] or [servo.NAME] for a leg or
a drive, with the fields in which it differs; a machine with such tables gets a family of its own, whose files have
them. Nothing is solved here. Points and axes are in the base frame.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import lru_cache
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar, arctan2, is_zero, reciprocal
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.column import plain
from kinetostat.machine.common_tables import COMMON_TABLES, Drives
from kinetostat.machine.leg import Joint, Leg, PartName, Spring, Turn
from kinetostat.machine.links import Rod, rods
from kinetostat.machine.machine import Chains, Configuration, DriveTable, Family, Machine
from kinetostat.machine.parameters import KEPT_FAMILIES, AnyMachine, with_values
from kinetostat.spec.document import Document, toml_key
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.fields import quantities
from kinetostat.tolerances import NO_LINK, PARALLEL_IN_FILE

TRIAL_MOTION = 1e-4
"""Motion of an actuator, m or rad, that shows its sense: far above round-off, too small to pass a turning point."""
TABLES_OF_DRIVES = ("drives", "servo")
"""Tables of which a drive may have its own."""
MOST_DRIVES = 64
"""Drives that may have tables of their own: more than any machine has, so that more are a mistake."""


class Meaning(StrEnum):
    """Meaning of an actuator's coordinate, for people."""

    LENGTH = "length of the leg"
    POSITION = "position along its axis from the base origin"
    HEIGHT = "position along its rail from the foot of that"
    ELEVATION = "angle of the crank above the x-y plane"
    BEARING = "angle of the crank from x"
    TRAVEL = "travel from the home pose"
    ROTATION = "turn from the home pose"

    __repr__ = str.__repr__  # so that an answer prints the words alone


@dataclass(frozen=True)
class Actuator:
    """An actuator with its coordinate.

    Attributes:
        name: the name of the joint that it drives, e.g. "leg 1 actuator".
        leg: the name of its leg.
        meaning: the meaning of its coordinate.
        coordinate: m, or rad.
        slides: whether it is linear.
    """

    name: str
    leg: str
    meaning: Meaning
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
    """Measure the actuators of a placed machine of a family.

    A rotary actuator has the angle of its crank above the x-y plane, from the horizontal direction that points away
    from the z axis (towards +x or +y where none does); about a vertical axis, the angle from x, counter-clockwise.

    Args:
        configuration: the configuration of a machine in closed form, over floats or columns; over traced scalars if
            its rotary actuators turn about the vertical by form.
    """
    lengths = {rod.leg: rod.length for rod in rods(configuration.legs) if rod.telescopic}
    actuators, end = [], configuration.platform.translation
    for leg in configuration.legs:
        for place, spring in enumerate(leg.chain):
            if not (isinstance(spring, Spring) and spring.actuated):
                continue
            slides = spring.joint.point is None
            if slides and leg.name in lengths:
                meaning, coordinate = Meaning.LENGTH, lengths[leg.name]
            elif slides:
                meaning, coordinate = _slide_position(spring.joint, _next_point(leg, place, end))
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


def _slide_position(joint: Joint, carriage: Vector) -> tuple[Meaning, Scalar]:
    """The meaning and the value, m, of the coordinate of a driven slide, from the point that it carries."""
    if joint.foot is None:
        return Meaning.POSITION, carriage.dot(joint.axis)
    return Meaning.HEIGHT, (carriage - joint.foot).dot(joint.axis)


def _crank_angle(joint: Joint, leg: Leg, place: int, end: Vector) -> tuple[Meaning, Scalar]:
    """The meaning and the value, rad, of the coordinate of a driven revolute, as `actuators_of` describes it."""
    centre, axis = joint.point, joint.axis
    if centre is None:
        raise ValueError("a slide has no crank")
    crank = _next_point(leg, place, end, centre) - centre
    level = np.hypot(np.asarray(axis.x, dtype=float), np.asarray(axis.y, dtype=float))
    if level.min() <= PARALLEL_IN_FILE:  # the axis is vertical, so that no crank rises
        return Meaning.BEARING, arctan2(crank.y, crank.x)
    outward = Vector(axis.y / level, -axis.x / level, 0.0)
    radius = np.asarray(outward.dot(centre), dtype=float)
    # Where neither horizontal direction points away from the z axis, the one towards +x (or +y) is taken.
    towards_x = np.where(np.abs(outward.x) > NO_LINK, outward.x, outward.y)
    outward = outward * np.where(np.where(np.abs(radius) < NO_LINK, towards_x, radius) < 0.0, -1.0, 1.0)
    upward = Vector(-axis.x * axis.z / level, -axis.y * axis.z / level, level)
    return Meaning.ELEVATION, arctan2(crank.dot(upward), crank.dot(outward))


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
    meaning: Meaning
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
    actuators: list[JointActuator] = []
    first = 0
    for name, steps in zip(names, chains.legs, strict=True):
        rod = next(iter(rods([Leg(name, tuple(step.element for step in steps))])), None)
        moving = [step.element for step in steps if step.moves]
        actuators += [
            _joint_actuator(element, name, place, rod if rod is not None and rod.telescopic else None)
            for place, element in enumerate(moving, first)
            if isinstance(element, Spring) and element.actuated
        ]
        first += len(moving)
    return actuators


def _joint_actuator(spring: Spring, leg: str, place: int, telescope: Rod | None) -> JointActuator:
    """The actuator of a sprung joint at the home pose.

    Args:
        spring: the spring of the actuator.
        leg: the name of its leg.
        place: the place of its coordinate among all joint coordinates.
        telescope: the straight part of its leg, if a driven slide sets its length.
    """
    slides = spring.joint.point is None
    meaning, offset, sign = Meaning.TRAVEL if slides else Meaning.ROTATION, 0.0, 1.0
    if slides and telescope is not None:
        along = telescope.span * (1.0 / telescope.length)
        if spring.joint.axis.cross(along).norm() <= PARALLEL_IN_FILE:
            meaning, offset = Meaning.LENGTH, float(telescope.length)
            sign = math.copysign(1.0, spring.joint.axis.dot(along))
    return JointActuator(
        name=name_of(spring), leg=leg, meaning=meaning, slides=slides, place=place, offset=offset, sign=sign
    )


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
            tables.append(DriveTable(f"{table}.{name}", tuple(field for field in known if field in fields)))
    drives = {table.drive for table in tables}
    if len(drives) > MOST_DRIVES:
        raise InputError(
            f'"{origin}" has tables for {len(drives)} single drives; at most {MOST_DRIVES} drives may have any.'
        )
    return _with_own_drives(family, tuple(tables)) if tables else family


@lru_cache(KEPT_FAMILIES)
def _with_own_drives(family: Family, tables: tuple[DriveTable, ...]) -> Family:
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
    for table in family.own_drives:
        choice(table.drive, names, f'"{origin}": the leg or drive of [{table.of_all}.{toml_key(table.drive)}]')


def numbers_of_drive(machine: Machine, table: str, spring: Spring) -> Any:
    """A table of `TABLES_OF_DRIVES` as a drive has it: its own fields in the place of those of all drives.

    A number in a table of the drive itself counts more than one in a table of its leg.

    Args:
        machine: the machine with its tables.
        table: "drives" or "servo".
        spring: the spring of the actuator.

    Returns:
        `common_tables.Drives` or `ServoGains`.
    """
    single = [drive_table for drive_table in machine.family.own_drives if drive_table.of_all == table]
    of_leg = [drive_table for drive_table in single if _is_of_leg(spring.part_name, drive_table.drive)]
    of_drive = [drive_table for drive_table in single if drive_table.drive == name_of(spring)]
    numbers = machine.tables[table]
    for drive_table in (*of_leg, *of_drive):  # the later one holds
        numbers = replace(numbers, **vars(machine.tables[drive_table.path]))
    return numbers


def _is_of_leg(part: str, leg: str) -> bool:
    """Whether a part belongs to a leg: it knows its leg, or else its name begins with that of the leg."""
    return part.leg == leg if isinstance(part, PartName) else part.startswith(f"{leg} ")


def with_every_drive(machine: AnyMachine, changes: Mapping[str, float]) -> AnyMachine:
    """The machine with fields of [drives] or [servo] replaced for every drive, whether it has its own or not.

    Args:
        machine: a machine.
        changes: new values by path, such as "drives.lead", SI.
    """
    single = {
        f"{table.path}.{field}": changes[shared]
        for table in machine.family.own_drives
        for field in table.fields
        if (shared := f"{table.of_all}.{field}") in changes
    }
    return with_values(machine, {**changes, **single})


def values_of_drives(machine: Machine, path: str) -> list[Any]:
    """All values that a machine has of a field of [drives] or [servo], shared ones first.

    Args:
        machine: a machine.
        path: the path of the field, such as "drives.lead".
    """
    of_all, _, field = path.partition(".")
    single = [table.path for table in machine.family.own_drives if table.of_all == of_all and field in table.fields]
    return [getattr(machine.tables[path], field) for path in (of_all, *single)]


def rotor_turns(spring: Spring, drives: Drives) -> Scalar:
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

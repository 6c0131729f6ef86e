"""The coordinates of actuators: how long, how far along and how far turned the actuated joints of a placed machine are.

An actuated slide between two passive joints has the length of its leg. All other actuators of machines written leg by
leg count from the home pose; those of families, which have no home pose, have a position or an angle in the base frame.
Nothing is solved here. Points and axes are in the base frame.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.scalar import Scalar, arctan2, is_zero
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.column import plain
from kinetostat.machine.leg import Joint, Leg, Spring, Turn
from kinetostat.machine.links import rods
from kinetostat.machine.machine import Chains, Configuration
from kinetostat.tolerances import NO_LINK, PARALLEL_AXES

TRIAL_MOTION = 1e-4
"""Motion of an actuator, m or rad, that shows its sense: far above round-off, too small to pass a turning point."""
LENGTH, POSITION = "length of the leg", "position along its axis from the base origin"
HEIGHT = "position along its rail from the foot of that"
ELEVATION, BEARING = "angle of the crank above the x-y plane", "angle of the crank from x"
TRAVEL, TURN = "travel from the home pose", "turn from the home pose"
"""Meanings of the coordinates of actuators, for people."""


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
            moved_spring, motion = spring.moved(TRIAL_MOTION)
            following = [element.displaced(motion) for element in leg.chain[place + 1 :]]
            moved_leg = replace(leg, chain=(*leg.chain[:place], moved_spring, *following))
            after = actuators_of(replace(configuration, platform=motion @ configuration.platform, legs=(moved_leg,)))
            senses.append(np.sign(np.asarray(after[number].coordinate, dtype=float) - before[number].coordinate))
    return senses


def name_of(spring: Spring) -> str:
    """The name of the joint that an actuator drives, or of the part that it is where the joint has none."""
    return spring.joint.name or spring.of


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

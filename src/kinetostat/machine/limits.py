"""The limits that a machine file may set in [limits]: one row each, with what it is compared with and its wording.

A row knows the parts of a machine, not how they are solved for: `kinematics.limits` places them and compares.

Source: the definitions on the documentation's page on limits and workspace. Points are in the base frame.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from functools import cached_property, partial
from itertools import combinations
from typing import NamedTuple

from kinetostat.algebra.lines import squared_distance
from kinetostat.algebra.scalar import Scalar, cos
from kinetostat.algebra.vector import Z_AXIS, Vector
from kinetostat.display import ENGINEERING
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Leg, Spring
from kinetostat.machine.links import Rod, rods
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Field, Quantity, made_table
from kinetostat.units import KINDS


@dataclass(frozen=True)
class Parts:
    """The parts of a machine that limits are about, at one pose.

    Attributes:
        legs: the legs of the machine.
        normal: the platform's z axis, base frame.
        planar: whether the machine moves in a plane; angles to z are then fixed.
        slides: actuated slides that count from a home pose, each with its travel, m.
        actuators: actuators, each with the size of its load, N or N·m.
    """

    legs: Sequence[Leg]
    normal: Vector
    planar: bool
    slides: Sequence[tuple[str, Scalar]] = ()
    actuators: Sequence[tuple[Spring, Scalar]] = ()

    @cached_property
    def rods(self) -> list[Rod]:
        """The straight legs."""
        return rods(self.legs, self.planar)


class Measurement(NamedTuple):
    """The number that a limit is compared with, of one of the parts that it is about.

    Attributes:
        place: the number of the part among those that `Parts` lists.
        part: its name.
        size: what is compared, in the unit that `Limit.compared` gives.
    """

    place: int
    part: str
    size: Scalar


Measured = Iterator[Measurement]
"""A measurement for each part that a limit is about."""


def _leg_lengths(parts: Parts) -> Measured:
    return (Measurement(i, rod.leg, rod.length) for i, rod in enumerate(parts.rods) if rod.telescopic)


def _travels(parts: Parts) -> Measured:
    return (Measurement(i, name, travel) for i, (name, travel) in enumerate(parts.slides))


def _base_tilts(parts: Parts) -> Measured:
    tilting = [(i, rod) for i, rod in enumerate(parts.rods) if rod.on_base and not parts.planar]
    return (Measurement(i, rod.leg, _squared_cosine(rod, Z_AXIS)) for i, rod in tilting)


def _platform_tilts(parts: Parts) -> Measured:
    tilting = [(i, rod) for i, rod in enumerate(parts.rods) if rod.on_platform and not parts.planar]
    return (Measurement(i, rod.leg, _squared_cosine(rod, parts.normal)) for i, rod in tilting)


def _squared_cosine(rod: Rod, normal: Vector) -> Scalar:
    """Square of the cosine between a leg and a normal: it is compared without a square root or an arc cosine."""
    along = rod.span.dot(normal)
    return along * along * rod.inverse_square


def _clearances(parts: Parts) -> Measured:
    """Squares of the distances between the axes of any two straight legs."""
    for i, (first, other) in enumerate(combinations(parts.rods, 2)):
        distance = squared_distance((first.start, first.end), (other.start, other.end))
        yield Measurement(i, f"{first.leg} and {other.leg}", distance)


def _loads(parts: Parts, sliding: bool) -> Measured:
    for i, (spring, load) in enumerate(parts.actuators):
        if (spring.joint.point is None) is sliding:
            yield Measurement(i, spring.name, load)


class About(Enum):
    """Subject of a limit. A pose is checked in this order, so that the first limit it passes is well defined."""

    LENGTH = "leg length"
    TRAVEL = "slide travel"
    ANGLE = "joint angle"
    CLEARANCE = "clearance"
    LOAD = "actuator load"


@dataclass(frozen=True)
class Limit:
    """A limit that files may set.

    Attributes:
        name: the name in the table [limits].
        about: the subject of the limit.
        quantity: the values that may be written, and their meaning.
        at_most: whether it is a greatest value; otherwise it is a least one.
        measure: gives the numbers that the limit is compared with, from the parts of a machine.
        needs: the parts that a machine must have for the limit to mean something, in words.
        sentence: the sentence about a part that passes the limit, with its value in braces.
        phrase: says in a few words that it is passed.
        title: the title of the measure, where its range over many poses is shown; limits with one measure share it.
        compared: makes of the limit as written (SI) the number that the measure is compared with.
        shown: makes of the measure the value as written, SI.
        falling: whether the measure falls where the value rises, as a cosine does.
        advice: what may be done besides changing the limit.
    """

    name: str
    about: About
    quantity: Quantity
    at_most: bool
    measure: Callable[[Parts], Measured]
    needs: str
    sentence: str
    phrase: str
    title: str
    compared: Callable[[Scalar], Scalar] = lambda limit: limit
    shown: Callable[[float], float] = float
    falling: bool = False
    advice: str = "move the platform"

    @property
    def unit(self) -> str:
        return KINDS[self.quantity.kind].unit

    def has_meaning_for(self, parts: Parts) -> bool:
        """Whether a machine has any part that the limit is about."""
        return next(self.measure(parts), None) is not None

    def scale(self, bound: Scalar, length: Scalar) -> Scalar:
        """The size beside which an excess is round-off: the machine's (m), that of a cosine, or the bound itself."""
        sizes = {About.LENGTH: length, About.TRAVEL: length, About.ANGLE: 1.0}
        return sizes.get(self.about, bound)


def _least(kind: str, meaning: str, positive: bool = False) -> Quantity:
    return Quantity(kind, meaning, positive=positive, unset=-math.inf)


def _most(kind: str, meaning: str, positive: bool = True, most: float = math.inf) -> Quantity:
    return Quantity(kind, meaning, positive=positive, most=most, unset=math.inf)


def _square(number: Scalar) -> Scalar:
    return number * number


def _angle(squared_cosine: float) -> float:
    return math.acos(min(1.0, math.sqrt(squared_cosine)))


_TELESCOPIC = "a leg with an actuated slide between two joints"
_HOME = "a slide whose travel counts from a home pose (those of machines written leg by leg)"
_TILT = "greatest angle of a straight leg at its {0} joint from the {0}'s z axis"

LIMITS = {
    limit.name: limit
    for limit in (
        Limit(
            name="shortest_leg",
            about=About.LENGTH,
            quantity=_least("length", "least distance of the two joints of a leg with an actuated slide between them"),
            at_most=False,
            measure=_leg_lengths,
            needs=_TELESCOPIC,
            sentence="is {} long",
            phrase="a leg is too short",
            title="length of the legs",
        ),
        Limit(
            name="longest_leg",
            about=About.LENGTH,
            quantity=_most("length", "greatest such distance"),
            at_most=True,
            measure=_leg_lengths,
            needs=_TELESCOPIC,
            sentence="is {} long",
            phrase="a leg is too long",
            title="length of the legs",
        ),
        Limit(
            name="travel_from",
            about=About.TRAVEL,
            quantity=_least(
                "length", "actuated slides of other legs, written leg by leg: least travel from the home pose"
            ),
            at_most=False,
            measure=_travels,
            needs=_HOME,
            sentence="has travelled {} from the home pose",
            phrase="a slide at its lower end",
            title="travel of the slides",
        ),
        Limit(
            name="travel_to",
            about=About.TRAVEL,
            quantity=_most("length", "their greatest travel", positive=False),
            at_most=True,
            measure=_travels,
            needs=_HOME,
            sentence="has travelled {} from the home pose",
            phrase="a slide at its upper end",
            title="travel of the slides",
        ),
        Limit(
            name="base_joint_angle",
            about=About.ANGLE,
            quantity=_most("angle", _TILT.format("base"), most=math.pi / 2),
            at_most=True,
            measure=_base_tilts,
            needs="a straight leg that tilts against the base's z axis",
            sentence="stands at {} to the base's z axis",
            phrase="a base joint turned too far",
            title="angle at the base joints",
            compared=lambda limit: _square(cos(limit)),
            shown=_angle,
            falling=True,
        ),
        Limit(
            name="platform_joint_angle",
            about=About.ANGLE,
            quantity=_most("angle", _TILT.format("platform"), most=math.pi / 2),
            at_most=True,
            measure=_platform_tilts,
            needs="a straight leg that tilts against the platform's z axis",
            sentence="stands at {} to the platform's z axis",
            phrase="a platform joint turned too far",
            title="angle at the platform joints",
            compared=lambda limit: _square(cos(limit)),
            shown=_angle,
            falling=True,
        ),
        Limit(
            name="actuator_force",
            about=About.LOAD,
            quantity=_most("force", "greatest force of an actuated slide under [load]"),
            at_most=True,
            measure=partial(_loads, sliding=True),
            needs="an actuated slide",
            sentence="carries {}",
            phrase="an actuator overloaded (force)",
            title="force of the actuators",
            advice="lower the load",
        ),
        Limit(
            name="actuator_moment",
            about=About.LOAD,
            quantity=_most("moment", "greatest moment of an actuated revolute under [load]"),
            at_most=True,
            measure=partial(_loads, sliding=False),
            needs="an actuated revolute",
            sentence="carries {}",
            phrase="an actuator overloaded (moment)",
            title="moment of the actuators",
            advice="lower the load",
        ),
        Limit(
            name="leg_diameter",
            about=About.CLEARANCE,
            quantity=_least(
                "length", "straight legs, as cylinders this thick between their joints, must not touch", positive=True
            ),
            at_most=False,
            measure=_clearances,
            needs="two straight legs",
            sentence="come within {} of each other",
            phrase="legs touch",
            title="distance between leg axes",
            compared=_square,
            shown=math.sqrt,
        ),
    )
}
"""Every limit by name. To add one, add its row here and, if no row has it yet, its measure above."""

OF_DRIVES = {
    "actuator_speed": _most("speed", "greatest speed of an actuated slide; bounds what drives can do, and no pose"),
    "actuator_turning_speed": _most("rate", "greatest speed of an actuated revolute, likewise"),
}
"""Limits on what no pose has by itself, so that no pose is judged by them: they say what drives can do."""

_FIELDS = {**{limit.name: limit.quantity for limit in LIMITS.values()}, **OF_DRIVES}
Limits = made_table("Limits", {name: Field(quantity, quantity.unset) for name, quantity in _FIELDS.items()})
Limits.__doc__ = "Table [limits], in any machine file; a limit that is left out is infinite and costs no arithmetic."


def is_set(limit: Scalar) -> bool:
    """Whether a limit holds at all: one that is not set is infinite by form, the float itself."""
    return not (type(limit) is float and math.isinf(limit))


def unloaded_parts(
    legs: Sequence[Leg], normal: Vector, planar: bool, slides: Sequence[tuple[str, Scalar]] = ()
) -> Parts:
    """The parts of a machine whose actuators carry nothing, to ask which limits mean something for it.

    Args:
        legs, normal, planar, slides: see `Parts`.
    """
    actuators = [(spring, 0.0) for leg in legs for spring in leg.springs if spring.actuated]
    return Parts(legs=legs, normal=normal, planar=planar, slides=slides, actuators=actuators)


def limits_set(limits: object) -> list[Limit]:
    """Return the rows of the limits that a table [limits] sets."""
    return [limit for limit in LIMITS.values() if is_set(getattr(limits, limit.name))]


def limits_loads(limits: object) -> bool:
    """Whether a table [limits] bounds the loads of actuators, so that a pose is judged by them."""
    return any(limit.about is About.LOAD for limit in limits_set(limits))


def no_limits_sentence(limits: object) -> str:
    """A sentence for an answer that rests on no limit; empty if the table [limits] sets one."""
    return "" if limits_set(limits) else "No limits are set: strokes, joint angles and loads are not checked."


def check_limits(limits: object, parts: Parts, origin: str) -> None:
    """Refuse limits that contradict each other, and limits on parts that the machine does not have.

    Args:
        limits: the table [limits] of the machine.
        parts: the parts of the machine, at any pose.
        origin: name of the file.

    Raises:
        InputError: names the limits and what to change.
    """
    for low, high in combinations(LIMITS.values(), 2):
        least, most = getattr(limits, low.name), getattr(limits, high.name)
        if low.measure is high.measure and least > most:
            raise InputError(
                f'"{origin}": limits.{low.name} is {ENGINEERING.show(least, low.unit)} and limits.{high.name} '
                f"{ENGINEERING.show(most, high.unit)}: nothing lies between them; exchange or widen them."
            )
    for limit in limits_set(limits):
        if not limit.has_meaning_for(parts):
            raise InputError(
                f'"{origin}": limits.{limit.name} has no meaning here: the machine lacks {limit.needs}; leave it out.'
            )

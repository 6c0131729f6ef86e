"""What the parts of a machine bear: the table [limits] of its file, and which parts each limit is about.

Whether a pose keeps within them is `kinematics.limits`' and, under load, `kinetostatics.overload`'s business.

Points are in the base frame.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Vector
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Quantity, quantities, table

RIGHT_ANGLE = math.pi / 2


def _least(kind: str, meaning: str, positive: bool = False) -> Quantity:
    return Quantity(kind, meaning, positive, unset=-math.inf)


def _most(kind: str, meaning: str, positive: bool = True, most: float = math.inf) -> Quantity:
    return Quantity(kind, meaning, positive, most=most, unset=math.inf)


@table
class Limits:
    """Table [limits], in any machine file; what is left out is not limited.

    A limit that is not set is infinite by form, and no arithmetic is spent on it.
    """

    shortest_leg: Annotated[
        float, _least("length", "least distance of the two joints of a leg with an actuated slide between them")
    ] = -math.inf
    longest_leg: Annotated[float, _most("length", "greatest such distance")] = math.inf
    travel_from: Annotated[
        float, _least("length", "actuated slides of other legs, written leg by leg: least travel from the home pose")
    ] = -math.inf
    travel_to: Annotated[float, _most("length", "their greatest travel", positive=False)] = math.inf
    base_joint_angle: Annotated[
        float,
        _most("angle", "greatest angle of a straight leg at its base joint from the base's z axis", True, RIGHT_ANGLE),
    ] = math.inf
    platform_joint_angle: Annotated[
        float,
        _most(
            "angle",
            "greatest angle of a straight leg at its platform joint from the platform's z axis",
            True,
            RIGHT_ANGLE,
        ),
    ] = math.inf
    actuator_force: Annotated[float, _most("force", "greatest force of an actuated slide under [load]")] = math.inf
    actuator_moment: Annotated[float, _most("moment", "greatest moment of an actuated revolute under [load]")] = (
        math.inf
    )
    leg_diameter: Annotated[
        float, _least("length", "straight legs, as cylinders this thick between their joints, must not touch", True)
    ] = -math.inf


def is_set(limit: Scalar) -> bool:
    """Whether a limit holds at all: one that is not set is infinite by form, the float itself."""
    return not (type(limit) is float and math.isinf(limit))


@dataclass(frozen=True)
class Rod:
    """The straight part of a leg, between its only two passive joints.

    Attributes:
        leg: name of the leg.
        start, end: centres of the joints on the base side and on the platform side, base frame, m.
        telescopic: whether an actuated slide lies between them.
        on_base, on_platform: whether the first joint stands on the base, the last one on the platform.
    """

    leg: str
    start: Vector
    end: Vector
    telescopic: bool
    on_base: bool
    on_platform: bool

    @property
    def span(self) -> Vector:
        """From its start to its end, m."""
        return self.end - self.start


def rods(legs: Sequence[Leg]) -> list[Rod]:
    """The straight parts of those legs that have one.

    That is a leg with a slide between its two passive joints (U-P-S, R-P-S, R-P-R), and the rod of a crank between two
    joints that both have several axes, or in a plane both have one.
    """
    return [rod for leg in legs if (rod := _rod(leg)) is not None]


def _rod(leg: Leg) -> Rod | None:
    places: dict[str, list[tuple[int, Vector]]] = {}
    for i, element in enumerate(leg.chain):
        if isinstance(element, Parallelogram):
            return None
        for joint in element.freedoms:
            if joint.point is not None:
                places.setdefault(joint.name, []).append((i, joint.point))
    if len(places) != 2:
        return None
    first, last = places.values()
    between = leg.chain[first[-1][0] + 1 : last[0][0]]
    slides = any(_is_slide(element) for element in between)
    if not slides and (len(first) == 1) != (len(last) == 1):
        return None
    return Rod(
        leg.name,
        first[0][1],
        last[0][1],
        any(_is_driven_slide(element) for element in between),
        not any(_moves(element) for element in leg.chain[: first[0][0]]),
        not any(_moves(element) for element in leg.chain[last[-1][0] + 1 :]),
    )


def _is_driven_slide(element: Element) -> bool:
    return isinstance(element, Spring) and element.actuated and element.joint.point is None


def _is_slide(element: Element) -> bool:
    return _is_driven_slide(element) or (isinstance(element, Joint) and element.point is None)


def _moves(element: Element) -> bool:
    return isinstance(element, Joint) or (isinstance(element, Spring) and element.actuated)


def driven_slides(chain: Sequence[Element]) -> list[int]:
    """Which elements of a leg's chain are actuated slides whose travel is not the leg's length."""
    rod = _rod(Leg("", tuple(chain)))
    if rod is not None and rod.telescopic:
        return []
    return [i for i, element in enumerate(chain) if _is_driven_slide(element)]


def check_limits(limits: Limits, legs: Sequence[Leg], planar: bool, written: bool, origin: str) -> None:
    """Refuse limits that contradict each other, and those of parts that the machine does not have.

    Args:
        limits: of the machine.
        legs: of it, at any pose.
        planar: whether it moves in a plane.
        written: whether it is written leg by leg, so that slides have a home.
        origin: name of the file.

    Raises:
        InputError: names the limits and what to change.
    """
    for low, high in (("shortest_leg", "longest_leg"), ("travel_from", "travel_to")):
        least, most = getattr(limits, low), getattr(limits, high)
        if least > most:
            raise InputError(
                f'"{origin}": limits.{low} is {least:g} m and limits.{high} {most:g} m: nothing lies between them; '
                "exchange or widen them."
            )
    found = rods(legs)
    lengths = any(rod.telescopic for rod in found)
    travels = written and any(driven_slides(leg.chain) for leg in legs)
    driven = [s for leg in legs for s in leg.springs if s.actuated]
    has = {
        "shortest_leg": (lengths, "a leg with an actuated slide between two joints"),
        "longest_leg": (lengths, "a leg with an actuated slide between two joints"),
        "travel_from": (travels, "a slide whose travel counts from a home pose (those of machines written leg by leg)"),
        "travel_to": (travels, "a slide whose travel counts from a home pose (those of machines written leg by leg)"),
        "base_joint_angle": (
            not planar and any(rod.on_base for rod in found),
            "a straight leg that tilts against the base's z axis",
        ),
        "platform_joint_angle": (
            not planar and any(rod.on_platform for rod in found),
            "a straight leg that tilts against the platform's z axis",
        ),
        "actuator_force": (any(s.joint.point is None for s in driven), "an actuated slide"),
        "actuator_moment": (any(s.joint.point is not None for s in driven), "an actuated revolute"),
        "leg_diameter": (len(found) > 1, "two straight legs"),
    }
    for name in quantities(Limits):
        there, part = has[name]
        if is_set(getattr(limits, name)) and not there:
            raise InputError(f'"{origin}": limits.{name} has no meaning here: the machine lacks {part}; leave it out.')

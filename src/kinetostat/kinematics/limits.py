"""Whether a pose keeps within the limits of a machine's legs and joints, and if not, which it passes. Loads elsewhere.

Every comparison is between scalars without a branch, so that one pose, many and the compiled engine judge alike.

Source: the definitions on the documentation's page on limits and workspace.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from kinetostat.algebra.scalar import Scalar, cos, reciprocal, times
from kinetostat.algebra.segment import squared_distance
from kinetostat.algebra.vector import Vector
from kinetostat.machine.limits import Limits, Rod, driven_slides, is_set, rods
from kinetostat.machine.machine import Chains, Configuration, Machine

SLACK = 1e-9
"""Relative excess up to which a pose counts as at its limit: whoever asks for the limit itself is not refused by
rounding."""


@dataclass(frozen=True)
class Check:
    """A limit and what it is compared with at a pose.

    Attributes:
        field: the limit's name in [limits].
        part: what is limited, as people call it.
        measure: what is compared; see `READINGS` for how it is read.
        bound: what it is compared with.
        at_most: whether `measure` must not exceed the bound, otherwise it must not fall short of it.
        slack: excess that counts as none.
    """

    field: str
    part: str
    measure: Scalar
    bound: Scalar
    at_most: bool
    slack: Scalar

    @property
    def kept(self) -> Scalar:
        """Whether the pose is within the limit; not where the measure is NaN."""
        if self.at_most:
            return self.measure <= self.bound + self.slack
        return self.measure >= self.bound - self.slack


def within(checks: Sequence[Check]) -> Scalar:
    """Whether all limits are kept; plainly true where there are none."""
    result: Scalar = True
    for check in checks:
        result = check.kept & result
    return result


def geometric_checks(machine: Machine, configuration: Configuration, joints: Sequence[Scalar]) -> list[Check]:
    """All limits that do not depend on loads.

    Args:
        machine: with its limits.
        configuration: it, placed.
        joints: its coordinates from the home pose (m, rad) where it is written leg by leg.
    """
    limits, length = machine.tables["limits"], configuration.length
    found = [*_lengths(limits, rods(configuration.legs), length)] if _any(limits, "shortest_leg", "longest_leg") else []
    if machine.family.chains and joints and _any(limits, "travel_from", "travel_to"):
        found += _travels(limits, machine.chains(), joints)
    if _any(limits, "base_joint_angle", "platform_joint_angle"):
        found += _tilts(limits, rods(configuration.legs), configuration.platform.rotation.z)
    if is_set(limits.leg_diameter):
        found += _clearances(limits, rods(configuration.legs))
    return found


def _any(limits: Limits, *names: str) -> bool:
    return any(is_set(getattr(limits, name)) for name in names)


def _between(names: tuple[str, str], limits: Limits, part: str, measure: Scalar, slack: Scalar) -> Iterator[Check]:
    """The checks of a least and a greatest value."""
    for name, at_most in zip(names, (False, True), strict=True):
        if is_set(getattr(limits, name)):
            yield Check(name, part, measure, getattr(limits, name), at_most, slack)


def _lengths(limits: Limits, legs: Sequence[Rod], length: Scalar) -> Iterator[Check]:
    for rod in legs:
        if rod.telescopic:
            yield from _between(("shortest_leg", "longest_leg"), limits, rod.leg, rod.span.norm(), times(SLACK, length))


def _travels(limits: Limits, chains: Chains, joints: Sequence[Scalar]) -> Iterator[Check]:
    """Coordinates of the actuated slides, leg by leg."""
    coordinates = iter(joints)
    for steps in chains.legs:
        counted = driven_slides([step.element for step in steps])
        for i, step in enumerate(steps):
            amount = next(coordinates) if step.moves else None
            if i in counted:
                name = step.element.name.removesuffix(" actuator")
                yield from _between(("travel_from", "travel_to"), limits, name, amount, times(SLACK, chains.length))


def _tilts(limits: Limits, legs: Sequence[Rod], platform_normal: Vector) -> Iterator[Check]:
    """Squares of the cosines between straight legs and the normals: no square root, no arc."""
    for rod in legs:
        span = rod.span
        square = span.dot(span)
        ends = (
            ("base_joint_angle", rod.on_base, span.z),
            ("platform_joint_angle", rod.on_platform, span.dot(platform_normal)),
        )
        for name, there, along in ends:
            limit = getattr(limits, name)
            if there and is_set(limit):
                yield Check(
                    name,
                    rod.leg,
                    times(times(along, along), reciprocal(square)),
                    times(cos(limit), cos(limit)),
                    False,
                    SLACK,
                )


def _clearances(limits: Limits, legs: Sequence[Rod]) -> Iterator[Check]:
    """Squares of the distances of the axes of any two straight legs."""
    square = times(limits.leg_diameter, limits.leg_diameter)
    for one, other in combinations(legs, 2):
        apart = squared_distance((one.start, one.end), (other.start, other.end))
        yield Check("leg_diameter", f"{one.leg} and {other.leg}", apart, square, False, times(SLACK, square))


@dataclass(frozen=True)
class Reading:
    """How a limit that is passed is told to people.

    Attributes:
        says: about the part, with its value in braces.
        unit: of the value.
        value: from what is compared to what people read.
        advice: what may be done besides changing the limit.
    """

    says: str
    unit: str
    value: Callable[[float], float] = float
    advice: str = "move the platform"


def _angle(square: float) -> float:
    return math.degrees(math.acos(min(1.0, math.sqrt(square))))


READINGS = {
    "shortest_leg": Reading("is {} long", "m"),
    "longest_leg": Reading("is {} long", "m"),
    "travel_from": Reading("has travelled {} from the home pose", "m"),
    "travel_to": Reading("has travelled {} from the home pose", "m"),
    "base_joint_angle": Reading("stands at {} to the base's z axis", "deg", _angle),
    "platform_joint_angle": Reading("stands at {} to the platform's z axis", "deg", _angle),
    "actuator_force": Reading("carries {}", "N", advice="lower the load"),
    "actuator_moment": Reading("carries {}", "N·m", advice="lower the load"),
    "leg_diameter": Reading("come within {} of each other", "m", math.sqrt),
}
"""By the name of the limit."""


def why_beyond(checks: Sequence[Check]) -> str:
    """One sentence for each limit that is passed, on the part that passes it furthest; floats only."""
    passed: dict[str, list[Check]] = {}
    for check in checks:
        if not check.kept:
            passed.setdefault(check.field, []).append(check)
    return " ".join(_sentence(found) for found in passed.values())


def _sentence(passed: Sequence[Check]) -> str:
    """About the checks of one limit that are not kept."""
    worst = max(passed, key=lambda check: abs(check.measure - check.bound))
    reading = READINGS[worst.field]
    value, limit = (f"{reading.value(float(number)):.6g} {reading.unit}" for number in (worst.measure, worst.bound))
    more = f" (and {len(passed) - 1} more pass it)" if len(passed) > 1 else ""
    side = "at most" if worst.at_most or worst.field.endswith("angle") else "at least"
    return (
        f"{worst.part[0].upper()}{worst.part[1:]} {reading.says.format(value)}, but limits.{worst.field} asks for "
        f"{side} {limit}{more}; {reading.advice} or change the limit."
    )

"""Whether a pose keeps within the limits of a machine, and if not, which it passes. Which limits there are: `machine`.

Every comparison is between scalars without a branch, so that one pose, many and the compiled engine judge alike.

Source: the definitions on the documentation's page on limits and workspace.
"""

import math
from collections.abc import Sequence
from operator import itemgetter

from kinetostat.algebra.scalar import Scalar
from kinetostat.display import Display
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Spring
from kinetostat.machine.limits import About, Limit, Parts, limits_set
from kinetostat.machine.links import driven_slides
from kinetostat.machine.machine import Chains, Configuration, Machine
from kinetostat.tolerances import LIMIT_SLACK

DIGITS_OF_LIMIT = 6
"""Digits of a value and of its limit in a message: with fewer, a limit that is just passed would look kept."""


@dataclass(frozen=True)
class Check:
    """A limit and what it is compared with at a pose.

    Attributes:
        limit: the limit.
        part: what is limited, as people call it.
        measure: what is compared, e.g. the square of a cosine; `limit.shown` makes a length or an angle of it.
        bound: what it is compared with.
        slack: excess that counts as none.
    """

    limit: Limit
    part: str
    measure: Scalar
    bound: Scalar
    slack: Scalar

    @property
    def at_most(self) -> bool:
        """Whether the measure must not exceed the bound, otherwise it must not fall short of it."""
        # A greatest value is a least measure where the measure falls as the value rises.
        return self.limit.at_most != self.limit.falling

    @property
    def kept(self) -> Scalar:
        """Whether the pose is within the limit; not where the measure is NaN."""
        if self.at_most:
            return self.measure <= self.bound + self.slack
        return self.measure >= self.bound - self.slack


def within(checks: Sequence[Check]) -> Scalar:
    """Return whether all limits are kept; plainly true where there are none."""
    result: Scalar = True
    for check in checks:
        result = check.kept & result
    return result


def geometric_checks(machine: Machine, configuration: Configuration, joints: Sequence[Scalar]) -> list[Check]:
    """Compare a pose with all limits that do not depend on loads.

    Args:
        machine: the machine with its limits.
        configuration: the placed machine.
        joints: joint coordinates from the home pose, rad or m, of a machine written leg by leg; empty for others.
    """
    rows = [limit for limit in limits_set(machine.tables["limits"]) if limit.about is not About.LOAD]
    if not rows:
        return []
    needs_travels = bool(machine.family.chains and joints) and any(limit.about is About.TRAVEL for limit in rows)
    slides = travels(machine.chains(), joints) if needs_travels else []
    return _checks(machine, rows, parts_of(machine, configuration, slides), configuration.length)


def load_checks(
    machine: Machine, configuration: Configuration, actuators: Sequence[tuple[Spring, Scalar]]
) -> list[Check]:
    """Compare the loads of actuators with their limits.

    Args:
        machine: the machine with its limits.
        configuration: the placed machine.
        actuators: the springs of the actuators, each with the size of its load, N or N·m.
    """
    rows = [limit for limit in limits_set(machine.tables["limits"]) if limit.about is About.LOAD]
    return _checks(machine, rows, parts_of(machine, configuration, (), actuators), configuration.length)


def limit_use(
    machine: Machine, configuration: Configuration, actuators: Sequence[tuple[Spring, Scalar]]
) -> list[Scalar]:
    """Shares that loads of actuators use of their limits, none if none is limited; arguments as for `load_checks`."""
    return [check.measure / check.bound for check in load_checks(machine, configuration, actuators)]


def parts_of(
    machine: Machine,
    configuration: Configuration,
    slides: Sequence[tuple[str, Scalar]] = (),
    actuators: Sequence[tuple[Spring, Scalar]] = (),
) -> Parts:
    """Return the parts of a placed machine that limits are about; see `Parts` for slides and actuators."""
    return Parts(configuration.legs, configuration.platform.rotation.z, machine.family.planar, slides, actuators)


def _checks(machine: Machine, limits: Sequence[Limit], parts: Parts, length: Scalar) -> list[Check]:
    """Compare parts with limits, part by part and not limit by limit.

    So the first limit that a pose passes is that of the first part that passes one: parts come in the
    order of `About`.
    """
    about_order, checks_in_place = list(About), []
    for limit in limits:
        bound = limit.compared(getattr(machine.tables["limits"], limit.name))
        slack = LIMIT_SLACK * limit.scale(bound, length)
        for place, part, measure in limit.measure(parts):
            check = Check(limit, part, measure, bound, slack)
            checks_in_place.append(((about_order.index(limit.about), place), check))
    return [check for _, check in sorted(checks_in_place, key=itemgetter(0))]


def travels(chains: Chains, joints: Sequence[Scalar]) -> list[tuple[str, Scalar]]:
    """Return the actuated slides whose travel counts from the home pose, each with its coordinate (m), leg by leg."""
    coordinates = iter(joints)
    result = []
    for steps in chains.legs:
        slides = driven_slides([step.element for step in steps])
        for i, step in enumerate(steps):
            coordinate = next(coordinates) if step.moves else None
            if i in slides:
                result.append((step.element.part, coordinate))
    return result


def why_beyond(checks: Sequence[Check], display: Display) -> str:
    """Return one sentence for each limit that is passed, on the part that passes it furthest; floats only."""
    passed: dict[str, list[Check]] = {}
    for check in checks:
        if not check.kept:
            passed.setdefault(check.limit.name, []).append(check)
    return " ".join(_sentence(checks_of_limit, display) for checks_of_limit in passed.values())


def _sentence(passed: Sequence[Check], display: Display) -> str:
    """Say that one limit is passed, from its checks that are not kept; a direction without length is not a number."""
    unknown = [check for check in passed if math.isnan(check.measure)]
    worst = unknown[0] if unknown else max(passed, key=lambda check: abs(check.measure - check.bound))
    limit = worst.limit
    if unknown:
        return (
            f"{worst.part[0].upper()}{worst.part[1:]}: both joints stand in one point, so that limits.{limit.name} "
            f"cannot be judged; {limit.advice} or leave the limit out."
        )
    value, allowed = (
        display.show(limit.shown(float(number)), limit.unit, digits=DIGITS_OF_LIMIT)
        for number in (worst.measure, worst.bound)
    )
    more = f" (and {len(passed) - 1} more pass it)" if len(passed) > 1 else ""
    return (
        f"{worst.part[0].upper()}{worst.part[1:]} {limit.sentence.format(value)}, but limits.{limit.name} asks for "
        f"{'at most' if limit.at_most else 'at least'} {allowed}{more}; {limit.advice} or change the limit."
    )

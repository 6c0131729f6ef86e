"""A wrench on the platform: the displacement of the tool, and the loads of legs, springs and joints. One pose.

Source: theory (28) and (29). Wrenches and twists are in base axes, at the point that each function names.
"""

from collections.abc import Sequence
from dataclasses import replace

from kinetostat.algebra.scalar import Scalar, total, weighted
from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.symmetric import SIZE, Symmetric6
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import Statics, compliance_matrix
from kinetostat.kinetostatics.leg import INFINITE
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Element, Joint, Leg, work_on_free


@dataclass(frozen=True)
class JointReaction:
    """The wrench that a joint passes on from its platform side to its base side; its reaction is opposite to it.

    Attributes:
        leg, joint: names of the leg and of the joint.
        point: point about which the moment is taken, base frame, m: on the joint's axis, or on the carriage of a slide.
        wrench: moment (N·m) and force (N) that the platform side exerts on the base side at that point, base axes.
    """

    leg: str
    joint: str
    point: Vector
    wrench: Wrench


def deflection(statics: Statics, load: Wrench) -> Twist:
    """Compute t = C w: small rotation (rad) and displacement (m) of the tool point under a wrench there.

    A free spring on which the load does work moves without end, so that the components which it moves are infinite; the
    others are exact. A free spring on which the load does no work stays where it is.

    Args:
        statics: the statics of the machine.
        load: the wrench at the tool point, in the axes of the statics.
    """
    compliance, w = held_compliance(statics), load.components()
    rows = [total([weighted(compliance.entry(i, j), w[j]) for j in range(SIZE)]) for i in range(SIZE)]
    driven = [twist.components() for twist, s in statics.motions if s == INFINITE and work_on_free(load, twist)]
    infinite = [any(twist[i] for twist in driven) for i in range(SIZE)]
    components = [INFINITE if endless else row for row, endless in zip(rows, infinite, strict=True)]
    return Twist(Vector(*components[:3]), Vector(*components[3:]))


def held_compliance(statics: Statics) -> Symmetric6:
    """C of the machine with its free springs held, in the axes of the statics; C itself if no spring is free."""
    return compliance_matrix(replace(statics, motions=tuple((xi, s) for xi, s in statics.motions if s < INFINITE)))


def spring_loads(response: Response, load: Wrench) -> list[Scalar]:
    """Force (N) or moment (N·m) of each spring under a wrench at the tool point: xi_e times w (virtual work).

    For a free spring it is the load that would hold it: exactly 0 if the wrench does no work on it.
    """
    pairs = zip(response.statics.flexibility, response.statics.compliance, strict=True)
    return [work_on_free(load, twist) if s == INFINITE else load.work(twist) for twist, s in pairs]


def leg_wrenches(response: Response, load: Wrench) -> list[Wrench]:
    """The wrench that each leg carries from the platform to the base, at the tool point, base axes.

    Their sum is the load. Internal loads that rigid parts leave undecided are taken as zero.
    """
    carried = []
    for basis, shares in zip(response.statics.wrenches, response.statics.sharing, strict=True):
        parts = [wrench * load.work(share) for wrench, share in zip(basis, shares, strict=True)]
        carried.append(sum_of(parts))
    return carried


def sum_of(wrenches: Sequence[Wrench]) -> Wrench:
    """The sum of wrenches at one point."""
    result = Wrench(ZERO, ZERO)
    for wrench in wrenches:
        result = result + wrench
    return result


def joint_reactions(response: Response, load: Wrench) -> list[JointReaction]:
    """The wrench in every joint: that of its leg (links have no weight here), referred to the joint's own point.

    A joint that an actuator or a flexure holds passes on the whole wrench: along its freedom the load of that spring,
    and across it the load of its bearings or its guide.
    """
    reactions = []
    for leg, wrench in zip(response.configuration.legs, leg_wrenches(response, load), strict=True):
        for name, point in joint_points(leg):
            reactions.append(JointReaction(leg.name, name, point, wrench.moved(point - response.reference)))
    return reactions


def joint_points(leg: Leg) -> list[tuple[str, Vector]]:
    """The joints of a leg by name, from base to platform, each with a point of it (m).

    The point of a slide is its carriage, or the end of the chain before it if the carriage is not known.
    """
    named: dict[str, Vector] = {}
    at = next(iter(leg.path), ZERO)
    for element in leg.chain:
        for name, joint in _joints(element):
            named.setdefault(name, joint.point or joint.carriage or at)
        at = element.path[-1] if element.path else at
    return list(named.items())


def _joints(element: Element) -> list[tuple[str, Joint]]:
    """The freedoms of an element by the name of their joint, also those that an actuator or a flexure holds."""
    springs = [s for s in element.springs if s.actuated or s.hinge]
    return [(j.name, j) for j in element.freedoms] + [(s.joint.name or s.name, s.joint) for s in springs]

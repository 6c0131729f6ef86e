"""A wrench on the platform: how far it moves the tool point, and what every leg, spring and joint carries. One pose.

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
from kinetostat.machine.leg import Element, Joint, Leg, felt


@dataclass(frozen=True)
class JointReaction:
    """The share of the load that a joint passes on towards the base; against it, the joint bears on the platform side.

    Attributes:
        leg, joint: names.
        point: where the moment is taken, base frame, m: on the joint's axis, or the carriage of a slide.
        wrench: moment (N·m) and force (N) that the platform side exerts on the base side at that point, base axes.
    """

    leg: str
    joint: str
    point: Vector
    wrench: Wrench


def deflection(statics: Statics, load: Wrench) -> Twist:
    """Compute t = C w: small rotation (rad) and displacement (m) of the tool point under a wrench there.

    A free spring that the load drives moves without end, so that the components which it moves are infinite; the others
    are exact. A free spring that the load does not drive stays where it is.

    Args:
        statics: of the machine.
        load: at the tool point, in the axes of the statics.
    """
    compliance, w = held_compliance(statics), load.components()
    rows = [total([weighted(compliance.entry(i, j), w[j]) for j in range(SIZE)]) for i in range(SIZE)]
    endless = [twist.components() for twist, s in statics.motions if s == INFINITE and felt(load, twist)]
    reached = [any(twist[i] for twist in endless) for i in range(SIZE)]
    moved = [INFINITE if free else row for row, free in zip(rows, reached, strict=True)]
    return Twist(Vector(*moved[:3]), Vector(*moved[3:]))


def held_compliance(statics: Statics) -> Symmetric6:
    """C of the machine with its free springs held, in the axes of the statics; C itself where no spring is free."""
    return compliance_matrix(replace(statics, motions=tuple((xi, s) for xi, s in statics.motions if s < INFINITE)))


def spring_loads(response: Response, load: Wrench) -> list[Scalar]:
    """N or N·m that each spring carries under a wrench at the tool point: xi_e times w (virtual work).

    For a free spring it is what would hold it: exactly 0 where the load does not drive it.
    """
    pairs = zip(response.statics.flexibility, response.statics.compliance, strict=True)
    return [felt(load, twist) if s == INFINITE else load.work(twist) for twist, s in pairs]


def leg_wrenches(response: Response, load: Wrench) -> list[Wrench]:
    """The wrench that each leg carries from the platform to the base, at the tool point, base axes.

    Their sum is the load. Where rigid parts leave internal loads undecided, those are taken as zero.
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
    """The wrench in every joint: that of its leg (links are without weight), referred to the joint's own point.

    A joint that an actuator or a flexure holds passes it on whole: along its freedom the load of that spring, and
    across it what its bearings or its guide must carry.
    """
    reactions = []
    for leg, wrench in zip(response.configuration.legs, leg_wrenches(response, load), strict=True):
        for name, point in joint_points(leg):
            reactions.append(JointReaction(leg.name, name, point, wrench.moved(point - response.reference)))
    return reactions


def joint_points(leg: Leg) -> list[tuple[str, Vector]]:
    """The joints of a leg by name, base to platform, each with a point of it.

    That of a slide is its carriage's, or if that is not known, where the chain has come to.
    """
    named: dict[str, Vector] = {}
    at = next(iter(leg.path), ZERO)
    for element in leg.chain:
        for name, joint in _joints(element):
            named.setdefault(name, joint.point or joint.carriage or at)
        at = element.path[-1] if element.path else at
    return list(named.items())


def _joints(element: Element) -> list[tuple[str, Joint]]:
    """The freedoms of an element, those that an actuator or a flexure holds among them, by the name of their joint."""
    springs = [s for s in element.springs if s.actuated or s.hinge]
    return [(j.name, j) for j in element.freedoms] + [(s.joint.name or s.name, s.joint) for s in springs]

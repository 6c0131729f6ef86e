"""Loads at one pose: how far they move the tool and the links, what legs, springs and joints carry, and internal loads.

A wrench on the platform moves the tool, and to first order every joint and link (`deflection`, `deflected_links`).
Legs, springs and joints carry it (`leg_wrenches`, `spring_loads`, `joint_reactions`). Internal loads are wrenches that
legs exert on each other through the platform without any load on it (`internal_loads`): if a spring on their way
deflects, elasticity decides how large they are; if everything is rigid, they are undecided, and no motion of the
platform depends on them. Wrenches and twists are in base axes, at the point that each function names.

Source: theory (28) and (29); theory (31) and (32) for the shape; theory (9) and theory section 7 for internal loads.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from kinetostat.algebra.scalar import Scalar, total, weighted
from kinetostat.algebra.screw import NO_MOTION, NO_WRENCH, Twist, Wrench
from kinetostat.algebra.symmetric import SIZE, Symmetric6
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import Statics, compliance_matrix
from kinetostat.kinetostatics.leg import INFINITE, free_springs_as_joints
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.leg_screws import LegScrews, work_on_free
from kinetostat.tolerances import CLOSING_ROUND_OFF, DEPENDENT_WRENCHES


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
    amounts = [total([weighted(compliance.entry(i, j), w[j]) for j in range(SIZE)]) for i in range(SIZE)]
    endless = [twist.components() for twist, s in statics.motions if s == INFINITE and work_on_free(load, twist)]
    is_endless = [any(twist[i] for twist in endless) for i in range(SIZE)]
    components = [INFINITE if flag else amount for amount, flag in zip(amounts, is_endless, strict=True)]
    return Twist.of(components)


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
        amounts = [load.work(share) for share in shares]
        carried.append(sum((wrench * amount for wrench, amount in zip(basis, amounts, strict=True)), NO_WRENCH))
    return carried


def joint_reactions(response: Response, load: Wrench) -> list[JointReaction]:
    """The wrench in every joint: that of its leg (without the weight of links), referred to the joint's own point.

    A joint that an actuator or a flexure holds passes on the whole wrench: along its freedom the load of that spring,
    and across it the load of its bearings or its guide.
    """
    reactions = []
    for leg, wrench in zip(response.configuration.legs, leg_wrenches(response, load), strict=True):
        for name, point in joint_points(leg):
            reactions.append(JointReaction(leg.name, name, point, wrench.at_offset(point - response.reference)))
    return reactions


def joint_points(leg: Leg) -> list[tuple[str, Vector]]:
    """The joints of a leg by name, from base to platform, each with a point of it (m).

    The point of a slide is its carriage, or the end of the chain before it if the carriage is not known.
    """
    point_of_joint: dict[str, Vector] = {}
    end = next(iter(leg.path), ZERO)
    for element in leg.chain:
        for name, joint in _joints(element):
            point_of_joint.setdefault(name, joint.point or joint.carriage or end)
        end = element.path[-1] if element.path else end
    return list(point_of_joint.items())


def _joints(element: Element) -> list[tuple[str, Joint]]:
    """The freedoms of an element by the name of their joint, also those that an actuator or a flexure holds."""
    springs = [s for s in element.springs if s.actuated or s.hinge]
    return [(j.name, j) for j in element.freedoms] + [(s.joint.name or s.name, s.joint) for s in springs]


@dataclass(frozen=True)
class DeflectedLink:
    """A link of a leg with the small motions of its ends.

    Attributes:
        leg: its name.
        start, end: before the load, base frame, m.
        start_motion, end_motion: rotation (rad) and displacement (m) of each end, at that end, base axes.
    """

    leg: str
    start: Vector
    end: Vector
    start_motion: Twist
    end_motion: Twist

    def point(self, share: float, factor: float) -> Vector:
        """The point at a share of the link once it has bent, displacements times `factor`; base frame, m.

        Displacements between the ends are cubic in the share, as those of a beam that is loaded at its ends only.
        """
        span, s = self.end - self.start, share
        slopes = [motion.rotational.cross(span) for motion in (self.start_motion, self.end_motion)]
        shift = (
            self.start_motion.translational * (2 * s**3 - 3 * s**2 + 1)
            + slopes[0] * (s**3 - 2 * s**2 + s)
            + self.end_motion.translational * (3 * s**2 - 2 * s**3)
            + slopes[1] * (s**3 - s**2)
        )
        return self.start + span * s + shift * factor


@dataclass(frozen=True)
class Deflection:
    """Small motions of a loaded machine.

    Attributes:
        load: the wrench at the tool point, base axes, N·m and N.
        motion: motion of the tool point, rad and m.
        links: deflected links of the legs.
    """

    load: Wrench
    motion: Twist
    links: tuple[DeflectedLink, ...]


def deflected_links(response: Response, load: Wrench) -> list[DeflectedLink]:
    """All links of a machine under a wrench at its tool point (N·m; N, base axes).

    Springs deflect as they are loaded; passive joints and free springs move so that each leg's end follows the platform
    (least squares of J_p q = t - J_e d, which has a solution because the statics hold).
    """
    platform = deflection(response.statics, load)
    loads = iter(spring_loads(response, load))
    links: list[DeflectedLink] = []
    for leg, screws in zip(response.configuration.legs, response.legs, strict=True):
        springs = [(twist, s, next(loads)) for twist, s in zip(screws.elastic, screws.compliance, strict=True)]
        is_free = [s == INFINITE for _, s, _ in springs]
        elastic = [twist * (spring_load * s) for twist, s, spring_load in springs if s != INFINITE]
        free = [twist for twist, s, _ in springs if s == INFINITE]
        passive = [joint.twist(response.reference) for joint in leg.passive]
        remainder = platform - sum(elastic, NO_MOTION)
        following = _following([*passive, *free], remainder, float(response.configuration.length))
        motions_of_joints, motions_of_free = iter(following[: len(passive)]), iter(following[len(passive) :])
        motions_of_elastic = iter(elastic)
        motions_of_springs = (next(motions_of_free if flag else motions_of_elastic) for flag in is_free)
        bodies = _bodies(leg, motions_of_joints, motions_of_springs)
        links += leg_links(leg, partial(_twist_at, bodies, response.reference))
    return links


def leg_links(leg: Leg, motion_of: Callable[[int, Vector], Twist]) -> Iterator[DeflectedLink]:
    """The links between the points of a chain.

    Args:
        leg: the leg at the pose.
        motion_of: function from a number of elements and a point of the body after them to the motion of this point,
            in base axes, rad and m.
    """
    start: Vector | None = None
    start_body = 0
    for number, element in enumerate(leg.chain):
        points = _points(element)
        for place, point in enumerate(points):
            body = number if place == 0 else number + 1  # the first point of an element belongs to the body before it
            if start is not None and (point - start).norm() > 0.0:
                yield DeflectedLink(leg.name, start, point, motion_of(start_body, start), motion_of(body, point))
            start, start_body = point, body
        if len(points) == 1:
            start_body = number + 1


def _following(joints: Sequence[Twist], motion: Twist, length: float) -> list[Twist]:
    """Motions of joints, by their unit twists, that add up to a motion; `length` (m) makes rows comparable."""
    if not joints:
        return []
    scale = np.repeat([length, 1.0], 3)
    columns = np.array([twist.components() for twist in joints], dtype=float).T * scale[:, None]
    amounts = np.linalg.lstsq(columns, np.array(motion.components(), dtype=float) * scale, rcond=DEPENDENT_WRENCHES)[0]
    return [twist * float(amount) for twist, amount in zip(joints, amounts, strict=True)]


def _bodies(leg: Leg, of_joints: Iterator[Twist], of_springs: Iterator[Twist]) -> list[Twist]:
    """Motions of the bodies before, between and after the elements of a chain, added up from the base.

    Args:
        leg: the leg.
        of_joints, of_springs: motions of its passive joints and of its springs, in order.
    """
    motions = [NO_MOTION]
    for element in leg.chain:
        own_motions = [next(of_joints) for _ in element.freedoms] + [next(of_springs) for _ in element.springs]
        motions.append(motions[-1] + sum(own_motions, NO_MOTION))
    return motions


def _twist_at(bodies: Sequence[Twist], reference: Vector, body: int, point: Vector) -> Twist:
    return bodies[body].at_offset(point - reference)


def _points(element: Element) -> tuple[Vector, ...]:
    """The points of the chain at which an element lies: none for a slide."""
    if isinstance(element, Joint | Spring):
        point = element.mover.point
        return () if point is None else (point,)
    return element.path


@dataclass(frozen=True)
class InternalLoads:
    """Statically indeterminate loads of a machine.

    Attributes:
        degree: number of independent internal loads that the legs can carry: 0 for an isostatic machine.
        undecided: number of these that deflect no spring.
        legs: names of the legs that carry internal loads.
        undecided_legs: names of the legs that carry undecided ones.
    """

    degree: int
    undecided: int
    legs: tuple[str, ...]
    undecided_legs: tuple[str, ...]


def internal_loads(
    names: Sequence[str], legs: Sequence[LegScrews], length: float, guide: Sequence[Wrench] = ()
) -> InternalLoads:
    """The internal loads of a machine at a regular pose.

    They are the null space of the matrix whose columns are the wrenches of all legs (and of the guide): amounts of
    these wrenches that add up to zero on the platform. Those among them that load no elastic spring are undecided.

    Args:
        names: names of the legs.
        legs: their screws at one reference point, base axes.
        length: characteristic length, m, by which moments are divided to compare them with forces.
        guide: the wrenches by which a planar machine is kept in its plane; none for a spatial machine.
    """
    balanced = [free_springs_as_joints(leg) for leg in legs]
    owners = np.repeat(np.arange(len(legs)), [len(leg.wrenches) for leg in balanced])
    columns = [wrench.components() for leg in balanced for wrench in leg.wrenches]
    columns += [wrench.components() for wrench in guide]
    if not columns:
        return InternalLoads(0, 0, (), ())
    matrix = np.array(columns, dtype=float).T / np.repeat([length, 1.0], 3)[:, None]
    sizes = np.linalg.norm(matrix, axis=0)
    _, values, rows = np.linalg.svd(matrix / sizes)
    rank = int((values > DEPENDENT_WRENCHES * values[0]).sum())
    internal = (rows[rank:] / sizes).T[: len(owners)]  # a column for each; the guide, which stands last, has no leg
    _, elastic_sizes, modes = np.linalg.svd(_load_shares(balanced) @ internal)
    decided = int((elastic_sizes > CLOSING_ROUND_OFF).sum())
    undecided = internal @ modes[decided:].T
    return InternalLoads(
        degree=internal.shape[1],
        undecided=internal.shape[1] - decided,
        legs=_involved_legs(names, owners, internal),
        undecided_legs=_involved_legs(names, owners, undecided),
    )


def _load_shares(legs: Sequence[LegScrews]) -> Array:
    """Load in each elastic spring per unit of each leg's wrenches, over its order of size [springs x wrenches]."""
    rows: list[Array] = []
    count = sum(len(leg.wrenches) for leg in legs)
    start = 0
    for leg in legs:
        for loads, compliance, square in zip(leg.loads, leg.compliance, leg.load_squares, strict=True):
            if compliance > 0.0:
                rows.append(np.zeros(count))
                rows[-1][start : start + len(loads)] = np.array(loads, dtype=float) / math.sqrt(square)
        start += len(leg.wrenches)
    return np.array(rows).reshape(len(rows), count)


def _involved_legs(names: Sequence[str], owners: Integers, loads: Array) -> tuple[str, ...]:
    """Names of the legs that carry a share of any of these loads."""
    if not loads.size:
        return ()
    carried = np.abs(loads).max(axis=1) > DEPENDENT_WRENCHES * np.abs(loads).max()
    return tuple(name for i, name in enumerate(names) if carried[owners == i].any())

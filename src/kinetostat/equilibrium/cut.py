"""Machines whose loops are cut: at rods, each a spring between two points, or where legs meet the platform.

A leg that only carries a force between two joints is such a rod; here is also how rods pull at a place of the platform,
and resist its motion, over any scalars. If at most one leg is none, its coordinates, or six free motions of the
platform, are all the unknowns of `reduced`. If there are more, the platform moves freely, and these legs have
coordinates and wrenches of their own, with which `legwise` closes them again.

Source: theory (44). Units, axes and origin are those of `mechanism`.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.scalar import Scalar, inner_product, is_zero, sqrt, total, where
from kinetostat.algebra.solve import Row
from kinetostat.algebra.symmetric import POSITIONS
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.elastic_legs import NO_MASSES, ElasticLeg, RodEnds, masses_of_one_body
from kinetostat.equilibrium.mechanism import LegwisePlaces, Mechanism, legwise_places, mechanism_of
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import Chain
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Machine
from kinetostat.numerics.motions import Motions, of_scalars, skew_of

TENSIONS = ("load.min_tension", "load.max_tension")
"""Leaf paths of what makes preloads a choice."""

PLACES = frozenset(("point", "axis", "first_axis", "second_axis"))
"""Words of leaf paths that place joints of machines written leg by leg."""


@dataclass(frozen=True)
class ElasticRod:
    """A leg as a spring between two points; of its springs in a row, all carry the same.

    Attributes:
        ends: its ends in the free state, on the base and on the platform [1 x 3].
        softness: sum of the compliances of its springs.
        natural_elongation: elongation without a load: what its preloads have stretched, less the rod's growth.
        sign: the sign of the loads that it can carry, 0 for both.
        driven: its springs that are actuators.
        rotor: inertia that its drive adds along it, as `ElasticLeg.rotors`.
    """

    ends: RodEnds
    softness: Scalar
    natural_elongation: Scalar
    sign: float
    driven: tuple[Spring, ...]
    rotor: Scalar


@dataclass(frozen=True)
class Cut:
    """A mechanism whose loops are cut.

    Attributes:
        mechanism: the mechanism with the masses of rods on its platform.
        carrier: the chain that carries the platform.
        rods: the rods that hold it.
        legs: the legs that hold it and are no rods; none if the only one is the carrier.
    """

    mechanism: Mechanism
    carrier: ElasticLeg
    rods: tuple[ElasticRod, ...]
    legs: tuple[ElasticLeg, ...] = ()

    @property
    def unknown_places(self) -> LegwisePlaces:
        """Places among the unknowns: of the coordinates of the carrier, then of each leg, followed by its wrench."""
        return legwise_places(self.carrier.size, self.legs, wrench_size=self.mechanism.ways.shape[1])


def cut(mechanism: Mechanism) -> Cut | None:
    """Cut the loops of a mechanism; None if its form does not allow it."""
    chains = [_without_spin(leg) for leg in mechanism.legs if leg.rod is None]
    if any(leg.sign.any() or leg.idle.any() for leg in chains) or any(leg.hinged.any() for leg in mechanism.legs):
        return None
    rods, masses = [], [mechanism.platform]
    for leg in mechanism.legs:
        if leg.rod is None:
            continue
        twists, coordinate = leg.chain.twists[0], leg.chain.coordinate
        slides = [n for n in range(len(twists)) if all(is_zero(part) for part in twists[n, :3].tolist())]
        springs = [coordinate[n] for n in slides if coordinate[n] >= 0]
        if not springs:
            return None  # nothing of it deflects
        # What the rod carries beyond its slide goes with the platform.
        heavy = [i for i, carried in enumerate(leg.masses.carried) if carried > slides[0]]
        masses.append(leg.masses.of(heavy))
        if all(leg.springs[number] is not None for number in springs):
            if len(springs) > 1 and not all(is_zero(rotor) for rotor in leg.rotors[0].tolist()):
                return None  # a rotor between two springs has a motion of its own
            rods.append(_elastic_rod(mechanism, leg, leg.rod, springs))
    legs = chains if len(chains) > 1 else []
    if legs and not _determine_platform(mechanism, legs, rods):
        return None
    return Cut(
        mechanism=replace(mechanism, platform=masses_of_one_body(masses)),
        carrier=chains[0] if len(chains) == 1 else _free_motions(mechanism),
        rods=tuple(rods),
        legs=tuple(legs),
    )


def _determine_platform(mechanism: Mechanism, legs: Sequence[ElasticLeg], rods: Sequence[ElasticRod]) -> bool:
    """Tell whether the wrenches of legs and rods can hold the platform, and the platform tells how each leg moves."""
    ways = mechanism.ways.shape[1]
    passive = [leg.springs.count(None) for leg in legs]
    wrenches = len(rods) + sum(ways - count for count in passive)
    return wrenches >= ways and max(passive) <= ways and not any(rod.sign for rod in rods)


def _elastic_rod(mechanism: Mechanism, leg: ElasticLeg, ends: RodEnds, springs: Sequence[int]) -> ElasticRod:
    """A leg that is a rod with its springs in a row as one; `springs` are the numbers of their coordinates."""
    softness = [1.0 / leg.stiffness[0, number] for number in springs]
    elongations = [soft * leg.preload[0, number] for soft, number in zip(softness, springs, strict=True)]
    links = [number - len(mechanism.actuators) for number in leg.chain.given]
    elongations += [-mechanism.growth[0, link] for link in links if link >= 0]
    signs = [float(leg.sign[number]) for number in springs if leg.sign[number]]
    return ElasticRod(
        ends=ends,
        softness=total(softness),
        natural_elongation=total(elongations),
        sign=signs[0] if signs else 0.0,
        driven=tuple(mechanism.driven[i] for i in leg.chain.given if 0 <= i < len(mechanism.driven)),
        rotor=total([rotor for rotor in leg.rotors[0].tolist() if not is_zero(rotor)]),
    )


def _without_spin(leg: ElasticLeg) -> ElasticLeg:
    """The leg with a universal joint in place of a ball joint that lets a link spin, which moves nothing else.

    Its axes are across the link, so that the link can be turned any way from where it is.
    """
    if leg.spin is None or np.count_nonzero(leg.idle.any(axis=(0, 1))) > 1:
        return leg
    first, span = leg.spin.first, leg.spin.span
    left_out, chain = first + 2, leg.chain
    turns = [chain.coordinate.index(number) for number in range(first, first + 3)]
    motions = [k for k in range(len(chain.coordinate)) if k != turns[2]]
    kept = [number for number in range(leg.size) if number != left_out]
    twists = np.array(np.broadcast_to(chain.twists, (len(span), *chain.twists.shape[1:])))
    balls = [twists[:, turn].copy() for turn in turns]
    for turn, axis in zip(turns, _across(span), strict=False):
        twists[:, turn] = total([axis[:, i, None] * ball for i, ball in enumerate(balls)])
    carried = tuple(number - (number > turns[2]) for number in leg.masses.carried)
    return replace(
        leg,
        chain=replace(
            chain,
            twists=twists[:, motions],
            coordinate=tuple(chain.coordinate[k] - (chain.coordinate[k] > left_out) for k in motions),
            given=tuple(chain.given[k] for k in motions),
            size=leg.size - 1,
        ),
        springs=tuple(leg.springs[number] for number in kept),
        stiffness=leg.stiffness[:, kept],
        preload=leg.preload[:, kept],
        rotors=leg.rotors[:, kept],
        dampers=leg.dampers[:, kept],
        sign=leg.sign[kept],
        idle=np.zeros((len(leg.idle), len(kept), len(kept))),
        masses=replace(leg.masses, carried=carried),
        motion_counts=tuple(number - (number > turns[2]) for number in leg.motion_counts),
        spin=None,
    )


def _across(span: Array) -> tuple[Array, Array]:
    """Two unit vectors across a way and each other [n x 3], without a case in which they are not known.

    Source: Duff et al. 2017, "Building an orthonormal basis, revisited", J. Computer Graphics Techniques 6(1).
    """
    count = None if span.dtype == object else len(span)
    columns = span[0].tolist() if count is None else [*span.T]
    size = sqrt(total([part * part for part in columns]))
    x, y, z = (part * (1.0 / size) for part in columns)
    sign = where(z < 0.0, -1.0, 1.0)
    share = -(1.0 / (sign + z))
    mixed = x * y * share
    first = 1.0 + sign * (x * x * share), sign * mixed, -(sign * x)
    return of_scalars(first, count), of_scalars((mixed, sign + y * y * share, -y), count)


def _free_motions(mechanism: Mechanism) -> ElasticLeg:
    """A chain without springs in all motions that there are: slides first, so that turns are about the tool point."""
    ways = mechanism.ways.T[::-1].astype(object)
    size = len(ways)
    nothing = np.zeros((1, size))
    return ElasticLeg(
        name="platform",
        chain=Chain(ways[None], tuple(range(size)), (-1,) * size, size),
        springs=(None,) * size,
        stiffness=nothing,
        preload=nothing,
        sign=nothing[0],
        idle=np.zeros((1, size, size)),
        masses=NO_MASSES,
        rotors=nothing,
        dampers=nothing,
    )


def cut_machine(machine: Machine, varying: Collection[str] = ()) -> Cut | None:
    """Cut the loops of a machine, if that can be done wherever its varying parameters (leaf paths) are."""
    load = machine.tables["load"]
    if any(path in varying or math.isfinite(getattr(load, path.partition(".")[2])) for path in TENSIONS):
        return None
    state = state_of(machine)
    with np.errstate(all="ignore"):
        mechanism, form = (mechanism_of(machine, state.configuration, state.joints, count) for count in (1, None))
        if any((a.rod is None) != (b.rod is None) for a, b in zip(mechanism.legs, form.legs, strict=True)):
            return None  # by its form a leg is a rod, which its numbers do not let it be
        machine_cut = cut(mechanism)
    # Legs of a file are rods by their numbers, which must then stay as they are.
    if any(not leg.lines for leg in state.configuration.legs) and any(
        PLACES.intersection(p.split(".")) for p in varying
    ):
        return None
    if machine_cut is None or not machine.loaded:
        return machine_cut
    carrier, driven = machine_cut.carrier, machine_cut.mechanism.driven
    drives_of_carrier = [driven[n] for n in carrier.chain.given if 0 <= n < len(driven)]
    if not machine_cut.legs and any(spring not in carrier.springs for spring in drives_of_carrier):
        return None  # no coordinate says what a rigid actuator carries
    return machine_cut


@dataclass(frozen=True)
class RodPull:
    """Pull of a rod from a point b of the base to a point a of the platform.

    Attributes:
        base_point, platform_point: b and a.
        moment: a x b.
        length: length of the rod, |a - b|.
        tension: the tension with which it pulls.
        force_density: c, the tension over the length: the rod pulls a with c (b - a).
        tangent_weight, elastic_weight: weights of the dyad of the rod's line in the tangent stiffness, and in the
            elastic part of it: (k - c) and k over the square of the length, with the stiffness k of the rod.
        slack: 1 where the rod carries nothing, else 0.
    """

    base_point: Vector
    platform_point: Vector
    moment: Vector
    length: Scalar
    tension: Scalar
    force_density: Scalar
    tangent_weight: Scalar
    elastic_weight: Scalar
    slack: Scalar

    @property
    def line(self) -> tuple[Scalar, ...]:
        """The gradient of half the square of its length by a twist of the platform."""
        return (*(-self.moment).components(), *(self.platform_point - self.base_point).components())


def pull_of(rod: ElasticRod, platform: Motions | None) -> RodPull:
    """Compute the pull of a rod at a place of the platform, or in the free state if `platform` is None."""
    base_point, free_point = Vector(*rod.ends.near[0]), Vector(*rod.ends.far[0])
    shift = ZERO if platform is None else Vector(*platform.shift(rod.ends.far)[0])
    platform_point, free_span = free_point + shift, free_point - base_point
    span = platform_point - base_point
    square = span.dot(span)
    length = sqrt(square)
    # The difference of both lengths is written as a quotient, which does not cancel.
    elongation = 0.0 if platform is None else shift.dot(span + free_span) * (1.0 / (length + free_span.norm()))
    stiffness, slack = 1.0 / rod.softness, 0.0
    tension = (elongation + rod.natural_elongation) * stiffness
    if rod.sign:
        carries = rod.sign * tension >= 0.0
        tension, stiffness = where(carries, tension, 0.0), where(carries, stiffness, 0.0)
        slack = where(carries, 0.0, 1.0)
    force_density, inverse_square = tension * (1.0 / length), 1.0 / square
    return RodPull(
        base_point=base_point,
        platform_point=platform_point,
        moment=platform_point.cross(base_point),
        length=length,
        tension=tension,
        force_density=force_density,
        tangent_weight=(stiffness - force_density) * inverse_square,
        elastic_weight=stiffness * inverse_square,
        slack=slack,
    )


def wrench_of_rods(pulls: Sequence[RodPull], weights: Row) -> tuple[Array, Array]:
    """The wrench of all rods at the origin [1 x 6], and the negative of its derivative by a twist [1 x 6 x 6].

    Args:
        pulls: the pulls of the rods.
        weights: weight of the dyad of each line in the derivative: `tangent_weight` of each pull for the tangent
            stiffness.
    """
    weighted_ends = [pull.platform_point * pull.force_density for pull in pulls]
    ends = _sum(weighted_ends)
    starts = _sum([pull.base_point * pull.force_density for pull in pulls])
    # S, the sum of c a b^T: its antisymmetric part is the moment, and the whole says how the moment turns.
    pairs = [(a.components(), pull.base_point.components()) for a, pull in zip(weighted_ends, pulls, strict=True)]
    outer = [[total([a[i] * b[j] for a, b in pairs]) for j in range(3)] for i in range(3)]
    moment = [outer[i][j] - outer[j][i] for i, j in ((1, 2), (2, 0), (0, 1))]
    trace, density = outer[0][0] + outer[1][1] + outer[2][2], total([pull.force_density for pull in pulls])
    # The weighted dyads, and the geometric part [tr(S) 1 - S, [sum c b]x; -[sum c a]x, (sum c) 1].
    decrease = sum_of_dyads(pulls, weights)[None]
    for i in range(3):
        for j in range(3):
            decrease[0, i, j] = decrease[0, i, j] + (trace if i == j else 0.0) - outer[i][j]
        decrease[0, 3 + i, 3 + i] = decrease[0, 3 + i, 3 + i] + density
    decrease[:, :3, 3:] = decrease[:, :3, 3:] + skew_of(of_scalars(starts.components()))
    decrease[:, 3:, :3] = decrease[:, 3:, :3] - skew_of(of_scalars(ends.components()))
    return of_scalars([*moment, *(starts - ends).components()]), decrease


def _sum(vectors: Sequence[Vector]) -> Vector:
    """Return the sum of vectors, component by component; zero of none."""
    if not vectors:
        return ZERO
    return Vector(*(total(list(parts)) for parts in zip(*(v.components() for v in vectors), strict=True)))


def sum_of_dyads(pulls: Sequence[RodPull], weights: Row) -> Array:
    """The weighted sum of the dyads of all lines [6 x 6]."""
    result = np.zeros((6, 6), dtype=object)
    for i, j in POSITIONS:
        pairs = zip(pulls, weights, strict=True)
        result[i, j] = result[j, i] = total([pull.line[i] * pull.line[j] * weight for pull, weight in pairs])
    return result


def loads_of_rods(
    rods: Sequence[ElasticRod], pulls: Sequence[RodPull], twist: Row, force: Scalar
) -> list[tuple[Spring, Scalar]]:
    """The actuators of rods with their tensions after a step of the platform, to first order, N.

    Args:
        rods, pulls: the rods, and their pulls before the step.
        twist: the step of the platform.
        force: unit of force of the mechanism, N.
    """
    loads = []
    for rod, pull in zip(rods, pulls, strict=True):
        along = inner_product(pull.line, twist)
        tension = pull.tension + pull.elastic_weight * pull.length * along
        loads += [(spring, tension * force) for spring in rod.driven]
    return loads

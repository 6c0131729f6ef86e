"""The equations of equilibrium of a mechanism and their rates: where everything is, what it carries, the rest.

A state is at rest where one potential is stationary: energy of the springs, weight, and the potential of the load,
under the condition that all legs end at the platform. The multipliers of these conditions are the wrenches that the
platform exerts on the legs. Nothing is solved here.

Source: theory (35)-(38). Units, axes and origin are those of `mechanism`.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from kinetostat.algebra.screw import Twist
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array, Integers
from kinetostat.equilibrium.elastic_legs import ElasticLeg
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import PlacedChain, closing_gap
from kinetostat.kinetostatics.loading import DeflectedLink, leg_links
from kinetostat.machine.leg import Leg
from kinetostat.numerics.iteration import largest, with_rows
from kinetostat.numerics.motions import Motions, brackets_by, cross, exponential, logarithm, skew_of, still


@dataclass(frozen=True)
class State:
    """A place of a mechanism with the wrenches on its legs, at n poses.

    Attributes:
        platform: displacement of the platform from the free state.
        coordinates: the coordinates of each leg [n x coordinates].
        wrenches: the wrenches that the platform exerts on each leg, at the origin [n x 6].
        amounts: the amounts by which the actuators are driven from the free state [n x actuators].
    """

    platform: Motions
    coordinates: tuple[Array, ...]
    wrenches: tuple[Array, ...]
    amounts: Array

    def at(self, rows: Integers) -> "State":
        """The state at some of the poses [rows]."""
        return State(
            self.platform.at(rows),
            tuple(values[rows] for values in self.coordinates),
            tuple(values[rows] for values in self.wrenches),
            self.amounts[rows],
        )

    def with_part(self, rows: Integers, part: "State") -> "State":
        """The state with that of some of the poses [rows] in its place."""
        return State(
            self.platform.with_part(rows, part.platform),
            tuple(with_rows(q, rows, values) for q, values in zip(self.coordinates, part.coordinates, strict=True)),
            tuple(with_rows(w, rows, values) for w, values in zip(self.wrenches, part.wrenches, strict=True)),
            with_rows(self.amounts, rows, part.amounts),
        )


def free_state(mechanism: Mechanism) -> State:
    """The state without loads: nothing has moved."""
    count = len(mechanism.length)
    return State(
        still(count),
        tuple(np.zeros((count, leg.size)) for leg in mechanism.legs),
        tuple(np.zeros((count, 6)) for _ in mechanism.legs),
        np.zeros((count, len(mechanism.actuators))),
    )


@dataclass(frozen=True)
class LegTerms:
    """Contribution of a leg to the equations, at n poses.

    Attributes:
        end: displacement of its end.
        rates: twist of its end per unit of each coordinate [n x 6 x coordinates].
        driven: the same per unit of each given amount [n x 6 x amounts].
        loads: the loads in its springs [n x coordinates], 0 of a passive coordinate.
        holding: what is needed along each given amount to keep it, such as the load of an actuator [n x amounts].
        carrying: stiffness of each spring that carries, 0 of those that are slack [n x coordinates].
        residual: residual of the equilibrium of its coordinates [n x coordinates].
        geometric: rates of the residual by the coordinates through weight and wrenches alone [n x c x c].
        by_given: rates of the residual by the given amounts [n x coordinates x amounts].
    """

    end: Motions
    rates: Array
    driven: Array
    loads: Array
    holding: Array
    carrying: Array
    residual: Array
    geometric: Array
    by_given: Array

    def of(self, rows: slice, given: Integers, count: int) -> "LegTerms":
        """The terms of one of several legs [rows], whose amounts have these numbers among `count` of the machine."""

        def of_machine(values: Array) -> Array:
            result = np.zeros((*values[rows].shape[:-1], count))
            result[..., given] = values[rows]
            return result

        return LegTerms(
            end=Motions(self.end.rotation[rows], self.end.translation[rows]),
            rates=self.rates[rows],
            driven=of_machine(self.driven),
            loads=self.loads[rows],
            holding=of_machine(self.holding),
            carrying=self.carrying[rows],
            residual=self.residual[rows],
            geometric=self.geometric[rows],
            by_given=of_machine(self.by_given),
        )


def leg_terms(
    leg: ElasticLeg,
    coordinates: Array,
    wrench: Array,
    amounts: Array,
    gravity: Array,
    placed: PlacedChain | None = None,
    symmetric: bool = False,
) -> LegTerms:
    """Evaluate a leg.

    Args:
        leg: the leg.
        coordinates: the coordinates of the leg [n x coordinates].
        wrench: the wrench that the platform exerts on the leg, at the origin [n x 6].
        amounts: the amounts that are given: of all actuators of the machine, then of its links that grow [n x amounts].
        gravity: acceleration of free fall, m/s² [n x 3].
        placed: the chain of the leg at these coordinates, if it has been placed.
        symmetric: whether `geometric` and `by_given` shall be those of the symmetric part alone.
    """
    placed = placed or leg.chain.place(coordinates, amounts)
    screws = placed.screws
    weight, pulling = _weight(leg, placed.before, screws, gravity)
    change = (_symmetric_change if symmetric else _change)(screws, brackets_by(wrench, screws), pulling)
    follows, drives = leg.chain.follows, leg.chain.follows_given(amounts.shape[1])
    loads = leg.stiffness * coordinates + leg.preload
    stiffness = leg.stiffness
    if leg.sign.any():
        carries = leg.sign * loads >= 0.0
        loads, stiffness = np.where(carries, loads, 0.0), np.where(carries, stiffness, 0.0)
    work = np.einsum("nfc,nc->nf", screws, wrench)
    return LegTerms(
        end=placed.end,
        rates=leg.chain.rates(placed),
        driven=screws.mT @ drives,
        loads=loads,
        holding=(work - weight) @ drives,
        carrying=stiffness,
        residual=loads + (weight - work) @ follows,
        geometric=follows.T @ change @ follows,
        by_given=follows.T @ change @ drives,
    )


def _change(screws: Array, turning: Array, pulling: Array) -> Array:
    """Change of the work of wrench and weight on each motion, by each motion [n x motions x motions].

    A screw changes with the motions before it, and so does the work on it.

    Args:
        screws: the screws of the motions [n x motions x 6].
        turning: brackets of the screws by the wrench [n x motions x 6].
        pulling: the vectors of `_weight`, by which its gradient changes [n x motions x 3].
    """
    weighing = np.tril(np.einsum("njc,nkc->nkj", screws[..., :3], pulling))
    change = -weighing - np.tril(weighing, -1).mT
    return np.asarray(change - np.tril(np.einsum("njc,nkc->nkj", screws, turning), -1))


def _symmetric_change(screws: Array, turning: Array, pulling: Array) -> Array:
    """The symmetric part of `_change`, in fewer operations: traced programs compute half of its entries."""
    by_motion = 0.5 * turning
    by_motion[..., :3] += pulling
    below = np.tril(-np.einsum("njc,nkc->nkj", screws, by_motion), -1)
    diagonal = np.einsum("nkc,nkc->nk", screws[..., :3], pulling)[:, :, None] * np.eye(screws.shape[1])
    return np.asarray(below + below.mT - diagonal)


def _weight(leg: ElasticLeg, placed: Sequence[Motions], screws: Array, gravity: Array) -> tuple[Array, Array]:
    """Gradient of the potential of a leg's weight by its motions [n x motions], and how it changes.

    The second result holds a vector for each motion k [n x motions x 3]. The product of this vector and the axis of a
    motion j nearer to the base is the fall of k's gradient per unit of j, and of j's gradient per unit of k.
    """
    count, motions = screws.shape[:2]
    kind = np.result_type(screws, gravity, leg.masses.mass)
    first, mass = np.zeros((count, motions, 3), dtype=kind), np.zeros((count, motions, 1), dtype=kind)
    for i, carried in enumerate(leg.masses.carried):
        moment = placed[carried].point(leg.masses.point[:, i]) * leg.masses.mass[:, i, None]
        first[:, :carried] += moment[:, None]
        mass[:, :carried] += leg.masses.mass[:, i, None, None]
    moving = cross(screws[..., :3], first) + mass * screws[..., 3:]
    # Of two motions, the one nearer to the base turns the path on which the other one moves the masses.
    return -np.einsum("nc,nfc->nf", gravity, moving), cross(moving, gravity[:, None])


def platform_load(mechanism: Mechanism, platform: Motions) -> tuple[Array, Array]:
    """The load on the platform at the origin [n x 6], and its change by a twist of the platform [n x 6 x 6].

    Forces keep their direction and go with their points; the moment keeps its axis.
    """
    count = len(mechanism.length)
    wrench = np.concatenate([mechanism.wrench[:, :3], np.zeros((count, 3))], axis=1)
    change = np.zeros((count, 6, 6))
    for point, force in _platform_forces(mechanism):
        at, across = platform.point(point), skew_of(force)
        wrench = wrench + np.concatenate([cross(at, force), force], axis=1)
        turning = np.concatenate([across @ skew_of(at), -across], axis=2)
        change = change + np.concatenate([turning, 0.0 * turning], axis=1)
    return wrench, change


def _platform_forces(mechanism: Mechanism) -> Iterator[tuple[Array, Array]]:
    """The points of the platform at which forces act, in the free state, and these [n x 3]; the tool point first."""
    others, masses = (np.swapaxes(p, 0, 1) for p in (mechanism.pushed, mechanism.platform.point))
    weights = mechanism.platform.mass.T[:, :, None] * mechanism.gravity[None]
    points = [np.zeros((len(mechanism.length), 3)), *others, *masses]
    return zip(points, [mechanism.wrench[:, 3:], *np.swapaxes(mechanism.forces, 0, 1), *weights], strict=True)


def potential(mechanism: Mechanism, state: State, before: Motions) -> Array:
    """The potential of springs, weights and loads where all legs are closed, up to a constant [n].

    Its slope is continuous where a spring that only pulls goes slack. The moment of the load keeps its axis, which no
    potential does; what counts is its work on the way from the placement `before`, by a turn about one axis.

    Source: theory section 12.
    """
    turn = logarithm(state.platform @ before.inverse())[:, :3]
    result = -np.einsum("nc,nc->n", mechanism.wrench[:, :3], turn)
    for point, force in _platform_forces(mechanism):
        result -= np.einsum("nc,nc->n", force, state.platform.point(point) - point)
    amounts = mechanism.given_amounts(state.amounts)
    for leg, coordinates in zip(mechanism.legs, state.coordinates, strict=True):
        loads = leg.stiffness * coordinates + leg.preload
        energy = 0.5 * (loads + leg.preload) * coordinates
        if leg.sign.any():
            stiffness = np.where(leg.sign == 0.0, 1.0, leg.stiffness)
            energy = np.where(leg.sign == 0.0, energy, 0.5 * np.maximum(leg.sign * loads, 0.0) ** 2 / stiffness)
        result += energy.sum(axis=1)
        if leg.masses.carried:
            placed = leg.chain.place(coordinates, amounts).before
            for i, carried in enumerate(leg.masses.carried):
                force, point = mechanism.gravity * leg.masses.mass[:, i, None], leg.masses.point[:, i]
                result -= np.einsum("nc,nc->n", force, placed[carried].point(point) - point)
    return result


@dataclass(frozen=True)
class Balance:
    """The equations at a state; unknown are the twist of the platform, and of each leg its coordinates and wrench.

    Attributes:
        mechanism: the mechanism.
        state: the place of everything, and the wrenches of the legs.
        legs: what each leg contributes.
        residual: residuals of the equations, 0 at rest [n x unknowns].
        load: the load on the platform at the origin [n x 6].
        load_change: change of this load by a twist of the platform [n x 6 x 6].
    """

    mechanism: Mechanism
    state: State
    legs: tuple[LegTerms, ...]
    residual: Array
    load: Array
    load_change: Array

    def platform_rates(self, loaded: bool = True) -> Array:
        """Rates of the platform's equations by its twist [n x ways x ways].

        Args:
            loaded: whether to count what loads and wrenches do by turning; otherwise springs alone resist.
        """
        ways = self.mechanism.ways
        rates = -ways.T @ self.load_change @ ways
        return rates if loaded else np.zeros_like(rates)

    def leg_rates(self, number: int, loaded: bool = True) -> Array:
        """Rates of a leg's equations by its coordinates and its wrench [n x m x m]; `loaded` as for the platform.

        Its wrench enters the platform's equations, and the platform's twist those of its closure, as it is.
        """
        leg, terms, ways = self.mechanism.legs[number], self.legs[number], self.mechanism.ways
        across = ways.T @ terms.rates
        result = np.zeros((len(across), leg.size + ways.shape[1], leg.size + ways.shape[1]))
        inner = terms.carrying[:, :, None] * np.eye(leg.size) + leg.idle @ leg.idle.mT
        result[:, : leg.size, : leg.size] = inner + terms.geometric if loaded else inner
        result[:, : leg.size, leg.size :] = -across.mT
        result[:, leg.size :, : leg.size] = across
        return result

    def by_actuators(self) -> Array:
        """Rates of the equations by the amounts of the actuators [n x unknowns x actuators]."""
        ways, places = self.mechanism.ways, self.mechanism.unknown_places
        count = self.state.amounts.shape[1]
        result = np.zeros((len(self.residual), places.count, count))
        for terms, coordinates, wrench in zip(self.legs, places.coordinates, places.wrenches, strict=True):
            result[:, coordinates] = terms.by_given[:, :, :count]
            result[:, wrench] = ways.T @ terms.driven[:, :, :count]
        return result


def state_after(mechanism: Mechanism, state: State, step: Array) -> State:
    """Return the state after a step of the unknowns [n x unknowns]."""
    ways, places = mechanism.ways, mechanism.unknown_places
    return State(
        platform=exponential(step[:, places.platform] @ ways.T) @ state.platform,
        coordinates=tuple(
            before + step[:, part] for before, part in zip(state.coordinates, places.coordinates, strict=True)
        ),
        wrenches=tuple(
            before + step[:, part] @ ways.T for before, part in zip(state.wrenches, places.wrenches, strict=True)
        ),
        amounts=state.amounts,
    )


def motion_of(mechanism: Mechanism, step: Array) -> Array:
    """Return the largest motion in a step of the unknowns, rad and units of the length [n]."""
    return largest(step[:, mechanism.unknown_places.motions])


def balance(mechanism: Mechanism, state: State) -> Balance:
    """Evaluate the equations of equilibrium at a state."""
    ways = mechanism.ways
    load, load_change = platform_load(mechanism, state.platform)
    placed_legs = _placed_legs(mechanism, state)
    carried = sum(state.wrenches, np.zeros_like(load))
    of_legs = [part for leg in placed_legs for part in (leg.terms.residual, -leg.gap @ ways)]
    return Balance(
        mechanism=mechanism,
        state=state,
        legs=tuple(leg.terms for leg in placed_legs),
        residual=np.concatenate([(carried - load) @ ways, *of_legs], axis=1),
        load=load,
        load_change=load_change,
    )


class _PlacedLeg(NamedTuple):
    """Contribution of a leg to the equations, and the screw by which its end misses the platform [n x 6]."""

    terms: LegTerms
    gap: Array


def _placed_legs(mechanism: Mechanism, state: State) -> list[_PlacedLeg]:
    """Place all legs at a state; legs of one form are evaluated together."""
    poses, amounts = len(mechanism.length), mechanism.given_amounts(state.amounts)
    by_number: dict[int, _PlacedLeg] = {}
    for legs in mechanism.like_legs:
        count = len(legs.numbers)
        driven = np.concatenate([amounts[:, given] for given in legs.given])
        coordinates, wrenches = (
            np.concatenate([values[number] for number in legs.numbers])
            for values in (state.coordinates, state.wrenches)
        )
        together = leg_terms(legs.leg, coordinates, wrenches, driven, np.tile(mechanism.gravity, (count, 1)))
        gaps = closing_gap(state.platform.at(np.tile(np.arange(poses), count)), together.end)
        for place, number in enumerate(legs.numbers):
            rows = slice(poses * place, poses * (place + 1))
            by_number[number] = _PlacedLeg(together.of(rows, legs.given[place], amounts.shape[1]), gaps[rows])
    return [by_number[number] for number in range(len(mechanism.legs))]


def loaded_links(equations: Balance, legs: tuple[Leg, ...], origin: Vector) -> tuple[DeflectedLink, ...]:
    """All links of a machine at one pose, with the exact motions of their ends.

    Args:
        equations: the equations at the state of rest of one pose.
        legs: the legs of the machine without loads.
        origin: its tool point there, m.
    """
    mechanism, state = equations.mechanism, equations.state
    length = float(mechanism.length[0])
    links: list[DeflectedLink] = []
    given = mechanism.given_amounts(state.amounts)
    for leg, elastic, coordinates in zip(legs, mechanism.legs, state.coordinates, strict=True):
        placed = elastic.chain.place(coordinates, given).before
        bodies = [placed[number] for number in elastic.motion_counts]
        links += leg_links(leg, partial(_point_motion, bodies, origin, length))
    return tuple(links)


def _point_motion(bodies: Sequence[Motions], origin: Vector, length: float, body: int, point: Vector) -> Twist:
    """Motion of a point (m) of one of the bodies, rad and m."""
    start = np.array([(point - origin).components()], dtype=float) / length
    rotation = Vector(*bodies[body].amounts()[0, :3].tolist())
    return Twist(rotation, Vector(*(length * (bodies[body].point(start) - start))[0].tolist()))

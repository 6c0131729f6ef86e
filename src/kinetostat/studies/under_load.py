"""A machine at rest under its loads: displacement of its tool, loads of its springs, stiffness and stability.

The equations are in `equilibrium`; the command is `analyze --loaded`.
"""

import math
from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

import numpy as np

from kinetostat.algebra.screw import Twist
from kinetostat.algebra.symmetric import SIZE
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.balance import Balance, balance, free_state, loaded_links
from kinetostat.equilibrium.limit import LoadLimit, Strut
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.equilibrium.solving import Rest, Stability, at_rest, newton_step, with_share
from kinetostat.equilibrium.state import AnswerInState, MachineState, state_of
from kinetostat.equilibrium.tangent import elastic_stiffness, platform_compliance, stiffness_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.limits import Check, limit_use, load_checks, why_beyond, within
from kinetostat.kinematics.mobility import describe
from kinetostat.kinematics.status import PLACELESS, REGULAR, Status
from kinetostat.kinetostatics.indices import free_stiffnesses
from kinetostat.kinetostatics.loading import DeflectedLink
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.limits import About
from kinetostat.machine.machine import Machine, springs
from kinetostat.spec.arguments import checked
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.studies.attribution import Softest, softest
from kinetostat.studies.cleaning import clean_matrix, clean_screw, clean_statics
from kinetostat.tolerances import LEAST_DIVISOR, ROUND_OFF_OF_ENTRY, UNMOVED_TOOL

ADVICE = "Reduce the load, stiffen what moves, or preload what only pulls."
"""The last sentence about a machine that does not stand."""
CURVE_SHARES = tuple(i / 12 for i in range(16))
"""Shares of the loads at which a curve is drawn: up to 125 %, so that it shows what a little more load would do."""
LEAST_NAMED_MOTION = 0.5
"""Share of the largest motion above which a leg is named among those that move."""


@dataclass(frozen=True)
class SpringState:
    """A spring at rest under load.

    Attributes:
        name, leg: name of the spring and of its leg.
        turning: whether it is a torsion spring: N·m and rad, otherwise N and m.
        actuated: whether it is an actuator.
        load: force or moment that it carries, positive where it pulls its ends together.
        deformation: its deformation from the free state.
        slack: whether it can only pull or only push, would have to do the other, and so carries nothing.
    """

    name: str
    leg: str
    turning: bool
    actuated: bool
    load: float
    deformation: float
    slack: bool


@dataclass(frozen=True, eq=False)
class LoadedState(AnswerInState):
    """A machine at rest under gravity, its preload and its table [load]; base axes, at the loaded tool point, SI.

    Attributes:
        state: the machine's state, at the pose that it has without loads.
        rest: the verdict: no rest, unstable springs or a strut that buckles, beyond a limit (loads of actuators at rest
            among them), or ok.
        reason: why there is no state of rest; empty where there is one.
        components: names of rows and columns: rx ry rz x y z, or rz x y.
        displacement: rotation vector (rad) and displacement of the tool point (m), from the unloaded pose [n]; empty
            where it comes to no rest.
        linear: the displacement to first order, C w with all weights [n]; None where C is not finite.
        springs: all springs that deform.
        slack_legs: names of the legs in which a spring is slack.
        elastic, tangent: stiffness of the springs alone at rest, and stiffness against further loads, to which also
            the loads add by turning [n x n]; infinite where rigid parts hold a component, None where they hold all.
        compliance: inverse of the tangent stiffness.
        factor: factor by which the loads may grow in proportion until the springs are unstable; infinite if no growth
            makes them so, None where springs alone hold nothing. Without a state of rest, the share of the loads up to
            which there is one.
        mode: small motion of the tool point when it becomes unstable, of any size, rad and m.
        mode_legs: the legs that move most in that motion.
        struts: compression of each strut whose E I is known, and Euler's load at which it buckles.
        residual: largest residual of the equations, as a share of what the load and the legs carry.
        links: links of all legs, with the exact motions of their ends.
        requirements: verdicts on the requirements of the machine's file, if these were judged.
    """

    state: MachineState
    rest: Rest
    reason: str
    components: tuple[str, ...]
    displacement: Array = field(default_factory=lambda: np.zeros(0))
    linear: Array | None = None
    springs: tuple[SpringState, ...] = ()
    slack_legs: tuple[str, ...] = ()
    elastic: Array | None = None
    tangent: Array | None = None
    compliance: Array | None = None
    factor: float | None = None
    mode: Array = field(default_factory=lambda: np.zeros(0))
    mode_legs: tuple[str, ...] = ()
    struts: tuple[Strut, ...] = ()
    residual: float = 0.0
    links: tuple[DeflectedLink, ...] = ()
    requirements: tuple[Any, ...] = ()

    @cached_property
    def message(self) -> str:
        """Sentences on what is special about the state of rest, or the reason why there is none."""
        return self.reason or _about_rest_and_limits(self)

    @property
    def snapped(self) -> bool:
        """Whether the springs are stable, but the machine has snapped over to this state while the loads grew."""
        state = self.state
        return self.has_rest and state.stands and state.limit is not None and state.limit.is_passed

    @property
    def loaded(self) -> bool:
        """Whether anything loads the machine: its tool moves, or a spring carries something."""
        return bool(self.displacement.any()) or any(spring.load for spring in self.springs)

    @property
    def has_rest(self) -> bool:
        """Whether it comes to rest at all, stable or not."""
        return len(self.displacement) > 0

    @property
    def tool_motion(self) -> tuple[float, float]:
        """The displacement of the tool point, m, and the rotation of the platform, rad, that the loads cause."""
        rotations = sum(name.startswith("r") for name in self.components)
        return math.hypot(*self.displacement[rotations:]), math.hypot(*self.displacement[:rotations])

    @property
    def limit_use(self) -> float | None:
        """Greatest share that any actuator uses of the limit of its load; None where the file limits none."""
        state = self.state
        return max(map(float, limit_use(state.machine, state.configuration, state.actuator_loads)), default=None)

    @property
    def softest(self) -> dict[str, Softest]:
        """Direction in which further loads meet the least stiffness, of "translation" and of "rotation".

        What makes it soft are the shares of the parts in the compliance that springs alone have along this direction
        at the unloaded pose; none where they do not hold the machine.
        """
        if self.compliance is None:
            return {}
        free = self.state.free
        if int(free.status) not in REGULAR:
            known_springs, statics = [], replace(free.statics, flexibility=(), compliance=())
        else:
            known_springs, statics = springs(free.configuration), clean_statics(free.statics)
        blocks = free_stiffnesses(self.tangent, self.compliance, self.machine.family.components) or {}
        weakest = {name: softest(block, name, known_springs, statics) for name, block in blocks.items()}
        return {name: _with_shares_of_springs(way) for name, way in weakest.items() if way is not None}

    def __repr__(self) -> str:
        return f"<{self.machine.name!r} under load: {self.rest.word}>"


def _with_shares_of_springs(direction: Softest) -> Softest:
    """Return the direction with the shares of springs alone, scaled to add up to 1; tension and weight are left out."""
    total = sum(share for _, share in direction.shares) or 1.0
    shares, kinds = (tuple((n, share / total) for n, share in row) for row in (direction.shares, direction.kinds))
    return replace(direction, shares=shares, kinds=kinds)


@checked
def under_load(machine: Machine | MachineState) -> LoadedState:
    """Find the state in which a machine is at rest under its loads, with exact geometry.

    The free state is the machine at its pose with relaxed springs. Loads are the wrench of [load], the weight of all
    masses that are known under `load.gravity`, and preloads. A spring that only pulls or only pushes carries nothing
    where it would have to do the other.

    Args:
        machine: the machine with its pose and loads; or its state, as `state_of` returns it.

    Raises:
        InputError: there is gravity but no mass in the file, or bounds of tensions contradict each other.
    """
    state = state_of(machine)
    names = state.machine.family.component_names
    if int(state.free.status) in PLACELESS:
        return LoadedState(state, Rest.NO_REST, state.refusal, names)
    if state.free.undecided:
        return LoadedState(state, Rest.UNDECIDED, Status.UNDECIDED.sentence, names)
    if not state.balanced[0]:
        return LoadedState(state, Rest.NO_REST, why_no_tensions(state.machine), names)
    if state.at_rest is None or state.stability is None:
        return _without_rest(state)
    return _answer_at_rest(state, state.at_rest, state.stability)


@dataclass(frozen=True, eq=False)
class LoadCurve(ImmutableAnswer):
    """Displacement of the tool and loads of the springs of a preloaded machine while its loads grow in proportion.

    Attributes:
        shares: shares of the loads.
        displacement: rotation vector (rad) and displacement of the tool point (m), components of the machine
            [shares x components]; NaN where it comes to no rest.
        springs: names of the springs.
        loads: force or moment of each spring [shares x springs], N or N·m.
    """

    shares: Array
    displacement: Array
    springs: tuple[str, ...]
    loads: Array


def load_curve(machine: Machine | MachineState, shares: Sequence[float] = CURVE_SHARES) -> LoadCurve:
    """Follow the state of rest while the loads grow, each share from the one before.

    Args:
        machine: the machine with all of its loads, or its state.
        shares: shares of the loads, from the least to the greatest.

    Raises:
        InputError: as for `under_load`.
    """
    start = state_of(machine)
    mechanism = start.mechanism
    places, last = list(start.machine.family.components), free_state(mechanism)
    displacements, loads = [], []
    for share in shares:
        solution = at_rest(with_share(mechanism, share, preload=1.0), last)
        springs_at_rest, state_at_rest = _spring_states(solution.balance), solution.balance.state
        one_or_nan, last = (1.0, state_at_rest) if solution.settled[0] else (math.nan, last)
        displacements.append(one_or_nan * _in_si(mechanism, state_at_rest.platform.amounts()[0], places))
        loads.append([one_or_nan * spring.load for spring in springs_at_rest])
    names = tuple(spring.name for spring in springs_at_rest)
    return LoadCurve(np.array(shares), np.array(displacements), names, np.array(loads))


def _answer_at_rest(state: MachineState, equations: Balance, stability: Stability) -> LoadedState:
    """Return the answer for a machine that comes to rest, whether its rest is stable or not."""
    machine, response = state.machine, state.free
    mechanism, places = equations.mechanism, list(machine.family.components)  # places in rx ry rz x y z
    units, square = mechanism.twist_units[0], np.ix_(places, places)
    all_compliances = platform_compliance(equations)
    compliances = (all_compliances * mechanism.compliance_units)[0][square]
    springs_alone = (elastic_stiffness(equations, all_compliances) / mechanism.compliance_units)[0][square]
    stays = stability.stable and not any(strut.bends_away for strut in state.struts)
    rest_within_limits = Rest.OK if within(_limits_at_rest(state)) else Rest.JOINT_LIMIT
    return LoadedState(
        state=state,
        rest=rest_within_limits if stays else Rest.UNSTABLE,
        reason="",
        components=machine.family.component_names,
        displacement=_in_si(mechanism, equations.state.platform.amounts()[0], places),
        linear=_linear(response, mechanism, places),
        springs=tuple(_spring_states(equations)),
        slack_legs=_slack_legs(equations),
        elastic=_clean_stiffness(springs_alone),
        tangent=_clean_stiffness(stiffness_of(compliances[None])[0]),
        compliance=np.array(clean_matrix(compliances.tolist())),
        factor=None if math.isnan(stability.factor) else stability.factor,
        mode=(stability.mode * units)[places],
        mode_legs=tuple(moving_legs(equations, stability)) if math.isfinite(stability.factor) else (),
        struts=state.struts,
        residual=float(np.abs(equations.residual).max() / _largest_wrench(equations)),
        links=loaded_links(equations, response.configuration.legs, response.reference),
    )


def _about_rest_and_limits(answer: LoadedState) -> str:
    """Say what is special about a state of rest, and beyond which limits it is."""
    state, stability = answer.state, answer.state.stability
    checks = _limits_at_rest(state)
    beyond_limits = [] if within(checks) else [why_beyond(checks, answer.machine.display)]
    about = [] if stability is None else [about_rest(state, stability, answer.slack_legs)]
    return " ".join([*about, *beyond_limits])


def _limits_at_rest(state: MachineState) -> list[Check]:
    """The limits of geometry at the pose, and those of actuators' loads compared with the loads at rest."""
    at_the_pose = [check for check in state.free.checks if check.limit.about is not About.LOAD]
    return [*at_the_pose, *load_checks(state.machine, state.configuration, state.actuator_loads)]


def _largest_wrench(equations: Balance) -> float:
    """The largest component of the load, of what the legs carry (it may be preload alone), and of thermal growth.

    Above 0, so that a machine on which nothing acts has the residual 0.
    """
    sizes = (equations.load, *equations.state.wrenches, equations.mechanism.growth)
    return float(max(np.abs(size).max(initial=LEAST_DIVISOR) for size in sizes))


def _spring_states(equations: Balance) -> list[SpringState]:
    """All springs that deform, leg by leg."""
    mechanism, coordinates = equations.mechanism, equations.state.coordinates
    length, force = float(mechanism.length[0]), float(mechanism.force[0])
    states = []
    for leg, terms, amounts in zip(mechanism.legs, equations.legs, coordinates, strict=True):
        for i, spring in enumerate(leg.springs):
            if spring is None:
                continue
            turning, amount = spring.joint.point is not None, float(amounts[0, i])
            states.append(
                SpringState(
                    name=spring.name,
                    leg=leg.name,
                    turning=turning,
                    actuated=bool(spring.actuated),
                    load=float(terms.loads[0, i]) * force * (length if turning else 1.0),
                    deformation=0.0 if abs(amount) < UNMOVED_TOOL else amount * (1.0 if turning else length),
                    slack=bool(leg.sign[i]) and terms.carrying[0, i] == 0.0,
                )
            )
    return states


def _linear(response: Response, mechanism: Mechanism, places: list[int]) -> Array | None:
    """The displacement to first order: one step of Newton's method from the free state; None where C is not finite."""
    entries = np.array(response.compliance.rows(), dtype=float)
    if int(response.status) not in REGULAR or not np.isfinite(entries).all():
        return None
    step = newton_step(balance(mechanism, free_state(mechanism)), loaded=False)[0]
    return _in_si(mechanism, mechanism.ways @ step[mechanism.unknown_places.platform], places)


def _in_si(mechanism: Mechanism, twist: Array, places: list[int]) -> Array:
    """Components of a displacement in rad and m, those at some places in rx ry rz x y z; round-off is set to zero."""
    numbers = np.where(np.abs(twist) < UNMOVED_TOOL, 0.0, twist).tolist()
    cleaned = clean_screw(Twist(Vector(*numbers[:3]), Vector(*numbers[3:])), 1.0).components()
    return np.array(cleaned)[places] * mechanism.twist_units[0, places]


def _clean_stiffness(stiffness: Array) -> Array | None:
    """A stiffness without round-off; None if no component has a finite stiffness.

    The entries of a direction in which springs hold nothing are round-off beside those of the others of its kind.
    """
    diagonal = np.abs(np.diag(stiffness))
    finite = np.isfinite(diagonal)
    if not finite.any() or not np.isfinite(stiffness[np.ix_(finite, finite)]).all():
        return None
    turning = np.arange(len(stiffness)) < (SIZE // 2 if len(stiffness) == SIZE else 1)
    largest = np.sqrt([diagonal[finite & (turning == kind)].max(initial=0.0) for kind in turning])
    negligible = np.abs(stiffness) < ROUND_OFF_OF_ENTRY * np.outer(largest, largest)
    return np.array(clean_matrix(np.where(negligible, 0.0, stiffness).tolist()))


def _without_rest(state: MachineState) -> LoadedState:
    """The answer for a machine that comes to no rest: its last state of rest while the loads grew."""
    family, limit = state.machine.family, state.limit
    names, places, message = family.component_names, list(family.components), why_no_rest(state.machine, limit)
    if limit is None:
        return LoadedState(state, Rest.NO_REST, message, names)
    mode = (limit.stability.mode * state.mechanism.twist_units[0])[places]
    legs = moving_legs(limit.balance, limit.stability) if mode.any() else []
    return LoadedState(state, Rest.NO_REST, message, names, factor=limit.share, mode=mode, mode_legs=tuple(legs))


def about_rest(state: MachineState, stability: Stability, slack: Sequence[str]) -> str:
    """Say what is special about a state of rest.

    Args:
        state: the state of a machine that is at rest.
        stability: the stability of its springs there.
        slack: names of legs in which a spring carries nothing.
    """
    sentences = [*_about_stability(stability, state.limit)]
    if slack:
        sentences.append(f"Slack, so that they carry nothing: {', '.join(slack)}.")
    bent = sorted((strut for strut in state.struts if strut.bends_away), key=lambda strut: strut.factor)
    if bent:
        sentences.append(_bends_away(state.machine, bent[0], len(bent) - 1))
    return " ".join(sentences) or "At rest and stable."


def _about_stability(stability: Stability, limit: LoadLimit | None) -> list[str]:
    """A sentence if the machine is unstable, or has passed an unstable state, and how it gives way there; else none."""
    if not stability.stable:
        stands = how_it_gives_way(limit)
        return [f"The machine is not stable under this load: the least disturbance moves it away. {stands} {ADVICE}"]
    if limit is None or not limit.is_passed:
        return []
    return [f"The machine has snapped over to another state on the way. {how_it_gives_way(limit)}"]


def _bends_away(machine: Machine, strut: Strut, others: int) -> str:
    """Say that a strut, and so many others, are pressed with more than Euler's load, which the springs do not know."""
    show, more = machine.display.show, f" (and {others} more)" if others else ""
    return (
        f"Strut {strut.name} bends away{more}: it is pressed with {show(strut.compression, 'N')}, and Euler's load of "
        f"a column of {show(strut.length, 'm')} between two hinges is {show(strut.euler_load, 'N')}. Make it shorter "
        "or its cross-section stiffer."
    )


def why_no_rest(machine: Machine, limit: LoadLimit | None) -> str:
    """Say that a machine comes to no rest under its loads, and under which share of them it stood last."""
    return f"{machine.name} comes to no rest under this load. {how_it_gives_way(limit)} {ADVICE}"


def why_no_tensions(machine: Machine) -> str:
    """Say that no tensions within the bounds of [load] hold the load."""
    load, show = machine.tables["load"], machine.display.show
    least = 0.0 if math.isinf(load.min_tension) else load.min_tension
    upper = "or more" if math.isinf(load.max_tension) else f"to {show(load.max_tension, 'N')}"
    return (
        f"No tensions of {show(least, 'N')} {upper} hold this load at the pose of {machine.name}; change the bounds "
        "load.min_tension and load.max_tension, the load, or the pose."
    )


def how_it_gives_way(limit: LoadLimit | None) -> str:
    """Say up to which share of its loads a machine stands, by which motion it gives way, and what is slack then.

    Args:
        limit: limit of the loads of the machine; None if no share of its loads was found under which it stands.
    """
    if limit is None:
        return "No share of it was found under which it stands."
    stability = limit.stability
    mode = describe((stability.mode * limit.balance.mechanism.twist_units[0]).tolist(), ("rad", "m"))
    slack, legs = _slack_legs(limit.balance), moving_legs(limit.balance, stability)
    motion = f"a motion like {mode} at the tool, most of all in {', '.join(legs)}"
    by = f", and then gives way by {motion}" if stability.mode.any() else ""
    what = f" Slack there: {', '.join(slack)}." if slack else ""
    least = "at least " if limit.is_lower_bound else ""
    return f"It stands up to {least}{limit.share:.3g} times this load{by}.{what}"


def moving_legs(equations: Balance, stability: Stability) -> list[str]:
    """The legs that move most when a state gives way, and those that move at least half as much."""
    legs = zip(equations.mechanism.legs, stability.legs, strict=True)
    return [leg.name for leg, size in legs if size > LEAST_NAMED_MOTION * max(stability.legs)]


def _slack_legs(equations: Balance) -> tuple[str, ...]:
    """The legs in which a spring is slack."""
    pairs = zip(equations.mechanism.legs, equations.legs, strict=True)
    return tuple(leg.name for leg, terms in pairs if ((leg.sign != 0.0) & (terms.carrying[0] == 0.0)).any())

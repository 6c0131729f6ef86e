"""Everything about a tilting machine over its elevation: sag, frequency, forces, reversals, errors, corrections.

A telescope or a rotary table tilts, and gravity turns in its base. At an elevation of 90 degrees gravity acts as the
file says; at any other, `load.gravity_angle` is 90 degrees minus the elevation. The states at rest, the error budget
and the corrections are those of their own questions; what is here are the reversals and the answer that holds all.

A load reverses where gravity turns the force between two parts around, so that they cross the clearance or the backlash
between them. To first order the reaction of a joint or a drive is what the load does per unit of its free motion
(virtual work), and over the angle of gravity it is a + b cos + c sin, exactly: the load is so, and the drawn machine
stays where it is. So three angles or more give the whole curve, and with it the angle at which it passes zero.

Source: theory (46) and (51), and theory section 12.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kinetostat.accuracy.model import ErrorModel, error_model
from kinetostat.accuracy.toleranced_parts import greatest_work, toleranced_parts
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.engine.batch import Progress, evaluate, silent
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.numbers import loaded_numbers
from kinetostat.equilibrium.state import AnswerInState, MachineState, state_of, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.limits import limit_use
from kinetostat.kinematics.status import REGULAR, Status
from kinetostat.kinetostatics.drive_limits import driven_springs, unseen_backlash
from kinetostat.machine.actuators import name_of
from kinetostat.machine.loading import changed
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity, parse_range
from kinetostat.studies.budget import Budget, budget
from kinetostat.studies.corrections import GRAVITY_ANGLE, CorrectionTable, correction_table
from kinetostat.studies.requirements import Verdict, requirements
from kinetostat.tolerances import NO_REACTION, ROUND_OFF_OF_ENTRY

UPRIGHT = math.pi / 2.0
"""Elevation at which gravity acts as the file says."""
USUAL_RANGE = "0 deg:90 deg:7"
"""Elevations of a telescope, from the horizon to the zenith."""
LEAST_POINTS, MOST_POINTS = 3, 1000
"""Number of elevations: three give a curve a + b cos + c sin, and more than a thousand are a slip of the pen."""
FREQUENCY = "loaded_frequency_1"
"""Name of the first natural frequency about the state at rest."""
DIGITS_OF_ELEVATION = 9
"""Decimals, rad, in which elevations at which parts of a leg reverse are compared: the same ones are one reversal."""
ANSWERS_BEFORE_REQUIREMENTS = 4
"""Questions that are answered at all elevations together: states at rest, frequencies, corrections and budget."""


@dataclass(frozen=True)
class Reversal:
    """Parts of a leg between which the load reverses at an elevation.

    Attributes:
        elevation: the elevation, rad.
        leg: name of the leg.
        parts: joints and drives of the leg that reverse there.
        jump: motion of the tool point while they cross their clearances and backlash, m; None where the file gives
            none of these.
        turn: rotation of the platform meanwhile, rad; None where `jump` is None.
    """

    elevation: float
    leg: str
    parts: tuple[str, ...]
    jump: float | None
    turn: float | None


@dataclass(frozen=True, eq=False)
class Elevation(AnswerInState):
    """A machine at rest under its loads over the elevation, base axes, SI.

    Attributes:
        state: the state of the machine as it stands upright.
        status: OK if every elevation has a result within the limits; otherwise that of the first elevation without a
            result, or, where only limits are passed, `JOINT_LIMIT`.
        message: the elevations without a result, with the reasons; empty where all have one.
        elevations: the elevations, rad [n].
        statuses: `Status` codes [n].
        components: names of the components of the displacement.
        displacement: rotation vector and displacement of the tool point [n x components]; NaN without rest.
        frequency: first natural frequency about the state at rest, Hz [n].
        actuators: names of what is driven.
        turning: whether each is rotary: N·m, otherwise N.
        loads: load of each actuator, positive where it is pulled open [n x actuators].
        limit_use: the greatest share that any actuator uses of its limit [n]; NaN where the file limits none.
        reversals: reversals of the loads of drives and joints, by elevation.
        budget: the error by tolerances at each elevation; None where the file has no tolerances.
        corrections: corrections of the actuators, with their law over `load.gravity_angle`.
        requirements: verdicts on the requirements of the file, each at the elevation that is worst for it.
    """

    state: MachineState
    status: Status
    message: str
    elevations: Array
    statuses: Integers
    components: tuple[str, ...]
    displacement: Array
    frequency: Array
    actuators: tuple[str, ...]
    turning: tuple[bool, ...]
    loads: Array
    limit_use: Array
    reversals: tuple[Reversal, ...]
    budget: Budget | None
    corrections: CorrectionTable
    requirements: tuple[Verdict, ...] = ()

    def __repr__(self) -> str:
        return f"<Elevation of {self.machine.name!r}: {len(self.elevations)} elevations>"

    @property
    def sag(self) -> Array:
        """Displacement of the tool point by the loads, m [n]."""
        return np.asarray(np.linalg.norm(self.displacement[:, ~self._rotations], axis=1))

    @property
    def rotation(self) -> Array:
        """Rotation of the platform by the loads, rad [n]."""
        return np.asarray(np.linalg.norm(self.displacement[:, self._rotations], axis=1))

    @property
    def error(self) -> Array:
        """Error of the tool point that 95 % of all machines keep within, m [n]; NaN without tolerances."""
        none = np.full(len(self.elevations), np.nan)
        return none if self.budget is None else self.budget.size("usual", "position")

    @property
    def _rotations(self) -> Mask:
        return np.array([name.startswith("r") for name in self.components])


@checked
def elevation(
    machine: Machine | MachineState,
    over: str = USUAL_RANGE,
    about: Sequence[float] = (),
    tolerance: float | str | None = None,
    progress: Progress = silent,
) -> Elevation:
    """Compute what gravity does to a machine over its elevation, and what takes it away.

    The machine is at rest under all its loads, whether its file says `state = "loaded"` or not.

    Args:
        machine: the machine with its loads, gravity and masses among them, or its state, as `state_of` returns it.
        over: range of elevations, "0 deg:90 deg:7" for instance; gravity acts as the file says at 90 deg.
        about: axis of the base about which gravity turns in it as the elevation falls; `load.gravity_axis` if empty.
        tolerance: greatest error of the law of the corrections at the tool, m or text with a unit; a thousandth of the
            error without corrections if None.
        progress: receives how far the work is.

    Raises:
        InputError: no gravity or nothing that weighs, a bad range or axis, or what `correction_table` and `budget`
            refuse.
    """
    upright = _upright_machine(state_of(machine).machine, about)
    elevations = _elevations(over)
    count, angles = len(elevations), UPRIGHT - elevations
    span = f"{GRAVITY_ANGLE}={float(angles[0])!r}:{float(angles[-1])!r}:{count}"
    steps = ANSWERS_BEFORE_REQUIREMENTS + (count if upright.requirements else 0)
    rest = _rest_at(upright, angles)
    progress(1, steps)
    frequency = evaluate(upright, PointTable({GRAVITY_ANGLE: angles}), [FREQUENCY]).values[FREQUENCY]
    progress(2, steps)
    corrections = correction_table(upright, span, tolerance)
    progress(3, steps)
    error_budget = budget(upright, ranges=[span]) if upright.tolerances else None
    progress(ANSWERS_BEFORE_REQUIREMENTS, steps)

    def requirements_done(judged: int) -> None:
        progress(ANSWERS_BEFORE_REQUIREMENTS + judged, steps)

    return Elevation(
        state=state_of(upright),
        status=_overall_status(rest.statuses),
        message=_message(rest.statuses, elevations, upright),
        elevations=elevations,
        statuses=rest.statuses,
        components=upright.family.component_names,
        displacement=rest.displacement,
        frequency=np.where(np.isfinite(rest.loads).all(axis=1), frequency, np.nan),
        actuators=rest.actuators,
        turning=rest.turning,
        loads=rest.loads,
        limit_use=rest.limit_use,
        reversals=_reversals(error_model(upright, {GRAVITY_ANGLE: angles}, count), angles, upright),
        budget=error_budget,
        corrections=corrections,
        requirements=_requirements(upright, angles, elevations, requirements_done),
    )


def _upright_machine(machine: Machine, about: Sequence[float]) -> Machine:
    """The machine meant loaded, as it stands at an elevation of 90 degrees, with the axis about which gravity turns."""
    if not any(machine.tables["load"].gravity):
        raise InputError(
            f'{machine.name} has no gravity that could turn; write gravity = [0, 0, "-9.81 m/s**2"] under [load], '
            "as it acts at an elevation of 90 deg."
        )
    axis = {"load.gravity_axis": list(about)} if len(about) else {}
    return replace(changed(machine, {**axis, GRAVITY_ANGLE: 0.0}), loaded=True)


class _Rest(NamedTuple):
    """States at rest over the elevation, as the fields of `Elevation`; NaN where there is none."""

    statuses: Integers
    displacement: Array
    actuators: tuple[str, ...]
    turning: tuple[bool, ...]
    loads: Array
    limit_use: Array


def _rest_at(upright: Machine, angles: Array) -> _Rest:
    """The states at rest at some angles of gravity, rad [n]."""
    states = states_at(upright, {GRAVITY_ANGLE: angles}, len(angles))
    numbers, statuses = loaded_numbers(states)
    driven = states.mechanism.driven
    loads = np.asarray(numbers.get("drive_loads", np.full((len(angles), len(driven)), np.nan)))
    has_rest = np.isfinite(loads).all(axis=1)
    return _Rest(
        statuses=statuses,
        displacement=np.where(has_rest[:, None], _displacement(upright, numbers["displacement"]), np.nan),
        actuators=tuple(states.mechanism.actuators),
        turning=tuple(spring.joint.point is not None for spring in driven),
        loads=loads,
        limit_use=_limit_use(states, loads),
    )


def _displacement(machine: Machine, twists: Array) -> Array:
    """The components of twists [n x 6] that the machine has, without what is round-off over all elevations."""
    components = twists[:, list(machine.family.components)]
    rotations = np.array([name.startswith("r") for name in machine.family.component_names])
    for columns in (rotations, ~rotations):
        sizes = np.abs(components[:, columns])
        round_off = sizes < ROUND_OFF_OF_ENTRY * np.nanmax(sizes, initial=0.0)
        components[:, columns] = np.where(round_off, 0.0, components[:, columns])
    return components


def _elevations(over: str) -> Array:
    span = parse_range(f"elevation={over}")
    if span.logarithmic or not LEAST_POINTS <= span.count <= MOST_POINTS:
        raise InputError(
            f"over is {shorten(over)}; give from, to and {LEAST_POINTS} to {MOST_POINTS:,} elevations, as "
            f'"{USUAL_RANGE}".'
        )
    values = span.values(Quantity("angle", ""))
    if values[0] == values[-1]:
        raise InputError(f'over is {shorten(over)}, a single elevation; give two ends, as "{USUAL_RANGE}".')
    return values


def _overall_status(statuses: Integers) -> Status:
    """The first status of an elevation without a result; else the first beyond a limit, or OK."""
    irregular = statuses[~np.isin(statuses, REGULAR)]
    return Status(int(irregular[0] if irregular.size else statuses.max()))


def _message(statuses: Integers, elevations: Array, machine: Machine) -> str:
    """Say at which elevations there is no result, or a limit is passed, and why."""
    sentences = []
    for code in sorted({*statuses.tolist()} - {int(Status.OK)}):
        where = ", ".join(machine.display.show(float(e), "rad") for e in elevations[statuses == code])
        sentences.append(f"At {where}: {Status(code).sentence}")
    return " ".join(sentences)


def _limit_use(states: MachineState, loads: Array) -> Array:
    """The greatest share that any actuator uses of its limit at each elevation; NaN where nothing is limited [n]."""
    pairs = [(spring, np.abs(load)) for spring, load in zip(states.mechanism.driven, loads.T, strict=True)]
    shares = limit_use(states.machine, states.configuration, pairs)
    return np.max(np.array(shares, dtype=float), axis=0) if shares else np.full(len(loads), np.nan)


def _reversals(model: ErrorModel, angles: Array, machine: Machine) -> tuple[Reversal, ...]:
    """Find where the loads of drives and joints pass zero while gravity turns.

    Args:
        model: the errors of the machine, whose free motions are those of its joints and drives, at n angles.
        angles: angles of gravity, rad [n].
        machine: the machine with its tolerances and backlash.
    """
    rates = model.rates()
    if not np.isfinite(rates).all():
        return ()
    reactions = np.einsum("nie,ni->ne", rates, model.drawn.load)
    round_off = NO_REACTION * float(greatest_work(model.drawn.load, model.length).max())
    gaps = _gaps(model, machine)
    parts_by_leg_and_height: dict[tuple[str, float], list[_ReversedPart]] = {}
    for part, places in _free_motions(model).items():
        gap = gaps.get(part)
        for angle, direction in _zeros_of_reaction(reactions[:, places], angles, round_off):
            # The drawn machine stays where it is, so that all elevations share the rates of the first one.
            twist = None if gap is None else rates[0][:, places] @ (direction * gap)
            height = round(UPRIGHT - angle, DIGITS_OF_ELEVATION)
            parts_by_leg_and_height.setdefault((part.leg, height), []).append(_ReversedPart(part.name, twist))
    reversals = [_reversal(leg, height, parts) for (leg, height), parts in parts_by_leg_and_height.items()]
    return tuple(sorted(reversals, key=lambda reversal: reversal.elevation))


def _zeros_of_reaction(reaction: Array, angles: Array, round_off: float) -> Iterator[tuple[float, Array]]:
    """The angles at which a part crosses its clearance, each with the unit direction in which its reaction changes.

    Between two angles at which a part is pressed, to opposite sides, its load passes zero. What is left of the load
    along the direction in which it changes is then a + b cos + c sin, which `_zero` solves.

    Args:
        reaction: reaction of the part along its free motions at each angle [n x motions].
        angles: angles of gravity, rad [n].
        round_off: size of a reaction that is none.
    """
    waves = np.stack([np.ones(len(angles)), np.cos(angles), np.sin(angles)], axis=1)
    curves = np.linalg.lstsq(waves, reaction, rcond=None)[0]
    pressed = np.flatnonzero(np.linalg.norm(reaction, axis=1) > round_off)
    for before, after in pairwise(pressed.tolist()):
        if reaction[before] @ reaction[after] < 0.0:
            change = reaction[before] - reaction[after]
            direction = change / np.linalg.norm(change)
            yield _zero(curves @ direction, angles[before], angles[after]), direction


@dataclass(frozen=True)
class _ReversedPart:
    """A joint or drive whose load reverses.

    Attributes:
        name: name of the joint or drive.
        twist: motion of the platform while it crosses its clearance, rad and m [6]; None where it has none.
    """

    name: str
    twist: Array | None


class _LegPart(NamedTuple):
    """A joint or a drive: name of its leg, and its own."""

    leg: str
    name: str


def _part_of(path: str, leg: str) -> _LegPart:
    """The part of a leg that an error is about, its clearance or the zero of its drive, by the path of the error."""
    return _LegPart(leg, path.removeprefix(f"legs.{leg}.").removesuffix(".zero").partition(".clearance")[0])


def _free_motions(model: ErrorModel) -> dict[_LegPart, list[int]]:
    """Places of the errors along which each joint and each drive could move."""
    motions: dict[_LegPart, list[int]] = {}
    for place, error in enumerate(model.errors):
        if error.group in ("clearances", "zeros"):
            motions.setdefault(_part_of(error.path, error.leg), []).append(place)
    return motions


def _gaps(model: ErrorModel, machine: Machine) -> dict[_LegPart, float]:
    """Distance between the ends of each clearance with a tolerance, and of the backlash of each drive, m or rad."""
    driven = driven_springs(state_of(machine).configuration)
    backlashes = {name_of(spring): float(unseen_backlash(machine, spring)) for spring in driven}
    drives = [_part_of(error.path, error.leg) for error in model.errors if error.group == "zeros"]
    gaps = {drive: gap for drive in drives if (gap := backlashes.get(f"{drive.leg} {drive.name}"))}
    if machine.tolerances:
        for part in toleranced_parts(machine, model.errors, machine.tolerances):
            if part.free:
                gaps[_part_of(part.path, part.leg)] = 2.0 * part.limit
    return gaps


def _zero(curve: Array, start: float, end: float) -> float:
    """The angle between two others at which a + b cos + c sin is zero."""
    mean, cosine, sine = curve.tolist()
    middle = math.atan2(sine, cosine)
    reach = math.acos(min(1.0, max(-1.0, -mean / math.hypot(cosine, sine))))
    between, half = 0.5 * (start + end), 0.5 * abs(end - start)
    roots = [middle + side * reach for side in (1.0, -1.0)]
    nearest = [root + math.tau * round((between - root) / math.tau) for root in roots]
    return min(max(min(nearest, key=lambda root: abs(root - between)), between - half), between + half)


def _reversal(leg: str, height: float, parts: Sequence[_ReversedPart]) -> Reversal:
    """The reversal of all parts of a leg that reverse at an elevation, rad: their motions of the tool add up."""
    twists = [part.twist for part in parts if part.twist is not None]
    twist = np.sum(twists, axis=0) if twists else None
    return Reversal(
        elevation=height,
        leg=leg,
        parts=tuple(part.name for part in parts),
        jump=None if twist is None else float(np.linalg.norm(twist[3:])),
        turn=None if twist is None else float(np.linalg.norm(twist[:3])),
    )


def _requirements(
    upright: Machine, angles: Array, elevations: Array, done: Callable[[int], None]
) -> tuple[Verdict, ...]:
    """The requirements at every elevation: of each condition the verdict at its worst one, which its place names."""
    if not upright.requirements:
        return ()
    by_condition: dict[int, list[Verdict]] = {}
    for number, (angle, height) in enumerate(zip(angles.tolist(), elevations.tolist(), strict=True), 1):
        where = f"elevation {upright.display.show(height, 'rad')}"
        for condition, verdict in enumerate(requirements(with_values(upright, {GRAVITY_ANGLE: angle}))):
            place = f"{verdict.place}, {where}" if verdict.place else where
            by_condition.setdefault(condition, []).append(replace(verdict, place=place))
        done(number)
    return tuple(min(verdicts, key=_margin_or_bound) for _, verdicts in sorted(by_condition.items()))


def _margin_or_bound(verdict: Verdict) -> float:
    """The margin of a verdict; without one, minus infinity where the requirement is not met, and 0 where it is."""
    if verdict.margin is not None:
        return verdict.margin
    return 0.0 if verdict.met else -math.inf

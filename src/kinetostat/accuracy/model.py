"""The machine as built at many poses: how the tool moves by small errors of its numbers, to first order and exactly.

Actuators stand where the drawn machine has them at the pose, because the controller that commands them knows the
drawing only. Then the legs with their errors no longer close at the drawn pose, and the platform goes to where they do.
Redundant legs cannot all close: they share the misfit with the least energy of their springs, or by least squares if
all of them are rigid. Families and machines written leg by leg, spatial and planar ones are treated alike.

Source: theory (45) to (49); compliances, theory (10).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from operator import itemgetter

import numpy as np
import numpy.typing as npt

from kinetostat.accuracy.closing import (
    ClosedLegs,
    closed_legs,
    coordinates_toward,
    free_screws,
    in_lengths,
    independent_columns,
    legs_in_place,
    tool_at,
)
from kinetostat.accuracy.errors import Insertion, MachineError, Source, leg_error_sources, shared_error_sources
from kinetostat.accuracy.rows import Errors, HomeRows, LegRow, home_rows, like_rows, random_coordinates
from kinetostat.arrays import Array, Codes, Integers
from kinetostat.equilibrium.state import MachineState, state_of, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import stand
from kinetostat.kinematics.status import REGULAR, Status
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE
from kinetostat.numerics.motions import Motions, cross
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import ONE_PLACEMENT

LOAD = "load."
"""Prefix of the fields of [load], which press joints and move no leg of the drawn machine."""


@dataclass(frozen=True)
class FlexibleSpring:
    """Motion of the tool at n poses by the compliance of a spring.

    Attributes:
        twist: twist of the tool per unit of the deformation, at the tool point, base axes, SI [n x 6].
        compliance: compliance of the spring, m/N or rad/(N·m) [n].
    """

    twist: Array
    compliance: Array

    def deflection(self, wrenches: Array) -> Array:
        """The twist of the tool by its deformation under wrenches at the tool point [n x 6], SI [n x 6]."""
        load = np.einsum("ni,ni->n", self.twist, wrenches)
        return np.asarray(self.twist * (self.compliance * load)[:, None])


@dataclass(frozen=True)
class DrawnMachine:
    """The machine without errors at n poses.

    Attributes:
        status: `Status` codes of the machine at the poses [n]; results are NaN where it has no place.
        state: displacement of its platform from the home place, and the coordinates of its legs.
        tool: the tool point, base frame, m [n x 3].
        axes: the axes of its platform as columns, base frame [n x 3 x 3].
        actuators: coordinates of its actuators, m or rad [n x actuators].
        load: the wrench at the tool point under which compliances count, base axes, N·m and N [n x 6].
        springs: the springs that deflect.
        leg_compliances: compliance of each leg whose passive joints are locked, at the tool, in units of the machine's
            length [n x 6 x 6].
    """

    status: Codes
    state: ClosedLegs
    tool: Array
    axes: Array
    actuators: Array
    load: Array
    springs: tuple[FlexibleSpring, ...]
    leg_compliances: tuple[Array, ...]

    def at_poses(self, rows: Integers) -> "DrawnMachine":
        """The machine at some of the poses [rows]."""
        state = self.state.at(rows)
        springs = tuple(FlexibleSpring(spring.twist[rows], spring.compliance[rows]) for spring in self.springs)
        return DrawnMachine(
            self.status[rows],
            state,
            self.tool[rows],
            self.axes[rows],
            self.actuators[rows],
            self.load[rows],
            springs,
            tuple(compliance[rows] for compliance in self.leg_compliances),
        )


@dataclass(frozen=True, eq=False)
class ErrorsBehind:
    """Errors that displace what follows the same motion of a leg, each of them once.

    Attributes:
        leg: number of the leg.
        behind: number of the leg's motions that come before them.
        numbers: of the errors, k of them.
        twists: the small screw motion in home place per unit of each [k x 6].
        factors: what each twist is multiplied by at the poses [n x k].
        steady: whether all of these factors are 1.
    """

    leg: int
    behind: int
    numbers: tuple[int, ...]
    twists: Array
    factors: Array
    steady: bool

    def motion(self, values: Array) -> Array | None:
        """Their screw motion [1 or n x 6] at values of all errors [1 or n x errors]; None if none is there."""
        amounts = values[:, self.numbers]
        if not amounts.any():
            return None
        return np.asarray((amounts if self.steady else amounts * self.factors) @ self.twists)

    def among(self, wanted: Collection[int]) -> "ErrorsBehind":
        """Those of them that are wanted."""
        kept = [place for place, number in enumerate(self.numbers) if number in wanted]
        numbers = tuple(self.numbers[place] for place in kept)
        return replace(self, numbers=numbers, twists=self.twists[kept], factors=self.factors[:, kept])


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """A machine with small errors at n poses.

    Attributes:
        machine: the machine as drawn.
        drawn: the machine without errors at the poses.
        errors: every number that may be wrong.
        sources: the screw motions that errors put into the legs, in the order of `errors`; compliances, which are the
            last errors, put none there.
        rows: the legs at the home place.
        tool_home: the tool point at the home place, m [3].
        independent: by leg, the free screws that do not follow from those before them wherever the leg is.
    """

    machine: Machine
    drawn: DrawnMachine
    errors: tuple[MachineError, ...]
    sources: tuple[Source, ...]
    rows: HomeRows
    tool_home: Array
    independent: tuple[tuple[int, ...], ...]
    _last_state: dict[bytes, ClosedLegs] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.drawn.status)

    @property
    def length(self) -> float:
        """The machine's characteristic length, m."""
        return self.rows.length

    @property
    def overconstrained(self) -> bool:
        """Whether the legs carry more wrenches than the platform needs, so that they share a misfit."""
        return sum(6 - len(screws) for screws in self.independent) + len(self.rows.absent) > 6

    def at_poses(self, rows: Integers) -> "ErrorModel":
        """The model at some of its poses [rows]."""
        return replace(self, drawn=self.drawn.at_poses(rows), _last_state={})

    def leg_errors(self, values: Array) -> Errors:
        """The screw motions that errors put into each leg at the poses, one for all of them where they agree.

        Args:
            values: SI [errors], or others at each pose [n x errors].
        """
        motions: Errors = [{} for _ in self.rows.legs]
        each = np.atleast_2d(np.asarray(values, dtype=float))
        for errors in self._errors_behind:
            motion = errors.motion(each)
            if motion is not None:
                others = motions[errors.leg].get(errors.behind)
                motions[errors.leg][errors.behind] = motion if others is None else others + motion
        return motions

    @cached_property
    def _errors_behind(self) -> tuple[ErrorsBehind, ...]:
        """The errors of all legs by the motions behind which they stand, leg by leg."""
        standing: dict[tuple[int, int, int], dict[int, Insertion]] = {}
        for number, (_, insertions) in enumerate(self.sources):
            for i in insertions:
                again = 0  # an error may stand twice behind one motion
                while number in standing.setdefault((i.leg, i.behind, again), {}):
                    again += 1
                standing[i.leg, i.behind, again][number] = i
        result = []
        for (leg, behind, _), these in sorted(standing.items(), key=itemgetter(0)):
            coordinates, there = self.drawn.state.coordinates[leg], these.values()
            factors = np.stack([i.amount(coordinates) for i in there], axis=1)
            steady = all(i.factor is None for i in there)
            twists = np.array([i.twist for i in there])
            result.append(ErrorsBehind(leg, behind, tuple(these), twists, factors, steady))
        return tuple(result)

    def closed_state(self, values: Array) -> ClosedLegs:
        """Place all legs with errors [errors] or [n x errors], theory (48).

        The state at the last values is kept, because a fit asks for it again.
        """
        key = np.asarray(values, dtype=float).tobytes()
        if key not in self._last_state:
            drawn, errors = self.drawn, self.leg_errors(values)
            with np.errstate(all="ignore"):
                state = closed_legs(
                    self.rows, drawn.state, errors, self.tool_home, self.independent, drawn.leg_compliances
                )
            self._last_state.clear()
            self._last_state[key] = state
        return self._last_state[key]

    def rates(self, values: Array | None = None) -> Array:
        """Motion of the tool per unit of each error, with the actuators held, theory (46).

        Args:
            values: errors [errors] at which the rates are taken; none if None.

        Returns:
            Twists of the tool point, rotation first, base axes, rad and m per SI unit of the error [n x 6 x errors];
            NaN where the machine has no place.
        """
        if values is None:
            return self._rates_at(self.drawn.state, [{} for _ in self.rows.legs])
        return self._rates_at(self.closed_state(values), self.leg_errors(values))

    def displacement(self, values: Array) -> tuple[Array, Codes]:
        """Displacement of the tool by errors of any size, theory (48); compliances add to first order.

        Args:
            values: of the errors, SI [errors], or others at each pose [n x errors].

        Returns:
            Rotation vectors of the platform and displacements of the tool point from the drawn machine, base axes, rad
            and m [n x 6], and `Status` codes [n]; NaN where the legs do not close.
        """
        drawn, state = self.drawn, self.closed_state(values)
        motion = (state.platform @ drawn.state.platform.inverse()).amounts()
        motion[:, 3:] = tool_at(state.platform, self.tool_home) - drawn.tool
        each = np.broadcast_to(np.asarray(values, dtype=float), (len(self), len(self.errors)))
        for number, spring in enumerate(drawn.springs, len(self.sources)):
            motion = motion + spring.deflection(drawn.load) * each[:, number, None]
        status = np.where(np.isin(drawn.status, REGULAR) & ~state.settled, int(Status.NOT_CONVERGED), drawn.status)
        return np.where(np.isin(status, REGULAR)[:, None], motion, np.nan), status

    def linearisation(self, values: Array, wanted: Collection[int]) -> tuple[Array, Array]:
        """Compute `displacement` and `rates` at errors [errors] together [n x 6], [n x 6 x errors].

        Args:
            values: of the errors, SI.
            wanted: errors whose rates are needed; the other rates are 0.
        """
        rates = self._rates_at(self.closed_state(values), self.leg_errors(values), wanted)
        return self.displacement(values)[0], rates

    def deflections(self, wrenches: Array) -> Array:
        """Deflection of the tool under wrenches per relative error of each spring's compliance [n x 6 x springs].

        Args:
            wrenches: at the tool point, base axes, N·m and N [n x 6]; the sum over all springs is the deflection.
        """
        parts = [spring.deflection(wrenches) for spring in self.drawn.springs]
        return np.stack(parts, axis=2) if parts else np.zeros((len(self), 6, 0))

    def _rates_at(self, state: ClosedLegs, errors: Errors, wanted: Collection[int] | None = None) -> Array:
        tool, length = tool_at(state.platform, self.tool_home), self.rows.length
        every = self._errors_behind if wanted is None else [errors.among(wanted) for errors in self._errors_behind]
        by_leg: dict[int, list[ErrorsBehind]] = {}
        for of_motion in every:
            if of_motion.numbers:
                by_leg.setdefault(of_motion.leg, []).append(of_motion)
        with np.errstate(all="ignore"):
            groups = like_rows(self.rows, self.independent, len(self))
            at = legs_in_place(self.rows, groups, state.coordinates, errors, tool, self.drawn.leg_compliances)
            result = np.zeros((len(self), 6, len(self.errors)))
            for leg, of_leg in by_leg.items():
                wrenches, before = (
                    at.holding.at_origin(leg, tool, length),
                    [at.displacement(leg, e.behind) for e in of_leg],
                )
                bodies = Motions(
                    *(np.stack([getattr(body, part) for body in before]) for part in ("rotation", "translation"))
                )
                beside = [np.broadcast_to(errors[leg].get(e.behind, np.zeros(6)), (len(self), 6)) for e in of_leg]
                works = _work_beside(_work_in_body(wrenches, bodies), np.stack(beside))
                for of_motion, felt in zip(of_leg, works, strict=True):
                    work = np.swapaxes(felt, 1, 2) @ of_motion.twists.T * of_motion.factors[:, None]
                    result[:, :, of_motion.numbers] += at.holding.shares[leg] @ work
        result[:, 3:] *= length
        result[:, :, len(self.sources) :] = self.deflections(self.drawn.load)
        sound = np.isin(self.drawn.status, REGULAR) & state.settled
        return np.where(sound[:, None, None], result, np.nan)


def _work_in_body(wrenches: Array, place: Motions) -> Array:
    """Work of wrenches at the base origin [n x 6 x m] on screws fixed in a body, or in each of several."""
    moments, forces = np.swapaxes(wrenches[:, :3], 1, 2), np.swapaxes(wrenches[:, 3:], 1, 2)
    moments = moments + cross(forces, place.translation[..., None, :])
    return np.concatenate([np.swapaxes(part @ place.rotation, -2, -1) for part in (moments, forces)], axis=-2)


def _work_beside(wrenches: Array, error: Array) -> Array:
    """Work of wrenches [... x 6 x m] on the screws by which exp(e) changes, on the left, per unit that is added to e.

    The error e is small [... x 6], so that the series 1 + B / 2 + B^2 / 6 in its transposed bracket B suffices.
    """
    if not error.any():
        return wrenches
    once = _bracket(error, wrenches)
    return np.asarray(wrenches + once / 2.0 + _bracket(error, once) / 6.0)


def _bracket(screw: Array, wrenches: Array) -> Array:
    """Work of wrenches [... x 6 x m] on the brackets of a screw [... x 6] with others."""
    moments, forces = np.swapaxes(wrenches[..., :3, :], -2, -1), np.swapaxes(wrenches[..., 3:, :], -2, -1)
    turning, moving = screw[..., None, :3], screw[..., None, 3:]
    parts = cross(moments, turning) + cross(forces, moving), cross(forces, turning)
    return np.concatenate([np.swapaxes(part, -2, -1) for part in parts], axis=-2)


def error_model(
    machine: Machine | MachineState, columns: Mapping[str, Array], count: int, load: npt.ArrayLike | None = None
) -> ErrorModel:
    """State the errors of a machine at n poses.

    Args:
        machine: as drawn, or its state, as `state_of` returns it.
        columns: coordinates of the pose and loads that vary, by leaf path ("pose.x", "load.gravity_angle"), SI [n].
        count: n.
        load: wrench at the tool point under which compliances count, base axes, N·m and N [6] or [n x 6]; that of the
            machine's file if None.

    Raises:
        InputError: a column is neither of the pose nor of the loads, or the machine has no place at its home place.
    """
    given = state_of(machine)
    machine, others = given.machine, [path for path in columns if not path.startswith((POSE, LOAD))]
    if others:
        raise InputError(
            f'"{others[0]}" is not a coordinate of the pose of {machine.name}, nor a load; errors are of one machine.'
        )
    posed = states_at(machine, columns, count) if columns else given
    with np.errstate(all="ignore"):  # poses without a place
        response, stands = posed.free, stand(posed.machine, posed.joints)
    status = np.array(np.broadcast_to(np.asarray(response.status), (count,)), dtype=np.int64)
    rows = home_rows(machine)
    if not all(np.isfinite(twist).all() for row in rows.legs for twist in row.twists):
        raise InputError(f"{machine.name} cannot be placed at its pose; change [pose] until `kinetostat check` is ok.")
    platform, axes = _displacement(rows, response, count)
    with np.errstate(all="ignore"):
        coordinates = tuple(coordinates_toward(row, platform, rows.length) for row in rows.legs)
    actuators = stacked_columns([a.coordinate for a in stands], count)
    _mark_other_placements(rows, coordinates, actuators, status)
    springs, compliance_errors = _flexible_springs(response, count)
    tool_home = rows.point + rows.rotation @ np.array(machine.tables["tool"].offset, dtype=float)
    if response.configuration.plane is not None:
        tool_home = np.where([1, 1, 0], tool_home, rows.point)
    tool = tool_at(platform, tool_home)
    state = ClosedLegs(platform, coordinates, np.ones(count, dtype=bool))
    wrench = stacked_columns(response.load.components(), count) if load is None else np.broadcast_to(load, (count, 6))
    wrench = np.asarray(wrench, dtype=float)
    leg_compliances = _leg_compliances(response, rows, count)
    drawn = DrawnMachine(status, state, tool, axes, actuators, wrench, springs, leg_compliances)
    sources = (*leg_error_sources(rows), *shared_error_sources(machine, rows))
    errors = (*(error for error, _ in sources), *compliance_errors)
    independent_screws = tuple(_independent_screws(row, rows) for row in rows.legs)
    return ErrorModel(machine, drawn, errors, sources, rows, tool_home, independent_screws)


def _displacement(rows: HomeRows, response: Response, count: int) -> tuple[Motions, Array]:
    """Displacement of the platform from its home place, and its axes as columns [n x 3 x 3]."""
    placement = response.configuration.platform
    axes = (placement.rotation.x, placement.rotation.y, placement.rotation.z)
    columns = np.stack([stacked_columns(axis.components(), count) for axis in axes], axis=2)
    rotation = columns @ rows.rotation.T
    point = stacked_columns(placement.translation.components(), count)
    return Motions(rotation, point - np.einsum("nij,j->ni", rotation, rows.point)), columns


def _mark_other_placements(rows: HomeRows, coordinates: Sequence[Array], actuators: Array, status: Codes) -> None:
    """Mark poses at which a leg that is followed from the home place has its actuator elsewhere than the machine."""
    for row, joints in zip(rows.legs, coordinates, strict=True):
        for drive in (unit.drive for unit in row.units if unit.drive):
            off = actuators[:, drive.number] - drive.home - drive.sense * joints[:, drive.coordinate]
            off = off / rows.length if drive.slides else np.arctan2(np.sin(off), np.cos(off))
            elsewhere = ~(np.abs(off) < ONE_PLACEMENT) & np.isin(status, REGULAR)
            status[elsewhere] = int(Status.NOT_CONVERGED)


def _independent_screws(row: LegRow, rows: HomeRows) -> tuple[int, ...]:
    """Choose the free screws of a leg that are independent wherever it is; it carries six wrenches less these."""
    coordinates = random_coordinates(row, rows.length)
    return independent_columns(free_screws(row, rows, row.chain.place(coordinates), np.zeros((len(coordinates), 3))))


def _leg_compliances(response: Response, rows: HomeRows, count: int) -> tuple[Array, ...]:
    """The compliance of the springs of each leg at the tool, in units of the length [n x 6 x 6]."""
    result = []
    for leg in response.legs:
        soft = np.zeros((count, 6, 6))
        for twist, compliance in zip(leg.elastic, leg.compliance, strict=True):
            size = stacked_columns([compliance], count)
            screw = in_lengths(stacked_columns(twist.components(), count), rows.length)
            soft += np.where(np.isfinite(size), size, 0.0)[:, :, None] * screw[:, :, None] * screw[:, None]
        result.append(soft)
    return tuple(result)


def _flexible_springs(response: Response, count: int) -> tuple[tuple[FlexibleSpring, ...], list[MachineError]]:
    """The springs that deflect, and the relative error of the compliance of each."""
    flexible, names = [], []
    of_legs = [(leg.name, spring) for leg in response.configuration.legs for spring in leg.springs]
    for (leg, spring), twist, compliance in zip(
        of_legs, response.statics.flexibility, response.statics.compliance, strict=True
    ):
        size = stacked_columns([compliance], count)[:, 0]
        if not (np.isfinite(size).all() and (size > 0.0).any()):
            continue
        alone = sum(other.of == spring.of for _, other in of_legs) == 1
        part = (spring.of if alone else spring.name).removeprefix(f"{leg} ").replace(".", " ")
        words = f"compliance of the {part} of {leg}, relative"
        flexible.append(FlexibleSpring(stacked_columns(twist.components(), count), size))
        names.append(MachineError(f"legs.{leg}.{part}.compliance", "share", "compliances", words, leg))
    return tuple(flexible), names

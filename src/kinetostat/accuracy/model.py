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
from kinetostat.accuracy.errors import (
    FlexibleSpring,
    Insertion,
    MachineError,
    Source,
    flexible_springs,
    leg_error_sources,
    shared_error_sources,
)
from kinetostat.accuracy.rows import Errors, HomeRows, LegRow, home_rows, like_rows, random_coordinates
from kinetostat.arrays import Array, Codes, Integers, Mask
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
"""Beginning of the paths of loads, which press joints and move no leg of the drawn machine."""


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
        """Return the machine at some of the poses [rows]."""
        return DrawnMachine(
            status=self.status[rows],
            state=self.state.at(rows),
            tool=self.tool[rows],
            axes=self.axes[rows],
            actuators=self.actuators[rows],
            load=self.load[rows],
            springs=tuple(FlexibleSpring(spring.twist[rows], spring.compliance[rows]) for spring in self.springs),
            leg_compliances=tuple(compliance[rows] for compliance in self.leg_compliances),
        )


@dataclass(frozen=True, eq=False)
class ErrorsBehind:
    """Errors that displace what follows the same motion of a leg, each of them once.

    Attributes:
        leg: number of the leg.
        behind: number of the leg's motions that come before them.
        numbers: numbers of the errors, k of them.
        twists: the small screw motion in home place per unit of each [k x 6].
        factors: factors of the twists at the poses [n x k].
        are_constant: whether all of these factors are 1.
    """

    leg: int
    behind: int
    numbers: tuple[int, ...]
    twists: Array
    factors: Array
    are_constant: bool

    def motion(self, values: Array) -> Array | None:
        """Return their screw motion [1 or n x 6] at values of all errors [1 or n x errors]; None if all are 0."""
        amounts = values[:, self.numbers]
        if not amounts.any():
            return None
        return np.asarray((amounts if self.are_constant else amounts * self.factors) @ self.twists)

    def among(self, wanted: Collection[int]) -> "ErrorsBehind":
        """Return those of them whose numbers are wanted."""
        places = [place for place, number in enumerate(self.numbers) if number in wanted]
        numbers = tuple(self.numbers[place] for place in places)
        return replace(self, numbers=numbers, twists=self.twists[places], factors=self.factors[:, places])


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """A machine with small errors at n poses.

    Attributes:
        machine: the machine as drawn.
        drawn: the machine without errors at the poses.
        errors: the numbers that may be wrong.
        sources: the screw motions that errors put into the legs, in the order of `errors`; compliances, which are the
            last errors, put none there.
        rows: the legs at the home place.
        tool_home: the tool point at the home place, m [3].
        independent: for each leg, numbers of its free screws that do not follow from those before them, wherever it is.
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
        """Return the model at some of its poses [rows]."""
        return replace(self, drawn=self.drawn.at_poses(rows), _last_state={})

    def leg_errors(self, values: Array) -> Errors:
        """Return the screw motions that errors put into each leg at the poses, one for all of them where they agree.

        Args:
            values: values of the errors, SI [errors], or others at each pose [n x errors].
        """
        motions: Errors = [{} for _ in self.rows.legs]
        values_at_poses = np.atleast_2d(np.asarray(values, dtype=float))
        for errors in self._errors_behind:
            motion = errors.motion(values_at_poses)
            if motion is not None:
                others = motions[errors.leg].get(errors.behind)
                motions[errors.leg][errors.behind] = motion if others is None else others + motion
        return motions

    @cached_property
    def _errors_behind(self) -> tuple[ErrorsBehind, ...]:
        """The errors of all legs by the motions behind which they stand, leg by leg."""
        groups: dict[tuple[int, int, int], dict[int, Insertion]] = {}
        for number, (_, insertions) in enumerate(self.sources):
            for i in insertions:
                repetition = 0  # an error may stand twice behind one motion
                while number in groups.setdefault((i.leg, i.behind, repetition), {}):
                    repetition += 1
                groups[i.leg, i.behind, repetition][number] = i
        result = []
        for (leg, behind, _), insertion_of_error in sorted(groups.items(), key=itemgetter(0)):
            coordinates, group = self.drawn.state.coordinates[leg], insertion_of_error.values()
            errors_behind = ErrorsBehind(
                leg=leg,
                behind=behind,
                numbers=tuple(insertion_of_error),
                twists=np.array([i.twist for i in group]),
                factors=np.stack([i.amount(coordinates) for i in group], axis=1),
                are_constant=all(i.factor is None for i in group),
            )
            result.append(errors_behind)
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
            values: errors [errors] at which the rates are taken; the drawn machine if None.

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
            values: values of the errors, SI [errors], or others at each pose [n x errors].

        Returns:
            Rotation vectors of the platform and displacements of the tool point from the drawn machine, base axes, rad
            and m [n x 6], and `Status` codes [n]; NaN where the legs do not close.
        """
        drawn, state = self.drawn, self.closed_state(values)
        motion = (state.platform @ drawn.state.platform.inverse()).amounts()
        motion[:, 3:] = tool_at(state.platform, self.tool_home) - drawn.tool
        values_at_poses = np.broadcast_to(np.asarray(values, dtype=float), (len(self), len(self.errors)))
        for number, spring in enumerate(drawn.springs, len(self.sources)):
            motion = motion + spring.deflection(drawn.load) * values_at_poses[:, number, None]
        status = np.where(np.isin(drawn.status, REGULAR) & ~state.settled, int(Status.NOT_CONVERGED), drawn.status)
        return np.where(np.isin(status, REGULAR)[:, None], motion, np.nan), status

    def linearisation(self, values: Array, wanted: Collection[int]) -> tuple[Array, Array]:
        """Compute `displacement` and `rates` at errors [errors] together [n x 6], [n x 6 x errors].

        Args:
            values: values of the errors, SI.
            wanted: numbers of the errors whose rates are needed; the other rates are 0.
        """
        rates = self._rates_at(self.closed_state(values), self.leg_errors(values), wanted)
        return self.displacement(values)[0], rates

    def deflections(self, wrenches: Array) -> Array:
        """Deflection of the tool under wrenches per relative error of each spring's compliance [n x 6 x springs].

        Args:
            wrenches: wrenches at the tool point, base axes, N·m and N [n x 6]; the sum over all springs is the
                deflection.
        """
        parts = [spring.deflection(wrenches) for spring in self.drawn.springs]
        return np.stack(parts, axis=2) if parts else np.zeros((len(self), 6, 0))

    def _rates_at(self, state: ClosedLegs, errors: Errors, wanted: Collection[int] | None = None) -> Array:
        """Return `rates` at a state with errors of the legs; only those of the wanted errors, or of all if None."""
        tool = tool_at(state.platform, self.tool_home)
        by_leg: dict[int, list[ErrorsBehind]] = {}
        for group in self._errors_behind:
            group = group if wanted is None else group.among(wanted)
            if group.numbers:
                by_leg.setdefault(group.leg, []).append(group)
        with np.errstate(all="ignore"):
            like = like_rows(self.rows, self.independent, len(self))
            placed = legs_in_place(self.rows, like, state.coordinates, errors, tool, self.drawn.leg_compliances)
            result = np.zeros((len(self), 6, len(self.errors)))
            for leg, groups in by_leg.items():
                wrenches = placed.holding.at_origin(leg, tool, self.length)
                carriers = [placed.displacement(leg, group.behind) for group in groups]
                present = [errors[leg].get(group.behind, np.zeros(6)) for group in groups]
                present = [np.broadcast_to(error, (len(self), 6)) for error in present]
                works = _work_by_errors(wrenches, carriers, np.stack(present))
                for group, work in zip(groups, works, strict=True):
                    work_of_errors = np.swapaxes(work, 1, 2) @ group.twists.T * group.factors[:, None]
                    result[:, :, group.numbers] += placed.holding.shares[leg] @ work_of_errors
        result[:, 3:] *= self.length
        result[:, :, len(self.sources) :] = self.deflections(self.drawn.load)
        sound = np.isin(self.drawn.status, REGULAR) & state.settled
        return np.where(sound[:, None, None], result, np.nan)


def _work_by_errors(wrenches: Array, carriers: Sequence[Motions], errors: Array) -> Array:
    """Return the work of wrenches on screws that are added to errors of a leg [groups x n x 6 x m].

    By a change of an error e, exp(e) changes on the left by screws of the body that carries it. The error is small, so
    that the series 1 + B / 2 + B^2 / 6 in its transposed bracket B suffices for these.

    Args:
        wrenches: wrenches of the leg at the base origin [n x 6 x m].
        carriers: for each group of errors, the displacement of the body that carries it [n].
        errors: the errors of each group [groups x n x 6].
    """
    rotation, translation = (
        np.stack([getattr(body, part) for body in carriers]) for part in ("rotation", "translation")
    )
    moments, forces = np.swapaxes(wrenches[:, :3], 1, 2), np.swapaxes(wrenches[:, 3:], 1, 2)
    moments = moments + cross(forces, translation[..., None, :])
    in_body = np.concatenate([np.swapaxes(part @ rotation, -2, -1) for part in (moments, forces)], axis=-2)
    if not errors.any():
        return in_body
    first = _bracket(errors, in_body)
    return np.asarray(in_body + first / 2.0 + _bracket(errors, first) / 6.0)


def _bracket(screw: Array, wrenches: Array) -> Array:
    """Return the work of wrenches [... x 6 x m] on the brackets of a screw [... x 6] with others."""
    moments, forces = np.swapaxes(wrenches[..., :3, :], -2, -1), np.swapaxes(wrenches[..., 3:, :], -2, -1)
    rotation, translation = screw[..., None, :3], screw[..., None, 3:]
    parts = cross(moments, rotation) + cross(forces, translation), cross(forces, rotation)
    return np.concatenate([np.swapaxes(part, -2, -1) for part in parts], axis=-2)


def error_model(
    machine: Machine | MachineState, columns: Mapping[str, Array], count: int, load: npt.ArrayLike | None = None
) -> ErrorModel:
    """State the errors of a machine at n poses.

    Args:
        machine: as drawn, or its state, as `state_of` returns it.
        columns: coordinates of the pose and loads that vary, by leaf path ("pose.x", "load.gravity_angle"), SI [n].
        count: number of poses, n.
        load: wrench at the tool point under which compliances count, base axes, N·m and N [6] or [n x 6]; that of the
            machine's file if None.

    Raises:
        InputError: a column is neither of the pose nor of the loads, or the machine has no place at its home place.
    """
    state = state_of(machine)
    others = [path for path in columns if not path.startswith((POSE, LOAD))]
    if others:
        raise InputError(
            f'"{others[0]}" is not a coordinate of the pose of {state.machine.name}, nor a load; errors are of one '
            "machine."
        )
    rows = home_rows(state.machine)
    if not all(np.isfinite(twist).all() for row in rows.legs for twist in row.twists):
        raise InputError(
            f"{state.machine.name} cannot be placed at its pose; change [pose] until `kinetostat check` is ok."
        )
    tool_home = rows.point + rows.rotation @ np.array(state.machine.tables["tool"].offset, dtype=float)
    if rows.configuration.plane is not None:
        tool_home = np.where([1, 1, 0], tool_home, rows.point)
    posed = states_at(state.machine, columns, count) if columns else state
    with np.errstate(all="ignore"):  # poses without a place
        flexible = list(flexible_springs(posed.free, count))
        drawn = _drawn_machine(rows, posed, count, tool_home, load)
    sources = (*leg_error_sources(rows), *shared_error_sources(state.machine, rows))
    return ErrorModel(
        machine=state.machine,
        drawn=replace(drawn, springs=tuple(spring for spring, _ in flexible)),
        errors=(*(error for error, _ in sources), *(error for _, error in flexible)),
        sources=sources,
        rows=rows,
        tool_home=tool_home,
        independent=tuple(_independent_screws(row, rows) for row in rows.legs),
    )


def _drawn_machine(
    rows: HomeRows, posed: MachineState, count: int, tool_home: Array, load: npt.ArrayLike | None
) -> DrawnMachine:
    """Place the machine without errors at n poses; its springs are left out.

    Args:
        rows: the machine at its home place.
        posed: its state at the poses.
        count: number of poses, n.
        tool_home: the tool point at the home place, m [3].
        load: see `error_model`.
    """
    response = posed.free
    platform, axes = _displacement(rows, response, count)
    coordinates = tuple(coordinates_toward(row, platform, rows.length) for row in rows.legs)
    actuators = stacked_columns([actuator.coordinate for actuator in stand(posed.machine, posed.joints)], count)
    status = np.array(np.broadcast_to(np.asarray(response.status), (count,)), dtype=np.int64)
    elsewhere = _is_elsewhere(rows, coordinates, actuators) & np.isin(status, REGULAR)
    wrench = stacked_columns(response.load.components(), count) if load is None else np.broadcast_to(load, (count, 6))
    return DrawnMachine(
        status=np.where(elsewhere, int(Status.NOT_CONVERGED), status),
        state=ClosedLegs(platform, coordinates, np.ones(count, dtype=bool)),
        tool=tool_at(platform, tool_home),
        axes=axes,
        actuators=actuators,
        load=np.asarray(wrench, dtype=float),
        springs=(),
        leg_compliances=_leg_compliances(response, rows, count),
    )


def _displacement(rows: HomeRows, response: Response, count: int) -> tuple[Motions, Array]:
    """Return the displacement of the platform from its home place, and its axes as columns [n x 3 x 3]."""
    placement = response.configuration.platform
    axes = (placement.rotation.x, placement.rotation.y, placement.rotation.z)
    columns = np.stack([stacked_columns(axis.components(), count) for axis in axes], axis=2)
    rotation = columns @ rows.rotation.T
    point = stacked_columns(placement.translation.components(), count)
    return Motions(rotation, point - np.einsum("nij,j->ni", rotation, rows.point)), columns


def _is_elsewhere(rows: HomeRows, coordinates: Sequence[Array], actuators: Array) -> Mask:
    """Return whether a leg that is followed from the home place has its actuator elsewhere than the machine [n]."""
    result = np.zeros(len(actuators), dtype=bool)
    for row, joints in zip(rows.legs, coordinates, strict=True):
        for drive in (unit.drive for unit in row.units if unit.drive):
            difference = actuators[:, drive.number] - drive.home - drive.sense * joints[:, drive.coordinate]
            distance = difference / rows.length if drive.slides else np.arctan2(np.sin(difference), np.cos(difference))
            result |= ~(np.abs(distance) < ONE_PLACEMENT)  # NaN, too
    return result


def _independent_screws(row: LegRow, rows: HomeRows) -> tuple[int, ...]:
    """Choose the free screws of a leg that are independent wherever it is; it carries six wrenches less these."""
    coordinates = random_coordinates(row, rows.length)
    return independent_columns(free_screws(row, rows, row.chain.place(coordinates), np.zeros((len(coordinates), 3))))


def _leg_compliances(response: Response, rows: HomeRows, count: int) -> tuple[Array, ...]:
    """Return the compliance of the springs of each leg at the tool, in units of the length [n x 6 x 6]."""
    result = []
    for leg in response.legs:
        soft = np.zeros((count, 6, 6))
        for twist, compliance in zip(leg.elastic, leg.compliance, strict=True):
            size = stacked_columns([compliance], count)
            screw = in_lengths(stacked_columns(twist.components(), count), rows.length)
            soft += np.where(np.isfinite(size), size, 0.0)[:, :, None] * screw[:, :, None] * screw[:, None]
        result.append(soft)
    return tuple(result)

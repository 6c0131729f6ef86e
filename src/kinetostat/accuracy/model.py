"""The machine as built at many poses: how the tool moves by small errors of its numbers, to first order and exactly.

Actuators stand where the drawn machine has them at the pose, because the controller that commands them knows the
drawing only. Then the legs with their errors no longer close at the drawn pose, and the platform goes to where they do.
Redundant legs cannot all close: they share the misfit with the least energy of their springs, or by least squares if
all of them are rigid. Families and machines written leg by leg, spatial and planar ones are treated alike.

Source: theory (45) to (49); compliances, theory (10).
"""

from collections import deque
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
    ErrorSource,
    FlexibleSpring,
    Insertion,
    MachineError,
    flexible_springs,
    leg_error_sources,
    shared_error_sources,
)
from kinetostat.accuracy.rows import ErrorScrews, HomeRows, LegRow, home_rows, like_rows, random_coordinates
from kinetostat.arrays import Array, Codes, Integers, Mask
from kinetostat.equilibrium.state import MachineState, state_of, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import stand
from kinetostat.kinematics.status import REGULAR, Status
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE
from kinetostat.numerics.motions import Motions, work_on_exponents
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

    def at_poses(self, poses: Integers) -> "DrawnMachine":
        """Return the machine at some of the poses, by their numbers."""
        return DrawnMachine(
            status=self.status[poses],
            state=self.state.at(poses),
            tool=self.tool[poses],
            axes=self.axes[poses],
            actuators=self.actuators[poses],
            load=self.load[poses],
            springs=tuple(FlexibleSpring(spring.twist[poses], spring.compliance[poses]) for spring in self.springs),
            leg_compliances=tuple(compliance[poses] for compliance in self.leg_compliances),
        )


@dataclass(frozen=True, eq=False)
class ErrorsBehindMotion:
    """Errors that act behind the same motion of a leg; an error that acts there twice is in two of these.

    Attributes:
        leg: number of the leg.
        behind: number of the leg's motions that come before them.
        numbers: numbers of the errors, k different ones.
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

    def screw(self, values: Array) -> Array | None:
        """Return their screw motion [1 or n x 6] at values of all errors [1 or n x errors]; None if all are 0."""
        own_values = values[:, self.numbers]
        if not own_values.any():
            return None
        return np.asarray((own_values if self.are_constant else own_values * self.factors) @ self.twists)

    def among(self, wanted: Collection[int]) -> "ErrorsBehindMotion":
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
        errors: the numbers that may be wrong: first those that have `sources`, then the compliances of the springs of
            `drawn`, in their order.
        sources: the screw motions that errors put into the legs, in the order of `errors`; compliances put none there.
        rows: the legs at the home place.
        tool_home: the tool point at the home place, m [3].
        independent: for each leg, numbers of its free screws that do not follow from those before them, wherever it is.
    """

    machine: Machine
    drawn: DrawnMachine
    errors: tuple[MachineError, ...]
    sources: tuple[ErrorSource, ...]
    rows: HomeRows
    tool_home: Array
    independent: tuple[tuple[int, ...], ...]
    _last_closed: deque[tuple[bytes, ClosedLegs]] = field(default_factory=lambda: deque(maxlen=1), init=False)
    """The values of the last `closed_state`, as bytes, and what it returned; a copy of the model begins without."""

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

    def at_poses(self, poses: Integers) -> "ErrorModel":
        """Return the model at some of its poses, by their numbers."""
        return replace(self, drawn=self.drawn.at_poses(poses))

    def error_screws(self, values: Array) -> ErrorScrews:
        """Return the screw motions that errors put into each leg at the poses, one for all of them where they agree.

        Args:
            values: values of the errors, SI [errors], or others at each pose [n x errors].
        """
        screws: ErrorScrews = [{} for _ in self.rows.legs]
        values_at_poses = np.atleast_2d(np.asarray(values, dtype=float))
        for group in self._errors_by_motion:
            screw = group.screw(values_at_poses)
            if screw is not None:
                others = screws[group.leg].get(group.behind)
                screws[group.leg][group.behind] = screw if others is None else others + screw
        return screws

    @cached_property
    def _errors_by_motion(self) -> tuple[ErrorsBehindMotion, ...]:
        """The errors of all legs by the motions behind which they act, leg by leg."""
        insertions: dict[tuple[int, int, int], dict[int, Insertion]] = {}
        for number, source in enumerate(self.sources):
            for insertion in source.insertions:
                repetition = 0  # an error may act twice behind one motion
                while number in insertions.setdefault((insertion.leg, insertion.behind, repetition), {}):
                    repetition += 1
                insertions[insertion.leg, insertion.behind, repetition][number] = insertion
        groups = []
        for (leg, behind, _), insertion_of_error in sorted(insertions.items(), key=itemgetter(0)):
            coordinates, members = self.drawn.state.coordinates[leg], insertion_of_error.values()
            group = ErrorsBehindMotion(
                leg=leg,
                behind=behind,
                numbers=tuple(insertion_of_error),
                twists=np.array([insertion.twist for insertion in members]),
                factors=np.stack([insertion.amount(coordinates) for insertion in members], axis=1),
                are_constant=all(insertion.factor is None for insertion in members),
            )
            groups.append(group)
        return tuple(groups)

    def closed_state(self, values: Array) -> ClosedLegs:
        """Place all legs with errors [errors] or [n x errors], theory (48).

        The state at the last values is kept: a fit first asks for the residuals at new values and then, if these are
        better, for the rates there.
        """
        key = np.asarray(values, dtype=float).tobytes()
        for last_key, last_state in tuple(self._last_closed):
            if last_key == key:
                return last_state
        drawn, screws = self.drawn, self.error_screws(values)
        with np.errstate(all="ignore"):
            state = closed_legs(self.rows, drawn.state, screws, self.tool_home, self.independent, drawn.leg_compliances)
        self._last_closed.append((key, state))  # takes the place of the last one in one step, so that threads may share
        return state

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
        return self._rates_at(self.closed_state(values), self.error_screws(values))

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
        rates = self._rates_at(self.closed_state(values), self.error_screws(values), wanted)
        return self.displacement(values)[0], rates

    def deflections(self, wrenches: Array) -> Array:
        """Deflection of the tool under wrenches per relative error of each spring's compliance [n x 6 x springs].

        Args:
            wrenches: wrenches at the tool point, base axes, N·m and N [n x 6]; the sum over all springs is the
                deflection.
        """
        parts = [spring.deflection(wrenches) for spring in self.drawn.springs]
        return np.stack(parts, axis=2) if parts else np.zeros((len(self), 6, 0))

    def _rates_at(self, state: ClosedLegs, screws: ErrorScrews, wanted: Collection[int] | None = None) -> Array:
        """Return `rates` at a state with error screws of the legs; only of the wanted errors, or of all if None."""
        tool = tool_at(state.platform, self.tool_home)
        groups_of_leg: dict[int, list[ErrorsBehindMotion]] = {}
        for group in self._errors_by_motion:
            wanted_group = group if wanted is None else group.among(wanted)
            if wanted_group.numbers:
                groups_of_leg.setdefault(group.leg, []).append(wanted_group)
        with np.errstate(all="ignore"):
            like = like_rows(self.rows, self.independent, len(self))
            placed = legs_in_place(self.rows, like, state.coordinates, screws, tool, self.drawn.leg_compliances)
            rates = np.zeros((len(self), 6, len(self.errors)))
            for leg, groups in groups_of_leg.items():
                wrenches = placed.holding.at_origin(leg, tool, self.length)
                carriers = [placed.displacement(leg, group.behind) for group in groups]
                present_screws = [
                    np.broadcast_to(screws[leg].get(group.behind, np.zeros(6)), (len(self), 6)) for group in groups
                ]
                works = work_on_exponents(wrenches, carriers, np.stack(present_screws))
                for group, work in zip(groups, works, strict=True):
                    work_of_errors = np.swapaxes(work, 1, 2) @ group.twists.T * group.factors[:, None]
                    rates[:, :, group.numbers] += placed.holding.shares[leg] @ work_of_errors
        rates[:, 3:] *= self.length
        rates[:, :, len(self.sources) :] = self.deflections(self.drawn.load)
        has_place = np.isin(self.drawn.status, REGULAR) & state.settled
        return np.where(has_place[:, None, None], rates, np.nan)


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
            f'"{others[0]}" is not a coordinate of the pose of {state.machine.name}, nor a load; errors are those of '
            f'one design: vary coordinates and loads only, such as "{POSE}x" or "{LOAD}gravity_angle".'
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
        errors=(*(source.error for source in sources), *(error for _, error in flexible)),
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
    is_elsewhere = _is_elsewhere(rows, coordinates, actuators) & np.isin(status, REGULAR)
    wrench = stacked_columns(response.load.components(), count) if load is None else np.broadcast_to(load, (count, 6))
    return DrawnMachine(
        status=np.where(is_elsewhere, int(Status.NOT_CONVERGED), status),
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
    vectors = (placement.rotation.x, placement.rotation.y, placement.rotation.z)
    axes = np.stack([stacked_columns(vector.components(), count) for vector in vectors], axis=2)
    rotation = axes @ rows.rotation.T
    point = stacked_columns(placement.translation.components(), count)
    return Motions(rotation, point - np.einsum("nij,j->ni", rotation, rows.point)), axes


def _is_elsewhere(rows: HomeRows, coordinates: Sequence[Array], actuators: Array) -> Mask:
    """Return whether a leg that is followed from the home place has its actuator elsewhere than the machine [n].

    Then it has come to another assembly mode than the machine, and its errors would be those of another machine.
    """
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
    matrices = []
    for leg in response.legs:
        matrix = np.zeros((count, 6, 6))
        for twist, spring_compliance in zip(leg.elastic, leg.compliance, strict=True):
            compliance = stacked_columns([spring_compliance], count)
            compliance = np.where(np.isfinite(compliance), compliance, 0.0)  # a free spring is a joint
            screw = in_lengths(stacked_columns(twist.components(), count), rows.length)
            matrix += compliance[:, :, None] * screw[:, :, None] * screw[:, None]
        matrices.append(matrix)
    return tuple(matrices)

"""Measured values that a machine with errors would give, and their rates by every unknown.

Unknowns are errors of the machine, and where wanted the place of the measuring frame in the base frame and that of the
target on the platform. Residuals are in standard deviations.

Source: theory (64); exact places and rates are those of theory (46) and (48).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from kinetostat.accuracy.errors import MachineError
from kinetostat.accuracy.model import ErrorModel
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import REGULAR, Status
from kinetostat.numerics.motions import Motions, cross, exponential, logarithm
from kinetostat.spec.renamed import former_names
from kinetostat.studies.identification.measurements import EULER, FARTHEST_POSITION, POSITION, ROTATION, Measurements
from kinetostat.tolerances import ON_A_LINE

ANGLE_STEP = 1e-5
"""Step of central differences of angles by small rotations, rad: what they leave out is its square."""
FRAME_UNKNOWNS = tuple(f"frame.{name}" for name in (*ROTATION, *POSITION))
TARGET_UNKNOWNS = tuple(f"target.{name}" for name in (*ROTATION, *POSITION))
"""Unknown places of the measuring frame in the base frame, and of the target from the tool point in platform axes."""
PLACES = {"frame": "place of the measuring frame in the base frame", "target": "place of the target on the platform"}


def place_unknown(path: str) -> MachineError:
    """An unknown of the measuring frame or the target, described as errors are."""
    what, name = path.split(".")
    turns = name in ROTATION
    words = f"{PLACES[what]}, {'turn about' if turns else 'shift along'} {name[-1]}"
    return MachineError(path, "angle" if turns else "length", what, words, "")


@former_names(chosen="error_numbers", members="error_mix", names="row_names", pose="row_poses", value="measured")
@dataclass(frozen=True, eq=False)
class Observation:
    """Measurements beside the model that is to explain them.

    Attributes:
        model: the machine at the commanded poses.
        data: what was measured there.
        unknowns: what is to be found, in order.
        error_numbers: number of each unknown among the errors of the model; -1 of tied errors, and of unknowns of the
            frame and the target.
        error_mix: how far each error of the model goes with each unknown, errors = error_mix @ unknowns [errors x
            unknowns].
        frame: where the measuring frame is taken to be at first.
        row_names: name of the measured value in each row of the residuals [rows].
        row_poses: number of the pose to which each row belongs [rows].
        sigma: standard deviation of each row [rows].
        measured: the value that was measured in each row [rows].
    """

    model: ErrorModel
    data: Measurements
    unknowns: tuple[MachineError, ...]
    error_numbers: Integers
    error_mix: Array
    frame: Motions
    row_names: tuple[str, ...]
    row_poses: Integers
    sigma: Array
    measured: Array

    @property
    def turns(self) -> Mask:
        """Flags of the rows that are angles [rows]."""
        return np.isin([name.removeprefix("deflection.") for name in self.row_names], (*ROTATION, *EULER))

    def residuals(self, values: Array) -> Array:
        """Measured values less those that the unknowns predict, over the standard deviations [rows].

        NaN where the legs do not close.
        """
        predicted, _ = self._predict(values, False)
        return self._over_sigma(predicted)

    def linearisation(self, values: Array) -> tuple[Array, Array]:
        """The residuals, and how each falls per unit of each unknown [rows x unknowns]."""
        predicted, rates = self._predict(values, True)
        return self._over_sigma(predicted), rates / self.sigma[:, None]

    def _over_sigma(self, predicted: Array) -> Array:
        off = self.measured - predicted
        off = np.where(self.turns, np.arctan2(np.sin(off), np.cos(off)), off)
        return np.asarray(off / self.sigma)

    def _unknowns_at(self, paths: Sequence[str], values: Array) -> Array:
        """The values of unknowns by path, of all that have values [unknowns]; 0 where a path is not sought."""
        known = {unknown.path: value for unknown, value in zip(self.unknowns, values, strict=True)}
        return np.array([known.get(path, 0.0) for path in paths])

    def errors(self, values: Array) -> Array:
        """The errors of the whole model [errors] that unknowns [unknowns] stand for."""
        return np.asarray(self.error_mix @ values)

    def twists(self, whole: Array) -> Array:
        """Twists of the tool per unit of each unknown, base axes, from the rates of all errors; 0 by frame and target.

        Args:
            whole: rates of all errors of the model [n x 6 x errors].
        """
        used = self.error_mix.any(axis=1)
        return np.asarray(whole[:, :, used] @ self.error_mix[used])

    def _predict(self, values: Array, with_rates: bool) -> tuple[Array, Array]:
        """Predicted values [rows], and their rates by the unknowns [rows x unknowns], empty where these are not wanted.

        The tool of the drawn machine is displaced by errors of geometry, and by springs with their errors of
        compliance; the target on it is then seen from the measuring frame.
        """
        model, errors = self.model, self.errors(values)
        per_spring = model.deflections(self.data.wrenches)
        first_spring = len(errors) - per_spring.shape[2]
        deflection = per_spring @ (1.0 + errors[first_spring:])
        if not with_rates:
            target = self._target_of(model.displacement(errors)[0] + deflection, values)
            return self._values(target.in_frame, deflection), np.zeros((0, 0))
        wanted = set(np.flatnonzero(self.error_mix.any(axis=1)).tolist())
        displacement, error_rates = model.linearisation(errors, wanted)
        target = self._target_of(displacement + deflection, values)
        twists = self.twists(np.concatenate([error_rates[:, :, :first_spring], per_spring], axis=2))
        rates = target.rates(twists, [unknown.path for unknown in self.unknowns])
        return self._values(target.in_frame, deflection), self._rates(target.in_frame, rates, per_spring)

    def _target_of(self, displacement: Array, values: Array) -> "_Target":
        """The target where the tool is displaced [n x 6], with the unknown places of frame and target at values."""
        drawn = self.model.drawn
        frame, target = self._unknowns_at(FRAME_UNKNOWNS, values), self._unknowns_at(TARGET_UNKNOWNS, values)
        turns = np.concatenate([displacement[:, :3], np.zeros_like(displacement[:, :3])], axis=1)
        platform_axes = exponential(turns).rotation @ drawn.axes
        frame_turn, target_turn = (
            exponential(place[None] * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])).rotation for place in (frame, target)
        )
        return _Target(
            frame=frame,
            target=target,
            platform_axes=platform_axes,
            frame_axes=(frame_turn @ self.frame.rotation)[0],
            target_turn=target_turn[0],
            arm=np.einsum("nij,j->ni", platform_axes, target[3:]),
            tool=drawn.tool + displacement[:, 3:],
            origin=self.frame.translation[0] + frame[3:],
        )

    def _values(self, seen: Motions, deflected: Array) -> Array:
        """The values of all rows by where the target is seen, and by the deflection of the tool [rows]."""
        angles = _angles(seen.rotation)
        away = np.linalg.norm(seen.translation - self.data.origins, axis=1)
        columns = {name: seen.translation[:, i] for i, name in enumerate(POSITION)}
        columns |= {name: angles[:, i] for i, name in enumerate((*ROTATION, *EULER))} | {"distance": away}
        columns |= {f"deflection.{name}": deflected[:, i] for i, name in enumerate((*ROTATION, *POSITION))}
        return np.array([columns[name][row] for name, row in zip(self.row_names, self.row_poses, strict=True)])

    def _rates(self, seen: Motions, rates: Array, per_spring: Array) -> Array:
        """Rates of every measured value [rows x unknowns]."""
        wanted = {*self.row_names}
        columns: dict[str, Array] = {name: rates[:, 3 + i] for i, name in enumerate(POSITION)}
        if wanted & {*ROTATION, *EULER}:
            by_turn = _angle_rates(seen.rotation) @ rates[:, :3]
            columns |= {name: by_turn[:, i] for i, name in enumerate((*ROTATION, *EULER))}
        if "distance" in wanted:
            sight = seen.translation - self.data.origins
            sight = sight / np.linalg.norm(sight, axis=1)[:, None]
            columns["distance"] = np.einsum("ni,niu->nu", sight, rates[:, 3:])
        if any(name.startswith("deflection") for name in wanted):
            first_spring = len(self.model.errors) - per_spring.shape[2]
            by_spring = per_spring @ self.error_mix[first_spring:]
            columns |= {f"deflection.{name}": by_spring[:, i] for i, name in enumerate((*ROTATION, *POSITION))}
        return np.stack([columns[name][row] for name, row in zip(self.row_names, self.row_poses, strict=True)])


@dataclass(frozen=True)
class _Target:
    """The target on the platform and the measuring frame at n poses.

    Attributes:
        frame, target: turns and shifts of the frame and of the target from where they are taken to be, rad and m [6].
        platform_axes: axes of the platform as columns, base frame [n x 3 x 3].
        frame_axes: axes of the measuring frame as columns, base frame [3 x 3].
        target_turn: rotation from the axes of the target to those of the platform [3 x 3].
        arm: vector from the tool point to the target, base axes, m [n x 3].
        tool: the tool point, base frame, m [n x 3].
        origin: origin of the measuring frame, base frame, m [3].
    """

    frame: Array
    target: Array
    platform_axes: Array
    frame_axes: Array
    target_turn: Array
    arm: Array
    tool: Array
    origin: Array

    @property
    def in_frame(self) -> Motions:
        """Place of the target in the measuring frame."""
        rotation = np.swapaxes(self.frame_axes[None], 1, 2) @ self.platform_axes @ self.target_turn
        return Motions(rotation, (self.tool + self.arm - self.origin) @ self.frame_axes)

    def rates(self, twists: Array, paths: Sequence[str]) -> Array:
        """Twists of the target in the measuring frame per unit of each unknown [n x 6 x unknowns].

        Args:
            twists: of the tool per unit of each unknown, base axes, 0 by frame and target [n x 6 x unknowns].
            paths: of the unknowns.
        """
        turning, moving = twists[:, :3].copy(), twists[:, 3:]
        moving = moving + np.swapaxes(cross(np.swapaxes(turning, 1, 2), self.arm[:, None]), 1, 2)
        from_frame = self.tool + self.arm - self.origin
        for place in (number for number, path in enumerate(paths) if path in FRAME_UNKNOWNS):
            component = FRAME_UNKNOWNS.index(paths[place])
            if component < 3:
                axis = _turn_axis(self.frame, component)
                turning[:, :, place], moving[:, :, place] = -axis, -np.cross(axis, from_frame)
            else:
                moving[:, :, place] = -np.eye(3)[component - 3]
        for place in (number for number, path in enumerate(paths) if path in TARGET_UNKNOWNS):
            component = TARGET_UNKNOWNS.index(paths[place])
            if component < 3:
                turning[:, :, place] = self.platform_axes @ _turn_axis(self.target, component)
            else:
                moving[:, :, place] = self.platform_axes @ np.eye(3)[component - 3]
        back = self.frame_axes.T
        return np.concatenate([back @ turning, back @ moving], axis=1)


def _turn_axis(turn: Array, component: int) -> Array:
    """Angular velocity per unit rate of a component of a rotation vector, which need not be small [3].

    The translation of the exponential of a screw (w, u) is J(w) u, with the left Jacobian J of rotations: of a unit
    vector u it is the column of J that is wanted.
    """
    return np.asarray(exponential(np.array([[*turn[:3], *np.eye(3)[component]]])).translation[0])


def _angles(rotation: Array) -> Array:
    """Rotation vectors, and roll, pitch and yaw [n x 6]."""
    vectors = logarithm(Motions(rotation, np.zeros(rotation.shape[:2])))[:, :3]
    level = np.hypot(rotation[:, 0, 0], rotation[:, 1, 0])
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    pitch = np.arctan2(-rotation[:, 2, 0], level)
    yaw = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    return np.column_stack([vectors, roll, pitch, yaw])


def _angle_rates(rotation: Array) -> Array:
    """Rates of these angles by small rotations about the axes of the frame [n x 6 x 3]."""
    columns = []
    for axis in np.eye(3):
        ends = [
            _angles(exponential(np.array([[*(sign * ANGLE_STEP * axis), 0.0, 0.0, 0.0]])).rotation @ rotation)
            for sign in (1.0, -1.0)
        ]
        off = ends[0] - ends[1]
        columns.append(np.arctan2(np.sin(off), np.cos(off)) / (2.0 * ANGLE_STEP))
    return np.stack(columns, axis=2)


def observation(
    model: ErrorModel,
    data: Measurements,
    unknowns: Sequence[MachineError],
    frame: Motions | None = None,
    ties: Mapping[str, Mapping[str, float]] | None = None,
) -> Observation:
    """Put measurements beside the model.

    Args:
        model: of the machine at the commanded poses.
        data: at the same poses.
        unknowns: to be found.
        frame: where the measuring frame is taken to be at first; found from the measurements if None.
        ties: of each unknown that is several errors at once, their paths and how far they go with it.

    Raises:
        InputError: the drawn machine has no place at a commanded pose, or measured positions lie far from it although
            the measuring frame is the base frame.
    """
    _check_placed(model, data)
    numbers = {error.path: number for number, error in enumerate(model.errors)}
    error_mix = np.zeros((len(numbers), len(unknowns)))
    for column, unknown in enumerate(unknowns):
        for path, share in (ties or {}).get(unknown.path, {unknown.path: 1.0}).items():
            if path in numbers:
                error_mix[numbers[path], column] = share
    # The rows of the residuals: pose by pose, so that the values of one pose stand together.
    pairs = [(n, row) for n, values in data.values.items() for row in np.flatnonzero(np.isfinite(values)).tolist()]
    pairs.sort(key=lambda pair: pair[1])
    if frame is None:
        free = any(unknown.group == "frame" for unknown in unknowns)
        frame = _frame(model, data) if free else still_frame()
        if not free:
            _check_far(model, data)
    return Observation(
        model=model,
        data=data,
        unknowns=tuple(unknowns),
        error_numbers=np.array([numbers.get(unknown.path, -1) for unknown in unknowns], dtype=np.int64),
        error_mix=error_mix,
        frame=frame,
        row_names=tuple(name for name, _ in pairs),
        row_poses=np.array([row for _, row in pairs], dtype=np.int64),
        sigma=np.array([data.sigma[name][row] for name, row in pairs]),
        measured=np.array([data.values[name][row] for name, row in pairs]),
    )


def _check_placed(model: ErrorModel, data: Measurements) -> None:
    """Refuse a pose at which the drawn machine has no place."""
    elsewhere = np.flatnonzero(~np.isin(model.drawn.status, REGULAR))
    if elsewhere.size:
        row = int(elsewhere[0])
        sentence = Status(int(model.drawn.status[row])).sentence
        raise data.refusal(row, f"the drawn machine is not at the commanded pose. {sentence} Check units and angles.")


def still_frame() -> Motions:
    """The base frame itself."""
    return Motions(np.eye(3)[None], np.zeros((1, 3)))


def _frame(model: ErrorModel, data: Measurements) -> Motions:
    """The place of the measuring frame with which the drawn machine comes nearest to positions (W. Kabsch, 1976).

    Without three measured positions it is the base frame. Where all lie on a line, they do not say how the frame is
    turned about it: of all frames that come as near it is the one that is turned least.
    """
    if not all(name in data.values for name in POSITION):
        return still_frame()
    measured = np.stack([data.values[name] for name in POSITION], axis=1)
    rows = np.isfinite(measured).all(axis=1)
    if rows.sum() < 3:
        return still_frame()
    start, end = measured[rows], model.drawn.tool[rows]
    spread = (start - start.mean(axis=0)).T @ (end - end.mean(axis=0))
    left, sizes, right = np.linalg.svd(spread)
    if sizes[1] > ON_A_LINE * sizes[0]:
        hand = np.diag([1.0, 1.0, np.sign(np.linalg.det(right.T @ left.T))])
        turn = right.T @ hand @ left.T
    else:
        turn = _least_turn(left[:, 0], right[0])
    return Motions(turn[None], (end.mean(axis=0) - turn @ start.mean(axis=0))[None])


def _least_turn(start: Array, end: Array) -> Array:
    """The rotation by the least angle that turns one unit vector into another [3 x 3]."""
    axis, cosine = np.cross(start, end), float(start @ end)
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:  # a turn by nothing, or half a turn about any axis across
        axis = np.cross(start, np.eye(3)[np.abs(start).argmin()])
    axis = axis / np.linalg.norm(axis)
    return np.asarray(exponential(np.array([[*(np.arctan2(sine, cosine) * axis), 0.0, 0.0, 0.0]])).rotation[0])


def _check_far(model: ErrorModel, data: Measurements) -> None:
    """Refuse positions that are measured far from the drawn machine, as by a wrong unit or in another frame."""
    length = model.length
    for i, name in enumerate(POSITION):
        off = np.abs(data.values.get(name, model.drawn.tool[:, i]) - model.drawn.tool[:, i])
        if np.isfinite(off).any() and np.nanmedian(off) > FARTHEST_POSITION * length:
            row = int(np.nanargmax(off))
            raise data.refusal(
                row,
                f"measured.{name} is {1e3 * data.values[name][row]:.6g} mm where the drawn machine has its tool at "
                f"{1e3 * model.drawn.tool[row, i]:.6g} mm, and most others are as far away; check the unit in the head "
                "of the column, or say that the measuring frame is unknown (--frame).",
            )

"""The values that a machine with errors would be measured to have, and their rates by every unknown.

Unknowns are errors of the machine and, if a fit asks for them, the place of the measuring frame in the base frame and
that of the target on the platform. Residuals are in standard deviations.

Source: theory (64); exact places and rates are those of theory (46) and (48).
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import field

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
"""Step of central differences of angles by small rotations, rad: their relative error is its square, 1e-10, and
round-off takes no more than 1e-11."""
FRAME_UNKNOWNS = tuple(f"frame.{name}" for name in (*ROTATION, *POSITION))
"""Paths of the unknown place of the measuring frame in the base frame."""
TARGET_UNKNOWNS = tuple(f"target.{name}" for name in (*ROTATION, *POSITION))
"""Paths of the unknown place of the target, from the tool point in platform axes."""
PLACES = {"frame": "place of the measuring frame in the base frame", "target": "place of the target on the platform"}
"""Unknown places, by the beginning of their paths, in words."""


def place_unknown(path: str) -> MachineError:
    """An unknown of the measuring frame or the target, described as errors are."""
    place, name = path.split(".")
    turns = name in ROTATION
    words = f"{PLACES[place]}, {'turn about' if turns else 'shift along'} {name[-1]}"
    return MachineError(path=path, kind="angle" if turns else "length", group=place, words=words, leg="")


@former_names(chosen="error_numbers", members="error_mix", names="row_names", pose="row_poses", value="measured")
@dataclass(frozen=True, eq=False)
class Observation:
    """Measurements beside the model that is to explain them.

    Attributes:
        model: the machine at the commanded poses.
        data: what was measured there.
        unknowns: the unknowns of the fit, in order.
        error_numbers: number of each unknown among the errors of the model; -1 for tied errors, and for unknowns of
            the frame and the target [unknowns].
        error_mix: errors of the model per unit of each unknown, errors = error_mix @ values [errors x unknowns].
        frame: place of the measuring frame in the base frame where its unknowns are zero.
        row_names: name of the measured value in each row of the residuals [rows].
        row_poses: number of the pose to which each row belongs [rows].
        sigma: standard deviation of each row [rows].
        measured: the measured value in each row [rows].
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
    # The last linearisation, with the bytes of its values. It is not a part of the constructor, so that a copy with
    # other fields does not take over answers of this one.
    _last: deque[tuple[bytes, tuple[Array, Array]]] = field(default_factory=lambda: deque(maxlen=1), init=False)

    @property
    def turns(self) -> Mask:
        """Flags of the rows that are angles [rows]."""
        return np.isin([name.removeprefix("deflection.") for name in self.row_names], (*ROTATION, *EULER))

    def residuals(self, values: Array) -> Array:
        """Measured values less those that the unknowns predict, over the standard deviations [rows].

        NaN where the legs do not close.
        """
        errors, per_spring = self.errors(values), self._deflections_per_spring
        deflection = per_spring @ (1.0 + errors[self._first_spring :])
        target = self._target_at(self.model.displacement(errors)[0] + deflection, values)
        return self._residuals_of(self._predicted_values(target.in_frame, deflection))

    def linearisation(self, values: Array) -> tuple[Array, Array]:
        """The residuals, and how each falls per unit of each unknown [rows x unknowns], theory (64).

        Errors of geometry displace the tool of the drawn machine, and springs with their errors of compliance deflect
        it; the target on it is then seen from the measuring frame. The last answer is kept: a round of a fit begins at
        the values where the one before it has ended.
        """
        key = values.tobytes()
        for last_key, last_linearisation in tuple(self._last):
            if last_key == key:
                return last_linearisation
        linearisation = self._new_linearisation(values)
        self._last.append((key, linearisation))  # replaces the last one in one step, so that threads may share it
        return linearisation

    def _new_linearisation(self, values: Array) -> tuple[Array, Array]:
        model, errors, per_spring = self.model, self.errors(values), self._deflections_per_spring
        deflection = per_spring @ (1.0 + errors[self._first_spring :])
        wanted = set(np.flatnonzero(self.error_mix.any(axis=1)).tolist())
        displacement, error_rates = model.linearisation(errors, wanted)
        target = self._target_at(displacement + deflection, values)
        twists = self.twists(np.concatenate([error_rates[:, :, : self._first_spring], per_spring], axis=2))
        rates = target.rates(twists, [unknown.path for unknown in self.unknowns])
        rows = self._rates_of_values(target.in_frame, rates, per_spring)
        return self._residuals_of(self._predicted_values(target.in_frame, deflection)), rows / self.sigma[:, None]

    @property
    def _deflections_per_spring(self) -> Array:
        """Deflections of the tool under the measured wrenches by each spring, as drawn [n x 6 x springs]."""
        return self.model.deflections(self.data.wrenches)

    @property
    def _first_spring(self) -> int:
        """Number of the first error of a compliance: these come last, in the order of the springs."""
        return len(self.model.errors) - len(self.model.drawn.springs)

    def _residuals_of(self, predicted: Array) -> Array:
        """Measured values less predicted ones, over the standard deviations [rows]."""
        differences = self.measured - predicted
        angles = np.arctan2(np.sin(differences), np.cos(differences))  # within half a turn
        return np.asarray(np.where(self.turns, angles, differences) / self.sigma)

    def _values_at(self, paths: Sequence[str], values: Array) -> Array:
        """The values of unknowns by path, out of the values of all [unknowns]; 0 where a path is not an unknown."""
        by_path = {unknown.path: value for unknown, value in zip(self.unknowns, values, strict=True)}
        return np.array([by_path.get(path, 0.0) for path in paths])

    def errors(self, values: Array) -> Array:
        """The errors of the whole model [errors] that values of the unknowns [unknowns] stand for."""
        return np.asarray(self.error_mix @ values)

    def twists(self, error_rates: Array) -> Array:
        """Twists of the tool per unit of each unknown [n x 6 x unknowns]; 0 for those of the frame and the target.

        Args:
            error_rates: twists of the tool per unit of each error of the model, base axes [n x 6 x errors].
        """
        used = self.error_mix.any(axis=1)
        return np.asarray(error_rates[:, :, used] @ self.error_mix[used])

    def _target_at(self, displacement: Array, values: Array) -> "_Target":
        """The target where the tool is displaced from the drawn one [n x 6], at values of the unknowns [unknowns]."""
        drawn = self.model.drawn
        frame, target = self._values_at(FRAME_UNKNOWNS, values), self._values_at(TARGET_UNKNOWNS, values)
        platform_axes = _rotations(displacement[:, :3]) @ drawn.axes
        return _Target(
            frame=frame,
            target=target,
            platform_axes=platform_axes,
            frame_axes=(_rotations(frame[None, :3]) @ self.frame.rotation)[0],
            target_turn=_rotations(target[None, :3])[0],
            arm=np.einsum("nij,j->ni", platform_axes, target[3:]),
            tool=drawn.tool + displacement[:, 3:],
            origin=self.frame.translation[0] + frame[3:],
        )

    def _predicted_values(self, place: Motions, deflection: Array) -> Array:
        """The values of all rows by the place of the target in the frame, and by the deflection of the tool [rows]."""
        angles = _angles(place.rotation)
        columns = {name: place.translation[:, i] for i, name in enumerate(POSITION)}
        columns |= {name: angles[:, i] for i, name in enumerate((*ROTATION, *EULER))}
        columns["distance"] = np.linalg.norm(place.translation - self.data.origins, axis=1)
        columns |= {f"deflection.{name}": deflection[:, i] for i, name in enumerate((*ROTATION, *POSITION))}
        return np.array([columns[name][pose] for name, pose in zip(self.row_names, self.row_poses, strict=True)])

    def _rates_of_values(self, place: Motions, twists: Array, per_spring: Array) -> Array:
        """Rates of the values of all rows by the unknowns [rows x unknowns]; only columns that rows name are computed.

        Args:
            place: place of the target in the measuring frame.
            twists: its twists there per unit of each unknown [n x 6 x unknowns].
            per_spring: deflections of the tool by each spring [n x 6 x springs].
        """
        wanted = {*self.row_names}
        columns: dict[str, Array] = {name: twists[:, 3 + i] for i, name in enumerate(POSITION)}
        if wanted & {*ROTATION, *EULER}:
            angle_rates = _angle_rates(place.rotation) @ twists[:, :3]
            columns |= {name: angle_rates[:, i] for i, name in enumerate((*ROTATION, *EULER))}
        if "distance" in wanted:
            sight = place.translation - self.data.origins
            direction = sight / np.linalg.norm(sight, axis=1)[:, None]
            columns["distance"] = np.einsum("ni,niu->nu", direction, twists[:, 3:])
        if any(name.startswith("deflection") for name in wanted):
            deflections = per_spring @ self.error_mix[self._first_spring :]
            columns |= {f"deflection.{name}": deflections[:, i] for i, name in enumerate((*ROTATION, *POSITION))}
        return np.stack([columns[name][pose] for name, pose in zip(self.row_names, self.row_poses, strict=True)])


@dataclass(frozen=True)
class _Target:
    """The target on the platform and the measuring frame at n poses.

    Attributes:
        frame, target: rotation vector and shift of the frame, and of the target, that the unknowns say, rad and m [6].
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
            twists: twists of the tool, base axes; 0 for unknowns of the frame and the target [n x 6 x unknowns].
            paths: paths of the unknowns.
        """
        turns = twists[:, :3].copy()
        shifts = twists[:, 3:] + np.swapaxes(cross(np.swapaxes(turns, 1, 2), self.arm[:, None]), 1, 2)
        from_frame = self.tool + self.arm - self.origin
        for column, path in enumerate(paths):
            # A motion of the frame moves the target the other way in it.
            if path in FRAME_UNKNOWNS[:3]:
                axis = _turn_axis(self.frame, FRAME_UNKNOWNS.index(path))
                turns[:, :, column], shifts[:, :, column] = -axis, -np.cross(axis, from_frame)
            elif path in FRAME_UNKNOWNS:
                shifts[:, :, column] = -np.eye(3)[FRAME_UNKNOWNS.index(path) - 3]
            elif path in TARGET_UNKNOWNS[:3]:
                turns[:, :, column] = self.platform_axes @ _turn_axis(self.target, TARGET_UNKNOWNS.index(path))
            elif path in TARGET_UNKNOWNS:
                shifts[:, :, column] = self.platform_axes @ np.eye(3)[TARGET_UNKNOWNS.index(path) - 3]
        to_frame = self.frame_axes.T
        return np.concatenate([to_frame @ turns, to_frame @ shifts], axis=1)


def _rotations(vectors: Array) -> Array:
    """The rotations [n x 3 x 3] of rotation vectors [n x 3], rad."""
    return exponential(np.concatenate([vectors, np.zeros_like(vectors)], axis=1)).rotation


def _turn_axis(place: Array, component: int) -> Array:
    """Angular velocity per unit rate of a component of the rotation vector of a place [6], which need not be small [3].

    The exponential of a screw (w, u) shifts by J(w) u, where J is the left Jacobian of rotations. Of a unit vector u
    that is a column of J, which is the angular velocity.
    """
    return np.asarray(exponential(np.array([[*place[:3], *np.eye(3)[component]]])).translation[0])


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
    for small_turn in ANGLE_STEP * np.eye(3):
        ahead, behind = (_angles(_rotations(turn[None]) @ rotation) for turn in (small_turn, -small_turn))
        change = ahead - behind
        columns.append(np.arctan2(np.sin(change), np.cos(change)) / (2.0 * ANGLE_STEP))
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
        model: the errors of the machine at the commanded poses.
        data: what was measured at the same poses.
        unknowns: the unknowns of a fit.
        frame: place of the measuring frame where its unknowns are zero; None to estimate it from the measurements.
        ties: of each unknown that stands for several errors, their paths, and the share of it that each takes.

    Raises:
        InputError: the drawn machine has no place at a commanded pose, or measured positions lie far from it although
            the measuring frame is the base frame.
    """
    _check_placed(model, data)
    number_by_path = {error.path: number for number, error in enumerate(model.errors)}
    error_mix = np.zeros((len(number_by_path), len(unknowns)))
    for column, unknown in enumerate(unknowns):
        for path, share in (ties or {}).get(unknown.path, {unknown.path: 1.0}).items():
            if path in number_by_path:  # unknowns of the frame and the target are no errors
                error_mix[number_by_path[path], column] = share
    # A row for each measured value, pose by pose, so that the values of one pose stand together.
    rows = [
        (name, pose) for name, values in data.values.items() for pose in np.flatnonzero(np.isfinite(values)).tolist()
    ]
    rows.sort(key=lambda name_and_pose: name_and_pose[1])
    if frame is None and any(unknown.group == "frame" for unknown in unknowns):
        frame = _estimated_frame(model, data)
    elif frame is None:
        _check_near(model, data)
        frame = _base_frame()
    return Observation(
        model=model,
        data=data,
        unknowns=tuple(unknowns),
        error_numbers=np.array([number_by_path.get(unknown.path, -1) for unknown in unknowns], dtype=np.int64),
        error_mix=error_mix,
        frame=frame,
        row_names=tuple(name for name, _ in rows),
        row_poses=np.array([pose for _, pose in rows], dtype=np.int64),
        sigma=np.array([data.sigma[name][pose] for name, pose in rows]),
        measured=np.array([data.values[name][pose] for name, pose in rows]),
    )


def _check_placed(model: ErrorModel, data: Measurements) -> None:
    """Refuse a pose at which the drawn machine has no place."""
    unplaced = np.flatnonzero(~np.isin(model.drawn.status, REGULAR))
    if unplaced.size:
        pose = int(unplaced[0])
        sentence = Status(int(model.drawn.status[pose])).sentence
        raise data.refusal(pose, f"the drawn machine is not at the commanded pose. {sentence} Check units and angles.")


def _base_frame() -> Motions:
    return Motions(np.eye(3)[None], np.zeros((1, 3)))


def _estimated_frame(model: ErrorModel, data: Measurements) -> Motions:
    """The place of the measuring frame in which measured positions lie nearest to the drawn machine's.

    Without three measured positions it is the base frame. Where all lie on a line, they do not say how the frame is
    turned about it: of all frames that come as near it is the one that is turned least.

    Source: W. Kabsch, Acta Crystallographica A 32, 1976.
    """
    if not all(name in data.values for name in POSITION):
        return _base_frame()
    positions = np.stack([data.values[name] for name in POSITION], axis=1)
    is_measured = np.isfinite(positions).all(axis=1)
    if is_measured.sum() < 3:
        return _base_frame()
    measured, drawn = positions[is_measured], model.drawn.tool[is_measured]
    products = (measured - measured.mean(axis=0)).T @ (drawn - drawn.mean(axis=0))
    left, sizes, right = np.linalg.svd(products)
    if sizes[1] > ON_A_LINE * sizes[0]:
        no_mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(right.T @ left.T))])
        turn = right.T @ no_mirror @ left.T
    else:
        turn = _least_turn(left[:, 0], right[0])
    return Motions(turn[None], (drawn.mean(axis=0) - turn @ measured.mean(axis=0))[None])


def _least_turn(start: Array, end: Array) -> Array:
    """The rotation by the least angle that turns one unit vector into another [3 x 3]."""
    axis, cosine = np.cross(start, end), float(start @ end)
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:  # no turn at all, or half a turn about any axis across
        axis = np.cross(start, np.eye(3)[np.abs(start).argmin()])
    axis = axis / np.linalg.norm(axis)
    return np.asarray(_rotations(np.arctan2(sine, cosine) * axis[None])[0])


def _check_near(model: ErrorModel, data: Measurements) -> None:
    """Refuse positions that are measured far from the drawn machine, as by a wrong unit or in another frame."""
    for i, name in enumerate(POSITION):
        distances = np.abs(data.values.get(name, model.drawn.tool[:, i]) - model.drawn.tool[:, i])
        if np.isfinite(distances).any() and np.nanmedian(distances) > FARTHEST_POSITION * model.length:
            pose = int(np.nanargmax(distances))
            raise data.refusal(
                pose,
                f"measured.{name} is {1e3 * data.values[name][pose]:.6g} mm where the drawn machine has its tool at "
                f"{1e3 * model.drawn.tool[pose, i]:.6g} mm, and most others are as far away; check the unit in the "
                "head of the column, or say that the measuring frame is unknown (--frame).",
            )

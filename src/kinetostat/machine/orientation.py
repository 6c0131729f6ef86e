"""Orientations as people write them, quaternions, rotation matrices, tilt and torsion, converted to roll, pitch, yaw.

Machine files, overrides and Python may give any of these in the place of the three angles. Everything after reading
uses the angles of Q = Rz(yaw) Ry(pitch) Rx(roll) alone. Tilt and torsion are those of I. A. Bonev, "Advantages of the
modified Euler angles in the design and control of PKMs" (2002): Q = Rz(azimuth) Ry(angle) Rz(torsion - azimuth). In the
base frame.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.tolerances import NO_ANGLE_RATES, ROUNDED_ORIENTATION
from kinetostat.units import UnitError

NEWTON_STEPS = 4
"""Steps to the nearest rotation: an error of `ROUNDED_ORIENTATION` is round-off after three, and one is to spare."""
ANGLES = ("roll", "pitch", "yaw")
"""Coordinates of a pose that say how the platform is turned."""
TILT = ("azimuth", "angle", "torsion")
"""Angles of a tilt; the torsion may be left out, and is then 0."""
FORMS = {
    "quaternion": "[w, x, y, z] of length 1, e.g. [0.9962, 0.0872, 0, 0] for 10 deg about x",
    "rotation": "three rows, the axes of the platform in their columns, e.g. [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
    "tilt": 'the direction of the tilt, how far, and the turn about the normal, e.g. { azimuth = "30 deg", angle = '
    '"10 deg", torsion = "0 deg" }',
}
"""Ways to write an orientation beside roll, pitch and yaw, by the name that files have for them."""
PARTS = {
    "quaternion": ("w", "x", "y", "z"),
    "rotation": tuple(f"{row}.{column}" for row in (1, 2, 3) for column in (1, 2, 3)),
    "tilt": TILT,
}
"""The numbers of each form in order, by the names that they have as columns of a table: "quaternion.w"."""
ANGLE = Quantity("angle", "an angle of an orientation")
COMPONENT = Quantity("direction", "a number of an orientation")


def form_of(name: str) -> str:
    """Return the form in a path such as "pose.tilt.angle" or "quaternion"; empty if it has none."""
    head = _bare(name).partition(".")[0]
    return head if head in FORMS else ""


def part_of(name: object) -> tuple[str, str]:
    """Return the form and the part of a column of a table, such as ("tilt", "angle"); two empty texts for others."""
    form, _, part = _bare(str(name)).replace("_", ".").partition(".")
    return (form, part) if part in PARTS.get(form, ()) else ("", "")


def from_parts(form: str, parts: Mapping[str, Array]) -> Any:
    """Join the columns of a table to orientations as `angles_of` takes them.

    Args:
        form: a key of `PARTS`.
        parts: values of each of its parts [n], or one value for all.

    Raises:
        InputError: a part has no column (only the torsion of a tilt may be left out), or they differ in length.
    """
    *_, torsion = TILT
    missing = [part for part in PARTS[form] if part not in parts and part != torsion]
    if missing:
        raise InputError(
            f"the poses have a column {form}.{next(iter(parts))}, but no {form}.{missing[0]}; give a column for each "
            f"of {', '.join(f'{form}.{part}' for part in PARTS[form])}."
        )
    if form == "tilt":
        return parts
    columns = np.stack(_of_one_length([parts[part] for part in PARTS[form]], form), axis=1)
    return columns.reshape(-1, 3, 3) if form == "rotation" else columns


def angles_of(form: str, value: object, where: str) -> dict[str, Array]:
    """Read orientations: arrays of roll, pitch and yaw, rad, one entry for each of them.

    Args:
        form: a key of `FORMS`.
        value: one orientation, or an array of several; of a tilt a table whose entries may be arrays.
        where: name of the value in messages.

    Raises:
        InputError: it is not of this form, not of unit length, not orthogonal, or a mirror image.
    """
    readers = {"quaternion": _rotations_of_quaternions, "rotation": _rotations_of_matrices, "tilt": _rotations_of_tilts}
    return _roll_pitch_yaw(readers[form](value, where))


def _numbers(value: object, shape: tuple[int, ...], form: str, where: str) -> Array:
    """An array of numbers with the shape of one orientation, or with one more dimension in front."""
    try:
        array = np.asarray(value)
        array = array.astype(float) if array.dtype.kind in "iuf" else np.empty(0)
    except ValueError:  # rows of several lengths
        array = np.empty(0)
    array = array[None] if array.shape == shape else array
    if array.shape[1:] != shape or not np.isfinite(array).all():
        raise InputError(f"{where} is {shorten(value)}; give {FORMS[form]}.")
    return array


def _rotations_of_quaternions(value: object, where: str) -> Array:
    quaternions = _numbers(value, (4,), "quaternion", where)
    with np.errstate(over="ignore"):
        length = np.sqrt((quaternions**2).sum(axis=1))
    _refuse_large(np.abs(length - 1.0), lambda i: f"{where} has length {length[i]:.6g}; write {FORMS['quaternion']}.")
    w, x, y, z = (quaternions / length[:, None]).T
    return _rows(
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def _rotations_of_matrices(value: object, where: str) -> Array:
    turns = _numbers(value, (3, 3), "rotation", where)
    with np.errstate(all="ignore"):
        errors = np.abs(np.swapaxes(turns, 1, 2) @ turns - np.eye(3)).max(axis=(1, 2))
    _refuse_large(
        errors,
        lambda i: (
            f"{where} is not a rotation: lengths and products of its columns differ from those of perpendicular unit "
            f"vectors by up to {errors[i]:.2g}; write {FORMS['rotation']}."
        ),
    )
    _refuse_large(
        np.where(np.linalg.det(turns) < 0.0, 1.0, 0.0),
        lambda _: (
            f"{where} is a mirror image and not a rotation: its determinant is -1; turn one of its columns round."
        ),
    )
    # Newton's iteration for the nearest rotation: the error of rounded digits squares, and an exact matrix stays exact.
    for _ in range(NEWTON_STEPS):
        turns = turns @ (1.5 * np.eye(3) - 0.5 * np.swapaxes(turns, 1, 2) @ turns)
    return turns


def _rotations_of_tilts(value: object, where: str) -> Array:
    if not isinstance(value, Mapping) or not set(TILT[:2]) <= value.keys() <= set(TILT):
        raise InputError(f"{where} is {shorten(value)}; give {FORMS['tilt']} (torsion may be left out: 0).")
    parts = {"torsion": 0.0, **value}
    azimuth, angle, torsion = _of_one_length([_angle_values(parts[name], f"{where}.{name}") for name in TILT], where)
    return _about_z(azimuth) @ _about_y(angle) @ _about_z(torsion - azimuth)


def _of_one_length(arrays: Sequence[Array], where: str) -> Sequence[Array]:
    """Arrays of one length from arrays [n] and [1]."""
    try:
        return np.broadcast_arrays(*arrays)
    except ValueError:
        lengths = ", ".join(str(len(array)) for array in arrays)
        raise InputError(
            f"{where} has parts of several lengths ({lengths}); give each one value for each pose."
        ) from None


def _angle_values(value: Any, where: str) -> Array:
    """Angles in rad, from one of them or from an array."""
    entries = np.atleast_1d(np.asarray(value, dtype=object)).tolist()
    try:
        return np.array([ANGLE.number(entry) for entry in entries])
    except UnitError as error:
        raise InputError(f"{where} is {shorten(value)}: {error}.") from None


def _refuse_large(errors: Array, sentence: Callable[[int], str]) -> None:
    """Refuse the first orientation whose error is larger than rounded digits explain.

    Args:
        errors: the error of each orientation [n].
        sentence: gives the message for an orientation by its number; which pose it is, is added before its full stop.

    Raises:
        InputError: there is one.
    """
    wrong = np.flatnonzero(~(errors <= ROUNDED_ORIENTATION))
    if wrong.size:
        pose = f" (pose {wrong[0] + 1})" if len(errors) > 1 else ""
        raise InputError(f"{sentence(wrong[0]).removesuffix('.')}{pose}.")


def _rows(*rows: tuple[Array, Array, Array]) -> Array:
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def _about_z(angle: Array) -> Array:
    c, s, none = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    return _rows((c, -s, none), (s, c, none), (none, none, none + 1.0))


def _about_y(angle: Array) -> Array:
    c, s, none = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    return _rows((c, none, s), (none, none + 1.0, none), (-s, none, c))


def _roll_pitch_yaw(turns: Array) -> dict[str, Array]:
    """Roll, pitch and yaw of rotations [n x 3 x 3]; roll is 0 at pitch = +-90 deg, where only one angle is left."""
    flat = np.hypot(turns[:, 0, 0], turns[:, 1, 0])
    upright = flat < NO_ANGLE_RATES
    roll = np.where(upright, 0.0, np.arctan2(turns[:, 2, 1], turns[:, 2, 2]))
    yaw = np.where(upright, np.arctan2(-turns[:, 0, 1], turns[:, 1, 1]), np.arctan2(turns[:, 1, 0], turns[:, 0, 0]))
    return {"roll": roll + 0.0, "pitch": np.arctan2(-turns[:, 2, 0], flat) + 0.0, "yaw": yaw + 0.0}


def check_form(coordinates: Iterable[str], where: str) -> None:
    """Refuse an orientation for a machine whose pose does not have all of roll, pitch and yaw.

    Raises:
        InputError: with the coordinates that it has.
    """
    known = list(coordinates)
    if not set(ANGLES) <= set(known):
        raise InputError(
            f"{where} stands for roll, pitch and yaw, which the pose of this machine does not have all; give its own "
            f"coordinates {', '.join(known)}."
        )


def with_angles(document: Document, coordinates: Sequence[str], origin: str) -> Document:
    """The document with roll, pitch and yaw, rad, in the place of a quaternion, a rotation matrix, or tilt and torsion.

    Args:
        document: the document of a machine, with its table [pose].
        coordinates: the coordinates that its [pose] may have.
        origin: names it in messages.

    Raises:
        InputError: two orientations in one pose, one that cannot be read, or a pose without these angles.
    """
    pose: Any = document.get("pose")
    orientation_keys = [name for name in (*FORMS, *ANGLES) if isinstance(pose, dict) and name in pose]
    form = next((name for name in orientation_keys if name in FORMS), "")
    if not form:
        return document
    where = f'"{origin}": pose.{form}'
    check_form(coordinates, where)
    if len(orientation_keys) > 1:
        raise InputError(
            f"{where} and pose.{orientation_keys[1]} both say how the platform is turned; leave one of them out."
        )
    rest = {name: value for name, value in pose.items() if name != form}
    return {**document, "pose": {**rest, **single_angles(form, pose[form], where)}}


def single_angles(form: str, value: object, where: str) -> dict[str, float]:
    """Read one orientation: roll, pitch and yaw, rad; see `angles_of`.

    Raises:
        InputError: it is not one of this form.
    """
    angles = angles_of(form, value, where)
    if len(angles["roll"]) != 1:
        raise InputError(f"{where} is {shorten(value)}; give one orientation: {FORMS[form]}.")
    return {name: float(values[0]) for name, values in angles.items()}


def remove_replaced_form(document: Any, settings: Iterable[str], coordinates: Sequence[str], origin: str) -> None:
    """Remove from a document the orientation that overrides replace by another form; the document is changed.

    If one angle of a pose with a quaternion is overridden, the other two angles are those of the quaternion.

    Args:
        document: the document of a machine.
        settings: overrides "path=value", with whole paths.
        coordinates: the coordinates that its [pose] may have.
        origin: names it in messages.

    Raises:
        InputError: an orientation that must be converted first and cannot be read.
    """
    pose = document.get("pose")
    paths = [setting.partition("=")[0].strip() for setting in settings]
    names = {path.split(".")[1] for path in paths if path.startswith("pose.")}
    if not isinstance(pose, dict) or not names & {*FORMS, *ANGLES}:
        return
    if not names & FORMS.keys():
        pose.update(with_angles({"pose": {**pose}}, coordinates, origin)["pose"])
    replaced = FORMS if not names & FORMS.keys() else (*FORMS, *ANGLES)
    for name in [name for name in replaced if name in pose and name not in names]:
        del pose[name]


def numbers_for(
    coordinates: Iterable[str], numbers: Mapping[str, Any], angles_from: Callable[[str, object, str], Mapping[str, Any]]
) -> dict[str, Any]:
    """Return values from Python with roll, pitch and yaw in the place of another form; see `with_values`.

    Args:
        coordinates: the coordinates of the machine's pose.
        numbers: values by name of the field.
        angles_from: `single_angles`, or `angles_of` where there may be several poses.

    Raises:
        InputError: as for files.
    """
    forms = [name for name in numbers if isinstance(name, str) and "." not in _bare(name) and form_of(name)]
    if not forms:
        return dict(numbers)
    check_form(coordinates, forms[0])
    clash = [name for name in numbers if name in forms[1:] or _bare(str(name)) in ANGLES]
    if clash:
        raise InputError(f"{forms[0]} and {clash[0]} both say how the platform is turned; leave one of them out.")
    rest = {name: value for name, value in numbers.items() if name != forms[0]}
    return {**rest, **angles_from(form_of(forms[0]), numbers[forms[0]], forms[0])}


def _bare(name: str) -> str:
    """The name of a coordinate without that of its table."""
    return name.removeprefix("pose.").removeprefix("pose_")


def orientation_schema() -> dict[str, Any]:
    """The JSON Schema of the forms, to stand beside roll, pitch and yaw."""
    row = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    angles: dict[str, Any] = {name: {"type": ["number", "string"]} for name in TILT}
    kinds: dict[str, dict[str, Any]] = {
        "quaternion": {**row, "minItems": 4, "maxItems": 4},
        "rotation": {"type": "array", "items": row, "minItems": 3, "maxItems": 3},
        "tilt": {"type": "object", "properties": angles, "required": [*TILT[:2]], "additionalProperties": False},
    }
    about = "in the place of roll, pitch and yaw"
    return {form: {**kind, "description": f"{FORMS[form]}; {about}"} for form, kind in kinds.items()}

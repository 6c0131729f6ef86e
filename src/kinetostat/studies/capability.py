"""The question of what the drives of a machine can do at its pose: forces, moments and speeds in every direction.

Sets of wrenches and twists as such are in `kinetostatics.feasible`; here they are cut to forces at no moment, moments
at no force, and motions without turning or moving, and put into sentences.

Source: theory (81)-(84). At the tool point, base axes.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.screw import Wrench
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import AnswerInState, MachineState, actuator_loads_at_rest, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.drive_limits import drive_limits
from kinetostat.kinetostatics.feasible import BLOCKS, Transmission, greatest_acceleration, greatest_ball, greatest_speed
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.actuators import name_of
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Machine
from kinetostat.motion.response import response_in_motion
from kinetostat.motion.rigid import plan_of
from kinetostat.numerics.polytopes import reach_along, vertices
from kinetostat.spec.arguments import checked
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.studies.directions import unit_direction
from kinetostat.studies.quantities import refuse_absent
from kinetostat.tolerances import DEPENDENT

SETS = {
    ("wrench", "translation"): ("force", "N"),
    ("wrench", "rotation"): ("moment", "N·m"),
    ("twist", "translation"): ("speed", "m/s"),
    ("twist", "rotation"): ("rate", "rad/s"),
    ("acceleration", "translation"): ("acceleration", "m/s**2"),
    ("acceleration", "rotation"): ("angular acceleration", "rad/s**2"),
}
"""Name and SI unit of the amounts of each set, by what it is about and by the block of components that vary in it."""
PHRASES = {
    "force": "hold {} in whichever direction a force acts",
    "speed": "move the tool at {} in whichever direction",
    "acceleration": "accelerate it by {} in whichever direction",
}
"""Phrases about the least amounts of the sets that the message names; the amount stands in the braces."""
NO_REST_SENTENCE = "{} comes to no stable rest under its loads; `kinetostat analyze --loaded` says why."
"""The answer of a machine that is meant loaded and comes to no rest; its name stands in the braces."""


@dataclass(frozen=True)
class DriveAtPose:
    """A drive at a pose.

    Attributes:
        name: name of the joint that it drives.
        lower, upper: least and greatest load, N or N·m, positive where its joint is pulled open; infinite if not set.
        carried: load that it carries by the loads that count, N or N·m.
        speed: greatest speed, m/s or rad/s; infinite if not set.
        slides: whether it is linear.
    """

    name: str
    lower: float
    upper: float
    carried: float
    speed: float
    slides: bool


@dataclass(frozen=True, eq=False)
class CapabilitySet(ImmutableAnswer):
    """All forces, moments, speeds or angular speeds that the drives allow: a convex polytope about zero.

    Attributes:
        name: "force", "moment", "speed", "rate", "acceleration" or "angular acceleration".
        unit: unit of the amounts, SI.
        least: radius of the largest ball in it, the amount that the drives allow in every direction; negative where
            they do not hold the loads that count already.
        greatest: amount in the best direction; infinite where structure holds it without a drive, NaN where the loads
            that count already are not held or only just.
        weakest: unit vector of the direction in which it is least [3].
        limited_by: names of the drives that are at their limits there.
        normals: rows A of its half-spaces A x <= b [m x 3].
        bounds: their bounds b [m].
        directions: a basis of the directions that it has, as columns [3 x k]: those in which drives limit a load, or
            structure allows a motion.
        vertices: its corners [n x 3]; none where it has no end, or the loads are not held.
    """

    name: str
    unit: str
    least: float
    greatest: float
    weakest: Array
    limited_by: tuple[str, ...]
    normals: Array
    bounds: Array
    directions: Array
    vertices: Array

    def along(self, direction: Sequence[float]) -> float:
        """The greatest amount along a direction, in SI; 0 where the machine cannot move so, NaN if loads are not held.

        Args:
            direction: three numbers of any size, base axes.

        Raises:
            InputError: the direction is zero.
        """
        unit = np.array(unit_direction(direction, "direction"))
        if self.least < 0.0:
            return math.nan
        is_outside = np.linalg.norm(unit - self.directions @ (self.directions.T @ unit)) > DEPENDENT
        if is_outside:
            return math.inf if self.name in ("force", "moment") else 0.0
        return reach_along(self.normals, self.bounds, unit)


@dataclass(frozen=True, eq=False)
class Capability(AnswerInState):
    """The forces, moments and speeds that the drives of a machine allow at its pose.

    Attributes:
        state: state of the machine.
        status: status of the pose.
        message: the answer in a sentence or two.
        drives: drives with their limits and what they carry.
        sets: sets of forces, moments, speeds, angular speeds and accelerations, as far as the file limits drives and
            the machine has them.
        direction: the direction that was asked for, base axes; empty if none.
    """

    state: MachineState
    status: Status
    message: str
    drives: tuple[DriveAtPose, ...] = ()
    sets: tuple[CapabilitySet, ...] = ()
    direction: tuple[float, ...] = ()

    def __repr__(self) -> str:
        return f"<Capability of {self.machine.name!r}: {self.message}>"

    @property
    def loads_left_out(self) -> str:
        """A sentence on the loads of the file that do not count; empty where all do."""
        return self.state.left_out

    def set_of(self, name: str) -> CapabilitySet | None:
        """The set of a name, such as "force"; None where there is none."""
        return next((each for each in self.sets if each.name == name), None)


@checked
def capability(machine: Machine | MachineState, along: Sequence[float] = ()) -> Capability:
    """Find which forces, moments and speeds the drives of a machine allow at its pose.

    Loads come beside those of the file: the platform's to first order, or all of them at rest where `machine.loaded`.

    Args:
        machine: the machine at its pose, or its state; its drives are limited by [limits], and by [load] if they only
            pull.
        along: a direction of interest, base axes; none if empty.

    Raises:
        InputError: nothing limits the drives, or the direction is zero.
    """
    state = state_of(machine)
    direction = tuple(unit_direction(along, "along")) if along else ()
    kinds = limits_of_drives(state)
    if not kinds:
        refuse_absent(state, ["least_wrench_force"])
    if state.status is not Status.OK:
        return Capability(state, state.status, state.refusal)
    if state.machine.loaded and not (state.at_rest is not None and state.stands):
        return Capability(state, Status.NO_REST, NO_REST_SENTENCE.format(state.machine.name))
    response = _with_loads(state)
    drives = _drives(response)
    sets = []
    for block in ("translation", "rotation"):
        wrenches = _wrenches(response, drives, block) if "load" in kinds else None
        twists = _twists(response, drives, block) if "speed" in kinds else None
        accelerations = _accelerations(response, drives, block) if "load" in kinds else None
        sets += [each for each in (wrenches, twists, accelerations) if each is not None]
    return Capability(
        state=state,
        status=Status.OK,
        message=_message(state.machine, sets),
        drives=drives,
        sets=tuple(sets),
        direction=direction,
    )


def limits_of_drives(state: MachineState) -> set[str]:
    """Return which of "load" and "speed" the file of a machine limits of its drives; none where it limits neither."""
    drives = drive_limits(state.machine, state.configuration)
    limits_loads = any(is_set(drive.lower) or is_set(drive.upper) for drive in drives)
    limits_speeds = any(is_set(drive.speed) for drive in drives)
    return ({"load"} if limits_loads else set()) | ({"speed"} if limits_speeds else set())


def _with_loads(state: MachineState) -> Response:
    """The machine at its pose, with loads by accelerations, and what its drives carry at rest where it is meant so."""
    plan = plan_of(state.machine, state.configuration, state.joints)
    response = response_in_motion(state.machine, state.free, state.joints, plan, ["least_acceleration"])
    if not state.machine.loaded or state.at_rest is None:
        return response
    carried = [float(load[0]) for _, load in actuator_loads_at_rest(state.at_rest)]
    return replace(response, loaded={"drive_loads": carried})


def _drives(response: Response) -> tuple[DriveAtPose, ...]:
    return tuple(
        DriveAtPose(
            name=name_of(drive.spring),
            lower=float(drive.lower),
            upper=float(drive.upper),
            carried=float(carried),
            speed=float(drive.speed),
            slides=drive.spring.joint.point is None,
        )
        for drive, carried in zip(response.drives, response.drive_loads, strict=True)
    )


def _wrenches(response: Response, drives: Sequence[DriveAtPose], block: str) -> CapabilitySet:
    """The forces at no moment, or the moments at no force, that the drives hold beside the loads that count."""
    part = BLOCKS[block]
    length = float(response.configuration.length)
    normals, bounds, names = [], [], []
    for face in response.faces:
        normal = np.array(face.normal.components(), dtype=float)
        size = np.linalg.norm(normal * np.repeat([length, 1.0], 3))
        if np.linalg.norm(normal[part]) * (length if block == "rotation" else 1.0) <= DEPENDENT * size:
            continue
        for sign, bound in ((1.0, face.upper), (-1.0, -face.lower)):
            normals.append(sign * normal[part])
            bounds.append(float(bound))
            names.append(tuple(drives[drive].name for drive in face.drives))
    matrix = np.array(normals).reshape(-1, 3)
    least = float(greatest_ball(response.faces, part, length))
    return _set(("wrench", block), least, matrix, np.array(bounds), _row_space(matrix), names)


def _twists(response: Response, drives: Sequence[DriveAtPose], block: str) -> CapabilitySet | None:
    """The velocities without turning, or the turns about the tool point, that the drives allow; None if it has none."""
    motions = _motions(response.transmission, block)
    if motions is None:
        return None
    directions, rates = motions
    moves = np.linalg.norm(rates, axis=1) > DEPENDENT * np.linalg.norm(rates, axis=1).max(initial=0.0)
    speeds = np.array([drive.speed for drive in drives])
    names = [(drive.name,) for drive, takes_part in zip(drives, moves, strict=True) if takes_part]
    least = float(greatest_speed(response.transmission, speeds.tolist(), BLOCKS[block]))
    matrix, bounds = np.vstack([rates[moves], -rates[moves]]), np.tile(speeds[moves], 2)
    return _set(("twist", block), least, matrix, bounds, directions, names * 2)


def _accelerations(response: Response, drives: Sequence[DriveAtPose], block: str) -> CapabilitySet | None:
    """The accelerations from rest that the drives allow, without turning or of turns alone.

    Friction does not count. None if it has none, or nothing that moves so has a mass.
    """
    directions = _null_space(_block_of(response.transmission.constraints, block), response.transmission, block)
    if not response.acceleration_faces or not directions.shape[1]:
        return None
    normals = np.array([face.normal.components() for face in response.acceleration_faces], dtype=float)
    rows = normals[:, BLOCKS[block]] @ directions @ directions.T
    sizes = np.linalg.norm(rows, axis=1)
    limiting = np.flatnonzero(sizes > DEPENDENT * sizes.max(initial=0.0))
    if not len(limiting):
        return None
    faces = [response.acceleration_faces[number] for number in limiting]
    names = [tuple(drives[drive].name for drive in face.drives) for face in faces]
    matrix = np.vstack([rows[limiting], -rows[limiting]])
    bounds = np.array([float(face.upper) for face in faces] + [-float(face.lower) for face in faces])
    least = float(greatest_acceleration(response.acceleration_faces, response.transmission, BLOCKS[block]))
    return _set(("acceleration", block), least, matrix, bounds, directions, names * 2)


def _set(
    subject_and_block: tuple[str, str],
    least: float,
    normals: Array,
    bounds: Array,
    directions: Array,
    names: Sequence[tuple[str, ...]],
) -> CapabilitySet:
    """The set of all amounts a with normals a <= bounds, and how far it reaches.

    Args:
        subject_and_block: a key of `SETS`.
        least: radius of the largest ball in the set.
        normals, bounds: normals and bounds of its faces [faces x 3], [faces].
        directions: an orthonormal basis of the directions that it extends in [3 x k].
        names: names of the drives that are at their bounds in each face.
    """
    name, unit = SETS[subject_and_block]
    sizes = np.linalg.norm(normals, axis=1)
    reaches = bounds / sizes
    has_room = least > 0.0
    in_directions = vertices((normals / sizes[:, None]) @ directions, reaches) if has_room and len(bounds) else None
    corners = np.zeros((0, 3)) if in_directions is None else in_directions @ directions.T
    without_corners = math.inf if has_room else math.nan
    worst = int(np.argmin(reaches)) if np.isfinite(least) else None  # number of the face that limits the least amount
    return CapabilitySet(
        name=name,
        unit=unit,
        least=least,
        greatest=float(np.linalg.norm(corners, axis=1).max()) if len(corners) else without_corners,
        weakest=np.zeros(0) if worst is None else normals[worst] / sizes[worst],
        limited_by=() if worst is None else names[worst],
        normals=normals,
        bounds=bounds,
        directions=directions,
        vertices=corners,
    )


def _row_space(matrix: Array) -> Array:
    """An orthonormal basis of the directions that some row feels [3 x k]."""
    if not len(matrix):
        return np.zeros((3, 0))
    _, values, rows = np.linalg.svd(matrix, full_matrices=False)
    return np.asarray(rows[values > DEPENDENT * values[0]].T)


def _motions(transmission: Transmission, block: str) -> tuple[Array, Array] | None:
    """The motions of the platform in a block that structure allows, and the rates of the drives.

    Returns:
        An orthonormal basis of the motions [3 x k], and the rates per unit of each component of the block, along these
        motions [drives x 3]; None where there are none, or the rates of the drives do not follow from them.
    """
    if transmission.wrenches is None:
        return None
    directions = _null_space(_block_of(transmission.constraints, block), transmission, block)
    if not directions.shape[1]:
        return None
    return directions, _block_of(transmission.wrenches, block) @ directions @ directions.T


def _block_of(wrenches: Sequence[Wrench], block: str) -> Array:
    """Components of wrenches in a block [n x 3]."""
    return np.array([wrench.components() for wrench in wrenches], dtype=float).reshape(-1, 6)[:, BLOCKS[block]]


def _null_space(stopped: Array, transmission: Transmission, block: str) -> Array:
    """An orthonormal basis of the directions that no wrench of structure stops [3 x k]."""
    scaled = stopped / float(transmission.length) if block == "rotation" else stopped
    if not len(scaled):
        return np.eye(3)
    _, values, rows = np.linalg.svd(scaled)
    return np.asarray(rows[int((values > DEPENDENT).sum()) :].T)


def _message(machine: Machine, sets: Sequence[CapabilitySet]) -> str:
    if any(each.least < 0.0 for each in sets):
        return "The drives do not hold the loads that count already."
    phrases = [
        PHRASES[each.name].format(machine.display.show(each.least, each.unit))
        for each in sets
        if each.name in PHRASES and math.isfinite(each.least)
    ]
    if not phrases:
        return "No drive limits a force or a speed of the tool here."
    *first, last = phrases
    return f"The drives {', '.join(first)} and {last}." if first else f"The drives {last}."

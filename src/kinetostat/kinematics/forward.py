"""Forward kinematics: the poses that a machine can take while its actuators stand at given coordinates.

The equations are those of the inverse way. A family in closed form says where its actuators stand at a pose, and its
pose is sought at which they stand right; legs written joint by joint must close while their actuated joints are held.
Both are solved from many starts at once by damped least squares (Levenberg and Marquardt), whose steps are Newton's
near a solution. One set of coordinates may have several solutions, the assembly modes; the present one is followed from
the pose of the machine.

Source: theory section 6, (19) for legs that close. In the base frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Displacement
from kinetostat.arrays import Array, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import (
    ANGLES,
    Joints,
    gaps_at,
    leg_ends,
    pose_coordinates,
    squared_distance,
    units_of,
)
from kinetostat.kinematics.status import Status
from kinetostat.late import LateModule
from kinetostat.machine.actuators import Actuator, actuators_of, joint_actuators
from kinetostat.machine.column import column, stacked_columns
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, parameters, values, with_values
from kinetostat.numerics.iteration import least_squares
from kinetostat.tolerances import CLOSED, NEWTON_SETTLED, ONE_PLACEMENT, UNDRIVEN

if TYPE_CHECKING:
    from kinetostat.kinematics import closure
else:
    closure = LateModule("kinetostat.kinematics.closure")

MOST_DAMPED_STEPS = 60
"""Number of steps of damped least squares: a start that has not arrived by then is in no solution's reach."""
CENTRAL_DIFFERENCE = 1e-6
"""Step of central differences, rad or in units of the machine's length: their error is its square, 1e-12, and round-off
adds about 1e-16 over the step; rates of ten digits are more than steps need."""
STRIDE = 0.05
"""Motion of the actuators in one step on the way from the pose of the machine, rad or in units of its length: from one
step to the next, Newton's method stays with the solution."""
MOST_STRIDES = 400
"""Most steps of a way, which are some three turns; a longer way is gone in longer steps."""
LEAP = 0.5
"""Change of an unknown in one of these steps that shows a jump to another solution: ten times that of the actuators,
which a machine only exceeds beside a singularity."""


@dataclass(frozen=True)
class AssemblyMode:
    """A pose at which the actuators stand at the given coordinates.

    Attributes:
        pose: the coordinates of the machine's [pose], m and rad.
        placement: the placement of the platform, base frame.
        residual: the largest difference of an actuator from its coordinate, or gap of a leg, rad or in units of the
            machine's length.
        joints: its joint coordinates, of a machine written leg by leg: m and rad from the home pose.
        present: whether the machine comes to it from its own pose if its actuators move evenly, without passing a
            singularity.
        by_pose: whether the machine at this `pose` has its actuators there. A machine written leg by leg stays in the
            assembly mode of its home pose, and a pose may belong to another one.
    """

    pose: dict[str, float]
    placement: Displacement
    residual: float
    joints: Joints | None = None
    present: bool = False
    by_pose: bool = True


class System(Protocol):
    """Equations whose solutions are assembly modes; unknowns are in rad and in units of the machine's length."""

    length: float
    start: Array
    actuators: Sequence[Actuator]

    def residuals(self, unknowns: Array, goal: Array) -> tuple[Array, Array]:
        """Residuals of the equations [n x m], and how the unknowns reduce them [n x m x unknowns].

        Args:
            unknowns: [n x unknowns].
            goal: coordinates of the actuators [actuators], or others in each row [n x actuators].
        """

    def placements(self, unknowns: Array, goal: Array, /) -> list[Displacement]:
        """Placements of the platform at unknowns [n x unknowns] and actuators [actuators]."""

    def poses(self, unknowns: Array, goal: Array, /) -> dict[str, Array]:
        """Coordinates of the machine's [pose], m and rad [n], at unknowns [n x unknowns]; goal as of `residuals`."""

    def mode(self, unknowns: Array, goal: Array) -> AssemblyMode:
        """The assembly mode that the unknowns [unknowns] of one solution mean; goal [actuators]."""

    def by_pose(self, poses: Sequence[Mapping[str, float]], goal: Array, /) -> list[bool]:
        """Whether the machine at each of these poses has its actuators at their coordinates [actuators]."""

    def drift(self) -> Array:
        """Twists of the platform per unknown at the pose of the machine [6 x unknowns]."""


class ByPose:
    """A family in closed form: unknown are the coordinates of its pose.

    Attributes:
        length: length of the machine, m.
        start: the unknowns at its pose.
        actuators: coordinates of the actuators there.
    """

    def __init__(self, machine: Machine) -> None:
        self.machine, configuration = machine, machine.configure()
        self.length = float(configuration.length)
        self.kinds = {p.path: p.quantity.kind for p in parameters(machine.family) if p.path.startswith(POSE)}
        self.units = np.array([self.length if kind == "length" else 1.0 for kind in self.kinds.values()])
        self.actuators: Sequence[Actuator] = actuators_of(configuration)
        self.slides = np.array([actuator.slides for actuator in self.actuators], dtype=bool)
        numbers = values(machine)
        self.start = np.array([float(numbers[path]) for path in self.kinds]) / self.units

    def _with_unknowns(self, unknowns: Array) -> Machine:
        return with_values(self.machine, dict(zip(self.kinds, (unknowns * self.units).T, strict=True)))

    def _missing(self, unknowns: Array, goal: Array) -> Array:
        """Differences of the actuators from their goals [n x actuators]; NaN where a leg does not reach."""
        actuators = actuators_of(self._with_unknowns(unknowns).configure())
        return _differences(self, goal, [actuator.coordinate for actuator in actuators], len(unknowns))

    def residuals(self, unknowns: Array, goal: Array) -> tuple[Array, Array]:
        """See `System`; the rates [n x actuators x unknowns] are central differences, all of them in one batch."""
        count, size = unknowns.shape
        shifts = CENTRAL_DIFFERENCE * np.concatenate([np.zeros((1, size)), np.eye(size), -np.eye(size)])
        goals = np.repeat(np.broadcast_to(goal, (count, goal.shape[-1])), len(shifts), axis=0)
        missing = self._missing((unknowns[:, None] + shifts).reshape(-1, size), goals).reshape(count, len(shifts), -1)
        unshifted, forward, backward = missing[:, 0], missing[:, 1 : size + 1], missing[:, size + 1 :]
        return unshifted, np.swapaxes((backward - forward) / (2.0 * CENTRAL_DIFFERENCE), 1, 2)

    def placements(self, unknowns: Array, _goal: Array) -> list[Displacement]:
        """See `System` [n x unknowns]."""
        poses = [dict(zip(self.kinds, row.tolist(), strict=True)) for row in unknowns * self.units]
        return [with_values(self.machine, pose).configure().platform for pose in poses]

    def poses(self, unknowns: Array, _goal: Array) -> dict[str, Array]:
        """See `System` [n x unknowns]; of angles that give one orientation, the smallest are chosen."""
        columns = zip(self.kinds, (unknowns * self.units).T, strict=True)
        result = {path.removeprefix(POSE): np.array(column) for path, column in columns}
        for path in (path.removeprefix(POSE) for path, kind in self.kinds.items() if kind == "angle"):
            result[path] = np.arctan2(np.sin(result[path]), np.cos(result[path]))
        if set(ANGLES) <= result.keys():
            pose = pose_coordinates(self._with_unknowns(unknowns).configure().platform)
            result |= {name: np.broadcast_to(pose[name], (len(unknowns),)) for name in ANGLES}
        return result

    def mode(self, unknowns: Array, goal: Array) -> AssemblyMode:
        """See `System` [unknowns]."""
        (placement,) = self.placements(unknowns[None], goal)
        pose = {name: float(entry[0]) for name, entry in self.poses(unknowns[None], goal).items()}
        return AssemblyMode(pose, placement, float(np.abs(self._missing(unknowns[None], goal)).max(initial=0.0)))

    def by_pose(self, poses: Sequence[Mapping[str, float]], _goal: Array) -> list[bool]:
        """See `System`, [actuators]: there is one assembly mode of the legs for each pose."""
        return [True] * len(poses)

    def drift(self) -> Array:
        """See `System` [6 x unknowns]: no coordinate of a pose leaves the platform where it is."""
        return np.eye(self.start.size)


class LegByLeg:
    """A machine written leg by leg: unknown are its passive joint coordinates.

    Attributes:
        length: length of the machine, m.
        start: the unknowns at its pose, or at its home pose where the legs cannot close.
        actuators: coordinates of the actuators there.
    """

    def __init__(self, machine: Machine) -> None:
        self.machine, self.chains = machine, machine.chains()
        self.length = float(self.chains.length)
        self.driven = joint_actuators(self.chains, leg_names(machine))
        self.slides = np.array([actuator.slides for actuator in self.driven], dtype=bool)
        places = [actuator.place for actuator in self.driven]
        self.free = np.array([i for i in range(self.chains.size) if i not in places], dtype=int)
        self.units = units_of(self.chains, np.array([self.length]))[0][self.free]
        joints = closure.solve_joints(machine)
        closes = int(joints.status) in (Status.OK, Status.SINGULAR)
        self.joints = np.array(joints.coordinates if closes else [0.0] * self.chains.size, dtype=float)
        self.actuators: Sequence[Actuator] = [actuator.at(self.joints.tolist()) for actuator in self.driven]
        self.start = self.joints[self.free] / self.units

    def _whole(self, unknowns: Array, goal: Array) -> Array:
        """All joint coordinates, m and rad [n x coordinates]."""
        joints = np.empty((len(unknowns), self.chains.size))
        joints[:, self.free] = unknowns * self.units
        for actuator, coordinates in zip(self.driven, np.moveaxis(goal, -1, 0), strict=True):
            joints[:, actuator.place] = actuator.joint_coordinate(coordinates)
        return joints

    def residuals(self, unknowns: Array, goal: Array) -> tuple[Array, Array]:
        """See `System`; the rates [n x gaps x unknowns] are the twists of the passive joints."""
        gaps = gaps_at(self.chains, self._whole(unknowns, goal))
        return gaps.closure, gaps.closure_rates[:, :, self.free]

    def placements(self, unknowns: Array, goal: Array) -> list[Displacement]:
        """See `System` [n x unknowns]."""
        return [leg_ends(self.chains, row.tolist())[0].platform for row in self._whole(unknowns, goal)]

    def poses(self, unknowns: Array, goal: Array) -> dict[str, Array]:
        """See `System` [n x unknowns]."""
        joints = self._whole(unknowns, goal)
        coordinates = pose_coordinates(leg_ends(self.chains, [column(c) for c in joints.T])[0].platform)
        return {name: np.broadcast_to(coordinates[name], (len(joints),)) for name in self.chains.pose}

    def mode(self, unknowns: Array, goal: Array) -> AssemblyMode:
        """See `System` [unknowns]."""
        joints, (placement,) = self._whole(unknowns[None], goal)[0], self.placements(unknowns[None], goal)
        pose = {name: float(entry[0]) for name, entry in self.poses(unknowns[None], goal).items()}
        gap, _ = self.residuals(unknowns[None], goal)
        residual = float(np.abs(gap).max(initial=0.0))
        placed_joints = Joints(tuple(joints.tolist()), int(Status.OK))
        return AssemblyMode(pose, placement, residual, placed_joints)

    def by_pose(self, poses: Sequence[Mapping[str, float]], goal: Array) -> list[bool]:
        """See `System` [actuators]."""
        columns = {f"{POSE}{name}": np.array([pose[name] for pose in poses]) for name in self.chains.pose}
        solved = closure.solve_joints(with_values(self.machine, columns))
        amounts = [actuator.at(solved.coordinates).coordinate for actuator in self.driven]
        missing = _differences(self, goal, amounts, len(poses))
        close = np.abs(missing).max(axis=1, initial=0.0) < ONE_PLACEMENT
        return [bool(same) for same in close & (np.asarray(solved.status) == Status.OK)]

    def drift(self) -> Array:
        """See `System` [6 x unknowns]."""
        gaps = gaps_at(self.chains, self.joints[None])
        return np.asarray(gaps.platform_rates[0][:, self.free])


def _differences(system: ByPose | LegByLeg, goal: Array, coordinates: Sequence[Scalar], count: int) -> Array:
    """Differences of actuators from their goals, in units of the length or within half a turn, rad [n x actuators]."""
    missing = goal - stacked_columns(coordinates, count)
    return np.where(system.slides, missing / system.length, np.arctan2(np.sin(missing), np.cos(missing)))


def leg_names(machine: Machine) -> list[str]:
    """The names of the legs of a machine written leg by leg, in order."""
    return [leg.name for leg in machine.configure((0.0,) * machine.chains().size).legs]


def system_of(machine: Machine) -> System:
    """The equations of a machine; its pose is where the search begins."""
    return LegByLeg(machine) if machine.family.chains else ByPose(machine)


def stand(machine: Machine, joints: Joints | None = None) -> list[Actuator]:
    """Coordinates of the actuators of a machine at its pose: the inverse of forward kinematics.

    Args:
        machine: the machine with its pose.
        joints: its joint coordinates, if it is written leg by leg and they are known.
    """
    if machine.family.chains is None:
        return actuators_of(machine.configure())
    coordinates = (joints or closure.solve_joints(machine)).coordinates
    return [actuator.at(coordinates) for actuator in joint_actuators(machine.chains(), leg_names(machine))]


def undriven(system: System) -> bool:
    """Whether the platform can move at the pose of the machine while all actuators stand still."""
    rates = system.residuals(system.start[None], _coordinates(system))[1][0]
    if not np.isfinite(rates).all() or rates.shape[1] == 0:
        return False
    _, values, motions = np.linalg.svd(rates, full_matrices=True)
    sizes = np.zeros(len(motions))
    sizes[: len(values)] = values
    idle_motions = motions[sizes < UNDRIVEN * max(sizes.max(), 1.0)]
    return bool(np.abs(system.drift() @ idle_motions.T).max(initial=0.0) > UNDRIVEN)


def assembly_modes(system: System, goal: Array, starts: int, spread: float) -> list[AssemblyMode]:
    """Search for the assembly modes near the pose of a machine.

    Args:
        system: the equations of the machine.
        goal: coordinates of its actuators [actuators], m and rad.
        starts: number of random starts beside the pose itself.
        spread: their greatest distance from it, rad and in units of the machine's length.

    Returns:
        Each mode once, the present one first, then in the order of their distance from the pose of the machine.
    """
    # The seed is fixed, so that the modes that are found never depend on chance.
    shifts = np.random.default_rng(0).uniform(-spread, spread, (starts, system.start.size))
    with np.errstate(all="ignore"):
        ends, arrived = _ends_of_ways(system, goal[None])
        first = [*ends[arrived], system.start]
        unknowns, largest = _solutions(system, np.concatenate([first, system.start + shifts]), goal)
    solutions = unknowns[largest < CLOSED]
    places = system.placements(solutions, goal)
    (present,) = system.placements(system.start[None], _coordinates(system))
    order = np.argsort([squared_distance(place, present, system.length) for place in places], kind="stable")
    kept = [0] if arrived[0] else []
    for i in order.tolist():
        if all(squared_distance(places[i], places[k], system.length) > ONE_PLACEMENT**2 for k in kept):
            kept.append(i)
    modes = [system.mode(solutions[i], goal) for i in kept]
    flags = system.by_pose([mode.pose for mode in modes], goal) if modes else []
    return [
        replace(mode, present=bool(arrived[0]) and i == 0, by_pose=by_pose)
        for i, (mode, by_pose) in enumerate(zip(modes, flags, strict=True))
    ]


def _coordinates(system: System) -> Array:
    """Coordinates of the actuators at the pose of the machine, m and rad [actuators]."""
    return np.array([actuator.coordinate for actuator in system.actuators], dtype=float)


def poses_at(system: System, goals: Array) -> tuple[dict[str, Array], Mask]:
    """Find the poses of a machine at many coordinates of its actuators, all of them at once.

    They are those to which it comes from its own pose if all actuators move evenly, or where a singularity is on the
    way, those that a search from there comes to.

    Args:
        system: the equations of the machine.
        goals: coordinates of its actuators [n x actuators], m and rad.

    Returns:
        Coordinates of its [pose], m and rad [n], and where there is such a pose [n].
    """
    with np.errstate(all="ignore"):
        unknowns, arrived = _ends_of_ways(system, goals)
        lost = np.flatnonzero(~arrived)
        if lost.size:
            unknowns[lost], largest = _solutions(system, np.tile(system.start, (len(lost), 1)), goals[lost])
            arrived[lost] = largest < CLOSED
        return system.poses(unknowns, goals), arrived


def _ends_of_ways(system: System, goals: Array) -> tuple[Array, Mask]:
    """Follow a machine from its pose while all actuators move evenly to goals [n x actuators].

    Returns:
        The unknowns it comes to [n x unknowns], and whether it does without passing a singularity [n].
    """
    start, unknowns = _coordinates(system), np.tile(system.start, (len(goals), 1))
    scale = np.array([system.length if actuator.slides else 1.0 for actuator in system.actuators])
    is_open = np.asarray(np.isfinite(goals - start).all(axis=1))  # the way, as far as it has been gone
    way = np.where(is_open[:, None], goals - start, 0.0)
    steps = int(np.clip(np.ceil(np.abs(way / scale).max(initial=0.0) / STRIDE), 1, MOST_STRIDES))
    last_signs = np.zeros(len(goals))
    for step in range(steps + 1):
        rows = np.flatnonzero(is_open)
        if not rows.size:
            break
        target = start + way[rows] * (step / steps)
        solution, largest = _solutions(system, unknowns[rows], target, NEWTON_SETTLED if step == steps else CLOSED)
        rates = system.residuals(solution, target)[1]
        # The determinant changes its sign at a singularity.
        signs = np.sign(np.linalg.det(rates)) if rates.shape[1] == rates.shape[2] else np.zeros(len(rows))
        change = np.abs(solution - unknowns[rows]).max(axis=1, initial=0.0)
        is_open[rows] = (largest <= CLOSED) & (change <= LEAP) & ~(signs * last_signs[rows] < 0.0)
        unknowns[rows], last_signs[rows] = solution, signs
    return unknowns, is_open


def _solutions(
    system: System, starts: Array, goal: Array, residual_goal: float = NEWTON_SETTLED
) -> tuple[Array, Array]:
    """Solve from many starts at once until no more than `residual_goal` is left of any equation.

    Returns:
        Unknowns [n x unknowns], and the largest of what is left of the equations [n].
    """
    goals = np.broadcast_to(goal, (len(starts), goal.shape[-1]))
    end = least_squares(
        lambda unknowns, rows: system.residuals(unknowns, goals[rows]), starts, most_steps=MOST_DAMPED_STEPS,
        residual_goal=residual_goal, acceptable_residual=CLOSED,
    )  # fmt: skip
    return end.value, end.residual

"""The numbers of a machine that bring its platform, or a joint of a plate, to where a designer pulls it.

Every family has coordinates and fields of its own. So the numbers are computed by least squares over those that move
the part at all; nothing is known here of what they mean, and nothing of the page.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from kinetostat.algebra.vector import IDENTITY, Displacement, Rotation, Vector, rotation_along
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import rotation_between
from kinetostat.machine.common_tables import DYNAMIC_FIELDS
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.views.scene.anatomy import anatomy

MOVES, TURNS = ("x", "y", "z"), ("rx", "ry", "rz")
"""Axes of the base along which a platform can be pulled, and about which it can be turned."""
PLATFORM, BASE, HEAD = "platform", "base", "head"
"""Kinds of handles: of the whole platform, of a joint on the base, or of a joint on the platform."""
HOLDING_WEIGHT = 0.03
"""Weight of what should stay (the orientation under a push, the place under a turn) against what is pulled."""
LEAST_FOLLOWED = 0.5
"""Share of a unit pull along or about an axis that a platform must be able to follow, so that it is free there."""
MOST_ASIDE = 5.0
"""Motion aside that such a pull may cause, in units of the machine's length or rad: more of it looks like flight."""
FAINT_EFFECT = 1e-3
"""Share of the largest effect on a part from which a number counts as one that moves it."""
DIFFERENCE_STEP = 1e-6
"""Step of forward differences, in units of the machine's length or in rad: slopes keep about six digits."""
MOST_PULL_STEPS = 6
"""Greatest number of steps of a pull: the next position of the pointer goes on from where these have led."""
MOST_HALVINGS = 4
"""Greatest number of halvings of a step: what a sixteenth of it does not improve, the pull does not move."""
SAME_PLACE = 1e-7
"""Residual, in units of the machine's length, at which the part is where it was pulled: far less than a pixel."""
DECIMALS = 9
"""Decimals of metres and radians to which pulled numbers are rounded: finer than anybody can pull."""
NO_MOTION = 1e-6
"""Singular values below this share of the largest count as zero: motions that no number can make."""
NOT_GEOMETRY = ("pose.", "tool.", "load.", "limits.", "sections.", *DYNAMIC_FIELDS)
"""Beginnings of the paths of numbers that do not change where a joint of a leg is."""


@dataclass(frozen=True)
class Handle:
    """A handle of the picture that can be pulled.

    Attributes:
        kind: `PLATFORM`, `BASE` or `HEAD`.
        leg: name of the leg whose joint it is; empty for the platform.
        point: its place, base frame, m.
        axes: those of `MOVES` and `TURNS` along or about which the platform can be pulled; a joint moves in its plate.
    """

    kind: str
    leg: str
    point: Vector
    axes: tuple[str, ...] = ()

    def as_data(self) -> dict[str, Any]:
        """Convert it to plain data for the browser."""
        point = [float(c) for c in self.point.components()]
        return {"of": self.kind, "leg": self.leg, "point": point, "axes": list(self.axes)}


@dataclass(frozen=True)
class Pull:
    """A wish of the designer.

    Attributes:
        machine: the machine as it is now.
        kind, leg: those of the handle that is pulled.
        axis: the axis of a platform's handle, one of `MOVES` or `TURNS`.
        goal: the place where the platform should be; the joint of a leg should be at its translation.
    """

    machine: Machine
    kind: str
    leg: str
    axis: str
    goal: Displacement


def handles(configuration: Configuration, axes: tuple[str, ...]) -> list[Handle]:
    """Return the handles: of the platform at P along some axes, and of the joints of actuated legs.

    A joint on the base that slides on a rail has none.
    """
    legs = [part for leg in configuration.legs if (part := anatomy(leg)).actuated]
    joints = [Handle(BASE, leg.leg, leg.foot) for leg in legs if not leg.on_rail]
    joints += [Handle(HEAD, leg.leg, leg.head) for leg in legs]
    return [Handle(PLATFORM, "", configuration.platform.translation, axes), *joints]


def free_axes(machine: Machine) -> tuple[str, ...]:
    """Return the axes of the base along and about which the coordinates of the pose can move the platform."""
    now = state_of(machine).configuration
    length = float(now.length)
    slopes = _slopes(_Problem(machine, _pose(machine), length, lambda moved: _motion(moved, now.platform, length)))
    return tuple(axis for k, axis in enumerate((*MOVES, *TURNS)) if _follows(slopes, k, _weights(axis)))


def _follows(slopes: Array, k: int, weights: Array) -> bool:
    """Return whether the pose can follow a unit pull along or about the axis `k`, without running away aside."""
    wish = np.eye(6)[k]
    motion = slopes @ np.linalg.lstsq(weights[:, None] * slopes, weights * wish, rcond=NO_MOTION)[0]
    return bool(motion[k] > LEAST_FOLLOWED and np.abs(motion - wish).max() < MOST_ASIDE)


def _weights(axis: str) -> Array:
    """Return what counts of the platform's motion under a pull: the place under a push, the turn under a turn."""
    return np.array([1.0] * 3 + [HOLDING_WEIGHT] * 3 if axis in MOVES else [HOLDING_WEIGHT] * 3 + [1.0] * 3)


def numbers_after_pull(pull: Pull) -> dict[str, float]:
    """Return the numbers, by leaf path, that bring a part as near as possible to where it is pulled.

    Of a platform the coordinates of the pose change, of a joint the geometry. What the pull is not about should stay: a
    machine that can turn while it moves keeps its orientation, and one that cannot lets it follow.
    """
    machine, now = pull.machine, state_of(pull.machine).configuration
    length = float(now.length)
    if pull.kind == PLATFORM:
        weights = _weights(pull.axis)
        return _solution_of(
            _Problem(machine, _pose(machine), length, lambda moved: weights * _motion(moved, pull.goal, length))
        )
    goal, is_on_base = pull.goal.translation, pull.kind == BASE
    # A joint of the platform is compared in the platform's axes: its place there is geometry, whatever the pose.
    goal_in_plate = goal if is_on_base else now.platform.inverse().apply(goal)

    def distance(configuration: Configuration) -> Array:
        part = anatomy(next(leg for leg in configuration.legs if leg.name == pull.leg))
        point_in_plate = part.foot if is_on_base else configuration.platform.inverse().apply(part.head)
        return np.array((point_in_plate - goal_in_plate).components(), dtype=float) / length

    return _solution_of(_Problem(machine, _geometry(machine, pull.leg), length, distance))


@dataclass(frozen=True)
class _Problem:
    """Numbers that may change, and what is to vanish.

    Attributes:
        machine: the machine as it is before the pull.
        unknowns: the kind of each number, "length" or "angle", by its leaf path.
        length: the machine's length, m.
        residual: what is to vanish at a configuration, in units of that length or rad.
    """

    machine: Machine
    unknowns: dict[str, str]
    length: float
    residual: Callable[[Configuration], Array]

    def at(self, numbers: Array) -> Array:
        """Return the residual of the machine with these numbers, SI; NaN where it is out of reach."""
        changes = dict(zip(self.unknowns, numbers.tolist(), strict=True))
        return self.residual(state_of(with_values(self.machine, changes)).configuration)

    @property
    def start(self) -> Array:
        present = values(self.machine)
        return np.array([float(present[path]) for path in self.unknowns])

    @property
    def units(self) -> Array:
        """Size of each unknown: the machine's length, or a radian."""
        return np.array([self.length if kind == "length" else 1.0 for kind in self.unknowns.values()])


def _solution_of(problem: _Problem) -> dict[str, float]:
    """Go downhill by Gauss and Newton; a step that leads out of reach, or uphill, is halved."""
    numbers, units = problem.start, problem.units
    residual, effective = problem.at(numbers), np.zeros(len(numbers), dtype=bool)
    for _ in range(MOST_PULL_STEPS):
        if not np.isfinite(residual).all() or np.abs(residual).max() < SAME_PLACE:
            break
        slopes = _slopes(problem, numbers, residual)
        effective = effective | slopes.any(axis=0)
        step = units * np.linalg.lstsq(slopes, -residual, rcond=NO_MOTION)[0]
        for _ in range(MOST_HALVINGS):
            new_residual = problem.at(numbers + step)
            if np.isfinite(new_residual).all() and np.linalg.norm(new_residual) < np.linalg.norm(residual):
                break
            step = 0.5 * step
        else:
            break  # no step leads nearer: the numbers stay where they are
        numbers, residual = numbers + step, new_residual
    # What has moved less than a residual may be left is round-off: it stays as it was written, to the last digit.
    start = problem.start
    numbers = np.where(np.abs(numbers - start) > SAME_PLACE * units, np.round(numbers, DECIMALS), start)
    # All numbers that have an effect, changed or not: a whole pull changes the same ones, and is one step to undo.
    return {path: float(n) for path, n, counts in zip(problem.unknowns, numbers, effective, strict=True) if counts}


def _slopes(problem: _Problem, numbers: Array | None = None, residual: Array | None = None) -> Array:
    """Differentiate the residual by each unknown in its unit [residuals x unknowns]; 0 where it has no effect."""
    numbers = problem.start if numbers is None else numbers
    residual = problem.at(numbers) if residual is None else residual
    columns = []
    for k, unit in enumerate(problem.units):
        ahead = numbers.copy()
        ahead[k] += DIFFERENCE_STEP * unit
        columns.append((problem.at(ahead) - residual) / DIFFERENCE_STEP)
    slopes = np.nan_to_num(np.array(columns, dtype=float).T.reshape(len(residual), len(columns)))
    effects = np.linalg.norm(slopes, axis=0)
    return slopes * (effects > FAINT_EFFECT * effects.max(initial=0.0))


def _pose(machine: Machine) -> dict[str, str]:
    return _fields(machine, lambda path: path.startswith("pose."))


def _geometry(machine: Machine, leg: str) -> dict[str, str]:
    """Return the lengths and angles of the machine itself; of a machine written leg by leg, those of one leg."""
    if machine.family.chains is None:
        return _fields(machine, lambda path: not path.startswith(NOT_GEOMETRY))
    tables = (f"legs.{leg}.", "geometry.")
    return _fields(machine, lambda path: path.startswith(tables) and not path.startswith(NOT_GEOMETRY))


def _fields(machine: Machine, is_chosen: Callable[[str], bool]) -> dict[str, str]:
    """Return the kind of each length or angle whose leaf path is chosen."""
    return {
        leaf: parameter.quantity.kind
        for parameter in parameters(machine.family)
        for leaf in parameter.leaves
        if parameter.quantity.kind in ("length", "angle") and is_chosen(leaf)
    }


def _motion(configuration: Configuration, goal: Displacement, length: float) -> Array:
    """Return the motion from a goal to the platform: translation in units of the machine's length, small turn."""
    platform = configuration.platform
    offset = (platform.translation - goal.translation) * (1.0 / length)
    turn = rotation_between(goal.rotation, platform.rotation)
    return np.array([*offset.components(), *turn.components()], dtype=float)


def goal_of(start: Displacement, axis: str, amount: float) -> Displacement:
    """Return a platform's place after a move (m) along, or a turn (rad) about, an axis of the base through P."""
    direction = (Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0))["xyz".index(axis[-1])]
    if axis in MOVES:
        return Displacement(start.rotation, start.translation + direction * amount)
    turn: Rotation = rotation_along(direction, math.cos(amount), math.sin(amount))
    return Displacement(turn @ start.rotation, start.translation)


def point_goal(point: Sequence[float]) -> Displacement:
    """Return the goal of a joint that is pulled to a point, base frame, m."""
    return Displacement(IDENTITY, Vector(*point))

"""Gaps from legs to where a pose puts the platform, for many legs at many poses at once, with the rates of joints.

Legs of one build, such as copies of one leg, are placed by one evaluation of the formulas of a leg. What is done with
the gaps is elsewhere (`following`, `closure`).

Source: theory (19)-(21); placements are in the base frame.
"""

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import fields, replace
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero
from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics import closing
from kinetostat.kinematics.closing import ANGLES, POINT, leg_end, placement_of, rotation_between
from kinetostat.machine.column import column, plain, stacked_columns
from kinetostat.machine.machine import Chains, Step
from kinetostat.numerics.iteration import Steps, largest, least_norm

Coordinates = dict[str, Scalar]
"""Coordinates of the platform: x, y, z (m) and roll, pitch, yaw (rad), one for each problem, or a float for all."""


def coordinates_at(coordinates: Coordinates, problems: Integers) -> Coordinates:
    """The coordinates of some problems, by number."""
    return {name: value if isinstance(value, float) else value[problems] for name, value in coordinates.items()}


@dataclass(frozen=True)
class Build:
    """Legs with the same kinds of joints in a row.

    Attributes:
        elements: moving elements of the legs, at the home pose, of any class with a `mover`; their scalars are floats,
            or arrays [poses or 1 x legs].
        slides: whether each coordinate is a length [elements].
        places: places of their coordinates among those of the machine [legs x elements].
    """

    elements: tuple[Any, ...]
    slides: Mask
    places: Integers

    def steps(self, poses: Integers, legs: Integers) -> tuple[Step, ...]:
        """The elements of some legs at some poses, as one leg over columns.

        Args:
            poses, legs: numbers of pose and leg [n].
        """

        def entry_of(scalar: Scalar) -> Scalar:
            return scalar if isinstance(scalar, float) else column(scalar[poses if len(scalar) > 1 else 0, legs])

        return tuple(
            Step(_with_scalars(element, map(entry_of, _scalars_of(element))), True) for element in self.elements
        )


def builds_of(chains: Chains) -> list[Build]:
    """Sort the legs of a machine by their build."""
    alike: dict[Hashable, list[tuple[list[Any], Integers]]] = {}
    first = 0  # place of the leg's first coordinate among those of the machine
    for steps in chains.legs:
        # A spring that moves is placed as its joint.
        elements = [getattr(step.element, "joint", step.element) for step in steps if step.moves]
        keys = tuple(_build_key(element) for element in elements)
        alike.setdefault(keys, []).append((elements, np.arange(first, first + len(elements))))
        first += len(elements)
    builds = []
    for legs in alike.values():
        elements = [_merged_element(same_place) for same_place in zip(*(elements for elements, _ in legs), strict=True)]
        slides = np.array([element.mover.point is None for element in legs[0][0]], dtype=bool)
        builds.append(Build(tuple(elements), slides, np.stack([places for _, places in legs])))
    return builds


def _build_key(element: Any) -> Hashable:
    """The class of an element, and which of its fields are points, names or None: alike in elements of one build.

    Only then can one evaluation place them all. A joint with a carriage and one without it differ.
    """
    values = [getattr(element, field.name) for field in fields(element)]
    kinds = tuple(type(value) if isinstance(value, Vector | str | None) else float for value in values)
    return type(element), element.mover.point is None, is_zero(element.mover.pitch), kinds


def _merged_element(elements: Sequence[Any]) -> Any:
    """One element for those of several legs of a build: its scalars have a column for each leg."""
    return _with_scalars(elements[0], map(_stacked_scalar, zip(*map(_scalars_of, elements), strict=True)))


def _scalars_of(element: Any) -> list[Scalar]:
    """The numbers of an element in the order of its fields, those of a vector one by one; names are left out."""
    values = [getattr(element, field.name) for field in fields(element)]
    parts = (value.components() if isinstance(value, Vector) else (value,) for value in values if _has_numbers(value))
    return [scalar for part in parts for scalar in part]


def _with_scalars(element: Any, scalars: Iterable[Scalar]) -> Any:
    """The element with other numbers, in the order of `_scalars_of`."""
    remaining, changes = iter(scalars), {}
    for name in (field.name for field in fields(element)):
        value = getattr(element, name)
        if _has_numbers(value):
            changes[name] = Vector(*islice(remaining, 3)) if isinstance(value, Vector) else next(remaining)
    return replace(element, **changes)


def _has_numbers(value: Any) -> bool:
    return not isinstance(value, str | None)


def _stacked_scalar(scalars: Sequence[Scalar]) -> Scalar:
    """A float where all legs have it; else an array [poses or 1 x legs]."""
    first = scalars[0]
    if all(isinstance(scalar, int | float) and scalar == first for scalar in scalars):
        return float(first)
    rows = [np.atleast_1d(np.asarray(plain(scalar), dtype=float)) for scalar in scalars]
    return np.stack(np.broadcast_arrays(*rows), axis=1)


@dataclass(frozen=True)
class AlikeLegs:
    """Legs of one build in each of some problems.

    Attributes:
        build: their build.
        legs: numbers of the legs in their build [problems x legs].
        columns: places of their coordinates among the unknowns of a problem [legs x joints].
    """

    build: Build
    legs: Integers
    columns: Integers


class GapsToGoal(NamedTuple):
    """Gaps that are left from the ends of legs to the goal.

    The gap of a rotation is the sine of its angle a, which vanishes at half a turn as well. The distance has
    2 (1 - cos a) in the place of its square: this vanishes at 0 only, and the slope of half the squared distance is
    exactly the gaps times their rates, however large they are.

    Attributes:
        gaps: six numbers for each leg, a rotation vector and a displacement in units of the length [problems x rows].
        rates: how the unknowns reduce them [problems x rows x unknowns].
        squared_distance: the squared distance of all ends of a problem from the goal [problems].
    """

    gaps: Array
    rates: Array
    squared_distance: Array


@dataclass(frozen=True)
class Problems:
    """Equations to be solved, all of one form: at a pose, one leg alone, or all legs and the coordinates not given.

    The unknowns are joint coordinates, rad or in units of the machine's length, and after them changes of the
    coordinates not given, from the home pose, in the same units.

    Attributes:
        chains: the machine.
        poses: number of the pose of each problem [problems].
        parts: the legs of a problem.
        free: names of the pose's coordinates that are not given.
    """

    chains: Chains
    poses: Integers
    parts: tuple[AlikeLegs, ...]
    free: tuple[str, ...]

    @property
    def size(self) -> int:
        """Number of unknowns of each problem."""
        return sum(part.columns.size for part in self.parts) + len(self.free)

    @property
    def rows(self) -> int:
        """Number of equations of each problem."""
        return 6 * sum(len(part.columns) for part in self.parts)

    @property
    def lengths(self) -> Array:
        """The machine's length in each problem, m [problems]."""
        length = np.atleast_1d(np.asarray(plain(self.chains.length), dtype=float))
        return length[self.poses] if len(length) > 1 else np.broadcast_to(length, (len(self.poses),))

    def at_home(self) -> Coordinates:
        """Coordinates of the platform at the home pose."""
        point = {name: _scalar_at(getattr(self.chains.home.translation, name), self.poses) for name in POINT}
        return point | dict.fromkeys(ANGLES, 0.0)

    def unknowns_of(self, coordinates: Array) -> Array:
        """The unknowns at joint coordinates [poses x coordinates], those not given as at the home pose."""
        unknowns = np.zeros((len(self.poses), self.size))
        for part in self.parts:
            unknowns[:, part.columns] = coordinates[self._entries(part)] / self._units(part)
        return unknowns

    def write_joints(self, coordinates: Array, unknowns: Array) -> None:
        """Write the joint coordinates of solved problems into those of all poses [poses x coordinates], rad or m."""
        for part in self.parts:
            coordinates[self._entries(part)] = unknowns[:, part.columns] * self._units(part)

    def _entries(self, part: AlikeLegs) -> tuple[Integers, Integers]:
        return self.poses[:, None, None], part.build.places[part.legs]

    def _units(self, part: AlikeLegs) -> Array:
        return np.where(part.build.slides, self.lengths[:, None, None], 1.0)

    def subset(self, problems: Integers) -> "Problems":
        """Return some of the problems, by number."""
        parts = tuple(replace(part, legs=part.legs[problems]) for part in self.parts)
        return replace(self, poses=self.poses[problems], parts=parts)

    def gaps(self, unknowns: Array, goal: Coordinates) -> GapsToGoal:
        """Find the gaps from the legs' ends to the goal.

        Args:
            unknowns: [problems x unknowns].
            goal: coordinates of the platform; those not given are those of the home pose.
        """
        lengths, first = self.lengths, self.size - len(self.free)
        for k, name in enumerate(self.free, first):
            goal = goal | {name: goal[name] + unknowns[:, k] * (1.0 if name in ANGLES else lengths)}
        gaps, rates, squared_distance = [], [], np.zeros(len(unknowns))
        for part in self.parts:
            legs = part.legs.shape[1]
            ends, twists = self._ends(part, unknowns, lengths)
            wanted = placement_of({name: column(_for_each_leg(value, legs)) for name, value in goal.items()})
            leg_lengths = np.repeat(lengths, legs)
            turn = rotation_between(ends.rotation, wanted.rotation).components()
            shift = [plain(c) * (1.0 / leg_lengths) for c in (wanted.translation - ends.translation).components()]
            gaps.append(stacked_columns([*turn, *shift], len(leg_lengths)).reshape(len(lengths), 6 * legs))
            rates.append(self._rates_by_all_unknowns(part, twists, wanted, len(lengths)))
            squares = plain(closing.squared_distance(ends, wanted, column(leg_lengths)))
            squared_distance = squared_distance + np.asarray(squares).reshape(-1, legs).sum(axis=1)
        all_rates = rates[0] if len(rates) == 1 else np.concatenate(rates, axis=1)
        return GapsToGoal(np.hstack(gaps), all_rates, squared_distance)

    def closing_equations(
        self, goal: Coordinates, solve: Callable[[Array, Array], Array] = least_norm
    ) -> Callable[[Array, Integers], tuple[Array, Steps]]:
        """The equations that close the legs, as `newton` takes them.

        Args:
            goal: coordinates of the platform in each problem.
            solve: function from rates [k x rows x unknowns] and gaps [k x rows] to the steps that close these to first
                order [k x unknowns].
        """

        def equations(unknowns: Array, rows: Integers) -> tuple[Array, Steps]:
            gaps, rates, _ = self.subset(rows).gaps(unknowns, coordinates_at(goal, rows))
            return largest(gaps), lambda unsolved: solve(rates[unsolved], gaps[unsolved])

        return equations

    def _ends(self, part: AlikeLegs, unknowns: Array, lengths: Array) -> tuple[Displacement, Array]:
        """Places to which legs take the platform, and its twist per unit of their coordinates [legs x 6 x joints]."""
        count = part.legs.shape[1]
        coordinates = unknowns[:, part.columns].reshape(-1, part.columns.shape[1])
        leg_lengths, poses = np.repeat(lengths, count), np.repeat(self.poses, count)
        home = self.chains.home.translation.components()
        start = Displacement(self.chains.home.rotation, Vector(*(column(_scalar_at(c, poses)) for c in home)))
        # A coordinate of a slide is counted in lengths of the machine, one of a turn in rad.
        units = [leg_lengths if slide else 1.0 for slide in part.build.slides]
        amounts = [column(q * unit) for q, unit in zip(coordinates.T, units, strict=True)]
        end = leg_end(part.build.steps(poses, part.legs.ravel()), start, iter(amounts))
        twists = np.empty((len(leg_lengths), 6, len(units)))
        for k, (mover, unit) in enumerate(zip(end.movers, units, strict=True)):
            for row, scalar in enumerate(mover.twist(end.platform.translation).components()):
                # The platform turns in rad and moves in lengths of the machine, as gaps do.
                twists[:, row, k] = plain(scalar) * (unit * (1.0 if row < 3 else 1.0 / leg_lengths))
        return end.platform, twists

    def _rates_by_all_unknowns(self, part: AlikeLegs, twists: Array, wanted: Displacement, count: int) -> Array:
        """The rates of some legs' gaps by all unknowns [problems x rows x unknowns]; joints of other legs have none."""
        if not self.free and part.columns.shape[0] == 1 and len(self.parts) == 1:
            return twists
        legs = len(part.columns)
        rates = np.zeros((count, 6 * legs, self.size))
        blocks = twists.reshape(count, legs, 6, part.columns.shape[1])
        for k, places in enumerate(part.columns):
            rates[:, 6 * k : 6 * k + 6, places] = blocks[:, k]
        for k, name in enumerate(self.free, self.size - len(self.free)):
            rates[:, :, k] = -stacked_columns(_rates_of(name, wanted), count * legs).reshape(count, 6 * legs)
        return rates


def _scalar_at(scalar: Scalar, poses: Integers) -> Scalar:
    values = plain(scalar)
    return values[poses] if np.size(values) > 1 else float(np.ravel(values)[0])


def _for_each_leg(values: Scalar, times: int) -> Scalar:
    return values if isinstance(values, float) or times == 1 else np.repeat(values, times)


def _rates_of(name: str, placement: Displacement) -> tuple[Scalar, ...]:
    """The twist of the platform per unit of one coordinate of its pose, translations in units of the length."""
    if name in POINT:
        return (0.0, 0.0, 0.0, *(float(name == other) for other in POINT))
    turn = placement.rotation
    if name == "roll":
        return (*turn.x.components(), 0.0, 0.0, 0.0)
    if name == "yaw":
        return (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    yaw = np.arctan2(np.asarray(turn.x.y), np.asarray(turn.x.x))
    return (-np.sin(yaw), np.cos(yaw), 0.0, 0.0, 0.0, 0.0)


def problems_of(chains: Chains, count: int, free: Sequence[str]) -> list[Problems]:
    """State the equations of a machine at some poses: leg by leg where the pose is complete, else all legs together.

    Args:
        chains: the machine.
        count: number of poses.
        free: coordinates that the pose does not give, and that can change.
    """
    builds = builds_of(chains)
    if free:
        parts, first = [], 0
        for build in builds:
            columns = np.arange(first, first + build.places.size).reshape(build.places.shape)
            parts.append(AlikeLegs(build, np.broadcast_to(np.arange(len(columns)), (count, len(columns))), columns))
            first += columns.size
        return [Problems(chains, np.arange(count), tuple(parts), tuple(free))]
    problems = []
    for build in builds:
        legs = len(build.places)
        numbers = np.tile(np.arange(legs), count)[:, None]
        alone = AlikeLegs(build, numbers, np.arange(build.places.shape[1])[None])
        problems.append(Problems(chains, np.repeat(np.arange(count), legs), (alone,), ()))
    return problems


def goal_of(problems: Problems, goal: Array) -> Coordinates:
    """Coordinates of the platform in each problem; those not given are those of the home pose.

    Args:
        problems: the problems at some poses.
        goal: coordinates of the poses, in the order of the chains' pose [poses x given], rad or m.
    """
    return problems.at_home() | {name: goal[problems.poses, i] for i, name in enumerate(problems.chains.pose)}

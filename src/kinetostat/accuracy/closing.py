"""Legs with small errors: the wrenches by which they hold the platform, and where they close on it, at many poses.

An error displaces what follows it in its leg by a small screw motion. Actuators are held; passive joints take up what
they can, and the wrenches that each leg can carry decide what the platform makes of the rest.

Which freedoms of a leg are independent is a matter of its form. Where it is known, an orthogonal basis of these gives
the wrenches, and with them the least steps follow from linear equations; places at which freedoms are nearly dependent
are decomposed by their singular values. Arrays have the poses first [n]; screws are at the base origin in base axes,
SI, unless said otherwise.

Source: theory (45) to (48).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from kinetostat.accuracy.rows import ErrorScrews, HomeRows, LegRow, LikeRows, by_leg, like_rows, random_coordinates
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import PlacedChain, closing_gap
from kinetostat.numerics.iteration import Steps, largest, newton, with_rows
from kinetostat.numerics.motions import Motions, cross, exponential, logarithm
from kinetostat.tolerances import LEAST_DIVISOR, NEARLY_DEPENDENT, SEEN_BY_LEG

LEAST_SEEN_RATIO = 1e-7
"""Least ratio of a singular value of joint screws to the largest one, with lengths in units of the machine's: singular
values of screws that depend on each other by form are round-off, some 1e-16, those near a singular place lie above."""
SOFTEST_SHARE = 1e-9
"""Share of the mean compliance of the legs that is added to that of each where they must share a misfit: rigid legs
among compliant ones would leave the equations singular, and 1e-9 changes the other shares by no more."""
CLOSED_STEP = 1e-8
"""Motion of the last step of Newton's method, rad or in units of the machine's length: the next one would be about its
square, or a thousandth of it where legs share a misfit."""
LONGEST_STAGE = 0.2
"""Farthest motion of a stage on the way from the home place to a pose, rad or in units of the machine's length, from
which Newton's method converges; so near poses have fewer stages."""
NEARLY_CLOSED_STEP = 1e-2
"""Motion of the last step of a stage before the last one: the next stage only starts from there."""
MOST_CLOSING_STEPS = 40
"""Most steps of Newton's method: errors are small, so that a few suffice where there is a solution."""
STEPS_OF_STAGE = 3
"""Most steps of Newton's method in a stage before the last one."""
MOST_STAGES = 8
"""Most stages on the way from the home place to a pose; a way that is farther has longer stages."""


def in_lengths(twists: Array, length: float, axis: int = -1) -> Array:
    """Return twists with their translations in units of a length; `axis` has their six components."""
    units = np.array([1.0, 1.0, 1.0] + [1.0 / length] * 3)
    shape = [1] * twists.ndim
    shape[axis] = 6
    return twists * units.reshape(shape)


def at_points(twists: Array, point: Array) -> Array:
    """Return twists that are given at the base origin [n x ... x 6], at points [n x 3]."""
    rotation, translation = twists[..., :3], twists[..., 3:]
    points = np.broadcast_to(point.reshape(len(point), *([1] * (twists.ndim - 2)), 3), translation.shape)
    return np.concatenate([rotation, translation + cross(rotation, points)], axis=-1)


def independent_columns(screws: Array) -> tuple[int, ...]:
    """Choose the screws of a leg that do not follow from those before them.

    Args:
        screws: at random places, where nothing is dependent but by form [n x 6 x k].
    """
    basis, independent = np.zeros((*screws.shape[:2], 0)), []
    for place in range(screws.shape[2]):
        column = screws[:, :, place, None]
        remainder = column
        for _ in range(2):  # the second time takes away what round-off has left of the first
            remainder = remainder - basis @ (np.swapaxes(basis, 1, 2) @ remainder)
        new_size, size = (np.linalg.norm(part, axis=1, keepdims=True) for part in (remainder, column))
        if (new_size > SEEN_BY_LEG * size).any():
            basis = np.concatenate([basis, remainder / np.maximum(new_size, LEAST_DIVISOR)], axis=2)
            independent.append(place)
    return tuple(independent)


@dataclass(frozen=True)
class Screws:
    """Screws of the free motions of a leg at n places.

    Attributes:
        screws: the screws in units of the length [n x 6 x k]; results are NaN where they are not finite.
        independent: numbers of those that are independent by form, r of them.
    """

    screws: Array
    independent: tuple[int, ...]

    @cached_property
    def wrenches(self) -> Array:
        """An orthonormal basis of the wrenches that the leg carries, without work on the screws [n x 6 x (6 - r)]."""
        return self._wrenches_and_near_dependence[0]

    def steps(self, twists: Array) -> Array:
        """Return the least steps that come nearest to twists [n x 6] in units of the length [n x coordinates].

        A^T (A A^T + W W^T)^-1 is the pseudo-inverse of A if the columns of W are a basis of what A does not reach.
        """
        wrenches, near_dependence = self._wrenches_and_near_dependence
        transposed = np.swapaxes(self.screws, 1, 2)
        whole = self.screws @ transposed + wrenches @ np.swapaxes(wrenches, 1, 2)
        whole[near_dependence | ~np.isfinite(whole).all(axis=(1, 2))] = np.eye(6)
        result = (transposed @ np.linalg.solve(whole, twists[:, :, None]))[:, :, 0]
        if near_dependence.any():
            backward = np.linalg.pinv(self.screws[near_dependence], rcond=LEAST_SEEN_RATIO)
            result[near_dependence] = (backward @ twists[near_dependence, :, None])[:, :, 0]
        return np.asarray(result)

    @cached_property
    def _wrenches_and_near_dependence(self) -> tuple[Array, Mask]:
        """The wrenches, and where the independent screws are nearly dependent."""
        rank, finite = len(self.independent), np.isfinite(self.screws).all(axis=(1, 2))
        orthogonal, triangle = np.linalg.qr(self.screws[:, :, list(self.independent)], mode="complete")
        wrenches = np.array(orthogonal[:, :, rank:])
        pivots = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
        ratio_holds = pivots.min(axis=1, initial=np.inf) > NEARLY_DEPENDENT * pivots.max(axis=1, initial=0.0)
        near_dependence = np.asarray(finite & ~ratio_holds)
        if near_dependence.any():
            wrenches[near_dependence] = np.linalg.svd(self.screws[near_dependence])[0][:, :, rank:]
        wrenches[~finite] = np.nan
        return wrenches, near_dependence


@dataclass(frozen=True)
class Holding:
    """Wrenches by which the legs hold the platform at a state, theory (46).

    Attributes:
        wrenches: for each leg, a basis of what it carries at the tool point [n x 6 x m], moments over the length.
        shares: for each leg, the twist of the tool per unit work of a misfit on each wrench [n x 6 x m], translations
            over the length.
    """

    wrenches: tuple[Array, ...]
    shares: tuple[Array, ...]

    def twist(self, leg: int, misfits: Array) -> Array:
        """Return twists of the tool by displacements of a leg's end [n x k x 6], both at the tool, over the length."""
        work = misfits @ self.wrenches[leg]
        return np.asarray(work @ np.swapaxes(self.shares[leg], 1, 2))

    def at_origin(self, leg: int, tool: Array, length: float) -> Array:
        """Return the wrenches of a leg, moments about the base origin over forces: work per rad and per m [n x 6 x m].

        Args:
            leg: number of the leg.
            tool: the tool point, m [n x 3].
            length: the length over which moments are, m.
        """
        basis = np.swapaxes(self.wrenches[leg], 1, 2)
        forces = basis[..., 3:] / length
        return np.swapaxes(np.concatenate([basis[..., :3] + cross(tool[:, None], forces), forces], axis=2), 1, 2)


def free_screws(row: LegRow, rows: HomeRows, placed: PlacedChain, points: Array) -> Array:
    """Return the screws of what moves freely in a leg, at points, in units of the length [n x 6 x freedoms].

    The free coordinates of the leg come first, in their order. Twists that a planar machine does not have count as free
    and stand behind them.

    Args:
        row: the leg.
        rows: its machine.
        placed: the leg at its places.
        points: the points, m [n x 3].
    """
    free = row.chain.rates(placed)[:, :, list(row.free_coordinates)] * _free_units(row, rows.length)
    absent = np.broadcast_to(rows.absent.T, (len(free), 6, len(rows.absent)))
    screws = np.concatenate([free, absent], axis=2)
    return in_lengths(at_points(np.swapaxes(screws, 1, 2), points), rows.length).swapaxes(1, 2)


def _free_units(row: LegRow, length: float) -> Array:
    """Return the units of its free coordinates, 1 rad or the machine's length, m."""
    return np.array([length if row.slides[coordinate] else 1.0 for coordinate in row.free_coordinates])


@dataclass(frozen=True)
class LegsInPlace:
    """Legs with their errors at n poses, and how they hold the platform there.

    Attributes:
        groups: legs that are alike.
        chains: the legs of each group in their places [legs * n].
        free: the screws of what moves freely in them, at the tool point [legs * n].
        holding: the wrenches that all legs carry.
    """

    groups: Sequence[LikeRows]
    chains: Sequence[PlacedChain]
    free: Sequence[Screws]
    holding: Holding

    def displacement(self, leg: int, motions: int) -> Motions:
        """Return the displacement of what the first motions of a leg carry [n].

        Args:
            leg: number of the leg.
            motions: number of its motions.
        """
        group, chain = next(pair for pair in zip(self.groups, self.chains, strict=True) if leg in pair[0].numbers)
        of_group = chain.before[motions]
        count = len(of_group.translation) // len(group.numbers)
        first = group.numbers.index(leg) * count
        return of_group.at(np.arange(first, first + count))


def legs_in_place(
    rows: HomeRows,
    groups: Sequence[LikeRows],
    coordinates: Sequence[Array],
    screws: ErrorScrews,
    tool: Array,
    leg_compliances: Sequence[Array],
) -> LegsInPlace:
    """Place the legs at n poses.

    Args:
        rows: the machine.
        groups: its legs, those that are alike together.
        coordinates: coordinates of the joints of each leg [n x coordinates].
        screws: the screw motions by the errors of each leg.
        tool: the tool point, m [n x 3].
        leg_compliances: see `holding`.
    """
    chains = [group.place(coordinates, screws) for group in groups]
    free = [
        Screws(free_screws(group.row, rows, chain, np.tile(tool, (len(group.numbers), 1))), group.independent)
        for group, chain in zip(groups, chains, strict=True)
    ]
    wrenches = by_leg(groups, [free_of_group.wrenches for free_of_group in free])
    return LegsInPlace(groups, chains, free, holding(rows, wrenches, tool, leg_compliances))


def holding(rows: HomeRows, wrenches: Sequence[Array], tool: Array, leg_compliances: Sequence[Array]) -> Holding:
    """Find how the legs share a misfit, theory (46) and (47).

    Six wrenches decide it alone; more of them share the misfit with the least energy.

    Args:
        rows: the machine.
        wrenches: for each leg, a basis of what it carries at the tool point [n x 6 x m], moments over the length.
        tool: the tool point, m [n x 3].
        leg_compliances: compliance of each leg without its passive joints at the tool, in the length's units
            [n x 6 x 6].
    """
    whole = np.concatenate([*wrenches, _guide(rows, tool)], axis=2)
    if whole.shape[2] == 6:
        sharing = _solution(np.swapaxes(whole, 1, 2), np.broadcast_to(np.eye(6), whole.shape))
    else:
        sharing = _sharing_by_energy(whole, wrenches, leg_compliances)
    ends = np.cumsum([basis.shape[2] for basis in wrenches])
    return Holding(tuple(wrenches), tuple(np.split(sharing, ends, axis=2)[:-1]))


def _guide(rows: HomeRows, tool: Array) -> Array:
    """Return wrenches against the twists that a planar machine does not have [n x 6 x 3]; none of a spatial one."""
    absent = np.broadcast_to(rows.absent, (len(tool), *rows.absent.shape))
    if not len(rows.absent):
        return np.zeros((len(tool), 6, 0))
    return np.swapaxes(in_lengths(at_points(absent, tool), rows.length), 1, 2)


def _sharing_by_energy(whole: Array, wrenches: Sequence[Array], leg_compliances: Sequence[Array]) -> Array:
    """Return the shares of the misfits of a redundant machine [n x 6 x wrenches], of least energy, theory (47).

    Args:
        whole: the wrenches of all legs and of the guide [n x 6 x wrenches].
        wrenches, leg_compliances: see `holding`.
    """
    count, size = whole.shape[0], whole.shape[2]
    compliances = np.zeros((count, size, size))  # the guide, whose wrenches stand last, is rigid
    start = 0
    for basis, leg_compliance in zip(wrenches, leg_compliances, strict=True):
        end = start + basis.shape[2]
        compliances[:, start:end, start:end] = np.swapaxes(basis, 1, 2) @ leg_compliance @ basis
        start = end
    mean = np.trace(compliances, axis1=1, axis2=2) / max(start, 1)
    mean = np.where(np.isfinite(mean) & (mean > 0.0), mean, 1.0)  # all legs are rigid: least squares
    compliances = compliances / mean[:, None, None] + SOFTEST_SHARE * np.eye(size)
    resistances = np.swapaxes(_solution(compliances, np.swapaxes(whole, 1, 2)), 1, 2)
    return _solution(resistances @ np.swapaxes(whole, 1, 2), resistances)


def _solution(matrices: Array, right: Array) -> Array:
    """Return solutions of linear equations; NaN where these are singular or not finite."""
    result = np.full(np.broadcast_shapes(matrices.shape[:1], right.shape[:1]) + right.shape[1:], np.nan)
    solvable: Mask = np.asarray(np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2)))
    solvable[solvable] = np.abs(np.linalg.det(matrices[solvable])) > LEAST_DIVISOR
    result[solvable] = np.linalg.solve(matrices[solvable], right[solvable])
    return result


def coordinates_toward(row: LegRow, target: Motions, length: float, screws: Mapping[int, Array] | None = None) -> Array:
    """Return coordinates with which a leg takes the platform to a target, or near it [n x coordinates], rad or m.

    All of its coordinates move, actuators too, by least-norm steps along a screw motion from the home place.

    Args:
        row: the leg at its home place.
        target: displacement of the platform from the home place [n].
        length: a characteristic length of the machine, m.
        screws: screw motions by the leg's errors, by the number of motions before them; none if None.
    """
    way, chain, error_screws = logarithm(target), row.chain, screws or {}
    units = np.where(row.slides, length, 1.0)
    random_rates = chain.rates(chain.place(random_coordinates(row, length)))
    independent = independent_columns(in_lengths(random_rates, length, axis=1))
    distance = float(np.abs(in_lengths(way, length)).max(initial=0.0, where=np.isfinite(way)))
    stages = min(max(int(np.ceil(distance / LONGEST_STAGE)), 1), MOST_STAGES)
    coordinates = np.zeros((len(way), row.size))
    for stage in range(1, stages + 1):
        goal, is_last = exponential(way * (stage / stages)), stage == stages

        def equations(joints: Array, poses: Integers, goal: Motions = goal) -> tuple[Array, Steps]:
            placed = chain.place(joints, errors=screws_at(error_screws, poses))
            gap = in_lengths(closing_gap(goal.at(poses), placed.end), length)
            rates = in_lengths(chain.rates(placed), length, axis=1) * units
            return largest(gap), lambda unsolved: Screws(rates, independent).steps(gap)[unsolved]

        coordinates = newton(
            equations,
            coordinates,
            len(way),
            move=lambda joints, step: joints + step * units,
            most_steps=MOST_CLOSING_STEPS if is_last else STEPS_OF_STAGE,
            step_goal=CLOSED_STEP if is_last else NEARLY_CLOSED_STEP,
        ).value
    return coordinates


def screws_at(screws: Mapping[int, Array], poses: Integers) -> dict[int, Array]:
    """Return the error screws of a leg at some poses; those that are the same everywhere stay as they are."""
    return {behind: screw if len(screw) == 1 else screw[poses] for behind, screw in screws.items()}


@dataclass(frozen=True)
class ClosedLegs:
    """Places of the legs of a machine with errors that close on its platform, at n poses.

    Attributes:
        platform: displacement of the platform from its home place.
        coordinates: coordinates of the joints of each leg [n x coordinates].
        settled: where Newton's method has arrived [n].
    """

    platform: Motions
    coordinates: tuple[Array, ...]
    settled: Mask

    def at(self, poses: Integers) -> "ClosedLegs":
        """Return the legs at some of the poses."""
        return ClosedLegs(self.platform.at(poses), tuple(q[poses] for q in self.coordinates), self.settled[poses])

    def with_part(self, poses: Integers, part: "ClosedLegs") -> "ClosedLegs":
        """Return the legs with others in the places of those at some of the poses."""
        pairs = zip(self.coordinates, part.coordinates, strict=True)
        coordinates = tuple(with_rows(q, poses, values) for q, values in pairs)
        return ClosedLegs(self.platform.with_part(poses, part.platform), coordinates, self.settled)


def closed_legs(
    rows: HomeRows,
    start: ClosedLegs,
    screws: ErrorScrews,
    tool_home: Array,
    independent: Sequence[tuple[int, ...]],
    leg_compliances: Sequence[Array],
) -> ClosedLegs:
    """Close the legs with their errors while their actuators stand still: Newton's method, theory (48).

    A step is the twist of the tool [6], followed by the steps of the free coordinates of each leg, all in units of the
    length.

    Args:
        rows: the machine at its home place.
        start: joint coordinates, with the actuators where they stand, and the platform nearby.
        screws: the screw motions by the errors of each leg.
        tool_home: the tool point at the home place, m [3].
        independent: see `like_rows`.
        leg_compliances: see `holding`.
    """
    length, legs, count = rows.length, rows.legs, len(start.settled)
    groups = like_rows(rows, independent, count)

    def equations(state: ClosedLegs, poses: Integers) -> tuple[Array, Steps]:
        tool = tool_at(state.platform, tool_home)
        compliances = [compliance[poses] for compliance in leg_compliances]
        screws_at_poses = [screws_at(screws_of_leg, poses) for screws_of_leg in screws]
        placed = legs_in_place(rows, groups, state.coordinates, screws_at_poses, tool, compliances)
        pose_of_row = [np.tile(np.arange(len(poses)), len(group.numbers)) for group in groups]
        gaps = [
            -in_lengths(at_points(closing_gap(state.platform.at(pose), chain.end), tool[pose]), length)
            for pose, chain in zip(pose_of_row, placed.chains, strict=True)
        ]
        misfits = by_leg(groups, gaps)
        twists = (placed.holding.twist(leg, misfit[:, None])[:, 0] for leg, misfit in enumerate(misfits))
        twist = sum(twists, np.zeros((len(poses), 6)))
        joint_steps = [
            free.steps(twist[pose] - gap)[:, : len(group.row.free_coordinates)]
            for group, pose, free, gap in zip(groups, pose_of_row, placed.free, gaps, strict=True)
        ]
        step = np.concatenate([twist, *by_leg(groups, joint_steps)], axis=1)
        return largest(np.concatenate(misfits, axis=1)), lambda unsolved: step[unsolved]

    def move(state: ClosedLegs, step: Array) -> ClosedLegs:
        twist, *joint_steps = np.split(step, np.cumsum([6, *(len(row.free_coordinates) for row in legs[:-1])]), axis=1)
        in_metres = np.concatenate([twist[:, :3], twist[:, 3:] * length], axis=1)
        platform = exponential(at_points(in_metres, -tool_at(state.platform, tool_home))) @ state.platform
        coordinates = [q.copy() for q in state.coordinates]
        for row, values, change in zip(legs, coordinates, joint_steps, strict=True):
            values[:, list(row.free_coordinates)] += change * _free_units(row, length)
        return ClosedLegs(platform, tuple(coordinates), state.settled)

    end = newton(equations, start, count, move=move, most_steps=MOST_CLOSING_STEPS, step_goal=CLOSED_STEP)
    return replace(end.value, settled=end.converged)


def tool_at(platform: Motions, tool_home: Array) -> Array:
    """Return the tool point, m [n x 3], from displacements of the platform and the tool point at its home place [3]."""
    return platform.point(np.broadcast_to(tool_home, (len(platform.translation), 3)))

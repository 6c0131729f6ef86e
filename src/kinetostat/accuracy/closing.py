"""Legs with small errors closed on the platform, at many poses: free screws, wrenches, places, and Newton's method.

An error displaces what follows it in its leg by a small screw motion. Actuators are held; passive joints take up what
they can, and the wrenches that each leg can carry decide what the platform makes of the rest. Which freedoms are
independent is a matter of the leg's form. Where it is known, an orthogonal basis of these gives the wrenches, and with
them the least steps follow from linear equations; places at which freedoms are nearly dependent are decomposed by their
singular values. Arrays have the poses first [n]; screws are at the base origin in base axes, SI, unless said otherwise.

Source: theory (45) to (48).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from kinetostat.accuracy.rows import HomeRows, LegRow, random_coordinates
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import PlacedChain, closing_gap
from kinetostat.numerics.iteration import Steps, largest, newton, with_rows
from kinetostat.numerics.motions import Motions, cross, exponential, logarithm
from kinetostat.tolerances import LEAST_DIVISOR, NEARLY_DEPENDENT, SEEN_BY_LEG

LEAST_SEEN_RATIO = 1e-7
"""Least ratio of a singular value of joint screws to the largest one, with lengths in units of the machine's."""
CLOSED_STEP = 1e-8
"""Motion of the last step of Newton's method, rad or in units of the machine's length: the next one would be about its
square, or a thousandth of it where legs share a misfit."""
LONGEST_STAGE = 0.2
"""Farthest way of a stage, rad or in units of the machine's length, where fewer than all stages do."""
NEARLY_CLOSED_STEP = 1e-2
"""The same on the way there, where the next stage starts from."""
MOST_CLOSING_STEPS = 40
"""Of Newton's method: errors are small, so that a few steps suffice where there is a solution."""
MOST_STAGES = 8
"""Steps on the way from the home place to a pose."""
SOFTEST_SHARE = 1e-9
"""Share of the mean compliance of the legs that a leg without any is given where legs must share a misfit."""

Errors = list[dict[int, Array]]
"""For each leg, by the number of motions before it, the small screw motion of an error in home place [n x 6]; [1 x 6]
where it is the same at all poses."""


def in_lengths(twists: Array, length: float, axis: int = -1) -> Array:
    """Twists with their translations in units of a length; `axis` has their six components."""
    units = np.array([1.0, 1.0, 1.0] + [1.0 / length] * 3)
    shape = [1] * twists.ndim
    shape[axis] = 6
    return twists * units.reshape(shape)


def at_points(twists: Array, point: Array) -> Array:
    """Twists given at the base origin [n x ... x 6], at points [n x 3]."""
    turning, moving = twists[..., :3], twists[..., 3:]
    at = point.reshape(len(point), *([1] * (twists.ndim - 2)), 3)
    return np.concatenate([turning, moving + cross(turning, np.broadcast_to(at, moving.shape))], axis=-1)


def independent_columns(screws: Array) -> tuple[int, ...]:
    """Choose the screws of a leg that do not follow from those before them.

    Args:
        screws: at random places, where nothing is dependent but by form [n x 6 x k].
    """
    basis, chosen = np.zeros((*screws.shape[:2], 0)), []
    for place in range(screws.shape[2]):
        column = screws[:, :, place, None]
        rest = column
        for _ in range(2):
            rest = rest - basis @ (np.swapaxes(basis, 1, 2) @ rest)
        left, size = (np.linalg.norm(part, axis=1, keepdims=True) for part in (rest, column))
        if (left > SEEN_BY_LEG * size).any():
            basis = np.concatenate([basis, rest / np.maximum(left, LEAST_DIVISOR)], axis=2)
            chosen.append(place)
    return tuple(chosen)


@dataclass(frozen=True)
class Screws:
    """Screws of the free motions of a leg at n places.

    Attributes:
        screws: in units of the length [n x 6 x k]; results are NaN where they are not finite.
        chosen: which of them are independent by form, r of them.
    """

    screws: Array
    chosen: tuple[int, ...]

    @cached_property
    def wrenches(self) -> Array:
        """An orthonormal basis of what the leg carries: what does no work on any of them [n x 6 x (6 - r)]."""
        return self._wrenches_and_thin[0]

    def steps(self, twists: Array) -> Array:
        """The least steps that come nearest to twists [n x 6] in units of the length [n x coordinates].

        A^T (A A^T + W W^T)^-1 is the pseudo-inverse of A if the columns of W are a basis of what A does not reach.
        """
        wrenches, thin = self._wrenches_and_thin
        every, rest = np.swapaxes(self.screws, 1, 2), np.swapaxes(wrenches, 1, 2)
        whole = self.screws @ every + wrenches @ rest
        whole[thin | ~np.isfinite(whole).all(axis=(1, 2))] = np.eye(6)
        result = (every @ np.linalg.solve(whole, twists[:, :, None]))[:, :, 0]
        if thin.any():
            backward = np.linalg.pinv(self.screws[thin], rcond=LEAST_SEEN_RATIO)
            result[thin] = (backward @ twists[thin, :, None])[:, :, 0]
        return np.asarray(result)

    @cached_property
    def _wrenches_and_thin(self) -> tuple[Array, Mask]:
        """The wrenches, and where the independent screws are nearly dependent."""
        rank, finite = len(self.chosen), np.isfinite(self.screws).all(axis=(1, 2))
        orthogonal, triangle = np.linalg.qr(self.screws[:, :, list(self.chosen)], mode="complete")
        wrenches = np.array(orthogonal[:, :, rank:])
        pivots = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
        thin = finite & ~(pivots.min(axis=1, initial=np.inf) > NEARLY_DEPENDENT * pivots.max(axis=1, initial=0.0))
        if thin.any():
            wrenches[thin] = np.linalg.svd(self.screws[thin])[0][:, :, rank:]
        wrenches[~finite] = np.nan
        return wrenches, np.asarray(thin)


def coordinates_toward(row: LegRow, target: Motions, length: float, errors: Mapping[int, Array] | None = None) -> Array:
    """Coordinates with which a leg takes the platform to a displacement, or near it [n x coordinates], rad or m.

    All of its coordinates move, actuators too, by least-norm steps along a screw motion from the home place.
    """
    whole, chain, given = logarithm(target), row.chain, errors or {}
    units = np.where(row.slides, length, 1.0)
    chosen = independent_columns(in_lengths(chain.rates(chain.place(random_coordinates(row, length))), length, axis=1))
    far = float(np.abs(in_lengths(whole, length)).max(initial=0.0, where=np.isfinite(whole)))
    stages = min(max(int(np.ceil(far / LONGEST_STAGE)), 1), MOST_STAGES)
    coordinates = np.zeros((len(whole), row.size))
    for stage in range(1, stages + 1):
        goal, last = exponential(whole * (stage / stages)), stage == stages

        def equations(joints: Array, poses: Integers, goal: Motions = goal) -> tuple[Array, Steps]:
            at = chain.place(joints, errors=errors_at(given, poses))
            gap = in_lengths(closing_gap(goal.at(poses), at.end), length)
            rates = in_lengths(chain.rates(at), length, axis=1) * units
            return largest(gap), lambda going: Screws(rates, chosen).steps(gap)[going]

        coordinates = newton(
            equations,
            coordinates,
            len(whole),
            move=lambda joints, step: joints + step * units,
            most_steps=MOST_CLOSING_STEPS if last else 3,
            settled=CLOSED_STEP if last else NEARLY_CLOSED_STEP,
        ).value
    return coordinates


def errors_at(errors: Mapping[int, Array], poses: Integers) -> dict[int, Array]:
    """The errors of a leg at some poses; those that are the same everywhere stay as they are."""
    return {behind: error if len(error) == 1 else error[poses] for behind, error in errors.items()}


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

    def twist(self, number: int, misfits: Array) -> Array:
        """The tool's twists for displacements of the end of a leg [n x k x 6], both at the tool and over the length."""
        work = misfits @ self.wrenches[number]
        return np.asarray(work @ np.swapaxes(self.shares[number], 1, 2))

    def at_origin(self, number: int, tool: Array, length: float) -> Array:
        """The wrenches of a leg, moments about the base origin over forces: work per rad and per m [n x 6 x m].

        Args:
            number: of the leg.
            tool: the tool point, m [n x 3].
            length: that moments are over, m.
        """
        basis = np.swapaxes(self.wrenches[number], 1, 2)
        forces = basis[..., 3:] / length
        return np.swapaxes(np.concatenate([basis[..., :3] + cross(tool[:, None], forces), forces], axis=2), 1, 2)


def free_screws(row: LegRow, rows: HomeRows, at: PlacedChain, tool: Array) -> Array:
    """The screws of what moves freely in a leg, at points, in units of the length [n x 6 x freedoms].

    Args:
        row: the leg.
        rows: its machine; twists that a planar one does not have count as free.
        at: where the leg is.
        tool: the points, m [n x 3].
    """
    free = row.chain.rates(at)[:, :, list(row.free_coordinates)] * np.where(
        np.array(row.slides, dtype=bool)[list(row.free_coordinates)], rows.length, 1.0
    )
    absent = np.broadcast_to(rows.absent.T, (len(free), 6, len(rows.absent)))
    screws = np.concatenate([free, absent], axis=2)
    return in_lengths(at_points(np.swapaxes(screws, 1, 2), tool), rows.length).swapaxes(1, 2)


def _units(row: LegRow, length: float) -> Array:
    """The units of its free coordinates, 1 rad or the machine's length, m."""
    return np.array([length if row.slides[place] else 1.0 for place in row.free_coordinates])


def screws_of_legs(
    rows: HomeRows, places: Sequence[PlacedChain], tool: Array, chosen: Sequence[tuple[int, ...]]
) -> list[Screws]:
    """Free screws of each leg at its place, at tool points [n x 3]; `chosen` as of `Screws`."""
    every = zip(rows.legs, places, chosen, strict=True)
    return [Screws(free_screws(row, rows, at, tool), which) for row, at, which in every]


def holding(rows: HomeRows, free: Sequence[Screws], tool: Array, soft: Sequence[Array]) -> Holding:
    """Find what the legs carry and how they share a misfit, theory (46) and (47).

    Args:
        rows: the machine.
        free: what moves freely in its legs.
        tool: the tool point, m [n x 3].
        soft: compliance of each leg without its passive joints at the tool, in the length's units [n x 6 x 6].
    """
    wrenches = [screws.wrenches for screws in free]
    guide = _guide(rows, tool)
    every = np.concatenate([*wrenches, guide], axis=2)
    sharing = _inverse(np.swapaxes(every, 1, 2)) if every.shape[2] == 6 else _by_energy(every, wrenches, soft)
    ends = np.cumsum([w.shape[2] for w in wrenches])
    return Holding(tuple(wrenches), tuple(np.split(sharing, ends, axis=2)[:-1]))


def _guide(rows: HomeRows, tool: Array) -> Array:
    """Wrenches against the twists that a planar machine does not have [n x 6 x 3]; none of a spatial one."""
    absent = np.broadcast_to(rows.absent, (len(tool), *rows.absent.shape))
    if not len(rows.absent):
        return np.zeros((len(tool), 6, 0))
    return np.swapaxes(in_lengths(at_points(absent, tool), rows.length), 1, 2)


def _by_energy(every: Array, wrenches: Sequence[Array], soft: Sequence[Array]) -> Array:
    """Shares of the misfits of a redundant machine [n x 6 x wrenches], of least energy, theory (47)."""
    count, size = every.shape[0], every.shape[2]
    weights = np.zeros((count, size, size))
    start = 0
    for basis, compliance in zip(wrenches, soft, strict=True):
        end = start + basis.shape[2]
        weights[:, start:end, start:end] = np.swapaxes(basis, 1, 2) @ compliance @ basis
        start = end
    mean = np.trace(weights, axis1=1, axis2=2) / max(start, 1)
    mean = np.where(np.isfinite(mean) & (mean > 0.0), mean, 1.0)
    weights = weights / mean[:, None, None] + SOFTEST_SHARE * np.eye(size)
    resisted = np.swapaxes(_solution(weights, np.swapaxes(every, 1, 2)), 1, 2)
    return _solution(resisted @ np.swapaxes(every, 1, 2), resisted)


def _inverse(matrices: Array) -> Array:
    return _solution(matrices, np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape))


def _solution(matrices: Array, right: Array) -> Array:
    """Solutions of linear equations; NaN where these are singular or not finite."""
    result = np.full(np.broadcast_shapes(matrices.shape[:1], right.shape[:1]) + right.shape[1:], np.nan)
    sound: Mask = np.asarray(np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2)))
    sound[sound] = np.abs(np.linalg.det(matrices[sound])) > LEAST_DIVISOR
    result[sound] = np.linalg.solve(matrices[sound], right[sound])
    return result


@dataclass(frozen=True)
class ClosedLegs:
    """Places of the legs of a machine with errors that close on its platform, at n poses.

    Attributes:
        platform: displacement of the platform from its home place.
        coordinates: of the joints of each leg [n x coordinates].
        settled: where Newton's method has arrived [n].
    """

    platform: Motions
    coordinates: tuple[Array, ...]
    settled: Mask

    def at(self, poses: Integers) -> "ClosedLegs":
        """The legs at some of the poses."""
        return ClosedLegs(self.platform.at(poses), tuple(q[poses] for q in self.coordinates), self.settled[poses])

    def with_part(self, poses: Integers, part: "ClosedLegs") -> "ClosedLegs":
        """The legs with those at some of the poses in their places."""
        pairs = zip(self.coordinates, part.coordinates, strict=True)
        coordinates = tuple(with_rows(q, poses, values) for q, values in pairs)
        return ClosedLegs(self.platform.with_part(poses, part.platform), coordinates, self.settled)


def closed_legs(
    rows: HomeRows,
    start: ClosedLegs,
    errors: Errors,
    tool_home: Array,
    chosen: Sequence[tuple[int, ...]],
    soft: Sequence[Array],
) -> ClosedLegs:
    """Close the legs with their errors while their actuators stand still: Newton's method, theory (48).

    Args:
        rows: the machine at its home place.
        start: joint coordinates, with the actuators where they stand, and the platform nearby.
        errors: the errors of each leg.
        tool_home: the tool point at the home place, m [3].
        chosen: see `screws_of_legs`.
        soft: see `holding`.
    """
    length, legs = rows.length, rows.legs

    def equations(there: ClosedLegs, poses: Integers) -> tuple[Array, Steps]:
        given = [errors_at(error, poses) for error in errors]
        places = [row.chain.place(q, errors=e) for row, q, e in zip(legs, there.coordinates, given, strict=True)]
        tool = _tool_at(there.platform, tool_home)
        free = screws_of_legs(rows, places, tool, chosen)
        hold = holding(rows, free, tool, [compliance[poses] for compliance in soft])
        gaps = [-in_lengths(at_points(closing_gap(there.platform, at.end), tool), length) for at in places]
        twist = sum((hold.twist(i, gap[:, None])[:, 0] for i, gap in enumerate(gaps)), np.zeros((len(poses), 6)))
        every = zip(legs, free, gaps, strict=True)
        joints = [screws.steps(twist - gap)[:, : len(row.free_coordinates)] for row, screws, gap in every]
        step = np.concatenate([twist, *joints], axis=1)
        return largest(np.concatenate(gaps, axis=1)), lambda going: step[going]

    def move(there: ClosedLegs, step: Array) -> ClosedLegs:
        twist, *joints = np.split(step, np.cumsum([6, *(len(row.free_coordinates) for row in legs[:-1])]), axis=1)
        back = np.concatenate([twist[:, :3], twist[:, 3:] * length], axis=1)
        platform = exponential(at_points(back, -_tool_at(there.platform, tool_home))) @ there.platform
        coordinates = [q.copy() for q in there.coordinates]
        for row, values, change in zip(legs, coordinates, joints, strict=True):
            values[:, list(row.free_coordinates)] += change * _units(row, length)
        return ClosedLegs(platform, tuple(coordinates), there.settled)

    count = len(start.settled)
    end = newton(equations, start, count, move=move, most_steps=MOST_CLOSING_STEPS, settled=CLOSED_STEP)
    return replace(end.value, settled=end.converged)


def _tool_at(platform: Motions, tool_home: Array) -> Array:
    return platform.point(np.broadcast_to(tool_home, (len(platform.translation), 3)))

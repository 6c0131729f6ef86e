"""The free screws of legs at many poses, the wrenches that they carry, and how they share a misfit.

Which freedoms of a leg are independent is a matter of its form. Where it is known, an orthogonal basis of these gives
the wrenches, and with them the least steps follow from linear equations; places at which freedoms are nearly dependent
are decomposed by their singular values. Arrays have the poses first [n]; screws are at the base origin in base axes,
SI, unless said otherwise.

Source: theory (46) and (47).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from kinetostat.accuracy.rows import HomeRows, LegRow
from kinetostat.arrays import Array, Mask
from kinetostat.equilibrium.elastic_legs import FEW_POSES
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import Chain, PlacedChain
from kinetostat.numerics.motions import Motions, cross
from kinetostat.tolerances import LEAST_DIVISOR, NEARLY_DEPENDENT, SEEN_BY_LEG

LEAST_SEEN_RATIO = 1e-7
"""Least ratio of a singular value of joint screws to the largest one, with lengths in units of the machine's."""
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


@dataclass(frozen=True)
class LikeRows:
    """Legs whose motions, freedoms and drives are alike: all poses of the first of them, then all of the second.

    At a few poses, time goes into calls of NumPy more than into numbers: six legs take little longer than one.

    Attributes:
        numbers: numbers of the legs.
        row: the first of them.
        chain: the motions of all of them [legs x motions x 6].
        chosen: which of the free screws of each are independent, see `Screws`.
    """

    numbers: tuple[int, ...]
    row: LegRow
    chain: Chain
    chosen: tuple[int, ...]

    def place(self, coordinates: Sequence[Array], errors: Errors) -> PlacedChain:
        """Place the legs [legs * n] by coordinates of all legs of the machine [n x coordinates] and their errors."""
        count = len(coordinates[self.numbers[0]])
        disturbed = {behind for k in self.numbers for behind in errors[k]}
        beside = {behind: self._errors(behind, errors, count) for behind in sorted(disturbed)}
        return self.chain.place(np.concatenate([coordinates[k] for k in self.numbers]), errors=beside)

    def _errors(self, behind: int, errors: Errors, count: int) -> Array:
        """The errors behind so many motions [legs x 6], or [legs * n x 6] where those of a leg differ by pose."""
        each = [errors[k].get(behind, np.zeros((1, 6))) for k in self.numbers]
        if any(len(error) > 1 for error in each):
            each = [np.broadcast_to(error, (count, 6)) for error in each]
        return np.concatenate(each)


def like_rows(rows: HomeRows, chosen: Sequence[tuple[int, ...]], count: int) -> list[LikeRows]:
    """Put the legs that are alike together; at many poses each is left by itself.

    Args:
        rows: the machine.
        chosen: for each leg, which of its free screws are independent, see `Screws`.
        count: number of poses.
    """
    groups: dict[Any, list[int]] = {}
    for number, row in enumerate(rows.legs):
        alone = number if count > FEW_POSES else None
        form = alone, tuple(row.coordinate), tuple(row.slides), row.free_coordinates, chosen[number]
        groups.setdefault(form, []).append(number)
    result = []
    for (*_, independent), numbers in groups.items():
        first = rows.legs[numbers[0]]
        twists = np.concatenate([rows.legs[k].chain.twists for k in numbers])
        result.append(LikeRows(tuple(numbers), first, replace(first.chain, twists=twists), independent))
    return result


def by_leg(groups: Sequence[LikeRows], values: Sequence[Array]) -> list[Array]:
    """Return values of groups [legs * n x ...] as those of each leg [n x ...], in the order of the machine's legs."""
    parts: dict[int, Array] = {}
    for group, of_group in zip(groups, values, strict=True):
        parts.update(zip(group.numbers, np.split(of_group, len(group.numbers)), strict=True))
    return [parts[number] for number in range(len(parts))]


@dataclass(frozen=True)
class LegsInPlace:
    """Legs with their errors at n poses, and how they hold the platform there.

    Attributes:
        groups: legs that are alike.
        places: where the legs of each group are [legs * n].
        free: what moves freely in them, at the tool point [legs * n].
        holding: what all legs carry.
    """

    groups: Sequence[LikeRows]
    places: Sequence[PlacedChain]
    free: Sequence[Screws]
    holding: Holding

    def displacement(self, number: int, motions: int) -> Motions:
        """Return the displacement of what the first so many motions of a leg carry, by its number [n]."""
        group, at = next(pair for pair in zip(self.groups, self.places, strict=True) if number in pair[0].numbers)
        every = at.before[motions]
        count = len(every.translation) // len(group.numbers)
        first = group.numbers.index(number) * count
        return every.at(np.arange(first, first + count))


def legs_in_place(
    rows: HomeRows,
    groups: Sequence[LikeRows],
    coordinates: Sequence[Array],
    errors: Errors,
    tool: Array,
    soft: Sequence[Array],
) -> LegsInPlace:
    """Place the legs at n poses.

    Args:
        rows: the machine.
        groups: its legs, those that are alike together.
        coordinates: of the joints of each leg [n x coordinates].
        errors: the errors of each leg.
        tool: the tool point, m [n x 3].
        soft: see `holding`.
    """
    places = [group.place(coordinates, errors) for group in groups]
    free = [
        Screws(free_screws(group.row, rows, at, np.tile(tool, (len(group.numbers), 1))), group.chosen)
        for group, at in zip(groups, places, strict=True)
    ]
    wrenches = by_leg(groups, [screws.wrenches for screws in free])
    return LegsInPlace(groups, places, free, holding(rows, wrenches, tool, soft))


def holding(rows: HomeRows, wrenches: Sequence[Array], tool: Array, soft: Sequence[Array]) -> Holding:
    """Find how the legs share a misfit, theory (46) and (47).

    Args:
        rows: the machine.
        wrenches: for each leg, a basis of what it carries at the tool point [n x 6 x m], moments over the length.
        tool: the tool point, m [n x 3].
        soft: compliance of each leg without its passive joints at the tool, in the length's units [n x 6 x 6].
    """
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

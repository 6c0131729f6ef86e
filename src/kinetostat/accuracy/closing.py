"""Legs with small errors closed on the platform, at many poses: places, wrenches, and Newton's method.

An error displaces what follows it in its leg by a small screw motion. Actuators are held; passive joints take up what
they can, and the wrenches that each leg can carry decide what the platform makes of the rest. Arrays have the poses
first [n]; screws are at the base origin in base axes, SI, unless said otherwise.

Source: theory (45) to (48).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.accuracy.rows import Row, Rows, places_of
from kinetostat.accuracy.screws import Screws, independent, moved_to, scaled
from kinetostat.arrays import Array, Mask
from kinetostat.numerics.motions import Motions, cross, each_about, exponential, logarithm, still

SETTLED = 1e-8
"""Motion of the last step of Newton's method, rad or in units of the machine's length: the next one would be about its
square, or a thousandth of it where legs share a misfit."""
STAGE = 0.2
"""Farthest way of a stage, rad or in units of the machine's length, where fewer than all stages do."""
NEAR = 1e-2
"""The same on the way there, where the next stage starts from."""
MOST_STEPS = 40
"""Of Newton's method: errors are small, so that a few steps suffice where there is a solution."""
STAGES = 8
"""Steps on the way from the home place to a pose."""
SOFTEST_SHARE = 1e-9
"""Share of the mean compliance of the legs that a leg without any is given where legs must share a misfit."""

Errors = list[dict[int, Array]]
"""For each leg, by the number of motions before it, the small screw motion of an error in home place [n x 6]; [1 x 6]
where it is the same at all poses."""


@dataclass(frozen=True)
class Place:
    """A leg somewhere.

    Attributes:
        before: the displacement from the home place of what each number of motions carries, before the errors there.
        end: of the platform's end.
        screws: of its coordinates in place, per unit [n x 6 x coordinates].
    """

    before: tuple[Motions, ...]
    end: Motions
    screws: Array


def placed(row: Row, coordinates: Array, errors: dict[int, Array]) -> Place:
    """Follow a leg from base to platform, theory (45).

    Args:
        row: the leg at its home place.
        coordinates: of its joints, rad or m [n x coordinates].
        errors: displacements that stand behind a number of motions [n x 6].
    """
    count, twists = len(coordinates), np.array(row.twists).reshape(-1, 6)
    motion, before, screws = still(count), [], np.zeros((count, 6, row.size))
    steps = each_about(twists, coordinates[:, row.coordinate])
    for number, (step, which) in enumerate(zip(steps, row.coordinate, strict=True)):
        before.append(motion)
        motion = _with(motion, errors.get(number))
        screws[:, :, which] += motion.twist(twists[number, None])
        motion = motion @ step
    before.append(motion)
    return Place(tuple(before), _with(motion, errors.get(len(twists))), screws)


def _with(motion: Motions, error: Array | None) -> Motions:
    return motion if error is None else motion @ exponential(error)


def followed(row: Row, target: Motions, length: float, errors: dict[int, Array] | None = None) -> Array:
    """Coordinates with which a leg takes the platform to a displacement, or near it [n x coordinates], rad or m.

    All of its coordinates move, actuators too, by least-norm steps along a screw motion from the home place.
    """
    whole = logarithm(target)
    coordinates = np.zeros((len(whole), row.size))
    units = np.where(row.slides, length, 1.0)
    chosen = independent(scaled(placed(row, places_of(row, length), {}).screws, length, axis=1))
    far = float(np.abs(scaled(whole, length)).max(initial=0.0, where=np.isfinite(whole)))
    stages = min(max(int(np.ceil(far / STAGE)), 1), STAGES)
    for stage in range(1, stages + 1):
        goal = exponential(whole * (stage / stages))
        for _ in range(MOST_STEPS if stage == stages else 3):
            at = placed(row, coordinates, errors or {})
            gap = scaled(logarithm(goal @ at.end.inverse()), length)
            rates = scaled(at.screws, length, axis=1) * units
            step = Screws(rates, chosen).steps(gap) * units
            coordinates = coordinates + step
            if np.abs(step / units).max(initial=0.0) < (SETTLED if stage == stages else NEAR):
                break
    return coordinates


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


def free_screws(row: Row, rows: Rows, at: Place, tool: Array) -> Array:
    """The screws of what moves freely in a leg, at points, in units of the length [n x 6 x freedoms].

    Args:
        row: the leg.
        rows: its machine; twists that a planar one does not have count as free.
        at: where the leg is.
        tool: the points, m [n x 3].
    """
    free = at.screws[:, :, list(row.free)] * np.where(
        np.array(row.slides, dtype=bool)[list(row.free)], rows.length, 1.0
    )
    absent = np.broadcast_to(rows.absent.T, (len(free), 6, len(rows.absent)))
    screws = np.concatenate([free, absent], axis=2)
    return scaled(moved_to(np.swapaxes(screws, 1, 2), tool), rows.length).swapaxes(1, 2)


def _units(row: Row, length: float) -> Array:
    """The units of its free coordinates, 1 rad or the machine's length, m."""
    return np.array([length if row.slides[place] else 1.0 for place in row.free])


def freed(rows: Rows, places: Sequence[Place], tool: Array, chosen: Sequence[tuple[int, ...]]) -> list[Screws]:
    """Free screws of each leg at its place, at tool points [n x 3]; `chosen` as of `Screws`."""
    every = zip(rows.legs, places, chosen, strict=True)
    return [Screws(free_screws(row, rows, at, tool), which) for row, at, which in every]


def holding(rows: Rows, free: Sequence[Screws], tool: Array, soft: Sequence[Array]) -> Holding:
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


def _guide(rows: Rows, tool: Array) -> Array:
    """Wrenches against the twists that a planar machine does not have [n x 6 x 3]; none of a spatial one."""
    absent = np.broadcast_to(rows.absent, (len(tool), *rows.absent.shape))
    if not len(rows.absent):
        return np.zeros((len(tool), 6, 0))
    return np.swapaxes(scaled(moved_to(absent, tool), rows.length), 1, 2)


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
    resisted = np.swapaxes(_solved(weights, np.swapaxes(every, 1, 2)), 1, 2)
    return _solved(resisted @ np.swapaxes(every, 1, 2), resisted)


def _inverse(matrices: Array) -> Array:
    return _solved(matrices, np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape))


def _solved(matrices: Array, right: Array) -> Array:
    """Solutions of linear equations; NaN where these are singular or not finite."""
    result = np.full(np.broadcast_shapes(matrices.shape[:1], right.shape[:1]) + right.shape[1:], np.nan)
    sound: Mask = np.asarray(np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2)))
    sound[sound] = np.abs(np.linalg.det(matrices[sound])) > 1e-300
    result[sound] = np.linalg.solve(matrices[sound], right[sound])
    return result


@dataclass(frozen=True)
class State:
    """Place of a machine with errors.

    Attributes:
        platform: displacement of the platform from its home place.
        coordinates: of the joints of each leg [n x coordinates].
        settled: where Newton's method has arrived [n].
    """

    platform: Motions
    coordinates: tuple[Array, ...]
    settled: Mask


def closed(
    rows: Rows,
    start: State,
    errors: Errors,
    tool_home: Array,
    chosen: Sequence[tuple[int, ...]],
    soft: Sequence[Array],
) -> State:
    """Close the legs with their errors while their actuators stand still: Newton's method, theory (48).

    Args:
        rows: the machine at its home place.
        start: joint coordinates, with the actuators where they stand, and the platform nearby.
        errors: the errors of each leg.
        tool_home: the tool point at the home place, m [3].
        chosen: see `freed`.
        soft: see `holding`.
    """
    platform, coordinates, length = start.platform, list(start.coordinates), rows.length
    settled = np.zeros(len(platform.translation), dtype=bool)
    for _ in range(MOST_STEPS):
        places = [placed(row, q, e) for row, q, e in zip(rows.legs, coordinates, errors, strict=True)]
        tool = platform.point(np.broadcast_to(tool_home, (len(settled), 3)))
        free = freed(rows, places, tool, chosen)
        hold = holding(rows, free, tool, soft)
        gaps = [scaled(moved_to(logarithm(at.end @ platform.inverse()), tool), length) for at in places]
        twist = sum((hold.twist(i, gap[:, None])[:, 0] for i, gap in enumerate(gaps)), np.zeros((len(settled), 6)))
        largest = np.abs(twist).max(axis=1)
        for number, (row, screws, gap) in enumerate(zip(rows.legs, free, gaps, strict=True)):
            step = screws.steps(twist - gap)[:, : len(row.free)]
            largest = np.maximum(largest, np.abs(step).max(axis=1, initial=0.0))
            new = coordinates[number].copy()
            new[:, list(row.free)] += step * _units(row, length)
            coordinates[number] = new
        back = np.concatenate([twist[:, :3], twist[:, 3:] * length], axis=1)
        platform = exponential(moved_to(back, -tool)) @ platform
        settled = largest < SETTLED
        if settled.all() or not np.isfinite(largest).any():
            break
    return State(platform, tuple(coordinates), settled)

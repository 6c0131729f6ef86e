"""Poses to measure next: those that make the uncertain combinations of unknowns surest (D-optimal designs).

The determinant of the information grows by poses that are chosen one after the other, and then exchanged as long as
that helps (V. Fedorov, 1972). Candidates lie at random within the limits of the machine's file and are joined to poses
at which it has been: rays go out from a measured pose until a limit or a singularity ends them, first along each
coordinate, which says how far each one goes, then in random directions. Where the file sets no limits, candidates lie
in the range of what was measured.

Source: theory (67) and (68).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from kinetostat.accuracy.model import error_model
from kinetostat.arrays import Array, Mask
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import REGULAR, Status
from kinetostat.machine.limits import limits_set
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, find_field
from kinetostat.spec.renamed import former_names
from kinetostat.studies.identification.fit import Fit
from kinetostat.studies.identification.measurements import Measurements
from kinetostat.studies.identification.observation import Observation, observation
from kinetostat.units import KINDS

CANDIDATES = 400
"""Random poses from which some are chosen: twice as many shorten the intervals of a hexapod by 6 % more, and take
another half a second."""
MOST_PROPOSED = 100
"""Greatest number of poses to propose: they take two seconds, and a quarter of the candidates is still a choice."""
MOST_EXCHANGES = 5
"""Greatest number of rounds of exchanges; the second one changes nothing as a rule."""
LEAST_INFORMATION = 1e-9
"""Information along every combination, as a share of all that is known: a determinant needs some of it in each, and up
to here it does not change the choice."""
LEAST_HALF_RANGE = 0.1
"""Least half of the range of first poses in each coordinate: a tenth of the machine's length, or 0.1 rad. All poses
that were measured may be the same in some coordinate; twice as much would leave the workspace of many machines."""
LONGEST_RAY = 1.5
"""End of a ray, in lengths of the machine or rad; once the extent of each coordinate is known, in multiples of it. More
than 1, because the corner of a box lies beyond the middles of its faces."""
RAY_STEPS = 48
"""Places of a ray at which limits are compared: half as many would give away 2 % of the gain of a hexapod."""
SINGULAR_SHARE = 0.1
"""Share of the singularity margin at the start that must be left all along a ray, so that no step passes over a
singularity."""

WITHIN_LIMITS = "They were chosen within the [limits] of the machine's file."
WITHOUT_LIMITS = (
    "The machine's file sets no [limits]: they were chosen in the range of the measured poses. Set strokes and angles "
    "of joints to have them chosen wherever the machine may go."
)
BEYOND_LIMITS = (
    "No measured pose keeps the [limits] of the machine's file: they were chosen in the range of the measured poses."
)

Poses = Mapping[str, Array]
"""Coordinates of poses by leaf path, SI [poses each]."""


@former_names(sharper="gain", random="gain_at_random", within="area")
@dataclass(frozen=True)
class NextPoses:
    """Poses that should be measured next.

    Attributes:
        poses: their coordinates by leaf path, SI [k each].
        gain: by which factor they make the intervals of the unknowns shorter, as a geometric mean.
        gain_at_random: the same factor for as many candidates at random.
        ranges: least and greatest value of each coordinate among the candidates, SI.
        area: a sentence on where candidates were looked for.
    """

    poses: Poses
    gain: float
    gain_at_random: float
    ranges: Mapping[str, tuple[float, float]]
    area: str


def next_poses(machine: Machine, observed: Observation, fit: Fit, sizes: Array, count: int) -> NextPoses | None:
    """Choose poses among candidates; None where too few of these can be placed.

    Args:
        machine: the machine that is measured.
        observed: its measurements beside the model.
        fit: the fit to them.
        sizes: plausible size of each unknown, SI [unknowns].
        count: how many poses are wanted.
    """
    rng = np.random.default_rng(0)  # a fixed seed: the same measurements give the same advice
    candidates, area = _candidates(machine, observed, _ranges(observed.data.pose), rng)
    if len(candidates.data) < count:
        return None
    _, rates = candidates.linearisation(fit.values)
    seen_combinations = fit.combinations[:, : fit.rank]
    blocks = (rates * sizes @ seen_combinations).reshape(len(candidates.data), -1, fit.rank)
    information = np.diag(fit.strengths[: fit.rank] ** 2)
    chosen = chosen_poses(blocks, information, count)
    random_poses = rng.permutation(len(blocks))[:count]
    return NextPoses(
        poses=_selection(candidates, chosen),
        gain=_gain(blocks[chosen], information),
        gain_at_random=_gain(blocks[random_poses], information),
        ranges=_ranges(candidates.data.pose),
        area=area,
    )


def first_poses(machine: Machine, observed: Observation, sizes: Array, count: int) -> Poses:
    """Choose poses to add where there are too few for a fit: within limits, or about the measured ones.

    Args:
        machine: the machine that is measured.
        observed: its few measurements beside the model.
        sizes: plausible size of each unknown, SI [unknowns].
        count: how many poses are wanted; fewer are chosen where fewer candidates can be placed.
    """
    ranges = {}
    for path, (low, high) in _ranges(observed.data.pose).items():
        middle, half = 0.5 * (high + low), 0.5 * (high - low)
        half = max(half, LEAST_HALF_RANGE * _scale(machine, path, observed.model.length))
        ranges[path] = (middle - half, middle + half)
    candidates, _ = _candidates(machine, observed, ranges, np.random.default_rng(0))
    drawn = np.zeros(len(sizes))
    _, measured_rates = observed.linearisation(drawn)
    _, rates = candidates.linearisation(drawn)
    blocks = (rates * sizes).reshape(len(candidates.data), -1, len(sizes))
    information = (measured_rates * sizes).T @ (measured_rates * sizes)
    return _selection(candidates, chosen_poses(blocks, information, min(count, len(blocks))))


def as_csv(machine: Machine, proposed: NextPoses) -> str:
    """The poses as CSV, a row each, as `kinetostat path` and `kinetostat command` read them: "x [m]", "roll [rad]"."""
    heads = [f"{path.removeprefix(POSE)} [{unit_of(machine, path)}]" for path in proposed.poses]
    rows = zip(*(values.tolist() for values in proposed.poses.values()), strict=True)
    lines = [",".join(heads), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    return "\n".join(lines) + "\n"


def unit_of(machine: Machine, path: str) -> str:
    """The SI unit of a coordinate of the pose, by its path."""
    return KINDS[find_field(machine.family, path).quantity.kind].unit


def _scale(machine: Machine, path: str, length: float) -> float:
    """The size with which a coordinate of the pose is compared: the machine's length, m, or 1 rad."""
    return length if unit_of(machine, path) == "m" else 1.0


def _ranges(poses: Poses) -> dict[str, tuple[float, float]]:
    return {path: (float(values.min()), float(values.max())) for path, values in poses.items()}


def _selection(candidates: Observation, numbers: Sequence[int]) -> Poses:
    return {path: values[list(numbers)] for path, values in candidates.data.pose.items()}


def _candidates(
    machine: Machine, observed: Observation, ranges: Mapping[str, tuple[float, float]], rng: np.random.Generator
) -> tuple[Observation, str]:
    """Random poses that the machine reaches, as if the same had been measured there, and a sentence on where they are.

    They keep the limits of its file; where that sets none, or no measured pose keeps them, they lie within the ranges
    of the coordinates, and limits do not count.
    """
    scales = {path: _scale(machine, path, observed.model.length) for path in ranges}
    poses = within_limits(machine, observed.data.pose, scales, CANDIDATES, rng)
    area = WITHIN_LIMITS
    allowed: tuple[Status, ...] = (Status.OK,)
    if poses is None:
        poses = {path: rng.uniform(low, high, CANDIDATES) for path, (low, high) in ranges.items()}
        area, allowed = (BEYOND_LIMITS if limits_set(machine.tables["limits"]) else WITHOUT_LIMITS), REGULAR
    model = error_model(machine, poses, CANDIDATES, np.zeros(6))
    placed = np.flatnonzero(np.isin(model.drawn.status, allowed))
    poses = {path: values[placed] for path, values in poses.items()}
    data = _alike(observed.data, poses, len(placed))
    candidates = observation(model.at_poses(placed), data, observed.unknowns, observed.frame)
    return replace(candidates, error_mix=observed.error_mix), area


def _alike(data: Measurements, pose: Poses, count: int) -> Measurements:
    """Measurements of the same quantities at other poses: median deviations and origin, the first load, values zero."""
    wrenches = data.wrenches[data.wrenches.any(axis=1)]
    written = data.origins[np.isfinite(data.origins).all(axis=1)]  # a file without distances has none
    origin = np.median(written, axis=0) if len(written) else np.zeros(3)
    return replace(
        data,
        lines=tuple(range(count)),
        pose=pose,
        values={name: np.zeros(count) for name in data.values},
        sigma={name: np.full(count, float(np.median(sigma))) for name, sigma in data.sigma.items()},
        wrenches=np.broadcast_to(wrenches[0] if len(wrenches) else np.zeros(6), (count, 6)),
        origins=np.broadcast_to(origin, (count, 3)),
    )


def chosen_poses(blocks: Array, measured_information: Array, count: int) -> list[int]:
    """Choose poses whose information has the greatest determinant together with what is known, theory (67).

    Args:
        blocks: rates of the values measured at each pose, in standard deviations [poses x values x unknowns].
        measured_information: the information of what was measured [unknowns x unknowns].
        count: how many poses are wanted.
    """
    least = LEAST_INFORMATION * max(float(np.trace(measured_information)), 1.0)
    information = measured_information + np.eye(len(measured_information)) * least
    chosen: list[int] = []
    for _ in range(count):
        best = int(np.argmax(_growth(blocks, information, chosen)))
        chosen.append(best)
        information = information + blocks[best].T @ blocks[best]
    for _ in range(MOST_EXCHANGES):
        before = list(chosen)
        for place in range(count):
            others = [*chosen[:place], *chosen[place + 1 :]]
            of_others = information - blocks[chosen[place]].T @ blocks[chosen[place]]
            chosen[place] = best = int(np.argmax(_growth(blocks, of_others, others)))
            information = of_others + blocks[best].T @ blocks[best]
        if chosen == before:
            break
    return chosen


def _growth(blocks: Array, information: Array, chosen: list[int]) -> Array:
    """Growth of the logarithm of the determinant by each pose [poses]; minus infinity for those that are chosen."""
    spread = blocks @ np.linalg.solve(information, np.swapaxes(blocks, 1, 2))
    growth = np.linalg.slogdet(np.eye(blocks.shape[1]) + spread)[1]
    growth[chosen] = -np.inf
    return np.asarray(growth)


def _gain(blocks: Array, information: Array) -> float:
    """The factor by which intervals become shorter, as a geometric mean, theory (68)."""
    rows = blocks.reshape(-1, blocks.shape[2])
    before, after = (float(np.linalg.slogdet(each)[1]) for each in (information, information + rows.T @ rows))
    return float(np.exp((after - before) / (2.0 * len(information))))


def within_limits(
    machine: Machine, measured: Poses, scales: Mapping[str, float], count: int, rng: np.random.Generator
) -> Poses | None:
    """Draw poses within the limits of a machine's file; only coordinates that measurements vary differ.

    Args:
        machine: the machine with its limits.
        measured: poses at which it has been.
        scales: the size of each of their coordinates: the machine's length, m, or 1 rad.
        count: how many poses are wanted.
        rng: the source of random numbers.

    Returns:
        The poses [count each]; None if the file sets no limits or no measured pose keeps them.
    """
    if not limits_set(machine.tables["limits"]):
        return None
    paths, scale = list(measured), np.array([scales[path] for path in measured])
    places = np.stack([measured[path] for path in paths], axis=1)
    margins = _margins(machine, paths, places)
    if not (margins > 0.0).any():
        return None
    # Rays go out from the measured pose in the middle of those that keep the limits.
    distance_from_mean = np.abs((places - places.mean(axis=0)) / scale).max(axis=1)
    middle = int(np.argmin(np.where(margins > 0.0, distance_from_mean, np.inf)))
    start, least_margin = places[middle], SINGULAR_SHARE * float(margins[middle])
    axes = np.concatenate([np.diag(scale), -np.diag(scale)])
    extents = _reach(machine, paths, start, axes, least_margin).reshape(2, -1).max(axis=0) * scale
    rays = rng.normal(size=(count, len(paths)))
    rays = rays / np.linalg.norm(rays, axis=1)[:, None] * extents
    # The root makes poses even in the volume: as many lie in each part of it.
    factors = _reach(machine, paths, start, rays, least_margin) * rng.random(count) ** (1.0 / len(paths))
    return dict(zip(paths, (start + factors[:, None] * rays).T, strict=True))


def _reach(machine: Machine, paths: list[str], start: Array, rays: Array, least_margin: float) -> Array:
    """The factor of each ray [rays x coordinates] up to which the singularity margin along it is above the least one.

    Returns:
        The factors [rays], from 0 to `LONGEST_RAY`.
    """
    factors = np.linspace(0.0, LONGEST_RAY, RAY_STEPS + 1)
    places = start + factors[1:, None, None] * rays
    passes = _margins(machine, paths, places.reshape(-1, len(paths))).reshape(RAY_STEPS, -1) > least_margin
    steps_passed = np.where(passes.all(axis=0), RAY_STEPS, np.argmin(passes, axis=0))
    return np.asarray(factors[steps_passed])


def _margins(machine: Machine, paths: list[str], places: Array) -> Array:
    """The singularity margin at poses [poses x coordinates]; 0 where one is out of reach or passes a limit."""
    columns = {path: np.ascontiguousarray(column) for path, column in zip(paths, places.T, strict=True)}
    answer = evaluate(machine, PointTable(columns), ["singularity_margin"])
    inside: Mask = np.asarray(answer.status == Status.OK)
    return np.where(inside, answer.values["singularity_margin"], 0.0)

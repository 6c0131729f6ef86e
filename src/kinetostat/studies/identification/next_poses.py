"""Poses to measure next: those that make the uncertain combinations of unknowns surest (D-optimal designs).

The determinant of the information grows by poses that are chosen one after the other, and then exchanged as long as
that helps (V. Fedorov, 1972). Candidates lie at random within the limits of the machine's file and are joined to poses
at which it has been: rays go out from a measured pose until a limit or a singularity ends them, first along each
coordinate, which says how far each one goes, then in random directions. Where the file sets no limits, candidates lie
in the range of what was measured.

Source: theory (67) and (68).
"""

from collections.abc import Mapping
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
from kinetostat.studies.identification.fit import Fit
from kinetostat.studies.identification.measurements import Measurements
from kinetostat.studies.identification.observation import Observation, observation

CANDIDATES = 400
MOST_PROPOSED = 100
EXCHANGES = 5
"""Rounds of exchanges at most."""
LEAST_SPAN = 0.1
"""Least span of first poses on either side of the measured ones: a tenth of the machine's length, or 0.1 rad."""

WITHIN_LIMITS = "They were chosen within the [limits] of the machine's file."
WITHOUT_LIMITS = (
    "The machine's file sets no [limits]: they were chosen in the range of the measured poses. Set strokes and angles "
    "of joints to have them chosen wherever the machine may go."
)
BEYOND_LIMITS = (
    "No measured pose keeps the [limits] of the machine's file: they were chosen in the range of the measured poses."
)
FARTHEST, RAY_STEPS = 1.5, 48
"""End of a ray, in lengths of the machine or rad, then in reaches of all coordinates; and how many places of a ray are
looked at."""
SINGULAR_SHARE = 0.1
"""Share of the singularity margin at the start that must be left all along a ray, so that no step passes over a
singularity."""

Poses = Mapping[str, Array]
LEAST_INFORMATION = 1e-9
"""Information along every combination, as a share of all that is known: a determinant needs some of it in each."""


@dataclass(frozen=True)
class NextPoses:
    """Poses that should be measured next.

    Attributes:
        poses: coordinates by leaf path, SI [k].
        sharper: by which factor they make the intervals of the unknowns shorter, as a geometric mean.
        random: the factor of as many poses at random.
        ranges: least and greatest value of each coordinate among the candidates, SI.
        within: where they were looked for, a sentence.
    """

    poses: Mapping[str, Array]
    sharper: float
    random: float
    ranges: Mapping[str, tuple[float, float]]
    within: str


def next_poses(machine: Machine, seen: Observation, fit: Fit, sizes: Array, count: int) -> NextPoses | None:
    """Choose poses among candidates; None where too few of these can be placed.

    Args:
        machine: that is measured.
        seen: its measurements beside the model.
        fit: to them.
        sizes: plausible size of each unknown, SI [unknowns].
        count: how many poses are wanted.
    """
    spans = {path: (float(values.min()), float(values.max())) for path, values in seen.data.pose.items()}
    rng = np.random.default_rng(0)
    there, within = _candidates(machine, seen, spans, rng)
    rows = len(there.data)
    if rows < count:
        return None
    _, rates = there.linearisation(fit.values)
    basis = fit.combinations[:, : fit.rank]
    blocks = (rates * sizes @ basis).reshape(rows, -1, fit.rank)
    start = np.diag(fit.strengths[: fit.rank] ** 2)
    chosen = chosen_poses(blocks, start, count)
    gain, usual = (_gain(blocks[which], start) for which in (chosen, rng.permutation(rows)[:count]))
    poses = {path: values[chosen] for path, values in there.data.pose.items()}
    ranges = {path: (float(values.min()), float(values.max())) for path, values in there.data.pose.items()}
    return NextPoses(poses, gain, usual, ranges, within)


def first_poses(machine: Machine, seen: Observation, sizes: Array, count: int) -> Mapping[str, Array]:
    """Choose poses to add where there are too few for a fit: within limits, or about those that are there.

    Args:
        machine: that is measured.
        seen: its few measurements beside the model.
        sizes: plausible size of each unknown, SI [unknowns].
        count: how many poses are wanted.

    Returns:
        Coordinates by leaf path, SI [count at most].
    """
    spans = {}
    for path, values in seen.data.pose.items():
        least = LEAST_SPAN * (seen.model.length if unit_of(path) == "m" else 1.0)
        middle, half = 0.5 * (values.max() + values.min()), 0.5 * (values.max() - values.min())
        spans[path] = (middle - max(half, least), middle + max(half, least))
    there, _ = _candidates(machine, seen, spans, np.random.default_rng(0))
    _, known = seen.linearisation(np.zeros(len(sizes)))
    _, rates = there.linearisation(np.zeros(len(sizes)))
    blocks = (rates * sizes).reshape(len(there.data), -1, len(sizes))
    start = (known * sizes).T @ (known * sizes)
    chosen = chosen_poses(blocks, start, min(count, len(blocks)))
    return {path: values[chosen] for path, values in there.data.pose.items()}


def as_csv(proposed: NextPoses) -> str:
    """The poses as CSV, a row each, as `kinetostat path` and `kinetostat command` read them: "x [m]", "roll [rad]"."""
    heads = [f"{path.removeprefix('pose.')} [{unit_of(path)}]" for path in proposed.poses]
    rows = zip(*(values.tolist() for values in proposed.poses.values()), strict=True)
    lines = [",".join(heads), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    return "\n".join(lines) + "\n"


def unit_of(path: str) -> str:
    """The SI unit of a coordinate of the pose."""
    return "m" if path.removeprefix("pose.") in ("x", "y", "z", "length") else "rad"


def _candidates(
    machine: Machine, seen: Observation, spans: Mapping[str, tuple[float, float]], rng: np.random.Generator
) -> tuple[Observation, str]:
    """Poses at random that the machine reaches, as if the same had been measured there, and a sentence about them.

    They keep the limits of its file; without any they lie within spans.
    """
    units = {path: seen.model.length if unit_of(path) == "m" else 1.0 for path in spans}
    poses = within_limits(machine, seen.data.pose, units, CANDIDATES, rng)
    within = WITHIN_LIMITS
    if poses is None:
        poses = {path: rng.uniform(low, high, CANDIDATES) for path, (low, high) in spans.items()}
        within = BEYOND_LIMITS if limits_set(machine.tables["limits"]) else WITHOUT_LIMITS
    whole = error_model(machine, poses, CANDIDATES, np.zeros(6))
    rows = np.flatnonzero(np.isin(whole.drawn.status, REGULAR if within != WITHIN_LIMITS else Status.OK))
    poses = {path: values[rows] for path, values in poses.items()}
    there = observation(whole.at_poses(rows), _like(seen.data, poses, len(rows)), seen.unknowns, seen.frame)
    return replace(there, error_mix=seen.error_mix), within


def _like(data: Measurements, pose: Mapping[str, Array], count: int) -> Measurements:
    """Measurements of the same sort at other poses; what they say does not count."""
    typical = {name: np.full(count, float(np.median(sigma))) for name, sigma in data.sigma.items()}
    loads = data.wrenches[np.flatnonzero(data.wrenches.any(axis=1))[:1]]
    wrench = np.broadcast_to(loads[0] if len(loads) else np.zeros(6), (count, 6))
    origins = np.broadcast_to(np.nan_to_num(np.nanmedian(np.nan_to_num(data.origins), axis=0)), (count, 3))
    values = {name: np.zeros(count) for name in data.values}
    return Measurements(data.path, tuple(range(count)), pose, values, typical, wrench, origins, data.known)


def chosen_poses(blocks: Array, start: Array, count: int) -> list[int]:
    """Choose poses whose information has the greatest determinant together with what is known, theory (67).

    Args:
        blocks: rates of the values measured at each pose, in standard deviations [poses x values x unknowns].
        start: the information so far [unknowns x unknowns].
        count: how many.
    """
    chosen: list[int] = []
    information = start + np.eye(len(start)) * LEAST_INFORMATION * max(float(np.trace(start)), 1.0)
    for _ in range(count):
        best = int(np.argmax(_growth(blocks, information, chosen)))
        chosen.append(best)
        information = information + blocks[best].T @ blocks[best]
    for _ in range(EXCHANGES):
        changed = False
        for place in range(count):
            rest = information - blocks[chosen[place]].T @ blocks[chosen[place]]
            others = [number for n, number in enumerate(chosen) if n != place]
            best = int(np.argmax(_growth(blocks, rest, others)))
            changed = changed or best != chosen[place]
            chosen[place] = best
            information = rest + blocks[best].T @ blocks[best]
        if not changed:
            break
    return chosen


def _growth(blocks: Array, information: Array, taken: list[int]) -> Array:
    """By how much each pose makes the logarithm of the determinant grow [poses]; nothing of those that are taken."""
    spread = blocks @ np.linalg.solve(information, np.swapaxes(blocks, 1, 2))
    growth = np.linalg.slogdet(np.eye(blocks.shape[1]) + spread)[1]
    growth[taken] = -np.inf
    return np.asarray(growth)


def _gain(blocks: Array, start: Array) -> float:
    """The factor by which intervals become shorter, as a geometric mean, theory (68)."""
    flat = blocks.reshape(-1, blocks.shape[2])
    before, after = (float(np.linalg.slogdet(information)[1]) for information in (start, start + flat.T @ flat))
    return float(np.exp((after - before) / (2.0 * len(start))))


def within_limits(
    machine: Machine, measured: Poses, units: Mapping[str, float], count: int, rng: np.random.Generator
) -> Poses | None:
    """Draw poses within the limits of a machine's file, those coordinates alone that measurements vary.

    Args:
        machine: with its limits.
        measured: poses at which it has been, by leaf path, SI.
        units: of each of their coordinates: the machine's length, m, or 1 rad.
        count: how many poses are wanted.
        rng: draws them.

    Returns:
        Coordinates by leaf path, SI [count]; None if the file sets no limits or no measured pose keeps them.
    """
    if not limits_set(machine.tables["limits"]):
        return None
    paths, scale = list(measured), np.array([units[path] for path in measured])
    places = np.stack([measured[path] for path in paths], axis=1)
    margins = _margins(machine, paths, places)
    if not (margins > 0.0).any():
        return None
    off = np.abs((places - places.mean(axis=0)) / scale).max(axis=1)
    middle = int(np.argmin(np.where(margins > 0.0, off, np.inf)))
    start, least = places[middle], SINGULAR_SHARE * float(margins[middle])
    axes = np.concatenate([np.diag(scale), -np.diag(scale)])
    reach = _reach(machine, paths, start, axes, least).reshape(2, -1).max(axis=0) * scale
    rays = rng.normal(size=(count, len(paths)))
    rays = rays / np.linalg.norm(rays, axis=1)[:, None] * reach
    # The root makes poses even in the volume: as many lie in each part of it.
    share = _reach(machine, paths, start, rays, least) * rng.random(count) ** (1.0 / len(paths))
    return dict(zip(paths, (start + share[:, None] * rays).T, strict=True))


def _reach(machine: Machine, paths: list[str], start: Array, rays: Array, least: float) -> Array:
    """Reach of rays [rays x coordinates] from a pose before they end: factors of their length [rays]."""
    steps = np.linspace(0.0, FARTHEST, RAY_STEPS + 1)[1:]
    places = start + steps[:, None, None] * rays
    kept = _margins(machine, paths, places.reshape(-1, len(paths))).reshape(RAY_STEPS, -1) > least
    ended = np.where(kept.all(axis=0), RAY_STEPS, np.argmin(kept, axis=0))
    return np.asarray(np.concatenate([[0.0], steps])[ended])


def _margins(machine: Machine, paths: list[str], places: Array) -> Array:
    """The singularity margin at poses [poses x coordinates]; 0 where one is out of reach or passes a limit."""
    columns = {path: np.ascontiguousarray(column) for path, column in zip(paths, places.T, strict=True)}
    answer = evaluate(machine, PointTable(columns), ["singularity_margin"])
    inside: Mask = np.asarray(answer.status == Status.OK)
    return np.where(inside, answer.values["singularity_margin"], 0.0)

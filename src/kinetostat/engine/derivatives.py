"""Many points at once with exact derivatives: the engine chooses arithmetic and slab size. Holds no formula.

Few points go through NumPy and many through machine code, both from the same graph and by the same rules. Where the
joints of a machine written leg by leg follow from equations, so do their derivatives.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from kinetostat.engine.batch import NATIVE_SLAB, Fill, Progress, by_free_springs, in_slabs, silent
from kinetostat.engine.body import Array, Codes, Runnable
from kinetostat.engine.form import Form, Kind, angles, form_of, reduced
from kinetostat.engine.gradient import with_gradients
from kinetostat.engine.implicit import total_slopes
from kinetostat.engine.interpreter import Interpreted
from kinetostat.engine.points import Points
from kinetostat.engine.questions import Weights, equations_of, objectives_of
from kinetostat.engine.threads import available_cores
from kinetostat.kinematics.closure import solve_joints
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

MACHINE_CODE_FROM = 20_000
"""Points from which compiling pays: NumPy differentiates some ten thousand poses/s."""
SMALL_SLAB = 512
"""Points per slab of NumPy calls and of linear systems: some thousand arrays of it wait in memory at once."""
KEPT = 32
"""Programs kept in memory."""

Objective: TypeAlias = str | Mapping[str, float]
"""A quantity by name, or a weighted sum of several: weights, in whatever unit, by name."""


@dataclass(frozen=True)
class Gradients:
    """Values and derivatives at every point, in order.

    Attributes:
        values: of the objectives [objectives x points]; NaN where the status is not OK, infinite where rigid or free.
        gradients: by the parameters, SI [objectives x paths x points]; NaN where the value is not finite, by a spring
            that is free, and by a parameter that cannot change alone without the legs opening. By a rigid spring it
            is 0.
        status: `Status` codes.
    """

    values: Array
    gradients: Array
    status: Codes


def evaluate_gradient(
    machine: Machine,
    points: Points,
    objectives: Objective | Sequence[Objective],
    paths: Sequence[str],
    progress: Progress = silent,
) -> Gradients:
    """Objectives of a machine at many points, and their exact derivatives.

    Args:
        machine: gives all parameters that do not vary.
        points: where; leaf paths of the machine's family and their values, SI.
        objectives: one or several; names are from `kinetostatics.quantities.QUANTITIES`.
        paths: leaf paths of the parameters to differentiate by, whether they vary over the points or not.
        progress: told how far the work is.
    """
    wanted = [objectives] if isinstance(objectives, str | Mapping) else list(objectives)
    weights = tuple(((one, 1.0),) if isinstance(one, str) else tuple(one.items()) for one in wanted)
    native = points.size >= MACHINE_CODE_FROM
    slab = NATIVE_SLAB if native and machine.family.chains is None else SMALL_SLAB

    def method(one: Machine, varying: Sequence[str], _names: Sequence[str]) -> Fill:
        return _fill(one, varying, weights, tuple(paths), native)

    fill = by_free_springs(machine, points.paths, (), method)
    count, rows = len(weights), len(weights) * (1 + len(paths))
    results, status = in_slabs(points, fill, rows, slab, available_cores() if native else 1, progress)
    values, slopes = results[:count], results[count:].reshape(count, len(paths), points.size)
    for value, own in zip(values, slopes, strict=True):
        own[:, ~np.isfinite(value)] = math.nan
    return Gradients(values, slopes, status)


def _fill(
    machine: Machine, varying: Sequence[str], weights: tuple[Weights, ...], paths: tuple[str, ...], native: bool
) -> Fill:
    """Evaluates slabs of points of one machine: objectives, then their derivatives by each path."""
    ends = {path: slope for path, slope in _at_ends(machine).items() if path in paths and path not in varying}
    by = tuple(path for path in paths if path not in ends)
    form, fixed = form_of(machine, varying, by)
    kind, turning, count = Kind(machine), angles(machine), len(weights)
    objectives = _program(kind, form, weights, by, native)
    equations = _program(kind, form, (), by, native) if machine.family.chains else None

    def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        served = {path: np.ascontiguousarray(columns[path], dtype=float) for path in form.varying}
        given = [reduced(column) if path in turning else column for path, column in served.items()]
        if equations is None and not ends:
            objectives.runnable.run(fixed, given, results, status)
            return
        if equations is not None:
            joints = solve_joints(with_values(machine, columns))
            found = [np.broadcast_to(c, status.shape) for c in (*joints.coordinates, joints.status)]
            given += [np.ascontiguousarray(column, dtype=float) for column in found]
        rates = equations.slopes(fixed, given, np.empty_like(status))[1] if equations else None
        results[:count], slopes = objectives.slopes(fixed, given, status)
        slopes = slopes if rates is None else _followed(slopes, rates, len(by))
        rows = results[count:].reshape(count, len(paths), len(status))
        for k, path in enumerate(paths):
            rows[:, k] = ends[path] if path in ends else slopes[:, by.index(path)]

    return fill


def _at_ends(machine: Machine) -> dict[str, float]:
    """Derivatives by the springs that are rigid or free by form: 0 and none."""
    stiff = {p.path for p in parameters(machine.family) if p.quantity.stiff}
    ends = {0.0: math.nan, math.inf: 0.0}
    return {path: ends[value] for path, value in values(machine).items() if path in stiff and value in ends}


def _followed(slopes: Array, rates: Array, count: int) -> Array:
    """Derivatives of objectives by parameters with the joints following, from those by parameters and joints."""
    by_point = [np.moveaxis(part, 2, 0) for part in (slopes, rates)]
    (own, by_joints), (given, joint_rates) = (np.split(part, [count], axis=2) for part in by_point)
    return np.moveaxis(total_slopes(own, by_joints, joint_rates, given), 0, 2)


@dataclass(frozen=True)
class _Program:
    """Results and their derivatives by some inputs, as something to run."""

    runnable: Runnable
    results: int
    inputs: int

    def slopes(self, fixed: Array, columns: Sequence[Array], codes: Codes) -> tuple[Array, Array]:
        """Results [results x points] and their derivatives [results x inputs x points]; codes in place."""
        found = np.empty((self.results * (1 + self.inputs), len(codes)))
        self.runnable.run(fixed, columns, found, codes)
        return found[: self.results], found[self.results :].reshape(self.results, self.inputs, len(codes))


@lru_cache(KEPT)
def _program(kind: Kind, form: Form, weights: tuple[Weights, ...], paths: tuple[str, ...], native: bool) -> _Program:
    """The program of objectives and their derivatives; without weights, that of the closing equations."""
    asked = objectives_of(kind, form, weights, paths) if weights else equations_of(kind, form, paths)
    count, inputs = len(asked.body.results), len(asked.inputs)
    if not native:
        return _Program(Interpreted(asked.body, asked.inputs), count, inputs)
    from kinetostat.engine.native import Program  # LLVM takes 0.1 s to load: only where it pays

    return _Program(Program(with_gradients(asked.body, asked.inputs)), count, inputs)

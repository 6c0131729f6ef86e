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

from kinetostat.engine.batch import NATIVE_SLAB, Fill, Progress, available_cores, by_free_springs, in_slabs, silent
from kinetostat.engine.form import Form, Kind, angles, form_of, reduced
from kinetostat.engine.gradient import with_gradients
from kinetostat.engine.implicit import total_slopes
from kinetostat.engine.interpreter import Interpreted
from kinetostat.engine.points import Points
from kinetostat.engine.questions import Weights, equations_of, objectives_of
from kinetostat.engine.trace import Array, Codes, Runnable
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values

MACHINE_CODE_FROM = 20_000
"""Points from which compiling pays: NumPy differentiates some ten thousand poses/s."""
SMALL_SLAB = 512
"""Points per slab of NumPy calls and of linear systems: some thousand arrays of it wait in memory at once."""
KEPT = 32
"""Programs kept in memory."""
SAME, ROUNDED = 1e-6, 1e-9
"""Relative difference up to which two ways to a derivative agree, and share of the largest that may be rounding."""
NEAR, TRIED = 0.03, 5
"""How far from a machine's own numbers, as a share of them, and at how many points closed forms are tried."""

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
    *,
    repeated: bool = False,
) -> Gradients:
    """Objectives of a machine at many points, and their exact derivatives.

    Args:
        machine: gives all parameters that do not vary.
        points: where; leaf paths of the machine's family and their values, SI.
        objectives: one or several; names are from `kinetostatics.quantities.QUANTITIES`.
        paths: leaf paths of the parameters to differentiate by, whether they vary over the points or not.
        progress: told how far the work is.
        repeated: whether the same will be asked at other points again and again, as by a search: then compiling pays
            for few points as well, once.
    """
    wanted = [objectives] if isinstance(objectives, str | Mapping) else list(objectives)
    weights = tuple(((one, 1.0),) if isinstance(one, str) else tuple(one.items()) for one in wanted)
    native = repeated or points.size >= MACHINE_CODE_FROM
    slab = NATIVE_SLAB if native else SMALL_SLAB
    threads = available_cores() if native and points.size > slab else 1

    def method(one: Machine, varying: Sequence[str], _names: Sequence[str]) -> Fill:
        return _fill(one, varying, weights, tuple(paths), native)

    fill = by_free_springs(machine, points.paths, (), method)
    count, rows = len(weights), len(weights) * (1 + len(paths))
    results, status = in_slabs(points, fill, rows, slab, threads, progress)
    values, slopes = results[:count], results[count:].reshape(count, len(paths), points.size)
    for value, own in zip(values, slopes, strict=True):
        own[:, ~np.isfinite(value)] = math.nan
    return Gradients(values, slopes, status)


def _fill(
    machine: Machine, varying: Sequence[str], weights: tuple[Weights, ...], paths: tuple[str, ...], native: bool
) -> Fill:
    """Evaluates slabs of points of one machine: objectives, then their derivatives by each path."""
    given = _Given(machine, varying, weights, paths, native)
    if machine.family.chains is None:
        return given.direct()
    if native and _closed_forms_hold(Kind(machine), given.form, weights, paths):
        return given.closed()
    return given.followed


@lru_cache(KEPT)
def _closed_forms_hold(kind: Kind, form: Form, weights: tuple[Weights, ...], paths: tuple[str, ...]) -> bool:
    """Whether closed forms hold while parameters change: near the machine's own pose both ways must agree.

    They do not where a parameter changes what they take as given: that axes are parallel, say, or that the platform
    keeps the coordinates that its pose does not give. (At the home pose itself legs close whatever their axes.)
    """
    from kinetostat.engine.kernel import needs_iteration

    if needs_iteration(kind.machine):
        return False
    held, given = values(kind.machine), _Given(kind.machine, form.varying, weights, paths, native=False)
    drawn = np.random.default_rng(0).uniform(-NEAR, NEAR, (len(form.varying), TRIED))
    columns = {path: held[path] + (abs(held[path]) or 1.0) * row for path, row in zip(form.varying, drawn, strict=True)}
    direct, followed = np.empty((2, len(weights) * (1 + len(paths)), TRIED))
    status = np.empty(TRIED, dtype=np.int8)
    for fill, results in ((given.direct(closed=True), direct), (given.followed, followed)):
        fill(columns, results, status)
    direct, followed = direct[:, status == Status.OK], followed[:, status == Status.OK]
    rounded = ROUNDED * np.nan_to_num(np.abs(followed)).max(initial=0.0)
    agree = np.allclose(direct, followed, rtol=SAME, atol=rounded, equal_nan=True)
    return bool((status == Status.OK).any()) and agree


class _Given:
    """What is differentiated by what, and the ways to do it."""

    def __init__(
        self,
        machine: Machine,
        varying: Sequence[str],
        weights: tuple[Weights, ...],
        paths: tuple[str, ...],
        native: bool,
    ) -> None:
        at_ends = {path: slope for path, slope in _at_ends(machine).items() if path in paths and path not in varying}
        self._machine, self._weights, self._paths, self._native = machine, weights, paths, native
        self._ends, self._by = at_ends, tuple(path for path in paths if path not in at_ends)
        self.form, self._fixed = form_of(machine, varying, self._by)
        self._angles = angles(machine)

    def direct(self, closed: bool = False) -> Fill:
        """All from one program: the family places the joints, or they are `closed` forms."""
        program = self._program(self._weights, closed)

        def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
            given = self._columns(columns)
            if self._ends:
                self._spread(*program.slopes(self._fixed, given, status), results)
            else:
                program.runnable.run(self._fixed, given, results, status)

        return fill

    def followed(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Fill with joints by Newton's method and their slopes from the closing equations."""
        joints = solve_joints(with_values(self._machine, columns))
        found = [np.broadcast_to(c, status.shape) for c in (*joints.coordinates, joints.status)]
        given = self._columns(columns) + [np.ascontiguousarray(column, dtype=float) for column in found]
        rates = self._program(()).slopes(self._fixed, given, np.empty_like(status))[1]
        values, partial = self._program(self._weights).slopes(self._fixed, given, status)
        self._spread(values, _followed(partial, rates, len(self._by)), results)

    def closed(self) -> Fill:
        """Fill in closed form, and with joints by Newton's method where closed forms do not close the legs."""
        direct = self.direct(closed=True)

        def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
            direct(columns, results, status)
            left = np.flatnonzero(status == Status.NOT_CONVERGED)
            if left.size:
                found, codes = np.empty((len(results), left.size)), np.empty(left.size, dtype=status.dtype)
                self.followed({path: column[left] for path, column in columns.items()}, found, codes)
                results[:, left], status[left] = found, codes

        return fill

    def _spread(self, found: Array, slopes: Array, results: Array) -> None:
        """Put objectives and slopes in their rows, and what is known by rigid and free springs."""
        count = len(self._weights)
        results[:count] = found
        rows = results[count:].reshape(count, len(self._paths), results.shape[1])
        for k, path in enumerate(self._paths):
            rows[:, k] = self._ends[path] if path in self._ends else slopes[:, self._by.index(path)]

    def _columns(self, columns: Mapping[str, Array]) -> list[Array]:
        served = {path: np.ascontiguousarray(columns[path], dtype=float) for path in self.form.varying}
        return [reduced(column) if path in self._angles else column for path, column in served.items()]

    def _program(self, weights: tuple[Weights, ...], closed: bool = False) -> "_Program":
        return _program(Kind(self._machine), self.form, weights, self._by, self._native, closed)


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
def _program(
    kind: Kind, form: Form, weights: tuple[Weights, ...], paths: tuple[str, ...], native: bool, closed: bool
) -> _Program:
    """The program of objectives and their derivatives; without weights, that of the closing equations."""
    asked = objectives_of(kind, form, weights, paths, closed) if weights else equations_of(kind, form, paths)
    count, inputs = len(asked.body.results), len(asked.inputs)
    if not native:
        return _Program(Interpreted(asked.body, asked.inputs), count, inputs)
    from kinetostat.engine.native import Program  # LLVM takes 0.1 s to load: only where it pays

    return _Program(Program(with_gradients(asked.body, asked.inputs)), count, inputs)

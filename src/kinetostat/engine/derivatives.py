"""Many points at once with exact derivatives: the engine chooses arithmetic and slab size. Holds no formula.

Few points go through NumPy and many through machine code, both from the same graph and by the same rules. Where the
joints of a machine written leg by leg follow from equations, so do their derivatives, by linear systems pose by pose.

Source: theory (34).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from kinetostat.engine.batch import NATIVE_SLAB, Progress, available_cores, by_free_springs, in_slabs, silent
from kinetostat.engine.form import Form, Kind, Weights, angles, equations_of, form_of, joint_columns, objectives_of
from kinetostat.engine.gradient import with_gradients
from kinetostat.engine.interpreter import Interpreted
from kinetostat.engine.kernel import Fill, closes_inside, falling_back, program_columns
from kinetostat.engine.points import Points
from kinetostat.engine.trace import Array, Codes, Runnable
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.tolerances import IDLE_COORDINATES, OPENING, ROUND_OFF_DERIVATIVE, SAME_DERIVATIVE

MACHINE_CODE_FROM = 20_000
"""Points from which compiling pays: NumPy differentiates some ten thousand poses/s."""
SMALL_SLAB = 512
"""Points per slab of NumPy calls and of linear systems: some thousand arrays of it wait in memory at once."""
KEPT = 32
"""Programs kept in memory."""
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
    """Compute objectives of a machine at many points, and their exact derivatives.

    Args:
        machine: gives all parameters that do not vary.
        points: where; leaf paths of the machine's family and their values, SI.
        objectives: one or several; names are from `kinetostatics.quantities.QUANTITIES`.
        paths: leaf paths of the parameters to differentiate by, whether they vary over the points or not.
        progress: called after each slab.
        repeated: whether the same derivatives will be wanted again and again at other points, as by a search: then
            compiling once pays for few points as well.
    """
    several = [objectives] if isinstance(objectives, str | Mapping) else list(objectives)
    weights = tuple(((entry, 1.0),) if isinstance(entry, str) else tuple(entry.items()) for entry in several)
    native = repeated or points.size >= MACHINE_CODE_FROM
    slab = NATIVE_SLAB if native else SMALL_SLAB
    threads = available_cores() if native and points.size > slab else 1

    def method(part: Machine, varying: Sequence[str], _names: Sequence[str]) -> Fill:
        return _fill(part, tuple(varying), weights, tuple(paths), native)

    fill = by_free_springs(machine, points.paths, (), method)
    count, rows = len(weights), len(weights) * (1 + len(paths))
    results, status = in_slabs(points, fill, rows, slab, threads, progress)
    values, slopes = results[:count], results[count:].reshape(count, len(paths), points.size)
    for value, slope in zip(values, slopes, strict=True):
        slope[:, ~np.isfinite(value)] = math.nan
    return Gradients(values, slopes, status)


def _fill(
    machine: Machine, varying: tuple[str, ...], weights: tuple[Weights, ...], paths: tuple[str, ...], native: bool
) -> Fill:
    """Evaluates slabs of points of one machine: objectives, then their derivatives by each path."""
    ways = _Ways(machine, varying, weights, paths, native)
    if machine.family.chains is None:
        return ways.direct()
    if native and _closed_forms_hold(Kind(machine), tuple(values(machine).items()), varying, weights, paths):
        return falling_back(ways.direct(closed=True), lambda: ways.by_equations)
    return ways.by_equations


@lru_cache(KEPT)
def _closed_forms_hold(
    kind: Kind,
    numbers: tuple[tuple[str, float], ...],
    varying: tuple[str, ...],
    weights: tuple[Weights, ...],
    paths: tuple[str, ...],
) -> bool:
    """Whether closed forms hold while parameters change: near the machine's own pose both ways must agree.

    They do not where a parameter changes what they take as given: that axes are parallel, say, or that the platform
    keeps the coordinates that its pose does not give. (At the home pose itself legs close whatever their axes.)

    The answer depends on the machine's numbers, not only on its kind and form, so that all of them are in the key.

    Args:
        kind: of the machine.
        numbers: all its parameters, by leaf path.
        varying: leaf paths of the parameters that vary.
        weights: the objectives.
        paths: leaf paths of the parameters to differentiate by.
    """
    machine, centre = with_values(kind.machine, dict(numbers)), dict(numbers)
    if not closes_inside(machine):
        return False
    ways = _Ways(machine, varying, weights, paths, native=False)
    drawn = np.random.default_rng(0).uniform(-NEAR, NEAR, (len(varying), TRIED))
    columns = {path: centre[path] + (abs(centre[path]) or 1.0) * row for path, row in zip(varying, drawn, strict=True)}
    direct, expected = np.empty((2, len(weights) * (1 + len(paths)), TRIED))
    status = np.empty(TRIED, dtype=np.int8)
    for fill, results in ((ways.direct(closed=True), direct), (ways.by_equations, expected)):
        fill(columns, results, status)
    direct, expected = direct[:, status == Status.OK], expected[:, status == Status.OK]
    round_off = ROUND_OFF_DERIVATIVE * np.nan_to_num(np.abs(expected)).max(initial=0.0)
    agree = np.allclose(direct, expected, rtol=SAME_DERIVATIVE, atol=round_off, equal_nan=True)
    return bool((status == Status.OK).any()) and agree


class _Ways:
    """The ways to objectives and derivatives of one machine: from one program, or with the closing equations."""

    def __init__(
        self,
        machine: Machine,
        varying: Sequence[str],
        weights: tuple[Weights, ...],
        paths: tuple[str, ...],
        native: bool,
    ) -> None:
        known = {path: slope for path, slope in _at_ends(machine).items() if path in paths and path not in varying}
        self._machine, self._weights, self._paths, self._native = machine, weights, paths, native
        self._known, self._by = known, tuple(path for path in paths if path not in known)
        self._form, self._fixed = form_of(machine, varying, self._by)
        self._angles = angles(machine)

    def direct(self, closed: bool = False) -> Fill:
        """All from one program: the family places the joints, or they are in `closed` form."""
        program = self._program(self._weights, closed)

        def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
            given = program_columns(columns, self._form.varying, self._angles)
            if self._known:
                self._spread(*program.slopes(self._fixed, given, status), results)
            else:
                program.runnable.run(self._fixed, given, results, status)

        return fill

    def by_equations(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Fill with joints found first, and with their slopes from the closing equations."""
        given = program_columns(columns, self._form.varying, self._angles)
        given += joint_columns(self._machine, columns, len(status))
        rates = self._program(()).slopes(self._fixed, given, np.empty_like(status))[1]
        objectives, partial = self._program(self._weights).slopes(self._fixed, given, status)
        self._spread(objectives, _following(partial, rates, len(self._by)), results)

    def _spread(self, objectives: Array, slopes: Array, results: Array) -> None:
        """Put objectives and slopes in their rows, and what is known by rigid and free springs."""
        count = len(self._weights)
        results[:count] = objectives
        rows = results[count:].reshape(count, len(self._paths), results.shape[1])
        for k, path in enumerate(self._paths):
            rows[:, k] = self._known[path] if path in self._known else slopes[:, self._by.index(path)]

    def _program(self, weights: tuple[Weights, ...], closed: bool = False) -> "_Program":
        return _program(Kind(self._machine), self._form, weights, self._by, self._native, closed)


def _at_ends(machine: Machine) -> dict[str, float]:
    """Derivatives by the springs that are rigid or free by form: 0 and none."""
    stiff = {p.path for p in parameters(machine.family) if p.quantity.stiff}
    ends = {0.0: math.nan, math.inf: 0.0}
    return {path: ends[value] for path, value in values(machine).items() if path in stiff and value in ends}


def _following(slopes: Array, rates: Array, count: int) -> Array:
    """Derivatives of objectives by parameters with the joints following, from those by parameters and joints."""
    by_point = [np.moveaxis(part, 2, 0) for part in (slopes, rates)]
    (by_paths, by_joints), (path_rates, joint_rates) = (np.split(part, [count], axis=2) for part in by_point)
    return np.moveaxis(total_slopes(by_paths, by_joints, joint_rates, path_rates), 0, 2)


def total_slopes(slopes: Array, by_joints: Array, joint_rates: Array, rates: Array) -> Array:
    """Return derivatives with the joints following: J_p + J_q dq/dp, where F_q dq/dp = -F_p, of least norm.

    Joint coordinates q(p) satisfy F(p, q) = 0; there may be more equations than coordinates, and coordinates that no
    equation needs.

    Args:
        slopes: J_p, by parameters [n x results x parameters].
        by_joints: J_q, by joint coordinates [n x results x coordinates].
        joint_rates: F_q, of the equations by joint coordinates [n x equations x coordinates].
        rates: F_p, by parameters [n x equations x parameters].

    Returns:
        [n x results x parameters]; NaN for a parameter that cannot change alone without breaking an equation, and
        where anything is not finite.
    """
    result = np.full(slopes.shape, np.nan)
    sound = np.isfinite(joint_rates).all(axis=(1, 2)) & np.isfinite(by_joints).all(axis=(1, 2))
    if not sound.any():
        return result
    left, sizes, right = np.linalg.svd(joint_rates[sound], full_matrices=False)
    kept = sizes > IDLE_COORDINATES * sizes[:, :1]
    inverse = np.divide(1.0, sizes, where=kept, out=np.zeros_like(sizes))
    work = np.swapaxes(left, 1, 2) @ rates[sound]
    motion = -np.swapaxes(right, 1, 2) @ (inverse[:, :, None] * work)
    remaining = np.abs(rates[sound] + joint_rates[sound] @ motion).max(axis=1, initial=0.0)
    largest = np.abs(rates[sound]).max(axis=(1, 2), initial=0.0)
    follows = remaining <= OPENING * largest[:, None]
    total = slopes[sound] + by_joints[sound] @ motion
    result[sound] = np.where(follows[:, None, :], total, np.nan)
    return result


@dataclass(frozen=True)
class _Program:
    """Results and their derivatives by some inputs, as something to run."""

    runnable: Runnable
    results: int
    inputs: int

    def slopes(self, fixed: Array, columns: Sequence[Array], codes: Codes) -> tuple[Array, Array]:
        """Results [results x points] and their derivatives [results x inputs x points]; codes in place."""
        rows = np.empty((self.results * (1 + self.inputs), len(codes)))
        self.runnable.run(fixed, columns, rows, codes)
        return rows[: self.results], rows[self.results :].reshape(self.results, self.inputs, len(codes))


@lru_cache(KEPT)
def _program(
    kind: Kind, form: Form, weights: tuple[Weights, ...], paths: tuple[str, ...], native: bool, closed: bool
) -> _Program:
    """The program of objectives and their derivatives; without weights, that of the closing equations."""
    formula = objectives_of(kind, form, weights, paths, closed) if weights else equations_of(kind, form, paths)
    count, inputs = len(formula.body.results), len(formula.inputs)
    if not native:
        return _Program(Interpreted(formula.body, formula.inputs), count, inputs)
    from kinetostat.engine.native import Program  # LLVM takes 0.1 s to load: only where it pays

    return _Program(Program(with_gradients(formula.body, formula.inputs)), count, inputs)

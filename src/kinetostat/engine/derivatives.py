"""Evaluate many points at once with exact derivatives. The formulas are traced elsewhere, in `form` and `gradient`.

Few points are evaluated by NumPy and many by compiled machine code, both from the same traced graph and by the same
rules. The joints of a machine written leg by leg may have to be solved for; their derivatives then follow from the
closing equations by a linear system at each pose.

Source: theory (34).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.batch import FUNCTIONS_KEPT, Function, PopulationResults, Progress, by_free_springs, silent
from kinetostat.engine.form import Specimen, TraceOptions, Weights, equations_of, form_of, objectives_of, plan_for
from kinetostat.engine.kernel import (
    PROGRAMS_KEPT,
    FallingBack,
    Fill,
    Identical,
    closes_inside,
    program_columns,
    program_of,
    recipe_of,
)
from kinetostat.engine.modes import modes_at_rest
from kinetostat.engine.points import Points, Population
from kinetostat.engine.rest import StatePrograms
from kinetostat.engine.trace import Runnable
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import units_of
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES, rest_numbers
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.tolerances import IDLE_COORDINATES, IDLE_FREEDOM, OPENING, ROUND_OFF_DERIVATIVE, SAME_DERIVATIVE
from kinetostat.vibration.scalar_frequencies import SPARE_MODES, mode_columns, reducible
from kinetostat.vibration.springwise import mode_counts_of

MACHINE_CODE_FROM = 20_000
"""Number of points from which on compiling pays: NumPy differentiates some ten thousand poses per second."""
SMALL_SLAB = 512
"""Points in a slab for NumPy and for linear systems: some thousand arrays of this length are in memory at once."""
JOINT_STEP = 1e-5
"""Displacement of joints, rad or in units of the machine's length, whose differences are second derivatives: squares of
it and round-off over it are equally small."""
TRIAL_DISTANCE = 0.03
"""Share of the machine's numbers by which they differ at the points at which closed forms are tried: so little that
legs still close, and so much that an error of a derivative shows."""
TRIAL_POINTS = 5
"""Points at which closed forms are tried: some may be out of reach, and one is enough to show an error."""

Objective: TypeAlias = str | Mapping[str, float]
"""The name of a quantity, or a weighted sum of several: their weights, in any units, by name."""


@dataclass(frozen=True)
class Gradients:
    """Values and derivatives at every point, in order.

    Attributes:
        values: values of the objectives [objectives x points]; NaN where the status is not OK, infinite where something
            is rigid or free.
        gradients: derivatives by the parameters, SI [objectives x paths x points]. They are NaN where the value is not
            finite, for the stiffness of a free spring, and for a parameter that cannot change alone without opening a
            leg; they are 0 for the stiffness of a rigid spring.
        status: `Status` codes [points].
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
        points: leaf paths of the parameters that vary, and their values at each point, SI.
        objectives: a single objective or several; names are from `kinetostatics.quantities.QUANTITIES`.
        paths: leaf paths of the parameters to differentiate by, whether they vary over the points or not.
        progress: called after each slab.
        repeated: whether the same derivatives will be needed many times at other points, as in a search; compiling
            then pays for few points too.
    """
    several = [objectives] if isinstance(objectives, str | Mapping) else list(objectives)
    weights = tuple(((entry, 1.0),) if isinstance(entry, str) else tuple(entry.items()) for entry in several)
    native = repeated or points.size >= MACHINE_CODE_FROM
    function = _function(Identical(machine), tuple(points.paths), weights, tuple(paths), native)
    results, status = function.at(points, progress, 1 if function.slab else None)
    count = len(weights)
    objective_values, slopes = results[:count], results[count:].reshape(count, len(paths), points.size)
    for row, slope in zip(objective_values, slopes, strict=True):
        slope[:, ~np.isfinite(row)] = math.nan
    return Gradients(objective_values, slopes, status)


@lru_cache(FUNCTIONS_KEPT)
def _function(
    machine: Identical, varying: tuple[str, ...], weights: tuple[Weights, ...], paths: tuple[str, ...], native: bool
) -> Function:
    """Return the objectives and then their derivatives by each path as a function of what varies."""
    modes = _modes_to_know(machine.value, weights, (*varying, *paths))
    native = native and not modes

    def method(part: Machine, varying: Sequence[str], _names: Sequence[str]) -> Fill:
        return _fill(part, tuple(varying), weights, paths, native, modes)

    fill = by_free_springs(machine.value, varying, (), method)
    return Function(fill, varying, len(weights) * (1 + len(paths)), None if native else SMALL_SLAB)


def differentiate(
    machine: Machine, population: Population, quantities: Sequence[str], by: Sequence[str], repeated: bool = True
) -> PopulationResults:
    """Compute quantities of a few designs and their exact derivatives by parameters of the design.

    Args:
        machine: gives all parameters that do not vary.
        population: designs and poses.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
        by: leaf paths of what to differentiate by.
        repeated: whether it pays to compile, see `evaluate_gradient`.
    """
    sloped = evaluate_gradient(machine, population, quantities, by, repeated=repeated)
    slopes = sloped.gradients.reshape(len(quantities), len(by), *population.shape)
    return PopulationResults.of(population, quantities, sloped.values, sloped.status, slopes)


def _modes_to_know(machine: Machine, weights: Sequence[Weights], paths: Sequence[str]) -> int:
    """Count the modes to be solved for before a program takes derivatives; 0 where it finds the frequencies itself."""
    named = {name: QUANTITIES[name] for objective in weights for name, _ in objective}
    wanted = [int(name.rpartition("_")[2]) for name, row in named.items() if row.modal and not row.loaded]
    return max(wanted) + SPARE_MODES if wanted and not reducible(machine, paths) else 0


def _fill(
    machine: Machine,
    varying: tuple[str, ...],
    weights: tuple[Weights, ...],
    paths: tuple[str, ...],
    native: bool,
    modes: int,
) -> Fill:
    """Return the fill for slabs of points of one machine: rows of objectives, then of their derivatives by each path.

    Closed forms are faster than solving for the joints, but are used only where they still hold as parameters change.
    """
    routes = _Routes(machine, varying, weights, paths, native, modes)
    if machine.family.chains is None:
        return routes.direct()
    if native and _closed_forms_hold(Specimen(machine), tuple(values(machine).items()), varying, weights, paths):
        return FallingBack(routes.direct(closed=True), lambda: routes.by_equations)
    return routes.by_equations


@lru_cache(PROGRAMS_KEPT)
def _closed_forms_hold(
    kind: Specimen,
    numbers: tuple[tuple[str, float], ...],
    varying: tuple[str, ...],
    weights: tuple[Weights, ...],
    paths: tuple[str, ...],
) -> bool:
    """Tell whether closed forms still hold when parameters change.

    A closed form assumes, say, that two axes are parallel, or that the platform keeps the coordinates that its pose
    does not give. A parameter that upsets such an assumption makes its derivatives wrong without any error. Therefore
    closed forms and closing equations are compared at random points near the machine's numbers, where both must agree.
    (The home pose itself shows nothing: there the legs close whatever their axes are.)

    The answer depends on all numbers of the machine, not only on its kind and form. They are arguments so that
    they are part of the cache's key.

    Args:
        kind: kind of the machine.
        numbers: all parameters of the machine, by leaf path.
        varying: leaf paths of the parameters that vary.
        weights: the objectives.
        paths: leaf paths of the parameters to differentiate by.
    """
    machine, centre = with_values(kind.machine, dict(numbers)), dict(numbers)
    if not closes_inside(machine):
        return False
    routes = _Routes(machine, varying, weights, paths, native=False)
    drawn = np.random.default_rng(0).uniform(-TRIAL_DISTANCE, TRIAL_DISTANCE, (len(varying), TRIAL_POINTS))
    columns = {path: centre[path] + (abs(centre[path]) or 1.0) * row for path, row in zip(varying, drawn, strict=True)}
    direct, expected = np.empty((2, len(weights) * (1 + len(paths)), TRIAL_POINTS))
    status = np.empty(TRIAL_POINTS, dtype=np.int8)
    for fill, results in ((routes.direct(closed=True), direct), (routes.by_equations, expected)):
        fill(columns, results, status)
    direct, expected = direct[:, status == Status.OK], expected[:, status == Status.OK]
    round_off = ROUND_OFF_DERIVATIVE * np.nan_to_num(np.abs(expected)).max(initial=0.0)
    agree = np.allclose(direct, expected, rtol=SAME_DERIVATIVE, atol=round_off, equal_nan=True)
    return bool((status == Status.OK).any()) and agree


class _Routes:
    """Two routes to the objectives and derivatives of one machine: a single program, or joints from closing equations.

    Derivatives by springs that are rigid or free by form are known beforehand; a program computes only the others.
    """

    def __init__(
        self,
        machine: Machine,
        varying: Sequence[str],
        weights: tuple[Weights, ...],
        paths: tuple[str, ...],
        native: bool,
        modes: int = 0,
    ) -> None:
        known_slopes = _slopes_at_end_stiffnesses(machine)
        end_slopes = {path: known_slopes[path] for path in paths if path in known_slopes and path not in varying}
        self._machine, self._weights, self._paths, self._native = machine, weights, paths, native
        self._kind = Specimen(machine)
        self._known_slopes, self._differentiated = end_slopes, tuple(path for path in paths if path not in end_slopes)
        self._form, self._fixed = form_of(machine, varying, self._differentiated)
        self._modes, self._joints = modes, machine.chains().size if machine.family.chains else 0
        names = [name for objective in weights for name, _ in objective]
        self._loaded = bool(rest_numbers(machine, names, limited=False))
        self._plan = plan_for(machine, names, [*varying, *self._differentiated])
        counts = mode_counts_of(machine, names, [*varying, *self._differentiated])
        self._mode_counts = replace(counts, free=0) if counts and counts.at_rest else None

    def direct(self, closed: bool = False) -> Fill:
        """Return the fill by a single program, in which the family places the joints or `closed` forms give them."""
        program = self._program_of_objectives(closed)

        def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
            program_inputs = program_columns(self._machine, self._form, columns, len(status), closed)
            program_inputs += self._rest_columns(program_inputs, len(status), closed)
            program_inputs += self._mode_columns(columns, len(status))
            if self._known_slopes:
                self._fill_rows(*self._results_with_slopes(program, program_inputs, status, closed), results)
            else:
                program.run(self._fixed, program_inputs, results, status)

        return fill

    def by_equations(self, columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        """Fill by solving for the joints first; their derivatives follow from the closing equations."""
        program_inputs = program_columns(self._machine, self._form, columns, len(status))
        rates = self._closing_rates(program_inputs, len(status))
        program_inputs += self._rest_columns(program_inputs, len(status), closed=False)
        program_inputs += self._mode_columns(columns, len(status))
        program = self._program_of_objectives(closed=False)
        objectives, partial = self._results_with_slopes(program, program_inputs, status)
        self._fill_rows(objectives, _slopes_as_joints_follow(partial, rates, len(self._differentiated)), results)

    def _closing_rates(self, program_inputs: Sequence[Array], count: int) -> Array:
        """Derivatives of the closing equations, and of those by which idle freedoms stand nearest to home, theory (34).

        The latter need the second derivatives of the closing equations along the idle motions: central differences of
        the first ones.

        Returns:
            [equations x inputs x points]; inputs are the parameters and then the joint coordinates.
        """

        chains, first = self._machine.chains(), len(self._differentiated)
        # Columns of the parameters come first, then those of the joints, and at last their status.
        parameter_columns = program_inputs[: -chains.size - 1]
        *joint_columns, status = program_inputs[-chains.size - 1 :]
        program = program_of(recipe_of(equations_of, self._kind, self._form, paths=self._differentiated), self._native)

        def rates_at(joints: Array) -> tuple[Array, Array]:
            columns = [*parameter_columns, *joints, status]
            results, rates = self._results_with_slopes(program, columns, np.empty(count, dtype=np.int8))
            return results[-1], rates

        joints = np.stack(joint_columns)
        length, rates = rates_at(joints)
        rates, length_rates = rates[:-1], rates[-1]
        units = units_of(chains, length).T
        slides = (joints - units_of(chains, np.zeros(count)).T * joints) / units  # 0 of turns, whose unit has no length
        idle = _IdleMotions.of(np.moveaxis(rates[:, first:] * units, 2, 0), (joints / units).T)
        rows = []
        for motion in np.moveaxis(idle.motions, 1, 0):
            shift = JOINT_STEP * motion.T * units
            change = (rates_at(joints + shift)[1] - rates_at(joints - shift)[1])[:-1] / (2.0 * JOINT_STEP)
            row = -np.einsum("np,pin->in", idle.multipliers, change)
            row[first:] += motion.T / units
            row[:first] -= 2.0 * (motion.T * slides).sum(axis=0) * length_rates[:first] / length
            rows.append(row * length)
        return np.concatenate([rates, np.array(rows).reshape(len(rows), *rates.shape[1:])])

    def _rest_columns(self, program_inputs: Sequence[Array], count: int, closed: bool) -> list[Array]:
        """Return the coordinates of the states of rest and their modes, if any objective is about them."""
        if not self._loaded:
            return []
        programs = StatePrograms(self._machine, self._form, closed, self._native)
        states = programs.rest_coordinates(self._fixed, program_inputs, count)
        if self._mode_counts is None:
            return states
        inputs = [*program_inputs, *states]
        return states + modes_at_rest(self._machine, self._form, self._fixed, inputs, self._mode_counts, closed)

    def _mode_columns(self, columns: Mapping[str, Array], count: int) -> list[Array]:
        """Return the modes that programs cannot find themselves, if any objective is about them."""
        return mode_columns(with_values(self._machine, columns), count, self._modes) if self._modes else []

    def _fill_rows(self, objectives: Array, slopes: Array, results: Array) -> None:
        """Put objectives and slopes in their rows, with the known slopes by rigid and free springs among them."""
        count = len(self._weights)
        results[:count] = objectives
        rows = results[count:].reshape(count, len(self._paths), results.shape[1])
        for k, path in enumerate(self._paths):
            known = self._known_slopes.get(path)
            rows[:, k] = slopes[:, self._differentiated.index(path)] if known is None else known

    def _results_with_slopes(
        self, program: Runnable, program_inputs: Sequence[Array], codes: Codes, closed: bool = False
    ) -> tuple[Array, Array]:
        """Results [results x points] of a program and their derivatives [results x inputs x points], codes in place.

        Inputs are the parameters, and then the joint coordinates unless they are `closed` inside.
        """
        rows, inputs = np.empty((program.rows, len(codes))), len(self._differentiated) + (0 if closed else self._joints)
        program.run(self._fixed, program_inputs, rows, codes)
        count = program.rows // (1 + inputs)
        return rows[:count], rows[count:].reshape(count, inputs, len(codes))

    def _program_of_objectives(self, closed: bool) -> Runnable:
        """The program of the objectives and their derivatives."""
        options = TraceOptions(
            closed=closed, limited=False, plan=self._plan, modes=self._modes, mode_counts=self._mode_counts
        )
        weights, paths = self._weights, self._differentiated
        recipe = recipe_of(objectives_of, self._kind, self._form, objectives=weights, options=options, paths=paths)
        return program_of(recipe, self._native)


def _slopes_at_end_stiffnesses(machine: Machine) -> dict[str, float]:
    """Return the derivatives, by leaf path, by stiffnesses that are infinite or zero by form: 0 and NaN.

    A spring without stiffness is a free joint, so that the machine differs from that with a weak spring there.
    """
    stiff = {p.path for p in parameters(machine.family) if p.quantity.stiff}
    ends = {0.0: math.nan, math.inf: 0.0}
    return {path: ends[value] for path, value in values(machine).items() if path in stiff and value in ends}


@dataclass(frozen=True)
class _IdleMotions:
    """Motions of joints that change no equation, at n points.

    Attributes:
        motions: independent ones, of length 1, rad or in units of the machine's length [n x motions x joints]; 0 where
            a point has fewer.
        multipliers: Lagrange's multipliers: how strongly each equation keeps the joints from home [n x equations].
    """

    motions: Array
    multipliers: Array

    @classmethod
    def of(cls, rates: Array, joints: Array) -> "_IdleMotions":
        """Find them from the rates of equations [n x equations x joints] and joint coordinates [n x joints]."""
        sound = np.isfinite(rates).all(axis=(1, 2)) & np.isfinite(joints).all(axis=1)
        motions, multipliers = np.zeros((len(rates), 0, joints.shape[1])), np.zeros(rates.shape[:2])
        left, sizes, right = np.linalg.svd(rates[sound])
        ranks = (sizes > IDLE_FREEDOM * sizes[:, :1]).sum(axis=1)
        if sound.any() and ranks.min() < joints.shape[1]:
            kept = np.arange(joints.shape[1]) < ranks[:, None]
            motions = np.zeros((len(rates), joints.shape[1] - int(ranks.min()), joints.shape[1]))
            motions[sound] = np.where(kept[:, :, None], 0.0, right)[:, ranks.min() :]
            inverse = np.divide(1.0, sizes, where=kept[:, : sizes.shape[1]], out=np.zeros_like(sizes))
            along = np.einsum("nkj,nj->nk", right[:, : sizes.shape[1]], joints[sound])
            multipliers[sound] = np.einsum("nek,nk->ne", left[:, :, : sizes.shape[1]], inverse * along)
        return cls(motions, multipliers)


def _slopes_as_joints_follow(slopes: Array, rates: Array, count: int) -> Array:
    """Return the derivatives of objectives by the first `count` inputs, the parameters, while the joints follow.

    Both arrays have the parameters and then the joint coordinates as inputs [results x inputs x points].
    """
    # `total_slopes` solves a stack of linear systems, for which NumPy wants the points first.
    by_point = [np.moveaxis(part, 2, 0) for part in (slopes, rates)]
    (by_paths, by_joints), (path_rates, joint_rates) = (np.split(part, [count], axis=2) for part in by_point)
    return np.moveaxis(total_slopes(by_paths, by_joints, joint_rates, path_rates), 0, 2)


def total_slopes(slopes: Array, by_joints: Array, joint_rates: Array, rates: Array) -> Array:
    """Return total derivatives J_p + J_q dq/dp, in which the joints follow: F_q dq/dp = -F_p, with least norm.

    Joint coordinates q(p) satisfy F(p, q) = 0. There may be more equations than coordinates, and coordinates on which
    no equation depends: these stay where they are.

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
    # A pseudo-inverse by singular values; combinations of joints that change no equation are left out.
    left, sizes, right = np.linalg.svd(joint_rates[sound], full_matrices=False)
    kept = sizes > IDLE_COORDINATES * sizes[:, :1]
    inverse = np.divide(1.0, sizes, where=kept, out=np.zeros_like(sizes))
    work = left.mT @ rates[sound]
    motion = -right.mT @ (inverse[:, :, None] * work)
    # What remains of an equation shows that the joints cannot follow this parameter: a leg would open.
    remaining = np.abs(rates[sound] + joint_rates[sound] @ motion).max(axis=1, initial=0.0)
    largest = np.abs(rates[sound]).max(axis=(1, 2), initial=0.0)
    follows = remaining <= OPENING * largest[:, None]
    total = slopes[sound] + by_joints[sound] @ motion
    result[sound] = np.where(follows[:, None, :], total, np.nan)
    return result

"""Corrections of actuators over a grid, for a controller that interpolates between its points, and their shortest law.

The grid may run over the pose, the angle of gravity, or any other parameter. Between its points the table is compared
with what is solved at the middle of each cell.

A law is made of harmonics of the angle of gravity, and of powers of all else. A machine that is linear and fixed has
corrections a + b cos + c sin of the angle by which gravity is turned, exactly: its weight is such a law, and what the
weight moves is proportional to it. Corrections that gravity does to second order have the double angle. Over a pose no
law is exact, and polynomials of ever higher degree are fitted until one is good enough.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations_with_replacement
from typing import NamedTuple, TypeAlias

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress, silent
from kinetostat.engine.points import Axis, Grid
from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter
from kinetostat.spec.arguments import as_list, checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import positive_number
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.commanding import (
    ActuatorTargets,
    Command,
    actuator_targets,
    command_of,
    refuse_tensions,
    tally,
    without_command,
)
from kinetostat.studies.poses import PoseColumns, chosen_axes, grid_of
from kinetostat.tolerances import EXACT_LAW

GRAVITY_ANGLE = "load.gravity_angle"
"""Path of the field over which laws are harmonic."""
MOST_HARMONICS = 3
"""Greatest multiple of the angle of gravity in a law: corrections by gravity to first, second and third order."""
MOST_DEGREE = 8
"""Greatest sum of the powers of a term: beyond it, powers on a range from -1 to 1 are hardly told apart."""
MOST_TERMS = 500
"""Most terms of a law: with as many at all points of the largest table, least squares take 0.8 GB."""
MOST_TABLE_POINTS = 200_000
"""Points of a table: an hour or less."""
GOOD_ENOUGH = 1e-3
"""Share of the error without corrections that a law may leave, if no tolerance is given."""


class AxisFunction(NamedTuple):
    """A function of the values of one axis.

    Attributes:
        kind: "power" of the value, whose range is brought to -1 to 1; or "cos" or "sin" of a multiple of the angle.
        order: exponent of the power, or factor of the angle.
    """

    kind: str
    order: int

    def at(self, values: Array, middle: float, half: float) -> Array:
        """The function at values of the axis [n], whose range has this middle and this half width."""
        if self.kind == "power":
            return np.asarray(((values - middle) / half) ** self.order)
        return np.asarray((np.cos if self.kind == "cos" else np.sin)(self.order * values))


Term: TypeAlias = tuple[AxisFunction, ...]
"""A product of functions, one of each axis."""


@dataclass(frozen=True, eq=False)
class Law(ImmutableAnswer):
    """Corrections as sums of terms.

    Attributes:
        paths: paths of the fields.
        middles, halves: middle and half width of the range of each.
        terms: the terms.
        coefficients: factor of each term in each correction, m or rad [terms x actuators].
    """

    paths: tuple[str, ...]
    middles: Array
    halves: Array
    terms: tuple[Term, ...]
    coefficients: Array

    def at(self, values: Sequence[Array]) -> Array:
        """The corrections at points, given by the values of each axis [n]: m or rad [n x actuators]."""
        return _functions(self.terms, values, self.middles, self.halves) @ self.coefficients


def _functions(terms: Sequence[Term], values: Sequence[Array], middles: Array, halves: Array) -> Array:
    """Value of each term at each point [n x terms]."""
    columns = []
    for term in terms:
        column = np.ones(len(values[0]))
        for function, axis, middle, half in zip(term, values, middles, halves, strict=True):
            column = column * function.at(axis, middle, half)
        columns.append(column)
    return np.stack(columns, axis=1)


def shortest_law(
    paths: Sequence[str], axes: Sequence[Array], corrections: Array, error: Callable[[Law], float], tolerance: float
) -> tuple[Law, float]:
    """Fit laws of ever more terms until the error of one is within the tolerance; else return the best of them.

    Args:
        paths: paths of the fields.
        axes: values along each.
        corrections: corrections at all points of the grid, the last axis fastest, NaN where there are none
            [n x actuators].
        error: a function from a law to its error.
        tolerance: error that is good enough, in the same unit.

    Returns:
        The law and its error.
    """
    middles = np.array([0.5 * (axis.min() + axis.max()) for axis in axes])
    halves = np.array([float(0.5 * (axis.max() - axis.min())) or 1.0 for axis in axes])
    points = [grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")]
    has_correction = np.isfinite(corrections).all(axis=1)
    best: tuple[Law, float] | None = None
    for terms in _candidates(paths, [len(axis) for axis in axes], int(has_correction.sum())):
        functions = _functions(terms, [axis[has_correction] for axis in points], middles, halves)
        coefficients: Array = np.linalg.lstsq(functions, corrections[has_correction], rcond=None)[0].astype(float)
        law = Law(paths=tuple(paths), middles=middles, halves=halves, terms=terms, coefficients=coefficients)
        law = _without_round_off(law)
        law_error = error(law)
        if best is None or law_error < best[1]:
            best = law, law_error
        if best[1] <= tolerance:
            break
    if best is None:
        raise ValueError("no point of the grid has a correction")
    return best


def _without_round_off(law: Law) -> Law:
    """The law without terms that only round-off has; all functions are 1 at most."""
    sizes = np.abs(law.coefficients)
    coefficients = np.where(sizes > EXACT_LAW * sizes.max(axis=0), law.coefficients, 0.0)
    has_effect = np.asarray(coefficients.any(axis=1))
    has_effect[0] |= not has_effect.any()  # a law has one term at least
    terms = tuple(term for term, kept in zip(law.terms, has_effect, strict=True) if kept)
    return replace(law, terms=terms, coefficients=coefficients[has_effect])


def _candidates(paths: Sequence[str], counts: Sequence[int], known: int) -> Iterator[tuple[Term, ...]]:
    """Lists of terms, the shortest first and harmonics before powers; none has more terms than there are corrections.

    Args:
        paths: paths of the fields.
        counts: number of points along each axis.
        known: number of points with a correction.
    """
    with_powers: list[tuple[Term, ...]] = []
    with_harmonics: list[tuple[Term, ...]] = []
    turning = paths.index(GRAVITY_ANGLE) if GRAVITY_ANGLE in paths else None
    others = [axis for axis in range(len(paths)) if axis != turning]
    for degree in range(MOST_DEGREE + 1):
        with_powers.append(_powers(counts, range(len(paths)), degree))
        if turning is not None:
            plain = _powers(counts, others, degree)
            most = min(MOST_HARMONICS, (counts[turning] - 1) // 2)
            with_harmonics += [_with_harmonics(plain, turning, harmonics) for harmonics in range(1, most + 1)]
    # Sorting keeps the order of lists of one length: harmonics stand first.
    candidates = sorted(with_harmonics + with_powers, key=len)
    yield from dict.fromkeys(terms for terms in candidates if len(terms) <= min(known, MOST_TERMS))


def _powers(counts: Sequence[int], axes: Sequence[int], degree: int) -> tuple[Term, ...]:
    """All products of powers of some axes up to a degree; of each axis no more than its points determine."""
    terms = []
    for size in range(degree + 1):
        for chosen in combinations_with_replacement(axes, size):
            powers = [chosen.count(axis) for axis in range(len(counts))]
            if all(power < count for power, count in zip(powers, counts, strict=True)):
                terms.append(tuple(AxisFunction("power", power) for power in powers))
    return tuple(terms)


def _with_harmonics(terms: Sequence[Term], axis: int, harmonics: int) -> tuple[Term, ...]:
    """The terms, each also times cosine and sine of multiples of the angle, which is an axis without powers in them."""
    harmonics_of_angle = (AxisFunction(kind, k) for k in range(1, harmonics + 1) for kind in ("cos", "sin"))
    waves = [AxisFunction("power", 0), *harmonics_of_angle]
    return tuple((*term[:axis], wave, *term[axis + 1 :]) for term in terms for wave in waves)


@former_names(before="error_uncorrected", left="error_of_exact")
@dataclass(frozen=True, eq=False)
class CorrectionTable(ImmutableAnswer):
    """Corrections of the actuators' coordinates over a grid.

    Attributes:
        command: coordinates with and without loads at each point, the last axis fastest.
        fields: fields of the axes.
        axes: values along each, SI.
        error_uncorrected: the largest error of the tool point without corrections, at points and middles of cells, m.
        error_of_exact: the largest error that exact commands leave, m: what no actuator of the machine can change.
        error: the largest further error by interpolation, at the middles of cells, m; NaN if no cell is complete.
        unknown: number of cells with a corner or middle without a command.
        law: the shortest law of the corrections.
        law_error: its largest error at points and middles of cells, m.
        tolerance: greatest error of the law, m.
        exact: whether that error is only round-off.
        message: the answer in sentences.
    """

    command: Command
    fields: tuple[Parameter, ...]
    axes: tuple[Array, ...]
    error_uncorrected: float
    error_of_exact: float
    error: float
    unknown: int
    law: Law
    law_error: float
    tolerance: float
    exact: bool
    message: str

    def __repr__(self) -> str:
        return f"<CorrectionTable of {self.command.machine.name!r}: {' x '.join(map(str, map(len, self.axes)))} points>"

    @property
    def machine(self) -> Machine:
        """The machine with its loads."""
        return self.command.machine

    @property
    def corrections(self) -> Array:
        """Corrections, m or rad [points along axes x actuators]: they are added to coordinates without loads."""
        return self.command.corrections.reshape(*map(len, self.axes), -1)


@checked
def correction_table(
    machine: Machine,
    over: str | Sequence[str],
    tolerance: float | str | None = None,
    progress: Progress = silent,
) -> CorrectionTable:
    """Compute by how much the actuators of a loaded machine must be corrected, over a grid.

    A controller adds the corrections to the coordinates that an unloaded machine would need; between the points of the
    table it interpolates. The error of this is measured where it is largest, at the middles of the cells. A law as
    short as the tolerance allows is fitted as well: over the angle of gravity with its cosine and sine, over all else
    with powers.

    Args:
        machine: the machine with its loads.
        over: one axis each, "FIELD=from:to:count[:log]", as for `evaluate_grid`; for instance
            "gravity_angle=0 deg:90 deg:7".
        tolerance: greatest error of the law at the tool, m or text with a unit; a thousandth of the error without
            corrections if None.
        progress: receives how far the work is.

    Raises:
        InputError: a bad range or tolerance, too many points, no place or no actuator, gravity without a mass, or
            tensions that are to be chosen.
    """
    refuse_tensions(machine)
    pairs = chosen_axes(machine, as_list(over))
    if not pairs:
        raise InputError('over is empty; give an axis of the table, e.g. "gravity_angle=0 deg:90 deg:7".')
    grid = grid_of(pairs)
    if grid.size > MOST_TABLE_POINTS:
        raise InputError(
            f"the table has {grid.size:,} points; at most {MOST_TABLE_POINTS:,} are computed: lower the counts."
        )
    greatest_error = None if tolerance is None else positive_number(tolerance, "length", "tolerance")
    middles = Grid([Axis(axis.paths, 0.5 * (axis.values[1:] + axis.values[:-1])) for axis in grid.axes])
    # Together, so that a table whose cells have no place is still a table.
    of_cells = middles.columns(0, middles.size)
    columns = {path: np.concatenate([values, of_cells[path]]) for path, values in grid.columns(0, grid.size).items()}
    nodes, cells = actuator_targets(machine, columns, grid.size + middles.size, progress).split(grid.size)
    fields = tuple(parameter for _, parameter in pairs)
    return _table_of(machine, fields, grid, middles, nodes, cells, greatest_error)


def _table_of(
    machine: Machine,
    fields: tuple[Parameter, ...],
    grid: Grid,
    middles: Grid,
    nodes: ActuatorTargets,
    cells: ActuatorTargets,
    wanted: float | None,
) -> CorrectionTable:
    """The table with its errors and its law.

    Args:
        machine: the machine with its loads.
        fields: fields of the axes.
        grid, middles: the points of the table, and the middles of its cells.
        nodes, cells: what is solved at the points, and at the middles.
        wanted: greatest error of the law, m; None for a share of the error without corrections.
    """
    if not nodes.settled.any():
        raise InputError(f"{machine.name}: {without_command(machine, grid.columns(0, grid.size), nodes.status)}")
    axes, points, points_of_cells = tuple(axis.values for axis in grid.axes), _points(grid), _points(middles)
    errors = _errors(cells, _at_middles(nodes.corrections, grid.shape))
    largest = float(np.nanmax(errors)) if np.isfinite(errors).any() else float("nan")
    unknown = int((~np.isfinite(errors)).sum())
    uncorrected = _largest(nodes.distance_uncorrected, cells.distance_uncorrected)
    of_exact = _largest(nodes.distance_corrected, cells.distance_corrected)
    tolerance = GOOD_ENOUGH * uncorrected if wanted is None else wanted

    def error_of(law: Law) -> float:
        return _largest(_errors(nodes, law.at(points)), _errors(cells, law.at(points_of_cells)))

    law, law_error = shortest_law([field.path for field in fields], axes, nodes.corrections, error_of, tolerance)
    missing = ""
    if unknown:
        reasons = tally(np.concatenate([nodes.status, cells.status]))
        missing = f"{unknown} of {len(errors)} cells have a corner or a middle without a command ({reasons})."
    return CorrectionTable(
        command=command_of(machine, PoseColumns(fields, points, {}), nodes),
        fields=fields,
        axes=axes,
        error_uncorrected=uncorrected,
        error_of_exact=of_exact,
        error=largest,
        unknown=unknown,
        law=law,
        law_error=law_error,
        tolerance=tolerance,
        exact=law_error <= EXACT_LAW * uncorrected,
        message=_message(machine, uncorrected, of_exact, largest, missing),
    )


def _largest(at_nodes: Array, at_cells: Array) -> float:
    """The largest of some errors at points and at middles of cells; NaN, where there is no command, does not count."""
    return float(np.nanmax(np.concatenate([at_nodes, at_cells])))


def _points(grid: Grid) -> tuple[Array, ...]:
    """The values of each axis at all points of a grid."""
    columns = grid.columns(0, grid.size)
    return tuple(np.array(columns[axis.paths[0]]) for axis in grid.axes)


def _at_middles(values: Array, shape: Sequence[int]) -> Array:
    """Values at the points of a grid, interpolated linearly at the middles of its cells [n x k] -> [cells x k]."""
    table = values.reshape(*shape, -1)
    for axis, count in enumerate(shape):
        behind, ahead = (np.take(table, range(first, count - 1 + first), axis) for first in (0, 1))
        table = 0.5 * (ahead + behind)
    return table.reshape(-1, values.shape[1])


def _errors(solved: ActuatorTargets, corrections: Array) -> Array:
    """Distance of the corrected tool point from where exact corrections bring it, to first order, m [n]."""
    distance = np.einsum("nca,na->nc", solved.rates, corrections - solved.corrections)
    return np.asarray(np.linalg.norm(distance, axis=1))


def _message(machine: Machine, uncorrected: float, of_exact: float, error: float, missing: str) -> str:
    show = machine.display.show_deflection
    if not uncorrected:
        return (
            "No load moves the tool, so that there is nothing to correct; give [load] a force, or gravity and masses."
        )
    sentences = [f"Without corrections the tool point is off by at most {show(uncorrected, 'm')}."]
    if np.isfinite(error):
        beside = f", beside the {show(of_exact, 'm')} that no actuator can change" if of_exact > 0.0 else ""
        interpolated = f"Interpolated linearly, the table leaves at most {show(error, 'm')}"
        sentences.append(f"{interpolated} (at the middles of its cells){beside}.")
    return " ".join([*sentences, missing]).rstrip()

"""Numbers of several designs side by side: at the pose of each, and over poses that are the same for all.

A design that lacks a number has None in its place. Designs themselves are in `comparison`.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress, evaluate, silent
from kinetostat.engine.points import Points, PointTable
from kinetostat.equilibrium.state import MachineState
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.machine.loads import platform_is_loaded
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.budget import budget
from kinetostat.studies.evaluation import PoseCount, point_of_file
from kinetostat.studies.poses import chosen_axes, given_poses, grid_of
from kinetostat.studies.quantities import cable_count, refuse_absent, resolve_quantities
from kinetostat.tolerances import EQUAL_DESIGNS

PERCENTILE = 95.0
"""Share of the poses, in percent, that are at least as good as the value that is shown: a few bad corners of a
workspace, which the worst value shows, do not count."""
BUILT_ERROR = "built_error"
"""A number beside the quantities: the error that 95 % of the machines within the tolerances of a file do not exceed."""
DISPLACEMENT = "displacement"
"""A number beside the quantities: the distance that the tool point moves, whose components are this group."""
NUMBERS_BESIDE_QUANTITIES = (DISPLACEMENT, BUILT_ERROR)
"""Numbers of a design that `evaluate` does not know; both are lengths, of which less is better."""
USUAL_QUANTITIES = ("compliance", "singularity_margin")
"""Quantities over poses, if none is named."""


class Better(StrEnum):
    """The better one of two values: the smaller or the greater."""

    LESS = "less"
    MORE = "more"


@dataclass(frozen=True)
class DesignRow:
    """One number of every design.

    Attributes:
        group: heading under which rows stand together.
        name: name of the number.
        unit: unit of the number, SI.
        better: whether less or more is better; None if neither is.
        values: the number of each design; None if a design lacks it, infinite where the design is rigid or free.
    """

    group: str
    name: str
    unit: str
    better: Better | None
    values: tuple[float | None, ...]

    @property
    def percents(self) -> tuple[float | None, ...]:
        """Change against the first design, percent; None if the change is undefined."""
        reference = self.values[0]
        if reference is None or reference == 0.0 or not math.isfinite(reference):
            return (None,) * len(self.values)
        return tuple(None if v is None or not math.isfinite(v) else 100.0 * (v / reference - 1.0) for v in self.values)

    @property
    def best(self) -> tuple[int, ...]:
        """Indices of the best designs; empty if all are equal, or if neither less nor more is better."""
        numbers = {i: v for i, v in enumerate(self.values) if v is not None}
        if len(numbers) < 2 or self.better is None:
            return ()
        top = (min if self.better is Better.LESS else max)(numbers.values())
        best = tuple(i for i, v in numbers.items() if v == top or math.isclose(v, top, rel_tol=EQUAL_DESIGNS))
        return best if len(best) < len(numbers) else ()


def rows_at_poses(analyses: Sequence[Analysis], quantities: Sequence[str] = ()) -> tuple[DesignRow, ...]:
    """Collect numbers at each design's pose; a row for which no design has a number is left out.

    Args:
        analyses: the analyses of the designs.
        quantities: names of further quantities or groups.

    Raises:
        InputError: a quantity that none of the designs has.
    """
    rows = [
        *_matrix_rows(analyses),
        *_index_rows(analyses),
        *_load_and_vibration_rows(analyses),
        *_quantity_rows(analyses, quantities),
    ]
    return tuple(row for row in rows if any(value is not None for value in row.values))


def _matrix_rows(analyses: Sequence[Analysis]) -> Iterator[DesignRow]:
    """The diagonals of C and K."""
    for group, letter, better in (("compliance", "C", Better.LESS), ("stiffness", "K", Better.MORE)):
        for name in COMPONENTS:
            entry = QUANTITIES[f"{group}_{name}"]
            numbers = tuple(_diagonal(analysis, group, name) for analysis in analyses)
            yield DesignRow(group=group, name=f"{letter}_{name}", unit=entry.unit, better=better, values=numbers)


def _index_rows(analyses: Sequence[Analysis]) -> Iterator[DesignRow]:
    """Least stiffnesses, condition, singularity margin and moving mass."""
    row = partial(_row_at_pose, analyses, "indices")
    yield row("least stiffness, force", "N/m", Better.MORE, lambda each: _least_stiffness(each, "translation"))
    yield row("least stiffness, moment", "N·m/rad", Better.MORE, lambda each: _least_stiffness(each, "rotation"))
    yield row("condition of K", "1", Better.LESS, _condition)
    yield row("singularity margin", "1", Better.MORE, lambda each: each.singularity_margin)
    yield row("moving mass", "kg", Better.LESS, lambda each: each.moving_mass)


def _load_and_vibration_rows(analyses: Sequence[Analysis]) -> Iterator[DesignRow]:
    """Numbers that only designs have whose files give masses, a cut, loads or tolerances."""
    row = partial(_row_at_pose, analyses, "loads and vibration")
    yield row("first natural frequency", "Hz", Better.MORE, _frequency)
    yield row("stable width of cut", "m", Better.MORE, lambda each: _at_pose(each.state, "stable_width"))
    yield row("displacement under load", "m", Better.LESS, _displacement_under_load)
    yield row("error as built, 95 %", "m", Better.LESS, _built_error)


def _row_at_pose(
    analyses: Sequence[Analysis],
    group: str,
    name: str,
    unit: str,
    better: Better,
    number: Callable[[Analysis], float | None],
) -> DesignRow:
    """The row of a number that an analysis gives; None for a design whose pose has no answer."""
    numbers = tuple(number(each) if each.status is Status.OK else None for each in analyses)
    return DesignRow(group=group, name=name, unit=unit, better=better, values=numbers)


def _quantity_rows(analyses: Sequence[Analysis], quantities: Sequence[str]) -> Iterator[DesignRow]:
    """The quantities that were named."""
    numbers_of_designs = [
        _numbers_of(analysis.state.machine, point_of_file(analysis.state.machine), names)[0]
        for analysis, names in zip(analyses, _names_by_design(analyses, quantities), strict=True)
    ]
    for name in dict.fromkeys(name for numbers in numbers_of_designs for name in numbers):
        values_of_designs = tuple(
            _number_or_none(numbers[name][0]) if name in numbers else None for numbers in numbers_of_designs
        )
        yield DesignRow("quantities", name, *_unit_and_better(name), values_of_designs)


def _diagonal(analysis: Analysis, group: str, name: str) -> float | None:
    diagonal = analysis.compliance_diagonal if group == "compliance" else analysis.stiffness_diagonal
    # The diagonal is empty where the analysis has no matrices.
    return dict(zip(analysis.components, diagonal, strict=False)).get(name)


def _least_stiffness(analysis: Analysis, block: str) -> float | None:
    """The least principal stiffness of a block, with the motions of the other block free."""
    blocks = (analysis.indices.free if analysis.indices else None) or {}
    return float(blocks[block].stiffnesses[0]) if block in blocks else None


def _condition(analysis: Analysis) -> float | None:
    condition = analysis.indices.stiffness_condition if analysis.indices else math.inf
    return condition if math.isfinite(condition) else None


def _number_or_none(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def _frequency(analysis: Analysis) -> float | None:
    machine = analysis.state.machine
    return _at_pose(analysis.state, "loaded_frequency_1" if machine.loaded else "frequency_1")


def _displacement_under_load(analysis: Analysis) -> float | None:
    return _at_pose(analysis.state, DISPLACEMENT) if platform_is_loaded(analysis.state.machine) else None


def _built_error(analysis: Analysis) -> float | None:
    return _at_pose(analysis.state, BUILT_ERROR) if analysis.state.machine.tolerances else None


def _at_pose(state: MachineState, name: str) -> float | None:
    """A number of a machine at its pose, which has an answer; None where the file does not give what it needs."""
    machine = state.machine
    try:
        refuse_absent(state, _quantities_of(machine, name))
    except InputError:  # the file gives no masses or no cut: the row has a dash
        return None
    numbers, _ = _numbers_of(machine, point_of_file(machine), [name])
    return _number_or_none(numbers[name][0])


def _quantities_of(machine: Machine, name: str) -> list[str]:
    """The quantities from which a number of a design is computed."""
    if name == BUILT_ERROR:
        return []
    return resolve_quantities([name], machine.family.component_names, cable_count(machine))


def _names_by_design(
    analyses: Sequence[Analysis], wanted: Sequence[str], varied: Sequence[Sequence[Parameter]] = ()
) -> list[list[str]]:
    """For each design, those of the wanted names that mean something for it; groups stand for their members.

    Args:
        analyses: the analyses of the designs.
        wanted: names of quantities or groups, or of `NUMBERS_BESIDE_QUANTITIES`.
        varied: for each design, the fields that vary over poses; empty for the poses of the files.

    Raises:
        InputError: a name that means nothing for any of the designs.
    """
    result: list[list[str]] = [[] for _ in analyses]
    for name in wanted:
        refusals = []
        for place, analysis in enumerate(analyses):
            machine = analysis.state.machine
            try:
                members = _quantities_of(machine, name)
                if name == BUILT_ERROR and not machine.tolerances:
                    raise InputError(
                        f'"{BUILT_ERROR}" is not known: the file of {machine.name} has no tolerances; write '
                        'joints = "0.05 mm", say, in the table [tolerances].'
                    )
                refuse_absent(analysis.state, members, varied[place] if varied else ())
            except InputError as error:
                refusals.append(error)
                continue
            result[place] += [name, *members] if name in NUMBERS_BESIDE_QUANTITIES else members
        if len(refusals) == len(analyses):
            raise refusals[0]
    return [[*dict.fromkeys(names)] for names in result]


def _numbers_of(
    machine: Machine, points: Points, names: Sequence[str], progress: Progress = silent
) -> tuple[dict[str, Array], Array]:
    """Numbers at points by name [points], NaN where there is none, and whether each point has a result [points]."""
    quantities = [name for name in names if name not in NUMBERS_BESIDE_QUANTITIES]
    components = _quantities_of(machine, DISPLACEMENT) if DISPLACEMENT in names else []
    # Without any quantity, the margin alone says which points have a result.
    evaluated = [*dict.fromkeys([*quantities, *components])] or ["singularity_margin"]
    evaluation = evaluate(machine, points, evaluated, progress)
    has_result = evaluation.status == Status.OK
    numbers = {name: evaluation.values[name] for name in quantities}
    if DISPLACEMENT in names:
        translations = [each for each in components if not QUANTITIES[each].components[0].startswith("r")]
        numbers[DISPLACEMENT] = np.linalg.norm([evaluation.values[each] for each in translations], axis=0)
    if BUILT_ERROR in names:
        numbers[BUILT_ERROR] = np.full(points.size, np.nan)
        if has_result.any():
            errors = budget(machine, points.columns(0, points.size))
            numbers[BUILT_ERROR][errors.settled] = errors.size("usual", "position")[errors.settled]
    return {name: numbers[name] for name in names}, has_result


def _unit_and_better(name: str) -> tuple[str, Better | None]:
    """The unit of a number, and whether less or more of it is better."""
    if name in NUMBERS_BESIDE_QUANTITIES:
        return "m", Better.LESS
    quantity = QUANTITIES[name]
    return quantity.unit, Better(quantity.better) if quantity.better else None


class _Spread(NamedTuple):
    """Statistics of a number over poses: its worst value, `PERCENTILE` towards it, and its mean.

    Where neither less nor more is better, the worst value is the greatest in size, and the percentile is one of sizes.
    """

    worst: float
    percentile: float
    mean: float


def rows_over(
    analyses: Sequence[Analysis], ranges: Sequence[str], poses: Any, quantities: Sequence[str], progress: Progress
) -> tuple[tuple[DesignRow, ...], tuple[PoseCount, ...]]:
    """Compute the worst value, a percentile and the mean over poses, and for each design the number of poses.

    Args:
        analyses: the analyses of the designs.
        ranges: ranges of a grid of poses; none if the poses are given.
        poses: poses as for `evaluate`, of fields that all designs have; None if there are ranges.
        quantities: names or groups of quantities; the diagonal of C and the singularity margin if empty.
        progress: receives the number of poses done, and of all poses.

    Raises:
        InputError: one of the machines has no such pose or range, or none of them has a quantity.
    """
    machines = [analysis.state.machine for analysis in analyses]
    points_and_fields = [_points_of(machine, ranges, poses) for machine in machines]
    names = _names_by_design(analyses, quantities or USUAL_QUANTITIES, [fields for _, fields in points_and_fields])
    spreads: list[dict[str, _Spread]] = []
    counts = []
    total, done = sum(points.size for points, _ in points_and_fields), 0
    for machine, (points, _), names_of_design in zip(machines, points_and_fields, names, strict=True):
        progress_of_design = partial(_progress_after, progress, done, total)
        numbers, has_result = _numbers_of(machine, points, names_of_design, progress_of_design)
        counts.append(PoseCount(answered=int(has_result.sum()), total=points.size))
        known = {name: row[has_result & ~np.isnan(row)] for name, row in numbers.items()}
        spreads.append({name: _spread(_unit_and_better(name)[1], row) for name, row in known.items() if row.size})
        done += points.size
        progress(done, total)
    rows = []
    for name in dict.fromkeys(name for names_of_design in names for name in names_of_design):
        unit, better = _unit_and_better(name)
        group = name.replace("compliance_", "C_") if name in GROUPS["compliance"] else name.replace("_", " ")
        titles = ("worst" if better else "greatest in size", f"{PERCENTILE:g} %", "mean")
        for statistic, title in zip(_Spread._fields, titles, strict=True):
            numbers_of_designs = tuple(
                getattr(spread[name], statistic) if name in spread else None for spread in spreads
            )
            rows.append(DesignRow(group=group, name=title, unit=unit, better=better, values=numbers_of_designs))
    return tuple(rows), tuple(counts)


def _progress_after(progress: Progress, before: int, total: int, done: int, _total_of_part: int) -> None:
    """Report the progress of a part of the work as that of the whole."""
    progress(before + done, total)


def _points_of(machine: Machine, ranges: Sequence[str], poses: Any) -> tuple[Points, list[Parameter]]:
    """The points at which a machine is evaluated, and the fields that vary."""
    if poses is None:
        pairs = chosen_axes(machine, ranges)
        return grid_of(pairs), [parameter for _, parameter in pairs]
    columns = given_poses(machine, poses)
    return PointTable(columns.leaves), list(columns.fields)


def _spread(better: Better | None, row: Array) -> _Spread:
    """The statistics of some values, of at least one."""
    mean = float(row.mean())
    if better is None:
        return _Spread(float(row[np.abs(row).argmax()]), _percentile(np.abs(row), PERCENTILE), mean)
    if better is Better.MORE:
        return _Spread(float(row.min()), _percentile(row, 100.0 - PERCENTILE), mean)
    return _Spread(float(row.max()), _percentile(row, PERCENTILE), mean)


def _percentile(row: Array, percent: float) -> float:
    """A percentile, interpolated only if all values are finite, since infinity has no distance."""
    if np.isfinite(row).all():
        return float(np.percentile(row, percent))
    return float(np.percentile(row, percent, method="nearest"))

"""Numbers of several designs in rows: at the pose of each, and over a grid of poses that all of them have."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import Machine
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.grid.grid import evaluate_grid
from kinetostat.tolerances import EQUAL_DESIGNS

PERCENTILE = 95.0
"""Percent of the poses of a grid that are at least as good as the value shown."""


class Better(StrEnum):
    """Which of two values is the better one."""

    LESS = "less"
    MORE = "more"


@dataclass(frozen=True)
class Row:
    """One number of every design.

    Attributes:
        group: heading under which rows stand together.
        name: name of the number.
        unit: unit of the number, SI.
        better: whether less or more is better.
        values: the number of each design; None if a design lacks it, infinite where the design is rigid or free.
    """

    group: str
    name: str
    unit: str
    better: Better
    values: tuple[float | None, ...]

    @property
    def percents(self) -> tuple[float | None, ...]:
        """Change against the first design, percent; None where the change is undefined."""
        first = self.values[0]
        if first is None or first == 0.0 or not math.isfinite(first):
            return (None,) * len(self.values)
        return tuple(None if v is None or not math.isfinite(v) else 100.0 * (v / first - 1.0) for v in self.values)

    @property
    def best(self) -> tuple[int, ...]:
        """Indices of the best designs; empty where all are equal."""
        known = {i: v for i, v in enumerate(self.values) if v is not None}
        if len(known) < 2:
            return ()
        top = (min if self.better is Better.LESS else max)(known.values())
        places = tuple(i for i, v in known.items() if v == top or math.isclose(v, top, rel_tol=EQUAL_DESIGNS))
        return places if len(places) < len(known) else ()


def rows_at_poses(analyses: Sequence[Analysis]) -> tuple[Row, ...]:
    """Collect numbers at each design's pose; a row for which no design has a number is left out."""
    rows = []
    for group, letter, better in (("compliance", "C", Better.LESS), ("stiffness", "K", Better.MORE)):
        for name in COMPONENTS:
            entry = QUANTITIES[f"{group}_{name}"]
            numbers = tuple(_diagonal(analysis, group, name) for analysis in analyses)
            rows.append(Row(group, f"{letter}_{name}", entry.unit, better, numbers))
    scalars: list[tuple[str, str, Better, Callable[[Analysis], float | None]]] = [
        ("least stiffness, force", "N/m", Better.MORE, lambda analysis: _least(analysis, "translation")),
        ("least stiffness, moment", "N·m/rad", Better.MORE, lambda analysis: _least(analysis, "rotation")),
        ("condition of K", "1", Better.LESS, _condition),
        ("singularity margin", "1", Better.MORE, lambda analysis: analysis.singularity_margin),
        ("moving mass", "kg", Better.LESS, lambda analysis: analysis.moving_mass),
    ]
    for name, unit, better, value in scalars:
        numbers = tuple(value(analysis) if analysis.status is Status.OK else None for analysis in analyses)
        rows.append(Row("indices", name, unit, better, numbers))
    return tuple(row for row in rows if any(value is not None for value in row.values))


def _diagonal(analysis: Analysis, group: str, name: str) -> float | None:
    diagonal = analysis.compliance_diagonal if group == "compliance" else analysis.stiffness_diagonal
    return dict(zip(analysis.components, diagonal, strict=False)).get(name)


def _least(analysis: Analysis, block: str) -> float | None:
    """The least principal stiffness of a block, with the motions of the other block free."""
    blocks = analysis.indices.free if analysis.indices else None
    return {str(name): block_values.stiffnesses[0] for name, block_values in (blocks or {}).items()}.get(block)


def _condition(analysis: Analysis) -> float | None:
    value = analysis.indices.stiffness_condition if analysis.indices else math.inf
    return value if math.isfinite(value) else None


def rows_over(
    machines: Sequence[Machine], ranges: Sequence[str], progress: Progress
) -> tuple[tuple[Row, ...], tuple[tuple[int, int], ...]]:
    """Compute the worst value, a percentile and the mean over a grid; and for each design (poses answered, all poses).

    Raises:
        InputError: a range that one of the machines does not take.
    """
    common = [name for name in COMPONENTS if any(name in machine.family.component_names for machine in machines)]
    spreads: list[dict[str, tuple[float, ...]]] = []
    poses = []
    for done, machine in enumerate(machines, 1):
        dataset = evaluate_grid(machine, ranges, ["compliance", "singularity_margin"])
        good = dataset["status"].values == Status.OK
        poses.append((int(good.sum()), int(good.size)))
        columns = {str(name): dataset[name].values[good] for name in dataset.data_vars if name != "status"}
        spreads.append({name: _spread(name, row) for name, row in columns.items() if row.size})
        progress(done, len(machines))
    rows = []
    for name in [*(f"compliance_{component}" for component in common), "singularity_margin"]:
        better = Better.MORE if name == "singularity_margin" else Better.LESS
        shown = name.replace("compliance_", "C_").replace("_margin", " margin")
        for k, what in enumerate(("worst", f"{PERCENTILE:g} %", "mean")):
            by_design = tuple(spread[name][k] if name in spread else None for spread in spreads)
            rows.append(Row(shown, what, QUANTITIES[name].unit, better, by_design))
    return tuple(rows), tuple(poses)


def _spread(name: str, row: Array) -> tuple[float, ...]:
    """Return the worst value, the value that `PERCENTILE` percent of the poses reach or better, and the mean."""
    if name == "singularity_margin":
        return float(row.min()), float(np.percentile(row, 100.0 - PERCENTILE)), float(row.mean())
    return float(row.max()), float(np.percentile(row, PERCENTILE)), float(row.mean())

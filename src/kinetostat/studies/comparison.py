"""Designs side by side: where their files differ, how stiff each is, and what each gains against the first.

Any machines can be compared, of one family or not; what only some of them have is missing for the others. What is
printed or drawn is in `views`.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress, silent
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import element_share, elements, without_rounding
from kinetostat.kinetostatics.extremes import ROTATIONS, TRANSLATIONS
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, find, parameters, values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, several
from kinetostat.spec.immutable import Immutable
from kinetostat.spec.ranges import parse_range
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.grid import evaluate_grid
from kinetostat.tolerances import EQUAL_DESIGNS

if TYPE_CHECKING:
    import pandas as pd

MOST_DESIGNS = 12
OVERRIDE_SEPARATOR = ";"
"""Between overrides of one design."""
PERCENTILE = 95.0
"""Percent of the poses of a grid that are at least as good as the value shown."""

_OVERRIDDEN = re.compile(r"(.+?):(\s*[A-Za-z_][\w.-]*\s*=.*)", re.DOTALL)


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


@dataclass(frozen=True)
class Design:
    """A machine under the name by which it was given.

    Attributes:
        label: as written.
        machine: with its pose.
        analysis: of it.
    """

    label: str
    machine: Machine
    analysis: Analysis

    @property
    def answered(self) -> bool:
        """Whether its pose has an answer."""
        return self.analysis.status is Status.OK


@dataclass(frozen=True)
class Difference:
    """A field of which not all designs that have it say the same.

    Attributes:
        path: of the field.
        parameters: of each design; the kind need not be the same. None where it has no such field.
        values: SI, entry by entry; empty where it has no such field.
    """

    path: str
    parameters: tuple[Parameter | None, ...]
    values: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class SoftDirection:
    """The softest rotation or translation of a design, and what makes it soft.

    Attributes:
        direction: the component.
        shares: of the elements in its compliance, the greatest first.
    """

    direction: str
    shares: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False)
class Comparison(Immutable):
    """Designs side by side.

    Attributes:
        designs: in order; the first is what the others are compared with.
        differences: fields that two designs have at least and that differ.
        rows: numbers at the pose of each design.
        softest: the softest rotation and translation of each design; fewer where it has none.
        ranges: of the grid, as written.
        poses: of each design, how many poses of the grid have an answer, and how many there are.
        over: numbers over those poses.
    """

    designs: tuple[Design, ...]
    differences: tuple[Difference, ...]
    rows: tuple[DesignRow, ...]
    softest: tuple[tuple[SoftDirection, ...], ...]
    ranges: tuple[str, ...] = ()
    poses: tuple[tuple[int, int], ...] = ()
    over: tuple[DesignRow, ...] = ()

    def to_pandas(self) -> "pd.DataFrame":
        """Return a table of pandas: a row for each number, with its unit, and a column for each design, SI."""
        import pandas as pd  # takes long to load

        rows = [[row.group, row.name, row.unit, *row.values] for row in (*self.rows, *self.over)]
        names = [design.label for design in self.designs]
        return pd.DataFrame(rows, columns=["group", "number", "unit", *names]).set_index(["group", "number"])

    @property
    def machine(self) -> Machine:
        """The first design, with which the others are compared, and in whose units all are shown."""
        return self.designs[0].machine

    def __repr__(self) -> str:
        return f"<Comparison of {', '.join(design.label for design in self.designs)}>"


def read_design(text: str, settings: Sequence[str] = ()) -> Design:
    """Read a design from text: a file or bundled name, and after a colon overrides of its fields.

    Args:
        text: "NAME" or "NAME:path=value;path=value".
        settings: overrides for all designs, applied first.

    Raises:
        InputError: no such machine, or a mistake in it.
    """
    match = None if text in bundled() else _OVERRIDDEN.fullmatch(text)
    if match is None:
        machine = load(text, settings)
    else:
        overrides = [setting.strip() for setting in match[2].split(OVERRIDE_SEPARATOR) if setting.strip()]
        machine = load(match[1], [*settings, *overrides])
    return Design(text, machine, analyze(machine))


@checked
def compare(
    designs: Sequence[Design | Machine | str] | Mapping[str, Machine | str],
    ranges: Sequence[str] = (),
    progress: Progress = silent,
) -> Comparison:
    """Compare designs, each at its own pose and, where ranges are given, all over the same grid.

    Args:
        designs: two or more; machines, by names of your choice if you like, or texts, "NAME" or
            "NAME:path=value;path=value".
        ranges: "FIELD=from:to:count", of fields that all of them have.
        progress: receives how far the work is.

    Raises:
        InputError: fewer than two designs or too many, or a range that one of them does not take.
    """
    designs, ranges = [designs] if isinstance(designs, str) else designs, several(ranges)
    if not 2 <= len(designs) <= MOST_DESIGNS:
        raise InputError(
            f"compare takes 2 to {MOST_DESIGNS} designs, not {len(designs)}; give files, names or NAME:path=value."
        )
    given = list(_designs(designs))
    for design in given:
        _refuse_absent(design, ranges)
    over, poses = rows_over([design.machine for design in given], ranges, progress) if ranges else ((), ())
    return Comparison(
        tuple(given),
        _differences(given),
        rows_at_poses([design.analysis for design in given]),
        tuple(_softest(design) for design in given),
        tuple(ranges),
        poses,
        over,
    )


def _refuse_absent(design: Design, ranges: Sequence[str]) -> None:
    """Refuse ranges of fields that a design lacks, by its name."""
    for text in ranges:
        try:
            find(design.machine.family, parse_range(text).field)
        except InputError as error:
            raise InputError(f"{design.label}: {error}") from None


def _designs(given: Sequence[Design | Machine | str] | Mapping[str, Machine | str]) -> Iterator[Design]:
    """The designs that were given, analysed; machines without a name are numbered."""
    named = (
        given.items() if isinstance(given, Mapping) else ((f"design {n}", design) for n, design in enumerate(given, 1))
    )
    for name, design in named:
        if isinstance(design, Machine):
            yield Design(name, design, analyze(design))
        else:
            read = read_design(design) if isinstance(design, str) else design
            yield replace(read, label=name) if isinstance(given, Mapping) else read


def _differences(designs: Sequence[Design]) -> tuple[Difference, ...]:
    """Fields that two designs have at least, whole ones where they have entries, and of which not all say the same."""
    numbers_of = [values(design.machine) for design in designs]
    known = [_whole_fields(design.machine) for design in designs]
    differences = []
    for path in dict.fromkeys(path for fields in known for path in fields):
        fields_of = tuple(fields.get(path) for fields in known)
        rows = tuple(
            tuple(numbers[leaf] for leaf in p.leaves) if p else ()
            for numbers, p in zip(numbers_of, fields_of, strict=True)
        )
        if len({(p.quantity.kind, row) for p, row in zip(fields_of, rows, strict=True) if p}) > 1:
            differences.append(Difference(path, fields_of, rows))
    return tuple(differences)


def _whole_fields(machine: Machine) -> dict[str, Parameter]:
    """The fields of a machine by path, those with entries as one."""
    every = list(parameters(machine.family))
    entries = {leaf for parameter in every if parameter.quantity.count for leaf in parameter.leaves}
    return {parameter.path: parameter for parameter in every if parameter.path not in entries}


def _softest(design: Design) -> tuple[SoftDirection, ...]:
    """The softest rotation and translation of a design, with the shares of its elements."""
    if not design.answered:
        return ()
    response, components = respond(design.machine), design.machine.family.components
    whole = without_rounding(response.compliance.diagonal(), response)[:, 0]
    softest = []
    for block in (ROTATIONS, TRANSLATIONS):
        known = [i for i in components if i in block and 0.0 < whole[i] < math.inf]
        if known:
            i = max(known, key=lambda i: whole[i])
            parts = [
                (element.name, float(element_share(response, element)[i] / whole[i]))
                for element in elements(response.configuration)
                if element.stiffness != math.inf
            ]
            softest.append(SoftDirection(COMPONENTS[i], tuple(sorted(parts, key=lambda part: -part[1]))))
    return tuple(softest)


def rows_at_poses(analyses: Sequence[Analysis]) -> tuple[DesignRow, ...]:
    """Collect numbers at each design's pose; a row for which no design has a number is left out."""
    rows = []
    for group, letter, better in (("compliance", "C", Better.LESS), ("stiffness", "K", Better.MORE)):
        for name in COMPONENTS:
            entry = QUANTITIES[f"{group}_{name}"]
            numbers = tuple(_diagonal(analysis, group, name) for analysis in analyses)
            rows.append(DesignRow(group, f"{letter}_{name}", entry.unit, better, numbers))
    scalars: list[tuple[str, str, Better, Callable[[Analysis], float | None]]] = [
        ("least stiffness, force", "N/m", Better.MORE, lambda analysis: _least(analysis, "translation")),
        ("least stiffness, moment", "N·m/rad", Better.MORE, lambda analysis: _least(analysis, "rotation")),
        ("condition of K", "1", Better.LESS, _condition),
        ("singularity margin", "1", Better.MORE, lambda analysis: analysis.singularity_margin),
        ("moving mass", "kg", Better.LESS, lambda analysis: analysis.moving_mass),
    ]
    for name, unit, better, value in scalars:
        numbers = tuple(value(analysis) if analysis.status is Status.OK else None for analysis in analyses)
        rows.append(DesignRow("indices", name, unit, better, numbers))
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
) -> tuple[tuple[DesignRow, ...], tuple[tuple[int, int], ...]]:
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
            rows.append(DesignRow(shown, what, QUANTITIES[name].unit, better, by_design))
    return tuple(rows), tuple(poses)


def _spread(name: str, row: Array) -> tuple[float, ...]:
    """Return the worst value, the value that `PERCENTILE` percent of the poses reach or better, and the mean."""
    if name == "singularity_margin":
        return float(row.min()), float(np.percentile(row, 100.0 - PERCENTILE)), float(row.mean())
    return float(row.max()), float(np.percentile(row, PERCENTILE)), float(row.mean())

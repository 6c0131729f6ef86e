"""Designs side by side: where their files differ, how stiff each is, and who gains what against the first.

Any machines can be compared, of one family or not; what only some of them have is missing for the others. What is
printed or drawn is in `views`.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.batch import Progress, silent
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import element_share, elements, without_rounding
from kinetostat.kinetostatics.quantities import QUANTITIES, ROTATIONS
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, parameters, values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.grid import evaluate_grid

MOST_DESIGNS = 12
SEPARATOR = ";"
"""Between overrides of one design."""
PERCENTILE = 95.0
"""Of the poses of a grid, the share that is at least as good."""
SAME = 1e-9
"""Relative difference up to which two values are one."""

_OVERRIDDEN = re.compile(r"(.+?):(\s*[A-Za-z_][\w.-]*\s*=.*)", re.DOTALL)


class Better(StrEnum):
    """Which of two values is the better one."""

    LESS = "less"
    MORE = "more"


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
    """A field that all designs have, and of which not all say the same.

    Attributes:
        parameter: of the first design.
        values: SI, entry by entry.
    """

    parameter: Parameter
    values: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Row:
    """One number of every design.

    Attributes:
        group: what rows belong together.
        name: of the number.
        unit: SI.
        better: which is the better one.
        values: None where a design has none; infinite where it is rigid or free.
    """

    group: str
    name: str
    unit: str
    better: Better
    values: tuple[float | None, ...]

    @property
    def percents(self) -> tuple[float | None, ...]:
        """Change against the first design, percent; None where there is no such number."""
        first = self.values[0]
        if first is None or first == 0.0 or not math.isfinite(first):
            return (None,) * len(self.values)
        return tuple(None if v is None or not math.isfinite(v) else 100.0 * (v / first - 1.0) for v in self.values)

    @property
    def best(self) -> tuple[int, ...]:
        """Places of the best ones; none where all are alike."""
        known = {i: v for i, v in enumerate(self.values) if v is not None}
        if len(known) < 2:
            return ()
        top = (min if self.better is Better.LESS else max)(known.values())
        found = tuple(i for i, v in known.items() if v == top or math.isclose(v, top, rel_tol=SAME))
        return found if len(found) < len(known) else ()


@dataclass(frozen=True)
class Blame:
    """What makes a direction of a design soft.

    Attributes:
        component: the softest one of its kind.
        shares: of the elements in its compliance, the greatest first.
    """

    component: str
    shares: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Comparison:
    """The answer.

    Attributes:
        designs: in order; the first is what the others are compared with.
        differences: fields that differ.
        rows: numbers at the pose of each design.
        softest: the softest rotation and translation of each design; fewer where it has none.
        ranges: of the grid, as written.
        poses: of each design, how many poses of the grid have an answer, and how many there are.
        over: numbers over those poses.
    """

    designs: tuple[Design, ...]
    differences: tuple[Difference, ...]
    rows: tuple[Row, ...]
    softest: tuple[tuple[Blame, ...], ...]
    ranges: tuple[str, ...] = ()
    poses: tuple[tuple[int, int], ...] = ()
    over: tuple[Row, ...] = ()


def read_design(text: str, settings: Sequence[str] = ()) -> Design:
    """A design from what people write: a file or bundled name, and after a colon overrides of its fields.

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
        own = [setting.strip() for setting in match[2].split(SEPARATOR) if setting.strip()]
        machine = load(match[1], [*settings, *own])
    return Design(text, machine, analyze(machine))


def compare(designs: Sequence[Design], ranges: Sequence[str] = (), progress: Progress = silent) -> Comparison:
    """Designs side by side, each at its own pose and, where ranges are given, all over the same grid.

    Args:
        designs: two or more.
        ranges: "FIELD=from:to:count", of fields that all of them have.
        progress: told how far the work is.

    Raises:
        InputError: fewer than two designs or too many, or a range that one of them does not take.
    """
    if not 2 <= len(designs) <= MOST_DESIGNS:
        raise InputError(
            f"compare takes 2 to {MOST_DESIGNS} designs, not {len(designs)}; give files, names or NAME:path=value."
        )
    over, poses = _over(designs, ranges, progress) if ranges else ((), ())
    return Comparison(
        tuple(designs), _differences(designs), _rows(designs), tuple(_softest(design) for design in designs),
        tuple(ranges), poses, over,
    )  # fmt: skip


def _differences(designs: Sequence[Design]) -> tuple[Difference, ...]:
    """Fields that all designs have, whole ones where they have entries, and of which not all say the same."""
    held = [values(design.machine) for design in designs]
    every = list(parameters(designs[0].machine.family))
    entries = {leaf for parameter in every if parameter.quantity.count for leaf in parameter.leaves}
    found = []
    for parameter in every:
        if parameter.path in entries or not all(leaf in own for own in held for leaf in parameter.leaves):
            continue
        rows = tuple(tuple(own[leaf] for leaf in parameter.leaves) for own in held)
        if len(set(rows)) > 1:
            found.append(Difference(parameter, rows))
    return tuple(found)


def _rows(designs: Sequence[Design]) -> tuple[Row, ...]:
    """Numbers at each design's pose; rows that no design has are left out."""
    found = []
    for group, letter, better in (("compliance", "C", Better.LESS), ("stiffness", "K", Better.MORE)):
        for name in COMPONENTS:
            entry = QUANTITIES[f"{group}_{name}"]
            own = tuple(_diagonal(design.analysis, group, name) for design in designs)
            found.append(Row(group, f"{letter}_{name}", entry.unit, better, own))
    scalars: list[tuple[str, str, Better, Callable[[Analysis], float | None]]] = [
        ("least stiffness, force", "N/m", Better.MORE, lambda one: _least(one, "translation")),
        ("least stiffness, moment", "N·m/rad", Better.MORE, lambda one: _least(one, "rotation")),
        ("condition of K", "1", Better.LESS, _condition),
        ("regularity", "1", Better.MORE, _regularity),
        ("moving mass", "kg", Better.LESS, lambda one: one.mass),
    ]
    for name, unit, better, value in scalars:
        own = tuple(value(design.analysis) if design.answered else None for design in designs)
        found.append(Row("indices", name, unit, better, own))
    return tuple(row for row in found if any(value is not None for value in row.values))


def _diagonal(analysis: Analysis, group: str, name: str) -> float | None:
    diagonal = analysis.compliance_diagonal if group == "compliance" else analysis.stiffness_diagonal
    return dict(zip(analysis.components, diagonal, strict=False)).get(name)


def _least(analysis: Analysis, block: str) -> float | None:
    """The least principal stiffness of a block, the other free to follow."""
    blocks = analysis.indices.free if analysis.indices else None
    return {str(name): one.stiffnesses[0] for name, one in (blocks or {}).items()}.get(block)


def _regularity(analysis: Analysis) -> float:
    return float(respond(analysis.machine).regularity)


def _condition(analysis: Analysis) -> float | None:
    value = analysis.indices.condition if analysis.indices else math.inf
    return value if math.isfinite(value) else None


def _softest(design: Design) -> tuple[Blame, ...]:
    """The softest rotation and translation of a design, and what is to blame."""
    if not design.answered:
        return ()
    response, components = respond(design.machine), design.machine.family.components
    whole = without_rounding(response.compliance.diagonal(), response)[:, 0]
    found = []
    for block in (range(ROTATIONS), range(ROTATIONS, len(COMPONENTS))):
        own = [i for i in components if i in block and 0.0 < whole[i] < math.inf]
        if own:
            i = max(own, key=lambda i: whole[i])
            parts = [
                (element.name, float(element_share(response, element)[i] / whole[i]))
                for element in elements(response.configuration)
                if element.stiffness != math.inf
            ]
            found.append(Blame(COMPONENTS[i], tuple(sorted(parts, key=lambda part: -part[1]))))
    return tuple(found)


def _over(
    designs: Sequence[Design], ranges: Sequence[str], progress: Progress
) -> tuple[tuple[Row, ...], tuple[tuple[int, int], ...]]:
    """Worst, percentile and mean over a grid, and how many poses have an answer."""
    common = [name for name in COMPONENTS if any(name in d.machine.family.component_names for d in designs)]
    found: list[dict[str, tuple[float, ...]]] = []
    poses = []
    for done, design in enumerate(designs, 1):
        wanted = ["compliance", "regularity"]
        dataset = evaluate_grid(design.machine, ranges, wanted)
        good = dataset["status"].values == Status.OK
        poses.append((int(good.sum()), int(good.size)))
        own = {str(name): dataset[name].values[good] for name in dataset.data_vars if name != "status"}
        found.append({name: _spread(name, row) for name, row in own.items() if row.size})
        progress(done, len(designs))
    rows = []
    for name in [*(f"compliance_{component}" for component in common), "regularity"]:
        better = Better.MORE if name == "regularity" else Better.LESS
        shown = name.replace("compliance_", "C_")
        for k, what in enumerate(("worst", f"{PERCENTILE:g} %", "mean")):
            own_values = tuple(spread[name][k] if name in spread else None for spread in found)
            rows.append(Row(shown, what, QUANTITIES[name].unit, better, own_values))
    return tuple(rows), tuple(poses)


def _spread(name: str, row: np.ndarray) -> tuple[float, ...]:
    """Worst, what so many percent of the poses are at least as good as, and mean."""
    if name == "regularity":
        return float(row.min()), float(np.percentile(row, 100.0 - PERCENTILE)), float(row.mean())
    return float(row.max()), float(np.percentile(row, PERCENTILE)), float(row.mean())

"""The space of designs and poses: variables with bounds or choices, and the poses at which every design is judged.

A gene is a share of the way between the bounds of a variable, 0 to 1, or the number of a choice. The poses are the
machine's own, a list, a grid, or the workspace in a grid.
"""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from math import prod
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.arrays import Array
from kinetostat.display import ENGINEERING, Display
from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, Parameter, find, values
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.spec.immutable import Immutable
from kinetostat.spec.study import PosesTable, VariableTable
from kinetostat.studies.poses import listed_fields, repeated_leaf
from kinetostat.units import KINDS, RIGID, UnitError, parse

if TYPE_CHECKING:
    from kinetostat.studies import datasets, workspace
else:  # they label their answers, by a library that takes long to import; most studies have no grid of poses
    datasets = LateModule("kinetostat.studies.datasets")
    workspace = LateModule("kinetostat.studies.workspace")

VALUE_DIGITS = 6
"""Digits of the value of a variable for people, as in fields of the studio: what a file says comes back as it is."""
MOST_NODES = 1_000_000
"""Greatest number of nodes of a grid of poses, of which the workspace is a part."""
NO_CHOICE = -1.0
"""Takes the place of the number of a choice where a machine has none of the choices of a catalogue."""


@dataclass(frozen=True)
class Variable:
    """A field of the machine, or several tied together.

    Attributes:
        fields: the fields that it sets; the first one names it.
        ratios: ratio of each field to the value of the variable.
        low, high: bounds, SI; of a catalogue, numbers of its first and last choice.
        choices: values of each field [choices x fields], SI; None where bounds say what is allowed.
        labels: names of the choices.
        fixed: whether it keeps its value, so that only its tolerance counts.
        tolerance: greatest deviation by manufacture, SI.
        initial: the machine's own value, SI; of a catalogue, the number of the choice, or `NO_CHOICE`.
    """

    fields: tuple[Parameter, ...]
    ratios: tuple[float, ...]
    low: float
    high: float
    choices: Array | None
    labels: tuple[str, ...]
    fixed: bool
    tolerance: float
    initial: float

    @property
    def name(self) -> str:
        """The path of its first field."""
        return self.fields[0].path

    @property
    def quantity(self) -> Quantity:
        """Quantity of its first field."""
        return self.fields[0].quantity

    @property
    def unit(self) -> str:
        """Its SI unit; a catalogue has none."""
        return "1" if self.choices is not None else KINDS[self.quantity.kind].unit

    def columns(self, numbers: Array) -> dict[str, Array]:
        """Values of its leaves by path, SI [designs], from its own values [designs]."""
        columns: dict[str, Array] = {}
        for k, (field, ratio) in enumerate(zip(self.fields, self.ratios, strict=True)):
            value = ratio * numbers if self.choices is None else self.choices[numbers.astype(int), k]
            columns.update(dict.fromkeys(field.leaves, value))
        return columns

    def in_words(self, value: float, display: Display = ENGINEERING) -> str:
        """A value as people read it: a label, or a number with its unit."""
        if self.choices is not None:
            return "none of the choices" if value == NO_CHOICE else self.labels[int(value)]
        return display.show(value, self.unit, RIGID, VALUE_DIGITS)


@dataclass(frozen=True)
class Space:
    """All variables of a study."""

    variables: tuple[Variable, ...]

    @cached_property
    def searched_variables(self) -> tuple[Variable, ...]:
        """The variables that are not fixed."""
        return tuple(variable for variable in self.variables if not variable.fixed)

    @property
    def size(self) -> int:
        return len(self.searched_variables)

    @cached_property
    def catalogue(self) -> Array:
        """Number of choices of each searched variable; 0 where it has bounds."""
        return np.array([0 if v.choices is None else len(v.choices) for v in self.searched_variables])

    @property
    def has_continuous(self) -> bool:
        """Whether any searched variable has bounds, so that designs change continuously along it."""
        return bool((self.catalogue == 0).any())

    @cached_property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of all numbers that the variables set, those of fixed ones last."""
        ordered = [*self.searched_variables, *(variable for variable in self.variables if variable.fixed)]
        return tuple(leaf for variable in ordered for field in variable.fields for leaf in field.leaves)

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        """Lower bounds and widths of the ranges of genes, SI [variables each]; the gene of a choice is its number."""
        pairs = [(0.0, 1.0) if v.choices is not None else (v.low, v.high - v.low) for v in self.searched_variables]
        lows, spans = np.array(pairs).T
        return lows, spans

    def values(self, genes: Array) -> Array:
        """Values of the searched variables from genes: SI, or numbers of choices [... x variables]."""
        lows, spans = self._bounds
        return lows + spans * genes

    def genes(self, numbers: Array) -> Array:
        """Genes from values of the searched variables [... x variables]."""
        lows, spans = self._bounds
        return (numbers - lows) / spans

    def columns(self, genes: Array, deviations: Mapping[str, Array] | None = None) -> dict[str, Array]:
        """Values by leaf path, SI, in the order of `paths` [designs].

        Args:
            genes: genes of the designs [designs x variables].
            deviations: what is added to the value of a variable with bounds, by its name, SI [designs].
        """
        added = deviations or {}
        columns: dict[str, Array] = {}
        for variable, numbers in zip(self.searched_variables, self.values(genes).T, strict=True):
            columns |= variable.columns(numbers + added.get(variable.name, 0.0))
        for variable in (v for v in self.variables if v.fixed):
            columns |= variable.columns(np.full(len(genes), variable.initial) + added.get(variable.name, 0.0))
        return columns

    @property
    def initial(self) -> Array:
        """Genes of the machine as its file says [variables]; those of values beyond the bounds lie beyond 0 and 1."""
        return self.genes(np.array([variable.initial for variable in self.searched_variables]))

    def holds(self, genes: Array) -> bool:
        """Whether a design lies within bounds and choices."""
        most = np.where(self.catalogue > 0, self.catalogue - 1, 1)
        return bool(np.all((genes >= 0.0) & (genes <= most)))


def read_space(machine: Machine, tables: Sequence[VariableTable]) -> Space:
    """Read the variables of a study file.

    Raises:
        InputError: a field is not known or set twice, does not allow a bound, or no variable is left to search.
    """
    variables = tuple(_variable(machine, table, f"variables.{i}") for i, table in enumerate(tables))
    if leaf := repeated_leaf(field for variable in variables for field in variable.fields):
        raise InputError(f"{leaf} is set by two variables; give each field to one.")
    if all(variable.fixed for variable in variables):
        raise InputError("all variables are fixed; leave at least one free to be searched.")
    return Space(variables)


def _variable(machine: Machine, table: VariableTable, where: str) -> Variable:
    if (table.path is None) == (table.paths is None):
        raise InputError(f"{where} needs either path (one field) or paths (several tied together).")
    fields = tuple(find(machine.family, path) for path in table.fields)
    if table.choices is not None:
        return _catalogue(machine, table, fields, where)
    name = f"{where} ({fields[0].path})"
    ratios = _ratios(table, fields, name)
    initial = float(values(machine)[fields[0].leaves[0]]) / ratios[0]
    low, high = (initial, initial) if table.fixed else _bounds(table, fields[0].quantity, name)
    return Variable(
        fields=fields,
        ratios=ratios,
        low=low,
        high=high,
        choices=None,
        labels=(),
        fixed=table.fixed,
        tolerance=_tolerance(table, fields[0], name),
        initial=initial,
    )


def _bounds(table: VariableTable, quantity: Quantity, name: str) -> tuple[float, float]:
    """The bounds of a variable that is searched, SI.

    Raises:
        InputError: a bound is missing, cannot be read or is infinite, or the lower one is not below the upper one.
    """
    if table.start is None or table.end is None:
        raise InputError(f'{name} needs from and to, e.g. from = "10 cm", to = "14 cm"; or choices, or fixed = true.')
    low, high = _bound(table.start, quantity, f"{name}.from"), _bound(table.end, quantity, f"{name}.to")
    if low >= high:
        raise InputError(f"{name}: from is {table.start} and must be less than to, {table.end}; exchange them.")
    return low, high


def _ratios(table: VariableTable, fields: Sequence[Parameter], name: str) -> tuple[float, ...]:
    ratios = tuple(table.ratios or (1.0,) * len(fields))
    if len(ratios) != len(fields) or not all(ratios):
        raise InputError(f"{name}.ratios must be one number other than 0 for each of its {len(fields)} paths.")
    if len({field.quantity.kind for field in fields}) > 1:
        raise InputError(f"{name}: fields that are tied together must be of one kind; use choices for a catalogue.")
    return ratios


def _catalogue(machine: Machine, table: VariableTable, fields: tuple[Parameter, ...], where: str) -> Variable:
    name = f"{where} ({fields[0].path})"
    if table.start is not None or table.end is not None or table.ratios is not None or table.tolerance is not None:
        raise InputError(f"{name} has choices; leave out from, to, ratios and tolerance.")
    rows = [entry if isinstance(entry, list) else [entry] for entry in table.choices or []]
    for k, row in enumerate(rows):
        if len(row) != len(fields):
            raise InputError(f"{name}.choices.{k} has {len(row)} values; give one for each of {len(fields)} fields.")
    choices = [
        [_value(written, field.quantity, f"{name}.choices.{k}") for written, field in zip(row, fields, strict=True)]
        for k, row in enumerate(rows)
    ]
    labels = table.labels or [", ".join(str(value) for value in row) for row in rows]
    if len(labels) != len(rows):
        raise InputError(f"{name}.labels has {len(labels)} entries; give one for each of {len(rows)} choices.")
    numbers = values(machine)
    present = [{float(numbers[leaf]) for leaf in field.leaves} for field in fields]
    matching = [k for k, choice in enumerate(choices) if [{value} for value in choice] == present]
    if table.fixed and not matching:
        raise InputError(f"{name} is fixed, but the machine has none of its choices; set it to one of them.")
    return Variable(
        fields=fields,
        ratios=(1.0,) * len(fields),
        low=0.0,
        high=len(rows) - 1.0,
        choices=np.array(choices, dtype=float),
        labels=tuple(labels),
        fixed=table.fixed,
        tolerance=0.0,
        initial=float(matching[0]) if matching else NO_CHOICE,
    )


def _tolerance(table: VariableTable, field: Parameter, name: str) -> float:
    if table.tolerance is None:
        return 0.0
    try:
        tolerance = parse(table.tolerance, field.quantity.kind)  # a tolerance need not be in the range of its field
    except UnitError as error:
        raise InputError(f"{name}.tolerance is {shorten(table.tolerance)}: {error}.") from None
    if not 0.0 <= tolerance < math.inf:
        raise InputError(f"{name}.tolerance is {shorten(table.tolerance)}; it must not be negative.")
    return tolerance


def _bound(written: float | str, quantity: Quantity, name: str) -> float:
    bound = _value(written, quantity, name)
    if math.isinf(bound):
        raise InputError(f"{name} cannot be {shorten(written)}; give a large value, or use choices.")
    return bound


def _value(written: float | str, quantity: Quantity, name: str) -> float:
    try:
        return quantity.number(written)
    except UnitError as error:
        raise InputError(f"{name} is {shorten(written)}: {error}.") from None


@dataclass(frozen=True, eq=False)
class PoseSet(Immutable):
    """The poses at which designs are judged.

    Attributes:
        columns: values by leaf path, SI [poses]; empty for the machine's own pose.
        required: share of the poses that a design must reach.
        box: volume of a grid over coordinates of the pose alone, and the unit of that; None of other poses.
        description: the poses in words.
    """

    columns: Mapping[str, Array]
    required: float
    box: tuple[float, str] | None
    description: str

    @property
    def count(self) -> int:
        """Number of poses; 1 for the machine's own, which has no columns."""
        return len(next(iter(self.columns.values()))) if self.columns else 1


def read_poses(machine: Machine, table: PosesTable) -> PoseSet:
    """Read the poses of a study file.

    Raises:
        InputError: a field is not known, a range or value has a mistake, there are both a list and a grid, or no pose
            of the grid lies in the workspace.
    """
    if table.listed is not None and table.over is not None:
        raise InputError("[poses] has both list and over; give one of them.")
    if (table.within or table.where) and table.over is None:
        raise InputError("[poses]: within and where belong to a grid; add over = [...].")
    if table.where and table.within is None:
        raise InputError('[poses]: where belongs to within = "workspace"; add that.')
    if table.listed:
        columns = _list_columns(machine, table.listed)
        return PoseSet(columns, table.required, None, f"{len(table.listed)} poses of a list")
    if table.over:
        return _grid(machine, table)
    return PoseSet({}, table.required, None, "the machine's own pose")


def _list_columns(machine: Machine, rows: Sequence[Mapping[str, float | str]]) -> dict[str, Array]:
    numbers = values(machine)
    poses = [_row(machine, row, f"poses.list.{i}") for i, row in enumerate(rows)]
    paths = dict.fromkeys(path for pose in poses for path in pose)
    return {path: np.array([pose.get(path, float(numbers[path])) for pose in poses]) for path in paths}


def _row(machine: Machine, row: Mapping[str, float | str], where: str) -> dict[str, float]:
    """A pose of a list by leaf path, SI."""
    values_of_row: dict[str, float] = {}
    for name, field in listed_fields(machine, row, where).items():
        values_of_row |= dict.fromkeys(field.leaves, _value(row[name], field.quantity, f"{where}.{name}"))
    return values_of_row


def _grid(machine: Machine, table: PosesTable) -> PoseSet:
    """The nodes of a grid, or those of them that lie in the workspace of the machine as it is."""
    question = datasets.grid_question(machine, table.over or [], ["singularity_margin"])
    if question.grid.size > MOST_NODES:
        raise InputError(f"[poses] has {question.grid.size:,} nodes; at most {MOST_NODES:,} are allowed.")
    columns = question.grid.columns(0, question.grid.size)
    size = "x".join(str(count) for count in question.grid.shape)
    if table.within is None:
        return PoseSet(columns, table.required, _box(question), f"a grid of {size} poses")
    inside = workspace.workspace(machine, table.over or [], table.where).inside.ravel()
    if not inside.any():
        raise InputError("[poses]: no node of the grid lies in the workspace of the machine; widen over or where.")
    kept = {path: column[inside] for path, column in columns.items()}
    description = f"{int(inside.sum())} poses in the workspace, of a grid of {size}"
    return PoseSet(kept, table.required, None, description)


def _box(question: "datasets.GridQuestion") -> tuple[float, str] | None:
    """Volume of a grid and its unit; None where any axis is not a coordinate of the pose."""
    if not all(field.startswith(POSE) for field in question.fields):
        return None
    spans = [abs(float(axis.values[-1] - axis.values[0])) for axis in question.grid.axes]
    return prod(spans), workspace.unit_product([str(question.labels[dim].attrs["units"]) for dim in question.dims])

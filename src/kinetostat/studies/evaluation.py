"""Quantities of a machine at poses, as arrays: evaluated once, or as a function that programs call again and again.

Both are the function that maps and searches evaluate, without tables, units and labels around it; `datasets` makes
labelled arrays. A call of a `CompiledFunction` on arrays takes ten times as long as one pose itself, because shapes are
compared and memory is found for the results. `Buffers` do all that once.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Codes
from kinetostat.engine.batch import Function, Progress, evaluate, function_of, silent
from kinetostat.engine.kernel import Identical
from kinetostat.engine.machine_code import Program
from kinetostat.engine.points import PointTable
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, Parameter, find, values
from kinetostat.spec.arguments import as_list, checked
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studies.poses import PoseColumns
from kinetostat.studies.quantities import (
    cable_count,
    refuse_absent,
    refuse_without_derivatives,
    resolve_quantities,
    uncounted_loads,
)

if TYPE_CHECKING:
    from kinetostat.engine import derivatives
else:
    derivatives = LateModule("kinetostat.engine.derivatives")

MATRICES = {"K": "stiffness", "C": "compliance"}
"""Beginning of the names of entries, by the name of the matrix."""
NOT_CONVERGED = int(Status.NOT_CONVERGED)
"""Code of a point at which a program has found no joints, and another way may."""
MACHINES_KEPT = 8
"""Machines, by identity, whose facts that do not depend on the poses are kept: as many as a program mostly compares."""


class PoseCount(NamedTuple):
    """Number of poses that have an answer, and of all poses that were asked about."""

    answered: int
    total: int


@dataclass(frozen=True)
class PoseAnswers:
    """Quantities at poses, in their order.

    Attributes:
        machine: gives all fields that the poses do not name.
        poses: the poses.
        names: names of the quantities that were requested, without the matrices.
        matrices: "K", "C", both or none.
        values: values by quantity, with the entries of the matrices [poses]; NaN where the status is not OK.
        status: `Status` codes [poses].
        loads_left_out: a sentence on the loads of the file that do not count; empty if all do.
    """

    machine: Machine
    poses: PoseColumns
    names: tuple[str, ...]
    matrices: tuple[str, ...]
    values: Mapping[str, Array]
    status: Codes
    loads_left_out: str = ""

    @property
    def answered(self) -> bool:
        """Whether any pose has a result."""
        return bool((self.status == Status.OK).any())

    @property
    def failures(self) -> dict[Status, list[int]]:
        """The numbers of the poses, from 0, that have each status other than OK."""
        return {s: np.flatnonzero(self.status == s).tolist() for s in Status if s and (self.status == s).any()}

    def matrix(self, name: str) -> Array:
        """K or C at every pose [poses x n x n]; n is 6, or 3 of a planar machine."""
        parts = self.machine.family.component_names
        rows = [[self.values[entry_name(name, row, column)] for column in parts] for row in parts]
        return np.moveaxis(np.array(rows), 2, 0)


def entry_name(matrix: str, row: str, column: str) -> str:
    """Return the name of the quantity that is one entry of a matrix: for "K", "x" and "rz", "stiffness_rz_x"."""
    first, last = sorted((row, column), key=COMPONENTS.index)
    return "_".join([MATRICES[matrix], *dict.fromkeys((first, last))])


def answers_at(
    machine: Machine, poses: PoseColumns, quantities: Sequence[str], progress: Progress = silent
) -> PoseAnswers:
    """Evaluate quantities at poses; see `evaluate`.

    Args:
        machine: gives all fields that the poses do not name.
        poses: the poses.
        quantities: names of quantities, groups, or "K" and "C".
        progress: receives how far the work is.

    Raises:
        InputError: an unknown quantity, or one that the machine cannot have.
    """
    wanted, parts = as_list(quantities), machine.family.component_names
    matrices = tuple(dict.fromkeys(name for name in wanted if name in MATRICES))
    state, cables = _state_and_cables(Identical(machine))
    names = tuple(resolve_quantities([name for name in wanted if name not in MATRICES], parts, cables))
    refuse_absent(state, names, poses.fields)
    entries = [entry_name(matrix, row, column) for matrix in matrices for row in parts for column in parts]
    computed = evaluate(machine, PointTable(poses.leaves), tuple(dict.fromkeys([*names, *entries])), progress)
    uncounted = uncounted_loads(state, computed.values, zip(poses.fields, poses.values, strict=True))
    return PoseAnswers(
        machine=machine,
        poses=poses,
        names=names,
        matrices=matrices,
        values=computed.values,
        status=computed.status,
        loads_left_out=uncounted,
    )


def point_of_file(machine: Machine) -> PointTable:
    """The pose of a machine's file as a table of one point, which must have a column: its first coordinate."""
    path, value = next((path, value) for path, value in values(machine).items() if path.startswith(POSE))
    return PointTable({path: np.array([float(value)])})


@lru_cache(MACHINES_KEPT)
def _state_and_cables(machine: Identical) -> tuple[MachineState, int]:
    """The state of a machine at its pose, kept with everything that it has computed, and the number of cables."""
    return state_of(machine.value), cable_count(machine.value)


class Buffers:
    """Inputs of a function at a number of points, its results there, and the call that computes these from those.

    Each thread needs buffers of its own.

    Attributes:
        inputs: values of the inputs, SI [inputs x points]; write them in place.
        results: numbers of the function [rows x points], as of the last call.
        status: `Status` codes [points], as of the last call.
    """

    def __init__(self, function: Function, places: Sequence[int], start: Sequence[float], count: int) -> None:
        """Prepare memory.

        Args:
            function: the function.
            places: for each parameter of the function, the row of `inputs` that has its values.
            start: values of the inputs to begin with.
            count: number of points.
        """
        direct, self._function, self._count = function.direct, function, count
        program = direct.program if direct and isinstance(direct.program, Program) else None
        # A program fills all lanes of a vector register: memory has room for one register at least, and points beyond
        # the count keep the inputs to begin with.
        room = max(count, program.lanes) if program else count
        inputs = np.repeat(np.asarray(start, dtype=float)[:, None], room, axis=1)
        results = np.empty((function.rows, room))
        self._codes = bytearray(room)
        codes = np.frombuffer(self._codes, dtype=np.int8)
        self.inputs, self.results, self.status = inputs[:, :count], results[:, :count], codes[:count]
        rows = dict(zip(function.paths, places, strict=True))
        self._columns = {path: self.inputs[row] for path, row in rows.items()}
        self._angles: list[Array] = []
        self._run = None
        if direct and program:
            # Neighbouring rows are one view, so that a call compares all of them by one product.
            rows_of_angles = sorted({rows[path] for path in direct.form.turning})
            self._angles = [inputs[first:end].reshape(-1) for first, end in _runs(rows_of_angles)]
            varying = [inputs[rows[path]] for path in direct.form.varying]
            self._run = program.call_on(direct.fixed, varying, results, codes)

    def __call__(self) -> Array:
        """Evaluate the function at `inputs`; gives `results`, the same array at every call."""
        if self._run is None:
            self._evaluate()
            return self.results
        for angles in self._angles:
            # No angle exceeds the root of the sum of squares; where this is larger, or NaN, one angle may be too large
            # for traced cosines.
            if not angles.dot(angles) <= LARGEST_ANGLE**2:
                self._evaluate()
                return self.results
        self._run()
        if self._codes.find(NOT_CONVERGED, 0, self._count) >= 0:
            self._evaluate()
        return self.results

    def _evaluate(self) -> None:
        """Evaluate by the function's own fill, which knows other ways where the program ends without joints."""
        self._function.fill(self._columns, self.results, self.status)


def _runs(numbers: Sequence[int]) -> list[tuple[int, int]]:
    """Begin and end of each run of consecutive numbers."""
    beginnings = [k for k in numbers if k - 1 not in numbers]
    return list(zip(beginnings, [k + 1 for k in numbers if k + 1 not in numbers], strict=True))


@checked
def compile(  # noqa: A001 - `kinetostat.compile` is what users write
    machine: Machine, inputs: Sequence[str], quantities: str | Sequence[str], judged: bool = True
) -> "CompiledFunction":
    """Compile quantities of a machine as a function of some of its fields.

    Args:
        machine: gives all fields that are not inputs.
        inputs: names of the fields that vary, in the order in which the function takes them. A field with several
            entries gives all of them the same value.
        quantities: a name of a quantity; a list of names and groups; or "K" or "C" for a whole matrix.
        judged: whether the function knows the status of a pose. If False, values alone are computed, without reach,
            singularity margin and limits; they mean nothing where the machine has no answer. Values at rest under
            loads and of vibrations are judged in any case.

    Returns:
        The function.

    Raises:
        InputError: an unknown field, or the same one twice; an unknown quantity, or one that the machine cannot have.
    """
    return CompiledFunction(machine, tuple(as_list(inputs)), quantities, judged)


class CompiledFunction:
    """Quantities of a machine as a function of some of its fields, in machine code.

    Called with an array for each input, in SI and of any shapes that broadcast, it returns an array of the shape that
    they have together: for a list of quantities with an axis in front that counts them, for K and C with two. Values
    are NaN where the machine has no answer; `status` says why. Inputs are not compared with what a machine file allows.

    Threads may share a function, and it can be pickled: the other process compiles it, or takes it from the cache.

    Attributes:
        machine: gives all fields that are not inputs.
        inputs: paths of the inputs.
        quantities: names of the quantities; of a matrix its entries, row by row.
        distinct: the same names, each once.
        shape: lengths of the axes in front: () of one quantity, (n,) of a list, (6, 6) or (3, 3) of a matrix.
        judged: whether the function knows the status of a pose.
    """

    def __init__(
        self, machine: Machine, inputs: Sequence[str], quantities: str | Sequence[str], judged: bool = True
    ) -> None:
        """Compile. Arguments and errors are those of `compile`."""
        requested = quantities if isinstance(quantities, str) else tuple(quantities)
        self._arguments = machine, tuple(inputs), requested, judged
        self.judged = judged
        self._fields = _without_repetition([find(machine.family, name) for name in inputs])
        self.machine, self.inputs = machine, tuple(field.path for field in self._fields)
        self.quantities, self.shape = _named_quantities(machine, quantities)
        refuse_absent(state_of(machine), self.quantities, self._fields)
        self.distinct = tuple(dict.fromkeys(self.quantities))  # a symmetric matrix has most of its entries twice
        self._rows = [self.distinct.index(name) for name in self.quantities]
        self._leaves = {leaf: row for row, field in enumerate(self._fields) for leaf in field.leaves}
        self._numbers = values(machine)
        self._function: Function = function_of(machine, tuple(self._leaves), self.distinct, judged=judged)

    def __reduce__(self) -> tuple[Any, ...]:
        return CompiledFunction, self._arguments

    def __repr__(self) -> str:
        return f"<{', '.join(self.quantities)} of {self.machine.name!r} by {', '.join(self.inputs)}>"

    def __call__(self, *arrays: Scalar) -> Array:
        """Evaluate the quantities.

        Args:
            arrays: a number or an array for each input, SI, of shapes that broadcast.

        Returns:
            [shape of the quantities x shape of the inputs].
        """
        points, shape = self._points(arrays)
        results, _ = self._function.at(points)
        return self._arrange(results[self._rows], shape)

    def status(self, *arrays: Scalar) -> Codes:
        """Return the codes of `Status` where the function has been given the same arrays; 0 where there are values.

        Raises:
            InputError: the function gives values alone.
        """
        if not self.judged:
            raise InputError("judged is False, so that this function knows no status; compile it with judged=True.")
        points, shape = self._points(arrays)
        return self._function.at(points)[1].reshape(shape)[()]

    def jacobian(self, *arrays: Scalar) -> Array:
        """Return the derivatives of the quantities by each input, exact to round-off; the first call compiles them.

        Args:
            arrays: as for a call of the function.

        Returns:
            [shape of the quantities x inputs x shape of the inputs]; of a single quantity this is its gradient.

        Raises:
            InputError: a quantity has no derivatives that are known.
        """
        return self.value_and_jacobian(*arrays)[1]

    def value_and_jacobian(self, *arrays: Scalar) -> tuple[Array, Array]:
        """Return what a call returns and what `jacobian` returns, for little more than one of them.

        Args:
            arrays: as for a call of the function.

        Raises:
            InputError: a quantity has no derivatives that are known.
        """
        points, shape = self._points(arrays)
        answer = self._gradients(points)
        rates = np.zeros((len(self.distinct), len(self._fields), points.size))
        for k, row in enumerate(self._leaves.values()):
            rates[:, row] += answer.gradients[:, k]
        jacobian = self._arrange(rates[self._rows], (len(self._fields), *shape))
        return self._arrange(answer.values[self._rows], shape), jacobian

    def buffers(self, count: int = 1) -> Buffers:
        """Prepare arrays for so many poses; see `Buffers`. It begins at the numbers of the machine.

        The rows of its results are `distinct`: the quantities, of a matrix each different entry once.

        Raises:
            InputError: the number is not one from 1 on.
        """
        if type(count) is not int or count < 1:
            raise InputError(f"count is {shorten(count)}; give a whole number from 1.")
        start = [float(self._numbers[field.leaves[0]]) for field in self._fields]
        return Buffers(self._function, list(self._leaves.values()), start, count)

    @cached_property
    def _gradients(self) -> "Callable[[PointTable], derivatives.Gradients]":
        """The function with its derivatives by each leaf; refused where they are not known."""
        names, leaves = list(self.distinct), tuple(self._leaves)
        refuse_without_derivatives(self.machine, names, leaves)
        return lambda points: derivatives.evaluate_gradient(self.machine, points, names, leaves, repeated=True)

    def _points(self, arrays: Sequence[Scalar]) -> tuple[PointTable, tuple[int, ...]]:
        """The points of some inputs in a row, and their shape."""
        if len(arrays) != len(self._fields):
            raise InputError(
                f"the function has been given {len(arrays)} arrays; give {len(self._fields)}, one for each of "
                f"{', '.join(self.inputs)}."
            )
        try:
            columns = np.broadcast_arrays(*(np.asarray(array, dtype=float) for array in arrays))
        except (TypeError, ValueError) as error:
            raise InputError(f"the inputs of the function are not arrays of numbers that fit: {error}.") from None
        rows = [column.reshape(-1) for column in columns]
        return PointTable({leaf: rows[row] for leaf, row in self._leaves.items()}), columns[0].shape

    def _arrange(self, rows: Array, shape: tuple[int, ...]) -> Array:
        """Results [rows x ...] as they are returned."""
        return rows.reshape((*self.shape, *shape))[()]


def _without_repetition(fields: list[Parameter]) -> list[Parameter]:
    """The fields, none of which another contains."""
    if not fields:
        raise InputError("inputs names no field; name those that vary, e.g. x.")
    leaves = [leaf for field in fields for leaf in field.leaves]
    for leaf in leaves:
        if leaves.count(leaf) > 1:
            raise InputError(f"{leaf} is an input twice; name it once.")
    return fields


def _named_quantities(machine: Machine, requested: str | Sequence[str]) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """The names of what is asked for, and the shape of the axes that count them."""
    parts = machine.family.component_names
    if isinstance(requested, str) and requested in MATRICES:
        return tuple(entry_name(requested, row, column) for row in parts for column in parts), (len(parts), len(parts))
    names = [requested] if isinstance(requested, str) else as_list(requested)
    if any(name in MATRICES for name in names):
        raise InputError('quantities has a matrix among others; compile it alone, e.g. quantities="K".')
    resolved = tuple(resolve_quantities(names, parts, cable_count(machine)))
    return resolved, () if isinstance(requested, str) and len(resolved) == 1 else (len(resolved),)

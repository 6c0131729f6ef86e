"""Many designs at many poses each, again and again: programs are compiled once and kept. Holds no formula."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kinetostat.engine.batch import NATIVE_SLAB, Codes, Fill, by_free_springs, in_slabs
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.form import Kind, angles, form_of, reduced
from kinetostat.engine.gradient import with_gradients
from kinetostat.engine.kernel import slab_kernel
from kinetostat.engine.native import Program
from kinetostat.engine.points import Array
from kinetostat.engine.questions import objectives_of
from kinetostat.engine.threads import available_cores
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters


@dataclass(frozen=True)
class Population:
    """Every design at every pose; poses run fastest.

    Attributes:
        designs: values by leaf path, SI [designs]; at least one.
        poses: values by other leaf paths, SI [poses]; none for the machine's own pose.
    """

    designs: Mapping[str, Array]
    poses: Mapping[str, Array]

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Designs and poses."""
        return len(next(iter(self.designs.values()))), len(next(iter(self.poses.values()), (0.0,)))

    @property
    def size(self) -> int:
        """How many points."""
        return self.shape[0] * self.shape[1]

    @property
    def paths(self) -> tuple[str, ...]:
        """Leaf paths of the parameters that vary."""
        return *self.designs, *self.poses

    def columns(self, start: int, stop: int) -> dict[str, Array]:
        """Values of each varying parameter at points `start` to `stop` - 1, SI."""
        design, pose = np.divmod(np.arange(start, stop), self.shape[1])
        return {path: held[design] for path, held in self.designs.items()} | {
            path: held[pose] for path, held in self.poses.items()
        }


@dataclass(frozen=True)
class Answers:
    """Quantities of every design at every pose.

    Attributes:
        values: by name [designs x poses]; NaN where the status is not OK.
        status: `Status` codes [designs x poses].
        slopes: derivatives of each quantity in turn by each path [quantities x paths x designs x poses]; only of a
            `Differentiator`.
    """

    values: dict[str, Array]
    status: Codes
    slopes: Array | None = None


class Evaluator:
    """Quantities of whole populations of a machine's designs, always in machine code."""

    def __init__(self, machine: Machine, paths: Sequence[str], quantities: Sequence[str]) -> None:
        """Compile.

        Args:
            machine: gives all parameters that do not vary.
            paths: leaf paths of those that do: of designs, then of poses.
            quantities: names from `kinetostatics.quantities.QUANTITIES`.
        """
        self._names = tuple(quantities)
        self._fill = by_free_springs(machine, paths, self._names, lambda *form: slab_kernel(*form).run)

    def __call__(self, population: Population) -> Answers:
        """Evaluate a population; its size alone decides how it is cut, so that equal ones give equal bits."""
        results, status = _run(population, self._fill, len(self._names))
        values = {name: row.reshape(population.shape) for name, row in zip(self._names, results, strict=True)}
        return Answers(values, status.reshape(population.shape))


class Differentiator:
    """Quantities of a few designs and their exact derivatives by parameters of the design."""

    def __init__(self, machine: Machine, paths: Sequence[str], quantities: Sequence[str], by: Sequence[str]) -> None:
        """Compile, unless the joints of the machine are found by iteration.

        Args:
            machine, paths, quantities: as for `Evaluator`.
            by: leaf paths of what to differentiate by, among `paths`.
        """
        self._machine, self._names, self._by = machine, tuple(quantities), tuple(by)
        self._stiff = [p.path for p in parameters(machine.family) if p.quantity.stiff and p.path in paths]
        self._fill = _differentiated(machine, paths, self._names, self._by) if machine.family.chains is None else None

    def __call__(self, population: Population) -> Answers:
        """Evaluate a population."""
        count, by = len(self._names), len(self._by)
        if self._fill is None or any((population.designs[path] == 0.0).any() for path in self._stiff):
            found = evaluate_gradient(self._machine, population, self._names, self._by)
            results, slopes, status = found.values, found.gradients, found.status
        else:
            rows, status = _run(population, self._fill, count * (1 + by))
            results, slopes = rows[:count], rows[count:]
        values = {name: row.reshape(population.shape) for name, row in zip(self._names, results, strict=True)}
        return Answers(values, status.reshape(population.shape), slopes.reshape(count, by, *population.shape))


def _differentiated(machine: Machine, paths: Sequence[str], quantities: Sequence[str], by: Sequence[str]) -> Fill:
    form, fixed = form_of(machine, paths)
    asked = objectives_of(Kind(machine), form, [((name, 1.0),) for name in quantities], by)
    program, turning = Program(with_gradients(asked.body, asked.inputs)), angles(machine)

    def fill(columns: Mapping[str, Array], results: Array, status: Codes) -> None:
        served = {path: np.ascontiguousarray(columns[path], dtype=float) for path in form.varying}
        given = [reduced(column) if path in turning else column for path, column in served.items()]
        program.run(fixed, given, results, status)

    return fill


def _run(population: Population, fill: Fill, rows: int) -> tuple[Array, Codes]:
    threads = available_cores() if population.size > NATIVE_SLAB else 1
    return in_slabs(population, fill, rows, NATIVE_SLAB, threads)

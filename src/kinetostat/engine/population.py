"""Many designs at many poses each, evaluated repeatedly by programs compiled once. Holds no formula."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from kinetostat.arrays import Array, Codes
from kinetostat.engine.batch import NATIVE_SLAB, Method, available_cores, by_free_springs, in_slabs, program_fill
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.loaded import loaded_fill, way_of
from kinetostat.kinetostatics.quantities import needs_state
from kinetostat.machine.machine import Machine


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
        return {path: column[design] for path, column in self.designs.items()} | {
            path: column[pose] for path, column in self.poses.items()
        }


@dataclass(frozen=True)
class Answers:
    """Quantities of every design at every pose.

    Attributes:
        values: by name [designs x poses]; NaN where the status is not OK.
        status: `Status` codes [designs x poses].
        slopes: derivatives of each quantity in turn by each path [quantities x paths x designs x poses]; only of a
            `differentiate`.
    """

    values: dict[str, Array]
    status: Codes
    slopes: Array | None = None


class Evaluator:
    """Evaluates quantities of whole populations of a machine's designs, always in machine code."""

    def __init__(self, machine: Machine, paths: Sequence[str], quantities: Sequence[str]) -> None:
        """Compile.

        Args:
            machine: gives all parameters that do not vary.
            paths: leaf paths of those that do: of designs, then of poses.
            quantities: names from `kinetostatics.quantities.QUANTITIES`.
        """
        self._names, self._slab = tuple(quantities), NATIVE_SLAB
        method: Method = program_fill
        if needs_state(machine, self._names):
            way = way_of(machine, paths, self._names, NATIVE_SLAB, repeated=True)
            self._slab, method = way.slab, partial(loaded_fill, way=way)
        self._fill = by_free_springs(machine, paths, self._names, method)

    def __call__(self, population: Population) -> Answers:
        """Evaluate a population; its size alone decides how it is cut, so that equal ones give equal bits."""
        threads = available_cores() if population.size > self._slab else 1
        results, status = in_slabs(population, self._fill, len(self._names), self._slab, threads)
        return _answers(population, self._names, results, status)


def differentiate(machine: Machine, population: Population, quantities: Sequence[str], by: Sequence[str]) -> Answers:
    """Compute quantities of a few designs and their exact derivatives by parameters of the design.

    Programs are compiled at the first call.

    Args:
        machine: gives all parameters that do not vary.
        population: designs and poses.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
        by: leaf paths of what to differentiate by.
    """
    sloped = evaluate_gradient(machine, population, quantities, by, repeated=True)
    slopes = sloped.gradients.reshape(len(quantities), len(by), *population.shape)
    return _answers(population, quantities, sloped.values, sloped.status, slopes)


def _answers(
    population: Population, names: Sequence[str], results: Array, status: Codes, slopes: Array | None = None
) -> Answers:
    values = {name: row.reshape(population.shape) for name, row in zip(names, results, strict=True)}
    return Answers(values, status.reshape(population.shape), slopes)

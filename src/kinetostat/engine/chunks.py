"""A batch in chunks: runs of points that are computed, written and resumed one by one. Knows no file.

Chunks start where slabs do, so that a batch in chunks, whatever their size and wherever they run, gives the bits of the
batch as a whole.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from kinetostat.engine.batch import NATIVE_SLAB, Evaluation, evaluate
from kinetostat.engine.points import Points
from kinetostat.machine.machine import Machine

CHUNK_NUMBERS = 1 << 20
"""Results of one chunk, 8 MB: a tenth of a second of work at least, and little to lose or to hold."""


@dataclass(frozen=True)
class Work:
    """What is to be computed, in chunks.

    Attributes:
        machine: gives all parameters that do not vary.
        points: where.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
        chunk: points of one chunk, a multiple of a slab.
    """

    machine: Machine
    points: Points
    quantities: tuple[str, ...]
    chunk: int

    @property
    def count(self) -> int:
        """How many chunks."""
        return -(-self.points.size // self.chunk)

    def part(self, number: int) -> range:
        """The points of a chunk; chunks are numbered from 0."""
        return range(number * self.chunk, min((number + 1) * self.chunk, self.points.size))

    def compute(self, number: int, threads: int | None = None) -> Evaluation:
        """Evaluate one chunk, on all processors unless the number of threads is given."""
        part = self.part(number)
        return evaluate(self.machine, self.points, self.quantities, part=part, threads=threads)


Compute = Callable[[Work, Sequence[int]], Iterator[tuple[int, Evaluation]]]
"""Computes some chunks: yields (number, results), each once, in any order."""


def in_chunks(machine: Machine, points: Points, quantities: Sequence[str]) -> Work:
    """A batch cut into chunks of a suitable size."""
    slabs = max(1, CHUNK_NUMBERS // (NATIVE_SLAB * max(1, len(quantities))))
    return Work(machine, points, tuple(quantities), slabs * NATIVE_SLAB)


def here(work: Work, numbers: Sequence[int]) -> Iterator[tuple[int, Evaluation]]:
    """Compute chunks one after the other in this process, each on all processors."""
    for number in numbers:
        yield number, work.compute(number)

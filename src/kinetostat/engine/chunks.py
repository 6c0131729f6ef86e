"""A batch in chunks, computed one by one in this process, in workers or on a Dask cluster. Knows no file.

Chunks start where slabs do, so that a batch in chunks gives the bits of the batch as a whole, whatever their size and
wherever they run. Workers get the machine as text and the points as numbers, chunk by chunk, and send results back: one
that dies loses only the chunk in hand, which Dask gives to another.
"""

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from importlib.metadata import version
from itertools import islice
from typing import Any

from kinetostat.engine.batch import NATIVE_SLAB, Evaluation, evaluate
from kinetostat.engine.points import Points
from kinetostat.frozen import dataclass
from kinetostat.late import show_array_libraries
from kinetostat.machine.loading import as_toml, build
from kinetostat.machine.machine import Machine
from kinetostat.spec.document import parse
from kinetostat.spec.errors import InputError
from kinetostat.spec.installation import extra_command

CHUNK_NUMBERS = 1 << 20
"""Results of one chunk, 8 MB: at least a tenth of a second of work, and little to lose or to keep in memory."""


@dataclass(frozen=True)
class Work:
    """A batch to be computed in chunks.

    Attributes:
        machine: gives all parameters that do not vary.
        points: the points at which it is evaluated.
        quantities: names from `kinetostatics.quantities.QUANTITIES`.
        chunk: points of one chunk, a multiple of a slab.
    """

    machine: Machine
    points: Points
    quantities: tuple[str, ...]
    chunk: int

    @property
    def count(self) -> int:
        """Number of chunks."""
        return -(-self.points.size // self.chunk)

    def part(self, number: int) -> range:
        """Return the points of a chunk; chunks are numbered from 0."""
        return range(number * self.chunk, min((number + 1) * self.chunk, self.points.size))

    def compute(self, number: int, threads: int | None = None) -> Evaluation:
        """Evaluate one chunk, on all processors unless the number of threads is given."""
        part = self.part(number)
        return evaluate(self.machine, self.points, self.quantities, part=part, threads=threads)


Compute = Callable[[Work, Sequence[int]], Iterator[tuple[int, Evaluation]]]
"""Computes some chunks: gives (number, results), each once, in any order."""


def in_chunks(machine: Machine, points: Points, quantities: Sequence[str]) -> Work:
    """Cut a batch into chunks of a suitable size."""
    slabs = max(1, CHUNK_NUMBERS // (NATIVE_SLAB * max(1, len(quantities))))
    return Work(machine, points, tuple(quantities), slabs * NATIVE_SLAB)


def in_this_process(work: Work, numbers: Sequence[int]) -> Iterator[tuple[int, Evaluation]]:
    """Compute chunks one after the other in this process, each on all processors."""
    for number in numbers:
        yield number, work.compute(number)


DASK_MISSING = "--workers and --cluster need Dask, which is not installed; install it with `{}`."
"""Refusal without Dask, with the command that installs it."""
CHUNKS_AHEAD = 2
"""Chunks handed out per thread of the cluster: one that is computed and one that waits, so that no thread stands
idle."""
GO_ON = "Results that are already in a folder are kept: the same command continues from there."
"""Advice after a cluster has failed."""
CLUSTER_PATIENCE = "10 s"
"""Time in which a cluster must answer: far more than a network takes, and about as long as people wait."""


@dataclass(frozen=True)
class Crew:
    """The processes that compute: workers on this machine, a cluster, or neither.

    Attributes:
        workers: number of processes on this machine.
        address: address of the scheduler of an existing cluster, e.g. "tcp://10.0.0.1:8786".
    """

    workers: int | None = None
    address: str | None = None


@contextmanager
def compute_with(crew: Crew) -> Iterator[Compute]:
    """Give a way to compute chunks with a crew, or in this process where the crew is empty.

    Raises:
        InputError: Dask is not installed, the cluster does not answer, or its workers run another kinetostat.
    """
    if crew.workers is None and crew.address is None:
        yield in_this_process
        return
    show_array_libraries("dask")
    try:
        import distributed
    except ModuleNotFoundError:
        raise InputError(DASK_MISSING.format(extra_command("cluster"))) from None
    with _client(distributed, crew) as client:
        _check_versions(client)

        def compute(work: Work, numbers: Sequence[int]) -> Iterator[tuple[int, Evaluation]]:
            return _on_cluster(distributed, client, work, numbers)

        yield compute


@contextmanager
def _client(distributed: Any, crew: Crew) -> Iterator[Any]:
    """A connection to the cluster of a crew; workers that were started for it end with it."""
    if crew.address is not None:
        try:
            client = distributed.Client(crew.address, timeout=CLUSTER_PATIENCE)
        except (OSError, TypeError, ValueError) as error:
            raise InputError(f'no Dask scheduler answers at "{crew.address}" ({error}); check --cluster.') from None
        with client:
            yield client
        return
    with ExitStack() as started:
        with _interrupted_later():
            cluster = distributed.LocalCluster(
                n_workers=crew.workers,
                threads_per_worker=1,
                memory_limit=0,
                dashboard_address="127.0.0.1:0",
                silence_logs="CRITICAL",
                preload=__name__,
            )
            client = started.enter_context(distributed.Client(started.enter_context(cluster)))
        yield client


@contextmanager
def _interrupted_later() -> Iterator[None]:
    """Keep Ctrl-C waiting, because Dask cannot end workers half started; processes that start here never hear of it."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    waiting: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: waiting.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which processes inherit
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)
    if waiting:
        raise KeyboardInterrupt


def dask_setup(_worker: Any) -> None:
    """Called by Dask when a worker on this machine starts: Ctrl-C is for the process that gives the orders."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _check_versions(client: Any) -> None:
    """Check that all workers run this kinetostat, so that results are the same wherever they come from."""
    ours = version("kinetostat")
    try:
        versions = client.run(_version_here)
    except ImportError as error:
        raise InputError(f"a worker of the cluster lacks kinetostat {ours} ({error}); install it there.") from None
    for worker, theirs in versions.items():
        if theirs != ours:
            raise InputError(
                f"worker {worker} runs kinetostat {theirs}, but this computer runs {ours}; install the same version "
                "on both."
            )


def _version_here() -> str:
    return version("kinetostat")


def _on_cluster(distributed: Any, client: Any, work: Work, numbers: Sequence[int]) -> Iterator[tuple[int, Evaluation]]:
    """Compute chunks on a cluster, a few for each of its threads at a time; results as they come."""
    text = as_toml(work.machine)
    waiting = iter(numbers)

    def hand_out(count: int) -> list[Any]:
        chosen = islice(waiting, count)
        return [
            client.submit(_on_worker, text, work.points, work.quantities, work.chunk, n, pure=False) for n in chosen
        ]

    try:
        finished = distributed.as_completed(hand_out(_places(client)))
        for future in finished:
            number, evaluation = future.result()
            future.release()
            finished.update(hand_out(max(1, _places(client) - finished.count())))
            yield number, evaluation
    except distributed.KilledWorker:
        raise InputError("several workers stopped at the same chunk; their logs say why. " + GO_ON) from None
    except (distributed.CancelledError, OSError):
        raise InputError("the connection to the cluster was lost. " + GO_ON) from None


def _places(client: Any) -> int:
    """Return the number of chunks that the cluster should hold; workers come and go."""
    return CHUNKS_AHEAD * max(1, sum(client.nthreads().values()))


def _on_worker(
    text: str, points: Points, quantities: tuple[str, ...], chunk: int, number: int
) -> tuple[int, Evaluation]:
    """On a worker: one chunk, on one thread, because a worker takes as many chunks as it has threads."""
    return number, Work(_machine(text), points, quantities, chunk).compute(number, threads=1)


@lru_cache(8)
def _machine(text: str) -> Machine:
    """Return the machine of a file's text, made once for each process, so that its programs are compiled once."""
    return build(parse(text, "the machine sent to this worker"), "the machine sent to this worker")

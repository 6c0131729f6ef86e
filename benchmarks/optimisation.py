"""How well and how fast the optimisers do: the paper's study with ten seeds, two unrelated methods, random designs.

Run with `python benchmarks/optimisation.py [MILLIONS]`: so many million random designs (default 10).
"""

import sys
import time
from collections.abc import Iterator

import numpy as np

from kinetostat.studies.optimisation.assessment import Assessor
from kinetostat.studies.optimisation.log import Log
from kinetostat.studies.optimisation.problem import load_problem
from kinetostat.studies.optimisation.search import search

PAPER, REGION = "zhang-gosselin-2002", "zhang-gosselin-region"
RIGID = 'set.stiffness.passive_links="rigid"'
PRINTED = 1.017897
BATCH = 1_000_000


def timed(name: str, *settings: str) -> tuple[Log, float, float]:
    """A search, its process time and its time on the clock, s, compilation included."""
    clock, work = time.perf_counter(), time.process_time()
    log = search(Assessor(load_problem(name, settings)))
    return log, time.process_time() - work, time.perf_counter() - clock


def best(log: Log) -> float:
    """The objective of the best design."""
    return float(log.outcome(log.survivors[:1]).objectives[0, 0])


def rows() -> Iterator[tuple[str, str]]:
    """What was measured, line by line."""
    load_problem(PAPER)
    found = [timed(PAPER, f"optimizer.seed={seed}") for seed in range(1, 11)]
    sums, works = [best(log) for log, _, _ in found], [work for _, work, _ in found]
    yield "paper's study, 80 x 100, seeds 1 to 10: worst sum", f"{max(sums):.10f} (printed {PRINTED})"
    yield "... process time of one run, slowest", f"{max(works):.2f} s"
    for method in ("hybrid", "gradient"):
        log, work, _ = timed(PAPER, f"optimizer.method={method}", RIGID)
        yield f"... {method}, rigid passive leg", f"{best(log):.10f}, {log.count:,} designs, {work:.1f} s"
    least = best(timed(PAPER, "optimizer.method=gradient", RIGID)[0])
    yield "least sum of random designs, above the minimum by", least_random(least)
    for method in ("genetic", "hybrid"):
        log, work, clock = timed(REGION, f"optimizer.method={method}")
        points = log.count * log.problem.poses.count
        yield (
            f"worst of 441 poses, {method}",
            f"{best(log):.8f}, {points / 1e6:.1f} million points, {clock:.1f} s ({work:.1f} s of process time)",
        )


def least_random(least: float) -> str:
    """How near the best of many random designs comes to the minimum."""
    millions = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    assess, source = Assessor(load_problem(PAPER, [RIGID])), np.random.default_rng(0)
    clock, found = time.perf_counter(), np.inf
    for _ in range(millions):
        found = min(found, float(assess(source.random((BATCH, 7))).objectives.min()))
    return f"{found / least - 1.0:.2e} ({millions} million designs in {time.perf_counter() - clock:.1f} s)"


if __name__ == "__main__":
    for name, value in rows():
        print(f"{name:58s} {value}", flush=True)

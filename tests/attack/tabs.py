"""Fifty tabs that move the machine twice a second, and one that sends hostile files: nobody else may notice it.

The tabs are network clients that speak the browser's protocol (`benchmarks/studio_tabs.py`).
"""

import asyncio
import statistics
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

import httpx

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from studio_tabs import CROWDED, GROWTH, Tab, resident, served

EVERY = 0.5
"""Seconds between two moves of a tab."""
HOSTILE = (b"a = [" + b"[" * 400_000, b"a." * 200_000 + b"a = 1", b"\xff" * 500_000, b"x = 1\n" * 100_000)
"""Files whose reading costs what it may: deep, long, no text, many."""
AT_ONCE = 20
"""Hostile files on their way at a time."""
SLOWER = 2.0
"""Factor by which the median of the others' moves may be longer during the hostile files."""
PATIENCE = 60.0
"""Seconds after which a move counts as lost."""


async def moving(tab: Tab, until: float, waits: list[tuple[float, float]]) -> None:
    """Move a slider twice a second, each time a little later than the answer; note when, and how long the map took."""
    draw = Random(tab.client)
    await asyncio.sleep(EVERY * draw.random())
    while (start := time.monotonic()) < until:
        tab.arrived.clear()
        await tab.slide(draw.randint(430, 570))
        try:
            await asyncio.wait_for(tab.arrived.wait(), PATIENCE)
        except TimeoutError:
            tab.problems.append("a move without an answer")
            return
        waits.append((start, time.monotonic() - start))
        await asyncio.sleep(max(0.0, EVERY - (time.monotonic() - start)))


async def sent_to(address: str, seconds: float) -> int:
    """Send hostile files to an address for a time, as fast as it takes them; return how many it took."""
    sent, until = 0, time.monotonic() + seconds

    async def sending(http: httpx.AsyncClient, number: int) -> None:
        nonlocal sent
        while time.monotonic() < until:
            number += 1
            await http.post(address, files={"file": (f"{number}.toml", HOSTILE[number % len(HOSTILE)])})
            sent += 1

    async with httpx.AsyncClient(timeout=PATIENCE) as http:
        work = asyncio.gather(*(sending(http, n) for n in range(AT_ONCE)), return_exceptions=True)
        await asyncio.wait([work], timeout=seconds)
    return sent


async def hostile(address: str, tab: Tab, seconds: float) -> int:
    """Let another process send hostile files for a tab; return how many the studio took."""
    field = next(props["url"] for element in tab.elements.values() if "url" in (props := element.get("props", {})))
    words = [sys.executable, __file__, f"{address}{field}", str(seconds)]
    process = await asyncio.create_subprocess_exec(*words, stdout=asyncio.subprocess.PIPE)
    answer, _ = await process.communicate()
    return int(answer)


async def crowd(address: str, process: int, count: int, seconds: float) -> Iterator[str]:
    """Move all tabs for a time, hostile files in the middle third of it; print the figures, return the findings."""
    enemy, *tabs = (Tab(address) for _ in range(count + 1))
    for tab in (enemy, *tabs):
        await tab.open()
    begin = time.monotonic()
    waits: list[tuple[float, float]] = []
    work = [asyncio.create_task(moving(tab, begin + seconds, waits)) for tab in tabs]
    await asyncio.sleep(seconds / 3)
    memory = resident(process)
    sent = await hostile(address, enemy, seconds / 3)
    await asyncio.gather(*work)
    thirds = [[w for start, w in waits if k <= 3 * (start - begin) / seconds < k + 1] for k in range(3)]
    medians = [statistics.median(third) if third else float("inf") for third in thirds]
    last = resident(process)
    times = ", ".join(f"{1e3 * median:.0f}" for median in medians)
    print(f"{count} tabs, {seconds:.0f} s: {len(waits)} moves, {sent} hostile files")
    print(f"median of a move before, during and after the hostile files: {times} ms")
    print(f"memory: {memory:.0f} MiB after a third, {last:.0f} MiB at the end")
    findings = [f"{tab.client}: {problem}" for tab in tabs for problem in tab.problems]
    findings += [f"{tab.client}: lost" for tab in tabs if not tab.channel.connected]
    if medians[1] > SLOWER * medians[0]:
        findings.append(f"hostile files make the moves of others {medians[1] / medians[0]:.1f} times as long")
    if last > (1.0 + GROWTH) * memory:
        findings.append(f"memory grew from {memory:.0f} to {last:.0f} MiB")
    for tab in (enemy, *tabs):
        await tab.close()
    return iter(findings)


def tabs(count: int, seconds: float) -> Iterator[str]:
    """Findings of many tabs on a studio in a process of its own."""
    with served(CROWDED, None) as (address, process):
        return asyncio.run(crowd(address, process, count, seconds))


if __name__ == "__main__":
    print(asyncio.run(sent_to(sys.argv[1], float(sys.argv[2]))))

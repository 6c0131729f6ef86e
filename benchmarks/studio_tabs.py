"""The studio under use: from a slider to its map, and ten tabs whose sliders never rest; latency and memory.

Run `python benchmarks/studio_tabs.py`. Tabs are network clients that speak the browser's protocol and draw nothing, so
that the figures are the server's alone. Exits with 1 if anything failed or memory grew by more than a tenth.
"""

import argparse
import asyncio
import json
import random
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import socketio

from kinetostat.machine.loading import bundled

CROWDED = "zhang-gosselin-4dof"
"""The machine of all tabs."""
MOVES = 60
"""Slider movements of the first figure, each after the map of the one before."""
EVERY = 1.0 / 30.0
"""Seconds between two movements of a restless slider: what a browser sends at most."""
SETTLING = 0.25
"""Share of the time after which memory counts as settled: programs are compiled, pools are filled."""
GROWTH = 0.1
TIME = re.compile(r"poses in (\d+) ms")


@contextmanager
def served(machine: str, cores: str | None) -> Iterator[tuple[str, int]]:
    """A studio in a process of its own: its address and process."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    pinned = ["taskset", "-c", cores] if cores else []
    words = ["studio", machine, "--no-browser", "--port", str(port)]
    code = f"import sys; from kinetostat.cli import main; sys.exit(main({words!r}))"
    with tempfile.NamedTemporaryFile("r", encoding="utf-8") as said:
        with open(said.name, "w", encoding="utf-8") as log:
            process = subprocess.Popen([*pinned, sys.executable, "-c", code], stderr=log, stdout=log)
        while "Studio:" not in Path(said.name).read_text("utf-8") and process.poll() is None:
            time.sleep(0.1)
        try:
            yield f"http://127.0.0.1:{port}", process.pid
        finally:
            process.terminate()
            process.wait()
            complaints = said.read().splitlines()[1:]
            if complaints:
                print(f"the server said {len(complaints)} lines, the last of them:", *complaints[-12:], sep="\n")


def resident(process: int) -> float:
    """Memory of a process, MiB."""
    status = Path(f"/proc/{process}/status").read_text("utf-8")
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024  # type: ignore[index]


@dataclass
class Tab:
    """A tab: what the server told it of its elements, and how long its maps took."""

    address: str
    elements: dict[int, dict[str, Any]] = field(default_factory=dict)
    times: list[float] = field(default_factory=list)
    scenes: int = 0
    told: float = 0.0
    problems: list[str] = field(default_factory=list)
    arrived: asyncio.Event = field(default_factory=asyncio.Event)

    async def open(self) -> None:
        """Load the page and connect, as a browser does."""
        async with httpx.AsyncClient() as http:
            text = (await http.get(self.address)).text
        self.client = re.search(r"'client_id': '([0-9a-f-]+)'", text)[1]  # type: ignore[index]
        query = {"client_id": self.client, "tab_id": str(uuid.uuid4()), "document_id": str(uuid.uuid4()),
                 "old_tab_id": None, "next_message_id": 0}  # fmt: skip
        self.channel = socketio.AsyncClient()
        self.channel.on("update", self._update)
        self.channel.on("run_javascript", self._drawn)
        self.channel.on("notify", lambda data: self.problems.append(json.dumps(data)))
        await self.channel.connect(self.address, socketio_path="/_nicegui_ws/socket.io", transports=["websocket"])
        if not await self.channel.call("handshake", query):
            raise RuntimeError("the studio refused the tab")
        await asyncio.wait_for(self.arrived.wait(), 60.0)

    async def _update(self, data: dict[str, Any]) -> None:
        for key, element in data.items():
            if key != "_id" and element is not None:
                self.elements[int(key)] = element
                found = TIME.search(str(element.get("text", "")))
                self.told = float(found[1]) if found else self.told
        await self._acknowledge(data)

    async def _drawn(self, data: dict[str, Any]) -> None:
        start = data["code"][:400]
        if '"nx"' in start:
            self.times.append(self.told)
            self.arrived.set()
        self.scenes += '"solids"' in start
        await self._acknowledge(data)

    async def _acknowledge(self, data: dict[str, Any]) -> None:
        await self.channel.emit("ack", {"client_id": self.client, "next_message_id": data["_id"] + 1})

    def slider(self) -> tuple[int, str]:
        """The first slider of the pose: its element, and the listener to its movements."""
        for key, element in self.elements.items():
            heard = {event["type"]: event["listener_id"] for event in element.get("events", ())}
            if element.get("props", {}).get("slides") and "settle" in heard:
                return key, heard["slide"]
        raise RuntimeError("the page has no slider")

    async def slide(self, position: int) -> None:
        """Move the slider."""
        key, listener = self.slider()
        told = {"id": key, "client_id": self.client, "listener_id": listener, "args": [json.dumps(position)]}
        await self.channel.emit("event", told)

    async def close(self) -> None:
        """Leave."""
        await self.channel.disconnect()


async def one_slider(address: str) -> list[float]:
    """Milliseconds from slider to map, one movement after the other."""
    tab = Tab(address)
    await tab.open()
    await tab.slide(480)
    await asyncio.sleep(2.0)
    tab.times.clear()
    for step in range(MOVES):
        tab.arrived.clear()
        await tab.slide(481 + step % 40)
        await asyncio.wait_for(tab.arrived.wait(), 30.0)
        await asyncio.sleep(0.15)  # the rest of the page follows
    await tab.close()
    return tab.times


async def restless(tab: Tab, until: float) -> None:
    """Move a slider at random until a time."""
    draw = random.Random(tab.client)
    while time.monotonic() < until:
        await tab.slide(draw.randint(430, 570))
        await asyncio.sleep(EVERY)


async def many_tabs(address: str, process: int, count: int, seconds: float) -> bool:
    """Tabs whose sliders never rest; prints what came of it, and whether all is well."""
    tabs = [Tab(address) for _ in range(count)]
    for tab in tabs:
        await tab.open()
    start = time.monotonic()
    work = [asyncio.create_task(restless(tab, start + seconds)) for tab in tabs]
    memory = []
    while time.monotonic() < start + seconds:
        await asyncio.sleep(1.0)
        memory.append(resident(process))
    await asyncio.gather(*work)
    settled = memory[int(SETTLING * len(memory))]
    times = sorted(time for tab in tabs for time in tab.times)
    problems = [problem for tab in tabs for problem in tab.problems]
    pictures = sum(tab.scenes for tab in tabs)
    least = min(len(tab.times) for tab in tabs)
    print(f"\n{count} tabs, {seconds:.0f} s: {len(times)} maps and {pictures} drawings, at least {least} maps a tab")
    print(
        f"slider to map: median {statistics.median(times):.0f} ms, 95 % within {times[int(0.95 * len(times))]:.0f} ms"
    )
    print(f"memory: {memory[0]:.0f} MiB after a second, {settled:.0f} settled, {memory[-1]:.0f} at the end")
    print(f"errors: {len(problems)}")
    for tab in tabs:
        await tab.close()
    return not problems and least > 0 and memory[-1] <= (1.0 + GROWTH) * settled


def main() -> int:
    """Print both figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tabs", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--machines", nargs="*", default=list(bundled()), help="all bundled ones unless given")
    parser.add_argument("--cores", help="processors of the server, e.g. 0,1 (taskset)")
    options = parser.parse_args()
    print("slider to map of 41 x 41 poses, ms       median   95 %")
    for machine in options.machines:
        with served(machine, options.cores) as (address, _):
            times = sorted(asyncio.run(one_slider(address)))
        print(f"{machine:38s} {statistics.median(times):8.0f} {times[int(0.95 * len(times))]:6.0f}")
    if not options.tabs:
        return 0
    with served(CROWDED, options.cores) as (address, process):
        return 0 if asyncio.run(many_tabs(address, process, options.tabs, options.seconds)) else 1


if __name__ == "__main__":
    sys.exit(main())

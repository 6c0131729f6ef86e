"""Sizes and times of machines as C, as a page and as an address, for all bundled machines. It prints Markdown.

Times are the best of some turns: of `machine_matrices`, K and C whole with the status, built by cc -O2 and nothing
else; of a map of 41 x 41 poses in a page: the first one, while Chromium still compiles, and the best of some after it.

    python benchmarks/printed_programs.py > docs/measured/printed.md
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Page, sync_playwright

from kinetostat import export, load
from kinetostat.engine.batch import available_cores
from kinetostat.engine.kernel import closes_inside
from kinetostat.machine.loading import bundled
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.studies.diagnosis import processor

LOADS = ("load.force=[20, -30, -100]", "tool.mass=2 kg")
RESTING = ("zhang-gosselin-4dof", "hexapod", "tricept", "delta", "tripteron", "hexapod-rus")
"""Machines of the second table: three whose loops are cut at rods, three whose legs close loops."""
POSES, TURNS, MAPS = 200_000, 7, 12
TIMED = """
#include <stdio.h>
#include <time.h>
#include "m.h"
int main(void)
{
    double at[M_INPUTS] = {%s}, in[M_INPUTS], K[36], C[36], sum = 0.0, best = 1e9;
    for (int turn = 0; turn < %d; turn++) {
        clock_t start = clock();
        for (int n = 0; n < %d; n++) {
            for (int k = 0; k < M_INPUTS; k++) { in[k] = at[k] + 1e-9 * n; }
            sum += m_matrices(in, K, C) + K[35] + C[35];
        }
        double spent = (double)(clock() - start) / CLOCKS_PER_SEC / %d;
        best = spent < best ? spent : best;
    }
    printf("%%.3g\\n", 1e6 * best);
    fprintf(stderr, "%%g\\n", sum); /* without a use of it the compiler would leave the calls out */
    return 0;
}
"""


def main() -> None:
    """Print both tables."""
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    print(f"Measured on {date.today()}: {processor()}, {available_cores()} of {os.cpu_count()} cores; {compiler}.\n")
    print(
        "| machine | operations: K and C | actuators, with derivatives | forward, at most | K and C in C | page | ",
        end="",
    )
    print("address | map in the page: first, then |\n|---|---|---|---|---|---|---|---|")
    with sync_playwright() as playwright:
        options = {"executable_path": shutil.which("chromium"), "args": ["--no-sandbox"]}
        window = playwright.chromium.launch(**options).new_page()
        for name in bundled():
            machine = load(name)
            if machine.family.chains is None or closes_inside(machine):
                print(unloaded_row(name, machine, window), flush=True)
    print("\n| machine | rest: first, each further step | displacement | first frequency, with derivatives | ", end="")
    print("source | page |\n|---|---|---|---|---|---|")
    for name in RESTING:
        print(resting_row(name), flush=True)


def unloaded_row(name: str, machine: Machine, window: Page) -> str:
    """Sizes and times of a machine without loads."""
    with TemporaryDirectory() as folder:
        place = Path(folder)
        counts = operations(machine, place)
        head = (place / "m.h").read_text("utf-8")
        forward = re.search(r"At most (\d+) operations", head)
        page, link = place / "m.html", place / "m.link"
        export(machine, page)
        export(machine, link)
        cells = [
            f"`{name}`",
            counts["entries_at"],
            f"{counts['actuators_at']}, {counts['actuator_slopes_at']}",
            forward[1] if forward else "",
            f"{time_of_matrices(machine, place)} us",
            f"{page.stat().st_size / 1000:.0f} kB",
            f"{len(link.read_text('utf-8'))} characters",
            "{:.0f}, {:.1f} ms".format(*times_of_map(page, window)),
        ]
    return f"| {' | '.join(cells)} |"


def resting_row(name: str) -> str:
    """Sizes of a machine that rests under loads."""
    machine = load(name, LOADS)
    with TemporaryDirectory() as folder:
        place = Path(folder)
        counts = operations(machine, place, ["frequency_1"])
        modes = f" (modes: {counts['springs_at']})" if "springs_at" in counts else ""
        source = (place / "m.c").stat().st_size
        export(machine, place / "m.html")
        cells = [
            f"`{name}`",
            f"{counts['first_steps_at']}, {counts['step_at']}",
            counts["displacement_at"],
            f"{counts['quantities_at']}, {counts['quantity_slopes_at']}{modes}",
            f"{source / 1e6:.2f} MB",
            f"{(place / 'm.html').stat().st_size / 1000:.0f} kB",
        ]
    return f"| {' | '.join(cells)} |"


def operations(machine: Machine, place: Path, outputs: Sequence[str] | None = None) -> dict[str, str]:
    """Export a machine to m.c, and return how many operations each of its programs takes, by name."""
    export(machine, place / "m.c", outputs=outputs)
    found = re.findall(r"/\* (\d+) operations\. \*/\nstatic int (\w+)\(", (place / "m.c").read_text("utf-8"))
    return {name: count for count, name in found}


def time_of_matrices(machine: Machine, place: Path) -> str:
    """Time K and C at poses next to that of the file, us."""
    at = [repr(float(value)) for path, value in values(machine).items() if path.startswith(POSE)]
    (place / "main.c").write_text(TIMED % (", ".join(at), TURNS, POSES, POSES), "utf-8")
    subprocess.run(["cc", "-O2", "main.c", "m.c", "-o", "timed", "-lm"], cwd=place, check=True)
    return subprocess.run([place / "timed"], capture_output=True, text=True, check=True).stdout.strip()


def times_of_map(page: Path, window: Page) -> tuple[float, float]:
    """Time the first map of a page, and the best one while its first slider moves, ms."""
    window.goto(page.as_uri())
    window.wait_for_function("document.documentElement.dataset.mapTime")
    times = [float(window.evaluate("document.documentElement.dataset.mapTime"))]
    for turn in range(MAPS):
        slider = window.locator("#sliders input[type=number]").first
        slider.fill(str(float(slider.input_value()) + 1e-3 * turn))
        slider.press("Enter")
        window.wait_for_timeout(60)
        times.append(float(window.evaluate("document.documentElement.dataset.mapTime")))
    return times[0], min(times)


if __name__ == "__main__":
    sys.exit(main())

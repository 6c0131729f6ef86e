"""Every bundled machine in the engines that are not ours, at three poses each: the table of `docs/validation.md`.

Prints Markdown to stdout, progress to stderr; takes some minutes. Needs `kinetostat[validate]`.

    python benchmarks/validation_table.py > docs/measured/validation.md
"""

import math
import platform
import random
import sys
from collections.abc import Iterator
from importlib.metadata import version

from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.spec.errors import InputError
from kinetostat.validation.comparison import KNOWN, Validation, engines, validate

POSES = 3
SHIFT = 0.05
"""How far a coordinate in m lies from the bundled pose at most, as a share of the machine's characteristic length."""
TURN = math.radians(5)
"""Likewise one in rad."""
REGULAR = 0.02
"""Least singularity margin of a drawn pose, as in the tests."""
DRAWS = 200
"""Draws before a machine is given up."""


def nearby(name: str, machine: Machine) -> Iterator[Machine]:
    """The machine at its bundled pose, then at random ones around it, always the same."""
    yield machine
    pose = {p.path: p.quantity.kind for p in parameters(machine.family) if p.path.startswith("pose.")}
    here, length = values(machine), float(respond(machine).configuration.length)
    draw, found = random.Random(name), 1
    for _ in range(DRAWS):
        reach = {path: TURN if kind == "angle" else SHIFT * length for path, kind in pose.items()}
        drawn = with_values(machine, {path: here[path] + draw.uniform(-r, r) for path, r in reach.items()})
        response = respond(drawn)
        if Status(int(response.status)) is Status.OK and response.singularity_margin > REGULAR:
            yield drawn
            found += 1
        if found == POSES:
            return
    raise SystemExit(f"{name}: no {POSES} regular poses around the bundled one")


def described(machine: Machine) -> str:
    """The pose in words: mm and degrees."""
    kinds = {p.path: p.quantity.kind for p in parameters(machine.family)}
    shown = []
    for path, value in values(machine).items():
        if path.startswith("pose."):
            name = path.removeprefix("pose.")
            number = f"{math.degrees(value):.4g}°" if kinds[path] == "angle" else f"{1e3 * value:.4g}"
            shown.append(f"{name} {number}")
    return ", ".join(shown)


def compared(machine: Machine, engine: str) -> Validation | None:
    """The validation; None, with the reason on stderr, if the engine cannot have the machine."""
    try:
        return validate(machine, engine)
    except InputError as reason:
        print(f"  {engine}: {reason}", file=sys.stderr)
        return None


def cells(exudyn: Validation | None, pynite: Validation | None) -> list[str]:
    """What both engines say, as in the header."""
    found = {f"{scale:.0e}": apart for scale, apart in exudyn.trials} if exudyn else {}
    loads = [found.get(scale) for scale in ("1e-03", "1e-04", "1e-05")]
    numbers = [exudyn and exudyn.difference, *loads, pynite and pynite.difference, pynite and pynite.uncertainty]
    return ["–" if number is None else f"{number:.0e}" for number in numbers]


def main() -> None:
    """Print the table."""
    missing = [engine.name for engine in KNOWN if engine.name not in engines()]
    if missing:
        raise SystemExit(f"not installed: {', '.join(missing)}; pip install 'kinetostat[validate]'")
    used = {"Exudyn": "exudyn", "PyNite": "PyNiteFEA", "NumPy": "numpy", "SciPy": "scipy"}
    versions = ", ".join(f"{name} {version(package)}" for name, package in used.items())
    print(f"{versions}, Python {platform.python_version()}.\n")
    loads = ("Exudyn, loads 1e-3", "loads 1e-4", "loads 1e-5")
    header = ("machine", "pose (mm)", "Exudyn, linearised", *loads, "PyNite", "PyNite's uncertainty")
    print(f"| {' | '.join(header)} |\n|---|---|{'---:|' * 6}")
    worst = {engine.name: 0.0 for engine in KNOWN}
    for name in bundled():
        for i, machine in enumerate(nearby(name, load(name))):
            print(f"{name}, pose {i + 1}", file=sys.stderr)
            answers = [compared(machine, engine) for engine in ("exudyn", "pynite")]
            for answer in answers:
                if answer is not None:
                    worst[answer.engine] = max(worst[answer.engine], answer.difference)
            row = [f"`{name}`" if i == 0 else "", described(machine), *cells(*answers)]
            print(f"| {' | '.join(row)} |", flush=True)
    print("\nLargest difference: " + ", ".join(f"{name} {value:.1e}" for name, value in worst.items()) + ".")


if __name__ == "__main__":
    main()

"""The gallery: every bundled machine with its picture, what its file says of it, and what it can do."""

import re
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from kinetostat.machine.loading import bundled, load
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.views.picture import machine_picture

FOLDER = "generated"
SIZE = (640, 480)
"""Pixels of a picture."""
FORMALITY = re.compile(r" ?(?:Every value is|Values are) text with a unit, or[^.]*\.")
"""What every file says of itself."""
NUMBER = {2: "Two", 3: "Three", 4: "Four", 5: "Five", 6: "Six"}


def gallery(folder: Path) -> str:
    """One section for each machine, in the order of `kinetostat list`."""
    (folder / FOLDER).mkdir(exist_ok=True)
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as workers:
        pictures = dict(zip(bundled(), workers.map(picture, bundled()), strict=True))
    for name, data in pictures.items():
        (folder / FOLDER / f"{name}.png").write_bytes(data)
    return "\n".join(_section(name) for name in bundled())


def picture(name: str) -> bytes:
    """A bundled machine as PNG."""
    return machine_picture(load(name), SIZE)


def _section(name: str) -> str:
    found = analyze(load(name))
    return "\n".join(
        [
            f"## {name}\n",
            f"![{found.machine.name}]({FOLDER}/{name}.png)\n",
            f"**{found.machine.name}.** {described(bundled()[name])}\n",
            f"{_facts(found)}\n",
        ]
    )


def described(text: str) -> str:
    """What a machine file says at its head about the machine, as one paragraph."""
    lines = text.splitlines()
    head = lines[: next(i for i, line in enumerate(lines) if not line.startswith("#"))]
    return FORMALITY.sub("", " ".join(line.removeprefix("#").strip() for line in head))


def _facts(found: Analysis) -> str:
    mobility = found.mobility
    assert mobility is not None
    pose = ", ".join(f"`{field}`" for field in vars(found.machine.sections["pose"]))
    redundant = mobility.here.redundant
    held = f", {redundant} constraints more than needed" if redundant else ""
    return f"{NUMBER[mobility.full_cycle]} freedoms: {pose}. {mobility.actuators} actuators{held}."

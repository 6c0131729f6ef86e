"""The gallery: every bundled machine with its picture, what its file says of it, and what it can do."""

import re
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from kinetostat.machine.loading import bundled, load
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.views.picture import Theme, machine_picture

FOLDER = "generated"
SIZE = (640, 480)
"""Pixels of a picture."""
THEMES: tuple[Theme, ...] = ("light", "dark")
FORMALITY = re.compile(r" ?(?:Every value is|Values are) text with a unit, or[^.]*\.")
"""What every file says of itself."""
NUMBER = {2: "Two", 3: "Three", 4: "Four", 5: "Five", 6: "Six"}


def gallery(folder: Path) -> str:
    """One section for each machine, in the order of `kinetostat list`."""
    (folder / FOLDER).mkdir(exist_ok=True)
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as workers:
        wanted = [(name, theme) for name in bundled() for theme in THEMES]
        for (name, theme), data in zip(wanted, workers.map(picture, *zip(*wanted, strict=True)), strict=True):
            (folder / FOLDER / f"{name}-{theme}.png").write_bytes(data)
    return "\n".join(_section(name) for name in bundled())


def picture(name: str, theme: Theme) -> bytes:
    """A bundled machine as PNG, to stand on a light or a dark page."""
    return machine_picture(load(name), SIZE, theme=theme)


def _section(name: str) -> str:
    found = analyze(load(name))
    return "\n".join(
        [
            f"## {name}\n",
            *(_picture(found.machine.name, f"{FOLDER}/{name}-{theme}.png", theme) for theme in THEMES),
            f"**{found.machine.name}.** {described(bundled()[name])}\n",
            f"{_facts(found)}\n",
        ]
    )


def _picture(alt: str, path: str, theme: Theme) -> str:
    return f"```{{image}} {path}\n:alt: {alt}\n:class: only-{theme}\n```\n"


def described(text: str) -> str:
    """What a machine file says at its head about the machine, as one paragraph."""
    lines = text.splitlines()
    head = lines[: next(i for i, line in enumerate(lines) if not line.startswith("#"))]
    return FORMALITY.sub("", " ".join(line.removeprefix("#").strip() for line in head))


def _facts(found: Analysis) -> str:
    mobility = found.mobility
    assert mobility is not None
    pose = ", ".join(f"`{field}`" for field in vars(found.machine.tables["pose"]))
    redundant = mobility.here.redundant
    held = f", {redundant} constraints more than needed" if redundant else ""
    return f"{NUMBER[mobility.full_cycle]} freedoms: {pose}. {mobility.actuators} actuators{held}."

"""The gallery: every bundled machine with its picture, what its file says of it, and what it can do."""

import re
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from sphinx.application import Sphinx

from kinetostat.engine.kernel import closes_inside
from kinetostat.exchange.formats import export
from kinetostat.machine.loading import bundled, load
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.views.live_page import VIEWER, viewer
from kinetostat.views.picture import Theme, machine_picture

FOLDER, LIVE = "generated", "live"
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


def moves(name: str) -> bool:
    """Whether a bundled machine has a page that moves it: its legs have closed forms."""
    machine = load(name)
    return machine.family.chains is None or closes_inside(machine)


def write_pages(app: Sphinx, error: Exception | None) -> None:
    """Put the pages of bundled machines beside those of the site, and the one that shows the machine of its address."""
    if error is not None or app.builder.name != "html":
        return
    (Path(app.outdir) / LIVE).mkdir(exist_ok=True)
    (Path(app.outdir) / LIVE / VIEWER).write_text(viewer(), "utf-8")
    for name in filter(moves, bundled()):
        export(load(name), Path(app.outdir) / LIVE / f"{name}.html")


def _section(name: str) -> str:
    found = analyze(load(name))
    live = f'<p><a href="{LIVE}/{name}.html">Move it in your browser</a></p>\n'
    return "\n".join(
        [
            f"## {name}\n",
            *(_picture(found.machine.name, f"{FOLDER}/{name}-{theme}.png", theme) for theme in THEMES),
            f"**{found.machine.name}.** {described(bundled()[name])}\n",
            f"{_facts(found)}\n",
            *([live] if moves(name) else []),
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

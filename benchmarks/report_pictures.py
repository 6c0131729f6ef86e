"""The pictures of docs/report.md: a report as a page in a headless Chromium, and the first pages of one as a PDF.

Run `python benchmarks/report_pictures.py`; writes docs/images/report-*.png. Needs what the browser tests need.
"""

import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from kinetostat.cli import main
from kinetostat.machine.loading import as_toml, load
from kinetostat.studies.report import gather
from kinetostat.validation.comparison import validate
from kinetostat.views.report.writers import page_pictures
from kinetostat.views.report.writing import Origin, report_of

ROOT = Path(__file__).parent.parent
sys.path.append(str(ROOT / "tests" / "edges"))
from browser import browser  # noqa: E402  (of the tests)

IMAGES = ROOT / "docs" / "images"
SWEEPS = 20
"""Improvements of the palette: without them, rare colours such as those of marks are lost."""
PAGES, DOTS, GAP = 3, 72, 12
"""Pages beside each other, dots to an inch, and pixels between."""
LOAD = 'load.force=["0 N","0 N","-500 N"]'


def keep(image: Image.Image, name: str) -> None:
    """Write a small PNG."""
    path = IMAGES / f"{name}.png"
    image.convert("RGB").quantize(256, kmeans=SWEEPS, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"docs/images/{path.name}  {path.stat().st_size >> 10} KiB")


def pages() -> None:
    """The first pages of a PDF."""
    machine = load("tripteron", [LOAD])
    origin = Origin("", (), as_toml(machine), "{}")
    report = report_of(gather(machine), validate(machine), origin, {}, False)
    shown = [Image.open(BytesIO(page)) for page in page_pictures(report, DOTS)[:PAGES]]
    width, height = shown[0].size
    whole = Image.new("RGB", (PAGES * (width + GAP) + GAP, height + 2 * GAP), "#8d99a8")
    for k, page in enumerate(shown):
        whole.paste(page, (GAP + k * (width + GAP), GAP))
    keep(whole, "report-pdf")


def page() -> None:
    """The summary on a page, with the machine."""
    with TemporaryDirectory() as folder, browser() as new_tab:
        file = Path(folder) / "report.html"
        main(["report", "zhang-gosselin-4dof", "-o", str(file)])
        tab = new_tab(width=1000, height=1150).tab
        tab.goto(file.as_uri())
        tab.wait_for_function("document.querySelector('.machine-view')?.dataset.rest === 'fine'")
        tab.evaluate("document.querySelector('#s1').scrollIntoView()")
        tab.wait_for_timeout(1500)
        keep(Image.open(BytesIO(tab.screenshot())), "report-page")


if __name__ == "__main__":
    IMAGES.mkdir(parents=True, exist_ok=True)
    pages()
    page()

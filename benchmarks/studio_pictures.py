"""The pictures of docs/studio.md: the studio's main views as a headless Chromium shows them.

Run `python benchmarks/studio_pictures.py`; writes docs/images/*.png. Needs what the browser tests need.
"""

import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from PIL import Image

ROOT = Path(__file__).parent.parent
sys.path.append(str(ROOT / "tests" / "edges"))
from browser import Watched, browser, served  # noqa: E402  (of the tests)

from kinetostat.views.questions import QUESTIONS  # noqa: E402

IMAGES = ROOT / "docs" / "images"
SWEEPS = 20
"""Improvements of the palette: without them, rare colours such as those of marks are lost."""


def still(page: Watched) -> None:
    """Wait until the machine is drawn as finely as it will be."""
    page.tab.wait_for_timeout(1500)
    page.tab.wait_for_function("document.querySelector('.machine-view').dataset.rest === 'fine'")


def keep(page: Watched, name: str, part: str = "") -> None:
    """Write the page, or a part of it, as a small PNG."""
    still(page)
    shot = page.tab.locator(part).first.screenshot() if part else page.tab.screenshot()
    IMAGES.mkdir(parents=True, exist_ok=True)
    image = Image.open(BytesIO(shot)).convert("RGB").quantize(256, kmeans=SWEEPS, dither=Image.Dither.NONE)
    image.save(IMAGES / f"{name}.png", optimize=True)
    print(f"docs/images/{name}.png  {(IMAGES / f'{name}.png').stat().st_size >> 10} KiB")


def write(page: Watched, label: str, text: str) -> None:
    """Type a value."""
    box = page.tab.get_by_label(f"{label}, value with unit").locator("visible=true").first
    box.fill(text)
    box.press("Enter")


def front(page: Watched, tab: str) -> None:
    """Bring a view to the front."""
    page.tab.get_by_role("tab", name=tab, exact=True).last.click()


def paper_machine(new_tab: Any) -> None:
    """The whole page, and a pose that cannot be reached."""
    with served("zhang-gosselin-4dof") as address:
        page = new_tab()
        page.open(address)
        for height in ("69 cm", "68 cm"):  # the first map has a program to compile
            before = page.text(".headline")
            write(page, "z", height)
            page.until_changed(".headline", before)
        page.tab.locator(".wordmark").click()
        keep(page, "studio")
        for tab, name in (("Sensitivity", "sensitivity"), ("Links", "links")):
            front(page, tab)
            keep(page, f"studio-{name}", ".views-card")
        write(page, "z", "1.5 m")
        page.until_changed(".pose-status", "ok")
        keep(page, "studio-out-of-reach", ".middle")


def vibration(new_tab: Any) -> None:
    """The first mode of a hexapod, at the end of its swing, and the map of its frequency."""
    with served("hexapod") as address:
        page = new_tab()
        page.tab.emulate_media(reduced_motion="reduce")
        page.open(f"{address}?machine=hexapod&tool.mass=12+kg&linear_density.legs=4+kg%2Fm")
        page.tab.get_by_role("button", name="Layers of the picture").click()
        page.tab.get_by_text("compliance ellipsoids").click()
        page.tab.get_by_text("most compliant directions").click()
        page.tab.get_by_role("button", name="Layers of the picture").click()
        front(page, "Vibration")
        page.tab.wait_for_function("document.querySelector('.machine-view').dataset.swings")
        page.tab.get_by_role("tab", name="Mass", exact=True).click()
        before = page.text(".server-time")
        page.choose("map of", "frequency 1")
        page.until_changed(".server-time", before)
        keep(page, "studio-vibration")


def tripteron(new_tab: Any) -> None:
    """Beams that bend, in the dark."""
    with served("tripteron") as address:
        page = new_tab()
        page.open(address)
        page.tab.get_by_role("button", name="Light or dark").click()
        front(page, "Load")
        page.tab.get_by_role("tab", name="Load", exact=True).first.click()
        write(page, "force y", "400 N")
        page.tab.get_by_role("slider", name="deflection ×").wait_for()
        front(page, "Loads")
        keep(page, "studio-dark")


def design(new_tab: Any) -> None:
    """A Pareto front, its knee loaded."""
    with TemporaryDirectory() as state, served("zhang-gosselin-4dof", state) as address:
        page = new_tab()
        page.open(address)
        page.tab.get_by_role("button", name="Design", exact=True).click()
        page.choose("study", "zhang-gosselin-front")
        page.tab.get_by_role("button", name="Start", exact=True).click()
        page.tab.wait_for_function("document.querySelector('.run-line').innerText.startsWith('done')")
        page.tab.get_by_role("button", name="Load the knee").click()
        page.tab.locator(".wordmark").click()
        keep(page, "studio-design")


def question(new_tab: Any) -> None:
    """The vibrations of a hexapod, asked about as on the command line."""
    with served("hexapod") as address:
        page = new_tab()
        page.open(f"{address}?machine=hexapod&tool.mass=12+kg&linear_density.legs=4+kg%2Fm")
        page.tab.get_by_role("button", name="Ask", exact=True).first.click()
        page.tab.locator(".of-asking .form-about").wait_for()
        page.choose("question", f"modes: {QUESTIONS['modes'][0]}")
        page.tab.get_by_label("lowest").fill("10 Hz")
        page.tab.locator(".of-asking .design-foot").get_by_role("button", name="Ask", exact=True).click()
        page.tab.locator(".answer figure").first.wait_for(state="attached")
        page.tab.locator(".wordmark").click()
        keep(page, "studio-ask")


def gallery(new_tab: Any) -> None:
    """Other machines, the middle of the page."""
    for machine in ("hexapod", "delta", "tricept", "passive-leg-5dof-rus"):
        with served(machine) as address:
            page = new_tab(1180, 720)
            page.open(address)
            keep(page, f"studio-{machine}", ".machine-view")
            page.tab.close()


def main() -> None:
    """Make all pictures."""
    with browser() as new_tab:
        paper_machine(new_tab)
        vibration(new_tab)
        tripteron(new_tab)
        design(new_tab)
        question(new_tab)
        gallery(new_tab)


if __name__ == "__main__":
    main()

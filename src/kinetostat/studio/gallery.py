"""The gallery: a window with a picture and a sentence of every bundled machine, to begin a new one from."""

from collections.abc import Callable
from pathlib import Path

from nicegui import app, ui

from kinetostat.machine.loading import bundled
from kinetostat.studio.elements import icon_button

PICTURES = Path(__file__).parent / "gallery_pictures"
"""Pictures by the names of machines; `benchmarks/gallery_pictures.py` makes them. A machine may be without one."""
ADDRESS = "/gallery"
"""Where the browser gets them."""


def serve_pictures() -> None:
    """Let browsers load the pictures."""
    app.add_static_files(ADDRESS, PICTURES)


def about(text: str) -> str:
    """Return the first sentence of the comment at the head of a machine file; empty if there is none."""
    lines = text.splitlines()
    head = lines[: next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))]
    sentence, _, more = " ".join(line.removeprefix("#").strip() for line in head).partition(". ")
    # An initial is not the end of a sentence: "The machine of D. Zhang and C. M. Gosselin, ..."
    while more and sentence[-2:-1] in ("", " "):
        further, _, more = more.partition(". ")
        sentence = f"{sentence}. {further}"
    return sentence.rstrip(".")


class Gallery:
    """A button and its window, which is built when it is first opened."""

    def __init__(self, choose: Callable[[str], None]) -> None:
        """Build the button.

        Args:
            choose: opens a bundled machine by its name.
        """
        self._choose = choose
        icon_button("grid_view", "New machine from the gallery", self._open, "gallery")
        with ui.dialog() as self.window:
            self._content = ui.element("div").classes("gallery-window")

    def _open(self) -> None:
        if not self._content.default_slot.children:
            with self._content:
                self._build()
        self.window.open()

    def _build(self) -> None:
        with ui.element("div").classes("gallery-head"):
            ui.label("Begin with one of these machines; every number of it can be changed.").classes("comparison-title")
            icon_button("close", "Close", self.window.close, "gallery-close")
        with ui.element("div").classes("gallery-cards"):
            for name, text in bundled().items():
                with ui.element("button").classes("gallery-card").mark(f"gallery {name}") as card:
                    if (PICTURES / f"{name}.webp").exists():
                        picture = ui.element("img").props(f'src="{ADDRESS}/{name}.webp" alt="" loading="lazy"')
                        picture.props('width="240" height="180"')
                    ui.label(name).classes("gallery-name")
                    ui.label(about(text)).classes("gallery-about")
                card.on("click", lambda name=name: self._take(name))

    def _take(self, name: str) -> None:
        self.window.close()
        self._choose(name)

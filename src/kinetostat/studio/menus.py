"""The menus of the header: the gallery to begin a new machine from, and the files of other programs to write.

The commands `report` and `export` write files in a process of their own, so that the page stays responsive meanwhile.
"""

import asyncio
import io
import sys
import zipfile
from collections.abc import Callable, Sequence
from itertools import takewhile
from pathlib import Path
from tempfile import TemporaryDirectory

from nicegui import app, background_tasks, ui

from kinetostat.exchange.formats import FORMATS
from kinetostat.machine.loading import bundled
from kinetostat.studio.elements import icon_button, refuse
from kinetostat.studio.processes import Turns, make_modest
from kinetostat.studio.session import Session

REPORTS = (
    ("report, page", ".html", "for a design review, with the machine in three dimensions"),
    ("report, PDF", ".pdf", "for a design review, to print"),
)
"""Name, suffix and description of each kind of report."""
SHARED = ("page", "link")
"""Formats for people who have no kinetostat."""
SHARE_HINT = "Share and export: reports, the machine as a page or a link, and formats of other programs"
MOST_WRITTEN = 2
"""Files of all tabs that are written at a time: each takes a core, and the pages need one as well."""
BUSY = "Another file is being written; wait until it is done."
WRITING = Turns(MOST_WRITTEN, BUSY)
PICTURES = Path(__file__).parent / "gallery_pictures"
"""Pictures by the names of machines; `benchmarks/gallery_pictures.py` makes them. A machine may be without one."""
PICTURE_ADDRESS = "/gallery"
"""Address from which the browser gets the pictures."""


class FilesMenu:
    """A button with a menu of file formats; choosing one writes the file and sends it to the browser."""

    def __init__(self, session: Session) -> None:
        """Build the button; a file gets the machine as it is at the moment of choosing."""
        self._session = session
        self._process: asyncio.subprocess.Process | None = None
        self._busy = False
        self._button = icon_button("ios_share", SHARE_HINT, lambda: None, "files")
        with self._button, ui.menu().props('auto-close max-height="90vh"'):
            for name, suffix, summary in REPORTS:
                self._item(name, suffix, summary, ["report"])
            for shared in (True, False):
                for form in (form for form in FORMATS if (form.name in SHARED) is shared):
                    self._item(form.name, form.suffix, form.summary, ["export", "--to", form.name])
                if shared:
                    ui.separator()

    def _item(self, name: str, suffix: str, summary: str, words: Sequence[str]) -> None:
        item = ui.menu_item(on_click=lambda: self._choose(words, suffix)).props("dense").mark(f"file-{name}")
        with item, ui.item_section():
            ui.item_label(f"{name} ({suffix})")
            ui.item_label(summary).props("caption")

    def _choose(self, words: Sequence[str], suffix: str) -> None:
        if self._busy:
            refuse(BUSY)
            return
        self._busy = True
        background_tasks.create(self._send(words, suffix), name="studio file")

    async def _send(self, words: Sequence[str], suffix: str) -> None:
        """Write the file by the command of these words and send it; a format of several files is sent as a ZIP."""
        name, machine = self._session.as_file()
        target = f"{Path(name).stem}{suffix}"
        # NiceGUI does not know in a background task to which page a message belongs; the button tells it.
        with self._button:
            waiting = ui.notification(f"Writing {target} …", spinner=True, timeout=None, position="top")
        try:
            with TemporaryDirectory() as folder:
                (Path(folder) / name).write_bytes(machine)
                async with WRITING.turn(self._button.client.id):
                    reason = await self._run(Path(folder), [words[0], name, *words[1:], "-o", target])
                (Path(folder) / name).unlink()  # so that only files that the command has written remain
                files = [(path.name, path.read_bytes()) for path in sorted(Path(folder).iterdir())]
        finally:
            self._busy = False
            waiting.dismiss()
        with self._button:
            if not files:
                refuse(reason)
            elif len(files) == 1:
                ui.download(files[0][1], files[0][0])
            else:
                ui.download(_archive_of(files), f"{Path(name).stem}.zip")

    async def _run(self, folder: Path, words: Sequence[str]) -> str:
        """Run a command in a folder and return its message: if it has written no file, the message says why."""
        self._process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "kinetostat", *words, cwd=folder,
            stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE,
        )  # fmt: skip
        make_modest(self._process.pid)
        _, message = await self._process.communicate()
        text = message.decode("utf-8", "replace").removeprefix("kinetostat: ").strip()
        return text or "The file could not be written."

    def close(self) -> None:
        """Stop writing, because the page is gone."""
        if self._process is not None and self._process.returncode is None:
            self._process.kill()


def _archive_of(files: Sequence[tuple[str, bytes]]) -> bytes:
    """Pack several files into a ZIP archive."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files:
            archive.writestr(name, data)
    return stream.getvalue()


def serve_pictures() -> None:
    """Let browsers load the pictures."""
    app.add_static_files(PICTURE_ADDRESS, PICTURES)


def first_sentence(text: str) -> str:
    """Return the first sentence of the comment at the head of a machine file; empty if there is none."""
    comment = takewhile(lambda line: line.startswith("#"), text.splitlines())
    sentence, _, rest = " ".join(line.removeprefix("#").strip() for line in comment).partition(". ")
    # An initial is not the end of a sentence: "The machine of D. Zhang and C. M. Gosselin, ..."
    while rest and sentence[-2:-1] in ("", " "):
        continuation, _, rest = rest.partition(". ")
        sentence = f"{sentence}. {continuation}"
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
                        picture = ui.element("img").props(f'src="{PICTURE_ADDRESS}/{name}.webp" alt="" loading="lazy"')
                        picture.props('width="240" height="180"')
                    ui.label(name).classes("gallery-name")
                    ui.label(first_sentence(text)).classes("gallery-about")
                card.on("click", lambda name=name: self._open_machine(name))

    def _open_machine(self, name: str) -> None:
        self.window.close()
        self._choose(name)

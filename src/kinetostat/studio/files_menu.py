"""The menu that writes the machine as a report or in the format of another program, and sends it to the browser.

The commands `report` and `export` do the work, in another process, so that the page answers meanwhile.
"""

import asyncio
import io
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from nicegui import background_tasks, ui

from kinetostat.exchange.formats import KNOWN
from kinetostat.studio.elements import icon_button, refuse
from kinetostat.studio.session import Session

REPORTS = (
    ("report, page", ".html", "for a design review, with the machine in three dimensions"),
    ("report, PDF", ".pdf", "for a design review, to print"),
)
"""Name, suffix and description of each kind of report."""
BUSY = "Another file is being written; wait until it is done."


class FilesMenu:
    """A button with a menu; a file that is chosen is written and sent to the browser."""

    def __init__(self, session: Session) -> None:
        """Build the button; the machine is written as it is when a file is chosen."""
        self._session = session
        self._process: asyncio.subprocess.Process | None = None
        self._busy = False
        self._button = icon_button("ios_share", "Export: reports, and formats of other programs", lambda: None, "files")
        with self._button, ui.menu().props('auto-close max-height="90vh"'):
            for name, suffix, summary in REPORTS:
                self._item(name, suffix, summary, ["report"])
            ui.separator()
            for known in KNOWN:
                self._item(known.name, known.suffix, known.summary, ["export", "--to", known.name])

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
        name, machine = self._session.as_file()
        wanted = f"{Path(name).stem}{suffix}"
        with self._button:
            waiting = ui.notification(f"Writing {wanted} …", spinner=True, timeout=None, position="top")
        try:
            with TemporaryDirectory() as folder:
                (Path(folder) / name).write_bytes(machine)
                reason = await self._run(Path(folder), [words[0], name, *words[1:], "-o", wanted])
                (Path(folder) / name).unlink()
                data = [(path.name, path.read_bytes()) for path in sorted(Path(folder).iterdir())]
        finally:
            self._busy = False
            waiting.dismiss()
        with self._button:
            if not data:
                refuse(reason)
            elif len(data) == 1:
                ui.download(data[0][1], data[0][0])
            else:
                ui.download(_packed(data), f"{Path(name).stem}.zip")

    async def _run(self, folder: Path, words: Sequence[str]) -> str:
        """Run a command in a folder; returns its message, which is the reason if it has written nothing."""
        self._process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "kinetostat", *words, cwd=folder,
            stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE,
        )  # fmt: skip
        _, message = await self._process.communicate()
        text = message.decode("utf-8", "replace").removeprefix("kinetostat: ").strip()
        return text or "The file could not be written."

    def close(self) -> None:
        """Stop writing, because the page is gone."""
        if self._process is not None and self._process.returncode is None:
            self._process.kill()


def _packed(files: Sequence[tuple[str, bytes]]) -> bytes:
    """Pack several files into a ZIP archive."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files:
            archive.writestr(name, data)
    return stream.getvalue()

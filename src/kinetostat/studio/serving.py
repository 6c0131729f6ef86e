"""The studio as a web server on this computer: who may reach it, how much may be sent, what is served."""

import asyncio
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

from nicegui import app, background_tasks, ui
from nicegui.server import Server
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from kinetostat.machine.machine import Machine
from kinetostat.spec.document import LARGEST_FILE
from kinetostat.spec.errors import InputError
from kinetostat.studio.design.design_tab import Workshop
from kinetostat.studio.page import StudioPage
from kinetostat.studio.session import Memory

STYLE = Path(__file__).parent / "style.css"
LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names under which only this computer can be reached."""
SWITCH = 0.0005
"""Seconds after which a thread that computes lets the event loop have its turn; ten times as often as is usual, so that
messages of many tabs do not pile up and are not taken for silence."""
KEPT = "machine"
"""Under which a tab's work is remembered while the server runs."""
LARGEST_BODY = LARGEST_FILE + (64 << 10)
"""Bytes of a request: a machine file and what a form adds to it."""
MARK = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="7" fill="#0b5ea8"/>'
    '<path d="M7 25h18M10 25l3-14h6l3 14M11 9h10" stroke="#fff" stroke-width="2.4" fill="none" stroke-linecap="round"/>'
    "</svg>"
)
"""The icon of the page."""


class BoundedBody:
    """Refuses requests that are larger than a machine file can be, while they arrive."""

    def __init__(self, served: ASGIApp, largest: int = LARGEST_BODY) -> None:
        """Serve `served`, requests up to `largest` bytes."""
        self._served, self._largest = served, largest

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, cut off where it is too large."""
        if scope["type"] != "http":
            await self._served(scope, receive, send)
            return
        said = next((value for name, value in scope["headers"] if name == b"content-length"), b"0")
        if said.isdigit() and int(said) > self._largest:
            await send({"type": "http.response.start", "status": 413, "headers": [(b"content-length", b"0")]})
            await send({"type": "http.response.body", "body": b""})
            return
        seen = 0

        async def counted() -> Message:
            nonlocal seen
            message = await receive()
            seen += len(message.get("body", b""))
            return message if seen <= self._largest else {"type": "http.disconnect"}

        await self._served(scope, counted, send)


def serve(machine: Machine, name: str, host: str, port: int, browser: bool, state: Path) -> None:
    """Serve the studio until it is stopped; every page starts with this machine.

    Args:
        machine: what a new page shows.
        name: of it, if it is bundled; otherwise empty.
        host: address to listen at.
        port: to listen at.
        browser: whether to open a browser.
        state: folder of searches and favourites.

    Raises:
        InputError: nothing can listen there.
    """
    _check_free(host, port)
    sys.setswitchinterval(SWITCH)
    app.on_startup(lambda: background_tasks.create(_announce(host, port)))
    prepare(machine, name, Workshop(state), LOOPBACK if host in LOOPBACK else ())
    ui.run(
        host=host, port=port, title="kinetostat studio", favicon=MARK, show=browser, reload=False, tailwind=False,
        show_welcome_message=False, reconnect_timeout=30.0, message_history_length=200,
    )  # fmt: skip


def _check_free(host: str, port: int) -> None:
    """Refuse an address that this computer does not have, or a port that is in use."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind((host, port))
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(
            f"the studio cannot listen at {host}, port {port}: {reason}; choose another with --port or --host."
        ) from None


async def _announce(host: str, port: int) -> None:
    """Say where the studio is, once it listens."""
    while not Server.instance.started:
        await asyncio.sleep(0.02)
    shown = f"[{host}]" if ":" in host else host
    print(f"Studio: http://{shown}:{port}   stop with Ctrl-C", file=sys.stderr, flush=True)


def prepare(machine: Machine, name: str, workshop: Workshop, hosts: Sequence[str] = ()) -> None:
    """Make the page known to the server.

    Args:
        machine: what a new page shows.
        name: of it, if it is bundled; otherwise empty.
        workshop: what all pages share.
        hosts: names by which a browser may call this server: a page of another site cannot reach it under its own name.
    """
    app.add_middleware(BoundedBody)
    app.on_shutdown(workshop.close)
    if hosts:
        app.add_middleware(TrustedHostMiddleware, allowed_hosts=[*hosts, "[::1]"])

    @ui.page("/")
    async def studio() -> None:
        await show(machine, name, workshop)


async def show(machine: Machine, name: str, workshop: Workshop) -> None:
    """Build the page of one browser tab; a tab that is loaded again goes on where it was.

    Args:
        machine: what a new tab shows.
        name: of it, if it is bundled; otherwise empty.
        workshop: what all pages share.
    """
    ui.add_css(STYLE)
    await ui.context.client.connected()
    remembered = app.storage.tab
    kept = remembered.get(KEPT) or Memory(machine, name)
    StudioPage(kept, lambda memory: remembered.update({KEPT: memory}), workshop)

"""The studio as a web server on this computer: its address, its limits, and the page that it serves.

What is on the page is the business of `page`.
"""

import asyncio
import socket
import sys
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import parse_qsl

from nicegui import app, background_tasks, core, run, ui
from nicegui.client import ClientConnectionTimeout
from nicegui.server import Server
from starlette.middleware.trustedhost import TrustedHostMiddleware

from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studio.admission import LARGEST_BODY, BoundedBody, OwnOrigin, Paced, timed_handler
from kinetostat.studio.design.design_tab import Workshop
from kinetostat.studio.elements import refuse
from kinetostat.studio.menus import serve_pictures
from kinetostat.studio.page import StudioPage
from kinetostat.studio.session import Memory, memory_of

STYLE = Path(__file__).parent / "style.css"
LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names under which only this computer can be reached."""
SWITCH = 0.0005
"""Seconds after which a computing thread lets the event loop run: a tenth of Python's default. With many tabs, messages
would otherwise pile up until browsers take the silence for a lost connection."""
MEMORY, ADDRESSES = "machine", "addresses"
"""Keys under which the work of a tab, and its latest addresses, are remembered while the server runs."""
REMEMBERED = 60
"""Addresses that are remembered: the browser shows them with a delay, in which there may be as many."""
PATIENCE = 30.0
"""Seconds within which a page that has been loaded must open its socket: a slow phone does; an idle download would
keep memory."""
MARK = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="7" fill="#0b5ea8"/>'
    '<path d="M7 25h18M10 25l3-14h6l3 14M11 9h10" stroke="#fff" stroke-width="2.4" fill="none" stroke-linecap="round"/>'
    "</svg>"
)
"""The icon of the page."""


def serve(machine: Machine, name: str, host: str, port: int, browser: bool, state: Path) -> None:
    """Serve the studio until it is stopped; every page starts with this machine.

    Args:
        machine: the machine that a new page shows.
        name: the name of the machine if it is bundled, else empty.
        host: address at which to listen.
        port: the port at which to listen.
        browser: whether to open a browser.
        state: folder of searches and favourites.

    Raises:
        InputError: the address is not one of this computer, or the port is in use.
    """
    _check_free(host, port)
    sys.setswitchinterval(SWITCH)
    app.on_startup(lambda: background_tasks.create(_announce(host, port)))
    prepare(machine, name, Workshop(state), LOOPBACK if host in LOOPBACK else ())
    # Sockets only: what a tab sends by requests could not be slowed down without the others noticing.
    core.sio.eio.transports = app.config.socket_io_js_transports = ["websocket"]
    ui.run(
        host=host, port=port, title="kinetostat studio", favicon=MARK, show=browser, reload=False, tailwind=False,
        show_welcome_message=False, reconnect_timeout=60.0, message_history_length=200,
        ws_max_size=LARGEST_BODY,
    )  # fmt: skip


def _check_free(host: str, port: int) -> None:
    """Refuse an address that this computer does not have, or a port that is in use, before anything is started."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind((host, port))
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(
            f"the studio cannot listen at {host}, port {port}: {reason}; choose another one with --port or --host."
        ) from None


async def _announce(host: str, port: int) -> None:
    """Print the address of the studio once it listens."""
    while not Server.instance.started:
        await asyncio.sleep(0.02)
    shown = f"[{host}]" if ":" in host else host
    print(f"Studio: http://{shown}:{port}   stop with Ctrl-C", file=sys.stderr, flush=True)


def prepare(machine: Machine, name: str, workshop: Workshop, hosts: Sequence[str] = ()) -> None:
    """Register the page with the server.

    Args:
        machine: the machine that a new page shows.
        name: the name of the machine if it is bundled, else empty.
        workshop: searches and favourites of all pages.
        hosts: names by which a browser may address this server; any name if empty. The check stops pages of other
            sites, whose own names could be made to point here.
    """
    handlers = core.sio.handlers["/"]
    handlers["event"] = timed_handler(handlers["event"], lambda tab: core.sio.get_environ(tab)["asgi.scope"])
    for middleware in (BoundedBody, Paced, OwnOrigin):
        app.add_middleware(middleware)
    serve_pictures()
    app.on_shutdown(workshop.close)
    if hosts:
        app.add_middleware(TrustedHostMiddleware, allowed_hosts=[*hosts, "[::1]"])

    @ui.page("/", dark=None)
    async def studio() -> None:
        await show(machine, name, workshop)


async def show(machine: Machine, name: str, workshop: Workshop) -> None:
    """Build the page of one browser tab; a tab that is loaded again goes on where it was.

    Args:
        machine: the machine that a new tab shows.
        name: the name of the machine if it is bundled, else empty.
        workshop: searches and favourites of all pages.
    """
    ui.add_css(STYLE)
    client = ui.context.client
    try:
        await client.connected(timeout=PATIENCE)
    except ClientConnectionTimeout:
        client.delete()
    if client.is_deleted:
        return  # loaded by something that is not a browser, or left at once
    remembered = app.storage.tab
    query = client.request.url.query
    known: deque[str] = remembered.setdefault(ADDRESSES, deque(maxlen=REMEMBERED))
    memory, problem = remembered.get(MEMORY), ""
    if query and query not in known:  # a link; after a reload, the tab's own memory knows what can be undone, too
        try:
            memory = await run.io_bound(memory_of, parse_qsl(query, keep_blank_values=True))
        except InputError as error:
            problem = str(error)

    def remember(changed: Memory, address: str) -> None:
        remembered[MEMORY] = changed
        known.append(address)

    StudioPage(memory or Memory(machine, name), remember, workshop)
    if problem:
        refuse(problem)

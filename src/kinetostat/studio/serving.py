"""The studio as a web server on this computer: its address, which requests it takes, and the page that it serves.

It refuses requests from other sites, in frames and of too many bytes, and reads the messages of a tab more slowly where
they come so often that other tabs would suffer. What is on the page is the business of `page`.
"""

import asyncio
import re
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from nicegui import app, background_tasks, core, run, ui
from nicegui.client import ClientConnectionTimeout
from nicegui.server import Server
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from kinetostat.commands.common import LOCAL_HOSTS
from kinetostat.machine.machine import Machine
from kinetostat.spec.document import LARGEST_FILE
from kinetostat.spec.errors import InputError
from kinetostat.studio.addresses import memory_of
from kinetostat.studio.design.design_tab import Workshop
from kinetostat.studio.elements import refuse
from kinetostat.studio.menus import serve_pictures
from kinetostat.studio.page import StudioPage
from kinetostat.studio.session import Memory

LARGEST_BODY = LARGEST_FILE + (64 << 10)
"""Bytes of a request: a machine file and what a form adds to it."""
PROTECTION = {
    "content-security-policy": (
        "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; object-src 'none'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    ),
    "x-frame-options": "DENY",
    "cross-origin-resource-policy": "same-origin",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
}
"""Headers of every answer: the page may not be framed, and it may load and send nothing elsewhere. Vue compiles its
templates in the browser, which is an evaluation."""
PACE_KEY = "kinetostat pace"
"""Key of a connection's `Pace` in its scope."""
SECONDS_OF_A_MESSAGE = 0.002
"""Seconds that a message of a tab counts at least: what the server needs to take any message."""
SECONDS_OF_A_FILE = 0.2
"""Seconds that a file sent by a tab counts: it is written to the disk and read by a process."""
MOST_TABS = 1000
"""Greatest number of tabs whose files are counted: more than one server has; they take some hundred kilobytes."""
UPLOAD_ADDRESS = re.compile(r"/_nicegui/client/([^/]+)/")
"""The address to which a tab sends files."""
SHARE_OF_A_TAB = 0.5
"""Share of the server's time that the messages of one tab may take in the long run: half is left to all others."""
SECONDS_AT_ONCE = 2.0
"""Seconds that they may take beyond that share, so that a drag of the slider is never slowed down."""
STYLE = Path(__file__).parent / "style.css"
SWITCH_SECONDS = 0.0005
"""Seconds after which a computing thread lets the event loop run: a tenth of Python's default. With many tabs, messages
would otherwise pile up until browsers take the silence for a lost connection."""
MEMORY_KEY, ADDRESSES_KEY = "machine", "addresses"
"""Keys under which the work of a tab, and its latest addresses, are remembered while the server runs."""
MOST_ADDRESSES = 60
"""Addresses that are remembered: the browser shows them with a delay, in which there may be as many."""
SECONDS_TO_CONNECT = 30.0
"""Seconds within which a page that has been loaded must open its socket: a slow phone does; an idle download would
keep memory."""
START_PERIOD = 0.02
"""Seconds between two looks whether the server listens: nobody sees them in a start of a second."""
ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="7" fill="#0b5ea8"/>'
    '<path d="M7 25h18M10 25l3-14h6l3 14M11 9h10" stroke="#fff" stroke-width="2.4" fill="none" stroke-linecap="round"/>'
    "</svg>"
)
"""The icon of the page."""


class OwnOrigin:
    """Middleware that answers only pages of this server, and lets no page of another site frame them.

    A browser says in `Origin` from which site a script opens a socket or sends a form, and in `Sec-Fetch-Site` from
    which site anything else is requested. Programs that are not browsers say neither, and are answered. The address may
    be opened from anywhere, as a link.
    """

    def __init__(self, served: ASGIApp) -> None:
        self._served = served

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on with protecting headers in its answer, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._served(scope, receive, send)
        elif not _is_foreign(dict(scope["headers"])):
            await self._served(scope, receive, _protecting_send(send))
        elif scope["type"] == "websocket":
            await receive()  # the request to connect
            await send({"type": "websocket.close", "code": 1008})
        else:
            await _refuse(_protecting_send(send), 403)


def _is_foreign(headers: dict[bytes, bytes]) -> bool:
    """Return whether a browser sends this on behalf of another site."""
    origin, host = headers.get(b"origin"), headers.get(b"host", b"").decode("latin-1")
    if origin is not None and urlsplit(origin.decode("latin-1")).netloc != host:
        return True
    is_of_other_site = headers.get(b"sec-fetch-site", b"none") not in (b"none", b"same-origin")
    is_link = (headers.get(b"sec-fetch-mode"), headers.get(b"sec-fetch-dest")) == (b"navigate", b"document")
    return is_of_other_site and not is_link


def _protecting_send(send: Send) -> Send:
    """Return a `send` that adds the headers of `PROTECTION` to an answer."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            protection = [(name.encode(), value.encode()) for name, value in PROTECTION.items()]
            message = {**message, "headers": [*message.get("headers", ()), *protection]}
        await send(message)

    return sending


async def _refuse(send: Send, status: int) -> None:
    await send({"type": "http.response.start", "status": status, "headers": [(b"content-length", b"0")]})
    await send({"type": "http.response.body", "body": b""})


class BoundedBody:
    """Middleware that cuts off requests larger than a machine file can be, while they arrive."""

    def __init__(self, served: ASGIApp, largest: int = LARGEST_BODY) -> None:
        """Pass requests of up to `largest` bytes on to `served`."""
        self._served, self._largest = served, largest

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it: by its announced length at once, otherwise once too much has arrived."""
        if scope["type"] != "http":
            await self._served(scope, receive, send)
            return
        announced = next((value for name, value in scope["headers"] if name == b"content-length"), b"0")
        if announced.isdigit() and int(announced) > self._largest:
            await _refuse(send, 413)
            return
        received_bytes = 0

        async def receive_counted() -> Message:
            nonlocal received_bytes
            message = await receive()
            received_bytes += len(message.get("body", b""))
            return message if received_bytes <= self._largest else {"type": "http.disconnect"}

        await self._served(scope, receive_counted, send)


class Pace:
    """The time that the messages of one connection have taken, and how long it must wait for it.

    The connection may take `SECONDS_AT_ONCE` seconds at once and `SHARE_OF_A_TAB` of the time in the long run.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """Begin without a debt; `now` is the clock, s."""
        self._now, self._debt, self._since = now, 0.0, now()

    def add(self, seconds: float) -> None:
        """Note that a message has taken this long."""
        now = self._now()
        self._debt = max(0.0, self._debt - SHARE_OF_A_TAB * (now - self._since)) + seconds
        self._since = now

    @property
    def wait(self) -> float:
        """Seconds to wait before the next message."""
        self.add(0.0)
        return max(0.0, (self._debt - SECONDS_AT_ONCE) / SHARE_OF_A_TAB)


class Paced:
    """Middleware that reads the messages and files of a tab more slowly where they take too much of the server's time.

    What is not read waits in the tab's own connection, so that only this tab becomes slow.
    """

    def __init__(self, served: ASGIApp) -> None:
        self._served = served
        self._paces_of_files: dict[str, Pace] = {}  # by tab, the one that sent a file last at the end

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a connection on; its messages come as fast as its `Pace` allows."""
        if scope["type"] != "websocket":
            sender = UPLOAD_ADDRESS.match(scope.get("path", "")) if scope.get("method") == "POST" else None
            if sender is not None:
                pace = self._pace_of(sender[1])
                pace.add(SECONDS_OF_A_FILE)
                await asyncio.sleep(pace.wait)
            await self._served(scope, receive, send)
            return
        pace = scope[PACE_KEY] = Pace()

        async def receive_paced() -> Message:
            pace.add(SECONDS_OF_A_MESSAGE)
            await asyncio.sleep(pace.wait)
            return await receive()

        await self._served(scope, receive_paced, send)

    def _pace_of(self, tab: str) -> Pace:
        """Return the pace at which a tab sends files; those that sent nothing for the longest time are forgotten."""
        pace = self._paces_of_files.pop(tab) if tab in self._paces_of_files else Pace()
        self._paces_of_files[tab] = pace
        if len(self._paces_of_files) > MOST_TABS:
            del self._paces_of_files[next(iter(self._paces_of_files))]
        return pace


def timed_handler(handler: Callable[[str, Any], None], scope_of: Callable[[str], Scope]) -> Callable[[str, Any], None]:
    """Return a handler of messages that adds the time it takes to the pace of the connection.

    Args:
        handler: the function that takes a message, by the name of its connection and its content.
        scope_of: returns the scope of a connection by its name.
    """

    def handle(connection: str, message: Any) -> None:
        start = time.perf_counter()
        try:
            handler(connection, message)
        finally:
            pace = scope_of(connection).get(PACE_KEY)
            if pace is not None:
                pace.add(time.perf_counter() - start)

    return handle


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
    sys.setswitchinterval(SWITCH_SECONDS)
    app.on_startup(lambda: background_tasks.create(_announce(host, port)))
    prepare(machine, name, Workshop(state), LOCAL_HOSTS if host in LOCAL_HOSTS else ())
    # Sockets only: what a tab sends by requests could not be slowed down without the others noticing.
    core.sio.eio.transports = app.config.socket_io_js_transports = ["websocket"]
    ui.run(
        host=host, port=port, title="kinetostat studio", favicon=ICON, show=browser, reload=False, tailwind=False,
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
        await asyncio.sleep(START_PERIOD)
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
        await client.connected(timeout=SECONDS_TO_CONNECT)
    except ClientConnectionTimeout:
        client.delete()
    if client.is_deleted:
        return  # loaded by something that is not a browser, or left at once
    remembered = app.storage.tab
    query = client.request.url.query
    own_addresses: deque[str] = remembered.setdefault(ADDRESSES_KEY, deque(maxlen=MOST_ADDRESSES))
    memory, problem = remembered.get(MEMORY_KEY), ""
    if (
        query and query not in own_addresses
    ):  # a link; after a reload, the tab's own memory knows what can be undone, too
        try:
            memory = await run.io_bound(memory_of, parse_qsl(query, keep_blank_values=True))
        except InputError as error:
            problem = str(error)

    def remember(memory: Memory, address: str) -> None:
        remembered[MEMORY_KEY] = memory
        own_addresses.append(address)

    StudioPage(memory or Memory(machine, name), remember, workshop)
    if problem:
        refuse(problem)

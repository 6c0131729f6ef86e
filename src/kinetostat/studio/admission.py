"""Admission of requests to the page: none from other sites or in frames, none too large, and none so often that other
tabs suffer.

It knows requests and sockets only; what is on the page is the business of `page`.
"""

import asyncio
import re
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from kinetostat.spec.document import LARGEST_FILE

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
PACE = "kinetostat pace"
"""Key of a connection's `Pace` in its scope."""
MESSAGE = 0.002
"""Seconds that a message of a tab counts at least: what the server needs to take any message."""
SENDING = 0.2
"""Seconds that a file sent by a tab counts: it is written to the disk and read by a process."""
MOST_TABS = 1000
"""Tabs of which it is remembered how much they have sent: some kilobytes, and more than one server has."""
TAB = re.compile(r"/_nicegui/client/([^/]+)/")
"""The address to which a tab sends files."""
SHARE = 0.5
"""Share of the server's time that the messages of one tab may take in the long run: half is left to all others."""
CREDIT = 2.0
"""Seconds that they may take at once, so that a drag of the slider is never refused."""


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
        elif not _foreign(dict(scope["headers"])):
            await self._served(scope, receive, _protecting_send(send))
        elif scope["type"] == "websocket":
            await receive()  # the request to connect
            await send({"type": "websocket.close", "code": 1008})
        else:
            await _refuse(_protecting_send(send), 403)


def _foreign(headers: dict[bytes, bytes]) -> bool:
    """Return whether a browser sends this on behalf of another site."""
    origin, host = headers.get(b"origin"), headers.get(b"host", b"").decode("latin-1")
    if origin is not None and urlsplit(origin.decode("latin-1")).netloc != host:
        return True
    elsewhere = headers.get(b"sec-fetch-site", b"none") not in (b"none", b"same-origin")
    link = (headers.get(b"sec-fetch-mode"), headers.get(b"sec-fetch-dest")) == (b"navigate", b"document")
    return elsewhere and not link


def _protecting_send(send: Send) -> Send:
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
        seen = 0

        async def counted() -> Message:
            nonlocal seen
            message = await receive()
            seen += len(message.get("body", b""))
            return message if seen <= self._largest else {"type": "http.disconnect"}

        await self._served(scope, counted, send)


class Pace:
    """The time that the messages of one connection have taken, and how long it must wait for it.

    The connection may take `CREDIT` seconds at once and `SHARE` of the time in the long run.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """Begin without a debt; `now` is the clock, s."""
        self._now, self._debt, self._since = now, 0.0, now()

    def add(self, seconds: float) -> None:
        """Note that a message has taken this long."""
        now = self._now()
        self._debt = max(0.0, self._debt - SHARE * (now - self._since)) + seconds
        self._since = now

    @property
    def wait(self) -> float:
        """Seconds to wait before the next message."""
        self.add(0.0)
        return max(0.0, (self._debt - CREDIT) / SHARE)


class Paced:
    """Middleware that reads the messages and files of a tab more slowly where they take too much of the server's time.

    What is not read waits in the tab's own connection, so that only this tab becomes slow.
    """

    def __init__(self, served: ASGIApp) -> None:
        self._served = served
        self._sending: dict[str, Pace] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a connection on; its messages come as fast as its `Pace` allows."""
        if scope["type"] != "websocket":
            sender = TAB.match(scope.get("path", "")) if scope.get("method") == "POST" else None
            if sender is not None:
                pace = self._pace_of(sender[1])
                pace.add(SENDING)
                await asyncio.sleep(pace.wait)
            await self._served(scope, receive, send)
            return
        pace = scope[PACE] = Pace()

        async def paced() -> Message:
            pace.add(MESSAGE)
            await asyncio.sleep(pace.wait)
            return await receive()

        await self._served(scope, paced, send)

    def _pace_of(self, tab: str) -> Pace:
        """Return the pace at which a tab sends files; those that sent nothing for the longest time are forgotten."""
        pace = self._sending.pop(tab) if tab in self._sending else Pace()
        self._sending[tab] = pace
        if len(self._sending) > MOST_TABS:
            del self._sending[next(iter(self._sending))]
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
            pace = scope_of(connection).get(PACE)
            if pace is not None:
                pace.add(time.perf_counter() - start)

    return handle

"""Requests that reach the studio's page: of its own pages and of programs, never of other sites; and their pace."""

import asyncio

import httpx
import pytest
from starlette.responses import PlainTextResponse

pytest.importorskip("nicegui", reason="the extra kinetostat[studio] is not installed")

from kinetostat.studio.serving import (
    PACE_KEY,
    SECONDS_AT_ONCE,
    SECONDS_OF_A_FILE,
    SHARE_OF_A_TAB,
    OwnOrigin,
    Pace,
    Paced,
    timed_handler,
)

HOST = "127.0.0.1:8000"


def answer(headers, served=None):
    async def asked():
        transport = httpx.ASGITransport(OwnOrigin(served or PlainTextResponse("page")))
        async with httpx.AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
            return await client.get("/", headers=headers)

    return asyncio.run(asked())


@pytest.mark.parametrize(
    ("headers", "code"),
    [
        ({}, 200),
        ({"Origin": f"http://{HOST}"}, 200),
        ({"Sec-Fetch-Site": "same-origin", "Sec-Fetch-Mode": "cors", "Sec-Fetch-Dest": "empty"}, 200),
        ({"Sec-Fetch-Site": "none", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}, 200),
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}, 200),
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"}, 403),
        ({"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "script"}, 403),
        ({"Origin": "http://127.0.0.1:9000"}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
    ],
)
def test_only_pages_of_this_server_and_links_to_it_are_answered(headers, code):
    assert answer(headers).status_code == code


def test_no_page_may_frame_an_answer():
    headers = answer({}).headers
    assert headers["x-frame-options"] == "DENY"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]


def socket(served, origin, messages=()):
    """What a server sends to a browser that opens a socket and then sends messages."""
    sent, waiting = [], [{"type": "websocket.connect"}, *messages]
    scope = {"type": "websocket", "headers": [(b"host", HOST.encode()), (b"origin", origin)]}

    async def receive():
        return waiting.pop(0)

    async def send(message):
        sent.append(message)

    asyncio.run(served(scope, receive, send))
    return sent


async def accepting(scope, receive, send):
    await receive()
    await send({"type": "websocket.accept"})


def test_a_socket_is_for_pages_of_this_server():
    assert socket(OwnOrigin(accepting), f"http://{HOST}".encode()) == [{"type": "websocket.accept"}]
    assert socket(OwnOrigin(accepting), b"http://evil.example") == [{"type": "websocket.close", "code": 1008}]


def test_a_tab_may_take_its_credit_at_once_and_its_share_in_the_long_run():
    time = 0.0
    pace = Pace(lambda: time)
    pace.add(SECONDS_AT_ONCE)
    assert pace.wait == 0.0
    pace.add(1.0)
    assert pace.wait == pytest.approx(1.0 / SHARE_OF_A_TAB)
    time = 1.0 / SHARE_OF_A_TAB
    assert pace.wait == pytest.approx(0.0)
    time = 1e6
    pace.add(SECONDS_AT_ONCE)  # what was not used before is not saved up
    assert pace.wait == 0.0


def test_the_time_of_a_message_counts_for_its_own_connection(monkeypatch):
    """A tab whose messages took ten seconds waits before its next one; the clock here stands still."""
    waits, pause = [], asyncio.sleep

    async def noting(seconds):
        waits.append(seconds)
        await pause(0)

    monkeypatch.setattr("kinetostat.studio.serving.asyncio.sleep", noting)

    async def slow(scope, receive, send):
        await receive()
        timed_handler(lambda *_: scope[PACE_KEY].add(10.0), lambda _: scope)("tab", "message")
        await receive()

    socket(Paced(slow), b"", [{"type": "websocket.receive"}])
    assert waits[0] == 0.0
    assert waits[1] == pytest.approx((10.0 - SECONDS_AT_ONCE) / SHARE_OF_A_TAB, rel=0.01)


def test_a_tab_that_sends_many_files_waits_and_others_do_not(monkeypatch):
    waits, pause = {}, asyncio.sleep
    app = Paced(PlainTextResponse("sent"))

    async def noting(seconds):
        waits.setdefault(sender, []).append(seconds)
        await pause(0)

    monkeypatch.setattr("kinetostat.studio.serving.asyncio.sleep", noting)

    async def send_files():
        nonlocal sender
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
            for sender in ("hostile",) * 40 + ("other",):
                await client.post(f"/_nicegui/client/{sender}/upload/7", content=b"x")

    sender = ""
    asyncio.run(send_files())
    assert waits["hostile"][0] == waits["other"][0] == 0.0
    assert waits["hostile"][-1] == pytest.approx((40 * SECONDS_OF_A_FILE - SECONDS_AT_ONCE) / SHARE_OF_A_TAB, rel=0.1)

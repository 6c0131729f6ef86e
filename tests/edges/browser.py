"""A studio that is really served, and a real headless Chromium that looks at it and writes down what it asks for."""

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from threading import Event, Thread
from typing import Any
from urllib.parse import urlparse

import pytest
from playwright import sync_api

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
SOFTWARE_GRAPHICS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
PATIENCE = 600_000
"""Milliseconds for a step, half of what pytest gives a whole test: on a busy machine, software graphics are slow."""
OPENINGS = 30
"""Times that a list is opened at most; each time it has such a part of a step to show what it offers."""


def chromium() -> str | None:
    """Where a Chromium is, if there is one: CHROMIUM, or on the path."""
    return os.environ.get("CHROMIUM") or next((path for name in NAMES if (path := shutil.which(name))), None)


needs_chromium = pytest.mark.skipif(chromium() is None, reason="there is no Chromium on this machine")


@contextmanager
def served(machine: str, state: str | None = None) -> Iterator[str]:
    """The address of a studio in a process of its own; searches and favourites live in `state`."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = ["studio", machine, "--no-browser", "--port", str(port), *(["--state", state] if state else [])]
    code = f"import sys; from kinetostat.cli import main; sys.exit(main({words!r}))"
    outside = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, env=outside)
    said: list[str] = []
    ready = Event()

    def listen() -> None:
        """Read all that it says, so that it never waits for a reader."""
        for line in process.stderr:
            said.append(line)
            if "Studio:" in line:
                ready.set()
        ready.set()

    listener = Thread(target=listen)
    listener.start()
    try:
        ready.wait()
        assert process.poll() is None, "".join(said)
        yield f"http://127.0.0.1:{port}/"
    finally:
        process.terminate()
        process.wait()
        listener.join()
        process.stderr.close()
    assert len(said) == 1, "".join(said)


@dataclass
class Watched:
    """A tab of the browser, and what is to be said against it.

    Attributes:
        tab: of playwright.
        hosts: of all requests.
        complaints: errors in the console and on the page.
    """

    tab: Any
    hosts: set[str] = field(default_factory=set)
    complaints: list[str] = field(default_factory=list)

    def open(self, address: str) -> None:
        """Go to the studio and wait until the machine is drawn and analysed."""
        self.tab.goto(address)
        self.tab.wait_for_function("document.querySelector('.machine-view')?.dataset.solids > 10")
        self.tab.wait_for_function("document.querySelector('.headline')?.innerText.includes('C z')")
        self.tab.wait_for_function("document.querySelector('.plot')?.dataset.shown > 0")

    def blameless(self, address: str) -> None:
        """Nothing was wrong, and nobody else was asked for anything."""
        assert not self.complaints
        assert {host for host in self.hosts if host} == {urlparse(address).netloc}

    def text(self, where: str) -> str:
        """The text of an element."""
        return self.tab.locator(where).first.inner_text()

    def choose(self, label: str, option: str) -> None:
        """Choose from a list; a busy page may let the list close again while it opens."""
        wanted = self.tab.get_by_role("option", name=option, exact=True)
        for _ in range(OPENINGS):
            self.tab.get_by_role("combobox", name=label, exact=True).click()
            try:
                wanted.click(timeout=PATIENCE / OPENINGS)
            except sync_api.TimeoutError:
                continue
            return
        raise AssertionError(f"the list {label} never offers {option}")

    def until_changed(self, where: str, before: str) -> str:
        """The text of an element once it is another."""
        self.tab.wait_for_function(
            "([where, before]) => document.querySelector(where).innerText !== before", arg=[where, before]
        )
        return self.text(where)


@contextmanager
def browser() -> Iterator[Any]:
    """A function that opens a new, watched tab; everything is closed at the end."""
    with sync_api.sync_playwright() as play:
        running = play.chromium.launch(executable_path=chromium(), args=list(SOFTWARE_GRAPHICS), timeout=PATIENCE)

        def new_tab(width: int = 1280, height: int = 800, scale: float = 1.0) -> Watched:
            tab = running.new_page(viewport={"width": width, "height": height}, device_scale_factor=scale)
            tab.set_default_timeout(PATIENCE)
            watched = Watched(tab)
            tab.on("request", lambda request: watched.hosts.add(urlparse(request.url).netloc))
            tab.on("websocket", lambda channel: watched.hosts.add(urlparse(channel.url).netloc))
            tab.on("pageerror", lambda error: watched.complaints.append(str(error)))
            tab.on("console", lambda said: watched.complaints.append(said.text) if said.type == "error" else None)
            return watched

        yield new_tab
        running.close()

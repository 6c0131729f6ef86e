"""A studio page without a browser: opened, worked with, and waited for until nothing is being computed any more."""

import asyncio
import gc
import logging
from collections.abc import Awaitable, Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx
import pytest
from nicegui import Client, background_tasks, core, ui
from nicegui.elements.upload_files import SmallFileUpload
from nicegui.events import GenericEventArguments, handle_event
from nicegui.testing import User
from nicegui.testing.user_simulation import user_simulation
from watchfiles import awatch

from kinetostat.machine.loading import bundled, load
from kinetostat.studio import elements
from kinetostat.studio.design.design_tab import Workshop
from kinetostat.studio.serving import show
from studies import LOOK

KINDS = (elements.MachineView, elements.MapView, elements.CurveView, elements.FrontView)
"""What is drawn in the browser."""
PATIENCE = 6000
"""Tenths of a second in which a page appears, half of what pytest gives a whole test."""


TIMERS = ("RunPanel.refresh", "Player._step")
"""What timers of a page call, until it is closed or paused."""


def _of_the_studio(task: str) -> bool:
    """Whether a task ends by itself once what was asked for is done; a timer never does."""
    return ("studio" in task or "upload_field" in task) and not any(timer in task for timer in TIMERS)


class Page:
    """What a test does on a page, and what it sees there."""

    def __init__(self, user: User, calls: list[tuple[str, str, Any]]) -> None:
        self.user, self.calls = user, calls

    def one(self, mark: str) -> Any:
        """The element with this mark."""
        (element,) = [e for e in self.user.client.elements.values() if mark in (" ".join(e._markers), *e._markers)]
        return element

    async def settled(self) -> None:
        """Until nothing is computed any more."""
        while tasks := [t for t in background_tasks.running_tasks if _of_the_studio(t.get_name())]:
            await asyncio.wait(tasks)

    async def until(self, condition: Callable[[], bool]) -> None:
        """Until something holds that the end of a computation brings about, whatever else is being computed."""
        while not condition():
            tasks = [t for t in background_tasks.running_tasks if _of_the_studio(t.get_name())]
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)

    async def send(self, mark: str, event: str, args: Any = None) -> None:
        """An event of an element, as a browser sends it, and all that follows from it."""
        element = self.one(mark)
        with self.user.client:
            for listener in [one for one in element._event_listeners.values() if one.type == event]:
                handle_event(
                    listener.handler, GenericEventArguments(sender=element, client=self.user.client, args=args)
                )
        await self.settled()

    async def glance(self) -> None:
        """Let the page look at its searches, as its timer does."""
        with self.user.client:
            timer = next(e for e in self.user.client.elements.values() if isinstance(e, ui.timer) and e.active)
            timer.callback()
        await self.settled()

    async def watching(self, condition: Callable[[], bool], folder: Path) -> None:
        """Let the page look at its searches whenever their folder changes, until something holds."""
        changes = awatch(folder, yield_on_timeout=True, rust_timeout=LOOK)
        while not condition():
            await anext(changes)
            await self.glance()

    async def front(self, tab: str) -> None:
        """Bring a linked view to the front."""
        with self.user.client:
            self.one(f"tab-{tab}").tabs.value = tab
        await self.settled()

    async def upload(self, name: str, content: bytes, mark: str = "upload") -> None:
        """Send a machine file, or a file to another place."""
        with self.user.client:
            await self.one(mark).handle_uploads([SmallFileUpload(name, "application/toml", content)])
        await self.settled()

    async def choose(self, mark: str, value: Any) -> None:
        """Choose a value in a list, a toggle or a box."""
        with self.user.client:
            self.one(mark).value = value
        await self.settled()

    async def another(self, address: str = "/") -> "Page":
        """Another tab of the same browser, on the same server."""
        client = httpx.AsyncClient(transport=httpx.ASGITransport(core.app), base_url="http://test")
        return await opened(User(client), self.calls, address)

    async def again(self, address: str = "/") -> None:
        """Load the page of this tab again."""
        await self.user.open(address)
        await self.user.should_see(marker="status", retries=PATIENCE)
        await self.settled()

    @property
    def dark(self) -> bool | None:
        """Whether it is dark; None where the system decides."""
        (mode,) = [e for e in self.user.client.elements.values() if isinstance(e, ui.dark_mode)]
        return mode.value

    def shown(self, what: str, method: str) -> Any:
        """The last argument that a drawing was given."""
        return next(args for name, called, args in reversed(self.calls) if (name, called) == (what, method))[0]


@contextmanager
def nothing_fails() -> Iterator[None]:
    """No work of the page may fail, in whatever thread: it would only be logged."""
    failed: list[logging.LogRecord] = []
    noting = logging.Handler(logging.ERROR)
    noting.emit = failed.append  # type: ignore[method-assign]
    log = logging.getLogger("kinetostat")
    log.addHandler(noting)
    try:
        yield
    finally:
        log.removeHandler(noting)
    assert not failed, failed[0].exc_text or failed[0].getMessage()


async def opened(user: User, calls: list[tuple[str, str, Any]], address: str = "/") -> Page:
    """The page in a new tab, once everything is computed."""
    page = Page(user, calls)
    await page.again(address)
    return page


@contextmanager
def recorded(calls: list[tuple[str, str, Any]]) -> Iterator[None]:
    """Note what the page tells its drawings."""
    original = {kind: kind.run_method for kind in KINDS}

    def noting(kind: type) -> Callable[..., Any]:
        def run_method(self: Any, name: str, *args: Any, **options: Any) -> Any:
            calls.append((kind.__name__, name, args))
            return original[kind](self, name, *args, **options)

        return run_method

    with pytest.MonkeyPatch.context() as patch:
        for kind in original:
            patch.setattr(kind, "run_method", noting(kind))
        yield


async def outboxes_ended() -> None:
    """End what sends to the pages: where it wakes while NiceGUI cancels it, NiceGUI waits two seconds for it."""
    for client in Client.instances.values():
        client.outbox.stop()
    await asyncio.gather(*(t for t in background_tasks.running_tasks if t.get_name().startswith("outbox loop")))


def on_page(
    steps: Callable[[Page], Awaitable[None]],
    machine: str = "zhang-gosselin-4dof",
    settings: Any = (),
    state: Path | None = None,
) -> None:
    """Open a page with a machine and do something on it; searches and favourites live in `state`."""

    async def run(workshop: Workshop) -> None:
        async def root() -> None:
            await show(load(machine, settings), machine if machine in bundled() and not settings else "", workshop)

        calls: list[tuple[str, str, Any]] = []
        failed: BaseException | None = None
        with closing(workshop), recorded(calls), nothing_fails():
            async with user_simulation(root=root) as user:
                try:
                    await steps(await opened(user, calls))
                except BaseException as error:  # NiceGUI ends its tasks only where all went well; they would run on
                    failed = error
                await outboxes_ended()
            if failed is not None:
                raise failed

    gc.freeze()  # NiceGUI collects garbage before and after each page: all that is older need not be looked through
    with TemporaryDirectory() as own:
        asyncio.run(run(Workshop(state or Path(own))))

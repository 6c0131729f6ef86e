"""Work in threads, so that the page keeps responding. Only the latest request is computed; older ones are dropped.

A lane knows neither machines nor elements: it gets the function to run and the function that shows the result.
"""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

from nicegui import Client, background_tasks, context

Request = TypeVar("Request")
Result = TypeVar("Result")

THREADS = 4
"""Threads for all pages: Python computes one thing at a time, so more of them would only delay the event loop."""
THREADS_PER_PAGE = 2
"""Threads that one page may use at a time, so that a page with a slow machine leaves some to the others."""
SECONDS_BEFORE_BUSY = 0.3
"""Seconds that a computation may take before the page says that it is busy: a message for less would only flicker."""

log = logging.getLogger("kinetostat")


class Lane(Generic[Request, Result]):
    """One kind of work of one page: at most one request in progress, at most one waiting."""

    def __init__(
        self,
        work: Callable[[Request], Result],
        deliver: Callable[[Request, Result], None],
        show_failure: Callable[[Exception], None] | None = None,
        show_waiting: Callable[[], None] = lambda: None,
    ) -> None:
        """Create an idle lane of the page that is being built.

        Args:
            work: computes the result of a request, in a thread, or None if there is nothing to show; it must not touch
                the page.
            deliver: shows the result, on the event loop.
            show_failure: says on the page that `work` has raised an exception; by default the page's exception handler.
            show_waiting: says on the page that `work` takes longer than people wait without a word.
        """
        self._work, self._deliver, self._show_waiting = work, deliver, show_waiting
        self._page = context.client
        self._show_failure = show_failure or self._page.handle_exception
        self._threads = _threads_of(self._page)
        self._waiting: list[Request] = []  # one at most
        self.busy = False
        self._open = True

    def ask(self, request: Request) -> None:
        """Compute this request next, in the place of the one that is waiting; a page that is gone asks in vain."""
        if not self._open:
            return
        self._waiting = [request]
        if not self.busy:
            self.busy = True
            background_tasks.create(self._run(), name="studio lane")

    def close(self) -> None:
        """Stop delivering, because the page is gone. A computation in progress ends, but its result is dropped."""
        self._open = False
        self._waiting.clear()

    async def _run(self) -> None:
        try:
            while self._waiting:
                await self._next()
        finally:
            self.busy = False

    async def _next(self) -> None:
        """Compute the latest request, once the page has a thread for it, and deliver the result."""
        async with self._threads:
            if not self._waiting:
                return
            request = self._waiting.pop()
            try:
                computation = asyncio.get_running_loop().run_in_executor(_executor(), self._work, request)
                ended, _ = await asyncio.wait([computation], timeout=SECONDS_BEFORE_BUSY)
                if self._open and not ended:
                    with self._page:
                        self._show_waiting()
                result = await computation
                if self._open and result is not None:
                    with self._page:
                        self._deliver(request, result)
            except Exception as error:
                log.exception("the studio could not compute or show something")
                if self._open:
                    with self._page:
                        self._show_failure(error)


def as_sentence(error: Exception) -> str:
    """Return what a page says about an unexpected error."""
    return f"This is an error of the program; please report it ({type(error).__name__}: {error})."


@cache
def _threads_by_page() -> "WeakKeyDictionary[Client, asyncio.Semaphore]":
    """Return the threads that each page may use; a page that is gone is forgotten."""
    return WeakKeyDictionary()


def _threads_of(page: Client) -> asyncio.Semaphore:
    """Return the semaphore that all lanes of a page share, so that they use `THREADS_PER_PAGE` together."""
    return _threads_by_page().setdefault(page, asyncio.Semaphore(THREADS_PER_PAGE))


@cache
def _executor() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(THREADS, "studio")

"""Work in threads, so that the page answers meanwhile; only the latest request is computed, older ones are dropped.

A lane knows neither machines nor elements: it gets the function to run and the function that shows the result.
"""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Generic, TypeVar

from nicegui import background_tasks

Request = TypeVar("Request")
Result = TypeVar("Result")

WORKERS = 2
"""Threads for all pages: Python computes one thing at a time, so more of them would only delay the event loop."""

log = logging.getLogger("kinetostat")


class Lane(Generic[Request, Result]):
    """One kind of work of one page: at most one request in progress, at most one waiting."""

    def __init__(self, work: Callable[[Request], Result], deliver: Callable[[Request, Result], None]) -> None:
        """Create an idle lane.

        Args:
            work: computes the result of a request, in a thread; it must not touch the page.
            deliver: shows the result, on the event loop.
        """
        self._work, self._deliver = work, deliver
        self._waiting: list[Request] = []
        self.busy = False
        self._open = True

    def ask(self, request: Request) -> None:
        """Compute this next, in place of the request that is waiting."""
        self._waiting = [request]
        if not self.busy and self._open:
            self.busy = True
            background_tasks.create(self._run(), name="studio lane")

    def close(self) -> None:
        """Deliver nothing any more, because the page is gone; what is in progress ends unseen."""
        self._open = False
        self._waiting.clear()

    async def _run(self) -> None:
        try:
            while self._waiting:
                request = self._waiting.pop()
                result = await asyncio.get_running_loop().run_in_executor(_workers(), self._work, request)
                if self._open and result is not None:
                    self._deliver(request, result)
        except Exception:
            log.exception("the studio could not compute or show something")
            raise
        finally:
            self.busy = False


@cache
def _workers() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(WORKERS, "studio")

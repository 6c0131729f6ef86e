"""Work off the event loop, the latest wish first: what was asked for in between is never computed."""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Generic, TypeVar

from nicegui import background_tasks

Wish = TypeVar("Wish")
Result = TypeVar("Result")

WORKERS = 2
"""Threads of all pages: Python computes one thing at a time, and more would only keep the event loop waiting."""

log = logging.getLogger("kinetostat")


class Lane(Generic[Wish, Result]):
    """One kind of work of one page: at most one under way, at most one waiting."""

    def __init__(self, work: Callable[[Wish], Result], deliver: Callable[[Wish, Result], None]) -> None:
        """A lane.

        Args:
            work: from a wish to its result, in a thread; touches no page.
            deliver: shows the result, on the event loop.
        """
        self._work, self._deliver = work, deliver
        self._waiting: list[Wish] = []
        self.busy = False
        self._open = True

    def ask(self, wish: Wish) -> None:
        """Compute this next, instead of what else is waiting."""
        self._waiting = [wish]
        if not self.busy and self._open:
            self.busy = True
            background_tasks.create(self._run(), name="studio lane")

    def close(self) -> None:
        """Finish what is under way and deliver nothing any more: the page is gone."""
        self._open = False
        self._waiting.clear()

    async def _run(self) -> None:
        try:
            while self._waiting:
                wish = self._waiting.pop()
                result = await asyncio.get_running_loop().run_in_executor(_workers(), self._work, wish)
                if self._open and result is not None:
                    self._deliver(wish, result)
        except Exception:
            log.exception("the studio could not compute or show something")
            raise
        finally:
            self.busy = False


@cache
def _workers() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(WORKERS, "studio")

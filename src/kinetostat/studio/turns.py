"""Work in processes of their own, for all tabs: a few at a time, in the order of asking, one of each tab.

It knows neither files nor pages. A tab that asks for more waits for nothing: it is refused, so that no queue grows and
no other tab stands behind its work.
"""

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Hashable
from contextlib import asynccontextmanager, suppress

from kinetostat.spec.errors import InputError

MODESTY = 10
"""How much later than the pages such a process gets its time, as `nice` counts."""


class Turns:
    """Who works, and who waits."""

    def __init__(self, at_a_time: int, refusal: str) -> None:
        """Create an empty queue.

        Args:
            at_a_time: works of all tabs that are done at a time.
            refusal: what is said to a tab that has one already.
        """
        self._places, self._refusal = asyncio.Semaphore(at_a_time), refusal
        self._tabs: set[Hashable] = set()

    @asynccontextmanager
    async def turn(self, tab: Hashable) -> AsyncIterator[None]:
        """Wait for a place; those who came first are served first.

        Args:
            tab: names the tab.

        Raises:
            InputError: this tab works or waits already.
        """
        if tab in self._tabs:
            raise InputError(self._refusal)
        self._tabs.add(tab)
        try:
            async with self._places:
                yield
        finally:
            self._tabs.discard(tab)


def make_modest(process: int) -> None:
    """Let a process, by its number, give way to the pages, where the system can."""
    if sys.platform != "win32":
        with suppress(ProcessLookupError):  # it has ended already
            os.setpriority(os.PRIO_PROCESS, process, MODESTY)

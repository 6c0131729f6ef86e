"""A progress bar on a terminal, silence elsewhere. Work reports to it as (done, total)."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from kinetostat.engine.batch import Progress, silent

MEMORY = 600.0
"""Seconds of progress from which the remaining time is estimated: several chunks, also where each takes minutes."""


@contextmanager
def progress_bar(what: str) -> Iterator[Progress]:
    """A bar on stderr with the remaining time; nothing where stderr is not a terminal."""
    with telling_bar(what) as tell:
        yield lambda done, total: tell(done, total, "")


@contextmanager
def telling_bar(what: str) -> Iterator[Callable[[int, int, str], None]]:
    """A bar that also says how things stand: told (done, total, a few words)."""
    if not sys.stderr.isatty():
        yield lambda done, total, _: silent(done, total)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True, speed_estimate_period=MEMORY) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total, said: bar.update(
            task, completed=done, total=total, description=f"{what} {said}".rstrip()
        )

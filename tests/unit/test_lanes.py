"""Work of the studio in threads: a page that is gone is neither shown anything nor worked for."""

import asyncio
import threading
from contextlib import AbstractContextManager
from types import SimpleNamespace

from kinetostat.studio import lanes


class Page(AbstractContextManager):
    """Stands for a page in the browser."""

    def __exit__(self, *_):
        return None

    def handle_exception(self, error):
        raise error


def test_a_page_that_is_closed_accepts_no_work(monkeypatch):
    """Its computation in progress ends without a word; what was waiting, and what is asked later, is never begun."""
    begun, shown, tasks = [], [], []
    started, released = threading.Event(), threading.Event()

    def work(request):
        begun.append(request)
        started.set()
        released.wait()
        return request

    async def steps():
        create = SimpleNamespace(create=lambda job, name: tasks.append(asyncio.create_task(job, name=name)))
        monkeypatch.setattr(lanes, "background_tasks", create)
        monkeypatch.setattr(lanes, "context", SimpleNamespace(client=Page()))
        lane = lanes.Lane(work, lambda *result: shown.append(result))
        lane.ask("in progress")
        await asyncio.to_thread(started.wait)
        lane.ask("waiting")
        lane.close()
        lane.ask("too late")
        released.set()
        await asyncio.gather(*tasks)
        lane.ask("much too late")
        assert not lane.busy

    asyncio.run(steps())
    assert (begun, shown, len(tasks)) == (["in progress"], [], 1)

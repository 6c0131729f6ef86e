"""Files that a browser sends are read in a process of their own, within limits of time and memory."""

import asyncio
import sys
from types import SimpleNamespace

import pytest
from nicegui.client import ClientConnectionTimeout

from kinetostat.machine.loading import bundled
from kinetostat.spec.errors import InputError
from kinetostat.studio import processes, serving
from kinetostat.studio.processes import Turns
from refusals import refused


def sent(data, kind="machine"):
    asyncio.run(processes.check_upload(kind, data, "mine.toml", "tab"))


def test_a_machine_passes():
    sent(bundled()["tripteron"].encode())


@pytest.mark.parametrize(
    ("kind", "data", "words"), [("machine", b"\xff", "not text"), ("study", b"a = 1", "mine.toml")]
)
def test_a_refusal_is_that_of_the_reader(kind, data, words):
    with refused(words):
        sent(data, kind)


HOG = """
import sys
from kinetostat.studio import processes, serving
from kinetostat.studio.processes import Turns
processes.limit_process(SECONDS, processes.MEMORY_TO_READ)
taken = []
while True:
    {work}
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limits")
@pytest.mark.parametrize("work", ["taken.append(bytearray(1 << 26))", "pass"], ids=["memory", "time"])
def test_what_exceeds_the_limits_is_refused_in_a_sentence(work, tmp_path, monkeypatch):
    """Such a file is not known; a hog in the place of the reader shows that the limits hold."""
    (tmp_path / "hog.py").write_text(HOG.format(work=work).replace("SECONDS", "3"))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
    monkeypatch.setattr(processes, "READING_PROGRAM", "hog")
    with refused("or stops the program that reads it; a machine file is a short TOML text"):
        sent(b"")


def test_a_tab_that_sends_many_files_is_refused_and_others_do_not_stand_behind_it(monkeypatch):
    """One tab sends ten files at once, then another tab one: two files are read, and nine are refused at once."""
    read = []
    monkeypatch.setattr(processes, "READING", Turns(1, "one after the other."))
    whole = asyncio.create_subprocess_exec

    async def noted(*words, **more):
        read.append(words[-1])
        return await whole(*words, **more)

    monkeypatch.setattr(asyncio, "create_subprocess_exec", noted)

    async def sent_by(tab, name):
        try:
            await processes.check_upload("machine", b"a = 1", name, tab)
        except InputError as refusal:
            return str(refusal)

    async def all_at_once():
        return await asyncio.gather(
            *(sent_by("hostile", f"{n}.toml") for n in range(10)), sent_by("other", "mine.toml")
        )

    *hostile, other = asyncio.run(all_at_once())
    assert read == ["0.toml", "mine.toml"]
    assert hostile[1:] == ["one after the other."] * 9
    assert "mine.toml" in other


def test_turns_go_in_order_and_a_tab_may_ask_again_after_its_turn():
    done, turns = [], Turns(1, "wait.")

    async def works(tab):
        async with turns.turn(tab):
            done.append(tab)
            await asyncio.sleep(0)

    async def twice():
        for _ in range(2):
            await asyncio.gather(*map(works, "abc"))

    asyncio.run(twice())
    assert done == list("abcabc")


def test_a_page_that_opens_no_socket_is_forgotten_without_an_error(monkeypatch):
    """A page that a program loads is built for nobody: it waits for its socket, and then leaves nothing behind."""

    class Loaded:
        id, is_deleted = "loaded", False

        async def connected(self, **_):
            raise ClientConnectionTimeout(self)

        def delete(self):
            self.is_deleted = True

    page = Loaded()
    fake = SimpleNamespace(add_css=lambda _: None, context=SimpleNamespace(client=page))
    monkeypatch.setattr(serving, "ui", fake)
    asyncio.run(serving.show(None, "", None))
    assert page.is_deleted

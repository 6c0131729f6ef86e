"""Files that a browser sends are read in a process of their own, within limits of time and memory."""

import asyncio
import sys

import pytest

from kinetostat.machine.loading import bundled
from kinetostat.spec.errors import InputError
from kinetostat.studio import uploads


def sent(data, kind="machine"):
    asyncio.run(uploads.check_upload(kind, data, "mine.toml"))


def test_a_machine_passes():
    sent(bundled()["tripteron"].encode())


@pytest.mark.parametrize(
    ("kind", "data", "words"), [("machine", b"\xff", "not text"), ("study", b"a = 1", "mine.toml")]
)
def test_a_refusal_is_that_of_the_reader(kind, data, words):
    with pytest.raises(InputError, match=words):
        sent(data, kind)


HOG = """
import sys
from kinetostat.studio import uploads
uploads._limit()
taken = []
while True:
    {work}
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limits")
@pytest.mark.parametrize("work", ["taken.append(bytearray(1 << 26))", "pass"], ids=["memory", "time"])
def test_what_exceeds_the_limits_is_refused_in_a_sentence(work, tmp_path, monkeypatch):
    """Such a file is not known; a hog in the place of the reader shows that the limits hold."""
    (tmp_path / "hog.py").write_text(
        HOG.format(work=work).replace("uploads._limit()", "uploads.SECONDS = 3; uploads._limit()")
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
    monkeypatch.setattr(uploads, "WORKER", "hog")
    with pytest.raises(InputError, match="or stops the program that reads it; a machine file is a short TOML text"):
        sent(b"")

"""Sweeps in other processes: the same bits as in one, also when a worker dies; what is missing or lost is said."""

import argparse
import os
import signal
import subprocess
import sys
from operator import attrgetter

import numpy as np
import pytest

from kinetostat.cli import main
from kinetostat.commands.asking import _workers
from kinetostat.commands.common import BAD_INPUT, DONE
from kinetostat.engine import chunks
from kinetostat.engine.batch import NATIVE_SLAB
from kinetostat.engine.chunks import Crew, compute_with, in_chunks
from kinetostat.engine.points import Axis, Grid
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.parameters import values
from kinetostat.spec.installation import extra_command
from kinetostat.studies import datasets
from refusals import refused

MACHINE = "zhang-gosselin-4dof"
WORDS = ["map", MACHINE, "--over", "x=-40 cm:40 cm:400", "--over", "z=40 cm:140 cm:400", "--quantity", "compliance_x"]
"""160 000 points."""


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK_NUMBERS", NATIVE_SLAB)


@pytest.fixture(scope="module")
def dask():
    """A cluster of two processes, as one that exists already; its scheduler's address."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, memory_limit=0, dashboard_address="127.0.0.1:0", silence_logs="CRITICAL"
    ) as running:
        yield running.scheduler_address


def work_of(name):
    machine = load(name)
    poses = [path for path in values(machine) if path.startswith("pose.")][:2]
    axes = [Axis((path,), values(machine)[path] + np.linspace(-0.05, 0.06, 400)) for path in poses]
    return in_chunks(machine, Grid(axes), ["compliance_x", "stiffness_y"])


def assert_same(found, expected):
    assert sorted(found) == sorted(expected)
    for number, part in expected.items():
        np.testing.assert_array_equal(found[number].status, part.status)
        for name, column in part.values.items():
            assert found[number].values[name].tobytes() == column.tobytes()


@pytest.mark.parametrize("name", [MACHINE, "tripteron", "planar-3rrr"])
def test_a_cluster_gives_the_same_bits(name, dask):
    work = work_of(name)
    with compute_with(Crew(address=dask)) as compute:
        found = list(compute(work, range(work.count)))
    assert len(found) == work.count > 2
    assert_same(dict(found), dict(chunks.in_this_process(work, range(work.count))))


@pytest.mark.parametrize("name", bundled())
def test_a_worker_has_the_very_machine(name):
    machine = load(name)
    assert values(chunks._machine(chunks.as_toml(machine))) == values(machine)


def test_commands_take_a_cluster_and_write_the_same_file(dask, tmp_path, monkeypatch, capsys):
    assert main([*WORDS, "--json"]) == DONE
    alone = capsys.readouterr().out
    assert main([*WORDS, "--json", "--cluster", dask]) == DONE
    assert capsys.readouterr().out == alone
    monkeypatch.setattr(datasets, "IN_MEMORY", 1000)
    for folder, more in (("alone", []), ("together", ["--cluster", dask])):
        assert main([*WORDS, "-o", str(tmp_path / folder), *more]) == DONE
    assert (tmp_path / "alone" / "map.nc").read_bytes() == (tmp_path / "together" / "map.nc").read_bytes()


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_worker_that_dies_is_survived():
    distributed = pytest.importorskip("distributed")
    work = work_of(MACHINE)
    found = {}
    with compute_with(Crew(workers=2)) as compute:
        for number, part in compute(work, range(work.count)):
            if not found:
                os.kill(min(distributed.default_client().run(os.getpid).values()), signal.SIGKILL)
            assert number not in found
            found[number] = part
    assert_same(found, dict(chunks.in_this_process(work, range(work.count))))


INTERRUPTED = """
import os, signal, sys
import distributed
from kinetostat.cli import main
whole = distributed.Nanny.start_unsafe
async def start(nanny):
    os.kill(os.getpid(), signal.SIGINT)
    return await whole(nanny)
distributed.Nanny.start_unsafe = start
sys.exit(main(["sweep", "zhang-gosselin-4dof", "--vary", "x=-1 cm:1 cm:1000", "--workers", "2"]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
def test_ctrl_c_while_workers_start_is_obeyed_without_a_traceback():
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stderr.strip() == "kinetostat: stopped; files that had been written are complete."
    assert done.stdout == ""


def test_workers_started_here_leave_ctrl_c_to_the_one_that_gives_orders():
    before = signal.getsignal(signal.SIGINT)
    try:
        chunks.dask_setup(None)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


class Failing:
    """Stands for a client whose work ends in an error."""

    def __init__(self, error):
        self.error = error

    def nthreads(self):
        return {"worker": 1}

    def submit(self, *_arguments, **_options):
        raise self.error


@pytest.mark.parametrize(
    ("error", "arguments", "message"),
    [
        ("CancelledError", (), r"connection to the cluster was lost\. Results that are already in a folder are kept"),
        ("comm.CommClosedError", (), "connection to the cluster was lost"),
        ("KilledWorker", ("task", "worker", 3), "several workers stopped at the same chunk"),
    ],
)
def test_a_cluster_that_fails_is_said(error, arguments, message):
    distributed = pytest.importorskip("distributed")
    client = Failing(attrgetter(error)(distributed)(*arguments))
    with refused(message):
        next(chunks._on_cluster(distributed, client, work_of(MACHINE), [0]))


def test_another_version_on_a_worker_is_refused():
    class Client:
        def run(self, _function):
            return {"tcp://somewhere": "0.0.0"}

    with refused(r"tcp://somewhere runs kinetostat 0\.0\.0, but this computer runs"):
        chunks._check_versions(Client())


@pytest.mark.parametrize("how", [["--workers", "2"], ["--cluster", "tcp://127.0.0.1:1"]])
def test_without_dask_the_fix_is_named(how, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main([*WORDS, *how]) == BAD_INPUT
    assert extra_command("cluster") in capsys.readouterr().err


def test_no_scheduler_at_an_address_is_said(monkeypatch, capsys):
    pytest.importorskip("distributed")
    monkeypatch.setattr(chunks, "CLUSTER_PATIENCE", "100 ms")
    assert main([*WORDS, "--cluster", "tcp://127.0.0.1:1"]) == BAD_INPUT
    assert 'no Dask scheduler answers at "tcp://127.0.0.1:1"' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("how", "message"),
    [
        (["--workers", "0"], "1 to 1024"),
        (["--workers", "two"], "1 to 1024"),
        (["--workers", "2", "--cluster", "tcp://a:1"], "not allowed with"),
    ],
)
def test_bad_crews_are_refused(how, message, capsys):
    with pytest.raises(SystemExit) as stop:
        main([*WORDS, *how])
    assert stop.value.code == BAD_INPUT
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("text", ["000001024999", "1" * 5000])
def test_a_number_of_processes_is_compared_as_a_whole(text):
    with pytest.raises(argparse.ArgumentTypeError, match="give 1 to 1024"):
        _workers(text)  # alone: a command that took it would start a million processes

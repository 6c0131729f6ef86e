"""Ctrl-C while Python still reads the program: exit code 130, and never a traceback."""

import subprocess
import sys

import pytest

START = """
import os, signal, sys


class Stop:
    def find_spec(self, name, path=None, target=None):
        if name == "{module}":
            os.kill(os.getpid(), signal.SIGINT)


sys.argv = ["kinetostat", "analyze", "tripteron"]
sys.meta_path.insert(0, Stop())
signal.signal(signal.SIGINT, signal.{handler})
from kinetostat.__main__ import main
{run}
"""
RUN, WITHIN_A_TEXT = "sys.exit(main())", "exec('sys.exit(main())')"


def run(**words):
    return subprocess.run([sys.executable, "-c", START.format(**words)], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("module", ["kinetostat.cli", "argparse", "numpy", "kinetostat.studies.analysis"])
@pytest.mark.parametrize("way", [RUN, WITHIN_A_TEXT])
def test_it_ends_with_130_and_without_a_traceback_wherever_it_comes(module, way):
    ended = run(module=module, handler="default_int_handler", run=way)
    assert ended.returncode == 130
    assert "Traceback" not in ended.stderr
    assert ended.stdout == ""


def test_where_the_shell_has_it_ignored_the_command_goes_on():
    ended = run(module="kinetostat.cli", handler="SIG_IGN", run=RUN)
    assert ended.returncode == 0
    assert "Tripteron" in ended.stdout

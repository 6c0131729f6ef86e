"""A small attack on every run; `python tests/attack --files 100000 --lines 10000` is the large one.

Here only what hangs is found: how long a case may take is judged by the large one, on a machine that does nothing else.
"""

import subprocess
import sys
from pathlib import Path

import pytest
from hostile import good_texts
from judging import wrong_answer

from kinetostat.machine.loading import build


@pytest.mark.parametrize("text", good_texts("machine"))
def test_what_is_spoilt_was_good(text):
    """Otherwise nothing beyond the first refusal is attacked."""
    assert wrong_answer(build(text, "good.toml")) is None


def test_hostile_files_and_command_lines_are_well_answered():
    command = [sys.executable, str(Path(__file__).parent), "--files", "600", "--machines", "30"]
    command += ["--lines", "150", "--longest", "120"]
    attack = subprocess.run(command, capture_output=True, text=True)
    assert attack.returncode == 0, attack.stdout + attack.stderr

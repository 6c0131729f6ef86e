"""Overconstrained machines with rigid, elastic and contrasting parts against an engine written from nothing."""

import json

import pytest

from exact_engine import Closed, Machine, answer
from ideal_machines import CASES, MECHANISMS
from judged_machines import AGREED, judge, judged, share
from kinetostat.cli import main

DRAWS = 3
"""Machines of each mechanism that are judged every day: another engine, other routes, 0.2 s each."""
SLOW_DRAWS = 40
"""Those beyond them; `python tests/judged_machines.py` judges thousands."""

MENDED = {
    "unfelt-bearing": "K was 1e20 beside its finite entries: a load that was round-off had been taken for a direction",
    "nothing-moves": "C was 1e-40 instead of 0",
    "soft-beside-stiff": "unstable without a load, and seven digits of the compliance were wrong",
    "delta-far-out": "said to be out of reach, by the closed form of a leg without its parallelogram",
    "coupled-by-little": "a small component of a soft direction had been taken for round-off",
    "soft-but-held": "C had rotations of 1e-22: round-off of a motion that rigid parts hold, in a soft spring",
    "little-in-a-soft-leg": "the little that a soft leg carries had been taken for round-off",
    "ideal-links-agile-eye": "C was 1e33 times too small",
    "ideal-links-exechon": "C was 20 times too small",
    "ideal-links-delta": "C was wrong by hundreds",
    "ideal-links-some": "C was 1e3 times too small",
    "loaded-tripteron": "the compliance at rest was negative",
    "loaded-agile-eye": "the compliance at rest was half too large",
    "bennett": "",
    "three-puu": "",
}
"""Files in tests/cases, and what had been wrong about them."""


def exact(name):
    machine = Machine((CASES / f"{name}.toml").read_text("utf-8"))
    return answer(Closed(machine, machine.pose)), float(machine.size)


@pytest.mark.parametrize("name", MENDED)
def test_files_that_were_wrong_agree_with_the_exact_engine(name):
    expected, length = exact(name)
    verdict = judge(CASES / f"{name}.toml", expected, length)
    assert verdict.agreed, (MENDED[name], verdict)


@pytest.mark.parametrize("name", [name for name, wrong in MENDED.items() if wrong])
@pytest.mark.numbers
def test_the_command_line_tells_the_same(name, capsys):
    expected, length = exact(name)
    assert main(["analyze", str(CASES / f"{name}.toml"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["rank"] == expected.rank
    assert share(told["compliance"], expected.compliance, length) <= AGREED


@pytest.mark.parametrize("mechanism", MECHANISMS)
@pytest.mark.parametrize("seed", range(DRAWS))
def test_random_machines_agree_with_the_exact_engine(mechanism, seed, tmp_path):
    """Any of them undecided would be an answer too; none is."""
    verdict, _ = judged(mechanism, seed, tmp_path)
    assert verdict.agreed, verdict


@pytest.mark.slow
@pytest.mark.numbers
@pytest.mark.parametrize("mechanism", MECHANISMS)
def test_many_random_machines_agree_with_the_exact_engine(mechanism, tmp_path):
    verdicts = {seed: judged(mechanism, seed, tmp_path)[0] for seed in range(DRAWS, DRAWS + SLOW_DRAWS)}
    assert all(verdict.agreed for verdict in verdicts.values()), {
        seed: verdict for seed, verdict in verdicts.items() if not verdict.agreed
    }

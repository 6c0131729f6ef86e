"""Whole jobs of new users, from the words of a tutorial to its last file: few commands, none long, and known truth."""

import csv
import json
import os
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from kinetostat import load, modes
from pages import ROOT, blocks, commands, dialogues

MOST_COMMANDS = 10
MOST_SECONDS = 20.0
"""Of processor time for each command."""


def lines_of(page):
    """The commands of a page, and its other blocks, in order."""
    for block in blocks(page):
        if block.kind == "console":
            yield from (words for words, _ in dialogues(block.text))
        elif block.kind == "sh":
            yield from commands(block.text)
        else:
            yield block


def follow(page, folder):
    """Do what a page says, each command in a process of its own; the processor time of each, s."""
    spent = []
    for step in lines_of(page):
        if not isinstance(step, list):
            if step.kind in ("toml", "csv") and step.words[1:] == ():
                (folder / step.words[0]).write_text(step.text, "utf-8")
            elif step.kind == "python":
                subprocess.run([sys.executable, "-c", step.text], cwd=folder, check=True, stdout=subprocess.DEVNULL)
            continue
        words, target = (step[:-2], step[-1]) if step[-2:-1] == [">"] else (step, None)
        with open(folder / (target or "said"), "w", encoding="utf-8") as said:
            running = subprocess.Popen([sys.executable, "-m", *words], cwd=folder, stdout=said)
            _, status, usage = os.wait4(running.pid, 0)
        running.returncode = os.waitstatus_to_exitcode(status)
        # A requirement that is missed is an answer as well, with an exit code of its own.
        assert running.returncode in (0, 1), " ".join(words)
        spent.append(usage.ru_utime + usage.ru_stime)
    return spent


PUBLISHED = (361.2, 361.6, 387.3, 355.2, 337.7, 386.7, 367.8, 367.5)
"""Tensions of least norm of CoGiRo without payload at its home pose, N."""


def cable_robot(folder):
    """Tensions of least norm as published with the machine's data, and a workspace that their rule explains."""
    with (folder / "tensions" / "tensions.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    # Sag and pulleys change by less than a hundredth what least norm gives; the numbers are those of cogiro.toml.
    np.testing.assert_allclose([float(row["tension"]) for row in rows], PUBLISHED, rtol=0.01)
    maps = xr.load_dataset(folder / "tensions-map" / "map.nc")
    assert maps["capacity"].size == 25 * 17
    feasible = xr.load_dataset(folder / "feasible" / "workspace.nc")
    held = feasible["verdict"].values == 0
    assert 0 < held.sum() < held.size
    capacity = feasible["capacity"].values
    assert (capacity[held] > 30.0).all()
    # The frame is symmetric about both of its axes, but cables are crossed: the two halves of a turn agree.
    assert abs(int(held.sum()) - int(held[::-1, ::-1].sum())) == 0


def machine_tool(folder):
    """The least width at the tip, from the machine with the holder's mass and from the cutter on its spring."""
    told = json.loads((folder / "lobes-with-tool" / "lobes.json").read_text("utf-8"))
    machine = load(folder / "mill.toml", ["tool.payload=1.2 kg"])
    frequencies = np.linspace(2200.0, 2900.0, 7001)
    alone = modes(machine).receptance(frequencies.tolist())[:, 3:5, 3:5]
    bent = np.linalg.inv(alone + np.eye(2) / (25e6 * (1.0 + 0.04j)))
    tip = np.linalg.inv(bent - 0.1 * ((2.0 * np.pi * frequencies) ** 2)[:, None, None] * np.eye(2))
    angles, share = np.linspace(np.pi / 2, np.pi, 2001), 0.3
    push = np.array([-np.cos(angles) - share * np.sin(angles), np.sin(angles) - share * np.cos(angles)])
    chip = np.array([np.sin(angles), np.cos(angles)])
    mean = 4 / (2.0 * np.pi) * np.trapezoid(push[:, None] * chip[None], angles)
    inverse = 1.0 / (800e6 * np.linalg.eigvals(mean @ tip))
    widths = np.abs(inverse) ** 2 / (2.0 * inverse.real)
    assert told["least_width"] == pytest.approx(widths[inverse.real > 0.0].min(), rel=2e-3)
    compared = json.loads((folder / "designs" / "compare.json").read_text("utf-8"))
    stiff = next(row for row in compared["requirements"] if row["name"] == "stiff")
    assert [verdict["met"] for verdict in stiff["designs"]] == [False, True, False, False, True]
    assert "free_stiffness_x" in (folder / "mill.html").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.documents
@pytest.mark.parametrize(("page", "truth"), [("cable-robot", cable_robot), ("machine-tool", machine_tool)])
def test_a_job_is_done_in_few_commands_and_tells_the_truth(page, truth, tmp_path):
    spent = follow(ROOT / "docs" / "tutorials" / f"{page}.md", tmp_path)
    assert len(spent) <= MOST_COMMANDS
    assert max(spent) < MOST_SECONDS
    truth(tmp_path)

"""Known truth about jobs of tutorials: `test_documents` does what a page says, and compares the files with it."""

import csv
import json

import numpy as np
import pytest
import xarray as xr

from kinetostat import load, modes

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


TRUTHS = {"cable-robot": cable_robot, "machine-tool": machine_tool}
"""The tutorials whose files are compared with known truth, each by what asserts it of the page's folder."""

"""Known truth about jobs of tutorials: `test_documents` does what a page says, and compares the files with it."""

import csv
import json
import re

import numpy as np
import pytest
import xarray as xr

from kinetostat import load, modes
from synthetic_printer import ENDSTOPS, PROBED, Truth, endstops, probed_heights, sent_height

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


def delta_printer(folder):
    """A printer with the errors that were found touches its bed at the heights of the page, and klipper.cfg levels it.

    Both printers are simulated by the kinematics of the tests.
    """
    fit = json.loads((folder / "calibrated" / "fit.json").read_text("utf-8"))
    found = {unknown["path"]: unknown["value"] for unknown in fit["unknowns"]}
    zeros = np.array([found[f"legs.tower {tower}.actuator.zero"] for tower in "ABC"])
    angles = np.array([found["geometry.tower_angles.0"], found["geometry.tower_angles.1"], 0.0])
    truth = Truth(zeros, angles, found["radius"], found["rod"])
    with (folder / "probes.csv").open(encoding="utf-8") as stream:
        measured = np.array([float(row["z [mm]"]) for row in csv.DictReader(stream)]) / 1e3
    missed = probed_heights(truth) - measured
    assert np.sqrt(np.mean(missed**2)) == pytest.approx(fit["after"]["length"], rel=5e-3)
    text = (folder / "calibrated" / "klipper.cfg").read_text("utf-8")
    told = {word: np.array([float(size) for size in re.findall(rf"{word}:? ([-+.0-9]+)", text)])
            for word in ("delta_radius", "arm_length", "angle", "add")}  # fmt: skip
    radius, rods = told["delta_radius"][0] / 1e3, told["arm_length"] / 1e3
    believed = ENDSTOPS + told["add"] / 1e3 + np.sqrt(rods**2 - radius**2)
    numbers = radius, rods, np.radians(told["angle"])
    heights = [sent_height(truth, numbers, believed, endstops(truth), place) for place in PROBED]
    assert np.abs(heights).max() < 2e-6
    frequencies = xr.load_dataset(folder / "resonance" / "map.nc")["frequency_1"]
    assert float(frequencies.max() / frequencies.min()) > 1.05


def telescope(folder):
    """Forces of the drives by the statics of six lines that carry the weight, and where they reverse."""
    with (folder / "elevation" / "elevation.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    foot, head = np.array([0.85, 0.09, 0.0]), np.array([0.48, 0.56, -0.40])
    lines = []
    for turn in np.radians([0.0, 120.0, 240.0]):
        rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        for mirror in (np.diag([1, 1, 1]), np.diag([1, -1, 1])):
            top, end = rotation @ mirror @ foot, rotation @ mirror @ head
            along = (end - top) / np.linalg.norm(end - top)
            lines.append([*np.cross(end, along), *along])
    terms = []  # of the sine and of the cosine of the elevation
    for direction in ([0.0, 0.0, -1.0], [0.0, 1.0, 0.0]):
        weight = 3000.0 * 9.81 * np.array(direction)
        terms.append(np.linalg.solve(np.transpose(lines), [*np.cross([0, 0, -0.75], weight), *weight]))
    for row in rows:
        height = float(row["elevation [rad]"])
        told = sorted(float(row[f"leg {leg} drive load [N]"]) for leg in range(1, 7))
        expected = sorted(terms[0] * np.sin(height) + terms[1] * np.cos(height))
        # The sag of 0.15 mm, of legs of 0.7 m, changes the last parts in two thousand.
        np.testing.assert_allclose(told, expected, atol=5e-4 * max(np.abs(expected)))
    answer = json.loads((folder / "elevation" / "elevation.json").read_text("utf-8"))
    crossings = np.arctan2(-terms[1], terms[0])
    crossings = sorted(crossings[(crossings > 0.0) & (crossings < np.pi / 2)])
    np.testing.assert_allclose([each["elevation"] for each in answer["reversals"]], crossings, atol=1e-3)


TRUTHS = {
    "cable-robot": cable_robot,
    "delta-printer": delta_printer,
    "machine-tool": machine_tool,
    "telescope": telescope,
}
"""The tutorials whose files are compared with known truth, each by what asserts it of the page's folder."""

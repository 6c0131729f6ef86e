"""The state space of vibrating machines: its response is the receptance, and its files hold what was computed."""

import csv
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat

from kinetostat import analyze, export, load
from kinetostat.studies.control import state_space
from kinetostat.studies.vibration import modes
from refusals import refused

LIGHT = ["tool.mass=5", "tool.inertia=[0.05, 0.06, 0.07, 0, 0, 0]"]
MACHINES = {
    "rotors and stiffness in a row": (
        "hexapod",
        [*LIGHT, "linear_density.legs=2", "stiffness.leg_axial=3e7", "drives.rotor_inertia=1e-5", "drives.lead=0.005"],
    ),
    "friction of joints that have no mass": ("delta", ["tool.mass=2", "damping.hinges=0.05", "linear_density.arms=1"]),
    "Rayleigh": (
        "delta",
        ["tool.mass=2", "damping.per_stiffness=1e-5", "damping.per_mass=3", "damping.ratio=0.01"],
    ),
    "friction of rotors, in the plane": (
        "planar-3rrr",
        ["tool.mass=2", "drives.rotor_damping=1e-3", "drives.ratio=20"],
    ),
    "leg by leg": ("tripteron", ["tool.mass=2", "damping.slides=50", "damping.hinges=1"]),
}


def response(equations, frequency):
    """D + C (i w - A)^-1 B; rows are scaled, because motions that creep do it at very different rates."""
    left = 2j * np.pi * frequency * np.eye(len(equations.a)) - equations.a
    sizes = np.abs(left).max(axis=1)[:, None]
    return equations.c @ np.linalg.solve(left / sizes, equations.b / sizes) + equations.d


@pytest.mark.parametrize("what", MACHINES)
def test_its_response_is_the_receptance(what):
    machine = load(*MACHINES[what])
    vibration, answer = modes(machine), state_space(machine)
    parts = list(machine.family.components)
    frequencies = [0.0, *np.geomspace(0.1, 5000.0, 40), *vibration.solution.frequencies[:4]]
    wanted = vibration.receptance(frequencies)[:, parts][:, :, parts]
    sizes = np.sqrt(np.einsum("fii->fi", np.abs(wanted)).max(axis=0))
    for frequency, here in zip(frequencies, wanted, strict=True):
        error = response(answer.equations, frequency) - here
        assert np.abs(error / np.outer(sizes, sizes)).max() < 1e-10
    assert np.linalg.eigvals(answer.equations.a).real.max() < 0.0


def test_without_a_frequency_it_is_the_compliance():
    machine = load("hexapod", LIGHT)
    still = response(state_space(machine).equations, 0.0).real
    assert still == pytest.approx(np.array(analyze(machine).compliance), rel=1e-12, abs=1e-20)


def test_modes_that_are_left_out_still_add_to_the_compliance():
    machine = load("hexapod", LIGHT)
    few, whole = state_space(machine, ["fx"], ["x", "ry"], count=2), state_space(machine, ["fx"], ["x", "ry"])
    assert len(few.equations.states) == 4
    assert len(whole.equations.states) == 12
    assert response(few.equations, 0.0) == pytest.approx(response(whole.equations, 0.0), rel=1e-12)
    assert response(few.equations, 100.0) == pytest.approx(response(whole.equations, 100.0), rel=0.1)


def test_a_drive_moves_its_spring():
    """A force on the only spring of a leg lengthens it by the force over its stiffness, whatever the others are."""
    machine = load("hexapod", LIGHT)
    answer = state_space(machine, ["leg 1 actuator"], ["leg 1 actuator", "leg 2 actuator"])
    assert [port.unit for port in (*answer.inputs, *answer.outputs)] == ["N", "m", "m"]
    stiffness = machine.tables["stiffness"].actuator[0]
    assert response(answer.equations, 0.0).real.ravel() == pytest.approx([1.0 / stiffness, 0.0], abs=1e-12 / stiffness)


def test_what_is_not_there_is_refused(tmp_path):
    machine = load("hexapod", LIGHT)
    with refused('"fq".*choose from mx, my, mz, fx, fy, fz, leg 1 actuator'):
        state_space(machine, ["fq"])
    with refused("count is 0"):
        state_space(machine, count=0)
    with refused("format csv has no inputs to choose; c, .*, page, link, state-space have"):
        export(machine, tmp_path / "m.csv", inputs=["fx"])
    with refused("does not say what it weighs"):
        export(load("hexapod"), tmp_path / "m.mat", "state-space")
    assert not list(tmp_path.iterdir())


def test_files_of_a_state_space_hold_its_matrices(tmp_path):
    machine = load("hexapod", LIGHT)
    inputs, outputs = ["fz", "leg 3 actuator"], ["z", "rx", "leg 3 actuator"]
    answer = state_space(machine, inputs, outputs)
    for suffix in (".mat", ".nc"):
        export(machine, tmp_path / f"m{suffix}", "state-space", inputs, outputs)
    matlab, labelled = loadmat(tmp_path / "m.mat"), xr.load_dataset(tmp_path / "m.nc", engine="h5netcdf")
    for name in "ABCD":
        wanted = getattr(answer.equations, name.lower())
        assert (matlab[name] == wanted).all()
        assert (labelled[name].values == wanted).all()
    assert [str(row[0]) for row in matlab["inputs"][:, 0]] == inputs == labelled["input"].values.tolist()
    assert [str(row[0]) for row in matlab["output_units"][:, 0]] == ["m", "rad", "m"]
    assert labelled["output_unit"].values.tolist() == ["m", "rad", "m"]
    assert matlab["frequencies"].ravel() == pytest.approx(modes(machine).solution.frequencies, rel=1e-15)


def test_files_of_modes_hold_what_was_computed(tmp_path: Path):
    machine = load("hexapod", LIGHT)
    vibration = modes(machine)
    for suffix in (".csv", ".nc"):
        export(machine, tmp_path / f"m{suffix}", "modes")
    labelled = xr.load_dataset(tmp_path / "m.nc", engine="h5netcdf")
    assert labelled["frequency_hz"].values.tolist() == [mode.frequency for mode in vibration.modes]
    assert labelled["strain_energy"].sum("spring").values == pytest.approx(1.0, rel=1e-12)
    assert labelled["kinetic_energy"].sum("part").values == pytest.approx(1.0, rel=1e-12)
    with (tmp_path / "m.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["mode"] for line in lines] == [str(number) for number, _ in enumerate(vibration.modes, 1)]
    for line, mode in zip(lines, vibration.modes, strict=True):
        assert float(line["frequency_hz"]) == mode.frequency
        assert [float(line[name]) for name in ("rx", "x")] == [mode.tool[0], mode.tool[3]]
        assert float(line["modal_mass"]) == mode.modal_mass
    assert len({mode.direction for mode in vibration.modes}) > 1

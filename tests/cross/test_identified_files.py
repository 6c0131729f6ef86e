"""The file that a fit writes differs from the user's only in the numbers that were identified, in the user's units."""

import json
import re

import numpy as np
import pytest

from kinetostat import command, load
from kinetostat.accuracy.model import error_model
from kinetostat.cli import main
from kinetostat.exchange.leg_by_leg import fitted_text
from kinetostat.machine.loading import bundled
from kinetostat.spec.errors import InputError
from kinetostat.studies.identification.fitted_values import fitted_file_values
from kinetostat.studies.identification.identification import identification_of
from kinetostat.studies.identification.measurements import POSITION, ROTATION, Measurements
from synthetic_measurements import measured, posed
from synthetic_printer import Truth, probed_heights, write_probes

TIES = {"radius": "geometry.tower_radius.*", "rod": "geometry.rod_length.*"}


def changed_lines(before, after):
    """Pairs of a line of a file and what it has become."""
    assert len(before.splitlines()) == len(after.splitlines())
    return [pair for pair in zip(before.splitlines(), after.splitlines(), strict=True) if pair[0] != pair[1]]


def test_a_printer_keeps_its_file_but_for_what_was_identified(tmp_path, capsys):
    drawn = "# my printer\n" + bundled()["delta-linear"].replace("Delta printer", "Voron of mine")
    (tmp_path / "printer.toml").write_text(drawn, "utf-8")
    truth = Truth(np.array([3e-4, -2e-4, 4e-4]), np.zeros(3), 5e-4, 3e-4)
    write_probes(tmp_path / "probes.csv", probed_heights(truth))
    words = [word for name, paths in TIES.items() for word in ("--tie", f"{name}={paths}")]
    folder = tmp_path / "out"
    line = [str(tmp_path / "printer.toml"), str(tmp_path / "probes.csv"), "--fit", "zeros", *words, "--sigma", "1 um"]
    assert main(["identify", *line, "-o", str(folder)]) == 0
    capsys.readouterr()
    pairs = changed_lines(drawn, (folder / "machine.toml").read_text("utf-8"))
    assert [before.split("=")[0].strip() for before, _ in pairs] == ["tower_radius", "rod_length"]
    for (before, after), exact in zip(pairs, (145.6 + 0.5, 215.0 + 0.3), strict=True):
        assert after.count("#") == before.count("#")
        assert after.partition("#")[2] == before.partition("#")[2]
        assert float(after.split('"')[1].removesuffix(" mm")) == pytest.approx(exact, abs=0.01)
    built = load(folder / "machine.toml")
    commands = command(built, {"z": [0.01, 0.02]}, fit=folder)
    record = json.loads((folder / "fit.json").read_text("utf-8"))
    zeros = [unknown["value"] for unknown in record["unknowns"] if unknown["path"].endswith("zero")]
    # A carriage commanded to c stands at c + zero; where it stands is the business of the machine as built.
    stands = command(built, {"z": [0.01, 0.02]}).coordinates
    assert commands.coordinates + zeros == pytest.approx(stands, abs=1e-15)
    assert commands.message.endswith("Zeros and gains of the fit are counted in.")
    with pytest.raises(InputError, match="is the machine as drawn"):
        command(load(tmp_path / "printer.toml"), fit=folder)


def test_stiffnesses_are_identified_in_their_own_units(tmp_path):
    """From deflections under loads; the numbers of the file are those with which the loads were computed."""
    drawn = re.sub(
        r"^actuator .*$",
        'actuator = ["20 N/um", "20 N/um", "20 N/um", "30 N/um", "2e7 N/m", 2e7] # screws',
        bundled()["hexapod"],
        count=1,
        flags=re.MULTILINE,
    )
    (tmp_path / "own.toml").write_text(drawn, "utf-8")
    machine, draw = load(tmp_path / "own.toml"), np.random.default_rng(2)
    truth = {"stiffness.actuator.0": 22e6, "stiffness.actuator.3": 27e6, "stiffness.actuator.4": 18e6}
    _, poses = posed(machine, 20)
    wrenches = draw.normal(0.0, 100.0, (20, 6)) * [0.1, 0.1, 0.1, 1.0, 1.0, 1.0]
    moved = error_model(machine.with_values(truth), poses, 20, wrenches).deflections(wrenches).sum(axis=2)
    names = [f"deflection.{name}" for name in (*ROTATION, *POSITION)]
    read = dict(zip(names, moved.T, strict=True)), dict.fromkeys(names, np.full(20, 1e-12))
    data = Measurements("m.csv", tuple(range(2, 22)), poses, *read, wrenches, np.zeros((20, 3)))
    answer = identification_of(error_model(machine, poses, 20, wrenches), data, ["legs.leg [145].*.compliance"])
    assert fitted_file_values(answer) == pytest.approx(truth, rel=1e-6)
    ((before, after),) = changed_lines(drawn, fitted_text(answer))
    found = re.findall(r'"(\S+) ([^"]*)"', after)
    assert [unit for _, unit in found] == ["N/um"] * 4 + ["N/m"]
    assert [float(size) for size, _ in found] == pytest.approx([22.0, 20.0, 20.0, 27.0, 18e6])
    assert before.partition("#")[2] == after.partition("#")[2] == " screws"


def test_errors_of_single_joints_are_no_numbers_of_a_family_s_file():
    model, poses = posed(load("planar-3rpr"), 25, 0.4, 0.3)
    answer = identification_of(model, measured(model, poses, 1e-4 * np.ones(len(model.errors)), ("x", "y", "rz")))
    assert fitted_file_values(answer) is None
    assert fitted_file_values(identification_of(model, answer.observed.data, ["zeros"])) == {}

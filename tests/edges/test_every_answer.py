"""Every answer about a machine is plotted or has no figure, is saved in all its forms, and is shown in a session."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from report_pages import no_layout

import kinetostat as k
from kinetostat.spec.errors import InputError
from kinetostat.views import notebook
from kinetostat.views.answers import description_of
from kinetostat.views.notebook import html_of

WORDS = [
    "tool.mass=12 kg", "tool.inertia=[0.3, 0.3, 0.5, 0, 0, 0]", "load.force=[0, 0, -400]", "load.gravity=[0, 0, -9.81]",
    "tolerances.joints=0.05 mm", "cutting.pressure=2e9 Pa", "cutting.direction=[1, 0, 0]", "drives.rotor_inertia=2e-5",
    "drives.lead=5 mm", "servo.position_gain=20", "servo.velocity_gain=1",
]  # fmt: skip
POSES = {"x": [0.0, 0.01, 0.02]}
LINE, PLANE = ["x=0 mm:10 mm:3"], ["x=0 mm:10 mm:3", "y=0 mm:10 mm:3"]


@pytest.fixture(scope="module")
def machine():
    return k.load("hexapod", WORDS)


ANSWERS = {
    "analyze": k.analyze,
    "analyze out of reach": lambda m: k.analyze(m.with_values({"pose.z": 5.0})),
    "budget": lambda m: k.budget(m, samples=64),
    "budget at poses": lambda m: k.budget(m, POSES, samples=64),
    "capability": k.capability,
    "carrying_legs": lambda _: k.carrying_legs(k.load("cogiro"), ["x=0 mm:100 mm:2", "y=0 mm:100 mm:2"]),
    "command": k.command,
    "command at poses": lambda m: k.command(m, POSES),
    "compare": lambda m: k.compare([m, k.load("hexapod")]),
    "correction_table": lambda m: k.correction_table(m, "gravity_angle=0 deg:90 deg:5"),
    "elevation": k.elevation,
    "evaluate": lambda m: k.evaluate(m, POSES),
    "evaluate matrices": lambda m: k.evaluate(m, POSES, ["K", "C", "singularity_margin"]),
    "evaluate_grid on a line": lambda m: k.evaluate_grid(m, LINE, ["compliance"]),
    "evaluate_grid": lambda m: k.evaluate_grid(m, PLANE, ["compliance"]),
    "forward": lambda m: k.forward(m, {each.name: each.coordinate for each in k.analyze(m).actuators}),
    "guidelines": k.guidelines,
    "lobes": k.lobes,
    "modes": k.modes,
    "sensitivity": k.sensitivity,
    "servo": k.servo,
    "tensions": lambda _: k.tensions(k.load("cogiro")),
    "under_load": k.under_load,
    "workspace": lambda m: k.workspace(m, PLANE),
}
UNDRAWN = {"analyze", "analyze out of reach", "forward", "command", "command at poses", "correction_table"}
"""Answers without a figure: `plot` says so in a sentence."""


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_has_every_surface(machine, name, tmp_path, monkeypatch):
    monkeypatch.setattr(notebook, "PICTURE_PIXELS", (160, 120))
    answer = ANSWERS[name](machine)
    assert len(repr(answer)) < 200 or name.startswith("evaluate")
    with monkeypatch.context() as patch:
        no_layout(patch)  # a session, below, lays out and draws the same figures
        if name in UNDRAWN:
            with pytest.raises(InputError, match="There is no figure"):
                k.plot(answer)
        else:
            assert isinstance(k.plot(answer), Figure)
    assert "<" in html_of(answer)
    for form in description_of(answer).forms:
        k.save(answer, tmp_path / f"answer.{form}")
        assert (tmp_path / f"answer.{form}").stat().st_size > 0


def test_diagonals_are_arrays(machine):
    analysis = k.analyze(machine)
    assert 1.0 / analysis.compliance_diagonal == pytest.approx(1.0 / np.diag(analysis.C))
    assert 2.0 * analysis.stiffness_diagonal == pytest.approx(2.0 * np.diag(analysis.K))

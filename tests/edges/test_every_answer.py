"""Every answer about a machine is plotted or has no figure, is saved in all its forms, and is shown in a session."""

import pickle
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from matplotlib.figure import Figure
from report_pages import few_lamps, no_layout
from scipy.spatial.transform import Rotation

import kinetostat as k
from kinetostat.equilibrium.state import MachineState
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
    few_lamps(monkeypatch)
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


PAIRS = {"bounds", "extents", "best", "least_damped", "direction", "poses"}
"""Two numbers of different meaning, and directions as they were given, empty where none was."""
INDEXED = {"legs", "errors", "points", "springs"}
"""Counts, and places in other lists."""
DESIGNS = {"values"}
"""A row of designs, some of which have no such number: None."""


def numeric(value):
    if isinstance(value, list | tuple):
        return bool(value) and all(map(numeric, value))
    return isinstance(value, float | int) and not isinstance(value, bool)


def lists_of_numbers(value, path):
    """Places in an answer at which numbers stand in a list instead of an array; machines and their states left out."""
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from lists_of_numbers(entry, f"{path}[{key}]")
    elif isinstance(value, list | tuple) and not numeric(value):
        for entry in value[:2]:
            yield from lists_of_numbers(entry, f"{path}[]")
    elif isinstance(value, list | tuple):
        yield path
    elif is_dataclass(value) and not isinstance(value, k.Machine | MachineState):
        for field in fields(value):
            if field.name not in PAIRS | INDEXED | DESIGNS:
                yield from lists_of_numbers(getattr(value, field.name), f"{type(value).__name__}.{field.name}")


@pytest.mark.parametrize("name", ANSWERS)
def test_numbers_of_an_answer_are_arrays(machine, name):
    answer = ANSWERS[name](machine)
    if is_dataclass(answer):
        assert [*lists_of_numbers(answer, name)] == []


def test_other_libraries_take_the_arrays_of_answers(machine):
    """SciPy refuses arrays that are read-only in places; yet what is written into one is not lost without a word."""
    state = k.under_load(machine.with_values({"load.moment.2": 5.0}))
    assert Rotation.from_rotvec(state.displacement[:3]).magnitude() > 0.0
    analysis = k.analyze(machine)
    with pytest.raises(TypeError, match=r"cannot be changed; copy it with np\.array"):
        analysis.K[3:, 3:] *= 1e-6
    copies = np.array(analysis.K), analysis.K.copy(), analysis.K.astype(float)
    for mine in (*copies, 1e-6 * analysis.K, analysis.K @ analysis.C, analysis.K.sum(axis=0)):
        mine[0] = mine[:1].T[0, ...] = 0.0
    assert type(2.0 * analysis.K) is np.ndarray
    assert type(analysis.K.max()) is np.float64
    assert repr(analysis.K).startswith("array(")
    assert type(pickle.loads(pickle.dumps(analysis)).K) is type(analysis.K)
    assert Rotation.from_rotvec(analysis.load.deflection[:3]).apply(analysis.indices.centres["stiffness"]).shape == (3,)
    shares = analysis.attribution[0].compliance_share
    assert 1.0 / shares == pytest.approx([1.0 / share for share in shares])


def test_diagonals_are_arrays(machine):
    analysis = k.analyze(machine)
    assert 1.0 / analysis.compliance_diagonal == pytest.approx(1.0 / np.diag(analysis.C))
    assert 2.0 * analysis.stiffness_diagonal == pytest.approx(2.0 * np.diag(analysis.K))

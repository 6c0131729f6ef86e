"""Questions about one pose share its state: joints are solved for once, and the free machine responds once."""

import pytest

from kinetostat.equilibrium import state as states
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics import closure
from kinetostat.machine.loading import as_toml, load
from kinetostat.studies import datasets
from kinetostat.studies.analysis import analyze
from kinetostat.studies.budget import budget
from kinetostat.studies.datasets import evaluate
from kinetostat.studies.guidelines import guidelines
from kinetostat.studies.requirements import requirements

SETTINGS = ["tool.mass=2 kg", 'requirements.stiff.demand=["free_stiffness_z > 1 N/um", "mass > 1 kg"]']
QUESTIONS = {
    "budget": lambda state: budget(state, tolerances={"joints": "0.02 deg"}, samples=64),
    "guidelines": guidelines,
    "requirements": requirements,
}


@pytest.fixture
def calls(monkeypatch):
    """Number of calls of `solve_joints`, and of `respond` by states."""
    counts = {"solve_joints": 0, "respond": 0}

    def counting(name, function):
        def call(*given):
            counts[name] += 1
            return function(*given)

        return call

    for name, module in (("solve_joints", closure), ("respond", states)):
        monkeypatch.setattr(module, name, counting(name, getattr(module, name)))
    return counts


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_question_asked_of_a_state_places_and_solves_it_once(calls, question):
    state = state_of(load("tripteron", SETTINGS))
    assert analyze(state).stiffness is not None
    known = dict(calls)
    assert QUESTIONS[question](state)
    assert calls == known


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_question_asked_of_a_machine_places_and_solves_it_once(calls, question):
    assert QUESTIONS[question](load("tripteron", SETTINGS))
    assert calls == {"solve_joints": 1, "respond": 1}


def test_a_machine_that_is_evaluated_again_and_again_is_written_once(monkeypatch):
    """What does not depend on the poses takes longer than one of them."""
    machine, texts = load("tripteron", SETTINGS), []
    monkeypatch.setattr(datasets, "as_toml", lambda given: texts.append(as_toml(given)) or texts[-1])
    answers = [evaluate(machine, {"x": [x]}, ["compliance_z"]) for x in (0.01, 0.02, 0.03)]
    assert len(texts) == 1
    assert {answer.attrs["machine_file"] for answer in answers} == set(texts)
    other = evaluate(load("tripteron", [*SETTINGS, "pose.y=1 mm"]), {"x": [0.01]}, ["compliance_z"])
    assert other.attrs["machine_file"] == texts[1] != texts[0]
    assert other.attrs["pose"] != answers[0].attrs["pose"]

"""Rests far from the pose, to which Newton's steps wander: the loads are followed, and round-off chooses nothing."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.solving import Rest
from kinetostat.machine.loading import build, load
from kinetostat.machine.parameters import values
from kinetostat.studies.under_load import under_load

CASES = Path(__file__).parents[1] / "cases"


def in_reverse(name):
    """The machine of a case with its legs in reverse order."""
    document = tomllib.loads((CASES / name).read_text())
    return build({**document, "legs": document["legs"][::-1]}, "in reverse")


def test_a_soft_machine_is_where_growing_loads_take_it():
    """Newton's steps of 2.8 to 1e11 rad ended in a state that does not stay, another one in each frame of the file."""
    state = under_load(load(CASES / "soft-stands.toml"))
    assert state.rest is Rest.OK
    assert state.message == "At rest and stable."
    followed = state.state.limit
    assert followed.share == 1.0
    there = followed.balance.state.platform.amounts()[0] * followed.balance.mechanism.twist_units[0]
    assert state.displacement == pytest.approx(there, rel=1e-7)


def test_a_machine_that_snaps_over_comes_to_one_rest_in_whatever_order_its_legs_are_written():
    state, again = under_load(load(CASES / "snaps-over.toml")), under_load(in_reverse("snaps-over.toml"))
    assert state.rest is again.rest is Rest.OK
    assert "snapped over to another state on the way. It stands up to 0.528 times this load" in state.message
    assert np.linalg.norm(state.displacement) == pytest.approx(0.0659, abs=1e-4)
    assert again.displacement == pytest.approx(state.displacement, rel=1e-6)
    assert state.residual < 1e-9


@pytest.mark.parametrize("name", ["snaps-over.toml", "soft-stands.toml"])
@pytest.mark.parametrize("count", [2, 300])
def test_many_poses_have_the_rest_of_one(name, count):
    """A matrix of rank 5 has a rigid spring, whose stiffness was NaN where poses are columns: no rest was found."""
    machine = load(CASES / name)
    here = values(machine)
    path = next(path for path in here if path.startswith("pose."))
    poses = PointTable({path: np.full(count, here[path])})
    names = [f"displacement_{component}" for component in ("rx", "ry", "rz", "x", "y", "z")]
    answers = evaluate(machine, poses, names)
    assert not answers.status.any()
    alone = under_load(machine).displacement
    for place, quantity in enumerate(names):
        assert answers.values[quantity] == pytest.approx(np.full(count, alone[place]), rel=1e-6)

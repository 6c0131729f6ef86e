"""Platforms on cables come to the rest that an overdamped descent reaches, which knows points and lengths only."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hung_platforms import (
    LENGTH,
    energy_and_gradient,
    free_lengths,
    platform_of,
    random_platforms,
    rests_of,
    settled_places,
)
from kinetostat import build, evaluate, under_load
from kinetostat.cli import main
from kinetostat.equilibrium.descent import least_within
from kinetostat.equilibrium.solving import Rest
from kinetostat.kinematics.status import Status
from machines import written

AT_REST = Path(__file__).parents[1] / "cases" / "cables-at-rest.toml"


def placement(hung, number, displacement):
    """Place of P and orientation after a displacement of the tool point, as `under_load` gives it."""
    turned = Rotation.from_rotvec(displacement[:3]).as_matrix() @ hung.turned[number]
    tool = hung.place[number] + hung.turned[number] @ hung.offset[number] + displacement[3:]
    return tool - turned @ hung.offset[number], turned


def least_eigenvalue(hung, number, turned, tangent):
    """Of the stiffness about P, with turns over LENGTH, from that at the tool point [6 x 6]."""
    x, y, z = turned @ hung.offset[number]
    moves = np.eye(6)
    moves[3:, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    moves[:, :3] /= LENGTH
    return np.linalg.eigvalsh(moves.T @ np.array(tangent) @ moves)[0]


def assert_same_rests(hung, others=0):
    """Each platform that the descent brings to rest rests there; `others` of them, at most, in another place."""
    place, turned, least = rests_of(hung)
    rests = np.flatnonzero(np.isfinite(least))
    assert len(rests) >= 0.98 * len(hung)
    elsewhere = []
    for number in rests:
        state = under_load(build(hung.text(number)))
        assert state.rest is Rest.OK, f"platform {number}: {state.message}"
        at, orientation = placement(hung, number, np.array(state.displacement))
        if max(np.abs(at - place[number]).max(), np.abs(orientation - turned[number]).max()) > 1e-6:
            elsewhere.append(number)  # which of two rests is reached depends on the drag
            part = hung.of([number])
            there = settled_places(part, free_lengths(part), at[None], orientation[None])
            assert there[0][0] == pytest.approx(at, abs=1e-6)
            place[number], turned[number], least[number] = there[0][0], there[1][0], there[2][0]
        assert least_eigenvalue(hung, number, orientation, state.tangent) == pytest.approx(least[number], rel=1e-6)
    assert len(elsewhere) <= others, elsewhere


def test_eight_cables_of_which_two_go_slack_rest_where_a_descent_ends(capsys):
    """Newton's steps from this pose end nowhere: the platform turns by a tenth before it rests."""
    hung = platform_of(AT_REST.read_text())
    place, turned, least = rests_of(hung)
    main(["analyze", str(AT_REST), "--loaded", "--json"])
    state = json.loads(capsys.readouterr().out)
    at, orientation = placement(hung, 0, np.array(state["displacement"]))
    assert (state["rest"], len(state["slack_legs"])) == ("ok", 2)
    assert "snapped" not in state["message"]
    assert at == pytest.approx(place[0], abs=1e-9)
    assert orientation == pytest.approx(turned[0], abs=1e-9)
    assert least_eigenvalue(hung, 0, orientation, state["tangent_stiffness"]) == pytest.approx(least[0], rel=1e-7)


def test_random_platforms_rest_where_a_descent_ends():
    assert_same_rests(random_platforms(60, seed=1).of([0, 4, 16, 28]))


@pytest.mark.engines
def test_many_random_platforms_rest_where_a_descent_ends():
    assert_same_rests(random_platforms(500, seed=7).of(np.arange(60, 120)), others=1)


def test_all_poses_of_a_table_come_to_the_rest_of_each():
    hung = random_platforms(60, seed=1).of([4])
    machine = build(hung.text(0))
    shifts = [0.0, -0.05]
    table = evaluate(machine, {"x": hung.place[0, 0] + np.array(shifts)}, ["displacement_z", "slack_springs"])
    assert table.status.values.tolist() == [Status.OK] * 2
    for number, shift in enumerate(shifts):
        state = under_load(machine.with_values(x=hung.place[0, 0] + shift))
        assert float(table["displacement_z"][number]) == pytest.approx(state.displacement[5], abs=1e-9)


@pytest.mark.parametrize("number", [1, 7, 53])
def test_a_cable_that_goes_slack_on_the_way_is_no_snap(number):
    """With the weight in 200 steps, a descent moves these platforms by less than 3 mm in each."""
    assert "snapped" not in under_load(build(random_platforms(60, seed=1).text(number))).message


RUNS_AWAY = """
[[legs]]
name = "stop"
joints = [{ name = "slide", type = "prismatic", joins = ["base", "platform"], point = [0, 0, 0], axis = [1, 0, 0], actuated = true, stiffness = 1e5, acts = "pushes" }]
[load]
force = [50, 0, 0]
"""  # noqa: E501


def test_what_runs_away_does_not_rest_and_is_not_said_to_stand_under_no_share():
    state = under_load(build(written("cart", (0, 0, 0), {"x": 0}) + RUNS_AWAY))
    assert state.rest is not Rest.OK
    assert "under no share" not in state.message


@pytest.mark.parametrize("seed", range(8))
def test_the_step_within_a_radius_satisfies_its_conditions(seed):
    """(K + s) y = f with s >= 0 and no negative eigenvalue, and s = 0 unless y is as long as the radius."""
    rng = np.random.default_rng(seed)
    matrix, force, radius = rng.normal(size=(6, 6)), rng.normal(size=6), 10.0 ** rng.uniform(-3, 1)
    stiffness = matrix @ matrix.T if seed % 2 else matrix + matrix.T
    step = least_within(stiffness[None], force[None], np.array([radius]))[0]
    shift = (force - stiffness @ step) @ step / (step @ step)
    assert stiffness @ step + shift * step == pytest.approx(force, abs=1e-6 * np.abs(force).max())
    assert shift > -1e-9
    assert np.linalg.eigvalsh(stiffness)[0] + shift > -1e-9
    assert np.linalg.norm(step) == pytest.approx(radius, rel=1e-9) or abs(shift) < 1e-9


def test_the_energy_of_the_descent_has_the_slope_that_it_says():
    """The reference of this file, by differences."""
    hung, size = random_platforms(3, seed=4), 1e-6
    free = free_lengths(hung)
    _, gradient, _ = energy_and_gradient(hung, free, hung.place, hung.turned)
    for axis in range(3):
        ends = []
        for sign in (1.0, -1.0):
            place = hung.place.copy()
            place[:, axis] += sign * size
            ends.append(energy_and_gradient(hung, free, place, hung.turned)[0])
        assert (ends[0] - ends[1]) / (2 * size) == pytest.approx(gradient[:, 3 + axis], rel=1e-4, abs=1e-3)

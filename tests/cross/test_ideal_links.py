"""Ideal links in overconstrained machines: rigid parts that hold the same motion share no load with springs."""

from pathlib import Path

import numpy as np
import pytest

from kinetostat import analyze, evaluate, load
from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, NO_ANSWER
from kinetostat.equilibrium.mechanism import mechanism_of
from kinetostat.equilibrium.solving import Rest, at_rest, stability, with_share
from kinetostat.equilibrium.tangent import platform_compliance
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.parameters import values, with_values
from kinetostat.studies.under_load import under_load

CASES = Path(__file__).parents[1] / "cases"
ROUNDED = 6e-3
"""Three digits are known of the true values."""
ROUTES = 1e-12
"""Share of an entry's scale by which two routes may differ: some hundred units of round-off."""

TRUE = {
    "ideal-links-agile-eye": (3, {"rx": 1.27e-3}),
    "ideal-links-exechon": (3, {"rx": 7.56e-8, "y": 5.91e-8}),
    "ideal-links-delta": (3, {"x": 4.78e-6, "y": 4.14e-6, "z": 1.35e-6}),
    "ideal-links-some": (3, {"rx": 7.74e-3, "y": 4.12e-3}),
    "loaded-tripteron": (3, {"z": 3.67e-8}),
    "loaded-agile-eye": (3, {"ry": 1.66e-3}),
    "rank-of-c": (4, {}),
    "rigid-or-round-off": (5, {}),
    "joints-at-one-point": (4, {"rx": 0.105, "y": 5.47e-10}),
}
"""Rank of C, and diagonal entries of it (SI), by independent engines."""


def case(name, **changes):
    machine = load(CASES / f"{name}.toml")
    return with_values(machine, changes) if changes else machine


@pytest.mark.parametrize("name", TRUE)
def test_compliance_and_its_rank_are_those_of_independent_engines(name):
    rank, entries = TRUE[name]
    analysis = analyze(case(name))
    assert analysis.status is Status.OK
    assert analysis.rank == rank
    known = dict(zip(analysis.components, analysis.compliance_diagonal, strict=True))
    assert {c: known[c] for c in entries} == pytest.approx(entries, rel=ROUNDED)


@pytest.mark.parametrize("name", TRUE)
def test_what_rigid_parts_hold_is_exactly_rigid(name):
    """No compliance of 1e-36 in C, and no stiffness of 1e30 in K."""
    analysis = analyze(case(name))
    diagonal = np.array(analysis.compliance_diagonal)
    assert np.all((diagonal == 0.0) | (diagonal > 1e-14 * diagonal.max()))
    stiff = np.array(analysis.stiffness_diagonal)
    assert np.all(np.isinf(stiff) | (stiff < 1e20))


@pytest.mark.parametrize("name", sorted(TRUE.keys() - {"rank-of-c", "joints-at-one-point"}))
def test_the_loaded_machine_without_its_load_has_the_same_compliance(name):
    """The tangent at rest is found over admissible motions, C by wrenches: two routes.

    rank-of-c has a free drive; where joints meet in a point, displacements of 1e-12 m stand beside turns of 0.1 rad.
    """
    machine = case(name)
    joints = solve_joints(machine)
    mechanism = with_share(mechanism_of(machine, respond(machine, joints).configuration, joints), 0.0)
    solution = at_rest(mechanism)
    assert solution.settled.all()
    assert stability(solution.balance).stable
    tangent = platform_compliance(solution.balance)[0] * mechanism.compliance_units[0]
    expected = analyze(machine).C
    sizes = np.sqrt(np.diagonal(expected))
    assert np.all(abs(tangent - expected) <= ROUTES * np.outer(sizes, sizes))


@pytest.mark.parametrize("name", TRUE)
def test_a_grid_is_its_poses(name):
    """Machine code and single poses decide alike which rigid parts share a load."""
    machine = case(name)
    pose = {path: value for path, value in values(machine).items() if path.startswith("pose.")}
    share = np.linspace(0.2, 1.0, 6)
    poses = {path: value * share for path, value in pose.items()}
    grid = evaluate(machine, poses, ["compliance"])
    for i in range(len(share)):
        analysis = analyze(with_values(machine, {path: float(column[i]) for path, column in poses.items()}))
        assert Status(int(grid.status[i])) is analysis.status
        if analysis.status is Status.OK:
            found = [float(grid[f"compliance_{name}"][i]) for name in analysis.components]
            assert found == pytest.approx(analysis.compliance_diagonal, rel=ROUTES)


@pytest.mark.parametrize("name", ["ideal-links-agile-eye", "loaded-agile-eye"])
def test_the_tool_does_not_change_how_a_spherical_machine_turns(name):
    offsets = ([0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [-0.2, 0.05, 0.3])
    turning = []
    for offset in offsets:
        numbers = {f"tool.offset.{i}": c for i, c in enumerate(offset)}
        turning.append(analyze(case(name, **numbers)).C[:3, :3])
    assert np.allclose(turning[1:], turning[0], rtol=1e-10, atol=0.0)


@pytest.mark.parametrize("name", ["ideal-links-agile-eye", "ideal-links-exechon", "ideal-links-delta"])
def test_motors_carry_what_loads_them(name):
    """Virtual work: of the load on what it moves, and of the springs on what deforms them."""
    push = {"load.force.0": 10.0, "load.force.1": -4.0, "load.moment.0": 0.5, "load.moment.1": 1.0}
    state = under_load(case(name, **push))
    assert state.rest is Rest.OK
    work = float(np.dot([0.5, 1.0, 0.0, 10.0, -4.0, 0.0], state.displacement))
    energy = sum(spring.load * spring.deformation for spring in state.springs)
    assert work == pytest.approx(energy, rel=1e-3), "of first order in the displacement"
    assert work > 0.0


@pytest.fixture(scope="module")
def nearly_overconstrained(tmp_path_factory):
    """An Exechon at home, whose two pins are parallel but for 3e-8: neither by round-off nor clearly."""
    text = (CASES / "ideal-links-exechon.toml").read_text("utf-8")
    pin = "point = [-0.2, 0.0, 0.8], axis = [0, 1, 0]"
    home = {pin: pin.replace("[0, 1", "[3e-8, 1"), "z = 0.85": "z = 0.8", "roll = 0.2": "roll = 0.0"}
    for old, new in home.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    path = tmp_path_factory.mktemp("doubt") / "doubt.toml"
    path.write_text(text.replace("pitch = -0.1", "pitch = 0.0"), "utf-8")
    return path


@pytest.mark.parametrize(
    "words",
    [
        ["analyze"],
        ["analyze", "--loaded", "--set", "load.force.0=5"],
        ["modes", "--set", "tool.mass=1"],
        ["modes", "--loaded", "--set", "tool.mass=1", "--set", "load.gravity=[0, 0, -9.81]"],
        ["guidelines"],
        ["sensitivity", "--quantity", "compliance_x"],
    ],
    ids=" ".join,
)
def test_where_nobody_can_say_no_command_gives_a_number(nearly_overconstrained, capsys, words):
    assert main([words[0], str(nearly_overconstrained), *words[1:]]) == NO_ANSWER
    said = capsys.readouterr()
    assert "undecided" in " ".join((said.out + said.err).split())


def test_an_undecided_machine_is_not_commanded(nearly_overconstrained, tmp_path, capsys):
    poses = tmp_path / "poses.csv"
    poses.write_text("z [mm]\n799\n800\n", "utf-8")
    assert main(["command", str(nearly_overconstrained), str(poses), "--set", "load.force.0=5"]) == BAD_INPUT
    said = capsys.readouterr().err
    assert "2 of 2 poses have no command (2 undecided)" in said
    assert "Rigid parts of several legs" in said


def test_undecided_poses_of_grids_have_no_numbers(nearly_overconstrained):
    machine = with_values(load(nearly_overconstrained), {"load.force.0": 5.0})
    grid = evaluate(machine, {"pose.z": np.linspace(0.795, 0.805, 5)}, ["compliance_x"])
    assert set(grid.status.values.tolist()) == {Status.UNDECIDED}
    assert np.isnan(grid["compliance_x"]).all()
    loaded = evaluate(machine, {"pose.z": np.linspace(0.795, 0.805, 5)}, ["tangent_free_stiffness_x"])
    assert set(loaded.status.values.tolist()) == {Status.UNDECIDED}

"""Loaded states of many poses: programs of machines whose loops are cut against the solver for any machine."""

import numpy as np
import pytest

from kinetostat import analyze
from kinetostat.engine.batch import evaluate
from kinetostat.engine.loaded import NATIVE_FROM, Way, loaded_fill
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.cut import cut_machine
from kinetostat.kinematics.status import Status
from kinetostat.machine.parameters import values, with_values
from machines import hangprinter, load_without_limits
from refusals import refused

CUT = {
    *("hexapod", "hexapod-cubic", "planar-3rpr", "tricept", "zhang-gosselin-4dof"),
    *("passive-leg-3dof-pu", "passive-leg-3dof-pu-driven", "passive-leg-4dof-driven"),
    *("passive-leg-5dof", "passive-leg-5dof-driven"),
}
"""Bundled machines whose loops are cut at rods."""
WITH_LEGS = {
    *("delta", "delta-linear", "orthoglide", "planar-3rrr", "tripteron", "hexapod-hardware"),
    *("hexapod-rus", "tricept-rus", "passive-leg-3dof-pu-rus", "passive-leg-4dof-rus", "passive-leg-5dof-rus"),
}
"""Those with legs that close loops and are condensed onto the platform."""


def moved_by_about(name, amount, *settings):
    """A machine under a force, a moment and a weight that move it by about some m and rad."""
    planar = name.startswith("planar")
    soft = np.diag(analyze(load_without_limits(name, [*settings])).C)[1 if planar else 3 :].max()
    size = float(amount / soft)
    loads = [f"load.force={[0.3 * size, 0.5 * size, 0.0 if planar else -0.5 * size]}", f"tool.mass={size / 50}"]
    centre, moment = ([0.01, 0.02, 0.0], [0.0, 0.0, 0.02 * size]) if planar else ([0.01, 0.02, 0.03], [0.01 * size] * 3)
    pull = [0.0, -9.0, 0.0] if planar else [1.0, 0.0, -9.0]
    loads += [f"load.moment={moment}", f"tool.centre_of_mass={centre}", f"load.gravity={pull}"]
    return load_without_limits(name, [*loads, *settings])


def quantities_of(machine, *others):
    parts = [("rx", "ry", "rz", "x", "y", "z")[i] for i in machine.family.components]
    kinds = ("displacement", "tangent_free_stiffness", "tangent_stiffness")
    return [f"{kind}_{part}" for kind in kinds for part in parts] + list(others)


def both_ways(machine, columns, quantities):
    count = len(next(iter(columns.values())))
    answers = []
    for each in (Way.NATIVE, Way.ANY_MACHINE):
        results, status = np.full((len(quantities), count), np.nan), np.full(count, -1, dtype=np.int8)
        loaded_fill(machine, list(columns), quantities, each)(columns, results, status)
        answers.append((results, status))
    return answers


def compare(machine, columns, quantities, agreed=1e-9):
    (fast, status), (slow, expected) = both_ways(machine, columns, quantities)
    assert status.tolist() == expected.tolist()
    size = np.abs(slow)
    parts = len(machine.family.components)
    parts = parts if quantities[:parts] == quantities_of(machine)[:parts] else 0
    size[:parts] = size[:parts].max(axis=0, initial=0.0)  # of a displacement, small components count beside the largest
    same = (fast == slow) | (np.isnan(fast) & np.isnan(slow))
    with np.errstate(invalid="ignore"):
        assert (same | (np.abs(fast - slow) <= agreed * size)).all()
    return status


def poses_near(machine, count, share=0.01):
    pose = machine.tables["pose"]
    paths = [f"pose.{name}" for name in type(pose).__dataclass_fields__][:3]
    drawn = np.random.default_rng(1).uniform(-share, share, (3, count))
    return {path: getattr(pose, path[5:]) + row for path, row in zip(paths, drawn, strict=True)}


def test_which_machines_are_cut_and_which_of_them_have_legs_that_close_loops():
    cuts = {name: cut_machine(load_without_limits(name)) for name in CUT | WITH_LEGS | {"cogiro"}}
    assert all(found is not None for found in cuts.values())
    assert {name for name, found in cuts.items() if found.legs} == WITH_LEGS


def test_legs_of_a_file_are_rods_while_their_slides_point_along_them():
    """A leg of three joints is no rod if its slide is askew, and none is by numbers that vary."""
    machine = hangprinter()
    poses = {f"pose.{name}": np.random.default_rng(2).uniform(-0.4, 0.4, 8) for name in "xyz"}
    assert (compare(machine, poses, quantities_of(machine, "load_factor", "slack_springs")) == Status.OK).all()
    axis = next(path for path in values(machine) if ".axis." in path)
    assert cut_machine(machine, [axis]) is None
    askew = with_values(machine, {axis: values(machine)[axis] + 1e-3})
    assert cut_machine(askew) is None


@pytest.mark.parametrize("name", sorted(CUT))
def test_loaded_states_of_a_program_are_those_of_the_solver(name):
    machine = moved_by_about(name, 2e-3)
    status = compare(machine, poses_near(machine, 6), quantities_of(machine, "load_factor", "slack_springs"))
    assert (status == Status.OK).all()


def test_machine_code_gives_them_too_and_leaves_far_ones_to_the_solver():
    machine = moved_by_about("zhang-gosselin-4dof", 1e-3)
    force = machine.tables["load"].force[2]
    columns = poses_near(machine, 4) | {"load.force.2": force * np.array([1.0, 0.0, 200.0, 30.0])}
    columns["pose.z"][0] = 9.0
    status = compare(machine, columns, ["displacement_z", "tangent_stiffness_z"])
    assert status.tolist() == [Status.OUT_OF_REACH, Status.OK, Status.OK, Status.OK]


def test_links_weigh_as_they_do_in_the_solver():
    densities = ["linear_density.legs=0.3 kg/m", "linear_density.passive_links=[0.01, 0.02]"]
    machine = load_without_limits("zhang-gosselin-4dof", [*densities, "load.gravity=[0, 0, -0.1]"])
    compare(machine, poses_near(machine, 6), quantities_of(machine))
    bare = load_without_limits("zhang-gosselin-4dof", ["tool.mass=1e-9", "load.gravity=[0, 0, -0.1]"])
    moved = [both_ways(each, poses_near(each, 2), ["displacement_x"])[0][0][0] for each in (machine, bare)]
    assert (np.abs(moved[0]) > 1e3 * np.abs(moved[1])).all()


def test_rigid_links_and_springs_in_a_row():
    rigid = moved_by_about("zhang-gosselin-4dof", 1e-3, "stiffness.passive_links=rigid", "stiffness.leg_axial=2e4")
    compare(rigid, poses_near(rigid, 6), quantities_of(rigid), agreed=1e-8)


def test_machines_that_cannot_be_cut_are_left_to_the_solver():
    """A slide may point askew of its leg where a number of its axis varies."""
    machine = hangprinter()
    axis = next(path for path in values(machine) if ".axis." in path)
    columns = {"pose.x": np.array([0.0, 0.1, 0.2]), axis: np.full(3, values(machine)[axis])}
    compare(machine, columns, quantities_of(machine), agreed=0.0)


def of_programs(monkeypatch):
    """See to it that no point is left to the solver for any machine."""
    from kinetostat.engine import loaded

    chosen = loaded._fill_with_unknowns
    monkeypatch.setattr(loaded, "_solve_in_parts", lambda *_: pytest.fail("the slow solver was asked"))
    return chosen


AT_REST = ("tangent_free_stiffness", "tangent_stiffness", "displacement")
SLOW = {"orthoglide", "hexapod-hardware", "delta-linear"}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in sorted(WITH_LEGS)]
)
def test_programs_condense_legs_that_close_loops(name):
    """Loads move the tool by 5 mm; masses of links, where the file has them, weigh as in the solver."""
    machine = moved_by_about(name, 5e-3)
    turns = name in ("delta", "planar-3rrr") or name.endswith("-rus")
    others = ["actuator_moment" if turns else "actuator_force", "slack_springs"]
    programs, solver = both_ways(machine, poses_near(machine, 8), [*quantities_of(machine), *others])
    assert (programs[1] == Status.OK).all()
    assert (solver[1] == Status.OK).all()
    assert not np.array_equal(programs[0], solver[0])  # they are two routes
    sizes = np.abs(solver[0])
    parts = len(machine.family.components)
    sizes[:parts] = sizes[:parts].max(axis=0)
    same = (programs[0] == solver[0]) | (np.abs(programs[0] - solver[0]) <= 1e-10 * sizes)
    assert same.all()


@pytest.mark.parametrize("amount", [1e-4, 1e-3])
def test_the_chord_method_leads_so_near_that_a_step_of_newton_is_repeated_at_few_poses(monkeypatch, amount):
    """The numbers are compared with the solver above; here it is counted what they cost."""
    from kinetostat.engine.machine_code import Program

    machine, counted = moved_by_about("tripteron", amount), {}
    run = Program.run

    def counting(program, fixed, columns, results, codes):
        counted[len(results)] = counted.get(len(results), 0) + len(codes)
        run(program, fixed, columns, results, codes)

    monkeypatch.setattr(Program, "run", counting)
    quantities, poses = quantities_of(machine), poses_near(machine, 64)
    results, status = np.empty((len(quantities), 64)), np.empty(64, dtype=np.int8)
    loaded_fill(machine, list(poses), quantities, Way.NATIVE)(poses, results, status)
    assert (status == Status.OK).all()
    assert counted[max(counted)] <= 1.5 * 64  # the program with the quantities has the most results; three times before
    assert counted[min(counted)] <= 6 * 64  # the first step and those of the chord method


def test_programs_with_more_results_than_are_kept_together_evaluate_point_by_point(monkeypatch):
    from kinetostat.engine import rest

    monkeypatch.setattr(rest, "NUMBERS_PER_STEP", 1)
    machine = moved_by_about("planar-3rrr", 1e-3)
    assert (compare(machine, poses_near(machine, 3), quantities_of(machine)) == Status.OK).all()


def test_legs_with_rigid_links_share_what_rigid_parts_hold():
    """The bars and arms of a Delta are rigid unless its file says otherwise: three springs hold nine wrenches."""
    rigid = ["stiffness.bar_axial=rigid", "stiffness.arm_bending=rigid", "stiffness.arm_torsion=rigid"]
    machine = load_without_limits(
        "delta", ["load.force=[200, 100, -300]", "tool.mass=2", "load.gravity=[0, 0, -9.81]", *rigid]
    )
    quantities = [f"{kind}_{c}" for kind in ("displacement", "tangent_free_stiffness") for c in "xyz"]
    (fast, status), (slow, expected) = both_ways(machine, poses_near(machine, 8), [*quantities, "actuator_moment"])
    assert status.tolist() == expected.tolist() == [Status.OK] * 8
    assert np.allclose(fast, slow, rtol=1e-9, atol=0.0)
    assert not np.array_equal(fast, slow)


def test_vibration_at_rest_of_a_platform_that_is_alone_massive():
    machine = load_without_limits(
        "delta", ["tool.mass=2 kg", "load.force=[100, 0, -200]", "load.gravity=[0, 0, -9.81]"]
    )
    names = [f"loaded_frequency_{k}" for k in (1, 2, 3)]
    (fast, status), (slow, _) = both_ways(machine, poses_near(machine, 8), names)
    assert (status == Status.OK).all()
    assert np.allclose(fast, slow, rtol=1e-9, atol=0.0)
    assert not np.array_equal(fast, slow)


SLOWER = ("delta", "tripteron", "hexapod-rus")


@pytest.mark.parametrize("name", ["planar-3rrr", *(pytest.param(name, marks=pytest.mark.slow) for name in SLOWER)])
def test_vibration_and_load_factor_of_massive_legs_that_close_loops(monkeypatch, name):
    """At points that are well within reach, so that none is left to the solver."""
    from kinetostat.engine import loaded

    machine = moved_by_about(name, 2e-3)
    densities = {path: 1.5 for path in values(machine) if path.startswith("linear_density.")}
    machine, poses = with_values(machine, densities), poses_near(machine, 12)
    names = ["loaded_frequency_2", "load_factor", "displacement_x", "loaded_frequency_1", "frequency_1"]
    slow, fast, codes = np.empty((5, 12)), np.empty((5, 12)), np.empty((2, 12), dtype=np.int8)
    loaded_fill(machine, list(poses), names, Way.ANY_MACHINE)(poses, slow, codes[0])
    monkeypatch.setattr(loaded, "_solve_in_parts", lambda *_: pytest.fail("the slow solver was asked"))
    loaded_fill(machine, list(poses), names, Way.NATIVE)(poses, fast, codes[1])
    assert (codes == Status.OK).all()
    assert (abs(slow[3] / slow[4] - 1.0) > 1e-4).all()  # loads change what vibrates
    assert np.allclose(fast, slow, rtol=1e-9, atol=0.0)
    assert not np.array_equal(fast, slow)


def test_many_points_go_through_programs(monkeypatch):
    from kinetostat.engine import loaded

    machine = moved_by_about("hexapod", 1e-3)
    monkeypatch.setattr(loaded, "_solve_in_parts", lambda *_: pytest.fail("the slow solver was asked"))
    count = NATIVE_FROM
    values = evaluate(machine, PointTable(poses_near(machine, count)), ["displacement_z"])
    assert (values.status == Status.OK).all()


def test_gravity_without_any_mass_is_refused_by_programs_too():
    machine = load_without_limits("hexapod", ["load.gravity=[0, 0, -9.81]"])
    with refused(r"load.gravity pulls at masses, but none is known"):
        evaluate(machine, PointTable({"pose.x": np.zeros(NATIVE_FROM)}), ["displacement_z"])

"""Machines at rest under their loads: against linear answers, differences, an independent engine, and derivations."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kinetostat import analyze, build, bundled, command, evaluate, forward, save, sensitivity, under_load
from kinetostat.equilibrium.balance import balance, free_state, state_after
from kinetostat.equilibrium.elastic_legs import FEW_POSES
from kinetostat.equilibrium.solving import Rest, newton_step
from kinetostat.equilibrium.state import state_of
from kinetostat.equilibrium.tangent import finite_solution
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.machine.loads import located_members
from kinetostat.views.notebook import html_of
from machines import ONE_SIDED, load_without_limits
from refusals import refused

GRAVITY = "load.gravity=[0, 0, -9.81]"
WEIGHT = ["tool.mass=300 kg", "tool.centre_of_mass=[0.01, 0.02, 0.05]", "load.gravity=[2, -3, -9]"]


def loaded(name, force, moment=(0, 0, 0), *settings):
    given = [
        f"load.{what}={np.array(value, dtype=float).tolist()}" for what, value in (("force", force), ("moment", moment))
    ]
    return under_load(load_without_limits(name, [*given, *settings]))


@pytest.mark.parametrize("name", ["hexapod", "delta", "planar-3rrr", "tripteron", "passive-leg-5dof-rus"])
def test_without_loads_nothing_moves_and_the_tangent_is_the_stiffness(name):
    machine = load_without_limits(name, ["load.force=[0, 0, 0]", "load.moment=[0, 0, 0]"])
    state, analysis = under_load(machine), analyze(machine)
    assert state.rest is Rest.OK
    assert not any(state.displacement)
    size = np.abs(analysis.C).max()
    assert np.array(state.compliance) == pytest.approx(analysis.C, abs=1e-9 * size)
    assert np.isinf(state.factor)


@pytest.mark.parametrize("name", [name for name in bundled() if name not in ONE_SIDED])
def test_small_loads_move_it_as_linear_equations_say_but_for_the_square_of_the_load(name):
    """Force, moment, weight of platform and links; the largest load moves the tool by a thousandth of its size."""
    machine = load_without_limits(name)
    analysis, planar = analyze(machine), name.startswith("planar")
    moments, forces = ([0, 0, 0.02], [3, -4, 0]) if planar else ([0.02, 0.01, 0.03], [3, -4, 5])
    wrench = np.concatenate([moments, forces])[list(machine.family.components)]
    size = 1e-3 * analysis.characteristic_length / np.abs(np.array(analysis.C) @ wrench)[-3:].max()
    heavy = load_without_limits(name, [f"tool.mass={size}"])
    errors = []
    for share in (1.0, 0.5):
        pairs = {"moment": moments, "force": forces, "gravity": [1 / size, 2 / size, 0 if planar else -3 / size]}
        loads = {f"load.{what}": (np.array(values) * size * share).tolist() for what, values in pairs.items()}
        state = under_load(heavy.with_values(loads))
        errors.append(np.abs(np.subtract(state.displacement, state.linear)).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_to_first_order_a_load_moves_it_as_its_compliance_says():
    for name, force in (("hexapod", (30, -40, 500)), ("delta", (2, 1, -3))):
        wrench = np.concatenate([np.zeros(3), force])
        machine = load_without_limits(name)
        assert loaded(name, force).linear == pytest.approx(analyze(machine).C @ wrench, rel=1e-8, abs=1e-15)


@pytest.mark.parametrize(
    ("name", "force"),
    [("hexapod", (6e3, 1e4, -1.6e4)), ("hexapod-rus", (900, 1500, -2400)), ("tricept", (3e4, 5e4, -8e4))],
)
def test_the_tangent_is_the_derivative_of_the_state_by_its_load(name, force):
    settings = ["tool.mass=20 kg", "tool.centre_of_mass=[0.01, 0.02, 0.05]", GRAVITY]
    state, step = loaded(name, force, (0, 0, 0), *settings), 0.05 * max(map(abs, force))
    columns = []
    for axis in range(3):
        ends = []
        for size in (step, -step, 0.5 * step, -0.5 * step):
            pushed = np.array(force, dtype=float)
            pushed[axis] += size
            ends.append(np.array(loaded(name, pushed, (0, 0, 0), *settings).displacement[3:]))
        wide, narrow = (ends[0] - ends[1]) / (2 * step), (ends[2] - ends[3]) / step
        columns.append((4 * narrow - wide) / 3)
    translations = np.array(state.compliance)[3:, 3:]
    assert pytest.approx(translations, abs=1e-6 * np.abs(translations).max()) == np.array(columns).T
    assert not np.allclose(state.elastic, state.tangent, rtol=1e-3), "turning lines of action count here"


@pytest.mark.parametrize("conservative", [[], WEIGHT], ids=["bare", "with weight and preload"])
def test_no_work_is_done_round_a_closed_path(conservative):
    """The force turns once and comes back; the derivative of a periodic path is exact by Fourier's series."""
    count = 24
    angles = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    forces = np.stack([2e4 * np.cos(angles), 1e4 * np.sin(angles), np.full(count, -1.5e4)], axis=1)
    document = document_of(load_without_limits("hexapod"))
    if conservative:
        for number, joint in enumerate(joint for leg in document["legs"] for joint in leg["joints"]):
            joint |= {"preload": 2e3 * (1 + number % 5)} if joint.get("actuated") else {}
    machine = build(document, "legs", conservative)
    table = evaluate(machine, {f"load.force.{i}": forces[:, i] for i in range(3)}, ["displacement"])
    path = np.stack([table[f"displacement_{axis}"].values for axis in "xyz"], axis=1)
    waves = np.fft.fftfreq(count, 1.0 / count) * 1j
    waves[count // 2] = 0.0
    speed = np.fft.ifft(waves[:, None] * np.fft.fft(path, axis=0), axis=0).real
    work = (forces * speed).sum(axis=1)
    assert abs(work.sum()) < 1e-12 * np.abs(work).sum()


@pytest.mark.parametrize("name", ["hexapod", "delta", "hexapod-rus", "planar-3rrr", "orthoglide", "tricept"])
def test_a_family_and_itself_leg_by_leg_come_to_one_state(name):
    planar = name.startswith("planar")
    high = 0.0 if planar else 0.02
    settings = [
        f"load.force={[20, 30, 0] if planar else [20, 30, -50]}",
        "tool.mass=5 kg",
        "tool.payload=3 kg",
        f"tool.centre_of_mass={[0.01, -0.02, high]}",
        f"load.gravity={[4, 3, 0] if planar else [1, 2, -9]}",
        "load.gravity_angle=20 deg",
        f"load.gravity_axis={[0, 0, 1]}",
        f"load.hook={{point = {[0.03, 0.01, high]}, force = {[5, -3, 0]}}}",
    ]
    machine = load_without_limits(name, settings)
    state, legs = under_load(machine), build(document_of(machine), "legs")
    # A link's springs stand in another order there, and turns do not commute: the square of the angle.
    square = float(np.max(np.abs(state.displacement)) ** 2)
    assert under_load(legs).displacement == pytest.approx(state.displacement, rel=1e-6, abs=square)


def test_weight_of_links_hangs_at_both_of_their_ends():
    """The sag of a Delta by its arms and bars is that of forces and moments at their ends, by virtual work."""
    densities = ["linear_density.arms=3 kg/m", "linear_density.bars=1 kg/m"]
    machine = load_without_limits("delta", [*densities, "load.gravity=[0, 0, -0.00981]"])
    sag = np.array(under_load(machine).displacement)
    analysis = analyze(machine)
    step, rise = 1e-6, []
    for axis in "xyz":  # half of the masses of arms and bars at the elbows, all the rest at the platform
        heights = []
        for side in (step, -step):
            moved = machine.with_values({axis: getattr(machine.tables["pose"], axis) + side}).configure()
            elbows = sum(float(leg.stations[1][1].z) for leg in moved.legs) * (0.5 * 3 * 0.35 + 1 * 0.8)
            heights.append(elbows + 3 * 0.8 * float(moved.platform.translation.z))
        rise.append((heights[0] - heights[1]) / (2 * step))
    # Springs of the arms bend under weights too, which rigid kinematics leaves out: only actuators are elastic here.
    stiff = ["stiffness.bar_axial=rigid", "stiffness.arm_bending=rigid", "stiffness.arm_torsion=rigid"]
    rigid = load_without_limits("delta", [*densities, *stiff, "load.gravity=[0, 0, -0.00981]"])
    expected = analyze(rigid).C[3:, 3:] @ (-0.00981 * np.array(rise))
    assert np.array(under_load(rigid).displacement[3:]) == pytest.approx(expected, rel=1e-4)
    assert np.linalg.norm(sag[3:]) > np.linalg.norm(expected)
    assert analysis.moving_mass == pytest.approx(3 * (3 * 0.35 + 2 * 0.8))


def test_commanded_coordinates_bring_the_loaded_tool_to_its_pose():
    """By another route: the unloaded machine with these leg lengths, found by forward kinematics, is loaded."""
    settings = ["load.force=[6e3, 1e4, -1.6e4]", "tool.mass=20 kg", GRAVITY]
    machine = load_without_limits("hexapod", settings)
    answer = command(machine)
    assert answer.distance_uncorrected[0] > 1e-4
    assert answer.distance_corrected[0] < 1e-12
    ideal = forward(machine, dict(zip(answer.actuators, answer.coordinates[0].tolist(), strict=True))).present
    state = under_load(machine.with_values(ideal.pose))
    turned = Rotation.from_rotvec(np.array(state.displacement[:3])) * Rotation.from_matrix(ideal.rotation)
    assert np.add(ideal.position, state.displacement[3:]) == pytest.approx([0.0, 0.0, 0.135], abs=1e-12)
    assert turned.magnitude() < 1e-11


def test_commands_for_many_poses_are_those_for_each(tmp_path):
    machine = load_without_limits("delta", ["load.force=[0, 0, -30]"])
    poses = {"x": [0.0, 0.1, 5.0], "z": [-0.7, -0.75, -0.7]}
    answer = command(machine, poses)
    assert answer.settled.tolist() == [True, True, False]
    for i in range(2):
        alone = command(machine.with_values(x=poses["x"][i], z=poses["z"][i]))
        assert answer.coordinates[i] == pytest.approx(alone.coordinates[0], abs=1e-14)
    assert (answer.distance_corrected[:2] < 1e-3 * answer.distance_uncorrected[:2]).all()


@pytest.mark.parametrize("name", ["passive-leg-4dof-driven", "passive-leg-5dof-driven", "passive-leg-3dof-pu-driven"])
def test_links_of_a_driven_leg_weigh_as_those_of_a_passive_one(name):
    """The joint at its foot is driven, and the links begin there all the same."""
    machine = load_without_limits(name)
    for link in located_members(machine, machine.configure(), None):
        (_, start), (_, end) = link.ends()
        assert float((end - start).norm()) == pytest.approx(float(link.length), rel=1e-9)


def test_gravity_turns_about_its_axis():
    weights = ["tool.mass=20 kg", "tool.centre_of_mass=[0.01, 0.02, 0.05]", GRAVITY]
    tilted = load_without_limits("hexapod", [*weights, "load.gravity_axis=[0, 3, 0]", "load.gravity_angle=30 deg"])
    down = np.array([-math.sin(math.radians(30.0)), 0.0, -math.cos(math.radians(30.0))]) * 9.81
    turned = load_without_limits("hexapod", [*weights, f"load.gravity={down.tolist()}"])
    assert under_load(tilted).displacement == pytest.approx(under_load(turned).displacement, rel=1e-12, abs=1e-16)
    with refused("load.gravity_axis is .0, 0, 0."):
        under_load(tilted.with_values(gravity_axis=[0, 0, 0]))


def test_gravity_without_any_mass_is_refused():
    with refused(r"load.gravity pulls at masses, but none is known.*\[tool\] mass"):
        under_load(load_without_limits("hexapod", [GRAVITY]))


@pytest.mark.parametrize("name", ["hexapod", "planar-3rrr", "delta", "tripteron"])
@pytest.mark.numbers
def test_a_table_of_loaded_states_is_each_of_them(name):
    planar = name.startswith("planar")
    machine = load_without_limits(name, [f"load.force={[20, 30, 0] if planar else [20, 30, -50]}"])
    home = machine.tables["pose"].x
    places = [home - 0.01, home + 0.005, home + 50.0]
    table = evaluate(machine, {"x": places}, ["displacement", "tangent_stiffness", "slack_springs", "load_factor"])
    assert table.status.values[:2].tolist() == [0, 0]
    assert table.status.values[2] != 0
    for i in range(2):
        state = under_load(machine.with_values(x=places[i]))
        size = max(map(abs, state.displacement))
        for row, part in enumerate(state.components):
            assert float(table[f"displacement_{part}"][i]) == pytest.approx(state.displacement[row], abs=1e-9 * size)
            assert float(table[f"tangent_stiffness_{part}"][i]) == pytest.approx(state.tangent[row][row], rel=1e-9)
        assert float(table["load_factor"][i]) == pytest.approx(state.factor, rel=1e-9)
    assert np.isnan(table["slack_springs"][2])


@pytest.mark.parametrize("name", bundled())
def test_legs_of_one_form_together_are_each_of_them_alone(name):
    """At more than a few poses, legs are evaluated one by one."""
    mechanism, rng = state_of(load_without_limits(name, [])).mechanism, np.random.default_rng(1)
    free, many = free_state(mechanism), np.zeros(FEW_POSES + 1, dtype=int)
    step = rng.uniform(-0.1, 0.1, (1, mechanism.unknown_places.count))
    amounts = rng.uniform(-0.1, 0.1, free.amounts.shape)
    state = replace(state_after(mechanism, free, step), amounts=amounts)
    together, alone = balance(mechanism, state), balance(mechanism.at(many), state.at(many))
    assert together.residual[0] == pytest.approx(alone.residual[-1], rel=1e-12, abs=1e-14)
    assert together.by_actuators()[0] == pytest.approx(alone.by_actuators()[-1], rel=1e-12, abs=1e-14)
    for number in range(len(mechanism.legs)):
        assert together.leg_rates(number)[0] == pytest.approx(alone.leg_rates(number)[-1], rel=1e-12, abs=1e-14)
        held, holds = (each.legs[number].holding for each in (together, alone))
        assert held[0] == pytest.approx(holds[-1], rel=1e-12, abs=1e-14)


def test_one_pose_does_not_change_the_digits_of_the_others():
    """Poses with a stiff leg are solved in another way than the others, and those that are nowhere not at all."""
    mechanism = state_of(load_without_limits("hexapod", ["load.force=[10, 20, -30]"])).mechanism.at(
        np.zeros(3, dtype=int)
    )
    first, *others = mechanism.legs
    stiff = replace(first, stiffness=first.stiffness * [[1.0], [1e9], [np.nan]])
    equations = balance(replace(mechanism, legs=(stiff, *others)), free_state(mechanism))
    alone = balance(mechanism.at(np.array([0])), free_state(mechanism.at(np.array([0]))))
    usual, with_stiff_leg, nowhere = newton_step(equations)
    assert np.array_equal(usual, newton_step(alone)[0])
    spring = mechanism.unknown_places.coordinates[0].start + [s is None for s in first.springs].index(False)
    assert abs(with_stiff_leg[spring]) < 1e-6 * abs(usual[spring])
    assert np.isnan(nowhere).all()


def test_a_singular_pose_does_not_change_the_digits_of_the_others():
    rng = np.random.default_rng(0)
    matrices, right = rng.normal(size=(3, 6, 6)), rng.normal(size=(3, 6, 2))
    matrices[1, :, 5], right[2] = 0.0, np.nan
    solved = finite_solution(matrices, right)
    assert np.array_equal(solved[0], np.linalg.solve(matrices[0], right[0]))
    assert solved[1] == pytest.approx(np.linalg.pinv(matrices[1]) @ right[1])
    assert np.isnan(solved[2]).all()


def test_a_machine_whose_preloads_are_chosen_has_no_derivatives_under_load():
    with refused(r'"displacement_z" of .* has no derivatives.*tensions are to be chosen.*sweep or map'):
        sensitivity(load_without_limits("hexapod", ["load.min_tension=1"]), ["displacement_z"])


def test_answers_are_saved_and_shown_in_notebooks(tmp_path):
    machine = load_without_limits("hexapod", ["load.force=[20, 30, -50]"])
    for answer, key in ((under_load(machine), "tangent_stiffness"), (command(machine), "coordinates")):
        data = json.loads(save(answer, tmp_path / "answer.json").read_text())
        assert np.isfinite(np.array(data[key], dtype=float)).all()
        assert "leg 1 actuator" in html_of(answer)


def test_a_rigid_machine_does_not_move_by_round_off():
    state = under_load(load_without_limits("hexapod", ["load.force=[20, 30, -50]", "stiffness.actuator=rigid"]))
    assert state.rest is Rest.OK
    assert not np.any(state.displacement)
    assert not np.any(state.compliance)
    assert state.tangent is None


def test_poses_without_a_place_leave_the_others_of_a_table_alone():
    machine = load_without_limits("delta", ["load.force=[2, 3, -5]"])
    table = evaluate(machine, {"x": [0.0, 9.0, 0.1]}, ["displacement_z", "tangent_stiffness_z"])
    assert table.status.values.tolist() == [0, 1, 0]
    assert np.isfinite(table["displacement_z"].values[[0, 2]]).all()

"""Machines at rest under their loads: against linear answers, differences, an independent engine, and derivations."""

import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kinetostat import analyze, build, command, evaluate, forward, plot, save, sensitivity, under_load
from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.solving import Rest
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.studies.under_load import load_curve
from kinetostat.validation import exudyn_machine
from kinetostat.views.notebook import html_of
from machines import load_without_limits
from refusals import refused

GRAVITY = "load.gravity=[0, 0, -9.81]"


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


@pytest.mark.parametrize(("name", "force"), [("hexapod", (30, -40, 500)), ("delta", (2, 1, -3))])
def test_small_loads_move_it_as_linear_equations_say_but_for_the_square_of_the_load(name, force):
    errors = []
    for share in (1.0, 0.5, 0.25):
        state = loaded(name, np.array(force) * share)
        errors.append(np.linalg.norm(np.subtract(state.displacement, state.linear)))
        machine = load_without_limits(name)
        wrench = np.concatenate([np.zeros(3), np.array(force) * share])
        assert state.linear == pytest.approx(analyze(machine).C @ wrench, rel=1e-8, abs=1e-15)
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx([2.0, 2.0], abs=0.05)


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


def test_no_work_is_done_round_a_closed_path():
    """The force turns once and comes back; the derivative of a periodic path is exact by Fourier's series."""
    angles = np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False)
    forces = np.stack([2e4 * np.cos(angles), 1e4 * np.sin(angles), np.full(16, -1.5e4)], axis=1)
    path = np.array([loaded("hexapod", force).displacement[3:] for force in forces])
    waves = np.fft.fftfreq(16, 1.0 / 16) * 1j
    waves[8] = 0.0
    speed = np.fft.ifft(waves[:, None] * np.fft.fft(path, axis=0), axis=0).real
    work = (forces * speed).sum(axis=1)
    assert abs(work.sum()) < 1e-7 * np.abs(work).sum()


@pytest.mark.parametrize(
    ("name", "size", "agreed"),
    [
        ("hexapod", 2e4, 1e-9),
        ("hexapod-rus", 3e3, 1e-6),
        ("tricept", 1e5, 1e-8),
        ("tripteron", 2e3, 1e-6),
        ("passive-leg-5dof-rus", 3.0, 1e-6),
        ("planar-3rrr", 2e3, 1e-6),
    ],
)
def test_exudyn_comes_to_the_same_state(name, size, agreed):
    """Loads that move the tool by millimetres; the engine solves its own nonlinear statics of bodies and springs."""
    pytest.importorskip("exudyn")
    planar = name.startswith("planar")
    force = np.array([0.3, 0.5, 0.0 if planar else -0.8]) * size
    moment = np.array([0.0, 0.0, 0.01] if planar else [0.02, 0.01, 0.015]) * size
    mass, centre, gravity = size / 20.0, [0.01, 0.02, 0.0 if planar else 0.05], [2.0, -3.0, 0.0 if planar else -9.0]
    weight = [f"tool.mass={mass}", f"tool.centre_of_mass={centre}", f"load.gravity={gravity}"]
    if name == "tripteron":  # its links weigh as well, which the engine's do not here
        weight.append("sections.bar.density=0")
    state = loaded(name, force, moment, *weight)
    assert state.linear != pytest.approx(state.displacement, rel=1e-5)
    response = exudyn_response(load_without_limits(name))
    theirs = exudyn_displacement(response, np.concatenate([moment, force]), centre, mass * np.array(gravity))
    parts = list(state.machine.family.components)
    ours = np.array(state.displacement)
    angles = np.zeros(3)
    angles[[2] if planar else [0, 1, 2]] = ours[:1] if planar else ours[:3]
    turned = Rotation.from_rotvec(angles).as_euler("XYZ")
    expected = np.concatenate([turned, [*ours[1:], 0.0] if planar else ours[3:]])
    assert theirs[parts] == pytest.approx(expected[parts], abs=agreed * np.abs(ours).max())


def exudyn_response(machine):
    from kinetostat.kinematics.closure import solve_joints
    from kinetostat.kinetostatics.response import respond

    return respond(machine, solve_joints(machine) if machine.family.chains else None)


def exudyn_displacement(response, wrench, centre, weight):
    """Displacement of the platform under a wrench at the tool point and a weight at a centre in platform axes."""
    model, _ = exudyn_machine.build(response.configuration, response.reference)
    model.system.Assemble()
    settings = exudyn_machine._settings(model)
    unit = float(np.max(np.abs(model.system.ComputeLinearizedSystem(settings)[1])))
    model, platform = exudyn_machine.build(response.configuration, response.reference, unit=unit)
    marker = model.marker(platform, platform.at, np.eye(3))
    kinds = (model.items.Torque, model.items.Force)
    loads = [model.system.AddLoad(kind(markerNumber=marker, loadVector=[0.0] * 3)) for kind in kinds]
    at = response.configuration.platform.apply(Vector(*centre))
    heavy = model.marker(platform, np.array(at.components(), dtype=float), np.eye(3))
    model.system.AddLoad(model.items.Force(markerNumber=heavy, loadVector=(weight / model.unit).tolist()))
    model.system.Assemble()
    rest = model.system.systemData.GetODE2Coordinates()
    return exudyn_machine._displacement(model, platform, loads, rest, wrench / model.unit)


@pytest.mark.parametrize("name", ["hexapod", "delta", "hexapod-rus", "planar-3rrr", "orthoglide", "tricept"])
def test_a_family_and_itself_leg_by_leg_come_to_one_state(name):
    planar = name.startswith("planar")
    machine = load_without_limits(name, [f"load.force={[20, 30, 0] if planar else [20, 30, -50]}", "tool.mass=5 kg"])
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
    assert answer.before[0] > 1e-4
    assert answer.left[0] < 1e-12
    ideal = forward(machine, dict(zip(answer.actuators, answer.coordinates[0].tolist(), strict=True))).present
    state = under_load(machine.with_values(ideal.pose))
    turned = Rotation.from_rotvec(state.displacement[:3]) * Rotation.from_matrix(ideal.rotation)
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
    assert (answer.left[:2] < 1e-3 * answer.before[:2]).all()


CABLES = """
schema = 1
name = "cables"
family = "legs"
space = "planar"
[platform]
point = [0, 0, 0]
[pose]
x = 0
y = 0
yaw = 0
"""
ANCHORS = {"a": ((-2.0, 1.5), (-0.2, 0.1)), "b": ((2.0, 1.5), (0.2, -0.1)), "c": ((0.3, -1.6), (0.05, -0.1))}
STRETCH = 2e5


def cables(ends, preload, *more):
    legs = "".join(
        f'[[legs]]\nname = "{name}"\ntype = "cable"\nfrom = {[*base, 0.0]}\nto = {[*eye, 0.0]}\n'
        f"stiffness = {STRETCH}\npreload = {preload[name]}\n"
        for name, (base, eye) in ends.items()
    )
    return build("\n".join([CABLES, *more, legs]))


def stretched(ends, tensions):
    """Gradient and second derivative of the energy of cables by yaw, x, y of the platform, from their lengths alone."""
    gradient, elastic, geometric = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    for name, (base, eye) in ends.items():
        span, arm = np.subtract(eye, base), np.array(eye)
        length = np.linalg.norm(span)
        along = span / length
        moves = np.array([[-arm[1], 1.0, 0.0], [arm[0], 0.0, 1.0]])
        rate = along @ moves
        across = (np.eye(2) - np.outer(along, along)) / length
        turned = np.zeros((3, 3))
        turned[0, 0] = -along @ arm
        gradient += tensions[name] * rate
        elastic += STRETCH * np.outer(rate, rate)
        geometric += tensions[name] * (moves.T @ across @ moves + turned)
    return gradient, elastic, geometric


def test_three_cables_hold_a_weight_with_the_tensions_and_the_stiffness_of_their_derivation():
    """Preloads that balance 600 N and a moment at the free pose: nothing moves, and K has both parts."""
    rates = np.array([stretched({n: e}, {n: 1.0})[0] for n, e in ANCHORS.items()]).T
    pull = 400.0
    tensions = dict(zip(ANCHORS, np.linalg.solve(rates, [5.0, 0.0, -pull]), strict=True))
    tensions = {name: float(t) for name, t in tensions.items()}
    assert min(tensions.values()) < 0.0, "as they lie, one would have to push"
    tensions = {"a": 900.0, "b": 800.0, "c": 700.0}
    gradient, elastic, geometric = stretched(ANCHORS, tensions)
    load = f"[load]\nforce = [{gradient[1]}, {gradient[2]}, 0]\nmoment = [0, 0, {gradient[0]}]\n"
    state = under_load(cables(ANCHORS, tensions, load))
    assert state.rest is Rest.OK
    assert state.displacement == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert {s.leg: s.load for s in state.springs} == pytest.approx(tensions, rel=1e-9)
    assert np.array(state.elastic) == pytest.approx(elastic, rel=1e-9, abs=1e-3)
    assert np.array(state.tangent) == pytest.approx(elastic + geometric, rel=1e-9, abs=1e-3)


HANGING = {
    "top left": ((-1.0, 2.0), (-1.0, 0.2)),
    "top right": ((1.0, 2.0), (1.0, 0.2)),
    "bottom left": ((-1.0, -2.0), (-1.0, -0.2)),
    "bottom right": ((1.0, -2.0), (1.0, -0.2)),
}


@pytest.mark.parametrize(("share", "slack"), [(0.99, 0), (1.01, 2), (3.0, 2)])
def test_cables_go_slack_at_the_load_of_their_derivation(share, slack):
    """Upright cables of one stiffness, each with 100 N: a weight takes as much from the lower ones as it adds above."""
    preload, weight = 100.0, 400.0 * share
    force = f"[load]\nforce = [0, {-weight}, 0]\n"
    state = under_load(cables(HANGING, dict.fromkeys(HANGING, preload), force))
    upper, lower = (weight / 2, 0.0) if slack else (preload + weight / 4, preload - weight / 4)
    assert state.rest is Rest.OK
    assert len(state.slack_legs) == slack
    loads = {s.leg: s.load for s in state.springs}
    assert [loads["top left"], loads["top right"]] == pytest.approx([upper] * 2, rel=1e-9)
    assert [loads["bottom left"], loads["bottom right"]] == pytest.approx([lower] * 2, abs=1e-6)
    sag = (weight / 4 / STRETCH) if not slack else (weight / 2 - preload) / STRETCH
    assert state.displacement[2] == pytest.approx(-sag, rel=1e-9)


HINGE = "actuated = true, stiffness = 5e3"


@pytest.mark.parametrize(("least", "most"), [(50.0, None), (120.0, 500.0)])
def test_tensions_are_the_least_within_their_bounds(least, most):
    """Two cables up and two down under 500 N: each lower one pulls as little as it may, each upper one 250 N more."""
    bounds = f"min_tension = {least}" + (f"\nmax_tension = {most}" if most else "")
    state = under_load(cables(HANGING, dict.fromkeys(HANGING, 0.0), f"[load]\nforce = [0, -500, 0]\n{bounds}\n"))
    loads = [s.load for s in state.springs]
    assert loads == pytest.approx([least + 250.0, least + 250.0, least, least], rel=1e-9)
    assert state.displacement == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_tensions_of_a_spatial_machine_balance_its_weight_and_no_smaller_ones_do():
    """Eight cables in the corners of a room: balance from points alone, and no feasible direction lowers the norm."""
    rng = np.random.default_rng(3)
    corners = np.array([[x, y, z] for x in (-3.0, 3.0) for y in (-2.0, 2.0) for z in (0.0, 4.0)])
    eyes = np.array([[x, y, z] for x in (-0.2, 0.2) for y in (0.3, -0.3) for z in (2.3, 1.8)])
    eyes[:, 2] += 0.05 * rng.normal(size=8)
    legs = "".join(
        f'[[legs]]\nname = "c{i}"\ntype = "cable"\nfrom = {a}\nto = {b}\nstiffness = 2e5\n'
        for i, (a, b) in enumerate(zip(corners.tolist(), eyes.tolist(), strict=True))
    )
    head = 'schema = 1\nname = "room"\nfamily = "legs"\n[platform]\npoint = [0, 0, 2]\n[pose]\n'
    pose = "x = 0\ny = 0\nz = 2\nroll = 0\npitch = 0\nyaw = 0\n"
    load = "[tool]\nmass = 20\ncentre_of_mass = [0.02, 0, 0]\n[load]\ngravity = [0, 0, -9.81]\nmin_tension = 40\n"
    state = under_load(build(head + pose + load + legs))
    assert state.rest is Rest.OK
    tensions = np.array([s.load for s in state.springs])
    along = (corners - eyes) / np.linalg.norm(corners - eyes, axis=1)[:, None]
    pulls = np.concatenate([np.cross(eyes - [0.0, 0.0, 2.0], along), along], axis=1).T
    weight = np.array([0.0, 0.0, -20 * 9.81])
    assert pulls @ tensions == pytest.approx(-np.concatenate([np.cross([0.02, 0.0, 0.0], weight), weight]), abs=1e-6)
    assert tensions.min() == pytest.approx(40.0, rel=1e-9)
    internal = np.linalg.svd(pulls)[2][6:]
    for direction in rng.normal(size=(200, 2)) @ internal:
        moved = tensions + 1e-3 * direction
        if (moved >= 40.0 - 1e-9).all():
            assert np.linalg.norm(moved) > np.linalg.norm(tensions) - 1e-9


@pytest.mark.parametrize(
    ("bounds", "pattern"),
    [
        ("min_tension = 50\nmax_tension = 20", "min_tension is 50 N, more than load.max_tension, 20 N"),
        ("max_tension = -1", "more than load.max_tension"),
    ],
)
def test_bounds_of_tensions_that_contradict_each_other_are_refused(bounds, pattern):
    with refused(pattern):
        under_load(cables(HANGING, dict.fromkeys(HANGING, 0.0), f"[load]\nforce = [0, -5, 0]\n{bounds}\n"))


def test_a_load_beyond_all_tensions_is_said_with_its_bounds():
    bounds = "[load]\nforce = [0, -500, 0]\nmin_tension = 50\nmax_tension = 200\n"
    state = under_load(cables(HANGING, dict.fromkeys(HANGING, 0.0), bounds))
    assert state.rest is Rest.NO_REST
    assert "No tensions of 50 N to 200 N hold this load" in state.message


def test_a_planar_machine_that_only_tension_holds_says_how_it_moves_without():
    machine = cables(HANGING, dict.fromkeys(HANGING, 100.0))
    assert "can still move by the twist x" in analyze(machine).message
    state = under_load(machine)
    assert state.factor is None
    # Four cables of 1.8 m with 100 N each: 4 T / L sideways, and nothing from springs.
    assert state.tangent[1][1] == pytest.approx(4 * 100.0 / 1.8, rel=1e-9)
    assert state.elastic[1] == [0.0, 0.0, 0.0]


COLUMN = """
schema = 1
name = "column"
family = "legs"
[platform]
point = [0, 0, 2]
[pose]
roll = 0
[[legs]]
name = "column"
joints = [
  { name = "hinge", type = "revolute", joins = ["base", "platform"], point = [0, 0, 0], axis = [1, 0, 0], %s },
]
[load]
force = [0, 0, %s]
"""


def test_a_column_on_a_spring_falls_at_the_load_of_its_derivation():
    """Of height h on a hinge of stiffness k, it stands up to k / h."""
    standing = under_load(build(COLUMN % (HINGE, -1000)))
    assert standing.rest is Rest.OK
    assert standing.factor == pytest.approx(2.5, rel=1e-9)
    assert standing.mode[4] == pytest.approx(-2.0 * standing.mode[0], rel=1e-9), "it tilts about the hinge"
    fallen = under_load(build(COLUMN % (HINGE, -2600)))
    assert fallen.rest is Rest.UNSTABLE
    assert "not stable" in fallen.message
    assert np.isinf(under_load(build(COLUMN % (HINGE, 1000))).factor)


def test_what_only_pulls_does_not_push():
    machine = cables(ANCHORS, dict.fromkeys(ANCHORS, 0.0), "[load]\nforce = [0, 900, 0]\n")
    state = under_load(machine)
    assert state.rest is not Rest.OK or set(state.slack_legs) <= {"a", "b"}


def test_gravity_without_any_mass_is_refused():
    with refused(r"load.gravity pulls at masses, but none is known.*\[tool\] mass"):
        under_load(load_without_limits("hexapod", [GRAVITY]))


@pytest.mark.parametrize(
    ("line", "pattern"),
    [
        ('type = "rope"', r"type.*cable"),
        ('type = "cable"\nfrom = [0, 0, 1]', r"a cable without to and stiffness"),
        (
            'type = "cable"\nfrom = [0, 0, 1]\nto = [0, 0, 0]\nstiffness = 1e5\nslack = 1',
            "slack is not known; a cable has",
        ),
    ],
)
def test_a_cable_that_is_not_one_is_refused(line, pattern):
    with refused(pattern):
        build(f'{CABLES}\n[[legs]]\nname = "a"\n{line}\n')


@pytest.mark.parametrize("name", ["hexapod", "planar-3rrr", "delta", "tripteron"])
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


def test_what_is_about_the_loaded_machine_has_no_derivative():
    with refused(r'"displacement_z" is about the machine under load.*sweep or a map'):
        sensitivity(load_without_limits("hexapod"), ["displacement_z"])


def test_a_curve_over_the_load_ends_in_the_state_and_shows_where_cables_go_slack():
    machine = cables(HANGING, dict.fromkeys(HANGING, 100.0), "[load]\nforce = [0, -500, 0]\n")
    curve, state = load_curve(machine, [0.0, 0.5, 0.9, 1.0]), under_load(machine)
    assert curve.displacement[-1] == pytest.approx(state.displacement, rel=1e-9, abs=1e-15)
    lower = curve.loads[:, curve.springs.index("bottom left winch actuator")]
    assert lower == pytest.approx([100.0, 37.5, 0.0, 0.0], abs=1e-6)
    assert len(plot(state).axes) == 3, "rotation, displacement, and forces"


def test_answers_are_saved_and_shown_in_notebooks(tmp_path):
    machine = load_without_limits("hexapod", ["load.force=[20, 30, -50]"])
    for answer, key in ((under_load(machine), "tangent_stiffness"), (command(machine), "coordinates")):
        data = json.loads(save(answer, tmp_path / "answer.json").read_text())
        assert np.isfinite(np.array(data[key], dtype=float)).all()
        assert "leg 1 actuator" in html_of(answer)

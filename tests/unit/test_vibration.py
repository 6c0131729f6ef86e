"""Natural vibrations: what adds up, what they come to without motion, and both routes to the frequencies."""

import math

import numpy as np
import pytest

from kinetostat.engine.batch import evaluate
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.loaded import Way, loaded_fill
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.loading import bundled, changed, load
from kinetostat.machine.loads import located_members
from kinetostat.machine.parameters import values
from kinetostat.spec.errors import InputError
from kinetostat.studies.datasets import evaluate_grid
from kinetostat.studies.vibration import HIDDEN_BY_ROUND_OFF, NOTHING_VIBRATES, modes
from kinetostat.vibration.scalar_frequencies import (
    frequencies_over_scalars,
    legs_without_mass,
    numpy_frequencies,
    reducible,
)
from machines import with_bodies

BODY = {"tool.mass": 12.0, "tool.inertia.0": 0.3, "tool.inertia.1": 0.3, "tool.inertia.2": 0.5}
ROTORS = {"drives.rotor_inertia": 2e-5, "drives.lead": 0.01, "drives.ratio": 20.0}
NAMES = [f"frequency_{number}" for number in range(1, 7)]
BY_MATRICES = {
    "delta", "delta-linear", "hexapod-hardware", "hexapod-rus", "orthoglide", "passive-leg-3dof-pu-rus",
    "passive-leg-4dof-rus", "passive-leg-5dof-rus", "planar-3rrr", "tricept-rus", "tripteron",
}  # fmt: skip
"""Machines whose loops no rods cut: with massive links, sums over scalars do not give their frequencies."""


def heavy(name, links=False, **more):
    """A bundled machine with a massive platform, and with massive links and rotors if wished."""
    machine = changed(load(name), BODY)
    if links:
        densities = {path: 1.5 for path in values(machine) if path.startswith("linear_density.")}
        machine = changed(machine, {**densities, **ROTORS})
    return changed(machine, more) if more else machine


@pytest.mark.parametrize("name", [*bundled()])
def test_energies_add_up_and_the_receptance_begins_with_the_compliance(name):
    machine = heavy(name, links=True)
    answer, response = modes(machine), respond(machine)
    for mode in answer.modes:
        assert sum(mode.strain.values()) == pytest.approx(1.0, abs=1e-8)
        assert sum(mode.kinetic.values()) == pytest.approx(1.0, abs=1e-8)
    expected = np.array(response.compliance.rows(), dtype=float)
    found = answer.receptance([0.0])[0]
    # The five-dof machines are stiff in one direction and soft in another by a factor of 1e6, which costs digits.
    assert np.abs(found - expected).max() < (1e-10 if "5dof" in name else 1e-12) * np.abs(expected).max()
    whole = np.sum([mode.effective_mass for mode in answer.modes], axis=0)
    assert (whole < 1.0 + 1e-9).all()


@pytest.mark.parametrize("links", [False, True], ids=["platform", "links and rotors"])
@pytest.mark.parametrize("name", [*bundled()])
@pytest.mark.numbers
def test_the_quick_route_and_the_modes_give_the_same_frequencies(name, links):
    """Sums over scalars where there are any, for grids of the others matrices without shapes."""
    machine = heavy(name, links)
    response, joints = respond(machine), solve_joints(machine) if machine.family.chains else None
    if machine.family.name != "legs" or name in BY_MATRICES:  # a machine leg by leg that is new may go either way
        assert reducible(machine) == (legs_without_mass(machine, response.configuration) or name not in BY_MATRICES)
    if reducible(machine):
        quick = [float(f) for f in frequencies_over_scalars(machine, response, joints)]
    else:
        quick = numpy_frequencies(state_of(machine))[0].tolist()
    known = [mode.frequency for mode in modes(machine).modes][:6]
    assert quick[: len(known)] == pytest.approx(known, rel=1e-9)
    assert all(math.isinf(f) for f in quick[len(known) :])


@pytest.mark.parametrize(
    ("name", "links"),
    [
        *(("zhang-gosselin-4dof", False), ("hexapod", False), ("delta", False), ("delta", True), ("tripteron", True)),
        *(("planar-3rrr", True), ("passive-leg-4dof-rus", True), ("orthoglide", True), ("hexapod-rus", True)),
    ],
)
@pytest.mark.numbers
def test_every_way_to_evaluate_many_poses_agrees(name, links):
    machine, names = heavy(name, links), ["singularity_margin", *NAMES]
    path = next(path for path in values(machine) if path.startswith("pose."))
    points = PointTable({path: values(machine)[path] + np.linspace(0.0, 0.01, 300)})
    expected = evaluate(machine, points, names)
    for way in (Way.ANY_MACHINE, Way.NATIVE):
        results, status = np.empty((7, points.size)), np.empty(points.size, dtype=np.int8)
        loaded_fill(machine, points.paths, names, way)(points.columns(0, points.size), results, status)
        assert (status == expected.status).all()
        np.testing.assert_allclose(results, list(expected.values.values()), rtol=1e-9)


@pytest.mark.parametrize("names", [["frequency_2"], ["stiffness_x", "frequency_1", "compliance_z"]])
def test_machine_code_finds_modes_of_massive_legs_beside_other_quantities(monkeypatch, names):
    """Within reach and out of it, in another order, by fewer points than a vector has, and never by the slow solver."""
    from kinetostat.engine import loaded

    machine = heavy("delta", links=True)
    columns = {"pose.x": np.array([0.0, 5.0, 0.02])}
    slow, fast, codes = np.empty((len(names), 3)), np.empty((len(names), 3)), np.empty((2, 3), dtype=np.int8)
    loaded_fill(machine, [*columns], names, Way.MODES)(columns, slow, codes[0])
    monkeypatch.setattr(loaded, "_solve_in_parts", lambda *_: pytest.fail("the slow solver was asked"))
    loaded_fill(machine, [*columns], names, Way.NATIVE)(columns, fast, codes[1])
    assert codes.tolist() == [[Status.OK, Status.OUT_OF_REACH, Status.OK]] * 2
    np.testing.assert_allclose(fast, slow, rtol=1e-9)
    assert not np.array_equal(fast, slow, equal_nan=True)  # they are two routes


@pytest.mark.parametrize(
    ("name", "links"),
    [
        ("hexapod", False),
        ("delta", False),
        ("zhang-gosselin-4dof", True),
        ("tricept", True),
        ("delta", True),
        ("hexapod-rus", True),
        ("planar-3rrr", True),
        ("tripteron", True),
    ],
)
@pytest.mark.numbers
def test_derivatives_are_those_of_differences(name, links):
    machine = heavy(name, links, **{"tool.centre_of_mass.0": 0.01, "tool.centre_of_mass.2": 0.02})
    pose = {path: value + 0.002 * (1 + k) for k, (path, value) in enumerate(_pose(machine).items())}
    machine = changed(machine, pose)
    here = values(machine)
    paths = ["tool.mass", "tool.inertia.0", "tool.centre_of_mass.2", *pose]
    paths += [path for path in here if path.startswith("linear_density.") and links] + ["drives.lead"] * links
    paths += [path for path in here if path.startswith("geometry.") and links][:3]
    _compare_slopes(machine, paths)


@pytest.mark.numbers
def test_derivatives_by_the_bodies_of_links():
    """A machine leg by leg whose links are rigid bodies: by what they weigh and where."""
    machine = with_bodies("tripteron", ["tool.mass=5", "tool.inertia=[0.05, 0.06, 0.07, 0, 0, 0]"])
    of_links = [path for path in values(machine) if path.startswith("legs.y.") and path.endswith(".mass")]
    body = of_links[0].removesuffix("mass")
    own = [f"{body}{name}" for name in ("mass", "centre_of_mass.1", "inertia.0", "inertia.4")]
    _compare_slopes(machine, ["pose.z", *own])


def _compare_slopes(machine, paths):
    """Exact derivatives of three frequencies beside differences of fourth order."""
    here = values(machine)
    column = next(path for path in here if path.startswith("pose."))
    exact = evaluate_gradient(machine, PointTable({column: np.array([here[column]])}), NAMES[:3], paths)
    for row, path in enumerate(paths):
        step = 1e-4 * (abs(here[path]) or 0.1)
        points = PointTable({path: here[path] + step * np.array([-2.0, -1.0, 1.0, 2.0])})
        near = np.array(list(evaluate(machine, points, NAMES[:3]).values.values()))
        slope = (near[:, 0] - 8.0 * near[:, 1] + 8.0 * near[:, 2] - near[:, 3]) / (12.0 * step)
        scale = exact.values[:, 0] / (abs(here[path]) or 0.1)
        assert np.abs(slope - exact.gradients[:, row, 0]).max() < 1e-7 * scale.max(), path


def _pose(machine):
    return {path: value for path, value in values(machine).items() if path.startswith("pose.")}


def test_equal_frequencies_have_the_derivative_of_their_mean():
    machine = heavy("hexapod")
    struts = [f"stiffness.actuator.{leg}" for leg in range(6)]
    slopes = evaluate_gradient(machine, PointTable({"pose.x": np.zeros(1)}), NAMES, [*struts, "pose.x"])
    for first, second in ((0, 1), (3, 4)):
        assert slopes.values[first] == pytest.approx(slopes.values[second], rel=1e-9)
        np.testing.assert_allclose(slopes.gradients[first], slopes.gradients[second], rtol=1e-9, atol=1e-8)
        np.testing.assert_allclose(slopes.gradients[first, :6, 0], slopes.gradients[first, 0, 0], rtol=1e-6)
        assert abs(slopes.gradients[first, 6, 0]) < 1e-6 * slopes.values[first, 0] / 0.1


@pytest.mark.parametrize("name", ["hexapod", "hexapod-hardware"])
def test_modes_of_equal_frequency_move_along_the_components_in_their_order(name):
    """Which two motions of a plane are shown, and which way they go, is decided by no round-off."""
    first, second = modes(changed(load(name), {"tool.mass": 12.0})).modes[:2]
    assert first.frequency == pytest.approx(second.frequency, rel=1e-9)
    x, y = -3, -2  # z comes last
    assert (first.direction, second.direction) == ("x", "y")
    assert first.tool[x] > 0.0 < second.tool[y]
    assert abs(second.tool[x]) < 1e-9 * first.tool[x]


@pytest.mark.parametrize("name", ["delta", "orthoglide"])
def test_both_bars_of_a_parallelogram_weigh_where_they_are(name):
    """About the middle between them, two bars at a distance w resist a turn with m w^2 / 4 besides their own."""
    machine = load(name)
    configuration = machine.configure()
    pairs = [element for leg in configuration.legs for element in leg.chain if isinstance(element, Parallelogram)]
    expected = [end for pair in pairs for bar in pair.bars for end in bar]
    members = [member for member in located_members(machine, configuration, None) if " bar " in member.name]
    placed = [point for member in members for _, point in member.ends()]
    assert len(placed) == len(expected) == 4 * len(pairs) > 0
    assert all(a.is_at(b) for a, b in zip(placed, expected, strict=True))


def test_a_point_mass_rings_in_three_ways():
    machine = changed(load("hexapod"), {"tool.mass": 12.0})
    assert len(modes(machine).modes) == 3
    found = evaluate(machine, PointTable({"pose.x": np.zeros(1)}), NAMES).values
    assert [bool(np.isinf(found[name][0])) for name in NAMES] == [False] * 3 + [True] * 3


def test_without_any_mass_the_refusal_says_what_to_give():
    with pytest.raises(InputError, match=r'\[tool\] mass = "12 kg"'):
        modes(load("hexapod"))


@pytest.mark.parametrize("tensor", [(-1.0, 0.3, 0.5, 0, 0, 0), (1.0, 0.2, 0.3, 0, 0, 0), (0.1, 0.1, 0.1, 0.2, 0, 0)])
def test_an_inertia_that_no_body_has_is_refused(tensor):
    with pytest.raises(InputError, match=r"tool\.inertia .* which no body has"):
        load("hexapod", [f"tool.inertia={list(tensor)}"])
    with pytest.raises(InputError, match=r"tool\.inertia .* which no body has"):
        changed(load("hexapod"), {f"tool.inertia.{k}": entry for k, entry in enumerate(tensor)})


def test_a_rod_and_a_disc_are_bodies():
    load("hexapod", ["tool.inertia=[0.3, 0.3, 0, 0, 0, 0]"])
    load("hexapod", ["tool.inertia=[0.1, 0.1, 0.2, 0, 0, 0]"])


def test_what_cannot_ring_is_said():
    answer = modes(heavy("hexapod", **{"stiffness.actuator": math.inf}))
    assert (answer.modes, answer.message) == ((), NOTHING_VIBRATES)
    assert modes(changed(heavy("hexapod"), {"pose.z": 3.0})).status is Status.JOINT_LIMIT


def test_a_motion_too_soft_to_compute_with_is_said_at_a_pose_and_over_a_grid():
    drives = {"drives.lead": 0.01, "drives.rotor_inertia": 1e-4}
    machine = heavy("hexapod", **drives, **{"stiffness.actuator.0": 1e-6})
    answer = modes(machine)
    assert (answer.status, answer.message) == (Status.SINGULAR, HIDDEN_BY_ROUND_OFF)
    found = evaluate_grid(machine, ["x=-1 mm:1 mm:3"], ["frequency_1"])
    assert set(found["status"].values) == {Status.SINGULAR}
    rigid = evaluate_grid(
        heavy("hexapod", **drives, **{"stiffness.actuator": math.inf}), ["x=0:1 mm:2"], ["frequency_1"]
    )
    assert (set(rigid["status"].values), set(rigid["frequency_1"].values)) == ({Status.OK}, {math.inf})


def test_rotors_need_a_lead():
    with pytest.raises(InputError, match=r"drives\.lead is 0"):
        modes(heavy("hexapod", **{"drives.rotor_inertia": 1e-4}))


def test_the_cut_of_one_mode_is_that_of_the_textbook():
    """One mode along z: the least real part is -1 / (4 k zeta (1 + zeta)), at the frequency times sqrt(1 + 2 zeta)."""
    machine = heavy("hexapod", **{"damping.ratio": 0.03})
    answer = modes(machine)
    mode = next(mode for mode in answer.modes if mode.direction == "z")
    softest = answer.softest([0.0, 0.0, 1.0])
    assert softest.real == pytest.approx(-1.0 / (4.0 * mode.modal_stiffness * 0.03 * 1.03), rel=1e-6)
    assert softest.frequency == pytest.approx(mode.frequency * math.sqrt(1.06), rel=1e-4)
    assert softest.depth(2e9) == pytest.approx(-0.5 / (2e9 * softest.real))
    across = {f"cutting.direction.{k}": float(k == 2) for k in range(3)}
    cut = changed(machine, {**across, "cutting.pressure": 2e9})
    points = PointTable({"pose.z": values(cut)["pose.z"] + np.array([0.0, 0.01])})
    found = evaluate(cut, points, ["stable_width", "least_real_receptance", "frequency_1"]).values
    assert found["stable_width"][0] == pytest.approx(softest.depth(2e9), rel=1e-9)
    assert found["least_real_receptance"][0] == pytest.approx(softest.real, rel=1e-9)
    assert found["frequency_1"][0] == pytest.approx(answer.modes[0].frequency, rel=1e-9)


def test_loaded_frequencies_where_no_pose_has_a_place():
    answer = evaluate_grid(load("hexapod", ['tool.mass="12 kg"']), ["z=-1 m:-2 m:3"], ["loaded_frequency"])
    assert (answer["status"] != Status.OK).all()
    assert np.isnan(answer["loaded_frequency_1"]).all()

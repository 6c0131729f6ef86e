"""Loads at named points of the platform and masses of links, each against the same load said in another way."""

import math
import pickle

import numpy as np
import pytest

from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.file_schema import machine_schema
from kinetostat.machine.leg import Turn
from kinetostat.machine.loading import as_toml, build, bundled, load
from kinetostat.machine.parameters import with_values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import analyze
from kinetostat.studies.under_load import under_load
from machines import load_without_limits, written

SPINDLE = """
[load.spindle]
point = ["30 mm", "10 mm", "-40 mm"]
force = ["100 N", 0, "-300 N"]
moment = [0, 0, "2 N*m"]
[load.drag]
point = [0, "50 mm", 0]
force = [0, "20 N", "10 N"]
"""
TILTED = ["pose.roll=10 deg", "pose.pitch=-7 deg", "tool.offset=[0, 0, 0.05]"]


def with_loads(name, more=SPINDLE, settings=()):
    return build(bundled()[name] + more, name, settings)


def test_to_first_order_they_are_one_wrench_at_the_tool_point():
    machine = with_loads("hexapod", settings=TILTED)
    platform = machine.configure().platform
    tool = np.array(machine.tool_point(platform).components())
    moment, force = np.array([0.0, 0.0, 2.0]), np.array([100.0, 20.0, -290.0])
    for point, push in (((0.03, 0.01, -0.04), (100, 0, -300)), ((0, 0.05, 0), (0, 20, 10))):
        rows = np.array([row.components() for row in (platform.rotation.x, platform.rotation.y, platform.rotation.z)])
        arm = np.array(platform.translation.components()) + rows.T @ np.array(point) - tool
        moment = moment + np.cross(arm, push)
    assert respond(machine).load.components() == pytest.approx([*moment, *force], rel=1e-12)
    alone = load("hexapod", [*TILTED, f"load.moment={moment.tolist()}", f"load.force={force.tolist()}"])
    assert analyze(machine).load.deflection == pytest.approx(analyze(alone).load.deflection, rel=1e-9, abs=1e-18)
    assert under_load(machine).linear == pytest.approx(under_load(alone).linear, rel=1e-6, abs=1e-15)


def test_a_force_at_a_point_is_the_weight_of_a_mass_there():
    """Both keep their direction and go with their point, however far the machine moves."""
    soft = ["stiffness.actuator=2e5 N/m", *TILTED[:2]]
    weight = [*soft, "tool.mass=30", "tool.centre_of_mass=[0.03, 0.01, -0.04]", "load.gravity=[0, 0, -10]"]
    pushed = with_loads("hexapod", '[load.weight]\npoint = [0.03, 0.01, -0.04]\nforce = [0, 0, "-300 N"]\n', soft)
    state, expected = under_load(pushed), under_load(load_without_limits("hexapod", weight))
    assert np.abs(expected.displacement).max() > 1e-3
    assert state.displacement == pytest.approx(expected.displacement, rel=1e-9, abs=1e-15)
    assert np.array(state.tangent) == pytest.approx(np.array(expected.tangent), rel=1e-9, abs=1e-3)


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "planar-3rrr"])
def test_they_are_kept_by_files_pickles_and_sweeps(name):
    machine = with_loads(name)
    for again in (pickle.loads(pickle.dumps(machine)), build(as_toml(machine))):
        assert respond(again).load == respond(machine).load
    paths = ["load.spindle.force.2", "load.spindle.point.0"]
    columns = {paths[0]: np.array([-300.0, -600.0]), paths[1]: np.array([0.03, 0.06])}
    loads = np.array([np.broadcast_to(c, 2) for c in respond(with_values(machine, columns)).load.components()]).T
    values = {"load.spindle.force": [100.0, 0.0, -600.0], "load.spindle.point": [0.06, 0.01, -0.04]}
    changed = machine.with_values(values)
    for row, each in zip(loads, (machine, changed), strict=True):
        assert row == pytest.approx([float(c) for c in respond(each).load.components()], rel=1e-12)


def test_names_and_fields_are_checked():
    for more, message in (
        ('[load."a b"]\nforce = [0, 0, 1]', r"\[load.\"a b\"\] cannot be the name of a load"),
        ("[load.spindle]\nforces = [0, 0, 1]", "load.spindle.forces is not known; did you mean force"),
        ("[load.spindle]\nforce = [0, 1]", "load.spindle.force is .* it has 2 entries; give 3"),
        ("".join(f"[load.n{i}]\nforce = [0, 0, 1]\n" for i in range(17)), "17 named loads; at most 16"),
    ):
        with pytest.raises(InputError, match=message):
            with_loads("hexapod", more)


def test_the_schema_of_files_has_them():
    loads = [table for table in machine_schema()["$defs"].values() if "gravity" in table.get("properties", {})]
    assert all({"point", "force", "moment"} == set(table["additionalProperties"]["properties"]) for table in loads)
    assert loads


ARMS = """
[sections.bar]
shape    = "round"
diameter = "30 mm"
material = "steel"
[[legs]]
name = "arm"
joints = [
  { name = "motor", type = "revolute", joins = ["base", "upper"], point = ["-200 mm", 0, 0], axis = [0, 0, 1], actuated = true, stiffness = "5e7 N*m/rad" },
  { name = "elbow", type = "revolute", joins = ["upper", "lower"], point = ["-300 mm", "200 mm", 0], axis = [0, 0, 1] },
  { name = "wrist", type = "revolute", joins = ["lower", "platform"], point = [0, "300 mm", 0], axis = [0, 0, 1] },
]
links.upper = { model = "rigid", UPPER }
[[legs]]
name = "other arm"
joints = [
  { name = "motor", type = "revolute", joins = ["base", "upper"], point = ["200 mm", 0, 0], axis = [0, 0, 1], actuated = true, stiffness = "5e7 N*m/rad" },
  { name = "elbow", type = "revolute", joins = ["upper", "platform"], point = ["300 mm", "200 mm", 0], axis = [0, 0, 1] },
]
[load]
gravity = [0, "-9.81 m/s**2", 0]
"""  # noqa: E501
LENGTH = math.hypot(0.1, 0.2)


def arms(upper):
    return build(written("two arms", (0, 0.3, 0), {"x": 0.02, "y": 0.31}) + ARMS.replace("UPPER", upper))


def test_a_link_with_its_mass_in_the_middle_is_a_uniform_one():
    mass = 7850.0 * math.pi * 0.03**2 / 4.0 * LENGTH
    uniform = arms('section = "bar"')
    given = arms(f"mass = {mass!r}")
    centred = arms(f'mass = {mass!r}, centre_of_mass = ["-250 mm", "100 mm", 0]')
    expected = under_load(uniform).displacement
    assert np.abs(expected).max() > 1e-9
    for machine in (given, centred, build(as_toml(centred))):
        assert under_load(machine).displacement == pytest.approx(expected, rel=1e-9)
        assert analyze(machine).moving_mass == pytest.approx(analyze(uniform).moving_mass, rel=1e-12)
    heavier = centred.with_values({"legs.arm.upper.mass": 2.0 * mass})
    assert under_load(heavier).displacement == pytest.approx([2.0 * c for c in expected], rel=1e-4)


def test_a_centre_of_mass_travels_with_its_link():
    """The link hangs on its own motor alone, which carries its weight times the lever arm at the pose."""
    centre = np.array([-0.36, 0.13])
    machine = arms(f"mass = 4, centre_of_mass = {[*centre.tolist(), 0.0]}")
    turn = solve_joints(machine).coordinates[0]
    sine, cosine = (turn.sine, turn.cosine) if isinstance(turn, Turn) else (math.sin(turn), math.cos(turn))
    assert abs(sine) > 0.03
    lever = (centre[0] + 0.2) * cosine - centre[1] * sine
    motors = {spring.leg: spring.load for spring in under_load(machine).springs}
    assert abs(motors["arm"]) == pytest.approx(abs(4.0 * 9.81 * lever), rel=1e-5)
    assert motors["other arm"] == pytest.approx(0.0, abs=1e-5 * abs(motors["arm"]))


@pytest.mark.parametrize(
    ("upper", "message"),
    [
        ("centre_of_mass = [0, 0, 0]", 'link "upper" has centre_of_mass, but no mass'),
        ("mass = -1", "cannot be negative"),
        ("mas = 1", "mas is not known; a link has model, section, up, compliance, mass, centre_of_mass and inertia"),
        ("h = 1, g = 1, f = 1, e = 1, d = 1, c = 1, b = 1, a = 1", "a is not known"),  # the first of the alphabet
        ("mass = 1, inertia = [1, 1, 1, 0, 0, 0]", "has inertia, but no centre_of_mass"),
        ("mass = 1, centre_of_mass = [0, 0, 0], inertia = [1, 1, 3, 0, 0, 0]", r"legs\.arm\.upper\.inertia .* no body"),
        ("mass = 0, centre_of_mass = [0, 0, 0], inertia = [1, 1, 1, 0, 0, 0]", r"but legs\.arm\.upper\.mass is 0"),
        ("mass = 1, centre_of_mass = [0, 0]", "it has 2 entries; give 3"),
    ],
)
def test_masses_of_links_are_checked(upper, message):
    with pytest.raises(InputError, match=message):
        arms(upper)

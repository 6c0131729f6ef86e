"""Limits judged on floats, on NumPy arrays and by machine code: one status everywhere, and no code for none."""

import math

import numpy as np
import pytest

from kinetostat import command, evaluate, modes
from kinetostat.engine.batch import first_limit_passed, in_slabs, limits_used
from kinetostat.engine.form import Specimen, form_of, traced_machine
from kinetostat.engine.kernel import slab_fill
from kinetostat.engine.loaded import Way, loaded_fill
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.limits import is_set
from kinetostat.machine.loading import load as bundled_with_limits
from kinetostat.machine.parameters import parameters, values, with_values
from machines import load_without_limits as load

POSES = 300
LOAD = ("load.force=[200, -100, 500]", "load.moment=[3, 5, -2]")
PLANAR_LOAD = ("load.force=[200, -100, 0]",)
BOTH_WAYS = ("shortest_leg", "longest_leg", "actuator_force", "leg_diameter")

CASES = [
    ("hexapod", LOAD, (*BOTH_WAYS, "base_joint_angle", "platform_joint_angle")),
    ("zhang-gosselin-4dof", LOAD, (*BOTH_WAYS, "base_joint_angle", "platform_joint_angle")),
    ("planar-3rpr", PLANAR_LOAD, BOTH_WAYS),
    ("hexapod-rus", LOAD, ("actuator_moment", "platform_joint_angle", "leg_diameter")),
    ("passive-leg-5dof-driven", LOAD, ("longest_leg", "actuator_force")),
    ("tripteron", LOAD, ("travel_from", "travel_to", "actuator_force")),
    ("delta", LOAD, ("actuator_moment",)),
]


FAR = {
    "shortest_leg": -1e6,
    "longest_leg": 1e6,
    "travel_from": -1e6,
    "travel_to": 1e6,
    "base_joint_angle": math.pi / 2,
    "platform_joint_angle": math.pi / 2,
    "actuator_force": 1e20,
    "actuator_moment": 1e20,
    "leg_diameter": 1e-9,
}
"""Limits that are set but far away: what they are compared with is then known, and no pose passes them."""


def poses(machine):
    """Poses around the file's, of all coordinates."""
    rng, length = np.random.default_rng(8), float(respond(machine).configuration.length)
    held = values(machine)
    kinds = {p.path: p.quantity.kind for p in parameters(machine.family) if p.path.startswith("pose.")}
    return {p: held[p] + (0.2 * length if k == "length" else 0.3) * rng.uniform(-1, 1, POSES) for p, k in kinds.items()}


def limited(machine, columns, fields):
    """The machine with limits that about one pose in five passes, each within the range that the poses use."""
    wanted = {f"limits.{name}": FAR[name] for name in fields}
    watched = with_values(machine, wanted)
    single = [respond(at(watched, columns, i)) for i in range(POSES)]
    found = {}
    for name in fields:
        measures = np.array([measure(response, name) for response in single])
        found[f"limits.{name}"] = float(np.nanquantile(measures, 0.2 if FAR[name] < 1e-6 else 0.8))
    return with_values(machine, found)


def measure(response, name):
    """The extreme of what a limit is compared with, in its own unit."""
    checks = [c for c in response.checks if c.limit.name == name]
    worst = (max if checks[0].at_most else min)(float(c.measure) for c in checks)
    if name.endswith("angle"):
        return np.arccos(np.sqrt(worst))
    return np.sqrt(worst) if name == "leg_diameter" else worst


def at(machine, columns, i):
    return with_values(machine, {path: float(column[i]) for path, column in columns.items()})


@pytest.mark.parametrize(("name", "load_settings", "fields"), CASES, ids=[case[0] for case in CASES])
def test_floats_arrays_and_machine_code_give_one_status(name, load_settings, fields):
    machine = load(name, load_settings)
    columns = poses(machine)
    machine = limited(machine, columns, fields)
    single = [respond(at(machine, columns, i)) for i in range(POSES)]
    expected = np.array([int(response.status) for response in single])
    with np.errstate(all="ignore"):
        arrays = np.broadcast_to(respond(with_values(machine, columns)).status, POSES)
    results, codes = np.empty((1, POSES)), np.empty(POSES, dtype=np.int8)
    slab_fill(machine, [*columns], ["singularity_margin"])(columns, results, codes)
    assert {Status.OK, Status.JOINT_LIMIT} <= set(expected)
    assert np.array_equal(arrays, expected)
    assert np.array_equal(codes, expected)
    passed = first_limit_passed(machine, columns, fields)
    for i, response in enumerate(single):
        broken = [check.limit.name for check in response.checks if not check.kept]
        if expected[i] == Status.JOINT_LIMIT:
            assert fields[passed[i]] == broken[0]


def test_no_limit_hides_that_a_pose_is_singular():
    """A Gough platform is singular where it is turned by a right angle; every leg of this one is too long as well."""
    machine = load("hexapod", ["limits.longest_leg=7 cm", "tool.mass=2 kg"])
    columns = {"pose.yaw": np.array([0.0, math.pi / 2])}
    expected = [Status.JOINT_LIMIT, Status.SINGULAR]
    assert [respond(at(machine, columns, i)).status for i in range(2)] == expected
    with np.errstate(all="ignore"):
        assert np.array_equal(np.broadcast_to(respond(with_values(machine, columns)).status, 2), expected)
    results, codes = np.empty((1, 2)), np.empty(2, dtype=np.int8)
    slab_fill(machine, [*columns], ["compliance_z"])(columns, results, codes)
    assert codes.tolist() == expected
    assert np.isnan(results).all()
    refusal = state_of(at(machine, columns, 1)).refusal
    assert "singular (actuation singularity)" in refusal
    assert "limits.longest_leg asks for at most 70 mm" in refusal


@pytest.mark.parametrize("way", [Way.ANY_MACHINE, Way.NATIVE])
def test_loads_that_hold_a_singular_machine_hold_it_within_its_limits_only(way):
    """Weight holds the platform of a hexapod that hangs in its singular pose; a limit forbids the pose nevertheless."""
    hangs = ["tool.mass=3 kg", "load.gravity=[0, 0, 9.81]", 'load.state="loaded"']
    columns = {"pose.yaw": np.full(4, math.pi / 2), "load.force.2": np.linspace(0.0, 3.0, 4)}
    statuses = []
    for limits in ((), ("limits.longest_leg=7 cm",)):
        machine = load("hexapod", [*hangs, *limits])
        fill = loaded_fill(machine, [*columns], ["displacement_z"], way)
        statuses.append(in_slabs(PointTable(columns), fill, 1, way.slab, 1)[1].tolist())
    assert statuses == [[Status.OK] * 4, [Status.JOINT_LIMIT] * 4]


HEAVY = ("tool.mass=3 kg", "load.gravity=[0, 0, -9.81]")


def test_actuators_commanded_beyond_a_limit_are_said_to_be():
    """At 6 cm two legs of the hexapod are longer than its file allows; at a right angle it has no rest at all."""
    machine = bundled_with_limits("hexapod", HEAVY)
    answer = command(machine, {"x": [0.0, 0.06, 0.0], "yaw": [0.0, 0.0, math.pi / 2]})
    assert answer.settled.tolist() == [True, True, False]
    assert answer.message.endswith(
        "But a limit of the file is passed at 1 of 3 poses, first at pose 2: limits.longest_leg."
    )
    assert "But the pose passes limits.longest_leg" in command(with_values(machine, {"pose.x": 0.06})).message
    assert "limit" not in command(machine, {"x": [0.0, 0.001]}).message


def test_modes_under_load_obey_limits_as_the_map_of_frequencies_does():
    machine = bundled_with_limits("hexapod", [*HEAVY, 'load.state="loaded"', "limits.longest_leg=7 cm"])
    assert evaluate(machine, {"x": [0.0]}, ["loaded_frequency_1"]).status.values.tolist() == [Status.JOINT_LIMIT]
    refused = modes(machine)
    assert (refused.status, refused.modes) == (Status.JOINT_LIMIT, ())
    assert "limits.longest_leg asks for at most 70 mm" in refused.message


@pytest.mark.parametrize(("name", "load_settings", "fields"), CASES, ids=[case[0] for case in CASES])
def test_what_is_used_is_what_single_poses_measure(name, load_settings, fields):
    machine = load(name, load_settings)
    watched = with_values(machine, {f"limits.{field}": FAR[field] for field in fields})
    columns = poses(machine)
    reached = [i for i in range(40) if respond(at(watched, columns, i)).status == Status.OK]
    columns = {path: column[reached] for path, column in columns.items()}
    found = limits_used(watched, columns)
    every = [check for i in range(len(reached)) for check in respond(at(watched, columns, i)).checks]
    assert found.keys() == set(fields)
    for field, ends in found.items():
        measures = [float(check.measure) for check in every if check.limit.name == field]
        assert ends == pytest.approx((min(measures), max(measures)), rel=1e-9, abs=1e-12)


def test_no_arithmetic_is_spent_on_limits_that_are_not_set(monkeypatch):
    def nodes(machine):
        form, _ = form_of(machine, ["pose.x", "pose.z"])
        given = traced_machine(Specimen(machine), form)
        respond(given.machine)
        return len(given.graph.nodes)

    free, limited_once = load("hexapod", LOAD), load("hexapod", (*LOAD, "limits.longest_leg=1"))
    bare = nodes(free)
    assert nodes(limited_once) > bare
    monkeypatch.setattr("kinetostat.kinetostatics.response.geometric_checks", lambda *_: [])
    monkeypatch.setattr("kinetostat.kinetostatics.response.actuator_checks", lambda *_: [])
    assert nodes(free) == bare


def test_a_limit_that_varies_is_a_column_like_any_other():
    machine = load("hexapod")
    length = np.linspace(0.08, 0.12, 200)
    results, codes = np.empty((1, 200)), np.empty(200, dtype=np.int8)
    slab_fill(machine, ["limits.longest_leg"], ["singularity_margin"])({"limits.longest_leg": length}, results, codes)
    reach = limits_used(with_values(machine, {"limits.longest_leg": 1.0}), {"pose.x": np.zeros(1)})["longest_leg"][1]
    assert np.array_equal(codes == Status.OK, length >= reach)
    assert is_set(length)

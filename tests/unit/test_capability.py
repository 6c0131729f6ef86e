"""What the drives allow at a pose: sets with exact vertices, in sentences, tables, figures and files."""

import itertools
import json
import math

import numpy as np
import pytest

import kinetostat
from driven_sets import LINEAR, MACHINES, greatest_motion, greatest_wrench
from kinetostat import InputError, build, capability, drives, dynamics, evaluate, load, save
from kinetostat.numerics.polytopes import outline, reach_along, vertices
from kinetostat.views.capability import CAPABILITY, capability_figures

COMPONENTS = {"force": slice(3, 6), "moment": slice(0, 3), "speed": slice(3, 6), "rate": slice(0, 3)}


@pytest.mark.parametrize("name", MACHINES)
def test_sets_reach_as_far_as_a_linear_programme_says(name):
    answer = capability(MACHINES[name]())
    response, rng = answer.state.free, np.random.default_rng(3)
    for part in answer.sets:
        if part.name not in COMPONENTS:  # accelerations have a test of their own
            continue
        for _ in range(3):
            way = part.directions @ rng.normal(size=part.directions.shape[1]) if part.directions.size else None
            if way is None:
                continue
            direction = np.zeros(6)
            direction[COMPONENTS[part.name]] = way / np.linalg.norm(way)
            programme = greatest_wrench if part.name in ("force", "moment") else greatest_motion
            assert part.along(way) == pytest.approx(programme(response, direction), rel=1e-9), part.name


@pytest.mark.parametrize("name", MACHINES)
def test_vertices_lie_on_as_many_faces_as_dimensions_and_within_all(name):
    for part in capability(MACHINES[name]()).sets:
        reached = part.vertices @ part.normals.T / part.bounds
        assert (reached <= 1.0 + 1e-9).all()
        assert ((reached > 1.0 - 1e-9).sum(axis=1) >= part.directions.shape[1]).all()
        if len(part.vertices):
            assert part.greatest == pytest.approx(np.linalg.norm(part.vertices, axis=1).max())
            assert part.along(part.weakest) == pytest.approx(part.least, rel=1e-9)


def test_the_speeds_of_a_hexapod_are_the_corners_of_its_drives_without_turning():
    answer = capability(load("hexapod", LINEAR))
    response = answer.state.free
    lines = np.array([wrench.components() for wrench in response.transmission.wrenches])
    # A vertex has three drives at their limits, and no other beyond.
    corners = set()
    for three in itertools.combinations(range(6), 3):
        for signs in itertools.product((-0.3, 0.3), repeat=3):
            matrix = lines[list(three), 3:]
            if abs(np.linalg.det(matrix)) > 1e-9:
                speed = np.linalg.solve(matrix, signs)
                if (np.abs(lines[:, 3:] @ speed) <= 0.3 + 1e-12).all():
                    corners.add(tuple(np.round(speed, 9) + 0.0))
    assert {tuple(np.round(v, 9) + 0.0) for v in answer.set_of("speed").vertices} == corners


def test_polytopes_of_one_to_four_dimensions():
    for size in range(1, 5):
        cube = np.vstack([np.eye(size), -np.eye(size)])
        assert len(vertices(cube, np.full(2 * size, 2.0))) == 2**size
    assert vertices(np.eye(2), np.ones(2)) is None
    assert vertices(np.vstack([np.eye(2), -np.eye(2)]), np.array([1.0, 1.0, 1.0, np.inf])) is None
    square = outline(np.zeros((0, 2)), np.zeros(0), 3.0)
    assert len(square) == 4
    assert np.abs(square).max() == pytest.approx(3.0)
    assert reach_along(np.eye(2), np.array([1.0, 2.0]), np.array([1.0, 1.0])) == pytest.approx(1.0)
    assert math.isinf(reach_along(np.eye(2), np.ones(2), np.array([-1.0, 0.0])))


def test_the_answer_names_the_direction_and_the_drive():
    lines = dict(CAPABILITY.sentences(capability(load("hexapod", LINEAR), along=[0, 0, 1])))
    assert lines["Drives"].startswith("The drives hold 760.3 N in whichever direction a force acts")
    assert "leg 2 actuator reaches its limit" in lines["Least"]
    assert "the other way" in lines["Along"]


def test_loads_that_are_not_held_are_said():
    answer = capability(load("hexapod", ["limits.actuator_force=500 N", "load.force=[0, 0, -500]"]))
    assert answer.set_of("force").least > 0.0
    heavy = capability(load("cogiro", ["load.force=[0, 0, 6000]"]))
    assert heavy.set_of("force").least < 0.0
    assert heavy.message == "The drives do not hold the loads that count already."
    assert not capability_figures(heavy)
    force = heavy.set_of("force")
    assert math.isnan(force.greatest)
    assert math.isnan(force.along([1, 0, 0]))
    table = next(CAPABILITY.tables(heavy, False))
    assert next(iter(table.columns[-1].cells)) == "–"


def test_structure_that_carries_without_a_drive_has_no_limit():
    answer = capability(load("delta", ["limits.actuator_moment=50 N*m", "limits.actuator_turning_speed=3 rad/s"]))
    moment = answer.set_of("moment")
    assert math.isinf(moment.least)
    assert math.isinf(moment.greatest)
    assert math.isinf(moment.along([0, 0, 1]))
    assert answer.set_of("rate") is None  # it does not turn
    assert not len(moment.vertices)


def test_under_load_the_drives_carry_what_they_do_at_rest():
    settings = ["limits.actuator_force=5 kN", "load.gravity=[0, 0, -9.81]", "tool.mass=3 kg"]
    rest = capability(load("tripteron", [*settings, "load.state=loaded"]))
    assert rest.loads_left_out == ""
    free = capability(load("tripteron", settings))
    assert "weight of the links" in free.loads_left_out
    assert max(abs(d.carried) for d in rest.drives) > max(abs(d.carried) for d in free.drives)


def test_drives_without_limits_are_refused():
    with pytest.raises(InputError, match="nothing limits the load of the drives"):
        capability(load("zhang-gosselin-4dof"))


def test_only_what_is_limited_is_answered():
    answer = capability(load("zhang-gosselin-4dof", ["limits.actuator_speed=0.2 m/s"]))
    assert [part.name for part in answer.sets] == ["speed", "rate"]


def test_files_hold_the_sets(tmp_path):
    answer = capability(load("hexapod", LINEAR))
    save(answer, tmp_path / "capability.json")
    written = json.loads((tmp_path / "capability.json").read_text())
    assert written["sets"][0]["set"] == "force"
    assert len(written["sets"][0]["vertices"]) == 8
    save(answer, tmp_path / "capability.csv")
    assert "least" in (tmp_path / "capability.csv").read_text().splitlines()[0]
    assert capability_figures(answer)["capability"]().axes


MASSES = ["tool.mass=12 kg", "tool.inertia=[0.1, 0.1, 0.15, 0, 0, 0]", "load.gravity=[0, 0, -9.81]"]


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("hexapod", ["limits.actuator_force=500 N", "drives.lead=10 mm", "drives.rotor_inertia=2e-5 kg*m**2"]),
        ("delta", ["limits.actuator_moment=50 N*m", "drives.ratio=20", "drives.rotor_inertia=2e-5 kg*m**2"]),
        ("tripteron", ["limits.actuator_force=5 kN"]),
    ],
)
def test_the_greatest_acceleration_brings_a_drive_to_its_limit_in_inverse_dynamics(name, settings):
    machine = load(name, [*MASSES, *settings])
    answer = capability(machine)
    part = answer.set_of("acceleration")
    equations = dynamics(machine)
    rows = [equations.coordinates.index(axis) for axis in "xyz"]
    bare = dynamics(load(name, [*MASSES[:2], *settings]))  # weights count by what the drives carry, as in the answer
    carried = np.array([drive.carried for drive in answer.drives])
    limits = np.array([drive.upper for drive in answer.drives])
    for way in ([1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.3, -0.5, 0.8], part.weakest):
        accelerations = np.zeros(len(equations.coordinates))
        accelerations[rows] = np.array(way) / np.linalg.norm(way) * part.along(way)
        forces = sum(bare.forces([0.0] * len(accelerations), accelerations.tolist()).values())
        loads = carried - forces * equations.senses
        assert (np.abs(loads) / limits).max() == pytest.approx(1.0, rel=1e-9)
    assert part.along(part.weakest) == pytest.approx(part.least)


def test_a_machine_without_masses_has_no_accelerations():
    assert capability(load("hexapod", ["limits.actuator_force=500 N"])).set_of("acceleration") is None


@pytest.mark.parametrize(
    "ask",
    [
        lambda machine: kinetostat.compile(machine, ["z"], "least_acceleration"),
        lambda machine: evaluate(machine, {"z": [0.1, 3.0]}, ["greatest_acceleration_x"]),
        dynamics,
        lambda machine: drives(machine, speed=0.1, acceleration=1.0),
    ],
)
@pytest.mark.parametrize(
    ("name", "limit", "reason"),
    [
        ("hexapod-rus", "limits.actuator_moment=50 N*m", "would have to span"),
        ("tripteron", "limits.actuator_force=1 kN", "cannot|nearer"),
    ],
)
def test_a_machine_whose_pose_has_no_place_is_refused_accelerations_in_a_sentence(ask, name, limit, reason):
    machine = load(name, ["tool.mass=12 kg", limit, "pose.z=3 m"])
    with pytest.raises(InputError, match=rf"has no place at .*({reason})") as refused:
        ask(machine)
    assert len(str(refused.value)) < 400


def crank_leg(name, motor, elbow, wrist):
    return {
        "name": name,
        "joints": [
            {"name": joint, "type": "revolute", "joins": bodies, "point": [*point, 0.0], "axis": [0, 0, 1], **more}
            for joint, bodies, point, more in (
                ("motor", ["base", "crank"], motor, {"actuated": True, "stiffness": 5e3}),
                ("elbow", ["crank", "rod"], elbow, {}),
                ("wrist", ["rod", "platform"], wrist, {}),
            )
        ],
    }


def test_a_crank_in_line_with_its_rod_stops_the_motion_along_them():
    """At the dead point the drive has no load, and no finite rate of it moves the platform along the rod."""
    machine = build(
        {
            "schema": 1,
            "name": "dead point",
            "family": "legs",
            "space": "planar",
            "platform": {"point": [0.0, 1.0, 0.0]},
            "pose": {"x": 0.0, "y": 1.0, "yaw": 0.0},
            "legs": [
                crank_leg("a", (-4.0, 1.0), (-2.0, 1.0), (-1.0, 1.0)),
                crank_leg("b", (-1.0, -1.0), (-2.0, 0.0), (0.0, 1.0)),
                crank_leg("c", (3.0, -1.0), (3.0, 0.0), (1.0, 0.5)),
            ],
            "limits": {"actuator_moment": 100.0, "actuator_turning_speed": 1.0},
        }
    )
    least = {part.name: part.least for part in capability(machine).sets}
    assert least["speed"] == pytest.approx(0.0, abs=1e-90)
    assert least["rate"] == pytest.approx(4.0)

"""What drives can do, against brute-force linear programmes over the forces of every leg and the rates of every joint.

The programmes know passive and actuated joints of each leg and nothing else: no wrenches of legs, no faces.
"""

from dataclasses import replace

import numpy as np
import pytest

import kinetostat
from driven_sets import (
    EQUAL,
    MACHINES,
    by_faces,
    greatest_gain,
    greatest_motion,
    greatest_wrench,
    massive,
    poses,
    screws,
    states,
    twist_of,
)
from kinetostat import load
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.equilibrium.state import actuator_loads_at_rest, state_of
from kinetostat.kinetostatics.feasible import BLOCKS, greatest_ball, greatest_speed
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.parameters import values, with_values
from kinetostat.motion.machine_at_pose import loads_by_acceleration
from kinetostat.studies.dynamics import dynamics


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("count", [20, pytest.param(167, marks=pytest.mark.slow)])
def test_faces_bound_what_a_linear_programme_finds(name, count):
    machine, rng = MACHINES[name](), np.random.default_rng(0)
    there = [2, 3, 4] if machine.family.planar else range(6)
    for response in poses(machine, count):
        direction = np.zeros(6)
        direction[there] = rng.normal(size=len(there))
        expected = greatest_wrench(response, direction)
        assert by_faces(response.faces, direction) == pytest.approx(expected, rel=EQUAL), direction


def with_accelerations(equations):
    return replace(equations.state.free, acceleration_loads=loads_by_acceleration(equations._at_pose))


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("count", [10, pytest.param(167, marks=pytest.mark.slow)])
def test_accelerations_are_those_of_a_linear_programme_over_the_drives(name, count):
    machine, rng = massive(MACHINES[name]()), np.random.default_rng(2)
    for state in states(machine, count):
        equations = dynamics(state)
        response = with_accelerations(equations)
        size = sum(path.startswith("pose.") for path in values(machine))
        gains = rng.normal(size=size)
        reach = by_faces(response.acceleration_faces, twist_of(equations, gains))
        assert reach == pytest.approx(greatest_gain(equations, gains), rel=EQUAL)


@pytest.mark.parametrize("name", MACHINES)
def test_quantities_of_accelerations_are_the_least_of_linear_programmes(name):
    """Along single components, both ways, and in whichever direction of a thousand, and the worst of all."""
    machine, rng = massive(MACHINES[name]()), np.random.default_rng(3)
    for state in states(machine, 2):
        equations = dynamics(state)
        response = with_accelerations(equations)
        size = sum(path.startswith("pose.") for path in values(machine))
        motions = np.array([twist_of(equations, row) for row in np.eye(size)]).T
        for number, component in enumerate(COMPONENTS):
            gains, *_ = np.linalg.lstsq(motions, np.eye(6)[number], rcond=None)
            possible = np.abs(motions @ gains - np.eye(6)[number]).max() < 1e-9
            reach = min(greatest_gain(equations, sign * gains) for sign in (1.0, -1.0)) if possible else 0.0
            value = QUANTITIES[f"greatest_acceleration_{component}"].value(response)
            assert value == pytest.approx(reach, rel=EQUAL)
        for name_, part in (("least_acceleration", slice(3, 6)), ("least_angular_acceleration", slice(0, 3))):
            radius = QUANTITIES[name_].value(response)
            others = np.delete(motions, part, axis=0)
            _, sizes, rows = np.linalg.svd(others)
            allowed = rows[(sizes > 1e-9).sum() :].T  # gains without motion of the other kind
            moved = motions[part] @ allowed
            if not allowed.shape[1]:
                assert np.isnan(radius)
                continue
            drawn = allowed @ np.linalg.pinv(moved) @ moved @ rng.normal(size=(allowed.shape[1], 8))
            for gains in drawn.T:
                assert greatest_gain(equations, gains / np.linalg.norm(motions[part] @ gains)) >= radius * (1.0 - EQUAL)
            normals = np.array([face.normal.components() for face in response.acceleration_faces], dtype=float)
            felt = normals[:, part] @ moved @ np.linalg.pinv(moved)
            room = np.array([float(face.room) for face in response.acceleration_faces])
            sizes = np.linalg.norm(felt, axis=1)
            worst = np.argmin(np.where(sizes > 1e-9 * sizes.max(), room / np.maximum(sizes, 1e-300), np.inf))
            face = response.acceleration_faces[worst]
            sign = 1.0 if face.upper < -face.lower else -1.0
            gains = allowed @ np.linalg.pinv(moved) @ (sign * felt[worst] / sizes[worst])
            assert greatest_gain(equations, gains) == pytest.approx(radius, rel=EQUAL)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("block", BLOCKS)
def test_the_ball_touches_its_worst_face_and_no_direction_is_worse(name, block):
    machine, rng = MACHINES[name](), np.random.default_rng(1)
    for response in poses(machine, 4):
        radius = greatest_ball(response.faces, BLOCKS[block], response.configuration.length)
        if radius < 0.0:  # the cables do not hold the weight between their bounds
            assert greatest_wrench(response, np.zeros(6)) == -np.inf
            continue
        for _ in range(6):
            direction = np.zeros(6)
            direction[BLOCKS[block]] = rng.normal(size=3)
            if machine.family.planar:
                direction[[0, 1, 5]] = 0.0
            direction /= np.linalg.norm(direction)
            assert greatest_wrench(response, direction) >= radius * (1.0 - EQUAL)
        if np.isinf(radius):
            continue
        parts = [(np.array(f.normal.components(), dtype=float)[BLOCKS[block]], f) for f in response.faces]
        normal, face = min(
            ((n, f) for n, f in parts if np.linalg.norm(n) > 1e-9), key=lambda p: p[1].room / np.linalg.norm(p[0])
        )
        direction = np.zeros(6)
        direction[BLOCKS[block]] = normal / np.linalg.norm(normal) * (1.0 if face.upper < -face.lower else -1.0)
        assert greatest_wrench(response, direction) == pytest.approx(radius, rel=EQUAL)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("count", [5, pytest.param(83, marks=pytest.mark.slow)])
def test_speeds_are_those_of_a_linear_programme_over_the_joints(name, block, count):
    machine = MACHINES[name]()
    speeds = f"greatest_twist_{'x' if block == 'translation' else 'rz'}"
    for response in poses(machine, count):
        radius = greatest_speed(response.transmission, [drive.speed for drive in response.drives], BLOCKS[block])
        row = BLOCKS[block].start + (0 if block == "translation" else 2)
        along = greatest_motion(response, np.eye(6)[row])
        assert QUANTITIES[speeds].value(response) == pytest.approx(along, rel=EQUAL, abs=1e-9)
        if np.isnan(radius):
            continue
        worst = worst_motion(response, block)
        assert radius == pytest.approx(worst, rel=EQUAL)


def worst_motion(response, block):
    """The least of the greatest speeds over directions that the machine has, by the rates of the drives alone."""
    passive, driven = screws(response)
    absent = [] if response.configuration.plane is None else response.configuration.plane.missing_freedoms
    away = np.array([joint.twist(response.reference).components() for joint in absent], dtype=float).reshape(-1, 6).T
    # All rates of joints at unit speeds of the platform along the axes of the block, by least squares leg by leg.
    basis = np.eye(6)[:, BLOCKS[block]]
    rates, gaps = [], []
    for free, held in zip(passive, driven, strict=True):
        matrix = np.hstack([held, free, away])
        solved = np.linalg.pinv(matrix, rcond=1e-9) @ basis
        gaps.append(basis - matrix @ solved)
        rates.append(solved[: held.shape[1]])
    _, values, rows = np.linalg.svd(np.vstack(gaps))
    free = rows[(values > 1e-7).sum() :].T
    speeds = [drive.speed for drive in response.drives]
    return min(s / np.linalg.norm(row @ free) for row, s in zip(np.vstack(rates), speeds, strict=True))


@pytest.mark.parametrize("name", ["hexapod", "cables", "delta"])
def test_a_compiled_map_gives_what_a_pose_gives(name):
    machine = MACHINES[name]()
    quantities = [q for q in QUANTITIES if QUANTITIES[q].driven in ("load", "speed") and not q.endswith("_rx")]
    function = kinetostat.compile(machine, ["z"], quantities)
    heights = np.linspace(0.0, 0.02, 3) + machine.tables["pose"].z
    values = function(heights)
    for place, height in enumerate(heights):
        response = state_of(with_values(machine, {"pose.z": float(height)})).free
        expected = [float(QUANTITIES[q].value(response)) for q in quantities]
        np.testing.assert_allclose(values[:, place], expected, rtol=1e-10)


@pytest.mark.parametrize("name", ["hexapod", "cables", "delta"])
def test_compiled_accelerations_and_their_slopes_are_those_of_poses(name):
    machine = massive(MACHINES[name]())
    quantities = ["least_acceleration", "greatest_acceleration_x", "greatest_acceleration_z"]
    function = kinetostat.compile(machine, ["z"], quantities)
    heights = np.linspace(0.0, 0.02, 3) + machine.tables["pose"].z
    numbers, slopes = function(heights), function.jacobian(heights)
    for place, height in enumerate(heights):
        near = [state_of(with_values(machine, {"pose.z": float(height + step)})) for step in (-1e-6, 0.0, 1e-6)]
        responses = [with_accelerations(dynamics(state)) for state in near]
        rows = np.array([[float(QUANTITIES[q].value(response)) for q in quantities] for response in responses])
        np.testing.assert_allclose(numbers[:, place], rows[1], rtol=1e-10)
        np.testing.assert_allclose(
            np.ravel(slopes[:, ..., place]), (rows[2] - rows[0]) / 2e-6, rtol=1e-5, atol=1e-6 * np.abs(rows).max()
        )


@pytest.mark.parametrize("name", ["hexapod", "tripteron"])
def test_a_machine_meant_under_load_counts_what_its_drives_carry_at_rest(name):
    massive = ["load.state=loaded", "load.gravity=[0, 0, -9.81]", "tool.mass=3 kg", "limits.actuator_force=5 kN"]
    machine = load(name, massive)
    heights = machine.tables["pose"].z + np.linspace(0.0, 0.01, 300)
    compiled = kinetostat.compile(machine, ["z"], "least_wrench_force")(heights)
    for place in (0, 150, 299):
        state = state_of(with_values(machine, {"pose.z": float(heights[place])}))
        carried = [float(load[0]) for _, load in actuator_loads_at_rest(state.at_rest)]
        free = replace(state.free, loaded={"drive_loads": carried})
        expected = greatest_ball(free.faces, BLOCKS["translation"], free.configuration.length)
        assert compiled[place] == pytest.approx(expected, rel=1e-8)
        if name == "hexapod":  # its links weigh nothing
            relaxed = replace(state.free, meant_loaded=False)
            assert expected == pytest.approx(QUANTITIES["least_wrench_force"].value(relaxed), rel=1e-3)

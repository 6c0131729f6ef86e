"""Motions with forces of the process: the same forces set in the file point by point, and the work done at the tool."""

import io
import math

import numpy as np
import pytest
import xarray as xr

from kinetostat.engine.moving import PosePath, forces_on_path, rigid_form
from kinetostat.equilibrium.state import state_of
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import POSE, values, with_values
from kinetostat.motion.forces import PARTS
from kinetostat.spec.errors import InputError
from kinetostat.studies.drives import drives
from kinetostat.studies.motions import Motion, read_motion
from kinetostat.studies.motors import motors
from kinetostat.studies.requirements import motor_requirements
from kinetostat.views.data_forms import json_of, netcdf_of
from kinetostat.views.drives import DRIVES, curves_csv

MASSES = ("tool.mass=3 kg", "tool.inertia=[0.02, 0.03, 0.04, 0.001, 0, 0.002]", "load.gravity=[0, 0, -9.81]")
WRENCH = {
    "load.force.0": 30.0, "load.force.1": -20.0, "load.force.2": -50.0,
    "load.moment.0": 2.0, "load.moment.1": -1.0, "load.moment.2": 0.5,
}  # fmt: skip
MOVES = """feed [mm/s], acceleration [m/s**2], shape, x [mm], y [mm], z [mm], force.x [N], force.z [N]
100, 5, line,    20,  0,  140, 10, 0
100, 5, through, 0,   20, 140, 40, -5
100, 5, arc,     -20, 0,  140, 30, -10
100, 5, line,    -20, 0,  140, 90, -10
50,  5, line,    0,   0,  140, 50, -30
"""


def swing(machine, count, size=0.01):
    """A closed motion through all coordinates of the pose with all components of the load, once round in a second."""
    here = {path.removeprefix(POSE): float(v) for path, v in values(machine).items() if path.startswith(POSE)}
    angle = 2.0 * np.pi * np.arange(count) / count
    phases = dict(zip(here, np.linspace(0.0, 5.0, len(here)), strict=True))
    pose = {name: middle + size * np.sin(angle + phases[name]) for name, middle in here.items()}
    rates = {name: size * 2.0 * np.pi * np.cos(angle + phases[name]) for name in here}
    gains = {name: -size * (2.0 * np.pi) ** 2 * np.sin(angle + phases[name]) for name in here}
    loads = {path: most * (1.0 + np.sin(angle + most)) for path, most in WRENCH.items()}
    return PosePath(pose, rates, gains, loads)


def read(folder, machine, text, points=400):
    (folder / "motion.csv").write_text(text, "utf-8")
    return read_motion(machine, folder / "motion.csv", points)


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("name", ["hexapod", "delta", "planar-3rrr", "zhang-gosselin-4dof", "tripteron"])
def test_forces_along_a_motion_are_those_of_the_file_at_each_point(name, compiled):
    machine = load(name, ["tool.mass=3 kg", "load.force=[7, 8, 9]"])
    path = swing(machine, 12)
    along = forces_on_path(rigid_form(state_of(machine)), path, joints=True, compiled=compiled)
    for point in range(0, 12, 3):
        by_hand = with_values(machine, {leaf: float(rows[point]) for leaf, rows in path.loads.items()})
        alone = path.at(np.array([point]))
        there = forces_on_path(
            rigid_form(state_of(by_hand)), PosePath(alone.pose, alone.rates, alone.accelerations), True, compiled=False
        )
        for part in ("drives", "joints", "wrench"):
            expected = getattr(there, part)[..., 0]
            scale = np.abs(expected).max()
            assert getattr(along, part)[..., point] == pytest.approx(
                expected, abs=(1e-11 if compiled else 1e-13) * scale
            )


@pytest.mark.parametrize("name", ["hexapod", "delta"])
def test_a_force_that_stays_is_that_of_the_file(name, tmp_path):
    """Also in joints, deflections and modes, and in the place of another force in the file."""
    text = "time, x [mm], force.x [N], load.moment.1\n0, 0, 25, 2\n0.2, 4, 25, 2\n0.4, 6, 25, 2\n0.5, 6, 25, 2\n"
    plain = "\n".join(",".join(line.split(",")[:2]) for line in text.splitlines())
    settings = ["tool.mass=3 kg", "drives.lead=10 mm", "load.force.y=5 N"]
    given = load(name, [*settings, "load.force.x=-9 N"])
    by_hand = load(name, [*settings, "load.force.x=25 N", "load.moment.y=2 N*m"])
    first, second = drives(given, read(tmp_path, given, text)), drives(by_hand, read(tmp_path, by_hand, plain))
    pairs = [
        (getattr(first.curves, n), getattr(second.curves, n)) for n in ("force", "parts", "motor_torque", "net_energy")
    ]
    pairs += [([j.force for j in first.joints], [j.force for j in second.joints])]
    pairs += [(first.deflection, second.deflection), (first.along_modes.surplus, second.along_modes.surplus)]
    for along, expected in pairs:
        assert along == pytest.approx(np.array(expected), abs=1e-13 * np.abs(expected).max())


def test_drives_do_the_work_that_the_tool_does_on_the_process():
    """At every point, at a tool that stands off the platform's point; weight and inertia give all back once round."""
    arm = np.array([0.03, -0.02, 0.05])
    machine = load("hexapod", [*MASSES, "tool.offset=[0.03, -0.02, 0.05]"])
    path = swing(machine, 256)
    speed, _, *parts = np.moveaxis(forces_on_path(rigid_form(state_of(machine)), path).drives, 1, 0)
    done = np.zeros(256)
    for point in range(256):
        (_, pitch, yaw), rates = (
            [part[name][point] for name in ("roll", "pitch", "yaw")] for part in (path.pose, path.rates)
        )
        roll = path.pose["roll"][point]
        about_x, about_y, about_z = turns(roll, pitch, yaw)
        spin = about_z @ (np.array([0, 0, rates[2]]) + about_y @ np.array([rates[0], rates[1], 0]))
        moved = np.array([path.rates[name][point] for name in "xyz"])
        moved = moved + np.cross(spin, about_z @ about_y @ about_x @ arm)
        wrench = np.array([path.loads[leaf][point] for leaf in WRENCH])
        done[point] = -wrench[:3] @ moved - wrench[3:] @ spin
    size = np.abs(done).max()
    assert (speed * parts[2]).sum(axis=0) == pytest.approx(done, abs=1e-10 * size)
    assert (speed * sum(parts)).sum(axis=0).mean() == pytest.approx(done.mean(), abs=1e-10 * size)


def turns(roll, pitch, yaw):
    (a, b, c), (d, e, f) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, a, -d], [0, d, a]])
    return about_x, np.array([[b, 0, e], [0, 1, 0], [-e, 0, b]]), np.array([[c, -f, 0], [f, c, 0], [0, 0, 1]])


def test_forces_change_evenly_over_time_from_line_to_line(tmp_path):
    motion = read(tmp_path, load("hexapod"), "time, x [mm], force.z [N]\n0, 0, 10\n0.3, 4, -20\n0.4, 5, 0\n", 70)
    expected = np.interp(motion.times, [0.0, 0.3, 0.4], [10.0, -20.0, 0.0])
    assert motion.path.loads["load.force.2"] == pytest.approx(expected, abs=1e-13)


def test_forces_swing_about_those_of_the_file_as_in_a_table_of_times(tmp_path):
    """Beside a coordinate that swings twice as fast; the motion goes on for ever; drives feel the same forces."""
    machine = load("hexapod", [*MASSES, "load.force=[7, 8, 9]"])
    sines = "field, amplitude, frequency [Hz], phase [deg]\nforce.x, 30 N, 1, 0\nx, 2 mm, 2, 90\nforce.x, 5 N, 2, 90\n"
    swinging = read(tmp_path, machine, sines)
    turned = 2.0 * np.pi * swinging.times
    assert swinging.periodic
    assert swinging.path.loads.keys() == {"load.force.0"}
    assert swinging.path.loads["load.force.0"] == pytest.approx(
        7.0 + 30.0 * np.sin(turned) + 5.0 * np.cos(2.0 * turned)
    )
    assert swinging.path.pose["x"] == pytest.approx(0.002 * np.cos(2.0 * turned))
    answer = drives(machine, swinging)
    for point in (0, 100, 250):
        there = {POSE + name: float(rows[point]) for name, rows in swinging.path.pose.items()}
        held = with_values(machine, {**there, "load.force.0": float(swinging.path.loads["load.force.0"][point])})
        process = answer.curves.parts[:, PARTS.index("process"), point]
        assert process == pytest.approx(drives(held, still(swinging, point)).curves.parts[:, PARTS.index("process"), 0])


def still(motion, point):
    """The machine at rest at one point of a motion, twice, with the forces of its file."""
    pose = {name: np.full(2, rows[point]) for name, rows in motion.path.pose.items()}
    rest = {name: np.zeros(2) for name in pose}
    return Motion("rest", np.array([0.0, 1.0]), PosePath(pose, rest, rest))


def test_a_motion_that_ends_with_another_force_does_not_go_on_for_ever(tmp_path):
    rows = ["0, 0, 0", "0.1, 3, 1", "0.2, 5, 1", "0.3, 3, 1", "0.4, 0, 1", "0.5, -2, 1", "0.6, 0, {}"]
    texts = ("\n".join(["time, x [mm], force.z", *rows]).format(last) for last in (0, 2))
    assert [read(tmp_path, load("hexapod"), text).periodic for text in texts] == [True, False]


@pytest.mark.parametrize("jerk", ["", "jerk"])
def test_moves_carry_their_forces_through_arcs_and_jump_where_a_pose_stands_twice(tmp_path, jerk):
    """By symmetry the point of the arc is passed after half of its time."""
    text = MOVES
    if jerk:
        head, *rows = MOVES.splitlines()
        text = "\n".join([f"{head}, jerk [m/s**3]", *(f"{row}, 200" for row in rows)])
    motion = read(tmp_path, load("hexapod"), text)
    force, height = motion.path.loads["load.force.0"], motion.path.loads["load.force.2"]
    meeting = next(int(k) for k in np.flatnonzero(np.diff(motion.times) == 0.0) + 1 if force[k] == 90.0)
    assert (force[meeting - 1], force[meeting]) == pytest.approx((30.0, 90.0))
    half = motion.times[meeting] / 2.0
    arc, line = motion.times[:meeting], motion.times[meeting:]
    assert force[:meeting] == pytest.approx(np.interp(arc, [0, half, 2 * half], [10, 40, 30]), abs=1e-9)
    assert height[:meeting] == pytest.approx(np.interp(arc, [0, half, 2 * half], [0, -5, -10]), abs=1e-9)
    assert force[meeting:] == pytest.approx(np.interp(line, [line[0], line[-1]], [90, 50]), abs=1e-9)


def test_a_point_early_on_an_arc_has_the_time_at_which_it_is_passed(tmp_path):
    """The path is 20 mm times an angle; at the angle of 0.2 the tool is still speeding up: s = a t² / 2."""
    text = MOVES.replace("0,   20", f"{20 * math.cos(0.2)}, {20 * math.sin(0.2)}").replace("100, 5", "100, 1")
    motion = read(tmp_path, load("hexapod"), text)
    passed = np.sqrt(2.0 * 0.02 * 0.2)
    early = motion.times <= passed
    assert early.sum() > 10
    force = motion.path.loads["load.force.0"][early]
    assert force == pytest.approx(10.0 + 30.0 * motion.times[early] / passed, abs=1e-9)


def test_every_surface_has_the_forces_of_the_motion(tmp_path):
    machine = load("hexapod", [*MASSES, "drives.lead=10 mm"])
    motion = read(tmp_path, machine, MOVES)
    answer = drives(machine, motion)
    lines = dict(DRIVES.lines(answer))
    assert "load.force.x, load.force.z" in lines["Loads"]
    head, first, *_ = curves_csv(answer).splitlines()
    assert float(first.split(",")[head.split(",").index("load.force.x [N]")]) == 10.0
    given = json_of(DRIVES, answer)["loads"]["load.force.z"]
    assert given["units"] == "N"
    assert given["values"] == pytest.approx(motion.path.loads["load.force.2"])
    data = xr.load_dataset(io.BytesIO(netcdf_of(DRIVES, answer)))
    rows = data.loads_over_time.sel(load_component="load.force.x")
    assert rows.values == pytest.approx(motion.path.loads["load.force.0"])
    quiet = drives(machine, read(tmp_path, machine, "time, x\n0, 0\n0.2, 0.001\n"))
    assert "Loads" not in dict(DRIVES.lines(quiet))
    assert "loads" not in json_of(DRIVES, quiet)
    assert xr.load_dataset(io.BytesIO(netcdf_of(DRIVES, quiet))).loads_over_time.shape[0] == 0


def test_a_force_alone_asks_something_of_drives_and_motors(tmp_path):
    """Of a machine without masses, friction and loads; a motion in time may also stand still."""
    machine = load("hexapod", ["drives.lead=10 mm"])
    answer = drives(machine, read(tmp_path, machine, "time, force.z [N]\n0, 0\n0.2, -600\n"))
    assert max(drive.force for drive in answer.drives) > 100.0
    assert all(drive.speed == 0.0 for drive in answer.drives)
    light, heavy = (motors(machine, read(tmp_path, machine, MOVES.replace("-10", z))) for z in ("-10", "-1000"))
    assert heavy.candidates[0].peak > 3.0 * light.candidates[0].peak


def test_a_motion_made_in_python_has_forces_too():
    machine = load("hexapod", [*MASSES])
    path = swing(machine, 16)
    quiet = PosePath(path.pose, path.rates, path.accelerations)
    times = np.linspace(0.0, 1.0, 16)
    forces, others = (drives(machine, Motion("swing", times, way)).curves for way in (path, quiet))
    assert np.abs(forces.parts[:, 2]).max() > 10.0
    assert not others.parts[:, 2].any()
    assert forces.parts[:, 1] == pytest.approx(others.parts[:, 1])


def test_a_named_load_may_vary_and_a_required_motor_feels_it(tmp_path):
    named = ["load.fan.force=[0, 0, -5]", "load.fan.point=[0.1, 0, 0]", "drives.lead=10 mm", *MASSES]
    text = "time, z [mm], fan.force.z\\n0, 140, {0}\\n0.2, 141, {0}\\n"
    shares = []
    for force in (-5, -2000):
        required = f'requirements.servo={{ fits = "yaskawa-sgmp-03b", motion = "{text.format(force)}" }}'
        (verdict,) = motor_requirements(load("hexapod", [*named, required]))
        shares.append(verdict.worst)
    assert shares[1] > 3.0 * shares[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time, x, force.w\n0, 0, 1\n1, 0.01, 1\n", r'force.w" is not a field .* did you mean force\.[xyz]\?'),
        ("time, x, force.x [mm]\n0, 0, 1\n1, 0.01, 1\n", "line 2, column force.x.*not a unit of force"),
        ("time, x, tool.mass\n0, 0, 1\n1, 0.01, 1\n", "tool.mass does not move; .* forces and moments"),
        ("time, x, gravity_angle\n0, 0, 1\n1, 0.01, 1\n", "does not move"),
        ("field, amplitude, frequency, force.x\nx, 0.01, 1, 3\n", 'no column "force.x".*in the column field'),
        (
            "feed, acceleration, shape, x, force.x\n1, 1, line, 0, 0\n1, 1, through, 0.01, 0\n1, 1, arc, 0.02, 0\n",
            "a line",
        ),
    ],
)
def test_what_is_no_force_of_a_motion_is_said(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        read(tmp_path, load("hexapod"), text)

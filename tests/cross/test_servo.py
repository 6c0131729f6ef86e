"""Servo loops: receptance and poles against the transfer function of platform and drives, written out here."""

import copy
import json

import numpy as np
import pytest

import kinetostat
from kinetostat import InputError, drives, evaluate, load, modes, save, servo
from kinetostat.equilibrium.state import state_of
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.machine.actuators import MOST_DRIVES
from kinetostat.machine.loading import build
from kinetostat.vibration.servo import ServoLoop
from kinetostat.views.servo import SERVO, servo_figures
from kinetostat.views.vibration import VIBRATION

MASS, INERTIA, ROTOR, LEAD = 12.0, (0.3, 0.4, 0.5), 2e-5, 0.01
PLATFORM = ["tool.mass=12 kg", "tool.inertia=[0.3, 0.4, 0.5, 0, 0, 0]", "damping.per_mass=1e-12", "roll=0.1", "x=0.01"]
DRIVE = ["drives.rotor_inertia=2e-5", "drives.lead=0.01", "drives.rotor_damping=0.001"]
GAINS = ["servo.position_gain=50", "servo.velocity_gain=0.05"]
OWN_NUMBERS = {
    2: {"position_gain": 80.0, "velocity_gain": 0.08, "integral_time": 0.0},
    3: {"lead": 0.005, "rotor_inertia": 4e-5, "position_at_load": 1.0},
    6: {"rotor_damping": 0.004, "position_gain": 30.0},
}
"""What drives of some legs have in the place of the numbers of all."""
OF_ROTOR = ("lead", "rotor_inertia", "rotor_damping")
OWN = [
    f"{'drives' if field in OF_ROTOR else 'servo'}.leg {leg}.{field}={value}"
    for leg, numbers in OWN_NUMBERS.items()
    for field, value in numbers.items()
]
LOOPS = {
    "proportional, at the motor": [],
    "integral, at the motor": ["servo.integral_time=0.02"],
    "integral, at the load": ["servo.integral_time=0.02", "servo.position_at_load=1"],
    "integral, between": ["servo.integral_time=0.02", "servo.position_at_load=0.4"],
    "each its own": ["servo.integral_time=0.02", *OWN],
}


def hexapod(*more):
    return load("hexapod", [*PLATFORM, *DRIVE, *GAINS, *more])


def drive_stiffness(machine, leg, s):
    """Force of a drive on its joint per motion of the joint, by its two equations: motor and transmission."""
    shared = vars(machine.tables["servo"]) | {"rotor_inertia": ROTOR, "rotor_damping": 0.001, "lead": LEAD}
    given = shared | OWN_NUMBERS.get(leg, {}) if machine.family.own_drives else shared
    square, share = (2.0 * np.pi / given["lead"]) ** 2, given["position_at_load"]
    k = 2e7
    gain = given["velocity_gain"] * square
    gain = gain * (1.0 + 1.0 / (s * given["integral_time"])) if given["integral_time"] else gain
    # Unknown are the motor's place and the force, for a joint that moves by one.
    rotor = (s * s * given["rotor_inertia"] + s * given["rotor_damping"]) * square
    motor = rotor + gain * (given["position_gain"] * (1.0 - share) + s)
    matrix = np.array([[motor, -1.0], [k, 1.0]])
    return np.linalg.solve(matrix, [-gain * given["position_gain"] * share, k])[1]


def platform_stiffness(answer, s):
    """s² M + sum of z g g^T at the tool point."""
    response = answer.state.free
    lines = np.array([wrench.components() for wrench in response.transmission.wrenches], dtype=float)
    turn = response.configuration.platform.rotation
    axes = np.array([axis.components() for axis in (turn.x, turn.y, turn.z)], dtype=float).T
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = axes @ np.diag(INERTIA) @ axes.T, MASS * np.eye(3)
    loops = np.array([drive_stiffness(answer.machine, leg, s) for leg in range(1, 7)])
    return s * s * mass + (lines.T * loops) @ lines


@pytest.mark.parametrize("name", LOOPS)
def test_the_receptance_is_that_of_platform_and_drives(name):
    answer = servo(hexapod(*LOOPS[name]))
    frequencies = [0.3, 7.0, 40.0, 170.0, 900.0]
    for frequency, closed in zip(frequencies, answer.receptance(frequencies), strict=True):
        expected = np.linalg.inv(platform_stiffness(answer, 2.0j * np.pi * frequency))
        np.testing.assert_allclose(closed, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", LOOPS)
def test_poles_are_where_the_platform_moves_without_a_force(name):
    answer = servo(hexapod(*LOOPS[name]))
    assert answer.stable
    checked = 0
    for pole in answer.poles:
        if abs(pole) < 1e-6 or (abs(pole.imag) < 1e-9 and abs(pole.real + 1.0) < 1e-9):
            continue
        size = np.repeat([0.1, 1.0], 3)
        values = np.linalg.svd(platform_stiffness(answer, pole) / np.outer(size, size), compute_uv=False)
        assert values[-1] < 1e-6 * values[0]
        checked += 1
    assert checked >= 12 + 12  # platform and motors


@pytest.mark.parametrize("name", LOOPS)
def test_the_response_of_modes_has_the_damping_of_gains_where_loops_are_closed(name):
    machine, frequencies = hexapod(*LOOPS[name]), [0.3, 40.0, 170.0]
    answer = modes(machine, along=[1.0, 2.0, 0.0], closed_loops=True)
    for frequency, closed in zip(frequencies, answer.receptance(frequencies), strict=True):
        expected = np.linalg.inv(platform_stiffness(answer, 2.0j * np.pi * frequency))
        np.testing.assert_allclose(closed, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
    softest = answer.softest(answer.direction)
    curve = answer.along(answer.direction, np.geomspace(0.1, 5000.0, 4000).tolist()).real
    assert softest.real == pytest.approx(curve.min(), rel=1e-4)
    assert softest.real <= curve.min() * (1.0 - 1e-6)
    assert "loops closed" in dict(VIBRATION.sentences(answer))["Loops"]
    still = modes(hexapod("drives.rotor_inertia=0", "drives.rotor_damping=0"))
    assert [mode.frequency for mode in answer.modes] == pytest.approx([mode.frequency for mode in still.modes])


def test_modes_say_what_closed_loops_lack():
    with pytest.raises(InputError, match=r"servo\.position_gain of .* is 0"):
        modes(load("hexapod", [*PLATFORM, *DRIVE]), closed_loops=True)
    unstable = modes(hexapod("servo.position_gain=5000", "servo.velocity_gain=0.5"), closed_loops=True)
    assert ("unstable" in dict(VIBRATION.sentences(unstable))["Loops"]) is not servo(unstable.machine).stable


def test_static_stiffness_with_an_integral_part_is_that_of_the_transmission():
    answer = servo(hexapod("servo.integral_time=0.02"))
    np.testing.assert_allclose(answer.static, answer.motors_still, rtol=1e-9)
    proportional = servo(hexapod())
    loop = proportional.loops.loops[0]
    motor = loop.velocity_gain * loop.position_gain
    assert loop.static_stiffness == pytest.approx(1.0 / (1.0 / motor + 1.0 / loop.transmission))
    share = loop.static_stiffness / loop.transmission
    np.testing.assert_allclose(proportional.static, np.array(proportional.motors_still) * share, rtol=1e-9)


def test_a_scale_at_the_load_with_an_integral_part_is_rigid_at_rest():
    answer = servo(hexapod("servo.integral_time=0.02", "servo.position_at_load=1"))
    assert np.isinf(answer.static).all()
    assert np.isinf(answer.loops.loops[0].static_stiffness)


def test_gains_that_are_too_high_grow():
    answer = servo(hexapod("servo.position_gain=4000", "servo.position_at_load=1"))
    assert not answer.stable
    assert "unstable" in answer.message
    assert not servo_figures(answer)


def test_a_motor_without_loops_follows_the_transmission_at_high_frequency():
    loop = ServoLoop(2e7, 8.0, 0.0, 2e4, 50.0)
    assert abs(loop.stiffness([1e6])[0]) == pytest.approx(2e7, rel=1e-3)


def test_a_machine_whose_gains_nothing_says_is_refused():
    with pytest.raises(InputError, match="position_gain of"):
        servo(load("hexapod", [*PLATFORM, *DRIVE]))
    with pytest.raises(InputError, match="rotor_inertia"):
        servo(load("hexapod", [*PLATFORM, *GAINS]))
    with pytest.raises(InputError, match="is rigid"):
        servo(hexapod("stiffness.actuator=rigid"))


def test_the_answer_describes_itself(tmp_path):
    answer = servo(hexapod(), along=[1, 0, 0])
    lines = dict(SERVO.sentences(answer))
    assert lines["Servo"].startswith("The loops are stable")
    for suffix in ("json", "csv", "nc"):
        save(answer, tmp_path / f"servo.{suffix}")
    written = json.loads((tmp_path / "servo.json").read_text())
    assert [row["component"] for row in written["stiffness"]] == ["rx", "ry", "rz", "x", "y", "z"]
    assert servo_figures(answer)["servo"]().axes


def test_reversal_adds_play_and_friction_of_all_drives():
    friction, gain = 0.02, 0.05
    machine = hexapod("drives.backlash=4 um", f"drives.rotor_friction={friction}")
    turns = 2.0 * np.pi / LEAD
    lost = 4e-6 + 2.0 * friction * turns / (gain * turns**2 * 50.0)
    flexibility = state_of(machine).free.statics.flexibility
    expected = lost * sum(abs(twist.translational.x) for twist in flexibility)
    assert kinetostat.compile(machine, ["x"], "reversal_error_x")(0.01) == pytest.approx(expected)
    measured = hexapod("drives.backlash=4 um", "servo.position_at_load=1", "servo.integral_time=0.02")
    assert kinetostat.compile(measured, ["x"], "reversal_error_x")(0.01) == 0.0
    with pytest.raises(InputError, match="no lost motion"):
        kinetostat.compile(load("hexapod"), ["x"], "reversal_error_x")


def test_an_integral_time_that_varies_removes_what_friction_holds_back_only_where_it_is_not_zero():
    settings = ["drives.rotor_friction=0.02", "drives.guide_friction=30 N"]
    varied = kinetostat.compile(hexapod(*settings), ["servo.integral_time"], "reversal_error_x")
    for time in (0.0, 0.02):
        single = kinetostat.compile(hexapod(*settings, f"servo.integral_time={time}"), ["x"], "reversal_error_x")
        assert varied(time) == pytest.approx(single(0.01), rel=1e-12)
    assert varied(0.0) > 1.5 * varied(0.02) > 0.0


def test_a_machine_leg_by_leg_has_the_same_loops_of_its_own():
    """The same hexapod as a file leg by leg, whose legs have the names of the family's."""
    machine = hexapod("servo.integral_time=0.02", *OWN)
    written = servo(build(document_of(machine)))
    np.testing.assert_allclose(written.poles, servo(machine).poles, rtol=1e-6, atol=1e-6)
    assert len({loop.position_gain for loop in written.loops.loops}) == 3


def test_own_numbers_follow_a_machine_into_its_file_and_along_a_motion(tmp_path):
    machine = hexapod("servo.integral_time=0.02", *OWN)
    save(machine, tmp_path / "own.toml")
    again = load(tmp_path / "own.toml")
    assert again.tables == machine.tables
    changed = machine.with_values({"servo.leg 2.position_gain": 60.0, "drives.lead": 0.02})
    assert [loop.position_gain for loop in servo(changed).loops.loops] == [50.0, 60.0, 50.0, 50.0, 50.0, 30.0]
    speeds = [drive.motor_speed / drive.speed for drive in drives(machine, speed=0.1, acceleration=1.0).drives]
    assert speeds == pytest.approx([2.0 * np.pi / (0.005 if leg == 3 else LEAD) for leg in range(1, 7)])


GANTRY = """
schema = 1
name   = "Gantry"
family = "legs"
platform.point = [0, 0, 0.2]
pose  = { x = 0, z = 0.2 }
tool  = { mass = "5 kg" }
drives = { lead = "10 mm", rotor_inertia = "3e-5 kg*m**2" }
servo = { position_gain = 60, velocity_gain = 0.1, integral_time = 0.02, "a column" = { position_gain = 30 } }
[[legs]]
name = "a"
joints = [
  { name = "rail", type = "prismatic", joins = ["base", "carriage"], point = [0, 0, 0], axis = [1, 0, 0], actuated = true, stiffness = "30 N/um" },
  { name = "column", type = "prismatic", joins = ["carriage", "platform"], point = [0, 0, 0.1], axis = [0, 0, 1], actuated = true, stiffness = "20 N/um" },
]
"""  # noqa: E501


@pytest.mark.filterwarnings("error")
def test_two_drives_of_a_leg_have_tables_by_their_names_and_what_cannot_move_is_rigid(tmp_path):
    answer = servo(build(GANTRY))
    assert [loop.position_gain for loop in answer.loops.loops] == [60.0, 30.0]
    least = dict(zip(answer.components, (stiffness for stiffness, _ in answer.least), strict=True))
    assert [name for name, stiffness in least.items() if np.isinf(stiffness)] == ["rx", "ry", "rz", "y"]
    save(answer, tmp_path / "servo.json")
    assert json.loads((tmp_path / "servo.json").read_text())["drives"][1]["position_gain"] == 30.0
    assert servo_figures(answer)["servo"]().axes


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("servo.leg 9.position_gain=3", r'the leg or drive of \[servo\."leg 9"\] is "leg 9"'),
        ("servo.leg 2.gain=3", 'the field of servo."leg 2" is "gain"'),
        ("drives.leg 2.lead=5 kg", "drives.leg 2.lead is"),
    ],
)
def test_a_mistake_in_the_table_of_a_drive_is_named(setting, message):
    with pytest.raises(InputError, match=message):
        hexapod(setting)


def test_more_drives_with_tables_than_any_machine_has_are_refused():
    """A drive with both tables counts once, and 65 drives with one of them are too many."""
    tables = {f"leg {i}": {"lead": "5 mm"} for i in range(MOST_DRIVES + 1)}
    document = document_of(hexapod()) | {"drives": tables}
    with pytest.raises(InputError, match=f"{MOST_DRIVES + 1} single drives; at most {MOST_DRIVES}"):
        build(document)


def lost_by_joints(machine, moment):
    """Motion of the tool, by component, that reversing moments in all passive joints make in its state of rest.

    The machine as its file leg by leg, in which one passive joint after the other is a flexure hinge that is next to
    free and carries the moment (or force) where it is.
    """
    document, names = document_of(machine), machine.family.component_names
    joints = [
        (leg["name"], joint["name"])
        for leg in document["legs"]
        for joint in leg["joints"]
        if joint["type"] in ("revolute", "prismatic") and not joint.get("actuated")
    ]
    lost = dict.fromkeys(names, 0.0)
    for leg, name in joints:
        prepared = copy.deepcopy(document) | {"load": {"state": "loaded"}}
        joint = next(j for row in prepared["legs"] if row["name"] == leg for j in row["joints"] if j["name"] == name)
        joint |= {"stiffness": 1e-9, "preload": LITTLE}
        at_rest = build(prepared)
        moved = evaluate(at_rest, {"x": [at_rest.tables["pose"].x]}, [f"displacement_{name}" for name in names])
        for name in names:
            lost[name] += 2.0 * moment / LITTLE * abs(float(moved[f"displacement_{name}"][0]))
    return lost


LITTLE = 1e-3
"""Moment or force that bends the machine so little that its geometry stays."""


def reversal_errors(machine):
    names = machine.family.component_names
    answer = evaluate(machine, {"x": [machine.tables["pose"].x]}, [f"reversal_error_{name}" for name in names])
    return {name: float(answer[f"reversal_error_{name}"][0]) for name in names}


@pytest.mark.parametrize("name", ["planar-3rrr", "tripteron"])
def test_friction_of_joints_holds_back_what_its_moments_deflect(name):
    """The Tripteron's links bend, and its legs hold each other: all of that counts."""
    frictions = ["damping.hinge_friction=0.3", "damping.slide_friction=0.3"]
    expected, lost = lost_by_joints(load(name), 0.3), reversal_errors(load(name, frictions))
    assert lost == pytest.approx(expected, rel=1e-6)
    assert min(lost.values()) > 1e-9


def test_friction_of_guides_and_joints_meets_the_stiffness_of_closed_loops():
    """A machine whose actuators are as stiff as their loops at rest misses as much, without loops."""
    rubs = ["drives.guide_friction=30 N", "damping.hinge_friction=0.2"]
    closed = hexapod("servo.leg 4.integral_time=0.02", *rubs)
    at_rest = [loop.static_stiffness for loop in servo(closed).loops.loops]
    alone = load("hexapod", [*PLATFORM, *rubs, f"stiffness.actuator={at_rest}"])
    assert reversal_errors(closed) == pytest.approx(reversal_errors(alone), rel=1e-9)
    only_guides = load("hexapod", [*PLATFORM, rubs[0], f"stiffness.actuator={at_rest}"])
    flexibility = state_of(only_guides).free.statics.flexibility
    moved = sum(60.0 / k * abs(twist.translational.x) for k, twist in zip(at_rest, flexibility, strict=True))
    assert reversal_errors(only_guides)["x"] == pytest.approx(moved, rel=1e-9)

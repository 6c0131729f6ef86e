"""Servo loops: receptance and poles against the transfer function of platform and drives, written out here."""

import json

import numpy as np
import pytest

import kinetostat
from kinetostat import InputError, load, save, servo
from kinetostat.equilibrium.state import state_of
from kinetostat.vibration.servo import ServoLoop
from kinetostat.views.servo import SERVO, servo_figures

MASS, INERTIA, ROTOR, LEAD = 12.0, (0.3, 0.4, 0.5), 2e-5, 0.01
PLATFORM = ["tool.mass=12 kg", "tool.inertia=[0.3, 0.4, 0.5, 0, 0, 0]", "damping.per_mass=1e-12", "roll=0.1", "x=0.01"]
DRIVE = ["drives.rotor_inertia=2e-5", "drives.lead=0.01", "drives.rotor_damping=0.001"]
GAINS = ["servo.position_gain=50", "servo.velocity_gain=0.05"]
LOOPS = {
    "proportional, at the motor": [],
    "integral, at the motor": ["servo.integral_time=0.02"],
    "integral, at the load": ["servo.integral_time=0.02", "servo.position_at_load=1"],
    "integral, between": ["servo.integral_time=0.02", "servo.position_at_load=0.4"],
}


def hexapod(*more):
    return load("hexapod", [*PLATFORM, *DRIVE, *GAINS, *more])


def drive_stiffness(machine, s):
    """Force of a drive on its joint per motion of the joint, by its two equations: motor and transmission."""
    table, square = machine.tables["servo"], (2.0 * np.pi / LEAD) ** 2
    k = machine.tables["stiffness"].actuator[0]
    gain = table.velocity_gain * square
    gain = gain * (1.0 + 1.0 / (s * table.integral_time)) if table.integral_time else gain
    share = table.position_at_load
    # Unknown are the motor's place and the force, for a joint that moves by one.
    motor = s * s * ROTOR * square + s * 0.001 * square + gain * (table.position_gain * (1.0 - share) + s)
    matrix = np.array([[motor, -1.0], [k, 1.0]])
    return np.linalg.solve(matrix, [-gain * table.position_gain * share, k])[1]


def platform_stiffness(answer, s):
    """s² M + sum of z g g^T at the tool point."""
    response = answer.state.free
    lines = np.array([wrench.components() for wrench in response.transmission.wrenches], dtype=float)
    turn = response.configuration.platform.rotation
    axes = np.array([axis.components() for axis in (turn.x, turn.y, turn.z)], dtype=float).T
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = axes @ np.diag(INERTIA) @ axes.T, MASS * np.eye(3)
    return s * s * mass + drive_stiffness(answer.machine, s) * lines.T @ lines


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


def test_static_stiffness_with_an_integral_part_is_that_of_the_transmission():
    answer = servo(hexapod("servo.integral_time=0.02"))
    np.testing.assert_allclose(answer.static, answer.standing, rtol=1e-9)
    proportional = servo(hexapod())
    loop = proportional.loops.loops[0]
    motor = loop.velocity_gain * loop.position_gain
    assert loop.static_stiffness == pytest.approx(1.0 / (1.0 / motor + 1.0 / loop.transmission))
    share = loop.static_stiffness / loop.transmission
    np.testing.assert_allclose(proportional.static, np.array(proportional.standing) * share, rtol=1e-9)


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

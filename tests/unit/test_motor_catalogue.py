"""Motors of a catalogue: files, limits over speed, and which motors fit a motion, point by point as well."""

import math

import numpy as np
import pytest

from kinetostat import InputError, drives, load, motors, save
from kinetostat.studies.motors import MotorRating, read_catalogue
from kinetostat.views.motors import MOTORS, motors_figure

SETTINGS = [
    "tool.mass=12 kg",
    "tool.inertia=[0.1, 0.1, 0.15, 0, 0, 0]",
    "drives.lead=10 mm",
    "load.gravity=[0, 0, -9.81]",
]
SINE = "field, amplitude, frequency [Hz], phase [deg]\nz, 2 mm, {}, 0\nx, 3 mm, {}, 90\n"
RATINGS = {"torque": 2.0, "peak_torque": 6.0, "rated_speed": 300.0, "greatest_speed": 500.0, "inertia": 1e-4}


@pytest.fixture
def motion(tmp_path):
    path = tmp_path / "motion.csv"
    path.write_text(SINE.format(4, 4))
    return path


def test_every_motor_of_the_catalogue_has_the_power_and_the_source_of_its_data_sheet():
    watts = {"yaskawa-sgmsh-10a": 1000, "yaskawa-sgm7a-15a": 1500, "yaskawa-sgm7d-02k": 52, "yaskawa-sgmp-03b": 300}
    catalogue = read_catalogue()
    assert catalogue.motors.keys() == watts.keys()
    for name, motor in catalogue.motors.items():
        assert motor.torque * motor.rated_speed == pytest.approx(watts[name], rel=0.03)
        assert "Yaskawa" in catalogue.sources["motors", name]


def test_limits_are_constant_then_of_constant_power_then_nothing():
    motor = MotorRating(**RATINGS)
    speeds = np.array([0.0, -300.0, 400.0, 500.0, 500.1])
    np.testing.assert_allclose(motor.limit(False, speeds), [2.0, 2.0, 1.5, 1.2, 0.0])
    np.testing.assert_allclose(motor.limit(True, speeds), [6.0, 6.0, 4.5, 3.6, 0.0])


def test_a_fit_is_what_drives_says_with_the_rotor_of_the_motor(motion):
    answer = motors(load("hexapod", SETTINGS), motion)
    fit = next(fit for fit in answer.fits if fit.name == "yaskawa-sgmsh-10a")
    alone = drives(load("hexapod", [*SETTINGS, "drives.rotor_inertia=1.74e-4"]), motion)
    torque, speed = np.abs(alone.curves.motor_torque), np.abs(alone.curves.motor_speed)
    limit = np.where(speed <= 100.0 * math.pi, 9.54, 9.54 * 100.0 * math.pi / np.maximum(speed, 1.0))
    assert fit.peak == pytest.approx((torque / limit).max(), rel=1e-9)
    assert fit.continuous == pytest.approx(max(drive.rms_torque for drive in alone.drives) / 3.18, rel=1e-9)
    assert fit.speed == pytest.approx(speed.max() / (5000.0 * math.pi / 30.0), rel=1e-9)
    assert answer.fits[0].fits
    assert not answer.fits[-1].fits


def test_a_gear_or_a_screw_of_the_catalogue_takes_the_place_of_the_file(motion, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        '[motors.small]\ntorque = "2 N*m"\npeak_torque = "6 N*m"\nrated_speed = "3000 turn/min"\n'
        'greatest_speed = "5000 turn/min"\ninertia = "1e-4 kg*m**2"\n[screws.steep]\nlead = "20 mm"\nefficiency = 0.9\n'
        'inertia = "2e-5 kg*m**2"\n'
    )
    machine = load("hexapod", SETTINGS)
    (fit,) = motors(machine, motion, path, screw="steep").fits
    more = ["drives.lead=20 mm", "drives.efficiency=0.9", "drives.rotor_inertia=1.2e-4"]
    alone = drives(load("hexapod", [*SETTINGS, *more]), motion)
    np.testing.assert_allclose(fit.loads.curves.motor_torque, alone.curves.motor_torque, rtol=1e-12)
    with pytest.raises(InputError, match="steep"):
        motors(machine, motion, path, screw="step")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[motor.a]\ntorque = 1\n", "motor"),
        ("[motors.a]\ntorque = 1\n", "lacks peak_torque"),
        ('[motors.a]\ntorque = "1 N"\n', "a.torque"),
        ("[motors.a]\ntork = 1\n", "tork"),
        ("motors = 3\n", "not a table"),
        ("[motors]\na = 3\n", "not a table"),
        ("[gears.a]\nratio = 3\n", "no motors"),
    ],
)
def test_mistakes_in_a_catalogue_name_the_entry(text, said, motion, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        motors(load("hexapod", SETTINGS), motion, path)


def test_a_drive_of_which_nothing_says_how_far_its_motor_turns_is_refused(motion):
    with pytest.raises(InputError, match="how far"):
        motors(load("hexapod", [text for text in SETTINGS if "lead" not in text]), motion)


def test_the_answer_describes_itself(motion, tmp_path):
    answer = motors(load("hexapod", SETTINGS), motion)
    lines = dict(MOTORS.sentences(answer))
    assert "fits: the motion uses" in lines["Motors"]
    assert "Yaskawa" in lines["Source"]
    save(answer, tmp_path / "motors.json")
    save(answer, tmp_path / "motors.csv")
    assert len((tmp_path / "motors.csv").read_text().splitlines()) == 5
    assert len(motors_figure(answer).axes) == 4

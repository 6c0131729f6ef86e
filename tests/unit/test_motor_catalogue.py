"""Motors of a catalogue: files, limits over speed, and which motors fit a motion, point by point as well."""

import math

import numpy as np
import pytest

from kinetostat import InputError, build, bundled, drives, load, motors, requirements, save
from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE, NO_ANSWER
from kinetostat.machine.loading import as_toml
from kinetostat.studies.motors import MotorRating, read_catalogue, with_transmission
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


def test_gears_pass_on_the_torque_that_their_data_sheet_prints_behind_them():
    """Rated torque of the motor, and of the gear's output, N·m: two numbers of the sheet that are not in the file."""
    printed = {
        "yaskawa-sgmah-01aj1": (0.318, 1.27),
        "yaskawa-sgmah-02aj1": (0.637, 2.55),
        "yaskawa-sgmah-01aj7": (0.318, 8.40),
    }
    catalogue = read_catalogue()
    assert catalogue.gears.keys() == printed.keys()
    for name, (before, behind) in printed.items():
        gear = catalogue.gears[name]
        assert before * gear.ratio * gear.efficiency == pytest.approx(behind, rel=2e-3)
        assert "p. 3-7" in catalogue.sources["gears", name]


def test_shafts_of_screws_turn_as_solid_steel_of_their_diameter_unless_the_file_says_more(tmp_path):
    """A cylinder of the mass m and the radius r has the inertia m r²/2; a number per length is taken as it is."""
    catalogue = read_catalogue()
    for name, screw in catalogue.screws.items():
        diameter, lead = (1e-3 * float(size) for size in name.removeprefix("ball-").split("x"))
        mass = 7850.0 * np.pi * (0.5 * diameter) ** 2 * 0.3
        assert (screw.lead, screw.length) == pytest.approx((lead, 0.3))
        assert screw.total_inertia == pytest.approx(0.5 * mass * (0.5 * diameter) ** 2)
        assert "steel" in catalogue.sources["screws", name]
    path = tmp_path / "mine.toml"
    path.write_text(
        '[screws.mine]\nlead = "5 mm"\nshaft = "1.2e-3 kg*cm**2/mm"\ndiameter = "20 mm"\nlength = "300 mm"\n'
        'inertia = "1e-6 kg*m**2"\n'
    )
    _, beside = with_transmission(load("hexapod"), read_catalogue(path), "", "mine")
    assert beside == pytest.approx(1.2e-3 * 1e-4 * 300.0 + 1e-6)


def test_limits_are_constant_then_of_constant_power_then_nothing():
    motor = MotorRating(**RATINGS)
    speeds = np.array([0.0, -300.0, 400.0, 500.0, 500.1])
    np.testing.assert_allclose(motor.limit(False, speeds), [2.0, 2.0, 1.5, 1.2, 0.0])
    np.testing.assert_allclose(motor.limit(True, speeds), [6.0, 6.0, 4.5, 3.6, 0.0])


def test_a_fit_is_what_drives_says_with_the_rotor_of_the_motor(motion):
    answer = motors(load("hexapod", SETTINGS), motion)
    fit = next(fit for fit in answer.candidates if fit.name == "yaskawa-sgmsh-10a")
    alone = drives(load("hexapod", [*SETTINGS, "drives.rotor_inertia=1.74e-4"]), motion)
    torque, speed = np.abs(alone.curves.motor_torque), np.abs(alone.curves.motor_speed)
    limit = np.where(speed <= 100.0 * math.pi, 9.54, 9.54 * 100.0 * math.pi / np.maximum(speed, 1.0))
    assert fit.peak == pytest.approx((torque / limit).max(), rel=1e-9)
    assert fit.continuous == pytest.approx(max(drive.rms_torque for drive in alone.drives) / 3.18, rel=1e-9)
    assert fit.speed == pytest.approx(speed.max() / (5000.0 * math.pi / 30.0), rel=1e-9)
    assert answer.candidates[0].suffices
    assert not answer.candidates[-1].suffices


def test_of_motors_that_do_not_fit_the_nearest_comes_first(motion):
    """Those that are too fast have no torque left, and so no finite share of it."""
    machine = load("hexapod", [*SETTINGS, "drives.lead=0.5 mm"])
    answer = motors(machine, motion)
    missed = [fit for fit in answer.candidates if not fit.suffices]
    assert len(missed) > 2
    assert sum(math.isinf(fit.greatest_share) for fit in missed) > 1
    assert [fit.hardest[1] for fit in missed] == sorted(fit.hardest[1] for fit in missed)


def test_a_gear_or_a_screw_of_the_catalogue_takes_the_place_of_the_file(motion, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        '[motors.small]\ntorque = "2 N*m"\npeak_torque = "6 N*m"\nrated_speed = "3000 turn/min"\n'
        'greatest_speed = "5000 turn/min"\ninertia = "1e-4 kg*m**2"\n[screws.steep]\nlead = "20 mm"\nefficiency = 0.9\n'
        'inertia = "2e-5 kg*m**2"\n'
    )
    machine = load("hexapod", SETTINGS)
    (fit,) = motors(machine, motion, path, screw="steep").candidates
    more = ["drives.lead=20 mm", "drives.efficiency=0.9", "drives.rotor_inertia=1.2e-4"]
    alone = drives(load("hexapod", [*SETTINGS, *more]), motion)
    np.testing.assert_allclose(fit.loads.curves.motor_torque, alone.curves.motor_torque, rtol=1e-12)
    with pytest.raises(InputError, match="steep"):
        motors(machine, motion, path, screw="step")


GEAR_AND_SCREW = (
    "[gears.planetary]\nratio = 10\nefficiency = 0.5\ninertia = 1e-5\n"
    "[screws.steep]\nlead = 0.02\nefficiency = 0.9\ninertia = 2e-5\n"
)


@pytest.mark.parametrize(
    ("name", "gear", "screw", "said"),
    [
        ("hexapod", "planetary", "steep", "choose one"),
        ("hexapod", "planetary", "", "leg 1 actuator of .* is linear"),
        ("delta", "", "steep", "is rotary"),
    ],
)
def test_a_transmission_is_of_the_kind_of_the_drives(name, gear, screw, said, tmp_path):
    """The efficiency and the inertia of one that moves no drive would count nonetheless."""
    path = tmp_path / "mine.toml"
    path.write_text(GEAR_AND_SCREW)
    with pytest.raises(InputError, match=said):
        with_transmission(load(name), read_catalogue(path), gear, screw)


def test_a_gear_goes_before_rotary_drives(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(GEAR_AND_SCREW)
    geared, inertia = with_transmission(load("delta"), read_catalogue(path), "planetary", "")
    assert (geared.tables["drives"].ratio, geared.tables["drives"].efficiency, inertia) == (10.0, 0.5, 1e-5)


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


def required(folder, parts, name="mine.toml"):
    """The path of a machine file with settings and a requirement beside its motion."""
    text = as_toml(load("hexapod", SETTINGS)) + f"[requirements]\nservo = {{ {parts} }}\n"
    (folder / name).write_text(text, "utf-8")
    return str(folder / name)


def test_a_file_requires_that_a_motor_fits_its_motion(motion, tmp_path, capsys):
    paths = [required(tmp_path, f'fits = "{name}", motion = "motion.csv"') for name in ("yaskawa-sgm7d-02k",)]
    (slow,) = requirements(load(paths[0]))
    fits = {fit.name: fit for fit in motors(load("hexapod", SETTINGS), motion).candidates}
    assert (slow.met, slow.worst, slow.poses) == (False, fits["yaskawa-sgm7d-02k"].greatest_share, 401)
    machine = load(required(tmp_path, 'fits = "yaskawa-sgmp-03b", motion = "motion.csv"', "good.toml"))
    (good,) = requirements(machine)
    fit = fits["yaskawa-sgmp-03b"]
    assert (good.met, good.worst) == (fit.suffices, fit.greatest_share) == (True, pytest.approx(1.0 - good.margin))
    assert f"the motion uses {100.0 * fit.hardest[1]:.0f} % of its {fit.hardest[0]}" in good.sentence(machine.display)
    there = machine.with_values(good.worst_pose)
    assert there.tables["pose"] != machine.tables["pose"]
    motion.unlink()  # the machine has its lines
    assert requirements(machine) == (good,) == requirements(build(as_toml(machine)))
    with pytest.raises(InputError, match=r"servo\.motion: .*cannot be read"):
        load(paths[0])


@pytest.mark.reports
def test_every_command_about_drives_judges_it_and_takes_its_motion(motion, tmp_path, capsys):
    for name, code in (("yaskawa-sgmp-03b", DONE), ("yaskawa-sgm7d-02k", NO_ANSWER)):
        path = required(tmp_path, f'fits = "{name}", motion = "motion.csv"')
        for command in ("analyze", "check", "drives", "motors"):
            assert main([command, path]) == code
            met = "The requirement is met." if code == DONE else "The requirement is not met."
            assert met in capsys.readouterr().out
    alone = drives(load("hexapod", SETTINGS), motion)
    np.testing.assert_array_equal(drives(load(path)).curves.motor_torque, alone.curves.motor_torque)
    assert main(["motors", "hexapod"]) == BAD_INPUT
    assert "no motion is given" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ('fits = "yaskawa-sgmp-03b"', r"servo\.motion is wrong"),
        ('fits = "sgmp", motion = "motion.csv"', "fits is .*did you mean|fits is .*choose from"),
        ('fits = "yaskawa-sgmp-03b", motion = "../motion.csv"', "folder of the machine file"),
        ('fits = "yaskawa-sgmp-03b", motion = "/motion.csv"', "folder of the machine file"),
        ('fits = "yaskawa-sgmp-03b", motion = "motion.csv", over = ["x=0:1:2"]', r"servo\.over is wrong"),
        ('fits = "yaskawa-sgmp-03b", motion = "motion.csv", screw = "steep"', "the screw of the catalogue"),
        ('fits = "a", motion = "motion.csv", catalogue = "[motors.a]\\ntorque = 1"', "lacks peak_torque"),
    ],
)
def test_a_mistake_in_a_required_motor_names_it(parts, said, motion, tmp_path):
    with pytest.raises(InputError, match=said):
        requirements(load(required(tmp_path, parts)))


def test_a_machine_of_a_text_has_no_folder_of_motions():
    text = bundled()["hexapod"] + '[requirements]\nservo = { fits = "yaskawa-sgmp-03b", motion = "motion.csv" }\n'
    with pytest.raises(InputError, match="write the lines of the file"):
        requirements(build(text, settings=SETTINGS))

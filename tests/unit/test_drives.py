"""Drives along a motion: by hand where a hexapod moves upright, and what holds of every answer."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kinetostat.display import number
from kinetostat.engine.moving import PosePath
from kinetostat.kinematics.status import Status
from kinetostat.machine.loading import build, load
from kinetostat.motion.forces import PARTS
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import analyze
from kinetostat.studies.drives import drives
from kinetostat.studies.motion_deflection import swings_under
from kinetostat.studies.motions import Motion
from kinetostat.studies.report import REPORT_PARTS, gather
from kinetostat.views.data_forms import json_of
from kinetostat.views.drives import DRIVES, over_time_figure, speed_torque_figure
from kinetostat.views.report.writing import ReportOptions

UP = "field, amplitude, frequency [Hz]\nz, 3 mm, 8\n"
MOVES = "feed [mm/s], acceleration [m/s**2], x [mm], roll [deg]\n300, 5, 0, 0\n300, 5, 15, 2\n300, 5, 0, 0\n"
MASS = ("tool.mass=12 kg", "load.gravity=[0, 0, -9.81]")
MOTORS = ("drives.lead=10 mm", "drives.rotor_inertia=5e-5", "drives.rotor_friction=0.05 N*m", "drives.efficiency=0.8")


def answer_of(folder, text, *settings, name="hexapod"):
    (folder / "motion.csv").write_text(text, "utf-8")
    return drives(load(name, [*settings]), folder / "motion.csv")


def test_six_legs_lift_a_platform_as_by_hand(tmp_path):
    """Upright, legs of the slope c each carry m (g + z'') / (6 c)."""
    answer = answer_of(tmp_path, UP, *MASS)
    path, curves = answer.motion.path, answer.curves
    machine = load("hexapod")
    legs = machine.configure().legs
    flat = [np.hypot(*(leg.path[-1] - leg.path[0]).components()[:2]) for leg in legs]
    for k, across in enumerate(flat):
        slope = np.sqrt(1.0 - (across / curves.coordinate[k]) ** 2)
        expected = 12.0 * (9.81 + path.accelerations["z"]) / (6.0 * slope)
        assert curves.force[k] == pytest.approx(expected, rel=1e-11)
        assert curves.speed[k] == pytest.approx(path.rates["z"] * slope, abs=1e-12)


def test_motors_without_losses_get_all_energy_back(tmp_path):
    """And with a screw that loses a fifth either way, they give more at every moment."""
    ideal, real = (answer_of(tmp_path, MOVES, *MASS, *MOTORS[:2], *more) for more in ((), MOTORS[3:]))
    whole, moved = ideal.curves.net_energy[:, -1].sum(), np.abs(ideal.curves.net_energy).max()
    assert abs(whole) < 1e-4 * moved
    assert (real.curves.power - ideal.curves.power).min() > -1e-12 * np.abs(ideal.curves.power).max()
    assert real.curves.net_energy[:, -1].sum() > 0.1 * moved


def test_net_energy_is_what_motors_give_less_what_they_take_back(tmp_path):
    """In the file, in the table and in the sentence; from the power, which changes evenly between two points."""
    answer = answer_of(tmp_path, MOVES, *MASS, *MOTORS)
    work = 0.5 * (answer.curves.power[:, 1:] + answer.curves.power[:, :-1]) * np.diff(answer.motion.times)
    given, back = np.maximum(work, 0.0).sum(axis=1), -np.minimum(work, 0.0).sum(axis=1)
    written = json_of(DRIVES, answer)
    assert [drive["net_energy"] for drive in written["drives"]] == pytest.approx(given - back, rel=1e-10)
    assert [drive["braking_energy"] for drive in written["drives"]] == pytest.approx(back, rel=1e-10)
    assert back.min() > 0.0
    amounts = (number(part.sum()) for part in (given, back, given - back))
    sentence = "All motors together give {} J, and take back {} J while they brake: {} J net."
    assert dict(DRIVES.lines(answer))["Energy"] == sentence.format(*amounts)
    _, motors, *_ = DRIVES.tables(answer, False)
    (column,) = (column for column in motors.columns if column.header == "net energy")
    assert list(column.cells) == [f"{number(amount)} J" for amount in given - back]


def test_a_motor_feels_its_drive_through_the_screw(tmp_path):
    plain = answer_of(tmp_path, MOVES, *MASS)
    geared = answer_of(tmp_path, MOVES, *MASS, *MOTORS)
    turns = 2.0 * np.pi / 0.01
    rotor = 5e-5 * geared.curves.acceleration * turns + 0.05 * np.sign(geared.curves.speed)
    load_ = plain.curves.force / turns
    loss = np.where(load_ * geared.curves.speed > 0.0, 1.0 / 0.8, 0.8)
    size = np.abs(geared.curves.motor_torque).max()
    assert geared.curves.motor_torque == pytest.approx(rotor + load_ * loss, abs=1e-11 * size)
    assert geared.drives[0].inertia_ratio == pytest.approx(plain.drives[0].reflected / turns**2 / 5e-5, rel=1e-9)
    assert plain.drives[0].inertia_ratio is None


@pytest.mark.parametrize(
    ("lead", "linear"), [((), True), (("drives.lead=10 mm",), False), (("drives.lead=6.283185307179586 m",), False)]
)
def test_motors_count_as_linear_only_where_the_file_gives_no_lead(tmp_path, lead, linear):
    """A lead of 2 pi m turns the rotor by 1 rad in 1 m, as a linear motor has it by convention."""
    answer = answer_of(tmp_path, UP, *MASS, *lead)
    assert any("gives no lead" in sentence for _, sentence in DRIVES.sentences(answer)) is linear


def test_friction_of_a_guide_loads_the_screw_and_bends_what_holds_the_tool(tmp_path):
    """That of the rotor does neither: it acts before the screw, and behind the spring of the drive."""
    quiet, plain, rubbing = (
        answer_of(tmp_path, MOVES, *MASS, *more)
        for more in ((), MOTORS, (*MOTORS, "drives.guide_friction=30 N", "drives.leg 2.guide_friction=0 N"))
    )
    rubs = np.array([30.0, 0.0, 30.0, 30.0, 30.0, 30.0])[:, None] * np.sign(plain.curves.speed)
    assert rubbing.curves.force == pytest.approx(plain.curves.force + rubs, abs=1e-9)
    passed = (quiet.curves.force + rubs) * 0.01 / (2.0 * np.pi)
    rotor = plain.curves.motor_torque - (load_ := quiet.curves.force * 0.01 / (2.0 * np.pi)) * loss(load_, plain)
    assert rubbing.curves.motor_torque == pytest.approx(rotor + passed * loss(passed, plain), abs=1e-9)
    assert plain.deflection == pytest.approx(quiet.deflection, abs=1e-15)
    flexibility = analyze(load("hexapod", [*MASS])).state.free.statics.flexibility
    moved = np.array([twist.components() for twist in flexibility], dtype=float)
    start = slice(1, 4)  # the pose has hardly changed yet, so that C is that of the file's pose
    bent = rubs.T[start] / 2e7 @ moved
    assert rubbing.deflection[start] - plain.deflection[start] == pytest.approx(-bent, rel=1e-2, abs=1e-8)


def loss(passed, answer):
    return np.where(passed * answer.curves.speed > 0.0, 1.0 / 0.8, 0.8)


def test_parts_add_up_and_say_what_is_greatest(tmp_path):
    answer = answer_of(tmp_path, MOVES, *MASS, *MOTORS, "load.force=[5, 0, -20]")
    assert answer.curves.parts.sum(axis=1) == pytest.approx(answer.curves.force)
    for k, drive in enumerate(answer.drives):
        assert drive.force == pytest.approx(np.abs(answer.curves.force[k]).max())
        assert drive.rms_force <= drive.force
        assert drive.power[0] >= 0.0 >= drive.power[1]
    point, name = answer.worst
    row = answer.curves.force[[drive.name for drive in answer.drives].index(name)]
    assert abs(row[point]) == pytest.approx(np.abs(row).max())


def test_joints_of_struts_pass_on_what_their_drives_do(tmp_path):
    answer = answer_of(tmp_path, UP, *MASS)
    forces = {joint.name: joint.force for joint in answer.joints}
    for drive in answer.drives:
        leg = drive.name.removesuffix(" actuator")
        assert forces[f"{leg} base joint"] == pytest.approx(drive.force)
        assert forces[f"{leg} platform joint"] == pytest.approx(drive.force)


def test_the_tool_deflects_as_under_the_same_wrench(tmp_path):
    answer = answer_of(tmp_path, UP, *MASS)
    middle = int(np.argmin(np.abs(answer.motion.path.accelerations["z"][:-1])))
    compliance = np.array(analyze(load("hexapod", [*MASS])).compliance)
    wrench = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -12.0 * 9.81])
    assert answer.motion.path.pose["z"][middle] == pytest.approx(0.135)
    assert answer.deflection[middle] == pytest.approx(compliance @ wrench, abs=1e-12)


STAGE = """
schema = 1
name   = "Stage"
family = "legs"
[platform]
point = [0, 0, 0]
[pose]
x = 0
[tool]
mass = "2 kg"
[damping]
ratio = {}
[[legs]]
name = "drive"
joints = [{{ name = "slide", type = "prismatic", joins = ["base", "platform"], point = [0, 0, 0], axis = [1, 0, 0], stiffness = "2e5 N/m", actuated = true }}]
"""  # noqa: E501


@pytest.mark.parametrize("ratio", [0.03, 1.0, 2.5])
@pytest.mark.parametrize("share", [0.02, 0.4, 0.97])
def test_a_shaken_stage_swings_as_the_formula_says(tmp_path, share, ratio):
    """A spring whose foot moves as X sin(w t) stretches by X r² / sqrt((1 - r²)² + (2 zeta r)²), r = w / w_0."""
    lowest = np.sqrt(2e5 / 2.0) / (2.0 * np.pi)
    (tmp_path / "motion.csv").write_text(f"field, amplitude, frequency [Hz]\nx, 2 mm, {share * lowest}\n", "utf-8")
    answer = drives(build(STAGE.format(ratio)), tmp_path / "motion.csv")
    assert answer.along_modes.frequency == pytest.approx(lowest)
    stretched = 2e-3 * share**2 / np.hypot(1.0 - share**2, 2.0 * ratio * share)
    if answer.along_modes.modes:
        # The motion has 400 points, and its loads are taken for straight between them.
        assert answer.greatest_with_modes[0] == pytest.approx(stretched, rel=5e-5)
    else:
        assert (share, ratio) == (0.02, 0.03)
    assert answer.greatest_deflection[0] == pytest.approx(2e-3 * share**2, rel=1e-9)


def test_a_swing_under_loads_between_times_is_exact():
    """Against a fine solver of differential equations, for loads that change evenly between the times."""
    times, rng = np.linspace(0.0, 2.0, 21), np.random.default_rng(3)
    loads, rates, ratios = rng.normal(size=(3, 21)), np.array([3.0, 20.0, 5.0]), np.array([0.02, 0.3, 1.7])
    amounts, ends = swings_under(loads, rates, ratios, times[1], loads[:, 0])
    for load_, rate, ratio, amount, end in zip(loads, rates, ratios, amounts, ends, strict=True):

        def pull(t, y, load_=load_, rate=rate, ratio=ratio):
            return [y[1], rate**2 * (np.interp(t, times, load_) - y[0]) - 2.0 * ratio * rate * y[1]]

        state, known = [load_[0], 0.0], [load_[0]]
        for first, last in pairwise(times):
            state = solve_ivp(pull, (first, last), state, rtol=1e-11, atol=1e-13).y[:, -1]
            known.append(state[0])
        assert amount == pytest.approx(known, abs=1e-8)
        assert end == pytest.approx(state[1], abs=1e-7)


def test_after_a_move_the_stage_swings_on(tmp_path):
    """Accelerations a and -a for a time t each: jumps by a, -2 a and a, of which each excites a swing of a / w².

    With t a period of the stage they cancel; with t half of it they add up to four times that.
    """
    rate, acceleration = np.sqrt(2e5 / 2.0), 5.0
    period = 2.0 * np.pi / rate
    left = []
    for phase in (period, 0.5 * period):
        head, ends = "feed [m/s], acceleration [m/s**2], x [m]", (0.0, acceleration * phase**2)
        text = "\n".join([head, *(f"9, {acceleration}, {end}" for end in ends)])
        (tmp_path / "motion.csv").write_text(text, "utf-8")
        left.append(drives(build(STAGE.format(1e-9)), tmp_path / "motion.csv").along_modes.after)
    assert left[0] < 1e-3 * left[1]
    assert left[1] == pytest.approx(4.0 * acceleration / rate**2, rel=1e-3)


def test_no_direction_asks_for_more_than_the_worst_ones():
    """Of drives without speed, whose forces are linear in the acceleration, and with it, up to what bends the path."""
    machine = load("hexapod", [*MASS, *MOTORS, "linear_density.legs=3 kg/m"])
    rng = np.random.default_rng(2)
    for speed, share in ((1e-9, 1.0), (0.5, 0.98)):
        worst = drives(machine, speed=speed, acceleration="5 m/s**2")
        names = ("x", "y", "z")
        ways = rng.normal(size=(2, 3000, 3))
        rates, gains = (row / np.linalg.norm(row, axis=1)[:, None] for row in ways)
        pose = {
            n: np.full(3000, v) for n, v in zip((*names, "roll", "pitch", "yaw"), (0, 0, 0.135, 0, 0, 0), strict=True)
        }
        parts = [
            {n: part[:, names.index(n)] if n in names else np.zeros(3000) for n in pose}
            for part in (rates * speed, gains * 5.0)
        ]
        random = drives(machine, Motion("random", np.zeros(3000), PosePath(pose, *parts), timeless=True))
        for first, second in zip(worst.drives, random.drives, strict=True):
            assert share * second.force <= first.force * (1.0 + 1e-9)
            assert first.force < 1.03 * second.force
            assert first.speed >= second.speed


def test_the_diagram_of_all_directions_bounds_what_they_ask_of_a_motor():
    answer = drives(load("hexapod", [*MASS, *MOTORS]), speed="0.5 m/s", acceleration="5 m/s**2")
    speed, torque = np.abs(answer.curves.motor_speed[0]) * 30.0 / np.pi, np.abs(answer.curves.motor_torque[0])
    (panel,) = speed_torque_figure(answer).axes
    x, y = panel.lines[0].get_data()
    assert (torque <= np.interp(speed * (1.0 - 1e-12), x[::-1], y[::-1]) * (1.0 + 1e-9)).all()
    assert (x[0], y[-1]) == pytest.approx((speed.max(), torque.max()))


def test_the_diagram_of_a_motion_marks_peak_and_mean_squares(tmp_path):
    answer = answer_of(tmp_path, MOVES, *MASS, *MOTORS)
    (panel,) = speed_torque_figure(answer).axes
    _, peak, mean, *_ = panel.lines
    assert peak.get_ydata() == pytest.approx([answer.drives[0].motor_torque])
    assert mean.get_ydata() == pytest.approx([answer.drives[0].rms_torque])


def test_marks_are_explained_also_where_drives_are_too_many_to_be_named(tmp_path):
    answer = answer_of(tmp_path, MOVES, *MASS, *MOTORS)
    doubled = {name: np.concatenate([rows, rows]) for name, rows in vars(answer.curves).items()}
    many = replace(answer, drives=answer.drives * 2, curves=replace(answer.curves, **doubled))
    texts = [
        [text.get_text() for legend in figure.legends for text in (legend.get_title(), *legend.get_texts())]
        for figure in (speed_torque_figure(answer), speed_torque_figure(many), over_time_figure(many))
    ]
    marks = "\N{MULTIPLICATION SIGN} peak\n\N{BLACK CIRCLE} RMS"
    assert texts == [[marks, *(drive.name for drive in answer.drives)], [marks], []]


def test_without_a_motion_both_limits_are_needed():
    machine = load("hexapod", [*MASS])
    with pytest.raises(InputError, match="acceleration is not given"):
        drives(machine, speed="0.5 m/s")
    with pytest.raises(InputError, match="speed is"):
        drives(machine, speed="0.5 kg", acceleration=1.0)


def test_a_motion_out_of_reach_has_a_sentence(tmp_path):
    answer = answer_of(tmp_path, UP.replace("3 mm", "3 m"), *MASS, name="hexapod-rus")
    assert not answer.drives
    assert "cannot be followed" in answer.message
    assert json_of(DRIVES, answer)["drives"] == []


def test_a_motion_beyond_a_limit_has_an_answer_that_says_so(tmp_path):
    answer = answer_of(tmp_path, UP, *MASS, "limits.longest_leg=96 mm")
    assert answer.drives
    assert "a limit of the file" in answer.message


def test_a_machine_without_a_mass_is_refused(tmp_path):
    with pytest.raises(InputError, match="mass, friction or a load"):
        answer_of(tmp_path, UP)


def test_a_report_asks_for_the_motion_that_it_is_given(tmp_path):
    (tmp_path / "motion.csv").write_text(MOVES, "utf-8")
    machine = load("hexapod", MASS)
    asked = gather(machine, without=REPORT_PARTS, motion=tmp_path / "motion.csv").of("drives")
    assert json_of(DRIVES, asked) == json_of(DRIVES, drives(machine, tmp_path / "motion.csv"))
    assert gather(machine, without=REPORT_PARTS).of("drives") is None
    assert ReportOptions(motion="motion.csv").words() == ["--motion", "motion.csv"]


def test_a_limit_does_not_hide_that_the_machine_is_singular(tmp_path):
    """The first leg of the Tripteron is folded at x = y = 0: no force of its drives moves the tool there."""
    rows = "time [s],x [mm],y [mm],z [mm]\n0,0,0,500\n1,20,0,500\n"
    answer = answer_of(tmp_path, rows, *MASS, "limits.travel_from=-1 cm", name="tripteron")
    assert not answer.drives
    assert answer.status is Status.SINGULAR
    assert "cannot be followed" in answer.message


def test_a_drive_that_stands_has_no_friction(tmp_path):
    """At both ends of a move with limited jerk, speeds of drives are round-off."""
    rows = (
        "feed [mm/s], acceleration [m/s**2], jerk [m/s**3], x [mm], roll [deg]\n300, 5, 100, 0, 0\n300, 5, 100, 15, 2\n"
    )
    answer = answer_of(tmp_path, rows, *MASS, "drives.guide_friction=7 N")
    friction = answer.curves.parts[:, PARTS.index("friction")]
    assert (friction[:, [0, -1]] == 0.0).all()
    assert np.abs(friction).max(axis=1) == pytest.approx(7.0)

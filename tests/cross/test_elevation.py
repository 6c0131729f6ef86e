"""A telescope over its elevation against the same questions asked at each elevation by itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinetostat import budget, build, command, elevation, load, under_load
from kinetostat.accuracy.model import error_model
from kinetostat.cli import main
from kinetostat.engine.machine_functions import functions_of
from kinetostat.spec.errors import InputError
from kinetostat.studies.elevation import _overall_status, _reversals
from kinetostat.studies.vibration import modes
from kinetostat.views.elevation import elevation_csv

TELESCOPE = str(Path(__file__).parents[1] / "cases" / "telescope-weight.toml")


@pytest.fixture(scope="module")
def telescope():
    return load(TELESCOPE)


@pytest.fixture(scope="module")
def over_elevation(telescope):
    return elevation(telescope)


def at_elevation(machine, degrees):
    """The machine as it is asked by itself, gravity turned by the opposite angle."""
    return replace(machine.with_values({"load.gravity_angle": np.radians(90.0 - degrees)}), loaded=True)


def drive_loads(machine):
    """What each drive carries at rest, N, positive where it pulls."""
    return np.array(
        [spring.load for spring in under_load(machine).springs if spring.actuated and "screw" in spring.name]
    )


@pytest.mark.parametrize("place", [0, 2, 6])
def test_sag_forces_and_frequency_are_those_of_each_state(telescope, over_elevation, place):
    there = at_elevation(telescope, 15.0 * place)
    state = under_load(there)
    assert over_elevation.elevations[place] == pytest.approx(np.radians(15.0 * place))
    assert over_elevation.displacement[place] == pytest.approx(np.array(state.displacement), rel=1e-6, abs=1e-11)
    assert over_elevation.loads[place] == pytest.approx(drive_loads(there), rel=1e-6, abs=1e-3)
    assert over_elevation.frequency[place] == pytest.approx(modes(there).modes[0].frequency, rel=1e-6)
    assert over_elevation.limit_use[place] == pytest.approx(np.abs(drive_loads(there)).max() / 40e3, rel=1e-6)


def test_corrections_and_errors_are_those_of_each_elevation(telescope, over_elevation):
    there = at_elevation(telescope, 30.0)
    assert over_elevation.corrections.command.corrections[2] == pytest.approx(command(there).corrections[0], abs=1e-10)
    alone = budget(there, samples=4096)
    assert over_elevation.error[2] == pytest.approx(alone.size("usual", "position")[0], rel=0.02)  # drawn machines
    for statistic, difference in (("mean", 1e-9), ("rms", 1e-9), ("worst", 0.01)):
        together = over_elevation.budget.size(statistic, "position")[2]
        assert together == pytest.approx(alone.size(statistic, "position")[0], rel=difference)


def test_loads_reverse_where_the_drives_at_rest_pass_zero(telescope, over_elevation):
    legs = {reversal.leg: reversal for reversal in over_elevation.reversals}
    assert list(legs) == ["leg 2", "leg 4", "leg 3"]
    for leg, reversal in legs.items():
        number, width = int(leg[-1]) - 1, 0.05
        below, above = (drive_loads(at_elevation(telescope, np.degrees(reversal.elevation) + side))[number]
                        for side in (-width, width))  # fmt: skip
        assert below * above < 0.0
        assert reversal.parts == ("drive", "lower u", "upper")


def test_more_elevations_hide_no_reversal(telescope, over_elevation, monkeypatch):
    """A reaction is compared with the load at an elevation, not with the sum of the loads at all of them."""
    monkeypatch.setattr("kinetostat.studies.elevation.NO_REACTION", 1e-2)
    parts = [(reversal.leg, reversal.parts) for reversal in over_elevation.reversals]
    angles = np.radians(np.linspace(90.0, 0.0, 901))
    model = error_model(replace(telescope, loaded=True), {"load.gravity_angle": angles}, len(angles))
    reversals = _reversals(model, angles, telescope)
    assert [(reversal.leg, reversal.parts) for reversal in reversals] == parts


@pytest.mark.parametrize(
    ("statuses", "overall"), [([0, 0], "ok"), ([0, 2], "joint_limit"), ([2, 0, 5, 3], "no_rest"), ([1], "out_of_reach")]
)
def test_an_elevation_without_a_result_counts_before_one_beyond_a_limit(statuses, overall):
    assert _overall_status(np.array(statuses)).word == overall


def test_a_reversal_moves_the_tool_by_both_clearances(telescope, over_elevation):
    """Both joints of a leg cross 10 um along it, as if the drive were 20 um longer."""
    reversal, longer = over_elevation.reversals[0], 20e-6
    model = error_model(telescope, {}, 1)
    place = next(i for i, error in enumerate(model.errors) if error.path == f"legs.{reversal.leg}.drive.zero")
    motion = model.rates()[0, :, place] * longer
    assert reversal.jump == pytest.approx(np.linalg.norm(motion[3:]), rel=1e-9)
    assert reversal.turn == pytest.approx(np.linalg.norm(motion[:3]), rel=1e-9)


def test_backlash_counts_and_nothing_is_said_without_gaps(telescope):
    silent = replace(telescope, tolerances={})
    assert [each.jump for each in elevation(silent).reversals] == [None] * 3
    loose = silent.with_values({"drives.backlash": 20e-6})
    assert elevation(loose).reversals[0].jump == pytest.approx(elevation(telescope).reversals[0].jump, rel=1e-9)


def test_a_force_that_does_not_turn_moves_the_reversals(telescope):
    """A steady pull that is greater than any push leaves no reversal."""
    pulled = telescope.with_values({"load.force.2": -200e3})
    assert elevation(pulled).reversals == ()


def test_limits_and_requirements_are_judged_at_their_worst_elevation(telescope):
    answer = elevation(telescope.with_values({"limits.actuator_force": 17e3}))
    assert answer.limit_use.max() == pytest.approx(17393.0 / 17e3, rel=1e-3)
    assert "30 deg" in answer.message
    assert answer.status.word == "joint_limit"


def test_requirements_are_judged_at_their_worst_elevation():
    demand = '[requirements]\nsag = { demand = ["displacement_y <= 100 um", "displacement_rx <= 300 urad", '
    demand += '"loaded_frequency_1 >= 20 Hz"] }\n\n[tolerances]'
    text = Path(TELESCOPE).read_text().replace("[tolerances]", demand)
    verdicts = elevation(build(text)).requirements
    assert [verdict.met for verdict in verdicts] == [False, True, True]
    assert verdicts[0].worst == pytest.approx(149.7e-6, rel=1e-3)
    assert "elevation 0 deg" in verdicts[0].place


def test_about_another_axis_gravity_turns_the_other_way(telescope):
    answer = elevation(telescope, over="0 deg:90 deg:4", about=(0, 1, 0))
    state = under_load(telescope.with_values({"load.gravity_axis.0": 0.0, "load.gravity_axis.1": 1.0,
                                              "load.gravity_angle": np.pi / 2}))  # fmt: skip
    assert answer.displacement[0] == pytest.approx(np.array(state.displacement), rel=1e-6, abs=1e-11)


@pytest.mark.parametrize(
    ("over", "word"),
    [
        ("0 deg:90 deg:2", "3 to 1,000"),
        ("0 deg:0 deg:5", "single"),
        ("0 mm:90 deg:5", "not a unit of angle"),
        ("90", "range"),
    ],
)
def test_a_range_that_says_too_little_is_refused(telescope, over, word):
    with pytest.raises(InputError, match=word):
        elevation(telescope, over)


def test_its_programs_are_about_the_state_that_has_programs(telescope):
    functions = functions_of(telescope, (), ())
    assert functions.machine.loaded == functions.rests
    assert len(functions.shares.parts) > 0


def test_without_gravity_nothing_turns(telescope):
    with pytest.raises(InputError, match="no gravity"):
        elevation(telescope.with_values({"load.gravity.2": 0.0}))


def test_the_softest_direction_at_rest_is_made_by_what_is_named(telescope):
    """A part with a share of 29 % of the softness, one percent stiffer, takes 0.29 percent of it away."""
    state = under_load(telescope)
    direction = state.softest["translation"]
    assert direction.stiffness == pytest.approx(1.0 / state.compliance[5][5], rel=1e-9)
    kinds = dict(direction.kinds)
    assert sum(share for _, share in direction.shares) == pytest.approx(1.0)
    stiffer = build(Path(TELESCOPE).read_text().replace("screw 420 N/um", "screw 424.2 N/um"))
    gain = under_load(stiffer).compliance[5][5] / state.compliance[5][5] - 1.0
    assert kinds["drive screw ×6"] == pytest.approx(-gain * 1.01 / 0.01, rel=1e-3)


def test_under_load_the_answer_comes_first_and_springs_by_kind(capsys):
    assert main(["analyze", TELESCOPE]) == 0
    answer = capsys.readouterr().out
    heads = [line.split()[0] for line in answer.splitlines()[1:] if line[:1].isalpha()]
    assert heads[:6] == ["Pose", "Stiffness", "Softest", "Sag", "Actuators", "Stability"]
    assert "22.1 % of" in answer
    assert "drive screw ×6" in answer
    assert "leg 3 drive screw " not in answer
    assert "A load is positive where it pulls" in answer
    assert main(["analyze", TELESCOPE, "--full"]) == 0
    assert "leg 3 drive screw " in capsys.readouterr().out


def test_it_is_said_that_nothing_loads_a_machine(capsys):
    assert main(["analyze", "hexapod", "--loaded"]) == 0
    answer = capsys.readouterr().out
    assert "Nothing loads the machine" in answer
    assert "Stability" not in answer


def test_moments_have_one_unit_in_all_columns_of_a_file():
    settings = ["tool.mass=1 kg", 'load.gravity=[0, 0, "-9.81 m/s**2"]']
    text = elevation_csv(elevation(load("delta", settings), over="60 deg:90 deg:3", about=(1, 0, 0)))
    heads = text.splitlines()[0].split(",")
    assert {head.partition(" [")[2] for head in heads if "moment" in head or " load" in head} == {"N·m]"}

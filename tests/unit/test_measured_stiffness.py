"""A measured stiffness beside the computed one: uncertainties known in closed form, verdicts, and bad files."""

import json

import numpy as np
import pytest

from kinetostat import analyze, load, plot
from kinetostat.accuracy.model import error_model
from kinetostat.cli import main
from kinetostat.spec.errors import InputError
from kinetostat.studies.measured_stiffness import validate_measured
from kinetostat.views.data_forms import json_of
from kinetostat.views.validation import MEASURED_STIFFNESS
from machines import load_without_limits

SOFT = "tolerances.compliances=sigma 10 %"


def written(tmp_path, text, name="measured.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


def fit_of(tmp_path, machine, value, variance):
    """A record of a fit of the compliances of a machine's springs, all with one value and in common."""
    paths = [error.path for error in error_model(machine, {}, 1).errors if error.group == "compliances"]
    unknowns = [{"path": p, "group": "compliances", "value": value} for p in paths]
    record = {"machine": machine.name, "unknowns": unknowns, "covariance": [[variance] * len(paths)] * len(paths)}
    return written(tmp_path, json.dumps(record), "fit.json")


def test_six_independent_springs_share_an_uncertainty_by_the_root_of_six(tmp_path):
    """Of the stiffness of a hexapod along z each actuator makes a sixth, so that 10 % of each are 10 % / sqrt(6)."""
    machine = load_without_limits("hexapod", [SOFT])
    computed = 1.0 / np.array(analyze(machine).compliance)[5, 5]
    path = written(tmp_path, f"entry, value, sigma\nfree_stiffness_z, {1.05 * computed}, 3 %\n")
    (row,) = validate_measured(machine, path).rows
    assert row.predicted == pytest.approx(computed, rel=1e-12)
    assert row.u_input == pytest.approx(0.1 * computed / np.sqrt(6.0), rel=1e-9)
    assert row.u_data == pytest.approx(0.03 * 1.05 * computed, rel=1e-12)
    assert row.u_num < 1e-12 * computed
    assert row.error == pytest.approx(-0.05 * computed, rel=1e-9)
    assert row.u_val == pytest.approx(computed * np.hypot(0.1 / np.sqrt(6.0), 0.0315), rel=1e-9)
    assert row.explained
    assert row.bounds == (0.0, pytest.approx(0.05 * computed + 2.0 * row.u_val, rel=1e-9))


def test_a_fit_moves_the_prediction_and_its_covariance_counts(tmp_path):
    """All compliances 20 % larger, each known to 4 % but all in common: C is 1.2 C ± 4 % / 1.2 of it, K as well."""
    machine = load_without_limits("hexapod")
    drawn = analyze(machine)
    fit = fit_of(tmp_path, machine, 0.2, 0.04**2)
    text = "entry, value, sigma\nstiffness_x_ry, 1 N/urad, 1 N/urad\ncompliance_rx, 6 urad/(N*m), 1 %\n"
    for row in validate_measured(machine, written(tmp_path, text), fit=fit).rows:
        matrix, i, j = row.entry.place
        whole = np.array(getattr(drawn, matrix))[i, j] * (1.2 if matrix == "compliance" else 1.0 / 1.2)
        assert row.predicted == pytest.approx(whole, rel=1e-9)
        assert row.u_input == pytest.approx(abs(whole) * 0.04 / 1.2, rel=1e-9)


def test_errors_of_geometry_count_as_a_machine_drawn_otherwise_has_them(tmp_path):
    """Against differences of machines with another radius, whose actuators stand so that the pose is the same."""
    machine = load_without_limits("hexapod", ["tolerances.geometry.base_radius=sigma 1 mm"])
    names = ("compliance_x", "stiffness_rx", "free_stiffness_z")
    text = "entry, value, sigma\n" + "".join(f"{name}, 1, 5 %\n" for name in names)
    ends = [
        analyze(load_without_limits("hexapod", [f'geometry.base_radius="{115 + off} mm"'])) for off in (0.01, -0.01)
    ]
    for row in validate_measured(machine, written(tmp_path, text)).rows:
        matrix, i, j = row.entry.place
        sizes = [np.array(end.stiffness if matrix == "stiffness" else end.compliance)[i, j] for end in ends]
        sizes = [1.0 / size for size in sizes] if matrix == "free_stiffness" else sizes
        assert row.u_input == pytest.approx(abs(sizes[0] - sizes[1]) / 2e-5 * 1e-3, rel=1e-4)


def test_errors_of_geometry_count_at_several_poses(tmp_path):
    """Deflections against differences of machines with another radius that are drawn at each pose."""
    radius = "tolerances.geometry.base_radius=sigma 1 mm"
    text = (
        "x [mm], yaw [deg], force.z [N], force.x [N], deflection.x [um], deflection.z [um]\n"
        "0, 0, 100, 40, 1, 1\n8, 5, -100, 40, 1, 1\n-6, 9, 50, 200, 1, 1\n"
    )
    answer = validate_measured(load_without_limits("hexapod", [radius]), written(tmp_path, text), sigma="1 um")
    assert not answer.left_out
    loads = {(0, 0): (40, 100), (8, 5): (40, -100), (-6, 9): (200, 50)}
    for place, ((x, yaw), (along_x, along_z)) in enumerate(loads.items()):
        pose = [f'pose.x="{x} mm"', f'pose.yaw="{yaw} deg"']
        ends = [
            np.array(
                analyze(load_without_limits("hexapod", [f'geometry.base_radius="{115 + o} mm"', *pose])).compliance
            )
            for o in (0.01, -0.01)
        ]
        slope = (ends[0] - ends[1]) / 2e-5 * 1e-3 @ [0, 0, 0, along_x, 0, along_z]
        for component, row in zip((3, 5), answer.rows[2 * place : 2 * place + 2], strict=True):
            assert row.u_input == pytest.approx(abs(slope[component]), rel=1e-4)


def test_errors_of_geometry_do_not_count_where_they_would_bend_legs_or_springs_change(tmp_path):
    poses = "x [mm], force.z [N], deflection.z [um]\n0, 100, 1\n5, 100, 1\n"
    joints = "tolerances.joints=0.05 mm"
    stretched = load_without_limits("hexapod", [joints, "stiffness.leg_axial=3e7 N"])
    answer = validate_measured(stretched, written(tmp_path, poses), sigma="1 um")
    assert len(answer.left_out) == 36
    assert not any(row.u_input for row in answer.rows)


def test_deflections_at_poses_are_those_of_the_compliance_there(tmp_path):
    machine = load_without_limits("delta", [SOFT])
    text = (
        "x [mm], y [mm], force.z [N], force.x [N], deflection.z [um], sigma.deflection.z [um]\n"
        "0, 0, 100, 0, 1, 0.5\n20, -30, 100, 40, 1, 0.5\n"
    )
    answer = validate_measured(machine, written(tmp_path, text))
    for row, pose, load_ in zip(answer.rows, [(0, 0), (20, -30)], [(0, 100), (40, 100)], strict=True):
        posed = load_without_limits("delta", [f'pose.x="{pose[0]} mm"', f'pose.y="{pose[1]} mm"'])
        compliance = np.array(analyze(posed).compliance)
        assert row.predicted == pytest.approx(compliance[5, 3] * load_[0] + compliance[5, 5] * load_[1], rel=1e-9)
    assert answer.rows[1].entry.line == 3


@pytest.mark.numbers
def test_differences_over_their_uncertainty_are_as_large_as_they_should_be(tmp_path):
    """Machines with springs drawn by their tolerance, measured with noise: chi-square of 5 entries is 5 on average."""
    machine, rng = load_without_limits("hexapod", [SOFT]), np.random.default_rng(3)
    model = error_model(machine, {}, 1)
    dyads = np.stack([model.deflections(unit[None])[0] for unit in np.eye(6)], axis=1)
    names = ("compliance_rx", "compliance_rz", "compliance_x", "compliance_z", "compliance_rx_y")
    places = [(0, 0), (2, 2), (3, 3), (5, 5), (0, 4)]
    squares = []
    for _ in range(60):
        true = dyads @ (1.0 + 0.1 * rng.normal(size=6))
        lines = [
            f"{name}, {true[p] * (1.0 + 0.05 * rng.normal())}, {0.05 * abs(true[p])}"
            for name, p in zip(names, places, strict=True)
        ]
        answer = validate_measured(machine, written(tmp_path, "\n".join(["entry, value, sigma", *lines])))
        squares.append(answer.chi_square)
    # The mean of 60 values of chi-square with 5 degrees of freedom has the standard deviation sqrt(10 / 60).
    assert np.mean(squares) == pytest.approx(5.0, abs=3.0 * np.sqrt(10.0 / 60.0))


def test_a_model_that_is_too_stiff_is_told_by_how_much(tmp_path, capsys):
    text = "entry, value, sigma\nfree_stiffness_z, 40 N/um, 1 N/um\ncompliance_rx_y, 0 rad/N, 1 nrad/N\n"
    path = written(tmp_path, text.replace("1 nrad/N", "1e-9 rad/N"))
    folder = tmp_path / "out"
    code = main(["validate", "hexapod", "--measured", str(path), "-o", str(folder)])
    shown = " ".join(capsys.readouterr().out.split())
    assert code == 1
    # 47.64 - 40 = 7.64 ± 2 of 40 N/µm; the computed entry is -0.3209 ± 0.002 µrad/N where none was measured.
    assert "too stiff by 14" in shown  # a narrow table breaks the range in two
    assert "to 24 %" in shown
    assert "off by 0.32" in shown
    assert "below 0.01 %" in shown
    assert {p.name for p in folder.iterdir()} == {"measured.json", "measured.png", "kinetostat.sha256"}
    record = json.loads((folder / "measured.json").read_text())
    assert record["entries"][0]["model_error_between"] == pytest.approx([5.64e6, 9.64e6], rel=1e-3)
    answer = validate_measured(load("hexapod"), path)
    assert json_of(MEASURED_STIFFNESS, answer)["agrees"] is False
    assert len(plot(answer).axes) == 2


HEAD = "entry, value, sigma\n"
BAD = {
    "value, sigma, entry\n1, 2, stiffness_zz\n": 'line 2: "stiffness_zz" is not an entry of K or C',
    f"{HEAD}stiffness_z, 20 um, 1 %\n": 'line 2: the value of stiffness_z is "20 um"',
    f"{HEAD}stiffness_z, 20 N/um,\n": "line 2: nothing says how sure stiffness_z is",
    f"{HEAD}stiffness_z, 20 N/um, -1 N/um\n": "line 2: the sigma of stiffness_z is -1 N/um; it must be more than 0",
    f"{HEAD}stiffness_z, nan, 1 %\n": 'line 2: the value of stiffness_z is "nan"',
    f"{HEAD}stiffness_z, -3, 1 %\n": "line 2: the value of stiffness_z is -3; what stands on the diagonal",
    f"{HEAD}\nstiffness_z, 3, 1 %\nstiffness_z, 3, 1 %\n": "line 4: stiffness_z stands in the file twice",
    "entry, sigma\nstiffness_z, 1 %\n": "there is no column value",
    "entry, value, weight\nstiffness_z, 3, 1\n": "there is no column weight",
    f"{HEAD}stiffness_z, 3\n": "line 2: the number of values is 2, not 3",
    "x [mm], measured.x [mm]\n1, 1\n": "no column holds a stiffness",
    "x [mm], force.z [N], deflection.z [um]\n1, 9, 1\n": "line 2: nothing says how sure deflection.z is",
    "x [m], force.z, deflection.z, sigma.deflection.z\n9, 9, 1, 1\n": "line 2: the drawn machine is not at",
}


@pytest.mark.parametrize(("text", "message"), BAD.items(), ids=range(len(BAD)))
def test_a_bad_file_is_refused_with_its_line(tmp_path, text, message):
    with pytest.raises(InputError, match=r"measured\.csv") as refusal:
        validate_measured(load("hexapod"), written(tmp_path, text))
    assert message in str(refusal.value)


def test_a_record_of_another_machine_or_of_nothing_is_refused(tmp_path):
    path = written(tmp_path, f"{HEAD}stiffness_z, 3, 1 %\n")
    for text, message in (
        ("{", "is not the record of a fit"),
        ('{"machine": "Delta", "unknowns": [], "covariance": []}', "is not the record of a fit"),
    ):
        with pytest.raises(InputError, match=message):
            validate_measured(load("hexapod"), path, fit=written(tmp_path, text, "fit.json"))
    other = fit_of(tmp_path, load_without_limits("delta"), 0.1, 0.01)
    with pytest.raises(InputError, match="is the fit of Delta"):
        validate_measured(load("hexapod"), path, fit=other)
    with pytest.raises(InputError, match="cannot be read"):
        validate_measured(load("hexapod"), path, fit=tmp_path / "none.json")


def test_a_rigid_machine_has_no_stiffness_to_compare(tmp_path):
    machine = load_without_limits("hexapod", ["stiffness.actuator=rigid"])
    with pytest.raises(InputError, match="the model is rigid"):
        validate_measured(machine, written(tmp_path, f"{HEAD}stiffness_z, 3, 1 %\n"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--sigma", "3 %"], "--sigma is about a measured stiffness"),
        (["--measured", "x.csv", "--engine", "pynite"], "two kinds of validation"),
    ],
)
def test_options_of_the_other_kind_of_validation_are_refused(options, message, capsys):
    assert main(["validate", "hexapod", *options]) == 2
    assert message in " ".join(capsys.readouterr().err.split())

"""Whole identifications of machines whose truth is known: what is found, what is not seen, and what is set aside."""

import json

import numpy as np
import pytest

from kinetostat.cli import main
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.machine.loading import build
from kinetostat.numerics.motions import exponential
from kinetostat.studies.identification.identification import identification_of
from kinetostat.studies.identification.measurements import POSITION, Measurements
from kinetostat.studies.identification.next_poses import as_csv
from kinetostat.studies.poses import given_poses
from kinetostat.views.identification_figures import residual_figure
from machines import load_without_limits
from synthetic_measurements import SIGMA, found, measured, posed, truth_of, written


def test_a_hexapod_gives_back_its_42_errors():
    model, poses = posed(load_without_limits("hexapod"), 40)
    truth = truth_of(model)
    answer = identification_of(model, measured(model, poses, truth))
    assert answer.fit.rank == len(answer.unknowns) == 42
    assert not answer.unseen
    assert np.mean(np.abs(found(answer, truth)) < 1.0) > 0.85
    assert answer.fit.scatter == pytest.approx(1.0, abs=0.15)
    assert answer.scatter(answer.fit.before)["length"] > 20.0 * answer.scatter(answer.fit.after)["length"]
    assert answer.scatter(answer.fit.predicted)["length"] > answer.scatter(answer.fit.after)["length"]


def test_an_unknown_frame_and_target_hide_twelve_combinations_of_a_hexapod_and_no_other():
    model, poses = posed(load_without_limits("hexapod"), 30)
    truth = truth_of(model)
    frame = exponential(np.array([[0.3, -0.2, 2.0, 0.4, -0.1, 0.7]]))
    answer = identification_of(model, measured(model, poses, truth, frame=frame), frame=True, target=True)
    assert answer.fit.rank == 42
    assert len(answer.unseen) == 12
    words = [each.words for each in answer.unseen]
    for what, preposition in (("shift", "along"), ("turn", "about")):
        for axis in "xyz":
            on_base = f"A common {what} of all base joints {preposition} {axis} cannot be told from another place of"
            assert any(text.startswith(on_base) for text in words)
            assert any(text.startswith(on_base.replace("base", "platform")) for text in words)
    assert all(each.inside < 0.05 * 1e-3 for each in answer.unseen)  # another place of base and target undoes them
    assert answer.fit.scatter == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("name", ["hexapod", "delta", "written"])
def test_what_is_not_seen_is_the_null_space_of_the_measurements(name):
    """Against singular values of finite differences of exact places: as many, and the same combinations."""
    machine = load_without_limits("delta" if name == "delta" else "hexapod")
    machine = build(document_of(machine)) if name == "written" else machine
    model, poses = posed(machine, 25)
    groups = ("geometry", "zeros") if name != "delta" else ("zeros", "legs.*.actuator.?", "legs.*length")
    answer = identification_of(model, measured(model, poses, 0.0 * truth_of(model)), groups, frame=True)
    columns = []
    for unknown, size in zip(answer.unknowns, answer.sizes, strict=True):
        way = np.zeros(len(answer.unknowns))
        way[answer.unknowns.index(unknown)] = 0.01 * size
        ends = [answer.observed.residuals(answer.fit.values + sign * way) for sign in (1.0, -1.0)]
        columns.append((ends[1] - ends[0]) / 0.02)
    jacobian = np.stack(columns, axis=1)
    _, sizes, ways = np.linalg.svd(jacobian)
    # Differences keep half of the digits, so that what is hardly seen lies between 1e-6 and the round-off of both.
    assert answer.fit.rank >= (sizes > 1e-5 * sizes[0]).sum()
    assert np.linalg.norm(jacobian @ answer.fit.unseen_combinations, axis=0).max(initial=0.0) < 1e-5 * sizes[0]
    assert len(answer.unseen) == len(answer.unknowns) - answer.fit.rank
    assert len(ways) == len(answer.unknowns)


def test_tilt_of_a_delta_is_seen_only_by_what_turns():
    machine = load_without_limits("delta")
    model, poses = posed(machine, 40)
    fit = ["*.parallelogram.difference", "legs.*.elbow.length", "zeros"]
    truth = truth_of(model, ())
    for path in ("legs.leg 1.parallelogram.difference", "legs.leg 3.elbow.length"):
        truth[[error.path for error in model.errors].index(path)] = 2e-4
    whole = identification_of(model, measured(model, poses, truth), fit)
    position = identification_of(model, measured(model, poses, truth, POSITION), fit, target=True)
    assert whole.fit.rank == len(whole.unknowns)
    assert np.mean(np.abs(found(whole, truth)) < 1.0) > 0.7
    tilt = [n for n, unknown in enumerate(position.unknowns) if unknown.path.endswith("difference")]
    # Positions see it by the way it moves the target, which another target may do: hardly or not at all.
    assert (position.fit.half_intervals[tilt] > 20.0 * whole.fit.half_intervals[tilt]).all()


def test_gross_outliers_hardly_move_the_result_and_are_named():
    model, poses = posed(load_without_limits("hexapod"), 60)
    truth = truth_of(model)
    clean = measured(model, poses, truth)
    rng = np.random.default_rng(1)
    spoilt = {name: entries.copy() for name, entries in clean.values.items()}
    wrong = {(name, row) for name in spoilt for row in rng.choice(60, 6, replace=False)}
    for name, row in wrong:
        spoilt[name][row] += rng.choice([-1.0, 1.0]) * SIGMA[name] * rng.uniform(20.0, 500.0)
    plain = identification_of(model, clean)
    robust = identification_of(model, Measurements(**{**vars(clean), "values": spoilt}))
    sigma = np.sqrt(np.diag(plain.fit.covariance))
    assert {(name, line - 2) for line, name, _ in robust.outliers} >= wrong
    assert len(robust.outliers) <= len(wrong) + 2
    assert np.sqrt(np.mean(((robust.fit.values - plain.fit.values) / sigma) ** 2)) < 0.5
    for panel in residual_figure(robust).axes:  # no outlier is lost because it lies beyond the panel
        low, high = panel.get_ylim()
        assert all(((line.get_ydata() > low) & (line.get_ydata() < high)).all() for line in panel.lines)
        assert {line.get_label() for line in panel.lines} in ({*"xyz", "outlier"}, {"rx", "ry", "rz", "outlier"})


def test_poses_to_measure_next_are_a_file_that_other_commands_read(tmp_path):
    machine = load_without_limits("hexapod")
    model, poses = posed(machine, 30)
    answer = identification_of(model, measured(model, poses, 0.0 * truth_of(model)), more=3)
    (tmp_path / "next.csv").write_text(as_csv(answer.machine, answer.next))
    read = given_poses(machine, tmp_path / "next.csv")
    for field, values in zip(read.fields, read.values, strict=True):
        assert values == pytest.approx(answer.next.poses[f"pose.{field.shown}"], rel=1e-8)


def test_the_command_writes_a_machine_that_stands_where_it_was_measured(tmp_path, capsys):
    machine = load_without_limits("hexapod")
    model, poses = posed(machine, 24)
    truth = truth_of(model)
    written(tmp_path / "data.csv", measured(model, poses, truth))
    folder = tmp_path / "out"
    sigmas = ["--sigma", "5 um", "--sigma-angle", "30 urad"]
    code = main(
        ["identify", "hexapod", str(tmp_path / "data.csv"), *sigmas, "-o", str(folder), "--next", "3", "--json"]
    )
    record = json.loads(capsys.readouterr().out)
    assert code == 0
    assert record["rank"] == 42
    assert len(record["next_poses"]["poses"]["pose.x"]) == 3
    names = {path.name for path in folder.iterdir()} - {"kinetostat.sha256"}
    assert names == {"machine.toml", "fit.json", "next-poses.csv", "residuals.png", "correlations.png", "poses.png"}
    assert json.loads((folder / "fit.json").read_text())["home"]["commands"]
    assert main(["check", str(folder / "machine.toml")]) == 0


def test_over_200_repetitions_the_truth_lies_in_its_95_percent_intervals():
    """Of a planar machine: of each unknown, and of all together, as often as sampling allows.

    An unknown of which an interval holds the truth in 95 % of all cases has fewer than 177 of 200 with a probability of
    0.01 %, and 200 of 200 with one of 0.004 %: for all unknowns together 99.8 % of right fits pass.
    """
    model, poses = posed(load_without_limits("planar-3rpr"), 25, 0.4, 0.3)
    truth, inside = truth_of(model), []
    for seed in range(200):
        answer = identification_of(model, measured(model, poses, truth, ("x", "y", "rz"), np.random.default_rng(seed)))
        inside.append(np.abs(found(answer, truth)) < 1.0)
    each = np.array(inside)
    assert each.shape[1] > 5
    assert each.sum(axis=0).min() >= 177
    share = each.mean(axis=1)  # repetitions are independent of each other, unknowns are not
    assert share.mean() == pytest.approx(0.95, abs=3.3 * share.std() / np.sqrt(200))

"""Identification from synthetic measurements whose truth is known, and what it says about bad data."""

import math
from dataclasses import replace

import numpy as np
import pytest

from kinetostat.accuracy.built import as_built
from kinetostat.accuracy.model import error_model
from kinetostat.kinematics.forward import system_of
from kinetostat.machine.loading import build
from kinetostat.machine.machine import springs
from kinetostat.machine.parameters import values, with_values
from kinetostat.numerics.motions import Motions, exponential
from kinetostat.spec import document
from kinetostat.spec.errors import InputError
from kinetostat.studies.identification.fit import FitOptions, best_fit
from kinetostat.studies.identification.identification import identification_of, identify
from kinetostat.studies.identification.measurements import POSITION, ROTATION, Measurements, Sigmas, read_measurements
from kinetostat.studies.identification.next_poses import chosen_poses, first_poses
from kinetostat.studies.identification.observation import FRAME_UNKNOWNS, TARGET_UNKNOWNS, observation, place_unknown
from kinetostat.studies.identification.unseen import sparse
from machines import ARM, load_without_limits
from synthetic_measurements import posed


def test_rates_of_every_sort_of_measurement_are_exact():
    model, poses = posed(load_without_limits("hexapod"), 12)
    count, rng = len(model), np.random.default_rng(2)
    names = (*POSITION, "roll", "pitch", "yaw", "distance", "deflection.z", "deflection.rx")
    data = Measurements(
        "data.csv",
        tuple(range(count)),
        poses,
        {name: np.zeros(count) for name in names},
        {name: np.ones(count) for name in names},
        rng.normal(size=(count, 6)) * 100.0,
        rng.normal(size=(count, 3)),
    )
    chosen = [error for error in model.errors if error.group in ("geometry", "gains", "compliances")]
    unknowns = [*chosen, *(place_unknown(path) for path in (*FRAME_UNKNOWNS, *TARGET_UNKNOWNS))]
    seen = observation(model, data, unknowns, Motions(np.eye(3)[None], np.zeros((1, 3))))
    at, way = (size * rng.normal(size=len(unknowns)) for size in (1e-3, 1e-6))
    _, rates = seen.linearisation(at)
    difference = 0.5 * (seen.residuals(at - way) - seen.residuals(at + way))
    for name in names:
        rows = np.array(seen.row_names) == name
        assert difference[rows] == pytest.approx(
            (rates @ way)[rows], rel=1e-3, abs=5e-3 * np.abs(difference[rows]).max()
        )


def test_compliances_follow_from_deflections_under_known_loads():
    machine = load_without_limits("hexapod")
    model, poses = posed(machine, 20)
    rng, count = np.random.default_rng(4), len(model)
    truth = np.array([0.1 * rng.normal() if error.group == "compliances" else 0.0 for error in model.errors])
    soft = np.flatnonzero(truth)
    wrenches = rng.normal(size=(count, 6)) * [20.0, 20.0, 20.0, 300.0, 300.0, 300.0]
    deflected = model.deflections(wrenches) @ (1.0 + truth[soft])
    names = {f"deflection.{name}": deflected[:, i] for i, name in enumerate((*ROTATION, *POSITION))}
    sigma = {name: np.full(count, 1e-3 * np.abs(entries).max()) for name, entries in names.items()}
    noisy = {name: entries + sigma[name] * rng.normal(size=count) for name, entries in names.items()}
    data = Measurements("data.csv", tuple(range(count)), poses, noisy, sigma, wrenches, np.full((count, 3), np.nan))
    answer = identification_of(model, data, ["compliances"])
    assert answer.fit.rank == 6
    assert (np.abs(answer.fit.values - truth[soft]) < 1.6 * answer.fit.half_intervals).all()
    built = as_built(machine, answer.errors)
    stiffness = [s.stiffness for s in springs(built.configuration)]
    drawn = [s.stiffness for s in springs(machine.configure())]
    assert np.array(drawn) / stiffness == pytest.approx(1.0 + truth[soft], abs=0.02)


class Line:
    """Two unknowns of which measurements see the sum."""

    def __init__(self, noise):
        self.rates = np.array([[1.0, 1.0], [2.0, 2.0], [-1.0, -1.0], [0.5, 0.5]])
        self.value = self.rates @ [0.3, 0.1] + noise

    def residuals(self, at):
        return self.value - self.rates @ at

    def linearisation(self, at):
        return self.residuals(at), self.rates


def test_what_is_not_seen_is_said_and_a_prior_or_a_bound_settles_it():
    line, groups, none = Line(np.zeros(4)), np.arange(4), np.full(2, np.inf)
    small = np.full(2, 1e-5)
    open_end = best_fit(line, groups, FitOptions(np.ones(2), none, none, small))
    assert open_end.rank == 1
    assert np.isinf(open_end.half_intervals).all()
    assert open_end.values == pytest.approx([0.2, 0.2], abs=1e-6)
    known = best_fit(line, groups, FitOptions(np.ones(2), np.array([np.inf, 0.01]), none, small))
    assert known.rank == 2
    assert known.values == pytest.approx([0.4, 0.0], abs=1e-3)
    bounded = best_fit(line, groups, FitOptions(np.ones(2), none, np.array([0.05, 10.0]), small))
    assert bounded.values[0] <= 0.05 + 1e-9
    assert bounded.values.sum() == pytest.approx(0.4, abs=1e-6)


def test_chosen_poses_beat_all_others_of_a_small_set():
    rng = np.random.default_rng(0)
    blocks = rng.normal(size=(9, 1, 3))
    start = 1e-3 * np.eye(3)

    def score(which):
        flat = blocks[list(which)].reshape(-1, 3)
        return np.linalg.slogdet(start + flat.T @ flat)[1]

    from itertools import combinations

    best = max(combinations(range(9), 3), key=score)
    assert score(chosen_poses(blocks, start, 3)) == pytest.approx(score(best), abs=0.15)


HEADS = "x [mm], y [mm], z [mm], roll [deg], measured.x [mm], measured.y [mm], measured.z [mm]\n"
BAD = {
    "x [mm], y [mm]\n1, 2\n": "no column says what was measured",
    "measured.x [mm]\n1\n": "no column says what was commanded",
    "x [mm], measured.q [mm]\n1, 2\n": "there is no column measured.q",
    "x [mm], measured.x [deg]\n1, 2\n": "line 2, column measured.x",
    "x [mm], measured.rx [deg]\n1, 200\n": "more than half a turn",
    "x [mm], measured.distance [mm]\n1, 2\n": "from.x, from.y and from.z",
    "x [mm], deflection.z [um]\n1, 2\n": "without a load",
    "x [mm], measured.x [mm], sigma.x [um]\n1, 2, 0\n": 'column sigma.x is "0": it must be greater than 0',
    f"{HEADS}1, 2, 140, 0, 1, 2, 140\n": "measure at least 14 poses",
    "x [mm], measured.x [mm]\n1, two\n": "line 2, column measured.x is",
    "x [mm], measured.x [mm], sigma.x [um]\n1, 2, 3\n1, 2, -3\n": "line 3, column sigma.x is",
    "x [mm], measured.x [mm]\n1, 2\n1, nan\n": "line 3, column measured.x is",
    "x [mm], measured.x [mm]\n1, 2\nnan, 2\n": "line 3, column x",
    "x [mm], measured.x [mm]\n1, 2\n, 2\n": "line 3, column x",
    "x [mm], measured.x [mm]\n1, 2\n1\n": "line 3: the number of values is 1, not 2",
    "x [N], measured.x [mm]\n1, 2\n": "line 2, column x",
    "x [mm], measured.x [mm], sigma.x [deg]\n1, 2, 3\n": "line 2, column sigma.x",
    "actuator.leg 1 [mm], measured.x [mm]\n1, 2\n9000, 2\n": "the drawn machine has no pose with these coordinates",
    "actuator.leg 9 [mm], measured.x [mm]\n1, 2\n": "there is no column actuator.leg 9; choose from actuator.leg 1",
    "x [mm], measured.x [mm]\n": "names columns, but has no poses below them",
    "x [mm], measured.x [mm]\n9000, 2\n": "line 2: the drawn machine is not at the commanded pose",
    "x [mm], measured.x [mm]\n1, 1e308\n": "must not exceed 1e+06 m",
    "x [mm], measured.x [mm], sigma.x [mm]\n1, 2, 1e-300\n": "must be at least 1e-12 m",
    "x [mm], measured.x [mm], measured.x [mm]\n1, 2, 3\n": 'several columns are called "measured.x"',
    "x [mm], measured.x [mm]\n1, " + 200_000 * "2": "line 2 cannot be read: field larger than field limit",
    "x [mm], measured.x [mm],\n1, 2, 3\n": "a column is called",
    f"x{2000 * ',x'}\n1\n": "has 2,001 columns, and may have at most 1,000",
    "x, measured.x\n" + 20_000 * "0, 0\n": "has 20,000 poses, and may have at most 10,000",
}


def test_poses_to_add_first_show_what_many_poses_show(tmp_path):
    """With them as many combinations are seen as with four hundred poses at random, and they are told."""
    machine, path = load_without_limits("hexapod"), tmp_path / "data.csv"
    path.write_text(f"{HEADS}1, 2, 135, 0, 1, 2, 135\n")
    with pytest.raises(InputError, match=r"Those to add first, x \(mm\), y \(mm\), z \(mm\), roll \(deg\): .*; "):
        identify(machine, path)
    few, home = posed(machine, 2)
    unknowns = [error for error in few.errors if error.group in ("geometry", "zeros")]
    sizes = np.full(len(unknowns), 1e-3)

    def rank(rows):
        return np.linalg.matrix_rank(rows, tol=1e-9 * np.abs(rows).max())

    def rates(model, poses):
        count = len(model)
        values = {name: np.zeros(count) for name in POSITION}
        sigma = {name: np.full(count, 1e-5) for name in POSITION}
        data = Measurements(
            "d", tuple(range(count)), poses, values, sigma, np.zeros((count, 6)), np.full((count, 3), np.nan)
        )
        seen = observation(model, data, unknowns, Motions(np.eye(3)[None], np.zeros((1, 3))))
        return seen, seen.linearisation(np.zeros(len(unknowns)))[1]

    seen, known = rates(few, home)
    added = first_poses(machine, seen, sizes, 12)
    both = np.vstack([known, rates(error_model(machine, added, 12, np.zeros(6)), added)[1]])
    ranks = [
        np.linalg.matrix_rank(rows, tol=1e-9 * np.abs(rows).max()) for rows in (both, rates(*posed(machine, 400))[1])
    ]
    assert ranks[0] == ranks[1] > np.linalg.matrix_rank(known)


@pytest.mark.parametrize(("text", "message"), BAD.items(), ids=range(len(BAD)))
def test_bad_data_is_refused_with_file_and_line(tmp_path, text, message):
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=r"data\.csv") as refusal:
        identify(load_without_limits("hexapod"), path)
    assert message in str(refusal.value)


def test_a_pose_beyond_reach_is_refused_with_its_line(tmp_path):
    path = tmp_path / "data.csv"
    path.write_text("x [mm], measured.x [mm]\n0, 0\n900, 0\n")
    with pytest.raises(InputError, match="line 3: the drawn machine is not at the commanded pose"):
        identify(load_without_limits("delta"), path)


def test_a_crank_may_be_commanded_beyond_half_a_turn(tmp_path):
    """Of a platform 181 degrees are a mistake, of a motor they are not."""
    path, machine = tmp_path / "data.csv", load_without_limits("hexapod-rus")
    path.write_text("actuator.leg 4 [deg], measured.z [mm]\n-181, 300\n")
    commanded = read_measurements(machine, path, Sigmas(1e-5, 1e-5)).pose
    placed = with_values(machine, {name: float(values[0]) for name, values in commanded.items()})
    turned = next(actuator for actuator in system_of(placed).actuators if actuator.leg == "leg 4")
    assert math.remainder(turned.coordinate - math.radians(-181.0), math.tau) == pytest.approx(0.0, abs=1e-9)


"""One leg with three actuators."""


def test_a_commanded_actuator_has_one_column_and_one_name(tmp_path):
    """The name of a leg with several actuators means none of them, and none is commanded twice."""
    path, arm = tmp_path / "data.csv", build(document.parse(ARM, "arm"), "arm")
    path.write_text("actuator.arm elbow [deg], measured.x [mm]\n5, 500\n")
    turned = read_measurements(arm, path, Sigmas(1e-5, 1e-5)).pose
    assert turned["pose.yaw"] == pytest.approx(math.radians(5.0))
    path.write_text("actuator.arm [deg], measured.x [mm]\n5, 500\n")
    with pytest.raises(InputError, match=r"no column actuator\.arm; choose from actuator\.arm shoulder"):
        read_measurements(arm, path, Sigmas(1e-5, 1e-5))
    path.write_text("actuator.leg 4 [deg], actuator.leg 4 actuator [deg], measured.z [mm]\n5, 6, 300\n")
    with pytest.raises(InputError, match="are one actuator; leave one of them out"):
        read_measurements(load_without_limits("hexapod-rus"), path, Sigmas(1e-5, 1e-5))


def test_positions_in_another_unit_are_noticed(tmp_path):
    path = tmp_path / "data.csv"
    rows = "".join(f"{i}, 0, 140, {i % 3}, {i}, 0, 140\n" for i in range(-7, 8))
    path.write_text(
        HEADS.replace("measured.x [mm], measured.y [mm], measured.z [mm]", "measured.x, measured.y, measured.z") + rows
    )
    with pytest.raises(InputError, match="check the unit"):
        identify(load_without_limits("hexapod"), path)


LINE = np.array([6.0, 3.0, 2.0]) / 7.0


def on_a_line(count=7):
    """The hexapod at poses along `LINE`, measured from the base frame."""
    machine = load_without_limits("hexapod")
    poses = {path: np.full(count, float(value)) for path, value in values(machine).items() if path.startswith("pose.")}
    for path, part in zip(("pose.x", "pose.y", "pose.z"), LINE, strict=True):
        poses[path] += part * np.linspace(-0.01, 0.012, count)
    model, nothing = error_model(machine, poses, count, np.zeros(6)), np.full((count, 3), np.nan)
    measured = {name: model.drawn.tool[:, i] for i, name in enumerate(POSITION)}
    sigma = {name: np.full(count, 1e-5) for name in measured}
    return model, Measurements("data.csv", tuple(range(count)), poses, measured, sigma, np.zeros((count, 6)), nothing)


@pytest.mark.parametrize("angle", [0.0, 0.4, 3.1])
def test_positions_on_a_line_turn_the_frame_no_more_than_they_say(angle):
    """The line does not say how the frame is turned about it; what noise says of that must not count."""
    model, data = on_a_line()
    turn = angle * np.array([1.0, -2.0, 0.0]) / math.sqrt(5.0)
    rotation = exponential(np.array([[*turn, 0.0, 0.0, 0.0]])).rotation[0]
    noise = np.random.default_rng(0).normal(0.0, 1e-9, model.drawn.tool.shape)
    seen = model.drawn.tool @ rotation + noise  # R^T p
    data = replace(data, values={name: seen[:, i] for i, name in enumerate(POSITION)})
    frame = observation(model, data, [place_unknown("frame.rx")]).frame
    assert frame.point(seen) == pytest.approx(model.drawn.tool, abs=1e-7)
    assert np.linalg.norm(frame.amounts()[0, :3]) == pytest.approx(angle, abs=1e-5)


def test_former_names_of_an_observation_still_work_and_warn():
    observed = observation(*on_a_line(), [place_unknown("frame.rx")])
    for former, name in (("chosen", "error_numbers"), ("names", "row_names"), ("value", "measured")):
        with pytest.warns(DeprecationWarning, match=name):
            assert getattr(observed, former) is getattr(observed, name)


def test_rates_of_the_target_leave_the_twists_of_the_tool_as_they_are():
    model, data = on_a_line()
    unknowns = [place_unknown(path) for path in (*FRAME_UNKNOWNS, *TARGET_UNKNOWNS)]
    observed = observation(model, data, unknowns)
    target = observed._target_at(np.zeros((len(data), 6)), np.zeros(len(unknowns)))
    twists = np.zeros((len(data), 6, len(unknowns)))
    rates = target.rates(twists, [unknown.path for unknown in unknowns])
    assert rates.any(axis=(0, 1)).all()
    assert not twists.any()


def test_poses_chosen_beat_poses_at_random_by_the_factor_that_is_foretold():
    """Of a planar machine with 15 errors: the scatter of 4000 fits, as a geometric mean over all combinations."""
    model, poses = posed(load_without_limits("planar-3rpr"), 90, 0.4, 0.3)
    names, count = ("x", "y", "rz"), len(model)
    sigma = {name: np.full(count, 1e-5) for name in names}
    zeros = {name: np.zeros(count) for name in names}
    nothing = np.full((count, 3), np.nan)
    data = Measurements("data.csv", tuple(range(count)), poses, zeros, sigma, np.zeros((count, 6)), nothing)
    unknowns = [error for error in model.errors if error.group in ("geometry", "zeros")]
    frame = Motions(np.eye(3)[None], np.zeros((1, 3)))
    _, rates = observation(model, data, unknowns, frame).linearisation(np.zeros(len(unknowns)))
    _, sizes, ways = np.linalg.svd(rates * 1e-3)
    blocks = (rates * 1e-3 @ ways[sizes > 1e-6 * sizes[0]].T).reshape(count, 3, -1)
    unknown, rng = blocks.shape[2], np.random.default_rng(0)
    start = 1e-6 * np.eye(unknown)
    spreads, information = [], []
    for which in (chosen_poses(blocks, start, 12), rng.permutation(count)[:12]):
        flat = blocks[which].reshape(-1, unknown)
        estimates = rng.normal(size=(4000, len(flat))) @ np.linalg.pinv(flat).T
        spreads.append(np.linalg.slogdet(np.cov(estimates.T))[1])
        information.append(np.linalg.slogdet(flat.T @ flat)[1])
    measured_factor = np.exp((spreads[1] - spreads[0]) / (2 * unknown))
    foretold = np.exp((information[0] - information[1]) / (2 * unknown))
    assert measured_factor == pytest.approx(foretold, rel=0.02)
    assert foretold > 1.3


def test_combinations_that_are_not_seen_are_named_alike_whatever_basis_round_off_gives():
    rng = np.random.default_rng(3)
    ways = np.linalg.qr(rng.normal(size=(9, 3)))[0]
    ways[:3], ways[3:6] = ways[6:], -ways[6:]  # three legs that are alike
    ways = np.linalg.qr(ways)[0]
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    first, second = sparse(ways), sparse(ways @ turned)
    assert first == pytest.approx(second, abs=1e-12)
    assert np.linalg.matrix_rank(np.hstack([first, ways]), 1e-9) == 3
    assert sorted((np.abs(first - 1.0) < 1e-12).argmax(axis=0).tolist()) == [0, 1, 2]

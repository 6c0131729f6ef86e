"""Identifications from data that hardly say enough: few directions, spoilt values, exact values, readings."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from kinetostat.accuracy.model import error_model
from kinetostat.cli import main
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.kinematics.forward import assembly_modes, poses_at, stand, system_of
from kinetostat.machine.loading import build
from kinetostat.machine.parameters import with_values
from kinetostat.studies.identification.identification import PREFERENCE, identification_of
from machines import load_without_limits
from synthetic_measurements import measured, posed, truth_of, written

CASES = Path(__file__).parent.parent / "cases"
HEIGHTS = ["zeros", "geometry.base_radius", "legs.*.parallelogram.length"]
UNMOVED = [4, 7, 10, 16, 19, 22, 28, 31, 34]
"""Poses of delta-z-only.csv at which its heights are those of the machine as drawn."""


class Noiseless:
    """Stands for a generator of random numbers."""

    def normal(self, size):
        return np.zeros(size)


def answer_of(capsys, *words):
    code = main(["identify", *map(str, words), "--json"])
    assert code == 0
    return json.loads(capsys.readouterr().out)


def test_values_that_do_not_belong_do_not_make_a_fit_run_away(capsys):
    """A quarter of the heights are those of the drawn machine; zeros of 265 mrad and bars of 80 mm explained them."""
    fit = [word for what in HEIGHTS for word in ("--fit", what)]
    record = answer_of(capsys, "delta", CASES / "delta-z-only.csv", "--sigma", "5 um", *fit)
    assert sorted(each["line"] for each in record["outliers"]) == [place + 2 for place in UNMOVED]
    assert record["scatter"] == pytest.approx(1.04, abs=0.02)
    truth = dict.fromkeys([f"legs.leg {n}.actuator.zero" for n in (1, 2, 3)])
    truth |= zip(truth, (-1.30e-3, -0.35e-3, 3.33e-3), strict=True)
    truth |= zip([f"legs.leg {n}.parallelogram.length" for n in (1, 2, 3)], (0.5e-3, -0.4e-3, 0.3e-3), strict=True)
    truth["geometry.base_radius"] = 0.8e-3
    for unknown in record["unknowns"]:
        assert abs(unknown["value"] - truth[unknown["path"]]) < 1.1 * unknown["half_interval_95"]


def heights():
    """The Delta and the poses of delta-z-only.csv."""
    rings = [
        (0.0, 0.0),
        *((r * np.cos(a), r * np.sin(a)) for r in (0.05, 0.1, 0.15) for a in np.arange(12) * np.pi / 6),
    ]
    x, y = np.array(rings).T
    poses = {"pose.x": x, "pose.y": y, "pose.z": np.full(len(rings), -0.75)}
    return error_model(load_without_limits("delta"), poses, len(rings), np.zeros(6)), poses


@pytest.mark.parametrize(
    "seeds", [range(2), pytest.param(range(2, 25), marks=pytest.mark.slow)], ids=["two seeds", "all seeds"]
)
def test_no_fit_ends_above_a_trust_region_solver_that_starts_from_the_drawing(seeds):
    """With a quarter of the values spoilt as in delta-z-only.csv, and without any."""
    model, poses = heights()
    sizes = {"zeros": 2e-3, "geometry": 0.5e-3, "shared": 0.8e-3}
    wanted = [
        e.path == HEIGHTS[1] or e.group == "zeros" or e.path.endswith("parallelogram.length") for e in model.errors
    ]
    for seed in seeds:
        rng = np.random.default_rng(seed)
        scale = np.array([sizes.get(e.group, 0.0) for e in model.errors]) * wanted
        data = measured(model, poses, scale * rng.normal(size=len(scale)), ("z",), rng)
        if seed % 2:
            data.values["z"][UNMOVED] = poses["pose.z"][UNMOVED] + 5e-6 * rng.normal(size=len(UNMOVED))
        answer = identification_of(model, data, HEIGHTS)
        kept, seen, weak = answer.fit.kept, answer.observed, PREFERENCE * np.eye(len(answer.sizes))

        def residuals(units, answer=answer, seen=seen, kept=kept, weak=weak):
            return np.concatenate([seen.residuals(units * answer.sizes)[kept], weak @ units])

        def slopes(units, answer=answer, seen=seen, kept=kept, weak=weak):
            return np.concatenate([-(seen.linearisation(units * answer.sizes)[1] * answer.sizes)[kept], weak])

        other = least_squares(residuals, np.zeros(len(weak)), slopes, ftol=1e-12, xtol=1e-12, gtol=1e-12)
        objective = 0.5 * (residuals(answer.fit.values / answer.sizes) ** 2).sum()
        assert objective <= other.cost * (1.0 + 1e-6)
        assert (~kept).sum() <= 1 + len(UNMOVED) * (seed % 2)
        assert answer.fit.scatter < 1.6
        assert len(repr(answer.fit).splitlines()) == len(repr(answer).splitlines()) == 1


def test_translations_alone_are_answered_and_the_answer_names_what_they_cannot_see(capsys):
    record = answer_of(capsys, "hexapod", CASES / "hexapod-translations.csv", "--frame", "--sigma", "20 um")
    assert record["rank"] == len(record["unseen"]) == 24
    assert record["outliers"] == []
    assert max(abs(unknown["value"]) for unknown in record["unknowns"]) < 1.5e-3  # of a perfect machine
    sure = {u["path"]: (u["value"], u["half_interval_95"]) for u in record["unknowns"] if u["seen"]}
    assert all(abs(value) < 1.5 * half for value, half in sure.values())
    words = " ".join(each["words"] for each in record["unseen"])
    assert "A common turn of all base joints about x cannot be told from another place of the measuring frame" in words
    assert "platform joint of leg 1" in words


@pytest.mark.parametrize(("name", "groups"), [("planar-3rpr", ()), ("hexapod", ("gains",))])
def test_intervals_of_exact_data_hold_the_truth_and_nothing_is_set_aside(tmp_path, capsys, name, groups):
    """No noise and no standard deviations: what is left is round-off of the file."""
    model, poses = posed(load_without_limits(name), 40)
    groups = ("geometry", "zeros", *groups)
    truth = truth_of(model, groups)
    written(tmp_path / "exact.csv", measured(model, poses, truth, rng=Noiseless()))
    words = [word for group in groups for word in ("--fit", group)]
    record = answer_of(capsys, name, tmp_path / "exact.csv", *words)
    assert record["outliers"] == []
    assert record["rank"] == len(record["unknowns"]) == np.count_nonzero(truth)
    true = {error.path: value for error, value in zip(model.errors, truth, strict=True)}
    for unknown in record["unknowns"]:
        assert abs(unknown["value"] - true[unknown["path"]]) <= unknown["half_interval_95"] < 1e-6


def test_readings_of_actuators_give_what_poses_give(tmp_path, capsys):
    machine = load_without_limits("hexapod")
    model, poses = posed(machine, 12)
    data = measured(model, poses, truth_of(model, ("zeros",)))
    by_pose, by_reading = tmp_path / "poses.csv", tmp_path / "readings.csv"
    written(by_pose, data)
    lines = [line.split(", ") for line in by_pose.read_text().splitlines()]
    heads = [f"actuator.{actuator.name} [mm]" for actuator in stand(machine)]
    readings = [[f"{1e3 * value:.12f}" for value in row] for row in model.drawn.actuators]
    rows = zip([heads, *readings], (line[len(poses) :] for line in lines), strict=True)
    by_reading.write_text("\n".join(", ".join([*start, *end]) for start, end in rows) + "\n")
    records = [
        answer_of(capsys, "hexapod", path, "--fit", "zeros", "--sigma", "5 um", "--sigma-angle", "30 urad")
        for path in (by_pose, by_reading)
    ]
    for one, other in zip(*(record["unknowns"] for record in records), strict=True):
        assert other["value"] == pytest.approx(one["value"], abs=1e-9)


@pytest.mark.parametrize("name", ["hexapod", "delta", "planar-3rpr", "leg by leg"])
def test_many_readings_are_placed_at_once_as_each_is_alone(name):
    machine = load_without_limits("hexapod" if name == "leg by leg" else name)
    machine = build(document_of(machine)) if name == "leg by leg" else machine
    system = system_of(machine)
    start = np.array([actuator.coordinate for actuator in system.actuators])
    goals = start + np.random.default_rng(1).uniform(-0.06, 0.06, (4, len(start))) * system.length
    goals[2, 0] = np.nan
    if name != "leg by leg":
        goals[3] += 5.0 * system.length
    poses, placed = poses_at(system, goals)
    alone = [assembly_modes(system, goal, 0, 0.0) if np.isfinite(goal).all() else [] for goal in goals]
    assert placed.tolist() == [bool(modes) for modes in alone]
    assert not placed[2]
    for row, modes in enumerate(alone):
        if modes:
            assert {n: v[row] for n, v in poses.items()} == pytest.approx(modes[0].pose, abs=1e-9)
    if name != "leg by leg":
        at = with_values(machine, {f"pose.{n}": v[placed] for n, v in poses.items()})
        reached = np.stack([np.broadcast_to(a.coordinate, (placed.sum(),)) for a in stand(at)], axis=1)
        assert reached == pytest.approx(goals[placed], abs=1e-9)

"""Error budgets: sums that add up, distributions with known percentiles, worst cases, clearances, least cost."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from kinetostat import InputError, budget, load
from kinetostat.accuracy.errors import MachineError
from kinetostat.accuracy.model import error_model
from kinetostat.accuracy.toleranced_parts import TolerancedPart, is_about, random_inputs, toleranced_parts
from kinetostat.accuracy.tool_error import Measures, first_order, measures_of, spread_of
from kinetostat.exchange.leg_by_leg import legs_of
from kinetostat.machine.loading import build
from kinetostat.machine.parameters import values
from kinetostat.spec.tolerance_table import read_tolerances
from kinetostat.studies.allocation import allocation_for, effects_of_limits
from kinetostat.views.budget_forms import contributions_csv

LINES = {
    "hexapod": {"joints": "0.05 mm", "zeros": "0.02 mm normal", "gains": "20 um/m", "clearances": "5 um"},
    "delta": {"joints": ["0.05 mm", "0.02 deg"], "zeros": "sigma 0.005 deg"},
    "planar-3rpr": {"joints": "0.05 mm", "shared": ["IT7", "0.1 deg"], "clearances": "4 um"},
    "tripteron": {"joints": "0.02 deg", "zeros": "0.02 mm", "compliances": "10 %"},
}
"""Tolerances by machine, of every kind."""
FEW = 1 << 12


def parts_of(*groups, limit=1e-3, normal=False, cost=1.0, line=None):
    """Parts of a machine that is only a matrix of rates: a tuple of errors each."""
    return tuple(
        TolerancedPart(
            tuple(places), f"legs.{number}", f"number {number}", "length",
            "clearances" if len(places) > 1 else "geometry", "leg", line or str(number), limit, normal, cost,
        )
        for number, places in enumerate(groups)
    )  # fmt: skip


def measures(along=None):
    """The measures of a spatial machine whose actuators move everything."""
    return measures_of(np.eye(6)[None], ("rx", "ry", "rz", "x", "y", "z"), along, 1.0)[0]


def inputs(parts, rates, load=None):
    """The variables of parts at a single pose."""
    wrench = np.zeros(6) if load is None else np.array(load, dtype=float)
    return random_inputs(parts, np.asarray(rates)[None], wrench[None], 1.0)


def random_rates(errors, seed=0):
    """Rates of a machine with so many errors [6 x errors]."""
    return np.random.default_rng(seed).standard_normal((6, errors))


@pytest.mark.parametrize("name", LINES)
def test_contributions_add_up(name):
    answer = budget(load(name), tolerances=LINES[name], samples=256)
    for measure in answer.measures:
        for key in ("line", "leg", "group", "path"):
            whole = sum(answer.shares_by(key, measure).values())
            assert whole == pytest.approx(1.0 if answer.size("worst", measure)[0] > 0.0 else 0.0)
    assert set(answer.shares_by("line")) <= set(LINES[name])


@pytest.mark.parametrize("name", LINES)
def test_shares_are_what_the_variance_loses_without_a_line(name):
    """The first-order Sobol index of a line: how much smaller the variance is if its numbers are exact."""
    whole = budget(load(name), tolerances=LINES[name], samples=256)
    line = next(iter(whole.shares_by("line")))
    none = {"length": "0 mm", "angle": "0 deg", "share": "0 %"}
    exact = [none[kind] for kind in dict.fromkeys(part.kind for part in whole.parts if part.line == line)]
    rest = budget(load(name), tolerances={**LINES[name], line: exact}, samples=256)
    variance, left = (answer.size("rms", "position")[0] ** 2 for answer in (whole, rest))
    assert (variance - left) / variance == pytest.approx(whole.shares_by("line", "position")[line], rel=1e-9)


@pytest.mark.parametrize("name", LINES)
def test_drawn_machines_have_the_predicted_mean_square_and_no_worse_case(name):
    machine = load(name)
    model = error_model(machine, {}, 1)
    parts = toleranced_parts(machine, model.errors, read_tolerances(LINES[name]))
    variables = random_inputs(parts, model.rates(), model.drawn.load, 1.0)
    rows = measures_of(np.eye(6)[None], machine.family.component_names, None, 1.0)[0]
    drawn = np.concatenate(list(variables.machines(FEW, 3)))
    sizes = rows.sizes(rows.linear((drawn @ variables.columns[0].T)[:, :, None])[:, :, 0])
    _, rms, rss, worst = first_order(variables, rows)
    assert np.sqrt((sizes**2).mean(axis=0)) == pytest.approx(rms[0], rel=0.03)
    bounded = replace(variables, parts=tuple(replace(part, normal=False) for part in parts))
    even = np.concatenate(list(bounded.machines(FEW, 3)))
    sizes = rows.sizes(rows.linear((even @ variables.columns[0].T)[:, :, None])[:, :, 0])
    assert (sizes.max(axis=0) <= worst[0] * (1 + 1e-9)).all()
    assert (rms[0] <= rss[0]).all()
    assert (rss[0] <= worst[0] * (1 + 1e-9)).all()


@pytest.mark.parametrize(("normal", "quantile"), [(False, 0.95), (True, 1.959964 / 3)])
def test_percentiles_of_a_single_number_are_those_of_its_distribution(normal, quantile):
    rates = np.zeros((6, 1))
    rates[4] = 2.0
    spread, _ = spread_of(made := inputs(parts_of([0], normal=normal), rates), measures(), made.machines(1 << 14, 0))
    names = measures().names
    assert spread.usual[0, names.index("y")] == pytest.approx(2e-3 * quantile, rel=2e-3)
    assert spread.usual[0, names.index("position")] == pytest.approx(2e-3 * quantile, rel=2e-3)
    assert spread.rms[0, names.index("y")] == pytest.approx(2e-3 / (3.0 if normal else math.sqrt(3.0)))
    assert spread.worst[0, names.index("y")] == pytest.approx(2e-3)
    assert spread.usual[0, names.index("x")] == 0.0


@pytest.mark.parametrize("size", [2, 3])
def test_a_free_joint_moves_evenly_in_a_disc_or_a_ball(size):
    """Its distance from the middle keeps within r with probability r^2 or r^3, and no direction is preferred."""
    rates = np.zeros((6, size))
    rates[3 : 3 + size] = np.eye(size)
    made = inputs(parts_of(range(size)), rates)
    spread, _ = spread_of(made, measures(), made.machines(1 << 14, 0))
    names = measures().names
    assert spread.usual[0, names.index("position")] == pytest.approx(1e-3 * 0.95 ** (1 / size), rel=2e-3)
    assert spread.rms[0, names.index("x")] == pytest.approx(1e-3 / math.sqrt(size + 2))
    assert spread.worst[0, names.index("position")] == pytest.approx(1e-3)
    drawn = np.concatenate(list(made.machines(1 << 14, 0)))
    assert np.linalg.norm(drawn, axis=1).max() <= 1.0
    assert drawn.T @ drawn / len(drawn) == pytest.approx(np.eye(size) / (size + 2), abs=2e-3)


@pytest.mark.parametrize("poses", [1, 6])
def test_the_worst_case_is_that_of_all_corners(poses):
    """At many poses fewer directions are tried, from which steps must lead to the farthest corner."""
    rates = np.stack([random_rates(14, seed) for seed in range(poses)])
    made = random_inputs(parts_of(*([i] for i in range(14))), rates, np.zeros((poses, 6)), 1.0)
    rows = measures((1.0, 0.0, 0.0))
    worst = first_order(made, rows)[3]
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=14)))
    for pose in range(poses):
        sizes = rows.sizes(signs @ rows.linear(made.columns)[pose].T)
        assert worst[pose] == pytest.approx(sizes.max(axis=0), rel=1e-9)


def test_the_worst_case_of_free_joints_is_reached_and_not_exceeded():
    rates = random_rates(7, 1)
    made = inputs(parts_of([0], [1, 2, 3], [4, 5, 6]), rates)
    ways = np.random.default_rng(0).standard_normal((200_000, 7))
    for block in ([0], [1, 2, 3], [4, 5, 6]):
        ways[:, block] /= np.linalg.norm(ways[:, block], axis=1)[:, None]
    most = np.linalg.norm(ways @ made.columns[0, 3:].T, axis=1).max()
    worst = first_order(made, measures())[3][0, measures().names.index("position")]
    assert most <= worst <= 1.02 * most


def test_a_load_presses_a_joint_to_one_end_of_its_clearance():
    """The joint goes where the load does work on it: to the end along its reaction, which turns over with the load."""
    rates = random_rates(3)
    push = np.array([0, 0, 0, 0, 0, -100.0])
    free, pressed, other = (inputs(parts_of([0, 1, 2]), rates, load) for load in (None, push, -push))
    assert not free.pressed.any()
    assert pressed.pressed.all()
    assert (free.size, pressed.size) == (3, 1)
    along = rates.T @ push / np.linalg.norm(rates.T @ push)
    assert pressed.shift[0] == pytest.approx(rates @ along * 1e-3 / 2)
    assert other.shift == pytest.approx(-pressed.shift)
    assert push @ pressed.shift[0] > 0.0
    # From no play at all to all of it: a shift and an even number around it.
    assert pressed.columns[0, :, 0] == pytest.approx(pressed.shift[0])
    assert pressed.errors[:, 0] + pressed.drawn == pytest.approx(1e-3 * along)
    mean, _, _, worst = first_order(pressed, measures())
    assert worst == pytest.approx(2.0 * mean)


def test_a_joint_is_free_at_poses_where_the_load_does_not_reach_it():
    """Each pose has the answer that it has alone, whatever happens to the joints at the others."""
    rates, parts = np.stack([random_rates(6, seed) for seed in range(3)]), parts_of([0, 1, 2], [3, 4], [5])
    load = np.array([0.0, 0, 0, 0, 0, -100.0])
    rates[1, 5, :3] = 1e-14  # at the second pose the load does no work on the first joint, at the third on neither
    rates[2, 5, :5] = 1e-14
    whole = random_inputs(parts, rates, np.tile(load, (3, 1)), 1.0)
    slab = random_inputs(parts, rates[2:], load[None], 1.0, others=True)
    assert whole.pressed.tolist() == [[True, True, False], [False, True, False], [False, False, False]]
    assert (whole.owner == slab.owner).all()
    together = first_order(whole, measures())
    for pose in range(3):
        alone = inputs(parts, rates[pose], load)
        for many, single in zip(together, first_order(alone, measures()), strict=True):
            assert many[pose] == pytest.approx(single[0], rel=1e-2, abs=1e-12)
        for by, table in effects_of_limits(whole, measures(), "position").items():
            assert table[pose] == pytest.approx(effects_of_limits(alone, measures(), "position")[by][0])
    rows = spread_of(whole, measures(), whole.machines(FEW, 0))[0].rms
    drawn = np.concatenate(list(whole.machines(FEW, 0)))
    for pose in range(3):
        moved = whole.shift[pose] + drawn @ whole.columns[pose].T
        assert np.sqrt((moved**2).mean(axis=0)) == pytest.approx(rows[pose, :6], rel=0.02)


def test_a_component_is_parasitic_if_no_actuator_moves_it_at_any_pose(monkeypatch):
    """At x = 0 no actuator turns this platform about z, elsewhere they do: the order of the poses decides nothing."""
    machine = load("passive-leg-4dof-driven")
    beside, middle = machine.with_values({"x": 0.02}), machine.with_values({"x": 0.0})
    lines = {"zeros": ["0.02 mm", "0.02 deg"]}
    assert budget(middle, tolerances=lines, samples=8).parasitic == ("rz", "y")
    assert budget(beside, tolerances=lines, samples=8).parasitic == ("y",)
    for poses in ([0.02, 0.0], [0.0, 0.02]):
        together = budget(machine, {"x": poses}, tolerances=lines, samples=8)
        with monkeypatch.context() as patch:
            patch.setattr("kinetostat.studies.budget.DRAWN_POSES_AT_ONCE", 1)
            one_by_one = budget(machine, {"x": poses}, tolerances=lines, samples=8)
        assert one_by_one.parasitic == together.parasitic == ("y",)
        assert one_by_one.freedoms == together.freedoms == 4


def test_loads_at_named_points_press_joints_together():
    """The reaction is that of their sum, and of a load that another one balances nothing is left."""
    lines = {"clearances": "5 um"}
    point, force = 'load.tip.point=[0, 0, "0.5 m"]', "load.tip.force=[0, 30, -400]"
    named = budget(load("hexapod", [point, force]), tolerances=lines, samples=64)
    # The same wrench at the platform point: 0.5 m times 30 N about x.
    whole = budget(
        load("hexapod", ["load.force=[0, 30, -400]", "load.moment=[-15, 0, 0]"]), tolerances=lines, samples=64
    )
    assert named.pressed == whole.pressed
    assert named.spread.mean == pytest.approx(whole.spread.mean)
    assert named.spread.mean.max() > 1e-6
    balanced = budget(load("hexapod", [point, force, "load.force=[0, -30, 400]", "load.moment=[15, 0, 0]"]),
                      tolerances=lines, samples=64)  # fmt: skip
    assert not balanced.pressed


def test_a_tripteron_is_pressed_where_its_weight_is_carried():
    """Each of its three legs carries forces along one axis; a joint of the others is pressed where moments reach it."""
    machine = load("tripteron", ["load.force=[0, 0, -100]"])
    many = budget(machine, {"x": ["45 cm", "50 cm", "55 cm"]}, tolerances={"clearances": "5 um"})
    for number, x in enumerate((0.45, 0.5, 0.55)):
        alone = budget(machine.with_values({"x": x}), tolerances={"clearances": "5 um"}, samples=many.samples)
        assert set(alone.pressed) <= set(many.pressed)
        assert not alone.size("worst", "rotation").any()  # a Tripteron's legs do not turn it, to the last digit
        assert "parasitic motions" not in alone.message
        for name, close in (("mean", 1e-6), ("rms", 1e-6), ("worst", 1e-2)):
            assert getattr(many.spread, name)[number] == pytest.approx(
                getattr(alone.spread, name)[0], rel=close, abs=1e-12
            )


def test_the_joints_of_a_strut_are_pressed_along_it():
    """The reaction of a strut between two balls has its direction, whatever else the machine does."""
    machine = load("hexapod", ["load.force=[50, 20, -400]", "pose.x=5 mm", "pose.roll=3 deg"])
    model = error_model(machine, {}, 1)
    parts = toleranced_parts(machine, model.errors, read_tolerances({"clearances": "5 um"}))
    made = random_inputs(parts, model.rates(), model.drawn.load, 0.3)
    assert made.pressed.all()
    legs = {leg.name: leg for leg in machine.configure().legs}
    for number, part in enumerate(parts):
        moved = made.errors[list(part.errors), number]
        axis = np.array(legs[part.leg].lines[0].direction.components(), dtype=float)
        size = np.linalg.norm(moved)
        assert size == pytest.approx(2.5e-6)
        assert abs(moved @ axis) == pytest.approx(size * np.linalg.norm(axis))


def test_under_no_load_the_budget_has_no_systematic_error():
    lines = {"clearances": "5 um"}
    forces: tuple[list[str], ...] = ([], ["load.force=[0, 0, -400]"])
    free, loaded = (budget(load("hexapod", force), tolerances=lines, samples=64) for force in forces)
    assert not free.pressed
    assert not free.size("mean", "position").any()
    assert len(loaded.pressed) == 12
    assert loaded.size("mean", "z")[0] > 1e-6
    assert "presses 12 joints" in loaded.message


def test_the_later_line_holds_and_clearances_are_only_meant_by_name():
    lines = {"joints": "1 mm", "legs.leg 1.*": "2 mm", "legs.leg 1.base joint": "3 mm", "zeros": "4 mm"}
    answer = budget(load("hexapod"), tolerances=lines, samples=64)
    limits = {part.path: part.limit for part in answer.parts}
    assert limits["legs.leg 1.base joint.x"] == 3e-3
    assert limits["legs.leg 1.platform joint.platform.x"] == 2e-3
    assert limits["legs.leg 2.base joint.x"] == 1e-3
    assert limits["legs.leg 1.actuator.zero"] == 4e-3
    assert not any("clearance" in path for path in limits)
    named = budget(load("hexapod"), tolerances={"legs.leg 1.*.clearance.*": "0.1 mm"}, samples=64)
    assert [part.path for part in named.parts] == [
        "legs.leg 1.base joint.clearance", "legs.leg 1.platform joint.clearance",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("about", "paths"),
    [
        ("legs.leg 1", [0, 1]),
        ("legs.leg 1.*", [0, 1]),
        ("legs.*.x", [0, 2]),
        ("*", [0, 1, 2, 3]),
        ("legs.*1*.x", [0]),
        ("legs.*leg 1*leg 1.x", []),
        ("geometry.base_radius", [3]),
        ("geometry.base", []),
        ("a*" * 60, []),
    ],
)
def test_a_path_fits_where_its_parts_stand_in_order(about, paths):
    errors = [
        MachineError(path, "length", "geometry", "", "")
        for path in ("legs.leg 1.base.x", "legs.leg 1.base.y", "legs.leg 2.base.x", "geometry.base_radius")
    ]
    assert [place for place, error in enumerate(errors) if is_about(about, error)] == paths


def test_fields_of_the_file_are_their_own_nominal_sizes():
    answer = budget(load("hexapod"), tolerances={"geometry.base_radius": "IT7"}, samples=64)
    radius = values(load("hexapod"))["geometry.base_radius"]
    assert 0.05 < radius <= 0.08 or 0.08 < radius <= 0.25
    assert answer.parts[0].limit == read_tolerances({"a": "IT7"})["a"].deviations[0].within("length", radius)


def test_what_no_actuator_corrects_is_named_parasitic():
    """A Delta turns by its errors; a hexapod corrects everything."""
    delta = budget(load("delta"), tolerances=LINES["delta"], samples=64)
    assert delta.freedoms == 3
    assert delta.parasitic == ("rx", "ry", "rz")
    assert delta.size("rms", "parasitic rotation") == pytest.approx(delta.size("rms", "rotation"))
    assert delta.size("rms", "parasitic position")[0] < 1e-9 * delta.size("rms", "position")[0]
    assert "no actuator moves rx ry rz" in delta.message
    hexapod = budget(load("hexapod"), tolerances=LINES["hexapod"], samples=64)
    assert (hexapod.freedoms, hexapod.parasitic) == (6, ())
    assert not any(name.startswith("parasitic") for name in hexapod.measures)


def test_corrections_take_away_as_much_as_they_can():
    """Of two drives that move x with a turn about y, and y: what is left of an error is nothing that these could do."""
    drives = np.zeros((1, 6, 2))
    drives[0, 3, 0], drives[0, 1, 0], drives[0, 4, 1] = 1.0, 0.5, 1.0
    rows, freedoms, parasitic = measures_of(drives, ("rx", "ry", "rz", "x", "y", "z"), None, 2.0)
    assert (freedoms, parasitic) == (2, ("rx", "rz", "z"))
    left = rows.linear(np.concatenate([drives, np.eye(6)[None]], axis=2))[0, 6:12]
    assert left[:, :2] == pytest.approx(np.zeros((6, 2)), abs=1e-12)
    weights = np.array([4.0] * 3 + [1.0] * 3)
    assert drives[0].T @ (weights[:, None] * left[:, 2:]) == pytest.approx(np.zeros((2, 6)), abs=1e-12)


def test_poses_of_a_list_have_the_answers_of_each_pose():
    machine, lines = load("hexapod"), LINES["hexapod"]
    many = budget(machine, {"x": ["0 mm", "5 mm", "0 mm"], "z": ["135 mm", "140 mm", "900 mm"]}, tolerances=lines)
    assert many.settled.tolist() == [True, True, False]
    assert np.isnan(many.spread.usual[2]).all()
    for number, pose in enumerate(({"x": 0.0, "z": 0.135}, {"x": 5e-3, "z": 0.14})):
        alone = budget(machine.with_values(pose), tolerances=lines, samples=many.samples)
        for name, close in (("rms", 1e-9), ("rss", 1e-9), ("usual", 0.02), ("worst", 1e-3)):
            assert getattr(many.spread, name)[number] == pytest.approx(getattr(alone.spread, name)[0], rel=close)
    assert (many.spread.everywhere >= np.nanmax(many.spread.usual, axis=0) * (1 - 1e-12)).all()


def least(weights, costs, power, wanted=1.0):
    """An allocation of lines with given weights at each pose [poses x lines]."""
    parts = tuple(part for k, c in enumerate(costs) for part in parts_of([k], cost=c, line=str(k)))
    by = "rss" if power == 2 else "worst"
    return allocation_for(parts, [{by: np.array(weights, dtype=float)}], wanted, by, "position")


@pytest.mark.parametrize("power", [1, 2])
def test_least_cost_at_a_single_pose_is_the_closed_form(power):
    weights, costs = np.array([[4.0, 1.0, 0.5]]), np.array([1.0, 2.0, 5.0])
    answer = least(weights, costs, power, 2.0)
    assert (weights[0] / 2.0**power) @ answer.factors**power == pytest.approx(1.0)
    # Where cost is least, all lines give the same for what they cost.
    prices = costs / (weights[0] * answer.factors ** (power + 1))
    assert prices == pytest.approx(np.full(3, prices[0]))
    assert answer.cost < answer.evenly
    source = np.random.default_rng(0)
    for _ in range(200):
        other = answer.factors * np.exp(0.1 * source.standard_normal(3))
        other /= ((weights[0] / 2.0**power) @ other**power) ** (1.0 / power)
        assert (costs / other).sum() >= answer.cost * (1 - 1e-12)


@pytest.mark.parametrize("power", [1, 2])
def test_least_cost_keeps_the_error_at_every_pose(power):
    source = np.random.default_rng(1)
    weights, costs = source.uniform(0.1, 2.0, (50, 4)), source.uniform(0.5, 3.0, 4)
    answer = least(weights, costs, power)
    errors = weights @ answer.factors**power
    assert errors.max() == pytest.approx(1.0, rel=1e-6)
    for _ in range(300):
        other = answer.factors * np.exp(0.05 * source.standard_normal(4))
        other /= (weights @ other**power).max() ** (1.0 / power)
        assert (costs / other).sum() >= answer.cost * (1 - 1e-6)


def test_a_line_without_effect_may_be_as_loose_as_anybody_likes():
    answer = least([[1.0, 0.0]], [1.0, 1.0], 2)
    assert answer.factors.tolist() == [1.0, np.inf]
    assert answer.cost == pytest.approx(1.0)


@pytest.mark.parametrize("by", ["rss", "worst"])
def test_the_allocated_tolerances_give_the_wanted_error(by):
    machine, lines = load("hexapod"), {"joints": "0.05 mm", "zeros": "0.02 mm", "clearances": "5 um"}
    allocation = budget(machine, tolerances=lines, allocate="0.03 mm", by=by, samples=64).allocation
    limits = {"joints": 5e-5, "zeros": 2e-5, "clearances": 5e-6}
    new = {name: f"{limits[name] * f} m" for name, f in zip(allocation.lines, allocation.factors, strict=True)}
    reached = budget(machine, tolerances=new, samples=64).size(by, "position")[0]
    # A sum of lengths is more than the length of a sum, so that the worst case is kept with room to spare.
    assert reached == pytest.approx(3e-5) if by == "rss" else 1e-5 < reached <= 3e-5
    assert allocation.cost <= allocation.evenly


def test_along_a_direction_the_worst_case_is_met():
    machine, lines = load("hexapod"), {"joints": "0.05 mm", "zeros": "0.02 mm"}
    answer = budget(machine, tolerances=lines, along=(0, 0, 2), allocate="0.03 mm", by="worst", samples=64)
    assert answer.leading == "along"
    assert answer.size("rms", "along") == pytest.approx(answer.size("rms", "z"))
    triples = zip(answer.allocation.lines, (5e-5, 2e-5), answer.allocation.factors, strict=True)
    new = {name: f"{size * factor} m" for name, size, factor in triples}
    assert budget(machine, tolerances=new, samples=64).size("worst", "z")[0] == pytest.approx(3e-5)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({}, r"has no tolerances.*under \[tolerances\]"),
        ({"tolerances": {"jonts": "1 mm"}}, 'did you mean "joints"'),
        ({"tolerances": {"joints": "1 %"}}, "the numbers that it is about are lengths; write for example \"0.05 mm\""),
        ({"tolerances": {"joints": "IT7"}}, 'write it, for example "IT7 at 300 mm"'),
        ({"tolerances": {"joints": "1 mm"}, "allocate": "5 kg"}, "allocate, the wanted error"),
        ({"tolerances": {"joints": "1 mm"}, "allocate": "0 mm"}, "greater than 0"),
        ({"tolerances": {"joints": "1 mm"}, "along": (0, 0)}, "give three (finite )?numbers"),
        ({"tolerances": {"joints": "1 mm"}, "along": (0, 0, 0)}, "not all zero"),
        ({"tolerances": {"joints": "1 mm"}, "samples": -1}, "samples is -1"),
        ({"tolerances": {"joints": "1 mm"}, "by": "sum"}, "by is"),
        ({"tolerances": {"joints": "1 mm"}, "poses": {"x": [0.0]}, "exact": 10}, "leave the poses out, or exact"),
        ({"tolerances": {"joints": "1 mm"}, "poses": {"x": [0.0]}, "ranges": ["x=0:1:3"]}, "leave one of them out"),
        ({"tolerances": {"joints": "1 mm"}, "ranges": ["base_radius=0.1:0.2:3"]}, "not a coordinate of the pose"),
        ({"tolerances": {"joints": "1 mm"}, "poses": {"z": [9.0]}}, "has no result at"),
    ],
)  # fmt: skip
def test_a_question_that_cannot_be_answered_is_refused(arguments, reason):
    with pytest.raises(InputError, match=reason):
        budget(load("hexapod"), **arguments)


def test_lengths_are_of_the_rows_that_they_name():
    rows = Measures({"x": np.eye(6)[3], "y": np.eye(6)[4]}, {"position": ("x", "y")}, {})
    assert rows.sizes(np.array([[3.0, -4.0]])) == pytest.approx(np.array([[3.0, 4.0, 5.0]]))


def test_a_leg_whose_name_is_a_formula_is_none_in_the_table():
    text = legs_of("planar-3rpr").replace("leg 1", "=1+1")
    table = contributions_csv(budget(build(text, "legs"), tolerances={"joints": "0.05 mm"}, samples=64))
    assert ",'=1+1," in table
    assert ",=1+1," not in table

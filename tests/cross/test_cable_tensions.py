"""Tensions and capacity of cable machines: published ones, those of the state of rest, and linear programmes."""

import numpy as np
import pytest
from scipy.optimize import linprog

from kinetostat import analyze, evaluate, evaluate_grid, load, state_of, tensions, under_load, workspace
from kinetostat.engine.batch import evaluate as evaluate_points
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.cables import cables_of, leaving_points
from kinetostat.kinematics.status import Status
from kinetostat.spec.errors import InputError
from kinetostat.studies.report import REPORT_QUESTIONS, Answers
from kinetostat.studies.sensitivity import sensitivity
from kinetostat.views.analysis import LOADED

PUBLISHED = [361.2, 361.6, 387.3, 355.2, 337.7, 386.7, 367.8, 367.5]
"""Least-norm tensions of CoGiRo without payload at (0, 0, 2) m, N."""
KITE = """
schema = 1
name = "kite"
family = "legs"
space = "planar"
legs = [
  { name = "a", type = "cable", from = [-1, 2, 0],  to = [0.2, 0.1, 0],   stiffness = 1e5 },
  { name = "b", type = "cable", from = [1, 2, 0],   to = [-0.2, 0.1, 0],  stiffness = 1e5 },
  { name = "c", type = "cable", from = [-1, -2, 0], to = [0.2, -0.1, 0],  stiffness = 1e5 },
  { name = "d", type = "cable", from = [1, -2, 0],  to = [-0.2, -0.1, 0], stiffness = 1e5 },
]
[platform]
point = [0, 0, 0]
[pose]
x = 0.1
y = -0.2
yaw = 0.05
[load]
force = [20, -100, 0]
moment = [0, 0, 5]
min_tension = 10
max_tension = 400
"""


@pytest.fixture
def kite(tmp_path):
    path = tmp_path / "kite.toml"
    path.write_text(KITE, "utf-8")
    return load(path)


def values(machine, *names, **columns):
    given = {f"pose.{name}": np.atleast_1d(np.array(column, dtype=float)) for name, column in columns.items()}
    return evaluate_points(machine, PointTable(given), names)


def poses(count, seed=0):
    draw = np.random.default_rng(seed)
    sides = {"x": 5.0, "y": 4.0, "z": 1.0, "roll": 0.15, "pitch": 0.15, "yaw": 0.2}
    columns = {name: draw.uniform(-side, side, count) for name, side in sides.items()}
    return columns | {"z": columns["z"] + 2.0}


def structure(machine, columns, row):
    """Wrenches of unit tensions at P with moments in N·m, from the points of the file alone, and the weight."""
    roll, pitch, yaw = (columns[name][row] for name in ("roll", "pitch", "yaw"))
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in (roll, pitch, yaw))
    turn = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    turn = turn @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    place = np.array([columns[name][row] for name in "xyz"])
    tables, home, lines = machine.tables, np.array([0.0, 0.0, 2.0]), []
    for number in range(1, 9):
        near, far = (np.array(tables[f"legs.cable {number}.{end}"].point) for end in ("anchor", "eye"))
        arm = turn @ (far - home)
        line = near - place - arm
        line = line / np.linalg.norm(line)
        lines.append([*np.cross(arm, line), *line])
    weight = np.array([0.0, 0.0, -9.81 * tables["tool"].mass])
    return np.array(lines).T, np.array([*np.cross(turn @ tables["tool"].centre_of_mass, weight), *weight])


def test_the_bundled_machine_has_the_published_tensions():
    result = evaluate(load("cogiro"), {"z": [2.0]}, ["tension", "least_tension", "greatest_tension", "tension_reserve"])
    tensions = [float(result[f"tension_{number}"][0]) for number in range(1, 9)]
    assert np.round(tensions, 1).tolist() == PUBLISHED
    assert float(result["least_tension"][0]) == pytest.approx(min(tensions), rel=1e-14)
    assert float(result["greatest_tension"][0]) == pytest.approx(max(tensions), rel=1e-14)
    assert float(result["tension_reserve"][0]) == pytest.approx(min(tensions) - 50.0, rel=1e-13)


@pytest.mark.parametrize("settings", [[], ["load.min_tension=200"], ["cables.level=600"], ["cables.exponent=6"]])
def test_quantities_are_the_tensions_of_the_state_of_rest(settings):
    machine = load("cogiro", ["pose.x=3", "pose.y=-2", "pose.roll=5 deg", *settings])
    state = under_load(machine)
    quick = values(machine, *(f"tension_{n}" for n in range(1, 9)), x=3.0)
    assert [spring.load for spring in state.springs] == pytest.approx([v[0] for v in quick.values.values()], rel=1e-11)
    assert np.abs(state.displacement).max() < 1e-11


def test_quantities_of_a_planar_machine_are_those_of_its_state_of_rest(kite):
    quick = values(kite, "tension_1", "tension_2", "tension_3", "tension_4", x=0.1)
    loads = [spring.load for spring in under_load(kite).springs]
    assert loads == pytest.approx([v[0] for v in quick.values.values()], rel=1e-11)
    assert min(loads) == pytest.approx(10.0, rel=1e-11)


def test_capacity_is_how_far_linear_programmes_can_push_at_poses_all_over_the_room():
    """In N, with moments over the length of the machine: along 40 directions none is nearer, and 1e-9 decides."""
    columns = poses(25)
    machine = load("cogiro", ["load.max_tension=700", "load.min_tension=100"])
    result = values(machine, "capacity", "least_tension", **columns)
    length = float(machine.chains().length)
    units = np.array([1.0 / length] * 3 + [1.0] * 3)
    draw = np.random.default_rng(1)
    for row in range(25):
        lines, weight = structure(machine, columns, row)
        found = linprog(np.zeros(8), A_eq=lines, b_eq=-weight, bounds=(100.0, 700.0))
        assert (result.status[row] == 0) == (found.status == 0)
        inside = values(machine, "capacity", **{name: column[row] for name, column in columns.items()})
        capacity = float(inside.values["capacity"][0])
        assert (capacity >= 0.0) == (found.status == 0)
        for way in draw.normal(size=(20, 6)) if found.status == 0 else ():
            way = way / np.linalg.norm(way)
            reached = linprog(
                np.append(np.zeros(8), -1.0),
                A_eq=np.column_stack([units[:, None] * lines, -way]),
                b_eq=-units * weight,
                bounds=[(100.0, 700.0)] * 8 + [(None, None)],
            )
            assert -reached.fun >= capacity - 1e-9


def test_a_box_of_wrenches_lowers_the_capacity_to_that_of_its_worst_corner(kite):
    box = ["cables.force_box=[30, 20, 0]", "cables.moment_box=[0, 0, 4]"]
    least = np.inf
    for x, y, m in np.ndindex(2, 2, 2):
        corner = [f"load.force=[{20 + 60 * x - 30}, {-100 + 40 * y - 20}, 0]", f"load.moment=[0, 0, {5 + 8 * m - 4}]"]
        machine = kite.with_values({path: eval(value) for path, _, value in (c.partition("=") for c in corner)})
        least = min(least, values(machine, "capacity", x=0.1).values["capacity"][0])
    boxed = kite.with_values({path: eval(value) for path, _, value in (c.partition("=") for c in box)})
    assert values(boxed, "capacity", x=0.1).values["capacity"][0] == pytest.approx(least, rel=1e-12)


def test_a_hanging_machine_never_closes_on_all_wrenches_and_a_held_one_does(kite):
    assert values(load("cogiro"), "wrench_closure", x=[0.0, 2.0]).values["wrench_closure"].tolist() == [0.0, 0.0]
    assert values(kite, "wrench_closure", x=0.1).values["wrench_closure"][0] > 0.01


def test_workspaces_maps_and_searches_take_them(kite):
    ranges = ["x=-6 m:6 m:7", "y=-5 m:5 m:5"]
    region = workspace(load("cogiro", ["load.max_tension=900"]), ranges, ["capacity > 50 N", "tension_1 < 600 N"])
    assert 0 < region.nodes["inside"] < 35
    grid = evaluate_grid(load("cogiro"), ranges, ["tension", "free_stiffness_z"])
    assert grid["tension_8"].attrs["units"] == "N"
    assert "tension_9" not in grid
    held = grid["status"].values == 0
    least = grid[[f"tension_{n}" for n in range(1, 9)]].to_array().min("variable").values
    assert least[held].min() > 50.0 - 1e-9
    assert np.isfinite(grid["free_stiffness_z"].values[held]).all()
    with pytest.raises(InputError, match="has no derivatives: which tensions are at their bounds changes"):
        sensitivity(load("cogiro"), ["least_tension"])


@pytest.mark.parametrize(
    ("name", "quantity", "message"),
    [
        ("hexapod", "capacity", '"capacity" has no meaning here: .* lacks cables alone as legs'),
        ("cogiro", "tension_9", '"tension_9" is not known: CoGiRo has 8 cables, tension_1 to tension_8'),
    ],
)
def test_tensions_that_are_not_there_are_refused(name, quantity, message):
    with pytest.raises(InputError, match=message):
        evaluate_grid(load(name), ["x=0:1 mm:2"], [quantity])


def test_poses_that_no_tensions_hold_are_not_at_rest():
    result = values(load("cogiro"), "least_tension", z=[2.0, 5.9])
    assert [int(code) for code in result.status] == [0, 6] or result.status[1] != 0
    assert np.isnan(result.values["least_tension"][1])


def test_cables_that_hang_over_pulleys_hold_the_load_by_their_own_shapes():
    """Forces of the cables at the platform, from spans and tensions that the test reads, balance the weight."""
    machine = load("cogiro", ["pose.x=3", "pose.yaw=10 deg", "cables.linear_density=0.3", "cables.pulley_radius=8 cm"])
    cables = cables_of(machine, (1.0,) * 8, 1)
    shape = cables.shape
    assert cables.tensions[1][0]
    span = cables.near - cables.far
    ahead = span[0] * [1.0, 1.0, 0.0]
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    pulls = shape.across[0][:, None] * ahead + shape.up[0][:, None] * [0.0, 0.0, 1.0]
    assert np.linalg.norm(pulls, axis=1) == pytest.approx(cables.tensions[0][0], rel=1e-10)
    columns = {name: np.array([0.0]) for name in ("roll", "pitch")} | {"yaw": np.array([np.radians(10)])}
    columns |= {"x": np.array([3.0]), "y": np.array([0.0]), "z": np.array([2.0])}
    _, weight = structure(machine, columns, 0)
    assert pulls.sum(axis=0) == pytest.approx(-weight[3:], abs=1e-9)
    assert np.cross(cables.far[0] - [3.0, 0.0, 2.0], pulls).sum(axis=0) == pytest.approx(-weight[:3], abs=1e-9)
    level, rise = shape.spans
    assert np.hypot(level, rise)[0] == pytest.approx(np.linalg.norm(span[0], axis=1), abs=1e-10)
    guides = np.array([machine.tables[f"legs.cable {n}.anchor"].point for n in range(1, 9)])
    again = leaving_points(guides[None], cables.far, np.array([0.08]), shape.base_slope)[0]
    assert cables.near == pytest.approx(again, abs=1e-11)


def test_heavy_cables_whose_shapes_do_not_settle_are_not_at_rest():
    """Tensions that swing between two shapes balance the load in neither of them, so that there are no numbers."""
    machine = load("cogiro", ["pose.x=3", "pose.y=-2", "cables.linear_density=1", "load.min_tension=5"])
    names = ("least_tension", "capacity", "wrench_closure")
    result = values(machine, *names, x=[3.0, 0.0], y=[-2.0, 0.0])
    assert result.status.tolist() == [Status.NO_REST, Status.OK]
    assert all(np.isnan(result.values[name]).tolist() == [True, False] for name in names)
    answer = tensions(machine)
    assert answer.status == Status.NO_REST
    assert "do not settle" in answer.message
    assert answer.sag_message == "The sag of cables without a shape is not known."
    assert all(np.isnan([cable.length, cable.sag]).all() for cable in answer.cables)


def test_cables_of_hardly_any_weight_over_tiny_pulleys_are_straight_ones():
    light = load("cogiro", ["cables.linear_density=1e-9", "cables.pulley_radius=1e-9"])
    pairs = zip(tensions(light).cables, tensions(load("cogiro")).cables, strict=True)
    assert all(a.tension == pytest.approx(b.tension, rel=1e-6) for a, b in pairs)


def test_the_answer_has_the_published_tensions_a_reserve_and_the_worst_of_further_loads():
    answer = tensions(load("cogiro"))
    assert [round(cable.tension, 1) for cable in answer.cables] == PUBLISHED
    assert min(cable.reserve for cable in answer.cables) == pytest.approx(min(PUBLISHED) - 50.0, abs=0.05)
    assert "Cables are straight here" in answer.sag_message
    pushes = {"load.force.0": [300.0, -300.0], "load.force.1": [0.0, 50.0]}
    each = [values(load("cogiro", [f"load.force=[{x}, {y}, 0]"]), "capacity", x=0.0) for x, y in ((300, 0), (-300, 50))]
    both = tensions(load("cogiro"), pushes)
    assert both.required == 2
    assert both.capacity == pytest.approx(min(float(one.values["capacity"][0]) for one in each), rel=1e-12)
    with pytest.raises(InputError, match=r"wrenches has pose.x, which moves the machine"):
        tensions(load("cogiro"), {"x": [0.0]})


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            ["cables.pulley_radius=5 cm", "cables.linear_density=1", "load.gravity_angle=5 deg"],
            "gravity is not along z",
        ),
        (["cables.exponent=1.5"], "it must be at least 2"),
    ],
)
def test_what_cables_cannot_be_is_refused(settings, message):
    with pytest.raises(InputError, match=message):
        tensions(load("cogiro", settings))


def test_reports_have_a_section_on_tensions_and_loaded_answers_say_what_they_leave_out():
    sagging = load("cogiro", ["cables.linear_density=0.064"])
    lines = dict(LOADED.sentences(under_load(sagging)))
    assert lines["Cables"] == "Cables are straight here, without weight and pulleys; kinetostat tensions counts both."
    asked = next(question for question in REPORT_QUESTIONS if question.name == "tensions")
    assert asked.when(Answers(sagging, state_of(sagging), analyze(sagging)))
    hexapod = load("hexapod")
    assert not asked.when(Answers(hexapod, state_of(hexapod), analyze(hexapod)))

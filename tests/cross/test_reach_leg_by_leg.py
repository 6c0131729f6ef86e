"""Reach of machines that are closed by iteration: that of their closed form, wherever the home pose lies."""

import numpy as np
import pytest

from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.kinematics import closure
from kinetostat.kinematics.closing import free_coordinates
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.leg_gaps import Problems, goal_of, problems_of
from kinetostat.kinematics.nearest import nearest_pose
from kinetostat.kinematics.status import Status
from kinetostat.kinematics.ways import too_far_or_near
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.loading import build
from kinetostat.machine.parameters import values, with_values
from kinetostat.spec import document
from kinetostat.studies.workspace import workspace
from machines import load_without_limits, written

CRANKS = """
schema = 1
name = "cranks"
family = "hexapod-rus"
[geometry]
base_radius = "300 mm"
base_angles = ["-12 deg", "12 deg", "108 deg", "132 deg", "228 deg", "252 deg"]
platform_radius = "120 mm"
platform_angles = ["-45 deg", "45 deg", "75 deg", "165 deg", "195 deg", "-75 deg"]
platform_height = 0
crank_length = "250 mm"
rod_length = "350 mm"
[stiffness]
actuator = 1e5
[pose]
x = 0
y = 0
z = 0.45
roll = 0
pitch = 0
yaw = 0
"""
FIVE_BAR = """
[[legs]]
name = "left"
joints = [
  { name = "motor", type = "revolute", joins = ["base", "crank"], point = [-0.1, 0, 0], axis = [0, 0, 1] },
  { name = "elbow", type = "revolute", joins = ["crank", "platform"], point = [-0.16, 0.14, 0], axis = [0, 0, 1] },
]
[[legs]]
name = "right"
joints = [
  { name = "motor", type = "revolute", joins = ["base", "crank"], point = [0.1, 0, 0], axis = [0, 0, 1] },
  { name = "elbow", type = "revolute", joins = ["crank", "rod"], point = [0.16, 0.14, 0], axis = [0, 0, 1] },
  { name = "wrist", type = "revolute", joins = ["rod", "platform"], point = [0, 0.25, 0], axis = [0, 0, 1] },
]
"""
"""Its platform is one of its bars; yaw follows from the legs."""
REACHED = (Status.OK, Status.SINGULAR, Status.JOINT_LIMIT)


def cranks(z=0.45):
    """The family, and itself leg by leg with its home pose at a height, m."""
    family = with_values(build(document.parse(CRANKS, "cranks"), "cranks"), {"pose.z": z})
    return family, build(document_of(family), "cranks")


def poses(count, far, turned, seed=4):
    """Random coordinates: a point within a box and small angles."""
    rng = np.random.default_rng(seed)
    point = {f"pose.{name}": rng.uniform(-far, far, count) for name in "xyz"}
    return point | {f"pose.{name}": rng.uniform(-turned, turned, count) for name in ("roll", "pitch", "yaw")}


def reached(machine, columns):
    with np.errstate(all="ignore"):
        return np.isin(np.asarray(respond(with_values(machine, columns)).status), REACHED)


@pytest.mark.parametrize("z", [0.25, 0.37, 0.5])
def test_a_pose_is_reached_where_its_closed_form_reaches_it(z):
    family, legs = cranks(z)
    columns = poses(300, 0.5, 0.4)
    status = np.asarray(solve_joints(with_values(legs, columns)).status)
    inside = reached(family, columns)
    assert 30 < inside.sum() < 270
    assert (status[inside] == Status.OK).all()
    assert (status[~inside] == Status.OUT_OF_REACH).all(), "which is shown, not supposed"


def test_poses_beyond_flat_parallelograms_are_shown_to_be_out_of_reach():
    """The least gap lies where the bars are flat; the angles of the platform are dependent."""
    family = load_without_limits("orthoglide")
    columns = {path: values for path, values in poses(30, 0.35, 0.0).items() if path[-1] in "xyz"}
    inside = reached(family, columns)
    status = np.asarray(solve_joints(with_values(build(document_of(family), "orthoglide"), columns)).status)
    assert 5 < inside.sum() < 25
    assert (np.isin(status, REACHED) == inside).all()
    assert (status[~inside] == Status.OUT_OF_REACH).mean() > 0.9


@pytest.mark.parametrize("name", ["delta", "hexapod-rus", "orthoglide", "planar-3rrr", "five-bar"])
def test_the_lengths_of_links_show_no_pose_out_of_reach_that_is_not(name, monkeypatch):
    """Solutions are followed to all poses, beyond the bound too; it is passed at most of those that are not reached."""
    five_bar = build(written("five-bar", (0, 0.25, 0), {"x": 0.02, "y": 0.24}) + FIVE_BAR)
    machine = five_bar if name == "five-bar" else build(document_of(load_without_limits(name)), name)
    here, rng = values(machine), np.random.default_rng(2)
    fields = [path for path in here if path in ("pose.x", "pose.y", "pose.z")]
    columns = {path: here[path] + rng.uniform(-0.5, 0.5, 60) for path in fields}
    with monkeypatch.context() as patched:
        patched.setattr(closure, "too_far_or_near", lambda problems, _: np.zeros(len(problems.poses), dtype=bool))
        status = np.asarray(solve_joints(with_values(machine, columns)).status)
    chains = with_values(machine, columns).chains()
    given = stacked_columns(chains.pose.values(), 60)
    beyond = np.zeros(60, dtype=bool)
    for problems in problems_of(chains, 60, free_coordinates(chains)):
        goal = goal_of(problems, given)
        beyond[problems.poses[too_far_or_near(problems, goal)]] = True
    assert not (beyond & (status == Status.OK)).any()
    assert beyond.sum() > 0.7 * (status != Status.OK).sum() > 5


@pytest.mark.parametrize("name", ["hexapod-hardware", "tripteron"])
def test_a_pose_has_the_same_answer_alone_and_in_a_batch(name):
    machine = load_without_limits(name)
    columns = {path: values[:6] for path, values in poses(6, 0.35, 0.9).items()}
    columns["pose.z"] = columns["pose.z"] + 0.3
    if name == "tripteron":
        machine = load_without_limits(name, ["pose.roll=0"])  # more than it can choose, so that it is iterated
        columns = {f"pose.{c}": columns[f"pose.{c}"] + 0.5 for c in "xyz"} | {"pose.roll": np.arange(6) % 2 * 0.01}
    together = solve_joints(with_values(machine, columns))
    for i in range(6):
        alone = solve_joints(with_values(machine, {path: float(values[i]) for path, values in columns.items()}))
        assert alone.status == together.status[i]
        if alone.status == Status.OK:
            assert list(alone.coordinates) == pytest.approx([q[i] for q in together.coordinates], abs=1e-12)


def test_a_way_round_that_is_longer_than_half_a_turn_is_not_taken():
    here, there = (load_without_limits("hexapod-hardware", [f'pose.roll="{roll} deg"']) for roll in (-5, 355))
    assert solve_joints(here).coordinates == pytest.approx(solve_joints(there).coordinates, abs=1e-9)


def test_the_nearest_pose_is_on_the_border_and_no_sampled_one_is_nearer():
    machine = load_without_limits("tripteron", ['pose.x="3 m"'])
    near = nearest_pose(machine)
    apart = np.linalg.norm([near["x"] - 3.0, near["y"] - 0.5, near["z"] - 0.5])
    rng = np.random.default_rng(1)
    columns = {f"pose.{name}": rng.uniform(-0.6, 1.9, 1000) for name in "xyz"}
    inside = np.asarray(solve_joints(with_values(machine, columns)).status) == Status.OK
    distances = np.hypot(np.hypot(columns["pose.x"] - 3.0, columns["pose.y"] - 0.5), columns["pose.z"] - 0.5)
    assert apart < distances[inside].min() + 1e-3


@pytest.mark.parametrize(("name", "far"), [("tripteron", "pose.z"), ("passive-leg-4dof-rus", "pose.x")])
def test_the_nearest_pose_is_that_of_every_pose_on_the_way_to_it(name, far):
    """Where the search ends too early, it ends elsewhere from nearby."""
    machine = build(document_of(load_without_limits(name)), "legs")
    wanted = {path: values(machine)[path] for path in values(machine) if path.startswith("pose.")}
    wanted[far] += 6.0 * respond(machine).configuration.length
    near = nearest_pose(with_values(machine, wanted))
    beside = {path: 0.9 * near[path.removeprefix("pose.")] + 0.1 * goal for path, goal in wanted.items()}
    assert nearest_pose(with_values(machine, beside)) == pytest.approx(near, abs=2e-6)


@pytest.mark.parametrize(("name", "most"), [("tripteron", 40), ("passive-leg-4dof-rus", 40), ("hexapod-rus", 60)])
def test_the_nearest_pose_takes_few_evaluations_of_the_legs(monkeypatch, name, most):
    """Each takes some 2 to 10 ms: a message is to be there in 0.3 s."""
    calls, gaps = [], Problems.gaps
    monkeypatch.setattr(Problems, "gaps", lambda *arguments: calls.append(1) or gaps(*arguments))
    nearest_pose(with_values(build(document_of(load_without_limits(name)), "legs"), {"pose.x": 3.0}))
    assert len(calls) < most


@pytest.mark.parametrize("z", [0.37, 0.49])
@pytest.mark.parametrize("ball", [False, True], ids=["universal", "ball"])
def test_a_workspace_is_that_of_the_closed_form_node_by_node(ball, z):
    """Rods between two ball joints may spin; which axes stand for a ball joint is nothing that divides a workspace."""
    family, _ = cranks(z)
    tables = document_of(family)
    for joint in (joint for leg in tables["legs"] for joint in leg["joints"] if ball and joint["type"] == "universal"):
        joint["type"] = "spherical"
        for axis in ("axis", "first_axis", "second_axis"):
            joint.pop(axis, None)
    box = ["x=-25 cm:25 cm:7", "y=-25 cm:25 cm:7", "z=5 cm:60 cm:9"]
    ours, theirs = workspace(build(tables, "legs"), box), workspace(family, box)
    assert ours.nodes == theirs.nodes
    assert (ours.dataset["verdict"].values == theirs.dataset["verdict"].values).all()
    assert min(ours.nodes[word] for word in ("inside", "beyond a singularity")) > 10

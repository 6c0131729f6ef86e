"""Cables, columns and tensions: states of rest against derivations from points and lengths alone."""

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

from kinetostat import analyze, build, command, evaluate, evaluate_grid, plot, under_load
from kinetostat.equilibrium.solving import Rest
from kinetostat.kinematics.status import Status
from kinetostat.studies.under_load import load_curve
from machines import STRETCH, cable, column, written
from refusals import refused

CABLES = written("cables", (0, 0, 0), {"x": 0, "y": 0, "yaw": 0})
ANCHORS = {"a": ((-2.0, 1.5), (-0.2, 0.1)), "b": ((2.0, 1.5), (0.2, -0.1)), "c": ((0.3, -1.6), (0.05, -0.1))}


def cables(ends, preload, *more):
    legs = [cable(name, (*base, 0.0), (*eye, 0.0), preload[name]) for name, (base, eye) in ends.items()]
    return build("\n".join([CABLES, *more, *legs]))


def stretched(ends, tensions):
    """Gradient and second derivative of the energy of cables by yaw, x, y of the platform, from their lengths alone."""
    gradient, elastic, geometric = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    for name, (base, eye) in ends.items():
        span, arm = np.subtract(eye, base), np.array(eye)
        length = np.linalg.norm(span)
        along = span / length
        moves = np.array([[-arm[1], 1.0, 0.0], [arm[0], 0.0, 1.0]])
        rate = along @ moves
        across = (np.eye(2) - np.outer(along, along)) / length
        turned = np.zeros((3, 3))
        turned[0, 0] = -along @ arm
        gradient += tensions[name] * rate
        elastic += STRETCH * np.outer(rate, rate)
        geometric += tensions[name] * (moves.T @ across @ moves + turned)
    return gradient, elastic, geometric


def test_three_cables_hold_a_weight_with_the_tensions_and_the_stiffness_of_their_derivation():
    """Preloads that balance 600 N and a moment at the free pose: nothing moves, and K has both parts."""
    rates = np.array([stretched({n: e}, {n: 1.0})[0] for n, e in ANCHORS.items()]).T
    pull = 400.0
    tensions = dict(zip(ANCHORS, np.linalg.solve(rates, [5.0, 0.0, -pull]), strict=True))
    tensions = {name: float(t) for name, t in tensions.items()}
    assert min(tensions.values()) < 0.0, "as they lie, one would have to push"
    tensions = {"a": 900.0, "b": 800.0, "c": 700.0}
    gradient, elastic, geometric = stretched(ANCHORS, tensions)
    load = f"[load]\nforce = [{gradient[1]}, {gradient[2]}, 0]\nmoment = [0, 0, {gradient[0]}]\n"
    state = under_load(cables(ANCHORS, tensions, load))
    assert state.rest is Rest.OK
    assert state.displacement == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert {s.leg: s.load for s in state.springs} == pytest.approx(tensions, rel=1e-9)
    assert np.array(state.elastic) == pytest.approx(elastic, rel=1e-9, abs=1e-3)
    assert np.array(state.tangent) == pytest.approx(elastic + geometric, rel=1e-9, abs=1e-3)


HANGING = {
    "top left": ((-1.0, 2.0), (-1.0, 0.2)),
    "top right": ((1.0, 2.0), (1.0, 0.2)),
    "bottom left": ((-1.0, -2.0), (-1.0, -0.2)),
    "bottom right": ((1.0, -2.0), (1.0, -0.2)),
}


@pytest.mark.parametrize(("share", "slack"), [(0.99, 0), (1.01, 2), (3.0, 2)])
def test_cables_go_slack_at_the_load_of_their_derivation(share, slack):
    """Upright cables of one stiffness, each with 100 N: a weight takes as much from the lower ones as it adds above."""
    preload, weight = 100.0, 400.0 * share
    force = f"[load]\nforce = [0, {-weight}, 0]\n"
    state = under_load(cables(HANGING, dict.fromkeys(HANGING, preload), force))
    upper, lower = (weight / 2, 0.0) if slack else (preload + weight / 4, preload - weight / 4)
    assert state.rest is Rest.OK
    assert len(state.slack_legs) == slack
    loads = {s.leg: s.load for s in state.springs}
    assert [loads["top left"], loads["top right"]] == pytest.approx([upper] * 2, rel=1e-9)
    assert [loads["bottom left"], loads["bottom right"]] == pytest.approx([lower] * 2, abs=1e-6)
    sag = (weight / 4 / STRETCH) if not slack else (weight / 2 - preload) / STRETCH
    assert state.displacement[2] == pytest.approx(-sag, rel=1e-9)


@pytest.mark.parametrize(("least", "most"), [(50.0, None), (120.0, 500.0)])
def test_tensions_are_the_least_within_their_bounds(least, most):
    """Two cables up and two down under 500 N: each lower one pulls as little as it may, each upper one 250 N more."""
    bounds = f"min_tension = {least}" + (f"\nmax_tension = {most}" if most else "")
    state = under_load(cables(HANGING, dict.fromkeys(HANGING, 0.0), f"[load]\nforce = [0, -500, 0]\n{bounds}\n"))
    loads = [s.load for s in state.springs]
    assert loads == pytest.approx([least + 250.0, least + 250.0, least, least], rel=1e-9)
    assert state.displacement == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_tensions_of_a_spatial_machine_balance_its_weight_and_no_smaller_ones_do():
    """Eight cables in the corners of a room: balance from points alone, and no feasible direction lowers the norm."""
    rng = np.random.default_rng(3)
    corners = np.array([[x, y, z] for x in (-3.0, 3.0) for y in (-2.0, 2.0) for z in (0.0, 4.0)])
    eyes = np.array([[x, y, z] for x in (-0.2, 0.2) for y in (0.3, -0.3) for z in (2.3, 1.8)])
    eyes[:, 2] += 0.05 * rng.normal(size=8)
    legs = "".join(cable(f"c{i}", *ends) for i, ends in enumerate(zip(corners.tolist(), eyes.tolist(), strict=True)))
    head = written("room", (0, 0, 2), {"x": 0, "y": 0, "z": 2, "roll": 0, "pitch": 0, "yaw": 0}, planar=False)
    load = "[tool]\nmass = 20\ncentre_of_mass = [0.02, 0, 0]\n[load]\ngravity = [0, 0, -9.81]\nmin_tension = 40\n"
    state = under_load(build(head + load + legs))
    assert state.rest is Rest.OK
    tensions = np.array([s.load for s in state.springs])
    along = (corners - eyes) / np.linalg.norm(corners - eyes, axis=1)[:, None]
    pulls = np.concatenate([np.cross(eyes - [0.0, 0.0, 2.0], along), along], axis=1).T
    weight = np.array([0.0, 0.0, -20 * 9.81])
    assert pulls @ tensions == pytest.approx(-np.concatenate([np.cross([0.02, 0.0, 0.0], weight), weight]), abs=1e-6)
    assert tensions.min() == pytest.approx(40.0, rel=1e-9)
    internal = np.linalg.svd(pulls)[2][6:]
    for direction in rng.normal(size=(200, 2)) @ internal:
        moved = tensions + 1e-3 * direction
        if (moved >= 40.0 - 1e-9).all():
            assert np.linalg.norm(moved) > np.linalg.norm(tensions) - 1e-9
    elastic, geometric = of_cables(corners - eyes, eyes - [0.0, 0.0, 2.0], tensions, 2e5)
    geometric = geometric - turned(weight, np.array([0.02, 0.0, 0.0]))
    assert np.array(state.elastic) == pytest.approx(elastic, rel=1e-9, abs=1e-4)
    assert np.array(state.tangent) == pytest.approx(elastic + geometric, rel=1e-9, abs=1e-4)


def turned(force, arm):
    """Second derivative, by a turn of the arm to its end, of the work of a force that keeps its direction [6 x 6]."""
    result = np.zeros((6, 6))
    result[:3, :3] = 0.5 * (np.outer(force, arm) + np.outer(arm, force)) - force @ arm * np.eye(3)
    return result


def of_cables(spans, arms, tensions, stiffness):
    """K from the lengths of cables alone: V = k (L - L0)^2 / 2, where L changes to second order with a small motion."""
    elastic, geometric = np.zeros((2, 6, 6))
    for span, arm, tension in zip(spans, arms, tensions, strict=True):
        length = np.linalg.norm(span)
        along = span / length
        gradient = -np.concatenate([np.cross(arm, along), along])
        moving = np.hstack([-np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]]), np.eye(3)])
        across = moving.T @ (np.eye(3) - np.outer(along, along)) @ moving / length
        elastic += stiffness * np.outer(gradient, gradient)
        geometric += tension * (across - turned(along, arm))
    return elastic, geometric


GUIDE = """[[legs]]
name = "guide"
joints = [
  { name = "along x", type = "prismatic", joins = ["base", "b1"], point = [0, 0, 0], axis = [1, 0, 0] },
  { name = "along y", type = "prismatic", joins = ["b1", "b2"], point = [0, 0, 0], axis = [0, 1, 0] },
  { name = "along z", type = "prismatic", joins = ["b2", "platform"], point = [0, 0, 1], axis = [0, 0, 1] },
]
"""


def test_a_platform_that_only_translates_has_the_stiffness_of_its_translations():
    """K of cables with one end at a point mass: k u u^T and (T / L) (1 - u u^T); a rigid guide holds the rotations."""
    corners = np.array([[-2, -1.5, 2.3], [2, -1.5, 2.3], [0, 2, 2.3], [-1.5, 1, -0.2], [1.5, -1, -0.1]])
    legs = "".join(cable(f"c{i}", corner, (0.0, 0.0, 1.0), 200.0) for i, corner in enumerate(corners.tolist()))
    pose = {"x": 0, "y": 0, "z": 1, "roll": 0, "pitch": 0, "yaw": 0}
    load = "[tool]\nmass = 5\n[load]\ngravity = [0, 0, -9.81]\n"
    machine = build(written("point mass", (0, 0, 1), pose, planar=False) + load + GUIDE + legs)
    state = under_load(machine)
    spans = corners - [0.0, 0.0, 1.0] - np.array(state.displacement[3:])
    elastic, geometric = of_cables(spans, np.zeros((5, 3)), [s.load for s in state.springs], STRETCH)
    tangent = np.array(state.tangent)
    assert np.array(state.elastic)[3:, 3:] == pytest.approx(elastic[3:, 3:], rel=1e-9)
    assert tangent[3:, 3:] == pytest.approx((elastic + geometric)[3:, 3:], rel=1e-9)
    assert np.isinf(tangent[:3, :3]).all()
    assert not tangent[:3, 3:].any()
    table = evaluate(machine, {"x": [0.0]}, ["tangent_stiffness"])
    diagonal = [float(table[f"tangent_stiffness_{name}"][0]) for name in state.components]
    assert diagonal == pytest.approx(np.diag(tangent), rel=1e-9)


@pytest.mark.parametrize(
    ("bounds", "pattern"),
    [
        ("min_tension = 50\nmax_tension = 20", "min_tension is 50 N, more than load.max_tension, 20 N"),
        ("max_tension = -1", "more than load.max_tension"),
    ],
)
def test_bounds_of_tensions_that_contradict_each_other_are_refused(bounds, pattern):
    with refused(pattern):
        under_load(cables(HANGING, dict.fromkeys(HANGING, 0.0), f"[load]\nforce = [0, -5, 0]\n{bounds}\n"))


def test_a_load_beyond_all_tensions_is_said_with_its_bounds():
    bounds = "[load]\nforce = [0, -500, 0]\nmin_tension = 50\nmax_tension = 200\n"
    state = under_load(cables(HANGING, dict.fromkeys(HANGING, 0.0), bounds))
    assert state.rest is Rest.NO_REST
    assert "No tensions of 50 N to 200 N hold this load" in state.message


def test_a_planar_machine_that_only_tension_holds_says_how_it_moves_without():
    machine = cables(HANGING, dict.fromkeys(HANGING, 100.0))
    assert "can still move by the twist x" in analyze(machine).message
    state = under_load(machine)
    assert state.factor is None
    # Four cables of 1.8 m with 100 N each: 4 T / L sideways, and nothing from springs.
    assert state.tangent[1][1] == pytest.approx(4 * 100.0 / 1.8, rel=1e-9)
    assert [*state.elastic[1]] == [0.0, 0.0, 0.0]


def test_a_column_on_a_spring_falls_at_the_load_of_its_derivation():
    """Of height h on a hinge of stiffness k, it stands up to k / h."""
    standing = under_load(column(1000))
    assert standing.rest is Rest.OK
    assert standing.factor == pytest.approx(2.5, rel=1e-9)
    assert standing.mode[4] == pytest.approx(-2.0 * standing.mode[0], rel=1e-9), "it tilts about the hinge"
    fallen = under_load(column(2600))
    assert fallen.rest is Rest.UNSTABLE
    assert "not stable" in fallen.message
    assert "stands up to 0.962 times this load" in fallen.message
    assert "gives way by a motion like rx +1 rad, y -2 m at the tool, most of all in column" in fallen.message
    assert np.isinf(under_load(column(-1000)).factor)


def toggle(force, height=0.3):
    """Two struts that lean against each other at this height (m) above their feet, which are 2 m apart."""
    legs = "".join(
        f'[[legs]]\nname = "{name}"\njoints = [\n'
        f'{{ name = "foot", type = "revolute", joins = ["base", "b1"], point = [{x}, 0, 0], axis = [0, 0, 1] }},\n'
        f'{{ name = "strut", type = "prismatic", joins = ["b1", "b2"], point = [{x}, 0, 0], axis = [{-x}, {height}, 0]'
        ", actuated = true, stiffness = 1e6 },\n"
        f'{{ name = "top", type = "revolute", joins = ["b2", "platform"], point = [0, {height}, 0], axis = [0, 0, 1]'
        f"{held} }},\n]\n"
        for name, x, held in (("left", -1, ""), ("right", 1, ", actuated = true, stiffness = 1e3"))
    )
    head = written("toggle", (0, height, 0), {"x": 0, "y": height})
    return build(f"{head}{legs}[load]\nforce = [0, {-force}, 0]\n")


def greatest_load(height):
    """The struts snap over where 2 k (L0 - L(y)) y / L(y) is greatest over the height y."""
    heights = np.linspace(0.0, height, 300_001)
    lengths = np.hypot(1.0, heights)
    return (2e6 * (np.hypot(1.0, height) - lengths) * heights / lengths).max()


def test_a_load_beyond_stability_is_said_with_its_share_and_its_motion():
    greatest = greatest_load(0.3)
    assert under_load(toggle(0.999 * greatest)).rest is Rest.OK
    lost = under_load(toggle(1.25 * greatest))
    assert lost.rest is Rest.OK, "below their feet, the struts hold it by pulling"
    assert lost.displacement[2] < -0.6
    assert lost.state.limit.share == pytest.approx(0.8, rel=1e-3)
    assert "snapped over" in lost.message
    assert "stands up to 0.8 times this load" in lost.message
    assert "y +" in lost.message or "y -" in lost.message, "the sign of a mode means nothing"
    assert "most of all in" in lost.message


def test_a_machine_that_has_snapped_over_says_so():
    state = under_load(toggle(16.0 * greatest_load(0.02), 0.02))
    assert state.rest is Rest.OK
    assert "snapped over to another state on the way. It stands up to 0.0624 times this load" in state.message


def test_a_machine_that_moves_far_without_snapping_over_is_left_alone():
    force = "[load]\nforce = [0, 900000, 0]\n"
    state = under_load(cables(ANCHORS, dict.fromkeys(ANCHORS, 100.0), force))
    assert state.displacement[2] > 3.0
    assert state.message == "At rest and stable."


def test_what_only_pulls_does_not_push():
    machine = cables(ANCHORS, dict.fromkeys(ANCHORS, 0.0), "[load]\nforce = [0, 900, 0]\n")
    state = under_load(machine)
    assert state.rest is not Rest.OK or set(state.slack_legs) <= {"a", "b"}


@pytest.mark.parametrize(
    ("line", "pattern"),
    [
        ('type = "rope"', r"type.*cable"),
        ('type = "cable"\nfrom = [0, 0, 1]', r"a cable without to and stiffness"),
        (
            'type = "cable"\nfrom = [0, 0, 1]\nto = [0, 0, 0]\nstiffness = 1e5\nslack = 1',
            "slack is not known; a cable has",
        ),
        (  # of several, the first of the alphabet, whatever the hash seed of the process
            'type = "cable"\nfrom = [0, 0, 1]\nto = [0, 0, 0]\nstiffness = 1e5\n'
            "slack = 1\nrope = 1\nwire = 1\ncord = 1\nbelt = 1\nchain = 1\nloose = 1\ntight = 1",
            "belt is not known; a cable has",
        ),
    ],
)
def test_a_cable_that_is_not_one_is_refused(line, pattern):
    with refused(pattern):
        build(f'{CABLES}\n[[legs]]\nname = "a"\n{line}\n')


def test_a_curve_over_the_load_ends_in_the_state_and_shows_where_cables_go_slack():
    machine = cables(HANGING, dict.fromkeys(HANGING, 100.0), "[load]\nforce = [0, -500, 0]\n")
    curve, state = load_curve(machine, [0.0, 0.5, 0.9, 1.0]), under_load(machine)
    assert curve.displacement[-1] == pytest.approx(state.displacement, rel=1e-9, abs=1e-15)
    lower = curve.loads[:, curve.springs.index("bottom left winch actuator")]
    assert lower == pytest.approx([100.0, 37.5, 0.0, 0.0], abs=1e-6)
    assert len(plot(state).axes) == 3, "rotation, displacement, and forces"


def test_what_falls_has_no_rest_in_tables_and_commands():
    fallen = column(2600)
    table = evaluate(fallen, {"roll": [0.0]}, ["displacement_y", "load_factor"])
    assert table.status.values.tolist() == [Status.NO_REST]
    assert np.isnan(table["load_factor"].values).all()
    assert not command(fallen).settled.any()


def test_chosen_tensions_are_forces_and_no_commands():
    bounds = "[load]\nforce = [0, -500, 0]\nmin_tension = 50\n"
    with refused("choose forces"):
        command(cables(HANGING, dict.fromkeys(HANGING, 0.0), bounds))


def test_counts_have_a_colour_each_in_maps_and_small_displacements_are_in_micrometres():
    """Beyond 400 N down or up two of the upright cables are slack; no line is drawn between 0 and 2."""
    machine = cables(HANGING, dict.fromkeys(HANGING, 100.0), "[load]\nforce = [0, -1, 0]\n")
    grid = evaluate_grid(machine, ["load.force.1=-500:500:5", "y=0:1 mm:2"], ["slack_springs", "displacement_y"])
    assert grid["slack_springs"].values[:, 0].tolist() == [2, 0, 0, 0, 2]
    counts, moved = (axes for axes in plot(grid).axes if axes.get_title())
    assert [type(part) for part in counts.collections] == [QuadMesh]
    assert [text.get_text() for text in counts.collections[0].colorbar.ax.get_yticklabels()] == ["0", "2"]
    assert moved.get_title() == "$u_{\\mathrm{y}}$ (µm)"


STAGE = """
schema = 1
name   = "Stage on flexures"
family = "legs"
space  = "planar"
[platform]
point = [0, 0, 0]
[pose]
x   = "2 mm"
y   = 0
yaw = 0
[[legs]]
name = "flexure"
joints = [{ name = "slide", type = "prismatic", joins = ["base", "platform"], point = [0, 0, 0], axis = [1, 0, 0], stiffness = STIFFNESS }]
[[legs]]
name = "drive"
joints = [{ name = "slide", type = "prismatic", joins = ["base", "platform"], point = [0, 0, 0], axis = [1, 0, 0], stiffness = "3 N/um", actuated = true }]
"""  # noqa: E501


@pytest.mark.parametrize("stiffness", ['"1 N/um"', '["left 2 N/um", "right 2 N/um"]'])
def test_a_flexure_pulls_back_to_its_home_pose_and_commands_drive_against_it(stiffness):
    """1 N/um x (2 mm + u) + 3 N/um x u = 0; with a command a, 1 N/um x 2 mm = 3 N/um x (a - 2 mm)."""
    machine = build(STAGE.replace("STIFFNESS", stiffness))
    assert under_load(machine).displacement[1] == pytest.approx(-0.5e-3, rel=1e-12)
    assert command(machine).coordinates[0] == pytest.approx([2e-3 + 2e-3 / 3.0], rel=1e-12)
    home = build(STAGE.replace("STIFFNESS", stiffness), settings=["pose.x=0"])
    assert not np.any(under_load(home).displacement)

"""`analyze` at every kind of pose: status, message, and the machine-readable form."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.cli import main
from kinetostat.commands.common import DONE, NO_ANSWER
from kinetostat.machine.limits import LIMITS
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import with_values
from kinetostat.studies.analysis import analyze
from kinetostat.views.answers import plain_of
from machines import CASES, CONTRASTING, every_machine, machines
from refusals import refused

NAME = "zhang-gosselin-4dof"
RIGID_LINKS = "stiffness.passive_links=rigid"
FREE_LEG = "stiffness.actuator.0=0"


@pytest.mark.parametrize("axes", ["tool", "Base", "", None])
def test_axes_that_there_are_not_are_refused(axes):
    with refused(r"^axes is .*(base|platform)"):
        analyze(load(NAME), axes=axes)


def at(*settings):
    return analyze(load(NAME, settings))


STATES = {
    "ok": ((), "ok", ["can be reached", "resists every load"]),
    "rigid": ((RIGID_LINKS,), "ok", ["Rigid: passive link 1, passive link 2", "K is infinite", "C is exact"]),
    "free": ((FREE_LEG,), "ok", ["Free: leg 1 actuator", "no stiffness", "rx -0.4201 rad/m", "x +9.112 m/m"]),
    "free bending": (
        ("stiffness.passive_links.1=0",),
        "ok",
        ["Free: passive link 2", "rz -0.866 rad/rad", "y +0.68 m/rad"],
    ),
    "rigid and free": ((RIGID_LINKS, FREE_LEG), "ok", ["Rigid: passive link 1", "Free: leg 1 actuator"]),
    "all rigid": ((RIGID_LINKS, "stiffness.actuator=rigid"), "ok", ["Rigid: passive link 1", "leg 4 actuator"]),
    "all free": (("stiffness.actuator=0", "stiffness.passive_links=0"), "ok", ["Free: passive link 1", "Free: leg 4"]),
    "too far": (("pose.z=1.5",), "out_of_reach", ["passive leg", "1500 mm", "at most 1360 mm", "nearer"]),
    "too near": (
        ("geometry.passive_links.1=50 cm", "pose.z=0.1"),
        "out_of_reach",
        ["passive leg", "100 mm", "at least 180 mm", "away"],
    ),
    "stretched": (("pose.z=1.36",), "singular", ["passive leg lock up", "stretched, folded or aligned"]),
    "folded": (("pose.z=0",), "singular", ["passive leg"]),
    "no platform": (
        ("geometry.platform_radius=1e-12",),
        "singular",
        ["With all actuators locked", "still move", "rad"],
    ),
    "parallelogram": (
        ("geometry.base_radius=12 cm", "geometry.platform_angle=30 deg"),
        "singular",
        ["With all actuators locked", "x +1 m"],
    ),
}
every_state = pytest.mark.parametrize(("settings", "status", "words"), STATES.values(), ids=STATES)


@every_state
def test_status_and_message(settings, status, words):
    found = at(*settings)
    assert found.status.word == status
    for word in words:
        assert word in found.message
    assert found.message.endswith(".")


@every_state
def test_json_has_its_shape_and_no_number_that_json_lacks(settings, status, words):
    data = plain_of(at(*settings))
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["name"] == "Zhang & Gosselin 4-dof"
    assert data["components"] == list(COMPONENTS)
    assert set(data["pose"]) == {"x", "z", "theta5", "theta6"}
    assert (data["status"], data["message"]) == (status, at(*settings).message)
    for matrix in ("stiffness", "compliance"):
        assert data[matrix] is None or np.array(data[matrix], dtype=float).shape == (6, 6)
        assert data[f"{matrix}_diagonal"] is None or len(data[f"{matrix}_diagonal"]) == 6


@pytest.mark.parametrize("state", [state for state, row in STATES.items() if row[1] != "ok"])
def test_a_pose_without_answer_has_no_numbers(state):
    data = plain_of(at(*STATES[state][0]))
    answers = ("stiffness", "compliance", "stiffness_diagonal", "compliance_diagonal", "rank")
    if data["stiffness"] is None:
        assert [data[key] for key in answers] == [None] * 5
    else:  # a singular pose, at which the legs hold the platform against some loads
        assert data["status"] == "singular"
        assert data["rank"] < 6
        assert None in data["compliance_diagonal"]
    assert data["wrench_condition"] is None
    assert data["attribution"] == []
    assert data["principal_compliances"] is None


def test_the_reference_pose():
    data = plain_of(at())
    assert data["rank"] == 6
    assert (data["rigid"], data["free"]) == ([], [])
    assert data["stiffness"][0][0] == pytest.approx(8.50551299487, rel=1e-9)
    assert data["compliance_diagonal"] == pytest.approx([data["compliance"][i][i] for i in range(6)])
    for shares in ("compliance_share", "stiffness_share"):
        assert np.sum([s[shares] for s in data["attribution"]], axis=0) == pytest.approx(np.ones(6))
    assert [s["spring"] for s in data["attribution"]][:3] == ["passive link 1", "passive link 2", "leg 1 actuator"]
    assert set(data["principal_compliances"]) == {"rotation", "translation"}


def test_a_rigid_passive_leg_has_no_stiffness_matrix_and_exact_zeros_in_c():
    data = plain_of(at(RIGID_LINKS))
    assert data["stiffness"] is None
    assert data["rank"] == 4
    assert data["rigid"] == ["passive link 1", "passive link 2"]
    assert [entry is None for entry in data["stiffness_diagonal"]] == [False, False, True, False, True, False]
    zeros = [[name in ("rz", "y") for name in COMPONENTS]] * 6
    held = np.array(zeros) | np.array(zeros).T
    assert np.array_equal(np.array(data["compliance"]) == 0.0, held)
    assert [s["stiffness"] for s in data["attribution"]] == ["rigid"] * 2 + [1000.0] * 4
    assert data["attribution"][0]["compliance_share"] == [0.0, 0.0, None, 0.0, None, 0.0]


def test_a_free_leg_has_no_compliance_matrix():
    data = plain_of(at(FREE_LEG))
    assert data["compliance"] is None
    assert data["principal_compliances"] is None
    assert data["rank"] == 5
    assert data["free"] == ["leg 1 actuator"]
    assert [entry is None for entry in data["compliance_diagonal"]] == [True, True, False, True, False, True]
    assert np.linalg.matrix_rank(np.array(data["stiffness"]), 1e-9) == 5


def test_rounding_is_no_compliance_even_where_another_direction_is_free():
    """The passive leg is rigid: about z and along y nothing moves, whether or not an actuator is free."""
    data = plain_of(at(RIGID_LINKS, FREE_LEG))
    assert [data["compliance_diagonal"][COMPONENTS.index(name)] for name in ("rz", "y")] == [0.0, 0.0]
    assert all(share["compliance_share"][COMPONENTS.index("rz")] is None for share in data["attribution"])


UNSEEN = math.degrees(math.atan(math.sqrt(3) / 2))
"""theta5 (deg) at which neither link bends under one of the two loads that the passive leg carries.

There J5' of eq. 25 is singular: tan(theta5) = l52 / l51 sin(120 deg). The pose is regular and C is finite, but of rank
5, and K is infinite about the axis of that load.
"""


@pytest.mark.parametrize("beside", [0.0, 1e-13, -1e-13])
def test_a_load_that_no_spring_feels_is_held_rigidly(beside):
    found = at(f"pose.theta5={UNSEEN + beside!r} deg")
    data = plain_of(found)
    assert json.dumps(data, allow_nan=False)
    assert data["status"] == "ok"
    assert data["compliance_diagonal"] == pytest.approx(
        [0.140456, 0.0942476, 3.7037, 0.00679752, 5.78e-4, 0.00147172], rel=1e-5
    )
    assert [data["stiffness_diagonal"][i] for i in (1, 3, 5)] == pytest.approx([21.1391732, 247.319412, 3425.42944])
    assert [data["stiffness_diagonal"][i] for i in (0, 2, 4)] == [None] * 3
    assert data["stiffness"] is None
    assert data["rank"] == 5


def limits(machine):
    """Shortest and longest span of the passive leg."""
    first, second = machine.tables["geometry"].passive_links
    return abs(first - second), first + second


@given(
    machines(next(case for case in CASES if case.name == NAME)),
    st.sampled_from([0, 1]),
    st.floats(-1.0, 1.0),
    st.sampled_from([0.0, 1e-16, -1e-16]),
)
def test_a_stretched_or_folded_leg_is_never_ok(machine, which, direction, beside):
    """At the very limit rounding decides on which side the span falls; on either it is an answer, not a number."""
    span = limits(machine)[which] * (1.0 + beside)
    passive = {"stiffness.passive_actuator": 0.0}  # a driven foot would hold the stretched leg
    pose = {"pose.x": span * math.sin(direction), "pose.z": span * math.cos(direction)}
    at_limit = with_values(machine, {**pose, **passive})
    found = analyze(at_limit)
    assert found.status.word in ("singular", "out_of_reach")
    assert "passive leg" in found.message


@every_machine
@given(data=st.data())
def test_any_machine_has_an_answer_in_json(case, data):
    """Whatever the design, at poses in and out of reach, with rigid and free springs."""
    ends = st.sampled_from([0.0, math.inf])
    machine = data.draw(machines(case, CONTRASTING | ends))
    for path in data.draw(st.lists(st.sampled_from(sorted(case.ranges)), max_size=3)):
        machine = with_values(machine, {path: data.draw(st.floats(0.01, 2.0), label=path)})
    json.dumps(plain_of(analyze(machine)), allow_nan=False)


def test_directions_of_equal_stiffness_are_told_together(capsys):
    """The hexapod is alike in x and y, the cubic one in all directions: no single direction is the softest."""
    assert main(["analyze", "hexapod"]) == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith(" force, rotations held"))
    assert "any ⊥ +0.00 +0.00 +1.00" in row.replace("-1.00", "+1.00")
    assert row.count("1.00") == 2, "the stiffest is along z"
    assert main(["analyze", "hexapod-cubic"]) == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith(" force, rotations held"))
    assert row.split()[-2:] == ["any", "any"]


def test_words_of_the_version_before_still_work_with_a_warning():
    analysis = analyze(load(NAME))
    with pytest.warns(DeprecationWarning, match="attribution"):
        assert analysis.shares == analysis.attribution
    first = analysis.attribution[0]
    with pytest.warns(DeprecationWarning, match="compliance_share"):
        assert first.compliance.tolist() == first.compliance_share.tolist()
    data = plain_of(analysis)
    assert data["order"] == data["components"]
    assert data["deprecated_keys"]["order"] == "components"
    for old, new in (
        ("leg_distance", "leg_least_singular_value"),
        ("platform_distance", "platform_least_singular_value"),
    ):
        assert data["deprecated_keys"][old] == new
        assert data["mobility"][old] == data["mobility"][new]
        with pytest.warns(DeprecationWarning, match=new):
            assert getattr(analysis.mobility, old) == getattr(analysis.mobility, new)


SINGULAR_POSES = {
    "hexapod": ["--set", "pose.x=0", "--set", "pose.y=0", "--set", "pose.yaw=90 deg"],
    "planar-3rpr": ["--set", "pose.angle=-10 deg", "--set", "pose.x=0", "--set", "pose.y=0"],
}


@pytest.mark.parametrize("axes", ["base", "platform"])
@pytest.mark.parametrize("name", SINGULAR_POSES)
def test_a_singular_pose_says_what_is_known(name, axes, capsys):
    """K is that of poses beside it; C, where it is finite, is what a least-squares solution of K x = w says."""
    unlimited = [word for limit in LIMITS for word in ("--set", f"limits.{limit}=none")]
    pose = [*SINGULAR_POSES[name], *unlimited]
    assert main(["analyze", name, *pose, "--axes", axes, "--json"]) == NO_ANSWER
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == "singular"
    assert answer["platform"]["position"] is not None
    (twist,) = answer["mobility"]["free_twists"]
    beside = [word.replace("0 deg", "0.001 deg") for word in pose]
    assert main(["analyze", name, *beside, "--axes", axes, "--json"]) == DONE
    near = json.loads(capsys.readouterr().out)
    stiffness = np.array(answer["stiffness"])
    np.testing.assert_allclose(stiffness, near["stiffness"], rtol=1e-3, atol=1e-3 * np.abs(stiffness).max())
    places = [["rx", "ry", "rz", "x", "y", "z"].index(component) for component in answer["components"]]
    if axes == "base":
        np.testing.assert_allclose(stiffness @ np.array(twist)[places], 0.0, atol=1e-8 * np.abs(stiffness).max())
    free = [entry is None for entry in answer["compliance_diagonal"]]
    assert any(free)
    assert not all(free)
    scale = np.array([0.1 if component.startswith("r") else 1.0 for component in answer["components"]])
    solved = np.linalg.pinv(stiffness / np.outer(scale, scale), rcond=1e-9) / np.outer(scale, scale)
    for i, row in enumerate(answer["compliance"]):
        for j, entry in enumerate(row):
            assert (entry is None) == (free[i] or free[j])
            assert entry is None or entry == pytest.approx(solved[i, j], rel=1e-6, abs=1e-9 * np.abs(solved).max())
    assert answer["rank"] == len(free) - 1


def test_a_pose_beyond_a_limit_says_where_the_machine_stands(capsys):
    assert main(["analyze", "hexapod", "--set", "limits.longest_leg=7 cm", "--json"]) == NO_ANSWER
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == "joint_limit"
    assert answer["platform"]["position"] is not None
    assert len(answer["actuators"]) == 6
    assert answer["singularity_margin"] > 0.1
    assert answer["stiffness"] is None


@pytest.mark.parametrize("axes", ["base", "platform"])
def test_a_planar_machine_has_three_components_in_every_wrench_and_motion(axes):
    machine = load("planar-3rpr", ["load.force=[10, 20, 0]", "load.moment=[0, 0, 3]", "tool.offset=[0.01, 0.02, 0]"])
    analysis = analyze(machine, axes)
    case = analysis.load
    assert case.components == analysis.components == ("rz", "x", "y")
    np.testing.assert_allclose(case.deflection, analysis.C @ case.wrench, rtol=1e-12)
    if axes == "base":
        assert case.wrench.tolist() == [3.0, 10.0, 20.0]
    assert {len(reaction.wrench) for reaction in case.reactions} == {3}
    ends = [reaction.wrench for reaction in case.reactions if reaction.joint.endswith("base joint")]
    assert np.sum(ends, axis=0)[1:] == pytest.approx(case.wrench[1:], rel=1e-12)
    told = plain_of(analysis)["load"]
    assert (told["wrench"], told["deflection"]) == (case.wrench.tolist(), case.deflection.tolist())

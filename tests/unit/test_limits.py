"""Limits of legs, joints and actuators: which parts they are about, their edges, and what people are told."""

import math
from dataclasses import replace

import numpy as np
import pytest

from kinetostat.algebra.lines import squared_distance
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.display import ENGINEERING
from kinetostat.kinematics.limits import Check, why_beyond
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import pose_status, respond
from kinetostat.machine.limits import LIMITS
from kinetostat.machine.links import rods
from kinetostat.machine.loading import as_toml, build, bundled
from kinetostat.machine.loading import load as load_bundled
from kinetostat.machine.parameters import values, with_values
from kinetostat.spec import document
from kinetostat.studies.analysis import analyze
from kinetostat.tolerances import LIMIT_SLACK
from machines import load_without_limits as load
from refusals import refused

JUST = 1e-6
"""How far beside a limit a pose is put to be surely within or beyond it."""
LOADED = ("load.force=[100, -50, 800]", "load.moment=[3, 4, -5]")


def status(machine):
    return Status(int(respond(machine).status))


def legs_of(machine):
    return [(rod.start, rod.end) for rod in rods(respond(machine).configuration.legs)]


def array(vector):
    return np.array(vector.components(), dtype=float)


def spans(machine):
    return [array(end) - array(start) for start, end in legs_of(machine)]


def tilts(machine, normal):
    return [math.acos(abs(span @ normal) / np.linalg.norm(span)) for span in spans(machine)]


def loads(machine):
    return [abs(spring.load) for spring in analyze(machine).load.springs if spring.actuated]


def clearances(machine):
    """By sampling, refined where it is least: another route than the formula."""
    found = legs_of(machine)
    return [sampled_distance(*(array(p) for p in (*one, *other))) for i, one in enumerate(found) for other in found[:i]]


def sampled_distance(a, b, c, d):
    (low, high), best = np.array([[0.0, 0.0], [1.0, 1.0]]), math.inf
    for _ in range(40):
        shares = [np.linspace(lower, upper, 21) for lower, upper in zip(low, high, strict=True)]
        one = a + shares[0][:, None] * (b - a)
        other = c + shares[1][:, None] * (d - c)
        apart = np.linalg.norm(one[:, None] - other[None], axis=2)
        i, j = np.unravel_index(apart.argmin(), apart.shape)
        best = min(best, float(apart[i, j]))
        centre = np.array([shares[0][i], shares[1][j]])
        reach = 0.35 * (high - low)
        low, high = np.clip(centre - reach, 0, 1), np.clip(centre + reach, 0, 1)
    return best


def extreme_tilt(which):
    def measured(machine):
        turn = respond(machine).configuration.platform.rotation
        return max(tilts(machine, np.array([0.0, 0.0, 1.0]) if which == "base" else array(turn.z)))

    return measured


def lengths(machine):
    return [float(np.linalg.norm(span)) for span in spans(machine)]


TURNED = ("pose.x=2 cm", "pose.roll=7 deg", "pose.yaw=11 deg")
EDGES = [
    ("hexapod", TURNED, "shortest_leg", lambda m: min(lengths(m)), -1),
    ("hexapod", TURNED, "longest_leg", lambda m: max(lengths(m)), +1),
    ("hexapod", TURNED, "base_joint_angle", extreme_tilt("base"), +1),
    ("hexapod", TURNED, "platform_joint_angle", extreme_tilt("platform"), +1),
    ("hexapod", (*TURNED, *LOADED), "actuator_force", lambda m: max(loads(m)), +1),
    ("hexapod", (*TURNED, "load.force=[0, 0, -800]"), "actuator_force", lambda m: max(loads(m)), +1),
    ("hexapod", TURNED, "leg_diameter", lambda m: min(clearances(m)), -1),
    ("zhang-gosselin-4dof", (), "longest_leg", lambda m: max(lengths(m)), +1),
    ("planar-3rpr", (), "shortest_leg", lambda m: min(lengths(m)), -1),
    ("planar-3rrr", ("load.force=[100, 50, 0]",), "actuator_moment", lambda m: max(loads(m)), +1),
    ("tricept", (), "platform_joint_angle", extreme_tilt("platform"), +1),
    ("hexapod-rus", (), "platform_joint_angle", extreme_tilt("platform"), +1),
    ("tripteron", ("pose.x=0.62 m",), "travel_to", lambda _: 0.12, +1),
    ("tripteron", ("pose.y=0.41 m",), "travel_from", lambda _: -0.09, -1),
]
"""Machine, settings, limit, what it is compared with by another route, and on which side a limit is generous."""


@pytest.mark.parametrize(("name", "settings", "limit", "measure", "side"), EDGES, ids=[f"{e[0]} {e[2]}" for e in EDGES])
def test_a_limit_holds_up_to_its_edge_and_no_further(name, settings, limit, measure, side):
    machine = load(name, settings)
    edge = measure(machine)
    margin = side * JUST * abs(edge)
    assert status(machine) is Status.OK
    assert status(with_values(machine, {f"limits.{limit}": edge + margin})) is Status.OK
    assert status(with_values(machine, {f"limits.{limit}": edge - margin})) is Status.JOINT_LIMIT


@pytest.mark.parametrize(("name", "settings", "limit", "measure", "side"), EDGES, ids=[f"{e[0]} {e[2]}" for e in EDGES])
def test_rounding_does_not_refuse_the_limit_itself(name, settings, limit, measure, side):
    machine = load(name, settings)
    (check, *_) = sorted(
        (c for c in respond(with_values(machine, {f"limits.{limit}": 0.9 * measure(machine)})).checks),
        key=lambda c: c.measure if c.at_most else -c.measure,
    )[::-1]
    excess = 0.1 * check.slack * (-1 if check.at_most else 1)
    assert check.slack > 0.0
    assert replace(check, bound=check.measure + excess).kept


@pytest.mark.parametrize("name", bundled())
def test_a_machine_without_limits_is_not_checked(name):
    assert respond(load(name)).checks == ()


@pytest.mark.parametrize("name", bundled())
def test_a_bundled_machine_keeps_its_own_limits_and_says_whether_it_has_any(name):
    """K and C of no machine depend on them."""
    machine, free = load_bundled(name), load(name)
    answer = analyze(machine)
    assert answer.status is Status.OK
    assert answer.compliance.tolist() == analyze(free).compliance.tolist()
    assert respond(machine).stiffness == respond(free).stiffness
    assert "No limits are set" in analyze(free).message
    assert ("No limits are set" in answer.message) == ("limits" not in document.parse(bundled()[name], name))


def test_only_the_limits_of_the_paper_s_machine_are_not_known():
    known = {name: "limits" in document.parse(text, name) for name, text in bundled().items()}
    assert not known["zhang-gosselin-4dof"]
    assert sum(known.values()) >= 18


STRAIGHT_LEGS = {
    "hexapod": 6, "hexapod-cubic": 6, "hexapod-rus": 6, "hexapod-hardware": 6, "planar-3rpr": 3, "planar-3rrr": 3,
    "delta": 0, "orthoglide": 0, "tripteron": 0, "tricept": 3, "tricept-rus": 3,
    **{name: int(name.split("dof")[0][-1]) for name in bundled() if "dof" in name},
}  # fmt: skip


@pytest.mark.parametrize(("name", "count"), STRAIGHT_LEGS.items())
def test_the_straight_legs_are_those_a_family_draws_straight(name, count):
    machine = load(name)
    found = rods(respond(machine).configuration.legs, machine.family.planar)
    assert len(found) == count
    telescopic = not name.endswith("rus") and name != "planar-3rrr"
    assert all(rod.telescopic == telescopic and rod.on_base == telescopic and rod.on_platform for rod in found)


class TestDistance:
    def test_it_is_that_of_sampled_points(self):
        rng = np.random.default_rng(3)
        for _ in range(60):
            points = rng.uniform(-1, 1, (4, 3))
            a, b, c, d = (Vector(*p.tolist()) for p in points)
            assert math.sqrt(squared_distance((a, b), (c, d))) == pytest.approx(sampled_distance(*points), rel=1e-6)

    @pytest.mark.parametrize(
        ("other", "distance"),
        [
            ((Vector(0.0, 1.0, 0.0), Vector(2.0, 1.0, 0.0)), 1.0),  # parallel, overlapping
            ((Vector(3.0, 4.0, 0.0), Vector(4.0, 4.0, 0.0)), math.hypot(2.0, 4.0)),  # parallel, apart
            ((Vector(2.0, 4.0, 0.0), Vector(1.5, 4.0, 0.0)), math.hypot(0.5, 4.0)),  # parallel, opposite
            ((Vector(3.0, 0.0, 0.0), Vector(2.0, 0.0, 0.0)), 1.0),  # on one line
            ((Vector(0.5, -1.0, 0.0), Vector(0.5, 1.0, 0.0)), 0.0),  # crossing
            ((Vector(0.5, 1.0, 0.0), Vector(0.5, 3.0, 0.0)), 1.0),  # end against the middle
            ((Vector(1.0, 0.0, 0.0), Vector(2.0, 2.0, 1.0)), 0.0),  # a common end
            ((Vector(2.0, 1.0, 0.0), Vector(3.0, 5.0, 2.0)), math.sqrt(2.0)),  # end against end
        ],
    )
    def test_special_places(self, other, distance):
        one = ZERO, Vector(1.0, 0.0, 0.0)
        for first, second in ((one, other), (other, one), (one[::-1], other), (one, other[::-1])):
            assert math.sqrt(squared_distance(first, second)) == pytest.approx(distance, abs=1e-15)

    def test_arrays_and_floats_agree(self):
        points = np.random.default_rng(4).uniform(-1, 1, (4, 3, 50))
        points[3, :, :10] = points[2, :, :10] + points[1, :, :10] - points[0, :, :10]  # parallel ones
        a, b, c, d = (Vector(*p) for p in points)
        together = squared_distance((a, b), (c, d))
        for i in range(50):
            single = [Vector(*(float(row[i]) for row in p)) for p in points]
            assert together[i] == pytest.approx(squared_distance(tuple(single[:2]), tuple(single[2:])), abs=1e-14)


@pytest.mark.parametrize(
    ("placed", "reached", "singularity_margin", "allowed", "borne", "status"),
    [
        (0, True, 1.0, True, True, Status.OK),
        (0, True, 1.0, False, True, Status.JOINT_LIMIT),
        (0, True, 1.0, True, False, Status.JOINT_LIMIT),
        (0, True, 0.0, True, False, Status.SINGULAR),
        (0, True, 0.0, False, True, Status.SINGULAR),
        (0, False, 1.0, False, False, Status.OUT_OF_REACH),
        (4, True, 1.0, False, False, Status.NOT_CONVERGED),
    ],
)
def test_the_most_fundamental_obstacle_comes_first(placed, reached, singularity_margin, allowed, borne, status):
    assert pose_status(placed, reached, singularity_margin, allowed, borne) == status


TOLD = [
    ("hexapod", ["limits.longest_leg=7 cm"], ["Leg", "mm long", "limits.longest_leg", "at most 70 mm", "change the"]),
    ("hexapod", ["limits.shortest_leg=2 m"], ["limits.shortest_leg", "at least 2000 mm", "(and 5 more pass it)"]),
    ("hexapod", ["limits.base_joint_angle=10 deg"], ["stands at 50.94", "base's z axis", "at most 10 deg"]),
    ("hexapod", ["limits.platform_joint_angle=10 deg"], ["deg to the platform's z axis", "at most 10 deg"]),
    ("hexapod", ["limits.leg_diameter=6 cm"], ["and leg", "come within 31.2", "at least 60 mm"]),
    ("hexapod", ["limits.actuator_force=100", "load.force=[0, 0, 600]"], ["carries 158.7", "N", "lower the load"]),
    ("tripteron", ["limits.travel_to=1 cm", "pose.x=0.6"], ["X slide has travelled 100 mm", "at most 10 mm"]),
]


@pytest.mark.parametrize(("name", "settings", "words"), TOLD)
def test_a_pose_beyond_a_limit_says_which_and_by_how_much(name, settings, words):
    answer = analyze(load(name, settings))
    assert answer.status is Status.JOINT_LIMIT
    for word in words:
        assert word in answer.message
    assert "  " not in answer.message


def test_a_direction_without_length_is_not_said_to_be_an_angle():
    check = Check(LIMITS["base_joint_angle"], "leg 1", math.nan, 0.5, 0.0)
    assert "Leg 1: both joints stand in one point" in why_beyond([check], ENGINEERING)
    assert "0 deg" not in why_beyond([check], ENGINEERING)


REFUSED = [
    ("hexapod", ["limits.longest_leg=10 kg"], ["limits.longest_leg", '"10 kg"', "length"]),
    ("hexapod", ["limits.longest_leg=-1"], ["limits.longest_leg", "greater than 0"]),
    ("hexapod", ["limits.base_joint_angle=100 deg"], ["limits.base_joint_angle", "must not exceed 90 deg"]),
    ("hexapod", ["limits.longest_legs=1"], ["limits.longest_legs is not known", "did you mean longest_leg?"]),
    (
        "hexapod",
        ["limits.shortest_leg=2", "limits.longest_leg=1"],
        ["shortest_leg is 2000 mm", "longest_leg 1000 mm", "widen"],
    ),
    ("hexapod", ["limits.travel_to=1"], ["limits.travel_to has no meaning here", "home pose", "leave it out"]),
    ("hexapod", ["limits.actuator_moment=1"], ["limits.actuator_moment", "an actuated revolute"]),
    ("delta", ["limits.longest_leg=1"], ["limits.longest_leg has no meaning here", "leave it out"]),
    ("delta", ["limits.leg_diameter=1 cm"], ["limits.leg_diameter", "two straight legs"]),
    ("planar-3rpr", ["limits.base_joint_angle=30 deg"], ["limits.base_joint_angle", "tilts"]),
    ("hexapod-rus", ["limits.base_joint_angle=30 deg"], ["limits.base_joint_angle", "leave it out"]),
]


@pytest.mark.parametrize(("name", "settings", "words"), REFUSED)
def test_a_limit_that_cannot_be_meant_is_refused(name, settings, words):
    with refused() as caught:
        load(name, settings)
    for word in words:
        assert word in str(caught.value)


def test_a_limit_can_be_lifted():
    machine = load("hexapod", [f"limits.{name}=none" for name in LIMITS])
    assert machine == load("hexapod") or values(machine) == values(load("hexapod"))


def test_a_file_with_limits_is_written_and_read_back():
    machine = load("hexapod", ["limits.longest_leg=20 cm", "limits.base_joint_angle=60 deg"])
    text = as_toml(machine)
    assert text.count("limits") == 1
    assert "shortest_leg" not in text
    assert values(build(document.parse(text, "x"), "x")) == values(machine)


def test_the_slack_is_beyond_rounding_and_below_what_anyone_measures():
    assert 1e-14 < LIMIT_SLACK < 1e-7

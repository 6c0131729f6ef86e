"""Forward kinematics against closed forms and against the inverse way; leg by leg against families."""

import math

import numpy as np
import pytest

from kinetostat import Status, analyze, bundled, forward
from kinetostat.cli import main
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.kinematics.forward import stand as actuators_of
from kinetostat.machine.loading import build
from kinetostat.views.answers import plain_of
from machines import load_without_limits
from refusals import refused

ANGLES = ("roll", "pitch", "yaw", "angle")


def stand(machine):
    return {actuator.name: actuator.coordinate for actuator in actuators_of(machine)}


def distance(first, second):
    """Of two poses, m and rad."""
    return max(
        abs(math.remainder(first[name] - second[name], 2 * math.pi if name in ANGLES else 1e9)) for name in first
    )


@pytest.mark.parametrize("name", [name for name in bundled() if not name.startswith("hexapod-hardware")])
def test_the_present_mode_is_the_pose_that_the_inverse_way_came_from(name):
    machine = load_without_limits(name)
    pose = dict(vars(machine.tables["pose"]))
    sizes = {path: 0.04 if path in ANGLES or "theta" in path else 0.004 for path in pose}
    there = {path: value + sizes[path] * math.cos(7.0 * i) for i, (path, value) in enumerate(pose.items())}
    answer = forward(machine, stand(machine.with_values(there)), starts=0)
    assert answer.present is not None
    assert distance(answer.present.pose, there) < 1e-12


def test_every_mode_of_a_hexapod_has_the_legs_that_were_given():
    machine = load_without_limits("hexapod")
    lengths = {f"leg {i}": 0.095 + 0.001 * i for i in range(1, 7)}
    answer = forward(machine, lengths)
    assert len(answer.poses) > 4
    assert sum(pose.present for pose in answer.poses) == 1
    for pose in answer.poses:
        legs = machine.with_values(pose.pose).configure().legs
        spans = [math.dist(leg.path[0].components(), leg.path[-1].components()) for leg in legs]
        assert spans == pytest.approx(list(lengths.values()), abs=1e-12)


def roots(function, count=20001):
    """All places in a turn where a function of an angle changes its sign, by halving."""
    angles = np.linspace(-math.pi, math.pi, count)
    values = [function(angle) for angle in angles]
    for low, high, left, right in zip(angles, angles[1:], values, values[1:], strict=False):
        if left * right < 0.0 and abs(left) + abs(right) < 1e3:
            for _ in range(80):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if function(middle) * left > 0.0 else (low, middle)
            yield 0.5 * (low + high)


def test_all_modes_of_a_planar_machine_are_the_roots_of_one_equation_of_its_angle():
    """Three circles: two differences are linear in x and y, which leaves one equation of the angle."""
    machine = load_without_limits("planar-3rpr")
    geometry = machine.tables["geometry"]
    base = [geometry.base_radius * np.array([math.cos(a), math.sin(a)]) for a in geometry.base_angles]
    top = [geometry.platform_radius * np.array([math.cos(a), math.sin(a)]) for a in geometry.platform_angles]
    lengths = list(stand(machine).values())

    def position(angle):
        c, s = math.cos(angle), math.sin(angle)
        arms = [np.array([c * p[0] - s * p[1], s * p[0] + c * p[1]]) - b for p, b in zip(top, base, strict=True)]
        rows = 2 * np.array([arms[1] - arms[0], arms[2] - arms[0]])
        right = [lengths[i] ** 2 - lengths[0] ** 2 - arms[i] @ arms[i] + arms[0] @ arms[0] for i in (1, 2)]
        return np.linalg.solve(rows, right), arms[0]

    def off(angle):
        point, arm = position(angle)
        return float((point + arm) @ (point + arm)) - lengths[0] ** 2

    expected = sorted((*position(angle)[0], angle) for angle in roots(off))
    answer = forward(machine, starts=300, spread=math.pi)
    positions = sorted(tuple(pose.pose.values()) for pose in answer.poses)
    assert len(expected) > 1
    assert np.array(positions) == pytest.approx(np.array(expected), abs=1e-9)


def test_the_modes_of_a_delta_are_the_meetings_of_three_spheres():
    machine = load_without_limits("delta")
    geometry = machine.tables["geometry"]
    angles = list(stand(machine).values())
    reach = [geometry.base_radius - geometry.platform_radius + geometry.arm_length * math.cos(a) for a in angles]
    centres = np.array(
        [
            [r * math.cos(turn), r * math.sin(turn), geometry.arm_length * math.sin(a)]
            for r, turn, a in zip(reach, geometry.leg_angles, angles, strict=True)
        ]
    )
    middle, *_ = np.linalg.lstsq(
        2 * (centres[1:] - centres[0]), (centres[1:] ** 2).sum(1) - (centres[0] ** 2).sum(), rcond=None
    )
    normal = np.cross(centres[1] - centres[0], centres[2] - centres[0])
    normal /= np.linalg.norm(normal)
    across = middle - centres[0]
    b, c = normal @ across, across @ across - geometry.bar_length**2
    both = [middle + normal * (-b + sign * math.sqrt(b * b - c)) for sign in (1, -1)]
    low = min(both, key=lambda point: point[2])
    (pose,) = forward(machine).poses
    assert pose.present
    assert pose.position == pytest.approx(tuple(low), abs=1e-12)


def test_a_machine_leg_by_leg_has_the_modes_of_its_family():
    """The Newton of joints against that of pose coordinates."""
    family = load_without_limits("planar-3rpr")
    legs = build(document_of(family))
    expected = forward(family, spread=2.0).poses
    poses = forward(legs, spread=2.0).poses
    assert len(poses) == len(expected) > 1
    for pose in expected:
        nearest = min(poses, key=lambda other: math.dist(other.position, pose.position))
        assert nearest.position == pytest.approx(pose.position, abs=1e-12)
        assert nearest.present == pose.present


def test_a_leg_by_leg_hexapod_is_followed_and_counts_its_legs():
    machine = load_without_limits("hexapod-hardware")
    there = machine.with_values(x=0.01, y=-0.02, z=0.45, roll=0.05, pitch=-0.04, yaw=0.1)
    answer = forward(machine, stand(there), starts=0)
    assert distance(answer.present.pose, vars(there.tables["pose"])) < 1e-12
    assert {actuator.meaning for actuator in answer.actuators} == {"length of the leg"}


def test_a_singularity_on_the_way_ends_the_present_mode():
    """A crank of a delta cannot turn round; beyond, there is a pose all the same, and the way does not lead to it."""
    answer = forward(load_without_limits("delta"), {"leg 1": "400 deg"})
    assert answer.poses
    assert answer.present is None
    assert "do not lead" in answer.message


REFUSED = {
    "name of an actuator": {"leg 9": 0.1},
    "not a unit of length": {"leg 1": "3 deg"},
    "given twice": {"leg 1": 0.1, "leg 1 actuator": 0.1},
    "not a finite number": {"leg 1": math.nan},
}


@pytest.mark.parametrize("reason", REFUSED)
def test_what_is_no_coordinate_is_refused(reason):
    with refused(reason):
        forward(load_without_limits("hexapod"), REFUSED[reason])


def test_too_few_actuators_are_refused():
    document = document_of(load_without_limits("planar-3rpr"))
    for part in document["legs"][0]["joints"]:
        part.pop("actuated", None)
        part.pop("stiffness", None)
    with refused("do not determine"):
        forward(build(document))


def test_arguments_out_of_bounds_are_named():
    for wrong in ({"starts": -1}, {"spread": 0.0}, {"spread": math.nan}, {"actuators": 3}):
        with refused(next(iter(wrong))):
            forward(load_without_limits("hexapod"), **wrong)


def test_status_says_what_the_machine_is_there():
    machine = load_without_limits("hexapod").with_values({"limits.longest_leg": 0.0953})
    answer = forward(machine, {"leg 1": 0.096}, starts=0)
    assert answer.present.status is Status.JOINT_LIMIT


def test_the_command_prints_the_modes_and_says_when_there_is_none(capsys):
    assert main(["forward", "planar-3rpr", "--actuators", "leg 1=20 cm, leg 2=170 mm"]) == 0
    assert "(present)" in capsys.readouterr().out
    assert main(["forward", "hexapod", "--actuators", "leg 1=90 cm"]) == 1
    assert "No pose near" in capsys.readouterr().err
    assert main(["forward", "hexapod", "--actuators", "leg 1"]) == 2


def test_an_analysis_shows_where_the_actuators_stand():
    machine = load_without_limits("hexapod")
    analysis = analyze(machine)
    assert {actuator.name: actuator.coordinate for actuator in analysis.actuators} == stand(machine)
    assert plain_of(analysis)["actuators"][0]["meaning"] == "length of the leg"


def test_a_slide_at_the_end_of_its_leg_has_the_position_of_the_platform():
    machine = load_without_limits("tricept").with_values({"stiffness.tube_actuator": 1e8})
    (tube,) = (actuator for actuator in actuators_of(machine) if actuator.leg == "tube")
    assert tube.coordinate == pytest.approx(machine.tables["pose"].length, abs=1e-15)

"""Pulls become numbers: the platform and the joints go where they are pulled, and what is not pulled stays."""

import pytest

from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.state import state_of
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.parameters import values, with_values
from kinetostat.studio.pulling import (
    BASE,
    HEAD,
    MOVES,
    PLATFORM,
    Pull,
    free_axes,
    goal_of,
    handles,
    numbers_after_pull,
    point_goal,
)

HEXAPOD = "hexapod"


def follow(machine, axis, amount):
    start = state_of(machine).configuration.platform
    numbers = numbers_after_pull(Pull(machine, PLATFORM, "", axis, goal_of(start, axis, amount)))
    return numbers, start, state_of(with_values(machine, numbers)).configuration.platform


@pytest.mark.parametrize("name", bundled())
def test_every_platform_goes_where_it_is_pushed(name):
    machine = load(name)
    step = 0.01 * float(state_of(machine).configuration.length)
    axes = free_axes(machine)
    assert axes
    for axis in set(axes) & set(MOVES):
        numbers, start, end = follow(machine, axis, step)
        assert all(path.startswith("pose.") for path in numbers)
        moved = (end.translation - start.translation).components()
        assert moved["xyz".index(axis)] == pytest.approx(step, rel=0.02), axis


def test_a_push_keeps_the_orientation_and_a_turn_the_place():
    machine = load(HEXAPOD, ["pose.roll=5 deg", "pose.yaw=-8 deg"])
    _, start, pushed = follow(machine, "y", 0.01)
    assert (pushed.rotation.x - start.rotation.x).norm() < 1e-6
    _, start, turned = follow(machine, "ry", 0.2)
    assert (turned.translation - start.translation).norm() < 1e-7
    assert turned.rotation.x.dot(start.rotation.x) < 0.99


@pytest.mark.parametrize("axis", ["x", "y", "z", "rx", "rz"])
def test_coordinates_that_are_not_pulled_keep_every_digit(axis):
    machine = load(HEXAPOD, ["pose.x=7.123456789 mm", "pose.z=133.3333333333 mm"])
    numbers, _, _ = follow(machine, axis, 0.0031)
    present = values(machine)
    own = {"x": "x", "y": "y", "z": "z", "rx": "roll", "rz": "yaw"}[axis]
    assert {path for path, number in numbers.items() if number != present[path]} == {f"pose.{own}"}


def test_only_motions_that_a_machine_has_are_offered():
    assert free_axes(load("delta")) == ("x", "y", "z")
    assert free_axes(load("planar-3rpr")) == ("x", "y", "rz")
    assert free_axes(load("zhang-gosselin-4dof")) == ("x", "z", "rx", "ry")


@pytest.mark.parametrize("of", [BASE, HEAD])
def test_a_joint_goes_where_it_is_pulled_by_geometry_alone(of):
    machine = load(HEXAPOD, ["pose.x=1 cm", "pose.pitch=4 deg"])
    configuration = state_of(machine).configuration
    handle = next(h for h in handles(configuration, ()) if (h.kind, h.leg) == (of, "leg 3"))
    up = configuration.platform.rotation if of == HEAD else None
    along = up.x if up else Vector(1.0, 0.0, 0.0)
    goal = handle.point + along * 0.004
    numbers = numbers_after_pull(Pull(machine, of, "leg 3", "", point_goal(goal.components())))
    assert all(path.startswith("geometry.") for path in numbers)
    after = state_of(with_values(machine, numbers)).configuration
    reached = next(h for h in handles(after, ()) if (h.kind, h.leg) == (of, "leg 3")).point
    assert (reached - goal).norm() < 1e-6
    assert (after.platform.translation - configuration.platform.translation).norm() == 0.0


def test_a_joint_of_a_machine_leg_by_leg_moves_alone():
    machine = load("tripteron")
    handle = next(h for h in handles(state_of(machine).configuration, ()) if (h.kind, h.leg) == (HEAD, "z"))
    goal = handle.point + Vector(0.01, 0.005, 0.0)
    numbers = numbers_after_pull(Pull(machine, HEAD, "z", "", point_goal(goal.components())))
    changed = {path for path, number in numbers.items() if abs(number - values(machine)[path]) > 1e-6}
    assert changed == {"legs.z.wrist.point.0", "legs.z.wrist.point.1"}


def test_a_pull_out_of_reach_goes_nowhere_impossible():
    machine = load("tricept")
    numbers, _, end = follow(machine, "z", 50.0)
    assert all(abs(number) < 100.0 for number in numbers.values())
    assert all(abs(c) < 100.0 for c in end.translation.components())

"""Closing equations: zero where the legs meet at the pose; gaps of legs and their rates."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from kinetostat.algebra.vector import IDENTITY, Displacement, Vector
from kinetostat.kinematics.closing import closing_equations, free_coordinates, leg_end
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.leg_gaps import problems_of
from kinetostat.machine.leg import Joint
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Chains, Step

COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
STEP = 1e-5
HALF = 0.5 * STEP


def arm(lean):
    """Six joints in a row, none parallel to another."""
    axes = [(0.0, 0.6, 0.8), (1.0, 0.0, 0.0), (0.0, 0.8, -0.6), (0.6, 0.0, 0.8), (0.8, 0.6, 0.0), (0.0, 0.0, 1.0)]
    points = [Vector(0.1 * k, lean * k, 0.2 - 0.05 * k * k) for k in range(5)]
    joints = [Joint(Vector(*axis), point) for axis, point in zip(axes, [*points, None], strict=True)]
    return tuple(Step(joint, True) for joint in joints)


HOME = Displacement(IDENTITY, Vector(0.5, 0.1, 0.6))
ARMS = Chains((arm(0.1), arm(-0.2)), HOME, {}, 0.7)


def rates(chains, found):
    """Rates of the equations by the joint coordinates [equations x coordinates], by central differences."""
    steps = np.eye(len(found)) * HALF
    pairs = [(closing_equations(chains, found + step), closing_equations(chains, found - step)) for step in steps]
    return np.array([np.subtract(*pair) for pair in pairs], dtype=float).T / STEP


def placed(chains, found):
    """Coordinates of the platform where the first leg takes it."""
    end = leg_end(chains.legs[0], HOME, iter(found)).platform
    turn, point = end.rotation, end.translation
    flat = float(np.hypot(turn.x.x, turn.x.y))
    angles = np.arctan2(turn.y.z, turn.z.z), np.arctan2(-turn.x.z, flat), np.arctan2(turn.x.y, turn.x.x)
    return dict(zip(COORDINATES, (point.x, point.y, point.z, *map(float, angles)), strict=True))


@pytest.mark.parametrize("given", [c for n in (1, 2, 3, 6) for c in combinations(COORDINATES, n)], ids="-".join)
def test_pose_equations_vanish_and_fix_as_much_as_is_given(given):
    found = np.random.default_rng(3).uniform(-0.4, 0.4, 6).tolist()
    one = replace(ARMS, legs=ARMS.legs[:1])
    reached = placed(one, found)
    there = replace(one, pose={name: reached[name] for name in given})
    assert np.array(closing_equations(there, found)) == pytest.approx(0.0, abs=1e-15)
    assert np.linalg.matrix_rank(rates(there, np.array(found)), tol=1e-7) == len(given)


@pytest.mark.parametrize("given", [COORDINATES, ("x", "y", "z"), ("y", "roll"), ("x", "pitch", "yaw")], ids="-".join)
def test_gaps_change_at_their_rates(given):
    """By differences, near the home pose where the sine of an angle changes as the angle."""
    chains = replace(ARMS, pose=dict.fromkeys(given, 0.0))
    free = free_coordinates(chains)
    assert set(free) == set(COORDINATES) - set(given)
    for problems in problems_of(chains, 1, free):
        goal, here = problems.at_home(), np.zeros((1, problems.size))
        gaps, slopes, _ = problems.gaps(here, goal)
        assert gaps == pytest.approx(0.0, abs=1e-15)
        for k, step in enumerate(np.eye(problems.size) * HALF):
            change = problems.gaps(here + step, goal)[0] - problems.gaps(here - step, goal)[0]
            assert -change / STEP == pytest.approx(np.atleast_2d(slopes[..., k]), abs=1e-9)


@pytest.mark.parametrize("pose", [(0.5, 0.5, 0.5), (0.4, 0.62, 0.35)])
def test_they_vanish_where_joints_have_been_found(pose):
    machine = load("tripteron", [f"pose.{name}={value}" for name, value in zip("xyz", pose, strict=True)])
    equations = closing_equations(machine.chains(), solve_joints(machine).coordinates)
    assert len(equations) == 2 * 6 + 3
    assert np.array(equations) == pytest.approx(0.0, abs=1e-14)

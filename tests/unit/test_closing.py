"""Closing equations: zero where the legs meet at the pose, and their rates those of the joints' screws (`gaps_at`)."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from kinetostat.algebra.vector import IDENTITY, Displacement, Vector
from kinetostat.kinematics.closing import closing_equations, gaps_at, pose_of, units_of
from kinetostat.kinematics.closure import solve_joints
from kinetostat.machine.leg import Joint
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Chains, Step

COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
STEP = 1e-5
HALF = 0.5 * STEP


def in_metres(chains, rates):
    """Rates of gaps in rad and in units of the length as rates in m, per rad or m of each joint coordinate."""
    length = float(chains.length)
    return rates * length / units_of(chains, np.array([length]))[0]


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


@pytest.mark.parametrize("given", [c for n in (1, 2, 3, 6) for c in combinations(COORDINATES, n)], ids="-".join)
def test_pose_equations_vanish_and_change_as_the_pose_does(given):
    found = np.random.default_rng(3).uniform(-0.4, 0.4, 6)
    one = replace(ARMS, legs=ARMS.legs[:1])
    reached = pose_of(gaps_at(replace(one, pose={"x": 0.0}), found[None], np.zeros((1, 1))).platform)
    placed = replace(one, pose={name: float(reached[name][0]) for name in given})
    assert np.array(closing_equations(placed, found)) == pytest.approx(0.0, abs=1e-15)
    own = rates(placed, found)
    theirs = in_metres(placed, gaps_at(placed, found[None], np.array([list(placed.pose.values())])).pose_rates[0])
    rank = np.linalg.matrix_rank(theirs)
    assert rank == len(given)
    assert np.linalg.matrix_rank(np.vstack([own, theirs]), tol=1e-7) == rank, "they fix the same motions"
    assert np.linalg.matrix_rank(own, tol=1e-7) == rank


def test_gaps_of_legs_change_by_the_difference_of_their_screws():
    chains = replace(ARMS, pose={"x": 0.5})
    found = np.zeros(12)
    gaps = gaps_at(chains, found[None], np.array([[0.5]]))
    assert np.array(closing_equations(chains, found)) == pytest.approx(0.0, abs=1e-15)
    assert rates(chains, found)[:6] == pytest.approx(-in_metres(chains, gaps.closure_rates[0]), abs=1e-9)
    assert rates(chains, found)[6] == pytest.approx(-in_metres(chains, gaps.pose_rates[0])[0], abs=1e-9)


@pytest.mark.parametrize("pose", [(0.5, 0.5, 0.5), (0.4, 0.62, 0.35)])
def test_they_vanish_where_joints_have_been_found(pose):
    machine = load("tripteron", [f"pose.{name}={value}" for name, value in zip("xyz", pose, strict=True)])
    equations = closing_equations(machine.chains(), solve_joints(machine).coordinates)
    assert len(equations) == 2 * 6 + 3
    assert np.array(equations) == pytest.approx(0.0, abs=1e-14)

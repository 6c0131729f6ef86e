"""Random planar machines with cranks and slides: what a walk in many small steps reaches, kinetostat reaches as well.

The walk is written out here, in the plane and with joints of its own, so that it shares nothing with the package.
"""

import math
from itertools import islice

import numpy as np
import pytest

from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.status import Status
from kinetostat.machine.loading import build
from kinetostat.machine.parameters import with_values

LEGS_OF_THREE = ("RRR", "RPR", "PRR", "RRP", "PPR", "PRP", "RPP")
LEGS_OF_TWO = ("RR", "RP", "PR")
SMALL_STEPS = 80
SAME_BRANCH = 0.3
"""Change of a joint in a small step, rad or m, above which the walk has jumped."""


class Random:
    """A planar machine drawn from a seed: three legs of three joints, or two legs that leave the angle dependent."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.complete = rng.random() < 0.7
        self.given = ("x", "y", "yaw") if self.complete else ("x", "y")
        self.home = np.append(rng.uniform(-0.1, 0.1, 2), 0.0)
        kinds = rng.choice(LEGS_OF_THREE, 3) if self.complete else [rng.choice(LEGS_OF_TWO), rng.choice(LEGS_OF_THREE)]
        self.legs = [self.leg(rng, kind) for kind in kinds]
        self.goals = self.home + rng.uniform(-1.0, 1.0, (6, 3)) * [0.3, 0.3, 1.2]

    def leg(self, rng, kinds):
        tip = self.home[:2] + rng.uniform(-0.15, 0.15, 2)
        base = tip + rng.uniform(0.25, 0.7) * unit(rng.uniform(0.0, 2.0 * math.pi))
        points = np.linspace(base, tip, len(kinds)) + rng.normal(0.0, 0.12, (len(kinds), 2))
        return [(kind, point, unit(rng.uniform(0.0, 2.0 * math.pi))) for kind, point in zip(kinds, points, strict=True)]

    def document(self):
        legs = []
        for number, leg in enumerate(self.legs):
            bodies = ["base", *(f"link {k}" for k in range(1, len(leg))), "platform"]
            joints = [self.joint(k, *joint, bodies[k : k + 2]) for k, joint in enumerate(leg)]
            legs.append({"name": f"leg {number}", "joints": joints})
        pose = dict(zip(self.given, map(float, self.home), strict=False))
        point = [*map(float, self.home[:2]), 0.0]
        head = {"schema": 1, "name": "random", "family": "legs", "space": "planar"}
        return head | {"platform": {"point": point}, "pose": pose, "legs": legs}

    def joint(self, number, kind, point, axis, bodies):
        axis = [0.0, 0.0, 1.0] if kind == "R" else [*map(float, axis), 0.0]
        sort = "revolute" if kind == "R" else "prismatic"
        drive = {} if number else {"actuated": True, "stiffness": 1e5}
        joint = {"name": f"joint {number}", "type": sort, "joins": bodies, "point": [*map(float, point), 0.0]}
        return joint | {"axis": axis} | drive

    def gaps(self, unknowns, place):
        """From the legs' ends to a place (x, y, angle), with the rates of the ends; an unknown angle comes last."""
        place = place if self.complete else np.append(place[:2], unknowns[-1])
        gaps, rates, first = [], np.zeros((3 * len(self.legs), len(unknowns))), 0
        for row, leg in enumerate(self.legs):
            end, twists = placed(leg, unknowns[first : first + len(leg)], self.home[:2])
            gaps.append(place - end)
            rates[3 * row : 3 * row + 3, first : first + len(leg)] = twists
            rates[3 * row + 2, -1] -= 0.0 if self.complete else 1.0
            first += len(leg)
        return np.concatenate(gaps), rates

    def signs(self, rates):
        """Of the determinants that vanish where branches meet: of each leg, or of all together."""
        blocks = [rates[i : i + 3, i : i + 3] for i in (0, 3, 6)] if self.complete else [rates]
        return np.sign(np.linalg.det(np.array(blocks)))

    def walked(self, goal):
        """Joints at a goal by the straight way in small steps; None where that is blocked, or leads near a branch."""
        unknowns = np.zeros(sum(map(len, self.legs)) + (not self.complete))
        signs = self.signs(self.gaps(unknowns, self.home)[1])
        for share in np.arange(1, SMALL_STEPS + 1) / SMALL_STEPS:
            before, place = unknowns, self.home + share * (goal - self.home)
            for _ in range(12):
                gaps, rates = self.gaps(unknowns, place)
                if np.abs(gaps).max() < 1e-12:
                    break
                unknowns = unknowns + np.linalg.solve(rates, gaps)
            jumped = np.abs(gaps).max() > 1e-9 or np.abs(unknowns - before).max() > SAME_BRANCH
            if jumped or (self.signs(rates) != signs).any():
                return None
        return unknowns


def unit(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def placed(leg, amounts, tool):
    """Place (x, y, angle) to which a leg takes the tool, and the rates of that."""
    angle, shift, movers = 0.0, np.zeros(2), []
    for (kind, point, axis), amount in zip(leg, amounts, strict=True):
        if kind == "R":
            centre = turned(point, angle) + shift
            angle += amount
            shift = centre - turned(point, angle)
            movers.append((centre, True))
        else:
            direction = turned(axis, angle)
            shift = shift + amount * direction
            movers.append((direction, False))
    end = turned(tool, angle) + shift
    twists = [[*((end - c) @ [[0.0, 1.0], [-1.0, 0.0]]), 1.0] if turns else [*c, 0.0] for c, turns in movers]
    return np.append(end, angle), np.array(twists).T


def turned(vector, angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]) @ vector


def walks(random, most):
    """The first goals that are reached, with the joints there."""
    reached = ((goal, joints) for goal in random.goals for joints in [random.walked(goal)] if joints is not None)
    return list(islice(reached, most))


NEAR_SINGULAR, LONG_STRIDE = 357, 396
"""A home pose whose joints turn fast at first, and a way on which one long step would end in another assembly mode."""


@pytest.mark.parametrize("seeds", [(*range(20), NEAR_SINGULAR, LONG_STRIDE)], ids=["seeds"])
def test_what_a_walk_in_small_steps_reaches_is_reached_at_the_same_joints(seeds):
    count = 0
    for seed in seeds:
        random = Random(seed)
        reached = walks(random, 2)
        if not reached:
            continue
        goals, wanted = (np.array(column) for column in zip(*reached, strict=True))
        poses = {f"pose.{name}": goals[:, k] for k, name in enumerate(random.given)}
        solved = solve_joints(with_values(build(random.document(), "random"), poses))
        assert (np.broadcast_to(solved.status, len(goals)) == Status.OK).all(), f"seed {seed}"
        joints = np.stack([np.broadcast_to(amount(q), len(goals)) for q in solved.coordinates], axis=1)
        assert np.cos(joints - wanted[:, : joints.shape[1]]) == pytest.approx(1.0, abs=1e-9), f"seed {seed}"
        count += len(reached)
    assert count > len(seeds)


def amount(coordinate):
    return np.arctan2(coordinate.sine, coordinate.cosine) if hasattr(coordinate, "sine") else np.asarray(coordinate)

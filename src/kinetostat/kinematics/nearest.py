"""The admissible pose nearest to one that the legs of a machine cannot take, for messages. Nothing is judged here.

Source: theory section 6.
"""

from dataclasses import dataclass

import numpy as np

from kinetostat.kinematics.closing import ANGLES, POINT, Array
from kinetostat.kinematics.leg_gaps import Numbers, Problems, free_coordinates, least_norm, problems_of
from kinetostat.machine.machine import Machine
from kinetostat.tolerances import CLOSED, DEPENDENT, NEAREST_SETTLED, NO_COORDINATE

MOST_STEPS, MOST_TRIALS, MOST_CORRECTIONS = 30, 12, 8
"""Towards the nearest pose; dampings of a step; and of Newton's method, which closes the legs again after it."""


def nearest_pose(machine: Machine) -> dict[str, float]:
    """Return all coordinates (m, rad) of an admissible pose near a pose that the legs cannot take.

    Distance is that of the pose coordinates given, angles times the machine's characteristic length. From the home pose
    it becomes less step by step, along what the closed legs allow, so that the branch of the home pose is kept.
    """
    chains = machine.chains()
    names = tuple(name for name in (*POINT, *ANGLES) if name in {*chains.pose, *free_coordinates(chains)})
    (problems,) = problems_of(chains, 1, names)
    home = {name: float(value) for name, value in problems.at_home().items()}
    units = np.array([1.0 if name in ANGLES else problems.lengths[0] for name in names])
    apart = np.array([float(chains.pose.get(name, home[name])) - home[name] for name in names]) / units
    turning = np.array([name in ANGLES for name in names])
    apart = np.where(turning, np.arctan2(np.sin(apart), np.cos(apart)), apart)
    given = np.flatnonzero([name in chains.pose for name in names])
    first = problems.size - len(names)
    best = _Search(problems, home, first + given, apart[given]).nearest()
    nearest = home | {name: home[name] + change for name, change in zip(names, best[first:] * units, strict=True)}
    return {name: 0.0 if abs(value) < NO_COORDINATE else float(value) for name, value in nearest.items()}


@dataclass(frozen=True)
class _Search:
    """Unknowns that close the legs and bring some of them as near to a goal as possible.

    Attributes:
        problems: the equations of all legs, with every coordinate of the pose free.
        home: coordinates of the platform at the home pose.
        rows: which unknowns have a goal.
        goal: theirs.
    """

    problems: Problems
    home: dict[str, float]
    rows: Numbers
    goal: Array

    def nearest(self) -> Array:
        """Go on from the home pose until no way that the legs allow leads nearer."""
        best, damping = np.zeros(self.problems.size), 1e-3
        for _ in range(MOST_STEPS):
            left = self.goal - best[self.rows]
            ways = self._ways(best)
            slope = ways[self.rows].T @ left
            if np.linalg.norm(slope) <= NEAREST_SETTLED * np.linalg.norm(left):
                break
            nearer, damping = self._nearer(best, ways, damping)
            gain = np.linalg.norm(nearer - best)
            best = nearer
            if gain <= NEAREST_SETTLED:
                break
        return best

    def _ways(self, unknowns: Array) -> Array:
        """Directions in which the legs stay closed, to first order [unknowns x directions]."""
        rates = self.problems.gaps(unknowns[None], self.home)[1][0]
        _, sizes, directions = np.linalg.svd(rates)
        rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
        return np.asarray(directions[rank:].T)

    def _nearer(self, unknowns: Array, ways: Array, damping: float) -> tuple[Array, float]:
        """Take the longest step that leads nearer to the goal; return its end and the damping for the next one."""
        left, slopes = self.goal - unknowns[self.rows], ways[self.rows]
        for _ in range(MOST_TRIALS):
            square = slopes.T @ slopes + damping * np.eye(slopes.shape[1])
            there = self._closed(unknowns + ways @ np.linalg.solve(square, slopes.T @ left))
            if np.linalg.norm(self.goal - there[self.rows]) < np.linalg.norm(left):
                return there, 0.2 * damping
            damping *= 5.0
        return unknowns, damping

    def _closed(self, unknowns: Array) -> Array:
        """Close the legs again, wherever that takes the platform; NaN where they do not close."""
        for _ in range(MOST_CORRECTIONS):
            left, rates = self.problems.gaps(unknowns[None], self.home)
            if np.max(np.abs(left)) <= CLOSED:
                return unknowns
            unknowns = unknowns + least_norm(rates, left)[0]
        return np.full_like(unknowns, np.nan)

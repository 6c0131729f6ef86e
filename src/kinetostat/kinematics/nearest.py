"""The admissible pose nearest to one that the legs of a machine cannot take, for messages. Nothing is judged here.

Source: theory section 6.
"""

from dataclasses import dataclass

import numpy as np

from kinetostat.kinematics.closing import ANGLES, POINT, Array
from kinetostat.kinematics.leg_gaps import Numbers, Problems, free_coordinates, least_norm, problems_of
from kinetostat.machine.machine import Machine
from kinetostat.tolerances import CLOSED, DEPENDENT, NEAREST_GAIN, NEAREST_SETTLED, NO_COORDINATE

MOST_STEPS, MOST_CORRECTIONS = 30, 8
"""Towards the nearest pose; and of Newton's method, which closes the legs again after each of them."""
DAMPINGS: Array = 5.0 ** np.arange(-3.0, 6.0)
"""Dampings of a step that are tried in one batch, in units of the one that led nearest in the step before."""
CONTRACTION = 0.25
"""Share of a gap that a correction may leave; a step from which it leaves more was too long."""


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
        """Go on from the home pose until no way that the legs allow leads nearer by more than the figures show."""
        best, last, damping = np.zeros(self.problems.size), np.zeros(self.problems.size), 1e-3
        rates = self.problems.gaps(best[None], self.home)[1][0]
        for _ in range(MOST_STEPS):
            left, ways = self.goal - best[self.rows], _ways(rates)
            far, slope = np.linalg.norm(left), ways[self.rows].T @ left
            if np.linalg.norm(slope) <= NEAREST_SETTLED * far:
                break
            tried = damping * DAMPINGS
            steps = self._steps(ways, slope, tried)
            # Along a curved border of the reach each step is a constant share of the one before: go on along that, too.
            ends, rates_there = self._closed(best + np.concatenate([steps, steps + ways @ (ways.T @ last)]))
            apart = np.linalg.norm(self.goal - ends[:, self.rows], axis=1)
            least = int(np.argmin(np.where(np.isfinite(apart), apart, np.inf)))
            gain = far - apart[least]
            if not gain > 0.0:
                damping = float(tried[-1])
                continue
            last, best, rates = ends[least] - best, ends[least], rates_there[least]
            damping = float(tried[least % len(tried)])
            if gain <= NEAREST_GAIN * far:
                break
        return best

    def _steps(self, ways: Array, slope: Array, dampings: Array) -> Array:
        """Steps of Levenberg's and Marquardt's method along the ways that the legs allow [dampings x unknowns]."""
        slopes = ways[self.rows]
        squares = slopes.T @ slopes + dampings[:, None, None] * np.eye(len(slope))
        amounts = np.linalg.solve(squares, np.broadcast_to(slope[:, None], (len(dampings), len(slope), 1)))
        return np.asarray(amounts[:, :, 0] @ ways.T)

    def _closed(self, unknowns: Array) -> tuple[Array, Array]:
        """Close the legs again, wherever that takes the platform.

        Args:
            unknowns: near closed legs [n x unknowns].

        Returns:
            Unknowns that close them, NaN where that fails, and the rates of the gaps there.
        """
        problems = self.problems.take(np.zeros(len(unknowns), dtype=int))
        last, active = np.full(len(unknowns), np.inf), np.ones(len(unknowns), dtype=bool)
        for _ in range(MOST_CORRECTIONS):
            left, rates = problems.gaps(unknowns, self.home)
            gap = np.max(np.abs(left), axis=1)
            active = (gap > CLOSED) & (gap < CONTRACTION * last)
            if not active.any():
                break
            unknowns = unknowns + np.where(active[:, None], least_norm(rates, left), 0.0)
            last = gap
        return np.where((gap <= CLOSED)[:, None], unknowns, np.nan), rates


def _ways(rates: Array) -> Array:
    """Directions in which the legs stay closed, to first order [unknowns x directions].

    Args:
        rates: of the gaps [rows x unknowns].
    """
    _, sizes, directions = np.linalg.svd(rates)
    rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
    return np.asarray(directions[rank:].T)

"""The admissible pose nearest to one that the legs of a machine cannot take, for messages. Nothing is judged here.

Source: theory section 6.
"""

import numpy as np

from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import ANGLES, POINT
from kinetostat.kinematics.leg_gaps import Problems, free_coordinates, least_norm, problems_of
from kinetostat.machine.machine import Machine
from kinetostat.numerics.iteration import Steps, largest, newton
from kinetostat.tolerances import CLOSED, DEPENDENT, NEAREST_GAIN, NO_COORDINATE

MOST_STEPS, MOST_CORRECTIONS = 30, 8
"""Towards the nearest pose; and of Newton's method, which closes the legs again after each of them."""
DAMPINGS: Array = 5.0 ** np.arange(-3.0, 6.0)
"""Dampings of a step that are tried in one batch, in units of the one that led nearest in the step before."""
CLOSING_CONTRACTION = 0.25
"""Share of a gap that a correction may leave; a step from which it leaves more was too long."""
BESIDE = 1e-6
"""Displacement of the unknowns, rad or in units of the machine's length, whose rates show how ways are curved."""
NEARLY_CLOSED = 1e-3
"""Gap of the legs after a step, as a share of its square, that is left to the next step: what a step gains in distance
falls with the same square."""
LONG_STEP = 0.1
"""Size of a step, rad or in units of the machine's length, from which this gap grows no more."""


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
    rows: Integers
    goal: Array

    def nearest(self) -> Array:
        """Go on from the home pose until the next step would lead nearer by less than the figures show.

        Each step is Newton's for the squared distance, along the ways that the legs allow. It is tried with several
        dampings, which are added to the curvatures; these count without their sign, so that every step leads nearer.
        """
        best, damping = np.zeros(self.problems.size), 1e-3
        gap, rates = (each[0] for each in self.problems.gaps(best[None], self.home))
        for _ in range(MOST_STEPS):
            pull = np.zeros(len(best))
            pull[self.rows] = self.goal - best[self.rows]
            far, ways = np.linalg.norm(pull), _ways(rates)
            loads = np.linalg.lstsq(rates.T, pull, rcond=DEPENDENT)[0]
            sizes, turn = np.linalg.eigh(self._curvature(best, rates, ways, loads))
            along, stiff = ways @ turn, np.maximum(np.abs(sizes), DEPENDENT)
            slope = along.T @ pull
            tried = damping * DAMPINGS
            steps = slope / (stiff + tried[:, None]) @ along.T
            settled = slope @ (slope / stiff) <= NEAREST_GAIN * far * far
            ends, gaps, rates_there = self._closed_ends(best, steps[:1] if settled else steps)
            worth = self._half_squares(ends, gaps, loads)
            least = int(np.argmin(np.where(np.isfinite(worth), worth, np.inf)))
            if worth[least] < self._half_squares(best[None], gap[None], loads)[0]:
                best, gap, rates, damping = ends[least], gaps[least], rates_there[least], float(tried[least])
            else:
                damping = float(tried[-1])
            if settled:
                break
        return self._closed_ends(best, 0.0 * best[None])[0][0]

    def _curvature(self, best: Array, rates: Array, ways: Array, loads: Array) -> Array:
        """The curvature of half the squared distance along the ways [ways x ways], those of the closed legs included.

        Args:
            best: unknowns that nearly close them [unknowns].
            rates: the rates of the gaps there [rows x unknowns].
            ways: along which they stay closed to first order [unknowns x ways].
            loads: Lagrange's multipliers: how strongly each gap keeps the unknowns from the goal [rows].
        """
        problems = self.problems.take(np.zeros(ways.shape[1], dtype=int))
        beside = problems.gaps(best + BESIDE * ways.T, self.home)[1]
        bent = np.einsum("r,nrc->nc", loads, beside - rates) @ ways / BESIDE
        return np.asarray(ways[self.rows].T @ ways[self.rows] + 0.5 * (bent + bent.T))

    def _half_squares(self, ends: Array, gaps: Array, loads: Array) -> Array:
        """Half the squared distances from the goal as they will be once the gaps that are left are closed [n]."""
        return np.asarray(0.5 * ((self.goal - ends[:, self.rows]) ** 2).sum(axis=1) - gaps @ loads)

    def _closed_ends(self, start: Array, steps: Array) -> tuple[Array, Array, Array]:
        """Close the legs again after steps, wherever that takes the platform.

        Args:
            start: unknowns that nearly close them [unknowns].
            steps: the steps from there [n x unknowns].

        Returns:
            Unknowns that nearly close them, NaN where that fails; the gaps that are left there, and their rates.
        """
        count = len(steps)
        problems = self.problems.take(np.zeros(count, dtype=int))
        enough = np.maximum(CLOSED, NEARLY_CLOSED * np.minimum(np.abs(steps).max(axis=1), LONG_STEP) ** 2)
        left, rates = np.zeros((count, problems.rows)), np.zeros((count, problems.rows, problems.size))

        def equations(unknowns: Array, rows: Integers) -> tuple[Array, Steps]:
            left[rows], rates[rows] = problems.take(rows).gaps(unknowns, self.home)
            return largest(left[rows]), lambda going: least_norm(rates[rows[going]], left[rows[going]])

        end = newton(
            equations, start + steps, count, most_steps=MOST_CORRECTIONS, closed=enough, contraction=CLOSING_CONTRACTION
        )
        return np.where(end.converged[:, None], end.value, np.nan), left, rates


def _ways(rates: Array) -> Array:
    """Directions in which the legs stay closed, to first order [unknowns x directions].

    Args:
        rates: the rates of the gaps [rows x unknowns].
    """
    _, sizes, directions = np.linalg.svd(rates)
    rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
    return np.asarray(directions[rank:].T)

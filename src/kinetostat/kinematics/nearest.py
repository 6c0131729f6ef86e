"""The admissible pose nearest to one that the legs of a machine cannot take, for messages. Nothing is judged here.

Source: theory section 6.
"""

import numpy as np

from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import ANGLES, POINT, free_coordinates
from kinetostat.kinematics.leg_gaps import Problems, problems_of
from kinetostat.machine.machine import Machine
from kinetostat.numerics.iteration import Steps, largest, least_norm, newton
from kinetostat.tolerances import CLOSED, DEPENDENT, NEAREST_GAIN, NO_COORDINATE

MOST_STEPS, MOST_CORRECTIONS = 30, 8
"""Number of steps towards the nearest pose, and of Newton's corrections that close the legs again after each step."""
DAMPINGS: Array = 5.0 ** np.arange(-3.0, 6.0)
"""Dampings of a step that are tried in one batch, in units of the one that led nearest in the step before."""
FIRST_DAMPING = 1e-3
"""Damping of the first step, in units of the curvature of the squared distance itself: hardly any."""
CLOSING_CONTRACTION = 0.25
"""Share of a gap that a correction may leave; a step from which it leaves more was too long."""
CURVATURE_STEP = 1e-6
"""Displacement of the unknowns, rad or in units of the machine's length, for differences of the rates."""
NEARLY_CLOSED = 1e-3
"""Gap of the legs that may be left after a step, as a share of the step's square: the distance that a step gains falls
with the same square, so that closing the legs better would be wasted."""
LONG_STEP = 0.1
"""Size of a step, rad or in units of the machine's length, beyond which this gap does not grow."""


def nearest_pose(machine: Machine) -> dict[str, float]:
    """Return all coordinates (m, rad) of an admissible pose near a pose that the legs cannot take.

    The distance is measured in the coordinates that the pose gives, angles times the machine's characteristic length.
    The search starts at the home pose and lowers the distance step by step with closed legs, so that it stays in the
    assembly mode of the home pose.
    """
    chains = machine.chains()
    names = tuple(name for name in (*POINT, *ANGLES) if name in {*chains.pose, *free_coordinates(chains)})
    (problems,) = problems_of(chains, 1, names)
    home = {name: float(value) for name, value in problems.at_home().items()}
    units = np.array([1.0 if name in ANGLES else problems.lengths[0] for name in names])
    wish = np.array([float(chains.pose.get(name, home[name])) - home[name] for name in names]) / units
    are_angles = np.array([name in ANGLES for name in names])
    wish = np.where(are_angles, np.arctan2(np.sin(wish), np.cos(wish)), wish)
    given = np.flatnonzero([name in chains.pose for name in names])
    first = problems.size - len(names)
    best = _Search(problems, home, first + given, wish[given]).nearest()
    nearest = home | {name: home[name] + change for name, change in zip(names, best[first:] * units, strict=True)}
    return {name: 0.0 if abs(value) < NO_COORDINATE else float(value) for name, value in nearest.items()}


@dataclass(frozen=True)
class _Place:
    """Unknowns that nearly close the legs [unknowns], the gaps that are left [rows] and their rates [rows x unknowns].

    Of several places, each of these has one more axis in front.
    """

    unknowns: Array
    gaps: Array
    rates: Array


@dataclass(frozen=True)
class _Search:
    """Unknowns that close the legs and bring some of them as near to a goal as possible.

    Attributes:
        problems: the equations of all legs, with every coordinate of the pose free.
        home: coordinates of the platform at the home pose.
        rows: numbers of the unknowns that have a goal.
        goal: the values that these unknowns should have.
    """

    problems: Problems
    home: dict[str, float]
    rows: Integers
    goal: Array

    def nearest(self) -> Array:
        """Return the unknowns at the nearest pose, found from the home pose by damped Newton steps.

        Each step minimises the squared distance along the motions that the closed legs allow. It is tried with several
        dampings, of which the one that leads nearest is kept. The search ends when the next step would gain less than
        people see in the numbers.
        """
        start = np.zeros(self.problems.size)
        best, damping = _Place(start, *(each[0] for each in self.problems.gaps(start[None], self.home))), FIRST_DAMPING
        for _ in range(MOST_STEPS):
            dampings = damping * DAMPINGS
            steps, loads, settled = self._steps(best, dampings)
            ends = self._closed_ends(best.unknowns, steps[:1] if settled else steps)
            squares = self._half_squares(ends, loads)
            nearest = int(np.argmin(np.where(np.isfinite(squares), squares, np.inf)))
            if squares[nearest] < self._half_squares(best, loads):
                best = _Place(ends.unknowns[nearest], ends.gaps[nearest], ends.rates[nearest])
                damping = float(dampings[nearest])
            else:
                damping = float(dampings[-1])
            if settled:
                break
        return self._closed_ends(best.unknowns, 0.0 * best.unknowns[None]).unknowns[0]

    def _steps(self, here: _Place, dampings: Array) -> tuple[Array, Array, bool]:
        """Newton's steps towards the goal along the motions that closed legs allow, one for each damping.

        Dampings are added to the absolute values of the curvatures, so that a step damped enough leads nearer.

        Returns:
            The steps [dampings x unknowns]; Lagrange's multipliers, which say how strongly each gap keeps the unknowns
            from the goal [rows]; and whether an undamped step would gain nothing that people see.
        """
        to_goal = np.zeros(len(here.unknowns))
        to_goal[self.rows] = self.goal - here.unknowns[self.rows]
        distance, allowed = np.linalg.norm(to_goal), _allowed_motions(here.rates)
        loads: Array = np.asarray(np.linalg.lstsq(here.rates.T, to_goal, rcond=DEPENDENT)[0], dtype=float)
        curvatures, axes = np.linalg.eigh(self._curvature(here, allowed, loads))
        principal, stiff = allowed @ axes, np.maximum(np.abs(curvatures), DEPENDENT)
        slope = principal.T @ to_goal
        steps = slope / (stiff + dampings[:, None]) @ principal.T
        return steps, loads, bool(slope @ (slope / stiff) <= NEAREST_GAIN * distance * distance)

    def _curvature(self, here: _Place, allowed: Array, loads: Array) -> Array:
        """The curvature of half the squared distance, with that of the closed legs [motions x motions].

        Args:
            here: where the legs nearly close.
            allowed: motions by which the legs stay closed to first order [unknowns x motions].
            loads: Lagrange's multipliers, see `_steps` [rows].
        """
        problems = self.problems.subset(np.zeros(allowed.shape[1], dtype=int))
        rates_beside = problems.gaps(here.unknowns + CURVATURE_STEP * allowed.T, self.home)[1]
        of_legs = np.einsum("r,nrc->nc", loads, rates_beside - here.rates) @ allowed / CURVATURE_STEP
        return np.asarray(allowed[self.rows].T @ allowed[self.rows] + 0.5 * (of_legs + of_legs.T))

    def _half_squares(self, places: _Place, loads: Array) -> Array:
        """Half the squared distances from the goal as they will be once the gaps that are left are closed [places]."""
        squares = (self.goal - places.unknowns[..., self.rows]) ** 2
        return np.asarray(0.5 * squares.sum(axis=-1) - places.gaps @ loads)

    def _closed_ends(self, start: Array, steps: Array) -> _Place:
        """Close the legs again after steps, wherever that takes the platform.

        Args:
            start: unknowns that nearly close the legs [unknowns].
            steps: the steps from there [n x unknowns].

        Returns:
            Where the legs nearly close [n x ...]; unknowns are NaN where that fails.
        """
        count = len(steps)
        problems = self.problems.subset(np.zeros(count, dtype=int))
        enough = np.maximum(CLOSED, NEARLY_CLOSED * np.minimum(np.abs(steps).max(axis=1), LONG_STEP) ** 2)
        left, rates = np.zeros((count, problems.rows)), np.zeros((count, problems.rows, problems.size))

        def equations(unknowns: Array, rows: Integers) -> tuple[Array, Steps]:
            left[rows], rates[rows] = problems.subset(rows).gaps(unknowns, self.home)
            return largest(left[rows]), lambda going: least_norm(rates[rows[going]], left[rows[going]])

        end = newton(
            equations,
            start + steps,
            count,
            most_steps=MOST_CORRECTIONS,
            residual_goal=enough,
            contraction=CLOSING_CONTRACTION,
        )
        return _Place(np.where(end.converged[:, None], end.value, np.nan), left, rates)


def _allowed_motions(rates: Array) -> Array:
    """Motions by which the legs stay closed, to first order [unknowns x motions].

    Args:
        rates: the rates of the gaps [rows x unknowns].
    """
    _, sizes, motions = np.linalg.svd(rates)
    rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
    return np.asarray(motions[rank:].T)

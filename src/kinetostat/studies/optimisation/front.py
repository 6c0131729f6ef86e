"""Pareto fronts: the feasible designs that no other beats in everything, and the one that gives up least."""

import numpy as np
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from kinetostat.engine.points import Array
from kinetostat.studies.optimisation.log import Log, Rows


def front_of(log: Log) -> Rows:
    """Numbers of the designs of the front among those that the search kept, ordered by the first objective."""
    outcome = log.outcome(log.kept)
    feasible = np.flatnonzero(outcome.violation == 0.0)
    if not feasible.size:
        return feasible
    wanted = _wanted(log)[log.kept[feasible]]
    _, single = np.unique(wanted, axis=0, return_index=True)
    first = NonDominatedSorting().do(wanted[single], only_non_dominated_front=True)
    return log.kept[feasible][single][first[np.argsort(wanted[single][first, 0], kind="stable")]]


def knee_of(log: Log, front: Rows) -> int:
    """Which design of a front is its knee: the farthest from the plane through its ends, towards the better side.

    With each objective from 0 (its best on the front) to 1 (its worst), that is where their sum is least.

    Source: Das, On characterizing the "knee" of the Pareto curve, Structural Optimization 18 (1999).
    """
    wanted = _wanted(log)[front]
    spans = np.ptp(wanted, axis=0)
    shares = (wanted - wanted.min(axis=0)) / np.where(spans > 0.0, spans, 1.0)
    return int(np.argmin(shares.sum(axis=1)))


def _wanted(log: Log) -> Array:
    """Objectives of all designs, with signs so that less is better."""
    return np.array([objective.sign for objective in log.problem.objectives]) * log.outcome().objectives

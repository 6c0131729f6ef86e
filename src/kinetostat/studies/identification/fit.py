"""The most likely values of unknowns, how sure they are, and which measured values do not belong: theory (64) to (66).

Unknowns are counted in plausible sizes, so that metres and radians compare. A weak preference for zero decides what no
measurement sees. Derivatives are exact (`observed`); nothing here knows machines.

Source: theory (64)-(66). Reweighting: P. Holland and R. Welsch, 1977; deviation by the median: F. Hampel, 1974; linear
least squares within bounds: `scipy.optimize.lsq_linear`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from kinetostat.equilibrium.motion import Array
from kinetostat.spec.errors import InputError

Mask = npt.NDArray[np.bool_]
Tell = Callable[[int, int, str], None]

OUTLYING = 4.0
"""Standard deviations from which a value counts as an outlier: one of 16 000 good ones does."""
MEDIAN = 1.4826
"""Standard deviation of normal values over the median of their sizes."""
ROUNDS = 12
"""Of setting outliers aside: they change no more before that."""
UNSEEN = 1e-6
"""Share of the best seen combination of unknowns below which one is not seen at all: round-off is 1e-9."""
SURELY = 1.959963984540054
"""Half of the 95 % interval of a normal value over its standard deviation."""
FOLDS = 5
REWEIGHTS, REWEIGHTED = 50, 1e-3
"""How often values are weighted by their residuals at most, and the change, in standard deviations, that ends it."""
STEPS, SMALL_STEP = 8, 1e-4
"""Steps of Gauss and Newton at most, and the largest change of an unknown, in plausible sizes, that ends them."""


class Question(Protocol):
    """Residuals in standard deviations and how they fall with the unknowns."""

    def residuals(self, values: Array) -> Array:
        """At values of the unknowns [rows]."""

    def linearised(self, values: Array) -> tuple[Array, Array]:
        """The same, and how each falls per unit of each unknown [rows x unknowns]."""


@dataclass(frozen=True)
class Wishes:
    """How a fit is to be made.

    Attributes:
        sizes: plausible size of each unknown, SI [unknowns].
        priors: standard deviation of what is known of each before, about zero, SI; infinity for nothing [unknowns].
        bounds: largest size of each, SI; infinity without one [unknowns].
        preferred: weight of zero for each, in standard deviations per plausible size: it decides what is hardly seen
            and is not counted among what is known [unknowns].
        robust: whether outliers are set aside.
        known: whether standard deviations of measurements are known.
    """

    sizes: Array
    priors: Array
    bounds: Array
    preferred: Array
    robust: bool = True
    known: bool = True


@dataclass(frozen=True)
class Fit:
    """The most likely values of unknowns.

    Attributes:
        values: SI [unknowns].
        covariance: SI [unknowns x unknowns], of what is seen.
        sure: half of the 95 % interval of each, SI; infinity where a measurement sees it only in combinations that are
            not seen [unknowns].
        kept: rows that are not outliers [rows].
        before, after: residuals with all unknowns zero and with the values, in standard deviations [rows].
        rates: how residuals fall per plausible size of each unknown, with the values [rows x unknowns].
        scatter: standard deviation of the kept residuals over that expected.
        seen: how strongly each combination is seen, standard deviations per plausible size, the best first [unknowns].
        ways: these combinations as columns, in plausible sizes [unknowns x unknowns].
        rank: how many are seen.
        predicted: residuals of poses that took no part, in standard deviations [rows].
    """

    values: Array
    covariance: Array
    sure: Array
    kept: Mask
    before: Array
    after: Array
    rates: Array
    scatter: float
    seen: Array
    ways: Array
    rank: int
    predicted: Array

    @property
    def correlations(self) -> Array:
        """Of the unknowns [unknowns x unknowns]."""
        sizes = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))
        return np.asarray(self.covariance / np.outer(sizes, sizes))

    @property
    def unseen(self) -> Array:
        """A basis of the combinations that are not seen, in plausible sizes, as columns [unknowns x k]."""
        return self.ways[:, self.rank :]


def fitted(question: Question, groups: npt.NDArray[np.int64], wishes: Wishes, tell: Tell = lambda *_: None) -> Fit:
    """Find the most likely values of unknowns, theory (64).

    Args:
        question: the residuals.
        groups: to which pose each row belongs; poses are left out together [rows].
        wishes: priors, bounds, and what to do with outliers.
        tell: receives how far the work is: rounds done, rounds at most, and a few words.
    """
    start = np.zeros(len(wishes.sizes))
    before = question.residuals(start)
    kept = np.ones(len(before), dtype=bool)
    values = _solved(question, wishes, kept, start, wishes.robust)
    for turn in range(ROUNDS if wishes.robust else 0):
        tell(turn, ROUNDS, f"{int((~kept).sum())} outliers")
        left = question.residuals(values)
        inside = np.abs(left) < OUTLYING * _spread(left, wishes.known)
        if turn and (inside == kept).all():
            break
        kept = inside
        values = _solved(question, wishes, kept, values, False)
    after, rates = _linearised(question, values)
    return _judged(before, after, rates * wishes.sizes, kept, values, groups, wishes)


def _spread(residuals: Array, known: bool = False) -> float:
    """Standard deviation of the greater part of residuals; at least 1 where their size is known."""
    spread = MEDIAN * float(np.median(np.abs(residuals)))
    return max(spread, 1.0) if known else max(spread, 1e-12)


def _solved(question: Question, wishes: Wishes, kept: Mask, start: Array, robust: bool) -> Array:
    weights = _prior(wishes)
    most = wishes.bounds / wishes.sizes
    units = start / wishes.sizes
    for _ in range(STEPS):
        after, rates = _linearised(question, units * wishes.sizes)
        scale = _spread(after[kept], wishes.known) if robust else np.inf
        step = _step(after[kept], (rates * wishes.sizes)[kept], weights, units, most, scale)
        units = units + step
        if np.abs(step).max(initial=0.0) < SMALL_STEP:
            break
    return np.asarray(units * wishes.sizes)


def _linearised(question: Question, values: Array) -> tuple[Array, Array]:
    after, rates = question.linearised(values)
    if not (np.isfinite(after).all() and np.isfinite(rates).all()):
        raise InputError(
            "with the errors that would explain the measured values the legs of the machine cannot close. Check units "
            "and signs of all columns, have the place of the measuring frame found too (--frame), or give --bound."
        )
    return after, rates


def _step(after: Array, rates: Array, weights: Array, units: Array, most: Array, scale: float) -> Array:
    """The step of Gauss and Newton from units, within bounds; `scale` is that of the loss, infinite of squares.

    In the coordinates of an orthogonal basis, values are weighted again by their residuals until the step stays.
    """
    if np.isfinite(most).any():
        from scipy.optimize import lsq_linear  # half a second to import: only for fits within bounds

        weighted = np.sqrt(_trust(after, scale))
        rows = np.concatenate([rates * weighted[:, None], np.diag(weights)])
        wanted = np.concatenate([after * weighted + (rates * weighted[:, None]) @ units, np.zeros(len(units))])
        return np.asarray(lsq_linear(rows, wanted, (-most, most)).x - units)
    basis, triangle = np.linalg.qr(np.concatenate([rates, np.diag(weights)]))
    wanted = np.concatenate([after, -weights * units])
    turned = np.zeros(len(units))
    for _ in range(REWEIGHTS if np.isfinite(scale) else 1):
        trust = _trust((wanted - basis @ turned)[: len(after)], scale)
        heavy = basis * np.concatenate([trust, np.ones(len(units))])[:, None]
        new = np.linalg.solve(heavy.T @ basis, heavy.T @ wanted)
        done, turned = np.abs(new - turned).max(initial=0.0) < REWEIGHTED, new
        if done:
            break
    return np.asarray(np.linalg.solve(triangle, turned))


def _trust(left: Array, scale: float) -> Array:
    """The weights of residuals with Cauchy's loss."""
    return np.asarray(1.0 / (1.0 + (left / scale) ** 2))


def _prior(wishes: Wishes) -> Array:
    """How many standard deviations a plausible size of each unknown is away from zero before anything is measured."""
    return np.maximum(wishes.sizes / wishes.priors, wishes.preferred)


def _judged(
    before: Array,
    after: Array,
    rates: Array,
    kept: Mask,
    values: Array,
    groups: npt.NDArray[np.int64],
    wishes: Wishes,
) -> Fit:
    """Judge what has been found: covariance and intervals, theory (65), rank, and poses that took no part."""
    prior = np.where(np.isfinite(wishes.priors), wishes.sizes / wishes.priors, 0.0)
    whole = np.concatenate([rates[kept], np.diag(prior)])
    _, sizes, ways = np.linalg.svd(whole, full_matrices=False)
    seen = np.zeros(rates.shape[1])
    seen[: len(sizes)] = sizes
    rank = int((seen > UNSEEN * max(float(seen[0]), 1e-300)).sum())
    freedom = max(int(kept.sum()) - rank, 1)
    scatter = float(np.sqrt((after[kept] ** 2).sum() / freedom))
    basis = ways[:rank].T / seen[:rank]
    spread = 1.0 if wishes.known else scatter
    covariance = spread**2 * basis @ basis.T * np.outer(wishes.sizes, wishes.sizes)
    factor = SURELY if wishes.known else _quantile(freedom)
    mixed = np.linalg.norm(ways[rank:], axis=0) > np.sqrt(UNSEEN) if rank < len(ways) else np.zeros(len(values), bool)
    sure = np.where(mixed, np.inf, factor * np.sqrt(np.maximum(np.diag(covariance), 0.0)))
    predicted = _left_out(after, rates, kept, groups, _prior(wishes))
    return Fit(values, covariance, sure, kept, before, after, rates, scatter, seen, ways.T, rank, predicted)


def _quantile(freedom: int) -> float:
    """Half of the 95 % interval over the standard deviation, where that is estimated: Student's t."""
    from scipy.special import stdtrit  # a quarter of a second to import: only where nobody knows standard deviations

    return float(stdtrit(freedom, 0.975))


def _left_out(after: Array, rates: Array, kept: Mask, groups: npt.NDArray[np.int64], prior: Array) -> Array:
    """Residuals of each fifth of the poses, predicted from the others: the fit to these is one linear step away."""
    result, fold = after.copy(), np.unique(groups, return_inverse=True)[1] % FOLDS
    for number in range(FOLDS):
        others, mine = kept & (fold != number), fold == number
        if not others.any() or not mine.any():
            continue
        rows = np.concatenate([rates[others], np.diag(prior)])
        step = np.linalg.lstsq(rows, np.concatenate([after[others], np.zeros(len(prior))]), rcond=None)[0]
        result[mine] = after[mine] - rates[mine] @ step
    return result

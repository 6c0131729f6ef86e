"""The most likely values of unknowns, how sure they are, and which measured values do not belong: theory (64) to (66).

Unknowns are counted in plausible sizes, so that metres and radians compare. A preference for zero decides what no
measurement sees. Derivatives are exact (`observation`); nothing here knows machines.

Source: theory (64)-(66). Least squares by trust regions: `scipy.optimize.least_squares` (M. Branch, T. Coleman and
Y. Li, 1999); deviation by the median: F. Hampel, 1974; a loss whose scale shrinks: A. Blake and A. Zisserman, *Visual
Reconstruction*, 1987.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.spec.renamed import former_names
from kinetostat.tolerances import FIT_BEGUN, FIT_SETTLED, LEAST_DIVISOR

Tell = Callable[[int, int, str], None]

OUTLYING = 4.0
"""Standard deviations from which a value counts as an outlier: one of 16 000 good ones does."""
MEDIAN = 1.4826
"""Standard deviation of normal values over the median of their sizes."""
MOST_ROUNDS = 20
"""Number of fits at most in which the scale of residuals, outliers and unseen combinations settle: few need half."""
SAME_SPREAD = 0.1
"""Relative change of the spread of residuals below which it has settled."""
UNSEEN = 1e-6
"""Share of the best seen combination of unknowns below which one is not seen at all: round-off is 1e-9. One that is
seen less than it is preferred to be zero counts as unseen too."""
SURELY = 1.959963984540054
"""Half of the 95 % interval of a normal value over its standard deviation."""
UPPER_QUANTILE = 0.975
"""Probability below the upper end of a 95 % interval."""
FOLDS = 5
"""Parts of the poses, each of which is predicted from the others."""
FULL_PREFERENCE = 50.0
"""The preference for zero in full over the weak one, for combinations that are not seen: with the weak one alone they
would go where the curvature of the equations explains some of the noise."""
LEAST_WEIGHT = 1e-12
"""Weight of an unknown of which nothing is known before: without one, its rates would be divided by zero."""
LEAST_SPREAD = 1e-9
"""Least spread that is tried, as a share of the residuals with all unknowns zero: no machine is measured so well."""
TRIED_SPREADS = 400
"""Standard deviations of measurements that are tried, by a constant factor; as many again between the best ones."""
LEAST_FREEDOM = 0.5
"""Freedom of residuals at least: measured values that explain themselves say nothing of their standard deviation."""
MOST_FIT_STEPS = 500
"""Steps of a fit at most: along a curved valley they are short."""


class ResidualEquations(Protocol):
    """Residuals in standard deviations and how they fall with the unknowns."""

    def residuals(self, values: Array) -> Array:
        """The residuals at values of the unknowns [rows]."""

    def linearisation(self, values: Array) -> tuple[Array, Array]:
        """The residuals, and how each falls per unit of each unknown [rows x unknowns]."""


@dataclass(frozen=True)
class Wishes:
    """Options of a fit.

    Attributes:
        sizes: plausible size of each unknown, SI [unknowns].
        priors: standard deviation of each unknown about zero before anything is measured, SI; infinity if nothing is
            known of it [unknowns].
        bounds: largest size of each unknown, SI; infinity without a bound [unknowns].
        preferred: weak preference of each unknown for zero, in standard deviations per plausible size. It decides about
            combinations that are hardly seen, and does not count as knowledge [unknowns].
        robust: whether outliers are set aside.
        known: whether standard deviations of measurements are known.
        resolution: residual, in standard deviations, up to which it may be round-off.
    """

    sizes: Array
    priors: Array
    bounds: Array
    preferred: Array
    robust: bool = True
    known: bool = True
    resolution: float = 0.0

    @property
    def judged(self) -> bool:
        """Whether priors need no standard deviation of the measurements, which is known, or has nothing to weigh."""
        return self.known or not np.isfinite(self.priors).any()


@former_names(sure="half_intervals", seen="strengths", ways="combinations")
@dataclass(frozen=True)
class Fit:
    """The most likely values of unknowns.

    Attributes:
        values: SI [unknowns].
        covariance: SI [unknowns x unknowns], of what is seen.
        half_intervals: half of the 95 % interval of each, SI, with what combinations that are not seen may add if they
            are of a plausible size; infinity where it is seen only in such [unknowns].
        kept: rows that are not outliers [rows].
        before, after: residuals with all unknowns zero and with the values, in standard deviations [rows].
        rates: how residuals fall per plausible size of each unknown, with the values [rows x unknowns].
        scatter: standard deviation of the kept residuals over that expected.
        strengths: how strongly each combination is seen, standard deviations per plausible size; those that count as
            seen come first [unknowns].
        combinations: these combinations as columns, in plausible sizes [unknowns x unknowns].
        rank: how many are seen.
        interval: covariance of what is seen, widened to squares of halves of 95 % intervals, SI [unknowns x unknowns]:
            by Student's factor for what measurements say whose standard deviation is estimated, not for priors.
        freedom: of the kept residuals: their number, less what the measured values, not the priors, use up.
        predicted: residuals of poses that took no part, in standard deviations [rows].
    """

    values: Array
    covariance: Array
    half_intervals: Array
    kept: Mask
    before: Array
    after: Array
    rates: Array
    scatter: float
    strengths: Array
    combinations: Array
    rank: int
    interval: Array
    freedom: float
    predicted: Array

    def __repr__(self) -> str:
        return f"<Fit: {len(self.values)} values, {self.rank} combinations seen, scatter {self.scatter:.3g}>"

    @property
    def correlations(self) -> Array:
        """Correlations of the unknowns [unknowns x unknowns]."""
        sizes = np.sqrt(np.maximum(np.diag(self.covariance), LEAST_DIVISOR))
        return np.asarray(self.covariance / np.outer(sizes, sizes))

    @property
    def unseen_combinations(self) -> Array:
        """A basis of the combinations that are not seen, in plausible sizes, as columns [unknowns x k]."""
        return self.combinations[:, self.rank :]


def best_fit(question: ResidualEquations, groups: Integers, wishes: Wishes, tell: Tell = lambda *_: None) -> Fit:
    """Find the most likely values of unknowns, theory (64).

    Each fit is one of least squares by trust regions: a step is taken only where the residuals fall by about as much as
    the rates foretell. Where outliers are set aside, Cauchy's loss comes first, with a scale that follows the spread of
    the residuals down: values that do not belong then do not hold the fit where they happen to be small.

    Args:
        question: the residuals.
        groups: to which pose each row belongs; poses are left out together [rows].
        wishes: priors, bounds, and what to do with outliers.
        tell: receives how far the work is: rounds done, rounds at most, and a few words.
    """
    values = np.zeros(len(wishes.sizes))
    before, rates = _rates_at(question, values, wishes)
    kept, after, spread = np.ones(len(before), dtype=bool), before, _spread(before, rates, wishes)
    for squares in (False, True) if wishes.robust else (True,):
        settled, rank = False, 0
        for turn in range(MOST_ROUNDS):
            if squares and wishes.robust:
                inside = np.abs(after) < OUTLYING * spread
                settled, kept = settled and bool((inside == kept).all()), inside
            seen = _combinations(rates[kept], wishes, spread)
            if settled and seen.rank == rank:
                break
            tell(turn, MOST_ROUNDS, f"{int((~kept).sum())} outliers")
            values = _least_squares(question, wishes, kept, values, seen, np.inf if squares else spread)
            after, rates = _rates_at(question, values, wishes)
            last, rank = spread, seen.rank
            spread = (
                _spread(after, rates, wishes)
                if wishes.judged
                else _own_spread(after[kept], rates[kept], values, wishes)
            )
            settled = abs(spread - last) <= SAME_SPREAD * last
    return _fit_result(before, after, rates, kept, values, groups, wishes)


def _rates_at(question: ResidualEquations, values: Array, wishes: Wishes) -> tuple[Array, Array]:
    """The residuals [rows], and how they fall per plausible size of each unknown [rows x unknowns]."""
    after, rates = question.linearisation(values)
    return after, rates * wishes.sizes


def _spread(residuals: Array, rates: Array, wishes: Wishes) -> float:
    """Standard deviation of the greater part of residuals, or more where these do not say it.

    It is at least 1 where standard deviations are known, else what may be round-off, or where combinations are unseen,
    what these may do. Values that no unknown changes, as the height of a planar machine, do not count.
    """
    touched, least = rates.any(axis=1), 1.0
    if not touched.any():
        return least
    if not wishes.known:
        strengths = np.linalg.svd(rates, compute_uv=False)
        hides = len(strengths) < rates.shape[1] or strengths[-1] <= UNSEEN * strengths[0]
        least = max(wishes.resolution, UNSEEN * float(strengths[0]) if hides else 0.0)
    return max(MEDIAN * float(np.median(np.abs(residuals[touched]))), least)


def _own_spread(residuals: Array, rates: Array, values: Array, wishes: Wishes) -> float:
    """Estimate the standard deviation of measurements from residuals, where priors weigh against these.

    It is the one for which the values are most likely whatever the unknowns are, to first order: errors as large as the
    priors say, seen through the rates, and the measurements' own make up their variance along each combination that
    is seen, and their own alone along all others. Where this is greatest, the squares of the residuals are the variance
    times their freedom; but these may also agree, or nearly, far from there, where steps towards them would end.

    Args:
        residuals: of the kept rows, at the values [rows].
        rates: of the same rows, per plausible size [rows x unknowns].
        values: of the unknowns, SI [unknowns].
        wishes: priors and preferences.

    Source: D. MacKay, Neural Computation 4(3), 1992, equations 2.9 and 2.14.
    """
    weights = np.maximum(np.hypot(wishes.sizes / wishes.priors, wishes.preferred), LEAST_WEIGHT)
    directions, sizes, _ = np.linalg.svd(rates / weights, full_matrices=False)
    whole = residuals + rates @ (values / wishes.sizes)  # the residuals with all unknowns zero
    squares, total = (directions.T @ whole) ** 2, float(whole @ whole)
    unseen_square, unseen_count = max(total - float(squares.sum()), 0.0), len(whole) - len(sizes)
    most = np.sqrt(total / len(whole)) + wishes.resolution
    least, most = max(wishes.resolution, LEAST_SPREAD * most, LEAST_DIVISOR), max(most, LEAST_DIVISOR)
    for _ in range(2):
        tried = np.geomspace(least, max(most, least), TRIED_SPREADS)
        variances = tried**2
        along_seen = variances[:, None] + sizes**2
        unlikely = (np.log(along_seen) + squares / along_seen).sum(axis=1)
        unlikely += unseen_count * np.log(variances) + unseen_square / variances
        best = int(np.argmin(unlikely))
        least, most = float(tried[max(best - 1, 0)]), float(tried[min(best + 1, TRIED_SPREADS - 1)])
    return float(tried[best])


def _freedom(rates: Array, seen: "_SeenCombinations") -> float:
    """Number of residuals less the freedoms that measured values use up, theory (65).

    Each combination takes as much of a freedom as the measurements say of what they and the priors say together.

    Args:
        rates: how the kept residuals fall per plausible size [rows x unknowns].
        seen: the combinations, with the priors.
    """
    basis = seen.columns[:, : seen.rank]
    measured, prior = rates @ basis, seen.prior @ basis
    both = measured.T @ measured + prior.T @ prior
    used = float(np.trace(np.linalg.solve(both, measured.T @ measured))) if seen.rank else 0.0
    return max(len(rates) - used, LEAST_FREEDOM)


@dataclass(frozen=True)
class _SeenCombinations:
    """Combinations of unknowns, in plausible sizes, ordered by how well measured values see them.

    Attributes:
        strengths: of each, standard deviations per plausible size; those that are seen come first [unknowns].
        columns: the combinations, orthonormal [unknowns x unknowns].
        rank: how many are seen.
        unit: the true standard deviation of measurements in those that residuals are counted in.
        prior: rows that say what was known of the unknowns before [unknowns x unknowns].
        preference: rows of the preference for zero [rows x unknowns].
    """

    strengths: Array
    columns: Array
    rank: int
    unit: float
    prior: Array
    preference: Array


def _combinations(rates: Array, wishes: Wishes, spread: float) -> _SeenCombinations:
    """Find which combinations are seen better than round-off and the weak preference for zero.

    The preference is weak for these, and full for the others. Both, and what was known before, are in true standard
    deviations: where nobody knows these of the measurements, they are those of the residuals.

    Args:
        rates: how the residuals fall per plausible size [rows x unknowns].
        wishes: priors and preferences.
        spread: of the residuals, in the standard deviations that they are counted in.
    """
    unit = 1.0 if wishes.known else spread
    prior = unit * np.diag(wishes.sizes / wishes.priors)
    _, sizes, directions = np.linalg.svd(np.concatenate([rates, prior]), full_matrices=False)
    preferred = np.diag(unit * wishes.preferred)
    least = np.maximum(UNSEEN * sizes[0], np.linalg.norm(directions @ preferred, axis=1))
    order = np.argsort(sizes <= least, kind="stable")
    rank = int((sizes > least).sum())
    hidden = np.linalg.qr(preferred @ directions[order[rank:]].T)[0]
    preference = np.concatenate([preferred, FULL_PREFERENCE * hidden.T @ preferred])
    return _SeenCombinations(sizes[order], directions[order].T, rank, unit, prior, preference)


def _least_squares(
    question: ResidualEquations, wishes: Wishes, kept: Mask, start: Array, seen: _SeenCombinations, scale: float
) -> Array:
    """Fit values by least squares from a start; `scale` is that of Cauchy's loss, infinite for squares."""
    from scipy.optimize import least_squares  # half a second to import

    count, most = int(kept.sum()), wishes.bounds / wishes.sizes
    known = np.concatenate([seen.prior, seen.preference])
    # One residual that never changes: a fall of the sum of squares is small beside one squared standard deviation.
    constant, still = np.array([seen.unit]), np.zeros((1, len(start)))

    def residuals(units: Array) -> Array:
        return np.concatenate([question.residuals(units * wishes.sizes)[kept], known @ units, constant])

    def slopes(units: Array) -> Array:
        return np.concatenate([-_rates_at(question, units * wishes.sizes, wishes)[1][kept], known, still])

    def loss(squares: Array) -> Array:
        measured, trust = np.arange(len(squares)) < count, 1.0 / (1.0 + squares)
        plain = np.stack([squares, np.ones_like(squares), np.zeros_like(squares)])
        return np.where(measured, np.stack([np.log1p(squares), trust, -(trust**2)]), plain)

    robust = bool(np.isfinite(scale))
    form, precision = (loss, FIT_BEGUN) if robust else ("linear", FIT_SETTLED)
    answer = least_squares(
        residuals, start / wishes.sizes, slopes, (-most, most), loss=form, f_scale=scale if robust else 1.0,
        ftol=precision, xtol=precision, gtol=None, max_nfev=MOST_FIT_STEPS,
    )  # fmt: skip
    return np.asarray(answer.x * wishes.sizes)


def _fit_result(
    before: Array,
    after: Array,
    rates: Array,
    kept: Mask,
    values: Array,
    groups: Integers,
    wishes: Wishes,
) -> Fit:
    """Describe the fit at its values: covariance and intervals, theory (65), rank, and poses that took no part."""
    spread = _spread(after, rates, wishes) if wishes.judged else _own_spread(after[kept], rates[kept], values, wishes)
    seen = _combinations(rates[kept], wishes, spread)
    freedom = _freedom(rates[kept], seen)
    scatter = float(np.sqrt((after[kept] ** 2).sum() / freedom))
    covariance, interval = _covariance_and_interval(rates[kept], seen, wishes, scatter, freedom)
    return Fit(
        values=values,
        covariance=covariance,
        half_intervals=_half_intervals(interval, seen, wishes),
        kept=kept,
        before=before,
        after=after,
        rates=rates,
        scatter=scatter,
        strengths=seen.strengths,
        combinations=seen.columns,
        rank=seen.rank,
        interval=interval,
        freedom=freedom,
        predicted=_left_out(after, rates, kept, groups, np.concatenate([seen.prior, seen.preference])),
    )


def _covariance_and_interval(
    rates: Array, seen: _SeenCombinations, wishes: Wishes, scatter: float, freedom: float
) -> tuple[Array, Array]:
    """The covariance of what is seen, and `Fit.interval`, SI [unknowns x unknowns each].

    Args:
        rates: how the kept residuals fall per plausible size [rows x unknowns].
        seen: the combinations, with the priors.
        wishes: plausible sizes, and whether standard deviations of measurements are known.
        scatter, freedom: of the kept residuals.
    """
    basis = seen.columns[:, : seen.rank] / seen.strengths[: seen.rank]
    spread = 1.0 if wishes.known else max(scatter, wishes.resolution)
    units = spread**2 * np.outer(wishes.sizes, wishes.sizes)
    measured, known_before = rates @ basis, seen.prior @ basis
    factor = SURELY if wishes.known else _quantile(freedom)
    widened = factor**2 * measured.T @ measured + SURELY**2 * known_before.T @ known_before
    return basis @ basis.T * units, basis @ widened @ basis.T * units


def _half_intervals(interval: Array, seen: _SeenCombinations, wishes: Wishes) -> Array:
    """Half of the 95 % interval of each unknown, with what unseen combinations of plausible size may add [unknowns]."""
    hidden = seen.columns[:, seen.rank :]
    likely = np.linalg.inv(hidden.T @ np.diag((FULL_PREFERENCE * wishes.preferred) ** 2) @ hidden)
    unseen = np.sqrt(np.einsum("ui,ij,uj->u", hidden, likely, hidden)) * wishes.sizes
    result = np.hypot(np.sqrt(np.diag(interval)), SURELY * unseen)
    result[np.linalg.norm(hidden, axis=1) > np.sqrt(UNSEEN)] = np.inf
    return np.asarray(result)


def _quantile(freedom: float) -> float:
    """Half of the 95 % interval over the standard deviation, where that is estimated: Student's t."""
    from scipy.special import stdtrit  # a quarter of a second to import: only where nobody knows standard deviations

    return float(stdtrit(freedom, UPPER_QUANTILE))


def _left_out(after: Array, rates: Array, kept: Mask, groups: Integers, known: Array) -> Array:
    """Residuals of each fifth of the poses, predicted from the others: the fit to these is one linear step away."""
    result, fold = after.copy(), np.unique(groups, return_inverse=True)[1] % FOLDS
    for number in range(FOLDS):
        others, mine = kept & (fold != number), fold == number
        if not others.any() or not mine.any():
            continue
        rows = np.concatenate([rates[others], known])
        step = np.linalg.lstsq(rows, np.concatenate([after[others], np.zeros(len(known))]), rcond=None)[0]
        result[mine] = after[mine] - rates[mine] @ step
    return result

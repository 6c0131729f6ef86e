"""The most likely values of unknowns, how sure they are, and which measured values do not belong: theory (64) to (66).

Unknowns are counted in plausible sizes, so that metres and radians compare. A weak preference for zero decides what no
measurement sees. Equations come with exact derivatives from `observation`; nothing here knows machines.

Source: theory (64)-(66). Least squares by trust regions: `scipy.optimize.least_squares` (M. Branch, T. Coleman and
Y. Li, 1999); deviation by the median: F. Hampel, 1974; a loss whose scale shrinks: A. Blake and A. Zisserman, *Visual
Reconstruction*, 1987.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.spec.renamed import former_names
from kinetostat.tolerances import FIT_BEGUN, FIT_SETTLED, LEAST_DIVISOR

Tell = Callable[[int, int, str], None]
"""Receives how far a fit is: rounds done, rounds at most, and a few words."""

OUTLIER_SIGMAS = 4.0
"""Standard deviations from which a value counts as an outlier: one of 16 000 good ones does."""
DEVIATION_OVER_MEDIAN = 1.4826
"""Standard deviation of normal values over the median of their sizes: 1 over the 75 % quantile."""
MOST_ROUNDS = 20
"""Greatest number of rounds in which the scale of residuals, outliers and unseen combinations settle: few need half."""
SAME_SPREAD = 0.1
"""Relative change of the spread of residuals below which it has settled: few values lie between 4.0 and 4.4 spreads."""
UNSEEN_STRENGTH = 1e-6
"""Strength of a combination, as a share of the strongest one, below which it is not seen: round-off is 1e-9."""
NORMAL_FACTOR = 1.959963984540054
"""Half of the 95 % interval of a normal value over its standard deviation."""
UPPER_QUANTILE = 0.975
"""Probability below the upper end of a 95 % interval."""
FOLDS = 5
"""Parts of the poses, each of which is predicted from the others: of some dozens of poses, each part has several."""
FULL_PREFERENCE = 50.0
"""Factor on the weak preference for zero for combinations that are not seen: with the weak one alone they would go
where the curvature of the equations explains some of the noise."""
LEAST_WEIGHT = 1e-12
"""Weight of an unknown of which nothing is known before: without one, its rates would be divided by zero."""
LEAST_SPREAD = 1e-9
"""Least spread that is tried, as a share of the residuals with all unknowns zero: no machine is measured so well."""
TRIED_SPREADS = 400
"""Spreads that are tried, by a constant factor, 5 % of each; as many again between the neighbours of the best one."""
LEAST_FREEDOM = 0.5
"""Least degrees of freedom of residuals: where measured values determine as many unknowns as there are values, their
residuals say nothing of their standard deviation."""
MOST_FIT_STEPS = 500
"""Greatest number of steps of one least-squares fit: along a curved valley they are short."""


class ResidualEquations(Protocol):
    """Residuals in standard deviations and how they fall with the unknowns."""

    def residuals(self, values: Array) -> Array:
        """The residuals at values of the unknowns [rows]."""

    def linearisation(self, values: Array) -> tuple[Array, Array]:
        """The residuals, and how each falls per unit of each unknown [rows x unknowns]."""


@dataclass(frozen=True)
class FitOptions:
    """Options of a fit: what is known before of unknowns and measurements, and whether outliers are set aside.

    Attributes:
        sizes: plausible size of each unknown, SI [unknowns].
        priors: standard deviation of each unknown about zero before anything is measured, SI; infinity if nothing is
            known of it [unknowns].
        bounds: largest size of each unknown, SI; infinity without a bound [unknowns].
        preferred: weak preference of each unknown for zero, in standard deviations per plausible size. It decides about
            combinations that are hardly seen, and does not count as knowledge [unknowns].
        robust: whether outliers are set aside.
        known: whether standard deviations of measurements are known; if not, only their ratios count.
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
    def estimates_spread(self) -> bool:
        """Whether priors weigh against measurements of unknown standard deviation, which must then be estimated."""
        return not self.known and bool(np.isfinite(self.priors).any())


@former_names(sure="half_intervals", seen="strengths", ways="combinations")
@dataclass(frozen=True)
class Fit:
    """The most likely values of unknowns.

    Attributes:
        values: the values, SI [unknowns].
        covariance: their covariance by the combinations that are seen, SI [unknowns x unknowns].
        half_intervals: half of the 95 % interval of each, SI, with what unseen combinations may add if they are of a
            plausible size; infinity for an unknown that occurs in these alone [unknowns].
        kept: flags of the rows that are not outliers [rows].
        before, after: residuals with all unknowns zero and with the values, in standard deviations [rows].
        rates: how residuals fall per plausible size of each unknown, at the values [rows x unknowns].
        scatter: standard deviation of the kept residuals over that expected.
        strengths: how strongly each combination is seen, standard deviations per plausible size; those that count as
            seen come first [unknowns].
        combinations: these combinations as columns, in plausible sizes [unknowns x unknowns].
        rank: number of combinations that are seen.
        interval: the covariance widened to squares of halves of 95 % intervals, SI [unknowns x unknowns]. Student's
            factor widens what measurements say whose standard deviation is estimated; it does not widen priors.
        freedom: degrees of freedom of the kept residuals: their number less the number of unknowns that the measured
            values, not the priors, determine.
        predicted: residuals of each pose as predicted from others, in standard deviations [rows].
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


def best_fit(equations: ResidualEquations, groups: Integers, options: FitOptions, tell: Tell = lambda *_: None) -> Fit:
    """Find the most likely values of unknowns, theory (64).

    Each round is a fit of least squares by trust regions: a step is taken only where the residuals fall by about as
    much as the rates foretell. Where outliers are set aside, Cauchy's loss comes first, with a scale that follows the
    spread of the residuals down: values that do not belong then do not hold the fit where they happen to be small.

    Args:
        equations: the residuals.
        groups: number of the pose to which each row belongs; rows of a pose are left out together [rows].
        options: priors, bounds, and what to do with outliers.
        tell: receives how far the work is.
    """
    units = np.zeros(len(options.sizes))
    before, rates = _rates_at(equations, units, options)
    kept, spread = np.ones(len(before), dtype=bool), _median_spread(before, rates, options)
    state = _Iterate(units=units, after=before, rates=rates, kept=kept, spread=spread)
    for with_loss in (True, False) if options.robust else (False,):
        state = _settle(equations, options, state, with_loss, tell)
    return _fit_result(before, state, groups, options)


@dataclass(frozen=True)
class _Iterate:
    """A fit between two rounds.

    Attributes:
        units: values of the unknowns, in plausible sizes [unknowns].
        after: residuals with them, in standard deviations [rows].
        rates: how these fall per plausible size of each unknown [rows x unknowns].
        kept: flags of the rows that are not outliers [rows].
        spread: standard deviation of the residuals, in those that they are counted in.
    """

    units: Array
    after: Array
    rates: Array
    kept: Mask
    spread: float


def _settle(
    equations: ResidualEquations, options: FitOptions, state: _Iterate, with_loss: bool, tell: Tell
) -> _Iterate:
    """Repeat a fit until the spread of the residuals, the outliers and the combinations that are seen stay the same.

    With Cauchy's loss all rows are kept; without it, outliers are set aside before each round if the options say so.
    """
    settled, rank = False, 0
    for number in range(MOST_ROUNDS):
        if options.robust and not with_loss:
            kept = np.abs(state.after) < OUTLIER_SIGMAS * state.spread
            settled = settled and bool((kept == state.kept).all())
            state = replace(state, kept=kept)
        seen = _combinations(state.rates[state.kept], options, state.spread)
        if settled and seen.rank == rank:
            break
        tell(number, MOST_ROUNDS, f"{int((~state.kept).sum())} outliers")
        units = _least_squares(equations, options, state, seen, with_loss)
        after, rates = _rates_at(equations, units, options)
        if options.estimates_spread:
            spread = _likeliest_spread(after[state.kept], rates[state.kept], units, options)
        else:
            spread = _median_spread(after, rates, options)
        settled, rank = abs(spread - state.spread) <= SAME_SPREAD * state.spread, seen.rank
        state = replace(state, units=units, after=after, rates=rates, spread=spread)
    return state


def _rates_at(equations: ResidualEquations, units: Array, options: FitOptions) -> tuple[Array, Array]:
    """The residuals [rows] at values in plausible sizes, and how they fall per size of each [rows x unknowns]."""
    after, rates = equations.linearisation(units * options.sizes)
    return after, rates * options.sizes


def _median_spread(residuals: Array, rates: Array, options: FitOptions) -> float:
    """Standard deviation of residuals by the median of their sizes, which outliers hardly change.

    It is at least 1 where standard deviations are known. Where they are not, it is at least what may be round-off, and
    what unseen combinations may add. Values that no unknown changes, such as the height of a planar machine, do not
    count.
    """
    affected, least = rates.any(axis=1), 1.0
    if not affected.any():
        return least
    if not options.known:
        strengths = np.linalg.svd(rates, compute_uv=False)
        has_unseen = len(strengths) < rates.shape[1] or strengths[-1] <= UNSEEN_STRENGTH * strengths[0]
        least = max(options.resolution, UNSEEN_STRENGTH * float(strengths[0]) if has_unseen else 0.0)
    return max(DEVIATION_OVER_MEDIAN * float(np.median(np.abs(residuals[affected]))), least)


def _likeliest_spread(residuals: Array, rates: Array, units: Array, options: FitOptions) -> float:
    """Estimate the standard deviation of measurements where priors weigh against them.

    Residuals alone do not say it: the larger it is, the more of them the priors leave. So standard deviations are
    tried, and the one is taken with which the measured values are most likely, whatever the unknowns are. To first
    order, the variance of these values along a direction is that of the measurements; along directions that unknowns
    change, unknowns as large as the priors say add theirs. A grid is searched, because there may be two maxima.

    Args:
        residuals: residuals of the kept rows at the values [rows].
        rates: how they fall per plausible size of each unknown [rows x unknowns].
        units: values of the unknowns in plausible sizes [unknowns].
        options: priors and preferences.

    Source: D. MacKay, Neural Computation 4(3), 1992, equations 2.9 and 2.14.
    """
    weights = np.maximum(np.hypot(options.sizes / options.priors, options.preferred), LEAST_WEIGHT)
    directions, prior_spreads, _ = np.linalg.svd(rates / weights, full_matrices=False)
    drawn_residuals = residuals + rates @ units  # with all unknowns zero
    squares = (directions.T @ drawn_residuals) ** 2
    total, count = float(drawn_residuals @ drawn_residuals), len(drawn_residuals)
    other_squares, other_count = max(total - float(squares.sum()), 0.0), count - len(squares)

    def surprise(spreads: Array) -> Array:
        """Minus twice the logarithm of the likelihood of the measured values, up to a constant, for each spread."""
        variances = spreads**2
        changed = variances[:, None] + prior_spreads**2
        of_changed = (np.log(changed) + squares / changed).sum(axis=1)
        return np.asarray(of_changed + (other_count * np.log(variances) + other_squares / variances))

    most = np.sqrt(total / count) + options.resolution
    least, most = max(options.resolution, LEAST_SPREAD * most, LEAST_DIVISOR), max(most, LEAST_DIVISOR)
    for _ in range(2):  # the second time between the neighbours of the best spread
        tried = np.geomspace(least, max(most, least), TRIED_SPREADS)
        best = int(np.argmin(surprise(tried)))
        least, most = float(tried[max(best - 1, 0)]), float(tried[min(best + 1, TRIED_SPREADS - 1)])
    return float(tried[best])


@dataclass(frozen=True)
class _SeenCombinations:
    """Combinations of unknowns, in plausible sizes, ordered by how well measured values see them.

    Attributes:
        strengths: of each, standard deviations per plausible size; those that are seen come first [unknowns].
        columns: the combinations, orthonormal [unknowns x unknowns].
        rank: number of those that are seen.
        unit: the true standard deviation of measurements, in the one that residuals are counted in.
        prior: rows that say what was known of the unknowns before [unknowns x unknowns].
        preference: rows of the preference for zero [rows x unknowns].
    """

    strengths: Array
    columns: Array
    rank: int
    unit: float
    prior: Array
    preference: Array

    @property
    def rows_beside_measured(self) -> Array:
        """Rows of priors and preference, which count beside those of the measured values [rows x unknowns]."""
        return np.concatenate([self.prior, self.preference])


def _combinations(rates: Array, options: FitOptions, spread: float) -> _SeenCombinations:
    """Find the combinations that are seen better than round-off and the weak preference for zero.

    The preference is weak for these, and full for the others. Both it and the priors are in true standard deviations:
    where those of the measurements are not known, they are those of the residuals.

    Args:
        rates: how the residuals fall per plausible size [rows x unknowns].
        options: priors and preferences.
        spread: standard deviation of the residuals, in those that they are counted in.
    """
    unit = 1.0 if options.known else spread
    prior = unit * np.diag(options.sizes / options.priors)
    _, strengths, directions = np.linalg.svd(np.concatenate([rates, prior]), full_matrices=False)
    weak = np.diag(unit * options.preferred)
    seen = strengths > np.maximum(UNSEEN_STRENGTH * strengths[0], np.linalg.norm(directions @ weak, axis=1))
    order, rank = np.argsort(~seen, kind="stable"), int(seen.sum())
    unseen = np.linalg.qr(weak @ directions[order[rank:]].T)[0]
    return _SeenCombinations(
        strengths=strengths[order],
        columns=directions[order].T,
        rank=rank,
        unit=unit,
        prior=prior,
        preference=np.concatenate([weak, FULL_PREFERENCE * unseen.T @ weak]),
    )


def _least_squares(
    equations: ResidualEquations, options: FitOptions, state: _Iterate, seen: _SeenCombinations, with_loss: bool
) -> Array:
    """Values in plausible sizes by least squares of the kept rows, or by Cauchy's loss at the scale of the spread."""
    from scipy.optimize import least_squares  # half a second to import

    kept, bounds = state.kept, options.bounds / options.sizes
    # One residual that never changes: a fall of the sum of squares is small beside one squared standard deviation.
    constant, no_slope = np.array([seen.unit]), np.zeros((1, len(bounds)))

    def residuals(units: Array) -> Array:
        measured = equations.residuals(units * options.sizes)[kept]
        return np.concatenate([measured, seen.rows_beside_measured @ units, constant])

    def slopes(units: Array) -> Array:
        measured = -_rates_at(equations, units, options)[1][kept]
        return np.concatenate([measured, seen.rows_beside_measured, no_slope])

    def loss(squares: Array) -> Array:
        """Cauchy's loss of measured values and the square of all other rows, with first and second derivatives."""
        is_measured, trust = np.arange(len(squares)) < kept.sum(), 1.0 / (1.0 + squares)
        plain = np.stack([squares, np.ones_like(squares), np.zeros_like(squares)])
        return np.where(is_measured, np.stack([np.log1p(squares), trust, -(trust**2)]), plain)

    form, scale, precision = (loss, state.spread, FIT_BEGUN) if with_loss else ("linear", 1.0, FIT_SETTLED)
    answer = least_squares(
        residuals, state.units, slopes, (-bounds, bounds), loss=form, f_scale=scale,
        ftol=precision, xtol=precision, gtol=None, max_nfev=MOST_FIT_STEPS,
    )  # fmt: skip
    return np.asarray(answer.x)


def _fit_result(before: Array, state: _Iterate, groups: Integers, options: FitOptions) -> Fit:
    """Describe the fit at its values: covariance and intervals, theory (65), rank, and poses that took no part."""
    kept_residuals, kept_rates = state.after[state.kept], state.rates[state.kept]
    seen = _combinations(kept_rates, options, state.spread)
    freedom = _freedom(kept_rates, seen)
    scatter = float(np.sqrt((kept_residuals**2).sum() / freedom))
    covariance, interval = _covariance_and_interval(kept_rates, seen, options, scatter, freedom)
    return Fit(
        values=state.units * options.sizes,
        covariance=covariance,
        half_intervals=_half_intervals(interval, seen, options),
        kept=state.kept,
        before=before,
        after=state.after,
        rates=state.rates,
        scatter=scatter,
        strengths=seen.strengths,
        combinations=seen.columns,
        rank=seen.rank,
        interval=interval,
        freedom=freedom,
        predicted=_predicted_residuals(state, groups, seen.rows_beside_measured),
    )


def _freedom(rates: Array, seen: _SeenCombinations) -> float:
    """Degrees of freedom of residuals: their number less the unknowns that measured values determine, theory (65).

    Each combination counts by the share of the measurements in what they and the priors say of it together.
    """
    basis = seen.columns[:, : seen.rank]
    measured, prior = rates @ basis, seen.prior @ basis
    both = measured.T @ measured + prior.T @ prior
    determined = float(np.trace(np.linalg.solve(both, measured.T @ measured))) if seen.rank else 0.0
    return max(len(rates) - determined, LEAST_FREEDOM)


def _covariance_and_interval(
    rates: Array, seen: _SeenCombinations, options: FitOptions, scatter: float, freedom: float
) -> tuple[Array, Array]:
    """The covariance and the interval of a `Fit` whose kept rows have these rates, scatter and freedom, SI."""
    basis = seen.columns[:, : seen.rank] / seen.strengths[: seen.rank]
    spread = 1.0 if options.known else max(scatter, options.resolution)
    units = spread**2 * np.outer(options.sizes, options.sizes)
    measured, known_before = rates @ basis, seen.prior @ basis
    factor = NORMAL_FACTOR if options.known else _student_factor(freedom)
    widened = factor**2 * measured.T @ measured + NORMAL_FACTOR**2 * known_before.T @ known_before
    return basis @ basis.T * units, basis @ widened @ basis.T * units


def _half_intervals(interval: Array, seen: _SeenCombinations, options: FitOptions) -> Array:
    """Half of the 95 % interval of each unknown, with what unseen combinations of plausible size may add [unknowns]."""
    unseen = seen.columns[:, seen.rank :]
    covariance_of_unseen = np.linalg.inv(unseen.T @ np.diag((FULL_PREFERENCE * options.preferred) ** 2) @ unseen)
    deviations = np.sqrt(np.einsum("ui,ij,uj->u", unseen, covariance_of_unseen, unseen)) * options.sizes
    half_intervals = np.hypot(np.sqrt(np.diag(interval)), NORMAL_FACTOR * deviations)
    half_intervals[np.linalg.norm(unseen, axis=1) > np.sqrt(UNSEEN_STRENGTH)] = np.inf
    return np.asarray(half_intervals)


def _student_factor(freedom: float) -> float:
    """Half of the 95 % interval over the standard deviation, where that is estimated: Student's t."""
    from scipy.special import stdtrit  # a quarter of a second to import: only where standard deviations are not known

    return float(stdtrit(freedom, UPPER_QUANTILE))


def _predicted_residuals(state: _Iterate, groups: Integers, rows_beside_measured: Array) -> Array:
    """Residuals of each fifth of the poses, predicted from the others: the fit to these is one linear step away.

    A fifth without kept values, or without others, keeps the residuals of the fit.
    """
    predicted, fold_of_row = state.after.copy(), np.unique(groups, return_inverse=True)[1] % FOLDS
    for fold in range(FOLDS):
        others, left_out = state.kept & (fold_of_row != fold), fold_of_row == fold
        if not others.any() or not left_out.any():
            continue
        rows = np.concatenate([state.rates[others], rows_beside_measured])
        residuals = np.concatenate([state.after[others], np.zeros(len(rows_beside_measured))])
        step = np.linalg.lstsq(rows, residuals, rcond=None)[0]
        predicted[left_out] = state.after[left_out] - state.rates[left_out] @ step
    return predicted

"""The shortest law of corrections over a grid: harmonics of the angle of gravity, and powers of all else.

A machine that is linear and fixed has corrections a + b cos + c sin of the angle by which gravity is turned, exactly:
its weight is such a law, and what the weight moves is proportional to it. Corrections that gravity does to second order
have the double angle. Over a pose no law is exact, and polynomials of ever higher degree are fitted until one is good
enough. Nothing is solved here but least squares.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np

from kinetostat.arrays import Array
from kinetostat.tolerances import EXACT_LAW

ANGLE = "load.gravity_angle"
"""Path of the field over which laws are harmonic."""
MOST_HARMONICS, MOST_DEGREE, MOST_TERMS = 3, 8, 500

Term = tuple[tuple[str, int], ...]
"""For each axis which function of it: ("power", k), ("cos", k) or ("sin", k)."""


@dataclass(frozen=True)
class Law:
    """Corrections as sums of terms.

    Attributes:
        paths: of the fields.
        middles, halves: of the range of each; powers are those of (value - middle) / half, from -1 to 1.
        terms: each a product over the axes.
        coefficients: of each term in each correction, m or rad [terms x actuators].
    """

    paths: tuple[str, ...]
    middles: tuple[float, ...]
    halves: tuple[float, ...]
    terms: tuple[Term, ...]
    coefficients: Array

    def at(self, values: Sequence[Array]) -> Array:
        """The corrections at points, given by the values of each axis [n]: m or rad [n x actuators]."""
        return _functions(self.terms, values, self.middles, self.halves) @ self.coefficients


def _functions(
    terms: Sequence[Term], values: Sequence[Array], middles: Sequence[float], halves: Sequence[float]
) -> Array:
    """Value of each term at each point [n x terms]."""
    columns = []
    for term in terms:
        column = np.ones(len(values[0]))
        for (kind, k), axis, middle, half in zip(term, values, middles, halves, strict=True):
            if kind == "power":
                column = column * ((axis - middle) / half) ** k
            else:
                column = column * (np.cos(k * axis) if kind == "cos" else np.sin(k * axis))
        columns.append(column)
    return np.stack(columns, axis=1)


def shortest_law(
    paths: Sequence[str], axes: Sequence[Array], corrections: Array, error: Callable[[Law], float], tolerance: float
) -> tuple[Law, float]:
    """Fit laws of ever more terms until the error of one is within the tolerance; else return the best of them.

    Args:
        paths: of the fields.
        axes: values along each.
        corrections: at all points of the grid, the last axis fastest, NaN where there are none [n x actuators].
        error: of a law.
        tolerance: of it, in the same unit.

    Returns:
        The law and its error.
    """
    middles = tuple(float(0.5 * (axis.min() + axis.max())) for axis in axes)
    halves = tuple(float(0.5 * (axis.max() - axis.min())) or 1.0 for axis in axes)
    points = [grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")]
    known = np.isfinite(corrections).all(axis=1)
    best: tuple[Law, float] | None = None
    for terms in _candidates(paths, [len(axis) for axis in axes], int(known.sum())):
        functions = _functions(terms, [axis[known] for axis in points], middles, halves)
        coefficients: Array = np.linalg.lstsq(functions, corrections[known], rcond=None)[0].astype(float)
        law = _without_round_off(Law(tuple(paths), middles, halves, terms, coefficients))
        here = error(law)
        if best is None or here < best[1]:
            best = law, here
        if best[1] <= tolerance:
            break
    if best is None:
        raise ValueError("no point of the grid has a correction")
    return best


def _without_round_off(law: Law) -> Law:
    """The law without terms that only round-off has; all functions are 1 at most."""
    sizes = np.abs(law.coefficients)
    coefficients = np.where(sizes > EXACT_LAW * sizes.max(axis=0), law.coefficients, 0.0)
    felt = np.asarray(coefficients.any(axis=1))
    felt[0] |= not felt.any()
    terms = tuple(term for term, kept in zip(law.terms, felt, strict=True) if kept)
    return replace(law, terms=terms, coefficients=coefficients[felt])


def _candidates(paths: Sequence[str], counts: Sequence[int], known: int) -> Iterator[tuple[Term, ...]]:
    """Rows of terms, the shortest first and harmonics before powers; each with fewer terms than points."""
    rows: list[tuple[bool, tuple[Term, ...]]] = []
    turning = paths.index(ANGLE) if ANGLE in paths else None
    others = [i for i in range(len(paths)) if i != turning]
    for degree in range(MOST_DEGREE + 1):
        rows.append((False, _powers(counts, range(len(paths)), degree)))
        if turning is not None:
            plain = _powers(counts, others, degree)
            most = min(MOST_HARMONICS, (counts[turning] - 1) // 2)
            rows += [(True, _turned(plain, turning, harmonics)) for harmonics in range(1, most + 1)]
    rows = [row for row in rows if len(row[1]) <= min(known, MOST_TERMS)]
    yield from dict.fromkeys(terms for _, terms in sorted(rows, key=lambda row: (len(row[1]), not row[0])))


def _powers(counts: Sequence[int], axes: Sequence[int], degree: int) -> tuple[Term, ...]:
    """All products of powers of some axes up to a degree; of each axis no more than its points determine."""
    terms = []
    for size in range(degree + 1):
        for chosen in combinations_with_replacement(axes, size):
            powers = [chosen.count(axis) for axis in range(len(counts))]
            if all(power < count for power, count in zip(powers, counts, strict=True)):
                terms.append(tuple(("power", power) for power in powers))
    return tuple(terms)


def _turned(terms: Sequence[Term], axis: int, harmonics: int) -> tuple[Term, ...]:
    """The terms, each also times cosine and sine of multiples of the angle."""
    waves = [("power", 0), *((kind, k) for k in range(1, harmonics + 1) for kind in ("cos", "sin"))]
    return tuple((*term[:axis], wave, *term[axis + 1 :]) for term in terms for wave in waves)

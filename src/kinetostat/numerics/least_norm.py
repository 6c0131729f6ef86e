"""Linear equations of many problems at once whose solution is not unique: least squares of least norm, by damping.

Damping is so small that it changes only what the equations leave open. It takes a fraction of the time of singular
values, which give the same steps.

Source: Golub and Van Loan, Matrix Computations, 4th ed., sections 5.5 and 6.1.4.
"""

import numpy as np

from kinetostat.arrays import Array
from kinetostat.tolerances import LEAST_DIVISOR, LEAST_NORM_DAMPING


def least_norm(rates: Array, gaps: Array) -> Array:
    """Least-squares solutions x of rates x = gaps, of least norm up to the damping; NaN where numbers are not finite.

    Args:
        rates: [problems x rows x unknowns].
        gaps: [problems x rows].

    Returns:
        The solutions [problems x unknowns].
    """
    finite = np.isfinite(rates).all(axis=(1, 2)) & np.isfinite(gaps).all(axis=1)
    if not finite.all():  # one problem with NaN would spoil the linear algebra of all
        solutions = np.full((len(rates), rates.shape[2]), np.nan)
        if finite.any():
            solutions[finite] = least_norm(rates[finite], gaps[finite])
        return solutions
    transposed = np.swapaxes(rates, 1, 2)
    if rates.shape[2] >= rates.shape[1]:
        multipliers = np.linalg.solve(with_damping(rates @ transposed), gaps[:, :, None])
        return np.asarray((transposed @ multipliers)[:, :, 0])
    return np.asarray(np.linalg.solve(with_damping(transposed @ rates), transposed @ gaps[:, :, None])[:, :, 0])


def with_damping(squares: Array) -> Array:
    """Add `LEAST_NORM_DAMPING` times their trace to the diagonals of squared rates, so that these can be inverted.

    Only directions that change nothing notice.

    Args:
        squares: a product J^T J or J J^T of rates J for each problem [problems x n x n].
    """
    trace = np.trace(squares, axis1=1, axis2=2)[:, None, None]
    return np.asarray(squares + LEAST_NORM_DAMPING * (trace + LEAST_DIVISOR) * np.eye(squares.shape[1]))

"""How a mechanism resists further load at a state of rest: compliance and stiffness.

At a state of rest the second derivative of the potential depends on no choice of coordinates: it is the tangent
stiffness. Its elastic part is that of the springs at this place; the geometric part is what wrenches and weights do
when their lines of action turn. The moment of the load keeps its axis, which no potential does, and only the symmetric
part of what it adds is taken.

Source: theory (39). M. Zefran and V. Kumar, "A geometrical approach to the study of the Cartesian stiffness
matrix", J. Mechanical Design 124(1), 2002. Units are those of `mechanism`.
"""

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.solving import solve
from kinetostat.numerics.motions import skew_of
from kinetostat.tolerances import ROUND_OFF_OF_COMPLIANCE, UNRESISTED


def compliance(equations: Balance) -> Array:
    """The twist of the platform per unit of a further wrench, at the loaded tool point [n x 6 x 6].

    Rows and columns of components that rigid parts hold are exactly 0, as in `assembly.without_round_off`.
    """
    ways = equations.mechanism.ways
    size = ways.shape[1]
    right = np.zeros((len(equations.left), equations.left.shape[1], size))
    right[:, :size] = np.eye(size)
    moved = ways @ solve(equations, right)[:, :size] @ ways.T
    shift = np.broadcast_to(np.eye(6), moved.shape).copy()
    shift[:, 3:, :3] = -skew_of(equations.state.platform.translation)
    moved = shift @ moved @ np.swapaxes(shift, 1, 2)
    moved = 0.5 * (moved + np.swapaxes(moved, 1, 2))
    sizes = np.abs(np.diagonal(moved, axis1=1, axis2=2))
    # In these units a typical spring has the compliance 1.
    moves = sizes > ROUND_OFF_OF_COMPLIANCE * np.maximum(sizes.sum(axis=1, keepdims=True), 1.0)
    return np.where(moves[:, :, None] & moves[:, None] | np.isnan(moved), moved, 0.0)


def inverse(compliances: Array) -> Array:
    """The stiffness of each compliance [n x m x m].

    Rigid parts that hold single components leave the others a stiffness of their own: that of a fixed component is
    infinite, and 0 couples it to the others. All of it is infinite where other directions are rigid.
    """
    sizes = np.sqrt(np.abs(np.diagonal(compliances, axis1=1, axis2=2)))
    fixed = sizes == 0.0
    products = sizes[:, :, None] * sizes[:, None]
    products = np.where(products > 0.0, products, 1.0)
    scaled = compliances / products + fixed[:, :, None] * np.eye(fixed.shape[1])
    finite = (~fixed.all(axis=1) & (np.linalg.cond(scaled) < 1.0 / UNRESISTED))[:, None, None]
    usable = np.where(finite, scaled, np.eye(fixed.shape[1]))
    return _with_held(np.where(finite, np.linalg.inv(usable) / products, np.inf), fixed)


def _with_held(stiffness: Array, fixed: Mask) -> Array:
    """A stiffness with infinite entries between components that are fixed, and 0 between these and the others."""
    either, both = fixed[:, :, None] | fixed[:, None], fixed[:, :, None] & fixed[:, None]
    return np.where(both, np.inf, np.where(either & np.isfinite(stiffness), 0.0, stiffness))


def elastic_stiffness(equations: Balance, compliances: Array) -> Array:
    """The stiffness of the springs where they are, leg by leg, at the loaded tool point [n x 6 x 6].

    A leg with rigid parts only lets the platform move in some ways and takes no part in them. Where these are single
    components, the entries of the others are infinite; else all of them are.

    Args:
        equations: at a state of rest.
        compliances: of the platform there, to tell what is fixed [n x 6 x 6].
    """
    ways = equations.mechanism.ways
    size = ways.shape[1]
    total = np.zeros((len(equations.left), size, size))
    rigid = np.zeros(len(total), dtype=bool)
    for number, leg in enumerate(equations.mechanism.legs):
        block = equations.leg_rates(number, loaded=False)
        rigid |= np.linalg.cond(block) >= 1.0 / UNRESISTED
        total += np.linalg.pinv(block)[:, leg.size :, leg.size :]
    back = np.broadcast_to(np.eye(6), (len(total), 6, 6)).copy()
    back[:, 3:, :3] = skew_of(equations.state.platform.translation)
    whole = np.swapaxes(back, 1, 2) @ ways @ total @ ways.T @ back
    whole = 0.5 * (whole + np.swapaxes(whole, 1, 2))
    exists = np.abs(ways).max(axis=1) > 0.0
    fixed = (np.diagonal(compliances, axis1=1, axis2=2) == 0.0) & exists
    apart = np.isfinite(inverse(compliances[:, exists][:, :, exists])).any(axis=(1, 2))
    result = np.where((rigid & ~apart)[:, None, None], np.inf, whole)
    return _with_held(result, fixed & rigid[:, None])

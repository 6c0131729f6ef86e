"""Roles of the elastic elements in each direction of a machine: shares, limits of rigidity and gains, pose by pose."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import Progress, responses
from kinetostat.engine.points import Points
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import (
    Element,
    diagonal_with,
    element_share,
    rigid_from,
    stiffness_equations,
    without_rounding,
)
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.machine import Machine
from kinetostat.spec.immutable import Immutable
from kinetostat.tolerances import NO_ROLE

EXCESS = 0.01
"""An element counts as rigid where its compliance adds less than this share to that of the machine with it rigid."""


@dataclass(frozen=True, eq=False)
class Roles(Immutable):
    """What each element does to each direction, pose by pose; NaN where the direction is rigid, free or has no pose.

    Attributes:
        shares: of each entry of the diagonal of C, 0 to 1 [elements x components x poses].
        rigid: by which factor the stiffness of an element may be multiplied until it only just counts as rigid: from
            there on it does; infinite where nothing else is compliant, 0 where no compliance of it
            matters [same shape].
        gains: by which share an entry of C falls once the element is twice as stiff [same shape].
    """

    shares: Array
    rigid: Array
    gains: Array


def roles_at(response: Response, elements: Sequence[Element], kept: Sequence[int]) -> Roles:
    """Compute the roles of elements.

    Args:
        response: at one pose, or at many as arrays.
        elements: the elements.
        kept: which of rx ry rz x y z = 0 ... 5 the machine has.
    """
    with np.errstate(all="ignore"):
        whole = without_rounding(response.compliance.diagonal(), response)[kept]
        bounded = np.isfinite(whole)
        whole = np.where((whole > 0.0) & bounded, whole, math.nan)
        shares, rigid, gains = [], [], []
        for element in elements:
            part = without_rounding(element_share(response, element), response)[kept]
            ever = part / np.where(np.isfinite(whole), whole, 1.0) > NO_ROLE
            factor = 1.0 / rigid_from(response, element, EXCESS)[kept]
            rigid.append(np.where(bounded, np.where(ever, factor, 0.0), math.nan))
            here = 0.0 if element.stiffness == math.inf else part / whole
            shares.append(np.where(here > NO_ROLE, here, whole * 0.0))
            gains.append(1.0 - without_rounding(diagonal_with(response, element, 0.5), response)[kept] / whole)
    none = np.zeros((0, *np.shape(whole)))
    return Roles(*(np.stack(np.broadcast_arrays(*rows)) if rows else none for rows in (shares, rigid, gains)))


def roles_over(
    machine: Machine, grid: Points, elements: Sequence[Element], kept: Sequence[int], progress: Progress
) -> tuple[Roles, tuple[int, int]]:
    """Compute roles at the poses of a grid that have an answer; also how many these are, and how many there are.

    Args:
        machine: gives what does not vary.
        grid: poses.
        elements, kept: as for `roles_at`.
        progress: receives how far the work is.
    """
    response = responses(machine, grid)
    progress(1, 2)
    good = np.broadcast_to(np.asarray(response.status) == Status.OK, (grid.size,))
    every = roles_at(response, elements, kept)
    progress(2, 2)
    shape = (len(elements), len(kept), grid.size)
    part = [np.broadcast_to(rows, shape)[:, :, good] for rows in (every.shares, every.rigid, every.gains)]
    return Roles(*part), (int(good.sum()), grid.size)


def stiffening(machine: Machine, element: Element, factors: Array) -> Array:
    """Stiffness of each direction while an element changes, as a share of the one with the element rigid.

    Args:
        machine: at its pose.
        element: whose stiffness is multiplied.
        factors: on its stiffness; of an element that is rigid, its stiffness itself (SI) [points].

    Returns:
        1 / C_ii over its limit [components x points]; 0 where nothing else is compliant.
    """
    kept, response = list(machine.family.components), respond(machine)
    with np.errstate(all="ignore"):
        rigid = without_rounding(diagonal_with(response, element, 0.0), response)[kept]
        return rigid / without_rounding(diagonal_with(response, element, 1.0 / factors), response)[kept]


def equations_of_k(
    response: Response, elements: Sequence[Element], kept: Sequence[int]
) -> dict[str, tuple[float, ...]] | None:
    """Coefficients in the diagonal of K by element (eqs. 33-38), without round-off; None where K is not such a sum.

    Arguments as for `roles_at`, at one pose.
    """
    by_element = stiffness_equations(response, elements)
    if by_element is None:
        return None
    rows = {name: [float(matrix.entry(i, i)) for i in kept] for name, matrix in by_element.items()}
    most = [max(column) for column in zip(*rows.values(), strict=True)]
    return {
        name: tuple(c if c > NO_ROLE * top else 0.0 for c, top in zip(row, most, strict=True))
        for name, row in rows.items()
    }

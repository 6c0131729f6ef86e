"""Eigenscrews: the six screws on which a twist causes a wrench on the same screw, and K and C as sums over them.

They do not depend on the reference point. They are computed of 6 x 6 matrices only, because in a plane all pitches are
zero. Centres of K and C are in `centres`.

Sources: T. Patterson and H. Lipkin, "Structure of robot compliance", ASME J. Mechanical Design 115(3), 1993; S. Huang
and J. M. Schimmels, "The eigenscrew decomposition of spatial stiffness matrices", IEEE Trans. Robotics and Automation
16(2), 2000.
"""

import math

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.indices import Matrix, finite
from kinetostat.spec.immutable import Immutable
from kinetostat.tolerances import PURE_COUPLE, ZERO_EIGENSCREW

ROTATION, TRANSLATION = slice(0, 3), slice(3, 6)
MOMENT, FORCE = ROTATION, TRANSLATION


@dataclass(frozen=True, eq=False)
class Eigenscrew(Immutable):
    """A screw on which a twist causes a wrench on the same screw.

    Attributes:
        eigenvalue: force of the wrench over rotation of the twist, N/rad: K t = eigenvalue * (t as a wrench). It is
            zero for a motion that a singular K does not resist, and infinite for one that a singular C does not allow.
        pitch: pitch with the sign of the eigenvalue, m/rad; infinite for a couple (a translation).
        direction: unit vector of the axis, base axes [3]; its largest component is positive.
        point: foot of the perpendicular from P on the axis, base axes, m [3]; None at infinite pitch.
        weight: k in K = sum k w w^T, the stiffness of a spring on the unit wrench w = [h n + r x n; n] (N/m), or [n; 0]
            at infinite pitch (N·m/rad); from C, s in C = sum s t t^T with t = [n; h n + r x n] (rad/(N·m)), or [0; n]
            (m/N).
    """

    eigenvalue: float
    pitch: float
    direction: list[float]
    point: list[float] | None
    weight: float


def eigenscrews(stiffness: Matrix) -> list[Eigenscrew]:
    """The eigenscrews of K, solutions of K t = lambda Delta t, where Delta exchanges the halves of a screw.

    With K = F F^T their wrenches are w = F y with F^T Delta F y = lambda y. This problem is symmetric, so that its
    solutions are real, and K = sum k w w^T follows. If K is regular, three pitches are positive and three negative, and
    2 h k = lambda.
    Patterson and Lipkin (1993); the decomposition, Huang and Schimmels (2000).

    Args:
        stiffness: K at P, base axes [6 x 6], finite, positive semi-definite.

    Returns:
        As many eigenscrews as the rank of K, by increasing eigenvalue. Those of a repeated eigenvalue (zero, if K is
        singular) are one of many choices that all give the sum.

    Raises:
        ValueError: K is not 6 x 6 and finite.
    """
    return [_eigenscrew(*term, term[0]) for term in _terms(_finite(stiffness), line=FORCE, moment=MOMENT)]


def compliance_eigenscrews(compliance: Matrix) -> list[Eigenscrew]:
    """The eigenscrews of C: those of K = C^-1, also where K is infinite because the machine is rigid in a direction.

    With C = F F^T their twists are t = F y with F^T Delta F y = y / lambda. Arguments and results as for `eigenscrews`.
    """
    terms = _terms(_finite(compliance), line=ROTATION, moment=TRANSLATION)
    screws = [_eigenscrew(*term, 1.0 / term[0] if term[0] else math.inf) for term in terms]
    return sorted(screws, key=lambda screw: screw.eigenvalue)


def _finite(matrix: Matrix) -> Array:
    array = finite(matrix)
    if array is None:
        raise ValueError("eigenscrews need a finite matrix: take C where K is infinite, K where C is")
    return array


def _terms(matrix: Array, line: slice, moment: slice) -> list[tuple[float, Array, Array]]:
    """Return the eigenscrews of a matrix, the sum of their dyads: twice line . moment, the line and the moment.

    They are computed in a unit of length in which both diagonal blocks have the same trace. A line that is only
    round-off is set to zero.
    """
    moments, lines = float(np.trace(matrix[moment, moment])), float(np.trace(matrix[line, line]))
    length = math.sqrt(moments / lines) if moments > 0.0 and lines > 0.0 else 1.0
    scale = np.ones(6)
    scale[moment] = 1.0 / length
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    kept = values > ZERO_EIGENSCREW * values[-1]
    factor = vectors[:, kept] * np.sqrt(values[kept])
    products, mixed = np.linalg.eigh(factor.T @ np.roll(factor, 3, axis=0))
    products[np.abs(products) <= ZERO_EIGENSCREW * values[-1]] = 0.0
    screws = (factor @ mixed).T
    pure = np.linalg.norm(screws[:, line], axis=1) <= PURE_COUPLE * np.linalg.norm(screws, axis=1)
    screws[pure, line] = 0.0
    return [(float(p) * length, w[line], w[moment] * length) for p, w in zip(products, screws, strict=True)]


def _eigenscrew(product: float, line: Array, moment: Array, eigenvalue: float) -> Eigenscrew:
    """The eigenscrew of a term of the sum: its pitch is line . moment over line . line."""
    pure = not line.any()
    axis = moment if pure else line
    size = float(np.linalg.norm(axis))
    direction = axis * math.copysign(1.0 / size, axis[np.argmax(np.abs(axis))])
    point = None if pure else [float(c) for c in np.cross(line, moment) / size**2]
    pitch = math.inf if pure else 0.5 * product / size**2
    return Eigenscrew(eigenvalue, pitch, direction.tolist(), point, size**2)

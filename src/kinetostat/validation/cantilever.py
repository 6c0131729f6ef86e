"""The cantilever of the textbook: stiffness of a beam's free end against its built-in one. Written for validation only.

Nothing of `machine.link` that turns a beam into springs may be used here: this is the independent route.
"""

import math

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.vector import Vector
from kinetostat.machine.link import Beam

Array = npt.NDArray[np.float64]


def section_axes(beam: Beam) -> tuple[Array, float]:
    """Axes of a beam as the columns x (along it), y, z of a rotation [3 x 3] in the base frame, and its length, m."""
    start, end, up = (np.array([float(c) for c in v.components()]) for v in (beam.start, beam.end, beam.up))
    length = float(np.linalg.norm(end - start))
    x = (end - start) / length
    z = up - (up @ x) * x
    z = z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z]), length


def end_compliance(beam: Beam) -> Array:
    """Compliance of the end against a built-in start, at the end, in the beam's own axes, order rx ry rz x y z [6 x 6].

    A load F across deflects the end by F L³/3EI + F L/kGA and turns it by F L²/2EI; a moment M turns it by M L/EI and
    deflects it by M L²/2EI; torsion M L/GJ, tension F L/EA. Source: Przemieniecki 1968, Theory of Matrix Structural
    Analysis, section 5.6.
    """
    length, own = section_axes(beam)[1], beam.rigidity
    c = np.zeros((6, 6))
    c[0, 0], c[3, 3] = length / float(own.torsion), length / float(own.axial)
    planes = ((4, 2, 1.0, own.bending_z, own.shear_y), (5, 1, -1.0, own.bending_y, own.shear_z))
    for across, about, sign, bending, shear in planes:
        soft = 1.0 / float(bending)
        c[across, across] = length**3 / 3.0 * soft + length / float(shear)
        c[about, about] = length * soft
        c[across, about] = c[about, across] = sign * length**2 / 2.0 * soft
    return c


def in_plane(beam: Beam, normal: Vector) -> tuple[bool, ...]:
    """Which of rx ry rz x y z in the beam's own axes move in a plane that holds it; all False if it stands askew."""
    components = section_axes(beam)[0].T @ np.array([float(c) for c in normal.components()])
    across = [math.isclose(abs(c), 1.0, abs_tol=1e-9) for c in components]
    return (*across, *(not c and any(across) for c in across))

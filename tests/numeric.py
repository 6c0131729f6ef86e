"""Numbers for tests: our structures as NumPy arrays, and comparisons that never mix rotation with translation."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from hypothesis import assume

from kinetostat.algebra.screw import Screw, Twist, Wrench
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.algebra.vector import ZERO, Displacement, Rotation, Vector
from kinetostat.arrays import Array, Mask
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.common_tables import COMMON_TABLES, Tool
from kinetostat.machine.machine import Configuration, Family, Machine

U = float(np.finfo(float).eps)
"""Rounding unit of float64, 2.2e-16."""
BLOCKS = (slice(0, 3), slice(3, 6))
DROWNED = 10
"""Rounding units times the root of the contrast of springs that may be lost where springs are in a row; see `lost`."""
REACHED = 1e-9
"""Share of a screw, in one unit, above which a component is surely no rounding; see `reached`."""


def array(symmetric: Symmetric6) -> Array:
    """K or C as an array [6 x 6]."""
    return np.array(symmetric.rows(), dtype=float)


def vector(v: Vector) -> Array:
    """A vector as an array [3]."""
    return np.array(v.components(), dtype=float)


def matrix(rotation: Rotation) -> Array:
    """A rotation as an array [3 x 3]."""
    return np.array([rotation.x.components(), rotation.y.components(), rotation.z.components()], dtype=float).T


def screw(s: Screw) -> Array:
    """A twist or wrench as an array [6], order rx ry rz x y z."""
    return np.array(s.components(), dtype=float)


def skew(a: Array) -> Array:
    """The matrix of a x . [3 x 3]."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def wrench_transport(turn: Array, offset: Array) -> Array:
    """The matrix [6 x 6] that turns a wrench by `turn` and then refers it to the point at `offset` (m) from before."""
    return np.block([[turn, -skew(offset) @ turn], [np.zeros((3, 3)), turn]])


def twist_transport(turn: Array, offset: Array) -> Array:
    """Likewise for a twist."""
    return np.block([[turn, np.zeros((3, 3))], [-skew(offset) @ turn, turn]])


def dimensionless(symmetric: Symmetric6, length: float, kind: type[Screw]) -> Array:
    """K (kind Wrench) or C (kind Twist), moments divided and angles multiplied by `length` (m): all in N/m or m/N."""
    scale = np.repeat([1.0 / length if kind is Wrench else length, 1.0], 3)
    return scale[:, None] * array(symmetric) * scale


def trace_product(response: Response) -> float:
    """tr K tr C in one unit: 36 at best (9 in a plane); times the rounding unit, what K C can differ from 1."""
    stiffness, compliance = reduced(response, response.stiffness, Wrench), reduced(response, response.compliance, Twist)
    return float(np.trace(stiffness) * np.trace(compliance))


def assert_blocks_close(actual: Array, expected: Array, relative: float, scale_of: Array | None = None) -> None:
    """Compare two symmetric 6x6 block by block, in the Frobenius norm; of `expected`, or of another matrix `scale_of`.

    The scale of the coupling block is the geometric mean of the rotational and the translational block: for a
    positive semi-definite matrix it is at most that, and it has the same unit, so that no length has to be chosen.
    """
    sizes = [np.linalg.norm((expected if scale_of is None else scale_of)[block, block]) for block in BLOCKS]
    for i, rows in enumerate(BLOCKS):
        for j, columns in enumerate(BLOCKS):
            error = np.linalg.norm(actual[rows, columns] - expected[rows, columns])
            scale = np.sqrt(sizes[i] * sizes[j])
            assert error <= relative * scale, f"block {i},{j}: {error:.3g} of {scale:.3g}"


def lost(response: Response) -> float:
    """What may be lost beside rounding, as a share of K or C: 0 where each leg is solved spring by spring.

    In a leg with more or fewer springs than wrenches, and where legs constrain the platform twice, springs are mixed
    before they are inverted: the softest drown the stiffest in rounding, by the root of the contrast between them.
    """
    carried = sum(len(leg.wrenches) for leg in response.legs) + len(response.guide)
    if carried == 6 and all(len(leg.loads) == len(leg.wrenches) for leg in response.legs):
        return 0.0
    length = float(response.configuration.length)
    every = [s for leg in response.configuration.legs for s in leg.springs]
    sizes = [float(s.stiffness) / (1.0 if s.joint.point is None else length**2) for s in every]
    sizes = [size for size in sizes if 0.0 < size < np.inf] or [1.0]
    return DROWNED * U * float(np.sqrt(max(sizes) / min(sizes)))


def assert_psd(symmetric: Array, size: float = 0.0) -> None:
    """Of a matrix in one unit: all finite, and no eigenvalue below zero beyond rounding, of itself or of `size`."""
    assert np.all(np.isfinite(symmetric))
    assert np.allclose(symmetric, symmetric.T, rtol=0, atol=4 * U * np.max(abs(symmetric)))
    eigenvalues = np.linalg.eigvalsh(symmetric)
    assert eigenvalues[0] >= -20 * U * max(eigenvalues[-1], size)


def placed(configuration: Configuration, reference: Vector | None = None) -> Machine:
    """A machine that stands as it is placed, with its tool at `reference` (base frame, m): at P if not given."""
    home = configuration.platform.inverse()
    offset = ZERO if reference is None else home.apply(reference)
    sections = {**{name: table() for name, table in COMMON_TABLES.items()}, "tool": Tool(offset.components())}
    return Machine("placed", Family("placed", "", {}, lambda: configuration), sections)


def answer(configuration: Configuration, reference: Vector | None = None) -> Response:
    """What a placed machine answers at any reference point (base frame, m), at P if none is given."""
    return respond(placed(configuration, reference))


def displaced(configuration: Configuration, motion: Displacement) -> Configuration:
    """The whole placed machine moved as one, and the plane of a planar one with it."""
    legs = tuple(leg.displaced(motion) for leg in configuration.legs)
    plane = None if configuration.plane is None else configuration.plane.displaced(motion)
    return replace(configuration, platform=motion @ configuration.platform, legs=legs, plane=plane)


def with_springs(configuration: Configuration, stiffness: Mapping[int, float]) -> Configuration:
    """The placed machine with the stiffness of some springs replaced; springs count as in every per-spring result."""
    legs, taken = [], 0
    for leg in configuration.legs:
        own = [replace(s, stiffness=stiffness.get(e, s.stiffness)) for e, s in enumerate(leg.springs, taken)]
        legs.append(replace(leg, chain=(*leg.passive, *own)))
        taken += len(own)
    return replace(configuration, legs=tuple(legs))


def respring(response: Response, stiffness: Mapping[int, float]) -> Response:
    """What the same placed machine answers at the same point with other stiffnesses, by number of the spring."""
    return answer(with_springs(response.configuration, stiffness), response.reference)


def matrices(response: Response) -> tuple[Array, Array]:
    """K and C as arrays [6 x 6]."""
    return array(response.stiffness), array(response.compliance)


def motions(response: Response) -> Array:
    """Orthonormal basis of the twists at the reference point that exist: all six, or rz, x, y of a plane [6 x n]."""
    if response.configuration.plane is None:
        return np.eye(6)
    axes = response.configuration.plane.frame.rotation
    return columns([Twist(axes.z, ZERO), Twist(ZERO, axes.x), Twist(ZERO, axes.y)])


def reduced(response: Response, symmetric: Symmetric6, kind: type[Screw]) -> Array:
    """K (kind Wrench) or C (kind Twist) over the motions that exist, in one unit (N/m or m/N) [n x n]."""
    basis = motions(response)
    return basis.T @ dimensionless(symmetric, float(response.configuration.length), kind) @ basis


def columns(screws: Sequence[Screw]) -> Array:
    """Screws as the columns of an array [6 x n]."""
    return np.array([s.components() for s in screws], dtype=float).T


def reached(screws: Sequence[Screw], length: float) -> Mask:
    """Entries [6 x 6] to which some screws contribute beyond rounding; refuses doubtful machines.

    For twists `length` is that of the machine (m), for wrenches its inverse: then all six components compare.
    """
    touched = np.zeros((6, 6), dtype=bool)
    for one in screws:
        parts = abs(screw(one)) * np.repeat([length, 1.0], 3)
        share = parts / (np.linalg.norm(parts) or 1.0)
        assume(not np.any((share > 100 * U) & (share < REACHED)))
        touched |= np.outer(share > REACHED, share > REACHED)
    return touched

"""A leg as an engine can build it: nothing rigid, free or idle is left in its chain. Geometry and stiffness only.

Knows no engine, and no J, W or G: what it reads are the points, axes, sections and springs of `machine`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.vector import Rotation, Vector
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, Spring
from kinetostat.machine.link import Beam, Parallelogram, Rigidity
from kinetostat.machine.machine import Plane
from kinetostat.machine.parts import Arm
from kinetostat.spec.errors import InputError

Array = npt.NDArray[np.float64]

COINCIDENT = 1e-9
"""Share of a leg's extent, or sine of an angle, below which points coincide and directions are parallel."""


@dataclass(frozen=True)
class Strut:
    """A straight part between two spherical joints: it carries a force along its line; its idle spin is left out.

    Attributes:
        name: of the part.
        start, end: centres of the joints, base frame, m.
        stiffness: between them, N/m; infinity if rigid.
    """

    name: str
    start: Vector
    end: Vector
    stiffness: float


Piece = Joint | Spring | Beam | Parallelogram | Strut
"""What stands between two bodies of a chain; springs in it are neither free nor rigid."""


def array(v: Vector) -> Array:
    """A vector as an array [3]."""
    return np.array([float(c) for c in v.components()])


def columns(rotation: Rotation) -> Array:
    """A rotation as an array [3 x 3]."""
    return np.column_stack([array(rotation.x), array(rotation.y), array(rotation.z)])


def pieces(leg: Leg, plane: Plane | None = None) -> tuple[Piece, ...]:
    """The chain of a leg from base to platform, one piece between each body and the next.

    A spring of zero stiffness has become a joint, an infinitely stiff one has vanished, what lies between two
    spherical joints is a strut, and a planar machine keeps what moves in its plane.

    Raises:
        InputError: where an element is of a kind that no engine is told how to build.
    """
    size = _extent(leg)
    found: list[Piece] = []
    for element in leg.chain:
        found += _plain(leg, element)
    if plane is None:
        return _with_struts(leg.name, found, COINCIDENT * size)
    return tuple(piece for piece in found if moves_in(plane, piece))


def _plain(leg: Leg, element: Element) -> list[Piece]:
    if isinstance(element, Spring):
        if element.stiffness == 0.0:
            return [element.joint]
        return [] if math.isinf(element.stiffness) else [element]
    if isinstance(element, Joint | Beam | Parallelogram):
        return [element]
    if isinstance(element, Arm) and element.springs:
        own = Rigidity(torsion=element.torsion, bending_y=element.bending, bending_z=element.bending)
        return [Beam(element.name, element.start, element.end, element.up, own)]
    if not element.freedoms and not element.springs:
        return []
    raise InputError(f"{leg.name} holds a {type(element).__name__}, which validation cannot rebuild in another engine.")


def _extent(leg: Leg) -> float:
    """Largest distance of two points of a leg, or 1 where it has but one, m."""
    points = [array(p) for element in leg.chain for p in element.path]
    return max((float(np.linalg.norm(p - q)) for p in points for q in points), default=0.0) or 1.0


def joint_of(piece: Joint | Spring) -> Joint:
    """The freedom of a joint or of a spring."""
    return piece.joint if isinstance(piece, Spring) else piece


def moves_in(plane: Plane, piece: Piece) -> bool:
    """Whether a piece has a motion in the plane: a revolute along its normal, a slide across it, any link.

    Raises:
        InputError: if it is askew to the plane.
    """
    if not isinstance(piece, Joint | Spring):
        return True
    joint, normal = joint_of(piece), array(plane.frame.rotation.z)
    along = abs(float(array(joint.axis) @ normal))
    if COINCIDENT < along < 1.0 - COINCIDENT:
        raise InputError(f'"{joint.name or piece.name}" is askew to the plane of a planar machine.')
    return (along > 0.5) != (joint.point is None)


def _with_struts(name: str, chain: Sequence[Piece], near: float) -> tuple[Piece, ...]:
    """The chain with every strut in it as one piece."""
    made: list[Piece] = []
    at = 0
    while at < len(chain):
        strut, after = _strut(name, chain, at, near)
        made.append(strut or chain[at])
        at = after if strut else at + 1
    return tuple(made)


def _strut(name: str, chain: Sequence[Piece], at: int, near: float) -> tuple[Strut | None, int]:
    """The strut that begins at a position of the chain, if there is one, and the position after it."""
    first, inside = _ball(chain, at, near)
    if first is None:
        return None, at
    for last in range(inside, len(chain)):
        second, after = _ball(chain, last, near)
        if second is not None and float(np.linalg.norm(array(second - first))) > near:
            yielding = _in_a_row(chain[inside:last], first, second, near)
            return (None, at) if yielding is None else (Strut(name, first, second, yielding), after)
    return None, at


def _ball(chain: Sequence[Piece], at: int, near: float) -> tuple[Vector | None, int]:
    """Centre of the spherical joint that begins at a position (three revolutes through a point), and what follows."""
    axes: list[Array] = []
    centre: Vector | None = None
    for i, piece in enumerate(chain[at : at + 3], at + 1):
        if not isinstance(piece, Joint) or piece.point is None or piece.pitch != 0.0:
            return None, at
        centre = centre or piece.point
        if float(np.linalg.norm(array(piece.point - centre))) > near:
            return None, at
        axes.append(array(piece.axis))
        if len(axes) == 3 and abs(float(np.linalg.det(axes))) > COINCIDENT:
            return centre, i
    return None, at


def _in_a_row(parts: Sequence[Piece], start: Vector, end: Vector, near: float) -> float | None:
    """Stiffness (N/m) along the line of parts in a row; None where they do more than stretch along it."""
    span = array(end - start)
    along = span / np.linalg.norm(span)
    compliance = 0.0
    for part in parts:
        if isinstance(part, Spring) and part.joint.point is None and _parallel(array(part.joint.axis), along):
            compliance += 1.0 / float(part.stiffness)
        elif isinstance(part, Beam) and _spans(part, (start, end), near):
            compliance += float(np.linalg.norm(span)) / float(part.rigidity.axial)
        elif not (isinstance(part, Spring) and _turns_about(part.joint, (start, end), near)):
            return None
    return 1.0 / compliance if compliance > 0.0 else RIGID


def _parallel(a: Array, b: Array) -> bool:
    return float(np.linalg.norm(np.cross(a, b))) < COINCIDENT


def _spans(beam: Beam, ends: tuple[Vector, Vector], near: float) -> bool:
    pairs = zip((beam.start, beam.end), ends, strict=True)
    return all(float(np.linalg.norm(array(own - end))) < near for own, end in pairs)


def _turns_about(joint: Joint, centres: Sequence[Vector], near: float) -> bool:
    """Whether a revolute's axis passes through a spherical joint, which leaves it without a load."""
    if joint.point is None or joint.pitch != 0.0:
        return False
    axis, point = array(joint.axis), joint.point
    return any(float(np.linalg.norm(np.cross(array(centre - point), axis))) < near for centre in centres)

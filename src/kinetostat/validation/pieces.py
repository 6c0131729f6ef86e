"""A machine as another program can build it: chains without rigid, free or idle elements, beams as cantilevers, masses.

Knows no engine, and no J, W, G or mass matrix: it reads the points, axes, cross-sections, springs, masses, centres and
inertias of `machine`. The stiffness of a beam is that of the textbook's cantilever, so that nothing of `machine.link`
that turns a beam into springs is used: this keeps the comparison independent.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Displacement, Rotation, Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.drives import numbers_of_drive, values_of_drives
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, Spring, Station
from kinetostat.machine.link import Beam, Parallelogram, Rigidity
from kinetostat.machine.machine import Configuration, Machine, Member, Plane
from kinetostat.machine.parts import Arm
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import COINCIDENT


@dataclass(frozen=True)
class StrutPiece:
    """A straight part between two spherical joints: it carries a force along its line; its idle spin is omitted.

    Attributes:
        name: of the part.
        start, end: centres of the joints, base frame, m.
        stiffness: between them, N/m; infinity if rigid.
        preload: tension at this length, N.
    """

    name: str
    start: Vector
    end: Vector
    stiffness: float
    preload: float = 0.0


Piece = Joint | Spring | Beam | Parallelogram | StrutPiece
"""A connection between two bodies of a chain; springs in it are neither free nor rigid."""


def array(v: Vector) -> Array:
    """Return a vector as an array [3]."""
    return np.array([float(c) for c in v.components()])


def columns(rotation: Rotation) -> Array:
    """Return a rotation as an array with its axes as columns [3 x 3]."""
    return np.column_stack([array(rotation.x), array(rotation.y), array(rotation.z)])


def pieces(leg: Leg, plane: Plane | None = None, struts: bool = True) -> tuple[Piece, ...]:
    """Return the chain of a leg from base to platform, one piece between each body and the next.

    A spring of zero stiffness becomes a joint and an infinitely stiff one is omitted; of a planar machine only the
    pieces that move in its plane remain.

    Args:
        leg: at the pose.
        plane: of a planar machine.
        struts: whether the parts between two spherical joints become a strut.

    Raises:
        InputError: if an element is of a kind that cannot be built in another engine.
    """
    size = _extent(leg)
    chain: list[Piece] = []
    for element in leg.chain:
        chain += _plain(leg, element)
    if plane is None and struts:
        return _with_struts(leg.name, chain, COINCIDENT * size)
    return tuple(piece for piece in chain if plane is None or moves_in(plane, piece))


def bodies_before(leg: Leg, station: Station, plane: Plane | None = None, struts: bool = True) -> int:
    """Return how many pieces of a leg are between the base and the body that carries a station.

    What is on a strut is carried by its neighbours: the body at the end that is nearer.

    Args:
        leg, plane, struts: as for `pieces`.
        station: a point of the leg.

    Raises:
        InputError: if the station is within a part that another program cannot cut.
    """
    carried, point = station
    whole, part = pieces(leg, plane, struts), pieces(replace(leg, chain=leg.chain[:carried]), plane, struts)
    same = next((i for i, (a, b) in enumerate(zip(whole, part, strict=False)) if a != b), len(part))
    if same == len(part):
        return same
    cut = whole[same]
    if not isinstance(cut, StrutPiece):
        raise InputError(f"{leg.name} has a mass within {cut.name}, which cannot be rebuilt in another program.")
    near, far = (float((end - point).norm()) for end in (cut.start, cut.end))
    return same if near < far else same + 1


def _plain(leg: Leg, element: Element) -> list[Piece]:
    if isinstance(element, Spring):
        if element.stiffness == 0.0:
            return [element.joint]
        return [] if math.isinf(element.stiffness) else [element]
    if isinstance(element, Joint | Beam | Parallelogram):
        return [element]
    if isinstance(element, Arm) and element.springs:
        rigidity = Rigidity(torsion=element.torsion, bending_y=element.bending, bending_z=element.bending)
        return [Beam(element.name, element.start, element.end, element.up, rigidity)]
    if not element.freedoms and not element.springs:
        return []
    raise InputError(f"{leg.name} has a {type(element).__name__}, which cannot be rebuilt in an independent engine.")


def _extent(leg: Leg) -> float:
    """Return the largest distance of two points of a leg, m; 1 if it has only one."""
    points = [array(p) for element in leg.chain for p in element.path]
    return max((float(np.linalg.norm(p - q)) for p in points for q in points), default=0.0) or 1.0


def joint_of(piece: Joint | Spring) -> Joint:
    """Return the freedom of a joint or of a spring."""
    return piece.joint if isinstance(piece, Spring) else piece


def moves_in(plane: Plane, piece: Piece) -> bool:
    """Return whether a piece moves in the plane: a revolute along its normal, a slide across it, or any link.

    Raises:
        InputError: if it is askew to the plane.
    """
    if not isinstance(piece, Joint | Spring):
        return True
    joint, normal = joint_of(piece), array(plane.frame.rotation.z)
    along = abs(float(array(joint.axis) @ normal))
    if COINCIDENT < along < 1.0 - COINCIDENT:
        raise InputError(
            f'The axis of "{joint.name or piece.name}" must lie in the plane of the planar machine or be '
            "perpendicular to "
            "it; turn it."
        )
    return (along > 0.5) != (joint.point is None)


def _with_struts(name: str, chain: Sequence[Piece], near: float) -> tuple[Piece, ...]:
    """Return the chain with every strut in it as one piece."""
    result: list[Piece] = []
    at = 0
    while at < len(chain):
        strut, after = _strut(name, chain, at, near)
        result.append(strut or chain[at])
        at = after if strut else at + 1
    return tuple(result)


def _strut(name: str, chain: Sequence[Piece], at: int, near: float) -> tuple[StrutPiece | None, int]:
    """Return the strut that begins at a position of the chain, if there is one, and the position after it."""
    first, inside = _ball(chain, at, near)
    if first is None:
        return None, at
    for last in range(inside, len(chain)):
        second, after = _ball(chain, last, near)
        if second is not None and float(np.linalg.norm(array(second - first))) > near:
            row = _in_a_row(chain[inside:last], first, second, near)
            return (None, at) if row is None else (StrutPiece(name, first, second, *row), after)
    return None, at


def _ball(chain: Sequence[Piece], at: int, near: float) -> tuple[Vector | None, int]:
    """Centre of the spherical joint (three revolutes through a point) at a position, and the position after it."""
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


def _in_a_row(parts: Sequence[Piece], start: Vector, end: Vector, near: float) -> tuple[float, float] | None:
    """Stiffness (N/m) and preload (N) of parts in a row; None if they do more than stretch along their line."""
    span = array(end - start)
    along = span / np.linalg.norm(span)
    compliance = shorter = 0.0
    for part in parts:
        if isinstance(part, Spring) and part.joint.point is None and _parallel(array(part.joint.axis), along):
            compliance += 1.0 / float(part.stiffness)
            shorter += float(part.preload) / float(part.stiffness)
        elif isinstance(part, Beam) and _spans(part, (start, end), near):
            compliance += float(np.linalg.norm(span)) / float(part.rigidity.axial)
        elif not (isinstance(part, Spring) and _turns_about(part.joint, (start, end), near)):
            return None
    return (1.0 / compliance, shorter / compliance) if compliance > 0.0 else (RIGID, 0.0)


def _parallel(a: Array, b: Array) -> bool:
    return float(np.linalg.norm(np.cross(a, b))) < COINCIDENT


def _spans(beam: Beam, ends: tuple[Vector, Vector], near: float) -> bool:
    pairs = zip((beam.start, beam.end), ends, strict=True)
    return all(float(np.linalg.norm(array(point - end))) < near for point, end in pairs)


def _turns_about(joint: Joint, centres: Sequence[Vector], near: float) -> bool:
    """Return whether a revolute's axis passes through a spherical joint, so that it carries no load."""
    if joint.point is None or joint.pitch != 0.0:
        return False
    axis, point = array(joint.axis), joint.point
    return any(float(np.linalg.norm(np.cross(array(centre - point), axis))) < near for centre in centres)


def section_axes(beam: Beam) -> tuple[Array, float]:
    """Return the axes of a beam as columns x (along it), y, z [3 x 3] in the base frame, and its length, m."""
    start, end, up = (array(v) for v in (beam.start, beam.end, beam.up))
    length = float(np.linalg.norm(end - start))
    x = (end - start) / length
    z = up - (up @ x) * x
    z = z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z]), length


def end_compliance(beam: Beam) -> Array:
    """Return the compliance of a beam's end against its built-in start, in beam axes, order rx ry rz x y z [6 x 6].

    A load F across deflects the end by F L³/3EI + F L/kGA and turns it by F L²/2EI; a moment M turns it by M L/EI and
    deflects it by M L²/2EI; torsion M L/GJ, tension F L/EA. Source: Przemieniecki 1968, Theory of Matrix Structural
    Analysis, section 5.6.
    """
    length, rigidity = section_axes(beam)[1], beam.rigidity
    c = np.zeros((6, 6))
    c[0, 0], c[3, 3] = length / float(rigidity.torsion), length / float(rigidity.axial)
    planes = ((4, 2, 1.0, rigidity.bending_z, rigidity.shear_y), (5, 1, -1.0, rigidity.bending_y, rigidity.shear_z))
    for across, about, sign, bending, shear in planes:
        soft = 1.0 / float(bending)
        c[across, across] = length**3 / 3.0 * soft + length / float(shear)
        c[about, about] = length * soft
        c[across, about] = c[about, across] = sign * length**2 / 2.0 * soft
    return c


def in_plane(beam: Beam, normal: Vector) -> tuple[bool, ...]:
    """Return which of rx ry rz x y z, in beam axes, move in the plane of a planar machine; all False if it is askew."""
    components = section_axes(beam)[0].T @ array(normal)
    across = [math.isclose(abs(c), 1.0, abs_tol=COINCIDENT) for c in components]
    return (*across, *(not c and any(across) for c in across))


@dataclass(frozen=True)
class Heavy:
    """A rigid mass on a body.

    Attributes:
        mass: kg.
        centre: of it, base frame, m [3].
        inertia: about that centre, base axes, kg·m² [3 x 3].
    """

    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class HeavyLink:
    """A link that has a mass.

    Attributes:
        name: of the link.
        mass: kg.
        leg: number of its leg, from 0.
        bodies: which bodies of the leg carry its ends, or its centre of mass; counted from the base, which is 0.
        points: those ends or that centre, base frame, m.
        inertia: about that centre, base axes, kg·m² [3 x 3]; zero of a uniform rod between its ends.
    """

    name: str
    mass: float
    leg: int
    bodies: tuple[int, ...]
    points: tuple[Array, ...]
    inertia: Array


def on_platform(machine: Machine, place: Displacement) -> Iterator[Heavy]:
    """Give the platform with its tool, and the payload, as far as they have a mass.

    Args:
        machine: with the table [tool].
        place: of the platform at its pose.
    """
    tool = machine.tables["tool"]
    axes = columns(place.rotation)
    centre = place.apply(Vector(*tool.centre_of_mass))
    payload = place.apply(Vector(*tool.offset)) + place.rotation.apply(Vector(*tool.payload_centre))
    parts = (tool.mass, centre, tool.inertia), (tool.payload, payload, tool.payload_inertia)
    for mass, point, entries in parts:
        inertia = axes @ matrix_of(entries) @ axes.T
        if mass or np.any(inertia):
            yield Heavy(float(mass), array(point), inertia)


def links(members: Iterable[Member], configuration: Configuration, struts: bool = True) -> Iterator[HeavyLink]:
    """Give the links that have a mass; without the leg in its name, a link is in the leg that has no actuator.

    Args:
        members: the links, with both ends of each.
        configuration: the legs in which they are.
        struts: whether struts are single pieces of their legs, see `pieces`.

    Raises:
        InputError: if a link has its mass within a part that another program cannot cut.
    """
    for link in members:
        if not link.mass:
            continue
        number, leg = next(
            (i, leg)
            for i, leg in enumerate(configuration.legs)
            if (leg.name == link.leg if link.leg else leg.number is None)
        )
        stations = _stations(link)
        bodies = tuple(bodies_before(leg, station, configuration.plane, struts) for station in stations)
        points = tuple(array(point) for _, point in stations)
        inertia = np.zeros((3, 3)) if link.inertia is None else matrix_of(link.inertia())
        yield HeavyLink(link.name, float(link.mass), number, bodies, points, inertia)


def matrix_of(tensor: Sequence[Scalar]) -> Array:
    """Return an inertia tensor, xx, yy, zz, xy, xz, yz, as a matrix [3 x 3]."""
    xx, yy, zz, xy, xz, yz = (float(entry) for entry in tensor)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def tensor_of(matrix: Array) -> tuple[float, ...]:
    """Return an inertia matrix [3 x 3] as xx, yy, zz, xy, xz, yz."""
    return tuple(float(matrix[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def thin_rod(mass: float, start: Array, end: Array) -> Heavy:
    """Return a straight uniform rod (kg) between two points (m), without inertia about its own axis."""
    span = end - start
    return Heavy(mass, 0.5 * (start + end), mass / 12.0 * ((span @ span) * np.eye(3) - np.outer(span, span)))


def one_body(parts: Sequence[Heavy]) -> Heavy:
    """Return parts of a rigid body as one."""
    mass = sum(part.mass for part in parts)
    centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    arms = [part.centre - centre for part in parts]
    inertia = sum(
        (p.inertia + p.mass * (a @ a * np.eye(3) - np.outer(a, a)) for p, a in zip(parts, arms, strict=True)),
        np.zeros((3, 3)),
    )
    return Heavy(mass, centre, inertia)


def has_rotors(machine: Machine) -> bool:
    """Return whether rotors of actuators have an inertia."""
    return any(values_of_drives(machine, "drives.rotor_inertia"))


def rotor_inertia(machine: Machine, spring: Spring) -> float:
    """Return the inertia of a rotor as its actuator feels it, kg where that slides and kg·m² where it turns.

    A screw turns the rotor once per lead, a gear as often as its ratio says.
    """
    drives = numbers_of_drive(machine, "drives", spring)
    turns = 2.0 * math.pi / drives.lead if spring.joint.point is None else drives.ratio
    return float(drives.rotor_inertia) * turns**2


def _stations(link: Member) -> tuple[tuple[int, Vector], ...]:
    if link.centre is not None:
        return (link.centre(),)
    return () if link.ends is None else link.ends()

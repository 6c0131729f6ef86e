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
from kinetostat.machine.actuators import numbers_of_drive, values_of_drives
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, Spring, Station
from kinetostat.machine.link import Beam, Parallelogram, Rigidity
from kinetostat.machine.machine import Configuration, Machine, Member, Plane
from kinetostat.machine.parts import Arm
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import COINCIDENT

PIECES_OF_BALL = 3
"""Pieces of a spherical joint: revolutes about one point."""


@dataclass(frozen=True)
class StrutPiece:
    """A straight part between two spherical joints: it carries a force along its line; its idle spin is omitted.

    Attributes:
        name: name of the part.
        start, end: centres of the joints, base frame, m.
        stiffness: stiffness between them, N/m; infinity if rigid.
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
        leg: the leg at the pose.
        plane: the plane of a planar machine.
        struts: whether the parts between two spherical joints become a strut.

    Raises:
        InputError: if an element is of a kind that cannot be built in another engine.
    """
    size = _extent(leg)
    chain: list[Piece] = []
    for element in leg.chain:
        chain += _pieces_of(leg, element)
    if plane is None and struts:
        return _with_struts(leg.name, chain, COINCIDENT * size)
    return tuple(piece for piece in chain if plane is None or moves_in(plane, piece))


def bodies_before(leg: Leg, station: Station, plane: Plane | None = None, struts: bool = True) -> int:
    """Return the number of pieces of a leg between the base and the body that carries a station.

    What is on a strut is carried by its neighbours: the body at the end that is nearer.

    Args:
        leg, plane, struts: as for `pieces`.
        station: a point of the leg.

    Raises:
        InputError: if the station is within a part that another program cannot cut.
    """
    elements, point = station
    whole, part = pieces(leg, plane, struts), pieces(replace(leg, chain=leg.chain[:elements]), plane, struts)
    count = next((i for i, (a, b) in enumerate(zip(whole, part, strict=False)) if a != b), len(part))
    if count == len(part):
        return count
    piece = whole[count]
    if not isinstance(piece, StrutPiece):
        raise InputError(f"{leg.name} has a mass within {piece.name}, which cannot be rebuilt in another program.")
    near, far = (float((end - point).norm()) for end in (piece.start, piece.end))
    return count if near < far else count + 1


def _pieces_of(leg: Leg, element: Element) -> list[Piece]:
    """Return an element as pieces: none if it is rigid.

    Raises:
        InputError: if it is of a kind that cannot be built in another engine.
    """
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
            "perpendicular to it; turn it."
        )
    is_normal = along > 0.5  # it is 0 or 1 but for round-off
    return is_normal != (joint.point is None)


def _with_struts(name: str, chain: Sequence[Piece], margin: float) -> tuple[Piece, ...]:
    """Return the chain with every strut in it as one piece; points that are closer than a margin (m) are one."""
    result: list[Piece] = []
    while chain:
        strut, count = _first_strut(name, chain, margin)
        result.append(strut or chain[0])
        chain = chain[count:]
    return tuple(result)


def _first_strut(name: str, chain: Sequence[Piece], margin: float) -> tuple[StrutPiece | None, int]:
    """Return the strut with which a chain begins, if there is one, and the number of its pieces, otherwise 1."""
    start = _first_ball(chain, margin)
    if start is None:
        return None, 1
    for last in range(PIECES_OF_BALL, len(chain)):
        end = _first_ball(chain[last:], margin)
        if end is not None and float(np.linalg.norm(array(end - start))) > margin:
            spring = _spring_in_series(chain[PIECES_OF_BALL:last], start, end, margin)
            if spring is None:
                return None, 1
            stiffness, preload = spring
            return StrutPiece(name, start, end, stiffness, preload), last + PIECES_OF_BALL
    return None, 1


def _first_ball(chain: Sequence[Piece], margin: float) -> Vector | None:
    """Return the centre of the spherical joint, three revolutes through a point, with which a chain begins, if any."""
    first = [piece for piece in chain[:PIECES_OF_BALL] if isinstance(piece, Joint) and piece.pitch == 0.0]
    points = [joint.point for joint in first if joint.point is not None]
    if len(points) < PIECES_OF_BALL or any(_distance(point, points[0]) > margin for point in points):
        return None
    volume = float(np.linalg.det([array(joint.axis) for joint in first]))
    return points[0] if abs(volume) > COINCIDENT else None


def _spring_in_series(parts: Sequence[Piece], start: Vector, end: Vector, margin: float) -> tuple[float, float] | None:
    """Return stiffness (N/m) and preload (N) of parts in a row; None if they do more than stretch along their line."""
    span = array(end - start)
    along = span / np.linalg.norm(span)
    compliance = contraction = 0.0
    for part in parts:
        if isinstance(part, Spring) and part.joint.point is None and _is_parallel(part.joint, along):
            compliance += 1.0 / float(part.stiffness)
            contraction += float(part.preload) / float(part.stiffness)
        elif isinstance(part, Beam) and _distance(part.start, start) < margin and _distance(part.end, end) < margin:
            compliance += float(np.linalg.norm(span)) / float(part.rigidity.axial)
        elif not (isinstance(part, Spring) and _turns_about(part.joint, (start, end), margin)):
            return None
    return (1.0 / compliance, contraction / compliance) if compliance > 0.0 else (RIGID, 0.0)


def _distance(a: Vector, b: Vector) -> float:
    return float(np.linalg.norm(array(a - b)))


def _is_parallel(joint: Joint, direction: Array) -> bool:
    return float(np.linalg.norm(np.cross(array(joint.axis), direction))) < COINCIDENT


def _turns_about(joint: Joint, centres: Sequence[Vector], margin: float) -> bool:
    """Return whether a revolute's axis passes through a spherical joint, so that it carries no load."""
    if joint.point is None or joint.pitch != 0.0:
        return False
    axis, point = array(joint.axis), joint.point
    return any(float(np.linalg.norm(np.cross(array(centre - point), axis))) < margin for centre in centres)


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
    result = np.zeros((6, 6))
    result[0, 0], result[3, 3] = length / float(rigidity.torsion), length / float(rigidity.axial)
    planes = ((4, 2, 1.0, rigidity.bending_z, rigidity.shear_y), (5, 1, -1.0, rigidity.bending_y, rigidity.shear_z))
    for across, about, sign, bending, shear in planes:
        softness = 1.0 / float(bending)
        result[across, across] = length**3 / 3.0 * softness + length / float(shear)
        result[about, about] = length * softness
        result[across, about] = result[about, across] = sign * length**2 / 2.0 * softness
    return result


def in_plane(beam: Beam, normal: Vector) -> tuple[bool, ...]:
    """Return which of rx ry rz x y z, in beam axes, move in the plane of a planar machine; all False if it is askew."""
    components = section_axes(beam)[0].T @ array(normal)
    across = [math.isclose(abs(c), 1.0, abs_tol=COINCIDENT) for c in components]
    return (*across, *(not c and any(across) for c in across))


@dataclass(frozen=True)
class Heavy:
    """A rigid mass on a body.

    Attributes:
        mass: its mass, kg.
        centre: centre of the mass, base frame, m [3].
        inertia: inertia about that centre, base axes, kg·m² [3 x 3].
    """

    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class HeavyLink:
    """A link that has a mass.

    Attributes:
        name: name of the link.
        mass: its mass, kg.
        leg: number of its leg, from 0.
        bodies: numbers of the leg's bodies that carry its ends, or its centre of mass, from the base, which is 0.
        points: those ends or that centre, base frame, m.
        inertia: inertia about that centre, base axes, kg·m² [3 x 3]; zero for a uniform rod between its ends.
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
        machine: the machine with its table [tool].
        place: placement of the platform at its pose.
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


def _stations(link: Member) -> tuple[Station, ...]:
    """Return the centre of mass of a link, or its ends where its mass is spread evenly between them."""
    if link.centre is not None:
        return (link.centre(),)
    return () if link.ends is None else link.ends()

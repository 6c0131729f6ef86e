"""A placed machine as a multibody system in Exudyn: rigid bodies, exact constraints, springs; closed loops of any kind.

Built from points, axes and sections; what holds two bodies is `exudyn_bodies`, what loads do is `exudyn_answer`.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.vector import Vector
from kinetostat.machine.leg import Joint, Leg, Spring
from kinetostat.machine.link import Beam, Parallelogram
from kinetostat.machine.machine import Configuration, Plane
from kinetostat.spec.errors import InputError
from kinetostat.validation.cantilever import end_compliance, in_plane, section_axes
from kinetostat.validation.exudyn_bodies import Body, Multibody
from kinetostat.validation.pieces import Piece, Strut, array, columns, joint_of, pieces

Array = npt.NDArray[np.float64]

ALL = (True,) * 6
PLANAR_JOINT = (True, True, False, False, False, True)
"""What is held of rx ry rz x y z where z is the normal."""


def build(configuration: Configuration, reference: Vector, unit: float = 1.0) -> tuple[Multibody, Body]:
    """The machine and its platform, whose frame is at `reference` (base frame, m); `unit` of force in N.

    Raises:
        InputError: if the machine has a part that cannot be built.
    """
    model = Multibody(unit)
    platform = _body(model, array(reference), configuration.plane)
    for leg in configuration.legs:
        _leg(model, leg, platform, configuration.plane)
    return model, platform


def _body(model: Multibody, at: Array, plane: Plane | None) -> Body:
    """A new body, which moves in the plane only if there is one."""
    body = model.body(at)
    if plane is not None:
        frame = array(plane.frame.translation), columns(plane.frame.rotation)
        model.couple((model.ground, body), frame, PLANAR_JOINT)
    return body


def _leg(model: Multibody, leg: Leg, platform: Body, plane: Plane | None) -> None:
    """The bodies and connectors of one leg from ground to platform."""
    chain = pieces(leg, plane)
    bodies = [model.ground]
    for piece in chain[:-1]:
        bodies.append(_body(model, _far_point(piece, bodies[-1].at), plane))
    bodies.append(platform)
    if not chain:
        model.couple(bodies, (platform.at, np.eye(3)), ALL)
    for piece, near, far in zip(chain, bodies, bodies[1:], strict=False):
        _connect(model, piece, (near, far), plane)


def _far_point(piece: Piece, before: Array) -> Array:
    """A point of the body after a piece (m): a frame near its joints keeps the digits of what they do."""
    if isinstance(piece, Joint | Spring):
        point = joint_of(piece).point
        return before if point is None else array(point)
    return array(piece.far if isinstance(piece, Parallelogram) else piece.end)


def _connect(model: Multibody, piece: Piece, bodies: Sequence[Body], plane: Plane | None) -> None:
    if isinstance(piece, Joint):
        _joint(model, piece, bodies, plane)
    elif isinstance(piece, Spring):
        _joint(model, piece.joint, bodies, plane, float(piece.stiffness))
    elif isinstance(piece, Beam):
        _beam(model, piece, bodies, plane)
    elif isinstance(piece, Strut):
        model.bar(bodies, (array(piece.start), array(piece.end)), piece.stiffness)
    else:
        _parallelogram(model, piece, bodies, plane)


def _joint(
    model: Multibody, joint: Joint, bodies: Sequence[Body], plane: Plane | None, stiffness: float | None = None
) -> None:
    """A joint, all but one of whose components are held, with a spring (N/m, N·m/rad) on that one or none."""
    normal = None if plane is None else array(plane.frame.rotation.z)
    axes = _axes_around(array(joint.axis), normal)
    slide = joint.point is None
    point = bodies[0].at if joint.point is None else array(joint.point)
    free = 5 if slide else 2
    held = [i != free for i in range(6)]
    if plane is not None:
        held = [i in ((0, 4) if slide else (3, 4)) for i in range(6)]
    if joint.pitch != 0.0:
        held[5] = False
        model.thread(bodies, (point, axes[:, 2]), float(joint.pitch))
    matrix = np.zeros((6, 6))
    matrix[free, free] = stiffness or 0.0
    model.couple(bodies, (point, axes), held, None if stiffness is None else matrix)


def _axes_around(axis: Array, normal: Array | None = None) -> Array:
    """Right-handed axes whose third is `axis`; their first is along `normal` where that is across."""
    if normal is None or abs(float(normal @ axis)) > 0.5:
        normal = np.eye(3)[np.argmin(abs(axis))]
    x = normal - (normal @ axis) * axis
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _beam(model: Multibody, beam: Beam, bodies: Sequence[Body], plane: Plane | None) -> None:
    """The cantilever's 6x6 stiffness at the beam's end; components that do not yield are held."""
    compliance = end_compliance(beam)
    moving = ALL if plane is None else in_plane(beam, plane.frame.rotation.z)
    if not any(moving):
        raise InputError(f'The section of "{beam.name}" is askew to the plane of a planar machine.')
    yielding = [i for i in range(6) if moving[i] and compliance[i, i] > 0.0]
    held = [moving[i] and i not in yielding for i in range(6)]
    matrix = np.zeros((6, 6))
    if yielding:
        matrix[np.ix_(yielding, yielding)] = np.linalg.inv(compliance[np.ix_(yielding, yielding)])
    model.couple(bodies, (array(beam.end), section_axes(beam)[0]), held, matrix if yielding else None)


def _parallelogram(model: Multibody, piece: Parallelogram, bodies: Sequence[Body], plane: Plane | None) -> None:
    """Two bars between points of the bodies, which also stay in the parallelogram's plane and parallel to it."""
    normal = np.cross(array(piece.side), array(piece.far) - array(piece.near))
    if plane is None:
        axes = _axes_around(normal / np.linalg.norm(normal))
        model.couple(bodies, (array(piece.far), axes), PLANAR_JOINT)
    for near, far in piece.bars:
        model.bar(bodies, (array(near), array(far)), float(piece.bar))

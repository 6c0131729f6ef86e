"""A leg as a row of URDF joints, from base to platform. The text is `urdf`'s business.

Every frame is parallel to the base frame at the pose, so that axes and compliances are written as they are.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.vector import Vector
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.validation.pieces import array

Array = npt.NDArray[np.float64]

TIP = "_tip"
"""End of the name of the last link of a leg; what stands before it is the leg's."""
OPPOSITE = -1.0
"""How far the second joint of a parallelogram turns while the first one turns by one."""


@dataclass(frozen=True)
class UrdfJoint:
    """A joint as URDF has it, and what it cannot say.

    Attributes:
        name: not yet unique.
        kind: "continuous", "prismatic" or "fixed".
        at: its origin, base frame, m.
        axis: unit vector; None where it does not move.
        extension: attributes of its element <kinetostat>.
        mimics: whether it turns as far as the one before it, the other way.
    """

    name: str
    kind: str
    at: Array
    axis: Array | None = None
    extension: dict[str, str] = field(default_factory=dict)
    mimics: bool = False


def joints_of(leg: Leg) -> Iterator[UrdfJoint]:
    """The joints of a leg at the pose.

    A joint or spring that moves is one; springs that stand for one link or bearing are one that is fixed and has a
    compliance; a parallelogram is two revolutes, of which the second turns back what the first turned.
    """
    at = np.zeros(3)
    for i, element in enumerate(leg.chain):
        places = [at, *(array(p) for after in leg.chain[i + 1 :] for p in _places(after))]
        for joint in _of_element(leg.name, element, at, places[min(1, len(places) - 1)]):
            yield joint
            at = joint.at


def _places(element: Element) -> Sequence[Vector]:
    """Points where an element is."""
    own = element.mover.point if isinstance(element, Joint | Spring) else None
    return element.path or (() if own is None else (own,))


def _of_element(leg: str, element: Element, before: Array, after: Array) -> Iterator[UrdfJoint]:
    if isinstance(element, Parallelogram):
        yield from _parallelogram(element)
    elif isinstance(element, Joint):
        yield _moving(element.name or f"{leg} joint", element, after, {})
    elif isinstance(element, Spring) and (element.actuated or element.hinge):
        role = {"actuated": "true"} if element.actuated else {}
        stiffness = "rigid" if math.isinf(element.stiffness) else repr(float(element.stiffness))
        name = (element.part or element.name).replace("actuator", "drive")  # an actuator is named after its joint again
        yield _moving(name, element.joint, after, {"stiffness": stiffness, **role})
    else:
        yield from _yielding(element.springs, before)


def _moving(name: str, joint: Joint, after: Array, extension: dict[str, str]) -> UrdfJoint:
    """A joint that moves; a slide, which has no place, is put where the next element is."""
    if joint.pitch != 0.0:
        extension = {**extension, "pitch": repr(float(joint.pitch))}
    if joint.point is None:
        return UrdfJoint(name, "prismatic", after, array(joint.axis), extension)
    return UrdfJoint(name, "continuous", array(joint.point), array(joint.axis), extension)


def _yielding(springs: Sequence[Spring], before: Array) -> Iterator[UrdfJoint]:
    """Springs that stand for one part as a fixed joint with a 6x6 compliance; one without stiffness as a free joint."""
    for (part, free), group in groupby(springs, lambda s: (s.part or s.name, s.stiffness == 0.0)):
        held = list(group)
        if free:
            yield from (_moving(spring.name, spring.joint, before, {}) for spring in held)
            continue
        points = [spring.joint.point for spring in held if spring.joint.point is not None]
        at = array(points[0]) if points else before
        matrix = sum((_dyad(spring, at) for spring in held), np.zeros((6, 6)))
        if np.any(matrix):
            numbers = " ".join(repr(c) for c in matrix.ravel().tolist())
            yield UrdfJoint(part, "fixed", at, None, {"compliance": numbers})


def _dyad(spring: Spring, at: Array) -> Array:
    """What a spring adds to the compliance of its part at a point (base frame, m) [6 x 6]."""
    twist = np.array([float(c) for c in spring.joint.twist(Vector(*at.tolist())).components()])
    return np.outer(twist, twist) / float(spring.stiffness)


def _parallelogram(piece: Parallelogram) -> Iterator[UrdfJoint]:
    normal = array(piece.normal)
    bar = "rigid" if math.isinf(piece.bar) else repr(float(piece.bar))
    side = " ".join(repr(c) for c in array(piece.side).tolist())
    extension = {"parallelogram": side, "width": repr(float(piece.width)), "bar_stiffness": bar}
    yield UrdfJoint(f"{piece.name} near", "continuous", array(piece.near), normal)
    yield UrdfJoint(f"{piece.name} far", "continuous", array(piece.far), normal, extension, mimics=True)

"""Legs of bodies, joints and links at the home pose, and where joint coordinates take them: kinematics for engines.

Joints are moved by products of exponentials of their screws at the home pose, and nothing of `machine.written.family`
or `kinematics` is used. Points and axes are in the base frame, placements are matrices [4 x 4].
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Element, Joint, Leg, Spring, Station
from kinetostat.machine.link import Beam, Parallelogram
from kinetostat.machine.machine import Member
from kinetostat.spec.errors import InputError
from kinetostat.validation.pieces import array


@dataclass(frozen=True)
class LegPart:
    """A part of a leg at the home pose.

    Attributes:
        element: with its points and axes; the stiffness of a rod is its E A.
        moves: whether a joint coordinate moves what follows.
        rod: whether it is the rod of a strut, whose stiffness depends on its length.
    """

    element: Element
    moves: bool = False
    rod: bool = False

    def motion(self, amount: float) -> Array:
        """Placement of what follows once the part has moved by an amount (rad, m) from the home pose [4 x 4]."""
        if isinstance(self.element, Parallelogram):
            span, normal = _bars(self.element)
            turned = turn(normal, amount / float(np.linalg.norm(span))) @ span
            return placement(np.eye(3), turned - span)
        joint = joint_in(self.element)
        axis = array(joint.axis)
        if joint.point is None:
            return placement(np.eye(3), amount * axis)
        rotation, point = turn(axis, amount), array(joint.point)
        return placement(rotation, point - rotation @ point + amount * float(joint.pitch) * axis)

    def rate(self, before: Array, amount: float) -> Array:
        """Return the twist of what follows about the origin per unit of its coordinate, rotation first [6].

        Args:
            before: placement of what carries the part.
            amount: its coordinate.
        """
        if isinstance(self.element, Parallelogram):
            span, normal = _bars(self.element)
            length = float(np.linalg.norm(span))
            direction = np.cross(normal, turn(normal, amount / length) @ span) / length
            return np.concatenate([np.zeros(3), before[:3, :3] @ direction])
        joint = joint_in(self.element)
        axis = before[:3, :3] @ array(joint.axis)
        if joint.point is None:
            return np.concatenate([np.zeros(3), axis])
        point = apply(before, array(joint.point))
        return np.concatenate([axis, np.cross(point, axis) + float(joint.pitch) * axis])

    def at_pose(self, before: Array, after: Array) -> Element:
        """Return the part where it is at the pose.

        Args:
            before, after: placements of the bodies that it joins.

        Raises:
            InputError: it is of a kind that engines do not know.
        """
        element = self.element
        if isinstance(element, Joint):
            return _joint_at(element, before)
        if isinstance(element, Spring):
            return replace(element, joint=_joint_at(element.joint, before))
        if isinstance(element, Parallelogram):
            near, far = moved_point(before, element.near), moved_point(after, element.far)
            return replace(element, near=near, far=far, side=turned_direction(before, element.side))
        if isinstance(element, Beam):
            ends = moved_point(before, element.start), moved_point(before, element.end)
            return Beam(element.name, *ends, turned_direction(before, element.up), element.rigidity)
        raise InputError(f"The independent engines have no {type(element).__name__}; validate the machine without one.")


@dataclass(frozen=True)
class LegBody:
    """A link of a leg at the home pose, as far as it moves.

    Attributes:
        name: of it.
        mass: kg.
        ends: of its axis, m.
        parts: how many parts of the leg carry its beginning and its end.
        centre: of its mass, m; None if it is a uniform rod.
        inertia: about that centre, base axes, kg·m² [3 x 3]; None where nothing says it.
    """

    name: str
    mass: float
    ends: tuple[Array, Array]
    parts: tuple[int, int]
    centre: Array | None = None
    inertia: Array | None = None

    def member(self, leg: str, placements: Sequence[Array]) -> Member:
        """Return the link at the pose.

        Args:
            leg: name of its leg.
            placements: of what is before each part of the leg, and of its end.
        """
        before, after = (placements[count] for count in self.parts)
        start, end = moved_point(before, vector(self.ends[0])), moved_point(after, vector(self.ends[1]))
        ends = (self.parts[0], start), (self.parts[1], end)
        at: Station | None = None if self.centre is None else (self.parts[0], moved_point(before, vector(self.centre)))
        tensor = None
        if self.inertia is not None:
            matrix = before[:3, :3] @ self.inertia @ before[:3, :3].T
            tensor = tuple(float(matrix[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        length = float(np.linalg.norm(self.ends[1] - self.ends[0]))
        return Member(
            leg,
            self.name,
            length,
            self.mass,
            ends=lambda: ends,
            centre=None if at is None else lambda: at,
            inertia=None if tensor is None else lambda: tensor,
        )


@dataclass(frozen=True)
class MovingLeg:
    """A leg at the home pose.

    Attributes:
        name: of it.
        parts: from base to platform.
        bodies: its links that move.
    """

    name: str
    parts: tuple[LegPart, ...]
    bodies: tuple[LegBody, ...]

    @property
    def size(self) -> int:
        """Number of its joint coordinates."""
        return sum(part.moves for part in self.parts)

    def placements(self, coordinates: Sequence[float]) -> list[Array]:
        """Return the placements of what is before each part, and of the platform end, at coordinates in rad and m."""
        given = iter(coordinates)
        rows = [np.eye(4)]
        for part in self.parts:
            rows.append(rows[-1] @ part.motion(next(given)) if part.moves else rows[-1])
        return rows

    def rates(self, placements: Sequence[Array], coordinates: Sequence[float]) -> Array:
        """Return the twists of the platform end about the origin per unit of each coordinate [6 x size]."""
        given = iter(coordinates)
        pairs = zip(self.parts, placements, strict=False)
        return np.array([part.rate(before, next(given)) for part, before in pairs if part.moves]).reshape(-1, 6).T

    def at_pose(self, placements: Sequence[Array]) -> Leg:
        """Return the leg at the pose, its rods as long as the pose makes them."""
        pairs = list(zip(self.parts, placements, placements[1:], strict=False))
        chain = [part.at_pose(before, after) for part, before, after in pairs]
        for i, part in enumerate(self.parts):
            if part.rod:
                start, end = self._rod_ends(i, chain)
                stiffness = float(part.element.stiffness) / float(np.linalg.norm(end - start))  # type: ignore[attr-defined]
                chain[i] = replace(chain[i], stiffness=stiffness)  # type: ignore[type-var]
        return Leg(self.name, tuple(chain))

    def _rod_ends(self, at: int, chain: Sequence[Element]) -> tuple[Array, Array]:
        """Centres of the joints before and after a rod; a slide that comes first is written where its rod begins."""
        turning = [
            (i, element)
            for i, (part, element) in enumerate(zip(self.parts, chain, strict=True))
            if part.moves and (isinstance(element, Parallelogram) or joint_in(element).point is not None)
        ]
        before = [element for i, element in turning if i < at]
        after = next(element for i, element in turning if i > at)
        start = _centre(before[-1], far=True) if before else array(joint_in(chain[at]).carriage)
        return start, _centre(after, far=False)


def turn(axis: Array, angle: float) -> Array:
    """Return the rotation about a unit vector by an angle (rad), by Rodrigues' formula [3 x 3]."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def placement(rotation: Array, translation: Array) -> Array:
    """Return a rotation [3 x 3] and a translation (m) in one matrix [4 x 4]."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, translation
    return matrix


def apply(place: Array, point: Array) -> Array:
    """Return a point (m) under a placement."""
    return np.asarray(place[:3, :3] @ point + place[:3, 3])


def moved_point(place: Array, point: Vector) -> Vector:
    """Return a point (m) under a placement, as a vector."""
    return vector(apply(place, array(point)))


def turned_direction(place: Array, direction: Vector) -> Vector:
    """Return a direction under a placement."""
    return vector(place[:3, :3] @ array(direction))


def vector(numbers: Any) -> Vector:
    """Return three numbers as a vector."""
    return Vector(*(float(c) for c in numbers))


def unit(direction: Any) -> Array:
    """Return a direction at unit length."""
    row = np.asarray(direction, dtype=float)
    return np.asarray(row / np.linalg.norm(row))


def joint_in(element: Any) -> Any:
    """Return the freedom of a joint, or of a spring."""
    return element.joint if isinstance(element, Spring) else element


def _joint_at(joint: Joint, place: Array) -> Joint:
    point = None if joint.point is None else moved_point(place, joint.point)
    carriage = None if joint.carriage is None else moved_point(place, joint.carriage)
    return replace(joint, axis=turned_direction(place, joint.axis), point=point, carriage=carriage)


def _bars(bars: Parallelogram) -> tuple[Array, Array]:
    """Return the way along the bars at the home pose, m, and the unit normal about which they swing."""
    span = array(bars.far) - array(bars.near)
    return span, unit(np.cross(array(bars.side), span))


def _centre(element: Any, far: bool) -> Array:
    """Return the centre of a joint that turns, or of the near or far side of a parallelogram, m."""
    if isinstance(element, Parallelogram):
        return array(element.far if far else element.near)
    return array(joint_in(element).point)

"""Legs of bodies, joints and links at the home pose, and where joint coordinates take them: kinematics for engines.

Joints are moved by products of exponentials of their screws at the home pose, and legs are closed on the platform by
Newton's method over these. Nothing of `machine.written.family` or `kinematics` is used. Points and axes are in the base
frame, placements are matrices [4 x 4].
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Element, Joint, Leg, Spring, Station
from kinetostat.machine.link import Beam, Parallelogram
from kinetostat.machine.machine import Member
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import CLOSED
from kinetostat.validation.pieces import array, joint_of, tensor_of

MOST_CLOSING_STEPS = 20
"""Steps of Newton's method from coordinates that should be those of the pose already: a handful are enough, and legs
that have not closed after some more do not reach."""


@dataclass(frozen=True)
class LegPart:
    """A part of a leg at the home pose.

    Attributes:
        element: the element with its points and axes.
        moves: whether a joint coordinate moves what follows.
        axial_rigidity: E A of the rod of a strut, N, whose stiffness follows from its length at a pose; None of others.
    """

    element: Element
    moves: bool = False
    axial_rigidity: float | None = None

    def motion(self, amount: float) -> Array:
        """Return the placement of what follows once the part has moved by an amount (rad, m) from the home pose."""
        if isinstance(self.element, Parallelogram):
            return placement(np.eye(3), _swing(self.element, amount).shift)
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
            amount: coordinate of the part, rad or m.
        """
        rotation = before[:3, :3]
        if isinstance(self.element, Parallelogram):
            return np.concatenate([np.zeros(3), rotation @ _swing(self.element, amount).rate])
        joint = joint_in(self.element)
        axis = rotation @ array(joint.axis)
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
            near, far = point_at(before, element.near), point_at(after, element.far)
            return replace(element, near=near, far=far, side=direction_at(before, element.side))
        if isinstance(element, Beam):
            ends = point_at(before, element.start), point_at(before, element.end)
            return Beam(element.name, *ends, direction_at(before, element.up), element.rigidity)
        raise _unknown_to_engines(element)


@dataclass(frozen=True)
class LegBody:
    """A link of a leg at the home pose, as far as it moves.

    Attributes:
        name: name of the link.
        mass: its mass, kg.
        ends: both ends of its axis, m.
        parts: numbers of parts of the leg that carry its beginning and its end.
        centre: centre of its mass, m; None if it is a uniform rod.
        inertia: inertia about that centre, base axes, kg·m² [3 x 3]; None where nothing says it.
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
            placements: placements of what is before each part of the leg, and of its end.
        """
        first, last = self.parts
        before, after = placements[first], placements[last]
        start, end = (vector(point) for point in self.ends)
        ends = Station(first, point_at(before, start)), Station(last, point_at(after, end))
        centre = None if self.centre is None else Station(first, point_at(before, vector(self.centre)))
        tensor = None
        if self.inertia is not None:
            tensor = tensor_of(before[:3, :3] @ self.inertia @ before[:3, :3].T)
        return Member(  # which takes functions, because families compute these only where they are asked for
            leg=leg,
            name=self.name,
            length=float(np.linalg.norm(self.ends[1] - self.ends[0])),
            mass=self.mass,
            ends=lambda: ends,
            centre=None if centre is None else lambda: centre,
            inertia=None if tensor is None else lambda: tensor,
        )


@dataclass(frozen=True)
class MovingLeg:
    """A leg at the home pose.

    Attributes:
        name: name of the leg.
        parts: its parts from base to platform.
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
        remaining = iter(coordinates)
        placements = [np.eye(4)]
        for part in self.parts:
            placements.append(placements[-1] @ part.motion(next(remaining)) if part.moves else placements[-1])
        return placements

    def rates(self, placements: Sequence[Array], coordinates: Sequence[float]) -> Array:
        """Return the twists of the platform end about the origin per unit of each coordinate [6 x size]."""
        moving = [pair for pair in zip(self.parts, placements, strict=False) if pair[0].moves]
        twists = [part.rate(before, amount) for (part, before), amount in zip(moving, coordinates, strict=True)]
        return np.array(twists).reshape(-1, 6).T

    def closed_placements(self, start: Sequence[float], target: Array, length: float) -> list[Array]:
        """Return the placements along the leg if its platform end is displaced to a target, by Newton's method.

        Args:
            start: coordinates to begin with, rad and m.
            target: displacement of the platform from the home pose [4 x 4].
            length: characteristic length of the machine, m.

        Raises:
            InputError: if the leg does not reach there.
        """
        coordinates = np.array(start, dtype=float)
        for _ in range(MOST_CLOSING_STEPS + 1):  # the placements after the last step are looked at, too
            placements = self.placements(coordinates.tolist())
            gap = _twist(target @ np.linalg.inv(placements[-1]))
            if _motion_size(gap, target, length) <= CLOSED:
                return placements
            rates = self.rates(placements, coordinates.tolist())
            coordinates = coordinates + np.linalg.lstsq(rates, gap, rcond=None)[0]
        missing = 1000.0 * length * _motion_size(gap, target, length)  # of an angle, the arc at that length
        raise InputError(
            f'Leg "{self.name}", as the file describes it, does not reach the platform where kinetostat places it: '
            f"{missing:.3g} mm are missing. Please report this machine."
        )

    def at_pose(self, placements: Sequence[Array]) -> Leg:
        """Return the leg at the pose, its rods as long as the pose makes them."""
        pairs = list(zip(self.parts, placements, placements[1:], strict=False))
        chain = [part.at_pose(before, after) for part, before, after in pairs]
        for number, part in enumerate(self.parts):
            rod = chain[number]
            if part.axial_rigidity is not None and isinstance(rod, Spring):
                start, end = self._rod_ends(number, chain)
                chain[number] = replace(rod, stiffness=part.axial_rigidity / float(np.linalg.norm(end - start)))
        return Leg(self.name, tuple(chain))

    def _rod_ends(self, number: int, chain: Sequence[Element]) -> tuple[Array, Array]:
        """Return the centres of the joints before and after a rod of the leg at the pose, by the rod's number.

        Where a slide comes first, the rod begins at the carriage of the slide.
        """
        turning = [
            (i, element)
            for i, (part, element) in enumerate(zip(self.parts, chain, strict=True))
            if part.moves and (isinstance(element, Parallelogram) or joint_in(element).point is not None)
        ]
        before = [element for i, element in turning if i < number]
        after = next(element for i, element in turning if i > number)
        if before:
            return _far_centre(before[-1]), _near_centre(after)
        carriage = joint_in(chain[number]).carriage
        if carriage is None:
            raise ValueError(f"the rod {number} of {self.name} has neither a joint nor a carriage before it")
        return array(carriage), _near_centre(after)


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


def point_at(place: Array, point: Vector) -> Vector:
    """Return a point (m) under a placement, as a vector."""
    return vector(apply(place, array(point)))


def direction_at(place: Array, direction: Vector) -> Vector:
    """Return a direction under a placement."""
    return vector(place[:3, :3] @ array(direction))


def vector(numbers: Iterable[float]) -> Vector:
    """Return three numbers as a vector."""
    return Vector(*(float(c) for c in numbers))


def unit(direction: npt.ArrayLike) -> Array:
    """Return a direction at unit length."""
    row = np.asarray(direction, dtype=float)
    return np.asarray(row / np.linalg.norm(row))


def joint_in(element: Element) -> Joint:
    """Return the freedom of a joint, or of a spring.

    Raises:
        InputError: the element is neither.
    """
    if isinstance(element, Joint | Spring):
        return joint_of(element)
    raise _unknown_to_engines(element)


def _unknown_to_engines(element: Element) -> InputError:
    return InputError(f"The independent engines have no {type(element).__name__}; validate the machine without one.")


def _joint_at(joint: Joint, place: Array) -> Joint:
    point = None if joint.point is None else point_at(place, joint.point)
    carriage = None if joint.carriage is None else point_at(place, joint.carriage)
    return replace(joint, axis=direction_at(place, joint.axis), point=point, carriage=carriage)


class _Swing(NamedTuple):
    """The shift of the far side of a parallelogram from the home pose, m [3], and its rate per arc [3]."""

    shift: Array
    rate: Array


def _swing(bars: Parallelogram, amount: float) -> _Swing:
    """Swing the bars of a parallelogram by an arc, m."""
    span = array(bars.far) - array(bars.near)
    length, normal = float(np.linalg.norm(span)), unit(np.cross(array(bars.side), span))
    swung_span = turn(normal, amount / length) @ span
    return _Swing(swung_span - span, np.cross(normal, swung_span) / length)


def _near_centre(element: Element) -> Array:
    """Return the centre of a joint that turns, or of the near side of a parallelogram, m."""
    return array(element.near if isinstance(element, Parallelogram) else joint_in(element).pivot)


def _far_centre(element: Element) -> Array:
    """Return the centre of a joint that turns, or of the far side of a parallelogram, m."""
    return array(element.far if isinstance(element, Parallelogram) else joint_in(element).pivot)


def _twist(displacement: Array) -> Array:
    """Return a small displacement as a twist about the origin, rotation first [6]."""
    skew = 0.5 * (displacement[:3, :3] - displacement[:3, :3].T)
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0], *displacement[:3, 3]])


def _motion_size(gap: Array, target: Array, length: float) -> float:
    """Return the size of a gap: the larger of its angle, rad, and of the displacement of P over the length."""
    translation = gap[3:] + np.cross(gap[:3], target[:3, 3])
    return max(float(np.linalg.norm(gap[:3])), float(np.linalg.norm(translation)) / length)

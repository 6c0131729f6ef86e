"""A placed machine as MuJoCo builds one: a tree of bodies with hinges and slides, and what closes its loops.

Built from points, axes and springs (`validation.pieces`); the text is `mjcf`'s business, masses are `mjcf_pace`'s.
All frames are parallel to the base frame, so that every axis is written as it is.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.vector import Vector
from kinetostat.machine.leg import Joint, Leg, Spring
from kinetostat.machine.link import Beam, Parallelogram
from kinetostat.machine.machine import Configuration, Plane
from kinetostat.validation.pieces import Piece, Strut, array, joint_of, moves_in, pieces

Array = npt.NDArray[np.float64]

MOST_FREEDOMS = 6
"""Of one body."""
SAME_POINT = 1e-9
"""Distance of two points, m, below which hinges there share a body."""


@dataclass(frozen=True)
class Freedom:
    """A hinge or a slide between a body and the one before it.

    Attributes:
        name: unique within the model.
        axis: unit vector.
        point: on the axis of a hinge, base frame, m; None for a slide.
        stiffness: N·m/rad or N/m; 0 where it moves freely.
        actuated: whether the spring is an actuator held by its servo.
    """

    name: str
    axis: Array
    point: Array | None
    stiffness: float = 0.0
    actuated: bool = False


@dataclass
class Body:
    """A rigid body.

    Attributes:
        name: unique within the model.
        at: its frame's origin, base frame, m.
        freedoms: between it and its parent, the parent's side first.
        children: bodies that hang on it.
        reach: points to which a drawing connects its origin, base frame, m.
        leg: name of the leg that it belongs to.
    """

    name: str
    at: Array
    freedoms: list[Freedom] = field(default_factory=list)
    children: list["Body"] = field(default_factory=list)
    reach: list[Array] = field(default_factory=list)
    leg: str = ""

    def every(self) -> list["Body"]:
        """Itself and all bodies that hang on it, those nearer to it first."""
        return [self, *(one for child in self.children for one in child.every())]


@dataclass(frozen=True)
class Closing:
    """What closes a loop: a point (a ball joint) or all six components of two bodies held together.

    Attributes:
        ball: whether only the point is held.
        bodies: their names; the second is the platform's side.
        point: base frame, m.
    """

    ball: bool
    bodies: tuple[str, str]
    point: Array


@dataclass(frozen=True)
class Thread:
    """The slide and the hinge of a screw by their names, and its pitch, m/rad."""

    slide: str
    hinge: str
    pitch: float


@dataclass
class Model:
    """A machine in bodies.

    Attributes:
        world: the base.
        platform: free, but for what closes the loops.
        closings, threads: constraints.
    """

    world: Body
    platform: Body
    closings: list[Closing] = field(default_factory=list)
    threads: list[Thread] = field(default_factory=list)
    _names: Counter[str] = field(default_factory=Counter)

    def unique(self, name: str) -> str:
        """The name, with a number behind it if it was given before."""
        self._names[name] += 1
        return name if self._names[name] == 1 else self.unique(f"{name} {self._names[name]}")


def build(configuration: Configuration) -> Model:
    """The machine at its pose, unstressed.

    Raises:
        InputError: if it has a part that another engine cannot be told.
    """
    model = Model(Body("world", np.zeros(3)), Body("platform", array(configuration.platform.translation)))
    for fixed in (model.world, model.platform):
        model.unique(fixed.name)
    for leg in configuration.legs:
        _Chain(model, leg, configuration.plane).close()
    return model


class _Chain:
    """A leg while it is built: the body that was made last is where the next piece begins."""

    def __init__(self, model: Model, leg: Leg, plane: Plane | None) -> None:
        self._model, self._leg, self._plane = model, leg, plane
        self._body = model.world
        self._ball = False
        chain = pieces(leg, plane)
        for i, piece in enumerate(chain):
            self._add(piece, next(filter(None, map(_start, chain[i + 1 :])), None))

    def close(self) -> None:
        """Hold the last body and the platform together."""
        tip = self._body.reach[-1] if self._ball else self._body.at
        self._model.platform.reach.append(tip)
        self._model.closings.append(Closing(self._ball, (self._body.name, self._model.platform.name), tip))

    def _add(self, piece: Piece, after: Vector | None) -> None:
        """A piece; `after` is where the next one begins that has a place."""
        if self._ball:
            self._after_strut()
        if isinstance(piece, Joint | Spring):
            self._joint(piece, self._model.platform.at if after is None else array(after))
        elif isinstance(piece, Beam):
            self._beam(piece)
        elif isinstance(piece, Strut):
            self._strut(piece)
        else:
            self._parallelogram(piece)

    def _grow(self, name: str, at: Array) -> Body:
        """A new body at a point (base frame, m), hanging on the last one."""
        body = Body(self._model.unique(name), at, leg=self._leg.name)
        self._body.reach.append(at)
        self._body.children.append(body)
        self._body = body
        return body

    def _free(self, name: str, joint: Joint, stiffness: float = 0.0, actuated: bool = False) -> None:
        """A freedom of the last body; a screw is a hinge and a slide that a thread couples."""
        axis, point = array(joint.axis), None if joint.point is None else array(joint.point)
        hinge = Freedom(self._model.unique(name), axis, point, stiffness, actuated)
        self._body.freedoms.append(hinge)
        if joint.pitch != 0.0:
            slide = Freedom(self._model.unique(f"{name} advance"), axis, None)
            self._body.freedoms.append(slide)
            self._model.threads.append(Thread(slide.name, hinge.name, float(joint.pitch)))

    def _joint(self, piece: Joint | Spring, after: Array) -> None:
        """A joint or a spring: hinges about one point share a body, all others have one each.

        A slide has no place: it is put where the next piece begins, or half-way to there from the one before.
        """
        joint = joint_of(piece)
        name = piece.name or f"{self._leg.name} joint"
        at = after if joint.point is None else array(joint.point)
        if joint.point is None and self._body is not self._model.world:
            at = (self._body.at + after) / 2.0
        if not self._shares(joint, at):
            self._grow(name, at)
        if isinstance(piece, Spring):
            self._free(name, joint, float(piece.stiffness), piece.actuated)
        else:
            self._free(name, joint)

    def _shares(self, joint: Joint, at: Array) -> bool:
        own = self._body.freedoms
        hinges = bool(own) and all(one.point is not None for one in own) and joint.point is not None
        return hinges and len(own) < MOST_FREEDOMS - 1 and float(np.linalg.norm(self._body.at - at)) < SAME_POINT

    def _beam(self, beam: Beam) -> None:
        """The springs at the middle of a beam; those that do not yield are left out."""
        held = [spring for spring in beam.springs if np.isfinite(float(spring.stiffness))]
        if self._plane is not None:
            held = [spring for spring in held if moves_in(self._plane, spring)]
        if held:
            self._grow(beam.name, array((beam.start + beam.end) * 0.5))
            for spring in held:
                self._free(spring.name, spring.joint, float(spring.stiffness))

    def _strut(self, strut: Strut) -> None:
        """A rod on a ball joint: two hinges across it, as its spin does nothing, and a slide if it yields."""
        start, end = array(strut.start), array(strut.end)
        along = (end - start) / np.linalg.norm(end - start)
        self._grow(strut.name, start)
        for axis in _across(along):
            self._free(f"{strut.name} swing", Joint(Vector(*axis), strut.start))
        if np.isfinite(strut.stiffness):
            self._grow(f"{strut.name} rod", (start + end) * 0.5)
            driven = any(spring.actuated and spring.joint.point is None for spring in self._leg.springs)
            self._free(f"{strut.name} stretch", Joint(Vector(*along)), strut.stiffness, driven)
        self._body.reach.append(end)
        self._ball = True

    def _after_strut(self) -> None:
        """The ball joint at the end of a strut that does not reach the platform: three hinges."""
        end = self._body.reach.pop()
        self._ball = False
        self._grow(f"{self._leg.name} ball", end)
        for axis in np.eye(3):
            self._free(f"{self._leg.name} ball", Joint(Vector(*axis), Vector(*end)))

    def _parallelogram(self, piece: Parallelogram) -> None:
        """Two bars on hinges: the first carries the far side, the second is closed by a ball joint."""
        near_side, normal = self._body, piece.normal
        tips = []
        for bar, (near, far) in enumerate(piece.bars, 1):
            self._body = near_side
            self._grow(f"{piece.name} bar {bar}", array(near))
            self._free(f"{piece.name} swing {bar}", Joint(normal, near))
            if np.isfinite(float(piece.bar)):
                self._grow(f"{piece.name} stretch {bar}", array((near + far) * 0.5))
                self._free(f"{piece.name} stretch {bar}", Joint(piece.along), float(piece.bar))
            tips.append(self._body)
        (_, first), (_, second) = piece.bars
        tips[1].reach.append(array(second))
        self._body = tips[0]
        far_side = self._grow(f"{piece.name} far side", array(first))
        self._free(far_side.name, Joint(normal, first))
        far_side.reach.append(array(second))
        self._model.closings.append(Closing(True, (tips[1].name, far_side.name), array(second)))


def _start(piece: Piece) -> Vector | None:
    """Where a piece begins, if it has a place."""
    if isinstance(piece, Joint | Spring):
        return joint_of(piece).point
    return piece.near if isinstance(piece, Parallelogram) else piece.start


def _across(along: Array) -> Sequence[Array]:
    """Two unit vectors across a unit vector and each other."""
    first = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    first = first / np.linalg.norm(first)
    return first, np.cross(along, first)

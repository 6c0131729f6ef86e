"""A placed machine as a tree of bodies with hinges and slides, and the constraints that close its loops, for MuJoCo.

It is built from points, axes and springs (`validation.pieces`); `mjcf` writes the text, `mjcf_pace` chooses the masses.
All frames are parallel to the base frame, so that every axis is written as it is.
"""

import dataclasses
from collections import Counter
from dataclasses import field

import numpy as np

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, Leg, Spring
from kinetostat.machine.link import Beam, Parallelogram
from kinetostat.machine.machine import Configuration, Plane
from kinetostat.tolerances import COINCIDENT_HINGES
from kinetostat.validation.pieces import Piece, StrutPiece, array, joint_of, moves_in, pieces

MOST_HINGES = 5
"""Most hinges of one body: the engine takes six coordinates of a body, of which one is left for a slide."""


@dataclass(frozen=True)
class Freedom:
    """A hinge or a slide between a body and the one before it.

    Attributes:
        name: unique within the model.
        axis: unit vector.
        point: a point on the axis of a hinge, base frame, m; None for a slide.
        stiffness: N·m/rad or N/m; 0 where it moves freely.
        drive: the spring of the actuator that it is; None of others.
    """

    name: str
    axis: Array
    point: Array | None
    stiffness: float = 0.0
    drive: Spring | None = None

    @property
    def is_hinge(self) -> bool:
        """Whether it turns; otherwise it slides."""
        return self.point is not None


@dataclasses.dataclass
class Body:
    """A rigid body.

    Attributes:
        name: unique within the model.
        origin: origin of its frame, base frame, m.
        freedoms: the freedoms between it and its parent, the nearest to the parent first.
        children: bodies that hang on it.
        reach: points to which a drawing connects its origin, base frame, m.
        leg: name of the leg that it belongs to.
    """

    name: str
    origin: Array
    freedoms: list[Freedom] = field(default_factory=list)
    children: list["Body"] = field(default_factory=list)
    reach: list[Array] = field(default_factory=list)
    leg: str = ""

    def subtree(self) -> list["Body"]:
        """Return the body and all bodies that hang on it, each after the one on which it hangs."""
        return [self, *(body for child in self.children for body in child.subtree())]


@dataclass(frozen=True)
class Closing:
    """A constraint that closes a loop: two bodies share a point (a ball joint), or all six components.

    Attributes:
        ball: whether only the point is constrained.
        bodies: names of both bodies; the second one is nearer to the platform.
        point: the place of the constraint, base frame, m.
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


@dataclasses.dataclass
class Model:
    """A machine in bodies.

    Attributes:
        world: the base.
        platform: the platform, which is free but for the constraints.
        closings, threads: the constraints.
        chains: bodies of each leg from the base to the platform, one between each piece of `pieces` and the next.
        bars: near and far half of a strut, or of both bars of a parallelogram, by the numbers of leg and piece.
    """

    world: Body
    platform: Body
    closings: list[Closing] = field(default_factory=list)
    threads: list[Thread] = field(default_factory=list)
    chains: list[list[Body]] = field(default_factory=list)
    bars: dict[tuple[int, int], list[tuple[Body, Body]]] = field(default_factory=dict)
    _names: Counter[str] = field(default_factory=Counter)

    def unique(self, name: str) -> str:
        """Return the name, with a number after it if it has been used."""
        self._names[name] += 1
        return name if self._names[name] == 1 else self.unique(f"{name} {self._names[name]}")


def build(configuration: Configuration) -> Model:
    """Return the machine at its pose, unstressed.

    Raises:
        InputError: if it has a part that cannot be built in another program.
    """
    model = Model(Body("world", np.zeros(3)), Body("platform", array(configuration.platform.translation)))
    for fixed in (model.world, model.platform):
        model.unique(fixed.name)
    for leg in configuration.legs:
        _Chain(model, leg, configuration.plane).close()
    return model


class _Chain:
    """A leg while it is built.

    The next piece begins at the body that was made last, or with a ball joint where a strut has ended there.
    """

    def __init__(self, model: Model, leg: Leg, plane: Plane | None) -> None:
        self._model, self._leg, self._plane = model, leg, plane
        self._leg_number = len(model.chains)
        self._body = model.world
        self._ends_in_ball = False
        chain = pieces(leg, plane)
        self._bodies = [self._body]  # one more than pieces so far: the last is where the next piece begins
        for i, piece in enumerate(chain):
            self._add(piece, next(filter(None, map(_start, chain[i + 1 :])), None))
            self._bodies.append(self._body)
        model.chains.append(self._bodies)

    def _keep_bars(self, halves: list[tuple[Body, Body]]) -> None:
        """Note the halves of the bars of the piece that is being added."""
        self._model.bars[self._leg_number, len(self._bodies) - 1] = halves

    def close(self) -> None:
        """Join the last body to the platform."""
        tip = self._body.reach[-1] if self._ends_in_ball else self._body.origin
        self._model.platform.reach.append(tip)
        if self._ends_in_ball:
            self._bodies[-1] = self._model.platform
        self._model.closings.append(Closing(self._ends_in_ball, (self._body.name, self._model.platform.name), tip))

    def _add(self, piece: Piece, next_start: Vector | None) -> None:
        """Add a piece before the next one that has a place, which starts there."""
        if self._ends_in_ball:
            self._add_ball()
        if isinstance(piece, Joint | Spring):
            self._add_joint(piece, self._model.platform.origin if next_start is None else array(next_start))
        elif isinstance(piece, Beam):
            self._add_beam(piece)
        elif isinstance(piece, StrutPiece):
            self._add_strut(piece)
        else:
            self._add_parallelogram(piece)

    def _add_body(self, name: str, origin: Array) -> Body:
        """Add a body at a point (base frame, m), hanging on the last one."""
        body = Body(self._model.unique(name), origin, leg=self._leg.name)
        self._body.reach.append(origin)
        self._body.children.append(body)
        self._body = body
        return body

    def _add_freedom(self, name: str, joint: Joint, stiffness: float = 0.0, drive: Spring | None = None) -> None:
        """Give the last body a hinge, or a slide if the joint has no point; a screw has both, coupled by a thread."""
        axis, point = array(joint.axis), None if joint.point is None else array(joint.point)
        freedom = Freedom(self._model.unique(name), axis, point, stiffness, drive)
        self._body.freedoms.append(freedom)
        if joint.pitch != 0.0:
            slide = Freedom(self._model.unique(f"{name} advance"), axis, None)
            self._body.freedoms.append(slide)
            self._model.threads.append(Thread(slide.name, freedom.name, float(joint.pitch)))

    def _add_joint(self, piece: Joint | Spring, next_start: Array) -> None:
        """Add a joint or a spring: hinges about one point share a body, all others have one each.

        A slide has no place: it is put where the next piece begins, or half-way to there from the one before.
        """
        joint = joint_of(piece)
        name = piece.name or f"{self._leg.name} joint"
        if joint.point is not None:
            origin = array(joint.point)
        else:
            origin = next_start if self._body is self._model.world else (self._body.origin + next_start) / 2.0
        if joint.point is None or not self._takes_hinge_at(origin):
            self._add_body(name, origin)
        if isinstance(piece, Spring):
            self._add_freedom(name, joint, float(piece.stiffness), piece if piece.actuated else None)
        else:
            self._add_freedom(name, joint)

    def _takes_hinge_at(self, point: Array) -> bool:
        """Return whether the last body turns about this point alone, and may have one more hinge."""
        freedoms = self._body.freedoms
        return (
            0 < len(freedoms) < MOST_HINGES
            and all(freedom.is_hinge for freedom in freedoms)
            and float(np.linalg.norm(self._body.origin - point)) < COINCIDENT_HINGES
        )

    def _add_beam(self, beam: Beam) -> None:
        """Add the compliant springs at the middle of a beam; rigid ones are omitted."""
        springs = [spring for spring in beam.springs if np.isfinite(float(spring.stiffness))]
        if self._plane is not None:
            springs = [spring for spring in springs if moves_in(self._plane, spring)]
        if springs:
            self._add_body(beam.name, array((beam.start + beam.end) * 0.5))
            for spring in springs:
                self._add_freedom(spring.name, spring.joint, float(spring.stiffness))

    def _add_strut(self, strut: StrutPiece) -> None:
        """Add a rod on a ball joint: two hinges across it, as its spin does nothing, and a slide if it is compliant."""
        start, end = array(strut.start), array(strut.end)
        along = (end - start) / np.linalg.norm(end - start)
        near = self._add_body(strut.name, start)
        for axis in _vectors_across(along):
            self._add_freedom(f"{strut.name} swing", Joint(Vector(*axis), strut.start))
        if np.isfinite(strut.stiffness):
            self._add_body(f"{strut.name} rod", (start + end) * 0.5)
            driven = (spring for spring in self._leg.springs if spring.actuated and spring.joint.point is None)
            self._add_freedom(f"{strut.name} stretch", Joint(Vector(*along)), strut.stiffness, next(driven, None))
        self._body.reach.append(end)
        self._keep_bars([(near, self._body)])
        self._ends_in_ball = True

    def _add_ball(self) -> None:
        """Add the ball joint at the end of a strut that does not reach the platform: three hinges."""
        end = self._body.reach.pop()
        self._ends_in_ball = False
        self._bodies[-1] = self._add_body(f"{self._leg.name} ball", end)
        for axis in np.eye(3):
            self._add_freedom(f"{self._leg.name} ball", Joint(Vector(*axis), Vector(*end)))

    def _add_parallelogram(self, piece: Parallelogram) -> None:
        """Add two bars on hinges: the first carries the far side, the second is closed by a ball joint."""
        near_side, normal = self._body, piece.normal
        tips, halves = [], []
        for bar, (near, far) in enumerate(piece.bars, 1):
            self._body = near_side
            half = self._add_body(f"{piece.name} bar {bar}", array(near))
            self._add_freedom(f"{piece.name} swing {bar}", Joint(normal, near))
            if np.isfinite(float(piece.bar)):
                self._add_body(f"{piece.name} stretch {bar}", array((near + far) * 0.5))
                self._add_freedom(f"{piece.name} stretch {bar}", Joint(piece.along), float(piece.bar))
            tips.append(self._body)
            halves.append((half, self._body))
        self._keep_bars(halves)
        (_, first), (_, second) = piece.bars
        tips[1].reach.append(array(second))
        self._body = tips[0]
        far_side = self._add_body(f"{piece.name} far side", array(first))
        self._add_freedom(far_side.name, Joint(normal, first))
        far_side.reach.append(array(second))
        self._model.closings.append(Closing(True, (tips[1].name, far_side.name), array(second)))


def _start(piece: Piece) -> Vector | None:
    """Return the point where a piece begins; None if it has no place."""
    if isinstance(piece, Joint | Spring):
        return joint_of(piece).point
    return piece.near if isinstance(piece, Parallelogram) else piece.start


def _vectors_across(along: Array) -> tuple[Array, Array]:
    """Return two unit vectors across a unit vector and each other."""
    first = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    first = first / np.linalg.norm(first)
    return first, np.cross(along, first)

"""The plan of a machine written leg by leg, which is all but its numbers: legs, their copies, joints, links, models.

A leg that is written once may have copies, turned about the z axis of the base and mirrored in its x-z plane. Numbers
belong to the leg that is written, so that a change of one changes it in every copy. Points, axes and 6x6 matrices are
in the base frame at the home pose.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.loads import turned_tensor
from kinetostat.machine.machine import Inverse
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.immutable import Immutable
from kinetostat.tolerances import SIMPLE_COSINE
from kinetostat.units import UnitError, parse

NAME = "legs"
"""The name of this family in machine files."""

SUMMARY = "any machine, written leg by leg: joints by point and axis at the home pose, and the links between them"

BASE, PLATFORM = "base", "platform"
"""Names of the two bodies that every leg joins."""

LINK_MODELS = {
    "rigid": "rigid: it does not deflect",
    "lumped": "torsional and linear springs where the link is built in, at its first joint",
    "beam": "Euler-Bernoulli beam between its two joints",
    "timoshenko": "beam that deflects in shear as well",
    "matrix": "a 6x6 compliance of its own, of its end against its beginning, at the end",
}
"""Models of a link, by which it deflects."""

CABLE = "cable"
"""The only word that `type` of a leg may have; a leg without it is a chain of joints and links."""
ONE_SIDED = ("pulls", "pushes")
"""Words of `acts`: a cable pulls its ends together, a prop pushes them apart; neither does the other."""

SPATIAL_POSE = ("x", "y", "z", "roll", "pitch", "yaw")
PLANAR_POSE = ("x", "y", "yaw")
"""Coordinates of the platform: P in the base frame, and Q = Rz(yaw) Ry(pitch) Rx(roll) against the home pose."""

COPY_KEYS = ("copies", "angles", "mirrored")
"""Fields of a leg about its copies."""

MOST_LEGS = 24
"""Legs that a machine may have, with all copies: the work of sharing loads grows with the cube of their number."""

Matrix = tuple[tuple[float, ...], ...]
"""Rows of a 6x6 matrix, which plans compare and hash; empty where there is none."""


@dataclass(frozen=True)
class JointPlan:
    """A joint of a leg.

    Attributes:
        name: unique within the leg.
        kind: a key of `joints.JOINT_TYPES`.
        joins: names of the bodies on its base side and on its platform side.
        actuated: whether a servo holds it.
        sprung: whether it has a stiffness, as an actuator or a flexure hinge.
        compliance: its own compliance, rows rx ry rz x y z at its point, base axes at the home pose, SI; empty
            if it is stiff.
        series: keys of the parts that this stiffness is made of, in a row; empty if it is one number.
        seat: directions in which its bearings have a stiffness: some of `joints.SEAT`.
        motor: the freedom that is actuated, of a joint with several: a key of its type's `motors`; empty otherwise.
        preloaded: whether the file gives a preload of its spring.
        acts: "pulls" or "pushes" if its spring carries loads of one sign only; empty otherwise.
        rod: whether it is a strut whose rod stretches (`struts`).
        cross_section: name of the rod's cross-section; empty if its axial rigidity is given, or if there is no rod.
    """

    name: str
    kind: str
    joins: tuple[str, str]
    actuated: bool
    sprung: bool
    compliance: Matrix
    series: tuple[str, ...] = ()
    seat: tuple[str, ...] = ()
    motor: str = ""
    preloaded: bool = False
    acts: str = ""
    rod: bool = False
    cross_section: str = ""


@dataclass(frozen=True)
class LinkPlan:
    """A link between two consecutive joints of a leg.

    Attributes:
        name: the name of the body.
        model: a key of `LINK_MODELS`.
        cross_section: name of its cross-section, or empty.
        up: direction in which the cross-section's z axis points, base axes at the home pose; None to leave the choice.
        compliance: the compliance of model "matrix", as for a joint, at the link's end.
        weight: the fields that the file gives about its mass: keys of `tables.WEIGHT`.
    """

    name: str
    model: str
    cross_section: str
    up: tuple[float, float, float] | None
    compliance: Matrix
    weight: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Copies(Immutable):
    """Copies of a leg, as a file has them.

    Attributes:
        count: number of legs, all copies together.
        angles: the angles by which they are turned about the z axis of the base, as written; empty for equal steps.
        mirrored: whether every other one is the mirror image of the one before.
    """

    count: int
    angles: tuple[object, ...]
    mirrored: bool


@dataclass(frozen=True)
class CopyPlacement:
    """The way a copy lies: first the mirror image in the x-z plane of the base, if `mirrored`, then the turn about z.

    Attributes:
        cosine, sine: the cosine and sine of the angle of the turn.
        mirrored: whether it is a mirror image.
    """

    cosine: float
    sine: float
    mirrored: bool

    def vector(self, vector: Vector) -> Vector:
        """A point or direction of the written leg in the copy."""
        y = -vector.y if self.mirrored else vector.y
        return Vector(vector.x * self.cosine - y * self.sine, vector.x * self.sine + y * self.cosine, vector.z)

    def matrix(self, matrix: Matrix) -> Matrix:
        """A compliance of the written leg in the copy: rows rx ry rz x y z. A mirror turns rotations the other way."""
        if not matrix:
            return matrix
        columns = [self.vector(Vector(*axis)).components() for axis in np.eye(3).tolist()]
        turn = np.array(columns, dtype=float).T
        screw_turn = np.kron(np.diag([-1.0 if self.mirrored else 1.0, 1.0]), turn)
        return tuple(tuple(row) for row in (screw_turn @ np.array(matrix) @ screw_turn.T).tolist())


@dataclass(frozen=True, eq=False)
class LegPlan(Immutable):
    """A leg as a file writes it, or one of its copies.

    Attributes:
        name: unique within the machine.
        joints: its joints from base to platform.
        links: its links that are flexible or have a mass of their own, by name.
        idle, centred: see `leg.Leg`.
        inverse: closed form of its joint coordinates, if it has one.
        copy_of: name of the leg of the file that it is a copy of; empty if it is not a copy.
        copies: the copies of that leg, as the file has them.
        placement: the way the copy lies; None if it is not a copy.
    """

    name: str
    joints: tuple[JointPlan, ...]
    links: Mapping[str, LinkPlan]
    idle: tuple[int, ...] = ()
    centred: tuple[tuple[int, ...], ...] = ()
    inverse: Inverse | None = None
    copy_of: str = ""
    copies: Copies | None = None
    placement: CopyPlacement | None = None

    def table(self, part: str) -> str:
        """Name of the table with the numbers of one of its joints or links."""
        return f"legs.{self.copy_of or self.name}.{part}"


@dataclass(frozen=True, eq=False)
class Plan(Immutable):
    """A machine written leg by leg.

    Attributes:
        legs: the legs in the order of the file.
        shapes: the shapes of the cross-sections, by name: keys of `cross_section.SHAPES`.
        materials: the materials of the cross-sections, by name: keys of `cross_section.MATERIALS`, or empty where E and
            G are given.
        pose: coordinates that the pose gives; the others follow from the legs.
        planar: whether the platform moves in the x-y plane only.
    """

    legs: tuple[LegPlan, ...]
    shapes: Mapping[str, str]
    materials: Mapping[str, str]
    pose: tuple[str, ...]
    planar: bool

    @property
    def legs_of_file(self) -> tuple[LegPlan, ...]:
        """The legs of the file, each once; its first copy stands for a leg that is copied."""
        first: dict[str, LegPlan] = {}
        for leg in self.legs:
            first.setdefault(leg.copy_of or leg.name, leg)
        return tuple(first.values())

    def __hash__(self) -> int:
        # A dictionary of machines asks often, and names tell most plans apart; equality compares all of them.
        return hash((tuple(leg.name for leg in self.legs), self.pose, self.planar))


def literals(plan: Plan) -> dict[str, dict[str, object]]:
    """Everything but numbers in machine files with this plan, by table, for writing such a file."""
    tables: dict[str, dict[str, object]] = {"": {"space": "planar" if plan.planar else "spatial"}}
    for name, shape in plan.shapes.items():
        material = plan.materials[name]
        tables[f"sections.{name}"] = {"shape": shape, **({"material": material} if material else {})}
    for leg in plan.legs_of_file:
        if leg.copies is not None:
            angles = {"angles": list(leg.copies.angles)} if leg.copies.angles else {}
            tables[f"legs.{leg.copy_of}"] = {"copies": leg.copies.count, **angles, "mirrored": leg.copies.mirrored}
        for joint in leg.joints:
            tables[leg.table(joint.name)] = _joint_literals(joint)
        for link in leg.links.values():
            tables[leg.table(link.name)] = _link_literals(link)
    return tables


def _joint_literals(joint: JointPlan) -> dict[str, object]:
    written: dict[str, object] = {"type": joint.kind, "joins": list(joint.joins)}
    if joint.actuated:
        written["actuated"] = joint.motor or True
    if joint.acts:
        written["acts"] = joint.acts
    if joint.compliance:
        written["compliance"] = [list(row) for row in joint.compliance]
    if joint.cross_section:
        written["section"] = joint.cross_section
    return written


def _link_literals(link: LinkPlan) -> dict[str, object]:
    written: dict[str, object] = {"model": link.model}
    if link.cross_section:
        written["section"] = link.cross_section
    if link.up:
        written["up"] = list(link.up)
    if link.compliance:
        written["compliance"] = [list(row) for row in link.compliance]
    return written


def placements(copies: Copies, where: str) -> list[CopyPlacement]:
    """The placement of each of the copies, the first one first; mirror images follow the copies that they mirror.

    Raises:
        InputError: an entry of angles is not an angle; names the leg.
    """
    steps = copies.count // 2 if copies.mirrored else copies.count
    angles = [_angle(angle, where) for angle in copies.angles] or [2.0 * math.pi * i / steps for i in range(steps)]
    images = (False, True) if copies.mirrored else (False,)
    return [
        CopyPlacement(_without_round_off(math.cos(a)), _without_round_off(math.sin(a)), image)
        for a in angles
        for image in images
    ]


def _angle(angle: object, where: str) -> float:
    try:
        return parse(angle, "angle")
    except UnitError as error:
        raise InputError(f"{where}: an entry of angles is {shorten(angle)}: {error}.") from None


def _without_round_off(number: float) -> float:
    """Return a cosine or sine, exact if it is 0, 1/2 or 1 up to round-off, so that products with it are sparse."""
    simple = round(2.0 * number) / 2.0
    return simple if abs(number - simple) < SIMPLE_COSINE else number


def copies_in(leg: dict[str, Any], where: str) -> Copies | None:
    """Read the fields of a leg about copies, `COPY_KEYS`; None if it has none.

    Raises:
        InputError: no number of copies, or one that does not go with the angles; names the leg.
    """
    count, angles, mirrored = leg.get("copies"), leg.get("angles", []), leg.get("mirrored", False)
    if count is None and angles == [] and mirrored is False:
        return None
    if not isinstance(mirrored, bool):
        raise InputError(f"{where}: mirrored is {shorten(mirrored)}; it must be true or false.")
    if not isinstance(angles, list):
        raise InputError(f'{where}: angles is {shorten(angles)}; give a list, e.g. ["0 deg", "120 deg", "240 deg"].')
    per_angle = 2 if mirrored else 1
    count = count if count is not None else per_angle * max(1, len(angles))
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_LEGS or count % per_angle:
        evenness = ", and even, as mirrored legs come in pairs" if mirrored else ""
        raise InputError(
            f"{where}: copies is {shorten(count)}; it must be the number of legs, {per_angle} to {MOST_LEGS}{evenness}."
        )
    if angles and len(angles) * per_angle != count:
        raise InputError(
            f"{where}: angles has {len(angles)} entries for {count} copies; give {count // per_angle}, or leave it out "
            "for equal steps around the z axis."
        )
    return Copies(count, tuple(angles), mirrored)


def legs_of(leg: LegPlan, copies: Copies | None, where: str) -> tuple[LegPlan, ...]:
    """The legs that a written leg stands for: itself, or its copies, numbered from 1.

    Raises:
        InputError: as `placements` does.
    """
    if copies is None:
        return (leg,)
    return tuple(
        replace(leg, name=f"{leg.name} {i}", copy_of=leg.name, copies=copies, placement=placement)
        for i, placement in enumerate(placements(copies, where), 1)
    )


def joint_numbers(leg: LegPlan, joint: JointPlan, tables: Mapping[str, Any]) -> Any:
    """The numbers of a joint, with points and axes where they are in this leg."""
    data = tables[leg.table(joint.name)]
    if leg.placement is None:
        return data
    return SimpleNamespace(**{name: _number_in_copy(value, leg.placement) for name, value in vars(data).items()})


def matrix_in(leg: LegPlan, matrix: Matrix) -> Matrix:
    """A compliance that is written for a leg, where it is in this leg."""
    return matrix if leg.placement is None else leg.placement.matrix(matrix)


def direction_in(leg: LegPlan, direction: Sequence[float]) -> Vector:
    """A direction that is written for a leg, where it points in this leg."""
    return Vector(*direction) if leg.placement is None else leg.placement.vector(Vector(*direction))


def inertia_in(leg: LegPlan, tensor: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """An inertia tensor that is written for a leg, in the axes of this leg, which may be a mirror image."""
    return tuple(tensor) if leg.placement is None else turned_tensor(leg.placement.vector, tensor)


def _number_in_copy(value: Any, placement: CopyPlacement) -> Any:
    return placement.vector(Vector(*value)).components() if isinstance(value, tuple) else value

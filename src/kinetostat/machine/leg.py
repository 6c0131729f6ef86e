"""Legs at one pose as geometry: a chain of joints, springs and flexible links from base to platform.

A leg turns itself into screws (J_p, J_e, W) at a reference point; how a pose places its joints is the family's
business (`catalogue`), what the screws do to the platform is that of `kinetostatics`.

Source: theory (1) and (2), eqs. 1-4. In the base frame.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple, Protocol

from kinetostat.algebra.scalar import Scalar, cos, is_zero, reciprocal, sin
from kinetostat.algebra.screw import Twist, Wrench, force_along, rotation_about, translation_along
from kinetostat.algebra.vector import IDENTITY, Displacement, Vector, rotation_along
from kinetostat.frozen import dataclass
from kinetostat.machine.leg_screws import LegScrews, TwoCentres, reciprocal_wrenches, two_centres, work_on_free
from kinetostat.tolerances import SAME_CENTRE

RIGID = float("inf")
"""Stiffness of a rigid part: exactly infinite, not merely large."""


class PartName(str):
    """Name of a joint or link, "leg 1 actuator", with its leg and its kind, "actuator", alike in like legs."""

    leg: str
    kind: str

    def __new__(cls, leg: str, kind: str) -> "PartName":
        name = super().__new__(cls, f"{leg} {kind}")
        name.leg, name.kind = leg, kind
        return name

    def __getnewargs__(self) -> tuple[str, str]:  # type: ignore[override]
        return self.leg, self.kind


class Station(NamedTuple):
    """A point of a leg, base frame, m, and how many elements of its chain, from the base, carry it."""

    elements: int
    point: Vector


@dataclass(frozen=True)
class RevolutePlace:
    """The place of a revolute at a pose, base frame.

    Attributes:
        axis, point: the axis of the revolute, a unit vector, and a point of it, m.
        motion: the displacement, from the home pose, of what follows the revolute.
    """

    axis: Vector
    point: Vector
    motion: Displacement


@dataclass(frozen=True)
class Turn:
    """An angle by its cosine and sine: what closed forms find, and all that placing a revolute needs.

    Attributes:
        cosine, sine: cosine and sine of the angle.
        placement: the place of the revolute, if the closed form knows it; otherwise the joints before it give it.
    """

    cosine: Scalar
    sine: Scalar
    placement: RevolutePlace | None = None


@dataclass(frozen=True)
class Joint:
    """One freedom: a revolute about the line through `point` (m) along the unit vector `axis`, or a slide along it.

    Attributes:
        axis: unit vector.
        point: on the axis, m; None for a slide.
        name: name of the joint it belongs to; a Hooke joint is two of these with one name, a spherical joint three.
        pitch: advance of a screw, m/rad; 0 for a revolute.
        carriage: a point that travels with a slide, at which its load is given, base frame, m; None if it has none.
        foot: the point of a slide's rail from which its coordinate counts, base frame, m; None for the base origin. A
            rail that leans turns about it.
    """

    axis: Vector
    point: Vector | None = None
    name: str = ""
    pitch: Scalar = 0.0
    carriage: Vector | None = None
    foot: Vector | None = None

    @property
    def freedoms(self) -> tuple["Joint", ...]:
        """The free motions of a joint: the one that it is."""
        return (self,)

    @property
    def springs(self) -> tuple["Spring", ...]:
        """The springs in a joint: none."""
        return ()

    @property
    def mover(self) -> "Joint":
        """The freedom in which it moves: its own."""
        return self

    @property
    def pivot(self) -> Vector:
        """The point of a revolute, m."""
        if self.point is None:
            raise ValueError("a slide has no point")
        return self.point

    @property
    def path(self) -> tuple[Vector, ...]:
        """Its point, if it has one."""
        return () if self.point is None else (self.point,)

    def twist(self, reference: Vector) -> Twist:
        """Its unit twist at `reference` (base frame, m)."""
        if self.point is None:
            return translation_along(self.axis)
        turning = rotation_about(self.axis, reference - self.point)
        return turning if is_zero(self.pitch) else turning + translation_along(self.axis * self.pitch)

    def displaced(self, motion: Displacement) -> "Joint":
        """The joint after a rigid displacement of the whole machine."""
        point = None if self.point is None else motion.apply(self.point)
        carriage = None if self.carriage is None else motion.apply(self.carriage)
        foot = None if self.foot is None else motion.apply(self.foot)
        return replace(self, axis=motion.rotation.apply(self.axis), point=point, carriage=carriage, foot=foot)

    def motion_by(self, amount: "Scalar | Turn") -> tuple["Joint", Displacement]:
        """The joint once it has moved by `amount` (rad, or m of a slide), and how it displaces what follows it.

        Only a revolute takes a `Turn`.
        """
        if self.point is None:
            travel = self.axis * amount
            carriage = None if self.carriage is None else self.carriage + travel
            return replace(self, carriage=carriage), Displacement(IDENTITY, travel)
        angle = amount if isinstance(amount, Turn) else Turn(cos(amount), sin(amount))
        turn = rotation_along(self.axis, angle.cosine, angle.sine)
        shift = self.point - turn.apply(self.point)
        if not is_zero(self.pitch):
            shift = shift + self.axis * (self.pitch * amount)
        return self, Displacement(turn, shift)


def revolutes(point: Vector, axes: Sequence[Vector], name: str = "") -> tuple[Joint, ...]:
    """Revolutes with a common point: a Hooke joint has two axes, a spherical joint three."""
    return tuple(Joint(axis, point, name) for axis in axes)


@dataclass(frozen=True)
class Spring:
    """An elastic coordinate: an actuator held by its servo, or a virtual joint that stands for a flexible link.

    Attributes:
        name: unique within the machine, e.g. "leg 1 actuator".
        joint: the freedom it resists.
        stiffness: N/m for a slide, N·m/rad for a revolute; 0 (free) and infinity (rigid) are exact.
        part: the joint or link that it stands for, together with others of the same part; its own name if empty.
        actuated: whether it is an actuator.
        hinge: whether it is a flexure hinge: a joint that resists, where others are free.
        preload: its load where it is not deformed, N or N·m, positive where it pulls its ends together; a flexure hinge
            is not deformed at the home pose.
        return_stiffness: stiffness of a flexure hinge, or of the row of springs that it is, against travel from the
            home pose, SI.
        acts: "pulls" or "pushes" if it carries loads of one sign only, as a cable does; otherwise empty.
    """

    name: str
    joint: Joint
    stiffness: Scalar
    part: str = ""
    actuated: bool = False
    hinge: bool = False
    preload: Scalar = 0.0
    return_stiffness: Scalar = 0.0
    acts: str = ""

    @property
    def part_name(self) -> str:
        """The part that it stands for."""
        return self.part or self.name

    @property
    def kind(self) -> str:
        """The name of that part within its leg; its whole name if no leg is known."""
        return self.part_name.kind if isinstance(self.part_name, PartName) else self.part_name

    @property
    def freedoms(self) -> tuple[Joint, ...]:
        """The free motions of a spring: none, because it is held."""
        return ()

    @property
    def springs(self) -> tuple["Spring", ...]:
        """The springs in a spring: the one that it is."""
        return (self,)

    @property
    def mover(self) -> Joint:
        """The freedom in which it moves when driven."""
        return self.joint

    @property
    def path(self) -> tuple[Vector, ...]:
        """The points that a drawing shows: none."""
        return ()

    def displaced(self, motion: Displacement) -> "Spring":
        """The spring after a rigid displacement of the whole machine."""
        return replace(self, joint=self.joint.displaced(motion))

    def motion_by(self, amount: Scalar | Turn) -> tuple["Spring", Displacement]:
        """The spring once its joint has moved by `amount` (rad or m), and how that displaces what follows it."""
        joint, motion = self.joint.motion_by(amount)
        return replace(self, joint=joint), motion


class Element(Protocol):
    """A part of a leg's chain: a joint, a spring, or a flexible link."""

    @property
    def freedoms(self) -> tuple[Joint, ...]:
        """Its free motions."""

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Its elastic coordinates."""

    @property
    def path(self) -> tuple[Vector, ...]:
        """Points that a drawing connects, base frame, m."""

    def displaced(self, motion: Displacement) -> "Element":
        """The element after a rigid displacement of the whole machine."""


@dataclass(frozen=True)
class Line:
    """A line through `point` (m) along the unit vector `direction`: of a force that a leg can carry."""

    point: Vector
    direction: Vector

    def wrench(self, reference: Vector) -> Wrench:
        """The unit force along it, at `reference` (base frame, m)."""
        return force_along(self.direction, self.point - reference)

    def displaced(self, motion: Displacement) -> "Line":
        """The line after a rigid displacement of the whole machine."""
        return Line(motion.apply(self.point), motion.rotation.apply(self.direction))


def rows_about_one_point(centres: Sequence[Sequence[float] | None]) -> tuple[tuple[int, ...], ...]:
    """Return the numbers of joints in a row that turn about one point, two or more: universal and ball joints.

    Args:
        centres: centres of the joints of a leg in order, m; None for a joint that does not turn about a point.
    """
    rows: list[list[int]] = []
    before: Sequence[float] | None = None
    for number, centre in enumerate(centres):
        if centre is None or before is None or math.dist(before, centre) > SAME_CENTRE:
            rows.append([])
        rows[-1].append(number)
        before = centre
    return tuple(tuple(row) for row in rows if len(row) > 1)


@dataclass(frozen=True)
class Leg:
    """A serial chain from base to platform.

    Attributes:
        name: unique within the machine.
        chain: its elements in order.
        lines: lines of force, if the leg is known to carry forces along them and nothing else.
        idle: numbers of the passive freedoms, from the base, that depend on the others: the spin of a strut between
            two spherical joints, for instance. Irrelevant where `lines` are given.
        centred: passive freedoms in a row that turn about one point, counted likewise: universal and ball joints,
            however they are written. Only machines written leg by leg state them.
        number: number of an actuated leg of a family, from 1, in the order of its fields; None for any other leg, and
            in machines written leg by leg.
        short: the text that a drawing writes beside it; its name if empty.
    """

    name: str
    chain: tuple[Element, ...]
    lines: tuple[Line, ...] = ()
    idle: tuple[int, ...] = ()
    centred: tuple[tuple[int, ...], ...] = ()
    number: int | None = None
    short: str = ""

    @property
    def label(self) -> str:
        """Its name in a drawing."""
        return self.short or self.name

    @property
    def passive(self) -> tuple[Joint, ...]:
        """Its passive freedoms from base to platform."""
        return tuple(joint for element in self.chain for joint in element.freedoms)

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Its elastic coordinates from base to platform."""
        return tuple(spring for element in self.chain for spring in element.springs)

    @property
    def actuated(self) -> bool:
        """Whether it has an actuator."""
        return any(spring.actuated for spring in self.springs)

    @property
    def path(self) -> tuple[Vector, ...]:
        """Its joint centres and link ends from base to platform, base frame, m: what a drawing connects."""
        return tuple(station.point for station in self.stations)

    @property
    def stations(self) -> tuple[Station, ...]:
        """The points of its path, and how many elements of the chain carry each."""
        stations: list[Station] = []
        for number, element in enumerate(self.chain):
            # What comes before an element carries its first point, and the element itself the next one.
            stations += [Station(number + place, point) for place, point in enumerate(element.path)]
        pairs = pairwise(stations)
        return (*stations[:1], *(station for before, station in pairs if not station.point.is_at(before.point)))

    def displaced(self, motion: Displacement) -> "Leg":
        """The leg after a rigid displacement of the whole machine."""
        chain = tuple(element.displaced(motion) for element in self.chain)
        return replace(self, chain=chain, lines=tuple(line.displaced(motion) for line in self.lines))

    def screws(self, reference: Vector, length: Scalar, absent: Sequence[Joint] = ()) -> LegScrews:
        """Its screws at a point; the wrenches are the space reciprocal to the passive twists (theory (1)).

        Args:
            reference: base frame, m.
            length: m, scales rows; the result does not depend on it.
            absent: freedoms that a planar machine does not have: the leg carries nothing against them.
        """
        passive = tuple(joint.twist(reference) for joint in (*self.passive, *absent))
        carried = self._carried_wrenches(passive, reference, length, None if absent else self._two_centres())
        elastic = tuple(spring.joint.twist(reference) for spring in self.springs)
        loads = (_loads(s, t, carried.wrenches, carried.lines) for s, t in zip(self.springs, elastic, strict=True))
        return LegScrews(
            passive=passive,
            elastic=elastic,
            compliance=tuple(reciprocal(spring.stiffness) for spring in self.springs),
            wrenches=carried.wrenches,
            loads=tuple(loads),
            load_squares=self._load_squares(elastic, length),
            singularity_margin=carried.singularity_margin,
            wrench_squares=carried.squares,
        )

    def _carried_wrenches(
        self, passive: Sequence[Twist], reference: Vector, length: Scalar, centres: TwoCentres | None
    ) -> "_CarriedWrenches":
        """The wrenches that the leg carries, by the least arithmetic that its form allows.

        Args:
            passive: unit twists of the passive joints, and of the freedoms that a planar machine does not have.
            reference: base frame, m.
            length: m, see `screws`.
            centres: the points about which all passive axes turn, if these are two.
        """
        if centres:
            squares = (centres.square(reference, length),)
            line = Line(centres.point, self._slide_along(centres.along))
            margin = centres.singularity_margin(reference, length)
            return _CarriedWrenches((line.wrench(reference),), (line,), margin, squares)
        if self.lines:  # such a leg cannot lock up
            return _CarriedWrenches(tuple(line.wrench(reference) for line in self.lines), self.lines, 1.0)
        needed = [twist for i, twist in enumerate(passive) if i not in self.idle]
        wrenches, margin = reciprocal_wrenches(needed, length)
        return _CarriedWrenches(wrenches, (), margin)

    def _load_squares(self, elastic: Sequence[Twist], length: Scalar) -> tuple[Scalar, ...]:
        """Square of the greatest load that a unit wrench can exert on each spring, beside which others are round-off.

        It is 1 for a slide, and length² + arm² for a turn, m². All turns have the arm of the first one: only the
        magnitude counts, and traced programs then need one product.
        """
        turning = next((twist for twist in elastic if not twist.is_translation), None)
        square = 1.0 if turning is None else length * length + turning.translational.dot(turning.translational)
        return tuple(1.0 if twist.is_translation else square for twist in elastic)

    def _slide_along(self, direction: Vector) -> Vector:
        """A direction as the axis of a sprung slide along it has it, which may know more: how its link carries it."""
        axes = (spring.joint.axis for spring in self.springs if spring.joint.point is None)
        return next((axis for axis in axes if axis.is_at(direction)), direction)

    def _two_centres(self) -> TwoCentres | None:
        """Its passive axes, if they turn about two points, two about one and three about the other."""
        passive = self.passive
        rows = [[passive[i] for i in row if i not in self.idle] for row in self.centred]
        if not all(rows) or sum(map(len, rows)) != len(passive) - len(self.idle):
            return None
        return two_centres([row[0].pivot for row in rows], [[joint.axis for joint in row] for row in rows])


class _CarriedWrenches(NamedTuple):
    """The wrenches that a leg carries, with the lines that they act along, if these are known.

    The margin and the squares are those of `LegScrews`.
    """

    wrenches: tuple[Wrench, ...]
    lines: tuple[Line, ...]
    singularity_margin: Scalar
    squares: tuple[Scalar, ...] = ()


def _loads(spring: Spring, twist: Twist, wrenches: Sequence[Wrench], lines: Sequence[Line]) -> tuple[Scalar, ...]:
    """Load in a spring per unit of each wrench, by virtual work; exactly 1 in a slide along the line of force."""
    along = [spring.joint.point is None and line.direction.is_at(spring.joint.axis) for line in lines]
    if any(along):
        return tuple(1.0 if same else wrench.work(twist) for same, wrench in zip(along, wrenches, strict=True))
    if is_zero(spring.stiffness):
        return tuple(work_on_free(wrench, twist) for wrench in wrenches)
    return tuple(wrench.work(twist) for wrench in wrenches)


def with_numbers(legs: Iterable[Leg]) -> list[Leg]:
    """Return the actuated legs of a family with their numbers, which drawings write beside them."""
    return [replace(leg, number=i, short=leg.short or str(i)) for i, leg in enumerate(legs, 1)]


def series(stiffness: Scalar, other: Scalar) -> Scalar:
    """Stiffness of two springs in a row: 1 / (1/k + 1/k'); exact for rigid ones."""
    if is_zero(stiffness) or is_zero(other):
        return 0.0
    return reciprocal(reciprocal(stiffness) + reciprocal(other))

"""Anatomy of a leg: its chain of elements read as visible parts, and how thick all parts of a machine are drawn.

Cross-sections and limits of the file decide on the proportions; without them the parts are drawn in proportion to the
machine. Nothing is drawn here.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple, TypeAlias, cast

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.vector import AXES, ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.limits import is_set
from kinetostat.machine.link import Beam, Parallelogram
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parts import Arm
from kinetostat.tolerances import SAME_TO_THE_EYE
from kinetostat.views.scene.solids import unit

JointKind: TypeAlias = Literal["revolute", "universal", "spherical", "helical", "flexure", "motor"]
LinkKind: TypeAlias = Literal["bar", "telescope", "bars", "cable"]
SPRING_PLACE = 0.65
"""Place of a linear spring on the way to the next point, as a share of it: on the rod of a telescope, beyond its
cylinder."""
LEG_RADIUS = 0.0125
"""Radius of a leg as a share of the machine's diagonal, where the file does not say how thick it is: by eye."""


@dataclass(frozen=True)
class JointPart:
    """A visible joint: its kind, centre (base frame, m) and axes (unit vectors)."""

    name: str
    kind: JointKind
    point: Vector
    axes: tuple[Vector, ...]


@dataclass(frozen=True)
class LinkPart:
    """A link between two points, base frame, m.

    Attributes:
        name: the name of the link, where it has one; unique within the leg.
        kind: a bar, two parallel bars, a telescope along which a slide runs, or a cable: a slide that only pulls.
        start, end: the ends of its axis.
        driven: whether it holds an actuated slide.
        up: the direction in which the cross-section's z axis lies, if that matters.
        side: the vector from the middle to either of two bars.
        pinned: whether two bars turn on pins instead of balls.
    """

    name: str
    kind: LinkKind
    start: Vector
    end: Vector
    driven: bool = False
    up: Vector | None = None
    side: Vector | None = None
    pinned: bool = False

    @property
    def span(self) -> Vector:
        """From start to end."""
        return self.end - self.start


@dataclass(frozen=True)
class RailPart:
    """A guide along `axis` with its carriage at `point`; `driven` if an actuator moves it."""

    name: str
    point: Vector
    axis: Vector
    driven: bool


@dataclass(frozen=True)
class SpringPart:
    """A virtual spring: torsional about, or linear along, `axis` at `point`."""

    name: str
    point: Vector
    axis: Vector
    torsional: bool
    stiffness: float


@dataclass(frozen=True)
class Anatomy:
    """The parts of one leg from base to platform.

    Attributes:
        leg: name.
        label: what a drawing writes beside it.
        actuated: whether it has an actuator.
        removed: whether it has actuators, and all of these are without stiffness: it is drawn as not there.
        joints, links, rails, springs: the parts of the leg in order.
        foot, head: the points on the base and on the platform between which it stands, base frame, m.
    """

    leg: str
    label: str
    actuated: bool
    removed: bool
    joints: tuple[JointPart, ...]
    links: tuple[LinkPart, ...]
    rails: tuple[RailPart, ...]
    springs: tuple[SpringPart, ...]
    foot: Vector
    head: Vector

    @property
    def second_point(self) -> Vector:
        """End of its first link."""
        return self.links[0].end if self.links else self.head

    @property
    def last_but_one(self) -> Vector:
        """Beginning of its last link."""
        return self.links[-1].start if self.links else self.foot

    @property
    def on_rail(self) -> bool:
        """Whether it begins with a slide along the base."""
        return any(coincide(rail.point, self.foot) for rail in self.rails)


def anatomy(leg: Leg) -> Anatomy:
    """Read the visible parts of a leg at its pose."""
    reader = _ChainReader(leg)
    for element in leg.chain:
        reader.read(element)
    drives = [spring for spring in leg.springs if spring.actuated]
    return Anatomy(
        leg=leg.name,
        label=leg.label,
        actuated=bool(drives),
        removed=bool(drives) and all(is_zero(spring.stiffness) for spring in drives),
        joints=tuple(joint for joint in reader.joints if not _is_end_of_bars(joint, reader.links)),
        links=tuple(reader.links),
        rails=tuple(reader.finished_rails()),
        springs=tuple(reader.springs),
        foot=reader.foot or ZERO,  # a chain of slides alone has no point
        head=reader.head or ZERO,
    )


class _Slide(NamedTuple):
    """A slide of a chain: its name, its direction (unit vector), and whether an actuator moves it."""

    name: str
    axis: Vector
    driven: bool


class _ChainReader:
    """Reader of a chain from base to platform.

    Attributes:
        joints, links, rails, springs: the parts that have been read.
        foot, head: the first point of the chain, and the one that has been reached, base frame, m.
        slide: the slide that leads on from the head; None if there is none.
        pending_springs: linear springs, whose place is known with the next point.
    """

    def __init__(self, leg: Leg) -> None:
        self.leg = leg
        self.joints: list[JointPart] = []
        self.links: list[LinkPart] = []
        self.rails: list[RailPart] = []
        self.springs: list[SpringPart] = []
        self.foot: Vector | None = None
        self.head: Vector | None = None
        self.slide: _Slide | None = None
        self.pending_springs: list[Spring] = []

    def read(self, element: Element) -> None:
        """Read the next element."""
        match element:
            case Joint(point=None):
                self.slide = _Slide(element.name, element.axis, driven=False)
            case Joint():
                self._go_to(_point(element))
                self._add_axis(element)
            case Spring(actuated=True) if element.joint.point is None:
                self.slide = _Slide(element.name, element.joint.axis, driven=True)
            case Spring():
                self._add_spring(element)
            case Parallelogram():
                half = element.side * (0.5 * element.width)
                pinned = not self.leg.lines
                bars = LinkPart(element.name, "bars", element.near, element.far, side=half, pinned=pinned)
                self._go_along(bars)
            case Arm() | Beam():
                self._go_to(element.start)
                name = self._link_name(element.name)
                self._go_along(LinkPart(name, "bar", element.start, element.end, up=element.up))

    def finished_rails(self) -> list[RailPart]:
        """Return all rails; a slide at the end of the chain runs along the platform."""
        if self.slide is None or self.head is None:
            return self.rails
        return [*self.rails, RailPart(self.slide.name, self.head, self.slide.axis, self.slide.driven)]

    def _go_along(self, link: LinkPart) -> None:
        """Go on to the beginning of a link, and along it to its end."""
        self._go_to(link.start)
        self.links.append(link)
        self.head = link.end

    def _go_to(self, point: Vector) -> None:
        """Go on to a point: what lies between is a link, or a slide, which is a telescope or runs along a rail."""
        start = self.head or point
        slide, is_apart = self.slide, not coincide(start, point)
        telescopes = slide is not None and is_apart and _is_along(slide.axis, point - start)
        if slide is not None and telescopes:
            pulls = any(spring.acts == "pulls" for spring in self.leg.springs)
            kind: LinkKind = "cable" if pulls else "telescope"
            self.links.append(LinkPart(slide.name, kind, start, point, slide.driven))
        elif slide is not None:
            self.rails.append(RailPart(slide.name, start, slide.axis, slide.driven))
        if is_apart and not telescopes:
            self.links.append(LinkPart(self._link_name(""), "bar", start, point))
        place = start * (1.0 - SPRING_PLACE) + point * SPRING_PLACE
        self.springs += [_spring_part(spring, place) for spring in self.pending_springs]
        self.pending_springs, self.slide, self.head = [], None, point
        self.foot = self.foot or point

    def _link_name(self, name: str) -> str:
        return name or f"{self.leg.name} link {len(self.links) + 1}"

    def _add_axis(self, joint: Joint) -> None:
        """Add a joint about one axis, or a further axis to the joint that has this name and place."""
        last = self.joints[-1] if self.joints else None
        if last is not None and last.name == joint.name and coincide(last.point, _point(joint)):
            self.joints[-1] = _kind_of(replace(last, axes=(*last.axes, joint.axis)), self.leg)
        else:
            kind: JointKind = "revolute" if is_zero(joint.pitch) else "helical"
            self.joints.append(JointPart(joint.name, kind, _point(joint), (joint.axis,)))

    def _add_spring(self, spring: Spring) -> None:
        """Add a motor, a flexure, or a virtual joint of a link."""
        if spring.joint.point is None:
            self.pending_springs.append(spring)
            return
        self._go_to(_point(spring.joint))
        if spring.actuated or spring.hinge:
            kind: JointKind = "motor" if spring.actuated else "flexure"
            self.joints.append(JointPart(spring.name, kind, _point(spring.joint), (spring.joint.axis,)))
        else:
            self.springs.append(_spring_part(spring, _point(spring.joint)))


def _point(joint: Joint) -> Vector:
    return joint.point or ZERO


def _kind_of(joint: JointPart, leg: Leg) -> JointPart:
    """Return a joint with one more axis. Of the two spherical joints of a strut the lower is drawn as a Hooke joint."""
    if len(joint.axes) == 2:
        return replace(joint, kind="universal")
    if len(leg.lines) == 1 and coincide(joint.point, _lower_end(leg)):
        strut = leg.lines[0].direction
        across = unit(strut.cross(_axis_far_from(strut)))
        return replace(joint, kind="universal", axes=(across, unit(strut.cross(across))))
    return replace(joint, kind="spherical")


def _lower_end(leg: Leg) -> Vector:
    """Return the place of the first joint of a leg."""
    return next(joint.point for joint in leg.passive if joint.point is not None)


def _axis_far_from(direction: Vector) -> Vector:
    """Return the axis that is most nearly square to a direction; of equals to two decimals, the last."""
    return min(AXES[::-1], key=lambda axis: round(abs(axis.dot(direction)), 2))


def _spring_part(spring: Spring, point: Vector) -> SpringPart:
    return SpringPart(spring.name, point, spring.joint.axis, spring.joint.point is not None, float(spring.stiffness))


def _is_end_of_bars(joint: JointPart, links: Sequence[LinkPart]) -> bool:
    """Return whether a joint is drawn already as the balls of a pair of bars."""
    return any(
        link.kind == "bars"
        and not link.pinned
        and (coincide(joint.point, link.start) or coincide(joint.point, link.end))
        for link in links
    )


def coincide(first: Vector, second: Vector) -> bool:
    """Return whether two points are the same to the eye."""
    return (first - second).norm() < SAME_TO_THE_EYE


def _is_along(axis: Vector, span: Vector) -> bool:
    """Return whether a unit vector lies along a span, in either sense, to the eye."""
    return span.cross(axis).norm() < SAME_TO_THE_EYE * span.norm()


@dataclass(frozen=True)
class Profile:
    """Outer size of a cross-section, m: `width` along y, and the `depth` of a rectangle; None for a round one."""

    width: float
    depth: float | None = None


@dataclass(frozen=True)
class Proportions:
    """Sizes from which all parts are drawn.

    Attributes:
        leg: radius of a leg, m.
        cross_sections: cross-section of each link that has one, by the link's name.
        spans: length of each telescope where the machine was loaded, m, by name: its cylinder does not grow.
        carriages: where each rail's carriage was then, by name, base frame, m: the rail stays.
        diagonal: the diagonal of the machine, m.
    """

    leg: float
    cross_sections: Mapping[str, Profile]
    spans: Mapping[str, float]
    carriages: Mapping[str, Vector]
    diagonal: float


def diagonal_of(configuration: Configuration) -> float:
    """Return the diagonal of the box around P and all joints that the pose places, m.

    A machine whose joints lie in one point has its characteristic length instead.
    """
    points = [point for leg in configuration.legs for point in leg.path] + [configuration.platform.translation]
    placed = [point for point in points if all(math.isfinite(c) for c in point.components())]
    low, high = bounds(placed) if placed else (ZERO, ZERO)
    return math.hypot(*(high - low).components()) or float(configuration.length)


def _leg_radius(machine: Machine, diagonal: float) -> float:
    """Return the radius of the legs, m: half of their diameter in [limits], or a share of the diagonal without it."""
    diameter = machine.tables["limits"].leg_diameter
    return 0.5 * diameter if is_set(diameter) else LEG_RADIUS * diagonal


def cross_sections_of(machine: Machine) -> dict[str, Profile]:
    """Return the cross-sections of a machine written leg by leg, by the name of the link; other machines have none.

    A leg of the file that is copied has one set of numbers, and copies with names of their own: "leg 1", "leg 2", ...
    """
    profiles, literals = {}, machine.family.literals
    for table, entries in literals.items():
        room, _, leg_and_link = table.partition(".")  # such as legs.strut 1.rod
        if room == "legs" and (section := entries.get("section")):
            leg, _, link = leg_and_link.partition(".")
            count = cast("int", literals.get(f"legs.{leg}", {}).get("copies", 0))
            profile = _profile(str(literals[f"sections.{section}"]["shape"]), machine.tables[f"sections.{section}"])
            for name in [f"{leg} {number}" for number in range(1, count + 1)] or [leg]:
                profiles[f"{name} {link}"] = profile
    return profiles


def _profile(shape: str, section: Any) -> Profile:
    """Return the outer size of a cross-section by its shape; any other one is drawn round, with the same area."""
    match shape:
        case "round":
            return Profile(section.diameter)
        case "tube":
            return Profile(section.outer_diameter)
        case "rectangle":
            return Profile(section.width, section.height)
    return Profile(2.0 * math.sqrt(section.area / math.pi))


def bounds(points: Sequence[Vector]) -> tuple[Vector, Vector]:
    """Return the lowest and the highest corner of the box around some points."""
    columns = list(zip(*(p.components() for p in points), strict=True))
    return Vector(*(min(c) for c in columns)), Vector(*(max(c) for c in columns))


def proportions_of(machine: Machine, configuration: Configuration) -> Proportions:
    """Return the sizes to draw a machine with, from its pose when it is loaded; they stay while it moves."""
    legs = [anatomy(leg) for leg in configuration.legs]
    diagonal = diagonal_of(configuration)
    return Proportions(
        leg=_leg_radius(machine, diagonal),
        cross_sections=cross_sections_of(machine),
        spans={link.name: link.span.norm() for leg in legs for link in leg.links},
        carriages={rail.name: rail.point for leg in legs for rail in leg.rails},
        diagonal=diagonal,
    )

"""Links of legs: the straight parts between two passive joints, and the links of a family that have a mass.

Limits of length, angle and clearance are about the straight parts, which are read from the chains of the legs at a
pose. Of its links with a mass, a family says the names, the fields of their cross-sections, the lengths and the places;
`loads` adds up what they weigh. Those of a machine written leg by leg are in its file. How links deflect is in `link`.
Points are in the base frame.
"""

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Element, Joint, Leg, Spring, Station
from kinetostat.machine.link import Parallelogram
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Field, Quantity, made_table
from kinetostat.units import KINDS


@dataclass(frozen=True)
class Rod:
    """The straight part of a leg, between its only two passive joints.

    Attributes:
        leg: name of the leg.
        start, end: centres of the joints on the base side and on the platform side, base frame, m.
        telescopic: whether an actuated slide lies between them.
        on_base, on_platform: whether the first joint stands on the base, the last one on the platform.
    """

    leg: str
    start: Vector
    end: Vector
    telescopic: bool
    on_base: bool
    on_platform: bool

    @cached_property
    def span(self) -> Vector:
        """From its start to its end, m."""
        return self.end - self.start

    @cached_property
    def length(self) -> Scalar:
        """Distance of its two joints, m."""
        return self.span.norm()

    @cached_property
    def inverse_square(self) -> Scalar:
        """1 / length², m⁻²: by 1 / length, which the direction of the leg needs as well."""
        shrink = reciprocal(self.length)
        return shrink * shrink


def rods(legs: Sequence[Leg], planar: bool = False) -> list[Rod]:
    """Return the straight parts of those legs that have one.

    That is a leg with a slide between its two passive joints (U-P-S, R-P-S, R-P-R), and the rod of a crank between two
    joints that both have several axes, or in a plane both have one. Two single axes in space are no rod: they may be
    a Hooke joint that a file describes axis by axis, and its centres then coincide.

    Args:
        legs: the legs at a pose.
        planar: whether the machine moves in a plane.
    """
    return [rod for leg in legs if (rod := _rod(leg, planar)) is not None]


class _TurningJoint(NamedTuple):
    """A passive joint of a leg that turns: its point, m, and the numbers of its elements in the chain."""

    point: Vector
    elements: list[int]

    @property
    def has_one_axis(self) -> bool:
        return len(self.elements) == 1


def _turning_joints(chain: Sequence[Element]) -> list[_TurningJoint]:
    """The passive joints of a chain that turn, from base to platform; axes with one name belong to one joint."""
    joints: dict[str, _TurningJoint] = {}
    for number, element in enumerate(chain):
        for freedom in element.freedoms:
            if freedom.point is not None:
                joints.setdefault(freedom.name, _TurningJoint(freedom.point, [])).elements.append(number)
    return list(joints.values())


def _rod(leg: Leg, planar: bool = False) -> Rod | None:
    joints = _turning_joints(leg.chain)
    if len(joints) != 2 or any(isinstance(element, Parallelogram) for element in leg.chain):
        return None
    first, last = joints
    between = leg.chain[first.elements[-1] + 1 : last.elements[0]]
    one_axis_each = first.has_one_axis, last.has_one_axis
    if not any(_is_slide(element) for element in between) and one_axis_each != (planar, planar):
        return None
    return Rod(
        leg=leg.name,
        start=first.point,
        end=last.point,
        telescopic=any(_is_driven_slide(element) for element in between),
        on_base=not any(_moves(element) for element in leg.chain[: first.elements[0]]),
        on_platform=not any(_moves(element) for element in leg.chain[last.elements[-1] + 1 :]),
    )


def _is_driven_slide(element: Element) -> bool:
    return isinstance(element, Spring) and element.actuated and element.joint.point is None


def _is_slide(element: Element) -> bool:
    return _is_driven_slide(element) or (isinstance(element, Joint) and element.point is None)


def _moves(element: Element) -> bool:
    return isinstance(element, Joint) or (isinstance(element, Spring) and element.actuated)


def driven_slides(chain: Sequence[Element]) -> list[int]:
    """Return the numbers of the elements of a leg's chain that are actuated slides and do not set the leg's length."""
    rod = _rod(Leg("", tuple(chain)))
    if rod is not None and rod.telescopic:
        return []
    return [i for i, element in enumerate(chain) if _is_driven_slide(element)]


Ends = Callable[[], tuple[Station, ...]]
"""Gives the ends of a link's axis; it is called where these are needed."""


class PlacedLink(NamedTuple):
    """A link of a family at a pose.

    Attributes:
        leg: the leg that it belongs to; empty if it is not counted to one.
        name: its name, unique within the machine.
        length: m.
        ends: gives the ends of its axis.
    """

    leg: str
    name: str
    length: Scalar
    ends: Ends


LinksOf = Callable[[Sequence[Leg], Vector, Any], list[PlacedLink]]
"""From the legs at a pose, P (base frame, m) and the table `geometry` to each link."""


@dataclass(frozen=True)
class LinkKind:
    """Links of a family that are alike.

    Attributes:
        name: their field in the tables about links.
        rigidities: fields of [stiffness] in which their cross-section may be written.
        placed_links: gives the links at a pose.
        count: number of entries of those fields; None where one entry is for all links.
    """

    name: str
    rigidities: tuple[str, ...]
    placed_links: LinksOf
    count: int | None = None


LINK_TABLES = {
    "linear_density": ("linear density", "mass per length of the {}; 0: not counted"),
    "bending_rigidity": ("E I", "least E I of the {}, from which the buckling load follows; 0: not known"),
    "expansion": ("thermal expansion", "relative growth of the {} per kelvin; 0: not known"),
    "temperature_rise": ("temperature difference", "rise of the temperature of the {} since the machine was built"),
}
"""Tables with one number for each kind of links, all of which may be left out: kind of quantity, and what it means."""
OF_CROSS_SECTIONS = ("linear_density", "bending_rigidity", "expansion")
"""Tables whose numbers follow from a cross-section with its material."""


def link_tables(kinds: Sequence[LinkKind]) -> dict[str, type]:
    """Make the tables about the links of a family, see `LINK_TABLES`; none without links."""
    tables = {}
    for name, (quantity, meaning) in LINK_TABLES.items() if kinds else ():
        fields = {}
        for kind in kinds:
            field = Quantity(quantity, meaning.format(kind.name.replace("_", " ")), count=kind.count)
            fields[kind.name] = Field(field, 0.0 if kind.count is None else (0.0,) * kind.count)
        tables[name] = made_table(name.title().replace("_", ""), fields)
    return tables


def growth_of(expansion: Scalar, rise: Scalar, links: str) -> Scalar:
    """Compute the share of its length by which a link grows.

    Args:
        expansion: 1/K; 0 where it is not known.
        rise: temperature of the link above that at which it was built, K.
        links: name of the links in the message.

    Raises:
        InputError: a number says that it is warmer, and nothing says how its material grows.
    """
    if is_zero(expansion) and isinstance(rise, float) and rise:
        raise InputError(
            f"The temperature_rise of {links} is given, but nothing says how its material grows: give its expansion, "
            f'e.g. "{KINDS["thermal expansion"].example}", or a cross-section with a material.'
        )
    return expansion * rise


def straight_legs(legs: Sequence[Leg], _tip: Vector, _geometry: Any) -> list[PlacedLink]:
    """Legs from the first to the last of their passive joints, as long as the pose makes them."""
    ends = [(leg, leg.passive[0].point, leg.passive[-1].point) for leg in actuated_legs(legs)]
    return [
        PlacedLink(leg.name, leg.name, (end - start).norm(), partial(_ends_of_leg, leg))
        for leg, start, end in ends
        if start is not None and end is not None
    ]


def _stations(leg: Leg) -> tuple[Station, ...]:
    """The stations of a leg's path, which begins at the first joint also where that is driven."""
    first = leg.chain[0]
    foot = first.joint.point if isinstance(first, Spring) else None
    return leg.stations if foot is None or foot.is_at(leg.stations[0][1]) else (Station(0, foot), *leg.stations)


def _ends_of_leg(leg: Leg) -> tuple[Station, ...]:
    stations = _stations(leg)
    return stations[0], stations[-1]


def _ends_of_piece(leg: Leg, piece: int) -> tuple[Station, ...]:
    """Both ends of a piece of a leg's path, by its number from the base, from 0."""
    return _stations(leg)[piece : piece + 2]


def _ends_of_bar(leg: Leg, piece: int, bar: int) -> tuple[Station, ...]:
    """Both ends of a bar, by its number from 0, of a piece that is a parallelogram."""
    pair = next(element for element in leg.chain if isinstance(element, Parallelogram))
    carried = zip(_ends_of_piece(leg, piece), pair.bars[bar], strict=True)
    return tuple(Station(station.elements, point) for station, point in carried)


def in_each_leg(link: str, field: str, piece: int) -> LinksOf:
    """A link of each actuated leg; a field of [geometry] has their length, or one for each leg.

    Args:
        link: the name of the links.
        field: the field with their length or lengths.
        piece: number of their piece of the leg's path, counted from 0 at the base.
    """

    def placed_links(legs: Sequence[Leg], _tip: Vector, geometry: Any) -> list[PlacedLink]:
        return [
            PlacedLink(leg.name, f"{leg.name} {link}", length, partial(_ends_of_piece, leg, piece))
            for leg, length in _lengths(legs, getattr(geometry, field))
        ]

    return placed_links


def pair_in_each_leg(bar: str, field: str, piece: int) -> LinksOf:
    """Both bars of the parallelogram of each actuated leg; arguments as for `in_each_leg`."""

    def placed_links(legs: Sequence[Leg], _tip: Vector, geometry: Any) -> list[PlacedLink]:
        return [
            PlacedLink(leg.name, f"{leg.name} {bar} {i + 1}", length, partial(_ends_of_bar, leg, piece, i))
            for leg, length in _lengths(legs, getattr(geometry, field))
            for i in range(2)
        ]

    return placed_links


def _lengths(legs: Sequence[Leg], written: Any) -> list[tuple[Leg, Scalar]]:
    """The actuated legs with the length of a link of each: the same for all, or the entry of its number."""
    return [
        (leg, written[leg.number - 1] if isinstance(written, tuple) and leg.number else written)
        for leg in actuated_legs(legs)
    ]


def of_passive_leg(link: str, field: str) -> LinksOf:
    """Links whose lengths are the entries of a field of [geometry]: the path of the leg that has no actuator."""

    def placed_links(legs: Sequence[Leg], _tip: Vector, geometry: Any) -> list[PlacedLink]:
        passive = next(leg for leg in legs if leg.number is None)
        lengths = enumerate(getattr(geometry, field))
        return [PlacedLink("", f"{link} {i + 1}", length, partial(_ends_of_piece, passive, i)) for i, length in lengths]

    return placed_links


def from_origin(name: str) -> LinksOf:
    """One link from the origin of the base frame to P, which is the leg of this name if there is one."""

    def placed_links(legs: Sequence[Leg], tip: Vector, _geometry: Any) -> list[PlacedLink]:
        elements = next((len(leg.chain) for leg in legs if leg.name == name), 0)
        return [PlacedLink(name, name, tip.norm(), lambda: (Station(0, ZERO), Station(elements, tip)))]

    return placed_links


def actuated_legs(legs: Sequence[Leg]) -> list[Leg]:
    """Return the numbered legs that are there: one whose actuator has no stiffness by form has been removed."""
    counted = [leg for leg in legs if leg.number is not None]
    return [leg for leg in counted if not any(s.actuated and is_zero(s.stiffness) for s in leg.springs)]

"""Links of legs: the straight parts between two passive joints, and the links of a family that have a mass.

Limits of length, angle and clearance are about the straight parts, which are read from the chains of the legs at a
pose. Of the links with a mass, a family says the names, the fields for their cross-section, their lengths and places;
`loads` adds up what they weigh. Those of a machine written leg by leg are in its file. Points are in the base frame.
"""

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

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


def _rod(leg: Leg, planar: bool = False) -> Rod | None:
    axes: dict[str, list[tuple[int, Vector]]] = {}  # number and point of each axis, by the name of its joint
    for number, element in enumerate(leg.chain):
        if isinstance(element, Parallelogram):
            return None
        for joint in element.freedoms:
            if joint.point is not None:
                axes.setdefault(joint.name, []).append((number, joint.point))
    if len(axes) != 2:
        return None
    first, last = axes.values()
    between = leg.chain[first[-1][0] + 1 : last[0][0]]
    has_one_axis = len(first) == 1, len(last) == 1
    if not any(_is_slide(element) for element in between) and has_one_axis != (planar, planar):
        return None
    return Rod(
        leg=leg.name,
        start=first[0][1],
        end=last[0][1],
        telescopic=any(_is_driven_slide(element) for element in between),
        on_base=not any(_moves(element) for element in leg.chain[: first[0][0]]),
        on_platform=not any(_moves(element) for element in leg.chain[last[-1][0] + 1 :]),
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
PlacedLink = tuple[str, str, Scalar, Ends]
"""A link: its leg, empty if it belongs to none; its name; its length, m; and its ends."""
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
        (leg.name, leg.name, (end - start).norm(), partial(_stations, leg))
        for leg, start, end in ends
        if start is not None and end is not None
    ]


def _stations(leg: Leg, segment: int | None = None, bar: int | None = None) -> tuple[Station, ...]:
    """Both ends of a piece of a leg's path, or of the whole path, which begins at the first joint if that is driven.

    Args:
        leg: the leg.
        segment: number of the piece from the base, from 0; None for the whole path.
        bar: number of the bar, from 0, if the piece is a parallelogram; otherwise None.
    """
    stations, first = leg.stations, leg.chain[0]
    foot = first.joint.point if isinstance(first, Spring) else None
    if foot is not None and not foot.is_at(stations[0][1]):
        stations = ((0, foot), *stations)
    if segment is None:
        return stations[0], stations[-1]
    piece = stations[segment : segment + 2]
    if bar is None:
        return piece
    pair = next(element for element in leg.chain if isinstance(element, Parallelogram))
    return tuple((number, point) for (number, _), point in zip(piece, pair.bars[bar], strict=True))


def in_each_leg(what: str, field: str, segment: int, bars: int = 1) -> LinksOf:
    """Links of the actuated legs, in pairs where `bars` is 2; a field of [geometry] has their length or lengths.

    Args:
        what: the name of the links.
        field: the field with their length, or with one for each leg.
        segment: number of their piece of the leg's path, counted from 0 at the base.
        bars: number of links side by side.
    """

    def placed_links(legs: Sequence[Leg], _tip: Vector, geometry: Any) -> list[PlacedLink]:
        names = [what] if bars == 1 else [f"{what} {i}" for i in range(1, bars + 1)]
        actuated, written = actuated_legs(legs), getattr(geometry, field)
        lengths = [
            written[leg.number - 1] if isinstance(written, tuple) and leg.number else written for leg in actuated
        ]
        return [
            (leg.name, f"{leg.name} {name}", length, partial(_stations, leg, segment, None if bars == 1 else bar))
            for leg, length in zip(actuated, lengths, strict=True)
            for bar, name in enumerate(names)
        ]

    return placed_links


def of_passive_leg(what: str, field: str) -> LinksOf:
    """Links whose lengths are the entries of a field of [geometry]: the path of the leg that has no actuator."""

    def placed_links(legs: Sequence[Leg], _tip: Vector, geometry: Any) -> list[PlacedLink]:
        passive = next(leg for leg in legs if leg.number is None)
        lengths = enumerate(getattr(geometry, field))
        return [("", f"{what} {i + 1}", length, partial(_stations, passive, i)) for i, length in lengths]

    return placed_links


def from_origin(what: str) -> LinksOf:
    """One link from the origin of the base frame to P."""

    def placed_links(legs: Sequence[Leg], tip: Vector, _geometry: Any) -> list[PlacedLink]:
        elements = next((len(leg.chain) for leg in legs if leg.name == what), 0)
        return [(what, what, tip.norm(), lambda: ((0, ZERO), (elements, tip)))]

    return placed_links


def actuated_legs(legs: Sequence[Leg]) -> list[Leg]:
    """Return the numbered legs that are there: one whose actuator has no stiffness by form has been removed."""
    counted = [leg for leg in legs if leg.number is not None]
    return [leg for leg in counted if not any(s.actuated and is_zero(s.stiffness) for s in leg.springs)]

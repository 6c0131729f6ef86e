"""The straight parts of legs, between two passive joints: what limits of length, angle and clearance are about.

They are read from the chains of the legs at a pose. Points are in the base frame.
"""

from collections.abc import Sequence
from functools import cached_property

from kinetostat.algebra.scalar import Scalar, reciprocal
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram


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

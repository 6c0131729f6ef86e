"""Struts: slides whose rod stretches by EA/L, L being the length that the pose gives it.

A strut is written as an actuated slide with a section or an axial rigidity. Its rod begins at the centre of the joint
before the slide, or where a slide that comes first is written, and ends at the centre of the joint after it. Points are
in the base frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from kinetostat.algebra.scalar import Scalar, reciprocal
from kinetostat.algebra.vector import Displacement, Vector
from kinetostat.frozen import dataclass
from kinetostat.machine.cross_section import rigidity_of
from kinetostat.machine.leg import Element, Joint, PartName, Spring
from kinetostat.machine.machine import Step
from kinetostat.machine.written.plan import JointPlan, Plan
from kinetostat.spec.errors import InputError

AXIAL = "axial_rigidity"
"""The field that gives E A of the rod; `section` names a cross-section instead."""
JOINTS_WITHOUT_CENTRE = ("prismatic", "fixed")
"""Types of joints at whose point no rod ends: it travels, or nothing turns there."""


@dataclass(frozen=True)
class StrutRod:
    """The rod of a strut in a chain at the home pose; in a placed chain a spring stands for it.

    Attributes:
        part: the name of the rod.
        actuator: the actuator in whose slide it stretches, and whose load it carries.
        start: the beginning of the rod if no joint with a centre comes before it, base frame, m.
        axial: E A, N.
    """

    part: PartName
    actuator: Spring
    start: Vector
    axial: Scalar

    @property
    def freedoms(self) -> tuple[Joint, ...]:
        """A rod has no freedom."""
        return ()

    @property
    def springs(self) -> tuple[Spring, ...]:
        """There is no spring until a pose gives the length of the rod; see `spring`."""
        return ()

    @property
    def path(self) -> tuple[Vector, ...]:
        """A rod adds no point to a drawing: it lies between those of joints."""
        return ()

    def displaced(self, motion: Displacement) -> "StrutRod":
        """The rod after a rigid displacement of what carries it; what comes first in a leg begins on the base."""
        return replace(self, actuator=self.actuator.displaced(motion))

    def spring(self, start: Vector, end: Vector) -> Spring:
        """The rod between two points, base frame, m."""
        stiffness = self.axial * reciprocal((end - start).norm())
        return replace(self.actuator, name=self.part, part=self.part, stiffness=stiffness, actuated=False, hinge=False)


def rod_of(name: str, slide: JointPlan, actuator: Spring, data: Any, plan: Plan, tables: Mapping[str, Any]) -> StrutRod:
    """The rod of a strut.

    Args:
        name: the name of the leg.
        slide: the actuated slide of the strut.
        actuator: the actuator of the strut.
        data: the numbers of the slide.
        plan, tables: the plan and the tables of the machine, for the cross-section.
    """
    section = slide.cross_section
    shape, sizes = (plan.shapes[section], tables[f"sections.{section}"]) if section else ("", None)
    axial = rigidity_of(shape, sizes, shear=False).axial if section else data.axial_rigidity
    return StrutRod(PartName(name, f"{slide.name} rod"), actuator, Vector(*data.point), axial)


def with_rods(steps: Sequence[Step], placed: Sequence[Element | StrutRod]) -> tuple[Element, ...]:
    """A placed chain with springs in the place of its rods.

    Args:
        steps: the steps of the leg at the home pose.
        placed: the same elements at a pose, base frame.
    """
    centres = [
        (number, centre)
        for number, (step, element) in enumerate(zip(steps, placed, strict=True))
        if step.moves
        for centre in (element.joint if isinstance(element, Spring) else element).path
    ]
    elements: list[Element] = []
    for number, element in enumerate(placed):
        if isinstance(element, StrutRod):
            before = [centre for place, centre in centres if place < number]
            after = [centre for place, centre in centres if place > number]  # `check_strut` has made sure of one
            elements.append(element.spring(before[-1] if before else element.start, after[0]))
        else:
            elements.append(element)
    return tuple(elements)


def check_strut(joints: Sequence[JointPlan], place: int, where: str) -> None:
    """Refuse a rod on a joint that is not an actuated slide, and one without joints at which it begins and ends.

    Args:
        joints: the joints of the leg, in order.
        place: the number of the joint with the rod among them, from 0.
        where: names the joint in messages.

    Raises:
        InputError: says what to write instead.
    """
    joint = joints[place]
    field = "section" if joint.cross_section else AXIAL
    if joint.kind != "prismatic" or not joint.actuated:
        reason = "not actuated" if joint.kind == "prismatic" else joint.kind
        raise InputError(
            f"{where} is {reason} and has {field}; only an actuated prismatic joint is a strut whose rod stretches. "
            f"Leave {field} out, or give the section to a link of the leg."
        )
    moving_before = [other.kind for other in joints[:place] if other.kind != "fixed"]
    if moving_before and all(kind == "prismatic" for kind in moving_before):
        raise InputError(
            f"{where} has {field}, but only slides come before it, so that nothing says where its rod begins; leave "
            f"{field} out and write the rod's stiffness into stiffness."
        )
    if all(other.kind in JOINTS_WITHOUT_CENTRE for other in joints[place + 1 :]):
        raise InputError(
            f"{where} has {field}, but no joint that turns comes after it, so that nothing says where its rod ends; "
            f"leave {field} out and write the rod's stiffness into stiffness."
        )

"""A machine written leg by leg as a family: its chains at the home pose, and where joint coordinates take them.

Which coordinates close the chains at a pose is found in `kinematics.closure`. Points and axes are in the base frame.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial, reduce
from typing import Any, NamedTuple, cast

from kinetostat.algebra.scalar import Scalar, is_zero, sqrt, total, where
from kinetostat.algebra.vector import IDENTITY, ZERO, Displacement, Vector
from kinetostat.machine.cross_section import least_bending_of, linear_density_of, rigidity_of
from kinetostat.machine.leg import Element, Joint, Leg, PartName, Spring, Station, Turn, series
from kinetostat.machine.link import Beam, any_up, lumped_springs, matrix_springs, seat_springs
from kinetostat.machine.links import growth_of
from kinetostat.machine.loads import turned_tensor
from kinetostat.machine.machine import Chains, Configuration, Family, Machine, Member, Plane, Step
from kinetostat.machine.parameters import KEPT_FAMILIES
from kinetostat.machine.series import springs_in_a_row
from kinetostat.machine.written.ball_leg import BallLeg
from kinetostat.machine.written.joints import JOINT_TYPES, departure, own_axis
from kinetostat.machine.written.plan import (
    NAME,
    SUMMARY,
    JointPlan,
    LegPlan,
    LinkPlan,
    Plan,
    direction_in,
    inertia_in,
    joint_numbers,
    literals,
    matrix_in,
)
from kinetostat.machine.written.struts import rod_of, with_rods
from kinetostat.machine.written.tables import tables_of
from kinetostat.tolerances import LEAST_LENGTH, ONE_PLACE

LEGS = "legs."
"""Beginning of the leaf paths of all numbers of legs."""


@lru_cache(KEPT_FAMILIES)
def family_of(plan: Plan) -> Family:
    """The family of all machines with this plan."""
    return Family(
        name=NAME,
        summary=SUMMARY,
        tables=tables_of(plan),
        configure=partial(configure, plan),
        planar=plan.planar,
        chains=partial(chains, plan),
        literals=literals(plan),
        members=partial(members, plan),
        recipe=(family_of, (plan,)),
    )


def at_home(machine: Machine, varying: Iterable[str]) -> Machine:
    """The machine with closed forms that know its home pose: for programs in which no number of a leg varies.

    Axes at right angles and slides along their legs then cost no arithmetic.

    Args:
        machine: a machine of any family.
        varying: leaf paths of the parameters that vary.
    """
    if machine.family.chains is None or any(path.startswith(LEGS) for path in varying):
        return machine
    return replace(machine, family=_family_at_home(machine.family, machine.chains()))


def _family_at_home(family: Family, home: Chains) -> Family:
    if family.recipe is None:
        return family
    maker, arguments = family.recipe
    if maker is not family_of:  # a family that another function makes of one
        return maker(*(_family_at_home(each, home) if isinstance(each, Family) else each for each in arguments))
    (plan,) = arguments
    legs = tuple(
        replace(leg, inverse=leg.inverse.at_home(steps)) if isinstance(leg.inverse, BallLeg) else leg
        for leg, steps in zip(plan.legs, home.legs, strict=True)
    )
    return family_of(replace(plan, legs=legs))


def configure(plan: Plan, joints: Sequence[Scalar | Turn], **tables: Any) -> Configuration:
    """The machine with its joints at given coordinates; the platform is where the first leg takes it.

    Args:
        plan: the plan of the machine.
        joints: coordinates of all joints leg by leg, from the home pose: m, and rad or turns.
        tables: the numbers of the machine, SI, by keyword.
    """
    home = chains(plan, **tables)
    coordinates = iter(joints)
    placed = [placed_chain(steps, coordinates) for steps in home.legs]
    legs = tuple(
        Leg(leg.name, with_rods(steps, elements), idle=leg.idle, centred=leg.centred)
        for leg, steps, (elements, _) in zip(plan.legs, home.legs, placed, strict=True)
    )
    return Configuration(placed[0][1] @ home.home, legs, (), home.length, Plane() if plan.planar else None)


def chains(plan: Plan, **tables: Any) -> Chains:
    """All legs at the home pose."""
    parts = [_parts_at_home(plan, leg, tables) for leg in plan.legs]
    legs = tuple(tuple(step for part in row for step in (*part.joint, *part.link)) for row in parts)
    home = Displacement(IDENTITY, Vector(*tables["platform"].point))
    return Chains(
        legs=legs,
        home=home,
        pose={name: getattr(tables["pose"], name) for name in plan.pose},
        length=_length(plan, tables),
        inverses=tuple(leg.inverse for leg in plan.legs),
    )


def placed_chain(steps: Sequence[Step], coordinates: Iterator[Scalar | Turn]) -> tuple[list[Element], Displacement]:
    """A chain at given coordinates, and the displacement of its platform end from the home pose.

    Revolutes are turned in their axes at the home pose, which are often those of the base, so that traced products are
    sparse; and revolutes about one point, as those of a ball, share its place.
    """
    motion = Displacement(IDENTITY, ZERO)
    chain: list[Element] = []
    home, centre = ZERO, ZERO
    for step in steps:
        placed = step.element.displaced(motion)
        if step.moves:
            amount, mover = next(coordinates), step.element.mover
            revolute = amount.placement if isinstance(amount, Turn) else None
            if revolute is not None:
                placed, motion = _with_line(placed, revolute.point, revolute.axis), revolute.motion
                chain.append(placed)
                continue
            placed, moved = placed.motion_by(amount)
            if mover.point is None:  # a slide or a parallelogram, which turns nothing
                motion, home = Displacement(motion.rotation, motion.translation + moved.translation), ZERO
            elif not is_zero(mover.pitch):  # a screw
                motion, home = moved @ motion, ZERO
            else:
                if mover.point is home:  # about the point of the revolute before it
                    placed = _with_line(placed, centre)
                home, centre = mover.point, placed.mover.point
                turn = motion.rotation @ step.element.motion_by(amount)[1].rotation
                motion = Displacement(turn, centre - turn.apply(home))
        chain.append(placed)
    return chain, motion


def _with_line(element: Joint | Spring, point: Vector, axis: Vector | None = None) -> Joint | Spring:
    """A revolute, or a spring on one, with a point and an axis that are known otherwise; its own axis if None."""
    if isinstance(element, Spring):
        return replace(element, joint=replace(element.joint, point=point, axis=axis or element.joint.axis))
    return replace(element, point=point, axis=axis or element.axis)


class _JointAndLink(NamedTuple):
    """The elements of a joint, in order from the base, and those of the flexible link behind it."""

    joint: list[Step]
    link: list[Step]


def _parts_at_home(plan: Plan, leg: LegPlan, tables: Mapping[str, Any]) -> list[_JointAndLink]:
    """The elements of a leg at the home pose, joint by joint, from base to platform."""
    data = [joint_numbers(leg, joint, tables) for joint in leg.joints]
    parts: list[_JointAndLink] = []
    for i, joint in enumerate(leg.joints):
        seat = [Step(spring, False) for spring in _seat(leg, joint, data[i])]
        moving = _moving(leg, joint, data[i], plan, tables)
        # A matrix is that of the seat: a rail's foot stays where it is, however far its carriage has gone.
        travels = JOINT_TYPES[joint.kind].bearings_travel and not joint.compliance
        steps = [*moving, *seat] if travels else [*seat, *moving]
        link, flexible = leg.links.get(joint.joins[1]), []
        if link is not None:
            ends = departure(data[i]), Vector(*data[i + 1].point)
            flexible = [Step(element, False) for element in _link_elements(leg, link, ends, plan, tables)]
        parts.append(_JointAndLink(steps, flexible))
    return parts


def _seat(leg: LegPlan, joint: JointPlan, data: Any) -> Sequence[Spring]:
    """The springs of a joint's bearings: of a matrix, or of its stiffness in its own axes."""
    name, point = PartName(leg.name, f"{joint.name} bearing compliance"), Vector(*data.point)
    if joint.compliance:
        return matrix_springs(name, matrix_in(leg, joint.compliance), point)
    if joint.seat:
        stiffness = {way: getattr(data, f"stiffness_{way}") for way in joint.seat}
        return seat_springs(name, own_axis(data), point, stiffness)
    return ()


def _moving(leg: LegPlan, joint: JointPlan, data: Any, plan: Plan, tables: Mapping[str, Any]) -> list[Step]:
    """The movable elements of a joint, in order; of springs in a row the first one moves, and a rod comes last."""
    title = PartName(leg.name, joint.name)
    kind = JOINT_TYPES[joint.kind]
    motor = kind.motors.get(joint.motor)
    elements = list(((motor and motor.elements) or kind.elements)(title, data))
    steps = [Step(element, True) for element in elements]
    if not joint.sprung:
        return steps
    driven = motor.place if motor else 0
    freedom = cast(Joint, elements[driven])  # only a joint can be sprung: a parallelogram has no motor
    name = f"{title} actuator" if joint.actuated else f"{title} hinge"
    stiffness = 0.0 if joint.series else data.stiffness
    spring = Spring(
        name,
        freedom,
        stiffness,
        part=title,
        actuated=joint.actuated,
        hinge=not joint.actuated,
        preload=data.preload if joint.preloaded else 0.0,
        acts=joint.acts,
    )
    row = [spring]
    if joint.series:
        parts = tables[f"{leg.table(joint.name)}.stiffness"]
        row = [*springs_in_a_row(spring, [(key, getattr(parts, key)) for key in joint.series], joint.name)]
    if not joint.actuated:
        whole = reduce(series, [each.stiffness for each in row])
        row = [replace(each, return_stiffness=whole) for each in row]
    rods = [rod_of(leg.name, joint, row[0], data, plan, tables)] if joint.rod else []
    sprung = [Step(part, i == 0) for i, part in enumerate([*row, *rods])]
    return [*steps[:driven], *sprung, *steps[driven + 1 :]]


def _link_elements(
    leg: LegPlan, link: LinkPlan, ends: tuple[Vector, Vector], plan: Plan, tables: Mapping[str, Any]
) -> Sequence[Element]:
    """Return the elements that stand for a flexible link."""
    title = PartName(leg.name, link.name)
    if link.model == "rigid":
        return ()
    if link.model == "matrix":
        return matrix_springs(title, matrix_in(leg, link.compliance), ends[1])
    up = direction_in(leg, link.up) if link.up else any_up(ends[1] - ends[0])
    shape, data = plan.shapes[link.cross_section], tables[f"sections.{link.cross_section}"]
    rigidity = rigidity_of(shape, data, link.model == "timoshenko")
    if link.model == "lumped":
        return lumped_springs(title, *ends, up, rigidity)
    return (Beam(title, *ends, up, rigidity),)


def members(plan: Plan, joints: Sequence[Scalar | Turn] | None = None, **tables: Any) -> list[Member]:
    """The links between two joints that can move: those after the first joint of their leg that is not fixed.

    Args:
        plan: the plan of the machine.
        joints: coordinates at the pose, which place the ends of the links; without them no ends are given.
        tables: the tables of the machine, by keyword.
    """
    links, coordinates = [], None if joints is None else iter(joints)
    for leg in plan.legs:
        data = [joint_numbers(leg, joint, tables) for joint in leg.joints]
        carriers = [None] * len(data) if coordinates is None else _carriers(plan, leg, tables, coordinates)
        can_move = False
        # A link follows every joint but the last one, behind which is the platform.
        for joint, near, far, carrier in zip(leg.joints, data, data[1:], carriers, strict=False):
            can_move = can_move or joint.kind != "fixed"
            if can_move:
                ends = departure(near), Vector(*far.point)
                links.append(_member(plan, leg, joint.joins[1], ends, carrier, tables))
    return links


class Carrier(NamedTuple):
    """The place of a link: its displacement from the home pose, and how many elements of its leg carry either end."""

    motion: Displacement
    elements_to_start: int
    elements_to_end: int


def _carriers(
    plan: Plan, leg: LegPlan, tables: Mapping[str, Any], joints: Iterator[Scalar | Turn]
) -> list[Carrier | None]:
    """Placements of the links of a leg at the coordinates of its joints."""
    motion, carried = Displacement(IDENTITY, ZERO), 0
    carriers: list[Carrier | None] = []
    for part in _parts_at_home(plan, leg, tables):
        moved_joint = [replace(step, element=step.element.displaced(motion)) for step in part.joint]
        motion = placed_chain(moved_joint, joints)[1] @ motion
        to_start = carried + len(part.joint)
        carried = to_start + len(part.link)
        carriers.append(Carrier(motion, to_start, carried))
    return carriers


def _member(
    plan: Plan, leg: LegPlan, body: str, ends: tuple[Vector, Vector], carrier: Carrier | None, tables: Mapping[str, Any]
) -> Member:
    """A link with its mass and its growth.

    Args:
        plan, leg, body: the machine, its leg, and the name of the link's body.
        ends: the ends of its axis at the home pose, base frame, m.
        carrier: the place of the link; None if it is not known.
        tables: the numbers of the machine.
    """
    length, section = (ends[1] - ends[0]).norm(), _section(leg, body)
    mass, bending, growth = 0.0, 0.0, 0.0
    if section:
        shape, data = plan.shapes[section], tables[f"sections.{section}"]
        mass, bending = linear_density_of(shape, data) * length, least_bending_of(shape, data)
        growth = growth_of(data.expansion, data.temperature_rise, f'the links of section "{section}"') * length
    link, centre, inertia = leg.links.get(body), None, None
    if link is not None and link.weight:
        weight = tables[leg.table(body)]
        mass = weight.mass
        if carrier is not None and "centre_of_mass" in link.weight:
            centre = partial(_station, carrier, direction_in(leg, weight.centre_of_mass))
        if carrier is not None and "inertia" in link.weight:
            inertia = partial(turned_tensor, carrier.motion.rotation.apply, inertia_in(leg, weight.inertia))
    return Member(
        leg=leg.name,
        name=f"{leg.name} {body}",
        length=length,
        mass=mass,
        bending=bending,
        growth=growth,
        ends=None if carrier is None else partial(_stations, carrier, ends),
        centre=centre,
        inertia=inertia,
    )


def _stations(carrier: Carrier, ends: tuple[Vector, Vector]) -> tuple[Station, ...]:
    start, end = (carrier.motion.apply(point) for point in ends)
    return Station(carrier.elements_to_start, start), Station(carrier.elements_to_end, end)


def _station(carrier: Carrier, point: Vector) -> Station:
    return Station(carrier.elements_to_start, carrier.motion.apply(point))


def _section(leg: LegPlan, body: str) -> str:
    """Name of the cross-section of a body: its own as a link, or that of a strut which it is a part of; or empty."""
    struts = [joint.cross_section for joint in leg.joints if body in joint.joins]
    links = [leg.links[body].cross_section] if body in leg.links else []
    return next((section for section in (*links, *struts) if section), "")


def _length(plan: Plan, tables: Mapping[str, Any]) -> Scalar:
    """Root mean square distance of the joints from P at the home pose, m; 1 m where all are at P, as slides may be.

    They are at P as well where their distance is the round-off of their coordinates: a length of that size would make
    every rotation negligible beside every translation.
    """
    centre = Vector(*tables["platform"].point)
    points = [Vector(*joint_numbers(leg, joint, tables).point) for leg in plan.legs for joint in leg.joints]
    arms = [point - centre for point in points]
    squares = total([arm.dot(arm) for arm in arms])
    if is_zero(squares):
        return 1.0
    count = float(len(arms))
    from_origin = total([point.dot(point) for point in (*points, centre)])
    have_distance = squares > ONE_PLACE * ONE_PLACE * from_origin + count * LEAST_LENGTH * LEAST_LENGTH
    return where(have_distance, sqrt(squares * (1.0 / count)), 1.0)

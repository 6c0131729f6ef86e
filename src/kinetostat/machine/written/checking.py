"""Checks of machines written leg by leg: chains that reach the platform, numbers that make sense, idle freedoms.

Names of bodies other than base and platform are known within their leg only. The same name elsewhere may be a slip or a
body that two legs share, which cannot be written: messages then say so, and never advise what would be another machine.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.vector import Vector
from kinetostat.machine.leg import Joint, rows_about_one_point
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Inverse, Plane, Step
from kinetostat.machine.written.ball_leg import ball_leg
from kinetostat.machine.written.family import chains, placed_chain
from kinetostat.machine.written.joints import JOINT_TYPES, departure
from kinetostat.machine.written.parallel_axes import parallel_axes
from kinetostat.machine.written.plan import BASE, PLATFORM, JointPlan, LegPlan, LinkPlan, Matrix, Plan
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import LARGEST_OTHER, LEAST_STIFFNESS
from kinetostat.tolerances import NO_AXIS, PARALLEL_AXES, PARALLEL_IN_FILE, SYMMETRIC

ELASTIC = ("lumped", "beam", "timoshenko")
"""Models of a link that need a cross-section, and so a length and a direction."""
LARGEST_NUMBER = 1e100
"""Size of numbers in a matrix or a direction from which they are a slip: below it, products of three stay finite."""
RANDOM_AMOUNT = 0.4
"""Greatest random displacement of a joint, rad or m: large enough to leave a special home pose well behind."""


def check_numbers(plan: Plan, tables: Mapping[str, Any], origin: str) -> None:
    """Refuse axes without direction, links without length and cross-sections without substance.

    Raises:
        InputError: names leg and joint, or the cross-section.
    """
    for name, shape in plan.shapes.items():
        data = tables[f"sections.{name}"]
        if shape == "tube" and not 0.0 <= data.inner_diameter < data.outer_diameter:
            raise InputError(
                f'"{origin}": cross-section "{name}": inner_diameter is {data.inner_diameter:g} m; it must be at '
                f"least 0 and less than outer_diameter, {data.outer_diameter:g} m."
            )
    for leg in plan.legs_of_file:
        for i, joint in enumerate(leg.joints):
            where = f'"{origin}": leg "{leg.copy_of or leg.name}", joint "{joint.name}"'
            data = tables[leg.table(joint.name)]
            _check_axes(data, where)
            if plan.planar:
                _check_plane(joint, data, where)
            link = leg.links.get(joint.joins[1])
            if link is not None and link.model in ELASTIC:
                after = leg.joints[i + 1]
                _check_link(leg, joint, after, link, tables, plan.shapes[link.cross_section], origin)


def _check_axes(data: Any, where: str) -> None:
    axes = {name: getattr(data, name) for name in ("axis", "first_axis", "second_axis") if hasattr(data, name)}
    for name, axis in axes.items():
        if math.hypot(*axis) < NO_AXIS:
            raise InputError(f"{where}: {name} has no length; give a direction, e.g. {name} = [0, 0, 1].")
    if {"first_axis", "second_axis"} <= axes.keys():
        pair = axes["first_axis"], axes["second_axis"]
        first, second = (np.array(axis) / math.hypot(*axis) for axis in pair)
        if np.linalg.norm(np.cross(first, second)) < PARALLEL_IN_FILE:
            raise InputError(f"{where}: first_axis and second_axis are parallel; turn one of them.")
    if hasattr(data, "far") and math.dist(data.point, data.far) < NO_AXIS:
        raise InputError(f"{where}: point and far are the same; give the middles of both short sides.")


def _check_plane(joint: JointPlan, data: Any, where: str) -> None:
    """Refuse a joint of a planar machine that leads out of its plane."""
    x, y, z = getattr(data, "axis", (0.0, 0.0, 1.0))
    match JOINT_TYPES[joint.kind].in_plane:
        case "normal":
            sine = math.hypot(x, y) / math.hypot(x, y, z)
        case "along":
            sine = abs(z) / math.hypot(x, y, z)
        case always_or_never:
            sine = 0.0 if always_or_never == "always" else 1.0
    if sine >= PARALLEL_IN_FILE:
        raise InputError(
            f"{where}: in a planar machine joints are revolute about z, prismatic in the x-y plane, or fixed; "
            'change its axis or its type, or write space = "spatial".'
        )


def _check_link(
    leg: LegPlan, near: JointPlan, far: JointPlan, link: LinkPlan, tables: Mapping[str, Any], shape: str, origin: str
) -> None:
    where = f'"{origin}": leg "{leg.copy_of or leg.name}", link "{link.name}"'
    before, behind = (tables[leg.table(joint.name)] for joint in (near, far))
    ends = [np.array(departure(before).components()), np.array(behind.point)]
    span = ends[1] - ends[0]
    if np.linalg.norm(span) < NO_AXIS:
        raise InputError(
            f'{where} has no length: joints "{near.name}" and "{far.name}" share a point; move one joint, or make the '
            "link rigid."
        )
    if link.up is None and shape in ("rectangle", "own"):
        raise InputError(f"{where}: its cross-section has two axes; say where z points, e.g. up = [0, 0, 1].")
    if link.up is not None and np.linalg.norm(np.cross(span, link.up)) < PARALLEL_IN_FILE * np.linalg.norm(span):
        raise InputError(f"{where}: up points along the link; give another direction.")


def complete_plan(plan: Plan, tables: Mapping[str, Any]) -> Plan:
    """The plan with what its numbers tell of each leg: its closed form, idle freedoms, and joints about one point.

    A freedom is idle if it depends on the others at every pose, up to round-off of the file. One that only nearly does
    is not: a file that is off by an angle describes a leg that is nearly locked, with a margin of about that angle. The
    home pose may be special, so that joints are displaced at random to find idle freedoms; legs need not close for
    that, and a fixed seed gives a file the same plan each time.
    """
    home = chains(plan, **tables)
    amounts = iter(np.random.default_rng(1).uniform(-RANDOM_AMOUNT, RANDOM_AMOUNT, home.size).tolist())
    legs = []
    for leg, steps in zip(plan.legs, home.legs, strict=True):
        placed, _ = placed_chain(steps, amounts)
        freedoms = [joint for element in placed for joint in element.freedoms]
        idle = _dependent_freedoms(freedoms, plan.planar, home.home.translation, float(home.length))
        centred = rows_about_one_point([_centre(joint) for joint in freedoms])
        legs.append(replace(leg, idle=idle, centred=centred, inverse=_closed_form(leg.name, steps)))
    return replace(plan, legs=tuple(legs))


def _closed_form(name: str, steps: Sequence[Step]) -> Inverse | None:
    """The closed form of a leg at the home pose; None if it has none, so that Newton's method closes the leg."""
    moving = [step.element for step in steps if step.moves]
    # The far side of a parallelogram slides along the axes at the home pose, and on a circle away from it.
    if any(isinstance(element, Parallelogram) for element in moving):
        return None
    movers = [element.mover for element in moving]
    return parallel_axes(name, movers) or ball_leg(name, movers)


def _centre(joint: Joint) -> tuple[float, ...] | None:
    """Return the point about which a joint with numbers turns, m; None of a slide or a screw."""
    if joint.point is None or not is_zero(joint.pitch):
        return None
    return tuple(map(float, joint.point.components()))


def _dependent_freedoms(freedoms: Sequence[Joint], planar: bool, reference: Vector, length: float) -> tuple[int, ...]:
    """Numbers of the freedoms that depend on the others; those that a plane does not have count as present.

    The method is Gram and Schmidt's with pivoting: the largest rest is kept and taken out of the others.
    """
    if not freedoms:
        return ()
    absent = Plane().missing_freedoms if planar else ()
    twists = [joint.twist(reference).components() for joint in (*absent, *freedoms)]
    matrix = np.array(twists, dtype=float).T / np.repeat([1.0, length or 1.0], 3)[:, None]
    matrix /= np.linalg.norm(matrix, axis=0)
    missing_in_plane, rests = matrix[:, : len(absent)], matrix[:, len(absent) :]
    rests = rests - missing_in_plane @ np.linalg.lstsq(missing_in_plane, rests, rcond=None)[0] if absent else rests
    independent: list[int] = []
    for _ in range(rests.shape[1]):
        sizes = np.linalg.norm(rests, axis=0)
        if sizes.max() < PARALLEL_AXES:
            break
        independent.append(int(np.argmax(sizes)))
        axis = rests[:, independent[-1]] / sizes[independent[-1]]
        rests = rests - np.outer(axis, axis @ rests)
    return tuple(i for i in range(rests.shape[1]) if i not in independent)


SHARED = (
    "A body that carries two legs cannot be written: each leg leads from the base to the platform by joints and bodies "
    "of its own. Two equal parallel bars on one body are one leg with a parallelogram; other branches are not possible"
)


def check_chain(leg: str, joints: tuple[JointPlan, ...], legs: Mapping[str, Any], where: str) -> None:
    """Refuse joints that do not lead from the base to the platform.

    Args:
        leg: name of the leg.
        joints: the joints of the leg.
        legs: all legs as written, by name, with their joints and links by name.
        where: names file and leg in messages.

    Raises:
        InputError: names the joint, and says what to write instead.
    """
    body, passed = BASE, {BASE}
    for i, joint in enumerate(joints):
        near, far = joint.joins
        at = f'{where}, joint "{joint.name}"'
        if near != body:
            before = f'joint "{joints[i - 1].name}" ends at "{body}"' if i else 'a leg starts at "base"'
            raise InputError(
                f'{at} starts at "{near}", but {before}: the chain is disconnected. '
                + (_branching(near) if near in passed else _elsewhere(near, leg, legs, body, f'["{body}", "{far}"]'))
            )
        if far in passed or (far == PLATFORM and i < len(joints) - 1):
            raise InputError(
                f'{at} leads to "{far}" too early; a leg passes each body once and ends at the platform. Of loops '
                "within a leg only a parallelogram can be written, which is one joint."
            )
        body, passed = far, {*passed, far}
    if body != PLATFORM:
        raise InputError(
            f'{where} does not reach the platform: its last joint "{joints[-1].name}" ends at "{body}". '
            + _elsewhere(body, leg, legs, PLATFORM, f'["{joints[-1].joins[0]}", "platform"]')
            + " The platform is one body: one whose parts move against each other cannot be written."
        )


def _elsewhere(body: str, leg: str, legs: Mapping[str, Any], expected: str, joins: str) -> str:
    """Advice about a body that stands in the place of another one."""
    owner = next((other for other in legs if other != leg and body in _bodies(legs[other])), None)
    between = f'"{body}" and "{expected}"' if expected == PLATFORM else f'"{expected}" and "{body}"'
    missing = f'If leg "{leg}" has a "{body}" of its own, add the joints between {between}.'
    if owner is not None:
        return f'"{body}" is a body of leg "{owner}". {SHARED}. {missing}'
    return f'If "{body}" is a slip for "{expected}", write joins = {joins}; otherwise add the joints between {between}.'


def _branching(body: str) -> str:
    return f'The leg has left "{body}" already, and a leg does not branch. {SHARED}.'


def _bodies(leg: Mapping[str, Any]) -> Iterable[object]:
    """The bodies of a leg as written, without base and platform."""
    lists = [part.get("joins") for part in leg.values() if isinstance(part, dict)]
    return [body for row in lists if isinstance(row, list) for body in row if body not in (BASE, PLATFORM)]


def compliance_matrix(value: object, where: str) -> Matrix:
    """A 6x6 from what was written: six numbers for its diagonal, or six rows; empty if an empty list was written.

    Raises:
        InputError: it is not a compliance: not symmetric, with a negative eigenvalue, or with entries that are slips.
    """
    if value == []:
        return ()
    if are_numbers(value, 6):
        value = np.diag(np.array(value, dtype=float)).tolist()
    if not isinstance(value, list) or len(value) != 6 or not all(are_numbers(row, 6) for row in value):
        raise InputError(
            f"{where}: compliance is {shorten(value)}; give six numbers (rx, ry, rz in rad/(N·m), x, y, z in m/N) or "
            "six rows of six."
        )
    matrix = np.array(value, dtype=float)
    least, most = 1.0 / LARGEST_OTHER, 1.0 / LEAST_STIFFNESS
    out_of_bounds = [float(c) for c in np.diag(matrix) if c > 0.0 and not least <= c <= most]
    if out_of_bounds:
        raise InputError(
            f"{where}: compliance has {out_of_bounds[0]:g} on its diagonal; give 0 where it is rigid, and elsewhere "
            f"from {least:g} to {most:g} in SI units; what is free is a joint."
        )
    size = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
    scaled = matrix / np.where(size > 0.0, size, 1.0)
    if np.abs(scaled - scaled.T).max() > SYMMETRIC or np.linalg.eigvalsh(scaled)[0] < -SYMMETRIC:
        raise InputError(f"{where}: compliance must be symmetric and have no negative eigenvalue (no negative energy).")
    return tuple(tuple(row) for row in matrix.tolist())


def are_numbers(value: object, count: int) -> bool:
    """Whether a value is a list of so many numbers, none of which is a slip."""
    return (
        isinstance(value, list)
        and len(value) == count
        and all(isinstance(c, int | float) and not isinstance(c, bool) and abs(c) < LARGEST_NUMBER for c in value)
    )

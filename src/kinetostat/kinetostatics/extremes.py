"""Scalar figures of one pose for design: softest and stiffest direction, condition, aspect, legs, actuators.

All over scalars, so that the engine evaluates them for whole populations. Directions and tables are in `indices`.

Source: theory section 10; the aspect is theory (30).
"""

import math
from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal, smaller, sqrt, total, where
from kinetostat.algebra.solve import handedness
from kinetostat.algebra.symmetric import SIZE, Symmetric6, greatest_eigenvalue
from kinetostat.kinetostatics.indices import PLANAR, SPATIAL
from kinetostat.kinetostatics.response import Response, actuator_loads
from kinetostat.machine.leg import Leg
from kinetostat.machine.leg_screws import comparable
from kinetostat.machine.links import rods
from kinetostat.machine.machine import springs

ROTATIONS, TRANSLATIONS = range(3), range(3, 6)
BALL_AXES = 3
"""Axes about which a ball joint turns."""


def components(response: Response) -> tuple[int, ...]:
    """The components of the machine, of rx ry rz x y z = 0 ... 5."""
    return SPATIAL if response.configuration.plane is None else PLANAR


def free_stiffness(response: Response, row: int) -> Scalar:
    """Free stiffness along one component, with all other motions free: 1 / C_ii, N/m or N·m/rad; at most K_ii.

    Args:
        response: response of a pose; at T, base axes.
        row: number of the component, of rx ry rz x y z = 0 ... 5.

    Returns:
        0 where the direction is free, infinity where nothing deflects in it.
    """
    return reciprocal(response.compliance.entry(row, row))


def least_stiffness(response: Response, block: Sequence[int]) -> Scalar:
    """Stiffness of the softest direction of a block, the other block free to follow: 1 / max eig(C_bb).

    Args:
        response: response of a pose.
        block: `ROTATIONS` (N·m/rad) or `TRANSLATIONS` (N/m).

    Returns:
        0 where a direction is free.
    """
    return reciprocal(_greatest(response.compliance, response, block))


def greatest_stiffness(response: Response, block: Sequence[int]) -> Scalar:
    """Stiffness of the stiffest direction of a block, the other block held: max eig(K_bb); infinite where rigid."""
    return _greatest(response.stiffness, response, block)


def _greatest(matrix: Symmetric6, response: Response, block: Sequence[int]) -> Scalar:
    """Greatest eigenvalue of a block; infinite where an entry is."""
    rows = [i for i in components(response) if i in block]
    greatest = greatest_eigenvalue([[matrix.entry(i, j) for j in rows] for i in rows])
    return where(total([matrix.entry(i, i) for i in rows]) < math.inf, greatest, math.inf)


def frobenius_condition(response: Response) -> Scalar:
    """Condition of K in the Frobenius norm: |D K D| |D^-1 C D^-1| / n, D = diag(1/L for rotations, 1 for translations).

    It is 1 where K is the same in all directions, else greater, and unlike the ratio of eigenvalues it is smooth. L is
    the machine's characteristic length. Infinite where something is rigid or free while other parts deflect, NaN where
    everything is rigid, or everything free.

    Source: Angeles, Fundamentals of Robotic Mechanical Systems, section 5.8 (there of a Jacobian).
    """
    length, rows = response.configuration.length, components(response)
    stiff = _squares(response.stiffness, reciprocal(length), rows)
    soft = _squares(response.compliance, length, rows)
    if is_zero(stiff) or is_zero(soft):  # all is rigid, or all free: infinity times zero
        return math.nan
    return sqrt(stiff) * sqrt(soft) * (1.0 / len(rows))


def _squares(matrix: Symmetric6, arm: Scalar, rows: Sequence[int]) -> Scalar:
    """Sum of the squares of a matrix whose rotational rows and columns are multiplied by a length or its reciprocal."""
    scaled = [[_times_power(matrix.entry(i, j), arm, (i < 3) + (j < 3)) for j in rows] for i in rows]
    return total([entry * entry for row in scaled for entry in row])


def _times_power(value: Scalar, arm: Scalar, power: int) -> Scalar:
    for _ in range(power):
        value = value * arm
    return value


def shortest_leg(response: Response) -> Scalar:
    """Least distance of the two joints of a leg with an actuated slide between them, m; NaN if there is no such leg."""
    return _least([rod.length for rod in rods(response.configuration.legs) if rod.telescopic])


def longest_leg(response: Response) -> Scalar:
    """Greatest distance of the two joints of such a leg, m; NaN if there is none."""
    return -_least([-rod.length for rod in rods(response.configuration.legs) if rod.telescopic])


def actuator_load(response: Response, sliding: bool) -> Scalar:
    """Greatest force (N) of an actuated slide, or moment (N·m) of an actuated revolute, under the load of the machine.

    Load in a spring: xi_e times w; of a machine that is meant under its loads, what it carries at rest. NaN where the
    machine has no such actuator, and where the state of rest has not been computed.
    """
    if response.meant_loaded:
        at_rest = response.loaded or {}
        return at_rest.get("actuator_force" if sliding else "actuator_moment", math.nan)
    loads = actuator_loads(response.configuration, response.statics, response.load)
    return -_least([-load for spring, load in loads if (spring.joint.point is None) is sliding])


def reversal_error(response: Response, row: int) -> Scalar:
    """Motion of the tool along a component that is lost where all drives reverse, at worst, m or rad.

    Args:
        response: response of a pose; at T, base axes.
        row: number of the component, of rx ry rz x y z = 0 ... 5.

    Returns:
        NaN where it has not been computed what friction of passive joints holds back (`motion.response`).

    Source: theory (105).
    """
    if response.lost_motion_of_joints is None:
        return math.nan
    pairs = zip(springs(response.configuration), response.statics.flexibility, strict=True)
    twists = [twist for spring, twist in pairs if spring.actuated and not is_zero(spring.stiffness)]
    by_drive = zip(twists, response.drives, strict=True)
    lost = [abs(twist.components()[row]) * drive.lost_motion for twist, drive in by_drive]
    return total([*lost, response.lost_motion_of_joints[row]])


def _least(values: Sequence[Scalar]) -> Scalar:
    result: Scalar = values[0] if values else math.nan
    for value in values[1:]:
        result = smaller(value, result)
    return result


def aspect(response: Response) -> Scalar:
    """Return +1 or -1, different on the two sides of every singular surface; 0 if no such surface divides poses.

    The sign of det W, with the wrenches of each leg so oriented that they move continuously with its passive joints. It
    changes where the platform becomes free with locked actuators and where passive joints lock up. Legs that carry more
    than six wrenches lose rank on less than a surface, around which a machine can go.
    """
    wrenches = [wrench for leg in response.legs for wrench in leg.wrenches] + list(response.guide)
    if len(wrenches) != SIZE:
        return 0.0
    shrink = reciprocal(response.configuration.length)
    scaled = [wrench.in_newtons(shrink) for wrench in wrenches]
    sign = handedness(scaled)
    for leg, screws in zip(response.configuration.legs, response.legs, strict=True):
        if not leg.lines:
            needed = [twist for i, twist in enumerate(screws.passive) if i not in leg.idle]
            # A basis of wrenches is the complement by which handedness turns; the force along a line is to be named.
            lines = screws.wrenches if screws.wrench_squares else ()
            named = [line.in_newtons(shrink) for line in lines]
            sign = sign * handedness([*(comparable(twist, shrink) for twist in needed), *named]) * _ball_signs(leg)
    return sign


def _ball_signs(leg: Leg) -> Scalar:
    """Return the sign by which the axes of a leg's ball joints enter the sign of its passive screws.

    A ball joint is three revolutes through one point, and which three has no effect on what it lets move. Their axes
    turn with the joint and may become dependent; there the sign of their screws jumps although the leg passes nothing
    singular. At the other end of a strut with a ball joint are two axes: a universal joint, or a ball joint without the
    idle spin. They may flip, with the strut where it was; so the strut itself stands for the third axis.
    """
    sign: Scalar = 1.0
    rows = ([leg.passive[i] for i in row if i not in leg.idle] for row in leg.centred)
    joints = [row for row in rows if row]
    for i, joint in enumerate(joints):
        balls = [other for other in (*joints[max(i - 1, 0) : i], *joints[i + 1 : i + 2]) if len(other) == BALL_AXES]
        strut = [end - start for ball in balls[:1] for end in joint[0].path for start in ball[0].path]
        axes = [*(revolute.axis for revolute in joint), *strut][:BALL_AXES]
        if len(axes) == BALL_AXES:
            sign = where(axes[0].cross(axes[1]).dot(axes[2]) < 0.0, -sign, sign)
    return sign

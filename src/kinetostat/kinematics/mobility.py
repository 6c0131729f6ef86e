"""Mobility and singularities at a pose, from its screws: motions that are free, constrained twice, lost or gained.

Freedoms of the platform are those that all legs leave it with rigid links and free actuators. Beside them: locked legs,
free twists, and the motion by the actuators (the Jacobian).

Source: theory (3), (24)-(27) and sections 2 and 8; screws are at one reference point, in base axes.
"""

from collections.abc import Sequence
from enum import StrEnum

import numpy as np

from kinetostat.algebra.screw import COMPONENTS, Screw, Wrench
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, Leg, Spring
from kinetostat.machine.leg_screws import LegScrews
from kinetostat.machine.machine import Configuration
from kinetostat.spec.renamed import former_names
from kinetostat.tolerances import DEPENDENT, NEGLIGIBLE_COMPONENT, PURE_TRANSLATION

TWISTS_IN_SPACE = 6
"""Number of independent twists of a body in space: of these, what holds the platform takes its rank away."""


class SortOfPose(StrEnum):
    """Sorts of poses by the freedoms of the machine."""

    REGULAR = "regular"
    LEG = "leg singularity"
    CONSTRAINT = "constraint singularity"
    ACTUATION = "actuation singularity"


@dataclass(frozen=True)
class Freedoms:
    """Ranks at one pose.

    Attributes:
        platform: freedoms of the platform, actuators free.
        legs: freedoms that each leg alone allows its platform end.
        idle: freedoms within legs that move no platform, such as the spin of a strut.
        redundant: constraints that legs impose twice.
        locked: freedoms of the platform that remain when the actuators are held; 0 unless singular.
    """

    platform: int
    legs: tuple[int, ...]
    idle: int
    redundant: int
    locked: int


@former_names(leg_distance="leg_least_singular_value", platform_distance="platform_least_singular_value")
@dataclass(frozen=True)
class Mobility:
    """Motions at a pose, and in general.

    Attributes:
        here: ranks at the pose.
        full_cycle: freedoms of the platform at poses nearby, in general: those the machine has while it moves.
        actuators: how many there are; more than `full_cycle` is redundant actuation.
        kind: the kind of the pose.
        lost: names of legs that lose a freedom here.
        twists: what the platform gains, each [omega; v] at the reference point, base axes; of 1 rad, or 1 m.
        leg_least_singular_value, platform_least_singular_value: that of any leg's unit joint screws, and that of the
            unit wrenches that hold the platform with actuators locked, in units of the machine's length; 0 if singular.
    """

    here: Freedoms
    full_cycle: int
    actuators: int
    kind: SortOfPose
    lost: tuple[str, ...]
    twists: tuple[tuple[float, ...], ...]
    leg_least_singular_value: float
    platform_least_singular_value: float


def mobility(configuration: Configuration, nearby: Sequence[Configuration], reference: Vector) -> Mobility:
    """Return the mobility of a machine and the kind of its pose.

    Args:
        configuration: the machine at the pose.
        nearby: the machine at some poses around it, to tell what holds in general from what is special here.
        reference: point of reference of twists, base frame, m.
    """
    ranks = freedoms(configuration, reference)
    general = [freedoms(pose, pose.platform.translation) for pose in nearby] or [ranks]
    full_cycle = min(pose.platform for pose in general)
    general_ranks = [max(pose.legs[i] for pose in general) for i in range(len(configuration.legs))]
    lost = tuple(
        leg.name
        for leg, rank, general_rank in zip(configuration.legs, ranks.legs, general_ranks, strict=True)
        if rank < general_rank
    )
    constraints, holding = _platform_wrenches(configuration, reference)
    kind = SortOfPose.REGULAR
    twists: tuple[tuple[float, ...], ...] = ()
    if ranks.platform > full_cycle:
        kind, twists = SortOfPose.CONSTRAINT, _free_twists(constraints, ranks.platform, float(configuration.length))
    elif ranks.locked:
        kind, twists = SortOfPose.ACTUATION, _free_twists(holding, ranks.locked, float(configuration.length))
    elif lost:
        kind = SortOfPose.LEG
    absent = _twists_absent(configuration)
    leg_least_values = [
        _singular_value(_leg_screws(configuration, leg, reference), rank + absent)
        for leg, rank in zip(configuration.legs, general_ranks, strict=True)
    ]
    actuators = sum(len(_driven_joints(leg)) for leg in configuration.legs)
    return Mobility(
        here=ranks,
        full_cycle=full_cycle,
        actuators=actuators,
        kind=kind,
        lost=lost,
        twists=twists,
        leg_least_singular_value=min(leg_least_values, default=1.0),
        platform_least_singular_value=_singular_value(holding, TWISTS_IN_SPACE),
    )


def _twists_absent(configuration: Configuration) -> int:
    """Number of twists that a plane takes away."""
    return 0 if configuration.plane is None else len(configuration.plane.missing_freedoms)


def freedoms(configuration: Configuration, reference: Vector) -> Freedoms:
    """Count the freedoms of a configuration; `reference` in the base frame, m."""
    absent = _twists_absent(configuration)
    legs = [_rank(_leg_screws(configuration, leg, reference)) - absent for leg in configuration.legs]
    constraints, holding = _platform_wrenches(configuration, reference)
    rank = _rank(constraints)
    imposed = sum(TWISTS_IN_SPACE - absent - leg for leg in legs)
    idle = sum(
        len(_driven_joints(leg)) + len(_free_joints(leg)) + sum(spring.hinge for spring in leg.springs) - rank_of_leg
        for leg, rank_of_leg in zip(configuration.legs, legs, strict=True)
        if not leg.lines
    )
    return Freedoms(
        platform=TWISTS_IN_SPACE - rank,
        legs=tuple(legs),
        idle=idle,
        redundant=imposed - (rank - absent),
        locked=TWISTS_IN_SPACE - _rank(holding),
    )


def task_coordinates(configuration: Configuration, reference: Vector) -> tuple[int, ...]:
    """Choose coordinates that give the platform's freedoms, actuators free: the fewest, translations first.

    Args:
        configuration: the configuration at the pose.
        reference: point of reference of twists, base frame, m.

    Returns:
        Numbers of x y z rx ry rz = 0 ... 5, ascending.
    """
    constraints, _ = _platform_wrenches(configuration, reference)
    count = TWISTS_IN_SPACE - _rank(constraints)
    free_twists = np.linalg.svd(constraints)[0][:, TWISTS_IN_SPACE - count :]
    free = np.vstack([free_twists[3:], free_twists[:3]])
    kept: list[int] = []
    for number in range(TWISTS_IN_SPACE):
        if _rank(free[[*kept, number]]) > len(kept):
            kept.append(number)
    return tuple(kept)


def _driven_joints(leg: Leg) -> list[Joint]:
    """The joints that actuators hold; one without stiffness holds nothing."""
    return [spring.joint for spring in leg.springs if spring.actuated and float(spring.stiffness) > 0.0]


def _free_joints(leg: Leg) -> list[Joint]:
    """All joints that nothing holds."""
    return [*leg.passive, *(spring.joint for spring in leg.springs if float(spring.stiffness) == 0.0)]


def _leg_screws(configuration: Configuration, leg: Leg, reference: Vector) -> Array:
    """Unit screws of all joints of a leg, actuated ones and flexures too, and of what a plane takes away [6 x n]."""
    absent = configuration.plane.missing_freedoms if configuration.plane else ()
    hinges = [spring.joint for spring in leg.springs if spring.hinge and float(spring.stiffness) > 0.0]
    joints = (*_free_joints(leg), *hinges, *_driven_joints(leg), *absent)
    return _unit_screws([joint.twist(reference) for joint in joints], configuration)


def _unit_screws(screws: Sequence[Screw], configuration: Configuration) -> Array:
    """Screws at unit size, without those that a degenerate placement leaves without direction [6 x n]."""
    if not screws:
        return np.zeros((TWISTS_IN_SPACE, 0))
    matrix = columns(screws, 1.0, 1.0 / float(configuration.length))
    sizes = np.linalg.norm(matrix, axis=0)
    return matrix[:, sizes > 0.0] / sizes[sizes > 0.0]


def _platform_wrenches(configuration: Configuration, reference: Vector) -> tuple[Array, Array]:
    """Wrenches that hold the platform, scaled to compare [6 x n]: with actuators free, and with actuators held."""
    length = float(configuration.length)
    absent = configuration.plane.missing_freedoms if configuration.plane else ()
    guide = []
    if configuration.plane:
        plane = _unit_screws([joint.twist(reference) for joint in configuration.plane.freedoms], configuration)
        guide = [_reciprocal(plane)]
    constraints, holding = list(guide), list(guide)
    for leg in configuration.legs:
        constraints.append(_reciprocal(_leg_screws(configuration, leg, reference)))
        if leg.lines and len(_free_joints(leg)) == len(leg.passive):
            wrenches = columns([line.wrench(reference) for line in leg.lines], 1.0 / length, 1.0)
            holding.append(wrenches / np.linalg.norm(wrenches, axis=0))
        else:
            passive = [joint.twist(reference) for joint in (*_free_joints(leg), *absent)]
            holding.append(_reciprocal(_unit_screws(passive, configuration)))
    return np.hstack(constraints), np.hstack(holding)


def _reciprocal(twists: Array) -> Array:
    """Orthonormal wrenches that do no work on scaled twists [6 x n]: [moment / length; force] columns."""
    left, sizes, _ = np.linalg.svd(twists)
    return np.asarray(left[:, int((sizes > DEPENDENT).sum()) :])


def _rank(matrix: Array) -> int:
    return int((np.linalg.svd(matrix, compute_uv=False) > DEPENDENT).sum()) if matrix.size else 0


def _singular_value(matrix: Array, number: int) -> float:
    """The singular value of a number, from 1: of the rank at regular poses, it is the least; 0 if there is none."""
    sizes = np.linalg.svd(matrix, compute_uv=False)
    return float(sizes[number - 1]) if 0 < number <= len(sizes) else 0.0


def _free_twists(wrenches: Array, count: int, length: float) -> tuple[tuple[float, ...], ...]:
    """The twists that no wrench resists, each of 1 rad, or of 1 m where it does not turn."""
    left, _, _ = np.linalg.svd(wrenches)
    twists = left[:, TWISTS_IN_SPACE - count :] * np.repeat([1.0, length], 3)[:, None]
    scaled = []
    for twist in twists.T:
        turning, sliding = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
        size = turning if turning * length > DEPENDENT * sliding else sliding
        scaled.append(tuple(float(c) for c in np.where(np.abs(twist) < DEPENDENT * size, 0.0, twist) / size))
    return tuple(scaled)


def columns(screws: Sequence[Screw], rotational_scale: float, translational_scale: float) -> Array:
    """Return screws as columns [6 x n], with both halves scaled so that rotations and translations are comparable."""
    rows = [screw.components() for screw in screws]
    scale = np.repeat([rotational_scale, translational_scale], 3)
    return np.array(rows, dtype=float).T * scale[:, None]


def conditioning(legs: Sequence[LegScrews], length: float, guide: Sequence[Wrench] = ()) -> Array:
    """Return the singular values of W with moments divided by `length` (m), the largest first.

    Args:
        legs: screws of the legs at one reference point, base axes.
        length: characteristic length, m.
        guide: wrenches of a planar machine against the twists that do not exist in the plane.

    Returns:
        The singular values, N; there are 6, or fewer if there are fewer wrenches [n].
    """
    return np.asarray(np.linalg.svd(_comparable_wrenches(legs, length, guide), compute_uv=False), dtype=float)


def _comparable_wrenches(legs: Sequence[LegScrews], length: float, guide: Sequence[Wrench]) -> Array:
    """Return W: the wrenches of all legs and then those of a guide, with moments divided by the length [6 x n]."""
    wrenches = [*(wrench for leg in legs for wrench in leg.wrenches), *guide]
    return columns(wrenches, 1.0 / length, 1.0)


def count_independent(screws: Sequence[Screw], translational_scale: float, tolerance: float) -> int:
    """Return the number of independent screws: the rank of the screws at unit size, at a relative `tolerance`."""
    if not screws:
        return 0
    matrix = columns(screws, 1.0, translational_scale)
    sizes = np.linalg.norm(matrix, axis=0)
    values = np.linalg.svd(matrix[:, sizes > 0.0] / sizes[sizes > 0.0], compute_uv=False)
    return int((values > tolerance * max(values, default=0.0)).sum())


def free_twist(legs: Sequence[LegScrews], length: float, guide: Sequence[Wrench] = ()) -> list[float]:
    """Return the twist that the wrenches of all legs resist least; at a singularity they leave it free.

    Args:
        legs, length, guide: see `conditioning`.

    Returns:
        [omega; v] at P in base axes, with a rotation of 1 rad, or of 1 m if it is a pure translation.
    """
    left, _, _ = np.linalg.svd(_comparable_wrenches(legs, length, guide))
    angular, linear = left[:3, -1] / length, left[3:, -1]
    turning = np.linalg.norm(angular) * length > PURE_TRANSLATION
    size = np.linalg.norm(angular if turning else linear)
    return [float(c / size) for c in (*angular, *linear)]


def why_singular(
    names: Sequence[str], legs: Sequence[LegScrews], length: float, tolerance: float, guide: Sequence[Wrench] = ()
) -> str:
    """Name the causes of a singularity, a sentence each.

    Args:
        names: names of the legs.
        legs: screws of the legs at P, base axes.
        length: characteristic length, m.
        tolerance: a leg counts as locked if its singularity margin is at most this.
        guide: wrenches of a planar machine against the twists that do not exist in the plane.
    """
    locked = [name for name, leg in zip(names, legs, strict=True) if not leg.singularity_margin > tolerance]
    if locked:
        return (
            f"The passive joints of the {' and the '.join(locked)} lock up here (links stretched, folded or aligned), "
            "so that the leg loses a freedom; move the pose away from this limit."
        )
    motion = describe(free_twist(legs, length, guide), ("rad", "m"))
    return f"With all actuators locked the platform can still move by the twist {motion}; change the pose or joints."


def describe(screw: Sequence[float], units: tuple[str, str]) -> str:
    """Put a screw in words: its components beyond round-off, with their units (rotational, translational)."""
    size = max(abs(c) for c in screw)
    shown = [
        f"{name} {value:+.4g} {units[i // 3]}"
        for i, (name, value) in enumerate(zip(COMPONENTS, screw, strict=True))
        if abs(value) > NEGLIGIBLE_COMPONENT * size
    ]
    return ", ".join(shown)


def actuator_jacobian(
    legs: Sequence[LegScrews], springs: Sequence[Sequence[Spring]], length: float, guide: Sequence[Wrench] = ()
) -> Array:
    """Return the platform's twist t per unit rate of each actuator, from W^T t = (J_e^T W)^T r with all other rates 0.

    If legs impose the same constraint twice, there are more equations than unknowns. They agree for rates that the
    machine can have; for others the twist is the one of least squares.

    Args:
        legs: screws of the legs at one reference point, base axes.
        springs: springs of each leg, in the order of its screws.
        length: characteristic length, m; it weighs moments against forces in the least squares.
        guide: wrenches of a planar machine against the twists that do not exist in the plane.

    Returns:
        Twists [6 x actuators] at that point: rad and m per rad or m of the actuator.
    """
    wrenches = _comparable_wrenches(legs, length, guide)
    rates = []
    first = 0  # column of the leg's first wrench
    for leg, leg_springs in zip(legs, springs, strict=True):
        for spring, loads in zip(leg_springs, leg.loads, strict=True):
            if spring.actuated and float(spring.stiffness) > 0.0:
                rate = np.zeros(wrenches.shape[1])
                rate[first : first + len(loads)] = [float(load) for load in loads]
                rates.append(rate)
        first += len(leg.wrenches)
    if not rates:
        return np.zeros((6, 0))
    scaled = np.linalg.pinv(wrenches.T) @ np.array(rates).T
    return np.asarray(scaled / np.repeat([length, 1.0], 3)[:, None])

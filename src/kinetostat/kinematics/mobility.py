"""Mobility and singularities from the screws: which motions are free, constrained twice, lost or gained at a pose.

Freedoms of the platform are those that all legs leave it with rigid links and free actuators.

Source: theory (24)-(27); screws are in base axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from kinetostat.algebra.screw import Screw
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.kinematics.singularity import columns
from kinetostat.machine.leg import Joint, Leg
from kinetostat.machine.machine import Configuration
from kinetostat.spec.renamed import former_names
from kinetostat.tolerances import DEPENDENT

SPATIAL = 6


class Kind(StrEnum):
    """What a pose is to the freedoms of the machine."""

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
    """What can move at a pose, and in general.

    Attributes:
        here: ranks at the pose.
        full_cycle: freedoms of the platform at poses nearby, in general: those the machine has while it moves.
        actuators: how many there are; more than `full_cycle` is redundant actuation.
        kind: of the pose.
        lost: names of legs that lose a freedom here.
        twists: what the platform gains, each [omega; v] at the reference point, base axes; of 1 rad, or 1 m.
        leg_least_singular_value, platform_least_singular_value: of the unit joint screws of any leg, and of the unit
            wrenches that hold the platform with actuators locked, lengths in units of the machine's; 0 if singular.
    """

    here: Freedoms
    full_cycle: int
    actuators: int
    kind: Kind
    lost: tuple[str, ...]
    twists: tuple[tuple[float, ...], ...]
    leg_least_singular_value: float
    platform_least_singular_value: float


def mobility(here: Configuration, nearby: Sequence[Configuration], reference: Vector) -> Mobility:
    """Return the mobility of a machine and the kind of its pose.

    Args:
        here: the machine at the pose.
        nearby: at some poses around it, to tell what holds in general from what is special here.
        reference: point of reference of twists, base frame, m.
    """
    ranks = freedoms(here, reference)
    general = [freedoms(pose, pose.platform.translation) for pose in nearby] or [ranks]
    full_cycle = min(pose.platform for pose in general)
    usual = [max(pose.legs[i] for pose in general) for i in range(len(here.legs))]
    lost = tuple(leg.name for leg, has, may in zip(here.legs, ranks.legs, usual, strict=True) if has < may)
    constraints, holding = _platform_wrenches(here, reference)
    kind = Kind.REGULAR
    twists: tuple[tuple[float, ...], ...] = ()
    if ranks.platform > full_cycle:
        kind, twists = Kind.CONSTRAINT, _free_twists(constraints, ranks.platform, float(here.length))
    elif ranks.locked:
        kind, twists = Kind.ACTUATION, _free_twists(holding, ranks.locked, float(here.length))
    elif lost:
        kind = Kind.LEG
    away = _away(here)
    legs = [_least(_leg_screws(here, leg, reference), rank + away) for leg, rank in zip(here.legs, usual, strict=True)]
    actuators = sum(len(_drives(leg)) for leg in here.legs)
    return Mobility(ranks, full_cycle, actuators, kind, lost, twists, min(legs, default=1.0), _least(holding, SPATIAL))


def _away(configuration: Configuration) -> int:
    """How many twists a plane takes away."""
    return 0 if configuration.plane is None else len(configuration.plane.absent)


def freedoms(configuration: Configuration, reference: Vector) -> Freedoms:
    """Count the freedoms of a configuration; `reference` in the base frame, m."""
    away = _away(configuration)
    legs = [_rank(_leg_screws(configuration, leg, reference)) - away for leg in configuration.legs]
    constraints, holding = _platform_wrenches(configuration, reference)
    rank = _rank(constraints)
    imposed = sum(SPATIAL - away - leg for leg in legs)
    spins = sum(
        len(_drives(leg)) + len(_free(leg)) + sum(spring.hinge for spring in leg.springs) - has
        for leg, has in zip(configuration.legs, legs, strict=True)
        if not leg.lines
    )
    return Freedoms(SPATIAL - rank, tuple(legs), spins, imposed - (rank - away), SPATIAL - _rank(holding))


def task_coordinates(configuration: Configuration, reference: Vector) -> tuple[int, ...]:
    """Choose coordinates that give the platform's freedoms, actuators free: the fewest, translations first.

    Args:
        configuration: at the pose.
        reference: point of reference of twists, base frame, m.

    Returns:
        Numbers of x y z rx ry rz = 0 ... 5, ascending.
    """
    constraints, _ = _platform_wrenches(configuration, reference)
    count = SPATIAL - _rank(constraints)
    turned = np.linalg.svd(constraints)[0][:, SPATIAL - count :]
    free = np.vstack([turned[3:], turned[:3]])
    kept: list[int] = []
    for number in range(SPATIAL):
        if _rank(free[[*kept, number]]) > len(kept):
            kept.append(number)
    return tuple(kept)


def _drives(leg: Leg) -> list[Joint]:
    """The joints that actuators hold; one without stiffness holds nothing."""
    return [spring.joint for spring in leg.springs if spring.actuated and float(spring.stiffness) > 0.0]


def _free(leg: Leg) -> list[Joint]:
    """All joints that nothing holds."""
    return [*leg.passive, *(spring.joint for spring in leg.springs if float(spring.stiffness) == 0.0)]


def _leg_screws(configuration: Configuration, leg: Leg, reference: Vector) -> Array:
    """Unit screws of all joints of a leg, actuated ones and flexures too, and of what a plane takes away [6 x n]."""
    absent = configuration.plane.absent if configuration.plane else ()
    hinges = [spring.joint for spring in leg.springs if spring.hinge and float(spring.stiffness) > 0.0]
    joints = (*_free(leg), *hinges, *_drives(leg), *absent)
    return _unit_screws([joint.twist(reference) for joint in joints], configuration)


def _unit_screws(screws: Sequence[Screw], configuration: Configuration) -> Array:
    """Screws at unit size, without those that a degenerate placement leaves without direction [6 x n]."""
    if not screws:
        return np.zeros((SPATIAL, 0))
    matrix = columns(screws, 1.0, 1.0 / float(configuration.length))
    sizes = np.linalg.norm(matrix, axis=0)
    return matrix[:, sizes > 0.0] / sizes[sizes > 0.0]


def _platform_wrenches(configuration: Configuration, reference: Vector) -> tuple[Array, Array]:
    """What holds the platform, rows scaled to compare [6 x n]: with actuators free, and with actuators held."""
    length = float(configuration.length)
    absent = configuration.plane.absent if configuration.plane else ()
    guide = []
    if configuration.plane:
        plane = _unit_screws([joint.twist(reference) for joint in configuration.plane.freedoms], configuration)
        guide = [_reciprocal(plane)]
    constraints, holding = list(guide), list(guide)
    for leg in configuration.legs:
        constraints.append(_reciprocal(_leg_screws(configuration, leg, reference)))
        if leg.lines and len(_free(leg)) == len(leg.passive):
            wrenches = columns([line.wrench(reference) for line in leg.lines], 1.0 / length, 1.0)
            holding.append(wrenches / np.linalg.norm(wrenches, axis=0))
        else:
            passive = [joint.twist(reference) for joint in (*_free(leg), *absent)]
            holding.append(_reciprocal(_unit_screws(passive, configuration)))
    return np.hstack(constraints), np.hstack(holding)


def _reciprocal(twists: Array) -> Array:
    """Orthonormal wrenches that do no work on scaled twists [6 x n]: [moment / length; force] columns."""
    left, sizes, _ = np.linalg.svd(twists)
    return np.asarray(left[:, int((sizes > DEPENDENT).sum()) :])


def _rank(matrix: Array) -> int:
    return int((np.linalg.svd(matrix, compute_uv=False) > DEPENDENT).sum()) if matrix.size else 0


def _least(matrix: Array, rank: int) -> float:
    """The singular value of number `rank`, the least that a regular pose has."""
    sizes = np.linalg.svd(matrix, compute_uv=False)
    return float(sizes[rank - 1]) if 0 < rank <= len(sizes) else 0.0


def _free_twists(wrenches: Array, count: int, length: float) -> tuple[tuple[float, ...], ...]:
    """The twists that no wrench resists, each of 1 rad, or of 1 m where it does not turn."""
    left, _, _ = np.linalg.svd(wrenches)
    twists = left[:, SPATIAL - count :] * np.repeat([1.0, length], 3)[:, None]
    scaled = []
    for twist in twists.T:
        turning, sliding = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
        size = turning if turning * length > DEPENDENT * sliding else sliding
        scaled.append(tuple(float(c) for c in np.where(np.abs(twist) < DEPENDENT * size, 0.0, twist) / size))
    return tuple(scaled)

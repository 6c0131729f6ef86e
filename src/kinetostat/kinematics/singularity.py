"""Singularities and the Jacobian at a pose, from its screws: locked legs, free twists, motion by the actuators.

Source: theory (3) and sections 2 and 8; screws are at one reference point, in base axes.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.screw import COMPONENTS, Screw, Wrench
from kinetostat.arrays import Array
from kinetostat.machine.leg import LegScrews, Spring
from kinetostat.tolerances import NEGLIGIBLE_COMPONENT, PURE_TRANSLATION


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
    wrenches = [*(wrench for leg in legs for wrench in leg.wrenches), *guide]
    return np.asarray(np.linalg.svd(columns(wrenches, 1.0 / length, 1.0), compute_uv=False), dtype=float)


def independent(screws: Sequence[Screw], translational_scale: float, tolerance: float) -> int:
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
    wrenches = [*(wrench for leg in legs for wrench in leg.wrenches), *guide]
    left, _, _ = np.linalg.svd(columns(wrenches, 1.0 / length, 1.0))
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
    wrenches = [*(wrench for leg in legs for wrench in leg.wrenches), *guide]
    rates = []
    at = 0  # the first row of the leg
    for leg, leg_springs in zip(legs, springs, strict=True):
        for spring, loads in zip(leg_springs, leg.loads, strict=True):
            if spring.actuated and float(spring.stiffness) > 0.0:
                rate = np.zeros(len(wrenches))
                rate[at : at + len(loads)] = [float(load) for load in loads]
                rates.append(rate)
        at += len(leg.wrenches)
    if not rates:
        return np.zeros((6, 0))
    scaled = np.linalg.pinv(columns(wrenches, 1.0 / length, 1.0).T) @ np.array(rates).T
    return np.asarray(scaled / np.repeat([length, 1.0], 3)[:, None])

"""The Jacobian of a machine: how its platform moves with its actuators, all links rigid.

Source: theory (3) with the deformations of actuators as their rates; eq. 1.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.screw import Wrench
from kinetostat.kinematics.singularity import Array, columns
from kinetostat.machine.leg import LegScrews, Spring


def actuator_jacobian(
    legs: Sequence[LegScrews], springs: Sequence[Sequence[Spring]], length: float, guide: Sequence[Wrench] = ()
) -> Array:
    """Platform twist per unit rate of each actuator, W^T t = (J_e^T W)^T rates with rates of actuators alone.

    Where legs impose constraints twice, the equations agree for rates that the machine can have.

    Args:
        legs: their screws at one reference point, base axes.
        springs: of each leg, in the order of its screws.
        length: characteristic length, m; compares moments with forces where equations do not agree.
        guide: of a planar machine, the wrenches against twists that do not exist there.

    Returns:
        Twists [6 x actuators] at that point: rad and m per rad or m of the actuator.
    """
    wrenches = [*(wrench for leg in legs for wrench in leg.wrenches), *guide]
    rates = []
    at = 0
    for leg, own in zip(legs, springs, strict=True):
        for spring, loads in zip(own, leg.loads, strict=True):
            if spring.actuated and float(spring.stiffness) > 0.0:
                rate = np.zeros(len(wrenches))
                rate[at : at + len(loads)] = [float(load) for load in loads]
                rates.append(rate)
        at += len(leg.wrenches)
    if not rates:
        return np.zeros((6, 0))
    scaled = np.linalg.pinv(columns(wrenches, 1.0 / length, 1.0).T) @ np.array(rates).T
    return np.asarray(scaled / np.repeat([length, 1.0], 3)[:, None])

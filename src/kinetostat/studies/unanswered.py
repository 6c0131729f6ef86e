"""Facts about a machine at a pose without an answer: actuators, free motions, and finite entries of K and C.

At an actuation singularity the legs still resist: K is finite, and singular. C is finite between the loads that do no
work on the free twists and the motions that these leave alone; its other entries are infinite.

Source: theory sections 2 and 5; a pseudo-inverse of K in units of the characteristic length.
"""

import math
from typing import Any

import numpy as np

from kinetostat.algebra.screw import Screw
from kinetostat.algebra.vector import Rotation
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import MachineState
from kinetostat.kinematics.status import PLACELESS, Status
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.loads import moving_masses
from kinetostat.machine.machine import Machine, springs
from kinetostat.studies.assembly import actuators_at
from kinetostat.studies.rounding import clean_matrix
from kinetostat.tolerances import FREE_COMPONENT, MOST_LEG_CONTRAST, ROUND_OFF_OF_ENTRY, SINGULAR


def standing_fields(state: MachineState) -> dict[str, Any]:
    """Return the fields of an `Analysis` that are known wherever a machine stands, answer or not."""
    response = state.free
    configuration = response.configuration
    every = springs(configuration)
    turn = configuration.platform.rotation
    rows = zip(*([float(c) for c in axis.components()] for axis in (turn.x, turn.y, turn.z)), strict=True)
    return {
        "platform": (np.array(configuration.platform.translation.components(), dtype=float), np.array([*rows])),
        "rigid": tuple(spring.name for spring in every if math.isinf(spring.stiffness)),
        "free": tuple(spring.name for spring in every if spring.stiffness == 0.0),
        "masses": tuple(moving_masses(state.machine, configuration)),
        "actuators": actuators_at(state.machine, state.joints),
        "singularity_margin": float(response.singularity_margin),
        "leg_singularity_margin": min((float(leg.singularity_margin) for leg in response.legs), default=1.0),
        "platform_singularity_margin": float(response.statics.singularity_margin),
        "characteristic_length": float(configuration.length),
    }


def known_fields(state: MachineState, turn: Rotation) -> dict[str, Any]:
    """Return the fields of an `Analysis` that are known at a pose without an answer; none where it has no place.

    Args:
        state: the state of the machine.
        turn: rotation from base axes to those of K and C.
    """
    response = state.free
    if Status(int(response.joint_status)) is not Status.OK or state.status in PLACELESS:
        return {}
    fields = standing_fields(state)
    if state.status is not Status.SINGULAR:
        return fields
    return fields | {"mobility": state.mobility} | _matrices(state.machine, response, turn)


def _matrices(machine: Machine, response: Response, turn: Rotation) -> dict[str, Any]:
    """K, and C with NaN for what is not finite, of a singular pose; nothing where K is not finite either."""
    length, kept = float(response.configuration.length), list(machine.family.components)
    whole = _stiffness(response, turn, length)
    if whole is None:
        return {}
    units = np.repeat([1.0 / length, 1.0], 3)[kept]
    scaled = units[:, None] * whole[np.ix_(kept, kept)] * units
    scaled[np.abs(scaled) < ROUND_OFF_OF_ENTRY * np.abs(scaled).max()] = 0.0
    values, vectors = np.linalg.eigh(scaled)
    resisted = values > SINGULAR**2 * values[-1]
    free = np.abs(vectors[:, ~resisted]).max(axis=1, initial=0.0) > FREE_COMPONENT
    compliance = units[:, None] * ((vectors[:, resisted] / values[resisted]) @ vectors[:, resisted].T) * units
    compliance[free, :] = compliance[:, free] = math.nan
    stiffness = scaled / units[:, None] / units
    diagonal = np.where(free, math.inf, np.diag(compliance))
    return {
        "stiffness": stiffness,
        "stiffness_diagonal": np.diag(stiffness),
        "finite_compliance": np.array(clean_matrix(compliance.tolist())),
        "compliance_diagonal": diagonal,
        "rank": int(resisted.sum()),
    }


def _stiffness(response: Response, turn: Rotation, length: float) -> Array | None:
    """K [6 x 6] as the sum over legs of W G^-1 W^T (theory (3)); None where a leg is rigid, free or locked."""
    whole = np.zeros((6, 6))
    for leg in response.legs:
        compliance = np.array(leg.compliance, dtype=float)
        if not (float(leg.singularity_margin) > SINGULAR and np.isfinite(compliance).all()):
            return None
        wrenches = np.array([_turned_components(wrench, turn) for wrench in leg.wrenches]).reshape(-1, 6).T
        loads = np.array(leg.loads, dtype=float).reshape(len(compliance), -1)
        if not (np.isfinite(wrenches).all() and np.isfinite(loads).all()):
            return None
        sizes = np.linalg.norm(wrenches * np.repeat([1.0 / length, 1.0], 3)[:, None], axis=0)
        flexibility = (loads / sizes).T @ (compliance[:, None] * (loads / sizes))
        if wrenches.shape[1] and np.linalg.cond(flexibility) > MOST_LEG_CONTRAST:
            return None
        whole += (wrenches / sizes) @ np.linalg.solve(flexibility, (wrenches / sizes).T)
    return whole


def _turned_components(screw: Screw, turn: Rotation) -> list[float]:
    return [float(component) for component in screw.rotated(turn).components()]

"""Effects of a machine's [load]: deflection of the tool point, loads in springs and actuators, joint reactions.

The formulas are in `kinetostatics.loading`.
"""

import math
from dataclasses import dataclass, replace

from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.algebra.vector import Rotation
from kinetostat.kinetostatics.loading import JointReaction, deflection, joint_reactions, spring_loads
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import springs
from kinetostat.studies.rounding import clean_screw
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY


@dataclass(frozen=True)
class SpringLoad:
    """The load in a spring and how far it deforms.

    Attributes:
        name: of the spring.
        actuated: whether it is an actuator.
        turning: whether it is a rotation: N·m and rad, otherwise N and m.
        load, deformation: N·m and rad, or N and m.
    """

    name: str
    actuated: bool
    turning: bool
    load: float
    deformation: float


@dataclass(frozen=True)
class LoadCase:
    """A wrench on the platform at the tool point and its effects, all in the axes of K and C.

    Attributes:
        wrench: moment (N·m) and force (N) [6].
        deflection: rotation (rad) and displacement (m) of the tool point [6]; infinite where it is free.
        springs: loads in all springs.
        reactions: wrenches in all joints of the legs, actuated ones among them.
    """

    wrench: tuple[float, ...]
    deflection: tuple[float, ...]
    springs: tuple[SpringLoad, ...]
    reactions: tuple[JointReaction, ...]


def load_case(response: Response, compliance: Symmetric6, turn: Rotation) -> LoadCase | None:
    """Compute the effects of a machine's load; None where its file gives none.

    Args:
        response: of the machine, its load included; base axes.
        compliance: C in the axes of the results.
        turn: from base axes to those.
    """
    wrench = response.load
    if not any(wrench.components()):
        return None
    length = float(response.configuration.length)
    seen = clean_screw(wrench.rotated(turn), length)
    size = float(wrench.rotational.norm() + wrench.translational.norm() * length)
    loads = zip(springs(response.configuration), spring_loads(response, wrench), strict=True)
    return LoadCase(
        seen.components(),
        _deflection(compliance, seen),
        tuple(
            SpringLoad(
                s.name,
                s.actuated,
                s.joint.point is not None,
                float(load),
                _deformation(float(load), float(s.stiffness)),
            )
            for s, load in loads
        ),
        tuple(
            replace(reaction, wrench=clean_screw(reaction.wrench.rotated(turn), length, size))
            for reaction in joint_reactions(response, wrench)
        ),
    )


def _deflection(compliance: Symmetric6, load: Wrench) -> tuple[float, ...]:
    """C w without round-off: no component i can exceed sqrt(C_ii w C w), because C is positive semidefinite."""
    twist = deflection(compliance, load)
    energy = float(load.work(twist))
    moved = zip(twist.components(), compliance.diagonal(), strict=True)
    bounds = [(float(c), math.sqrt(max(energy * float(entry), 0.0)) if entry else 0.0) for c, entry in moved]
    return tuple(0.0 if abs(c) < ROUND_OFF_OF_ENTRY * bound < math.inf else c for c, bound in bounds)


def _deformation(load: float, stiffness: float) -> float:
    """Deformation of a spring; without a load it has none, even where it is free."""
    return load / stiffness if load else 0.0

"""What the [load] of a machine does: deflection of the tool point, loads in springs and actuators, joint reactions."""

from dataclasses import dataclass, replace

from kinetostat.algebra.vector import Rotation
from kinetostat.kinetostatics.loading import JointReaction, deflection, joint_reactions, spring_loads
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import Machine, springs


@dataclass(frozen=True)
class SpringLoad:
    """The load in a spring and how far it gives.

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


def load_case(machine: Machine, response: Response, turn: Rotation) -> LoadCase | None:
    """The effects of a machine's load; None where it has none.

    Args:
        machine: with its table [load], base axes.
        response: of it, with C in the axes of the results.
        turn: from base axes to those.
    """
    wrench = machine.load
    if not any(wrench.components()):
        return None
    seen = wrench.rotated(turn)
    loads = zip(springs(response.configuration), spring_loads(response, wrench), strict=True)
    return LoadCase(
        tuple(float(c) for c in seen.components()),
        tuple(float(c) for c in deflection(response.compliance, seen).components()),
        tuple(
            SpringLoad(
                s.name, s.actuated, s.joint.point is not None, float(load), _give(float(load), float(s.stiffness))
            )
            for s, load in loads
        ),
        tuple(
            replace(reaction, wrench=reaction.wrench.rotated(turn)) for reaction in joint_reactions(response, wrench)
        ),
    )


def _give(load: float, stiffness: float) -> float:
    """Deformation of a spring; an unloaded one gives nothing, free or not."""
    return load / stiffness if load else 0.0

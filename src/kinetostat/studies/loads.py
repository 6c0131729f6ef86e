"""Effects of a machine's [load]: deflection of the tool point, loads in springs and actuators, joint reactions.

The formulas are in `kinetostatics.loading`.
"""

import math
from dataclasses import replace

from kinetostat.algebra.screw import COMPONENTS, Wrench
from kinetostat.algebra.vector import Rotation
from kinetostat.display import ENGINEERING
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import Statics
from kinetostat.kinetostatics.loading import JointReaction, deflection, held_compliance, joint_reactions, spring_loads
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
        load, deformation: N·m and rad, or N and m; the deformation of a free spring that is loaded is infinite.
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
        deflection: rotation (rad) and displacement (m) of the tool point [6]; infinite where the load drives a free
            spring that moves it.
        springs: loads in all springs.
        reactions: wrenches in all joints of the legs, actuated ones among them.

    Where the load drives a free spring, there is no equilibrium: loads and reactions are then those with the free
    springs held, and the load of a free spring is what would have to hold it.
    """

    wrench: tuple[float, ...]
    deflection: tuple[float, ...]
    springs: tuple[SpringLoad, ...]
    reactions: tuple[JointReaction, ...]

    @property
    def unheld(self) -> str:
        """Which free springs the load drives, and what is still known, in words; empty where it drives none."""
        driven = [spring for spring in self.springs if math.isinf(spring.deformation)]
        if not driven:
            return ""
        show = ENGINEERING.show
        needed = ", ".join(f"{spring.name} {show(spring.load, 'N·m' if spring.turning else 'N')}" for spring in driven)
        free = [name for name, motion in zip(COMPONENTS, self.deflection, strict=True) if math.isinf(motion)]
        exact = "; the deflection is exact in all other components" if any(map(math.isfinite, self.deflection)) else ""
        return (
            f"Nothing holds the load: it moves the platform without limit in {', '.join(free)}, because springs "
            "without "
            f"stiffness would have to carry it ({needed}). Loads and reactions are those with these springs "
            f"held{exact}."
        )


def load_case(response: Response, statics: Statics, turn: Rotation) -> LoadCase | None:
    """Compute the effects of a machine's load; None where its file gives none.

    Args:
        response: of the machine, its load included; base axes.
        statics: of the machine, in the axes of the results.
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
        _deflection(statics, seen),
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


def _deflection(statics: Statics, load: Wrench) -> tuple[float, ...]:
    """C w without round-off: no component i can exceed sqrt(C_ii w C w), because C is positive semidefinite."""
    energy = sum(float(s) * float(load.work(twist)) ** 2 for twist, s in statics.motions if s < math.inf)
    moved = zip(deflection(statics, load).components(), held_compliance(statics).diagonal(), strict=True)
    bounds = [(float(c), math.sqrt(max(energy * float(entry), 0.0)) if entry else 0.0) for c, entry in moved]
    return tuple(0.0 if abs(c) < ROUND_OFF_OF_ENTRY * bound < math.inf else c for c, bound in bounds)


def _deformation(load: float, stiffness: float) -> float:
    """Deformation of a spring; a free one has none without a load, and no end to it under one."""
    return load / stiffness if stiffness else math.copysign(math.inf, load) if load else 0.0

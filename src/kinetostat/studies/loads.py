"""Effects of a machine's [load]: deflection of the tool point, loads in springs and actuators, joint reactions.

The formulas are in `kinetostatics.loading`.
"""

import math
from dataclasses import replace

import numpy as np

from kinetostat.algebra.screw import COMPONENTS, Wrench
from kinetostat.algebra.vector import Rotation
from kinetostat.arrays import Array
from kinetostat.display import ENGINEERING
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import Statics
from kinetostat.kinetostatics.loading import JointReaction, deflection, held_compliance, joint_reactions, spring_loads
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import springs
from kinetostat.spec.answer import ImmutableAnswer
from kinetostat.studies.rounding import clean_screw
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY


@dataclass(frozen=True)
class SpringLoad:
    """The load and the deformation of a spring.

    Attributes:
        name: name of the spring.
        actuated: whether it is an actuator.
        turning: whether it is a torsion spring: N·m and rad, otherwise N and m.
        load, deformation: N·m and rad, or N and m; the deformation of a free spring under load is infinite.
    """

    name: str
    actuated: bool
    turning: bool
    load: float
    deformation: float


@dataclass(frozen=True, eq=False)
class LoadCase(ImmutableAnswer):
    """A wrench on the platform at the tool point and its effects, all in the axes of K and C.

    Attributes:
        wrench: moment (N·m) and force (N) [6].
        deflection: rotation (rad) and displacement (m) of the tool point [6]; a component is infinite if a free spring
            on which the load does work moves it.
        springs: loads of all springs.
        reactions: wrenches in all joints of the legs, also in actuated ones.

    If the load does work on a free spring, there is no equilibrium: loads and reactions are then those with the free
    springs held, and the load of a free spring is the one that would hold it.
    """

    wrench: Array
    deflection: Array
    springs: tuple[SpringLoad, ...]
    reactions: tuple[JointReaction, ...]

    @property
    def unheld(self) -> str:
        """A sentence on the free springs that the load drives, and on what is still known; empty if it drives none."""
        driven = [spring for spring in self.springs if math.isinf(spring.deformation)]
        if not driven:
            return ""
        show = ENGINEERING.show
        needed = ", ".join(f"{spring.name} {show(spring.load, 'N·m' if spring.turning else 'N')}" for spring in driven)
        free = [name for name, motion in zip(COMPONENTS, self.deflection, strict=True) if math.isinf(motion)]
        exact = "; the deflection is exact in all other components" if any(map(math.isfinite, self.deflection)) else ""
        return (
            f"Nothing holds the load: it moves the platform without limit in {', '.join(free)}, because springs "
            f"without stiffness would have to carry it ({needed}). Loads and reactions are those with these springs "
            f"held{exact}."
        )


def load_case(response: Response, statics: Statics, turn: Rotation) -> LoadCase | None:
    """Compute the effects of a machine's load; None if its file gives none.

    Args:
        response: the response of the machine, its load included; base axes.
        statics: the statics of the machine, in the axes of the results.
        turn: rotation from base axes to those of the results.
    """
    wrench = response.load
    if not any(wrench.components()):
        return None
    length = float(response.configuration.length)
    load = clean_screw(wrench.rotated(turn), length)
    size = float(wrench.rotational.norm() + wrench.translational.norm() * length)
    loaded = zip(springs(response.configuration), spring_loads(response, wrench), strict=True)
    return LoadCase(
        np.array(load.components(), dtype=float),
        np.array(_deflection(statics, load)),
        tuple(_spring_load(spring, float(amount)) for spring, amount in loaded),
        tuple(
            replace(reaction, wrench=clean_screw(reaction.wrench.rotated(turn), length, size))
            for reaction in joint_reactions(response, wrench)
        ),
    )


def _deflection(statics: Statics, load: Wrench) -> tuple[float, ...]:
    """C w without round-off: no component i can exceed sqrt(C_ii w C w), because C is positive semidefinite."""
    energy = sum(float(s) * float(load.work(twist)) ** 2 for twist, s in statics.motions if s < math.inf)
    pairs = zip(deflection(statics, load).components(), held_compliance(statics).diagonal(), strict=True)
    bounds = [(float(c), math.sqrt(max(energy * float(entry), 0.0)) if entry else 0.0) for c, entry in pairs]
    return tuple(0.0 if abs(c) < ROUND_OFF_OF_ENTRY * bound < math.inf else c for c, bound in bounds)


def _spring_load(spring: Spring, load: float) -> SpringLoad:
    """The load and the deformation of a spring; a free one deforms without end under a load, and not at all without."""
    stiffness = float(spring.stiffness)
    deformation = load / stiffness if stiffness else math.copysign(math.inf, load) if load else 0.0
    return SpringLoad(spring.name, spring.actuated, spring.joint.point is not None, load, deformation)

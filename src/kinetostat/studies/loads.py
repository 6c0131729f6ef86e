"""Effects of a machine's [load]: deflection of the tool point, loads in springs and actuators, joint reactions.

The formulas are in `kinetostatics.loading`.
"""

import math
from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.screw import COMPONENTS, Wrench
from kinetostat.algebra.symmetric import SIZE
from kinetostat.algebra.vector import Rotation, Vector
from kinetostat.arrays import Array
from kinetostat.display import ENGINEERING
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import Statics
from kinetostat.kinetostatics.loading import deflection, held_compliance, joint_reactions, spring_loads
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import springs
from kinetostat.spec.immutable import ImmutableAnswer
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
class Reaction(ImmutableAnswer):
    """The wrench that a joint passes on from its platform side to its base side; its reaction is opposite to it.

    Attributes:
        leg, joint: names of the leg and of the joint.
        point: point about which the moment is taken, base frame, m: on the joint's axis, or on the carriage of a slide.
        wrench: moment (N·m) and force (N) that the platform side exerts on the base side at that point [n].
    """

    leg: str
    joint: str
    point: Vector
    wrench: Array


@dataclass(frozen=True, eq=False)
class LoadCase(ImmutableAnswer):
    """A wrench on the platform at the tool point and its effects, with the axes and the components of K and C.

    Attributes:
        components: names of the entries of all wrenches and of the deflection: rx ry rz x y z, or rz x y of a planar
            machine; a moment has the name of the rotation about its axis, a force that of the displacement along it.
        wrench: moment (N·m) and force (N) [n].
        deflection: rotation (rad) and displacement (m) of the tool point [n]; a component is infinite if a free spring
            on which the load does work moves it.
        springs: loads of all springs.
        reactions: wrenches in all joints of the legs, also in actuated ones.

    If the load does work on a free spring, there is no equilibrium: loads and reactions are then those with the free
    springs held, and the load of a free spring is the one that would hold it.
    """

    components: tuple[str, ...]
    wrench: Array
    deflection: Array
    springs: tuple[SpringLoad, ...]
    reactions: tuple[Reaction, ...]

    @property
    def unheld(self) -> str:
        """A sentence on the free springs that the load drives, and on what is still known; empty if it drives none."""
        driven = [spring for spring in self.springs if math.isinf(spring.deformation)]
        if not driven:
            return ""
        show = ENGINEERING.show
        needed = ", ".join(f"{spring.name} {show(spring.load, 'N·m' if spring.turning else 'N')}" for spring in driven)
        free = [name for name, motion in zip(self.components, self.deflection, strict=True) if math.isinf(motion)]
        exact = "; the deflection is exact in all other components" if any(map(math.isfinite, self.deflection)) else ""
        return (
            f"Nothing holds the load: it moves the platform without limit in {', '.join(free)}, because springs "
            f"without stiffness would have to carry it ({needed}). Loads and reactions are those with these springs "
            f"held{exact}."
        )


def load_case(
    response: Response, statics: Statics, turn: Rotation, kept: Sequence[int] = range(SIZE)
) -> LoadCase | None:
    """Compute the effects of a machine's load; None if its file gives none.

    Args:
        response: the response of the machine, its load included; base axes.
        statics: the statics of the machine, in the axes of the results.
        turn: rotation from base axes to those of the results.
        kept: places of the components that the machine has.
    """
    wrench = response.load
    if not any(wrench.components()):
        return None
    length = float(response.configuration.length)
    load = clean_screw(wrench.rotated(turn), length)
    size = float(wrench.rotational.norm() + wrench.translational.norm() * length)
    loaded = zip(springs(response.configuration), spring_loads(response, wrench), strict=True)
    return LoadCase(
        tuple(COMPONENTS[i] for i in kept),
        np.array(load.components(), dtype=float)[[*kept]],
        np.array(_deflection(statics, load))[[*kept]],
        tuple(_spring_load(spring, float(amount)) for spring, amount in loaded),
        tuple(
            Reaction(
                reaction.leg,
                reaction.joint,
                reaction.point,
                np.array(clean_screw(reaction.wrench.rotated(turn), length, size).components(), dtype=float)[[*kept]],
            )
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

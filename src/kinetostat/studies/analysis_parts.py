"""Indices of a pose and the effects of a load on the machine there: what an analysis has beside K and C.

Wrenches and twists are at the tool point, in one set of axes, in the order rx ry rz x y z, without round-off. The
formulas are in `kinetostatics`.
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
from kinetostat.kinetostatics.eigenscrews import (
    Eigenscrew,
    Point,
    centre_of_compliance,
    centre_of_elasticity,
    centre_of_stiffness,
    compliance_eigenscrews,
    eigenscrews,
)
from kinetostat.kinetostatics.indices import (
    SPATIAL,
    PrincipalCompliances,
    PrincipalStiffness,
    free_stiffnesses,
    guided_stiffnesses,
    principal_compliances,
    stiffness_condition,
)
from kinetostat.kinetostatics.loading import deflection, held_compliance, joint_reactions, spring_loads
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import springs
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.cleaning import clean_screw
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY


@former_names(principal="principal_compliances", condition="stiffness_condition")
@dataclass(frozen=True, eq=False)
class Indices(ImmutableAnswer):
    """Indices of a pose, at T and in the axes of K and C.

    Attributes:
        principal_compliances: principal compliances by block; None if a direction is free.
        free, guided: principal stiffnesses by block, with the other block free or held (`kinetostatics.indices`).
        stiffness_condition: condition number of K, with rotations times the characteristic length; infinite if the
            machine is rigid or free in a direction.
        centres: centres of stiffness, compliance and elasticity, from T, m; None for a centre that does not exist.
        eigenscrews: eigenscrews of K, or of C if K is not finite; empty for a planar machine.
    """

    principal_compliances: dict[str, PrincipalCompliances] | None
    free: dict[str, PrincipalStiffness] | None
    guided: dict[str, PrincipalStiffness] | None
    stiffness_condition: float
    centres: dict[str, Point | None]
    eigenscrews: tuple[Eigenscrew, ...]


def indices_of(
    stiffness: Array | None, compliance: Array | None, length: float, components: tuple[int, ...]
) -> Indices:
    """Compute every index that K [n x n] and C [n x n] give; either matrix may be missing.

    Args:
        stiffness, compliance: K and C [n x n]; None for one that is not finite.
        length: characteristic length, m.
        components: the components of their rows, from rx ry rz x y z = 0 ... 5.
    """
    screws: list[Eigenscrew] = []
    if components == SPATIAL:
        if stiffness is not None:
            screws = eigenscrews(stiffness)
        elif compliance is not None:
            screws = compliance_eigenscrews(compliance)
    return Indices(
        principal_compliances=None if compliance is None else principal_compliances(compliance, components),
        free=free_stiffnesses(stiffness, compliance, components),
        guided=guided_stiffnesses(stiffness, compliance, components),
        stiffness_condition=stiffness_condition(stiffness, compliance, length, components),
        centres={
            "stiffness": centre_of_stiffness(stiffness, components),
            "compliance": centre_of_compliance(compliance, components),
            "elasticity": centre_of_elasticity(stiffness, compliance, components),
        },
        eigenscrews=tuple(screws),
    )


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
    response: Response, statics: Statics, turn: Rotation, components: Sequence[int] = range(SIZE)
) -> LoadCase | None:
    """Compute the effects of a machine's load; None if its file gives none.

    Args:
        response: the response of the machine, its load included; base axes.
        statics: the statics of the machine, in the axes of the results.
        turn: rotation from base axes to those of the results.
        components: numbers of the components that the machine has, from rx ry rz x y z = 0 ... 5.
    """
    wrench = response.load
    if not any(wrench.components()):
        return None
    length = float(response.configuration.length)
    load = clean_screw(wrench.turned_by(turn), length)
    size_of_load = float(wrench.rotational.norm() + wrench.translational.norm() * length)
    rows = list(components)
    loads_of_springs = zip(springs(response.configuration), spring_loads(response, wrench), strict=True)
    reactions = []
    for at_joint in joint_reactions(response, wrench):
        cleaned = clean_screw(at_joint.wrench.turned_by(turn), length, size_of_load)
        passed_on = np.array(cleaned.components(), dtype=float)[rows]
        reactions.append(Reaction(leg=at_joint.leg, joint=at_joint.joint, point=at_joint.point, wrench=passed_on))
    return LoadCase(
        components=tuple(COMPONENTS[i] for i in components),
        wrench=np.array(load.components(), dtype=float)[rows],
        deflection=np.array(_deflection(statics, load))[rows],
        springs=tuple(_spring_load(spring, float(amount)) for spring, amount in loads_of_springs),
        reactions=tuple(reactions),
    )


def _deflection(statics: Statics, load: Wrench) -> tuple[float, ...]:
    """C w without round-off: no component i can exceed sqrt(C_ii w C w), because C is positive semidefinite."""
    energy = sum(float(s) * float(load.work(twist)) ** 2 for twist, s in statics.motions if s < math.inf)  # w C w
    motions = [float(component) for component in deflection(statics, load).components()]
    entries = [float(entry) for entry in held_compliance(statics).diagonal()]
    bounds = [math.sqrt(max(energy * entry, 0.0)) if entry else 0.0 for entry in entries]
    pairs = zip(motions, bounds, strict=True)
    return tuple(0.0 if abs(motion) < ROUND_OFF_OF_ENTRY * bound < math.inf else motion for motion, bound in pairs)


def _spring_load(spring: Spring, load: float) -> SpringLoad:
    """The load and the deformation of a spring; a free one deforms without end under a load, and not at all without."""
    stiffness = float(spring.stiffness)
    without_stiffness = math.copysign(math.inf, load) if load else 0.0
    return SpringLoad(
        name=spring.name,
        actuated=spring.actuated,
        turning=spring.joint.point is not None,
        load=load,
        deformation=load / stiffness if stiffness else without_stiffness,
    )

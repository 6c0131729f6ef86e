"""The parts of an analysis beside K and C: indices, stiffness along a direction, effects of a load; none is round-off.

Entries of a result that are only round-off beside its other entries are set to zero, and no other digit is touched.
Screws and matrices are at one point, in one set of axes, in the order rx ry rz x y z. The formulas are in
`kinetostatics`.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar
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
    Block,
    Principal,
    PrincipalStiffness,
    free_stiffness_along,
    free_stiffnesses,
    guided_stiffness_along,
    guided_stiffnesses,
    principal_compliances,
    stiffness_condition,
)
from kinetostat.kinetostatics.leg import AnyScrew
from kinetostat.kinetostatics.loading import deflection, held_compliance, joint_reactions, spring_loads
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import springs
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY

LARGEST_COMPONENT = 1e100
"""Greatest component of a direction, whose square is still a finite number."""


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

    principal_compliances: dict[str, Principal] | None
    free: dict[str, PrincipalStiffness] | None
    guided: dict[str, PrincipalStiffness] | None
    stiffness_condition: float
    centres: dict[str, Point | None]
    eigenscrews: tuple[Eigenscrew, ...]


@dataclass(frozen=True, eq=False)
class Along(ImmutableAnswer):
    """Stiffness along one direction, in the axes of K and C. What is `held` here is `guided` in `Indices`.

    Attributes:
        direction: the direction as it was given [3].
        force, force_held: force per displacement along it, N/m, with rotations free and with rotations held; None if
            the machine has no such direction, or the stiffness no finite value.
        moment, moment_held: moment per angle about it, N·m/rad, with the tool point free and with it held.
    """

    direction: Array
    force: float | None
    force_held: float | None
    moment: float | None
    moment_held: float | None


def stiffness_along(
    direction: Sequence[float], stiffness: Array | None, compliance: Array | None, components: tuple[int, ...]
) -> Along:
    """Compute the stiffness of the tool point along and about a direction.

    Args:
        direction: a vector of any length, in the axes of K and C [3].
        stiffness, compliance: K and C [n x n]; None for one that is not finite.
        components: the components of their rows, from rx ry rz x y z = 0 ... 5.

    Raises:
        InputError: the direction has no length, or none in the plane of a planar machine.
    """
    direction = three_numbers(direction)

    def along(block: Block, function: Callable[..., float | None]) -> float | None:
        try:
            return function(direction, block, stiffness, compliance, components)
        except ValueError:  # the direction is zero or not one of this block; below, one of neither block is refused
            return None

    force, force_held = along("translation", free_stiffness_along), along("translation", guided_stiffness_along)
    moment, moment_held = along("rotation", free_stiffness_along), along("rotation", guided_stiffness_along)
    if all(value is None for value in (force, force_held, moment, moment_held)):
        raise InputError(
            f"The direction {shorten(direction)} is zero, or perpendicular to the plane of this machine; give three "
            "numbers, e.g. (1, 0, 0), on the command line --along 1,0,0."
        )
    return Along(
        direction=np.array(direction), force=force, force_held=force_held, moment=moment, moment_held=moment_held
    )


def three_numbers(direction: Sequence[float]) -> tuple[float, ...]:
    """A direction as three finite floats of a size that can be squared.

    Raises:
        InputError: it is not three finite numbers.
    """
    entries = [] if isinstance(direction, str) or not isinstance(direction, Iterable) else list(direction)
    numbers = [float(c) for c in entries if isinstance(c, Real) and not isinstance(c, bool)]
    if len(entries) != 3 or len(numbers) != 3 or not all(abs(c) <= LARGEST_COMPONENT for c in numbers):
        raise InputError(
            f"The direction is {shorten(direction)}; give three finite numbers, e.g. (0, 0, 1), on the command line "
            "--along 0,0,1; its length does not matter."
        )
    return tuple(numbers)


def unit_direction(direction: Sequence[float], name: str) -> tuple[float, ...]:
    """A direction at unit length.

    Args:
        direction: three numbers of any size.
        name: name of the argument, for messages.

    Raises:
        InputError: it is not three finite numbers, or zero.
    """
    numbers = three_numbers(direction)
    size = math.hypot(*numbers)
    if size == 0.0:
        raise InputError(f"{name} is {shorten(direction)}; give three numbers that are not all zero, e.g. (0, 0, 1).")
    return tuple(c / size for c in numbers)


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


def indices_json(indices: Indices) -> dict[str, Any]:
    """The indices as plain data, for the JSON of an analysis."""
    compliances = (indices.principal_compliances or {}).items()
    stiffnesses = {"free": indices.free or {}, "guided": indices.guided or {}}
    return {
        "principal_compliances": {
            block: {"values": c.compliances, "directions": c.directions} for block, c in compliances
        }
        or None,
        "principal_stiffnesses": {
            kind: {block: {"values": k.stiffnesses, "directions": k.directions} for block, k in blocks.items()}
            for kind, blocks in stiffnesses.items()
        },
        "stiffness_condition": indices.stiffness_condition,
        "centres": indices.centres,
        "eigenscrews": indices.eigenscrews,
    }


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
    loads_of_springs = zip(springs(response.configuration), spring_loads(response, wrench), strict=True)
    return LoadCase(
        components=tuple(COMPONENTS[i] for i in kept),
        wrench=np.array(load.components(), dtype=float)[[*kept]],
        deflection=np.array(_deflection(statics, load))[[*kept]],
        springs=tuple(_spring_load(spring, float(amount)) for spring, amount in loads_of_springs),
        reactions=tuple(
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
    return SpringLoad(
        name=spring.name,
        actuated=spring.actuated,
        turning=spring.joint.point is not None,
        load=load,
        deformation=deformation,
    )


def clean_screw(screw: AnyScrew, length: float, least: float = 0.0) -> AnyScrew:
    """Set components of a screw that are only round-off to zero.

    Args:
        screw: a screw of floats.
        length: factor of its last three components that makes them comparable with the first three: in m for a wrench,
            in 1/m for a twist.
        least: size of the sum that the screw is a part of, measured as its first three components.
    """
    sizes = [abs(c) * scale for c, scale in zip(screw.components(), [1.0] * 3 + [length] * 3, strict=True)]
    limit = ROUND_OFF_OF_ENTRY * max(least, *sizes)
    components = [float(c) if size > limit else 0.0 for c, size in zip(screw.components(), sizes, strict=True)]
    return type(screw)(Vector(*components[:3]), Vector(*components[3:]))


def clean_matrix(rows: Sequence[Sequence[float]], share: float = ROUND_OFF_OF_ENTRY) -> list[list[float]]:
    """Set entries of K or C [n x n] to zero that are below a share of the geometric mean of both diagonal entries."""
    sizes = [abs(row[i]) for i, row in enumerate(rows)]
    return [
        [0.0 if abs(c) < share * math.sqrt(size * other) else c for c, other in zip(row, sizes, strict=True)]
        for row, size in zip(rows, sizes, strict=True)
    ]


def clean_statics(statics: Statics) -> Statics:
    """The same statics with exact zeros where a component of a screw is only round-off.

    What K and C are summed of is cleaned together: a component that is small beside the others of a soft direction may
    be all that couples it with a stiff one.
    """
    length = statics.length
    return replace(
        statics,
        flexibility=tuple(clean_screw(twist, 1.0 / length) for twist in statics.flexibility),
        resistance=tuple(clean_screw(wrench, length) for wrench in statics.resistance),
        motions=_clean_sum(statics.motions, 1.0 / length),
        actions=_clean_sum(statics.actions, length),
    )


def _clean_sum(shares: Sequence[tuple[AnyScrew, Scalar]], length: float) -> tuple[tuple[AnyScrew, Scalar], ...]:
    """Screws with their weights, with zeros in components that are round-off in every screw of the sum.

    Where the weight is infinite, of a free or a rigid spring, a component that is round-off would become infinite: it
    is zero there whatever the other screws are.
    """
    cleaned = [clean_screw(screw, length).components() for screw, weight in shares if weight > 0.0]
    is_reached = [any(components) for components in zip(*cleaned, strict=True)] or [False] * SIZE
    result = []
    for screw, weight in shares:
        if math.isinf(weight):
            result.append((clean_screw(screw, length), weight))
            continue
        numbers = [float(c) if reached else 0.0 for c, reached in zip(screw.components(), is_reached, strict=True)]
        result.append((type(screw)(Vector(*numbers[:3]), Vector(*numbers[3:])), weight))
    return tuple(result)

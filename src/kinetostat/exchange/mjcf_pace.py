"""Masses, time step, armature and damping of a machine in MuJoCo: as it comes to rest soon, or as it vibrates.

Static deflections depend on none of them; accuracy and the time to come to rest do. MuJoCo's constraints are soft: a
closed loop has a compliance of about (1 - d) t² / m, with d at most 0.9999 and t at least two time steps. So the step
follows from how large that compliance may be compared with the machine's.

A machine that vibrates has its own masses, no damping, and steps for its fastest springs. Its links are spread over the
bodies of `mjcf_model`: a rod that belongs to one body is rigid, a strut is two halves that slide along each other, and
a link that bends is two rigid halves.

Source: MuJoCo documentation, Computation, section on the constraint model (impedance and reference acceleration).
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from kinetostat.arrays import Array
from kinetostat.exchange.formats import reference_point
from kinetostat.exchange.mjcf_model import Body, Freedom, Model
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint, Spring
from kinetostat.machine.loads import PLATFORM, Mass, located_members
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.tolerances import COINCIDENT, COINCIDENT_HINGES, RIGID_BLOCK, SOFT_CONSTRAINT
from kinetostat.validation.pieces import (
    Heavy,
    HeavyLink,
    Piece,
    array,
    has_rotors,
    joint_of,
    links,
    on_platform,
    one_body,
    pieces,
    rotor_inertia,
    thin_rod,
)

NOMINAL_MASS = 1.0
"""Mass of every body where none is known, kg: deflections do not depend on it."""
GYRATION = 0.25
"""Radius of gyration of every body, as a share of the machine's characteristic length: deflections do not
depend on it, and a part of this size turns about as fast as it moves."""
IMPEDANCE = 0.9999
"""d in the text above: the stiffest constraint that MuJoCo allows."""
LEAST_STEPS = 2.0
"""Time constant of a constraint in time steps: the shortest that MuJoCo allows."""
DAMPING = 0.7
"""Damping ratio of the machine's slowest motion: it comes to rest after one swing."""
SETTLING_ROOTS = 20.0
"""Time after which a load has settled, in units of 1/omega of the slowest motion: with a damping ratio of 0.7, e^-14 is
left of a deflection."""
SETTLING_PERIODS = 10
"""Periods of the slowest motion that are worth looking at where nothing is damped."""
ARMATURE_ROOT = 2.0
"""Square root of a spring's armature over its stiffness, in units of the geometric mean of step and damping time:
smaller, springs would be too fast for the step; larger, they would still swing where the machine has come to rest."""
UNKNOWN_COMPLIANCE = 1e-7
"""Compliance that is assumed where the machine is free or rigid, m/N: that of a machine of 10 N/um."""
LIGHT_SHARE = 2e-5
"""Mass of a body that has none, as a share of all known masses: the engine moves no body without a mass."""
THIN_SHARE = 1e-3
"""Radius of gyration of a rod about its own axis, as a share of its length: the engine turns none without inertia."""
SHARE_BETWEEN_SPRINGS = 1e-3
"""Inertia between springs in a row, as a share of the inertia that hangs on them. The engine needs some; ten times less
would take three times as many steps, and ten times more would lower frequencies by up to half a percent."""
STEPS_OF_SPRING = 8.0
"""Steps in a period of the fastest spring with what hangs on it: pi of them are the limit of stability. The engine's
steps raise frequencies by (omega step)²/24: with eight by 3 % for the fastest spring, by far less for slow motions."""


@dataclass(frozen=True)
class Pace:
    """The pace of a model: its time step, and the masses and dampings that go with it.

    Attributes:
        step: time step, s.
        retardation: damping of a spring per its stiffness, s.
        settling: time after which a deflection has come to rest, s.
        inertias: mass, its centre and inertia of every body, by its name.
        armatures: inertia added to joints by name, kg or kg·m²; joints without a name here get none.
        carried: further masses on the platform.
    """

    step: float
    retardation: float
    settling: float
    inertias: dict[str, Heavy]
    armatures: dict[str, float]
    carried: tuple[Heavy, ...] = ()

    def damping(self, stiffness: float) -> float:
        """Return the damping of a joint with a spring, N·s/m or N·m·s/rad."""
        return stiffness * self.retardation


def pace_of(analysis: Analysis, model: Model) -> Pace:
    """Return a pace with accurate constraints, springs that the time step can follow, and little swinging."""
    masses = _masses(model, analysis.masses)
    length = float(analysis.characteristic_length or 1.0)
    gyration = GYRATION * length
    step = step_for(analysis, min(masses.values()), gyration)
    root = math.sqrt(max(compliances(analysis, length)) * sum(masses.values()))  # 1/omega of the slowest motion
    places = {body.name: body.origin for body in model.world.subtree()}
    places[model.platform.name] = np.array(reference_point(analysis))  # so that loads on the platform act there
    inertias = {name: Heavy(mass, places[name], mass * gyration**2 * np.eye(3)) for name, mass in masses.items()}
    retardation = 2.0 * DAMPING * root
    # So that no spring is too fast for the time step.
    armatures = {
        freedom.name: freedom.stiffness * ARMATURE_ROOT**2 * retardation * step
        for body in _moving_bodies(model)
        for freedom in body.freedoms
    }
    return Pace(step, retardation, SETTLING_ROOTS * root, inertias, armatures)


def step_for(analysis: Analysis, least_mass: float, gyration: float) -> float:
    """Return the time step (s) with which constraints are stiff enough, for a least mass (kg) and its gyration (m)."""
    least_compliance = min(compliances(analysis, gyration))
    return math.sqrt(SOFT_CONSTRAINT * least_compliance * least_mass / (1.0 - IMPEDANCE)) / LEAST_STEPS


def compliances(analysis: Analysis, arm: float) -> list[float]:
    """Return sizes of the compliant blocks of C, m/N; rotation as a point at an arm (m) moves under a force there."""
    if analysis.compliance is None:
        return [UNKNOWN_COMPLIANCE]
    matrix = np.array(analysis.compliance)
    turns = np.array([name.startswith("r") for name in analysis.components])
    translation, rotation = (float(np.linalg.norm(matrix[np.ix_(block, block)])) for block in (~turns, turns))
    sizes = translation, rotation * arm**2
    return [size for size in sizes if size > RIGID_BLOCK * max(sizes)] or [UNKNOWN_COMPLIANCE]


def _masses(model: Model, parts: Sequence[Mass]) -> dict[str, float]:
    """Return the mass of every body, kg: the known masses of a leg are spread evenly over its bodies.

    Bodies of legs without known masses get the mean of the others.
    """
    bodies, known = _moving_bodies(model), [(part, float(part.mass)) for part in parts if part.mass is not None]
    masses: dict[str, float] = {}
    for body in bodies:
        of_leg = sum(mass for part, mass in known if part.leg == body.leg)
        masses[body.name] = of_leg / sum(other.leg == body.leg for other in bodies)
    masses[model.platform.name] = sum(mass for part, mass in known if part.name == PLATFORM)
    positive = [mass for mass in masses.values() if mass > 0.0]
    mean = sum(positive) / len(positive) if positive else NOMINAL_MASS
    return {name: mass or mean for name, mass in masses.items()}


def vibrating_pace(analysis: Analysis, model: Model) -> Pace:
    """Return the machine's masses on its bodies, and a time step that follows all of its springs.

    Args:
        analysis: the analysis of the machine.
        model: the model of its bodies.

    Raises:
        InputError: if nothing has a mass.
    """
    machine, joints, configuration = analysis.machine, analysis.state.joints, analysis.state.configuration
    carried = tuple(on_platform(machine, configuration.platform))
    members = located_members(machine, configuration, None if joints is None else joints.coordinates)
    parts, slide_armatures = _parts_by_body(model, configuration, links(members, configuration))
    known_mass = sum(part.mass for parts_of_body in (carried, *parts.values()) for part in parts_of_body)
    if known_mass == 0.0:
        raise InputError(
            'Nothing of this machine has a mass, so that it cannot vibrate; give it one, e.g. --set tool.mass="5 kg".'
        )
    gyration = GYRATION * float(analysis.characteristic_length or 1.0)
    light = LIGHT_SHARE * known_mass
    places = {body.name: body.origin for body in _moving_bodies(model)}
    places[model.platform.name] = np.array(reference_point(analysis))
    inertias = {
        name: one_body(parts[name]) if name in parts else Heavy(light, place, light * gyration**2 * np.eye(3))
        for name, place in places.items()
    }
    # A platform that carries masses is heavier than its entry here, which may be that of a body without a mass.
    least_mass = min(part.mass for name, part in inertias.items() if name != model.platform.name or not carried)
    between_springs = _inertias_between_springs(_moving_bodies(model), inertias)
    sources = _rotors(machine, model), slide_armatures, between_springs
    armatures = {name: sum(source.get(name, 0.0) for source in sources) for source in sources for name in source}
    spring_steps = _steps_for_springs(_moving_bodies(model), inertias, between_springs)
    step = min([step_for(analysis, least_mass, gyration), *spring_steps])
    period = 2.0 * math.pi * math.sqrt(max(compliances(analysis, gyration)) * known_mass)
    return Pace(
        step=step,
        retardation=0.0,
        settling=SETTLING_PERIODS * period,
        inertias=inertias,
        armatures=armatures,
        carried=carried,
    )


def _moving_bodies(model: Model) -> list[Body]:
    """Return the bodies of the legs."""
    return [body for body in model.world.subtree() if body is not model.world]


def _rotors(machine: Machine, model: Model) -> dict[str, float]:
    """Return the inertia that rotors add to the joints of their actuators, by the names of these."""
    if not has_rotors(machine):
        return {}
    freedoms = [freedom for body in _moving_bodies(model) for freedom in body.freedoms]
    return {freedom.name: rotor_inertia(machine, freedom.drive) for freedom in freedoms if freedom.drive}


def _parts_by_body(
    model: Model, configuration: Configuration, parts: Iterable[HeavyLink]
) -> tuple[dict[str, list[Heavy]], dict[str, float]]:
    """Return the parts of links that each body carries, by its name, and armatures of slides in rods, by theirs.

    A rod between two bodies is two halves. Where one of them slides by q against the other, both have m/12 q² more
    kinetic energy than a rod that stretches evenly: so the slide has the armature -m/6.
    """
    heavy: defaultdict[str, list[Heavy]] = defaultdict(list)
    armatures: defaultdict[str, float] = defaultdict(float)
    chains = [pieces(leg, configuration.plane) for leg in configuration.legs]
    for link in parts:
        if len(link.points) == 1:
            body = model.chains[link.leg][link.bodies[0]]
            heavy[body.name].append(Heavy(link.mass, link.points[0], link.inertia))
            continue
        for (near, far), (start, end), mass in _rods_of_link(link, model, chains[link.leg]):
            if near is far:
                heavy[near.name].append(rod(mass, start, end))
                continue
            middle = 0.5 * (start + end)
            heavy[near.name].append(rod(0.5 * mass, start, middle))
            heavy[far.name].append(rod(0.5 * mass, middle, end))
            for freedom in far.freedoms:
                if not freedom.is_hinge and _is_along(freedom.axis, end - start):
                    armatures[freedom.name] -= mass / 6.0
    return heavy, armatures


def _rods_of_link(
    link: HeavyLink, model: Model, chain: Sequence[Piece]
) -> Iterator[tuple[tuple[Body, Body], tuple[Array, Array], float]]:
    """Give the rods of a link, which are two in a parallelogram: bodies and points of both ends, and the mass, kg."""
    bodies, first, last = model.chains[link.leg], link.bodies[0], link.bodies[-1]
    start, end = link.points
    if bar := _bar_at(model, link.leg, start):
        yield bar, (start, end), link.mass
        return
    # A joint at an end of the link leaves this end where it is, so that the body next to it carries the link as well.
    while first < last and _turns_at(chain[first], start):
        first += 1
    while first < last and _turns_at(chain[last - 1], end):
        last -= 1
    bars = model.bars.get((link.leg, first), []) if last == first + 1 else []
    pairs = bars or [(bodies[first], bodies[last])]
    for near, far in pairs:
        shift = near.origin - start if len(pairs) > 1 else np.zeros(3)
        yield (near, far), (start + shift, end + shift), link.mass / len(pairs)


def _bar_at(model: Model, leg: int, start: Array) -> tuple[Body, Body] | None:
    """Return the halves of that bar of a parallelogram of a leg that starts at a point, if there is one."""
    for (number, _), bars in model.bars.items():
        for near, far in bars if number == leg and len(bars) > 1 else ():
            if float(np.linalg.norm(near.origin - start)) < COINCIDENT_HINGES:
                return near, far
    return None


def _is_along(axis: Array, span: Array) -> bool:
    """Return whether a unit axis and a span have one direction."""
    return bool(abs(axis @ span) > (1.0 - COINCIDENT) * np.linalg.norm(span))


def _turns_at(piece: Piece, point: Array) -> bool:
    """Return whether a piece leaves a point where it is, so that the bodies on both sides of it carry the point."""
    if not isinstance(piece, Joint | Spring):
        return False
    joint = joint_of(piece)
    if joint.point is None or joint.pitch != 0.0:
        return False
    return float(np.linalg.norm(np.cross(array(joint.point) - point, array(joint.axis)))) < COINCIDENT_HINGES


def rod(mass: float, start: Array, end: Array) -> Heavy:
    """Return a straight uniform rod (kg) between two points (m)."""
    span, thin = end - start, thin_rod(mass, start, end)
    return Heavy(mass, thin.centre, thin.inertia + mass * THIN_SHARE**2 * np.outer(span, span))


def _inertias_between_springs(bodies: list[Body], inertias: dict[str, Heavy]) -> dict[str, float]:
    """Return the little inertia that each spring in a row on one body gets, kg or kg·m², by the spring's name."""
    return {
        freedom.name: SHARE_BETWEEN_SPRINGS * _moved_inertia(freedom, inertias[body.name])
        for body in bodies
        for freedom in body.freedoms
        if freedom.stiffness > 0.0 and len(body.freedoms) > 1
    }


def _steps_for_springs(
    bodies: list[Body], inertias: dict[str, Heavy], between_springs: dict[str, float]
) -> list[float]:
    """Return a time step for each spring, s, by the inertia that hangs on it."""
    pairs = [
        (between_springs.get(freedom.name, _moved_inertia(freedom, inertias[body.name])), freedom.stiffness)
        for body in bodies
        for freedom in body.freedoms
        if freedom.stiffness > 0.0
    ]
    return [2.0 * math.pi * math.sqrt(inertia / stiffness) / STEPS_OF_SPRING for inertia, stiffness in pairs]


def _moved_inertia(freedom: Freedom, part: Heavy) -> float:
    """Return the inertia of a body that a freedom moves, kg or kg·m²."""
    if freedom.point is None:
        return part.mass
    arm = np.cross(part.centre - freedom.point, freedom.axis)
    return float(freedom.axis @ part.inertia @ freedom.axis + part.mass * (arm @ arm))

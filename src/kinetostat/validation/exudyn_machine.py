"""The compliance and the natural frequencies of a machine by Exudyn; closed loops of any kind.

The multibody system is built from points, axes and cross-sections: rigid bodies, exact constraints and springs, made by
`exudyn_bodies`. Six unit wrenches act on it one by one, both in its linearised equations and as small finite loads on
the nonlinear ones. For the frequencies masses are added: links are rods between two bodies, with the kinetic energy of
all their points; the bodies themselves have none.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import state_of
from kinetostat.machine.leg import Joint, Spring
from kinetostat.machine.link import Beam, Parallelogram
from kinetostat.machine.machine import Configuration, Machine, Plane
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import IDLE_MOTION, MASSLESS_MODE, NEWTON_STATICS, NO_MOMENTUM, UNBALANCED_LOAD, UNMOVED
from kinetostat.validation.comparison import Answer, Trial
from kinetostat.validation.exudyn_bodies import TRANSLATION_FIRST, EngineBody, Multibody
from kinetostat.validation.machine_from_file import MachineFromFile, machine_from_file
from kinetostat.validation.pieces import (
    Piece,
    StrutPiece,
    array,
    columns,
    end_compliance,
    has_rotors,
    in_plane,
    joint_of,
    links,
    on_platform,
    pieces,
    rotor_inertia,
    section_axes,
)

MOTION_SHARES = (1e-3, 1e-4, 1e-5)
"""Motions of the platform by finite loads, rad or share of the machine's length: the difference from small loads falls
with the square of the motion, until round-off, which grows with its reciprocal, exceeds it."""
VARIED_MOTION = "how far loads move the platform, rad or share of the machine's length"
BALANCED = 10.0 * float(np.finfo(float).eps)
"""Imbalance of forces that ends Newton's method where the greatest stiffness is 1: below it round-off decides."""
MOST_NEWTON_STEPS = 30
"""Steps of Newton's method at most: far more than it takes where a load step converges at all."""
ALL = (True,) * 6
"""All of rx ry rz x y z: constrained in a rigid connection, moving in space."""
FACTORED_ONCE_FROM = 200
"""Coordinates from which Newton's steps share the factors of a matrix: these take the cube of the number, and most of
the time. A few more steps are then taken, which stop somewhat farther from balance."""
Z_AXIS = 2
"""Number of the third axis among components: of rotations; that of translations is 3 more."""
PLANAR_JOINT = (True, True, False, False, False, True)
"""Constrained components of rx ry rz x y z where z is the normal."""


def solve(configuration: Configuration, reference: Vector) -> Answer:
    """Return C from the engine's linearised equations, confirmed by its nonlinear statics under ever smaller loads.

    Args:
        configuration: the placed machine.
        reference: the point where loads act and motions are read, base frame, m.

    Raises:
        InputError: if the machine has a part that cannot be built, or a motion that nothing resists.
    """
    length = float(configuration.length)
    model, _ = build(configuration, reference)
    model.system.Assemble()
    greatest = float(np.max(np.abs(model.system.ComputeLinearizedSystem(settings_of(model))[1]))) or 1.0
    model, platform = build(configuration, reference, unit=greatest)
    tangent = _tangent(model, platform)
    if not np.any(tangent):
        return Answer(tangent, tangent, VARIED_MOTION, ())
    trials = tuple(_finite_loads(model, platform, tangent, length))
    return Answer(tangent, _without_load(trials), VARIED_MOTION, trials)


def _without_load(trials: tuple[Trial, ...]) -> Array | None:
    """Return C under the two smallest loads extrapolated to none: central differences err by the load squared."""
    if len(trials) < 2:
        return None
    small, large = trials[:2]
    ratio = (large.scale / small.scale) ** 2
    return (ratio * small.compliance - large.compliance) / (ratio - 1.0)


def _tangent(model: Multibody, platform: EngineBody) -> Array:
    """Return C of the unloaded system; the engine linearises and projects onto what its constraints leave free."""
    model.system.Assemble()
    system = model.system.ComputeLinearizedSystem(
        settings_of(model), projectIntoConstraintNullspace=True, returnConstraintNullspace=True
    )
    stiffness = system[1]
    free = np.asarray(system[4]) if len(system) > 3 else np.eye(len(stiffness))
    rows = model.system.GetNodeODE2Index(platform.node) + np.array(TRANSLATION_FIRST)
    loads = free[:, rows] / model.unit
    if not loads.size:
        return np.zeros((6, 6))
    motion = np.linalg.lstsq(stiffness, loads, rcond=IDLE_MOTION)[0]
    if np.max(np.abs(stiffness @ motion - loads)) > UNBALANCED_LOAD * np.max(np.abs(loads)):
        raise InputError(
            "Exudyn finds a motion that nothing resists in comparison with the machine's stiffest parts: either the "
            "machine is free, or its stiffnesses differ by more than about nine decades."
        )
    return np.asarray((free.T @ motion)[rows])


def _finite_loads(model: Multibody, platform: EngineBody, tangent: Array, length: float) -> Iterable[Trial]:
    """Give C by nonlinear statics with loads that move the platform by `MOTION_SHARES`, smallest first."""
    unit_loads = _loads_for_unit_motion(tangent, length)
    acting = np.flatnonzero(unit_loads)
    shares = sorted(MOTION_SHARES)
    signs = np.tile([1.0, -1.0], len(acting))[:, None]
    pairs = np.repeat(unit_loads[acting, None] * np.eye(6)[acting], 2, axis=0) * signs
    displacements = _displacements(model, platform, np.concatenate([share * pairs for share in shares]) / model.unit)
    for share, ends in zip(shares, np.split(displacements, np.arange(1, len(shares)) * len(pairs)), strict=True):
        if len(ends) == len(pairs):
            compliance = np.zeros((6, 6))
            compliance[:, acting] = (ends[::2] - ends[1::2]).T / (2.0 * share * unit_loads[acting])
            yield Trial(share, compliance)


def _loads_for_unit_motion(tangent: Array, length: float) -> Array:
    """Return the size of each wrench, N or N·m, that would move the platform by 1 rad or `length` (m), at least.

    A wrench that moves nothing gets the size of the others; one that a planar machine does not have is 0.
    """
    arms = np.repeat([length, 1.0], 3)
    motion = np.max(np.abs(tangent) * np.repeat([1.0, 1.0 / length], 3)[:, None], axis=0) / arms
    exists = np.any(tangent != 0.0, axis=0)
    moves = motion > UNMOVED * np.max(motion)
    return np.asarray(exists / (np.where(moves, motion, np.max(motion)) * arms))


def _displacements(model: Multibody, platform: EngineBody, wrenches: Array) -> Array:
    """Return the displacements of the platform (rad, m) under wrenches [n x 6] in the engine's unit of force.

    The wrenches are steps of one run, from no load on, so that all of them can share the factors of one matrix. Where a
    step does not converge the run ends, and there are fewer displacements than wrenches.
    """
    system, engine, items = model.system, model.engine, model.items
    marker = model.add_marker(platform, platform.origin, np.eye(3))
    steps = np.vstack([np.zeros(6), wrenches])

    def part_of_load(part: slice) -> Any:
        return lambda _system, time, _load: list(steps[round(time * len(wrenches)), part])

    for kind, part in ((items.Torque, slice(3)), (items.Force, slice(3, 6))):
        system.AddLoad(kind(markerNumber=marker, loadVector=[0.0] * 3, loadVectorUserFunction=part_of_load(part)))
    displacements = np.empty((len(steps), 6))
    count = 0

    def note(_system: Any, time: float) -> bool:
        nonlocal count
        count = round(time * len(wrenches))
        displacements[count] = system.GetNodeOutput(platform.node, engine.OutputVariableType.Coordinates)
        return True

    system.SetPostStepUserFunction(note)
    system.Assemble()
    settings = settings_of(model)
    settings.staticSolver.numberOfLoadSteps = len(wrenches)
    engine.MainSolverStatic().SolveSystem(system, settings)
    return displacements[1 : 1 + count, TRANSLATION_FIRST]


def settings_of(model: Multibody) -> Any:
    """Return settings: silent, no files, and a solver that copes with redundant constraints and idle motions."""
    settings = model.engine.SimulationSettings()
    settings.linearSolver.solverType = model.engine.LinearSolverType.EigenDense
    settings.linearSolver.ignoreSingularJacobian = True
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.adaptiveStep = False
    settings.solution.file.write = False
    newton = settings.staticSolver.newton
    newton.relativeTolerance = NEWTON_STATICS
    newton.absoluteTolerance = BALANCED
    newton.maxIterations = MOST_NEWTON_STEPS
    newton.useModifiedNewton = model.system.systemData.ODE2Size() > FACTORED_ONCE_FROM
    return settings


def build(
    configuration: Configuration, reference: Vector, unit: float = 1.0, preloaded: bool = False, struts: bool = True
) -> tuple[Multibody, EngineBody]:
    """Build the machine, and return it and its platform.

    Args:
        configuration: the placed machine.
        reference: the origin of the platform's frame, base frame, m.
        unit: force in N that is 1 in the engine.
        preloaded: whether its springs carry their preloads; without them it is at rest unloaded.
        struts: whether the parts between two spherical joints are one bar, without bodies of its own.

    Raises:
        InputError: if the machine has a part that cannot be built.
    """
    model = Multibody(unit, preloaded)
    platform = _add_body(model, array(reference), configuration.plane)
    for leg in configuration.legs:
        chain = pieces(leg, configuration.plane, struts)
        model.chains.append(_add_leg(model, chain, platform, configuration.plane))
    return model, platform


def _add_body(model: Multibody, at: Array, plane: Plane | None) -> EngineBody:
    """Add a body; in a planar machine it is constrained to the plane."""
    body = model.add_body(at)
    if plane is not None:
        frame = array(plane.frame.translation), columns(plane.frame.rotation)
        model.couple((model.ground, body), frame, PLANAR_JOINT)
    return body


def _add_leg(model: Multibody, chain: Sequence[Piece], platform: EngineBody, plane: Plane | None) -> list[EngineBody]:
    """Add the connectors of one leg and the bodies between them; return its bodies from ground to platform."""
    bodies = [model.ground]
    for piece in chain[:-1]:
        bodies.append(_add_body(model, _far_point(piece, bodies[-1].origin), plane))
    bodies.append(platform)
    if not chain:
        model.couple(bodies, (platform.origin, np.eye(3)), ALL)
    for piece, near, far in zip(chain, bodies, bodies[1:], strict=False):
        _connect(model, piece, (near, far), plane)
    return bodies


def _far_point(piece: Piece, before: Array) -> Array:
    """Return a point of the body after a piece (m); a frame near its joints loses fewer digits to cancellation."""
    if isinstance(piece, Joint | Spring):
        point = joint_of(piece).point
        return before if point is None else array(point)
    return array(piece.far if isinstance(piece, Parallelogram) else piece.end)


def _connect(model: Multibody, piece: Piece, bodies: Sequence[EngineBody], plane: Plane | None) -> None:
    if isinstance(piece, Joint):
        _add_joint(model, piece, bodies, plane)
    elif isinstance(piece, Spring):
        _add_joint(model, piece.joint, bodies, plane, (float(piece.stiffness), float(piece.preload)))
    elif isinstance(piece, Beam):
        _add_beam(model, piece, bodies, plane)
    elif isinstance(piece, StrutPiece):
        model.add_bar(bodies, (array(piece.start), array(piece.end)), piece.stiffness, piece.preload)
    else:
        _add_parallelogram(model, piece, bodies, plane)


def _add_joint(
    model: Multibody,
    joint: Joint,
    bodies: Sequence[EngineBody],
    plane: Plane | None,
    spring: tuple[float, float] | None = None,
) -> None:
    """Constrain all components but one; on that one a spring may act, of a stiffness (N/m, N·m/rad) and preload."""
    normal = None if plane is None else array(plane.frame.rotation.z)
    axes = _axes_around(array(joint.axis), normal)
    slides = joint.point is None
    point = bodies[0].origin if joint.point is None else array(joint.point)
    free = Z_AXIS + 3 if slides else Z_AXIS  # the third axis is that of the joint
    constrained = [i != free for i in range(6)]
    if plane is not None:  # the bodies are kept in the plane already; the first axis is its normal, or the third one is
        constrained = [i in ((0, 4) if slides else (3, 4)) for i in range(6)]
    if joint.pitch != 0.0:
        constrained[Z_AXIS + 3] = False
        model.add_thread(bodies, (point, axes[:, 2]), float(joint.pitch))
    matrix, preload = np.zeros((6, 6)), np.zeros(6)
    if spring is not None:
        matrix[free, free], preload[free] = spring
    model.couple(bodies, (point, axes), constrained, None if spring is None else matrix, preload)


def _axes_around(axis: Array, normal: Array | None = None) -> Array:
    """Return right-handed axes, the third along `axis`, the first along `normal` if that is across it."""
    if normal is None or abs(float(normal @ axis)) > 0.5:  # it is 0 or 1 but for round-off
        normal = np.eye(3)[np.argmin(abs(axis))]
    x = normal - (normal @ axis) * axis
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _add_beam(model: Multibody, beam: Beam, bodies: Sequence[EngineBody], plane: Plane | None) -> None:
    """Couple bodies by the cantilever's 6x6 stiffness at the beam's end; rigid components are constrained."""
    compliance = end_compliance(beam)
    moving = ALL if plane is None else in_plane(beam, plane.frame.rotation.z)
    if not any(moving):
        raise InputError(
            f'An axis of the cross-section of "{beam.name}" must lie in the plane of the planar machine; change its '
            "`up`."
        )
    flexible = [i for i in range(6) if moving[i] and compliance[i, i] > 0.0]
    constrained = [moving[i] and i not in flexible for i in range(6)]
    matrix = np.zeros((6, 6))
    if flexible:
        matrix[np.ix_(flexible, flexible)] = np.linalg.inv(compliance[np.ix_(flexible, flexible)])
    model.couple(bodies, (array(beam.end), section_axes(beam)[0]), constrained, matrix if flexible else None)


def _add_parallelogram(
    model: Multibody, piece: Parallelogram, bodies: Sequence[EngineBody], plane: Plane | None
) -> None:
    """Add two bars between points of the bodies, which also stay in the parallelogram's plane and parallel to it."""
    normal = np.cross(array(piece.side), array(piece.far) - array(piece.near))
    if plane is None:
        axes = _axes_around(normal / np.linalg.norm(normal))
        model.couple(bodies, (array(piece.far), axes), PLANAR_JOINT)
    for near, far in piece.bars:
        model.add_bar(bodies, (array(near), array(far)), float(piece.bar))


def frequencies(machine: Machine) -> Array:
    """Return the natural frequencies of the unloaded machine at its pose, ascending, Hz; none without a mass.

    Args:
        machine: the machine at a pose that it reaches, where nothing is free.

    Raises:
        InputError: if the machine has a part that cannot be built.
    """
    state = state_of(machine)
    drawn, struts = machine_from_file(machine, state.free, state.joints), not has_rotors(machine)
    model, _ = build(drawn.configuration, drawn.reference)
    model.system.Assemble()
    unit = float(np.max(np.abs(model.system.ComputeLinearizedSystem(settings_of(model))[1])))
    model, platform = build(drawn.configuration, drawn.reference, unit, struts=struts)
    add_masses(model, platform, machine, drawn)
    model.system.Assemble()
    return modal_frequencies(model)


def add_masses(model: Multibody, platform: EngineBody, machine: Machine, drawn: MachineFromFile) -> None:
    """Add the masses of platform, payload and links to the bodies of a machine.

    Args:
        model, platform: as `build` returns them.
        machine: the machine with the masses of its platform, payload and rotors.
        drawn: its legs and links at the pose.
    """
    for part in on_platform(machine, drawn.configuration.platform):
        model.add_mass(platform, part.mass, part.centre, part.inertia)
    if has_rotors(machine):
        add_rotors(model, machine, drawn.configuration)
    for link in links(drawn.members, drawn.configuration, struts=not has_rotors(machine)):
        carriers = [model.chains[link.leg][number] for number in link.bodies]
        if len(carriers) == 1:
            model.add_mass(carriers[0], link.mass, link.points[0], link.inertia)
        elif any(body.node is not None for body in carriers):
            model.add_rod(carriers, link.points, link.mass)


def add_rotors(model: Multibody, machine: Machine, configuration: Configuration) -> None:
    """Add the rotors of actuators, which move as the springs of the actuators deflect.

    Args:
        model: the unloaded model without struts, so that each spring of an actuator has two bodies.
        machine: the machine with its drives.
        configuration: the placed machine.
    """
    for leg, bodies in zip(configuration.legs, model.chains, strict=True):
        for piece, near, far in zip(pieces(leg, configuration.plane, struts=False), bodies, bodies[1:], strict=False):
            if isinstance(piece, Spring) and piece.actuated:
                model.add_rotor((near, far), piece.joint, rotor_inertia(machine, piece))


def modal_frequencies(model: Multibody) -> Array:
    """Return the frequencies (Hz) of the engine's linearised equations about where its system is, ascending.

    Motions that have no stiffness are idle, of frequency 0, and the others have no momentum with them; motions without
    mass have no frequency. So K is made a unit matrix by its eigenvectors without the idle ones, each with as much idle
    motion as takes its momentum away, and the eigenvalues of M in these coordinates are 1/omega².
    """
    mass, stiffness, *_ = model.system.ComputeLinearizedSystem(settings_of(model), projectIntoConstraintNullspace=True)
    sizes, shapes = np.linalg.eigh(0.5 * (stiffness + np.transpose(stiffness)))
    is_stiff = sizes > IDLE_MOTION * np.max(sizes)
    motions, idle = shapes[:, is_stiff] / np.sqrt(sizes[is_stiff]), shapes[:, ~is_stiff]
    masses, axes = np.linalg.eigh(idle.T @ mass @ idle)
    has_mass = masses > MASSLESS_MODE * np.trace(mass)  # of the others round-off would decide
    idle, masses = idle @ axes[:, has_mass], masses[has_mass]
    motions -= idle @ (idle.T @ mass @ motions / masses[:, None])
    squares = np.linalg.eigvalsh(motions.T @ np.asarray(mass) @ motions)[::-1]
    round_off = NO_MOMENTUM * np.trace(mass) * np.sum(motions**2)
    squares = squares[squares > max(MASSLESS_MODE * np.max(squares, initial=0.0), round_off)]
    return np.asarray(1.0 / (2.0 * np.pi * np.sqrt(squares)))

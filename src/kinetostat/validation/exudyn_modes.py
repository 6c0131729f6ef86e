"""The natural frequencies of a machine by Exudyn: its bodies and springs, with masses of platform, payload and links.

Links are rods between two bodies, with the kinetic energy of all their points; bodies themselves have no mass. How the
machine is built is `exudyn_machine`'s business; here masses are added and the engine's linearised equations are solved.
"""

import numpy as np

from kinetostat.arrays import Array
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.tolerances import IDLE_MOTION, MASSLESS_MODE
from kinetostat.validation.as_written import Drawing, drawing
from kinetostat.validation.exudyn_bodies import Body, Multibody
from kinetostat.validation.exudyn_machine import build, settings_of
from kinetostat.validation.masses import has_rotors, links, on_platform, rotor_inertia
from kinetostat.validation.pieces import array, pieces


def frequencies(machine: Machine) -> Array:
    """Return the natural frequencies of the unloaded machine at its pose, ascending, Hz; none without a mass.

    Args:
        machine: at a pose that it reaches, where nothing is free.

    Raises:
        InputError: if the machine has a part that cannot be built.
    """
    joints = solve_joints(machine) if machine.family.chains else None
    response = respond(machine, joints)
    drawn, struts = drawing(machine, response, joints), not has_rotors(machine)
    model, _ = build(drawn.configuration, drawn.reference)
    model.system.Assemble()
    unit = float(np.max(np.abs(model.system.ComputeLinearizedSystem(settings_of(model))[1])))
    model, platform = build(drawn.configuration, drawn.reference, unit, struts=struts)
    weigh(model, platform, machine, drawn)
    model.system.Assemble()
    return modal_frequencies(model)


def weigh(model: Multibody, platform: Body, machine: Machine, drawn: Drawing) -> None:
    """Add the masses of platform, payload and links to the bodies of a machine.

    Args:
        model, platform: as `exudyn_machine.build` returns them.
        machine: says what its platform, payload and rotors weigh.
        drawn: its legs and links at the pose.
    """
    for part in on_platform(machine, drawn.configuration.platform):
        model.weigh(platform, part.mass, part.centre, part.inertia)
    if has_rotors(machine):
        turn_rotors(model, machine, drawn.configuration)
    for link in links(drawn.members, drawn.configuration, struts=not has_rotors(machine)):
        carriers = [model.chains[link.leg][number] for number in link.bodies]
        if len(carriers) == 1:
            model.weigh(carriers[0], link.mass, link.points[0], link.inertia)
        elif any(body.node is not None for body in carriers):
            model.rod(carriers, link.points, link.mass)


def turn_rotors(model: Multibody, machine: Machine, configuration: Configuration) -> None:
    """Add the rotors of actuators, which move as the springs of the actuators deflect.

    Args:
        model: unloaded, without struts, so that each spring of an actuator has two bodies.
        machine: says how rotors are driven.
        configuration: of it.
    """
    for leg, bodies in zip(configuration.legs, model.chains, strict=True):
        for piece, near, far in zip(pieces(leg, configuration.plane, struts=False), bodies, bodies[1:], strict=False):
            if isinstance(piece, Spring) and piece.actuated:
                point, axis = piece.joint.point, array(piece.joint.axis)
                line = None if point is None else array(point), axis
                model.rotor((near, far), line, rotor_inertia(machine, slides=point is None))


def modal_frequencies(model: Multibody) -> Array:
    """Frequencies (Hz) of the engine's linearised equations about where its system is, ascending.

    Motions that have no stiffness are idle here, and motions without mass have no frequency. So K is made a unit
    matrix by its eigenvectors without the idle ones, and the eigenvalues of M in these coordinates are 1/omega².
    """
    mass, stiffness, *_ = model.system.ComputeLinearizedSystem(settings_of(model), projectIntoConstraintNullspace=True)
    sizes, shapes = np.linalg.eigh(0.5 * (stiffness + np.transpose(stiffness)))
    stiff = sizes > IDLE_MOTION * np.max(sizes)
    softened = shapes[:, stiff] / np.sqrt(sizes[stiff])
    periods = np.linalg.eigvalsh(softened.T @ np.asarray(mass) @ softened)[::-1]
    felt = periods[periods > MASSLESS_MODE * np.max(periods, initial=0.0)]
    return np.asarray(1.0 / (2.0 * np.pi * np.sqrt(felt)))
